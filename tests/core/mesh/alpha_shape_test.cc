#include "core/mesh/alpha_shape.h"

#include <limits>
#include <span>
#include <vector>

#include <Eigen/Geometry>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/mesh/mesh_check.h"
#include "tests/core/mesh/shapes.h"
#include "tests/support/simulator/simulator.h"
#include "tests/support/status_matchers.h"

namespace strata {
namespace {

using Eigen::Vector3d;
using testing::StatusIs;

TEST(AlphaShapeTest, SphereOfPointsIsClosed) {
  const std::vector<Vector3d> points = testing::SpherePoints(2000, 1.0, {400.0, 0.0, 9.0});
  // Large enough for the ball within: all is inside, the hull remains.
  const auto shape = MakeAlphaShape(points, {.alpha_m2 = 4.0}, Stop());
  STRATA_ASSERT_OK(shape);
  const MeshCheck check = CheckMesh(shape->mesh);
  EXPECT_TRUE(check.closed());
  EXPECT_TRUE(check.manifold());
  EXPECT_EQ(check.euler_characteristic, 2);
  EXPECT_NEAR(VolumeOf(shape->mesh), testing::SphereVolume(1.0), 0.01 * testing::SphereVolume(1.0));
}

TEST(AlphaShapeTest, AloneItJoinsThePoints) {
  const auto shape = MakeAlphaShape(testing::SpherePoints(2000, 1.0, Vector3d::Zero()), {}, Stop());
  STRATA_ASSERT_OK(shape);
  EXPECT_GT(shape->mesh.vertices.size(), 1900);
  EXPECT_GT(shape->alpha_m2, 0.001);
  EXPECT_LT(shape->alpha_m2, 0.1);
}

// A sheet has no inside: it faces its sensor all over.
TEST(AlphaShapeTest, SheetsFaceWhereTheyWereSeenFrom) {
  testing::Random random(5);
  std::vector<Vector3d> points;
  for (int i = 0; i < 900; ++i) {
    points.emplace_back(0.1 * (i % 30), 0.1 * (i / 30), 0.004 * random.Gaussian());
  }
  const std::vector<Eigen::Vector3f> towards(points.size(), Eigen::Vector3f(0, 0, -1));
  const auto shape = MakeAlphaShape(points, {.towards = towards, .spacing_m = 0.1}, Stop());
  STRATA_ASSERT_OK(shape);
  std::size_t sheet = 0;
  std::size_t wrong = 0;
  for (const Triangle& t : shape->mesh.triangles) {
    const Vector3d normal = AreaNormal(shape->mesh, t).normalized();
    ++sheet;
    wrong += normal.z() > 0.5 ? 1 : 0;
  }
  EXPECT_GT(sheet, 1500);
  // The backs of the flat tetrahedra that four neighbours make.
  EXPECT_LT(wrong, sheet / 2);
  EXPECT_THAT(MakeAlphaShape(points, {.towards = std::span(towards).first(3)}, Stop()),
              StatusIs(absl::StatusCode::kInvalidArgument, ::testing::HasSubstr("3 entries")));
}

TEST(AlphaShapeTest, FewAndOddPoints) {
  for (const std::size_t count : {0, 1, 3, 4}) {
    const auto shape =
        MakeAlphaShape(testing::SpherePoints(count, 1.0, Vector3d::Zero()), {}, Stop());
    STRATA_ASSERT_OK(shape);
  }
  std::vector<Vector3d> flat;
  for (int i = 0; i < 30; ++i) flat.emplace_back(i % 6, i / 6, 0.0);
  const auto shape = MakeAlphaShape(flat, {}, Stop());
  STRATA_ASSERT_OK(shape);
  EXPECT_TRUE(shape->mesh.triangles.empty());
  // All at one place, on one line, and far apart.
  const std::vector<Vector3d> same(50, Vector3d(1, 2, 3));
  std::vector<Vector3d> line;
  for (int i = 0; i < 50; ++i) line.emplace_back(i, i, i);
  std::vector<Vector3d> far = testing::SpherePoints(100, 1e-3, {1e8, 0, 0});
  far.emplace_back(-1e8, 0, 0);
  for (const auto& points : {same, line, far}) {
    EXPECT_THAT(
        MakeAlphaShape(points, {}, Stop()),
        ::testing::AnyOf(testing::IsOk(), StatusIs(absl::StatusCode::kInternal, ::testing::_)));
  }
  flat[3].x() = std::numeric_limits<double>::infinity();
  EXPECT_THAT(MakeAlphaShape(flat, {}, Stop()),
              StatusIs(absl::StatusCode::kInvalidArgument, ::testing::HasSubstr("point 3")));
  const std::vector<Vector3d> many(kMostAlphaPoints + 1);
  EXPECT_THAT(
      MakeAlphaShape(many, {}, Stop()),
      StatusIs(absl::StatusCode::kResourceExhausted, ::testing::HasSubstr("at most 200000")));
}

// The corners of a lattice lie on common balls, many at a time.
TEST(AlphaShapeTest, LatticeIsItsBox) {
  std::vector<Vector3d> points;
  for (int i = 0; i < 125; ++i) points.emplace_back(i % 5, i / 5 % 5, i / 25);
  const auto shape = MakeAlphaShape(points, {.alpha_m2 = 1.0}, Stop());
  STRATA_ASSERT_OK(shape);
  EXPECT_NEAR(VolumeOf(shape->mesh), 64.0, 1e-9);
  EXPECT_TRUE(CheckMesh(shape->mesh).closed());
}

}  // namespace
}  // namespace strata
