// Where on earth a map is that was made by a robot that had GPS.
#ifndef STRATA_CORE_EGOMOTION_GEOREFERENCE_H_
#define STRATA_CORE_EGOMOTION_GEOREFERENCE_H_

#include <cstddef>
#include <vector>

#include "absl/status/statusor.h"
#include <Eigen/Core>

#include "core/world/map_info.h"

namespace strata {

// One place of the robot: in the map, and in the frame (x east, y north) that its trajectory has.
struct SeenTwice {
  Eigen::Vector3d p_map = Eigen::Vector3d::Zero();
  Eigen::Vector3d p_run = Eigen::Vector3d::Zero();
};

struct Georeference {
  GeodeticOrigin origin;   // of the map
  std::size_t places = 0;  // that it rests on
  double turn_rad = 0.0;   // by which the map is turned against east and north, counter-clockwise
  double rms_m = 0.0;      // horizontal, of the places without that turn
  double height_rms_m = 0.0;  // likewise, of heights
};

// Up to this a turn is an error of the way's and stays.
inline constexpr double kMostTurnRad = 0.035;

// The origin that brings the places of the map onto those of a run whose frame is at `run`, by
// least squares over the three coordinates of the shift. Without places the map's frame is the
// run's.
//
// FAILED_PRECONDITION if the map is turned by more than kMostTurnRad against east and north, which
// an origin cannot say; the turn counts where the places are wide enough to tell it.
absl::StatusOr<Georeference> FitOrigin(const GeodeticOrigin& run,
                                       const std::vector<SeenTwice>& places);

}  // namespace strata

#endif  // STRATA_CORE_EGOMOTION_GEOREFERENCE_H_
