#include "core/engine/scans/matching.h"

#include <Eigen/Geometry>

namespace strata {
namespace {

// Twice the default: a chain of hundreds of scans then drifts little whatever the sample
// (core/registration/neighbours.h has numbers).
constexpr int kSamples = 4000;

// Walls of rooms want 0.6; robots of ROS 2 that are carried away are not noticed then, and nobody
// knows why yet (docs/decisions/0216).
constexpr double kTurnRad = 0.0;

}  // namespace

Pose MatchingFrame() { return Pose(Eigen::AngleAxisd(kTurnRad, Eigen::Vector3d::UnitZ())); }

ScanFeatureOptions FeatureOptionsOf(const ScanRecord& scan) {
  ScanFeatureOptions options;
  options.sample_count = kSamples;
  options.sensor_origin = scan.header.sensor_origin.cast<double>();
  if (scan.has_points) options.map_turn_rad = kTurnRad;
  options.up = scan.header.T_map_scan.linear().transpose() * Eigen::Vector3d::UnitZ();
  return options;
}

MlsRegistrationOptions EngineRegistrationOptions() {
  MlsRegistrationOptions options;
  options.max_samples = kSamples;
  return options;
}

}  // namespace strata
