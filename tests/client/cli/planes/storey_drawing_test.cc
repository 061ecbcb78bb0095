#include "client/cli/planes/storey_drawing.h"

#include <cstddef>
#include <cstdio>
#include <map>
#include <sstream>
#include <string>
#include <vector>

#include <Eigen/Geometry>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "client/formats/file_bytes.h"
#include "tests/support/dxf_entities.h"
#include "tests/support/simulator/plane_room.h"
#include "tests/support/status_matchers.h"
#include "tests/support/temp_dir.h"

namespace strata::cli {
namespace {

using Eigen::Vector2d;
using ::strata::testing::DxfEntity;
using ::strata::testing::StatusIs;
using ::testing::HasSubstr;
using ::testing::Not;

StoreyPlan RoomPlan(const Eigen::Isometry3d& T) {
  auto plan =
      PlanOfStorey(testing::Moved(testing::DrawnRoom(), T), {.storey_z_m = T.translation().z()});
  STRATA_EXPECT_OK(plan);
  plan->obstacles.emplace_back(T.translation().head<2>(),
                               T.translation().head<2>() + Vector2d(0.5, 0.25));
  return *std::move(plan);
}

const Eigen::Isometry3d kFar = Eigen::Isometry3d(Eigen::Translation3d(500'000.25, -499'999.5, 42));

// The places of a group's M and L, by what the <desc> says of the paper, in metres of the map.
std::vector<Vector2d> PlacesOf(const std::string& svg, const std::string& group) {
  double x = 0, right = 0, step = 0, y = 0, down = 0, same = 0;
  const std::size_t desc = svg.find("<desc>");
  EXPECT_EQ(std::sscanf(svg.c_str() + desc,
                        "<desc>x = %lf m + (right - %lf) * %lf m, y = %lf m + (%lf - down) * %lf m",
                        &x,
                        &right,
                        &step,
                        &y,
                        &down,
                        &same),
            6);
  const std::size_t begin = svg.find(" d=\"", svg.find("<g id=\"" + group + "\">")) + 4;
  std::string path = svg.substr(begin, svg.find('"', begin) - begin);
  for (char& c : path) c = c == 'M' || c == 'L' || c == 'Z' ? ' ' : c;
  std::vector<Vector2d> places;
  std::istringstream numbers(path);
  for (Vector2d p; numbers >> p.x() >> p.y();) {
    places.emplace_back(x + (p.x() - right) * step, y + (down - p.y()) * step);
  }
  return places;
}

TEST(StoreyDrawingTest, SvgHasThePlanToScaleNearAndFar) {
  for (const Eigen::Isometry3d& T : {Eigen::Isometry3d(Eigen::Isometry3d::Identity()), kFar}) {
    const StoreyPlan plan = RoomPlan(T);
    const std::string svg = StoreySvg(plan, "room");
    const auto walls = PlacesOf(svg, "wall");
    ASSERT_EQ(walls.size(), 2 * plan.walls.size());
    for (std::size_t i = 0; i < walls.size(); ++i) {
      EXPECT_LT((walls[i] - plan.walls[i / 2][i % 2]).norm(), 1e-4);
    }
    const auto floor = PlacesOf(svg, "floor");
    ASSERT_EQ(floor.size(), 8U);
    EXPECT_LT((floor[0] - plan.floors[0][0]).norm(), 1e-4);
    EXPECT_EQ(PlacesOf(svg, "unseen").size(), 2U);
    EXPECT_THAT(svg, HasSubstr("<g id=\"obstacle\">"));
    // 4 m are 400 mm at 1:10, too long for A3.
    EXPECT_THAT(svg, HasSubstr(">1:20</text>"));
    EXPECT_THAT(svg, HasSubstr(">1 m</text>"));
    EXPECT_THAT(svg, HasSubstr("4.00 m by 3.00 m"));
    EXPECT_THAT(svg, HasSubstr("width=\"220.00mm\""));
    EXPECT_THAT(svg, Not(HasSubstr("nan")));
  }
}

TEST(StoreyDrawingTest, TitlesAreEscapedAndAPlanWithoutAnythingIsADrawing) {
  const std::string svg = StoreySvg({}, "a<b> & \x01 c");
  EXPECT_THAT(svg, HasSubstr("<title>a&lt;b> &amp;  c</title>"));
  EXPECT_THAT(svg, Not(HasSubstr("nan")));
  EXPECT_THAT(svg, Not(HasSubstr("inf")));
  EXPECT_THAT(svg, Not(HasSubstr("<g ")));
}

TEST(StoreyDrawingTest, DxfHasThePlanInMetresOfTheMap) {
  for (const Eigen::Isometry3d& T : {Eigen::Isometry3d(Eigen::Isometry3d::Identity()), kFar}) {
    const StoreyPlan plan = RoomPlan(T);
    std::map<std::string, std::vector<DxfEntity>> by_layer;
    for (const DxfEntity& e : testing::DxfSection(StoreyDxf(plan), "ENTITIES")) {
      by_layer[e.kind + " " + e.layer()].push_back(e);
    }
    const auto& walls = by_layer["LINE WALL"];
    ASSERT_EQ(walls.size(), plan.walls.size());
    for (std::size_t i = 0; i < walls.size(); ++i) {
      EXPECT_LT((walls[i].Point(10).head<2>() - plan.walls[i][0]).norm(), 2e-6);
      EXPECT_LT((walls[i].Point(11).head<2>() - plan.walls[i][1]).norm(), 2e-6);
      EXPECT_EQ(walls[i].Point(10).z(), 0.0);
    }
    EXPECT_EQ(by_layer["LINE UNSEEN"].size(), 1U);
    EXPECT_EQ(by_layer["POLYLINE FLOOR"].size(), 2U);
    EXPECT_EQ(by_layer["VERTEX FLOOR"].size(), 8U);
    ASSERT_EQ(by_layer["SOLID OBSTACLE"].size(), 1U);
    const DxfEntity& solid = by_layer["SOLID OBSTACLE"][0];
    EXPECT_NEAR((solid.Point(11) - solid.Point(10)).norm(), 0.5, 1e-5);
    EXPECT_NEAR((solid.Point(12) - solid.Point(10)).norm(), 0.25, 1e-5);
    EXPECT_NEAR((solid.Point(13) - solid.Point(12)).norm(), 0.5, 1e-5);
  }
}

TEST(StoreyDrawingTest, FilesByTheirEnding) {
  const testing::TempDir dir;
  const StoreyPlan plan = RoomPlan(Eigen::Isometry3d::Identity());
  STRATA_ASSERT_OK(WriteStorey(dir.path() / "a.svg", plan, "room"));
  STRATA_ASSERT_OK_AND_ASSIGN(const std::string svg, ReadFileBytes(dir.path() / "a.svg"));
  EXPECT_EQ(svg, StoreySvg(plan, "room"));
  STRATA_ASSERT_OK(WriteStorey(dir.path() / "a.DXF", plan, "room"));
  STRATA_ASSERT_OK_AND_ASSIGN(const std::string dxf, ReadFileBytes(dir.path() / "a.DXF"));
  EXPECT_EQ(dxf, StoreyDxf(plan));
  EXPECT_THAT(WriteStorey(dir.path() / "a.pdf", plan, "room"),
              StatusIs(absl::StatusCode::kInvalidArgument, HasSubstr(".svg and .dxf, got ")));
  EXPECT_THAT(WriteStorey(dir.path() / "no" / "a.svg", plan, "room"),
              StatusIs(absl::StatusCode::kFailedPrecondition, HasSubstr("no/a.svg")));
}

}  // namespace
}  // namespace strata::cli
