// Starts a job and stays with it until it ends.
#ifndef STRATA_CLIENT_CLI_JOB_JOB_RUNNER_H_
#define STRATA_CLIENT_CLI_JOB_JOB_RUNNER_H_

#include <cstdint>
#include <map>
#include <string>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"

#include "client/cli/terminal/command.h"
#include "core/world/job.h"

namespace strata::cli {

// Watches with progress on stderr; returns the job's last state.
absl::StatusOr<JobInfo> FollowJob(Context& context, const std::string& map, std::uint64_t id);

// Parameters as KEY=VALUE or --param KEY=VALUE, and --wait.
void AddJobParameters(CLI::App* verb, JobParameters& parameters);
void AddWait(CLI::App* verb, bool& wait);

// Starts the job and prints it; with `wait` as RunJob() does.
absl::Status StartJob(Context& context,
                      const std::string& map,
                      absl::string_view kind,
                      const JobParameters& parameters,
                      bool wait);

// Starts, follows and prints the job; a job that did not succeed is an error with its message.
absl::Status RunJob(Context& context,
                    const std::string& map,
                    absl::string_view kind,
                    const std::map<std::string, std::string>& parameters);

// The job; as text with a line for each number of its result.
void PrintJob(const JobInfo& job, Output& output);

// OK only for a job that has succeeded, or proposes what a dry run found.
absl::Status StatusOf(const JobInfo& job);

}  // namespace strata::cli

#endif  // STRATA_CLIENT_CLI_JOB_JOB_RUNNER_H_
