#include "core/engine/jobs/job_changes.h"

#include <optional>
#include <string>
#include <utility>

#include "absl/strings/str_cat.h"
#include "absl/time/clock.h"

#include "core/common/status.h"
#include "core/engine/map/job_context.h"

namespace strata {
namespace {

absl::Status CheckProposed(const JobInfo& job) {
  if (job.state == JobState::kProposed) return absl::OkStatus();
  return absl::FailedPreconditionError(
      absl::StrCat("job ", job.id, " has no proposal that waits; start one with dry_run=1"));
}

}  // namespace

absl::Time NowInMicros() { return absl::FromUnixMicros(absl::ToUnixMicros(absl::Now())); }

absl::Status NoSuchJob(std::uint64_t id) {
  return absl::NotFoundError(absl::StrCat("job ", id, " does not exist"));
}

absl::StatusOr<JobInfo> ChangeStoredJob(StorageWriter& writer,
                                        std::uint64_t id,
                                        ChangeFunction change) {
  STRATA_ASSIGN_OR_RETURN(std::optional<JobInfo> job, writer.reader().FindJob(id));
  if (!job.has_value()) return NoSuchJob(id);
  STRATA_RETURN_IF_ERROR(change(*job, writer));
  job->updated = NowInMicros();
  STRATA_RETURN_IF_ERROR(writer.PutJob(*job));
  return *std::move(job);
}

absl::Status AcceptProposal(JobInfo& job, StorageWriter&) {
  STRATA_RETURN_IF_ERROR(CheckProposed(job));
  job.state = JobState::kQueued;
  job.parameters.emplace(kAccepted, "1");
  return absl::OkStatus();
}

absl::Status DiscardProposal(JobInfo& job, StorageWriter& writer) {
  STRATA_RETURN_IF_ERROR(CheckProposed(job));
  job.state = JobState::kCancelled;
  job.message = std::string("proposal discarded");
  return writer.DiscardProposal(job.id);
}

void TellToEnd(JobInfo& job) { job.parameters.emplace(kToldToEnd, "1"); }

bool IsToldToEnd(const JobInfo& job) { return job.parameters.contains(kToldToEnd); }

void ForgetToldToEnd(JobInfo& job) { job.parameters.erase(kToldToEnd); }

}  // namespace strata
