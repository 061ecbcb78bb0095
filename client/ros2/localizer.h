// Where a robot that does not know it begins in the map.
#ifndef STRATA_CLIENT_ROS2_LOCALIZER_H_
#define STRATA_CLIENT_ROS2_LOCALIZER_H_

#include <atomic>
#include <optional>
#include <string>
#include <thread>

#include "absl/base/thread_annotations.h"
#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/synchronization/mutex.h"

#include "client/ros2/node.h"
#include "client/ros2/pose_book.h"
#include "client/ros2/server_link.h"
#include "client/ros2/talk.h"
#include "core/geometry/pose.h"

namespace strata::ros2 {

// A thread that asks the server where clouds were taken, one after the other, until it knows of
// one, and then lets the book begin there.
class Localizer {
 public:
  // `guess`: roughly T_map_fixed. All outlive it.
  Localizer(std::string map,
            const std::optional<Pose>& guess,
            PoseBook& book,
            const ServerLink& link,
            Talk& talk);
  ~Localizer();
  Localizer(const Localizer&) = delete;
  Localizer& operator=(const Localizer&) = delete;

  bool done() const { return done_; }
  // One that waits gives way to it.
  void Put(CdrMessage cloud);

 private:
  void Loop();
  absl::StatusOr<Pose> Find(const CdrMessage& cloud);  // T_map_fixed

  const std::string map_;
  const std::optional<Pose> guess_;
  PoseBook& book_;
  const ServerLink& link_;
  Talk& talk_;
  std::atomic<bool> done_ = false;
  absl::Mutex mutex_;
  std::optional<CdrMessage> cloud_ ABSL_GUARDED_BY(mutex_);
  bool ending_ ABSL_GUARDED_BY(mutex_) = false;
  std::thread thread_;
};

}  // namespace strata::ros2

#endif  // STRATA_CLIENT_ROS2_LOCALIZER_H_
