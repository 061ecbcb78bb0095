// Map files that earlier versions wrote, kept for good (old_maps/): each has all it had, and
// becomes one of today. old_maps/README.md says how one is added.
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>
#include <utility>
#include <vector>

#include "absl/time/time.h"
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <zstd.h>

#include "core/engine/map/map_check.h"
#include "core/storage/sqlite/schema.h"
#include "tests/core/engine/engine_fixture.h"
#include "tests/support/paths.h"
#include "tests/support/status_matchers.h"

namespace strata::testing {
namespace {

using ::testing::Contains;
using ::testing::Each;
using ::testing::Field;
using ::testing::Le;

struct OldMap {
  const char* name;  // of old_maps/NAME.strata.zst
  std::int64_t format;
  bool has_constraints;
  bool has_classes;
};

std::string Unpacked(const std::filesystem::path& file) {
  std::ifstream stream(file, std::ios::binary);
  const std::string packed((std::istreambuf_iterator<char>(stream)), {});
  std::string bytes(ZSTD_getFrameContentSize(packed.data(), packed.size()), '\0');
  EXPECT_EQ(ZSTD_decompress(bytes.data(), bytes.size(), packed.data(), packed.size()),
            bytes.size());
  return bytes;
}

class OldMapTest : public EngineTest, public ::testing::WithParamInterface<OldMap> {
 protected:
  void SetUp() override {
    const std::string name = std::string(GetParam().name) + ".strata.zst";
    std::ofstream(MapFile(), std::ios::binary)
        << Unpacked(std::filesystem::path(SourcePath("tests/core/engine/old_maps")) / name);
  }
  std::int64_t Format() const {
    const auto checks = CheckMapFiles(MapFile().parent_path());
    EXPECT_EQ(checks->size(), 1U);
    STRATA_EXPECT_OK(checks->at(0).status);
    return checks->at(0).format;
  }
};

TEST_P(OldMapTest, HasAllItHadAndIsBroughtUpToDate) {
  EXPECT_EQ(Format(), GetParam().format);
  Reopen();
  ExpectSound();
  const MapStats stats = WaitIntegrated(db());
  EXPECT_EQ(stats.scans, 3U);
  EXPECT_EQ(stats.points, 2700U);
  EXPECT_EQ(stats.content_digest, "f49f8a5cd66e53f2c2e780932a99b3e8");
  Close();
  EXPECT_EQ(Format(), kTruthVersion);
  Reopen();
  EXPECT_EQ(Digest(), "f49f8a5cd66e53f2c2e780932a99b3e8");
}

TEST_P(OldMapTest, ScansAreAsTheyWereUploaded) {
  Reopen();
  STRATA_ASSERT_OK_AND_ASSIGN(const ScanInfo moved, db().scans().Get({}, kMapName, {"run", 2}));
  EXPECT_EQ(moved.header.time, absl::FromUnixMillis(2'000));
  EXPECT_TRUE(moved.T_map_scan.translation().isApprox(Eigen::Vector3d(4.0, 0.5, 1.1)));
  EXPECT_TRUE(moved.header.T_map_scan.translation().isApprox(Eigen::Vector3d(4.0, 0.0, 1.0)));
  EXPECT_THAT(db().scans().Get({}, kMapName, {"run", 4}),
              StatusIs(absl::StatusCode::kNotFound, ::testing::_));
  PointCloud cloud;
  STRATA_ASSERT_OK(db().scans().GetPoints({}, kMapName, {"run", 2}, [&](const PointCloud& piece) {
    cloud = piece;
    return absl::OkStatus();
  }));
  ASSERT_EQ(cloud.size(), 900U);
  EXPECT_EQ(cloud.points[31].x(), -3.0F + 0.2F * 1.0F);
  EXPECT_THAT(cloud.intensity, Each(Le(0.02F)));
  EXPECT_EQ(cloud.label.front(), 1);
  EXPECT_EQ(cloud.label.back(), 2);
}

TEST_P(OldMapTest, WhatPeopleAndJobsHaveSaidHolds) {
  Reopen();
  STRATA_ASSERT_OK_AND_ASSIGN(const api::PoseGraphState graph, db().posegraph().Get({}, kMapName));
  ASSERT_EQ(graph.constraints.size(), GetParam().has_constraints ? 1U : 0U);
  for (const Constraint& constraint : graph.constraints) {
    EXPECT_EQ(constraint.note, "measured");
    EXPECT_TRUE(constraint.T_i_j.translation().isApprox(Eigen::Vector3d(4.0, 0.0, 0.0)));
  }
  STRATA_ASSERT_OK_AND_ASSIGN(const auto profiles, db().planning().ListProfiles({}, kMapName));
  EXPECT_EQ(profiles.at("cart").radius_m, 0.5);
  STRATA_ASSERT_OK_AND_ASSIGN(const auto jobs, db().jobs().List({}, kMapName));
  ASSERT_EQ(jobs.size(), 1U);
  EXPECT_EQ(jobs[0].state, JobState::kSucceeded);
  EXPECT_EQ(jobs[0].metrics.at("scans_checked"), 3.0);
  STRATA_ASSERT_OK_AND_ASSIGN(const auto classes, db().maps().ListClasses({}, kMapName));
  ASSERT_EQ(classes.size(), GetParam().has_classes ? 1U : 0U);
  for (const MapClass& map_class : classes) EXPECT_EQ(map_class.name, "wall");
}

TEST_P(OldMapTest, ItsSurfacesAreThere) {
  Reopen();
  ExpectSound();  // once what is derived has been made again
  STRATA_ASSERT_OK_AND_ASSIGN(const auto columns,
                              db().planning().SampleSurfaces({}, kMapName, {{-0.3, 0.1}}));
  ASSERT_EQ(columns.size(), 1U);
  ASSERT_EQ(columns[0].surfaces.size(), 1U);
  EXPECT_NEAR(columns[0].surfaces[0].z_m, 0.01, 0.011);
}

constexpr OldMap kOldMaps[] = {
    {"v1", 1, false, false}, {"v2", 2, true, true}, {"v3", 3, true, true}};

INSTANTIATE_TEST_SUITE_P(EveryFormat,
                         OldMapTest,
                         ::testing::ValuesIn(kOldMaps),
                         [](const auto& test) { return std::string(test.param.name); });

TEST(OldMapsTest, EveryFormatBeforeThatOfTodayHasAFile) {
  for (std::int64_t format = 1; format < kTruthVersion; ++format) {
    EXPECT_THAT(kOldMaps, Contains(Field(&OldMap::format, format)))
        << "tests/core/engine/old_maps/README.md says how to add one";
  }
}

}  // namespace
}  // namespace strata::testing
