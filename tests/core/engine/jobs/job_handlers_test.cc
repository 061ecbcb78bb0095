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

}  // namespace
}  // namespace strata
