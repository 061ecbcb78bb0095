// Conformance: maps.
#include <limits>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/common/checksum.h"
#include "tests/support/database_suite/database_suite.h"
#include "tests/support/status_matchers.h"

namespace strata::testing {
namespace {

using ::testing::_;
using ::testing::HasSubstr;
using ::testing::SizeIs;
using Code = absl::StatusCode;

TEST_P(DatabaseSuite, MapsAreCreatedFoundListedAndDeleted) {
  MapParameters parameters;
  parameters.mls.cell_size_m = 0.25;
  parameters.default_profile.radius_m = 0.75;
  parameters.keep_points = false;
  parameters.origin = GeodeticOrigin{0.8, 0.1, 300.0};
  STRATA_ASSERT_OK(db().maps().Create({}, "campus", parameters));
  STRATA_ASSERT_OK_AND_ASSIGN(const MapInfo found, db().maps().Get({}, "campus"));
  EXPECT_EQ(found.name, "campus");
  EXPECT_EQ(found.parameters, parameters);
  STRATA_ASSERT_OK_AND_ASSIGN(std::vector<MapInfo> maps, db().maps().List({}));
  ASSERT_THAT(maps, SizeIs(2));
  EXPECT_EQ(maps[0].name, "campus");
  EXPECT_EQ(maps[1].name, kMap);
  STRATA_EXPECT_OK(db().maps().Delete({}, "campus"));
  EXPECT_THAT(db().maps().Get({}, "campus"), StatusIs(Code::kNotFound, HasSubstr("campus")));
}

TEST_P(DatabaseSuite, AnOriginIsSetAndSetAgain) {
  STRATA_ASSERT_OK_AND_ASSIGN(const MapInfo before, db().maps().Get({}, kMap));
  for (const GeodeticOrigin& origin :
       {GeodeticOrigin{0.8, 0.1, 300.0}, GeodeticOrigin{-0.5, 3.0, -2.0}}) {
    STRATA_ASSERT_OK(db().maps().SetOrigin({}, kMap, origin));
    STRATA_ASSERT_OK(db().maps().SetOrigin({}, kMap, origin));
    STRATA_ASSERT_OK_AND_ASSIGN(MapInfo after, db().maps().Get({}, kMap));
    EXPECT_EQ(after.parameters.origin, origin);
    after.parameters.origin = before.parameters.origin;
    EXPECT_EQ(after.parameters, before.parameters);
  }
  EXPECT_THAT(db().maps().SetOrigin({}, kMap, {2.0, 0.0, 0.0}),
              StatusIs(Code::kInvalidArgument,
                       HasSubstr("latitude 114.592°, longitude 0°, altitude 0 m is not on earth")));
  STRATA_ASSERT_OK_AND_ASSIGN(const MapInfo kept, db().maps().Get({}, kMap));
  EXPECT_EQ(kept.parameters.origin, (GeodeticOrigin{-0.5, 3.0, -2.0}));
}

TEST_P(DatabaseSuite, SurfacesThatScansDoNotAgreeOnAreLessCrisp) {
  const auto spread_m = [&] { return db().maps().Stats({}, kMap)->surface_spread_m; };
  const PointCloud floor = LevelFloor();
  EXPECT_EQ(spread_m(), 0.0);
  ScanHeader header = FloorHeader({"run", 1}, floor);
  STRATA_ASSERT_OK(UploadScan(db(), kMap, header, floor));
  AwaitIntegration(db(), kMap);
  EXPECT_LT(spread_m(), 1e-3);
  header = FloorHeader({"run", 2}, floor);
  header.T_map_scan.translation().z() = 0.04;  // half of what was measured, 0.02 m above the mean
  STRATA_ASSERT_OK(UploadScan(db(), kMap, header, floor));
  AwaitIntegration(db(), kMap);
  EXPECT_NEAR(spread_m(), 0.02, 1e-3);
}

TEST_P(DatabaseSuite, BadAndTakenMapsAreRefused) {
  EXPECT_THAT(db().maps().Create({}, kMap, {}), StatusIs(Code::kAlreadyExists, HasSubstr(kMap)));
  EXPECT_THAT(db().maps().Create({}, "../x", {}), StatusIs(Code::kInvalidArgument, _));
  MapParameters parameters;
  parameters.mls.cell_size_m = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THAT(db().maps().Create({}, "x", parameters),
              StatusIs(Code::kInvalidArgument, HasSubstr("cell_size_m")));
}

TEST_P(DatabaseSuite, AnUnknownMapIsNotFoundEverywhere) {
  const std::string no = "nowhere";
  const auto not_found = StatusIs(Code::kNotFound, HasSubstr("nowhere"));
  EXPECT_THAT(db().maps().Get({}, no), not_found);
  EXPECT_THAT(db().maps().Stats({}, no), not_found);
  EXPECT_THAT(db().maps().Delete({}, no), not_found);
  const PointCloud floor = LevelFloor(0.2);
  EXPECT_THAT(db().scans().Upload({}, no, FloorHeader({"run", 1}, floor)).status(), not_found);
  EXPECT_THAT(db().scans().GetUploadState({}, no, "run"), not_found);
  EXPECT_THAT(db().scans().Get({}, no, {"run", 1}), not_found);
  EXPECT_THAT(db().scans().Delete({}, no, {"run", 1}), not_found);
  const auto ignore = [](const auto&) { return absl::OkStatus(); };
  EXPECT_THAT(db().scans().List({}, no, {}, ignore), not_found);
  EXPECT_THAT(db().scans().GetPoints({}, no, {"run", 1}, ignore), not_found);
  EXPECT_THAT(db().tiles().Get({}, no, {}), not_found);
  EXPECT_THAT(db().tiles().List({}, no, {}), not_found);
  EXPECT_THAT(db().tiles().Fetch({}, no, {}, {}, ignore), not_found);
  EXPECT_THAT(db().planning().PlanPath({}, no, {}), not_found);
  EXPECT_THAT(db().planning().SampleSurfaces({}, no, {}), not_found);
  EXPECT_THAT(db().planning().SetProfile({}, no, "p", {}), not_found);
  EXPECT_THAT(db().planning().ListProfiles({}, no), not_found);
  EXPECT_THAT(db().jobs().Start({}, no, "verify", {}), not_found);
  EXPECT_THAT(db().jobs().Get({}, no, 1), not_found);
  EXPECT_THAT(db().jobs().List({}, no), not_found);
  EXPECT_THAT(db().jobs().Cancel({}, no, 1), not_found);
  EXPECT_THAT(db().jobs().Accept({}, no, 1), not_found);
  EXPECT_THAT(db().jobs().Revert({}, no, 1), not_found);
  EXPECT_THAT(db().jobs().Watch({}, no, 1, ignore), not_found);
  EXPECT_THAT(db().maps().History({}, no), not_found);
  EXPECT_THAT(db().scans().SetLabels({}, no, {"run", 1}, {1}, {}), not_found);
  EXPECT_THAT(db().classifiers().Get({}, no, "c"), not_found);
  EXPECT_THAT(db().classifiers().List({}, no), not_found);
  EXPECT_THAT(db().classifiers().Delete({}, no, "c"), not_found);
  EXPECT_THAT(db().classifiers().Export({}, no, "c", ignore), not_found);
  EXPECT_THAT(db().classifiers().Import({}, no, "c", "x"), not_found);
  EXPECT_THAT(db().maps().ListClasses({}, no), not_found);
  EXPECT_THAT(db().maps().SetClass({}, no, {1, "wall", {}}), not_found);
  EXPECT_THAT(db().maps().SetOrigin({}, no, {}), not_found);
  EXPECT_THAT(db().maps().Watch({}, no, {.trajectory = "", .once = true}, ignore), not_found);
  EXPECT_THAT(db().posegraph().Get({}, no), not_found);
  EXPECT_THAT(db().posegraph().SetPose({}, no, {"run", 1}, Pose::Identity()), not_found);
  Constraint constraint;
  constraint.j = {"run", 1};
  EXPECT_THAT(db().posegraph().AddConstraint({}, no, constraint), not_found);
  EXPECT_THAT(db().posegraph().RemoveConstraint({}, no, 1), not_found);
  EXPECT_THAT(db().posegraph().EnableConstraint({}, no, 1, true), not_found);
  EXPECT_THAT(db().posegraph().LookupPose({}, no, {"run", 1}), not_found);
  LocalizeQuery query;
  query.cloud = floor;
  EXPECT_THAT(db().posegraph().Localize({}, no, query), not_found);
  EXPECT_THAT(db().posegraph().Track({}, no, {}), not_found);
}

TEST_P(DatabaseSuite, ABackupIsTheWholeFile) {
  PutFloor(db(), {"run", 1});
  std::string bytes;
  ContentHasher hasher;
  STRATA_ASSERT_OK(db().maps().Backup({}, kMap, [&](const api::BackupPiece& piece) {
    bytes += piece.bytes;
    hasher.Add(piece.bytes);
    const bool last = bytes.size() == piece.total_bytes;
    EXPECT_EQ(piece.content_hash, last ? hasher.HexDigest() : "");
    return absl::OkStatus();
  }));
  EXPECT_EQ(bytes.substr(0, 15), "SQLite format 3");
  EXPECT_EQ(bytes.substr(68, 4), "STRA");
  const auto nothing = [](const api::BackupPiece&) { return absl::OkStatus(); };
  EXPECT_THAT(db().maps().Backup({}, "none", nothing), StatusIs(absl::StatusCode::kNotFound, _));
}

}  // namespace
}  // namespace strata::testing
