// Commands of `strata` in this process, on a database that the test decides on.
#ifndef STRATA_TESTS_CLIENT_CLI_COMMANDS_FIXTURE_H_
#define STRATA_TESTS_CLIENT_CLI_COMMANDS_FIXTURE_H_

#include <cstdint>
#include <sstream>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "client/cli/terminal/output.h"
#include "core/world/constraint.h"
#include "core/world/job.h"
#include "core/world/scan.h"
#include "tests/support/mock_database.h"

namespace strata::cli {

class CommandsTest : public ::testing::Test {
 protected:
  // Runs a command line without the word "strata"; throws CLI::ParseError for wrong usage.
  absl::Status Run(std::vector<std::string> words, OutputFormat format = OutputFormat::kJson);
  // Its JSON, of a command that ends well.
  Json RunJson(const std::vector<std::string>& words);
  std::string RunText(const std::vector<std::string>& words);

  static JobInfo Job(std::uint64_t id, JobState state);
  void EveryWatchEndsWith(JobState state);
  static Constraint SomeConstraint(std::uint64_t id);
  static PoseNode Node(const ScanId& id, double x);

  ::strata::testing::MockDatabase db_;
  std::ostringstream data_, talk_;
};

}  // namespace strata::cli

#endif  // STRATA_TESTS_CLIENT_CLI_COMMANDS_FIXTURE_H_
