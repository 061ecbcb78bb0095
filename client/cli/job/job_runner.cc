#include "client/cli/job/job_runner.h"

#include <cstdint>
#include <map>
#include <string>

#include "absl/strings/str_cat.h"
#include "absl/time/clock.h"

#include "client/cli/terminal/json.h"
#include "client/cli/terminal/patience.h"
#include "client/cli/terminal/progress.h"
#include "core/common/status.h"

namespace strata::cli {

absl::StatusOr<JobInfo> FollowJob(Context& context, const std::string& map, std::uint64_t id) {
  STRATA_ASSIGN_OR_RETURN(JobInfo last, context.database.jobs().Get(context.call, map, id));
  Progress progress(context.output.talk(), TalksToTerminal(), last.kind);
  Patience patience;
  while (true) {
    const absl::Status watched =
        context.database.jobs().Watch(context.call, map, id, [&](const JobInfo& job) {
          last = job;
          progress.Update(job.progress, job.phase);
          patience.Has(absl::OkStatus());
          return absl::OkStatus();
        });
    if (watched.ok()) {
      return last;
    }
    if (context.call.stop.requested()) {
      return absl::CancelledError(
          absl::StrCat("no longer watching; job ",
                       id,
                       " goes on, 'strata job watch ",
                       map,
                       " ",
                       id,
                       "' comes back to it and 'strata job cancel' ends it"));
    }
    // Jobs are durable: a server that comes back goes on with it.
    if (!patience.Has(watched)) {
      return watched;
    }
    absl::SleepFor(absl::Milliseconds(200));
  }
}

void PrintJob(const JobInfo& job, Output& output) {
  Json json = ToJson(job);
  if (output.json() || job.metrics.empty()) {
    output.Object(json);
    return;
  }
  const Json metrics = json["metrics"];
  json.erase("metrics");
  output.Object(json);
  output.Text("");
  output.Object(metrics);
}

absl::Status StatusOf(const JobInfo& job) {
  if (job.state == JobState::kSucceeded || job.state == JobState::kProposed) {
    return absl::OkStatus();
  }
  return absl::FailedPreconditionError(
      absl::StrCat(job.kind, " job ", job.id, " ", ToString(job.state), ": ", job.message));
}

absl::Status RunJob(Context& context,
                    const std::string& map,
                    absl::string_view kind,
                    const std::map<std::string, std::string>& parameters) {
  STRATA_ASSIGN_OR_RETURN(JobInfo started,
                          context.database.jobs().Start(context.call, map, kind, parameters));
  STRATA_ASSIGN_OR_RETURN(JobInfo job, FollowJob(context, map, started.id));
  PrintJob(job, context.output);
  return StatusOf(job);
}

}  // namespace strata::cli
