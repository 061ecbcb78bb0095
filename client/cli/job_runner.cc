#include "client/cli/job_runner.h"

#include <cstdint>
#include <map>
#include <string>

#include "absl/strings/str_cat.h"

#include "client/cli/json.h"
#include "client/cli/progress.h"
#include "core/common/status.h"

namespace strata::cli {

absl::StatusOr<JobInfo> FollowJob(Context& context, const std::string& map, std::uint64_t id) {
  STRATA_ASSIGN_OR_RETURN(JobInfo last, context.database.jobs().Get(context.call, map, id));
  Progress progress(context.output.talk(), TalksToTerminal(), last.kind);
  STRATA_RETURN_IF_ERROR(
      context.database.jobs().Watch(context.call, map, id, [&](const JobInfo& job) {
        last = job;
        progress.Update(job.progress, job.phase);
        return absl::OkStatus();
      }));
  return last;
}

absl::Status StatusOf(const JobInfo& job) {
  if (job.state == JobState::kSucceeded) {
    return absl::OkStatus();
  }
  return absl::FailedPreconditionError(
      absl::StrCat(job.kind, " job ", job.id, " ", ToString(job.state), ": ", job.message));
}

absl::Status RunJob(Context& context,
                    const std::string& map,
                    const std::string& kind,
                    const std::map<std::string, std::string>& parameters) {
  STRATA_ASSIGN_OR_RETURN(JobInfo started,
                          context.database.jobs().Start(context.call, map, kind, parameters));
  STRATA_ASSIGN_OR_RETURN(JobInfo job, FollowJob(context, map, started.id));
  context.output.Object(ToJson(job));
  return StatusOf(job);
}

}  // namespace strata::cli
