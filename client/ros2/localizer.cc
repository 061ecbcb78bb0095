#include "client/ros2/localizer.h"

#include <optional>
#include <string>
#include <utility>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "absl/synchronization/mutex.h"
#include "absl/time/clock.h"
#include "absl/time/time.h"

#include "client/formats/bags/cloud_poses.h"
#include "core/common/status.h"
#include "core/common/steady_time.h"
#include "core/world/localization.h"

namespace strata::ros2 {
namespace {

// Its pose may come after a cloud.
constexpr absl::Duration kPoseMayCome = absl::Seconds(1);

absl::StatusOr<CloudPose> PatientPose(PoseBook& book, const RosHeader& header) {
  const absl::Time until = SteadyNow() + kPoseMayCome;
  absl::StatusOr<CloudPose> pose = book.At(header.frame, header.stamp_ns);
  while (!pose.ok() && SteadyNow() < until) {
    absl::SleepFor(absl::Milliseconds(10));
    pose = book.At(header.frame, header.stamp_ns);
  }
  return pose;
}

}  // namespace

Localizer::Localizer(std::string map,
                     const std::optional<Pose>& guess,
                     PoseBook& book,
                     const ServerLink& link,
                     Talk& talk)
    : map_(std::move(map)), guess_(guess), book_(book), link_(link), talk_(talk), thread_([this] {
        Loop();
      }) {}

Localizer::~Localizer() {
  {
    absl::MutexLock lock(&mutex_);
    ending_ = true;
  }
  thread_.join();
}

void Localizer::Put(CdrMessage cloud) {
  absl::MutexLock lock(&mutex_);
  cloud_ = std::move(cloud);
}

void Localizer::Loop() {
  while (!done_) {
    CdrMessage cloud;
    {
      absl::MutexLock lock(&mutex_);
      const auto due = [this]() ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_) {
        return ending_ || cloud_.has_value();
      };
      mutex_.Await(absl::Condition(&due));
      if (ending_) return;
      cloud = *std::exchange(cloud_, std::nullopt);
    }
    const absl::StatusOr<Pose> T_map_fixed = Find(cloud);
    if (!T_map_fixed.ok()) {
      talk_.SayNew(
          "start",
          absl::StrCat("where the robot is in the map is not known yet, and nothing is kept: ",
                       T_map_fixed.status().message()));
      continue;
    }
    book_.SetStart(*T_map_fixed);
    const Eigen::Vector3d p = T_map_fixed->translation();
    talk_.Say(absl::StrFormat(
        "found in the map: the odometry begins at %.2f, %.2f, %.2f", p.x(), p.y(), p.z()));
    done_ = true;
  }
}

absl::StatusOr<Pose> Localizer::Find(const CdrMessage& cloud) {
  api::Database* const database = link_.database();
  if (database == nullptr) return absl::UnavailableError("no stratad has answered yet");
  STRATA_ASSIGN_OR_RETURN(const RosCloudHead head,
                          ReadRosCloudHead(cloud.bytes, MessageEncoding::kCdr));
  STRATA_ASSIGN_OR_RETURN(CloudPose pose, PatientPose(book_, head.header));
  LocalizeQuery query;
  STRATA_ASSIGN_OR_RETURN(
      query.cloud, ScanOfMessage(cloud.bytes, MessageEncoding::kCdr, pose.T_scan_cloud, nullptr));
  // The book begins at its guess, or at the map's origin, while it does not know better.
  Pose T_begun_scan = pose.T_map_scan;
  T_begun_scan.translate(query.cloud.origin);
  query.cloud.origin.setZero();
  query.cloud.time.clear();
  if (guess_.has_value()) query.T_map_scan_guess = T_begun_scan;
  STRATA_ASSIGN_OR_RETURN(const LocalizeResult result,
                          database->posegraph().Localize(link_.call(), map_, query));
  if (!result.found) return absl::NotFoundError(result.message);
  return Normalized(result.best.T_map_scan * T_begun_scan.inverse() * book_.start());
}

}  // namespace strata::ros2
