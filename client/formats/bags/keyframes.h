// Which poses of a drive are far enough apart to keep their scans.
#ifndef STRATA_CLIENT_FORMATS_BAGS_KEYFRAMES_H_
#define STRATA_CLIENT_FORMATS_BAGS_KEYFRAMES_H_

#include <optional>

#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"

#include "core/geometry/pose.h"

namespace strata {

// A pose is kept as soon as one of these lies between it and the one kept last; at least one is
// set.
struct KeyframeSpacing {
  std::optional<double> distance_m, angle_rad, time_s;
};

// "0.5m", "20deg", "0.3rad", "2s", or several with commas between; "0m" keeps all.
// INVALID_ARGUMENT otherwise.
absl::StatusOr<KeyframeSpacing> ParseKeyframeSpacing(absl::string_view text);

class KeyframeChooser {
 public:
  explicit KeyframeChooser(const KeyframeSpacing& spacing) : spacing_(spacing) {}
  // In the order of time; the first is kept.
  bool Keep(double time_s, const Pose& pose);
  // Whether Keep() would.
  bool WouldKeep(double time_s, const Pose& pose) const;

 private:
  KeyframeSpacing spacing_;
  std::optional<Pose> last_;
  double last_time_s_ = 0.0;
};

}  // namespace strata

#endif  // STRATA_CLIENT_FORMATS_BAGS_KEYFRAMES_H_
