// The frames of a robot and their transforms over time, as tf2 has them.
#ifndef STRATA_CLIENT_FORMATS_BAGS_TRANSFORM_TREE_H_
#define STRATA_CLIENT_FORMATS_BAGS_TRANSFORM_TREE_H_

#include <cstddef>
#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"

#include "client/formats/bags/pose_track.h"
#include "client/formats/bags/ros_messages.h"
#include "core/geometry/pose.h"

namespace strata {

class TransformTree {
 public:
  // A transform T_frame_child of a TFMessage; fixed for all times, as those of /tf_static are. As
  // PoseTrack::Add; INVALID_ARGUMENT, too, if the child has another parent already, or none of the
  // two a name.
  absl::Status Add(const RosPose& transform, bool fixed);

  // Forgets transforms before a time, but for the last of each frame.
  void DropBefore(std::int64_t stamp_ns);

  bool empty() const { return edges_.empty(); }
  std::size_t size() const { return size_; }  // transforms
  // By name.
  std::vector<std::string> frames() const;

  // Whether `frame` hangs from `above`, through one transform or more.
  bool HangsFrom(const std::string& frame, const std::string& above) const;
  // T_a_b at a time, by the nearest frame that both hang from. NOT_FOUND naming the frames, or as
  // PoseTrack::At.
  absl::StatusOr<Pose> Lookup(const std::string& a, const std::string& b, std::int64_t stamp_ns);

 private:
  struct Edge {
    std::string parent;
    bool fixed = false;
    PoseTrack T_parent_child = {};
  };
  // From `frame` up, itself first.
  std::vector<std::string> AncestorsOf(const std::string& frame) const;
  // T_parent_child along the first `count` frames of such a list.
  absl::StatusOr<Pose> Along(const std::vector<std::string>& frames,
                             std::size_t count,
                             std::int64_t stamp_ns);

  std::map<std::string, Edge> edges_;  // by child
  std::size_t size_ = 0;
};

}  // namespace strata

#endif  // STRATA_CLIENT_FORMATS_BAGS_TRANSFORM_TREE_H_
