#include "core/posegraph/solver/gauge.h"

#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/common/disjoint_sets.h"

namespace strata {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;

TEST(GaugeTest, EachSetHasItsFirstNode) {
  DisjointSets sets;
  sets.Join(6, 4);
  sets.Join(1, 3);
  sets.Join(3, 6);
  sets.Join(5, 2);
  EXPECT_THAT(FirstUnheld(sets, std::vector<bool>(7, false)), ElementsAre(0, 1, 2));
}

TEST(GaugeTest, OneHeldNodeHoldsASet) {
  DisjointSets sets;
  sets.Join(0, 1);
  sets.Join(2, 3);
  EXPECT_THAT(FirstUnheld(sets, {false, true, false, false}), ElementsAre(2));
  EXPECT_THAT(FirstUnheld(sets, {false, true, true, true}), IsEmpty());
}

}  // namespace
}  // namespace strata
