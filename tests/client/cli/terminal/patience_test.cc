#include "client/cli/terminal/patience.h"

#include <gtest/gtest.h>

namespace strata::cli {
namespace {

TEST(PatienceTest, LastsThroughAServerThatIsAwayAndNothingElse) {
  Patience patience;
  EXPECT_TRUE(patience.Has(absl::OkStatus()));
  EXPECT_TRUE(patience.Has(absl::UnavailableError("gone")));
  EXPECT_TRUE(patience.Has(absl::UnavailableError("still gone")));
  EXPECT_FALSE(patience.Has(absl::NotFoundError("no such job")));
  EXPECT_FALSE(patience.Has(absl::CancelledError("stopped")));
}

}  // namespace
}  // namespace strata::cli
