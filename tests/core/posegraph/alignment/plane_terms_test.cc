#include "core/posegraph/alignment/plane_terms.h"

#include <cstddef>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace strata {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;

SharedPlane SeenBy(const std::vector<std::size_t>& scans) {
  SharedPlane plane;
  plane.plane.distance = static_cast<double>(scans.size());
  plane.from_edges = true;
  for (const std::size_t scan : scans) {
    plane.views.push_back({.scan = scan, .weight = 1.0 + static_cast<double>(scan)});
    plane.support_value += plane.views.back().weight;
  }
  return plane;
}

std::vector<std::size_t> ScansOf(const SharedPlane& plane) {
  std::vector<std::size_t> scans;
  for (const SharedPlane::View& view : plane.views) scans.push_back(view.scan);
  return scans;
}

// Far from the map's zero a plane that is turned by a degree passes it metres away.
TEST(IsExcludedTest, WhereItWasSeenItIsTheSamePlane) {
  SharedPlane found = SeenBy({1});
  const Eigen::Vector4d p(2.0, 1.0, 0.0, 1.0);
  found.views[0].moments = 3.0 * p * p.transpose();
  const std::vector<Pose> poses(2, Pose(Eigen::Translation3d(200.0, 0.0, 5.0)));
  found.plane = {Eigen::Vector3d(0.02, 0.0, 1.0).normalized(), 0.0};
  found.plane.distance = found.plane.normal.dot(poses[1] * p.head<3>());
  EXPECT_TRUE(IsExcluded(found, {{Eigen::Vector3d::UnitZ(), 5.1}, {1}}, poses));
  EXPECT_FALSE(IsExcluded(found, {{Eigen::Vector3d::UnitZ(), 5.3}, {1}}, poses));
  EXPECT_FALSE(IsExcluded(found, {{Eigen::Vector3d::UnitZ(), 5.1}, {0}}, poses));
  EXPECT_FALSE(IsExcluded(found, {{-Eigen::Vector3d::UnitZ(), -5.1}, {1}}, poses));
}

TEST(SplitByPartTest, EachPartHasItsOwnPlane) {
  const std::vector<SharedPlane> split =
      SplitByPart({SeenBy({0, 1, 2, 3, 4}), SeenBy({1, 3})}, {0, 0, 2, 0, 2});
  ASSERT_EQ(split.size(), 3U);
  EXPECT_THAT(ScansOf(split[0]), ElementsAre(0, 1, 3));
  EXPECT_EQ(split[0].support_value, 1.0 + 2.0 + 4.0);
  EXPECT_EQ(split[0].plane.distance, 5.0);
  EXPECT_TRUE(split[0].from_edges);
  EXPECT_THAT(ScansOf(split[1]), ElementsAre(2, 4));
  EXPECT_THAT(ScansOf(split[2]), ElementsAre(1, 3));
}

TEST(SplitByPartTest, OneScanOfAPartSharesItWithNobody) {
  EXPECT_THAT(SplitByPart({SeenBy({0, 2})}, {0, 0, 2}), IsEmpty());
  EXPECT_THAT(SplitByPart({}, {}), IsEmpty());
}

}  // namespace
}  // namespace strata
