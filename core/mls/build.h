// Creates the multi-level surface map of one scan (thesis 6.5.2). Use it for local maps (identity
// pose) and for a scan's contribution to the global map; join.h puts contributions together.
#ifndef STRATA_CORE_MLS_BUILD_H_
#define STRATA_CORE_MLS_BUILD_H_

#include <memory>

#include "absl/status/statusor.h"

#include "core/cloud/point_cloud.h"
#include "core/cloud/sensor_model.h"
#include "core/geometry/pose.h"
#include "core/mls/measurement.h"
#include "core/mls/mls_map.h"
#include "core/mls/mls_parameters.h"

namespace strata {

struct MlsBuildResult {
  MlsMap map;
  DroppedPoints dropped;
};

// Working memory that calls may share one after the other, never at the same time. Holds no state
// that shows in a result; 32 bytes a point of the largest scan so far.
class MlsScratch {
 public:
  MlsScratch();
  ~MlsScratch();
  MlsScratch(MlsScratch&&) noexcept;
  MlsScratch& operator=(MlsScratch&&) noexcept;

  struct Buffers;
  Buffers& buffers() { return *buffers_; }

 private:
  std::unique_ptr<Buffers> buffers_;
};

// The map, in the map frame, of the points T_map_scan * (cloud.origin + p):
//   - σ follows from the distance to cloud.sensor_origin; returns outside the sensor's range are
//     dropped, as are NaN and infinite ones and those outside the map;
//   - cells are half-open, heights are rounded to ticks (measurement.h has the arithmetic);
//   - heights of a cell less than γ apart are one interval, a patch; taller than τ it is vertical;
//   - the colour column becomes ColourSum (every measurement of a patch counts), labels other than
//     0 become ClassVotes.
// A pure function: the same bytes whatever the order of the points, the scratch memory or the
// machine, and the map of a union of clouds that share pose and origins is the join of their maps.
//
// INVALID_ARGUMENT for parameters, a sensor model or a pose that do not validate, a column of
// another length than `points`, or an origin that is not finite or beyond 1e6 m (sensor_origin).
// Single points never fail the call.
absl::StatusOr<MlsBuildResult> BuildMlsMap(const PointCloud& cloud,
                                           const Pose& T_map_scan,
                                           const SensorModel& sensor,
                                           const MlsParameters& parameters,
                                           MlsScratch& scratch);
// The same with memory of its own.
absl::StatusOr<MlsBuildResult> BuildMlsMap(const PointCloud& cloud,
                                           const Pose& T_map_scan,
                                           const SensorModel& sensor,
                                           const MlsParameters& parameters);

}  // namespace strata

#endif  // STRATA_CORE_MLS_BUILD_H_
