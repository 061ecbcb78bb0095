// Poses over time, and where something was in between.
#ifndef STRATA_CLIENT_FORMATS_BAGS_POSE_TRACK_H_
#define STRATA_CLIENT_FORMATS_BAGS_POSE_TRACK_H_

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"

#include "core/geometry/pose.h"

namespace strata {

// 64 bytes a pose.
class PoseTrack {
 public:
  // INVALID_ARGUMENT, and nothing added, if a number is not finite or the quaternion (x y z w) is
  // not within 1 % of unit length.
  absl::Status Add(std::int64_t stamp_ns,
                   const std::array<double, 3>& position_m,
                   const std::array<double, 4>& quaternion);

  std::size_t size() const { return poses_.size(); }
  std::int64_t first_ns() const { return first_ns_; }  // REQUIRES: it has poses
  std::int64_t last_ns() const { return last_ns_; }    // likewise

  // The pose of exactly this stamp as it was added; else between its neighbours, the position on a
  // line, the rotation by slerp. Of several with one stamp the first counts. NOT_FOUND before the
  // first, after the last and where the neighbours are more than a second apart.
  absl::StatusOr<Pose> At(std::int64_t stamp_ns);
  // Forgets poses before a time, but for the last of them.
  void DropBefore(std::int64_t stamp_ns);
  // The last one that was added, whenever. REQUIRES: it has poses.
  Pose Last() const;

 private:
  struct Stamped {
    std::int64_t stamp_ns;
    std::array<double, 3> position_m;
    std::array<double, 4> quaternion;
  };
  void Sort();

  std::vector<Stamped> poses_;
  bool sorted_ = true;
  std::int64_t first_ns_ = 0, last_ns_ = 0;
  Stamped last_added_{};
};

}  // namespace strata

#endif  // STRATA_CLIENT_FORMATS_BAGS_POSE_TRACK_H_
