// Where was this scan taken? (thesis 6.2.1)
#ifndef STRATA_CORE_WORLD_LOCALIZATION_H_
#define STRATA_CORE_WORLD_LOCALIZATION_H_

#include <optional>
#include <string>
#include <vector>

#include "core/cloud/point_cloud.h"
#include "core/cloud/sensor_model.h"
#include "core/geometry/pose.h"
#include "core/world/scan.h"

namespace strata {

struct LocalizeQuery {
  PointCloud cloud;                   // scan frame, with the sensor's origin
  std::optional<SensorModel> sensor;  // default: the map's
  std::optional<Pose> T_map_scan_guess;
  // Only places within this distance of the guess [m]; in (0, 10000]. Without a guess, anywhere.
  double guess_radius_m = 20.0;
};

// A place where the scan could have been taken.
struct LocalizeCandidate {
  Pose T_map_scan = Pose::Identity();
  ScanId place;          // the scan of the map it was matched to
  double overlap = 0.0;  // share of the scan's features with a partner there, in [0, 1]
  double rms_m = 0.0;
  double confidence = 0.0;  // in [0, 1]; see LocalizeResult
};

// The best place, or why none is good enough; both are answers.
struct LocalizeResult {
  bool found = false;
  std::string message;  // for people, with numbers
  LocalizeCandidate best;
  Matrix6d covariance = Matrix6d::Zero();  // of a right-hand step on the pose; rad², m²
  std::vector<LocalizeCandidate> others;   // places that look alike, best first
  std::uint64_t epoch = 0;                 // that the pose is of
};

}  // namespace strata

#endif  // STRATA_CORE_WORLD_LOCALIZATION_H_
