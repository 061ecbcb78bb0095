// A map as its users know it.
#ifndef STRATA_CORE_WORLD_MAP_INFO_H_
#define STRATA_CORE_WORLD_MAP_INFO_H_

#include <cstdint>
#include <optional>
#include <string>

#include "absl/status/status.h"
#include "absl/time/time.h"
#include <Eigen/Core>

#include "core/cloud/sensor_model.h"
#include "core/mls/mls_parameters.h"
#include "core/world/robot_profile.h"

namespace strata {

// WGS 84; where the map's origin is on earth.
struct GeodeticOrigin {
  double latitude_rad = 0.0;
  double longitude_rad = 0.0;
  double altitude_m = 0.0;
  friend bool operator==(const GeodeticOrigin&, const GeodeticOrigin&) = default;
};

// INVALID_ARGUMENT with the numbers unless it is on earth.
absl::Status ValidateGeodeticOrigin(const GeodeticOrigin& origin);

inline constexpr std::uint32_t kMaxFadeAfter = 1000;

// Fixed when the map is created, but for `default_profile` and `origin`.
struct MapParameters {
  MlsParameters mls;
  SensorModel sensor;            // for scans that bring none of their own
  RobotProfile default_profile;  // whose traversability the tiles carry
  bool keep_points = true;       // false: points are dropped once their scan is integrated
  // Later scans that must have looked through a place for what was there to fade (job "fade"); 0:
  // nothing fades by itself. At most kMaxFadeAfter; needs keep_points.
  std::uint32_t fade_after = 0;
  std::optional<GeodeticOrigin> origin;

  friend bool operator==(const MapParameters&, const MapParameters&) = default;
};

// INVALID_ARGUMENT naming the fields out of range.
absl::Status ValidateMapParameters(const MapParameters& parameters);

struct MapInfo {
  std::string name;
  MapParameters parameters;
  absl::Time created;
};

// Counts of the current epoch, of committed scans only.
struct MapStats {
  std::uint64_t scans = 0;          // acknowledged, in any state
  std::uint64_t scans_pending = 0;  // acknowledged, not integrated yet
  std::uint64_t scans_failed = 0;
  std::uint64_t points = 0;   // of all scans, as uploaded
  std::uint64_t patches = 0;  // level of detail 0
  std::uint64_t occupied_cells = 0;
  std::uint64_t tiles = 0;           // level of detail 0
  std::uint64_t tiles_prepared = 0;  // of those, kept ready for plans of the default robot
  std::uint64_t tile_bytes = 0;      // served tiles of level 0 as stored
  std::uint64_t point_bytes = 0;     // points as stored (compressed)
  std::uint64_t epoch = 0;
  std::uint64_t commit_sequence = 0;
  // Of heights in level surfaces around their mean, over all measurements: root of the mean square
  // [m]. How crisp the map is: rough ground and slopes have some whatever the poses, scans that do
  // not agree add to it. 0 where no surface has five measurements.
  double surface_spread_m = 0.0;
  // Hash of the epoch's level-0 tiles with all their statistics; equal worlds have equal digests.
  std::string content_digest;
  // Box around all surfaces [m]; empty map: both zero.
  Eigen::Vector3d box_min = Eigen::Vector3d::Zero();
  Eigen::Vector3d box_max = Eigen::Vector3d::Zero();
};

}  // namespace strata

#endif  // STRATA_CORE_WORLD_MAP_INFO_H_
