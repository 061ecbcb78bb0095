#include "tests/client/cli/commands_fixture.h"

#include <algorithm>
#include <cstdint>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include <gmock/gmock.h>

#include "client/cli/terminal/command.h"
#include "tests/support/status_matchers.h"

namespace strata::cli {

using ::strata::testing::IsOk;
using ::testing::_;

absl::Status CommandsTest::Run(std::vector<std::string> words, OutputFormat format) {
  data_.str("");
  talk_.str("");
  CLI::App root;
  root.require_subcommand(1);
  Commands commands{.root = root, .selected = {}, .selected_on_files = {}};
  AddMapCommands(commands);
  AddPoseCommands(commands);
  AddJobCommands(commands);
  AddPosegraphCommands(commands);
  AddPlanesCommands(commands);
  AddObjectsCommands(commands);
  AddKindCommands(commands);
  AddLocalizeCommand(commands);
  AddPlanCommand(commands);
  AddExploreCommand(commands);
  AddSurfaceCommand(commands);
  std::reverse(words.begin(), words.end());  // as CLI11 takes them
  root.parse(words);
  Output output(format, data_, talk_);
  Context context{.database = db_, .call = {}, .output = output};
  return commands.selected(context);
}

Json CommandsTest::RunJson(const std::vector<std::string>& words) {
  EXPECT_THAT(Run(words), IsOk());
  return Json::parse(data_.str(), nullptr, false);
}

std::string CommandsTest::RunText(const std::vector<std::string>& words) {
  EXPECT_THAT(Run(words, OutputFormat::kText), IsOk());
  return data_.str();
}

JobInfo CommandsTest::Job(std::uint64_t id, JobState state) {
  JobInfo job;
  job.id = id;
  job.kind = "optimize";
  job.state = state;
  return job;
}

void CommandsTest::EveryWatchEndsWith(JobState state) {
  ON_CALL(db_.jobs(), Get(_, _, _)).WillByDefault([](auto&, auto, std::uint64_t id) {
    return absl::StatusOr<JobInfo>(Job(id, JobState::kQueued));
  });
  ON_CALL(db_.jobs(), Watch(_, _, _, _))
      .WillByDefault(
          [state](auto&, auto, std::uint64_t id, auto sink) { return sink(Job(id, state)); });
}

Constraint CommandsTest::SomeConstraint(std::uint64_t id) {
  Constraint constraint;
  constraint.id = id;
  constraint.i = {"a", 1};
  constraint.j = {"a", 2};
  constraint.T_i_j.translation().x() = 1.0;
  return constraint;
}

PoseNode CommandsTest::Node(const ScanId& id, double x) {
  PoseNode node;
  node.id = id;
  node.time = absl::UnixEpoch();
  node.T_map_scan.translation().x() = x;
  return node;
}

}  // namespace strata::cli
