// An engine in a directory of its own, and scans to put into it.
#ifndef STRATA_TESTS_CORE_ENGINE_ENGINE_FIXTURE_H_
#define STRATA_TESTS_CORE_ENGINE_ENGINE_FIXTURE_H_

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include <gtest/gtest.h>

#include "core/api/database.h"
#include "core/cloud/point_cloud.h"
#include "core/engine/engine.h"
#include "core/world/map_info.h"
#include "core/world/scan.h"
#include "tests/support/temp_dir.h"

namespace strata::testing {

inline constexpr char kMapName[] = "world";

// Parameters with tiles of 12.8 m, so that small worlds have several.
MapParameters SmallMap();

// A room's floor with some boxes, about `points` points around the scan's origin, the same for the
// same seed. `seed` also moves the boxes, so that scans differ.
PointCloud MakeRoom(std::uint64_t seed, std::size_t points = 3000);
// The same world of boxes seen from T_map_scan: scans of it overlap and can be aligned.
PointCloud SeeWorld(const Pose& T_map_scan, std::uint64_t seed, std::size_t points = 6000);
// A floor of which a scan sees 24 × 24 m and some eight low boxes: what lies along it is hardly
// held by anything.
PointCloud SeeFloor(const Pose& T_map_scan, std::uint64_t seed, std::size_t points = 6000);
Pose PoseAt(double x_m, double y_m, double yaw_rad = 0.0);
// Where room `i` of UploadRooms() lies.
Pose RoomPose(std::uint64_t i);

ScanHeader HeaderOf(const ScanId& id,
                    const PointCloud& cloud,
                    const Pose& T_map_scan,
                    Alignment alignment = Alignment::kOff);

// Uploads in pieces of `piece` points.
absl::StatusOr<ScanAck> Upload(api::Database& database,
                               const ScanHeader& header,
                               const PointCloud& cloud,
                               std::size_t piece = 2000,
                               const std::string& map = kMapName);

// Returns once no scan of the map is pending.
MapStats WaitIntegrated(api::Database& database, const std::string& map = kMapName);

// Starts a job and returns it once it has ended.
JobInfo RunJob(api::Database& database,
               const std::string& kind,
               const std::map<std::string, std::string>& parameters = {},
               const std::string& map = kMapName);

// Bytes of every served tile of every level, by key; fails the test on an error.
std::map<TileKey, std::string> AllTiles(api::Database& database, const std::string& map = kMapName);

class EngineTest : public ::testing::Test {
 protected:
  EngineOptions Options() const;
  // Ends the engine, if there is one, and opens the directory again.
  void Reopen();
  void Reopen(const EngineOptions& options);
  api::Database& db() { return *database_; }
  std::filesystem::path MapFile(const std::string& map = kMapName) const {
    return directory_.path() / (map + ".strata");
  }
  void Close() { database_.reset(); }
  void MakeMap(const MapParameters& parameters = SmallMap(), const std::string& map = kMapName);
  // Uploads a room, expecting success.
  ScanId UploadRoom(std::uint64_t sequence,
                    const Pose& T_map_scan,
                    const std::string& map = kMapName);
  // Rooms 1 to `count`, each where it lies.
  void UploadRooms(std::uint64_t count, const std::string& map = kMapName);
  // Of the map's content once nothing is pending.
  std::string Digest() { return WaitIntegrated(db()).content_digest; }
  // The map verifies.
  void ExpectSound();
  // Changes a map's file behind the engine's back, which must be closed.
  void Sql(const std::string& sql, const std::string& map = kMapName) const;
  // The first number that a query answers; the engine must be closed.
  std::int64_t Number(const std::string& sql) const;

  // Spoils a served tile; the engine must be closed.
  void DamageSurfaceTile(const TileKey& key) const;

  TempDir directory_;
  std::unique_ptr<api::Database> database_;
};

}  // namespace strata::testing

#endif  // STRATA_TESTS_CORE_ENGINE_ENGINE_FIXTURE_H_
