// strata job start|list|show|watch|cancel
#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/str_split.h"

#include "client/cli/arguments.h"
#include "client/cli/command.h"
#include "client/cli/job_runner.h"
#include "client/cli/json.h"
#include "core/common/status.h"

namespace strata::cli {
namespace {

struct JobOptions {
  std::string map;
  std::string kind;
  std::map<std::string, std::string> parameters;
  bool wait = false;
  std::uint64_t id = 0;
};

absl::Status Start(Context& context, const JobOptions& options) {
  if (options.wait) {
    return RunJob(context, options.map, options.kind, options.parameters);
  }
  STRATA_ASSIGN_OR_RETURN(
      const JobInfo job,
      context.database.jobs().Start(context.call, options.map, options.kind, options.parameters));
  context.output.Object(ToJson(job));
  return absl::OkStatus();
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
  context.output.Object(ToJson(job));
  return absl::OkStatus();
}

absl::Status Watch(Context& context, const JobOptions& options) {
  STRATA_ASSIGN_OR_RETURN(const JobInfo job, FollowJob(context, options.map, options.id));
  context.output.Object(ToJson(job));
  return StatusOf(job);
}

absl::Status Cancel(Context& context, const JobOptions& options) {
  STRATA_ASSIGN_OR_RETURN(const JobInfo job,
                          context.database.jobs().Cancel(context.call, options.map, options.id));
  context.output.Object(ToJson(job));
  return absl::OkStatus();
}

void AddParameters(CLI::App* verb, JobOptions& options) {
  verb->add_option_function<std::vector<std::string>>(
          "--param",
          [&options](const std::vector<std::string>& texts) {
            for (const std::string& text : texts) {
              const std::pair<std::string, std::string> pair =
                  absl::StrSplit(text, absl::MaxSplits('=', 1));
              if (text.find('=') == std::string::npos || pair.first.empty()) {
                throw CLI::ValidationError("--param", "expected KEY=VALUE, got " + text);
              }
              options.parameters.insert(pair);
            }
          },
          "Parameter of the job, as in threads=4; may be given several times")
      ->type_name("KEY=VALUE")
      ->allow_extra_args(false);
}

}  // namespace

void AddJobCommands(Commands& commands) {
  auto options = std::make_shared<JobOptions>();
  CLI::App* noun = commands.Noun(
      "job", "Durable background work on a map", "strata job start campus verify --wait");
  const auto verb = [&](const char* name, const char* description, const char* example, auto run) {
    CLI::App* app =
        commands.Verb(noun, name, description, example, [options, run](Context& context) {
          return run(context, *options);
        });
    AddMapName(app, options->map);
    return app;
  };
  CLI::App* start = verb(
      "start", "Start a job: rebuild or verify", "strata job start campus rebuild --wait", Start);
  start->add_option("KIND", options->kind, "rebuild or verify")->required();
  AddParameters(start, *options);
  start->add_flag("--wait", options->wait, "Return when it has ended; exit 1 unless it succeeded");
  verb("list", "All jobs of a map", "strata job list campus", List);
  const auto with_id = [&](CLI::App* app) {
    app->add_option("ID", options->id, "Number of the job")->check(CLI::PositiveNumber)->required();
  };
  with_id(verb("show", "One job", "strata job show campus 3", Show));
  with_id(verb("watch",
               "Follow a job to its end; exit 1 unless it succeeded",
               "strata job watch campus 3",
               Watch));
  with_id(verb("cancel", "Ask a job to end", "strata job cancel campus 3", Cancel));
}

}  // namespace strata::cli
