#include "core/engine/jobs/job_beside.h"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/string_view.h"

#include "core/common/status.h"
#include "core/engine/consistency/revert.h"
#include "core/engine/jobs/job_board.h"
#include "core/engine/jobs/job_changes.h"
#include "core/engine/jobs/job_handlers.h"
#include "core/world/job_arguments.h"
#include "core/world/job_kinds.h"

namespace strata {
namespace {

JobInfo NewJob(absl::string_view kind, const JobParameters& parameters) {
  JobInfo job;
  job.kind = std::string(kind);
  job.parameters = parameters;
  job.created = NowInMicros();
  job.updated = job.created;
  return job;
}

// In a commit: under a number of its own, which is put into `job`.
absl::Status Queue(StorageWriter& writer, JobInfo& job) {
  STRATA_ASSIGN_OR_RETURN(const std::vector<JobInfo> jobs, writer.reader().ListJobs());
  std::size_t waiting = 0;
  job.id = 1;
  for (const JobInfo& other : jobs) {
    waiting += other.state == JobState::kQueued ? 1 : 0;
    job.id = std::max(job.id, other.id + 1);
  }
  if (waiting < kMaxWaitingJobs) return writer.PutJob(job);
  return absl::ResourceExhaustedError(absl::StrCat(
      waiting, " jobs wait; at most ", kMaxWaitingJobs, "; wait for some, or cancel them"));
}

absl::StatusOr<JobInfo> ChangeBeside(MapStorage& store, std::uint64_t id, ChangeFunction change) {
  JobInfo job;
  StorageWriter& writer = store.writer();
  STRATA_RETURN_IF_ERROR(writer.Commit(Durability::kFull, [&]() -> absl::Status {
    STRATA_ASSIGN_OR_RETURN(job, ChangeStoredJob(writer, id, change));
    return absl::OkStatus();
  }));
  return job;
}

}  // namespace

absl::StatusOr<JobInfo> StartJobBeside(MapStorage& store,
                                       absl::string_view kind,
                                       const JobParameters& parameters) {
  STRATA_ASSIGN_OR_RETURN(const JobArguments arguments, ReadJobArguments(kind, parameters));
  STRATA_ASSIGN_OR_RETURN(const JobHandler* const handler, FindJobHandler(kind));
  JobInfo job = NewJob(kind, parameters);
  StorageWriter& writer = store.writer();
  STRATA_RETURN_IF_ERROR(writer.Commit(Durability::kFull, [&]() -> absl::Status {
    STRATA_RETURN_IF_ERROR(handler->check(writer.reader(), arguments));
    return Queue(writer, job);
  }));
  return job;
}

// Whoever runs it is told by its row: also one that takes the map over and would run it again.
absl::StatusOr<JobInfo> CancelJobBeside(MapStorage& store, std::uint64_t id) {
  std::optional<JobInfo> ended;
  absl::StatusOr<JobInfo> cancelled =
      ChangeBeside(store, id, [&ended](JobInfo& job, StorageWriter& writer) -> absl::Status {
        ended.reset();
        if (IsFinal(job.state)) {
          ended = job;
          return absl::AbortedError("the job has ended");
        }
        if (job.state == JobState::kRunning) {
          TellToEnd(job);
        } else {
          job.state = JobState::kCancelled;
          ForgetToldToEnd(job);
        }
        return DropProposalOfEnded(job, writer);
      });
  if (ended.has_value()) return *std::move(ended);
  return cancelled;
}

absl::StatusOr<JobInfo> AcceptJobBeside(MapStorage& store, std::uint64_t id) {
  return ChangeBeside(store, id, &AcceptProposal);
}

absl::StatusOr<JobInfo> RevertJobBeside(MapStorage& store, std::uint64_t id) {
  JobInfo told;
  StorageWriter& writer = store.writer();
  STRATA_RETURN_IF_ERROR(writer.Commit(Durability::kFull, [&]() -> absl::Status {
    STRATA_ASSIGN_OR_RETURN(const std::optional<JobInfo> job, writer.reader().FindJob(id));
    if (!job.has_value()) return NoSuchJob(id);
    if (job->state == JobState::kProposed) {
      STRATA_ASSIGN_OR_RETURN(told, ChangeStoredJob(writer, id, &DiscardProposal));
      return absl::OkStatus();
    }
    STRATA_ASSIGN_OR_RETURN(const std::vector<JobInfo> all, writer.reader().ListJobs());
    STRATA_RETURN_IF_ERROR(CheckNoneReverts(all));
    STRATA_ASSIGN_OR_RETURN(const MapClock clock, writer.reader().GetClock());
    STRATA_ASSIGN_OR_RETURN(const std::uint64_t epoch, EpochBefore(*job, clock.epoch));
    told = NewJob(kRevertJob, {{"epoch", absl::StrCat(epoch)}});
    return Queue(writer, told);
  }));
  return told;
}

}  // namespace strata
