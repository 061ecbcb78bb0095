#include "tests/support/database_suite.h"

#include <algorithm>
#include <limits>
#include <map>
#include <ostream>
#include <vector>

#include "absl/time/clock.h"
#include <gmock/gmock.h>

#include "core/codec/surface_tile_codec.h"
#include "core/common/status.h"
#include "tests/support/status_matchers.h"

namespace strata::testing {
namespace {

using ::testing::_;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::SizeIs;
using Code = absl::StatusCode;

constexpr char kMap[] = "world";

PointCloud Slice(const PointCloud& cloud, std::size_t begin, std::size_t end) {
  const auto part = [begin, end](const auto& column) {
    using Column = std::decay_t<decltype(column)>;
    const auto first = column.begin();
    return column.empty() ? Column()
                          : Column(first + static_cast<std::ptrdiff_t>(begin),
                                   first + static_cast<std::ptrdiff_t>(end));
  };
  PointCloud slice;
  slice.points = part(cloud.points);
  slice.intensity = part(cloud.intensity);
  slice.colour = part(cloud.colour);
  slice.label = part(cloud.label);
  return slice;
}

PointCloud ColouredCloud(std::size_t points) {
  PointCloud cloud = LevelFloor();
  cloud = Slice(cloud, 0, points);
  for (std::size_t i = 0; i < points; ++i) {
    cloud.intensity.push_back(0.5F * static_cast<float>(i));
    cloud.colour.push_back({static_cast<std::uint8_t>(i), static_cast<std::uint8_t>(i >> 8U), 7});
    cloud.label.push_back(static_cast<std::uint16_t>(i % 3));
  }
  return cloud;
}

std::vector<ScanId> Listed(api::Database& db, const api::ScanFilter& filter) {
  std::vector<ScanId> ids;
  STRATA_EXPECT_OK(db.scans().List({}, kMap, filter, [&ids](const ScanInfo& scan) {
    ids.push_back(scan.header.id);
    return absl::OkStatus();
  }));
  return ids;
}

std::vector<api::TileUpdate> Fetched(api::Database& db, const std::vector<api::HeldTile>& held) {
  std::vector<api::TileUpdate> updates;
  STRATA_EXPECT_OK(db.tiles().Fetch({}, kMap, {}, held, [&updates](const api::TileUpdate& update) {
    updates.push_back(update);
    return absl::OkStatus();
  }));
  return updates;
}

const Pose& NanPose() {
  static const Pose pose = [] {
    Pose T = Pose::Identity();
    T.translation().x() = std::numeric_limits<double>::quiet_NaN();
    return T;
  }();
  return pose;
}

void PutFloor(api::Database& db, const ScanId& id, double x_m = 0.0) {
  const PointCloud floor = LevelFloor();
  STRATA_ASSERT_OK(UploadScan(db, kMap, FloorHeader(id, floor, x_m), floor));
  AwaitIntegration(db, kMap);
}

}  // namespace

void PrintTo(const DatabaseMaker& maker, std::ostream* out) { *out << maker.name; }

std::string DatabaseMakerName(const ::testing::TestParamInfo<DatabaseMaker>& info) {
  return info.param.name;
}

void DatabaseSuite::SetUp() {
  database_ = GetParam().make(directory_.path());
  ASSERT_NE(database_, nullptr);
  STRATA_ASSERT_OK(db().maps().Create({}, kMap, {}));
}

PointCloud LevelFloor(double side_m) {
  constexpr double kSpacingM = 0.05;
  const int steps = static_cast<int>(side_m / kSpacingM);
  PointCloud cloud;
  for (int y = 0; y < steps; ++y) {
    for (int x = 0; x < steps; ++x) {
      cloud.points.emplace_back(static_cast<float>((x + 0.5) * kSpacingM - side_m / 2),
                                static_cast<float>((y + 0.5) * kSpacingM - side_m / 2),
                                0.0F);
    }
  }
  return cloud;
}

ScanHeader FloorHeader(const ScanId& id, const PointCloud& cloud, double x_m) {
  ScanHeader header;
  header.id = id;
  header.time = absl::FromUnixSeconds(1000 + static_cast<std::int64_t>(id.sequence));
  header.T_map_scan = MakePose(Eigen::Quaterniond::Identity(), {x_m, 0.0, 0.0});
  header.sensor_origin = Eigen::Vector3f(0.0F, 0.0F, 1.0F);
  header.alignment = Alignment::kOff;
  header.point_count = cloud.size();
  header.has_intensity = !cloud.intensity.empty();
  header.has_colour = !cloud.colour.empty();
  header.has_label = !cloud.label.empty();
  return header;
}

absl::StatusOr<ScanAck> UploadScan(api::Database& database,
                                   const std::string& map,
                                   const ScanHeader& header,
                                   const PointCloud& cloud) {
  constexpr std::size_t kPiece = 10'000;
  STRATA_ASSIGN_OR_RETURN(const std::unique_ptr<api::ScanUpload> upload,
                          database.scans().Upload({}, map, header));
  for (std::size_t begin = 0; begin < cloud.size(); begin += kPiece) {
    const std::size_t end = std::min(cloud.size(), begin + kPiece);
    STRATA_RETURN_IF_ERROR(upload->Write(Slice(cloud, begin, end)));
  }
  return upload->Finish();
}

void AwaitIntegration(api::Database& database, const std::string& map) {
  while (true) {
    STRATA_ASSERT_OK_AND_ASSIGN(const MapStats stats, database.maps().Stats({}, map));
    if (stats.scans_pending == 0) return;
    absl::SleepFor(absl::Milliseconds(5));
  }
}

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
  EXPECT_THAT(db().jobs().Watch({}, no, 1, ignore), not_found);
  EXPECT_THAT(db().posegraph().Get({}, no), not_found);
  EXPECT_THAT(db().posegraph().SetPose({}, no, {"run", 1}, Pose::Identity()), not_found);
}

