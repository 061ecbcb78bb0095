// Where a robot's base and its sensors were, as its topics say while it drives.
#ifndef STRATA_CLIENT_ROS2_POSE_BOOK_H_
#define STRATA_CLIENT_ROS2_POSE_BOOK_H_

#include <cstddef>
#include <cstdint>
#include <deque>
#include <optional>
#include <string>
#include <vector>

#include "absl/base/thread_annotations.h"
#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/synchronization/mutex.h"

#include "client/formats/bags/cloud_poses.h"
#include "client/formats/bags/pose_track.h"
#include "client/formats/bags/ros_messages.h"
#include "client/formats/bags/transform_tree.h"
#include "core/geometry/pose.h"

namespace strata::ros2 {

// The base in the frame that its odometry calls fixed, at its newest stamp.
struct BasePose {
  std::int64_t stamp_ns = 0;
  Pose T_fixed_base = Pose::Identity();
};

// Thread-safe. Holds the last minute: some 64 bytes a pose or transform, a hundred thousand at
// most.
class PoseBook {
 public:
  struct Options {
    // Whose poses are looked up among the transforms; without it a topic of poses says.
    std::optional<PoseFrames> transforms = {};
    std::optional<Pose> T_base_cloud = {};  // goes before what the transforms say
    Pose T_map_fixed = Pose::Identity();    // where the odometry began
    bool located = true;                    // false: that is a guess, or nothing
  };
  explicit PoseBook(const Options& options)
      : options_(options), T_map_fixed_(options.T_map_fixed), located_(options.located) {}

  // Where the odometry began, once that is known better.
  void SetStart(const Pose& T_map_fixed);
  Pose start() const;  // T_map_fixed as poses are uploaded with it
  bool located() const;

  // Of the topic of poses. INVALID_ARGUMENT as PoseTrack::Add, and for more than it holds.
  absl::Status AddPose(const RosPose& pose);
  // The rest is added where one is bad.
  absl::Status AddTransforms(const std::vector<RosPose>& transforms, bool fixed);

  // The pose of a cloud as it is uploaded. NOT_FOUND where nothing says it; it may come yet while
  // no pose as late as the stamp has.
  absl::StatusOr<CloudPose> At(const std::string& frame, std::int64_t stamp_ns);
  // T_fixed_base at a stamp. NOT_FOUND.
  absl::StatusOr<Pose> Base(std::int64_t stamp_ns);
  // T_fixed_frame now. NOT_FOUND.
  absl::StatusOr<Pose> InFixed(const std::string& frame);
  std::optional<BasePose> newest() const;
  PoseFrames frames() const;

 private:
  void Forget() ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  void FindNewest() ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  absl::StatusOr<Pose> BaseAt(std::int64_t stamp_ns) ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);

  const Options options_;
  mutable absl::Mutex mutex_;
  Pose T_map_fixed_ ABSL_GUARDED_BY(mutex_);
  bool located_ ABSL_GUARDED_BY(mutex_);
  PoseFrames frames_ ABSL_GUARDED_BY(mutex_);
  PoseTrack track_ ABSL_GUARDED_BY(mutex_);
  TransformTree transforms_ ABSL_GUARDED_BY(mutex_);
  std::optional<BasePose> newest_ ABSL_GUARDED_BY(mutex_);
  std::deque<std::int64_t> stamps_ ABSL_GUARDED_BY(mutex_);  // of the last transforms
  std::int64_t forgotten_ns_ ABSL_GUARDED_BY(mutex_) = 0;
};

}  // namespace strata::ros2

#endif  // STRATA_CLIENT_ROS2_POSE_BOOK_H_
