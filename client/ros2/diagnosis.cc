#include "client/ros2/diagnosis.h"

#include <string>

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "absl/time/time.h"

#include "core/world/tracking.h"

namespace strata::ros2 {
namespace {

// A robot that stands still is asked about once a second.
constexpr absl::Duration kOld = absl::Seconds(3);

// Why it is not tracked; empty where it is.
std::string WhyNot(const FollowerStatus& status, absl::Time now) {
  const bool recent = now - status.when < kOld;
  if (!status.trouble.ok() && !recent) return std::string(status.trouble.message());
  if (!status.last.has_value()) return "no cloud has been matched to the map yet";
  if (!recent) return "no cloud comes any more";
  return status.last->state == TrackState::kLost ? status.last->message : "";
}

}  // namespace

Diagnosis DiagnosisOf(const FollowerStatus& status, bool maps, bool located, absl::Time now) {
  Diagnosis diagnosis;
  diagnosis.name = "strata-ros2: place in the map";
  const std::string why_not = WhyNot(status, now);
  if (!why_not.empty()) {
    const bool by_scans = maps && located;
    diagnosis.level = by_scans ? Diagnosis::Level::kWarn : Diagnosis::Level::kError;
    diagnosis.message = absl::StrCat(by_scans || !located ? "not tracked: " : "lost: ",
                                     why_not,
                                     by_scans  ? "; map -> odom is by the robot's own scans"
                                     : located ? "; map -> odom stays as it was"
                                               : "; there is no map -> odom yet");
  } else {
    diagnosis.message = std::string(ToString(status.last->state));
    const Matrix6d& covariance = status.last->covariance;
    const Vector6d sigma = covariance.diagonal().cwiseMax(0.0).cwiseSqrt();
    diagnosis.values = {{"score", absl::StrFormat("%.2f", status.last->score)},
                        {"sigma [m]", absl::StrFormat("%.3f", sigma.tail<3>().norm())},
                        {"sigma [rad]", absl::StrFormat("%.4f", sigma.head<3>().norm())}};
  }
  diagnosis.values.push_back({"tracked", absl::StrCat(status.tracked)});
  diagnosis.values.push_back({"predicted", absl::StrCat(status.predicted)});
  diagnosis.values.push_back({"lost", absl::StrCat(status.lost)});
  return diagnosis;
}

}  // namespace strata::ros2
