#include "core/world/map_class.h"

#include <algorithm>
#include <cstdint>
#include <cstdlib>
#include <string>
#include <vector>

#include "absl/strings/str_cat.h"
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/status_matchers.h"

namespace strata::testing {
namespace {

using ::testing::HasSubstr;
using Code = absl::StatusCode;

const std::vector<MapClass> kClasses = {{3, "ground", {1, 2, 3}}, {9, "12", {4, 5, 6}}};

TEST(MapClassTest, AClassWithoutANameIsCalledByItsNumber) {
  EXPECT_EQ(ClassOf(kClasses, 3), kClasses[0]);
  EXPECT_EQ(ClassOf(kClasses, 4), (MapClass{4, "4", DefaultClassColour(4)}));
}

TEST(MapClassTest, ATextIsANameFirstAndANumberElse) {
  EXPECT_THAT(ClassIdOf(kClasses, "ground"), IsOkAndHolds(3));
  EXPECT_THAT(ClassIdOf(kClasses, "12"), IsOkAndHolds(9));
  EXPECT_THAT(ClassIdOf(kClasses, "200"), IsOkAndHolds(200));
  EXPECT_THAT(ClassIdOf(kClasses, "256"), StatusIs(Code::kNotFound, HasSubstr("ground, 12")));
  EXPECT_THAT(ClassIdOf({}, "wall"), StatusIs(Code::kNotFound, HasSubstr("none")));
}

TEST(MapClassTest, ANameHasItsIdOrTakesTheWantedOrTheFirstFreeOne) {
  std::vector<MapClass> table = kClasses;
  EXPECT_THAT(IdInTable(table, "ground", 7), IsOkAndHolds(3));
  EXPECT_EQ(table, kClasses);
  EXPECT_THAT(IdInTable(table, "wall", 7), IsOkAndHolds(7));
  EXPECT_THAT(IdInTable(table, "pole", 3), IsOkAndHolds(1));
  EXPECT_THAT(IdInTable(table, "wire", 0), IsOkAndHolds(2));
  EXPECT_THAT(IdInTable(table, "roof", 1200), IsOkAndHolds(4));
  EXPECT_EQ(table.size(), 6U);
  EXPECT_EQ(table.back(), (MapClass{4, "roof", DefaultClassColour(4)}));
  EXPECT_THAT(IdInTable(table, "a b", 8), StatusIs(Code::kInvalidArgument, HasSubstr("a b")));
  while (table.size() < kMaxClassId) {
    ASSERT_TRUE(IdInTable(table, absl::StrCat("c", table.size()), 1).ok());
  }
  EXPECT_THAT(IdInTable(table, "more", 1), StatusIs(Code::kResourceExhausted, HasSubstr("more")));
}

TEST(MapClassTest, LabelsAreIdsOfClassesOrNone) {
  EXPECT_THAT(ValidateLabels(std::vector<std::uint16_t>{0, 1, 255}), IsOk());
  EXPECT_THAT(ValidateLabels({}), IsOk());
  EXPECT_THAT(ValidateLabels(std::vector<std::uint16_t>{0, 256}, 40),
              StatusIs(Code::kInvalidArgument, HasSubstr("label 256 of point 41")));
}

TEST(MapClassTest, ColoursOfIdsNearbyAreApart) {
  for (std::uint16_t id = 1; id <= 20; ++id) {
    for (std::uint16_t other = id + 1; other <= id + 5; ++other) {
      const Colour a = DefaultClassColour(id);
      const Colour b = DefaultClassColour(other);
      const int apart = std::max({std::abs(a.r - b.r), std::abs(a.g - b.g), std::abs(a.b - b.b)});
      EXPECT_GE(apart, 40) << id << " " << other;
    }
  }
}

}  // namespace
}  // namespace strata::testing
