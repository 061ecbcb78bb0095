// strata job start|list|show|watch|cancel|accept|revert
#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "absl/strings/str_cat.h"

#include "client/cli/job/job_runner.h"
#include "client/cli/terminal/arguments.h"
#include "client/cli/terminal/command.h"
#include "client/cli/terminal/json.h"
#include "client/cli/terminal/names.h"
#include "core/common/status.h"
#include "core/world/job_kinds.h"

namespace strata::cli {
namespace {

struct JobOptions {
  std::string map;
  std::string kind;
  std::map<std::string, std::string> parameters;
  bool dry_run = false;
  bool wait = false;
  std::uint64_t id = 0;
};

absl::Status Start(Context& context, JobOptions options) {
  if (options.dry_run) options.parameters["dry_run"] = "1";
  return StartJob(context, options.map, options.kind, options.parameters, options.wait);
}

absl::Status List(Context& context, const JobOptions& options) {
  STRATA_ASSIGN_OR_RETURN(const std::vector<JobInfo> jobs,
                          context.database.jobs().List(context.call, options.map));
  Json rows = Json::array();
  for (const JobInfo& job : jobs) {
    rows.push_back(ToJson(job));
  }
  context.output.List(rows,
                      {{"id", "ID"},
                       {"kind", "KIND"},
                       {"state", "STATE"},
                       {"progress", "PROGRESS"},
                       {"created", "CREATED"},
                       {"message", "MESSAGE"}});
  return absl::OkStatus();
}

absl::Status Show(Context& context, const JobOptions& options) {
  STRATA_ASSIGN_OR_RETURN(const JobInfo job,
                          context.database.jobs().Get(context.call, options.map, options.id));
  PrintJob(job, context.output);
  return absl::OkStatus();
}

absl::Status Watch(Context& context, const JobOptions& options) {
  STRATA_ASSIGN_OR_RETURN(const JobInfo job, FollowJob(context, options.map, options.id));
  PrintJob(job, context.output);
  return StatusOf(job);
}

absl::Status Cancel(Context& context, const JobOptions& options) {
  STRATA_ASSIGN_OR_RETURN(const JobInfo job,
                          context.database.jobs().Cancel(context.call, options.map, options.id));
  PrintJob(job, context.output);
  return absl::OkStatus();
}

// What became of a decision; with --wait, of the job that carries it out.
absl::Status ShowDecided(Context& context, const JobInfo& job, const JobOptions& options) {
  if (!options.wait || IsFinal(job.state)) {
    PrintJob(job, context.output);
    return absl::OkStatus();
  }
  STRATA_ASSIGN_OR_RETURN(const JobInfo ended, FollowJob(context, options.map, job.id));
  PrintJob(ended, context.output);
  return StatusOf(ended);
}

absl::Status Accept(Context& context, const JobOptions& options) {
  STRATA_ASSIGN_OR_RETURN(const JobInfo job,
                          context.database.jobs().Accept(context.call, options.map, options.id));
  return ShowDecided(context, job, options);
}

absl::Status Revert(Context& context, const JobOptions& options) {
  STRATA_ASSIGN_OR_RETURN(const JobInfo job,
                          context.database.jobs().Revert(context.call, options.map, options.id));
  return ShowDecided(context, job, options);
}

void AddStart(CLI::App* start, JobOptions& options) {
  std::vector<std::string> kinds;
  for (const JobKind& kind : JobKinds()) kinds.emplace_back(kind.name);
  TakesWord(start->add_option("KIND", options.kind, JobKindNames())->required(), kinds);
  AddJobParameters(start, options.parameters);
  start->add_flag(
      "--dry-run", options.dry_run, "optimize: only propose; see job accept and revert");
  AddWait(start, options.wait);
  start->footer(
      absl::StrCat(start->get_footer(), "\n\nKinds and their parameters:\n", JobKindsText()));
}

}  // namespace

void AddJobCommands(Commands& commands) {
  auto options = std::make_shared<JobOptions>();
  CLI::App* noun = commands.Noun(
      "job", "Durable background work on a map", "strata job start campus verify --wait");
  const auto verb = MapVerbs(commands, noun, options);
  AddStart(verb("start",
                "Start a job; --help has its kinds and their parameters",
                "strata job start campus optimize rounds=3 --dry-run --wait",
                Start),
           *options);
  verb("list", "All jobs of a map", "strata job list campus", List);
  const auto with_id = [&](CLI::App* app) {
    TakesName(app->add_option("ID", options->id, "Number of the job")
                  ->check(CLI::PositiveNumber)
                  ->required(),
              kJobNames);
  };
  with_id(verb("show", "One job", "strata job show campus 3", Show));
  with_id(verb("watch",
               "Follow a job to its end; exit 1 unless it succeeded",
               "strata job watch campus 3",
               Watch));
  with_id(verb("cancel", "Ask a job to end", "strata job cancel campus 3", Cancel));
  const auto decided = [&](CLI::App* app) {
    with_id(app);
    app->add_flag("--wait", options->wait, "Return when it is done; exit 1 unless it succeeded");
  };
  decided(verb(
      "accept", "Make real what a dry run proposed", "strata job accept campus 3 --wait", Accept));
  decided(verb("revert",
               "Forget a proposal, or bring back the epoch before the one that the job made",
               "strata job revert campus 3 --wait",
               Revert));
}

}  // namespace strata::cli
