#include "client/formats/scan_list.h"

#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "client/formats/file_bytes.h"
#include "tests/support/data_dir.h"
#include "tests/support/status_matchers.h"
#include "tests/support/temp_dir.h"

namespace strata {
namespace {

using ::strata::testing::StatusIs;
using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

class ScanListTest : public ::testing::Test {
 protected:
  std::filesystem::path Write(const std::string& name, const std::string& text = "1 2 3\n") {
    std::filesystem::create_directories((dir_.path() / name).parent_path());
    STRATA_EXPECT_OK(WriteFileBytes(dir_.path() / name, text));
    return dir_.path() / name;
  }
  // A PCD file of one point, whose sensor stood there.
  static std::string Pcd(const std::string& sensor) {
    return "VERSION .7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nWIDTH 1\nHEIGHT 1\nVIEWPOINT " +
           sensor + " 1 0 0 0\nPOINTS 1\nDATA ascii\n1 2 3\n";
  }
  static std::vector<std::string> Names(const std::vector<ScanFile>& scans) {
    std::vector<std::string> names;
    for (const ScanFile& scan : scans) names.push_back(scan.path.filename().string());
    return names;
  }
  static std::vector<std::uint64_t> Sequences(const std::vector<ScanFile>& scans) {
    std::vector<std::uint64_t> sequences;
    for (const ScanFile& scan : scans) sequences.push_back(scan.sequence);
    return sequences;
  }
  testing::TempDir dir_;
};

TEST(SequenceOfNameTest, LastRunOfDigitsOfTheStem) {
  EXPECT_EQ(SequenceOfName("a/run7/scan012.pcd"), 12U);
  EXPECT_EQ(SequenceOfName("scan3_v2.3d"), 2U);
  EXPECT_EQ(SequenceOfName("scan.3d"), std::nullopt);
  EXPECT_EQ(SequenceOfName("99999999999999999999.bin"), std::nullopt);
}

TEST_F(ScanListTest, FoldersGiveTheirScansByNumber) {
  for (const char* name : {"s10.xyz", "s2.xyz", "s1.pcd", "README.txt", "poses.txt", "x.pose"}) {
    Write(name);
  }
  STRATA_ASSERT_OK_AND_ASSIGN(const auto all, ListScans({dir_.path()}, {.poses = kNoPoses}));
  EXPECT_THAT(Names(all), ElementsAre("s1.pcd", "s2.xyz", "s10.xyz"));
  EXPECT_THAT(Sequences(all), ElementsAre(1, 2, 10));
  EXPECT_TRUE(all[0].pose_status.ok());
  STRATA_ASSERT_OK_AND_ASSIGN(
      const auto xyz, ListScans({dir_.path()}, {.format = ScanFormat::kPcd, .poses = kNoPoses}));
  EXPECT_THAT(Names(xyz), ElementsAre("s1.pcd"));
}

TEST_F(ScanListTest, NamesWithoutOwnNumbersAreCounted) {
  const auto b = Write("b.xyz");
  const auto a10 = Write("a10.xyz");
  const auto a9 = Write("a9.xyz");
  STRATA_ASSERT_OK_AND_ASSIGN(const auto scans, ListScans({b, a10, a9, b}, {.poses = kNoPoses}));
  EXPECT_THAT(Names(scans), ElementsAre("a9.xyz", "a10.xyz", "b.xyz"));
  EXPECT_THAT(Sequences(scans), ElementsAre(0, 1, 2));
}

// The digits behind a time's point are no number of a scan.
TEST_F(ScanListTest, NamesThatAreTimesAreInTheirOrder) {
  for (const char* name : {"1000.9.xyz", "1001.25.xyz", "1001.3.xyz", "1002.100000.xyz"}) {
    Write(name);
  }
  STRATA_ASSERT_OK_AND_ASSIGN(const auto scans, ListScans({dir_.path()}, {.poses = kNoPoses}));
  EXPECT_THAT(Names(scans),
              ElementsAre("1000.9.xyz", "1001.25.xyz", "1001.3.xyz", "1002.100000.xyz"));
  EXPECT_THAT(Sequences(scans), ElementsAre(0, 1, 2, 3));
}

TEST_F(ScanListTest, IndexedPosesGoToTheirScansAndTheRestIsAnError) {
  const auto poses = Write("poses", "7 1.5 70 0 0 0 0 0 1\n5 1.25 50 0 0 0 0 0 1\n");
  Write("s005.xyz");
  Write("s006.xyz");
  Write("s007.xyz");
  STRATA_ASSERT_OK_AND_ASSIGN(const auto scans, ListScans({dir_.path()}, {.poses = poses}));
  ASSERT_EQ(scans.size(), 3U);
  EXPECT_EQ(scans[0].T_map_scan.translation().x(), 50);
  EXPECT_EQ(scans[0].time, absl::FromUnixMillis(1250));
  EXPECT_THAT(scans[1].pose_status, StatusIs(absl::StatusCode::kNotFound, HasSubstr("index 6")));
  EXPECT_EQ(scans[2].T_map_scan.translation().x(), 70);
}

TEST_F(ScanListTest, TumPosesGoInOrderOfTime) {
  const auto poses = Write("poses", "2 20 0 0 0 0 0 1\n1 10 0 0 0 0 0 1\n");
  Write("a.xyz");
  Write("b.xyz");
  Write("c.xyz");
  STRATA_ASSERT_OK_AND_ASSIGN(const auto scans, ListScans({dir_.path()}, {.poses = poses}));
  EXPECT_EQ(scans[0].T_map_scan.translation().x(), 10);
  EXPECT_EQ(scans[1].T_map_scan.translation().x(), 20);
  EXPECT_THAT(scans[2].pose_status, StatusIs(absl::StatusCode::kNotFound, HasSubstr("scan 3")));
}

TEST_F(ScanListTest, TumPosesGoByTimeWhereNamesAreTimes) {
  const auto poses =
      Write("poses", "1305031102.1753 10 0 0 0 0 0 1\n1305031103.2 20 0 0 0 0 0 1\n");
  Write("1305031103.200100.xyz");
  Write("1305031109.500000.xyz");
  STRATA_ASSERT_OK_AND_ASSIGN(const auto scans, ListScans({dir_.path()}, {.poses = poses}));
  ASSERT_EQ(scans.size(), 2U);
  EXPECT_EQ(scans[0].path.filename(), "1305031103.200100.xyz");
  EXPECT_EQ(scans[0].T_map_scan.translation().x(), 20);
  EXPECT_EQ(scans[0].time, absl::FromUnixMicros(1305031103200100));
  EXPECT_THAT(scans[1].pose_status,
              StatusIs(absl::StatusCode::kNotFound, HasSubstr("1305031109.5")));
}

// Their last digits were taken for the scans' numbers: poses went to others.
TEST_F(ScanListTest, NamesMayEndWithTimes) {
  const auto poses = Write("poses",
                           "1583836591.200000048 10 0 0 0 0 0 1\n"
                           "1583836592.100000000 20 0 0 0 0 0 1\n");
  const std::vector<std::pair<std::string, std::string>> names = {
      {"cloud_1583836591.200000.xyz", "cloud_1583836592.100000.xyz"},
      {"cloud_1583836591_200000048.xyz", "cloud_1583836592_100000000.xyz"},
      {"1583836591_200000.xyz", "1583836592_100000.xyz"},
      {"1583836591200000048.xyz", "1583836592100000000.xyz"},
      {"lidar-1583836591200000.xyz", "lidar-1583836592100000.xyz"},
      {"1583836591200.xyz", "1583836592100.xyz"}};
  for (std::size_t k = 0; k < names.size(); ++k) {
    const std::string folder = "times" + std::to_string(k) + "/";
    Write(folder + names[k].second);
    Write(folder + names[k].first);
    STRATA_ASSERT_OK_AND_ASSIGN(const auto scans,
                                ListScans({dir_.path() / folder}, {.poses = poses}));
    EXPECT_THAT(Names(scans), ElementsAre(names[k].first, names[k].second));
    EXPECT_THAT(Sequences(scans), ElementsAre(0, 1)) << folder;
    EXPECT_EQ(scans[0].T_map_scan.translation().x(), 10) << folder;
    EXPECT_EQ(scans[1].T_map_scan.translation().x(), 20) << folder;
  }
  for (const char* none : {"scan_12", "scan012_345678", "0123456789_123456", "12345678901.5x"}) {
    EXPECT_EQ(TimeOfName(std::string(none) + ".pcd"), std::nullopt) << none;
  }
}

// Nanoseconds without their zeros are no numbers of scans, and no fractions.
TEST_F(ScanListTest, NumbersThatDoNotGrowWithTheDigitsBeforeThemAreNone) {
  for (const char* name : {"a17_90.xyz", "a18_5.xyz", "a19_61.xyz"}) Write(name);
  STRATA_ASSERT_OK_AND_ASSIGN(const auto scans, ListScans({dir_.path()}, {.poses = kNoPoses}));
  EXPECT_THAT(Names(scans), ElementsAre("a17_90.xyz", "a18_5.xyz", "a19_61.xyz"));
  EXPECT_THAT(Sequences(scans), ElementsAre(0, 1, 2));
}

// A camera looks along z and has y down: maps of KITTI's own poses lay on their side.
TEST_F(ScanListTest, PosesOfACameraBecomeThoseOfTheLidar) {
  const auto poses = Write("poses.txt", "1 0 0 0 0 1 0 0 0 0 1 0\n1 0 0 0 0 1 0 0 0 0 1 2\n");
  Write("drive/velodyne/000000.xyz");
  Write("drive/velodyne/000001.xyz");
  std::vector<std::string> told;
  const auto list = [&] {
    ScanListOptions options{.poses = poses};
    options.tell = [&](const std::string& line) { told.push_back(line); };
    return ListScans({dir_.path() / "drive/velodyne"}, options);
  };
  STRATA_ASSERT_OK(list());
  EXPECT_THAT(told, ElementsAre(AllOf(HasSubstr("warning"), HasSubstr("calib.txt"))));
  Write("drive/calib.txt", "P0: 1 2 3\nTr: 0 -1 0 0.1 0 0 -1 0.2 1 0 0 0.3\n");
  told.clear();
  STRATA_ASSERT_OK_AND_ASSIGN(const auto scans, list());
  EXPECT_THAT(told, ElementsAre(HasSubstr("taken to the lidar")));
  EXPECT_TRUE(scans[0].T_map_scan.isApprox(Pose::Identity(), 1e-9));
  EXPECT_TRUE(scans[1].T_map_scan.isApprox(Pose(Eigen::Translation3d(2, 0, 0)), 1e-9));
  Write("drive/calib.txt", "Tr: 0 -1 0 0.1\n");
  EXPECT_THAT(list(),
              StatusIs(absl::StatusCode::kInvalidArgument,
                       AllOf(HasSubstr("calib.txt"), HasSubstr("12 numbers"))));
}

// What KITTI published and what was converted of it by hand.
TEST_F(ScanListTest, RecordedPosesOfACameraBecomeThoseOfTheLidar) {
  STRATA_REQUIRE_DATA(folder, "kitti00_gt");
  STRATA_ASSERT_OK_AND_ASSIGN(
      const auto of_camera,
      ListScans({folder / "velodyne"}, {.poses = folder / "poses_00_cam0.txt"}));
  STRATA_ASSERT_OK_AND_ASSIGN(
      const auto of_lidar,
      ListScans({folder / "velodyne"}, {.poses = folder / "poses_00_velo.txt"}));
  ASSERT_EQ(of_camera.size(), of_lidar.size());
  for (std::size_t k = 0; k < of_camera.size(); ++k) {
    STRATA_ASSERT_OK(of_camera[k].pose_status);
    const Pose off = of_lidar[k].T_map_scan.inverse() * of_camera[k].T_map_scan;
    EXPECT_LT(off.translation().norm(), 0.002) << k;
    EXPECT_LT(RotationAngleRad(off), 1e-4) << k;
  }
}

TEST_F(ScanListTest, PosesBeside3dtkScansAreTakenByThemselves) {
  Write("scan000.3d");
  Write("scan000.pose", "100 0 0 0 0 0\n");
  Write("scan001.3d");
  STRATA_ASSERT_OK_AND_ASSIGN(const auto scans, ListScans({dir_.path()}, {}));
  EXPECT_NEAR(scans[0].T_map_scan.translation().y(), -1.0, 1e-12);
  EXPECT_THAT(scans[1].pose_status,
              StatusIs(absl::StatusCode::kNotFound, HasSubstr("scan001.pose")));
}

TEST_F(ScanListTest, WhatIsNotThereIsNotFound) {
  EXPECT_THAT(ListScans({dir_.path()}, {}),
              StatusIs(absl::StatusCode::kNotFound, HasSubstr("no scan")));
  EXPECT_THAT(ListScans({dir_.path() / "x"}, {}),
              StatusIs(absl::StatusCode::kNotFound, HasSubstr("no such file or folder")));
  EXPECT_THAT(ListScans({Write("a.xyz")}, {.poses = "none.txt"}),
              StatusIs(absl::StatusCode::kNotFound, HasSubstr("none.txt")));
}

TEST_F(ScanListTest, MoreTumPosesThanScansAreAWarning) {
  Write("a.xyz");
  const auto poses = Write("poses", "1 10 0 0 0 0 0 1\n2 20 0 0 0 0 0 1\n");
  std::string warning;
  const auto tell = [&warning](const std::string& text) { warning += text; };
  STRATA_ASSERT_OK_AND_ASSIGN(const auto scans,
                              ListScans({dir_.path()}, {.poses = poses, .tell = tell}));
  EXPECT_EQ(scans.at(0).T_map_scan.translation().x(), 10);
  EXPECT_THAT(warning, HasSubstr("2 poses for 1 scans"));
  warning.clear();
  Write("b.xyz");
  STRATA_EXPECT_OK(ListScans({dir_.path()}, {.poses = poses, .tell = tell}));
  EXPECT_EQ(warning, "");
}

TEST_F(ScanListTest, AFolderOf3dtkPosesMayBeNamed) {
  Write("s000.3d", "100 100 100\n");
  std::filesystem::create_directory(dir_.path() / "poses");
  Write("poses/s000.pose", "100 0 0\n0 0 0\n");
  for (const PoseFormat format : {PoseFormat::kAuto, PoseFormat::k3dtk}) {
    STRATA_ASSERT_OK_AND_ASSIGN(
        const auto scans,
        ListScans({dir_.path()}, {.poses = dir_.path() / "poses", .pose_format = format}));
    STRATA_ASSERT_OK(scans.at(0).pose_status);
    EXPECT_NEAR(scans[0].T_map_scan.translation().y(), -1.0, 1e-12);
  }
  EXPECT_THAT(
      ListScans({dir_.path()}, {.poses = dir_.path(), .pose_format = PoseFormat::kTum}).status(),
      StatusIs(absl::StatusCode::kInvalidArgument, HasSubstr("not a file")));
}

TEST_F(ScanListTest, SeveralScansOfNoPlaceAreAnErrorThatNamesTheCure) {
  Write("set/scans/a1.pcd", Pcd("0 0 0"));
  STRATA_EXPECT_OK(ListScans({dir_.path() / "set"}, {}));
  Write("set/scans/a2.pcd", Pcd("0 0 0"));
  const auto refused = [](const std::vector<std::filesystem::path>& paths) {
    const absl::Status status = ListScans(paths, {}).status();
    EXPECT_EQ(status.code(), absl::StatusCode::kInvalidArgument);
    return std::string(status.message());
  };
  const std::filesystem::path scans = dir_.path() / "set" / "scans";
  EXPECT_THAT(refused({scans}),
              AllOf(HasSubstr("2 scans and no poses"),
                    HasSubstr("--poses FILE, or"),
                    HasSubstr("--poses none")));
  STRATA_ASSERT_OK_AND_ASSIGN(const auto insisted, ListScans({scans}, {.poses = kNoPoses}));
  EXPECT_EQ(insisted.size(), 2U);
  // Poses that lie about are named, and only those of a folder that is named are taken.
  const auto poses =
      Write("set/poses_odometry.txt", "1 1.5 70 0 0 0 0 0 1\n2 2.5 71 0 0 0 0 0 1\n");
  EXPECT_THAT(refused({scans}), HasSubstr("(there is " + poses.string() + ")"));
  EXPECT_THAT(refused({scans / "a1.pcd", scans / "a2.pcd"}), HasSubstr(poses.string()));
}

TEST_F(ScanListTest, PcdFilesThatSayWhereTheSensorStoodNeedNoPoses) {
  Write("a1.pcd", Pcd("0 0 0"));
  Write("a2.pcd", Pcd("0 4 0"));
  STRATA_ASSERT_OK_AND_ASSIGN(const auto scans, ListScans({dir_.path()}, {}));
  EXPECT_TRUE(scans.at(1).T_map_scan.isApprox(Pose::Identity()));
}

TEST_F(ScanListTest, AFolderOfADataSetIsUnderstood) {
  Write("set/README.txt");
  Write("set/scans/a1.xyz");
  Write("set/scans/a2.xyz");
  const auto poses = Write("set/poses.tum", "1 10 0 0 0 0 0 1\n2 20 0 0 0 0 0 1\n");
  std::string told;
  const auto tell = [&told](const std::string& text) { told += text; };
  STRATA_ASSERT_OK_AND_ASSIGN(const auto scans, ListScans({dir_.path() / "set"}, {.tell = tell}));
  ASSERT_EQ(scans.size(), 2U);
  EXPECT_EQ(scans[1].T_map_scan.translation().x(), 20);
  EXPECT_EQ(told, "poses of " + poses.string());
  // Scans beside the poses are a data set, too.
  Write("flat/a1.xyz");
  Write("flat/a2.xyz");
  Write("flat/poses.csv", "1,30,0,0,0,0,0,1\n2,40,0,0,0,0,0,1\n");
  STRATA_ASSERT_OK_AND_ASSIGN(const auto flat, ListScans({dir_.path() / "flat"}, {}));
  ASSERT_EQ(flat.size(), 2U);
  EXPECT_EQ(flat[0].T_map_scan.translation().x(), 30);
}

TEST_F(ScanListTest, SeveralPoseFilesOrFoldersAreNamed) {
  Write("set/velodyne/a1.xyz");
  Write("set/velodyne/a2.xyz");
  Write("set/empty/notes.md");
  const auto b = Write("set/poses_b.txt", "1 1 0 0 0 0 0 0 1\n2 2 0 0 0 0 0 0 1\n");
  const auto a = Write("set/poses_a.txt", "1 1 5 0 0 0 0 0 1\n2 2 6 0 0 0 0 0 1\n");
  const std::filesystem::path set = dir_.path() / "set";
  EXPECT_THAT(
      ListScans({set}, {}),
      StatusIs(absl::StatusCode::kInvalidArgument,
               AllOf(HasSubstr(a.string() + ", " + b.string()), HasSubstr("--poses FILE"))));
  STRATA_ASSERT_OK_AND_ASSIGN(const auto chosen, ListScans({set}, {.poses = a}));
  EXPECT_EQ(chosen.at(1).T_map_scan.translation().x(), 6);
  Write("set/other/a1.xyz");
  EXPECT_THAT(ListScans({set}, {.poses = a}),
              StatusIs(absl::StatusCode::kInvalidArgument,
                       AllOf(HasSubstr("set/other, "), HasSubstr("set/velodyne; name one"))));
  Write("set/scans/a1.xyz");
  STRATA_ASSERT_OK_AND_ASSIGN(const auto scans, ListScans({set}, {.poses = a}));
  EXPECT_THAT(Names(scans), ElementsAre("a1.xyz"));
}

TEST_F(ScanListTest, FilesThatAreNotReadSayWhatToDo) {
  for (const auto& [name, cure] :
       std::vector<std::pair<std::string, std::string>>{{"a.ot", "octree2pointcloud"},
                                                        {"a.mcap", "strata scan topics"},
                                                        {"a.rawlog", "the sensor's own program"},
                                                        {"a.bt", "octree2pointcloud"},
                                                        {"a.bin.gz", "unpack it first"}}) {
    const auto file = Write("files/" + name);
    EXPECT_THAT(
        ListScans({file}, {}),
        StatusIs(absl::StatusCode::kInvalidArgument, AllOf(HasSubstr(name), HasSubstr(cure))));
    EXPECT_THAT(ReadScan(file), StatusIs(absl::StatusCode::kInvalidArgument, HasSubstr(cure)));
  }
  EXPECT_THAT(ListScans({dir_.path() / "files"}, {}),
              StatusIs(absl::StatusCode::kNotFound, HasSubstr("5 files (.bt .gz")));
  Write("files/b.xyz");
  std::string told;
  const auto tell = [&told](const std::string& text) { told += text; };
  STRATA_EXPECT_OK(ListScans({dir_.path() / "files"}, {.tell = tell}));
  EXPECT_THAT(told, HasSubstr("5 files (.bt .gz .mcap .ot .rawlog) are not read: left out"));
}

TEST_F(ScanListTest, FilesOfASurveyNeedNoPoses) {
  Write("s1.las");
  Write("s2.las");
  STRATA_ASSERT_OK_AND_ASSIGN(const auto scans, ListScans({dir_.path()}, {}));
  EXPECT_THAT(Names(scans), ElementsAre("s1.las", "s2.las"));
  for (const ScanFile& scan : scans) STRATA_EXPECT_OK(scan.pose_status);
}

TEST_F(ScanListTest, ALinkToNothingIsAScanThatCannotBeRead) {
  Write("s0.xyz");
  std::filesystem::create_symlink("/nowhere/s1.xyz", dir_.path() / "s1.xyz");
  STRATA_ASSERT_OK_AND_ASSIGN(const auto scans, ListScans({dir_.path()}, {.poses = kNoPoses}));
  EXPECT_THAT(Names(scans), ElementsAre("s0.xyz", "s1.xyz"));
  EXPECT_THAT(ReadScan(scans[1].path).status(),
              StatusIs(absl::StatusCode::kNotFound, HasSubstr("no such file")));
}

TEST_F(ScanListTest, AFolderOfTextFilesIsToldHowToBeRead) {
  Write("s0.txt");
  EXPECT_THAT(ListScans({dir_.path()}, {}).status(),
              StatusIs(absl::StatusCode::kNotFound, HasSubstr("--format xyz")));
  STRATA_ASSERT_OK_AND_ASSIGN(const auto scans,
                              ListScans({dir_.path()}, {.format = ScanFormat::kXyz}));
  EXPECT_THAT(Names(scans), ElementsAre("s0.txt"));
}

}  // namespace
}  // namespace strata
