// Where a robot is by what it sees: its clouds and its odometry go to PoseGraph.Track.
#ifndef STRATA_CLIENT_ROS2_FOLLOWER_H_
#define STRATA_CLIENT_ROS2_FOLLOWER_H_

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <thread>

#include "absl/base/thread_annotations.h"
#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/synchronization/mutex.h"
#include "absl/time/time.h"

#include "client/ros2/keeper.h"
#include "client/ros2/node.h"
#include "client/ros2/pose_book.h"
#include "client/ros2/server_link.h"
#include "client/ros2/talk.h"
#include "client/ros2/where.h"
#include "core/api/posegraph.h"
#include "core/cloud/point_cloud.h"
#include "core/geometry/pose.h"
#include "core/world/tracking.h"

namespace strata::ros2 {

// How it stands, and what came of the clouds that were asked about.
struct FollowerStatus {
  std::optional<TrackedPose> last;         // the last answer
  absl::Time when = absl::InfinitePast();  // it came, by SteadyNow()
  absl::Status trouble;                    // why there was none for the last cloud
  std::uint64_t tracked = 0, predicted = 0, lost = 0;
};

// Whether it is due to ask again: after 0.1 m or 3°, or a second, and at most ten times a second;
// once a second while the robot is lost, for each search costs the server seconds.
bool IsStepDue(const Pose& moved, absl::Duration since, bool lost);
// A cloud as it is asked about: at most 40,000 finite points, evenly out of all of them.
PointCloud CloudForStep(PointCloud cloud);

// A thread. A cloud that waits gives way to the next one, so that nobody waits for it. Thread-safe.
class Follower {
 public:
  struct Options {
    KeeperOptions scans;        // as they are made of clouds
    std::optional<Pose> guess;  // roughly T_map_fixed, where the book does not say
    bool goes_on = true;        // else it ends as soon as the book is located
  };
  // All outlive it.
  Follower(const Options& options,
           PoseBook& book,
           const ServerLink& link,
           Where& where,
           const Entity& pose_writer,
           Talk& talk);
  ~Follower();
  Follower(const Follower&) = delete;
  Follower& operator=(const Follower&) = delete;

  // Whether clouds are to be put.
  bool wanted() const { return options_.goes_on || !book_.located(); }
  void Put(CdrMessage cloud);
  // Where somebody says that the robot is now, roughly: it is looked for there first.
  void Guess(const Pose& T_map_base);
  FollowerStatus status() const;

 private:
  // A cloud as the server is asked about it.
  struct Asked {
    std::int64_t stamp_ns = 0;
    Pose T_fixed_scan = Pose::Identity();
    PointCloud cloud;
  };

  void Loop();
  // The newest cloud once it is time for one; nullopt at the end.
  std::optional<CdrMessage> Next();
  bool AwaitEnd(absl::Duration longest);
  absl::Status Follow(const CdrMessage& message);
  absl::StatusOr<Keyframe> Placed(const CdrMessage& message);
  absl::StatusOr<Asked> Ask(const Keyframe& keyframe);
  absl::Status Open(const Pose& T_fixed_scan);
  std::optional<Pose> PlaceToLook() const;  // T_map_fixed; nullopt: anywhere
  void Take(const Asked& asked, const TrackedPose& pose);
  void Locate(const Pose& T_map_fixed);
  void Miss(const TrackedPose& pose);
  void Publish(const Asked& asked, const TrackedPose& pose);
  void Count(const absl::StatusOr<TrackedPose>& pose);

  const Options options_;
  PoseBook& book_;
  const ServerLink& link_;
  Where& where_;
  const Entity& pose_writer_;
  Talk& talk_;
  mutable absl::Mutex mutex_;
  std::optional<CdrMessage> cloud_ ABSL_GUARDED_BY(mutex_);
  std::optional<Pose> told_ ABSL_GUARDED_BY(mutex_);  // T_map_fixed, of Guess
  bool ending_ ABSL_GUARDED_BY(mutex_) = false;
  FollowerStatus status_ ABSL_GUARDED_BY(mutex_);
  // Of the thread.
  std::unique_ptr<api::Tracking> tracking_;  // nullptr: to be opened
  std::optional<Pose> guess_;                // roughly T_map_fixed, until it is found
  std::optional<Pose> T_fixed_last_;         // of the scan asked about last,
  absl::Time asked_ = absl::InfinitePast();  // when,
  bool lost_ = true;                         // and whether it was lost then
  bool near_ = true;                         // where it is thought to be, or anywhere
  int misses_ = 0;                           // answers in a row of a stream that knows no place
  std::thread thread_;
};

}  // namespace strata::ros2

#endif  // STRATA_CLIENT_ROS2_FOLLOWER_H_
