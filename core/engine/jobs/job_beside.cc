#include "core/engine/jobs/job_beside.h"

#include <algorithm>
#include <cstddef>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/string_view.h"
#include "absl/time/clock.h"
#include "absl/time/time.h"

#include "core/common/status.h"
#include "core/engine/jobs/job_board.h"
#include "core/engine/jobs/job_handlers.h"
#include "core/world/job_arguments.h"

namespace strata {

absl::StatusOr<JobInfo> StartJobBeside(MapStorage& store,
                                       absl::string_view kind,
                                       const JobParameters& parameters) {
  STRATA_ASSIGN_OR_RETURN(const JobArguments arguments, ReadJobArguments(kind, parameters));
  STRATA_ASSIGN_OR_RETURN(const JobHandler* const handler, FindJobHandler(kind));
  JobInfo job;
  job.kind = std::string(kind);
  job.parameters = parameters;
  job.created = absl::FromUnixMicros(absl::ToUnixMicros(absl::Now()));
  job.updated = job.created;
  StorageWriter& writer = store.writer();
  STRATA_RETURN_IF_ERROR(writer.Commit(Durability::kFull, [&]() -> absl::Status {
    STRATA_RETURN_IF_ERROR(handler->check(writer.reader(), arguments));
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
  }));
  return job;
}

}  // namespace strata
