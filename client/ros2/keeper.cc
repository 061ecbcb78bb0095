#include "client/ros2/keeper.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/str_cat.h"
#include "absl/synchronization/mutex.h"
#include "absl/time/clock.h"
#include "absl/time/time.h"

#include "client/formats/bags/cloud_poses.h"
#include "core/cloud/deskew.h"
#include "core/common/status.h"
#include "core/common/steady_time.h"

namespace strata::ros2 {
namespace {

// Where poses end in the middle of a scan, the rest of them is a moment away.
constexpr absl::Duration kRestOfPoses = absl::Seconds(1);
constexpr absl::Duration kPosePause = absl::Milliseconds(10);
constexpr absl::Duration kDiskPause = absl::Milliseconds(200);

absl::StatusOr<Pose> PoseAfter(PoseBook& book, const RosHeader& header, double offset_s) {
  const auto offset_ns = static_cast<std::int64_t>(std::llround(1e9 * offset_s));
  STRATA_ASSIGN_OR_RETURN(const CloudPose pose, book.At(header.frame, header.stamp_ns + offset_ns));
  return pose.T_map_scan;
}

// Each point where it was at the scan's stamp.
absl::StatusOr<PointCloud> WithoutMotion(const PointCloud& cloud,
                                         const RosHeader& header,
                                         PoseBook& book) {
  const double stamp_s = absl::ToDoubleSeconds(TimeOfStamp(header.stamp_ns) - absl::UnixEpoch());
  STRATA_ASSIGN_OR_RETURN(const std::vector<double> offsets_s, PointOffsets(cloud, stamp_s));
  const double last_s = *std::max_element(offsets_s.begin(), offsets_s.end());
  const absl::Time until = SteadyNow() + kRestOfPoses;
  while (!PoseAfter(book, header, last_s).ok() && SteadyNow() < until) absl::SleepFor(kPosePause);
  return Deskew(cloud, stamp_s, [&](double offset_s) { return PoseAfter(book, header, offset_s); });
}

}  // namespace

absl::StatusOr<KeptScan> ScanOfKeyframe(const Keyframe& keyframe,
                                        const KeeperOptions& options,
                                        PoseBook& book,
                                        KeeperCounts& counts) {
  const RosHeader& header = keyframe.head.header;
  const std::int64_t stamp_us = absl::ToUnixMicros(TimeOfStamp(header.stamp_ns));
  if (stamp_us < 0) return absl::InvalidArgumentError("the cloud's stamp is before 1970");
  STRATA_ASSIGN_OR_RETURN(
      PointCloud cloud,
      ScanOfMessage(
          keyframe.message.bytes, MessageEncoding::kCdr, keyframe.pose.T_scan_cloud, nullptr));
  if (options.deskew && !cloud.time.empty() && !keyframe.pose.T_scan_cloud.has_value()) {
    absl::StatusOr<PointCloud> still = WithoutMotion(cloud, header, book);
    ++(still.ok() ? counts.deskewed : counts.not_deskewed);
    if (still.ok()) cloud = *std::move(still);
  }
  cloud.time.clear();
  KeptScan scan;
  scan.header.id = {options.trajectory, static_cast<std::uint64_t>(stamp_us)};
  scan.header.time = TimeOfStamp(header.stamp_ns);
  scan.header.T_map_scan = keyframe.pose.T_map_scan;
  scan.header.alignment = options.alignment;
  AnnouncePoints(cloud, scan.header);
  cloud.origin.setZero();
  scan.cloud = std::move(cloud);
  return scan;
}

Keeper::Keeper(const KeeperOptions& options, PoseBook& book, Spool& spool, Talk& talk)
    : options_(options), book_(book), spool_(spool), talk_(talk), thread_([this] { Loop(); }) {}

void Keeper::Finish() {
  {
    absl::MutexLock lock(&mutex_);
    ending_ = true;
  }
  if (thread_.joinable()) thread_.join();
}

std::size_t Keeper::room() const {
  absl::MutexLock lock(&mutex_);
  return kMostWaitingBytes - std::min(kMostWaitingBytes, waiting_bytes_);
}

void Keeper::Put(Keyframe keyframe) {
  absl::MutexLock lock(&mutex_);
  waiting_bytes_ += keyframe.message.bytes.size();
  waiting_.push_back(std::move(keyframe));
}

KeeperCounts Keeper::counts() const {
  absl::MutexLock lock(&mutex_);
  return counts_;
}

bool Keeper::ending() const {
  absl::MutexLock lock(&mutex_);
  return ending_;
}

void Keeper::Loop() {
  while (true) {
    Keyframe next;
    {
      absl::MutexLock lock(&mutex_);
      const auto due = [this]() ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_) {
        return ending_ || !waiting_.empty();
      };
      mutex_.Await(absl::Condition(&due));
      if (waiting_.empty()) return;
      next = std::move(waiting_.front());
      waiting_.pop_front();
    }
    Keep(next);
    absl::MutexLock lock(&mutex_);
    waiting_bytes_ -= next.message.bytes.size();
  }
}

void Keeper::Keep(const Keyframe& keyframe) {
  KeeperCounts more;
  const absl::StatusOr<KeptScan> scan = ScanOfKeyframe(keyframe, options_, book_, more);
  if (!scan.ok()) {
    ++more.unreadable;
    talk_.SayNew("points",
                 absl::StrCat("a cloud cannot be read and is left out: ", scan.status().message()));
  } else if (AddPatiently(*scan)) {
    ++more.kept;
    more.points += scan->cloud.size();
  }
  absl::MutexLock lock(&mutex_);
  counts_.kept += more.kept;
  counts_.points += more.points;
  counts_.unreadable += more.unreadable;
  counts_.deskewed += more.deskewed;
  counts_.not_deskewed += more.not_deskewed;
}

bool Keeper::AddPatiently(const KeptScan& scan) {
  while (true) {
    const absl::Status added = spool_.Add(options_.map, scan.header, scan.cloud);
    const bool full = absl::IsResourceExhausted(added);
    talk_.SayNew("spool",
                 added.ok() ? ""
                            : absl::StrCat(full ? "a keyframe waits for room on disk: "
                                                : "a keyframe cannot be kept: ",
                                           added.message()));
    if (!full) return added.ok();
    if (ending()) return false;
    absl::SleepFor(kDiskPause);
  }
}

}  // namespace strata::ros2
