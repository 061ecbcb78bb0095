#include "core/posegraph/solver/gauge.h"

#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace strata {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;

TEST(ComponentsTest, EachHasItsFirstNode) {
  Components components(7);
  components.Join(6, 4);
  components.Join(1, 3);
  components.Join(3, 6);
  components.Join(5, 2);
  EXPECT_THAT(components.Unanchored(std::vector<bool>(7, false)), ElementsAre(0, 1, 2));
}

TEST(ComponentsTest, OneAnchorHoldsAComponent) {
  Components components(4);
  components.Join(0, 1);
  components.Join(2, 3);
  EXPECT_THAT(components.Unanchored({false, true, false, false}), ElementsAre(2));
  EXPECT_THAT(components.Unanchored({false, true, true, true}), IsEmpty());
}

}  // namespace
}  // namespace strata