TEST_P(DatabaseSuite, AScanComesBackAsSent) {
  const PointCloud cloud = ColouredCloud(25'000);
  ScanHeader header = FloorHeader({"run", 7}, cloud);
  header.T_map_scan = MakePose(Eigen::Quaterniond(Eigen::AngleAxisd(0.3, Eigen::Vector3d::UnitZ())),
                               {1.0, -2.0, 0.5});
  header.sensor = SensorModel{.sigma_m = 0.02, .max_range_m = 80.0};
  STRATA_ASSERT_OK_AND_ASSIGN(const ScanAck ack, UploadScan(db(), kMap, header, cloud));
  EXPECT_EQ(ack.id, header.id);
  EXPECT_FALSE(ack.already_present);

  STRATA_ASSERT_OK_AND_ASSIGN(const ScanInfo scan, db().scans().Get({}, kMap, header.id));
  EXPECT_TRUE(scan.header.T_map_scan.isApprox(header.T_map_scan, 1e-14));
  EXPECT_EQ(scan.header.time, header.time);
  EXPECT_EQ(scan.header.sensor, header.sensor);
  EXPECT_EQ(scan.header.sensor_origin, header.sensor_origin);
  EXPECT_EQ(scan.header.alignment, Alignment::kOff);
  EXPECT_EQ(scan.header.point_count, cloud.size());
  EXPECT_EQ(scan.commit_sequence, ack.commit_sequence);

  PointCloud back;
  const auto append = [](auto& to, const auto& from) {
    to.insert(to.end(), from.begin(), from.end());
  };
  STRATA_ASSERT_OK(db().scans().GetPoints({}, kMap, header.id, [&](const PointCloud& piece) {
    EXPECT_LE(piece.size(), api::kMaxPointsPerChunk);
    append(back.points, piece.points);
    append(back.intensity, piece.intensity);
    append(back.colour, piece.colour);
    append(back.label, piece.label);
    return absl::OkStatus();
  }));
  EXPECT_EQ(back.points, cloud.points);
  EXPECT_EQ(back.intensity, cloud.intensity);
  EXPECT_EQ(back.colour, cloud.colour);
  EXPECT_EQ(back.label, cloud.label);
}

TEST_P(DatabaseSuite, TheSameScanAgainChangesNothingAndAnotherIsRefused) {
  const PointCloud floor = LevelFloor(1.0);
  const ScanHeader header = FloorHeader({"run", 1}, floor);
  STRATA_ASSERT_OK_AND_ASSIGN(const ScanAck first, UploadScan(db(), kMap, header, floor));
  STRATA_ASSERT_OK_AND_ASSIGN(const ScanAck again, UploadScan(db(), kMap, header, floor));
  EXPECT_TRUE(again.already_present);
  EXPECT_EQ(again.commit_sequence, first.commit_sequence);
  PointCloud other = floor;
  other.points[17].z() += 0.01F;
  EXPECT_THAT(UploadScan(db(), kMap, header, other),
              StatusIs(Code::kAlreadyExists, HasSubstr("run/1")));
  EXPECT_THAT(Listed(db(), {}), ElementsAre(ScanId{"run", 1}));
}

TEST_P(DatabaseSuite, BadUploadsAreRefusedWithoutATrace) {
  const PointCloud floor = LevelFloor(1.0);
  const ScanHeader header = FloorHeader({"run", 1}, floor);
  const auto invalid = [](const char* message) {
    return StatusIs(Code::kInvalidArgument, HasSubstr(message));
  };
  ScanHeader bad = header;
  bad.T_map_scan = NanPose();
  EXPECT_THAT(db().scans().Upload({}, kMap, bad).status(), invalid("run/1"));
  bad = header;
  bad.id.trajectory = "a b";
  EXPECT_THAT(db().scans().Upload({}, kMap, bad).status(), invalid("a b"));

  const auto written = [&](const PointCloud& cloud) -> absl::Status {
    STRATA_ASSIGN_OR_RETURN(const std::unique_ptr<api::ScanUpload> upload,
                            db().scans().Upload({}, kMap, header));
    return upload->Write(cloud);
  };
  PointCloud cloud = floor;
  cloud.points[3].y() = std::numeric_limits<float>::quiet_NaN();
  EXPECT_THAT(written(cloud), invalid("point 3"));
  cloud = floor;
  cloud.label.assign(cloud.size(), 1);
  EXPECT_THAT(written(cloud), invalid("label"));
  cloud = floor;
  cloud.points.push_back(cloud.points.front());
  EXPECT_THAT(written(cloud), StatusIs(Code::kInvalidArgument, _));
  cloud.points.resize(api::kMaxPointsPerChunk + 1);
  EXPECT_THAT(written(cloud), StatusIs(Code::kInvalidArgument, _));
  cloud = floor;
  cloud.points.pop_back();
  EXPECT_THAT(UploadScan(db(), kMap, header, cloud), StatusIs(Code::kInvalidArgument, _));
  EXPECT_THAT(Listed(db(), {}), IsEmpty());
}

TEST_P(DatabaseSuite, AnAbandonedUploadLeavesNoTrace) {
  const PointCloud floor = LevelFloor(1.0);
  const ScanHeader header = FloorHeader({"run", 1}, floor);
  {
    STRATA_ASSERT_OK_AND_ASSIGN(auto upload, db().scans().Upload({}, kMap, header));
    STRATA_ASSERT_OK(upload->Write(floor));
  }
  EXPECT_THAT(db().scans().Get({}, kMap, header.id), StatusIs(Code::kNotFound, HasSubstr("run/1")));
  STRATA_ASSERT_OK_AND_ASSIGN(const ScanAck ack, UploadScan(db(), kMap, header, floor));
  EXPECT_FALSE(ack.already_present);
}

TEST_P(DatabaseSuite, UploadsMayBeUnderWayTogether) {
  const PointCloud floor = LevelFloor(1.0);
  STRATA_ASSERT_OK_AND_ASSIGN(auto first,
                              db().scans().Upload({}, kMap, FloorHeader({"a", 1}, floor)));
  STRATA_ASSERT_OK_AND_ASSIGN(auto second,
                              db().scans().Upload({}, kMap, FloorHeader({"b", 1}, floor)));
  STRATA_EXPECT_OK(first->Write(floor));
  STRATA_EXPECT_OK(second->Write(floor));
  STRATA_EXPECT_OK(second->Finish());
  STRATA_EXPECT_OK(first->Finish());
  EXPECT_THAT(Listed(db(), {}), ElementsAre(ScanId{"b", 1}, ScanId{"a", 1}));
}

TEST_P(DatabaseSuite, TheUploadStateTellsWhereToResume) {
  STRATA_ASSERT_OK_AND_ASSIGN(UploadState state, db().scans().GetUploadState({}, kMap, "run"));
  EXPECT_FALSE(state.exists);
  const PointCloud floor = LevelFloor(0.5);
  for (const std::uint64_t sequence : {3, 9}) {
    STRATA_ASSERT_OK(UploadScan(db(), kMap, FloorHeader({"run", sequence}, floor), floor));
  }
  STRATA_ASSERT_OK_AND_ASSIGN(state, db().scans().GetUploadState({}, kMap, "run"));
  EXPECT_TRUE(state.exists);
  EXPECT_EQ(state.last_sequence, 9U);
  EXPECT_EQ(state.scans, 2U);
}

TEST_P(DatabaseSuite, ListingsKeepTheirFilterAndTheirSinksWord) {
  const PointCloud floor = LevelFloor(1.0);
  for (const std::uint64_t sequence : {1, 2, 3}) {
    const double x_m = 10.0 * static_cast<double>(sequence);
    STRATA_ASSERT_OK(UploadScan(db(), kMap, FloorHeader({"a", sequence}, floor, x_m), floor));
  }
  STRATA_ASSERT_OK(UploadScan(db(), kMap, FloorHeader({"b", 9}, floor, 20.0), floor));
  AwaitIntegration(db(), kMap);
  api::ScanFilter filter;
  filter.trajectory = "a";
  EXPECT_THAT(Listed(db(), filter), ElementsAre(ScanId{"a", 1}, ScanId{"a", 2}, ScanId{"a", 3}));
  filter.box = Eigen::AlignedBox2d(Eigen::Vector2d(18, -1), Eigen::Vector2d(22, 1));
  EXPECT_THAT(Listed(db(), filter), ElementsAre(ScanId{"a", 2}));
  filter.trajectory.reset();
  EXPECT_THAT(Listed(db(), filter), ElementsAre(ScanId{"a", 2}, ScanId{"b", 9}));
  filter.box.reset();
  filter.from = absl::FromUnixSeconds(1002);
  filter.until = absl::FromUnixSeconds(1009);
  EXPECT_THAT(Listed(db(), filter), ElementsAre(ScanId{"a", 2}, ScanId{"a", 3}));
  filter = {};
  filter.state = ScanState::kFailed;
  EXPECT_THAT(Listed(db(), filter), IsEmpty());
  int seen = 0;
  const auto enough = [&seen](const ScanInfo&) {
    return ++seen == 2 ? absl::OutOfRangeError("enough") : absl::OkStatus();
  };
  EXPECT_THAT(db().scans().List({}, kMap, {}, enough), StatusIs(Code::kOutOfRange, "enough"));
  EXPECT_EQ(seen, 2);
}

TEST_P(DatabaseSuite, TilesAreFetchedOnlyWhenTheyDiffer) {
  PutFloor(db(), {"run", 1});
  const std::vector<api::TileUpdate> all = Fetched(db(), {});
  ASSERT_THAT(all, SizeIs(4));  // the floor lies around the corner of four tiles
  std::vector<api::HeldTile> held;
  for (const api::TileUpdate& update : all) {
    EXPECT_EQ(update.kind, api::TileUpdate::Kind::kNew);
    STRATA_ASSERT_OK_AND_ASSIGN(const SurfaceTile tile, DecodeSurfaceTile(update.tile.bytes));
    EXPECT_EQ(tile.surfaces.size(), 1600U);  // 4 m × 4 m of 10 cm cells
    STRATA_ASSERT_OK_AND_ASSIGN(const api::EncodedTile got,
                                db().tiles().Get({}, kMap, update.tile.key));
    EXPECT_EQ(got.bytes, update.tile.bytes);
    held.push_back({update.tile.key, update.tile.version});
  }
  EXPECT_THAT(Fetched(db(), held), IsEmpty());
  PutFloor(db(), {"run", 2}, 100.0);
  for (const api::TileUpdate& update : Fetched(db(), held)) {
    EXPECT_EQ(update.kind, api::TileUpdate::Kind::kNew);
    EXPECT_GE(update.tile.key.x, 3);
  }
  held[0].version += 1000;
  const auto kinds = [&](api::TileUpdate::Kind kind) {
    const auto updates = Fetched(db(), held);
    return std::count_if(
        updates.begin(), updates.end(), [kind](const auto& u) { return u.kind == kind; });
  };
  EXPECT_EQ(kinds(api::TileUpdate::Kind::kChanged), 1);
  STRATA_ASSERT_OK(db().scans().Delete({}, kMap, {"run", 1}));
  EXPECT_EQ(kinds(api::TileUpdate::Kind::kGone), 4);
  EXPECT_THAT(db().tiles().Get({}, kMap, held[1].key), StatusIs(Code::kNotFound, _));
  EXPECT_THAT(db().scans().Delete({}, kMap, {"run", 1}), StatusIs(Code::kNotFound, _));
}

TEST_P(DatabaseSuite, TileListingsKeepToTheirArea) {
  PutFloor(db(), {"run", 1});
  api::TileArea area;
  area.x_min = 0;
  STRATA_ASSERT_OK_AND_ASSIGN(const auto tiles, db().tiles().List({}, kMap, area));
  ASSERT_THAT(tiles, SizeIs(2));
  EXPECT_EQ(tiles[0].key, (TileKey{0, 0, -1}));
  EXPECT_EQ(tiles[1].key, (TileKey{0, 0, 0}));
  EXPECT_EQ(tiles[0].patches, 1600U);
  area.level = kMaxLevel + 1;
  EXPECT_THAT(db().tiles().List({}, kMap, area), StatusIs(Code::kInvalidArgument, HasSubstr("13")));
}

TEST_P(DatabaseSuite, SurfacesAndPathsOnALevelFloor) {
  PutFloor(db(), {"run", 1});
  STRATA_ASSERT_OK_AND_ASSIGN(
      const auto columns,
      db().planning().SampleSurfaces({}, kMap, {Eigen::Vector2d(1.0, 1.0), {50.0, 0.0}}));
  ASSERT_THAT(columns, SizeIs(2));
  ASSERT_THAT(columns[0].surfaces, SizeIs(1));
  EXPECT_NEAR(columns[0].surfaces[0].z_m, 0.0, 1e-3);
  EXPECT_THAT(columns[1].surfaces, IsEmpty());

  PlanQuery query;
  query.from.x_m = -2.0;
  query.to.x_m = 2.0;
  STRATA_ASSERT_OK_AND_ASSIGN(PlanResult plan, db().planning().PlanPath({}, kMap, query));
  EXPECT_EQ(plan.reason, PlanReason::kFound) << plan.message;
  EXPECT_NEAR(plan.length_m, 4.0, 0.2);
  EXPECT_GE(plan.waypoints.size(), 2U);
  query.to.x_m = 50.0;
  STRATA_ASSERT_OK_AND_ASSIGN(plan, db().planning().PlanPath({}, kMap, query));
  EXPECT_EQ(plan.reason, PlanReason::kGoalNotOnSurface) << plan.message;
  EXPECT_THAT(plan.waypoints, IsEmpty());
  query.profile.radius_m = -1.0;
  EXPECT_THAT(db().planning().PlanPath({}, kMap, query),
              StatusIs(Code::kInvalidArgument, HasSubstr("radius_m")));
}

TEST_P(DatabaseSuite, AScanSeenAsIntegratedIsInTheTiles) {
  const PointCloud floor = LevelFloor(1.0);
  for (std::uint64_t sequence = 1; sequence <= 30; ++sequence) {
    const ScanId id{"run", sequence};
    const double x_m = 3.0 * static_cast<double>(sequence);
    STRATA_ASSERT_OK(UploadScan(db(), kMap, FloorHeader(id, floor, x_m), floor));
    api::ScanFilter integrated;
    integrated.state = ScanState::kIntegrated;
    const auto seen = [&]() -> bool {
      if (sequence % 2 == 0) return Listed(db(), integrated).size() == sequence;
      const absl::StatusOr<ScanInfo> scan = db().scans().Get({}, kMap, id);
      STRATA_EXPECT_OK(scan);
      return !scan.ok() || scan->state == ScanState::kIntegrated;
    };
    while (!seen()) {
    }
    STRATA_ASSERT_OK_AND_ASSIGN(
        const auto columns, db().planning().SampleSurfaces({}, kMap, {Eigen::Vector2d(x_m, 0.0)}));
    ASSERT_THAT(columns[0].surfaces, SizeIs(1)) << id.ToString();
  }
}

TEST_P(DatabaseSuite, PointsThatDoNotReachTheMapAreCounted) {
  PointCloud floor = LevelFloor(2.0);
  for (std::size_t i = 0; i < 7; ++i) floor.points[i].x() = 2000.0F;
  STRATA_ASSERT_OK(UploadScan(db(), kMap, FloorHeader({"run", 1}, floor), floor));
  for (Eigen::Vector3f& point : floor.points) point.x() = -3000.0F;
  STRATA_ASSERT_OK(UploadScan(db(), kMap, FloorHeader({"run", 2}, floor), floor));
  AwaitIntegration(db(), kMap);
  STRATA_ASSERT_OK_AND_ASSIGN(ScanInfo scan, db().scans().Get({}, kMap, {"run", 1}));
  EXPECT_EQ(scan.state, ScanState::kIntegrated);
  EXPECT_EQ(scan.message,
            "7 of 1600 points left out: 7 not within range [0, 1000] m of the sensor at (0, 0, 1)");
  STRATA_ASSERT_OK_AND_ASSIGN(scan, db().scans().Get({}, kMap, {"run", 2}));
  EXPECT_EQ(scan.state, ScanState::kFailed);
  EXPECT_EQ(scan.message,
            "scan run/2: 0 of 1600 points within range [0, 1000] m of the sensor at (0, 0, 1); set "
            "the sensor origin or the sensor's max range");
  STRATA_ASSERT_OK_AND_ASSIGN(const MapStats stats, db().maps().Stats({}, kMap));
  EXPECT_EQ(stats.scans_failed, 1U);
}

TEST_P(DatabaseSuite, AStoppedCallSaysSo) {
  PutFloor(db(), {"run", 1});
  PlanQuery query;
  query.to.x_m = 2.0;
  const api::Call cancelled;
  cancelled.stop.Request();
  EXPECT_THAT(db().planning().PlanPath(cancelled, kMap, query), StatusIs(Code::kCancelled, _));
  const api::Call late{Stop(absl::UnixEpoch()), "", ""};
  EXPECT_THAT(db().planning().PlanPath(late, kMap, query), StatusIs(Code::kDeadlineExceeded, _));
}

TEST_P(DatabaseSuite, ProfilesAreKept) {
  RobotProfile profile;
  profile.radius_m = 0.9;
  profile.max_gap_m = 0.1;
  STRATA_ASSERT_OK(db().planning().SetProfile({}, kMap, "truck", profile));
  STRATA_ASSERT_OK_AND_ASSIGN(const auto profiles, db().planning().ListProfiles({}, kMap));
  EXPECT_EQ(profiles.at("truck"), profile);
  EXPECT_EQ(profiles.at(std::string(api::kDefaultProfile)), RobotProfile());
  profile.height_m = 0.0;
  EXPECT_THAT(db().planning().SetProfile({}, kMap, "truck", profile),
              StatusIs(Code::kInvalidArgument, HasSubstr("height_m")));
  EXPECT_THAT(db().planning().SetProfile({}, kMap, "", {}), StatusIs(Code::kInvalidArgument, _));
}

TEST_P(DatabaseSuite, JobsRunToTheirEndAndAreWatched) {
  PutFloor(db(), {"run", 1});
  STRATA_ASSERT_OK_AND_ASSIGN(const MapStats before, db().maps().Stats({}, kMap));
  for (const char* kind : {"rebuild", "verify"}) {
    STRATA_ASSERT_OK_AND_ASSIGN(const JobInfo job, db().jobs().Start({}, kMap, kind, {}));
    JobInfo last;
    STRATA_ASSERT_OK(db().jobs().Watch({}, kMap, job.id, [&last](const JobInfo& now) {
      EXPECT_FALSE(IsFinal(last.state));
      last = now;
      return absl::OkStatus();
    }));
    EXPECT_EQ(last.id, job.id);
    EXPECT_EQ(last.state, JobState::kSucceeded) << kind << ": " << last.message;
    STRATA_ASSERT_OK_AND_ASSIGN(const JobInfo cancelled, db().jobs().Cancel({}, kMap, job.id));
    EXPECT_EQ(cancelled.state, JobState::kSucceeded);
  }
  STRATA_ASSERT_OK_AND_ASSIGN(const MapStats after, db().maps().Stats({}, kMap));
  EXPECT_EQ(after.content_digest, before.content_digest);
  STRATA_ASSERT_OK_AND_ASSIGN(const auto jobs, db().jobs().List({}, kMap));
  ASSERT_THAT(jobs, SizeIs(2));
  EXPECT_EQ(jobs[0].kind, "rebuild");
  EXPECT_THAT(db().jobs().Start({}, kMap, "dance", {}),
              StatusIs(Code::kInvalidArgument, HasSubstr("dance")));
  EXPECT_THAT(db().jobs().Get({}, kMap, 999), StatusIs(Code::kNotFound, _));
}

TEST_P(DatabaseSuite, PosesAreSetByHand) {
  PutFloor(db(), {"run", 1});
  const Pose moved = MakePose(Eigen::Quaterniond::Identity(), {60.0, 0.0, 1.0});
  STRATA_ASSERT_OK(db().posegraph().SetPose({}, kMap, {"run", 1}, moved));
  STRATA_ASSERT_OK_AND_ASSIGN(const api::PoseGraphState graph, db().posegraph().Get({}, kMap));
  ASSERT_THAT(graph.nodes, SizeIs(1));
  EXPECT_TRUE(graph.nodes[0].T_map_scan.isApprox(moved, 1e-12));
  EXPECT_TRUE(graph.nodes[0].T_map_scan_uploaded.isApprox(Pose::Identity(), 1e-12));
  STRATA_ASSERT_OK_AND_ASSIGN(
      const auto columns,
      db().planning().SampleSurfaces({}, kMap, {Eigen::Vector2d(0.0, 0.0), {60.05, 0.05}}));
  EXPECT_THAT(columns[0].surfaces, IsEmpty());
  ASSERT_THAT(columns[1].surfaces, SizeIs(1));
  EXPECT_NEAR(columns[1].surfaces[0].z_m, 1.0, 1e-3);
  EXPECT_THAT(db().posegraph().SetPose({}, kMap, {"run", 2}, moved), StatusIs(Code::kNotFound, _));
  EXPECT_THAT(db().posegraph().SetPose({}, kMap, {"run", 1}, NanPose()),
              StatusIs(Code::kInvalidArgument, _));
}

}  // namespace strata::testing
