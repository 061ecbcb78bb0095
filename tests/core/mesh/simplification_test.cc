#include "core/mesh/simplification.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/mesh/alpha_shape.h"
#include "core/mesh/mesh_check.h"
#include "tests/core/mesh/shapes.h"
#include "tests/support/status_matchers.h"

namespace strata {
namespace {

TEST(SimplificationTest, FewerTrianglesOfTheSameBall) {
  const auto shape =
      MakeAlphaShape(testing::SpherePoints(5000, 1.0, {4e5, 5e6, 30.0}), {.alpha_m2 = 4.0}, Stop());
  STRATA_ASSERT_OK(shape);
  ASSERT_GT(shape->mesh.triangles.size(), 9000);
  const TriangleMesh simple = Simplify(shape->mesh, 1000);
  EXPECT_LE(simple.triangles.size(), 1000);
  EXPECT_GE(simple.triangles.size(), 900);
  EXPECT_TRUE(CheckMesh(simple).closed());
  EXPECT_EQ(CheckMesh(simple).euler_characteristic, 2);
  EXPECT_NEAR(VolumeOf(simple), testing::SphereVolume(1.0), 0.02 * testing::SphereVolume(1.0));
  EXPECT_EQ(Simplify(shape->mesh, 1000).triangles, simple.triangles);
}

TEST(SimplificationTest, NothingToDo) {
  EXPECT_TRUE(Simplify({}, 10).triangles.empty());
  EXPECT_EQ(Simplify(testing::TetrahedronMesh(), 4).triangles,
            testing::TetrahedronMesh().triangles);
}

}  // namespace
}  // namespace strata
