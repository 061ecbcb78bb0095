#include "core/registration/neighbours.h"

#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/status_matchers.h"

namespace strata {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

std::vector<Pose> Along(const std::vector<double>& x) {
  std::vector<Pose> poses;
  for (const double v : x) poses.push_back(MakePose(Eigen::Quaterniond::Identity(), {v, 0, 0}));
  return poses;
}

TEST(SelectNeighboursTest, NearestWithinTheRadiusInOrder) {
  const auto poses = Along({0, 10, 3, -40, 1, 20});
  EXPECT_THAT(SelectNeighbours(poses, Along({2})[0], {.radius_m = 9.0, .max_scans = 15}),
              ElementsAre(0, 1, 2, 4));
  EXPECT_THAT(SelectNeighbours(poses, Along({2})[0], {.radius_m = 9.0, .max_scans = 2}),
              ElementsAre(2, 4));
}

TEST(SelectNeighboursTest, LaterScanWinsATie) {
  EXPECT_THAT(SelectNeighbours(Along({1, 1, 1}), Along({0})[0], {.radius_m = 5.0, .max_scans = 1}),
              ElementsAre(2));
}

TEST(SelectNeighboursTest, NoneInReachIsEmpty) {
  EXPECT_THAT(SelectNeighbours(Along({100}), Along({0})[0]), IsEmpty());
  EXPECT_THAT(SelectNeighbours({}, Along({0})[0]), IsEmpty());
}

TEST(NeighbourPolicyTest, ValidateNamesEveryViolation) {
  STRATA_EXPECT_OK(NeighbourPolicy().Validate());
  EXPECT_THAT((NeighbourPolicy{.radius_m = -1.0, .max_scans = 0}).Validate(),
              testing::StatusIs(absl::StatusCode::kInvalidArgument,
                                AllOf(HasSubstr("radius_m is -1"), HasSubstr("max_scans is 0"))));
}

}  // namespace
}  // namespace strata
