// How uncertain a range measurement is (thesis 6.4.1).
#ifndef STRATA_CORE_CLOUD_SENSOR_MODEL_H_
#define STRATA_CORE_CLOUD_SENSOR_MODEL_H_

#include "absl/status/status.h"

namespace strata {

// Isotropic Gaussian noise whose standard deviation grows linearly with range: the thesis'
// "simplified sensor model" (6.4.1, Fig. 6.2). Height and range have the same σ.
struct SensorModel {
  double sigma_m = 0.01;            // at range 0; in [0.0005, 10]
  double sigma_per_metre = 0.0005;  // growth with range; in [0, 1]
  double min_range_m = 0.0;         // closer returns are the robot itself: ignored, as is range 0
  double max_range_m = 1000.0;      // farther returns are ignored

  // Whether a return from there counts: sensors report what they did not see as range 0.
  bool Takes(double range_m) const {
    return range_m > 0.0 && range_m >= min_range_m && range_m <= max_range_m;
  }
  double SigmaAt(double range_m) const { return sigma_m + sigma_per_metre * range_m; }

  friend bool operator==(const SensorModel&, const SensorModel&) = default;
};

// INVALID_ARGUMENT naming every field that is not finite or out of its range.
absl::Status ValidateSensorModel(const SensorModel& model);

}  // namespace strata

#endif  // STRATA_CORE_CLOUD_SENSOR_MODEL_H_
