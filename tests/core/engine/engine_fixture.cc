#include "tests/core/engine/engine_fixture.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <map>
#include <memory>
#include <random>
#include <string>

#include "absl/status/statusor.h"
#include "absl/time/clock.h"
#include "absl/time/time.h"
#include <sqlite3.h>

#include "core/common/status.h"
#include "tests/support/status_matchers.h"

namespace strata::testing {
namespace {

struct Box {
  double x, y, half, top;
};

// Height of a world of boxes on a floor.
double HeightAt(double x, double y, const std::vector<Box>& boxes) {
  double z = 0.0;
  for (const Box& box : boxes) {
    if (std::abs(x - box.x) < box.half && std::abs(y - box.y) < box.half) z = std::max(z, box.top);
  }
  return z;
}

bool NearSide(double x, double y, const std::vector<Box>& boxes) {
  constexpr double kSide = 0.03;
  for (const Box& box : boxes) {
    const double inside = std::min(box.half - std::abs(x - box.x), box.half - std::abs(y - box.y));
    if (inside > 0.0 && inside < kSide) return true;
  }
  return false;
}

std::vector<Box> RandomBoxes(std::uint64_t seed, int count, double reach) {
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> place(-reach, reach);
  std::uniform_real_distribution<double> size(0.3, 1.5);
  std::vector<Box> boxes;
  for (int i = 0; i < count; ++i) {
    boxes.push_back({place(random), place(random), size(random), size(random)});
  }
  return boxes;
}

PointCloud Sample(const Pose& T_map_scan,
                  const std::vector<Box>& boxes,
                  double reach,
                  std::uint64_t seed,
                  std::size_t points) {
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> place(-reach, reach);
  std::uniform_real_distribution<double> unit(0.0, 1.0);
  std::normal_distribution<double> noise(0.0, 0.01);
  PointCloud cloud;
  const Pose T_scan_map = T_map_scan.inverse();
  for (std::size_t i = 0; i < points; ++i) {
    const double x = T_map_scan.translation().x() + place(random);
    const double y = T_map_scan.translation().y() + place(random);
    double z = HeightAt(x, y, boxes);
    if (z > 0.0 && NearSide(x, y, boxes) && unit(random) < 0.8) z *= unit(random);
    const Eigen::Vector3d p_map(x, y, z + noise(random));
    cloud.points.push_back((T_scan_map * p_map).cast<float>());
  }
  return cloud;
}

}  // namespace

MapParameters SmallMap() {
  MapParameters parameters;
  parameters.mls.cell_size_m = 0.05;
  return parameters;
}

PointCloud MakeRoom(std::uint64_t seed, std::size_t points) {
  return Sample(Pose::Identity(), RandomBoxes(seed, 5, 5.0), 6.0, seed, points);
}

PointCloud SeeWorld(const Pose& T_map_scan, std::uint64_t seed, std::size_t points) {
  return Sample(T_map_scan, RandomBoxes(77, 120, 40.0), 12.0, seed, points);
}

PointCloud SeeFloor(const Pose& T_map_scan, std::uint64_t seed, std::size_t points) {
  std::vector<Box> boxes = RandomBoxes(11, 35, 25.0);
  for (Box& box : boxes) box.top *= 0.4;
  return Sample(T_map_scan, boxes, 12.0, seed, points);
}

Pose PoseAt(double x_m, double y_m, double yaw_rad) {
  return MakePose(Eigen::Quaterniond(Eigen::AngleAxisd(yaw_rad, Eigen::Vector3d::UnitZ())),
                  {x_m, y_m, 0.0});
}

Pose RoomPose(std::uint64_t i) {
  const auto n = static_cast<double>(i);
  return PoseAt(4.0 * n - 10.0, 0.7 * n, 0.3 * n);
}

ScanHeader HeaderOf(const ScanId& id,
                    const PointCloud& cloud,
                    const Pose& T_map_scan,
                    Alignment alignment) {
  ScanHeader header;
  header.id = id;
  header.time = absl::FromUnixSeconds(1'600'000'000 + static_cast<std::int64_t>(id.sequence));
  header.T_map_scan = T_map_scan;
  header.alignment = alignment;
  header.point_count = cloud.size();
  header.rows = cloud.rows;
  header.columns = cloud.columns;
  header.has_intensity = !cloud.intensity.empty();
  header.has_colour = !cloud.colour.empty();
  header.has_label = !cloud.label.empty();
  return header;
}

absl::StatusOr<ScanAck> Upload(api::Database& database,
                               const ScanHeader& header,
                               const PointCloud& cloud,
                               std::size_t piece,
                               const std::string& map) {
  STRATA_ASSIGN_OR_RETURN(const std::unique_ptr<api::ScanUpload> upload,
                          database.scans().Upload({}, map, header));
  for (std::size_t begin = 0; begin < cloud.size(); begin += piece) {
    const std::size_t end = std::min(begin + piece, cloud.size());
    const auto cut = [&](const auto& from, auto& to) {
      if (!from.empty()) to.assign(from.begin() + begin, from.begin() + end);
    };
    PointCloud chunk;
    cut(cloud.points, chunk.points);
    cut(cloud.intensity, chunk.intensity);
    cut(cloud.colour, chunk.colour);
    cut(cloud.label, chunk.label);
    STRATA_RETURN_IF_ERROR(upload->Write(chunk));
  }
  return upload->Finish();
}

MapStats WaitIntegrated(api::Database& database, const std::string& map) {
  while (true) {
    const absl::StatusOr<MapStats> stats = database.maps().Stats({}, map);
    EXPECT_THAT(stats, IsOk());
    if (!stats.ok() || stats->scans_pending == 0) return stats.value_or(MapStats());
    absl::SleepFor(absl::Milliseconds(2));
  }
}

JobInfo RunJob(api::Database& database,
               const std::string& kind,
               const std::map<std::string, std::string>& parameters,
               const std::string& map) {
  const absl::StatusOr<JobInfo> job = database.jobs().Start({}, map, kind, parameters);
  EXPECT_THAT(job, IsOk());
  if (!job.ok()) return {};
  JobInfo last;
  STRATA_EXPECT_OK(database.jobs().Watch({}, map, job->id, [&](const JobInfo& info) {
    last = info;
    return absl::OkStatus();
  }));
  return last;
}

std::map<TileKey, std::string> AllTiles(api::Database& database, const std::string& map) {
  std::map<TileKey, std::string> tiles;
  for (int level = 0; level <= kMaxLevel; ++level) {
    api::TileArea area;
    area.level = level;
    const absl::Status fetched =
        database.tiles().Fetch({}, map, area, {}, [&](const api::TileUpdate& update) {
          EXPECT_EQ(update.kind, api::TileUpdate::Kind::kNew);
          tiles[update.tile.key] = update.tile.bytes;
          return absl::OkStatus();
        });
    EXPECT_THAT(fetched, IsOk());
  }
  return tiles;
}

EngineOptions EngineTest::Options() const {
  EngineOptions options;
  options.directory = directory_.path();
  return options;
}

void EngineTest::Reopen() { Reopen(Options()); }

void EngineTest::Reopen(const EngineOptions& options) {
  database_.reset();
  absl::StatusOr<std::unique_ptr<api::Database>> opened = OpenEngine(options);
  ASSERT_THAT(opened, IsOk());
  database_ = *std::move(opened);
}

void EngineTest::MakeMap(const MapParameters& parameters, const std::string& map) {
  if (database_ == nullptr) Reopen();
  ASSERT_THAT(db().maps().Create({}, map, parameters), IsOk());
}

ScanId EngineTest::UploadRoom(std::uint64_t sequence,
                              const Pose& T_map_scan,
                              const std::string& map) {
  const PointCloud cloud = MakeRoom(sequence);
  const ScanId id{"run", sequence};
  EXPECT_THAT(Upload(db(), HeaderOf(id, cloud, T_map_scan), cloud, 2000, map), IsOk());
  return id;
}

void EngineTest::UploadRooms(std::uint64_t count, const std::string& map) {
  for (std::uint64_t i = 1; i <= count; ++i) UploadRoom(i, RoomPose(i), map);
}

void EngineTest::ExpectSound() {
  const JobInfo verified = RunJob(db(), "verify");
  EXPECT_EQ(verified.state, JobState::kSucceeded) << verified.message;
}

void EngineTest::Sql(const std::string& sql, const std::string& map) const {
  sqlite3* file = nullptr;
  ASSERT_EQ(sqlite3_open(MapFile(map).c_str(), &file), SQLITE_OK);
  char* error = nullptr;
  EXPECT_EQ(sqlite3_exec(file, sql.c_str(), nullptr, nullptr, &error), SQLITE_OK) << error;
  sqlite3_close(file);
}

std::int64_t EngineTest::Number(const std::string& sql) const {
  sqlite3* file = nullptr;
  EXPECT_EQ(sqlite3_open(MapFile(kMapName).c_str(), &file), SQLITE_OK);
  sqlite3_stmt* query = nullptr;
  EXPECT_EQ(sqlite3_prepare_v2(file, sql.c_str(), -1, &query, nullptr), SQLITE_OK) << sql;
  EXPECT_EQ(sqlite3_step(query), SQLITE_ROW) << sql;
  const std::int64_t number = sqlite3_column_int64(query, 0);
  sqlite3_finalize(query);
  sqlite3_close(file);
  return number;
}

void EngineTest::DamageSurfaceTile(const TileKey& key) const {
  Sql("UPDATE derived_surface_tile SET bytes = CAST(substr(bytes, 1, 40) || x'5a5a' || "
      "substr(bytes, 43) AS BLOB) WHERE (level, x, y) = (" +
      std::to_string(key.level) + ", " + std::to_string(key.x) + ", " + std::to_string(key.y) +
      ")");
}

}  // namespace strata::testing
