// Conformance: classes.
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/database_suite.h"
#include "tests/support/status_matchers.h"

namespace strata::testing {
namespace {

using ::testing::_;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using Code = absl::StatusCode;

TEST_P(DatabaseSuite, ClassesAreNamedAndKeepTheirIds) {
  const MapClass facade{7, "facade", {200, 100, 50}};
  const MapClass ground{2, "ground", {1, 2, 3}};
  EXPECT_THAT(db().maps().ListClasses({}, kMap), IsOkAndHolds(IsEmpty()));
  STRATA_ASSERT_OK(db().maps().SetClass({}, kMap, facade));
  STRATA_ASSERT_OK(db().maps().SetClass({}, kMap, ground));
  STRATA_ASSERT_OK(db().maps().SetClass({}, kMap, ground));
  const MapClass renamed{7, "wall", {255, 255, 255}};
  STRATA_ASSERT_OK(db().maps().SetClass({}, kMap, renamed));
  EXPECT_THAT(db().maps().ListClasses({}, kMap), IsOkAndHolds(ElementsAre(ground, renamed)));
  Reopen();
  EXPECT_THAT(db().maps().ListClasses({}, kMap), IsOkAndHolds(ElementsAre(ground, renamed)));
}

TEST_P(DatabaseSuite, BadAndTakenClassesAreRefused) {
  STRATA_ASSERT_OK(db().maps().SetClass({}, kMap, {1, "ground", {}}));
  EXPECT_THAT(db().maps().SetClass({}, kMap, {2, "ground", {}}),
              StatusIs(Code::kAlreadyExists, HasSubstr("ground")));
  EXPECT_THAT(db().maps().SetClass({}, kMap, {0, "wall", {}}),
              StatusIs(Code::kInvalidArgument, HasSubstr("[1, 255]")));
  EXPECT_THAT(db().maps().SetClass({}, kMap, {256, "wall", {}}),
              StatusIs(Code::kInvalidArgument, HasSubstr("256")));
  EXPECT_THAT(db().maps().SetClass({}, kMap, {3, "a wall", {}}),
              StatusIs(Code::kInvalidArgument, HasSubstr("class name")));
  EXPECT_THAT(db().maps().ListClasses({}, kMap), IsOkAndHolds(ElementsAre(_)));
}

}  // namespace
}  // namespace strata::testing
