#include "client/cli/job/job_runner.h"

#include <cstddef>
#include <cstdint>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_split.h"
#include "absl/time/clock.h"

#include "client/cli/terminal/json.h"
#include "client/cli/terminal/patience.h"
#include "client/cli/terminal/progress.h"
#include "client/cli/terminal/values.h"
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
  if (!output.text() || job.metrics.empty()) {
    output.Object(json);
    return;
  }
  const Json metrics = Shortest(json["metrics"]);
  json.erase("metrics");
  output.Object(json);
  output.Text("");
  output.Object(metrics);
}

namespace {

// What came of a job that somebody waited for: its sentences, not all its numbers.
void PrintEnded(const std::string& map, const JobInfo& job, Output& output) {
  constexpr std::size_t kFewMetrics = 8;
  if (!output.text() || job.metrics.size() <= kFewMetrics) return PrintJob(job, output);
  JobInfo brief = job;
  brief.metrics.clear();
  Json json = ToJson(brief);
  json["metrics"] = absl::StrCat(job.metrics.size(), " numbers; see job show ", map, " ", job.id);
  output.Object(json);
}

}  // namespace

absl::Status StatusOf(const JobInfo& job) {
  if (job.state == JobState::kSucceeded || job.state == JobState::kProposed) {
    return absl::OkStatus();
  }
  return absl::FailedPreconditionError(
      absl::StrCat(job.kind, " job ", job.id, " ", ToString(job.state), ": ", job.message));
}

void AddJobParameters(CLI::App* verb, JobParameters& parameters) {
  const auto take = [&parameters](const std::vector<std::string>& texts) {
    for (const std::string& text : texts) {
      const std::pair<std::string, std::string> pair =
          absl::StrSplit(text, absl::MaxSplits('=', 1));
      if (text.find('=') == std::string::npos || pair.first.empty()) {
        throw CLI::ValidationError("KEY=VALUE", "expected as in rounds=3, got " + text);
      }
      parameters.insert(pair);
    }
  };
  constexpr char kText[] = "Parameter of the job, as in threads=4; may be given several times";
  verb->add_option_function<std::vector<std::string>>("PARAMETER", take, kText)
      ->type_name("KEY=VALUE");
  verb->add_option_function<std::vector<std::string>>("--param", take, kText)
      ->type_name("KEY=VALUE")
      ->allow_extra_args(false);
}

void AddWait(CLI::App* verb, bool& wait) {
  verb->add_flag("--wait", wait, "Return when it has ended; exit 1 unless it succeeded");
}

absl::Status StartJob(Context& context,
                      const std::string& map,
                      absl::string_view kind,
                      const JobParameters& parameters,
                      bool wait) {
  if (wait) return RunJob(context, map, kind, parameters);
  STRATA_ASSIGN_OR_RETURN(const JobInfo job,
                          context.database.jobs().Start(context.call, map, kind, parameters));
  PrintJob(job, context.output);
  return absl::OkStatus();
}

absl::Status RunJob(Context& context,
                    const std::string& map,
                    absl::string_view kind,
                    const std::map<std::string, std::string>& parameters) {
  STRATA_ASSIGN_OR_RETURN(JobInfo started,
                          context.database.jobs().Start(context.call, map, kind, parameters));
  STRATA_ASSIGN_OR_RETURN(JobInfo job, FollowJob(context, map, started.id));
  PrintEnded(map, job, context.output);
  return StatusOf(job);
}

}  // namespace strata::cli
