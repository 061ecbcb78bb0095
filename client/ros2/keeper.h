// Keyframes become scans on disk, beside all that must not wait for a disk.
#ifndef STRATA_CLIENT_ROS2_KEEPER_H_
#define STRATA_CLIENT_ROS2_KEEPER_H_

#include <cstddef>
#include <cstdint>
#include <deque>
#include <string>
#include <thread>

#include "absl/base/thread_annotations.h"
#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/synchronization/mutex.h"

#include "client/ros2/intake.h"
#include "client/ros2/pose_book.h"
#include "client/ros2/talk.h"
#include "client/sdk/spool.h"
#include "core/world/scan.h"

namespace strata::ros2 {

struct KeeperOptions {
  std::string map, trajectory;
  Alignment alignment = Alignment::kOn;
  bool deskew = true;
};

struct KeeperCounts {
  std::uint64_t kept = 0;  // in the spool
  std::uint64_t points = 0;
  std::uint64_t unreadable = 0;  // keyframes whose points were not as announced
  std::uint64_t deskewed = 0;
  std::uint64_t not_deskewed = 0;  // though points had times
};

// The scan of a keyframe: numbered by its stamp in microseconds, so that it is the same scan
// whoever sends it again. INVALID_ARGUMENT for a stamp before 1970 and points as ScanOfMessage.
struct KeptScan {
  ScanHeader header;
  PointCloud cloud;
};
absl::StatusOr<KeptScan> ScanOfKeyframe(const Keyframe& keyframe,
                                        const KeeperOptions& options,
                                        PoseBook& book,
                                        KeeperCounts& counts);

// A thread. Thread-safe.
class Keeper {
 public:
  // Of keyframes that may wait for the disk; the last may go beyond.
  static constexpr std::size_t kMostWaitingBytes = std::size_t{32} << 20;

  // All outlive it.
  Keeper(const KeeperOptions& options, PoseBook& book, Spool& spool, Talk& talk);
  ~Keeper() { Finish(); }
  Keeper(const Keeper&) = delete;
  Keeper& operator=(const Keeper&) = delete;

  std::size_t room() const;     // [bytes]
  void Put(Keyframe keyframe);  // REQUIRES: room()
  // Keeps what waits, unless the disk has no room, and ends the thread.
  void Finish();
  KeeperCounts counts() const;

 private:
  void Loop();
  void Keep(const Keyframe& keyframe);
  // False where the spool stays full until this ends.
  bool AddPatiently(const KeptScan& scan);
  bool ending() const;

  const KeeperOptions options_;
  PoseBook& book_;
  Spool& spool_;
  Talk& talk_;
  mutable absl::Mutex mutex_;
  std::deque<Keyframe> waiting_ ABSL_GUARDED_BY(mutex_);
  std::size_t waiting_bytes_ ABSL_GUARDED_BY(mutex_) = 0;  // and of what is being kept
  bool ending_ ABSL_GUARDED_BY(mutex_) = false;
  KeeperCounts counts_ ABSL_GUARDED_BY(mutex_);
  std::thread thread_;
};

}  // namespace strata::ros2

#endif  // STRATA_CLIENT_ROS2_KEEPER_H_
