// What the parts of plane_models share.
#ifndef STRATA_TESTS_EXPERIMENTS_PLANES_PLANE_CASES_H_
#define STRATA_TESTS_EXPERIMENTS_PLANES_PLANE_CASES_H_

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <string>

#include <Eigen/Core>

#include "core/geometry/primitives.h"
#include "core/world/plane_model.h"

namespace strata::testing {

inline constexpr int kWorlds = 10;  // of each figure, of consecutive seeds
inline constexpr double kDegrees = 180.0 / M_PI;

inline double AngleDeg(const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
  return kDegrees * std::acos(std::min(1.0, std::abs(a.dot(b))));
}

// The plane of most surface that is within these of a place and its normal; null: there is none.
inline const ModelPlane* PlaneNear(const PlaneModel& model,
                                   const Eigen::Vector3d& place,
                                   const Eigen::Vector3d& normal,
                                   double most_deg,
                                   double most_m) {
  for (const ModelPlane& plane : model.planes) {
    if (AngleDeg(plane.plane.normal, normal) <= most_deg &&
        Distance(place, plane.plane) <= most_m) {
      return &plane;
    }
  }
  return nullptr;
}

// Each prints a table of its worlds and what holds of it.
void ParallelWalls(std::uint64_t seed);  // figure 5.3
void Rack(std::uint64_t seed);           // figures 5.4 and 5.5
void Boxes(std::uint64_t seed);          // figure 5.7
void Corridor(std::uint64_t seed);       // figures 5.8 and 5.9
void Jacket(std::uint64_t seed);         // figure 5.10
void Carpet(std::uint64_t seed);         // figure 5.11
void ThinWalls(std::uint64_t seed);      // partitions between rooms
// Failures, or 77 where the data are absent; `folder`: of any recording, whose planes are printed.
int RecordedBuilding();
int RecordedHall();
int Recording(const std::string& folder);

}  // namespace strata::testing

#endif  // STRATA_TESTS_EXPERIMENTS_PLANES_PLANE_CASES_H_
