#include "client/formats/survey/ptx_reader.h"

#include <cstddef>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_replace.h"
#include "absl/strings/string_view.h"
#include <Eigen/Geometry>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "client/formats/scan_list.h"
#include "client/formats/scan_reader.h"
#include "tests/client/formats/hostile_files.h"
#include "tests/fuzz/input_file.h"
#include "tests/support/data_dir.h"
#include "tests/support/status_matchers.h"
#include "tests/support/temp_dir.h"

namespace strata {
namespace {

using ::strata::testing::StatusIs;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

// Turned to the left by 90° and moved: x' = −y + 1000.5, y' = x − 20, z' = z + 3.
constexpr char kTurned[] =
    "2\n3\n1000.5 -20 3\n0 1 0\n-1 0 0\n0 0 1\n"
    "0 1 0 0\n-1 0 0 0\n0 0 1 0\n1000.5 -20 3 1\n"
    "1 2 3 0.5 10 20 30\n0 0 0 0.5 0 0 0\n-1 4 2 0.25 255 0 1\n"
    "0 0 0 0.5\n\n5 5 5 1 7 8 9\r\n0 0 0 0.5\n";
constexpr char kStraight[] =
    "1\n2\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n1 0 0 0\n0 1 0 0\n0 0 1 0\n0 0 0 1\n"
    "7 8 9 0.125\n1 1 1 0\n";

class PtxReaderTest : public ::testing::Test {
 protected:
  std::filesystem::path Write(absl::string_view text, const std::string& name = "a.ptx") {
    std::ofstream(dir_.path() / name, std::ios::binary | std::ios::trunc) << text;
    return dir_.path() / name;
  }
  testing::TempDir dir_;
};

TEST_F(PtxReaderTest, EachScanHasItsPointsAndItsPose) {
  const auto file = Write(absl::StrCat(kTurned, kStraight));
  STRATA_ASSERT_OK_AND_ASSIGN(const auto stations, ListPtxStations(file));
  ASSERT_EQ(stations.size(), 2U);
  EXPECT_TRUE((stations[0].T_file_scan * Eigen::Vector3d(1, 2, 3))
                  .isApprox(Eigen::Vector3d(998.5, -19, 6)));
  EXPECT_TRUE(stations[1].T_file_scan.isApprox(Pose::Identity()));
  STRATA_ASSERT_OK_AND_ASSIGN(const PointCloud second, stations[1].read());
  EXPECT_THAT(second.points, ElementsAre(Eigen::Vector3f(7, 8, 9), Eigen::Vector3f(1, 1, 1)));
  EXPECT_THAT(second.intensity, ElementsAre(0.125, 0));
  EXPECT_TRUE(second.colour.empty());
}

TEST_F(PtxReaderTest, AnImportTakesEachScanOfEachFileWithoutItsMissingReturns) {
  Write(absl::StrCat(kTurned, kStraight), "b7.ptx");
  Write(kStraight, "a9.ptx");
  STRATA_ASSERT_OK_AND_ASSIGN(const auto scans, ListScans({dir_.path()}, {}));
  ASSERT_EQ(scans.size(), 3U);
  std::vector<std::string> names;
  for (std::size_t i = 0; i < 3; ++i) {
    EXPECT_EQ(scans[i].sequence, i);
    names.push_back(scans[i].path.filename().string());
  }
  EXPECT_THAT(names, ElementsAre("b7.ptx:0", "b7.ptx:1", "a9.ptx"));
  std::size_t at_sensor = 0;
  STRATA_ASSERT_OK_AND_ASSIGN(const PointCloud cloud, ReadScanFile(scans[0], &at_sensor));
  EXPECT_EQ(at_sensor, 3U);
  EXPECT_THAT(
      cloud.points,
      ElementsAre(Eigen::Vector3f(1, 2, 3), Eigen::Vector3f(-1, 4, 2), Eigen::Vector3f(5, 5, 5)));
  EXPECT_THAT(cloud.colour, ElementsAre(Colour{10, 20, 30}, Colour{255, 0, 1}, Colour{7, 8, 9}));
  EXPECT_EQ(scans[0].T_map_scan.translation(), Eigen::Vector3d(1000.5, -20, 3));
  STRATA_ASSERT_OK_AND_ASSIGN(const auto nowhere, ListScans({dir_.path()}, {.poses = kNoPoses}));
  EXPECT_TRUE(nowhere[0].T_map_scan.isApprox(Pose::Identity()));
}

TEST_F(PtxReaderTest, OneScanIsReadByItself) {
  STRATA_ASSERT_OK_AND_ASSIGN(const PointCloud cloud, ReadScan(Write(kTurned)));
  EXPECT_EQ(cloud.size(), 3U);
  EXPECT_THAT(ReadScan(Write(absl::StrCat(kTurned, kStraight))),
              StatusIs(absl::StatusCode::kInvalidArgument, HasSubstr("holds 2 scans")));
  EXPECT_THAT(ReadScan(dir_.path() / "none.ptx"),
              StatusIs(absl::StatusCode::kNotFound, HasSubstr("no such file")));
  Write("1 0 0 0 0 0 0 1\n", "poses.txt");
  EXPECT_THAT(ListScans({dir_.path() / "a.ptx"}, {.poses = dir_.path() / "poses.txt"}),
              StatusIs(absl::StatusCode::kInvalidArgument, HasSubstr("leave out --poses")));
}

TEST_F(PtxReaderTest, AFileThatCannotBeReadLeavesTheOthers) {
  Write("2\n3\n", "a1.ptx");
  Write(kStraight, "a2.ptx");
  STRATA_ASSERT_OK_AND_ASSIGN(const auto scans, ListScans({dir_.path()}, {}));
  ASSERT_EQ(scans.size(), 2U);
  EXPECT_THAT(scans[0].pose_status,
              StatusIs(absl::StatusCode::kInvalidArgument, HasSubstr("a1.ptx: line 2: expected")));
  STRATA_EXPECT_OK(ReadScanFile(scans[1]));
}

TEST_F(PtxReaderTest, ErrorsNameTheLineAndWhatWasExpected) {
  const auto expect = [this](const std::string& text, const std::string& message) {
    EXPECT_THAT(ReadScan(Write(text)),
                StatusIs(absl::StatusCode::kInvalidArgument, HasSubstr(message)));
  };
  const std::string good = kStraight;
  const auto with = [&good](absl::string_view old, absl::string_view put) {
    return absl::StrReplaceAll(good, {{old, put}});
  };
  expect("", "expected the number of columns");
  expect("x\n", "line 1: expected the number of columns, found 'x'");
  expect("99999999999\n1\n", "line 1: expected the number of columns");
  expect("1\n2\n0 0\n", "line 3: expected where the scanner stood (3 numbers)");
  expect(good.substr(0, good.size() - 8), "line 11: expected 2 points, found 1");
  expect(with("1 0 0 0\n", "2 0 0 0\n"), "line 10: the transformation is no rotation");
  expect(with("1 0 0 0\n", "-1 0 0 0\n"), "line 10: the transformation is no rotation");
  expect(with("0 0 0 1\n7", "0 0 nan 1\n7"), "line 10: the transformation is no rotation");
  expect(with("7 8 9", "7 8 b"), "line 11: expected the 4 numbers of a point");
  expect(with("1 1 1 0\n", "1 1 1 0 1 2 3\n"), "line 12: expected the 4 numbers");
  expect(with("7 8 9 0.125", std::string(5000, '7')), "line 11: longer than");
  expect("0\n2\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n1 0 0 0\n0 1 0 0\n0 0 1 0\n0 0 0 1\n",
         "a scan of 0 points");
}

TEST_F(PtxReaderTest, DamageIsAStatus) {
  testing::ExpectSoundOnDamage(
      absl::StrCat(kTurned, kStraight),
      [](absl::string_view bytes) -> absl::StatusOr<PointCloud> {
        const fuzz::InputFile file(bytes);  // no disk: damage is tried thousands of times
        auto stations = ListPtxStations(file.path());
        if (!stations.ok()) return stations.status();
        absl::StatusOr<PointCloud> cloud = stations->front().read();
        for (const Station& station : *stations) cloud = station.read();
        return cloud;
      },
      1);
}

TEST_F(PtxReaderTest, ARecordedFileGivesItsPoints) {
  STRATA_REQUIRE_DATA(path, "importer_samples");
  STRATA_ASSERT_OK_AND_ASSIGN(const PointCloud cloud, ReadScan(path / "pdal_1.2-with-color.ptx"));
  ASSERT_EQ(cloud.size(), 1'065U);
  EXPECT_EQ(cloud.colour.size(), 1'065U);
  EXPECT_THAT(cloud.colour[0], (Colour{68, 77, 88}));
  EXPECT_FLOAT_EQ(cloud.intensity[0], 0.034912F);
  const Eigen::Vector3d first = cloud.origin + cloud.points[0].cast<double>();
  EXPECT_LT((first - Eigen::Vector3d(637012.24, 849028.31, 431.66)).norm(), 1e-3);
}

}  // namespace
}  // namespace strata
