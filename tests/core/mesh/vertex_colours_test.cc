#include "core/mesh/vertex_colours.h"

#include <vector>

#include <Eigen/Geometry>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/core/mesh/shapes.h"
#include "tests/support/status_matchers.h"

namespace strata {
namespace {

using Eigen::Vector3d;
using testing::At;
using ::testing::ElementsAre;
using ::testing::IsEmpty;

constexpr Colour kRed = {200, 0, 0};
constexpr Colour kBlue = {0, 0, 100};
constexpr Colour kGrey = {128, 128, 128};

// Four vertices a metre apart along x, far from zero, and one that no triangle has.
TriangleMesh Strip() {
  TriangleMesh mesh;
  for (int i = 0; i < 4; ++i) mesh.vertices.emplace_back(1e6 + i, 0, 0);
  mesh.vertices.emplace_back(1e6, 50, 0);
  mesh.triangles = {{0, 1, 2}, {1, 2, 3}};
  return mesh;
}

PointCloud Dots(const std::vector<Eigen::Vector3f>& points, const std::vector<Colour>& colours) {
  PointCloud cloud;
  cloud.points = points;
  cloud.colour = colours;
  return cloud;
}

TEST(VertexColoursTest, NearPointsCountMost) {
  const TriangleMesh mesh = Strip();
  VertexColours colours(mesh, 0.5);
  // Of two points at the same distance the mean; of others the near one, by (1 − d)².
  STRATA_ASSERT_OK(colours.Add(
      Dots({{0.1F, 0, 0}, {-0.1F, 0, 0}, {1, 0, 0}, {1.25F, 0, 0}}, {kRed, kBlue, kRed, kBlue}),
      At({1e6, 0, 0}),
      Stop()));
  const std::vector<Colour> found = colours.Colours();
  EXPECT_EQ(found[0], (Colour{100, 0, 50}));
  EXPECT_EQ(found[1], (Colour{160, 0, 20}));
}

TEST(VertexColoursTest, VerticesWithoutPointsAreAsTheirNeighbours) {
  const TriangleMesh mesh = Strip();
  VertexColours colours(mesh, 0.5);
  STRATA_ASSERT_OK(
      colours.Add(Dots({{0, 0, 0}, {1, 0, 0}}, {kRed, kRed}), At({1e6, 0, 0}), Stop()));
  EXPECT_THAT(colours.Colours(), ElementsAre(kRed, kRed, kRed, kRed, kGrey));
}

TEST(VertexColoursTest, CloudsWithoutColoursSayNothing) {
  const TriangleMesh mesh = Strip();
  VertexColours colours(mesh, 0.5);
  STRATA_ASSERT_OK(colours.Add(Dots({{0, 0, 0}}, {}), At({1e6, 0, 0}), Stop()));
  EXPECT_THAT(colours.Colours(), IsEmpty());
  STRATA_ASSERT_OK(colours.Add(Dots({{1, 0, 0}}, {kBlue}), At({1e6, 0, 0}), Stop()));
  EXPECT_EQ(colours.Colours()[1], kBlue);
}

}  // namespace
}  // namespace strata
