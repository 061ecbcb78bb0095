#include "core/engine/jobs/job_changes.h"

#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/time/clock.h"

#include "core/common/status.h"
#include "core/engine/map/job_context.h"
#include "core/engine/map/quarantine.h"

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

absl::Status DropProposalOfEnded(const JobInfo& job, StorageWriter& writer) {
  const bool is_over = job.state == JobState::kFailed || job.state == JobState::kCancelled;
  return is_over ? writer.DiscardProposal(job.id) : absl::OkStatus();
}

void EndJob(JobInfo& job, const absl::Status& ended, const JobResult& result) {
  for (const auto& [name, value] : result.metrics) job.metrics[name] = value;
  job.phase.clear();
  job.parameters.erase(kRunBy);
  if (ended.ok() && result.accepted) {  // and if it was told to end meanwhile, that goes on to hold
    job.state = JobState::kQueued;
    job.parameters.emplace(kAccepted, "1");
    job.message = result.message;
    return;
  }
  ForgetToldToEnd(job);
  if (ended.ok()) {
    job.state = result.proposed ? JobState::kProposed : JobState::kSucceeded;
    job.progress = 1.0;
    job.message = result.message;
  } else {
    job.state = absl::IsCancelled(ended) ? JobState::kCancelled : JobState::kFailed;
    job.message = std::string(ended.message());
  }
}

bool RunsElsewhere(const JobInfo& job) {
  return job.state == JobState::kRunning && job.parameters.contains(kRunBy);
}

std::string RunBy(const JobInfo& job) {
  const auto found = job.parameters.find(kRunBy);
  return found == job.parameters.end() ? "" : found->second;
}

std::string HolderOf(absl::string_view run_by) {
  return std::string(run_by.substr(0, run_by.find('/')));
}

bool IsAccepted(const JobInfo& job) { return job.parameters.contains(kAccepted); }

absl::Status ReturnDeadJob(JobInfo& job, StorageWriter& writer) {
  const WorkId work{WorkKind::kJob, job.id};
  if (IsToldToEnd(job)) {
    EndJob(job, absl::CancelledError("the server that ran it died"), {});
    STRATA_RETURN_IF_ERROR(DropProposalOfEnded(job, writer));
    return writer.DeleteAttempt(work);
  }
  STRATA_ASSIGN_OR_RETURN(const std::vector<Attempt> attempts, writer.reader().ListAttempts());
  Attempt attempt{work, 0, false};
  for (const Attempt& one : attempts) {
    if (one.work == work) attempt.deaths = one.deaths;
  }
  ++attempt.deaths;
  job.state = JobState::kQueued;
  job.parameters.erase(kRunBy);
  if (attempt.deaths >= kMostDeathsOfMany) {
    EndJob(job,
           absl::InternalError(absl::StrCat(kQuarantined,
                                            attempt.deaths,
                                            " servers died while they ran it; stratad quarantine "
                                            "release takes it back")),
           {});
  }
  return writer.PutAttempt(attempt);
}

void TellToEnd(JobInfo& job) { job.parameters.emplace(kToldToEnd, "1"); }

bool IsToldToEnd(const JobInfo& job) { return job.parameters.contains(kToldToEnd); }

void ForgetToldToEnd(JobInfo& job) { job.parameters.erase(kToldToEnd); }

}  // namespace strata
