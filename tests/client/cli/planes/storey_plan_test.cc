#include "client/cli/planes/storey_plan.h"

#include <cmath>
#include <limits>
#include <numbers>
#include <random>
#include <utility>
#include <vector>

#include <Eigen/Geometry>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/simulator/plane_room.h"
#include "tests/support/status_matchers.h"

namespace strata::cli {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;
using ::strata::testing::StatusIs;
using ::testing::HasSubstr;

double LengthOf(const std::vector<PlanSegment>& segments) {
  double length = 0.0;
  for (const auto& [a, b] : segments) length += (b - a).norm();
  return length;
}

// Whether a segment goes through the place.
bool IsDrawn(const std::vector<PlanSegment>& segments, const Vector2d& p) {
  for (const auto& [a, b] : segments) {
    if ((p - a).norm() + (b - p).norm() < (b - a).norm() + 1e-6) return true;
  }
  return false;
}

TEST(StoreyPlanTest, DoorAndWindowAreGapsAndWhatWasHiddenIsApart) {
  STRATA_ASSERT_OK_AND_ASSIGN(const StoreyPlan plan,
                              PlanOfStorey(testing::DrawnRoom(), StoreyOptions()));
  EXPECT_EQ(plan.cut_z_m, 1.2);
  EXPECT_NEAR(LengthOf(plan.walls), (4 - 0.9) + (4 - 1) + 3 + (3 - 1), 1e-9);
  EXPECT_NEAR(LengthOf(plan.unseen), 1.0, 1e-9);
  EXPECT_FALSE(IsDrawn(plan.walls, {1.5, 0}));  // door
  EXPECT_TRUE(IsDrawn(plan.walls, {0.9, 0}));
  EXPECT_TRUE(IsDrawn(plan.walls, {2.0, 0}));
  EXPECT_FALSE(IsDrawn(plan.walls, {2.0, 3}));  // window
  EXPECT_FALSE(IsDrawn(plan.unseen, {2.0, 3}));
  EXPECT_FALSE(IsDrawn(plan.walls, {4, 1.5}));  // behind the cupboard
  EXPECT_TRUE(IsDrawn(plan.unseen, {4, 1.5}));
  ASSERT_EQ(plan.floors.size(), 2U);  // with its shaft; not the ceiling
}

TEST(StoreyPlanTest, TheHeightOfTheCutDecides) {
  const auto lengths = [](double cut_m) {
    const auto plan = PlanOfStorey(testing::DrawnRoom(), {.cut_height_m = cut_m});
    STRATA_EXPECT_OK(plan);
    return std::pair(LengthOf(plan->walls), LengthOf(plan->unseen));
  };
  EXPECT_NEAR(lengths(2.2).first, 14.0, 1e-9);         // above all of them
  EXPECT_NEAR(lengths(1.7).first, 3.1 + 3 + 6, 1e-9);  // above the cupboard
  EXPECT_NEAR(lengths(1.7).second, 0.0, 1e-9);
  EXPECT_NEAR(lengths(0.5).first, 3.1 + 4 + 3 + 2, 1e-9);  // below the window
  // At corners: of two heights that are next to each other one of the two lengths.
  for (const double corner : {0.2, 0.9, 1.5, 2.0, 2.1, 2.5}) {
    const double at = lengths(corner).first;
    EXPECT_TRUE(std::abs(at - lengths(corner - 1e-9).first) < 1e-6 ||
                std::abs(at - lengths(corner + 1e-9).first) < 1e-6)
        << corner;
  }
}

TEST(StoreyPlanTest, ATurnedBuildingFarFromTheOriginHasTheSamePlan) {
  const Eigen::Isometry3d T = Eigen::Translation3d(500'000.0, -500'000.0, 31.7) *
                              Eigen::Isometry3d(Eigen::AngleAxisd(1.1, Vector3d::UnitZ()));
  STRATA_ASSERT_OK_AND_ASSIGN(
      const StoreyPlan plan,
      PlanOfStorey(testing::Moved(testing::DrawnRoom(), T), {.storey_z_m = 31.7}));
  EXPECT_NEAR(LengthOf(plan.walls), 11.1, 1e-6);
  EXPECT_NEAR(LengthOf(plan.unseen), 1.0, 1e-6);
  const auto at = [&T](double x, double y) { return (T * Vector3d(x, y, 0)).head<2>().eval(); };
  EXPECT_TRUE(IsDrawn(plan.walls, at(2.0, 0)));
  EXPECT_FALSE(IsDrawn(plan.walls, at(1.5, 0)));
  EXPECT_TRUE(IsDrawn(plan.unseen, at(4, 1.5)));
}

// Places along the line in which a ragged sloped plane is cut, inside and outside of the polygon.
TEST(StoreyPlanTest, CutsOfRaggedPolygonsAreWhereThePolygonIs) {
  std::mt19937 random(11);
  std::uniform_real_distribution<double> radius(1.0, 5.0);
  for (int world = 0; world < 20; ++world) {
    const Vector3d normal =
        Vector3d(radius(random) - 3.0, radius(random) - 3.0, 0.5 * (world % 3)).normalized();
    const Vector3d level(-normal.y(), normal.x(), 0.0);
    const Vector3d u = level.normalized();
    const Vector3d v = normal.cross(u);
    const auto star = [&](int corners, double share) {
      PlaneRing ring;
      for (int i = 0; i < corners; ++i) {
        const double angle = 2.0 * std::numbers::pi * i / corners;
        ring.emplace_back(share * radius(random) * (std::cos(angle) * u + std::sin(angle) * v));
      }
      return ring;
    };
    PlaneModel model;
    model.planes = {testing::DrawnPlane(1,
                                        world % 3 == 0 ? PlaneKind::kWall : PlaneKind::kSloped,
                                        normal,
                                        star(40, 1.0),
                                        {{star(9, 0.19), world % 2 == 0}})};
    STRATA_ASSERT_OK_AND_ASSIGN(const StoreyPlan plan,
                                PlanOfStorey(model, {.storey_z_m = -0.9, .cut_height_m = 1.0}));
    const PlanePolygon& polygon = model.planes[0].polygons[0];
    const Vector3d start = v * (0.1 / v.z());  // where the plane has the height of the cut
    for (double along = -6.0; along < 6.0; along += 0.0317) {
      const Vector3d p = start + along * u;
      EXPECT_EQ(IsDrawn(plan.walls, p.head<2>()), testing::IsInside(polygon, p, normal));
      EXPECT_EQ(IsDrawn(plan.unseen, p.head<2>()),
                world % 2 == 1 && testing::IsInside(polygon.holes[0].ring, p, normal));
    }
  }
}

TEST(StoreyPlanTest, ObstaclesAreTheOccupiedCells) {
  OccupancyGrid grid{.width = 4,
                     .height = 3,
                     .resolution_m = 0.5,
                     .x_m = 10.0,
                     .y_m = -2.0,
                     .cells = std::vector<GridCell>(12, GridCell::kFree)};
  for (const int cell : {0, 1, 3, 6, 7, 8}) {
    grid.cells[static_cast<std::size_t>(cell)] = GridCell::kOccupied;
  }
  StoreyPlan plan;
  EXPECT_TRUE(ExtentOf(plan).isEmpty());
  AddObstacles(grid, plan);
  EXPECT_EQ(plan.obstacles.size(), 4U);
  for (int i = 0; i < 12; ++i) {
    const Vector2d centre(10.25 + 0.5 * (i % 4), -1.75 + 0.5 * (i / 4));
    int in = 0;
    for (const auto& box : plan.obstacles) in += box.contains(centre) ? 1 : 0;
    EXPECT_EQ(in, grid.cells[static_cast<std::size_t>(i)] == GridCell::kOccupied ? 1 : 0);
  }
  EXPECT_EQ(ExtentOf(plan).min(), Vector2d(10.0, -2.0));
  EXPECT_EQ(ExtentOf(plan).max(), Vector2d(12.0, -0.5));
}

// The same places are drawn as without a region, where they are in it.
TEST(StoreyPlanTest, ARegionLeavesOutWhatIsBeyond) {
  const Eigen::AlignedBox2d region(Vector2d(0.7, -0.5), Vector2d(4.5, 1.75));
  STRATA_ASSERT_OK_AND_ASSIGN(const StoreyPlan whole, PlanOfStorey(testing::DrawnRoom(), {}));
  STRATA_ASSERT_OK_AND_ASSIGN(StoreyPlan part,
                              PlanOfStorey(testing::DrawnRoom(), {.region = region}));
  for (int i = 0; i < 4000; ++i) {
    const double along = 0.0017 + 0.001 * i;
    for (const Vector2d& p : {Vector2d(along, 0), Vector2d(4, along), Vector2d(along, 3)}) {
      EXPECT_EQ(IsDrawn(part.walls, p), IsDrawn(whole.walls, p) && region.contains(p)) << p;
      EXPECT_EQ(IsDrawn(part.unseen, p), IsDrawn(whole.unseen, p) && region.contains(p)) << p;
    }
  }
  EXPECT_TRUE(ExtentOf(part).max().isApprox(Vector2d(4.0, 1.75), 1e-5));
  EXPECT_TRUE(ExtentOf(part).min().isApprox(Vector2d(0.7, 0.0), 1e-5));
  OccupancyGrid grid{.width = 2,
                     .height = 1,
                     .resolution_m = 1.0,
                     .x_m = 4.0,
                     .y_m = 0.0,
                     .cells = {GridCell::kOccupied, GridCell::kOccupied}};
  AddObstacles(grid, part);
  ASSERT_EQ(part.obstacles.size(), 1U);
  EXPECT_EQ(part.obstacles[0].max(), Vector2d(4.5, 1.0));
  const Eigen::AlignedBox2d far(Vector2d(50, 50), Vector2d(60, 60));
  EXPECT_THAT(PlanOfStorey(testing::DrawnRoom(), {.region = far}),
              StatusIs(absl::StatusCode::kNotFound, HasSubstr("within x 0.0 to 4.0")));
}

TEST(StoreyPlanTest, WhereNothingIsTheFloorsAreNamed) {
  EXPECT_THAT(PlanOfStorey(testing::DrawnRoom(), {.storey_z_m = 7.0}),
              StatusIs(absl::StatusCode::kNotFound, HasSubstr("the largest floors are at 0.0 m")));
  PlaneModel many = testing::DrawnRoom();
  for (int i = 0; i < 20; ++i) {
    for (ModelPlane plane : testing::DrawnRoom().planes) many.planes.push_back(std::move(plane));
  }
  EXPECT_THAT(PlanOfStorey(many, {.storey_z_m = 7.0}),
              StatusIs(absl::StatusCode::kNotFound, HasSubstr("the largest floors are at 0.0 m")));
  EXPECT_THAT(PlanOfStorey({}, {}),
              StatusIs(absl::StatusCode::kNotFound, HasSubstr("the model has no floors")));
}

TEST(StoreyPlanTest, OptionsAndModelsThatAreNoneAreRefused) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  for (const StoreyOptions& options : {StoreyOptions{.storey_z_m = nan},
                                       StoreyOptions{.storey_z_m = 2e6},
                                       StoreyOptions{.cut_height_m = 0.0},
                                       StoreyOptions{.cut_height_m = nan},
                                       StoreyOptions{.cut_height_m = 101.0}}) {
    EXPECT_THAT(PlanOfStorey(testing::DrawnRoom(), options),
                StatusIs(absl::StatusCode::kInvalidArgument, HasSubstr(" is not ")));
  }
  PlaneModel model = testing::DrawnRoom();
  model.planes[0].polygons[0].outer[0].x() = nan;
  EXPECT_THAT(PlanOfStorey(model, {}),
              StatusIs(absl::StatusCode::kInvalidArgument, HasSubstr("plane 1")));
}

}  // namespace
}  // namespace strata::cli
