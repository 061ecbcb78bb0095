#include "core/egomotion/georeference.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/str_format.h"
#include <Eigen/Core>
#include <Eigen/Geometry>

#include "core/egomotion/geodesy.h"

namespace strata {
namespace {

// A turn is as well known as the places' spread over their errors says [rad].
constexpr double kSureTurnRad = 0.02;

SeenTwice MeanOf(const std::vector<SeenTwice>& places) {
  SeenTwice mean;
  for (const SeenTwice& place : places) {
    mean.p_map += place.p_map / static_cast<double>(places.size());
    mean.p_run += place.p_run / static_cast<double>(places.size());
  }
  return mean;
}

// About z, of the map against the run.
struct Turn {
  double yaw_rad = 0.0;
  double sigma_rad = 0.0;
};

Turn TurnOf(const std::vector<SeenTwice>& places, const SeenTwice& mean) {
  double cross = 0.0, dot = 0.0, spread_m2 = 0.0, rest_m2 = 0.0;
  for (const SeenTwice& place : places) {
    const Eigen::Vector2d run = (place.p_run - mean.p_run).head<2>();
    const Eigen::Vector2d map = (place.p_map - mean.p_map).head<2>();
    cross += run.x() * map.y() - run.y() * map.x();
    dot += run.dot(map);
    spread_m2 += run.squaredNorm();
  }
  const double yaw_rad = std::atan2(cross, dot);
  const Eigen::Rotation2Dd turn(yaw_rad);
  for (const SeenTwice& place : places) {
    const Eigen::Vector2d run = (place.p_run - mean.p_run).head<2>();
    rest_m2 += ((place.p_map - mean.p_map).head<2>() - turn * run).squaredNorm();
  }
  // Errors of neighbours are alike: no 1/√n.
  const double variance_m2 = rest_m2 / static_cast<double>(places.size());
  return {yaw_rad,
          std::sqrt(variance_m2 / std::max(spread_m2 / static_cast<double>(places.size()), 1e-9))};
}

}  // namespace

absl::StatusOr<Georeference> FitOrigin(const GeodeticOrigin& run,
                                       const std::vector<SeenTwice>& places) {
  Georeference result{.origin = run, .places = places.size()};
  if (places.empty()) return result;
  const SeenTwice mean = MeanOf(places);
  const Turn turn = TurnOf(places, mean);
  if (turn.sigma_rad < kSureTurnRad) result.turn_rad = turn.yaw_rad;
  if (std::abs(result.turn_rad) > kMostTurnRad) {
    return absl::FailedPreconditionError(absl::StrFormat(
        "the map is turned by %.1f degrees against east and north, at most %.1f can be said by an "
        "origin; make it with the run's poses: strata scan import MAP SCANS --poses run.csv",
        result.turn_rad * 180.0 / std::numbers::pi,
        kMostTurnRad * 180.0 / std::numbers::pi));
  }
  const Eigen::Vector3d shift = mean.p_map - mean.p_run;  // p_map = p_run + shift
  for (const SeenTwice& place : places) {
    const Eigen::Vector3d off = place.p_map - place.p_run - shift;
    result.rms_m += off.head<2>().squaredNorm() / static_cast<double>(places.size());
    result.height_rms_m += off.z() * off.z() / static_cast<double>(places.size());
  }
  result.rms_m = std::sqrt(result.rms_m);
  result.height_rms_m = std::sqrt(result.height_rms_m);
  result.origin = LocalFrame(run).ToEarth(-shift);
  return result;
}

}  // namespace strata
