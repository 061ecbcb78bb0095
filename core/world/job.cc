#include "core/world/job.h"

namespace strata {

absl::string_view ToString(JobState state) {
  switch (state) {
    case JobState::kQueued:
      return "queued";
    case JobState::kRunning:
      return "running";
    case JobState::kSucceeded:
      return "succeeded";
    case JobState::kFailed:
      return "failed";
    case JobState::kCancelled:
      return "cancelled";
    case JobState::kProposed:
      return "proposed";
  }
  return "unknown";
}

}  // namespace strata
