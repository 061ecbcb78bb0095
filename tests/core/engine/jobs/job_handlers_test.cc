#include "core/engine/jobs/job_handlers.h"

#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/strings/string_view.h"
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/world/job_kinds.h"
#include "tests/support/status_matchers.h"

namespace strata {
namespace {

TEST(JobHandlersTest, EveryKindHasOneAndNothingElseHas) {
  std::vector<absl::string_view> kinds, handled;
  for (const JobKind& kind : JobKinds()) kinds.push_back(kind.name);
  for (const JobHandler& handler : JobHandlers()) {
    handled.push_back(handler.kind);
    EXPECT_NE(handler.check, nullptr) << handler.kind;
    EXPECT_NE(handler.run, nullptr) << handler.kind;
    EXPECT_THAT(FindJobHandler(handler.kind), testing::IsOkAndHolds(&handler));
  }
  EXPECT_EQ(handled, kinds);
  EXPECT_THAT(FindJobHandler("dance"),
              testing::StatusIs(absl::StatusCode::kInvalidArgument, ::testing::HasSubstr("dance")));
}

// But what is proposed is applied by who has the map.
TEST(JobHandlersTest, WorkersRunWhatLeavesTilesAlone) {
  std::vector<absl::string_view> here;
  for (const JobKind& kind : JobKinds()) {
    JobInfo job;
    job.kind = std::string(kind.name);
    EXPECT_EQ(RunsAnywhere(job), RunsAnywhere(kind.name));
    if (!RunsAnywhere(job)) here.push_back(kind.name);
    job.parameters[kAccepted] = "1";
    EXPECT_FALSE(RunsAnywhere(job)) << kind.name;
  }
  EXPECT_THAT(here, ::testing::ElementsAre("rebuild", "revert", "classify", "fade"));
  EXPECT_FALSE(RunsAnywhere("dance"));
}

}  // namespace
}  // namespace strata
