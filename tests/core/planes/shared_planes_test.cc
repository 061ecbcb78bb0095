#include "core/planes/shared_planes.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <vector>

#include "absl/status/status.h"
#include <Eigen/Core>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/geometry/pose.h"
#include "core/geometry/primitives.h"
#include "core/planes/extraction.h"
#include "core/planes/moments.h"
#include "core/planes/scan_planes.h"
#include "tests/support/simulator/scene.h"
#include "tests/support/simulator/simulator.h"
#include "tests/support/status_matchers.h"

namespace strata {
namespace {

using ::testing::AllOf;
using testing::Box;
using ::testing::HasSubstr;
using testing::Random;
using testing::Scene;
using testing::SensorOptions;
using testing::SimulateScan;
using testing::StatusIs;

struct Views {
  std::vector<ScanPlanes> planes;
  std::vector<Pose> truth;

  std::vector<PosedPlanes> At(const std::vector<Pose>& poses) const {
    std::vector<PosedPlanes> posed;
    for (std::size_t i = 0; i < planes.size(); ++i) posed.push_back({&planes[i], poses[i]});
    return posed;
  }
};

Views Look(const Scene& scene, const std::vector<Eigen::Vector3d>& from, std::uint64_t seed) {
  Views views;
  SensorOptions sensor;
  for (const Eigen::Vector3d& at : from) {
    const Eigen::Quaterniond turn(
        Eigen::AngleAxisd(0.7 * static_cast<double>(views.truth.size()), Eigen::Vector3d::UnitZ()));
    views.truth.push_back(MakePose(turn, at));
    views.planes.push_back(
        ExtractPlanes(SimulateScan(scene, sensor, views.truth.back(), seed + views.truth.size())));
  }
  return views;
}

std::vector<Pose> Disturbed(std::vector<Pose> poses, double m, double rad, std::uint64_t seed) {
  Random random(seed);
  for (Pose& T : poses) {
    Vector6d step;
    for (int k = 0; k < 6; ++k) step(k) = (k < 3 ? rad : m) * random.Gaussian();
    T = Retract(T, step);
  }
  return poses;
}

const SharedPlane* PlaneNear(const std::vector<SharedPlane>& planes, const Plane& truth, double m) {
  for (const SharedPlane& g : planes) {
    if (!g.from_edges && g.plane.normal.dot(truth.normal) > 0.999 &&
        std::abs(g.plane.distance - truth.distance) < m) {
      return &g;
    }
  }
  return nullptr;
}

Scene Yard() {
  Scene scene;
  scene.Add(Box({-40, -40, -1}, {40, 40, 0}));
  scene.Add(Box({8, -6, 0}, {16, 6, 5}));
  scene.Build();
  return scene;
}

const std::vector<Eigen::Vector3d>& AroundTheYard() {
  static const std::vector<Eigen::Vector3d> places = {
      {0, -2, 1.5}, {2, 4, 1.5}, {4, -9, 1.5}, {12, -14, 1.5}, {20, -8, 1.5}, {22, 2, 1.5}};
  return places;
}

// What a patch of a hill misses of the hill's other patches is no error of poses: held together as
// one plane, they would flatten it. With true poses they find little wrong.
TEST(SharedPlanesTest, HillsAreNotFlattened) {
  Scene hills;
  const Eigen::AlignedBox2d area(Eigen::Vector2d(-60, -60), Eigen::Vector2d(60, 60));
  hills.SetTerrain(area, 0.25, [](double x, double) { return 1.6 * std::sin(x / 20.0); });
  hills.Build();
  std::vector<Eigen::Vector3d> way;
  for (double x = -24.0; x <= 24.0; x += 2.0)
    way.emplace_back(x, 0.0, 1.6 * std::sin(x / 20.0) + 1.7);
  const Views views = Look(hills, way, 20261127);
  double chi2 = 0.0;
  int count = 0;
  for (const SharedPlane& plane : FindSharedPlanes(views.At(views.truth))) {
    for (const SharedPlane::View& view : plane.views) {
      Eigen::Vector4d p;
      p << plane.plane.normal, -plane.plane.distance;
      const Eigen::Vector4d in_scan = views.truth[view.scan].matrix().transpose() * p;
      chi2 += in_scan.dot(view.moments * in_scan);
      ++count;
    }
  }
  ASSERT_GT(count, 0);
  EXPECT_LT(chi2 / count, 1.5);  // 5.6 where they are held together
}

TEST(SharedPlanesTest, FindsWallsAndFloorOfDisturbedScans) {
  const Views views = Look(Yard(), AroundTheYard(), 10);
  const std::vector<SharedPlane> planes =
      FindSharedPlanes(views.At(Disturbed(views.truth, 0.03, 0.005, 11)));
  const SharedPlane* floor = PlaneNear(planes, {.normal = {0, 0, 1}, .distance = 0.0}, 0.05);
  ASSERT_NE(floor, nullptr);
  EXPECT_EQ(floor->views.size(), 6U);
  const SharedPlane* wall = PlaneNear(planes, {.normal = {-1, 0, 0}, .distance = -8.0}, 0.05);
  ASSERT_NE(wall, nullptr);
  EXPECT_GE(wall->views.size(), 3U);
  EXPECT_EQ(PlaneNear(planes, {.normal = {1, 0, 0}, .distance = 16.0}, 0.05)->views.size(), 2U);
}

TEST(SharedPlanesTest, ViewsAreInformationAboutThePlane) {
  const Views views = Look(Yard(), AroundTheYard(), 20);
  const SharedPlaneOptions options;
  const std::vector<SharedPlane> planes = FindSharedPlanes(views.At(views.truth), options);
  ASSERT_FALSE(planes.empty());
  for (const SharedPlane& g : planes) {
    ASSERT_GE(g.views.size(), 2U);
    double value = 0.0;
    for (std::size_t i = 0; i < g.views.size(); ++i) {
      const SharedPlane::View& s = g.views[i];
      if (i > 0) {
        EXPECT_GT(s.scan, g.views[i - 1].scan);
      }
      value += s.weight;
      const Eigen::Matrix4d in_map = Moved(views.truth[s.scan], s.moments);
      EXPECT_LT(RmsDistance(in_map, g.plane), 0.06);
      const double best = 1.0 / (options.sigma_floor_m * options.sigma_floor_m);
      EXPECT_LE(s.moments(3, 3), 10 * options.max_measurements * best);
    }
    EXPECT_NEAR(value, g.support_value, 1e-9 * value);
  }
}

// Held at the true poses, what a shared plane's views saw lies in one plane: nothing was joined
// that is none, whatever the poses were when it was found.
void ExpectNothingFalse(const Views& views, const std::vector<SharedPlane>& planes, double rms_m) {
  for (const SharedPlane& g : planes) {
    Eigen::Matrix4d all = Eigen::Matrix4d::Zero();
    for (const SharedPlane::View& s : g.views) all += Moved(views.truth[s.scan], s.moments);
    EXPECT_LT(std::sqrt(FitMoments(all).eigenvalues(0)), rms_m)
        << (g.from_edges ? "edges" : "patches") << ", value " << g.support_value << ", views "
        << g.views.size() << ", normal " << g.plane.normal.transpose();
  }
}

TEST(SharedPlanesTest, KerbAndRampAndFloorStayApart) {
  Scene scene;
  scene.Add(Box({-40, -40, -1}, {4, 40, 0}));
  scene.Add(Box({4, -40, -1}, {14, 40, 0.05}));
  scene.Add(testing::RampX(-6, -40, -40, 40, 0.0, 0.594));  // 1°
  scene.Build();
  const Views views =
      Look(scene, {{0, -6, 1.5}, {0, 0, 1.5}, {1, 6, 1.5}, {-3, 3, 1.5}, {-5, -3, 1.5}}, 30);
  for (const std::uint64_t seed : {31, 32, 33, 34, 35}) {
    SCOPED_TRACE(seed);
    const std::vector<SharedPlane> planes =
        FindSharedPlanes(views.At(Disturbed(views.truth, 0.03, 0.005, seed)));
    EXPECT_FALSE(planes.empty());
    ExpectNothingFalse(views, planes, 0.02);
  }
}

TEST(SharedPlanesTest, RollingGroundIsNoPlane) {
  Scene scene;
  scene.SetTerrain({Eigen::Vector2d(-40, -40), Eigen::Vector2d(40, 40)},
                   0.5,
                   [](double x, double y) { return 0.5 * std::sin(x / 7.0) * std::cos(y / 9.0); });
  scene.Build();
  std::vector<Eigen::Vector3d> places;
  for (int i = 0; i < 10; ++i) places.emplace_back(-18 + 4.0 * i, 0.5 * i, 2.0);
  const Views views = Look(scene, places, 40);
  for (const std::uint64_t seed : {41, 42, 43}) {
    SCOPED_TRACE(seed);
    ExpectNothingFalse(
        views, FindSharedPlanes(views.At(Disturbed(views.truth, 0.03, 0.005, seed))), 0.03);
  }
}

// Wide and flat within every view, but not as a whole.
TEST(SharedPlanesTest, ALongBendIsNotFlattened) {
  constexpr double kRadius = 800.0;
  Scene scene;
  scene.SetTerrain({Eigen::Vector2d(-100, -15), Eigen::Vector2d(100, 15)},
                   0.5,
                   [](double x, double) { return x * x / (2 * kRadius); });
  scene.Build();
  std::vector<Eigen::Vector3d> places;
  for (int i = 0; i < 16; ++i) {
    const double x = -75 + 10.0 * i;
    places.emplace_back(x, 0.0, 1.5 + x * x / (2 * kRadius));
  }
  const Views views = Look(scene, places, 50);
  const std::vector<SharedPlane> planes = FindSharedPlanes(views.At(views.truth));
  ExpectNothingFalse(views, planes, 0.04);
}

TEST(SharedPlanesTest, OppositeSidesOfAThinWallAreTwoPlanes) {
  Scene scene;
  scene.Add(Box({-40, -40, -1}, {40, 40, 0}));
  scene.Add(Box({-6, -0.06, 0}, {6, 0.06, 3}));
  scene.Build();
  const Views views = Look(scene, {{-2, -5, 1.5}, {2, -5, 1.5}, {-2, 5, 1.5}, {2, 5, 1.5}}, 40);
  const std::vector<SharedPlane> planes = FindSharedPlanes(views.At(views.truth));
  const SharedPlane* south = PlaneNear(planes, {.normal = {0, -1, 0}, .distance = 0.06}, 0.03);
  const SharedPlane* north = PlaneNear(planes, {.normal = {0, 1, 0}, .distance = 0.06}, 0.03);
  ASSERT_NE(south, nullptr);
  ASSERT_NE(north, nullptr);
  EXPECT_EQ(south->views.size(), 2U);
  EXPECT_EQ(north->views.size(), 2U);
}

struct Rim {
  Eigen::Vector3d from, along;
};

// Edges of 8 m in the map, as a scan at `at` has them.
ScanPlanes EdgesSeenFrom(const Eigen::Vector3d& at, const std::vector<Rim>& rims) {
  ScanPlanes planes;
  for (const Rim& rim : rims) {
    EdgeFeature edge;
    for (int k = 0; k <= 10; ++k) edge.points.push_back(rim.from + 0.8 * k * rim.along - at);
    edge.line = {.origin = rim.from + 4.0 * rim.along - at, .direction = rim.along};
    edge.length_m = 8.0;
    planes.edges.push_back(edge);
  }
  return planes;
}

std::vector<SharedPlane> PlanesOfEdges(const std::vector<Eigen::Vector3d>& places,
                                       const std::vector<std::vector<Rim>>& rims) {
  std::vector<ScanPlanes> seen;
  for (std::size_t k = 0; k < places.size(); ++k) {
    seen.push_back(EdgesSeenFrom(places[k], rims[k]));
  }
  std::vector<PosedPlanes> posed;
  for (std::size_t k = 0; k < places.size(); ++k) {
    posed.push_back({&seen[k], MakePose(Eigen::Quaterniond::Identity(), places[k])});
  }
  return FindSharedPlanes(posed);
}

const Eigen::Vector3d kAlongX(1, 0, 0), kAlongY(0, 1, 0);

// The rim of a deck's underside seems somewhat too low from below and too high from above.
TEST(SharedPlanesTest, EdgesSeenFromAboveAndFromBelowAreTwoPlanes) {
  const auto rim = [](double z) {
    return std::vector<Rim>{{{-6, -4, z}, kAlongX}, {{-6, 4, z}, kAlongX}, {{5, -3, z}, kAlongY}};
  };
  const std::vector<SharedPlane> planes = PlanesOfEdges(
      {{-2, 0, 1}, {2, 0, 1}, {-2, 0, 4}, {2, 0, 4}}, {rim(2.97), rim(2.97), rim(3.03), rim(3.03)});
  ASSERT_EQ(planes.size(), 2U);
  for (const SharedPlane& plane : planes) {
    ASSERT_EQ(plane.views.size(), 2U);
    const bool above = plane.views.front().scan >= 2;
    EXPECT_EQ(plane.views.back().scan, plane.views.front().scan + 1);
    EXPECT_NEAR(std::abs(plane.plane.distance), above ? 3.03 : 2.97, 1e-6);
    EXPECT_NEAR(plane.plane.normal.z(), above ? 1.0 : -1.0, 1e-6);
  }
}

// Beams are close beside each other: what stands upright is where it seems to be from either side.
TEST(SharedPlanesTest, EdgesInAnUprightPlaneAreOnePlaneFromBothSides) {
  const std::vector<Rim> rims = {
      {{0, -4, 1}, kAlongY}, {{0, -4, 3}, kAlongY}, {{0, 4, 0}, Eigen::Vector3d(0, 0, 1)}};
  const std::vector<SharedPlane> planes = PlanesOfEdges({{-5, 0, 1}, {5, 0, 1}}, {rims, rims});
  ASSERT_EQ(planes.size(), 1U);
  EXPECT_EQ(planes[0].views.size(), 2U);
}

TEST(SharedPlanesTest, ParallelEdgesAreNoPlane) {
  std::vector<Rim> rims;
  for (const double y : {-3.0, 0.0, 3.0}) rims.push_back({{-4, y, 1.5 + 0.3 * y}, kAlongX});
  const std::vector<Eigen::Vector3d> places = {{-2, 0, 4}, {2, 0, 4}};
  EXPECT_THAT(PlanesOfEdges(places, {rims, rims}), ::testing::IsEmpty());
  rims.push_back({{5, -4, 1.5 - 0.3 * 4}, Eigen::Vector3d(0, 1, 0.3).normalized()});
  EXPECT_EQ(PlanesOfEdges(places, {rims, rims}).size(), 1U);
}

TEST(SharedPlanesTest, AViewThatIsOffPullsLess) {
  const Views views = Look(Yard(), AroundTheYard(), 30);
  std::vector<Pose> poses = views.truth;
  poses[0].translation().z() += 0.08;
  const std::vector<SharedPlane> planes = FindSharedPlanes(views.At(poses));
  const SharedPlane* floor = PlaneNear(planes, {.normal = {0, 0, 1}, .distance = 0.0}, 0.05);
  ASSERT_NE(floor, nullptr);
  ASSERT_EQ(floor->views.size(), 6U);
  for (std::size_t k = 1; k < 6; ++k) {
    EXPECT_LT(floor->views[0].moments(3, 3), 0.5 * floor->views[k].moments(3, 3));
  }
}

// A slab's rim or underside among the views of its top.
TEST(SharedPlanesTest, FewThatAreOffTakeNoWeightFromTheOthers) {
  std::vector<Eigen::Vector3d> from = AroundTheYard();
  from.insert(from.end(), {{-4, 2, 1.5}, {-6, -6, 1.5}, {2, 12, 1.5}, {14, 12, 1.5}});
  const Views views = Look(Yard(), from, 31);
  std::vector<Pose> poses = views.truth;
  for (const std::size_t k : {0U, 4U}) poses[k].translation().z() += 0.08;
  const Plane truth = {.normal = {0, 0, 1}, .distance = 0.0};
  const std::vector<SharedPlane> off = FindSharedPlanes(views.At(poses));
  const std::vector<SharedPlane> right = FindSharedPlanes(views.At(views.truth));
  const SharedPlane* floor = PlaneNear(off, truth, 0.05);
  const SharedPlane* as_it_is = PlaneNear(right, truth, 0.05);
  ASSERT_NE(floor, nullptr);
  ASSERT_NE(as_it_is, nullptr);
  ASSERT_EQ(floor->views.size(), from.size());
  ASSERT_EQ(as_it_is->views.size(), from.size());
  EXPECT_NEAR(floor->plane.distance, 0.0, 0.002);
  for (std::size_t k = 0; k < from.size(); ++k) {
    const double share = floor->views[k].moments(3, 3) / as_it_is->views[k].moments(3, 3);
    if (k == 0 || k == 4) {
      EXPECT_LT(share, 0.1) << k;
    } else {
      EXPECT_GT(share, 0.8) << k;
    }
  }
}

TEST(SharedPlanesTest, OneScanOrNoneGivesNone) {
  const Views views = Look(Yard(), {{0, 0, 1.5}}, 50);
  EXPECT_TRUE(FindSharedPlanes(views.At(views.truth)).empty());
  EXPECT_TRUE(FindSharedPlanes({}).empty());
  const ScanPlanes nothing;
  const std::vector<PosedPlanes> empty(3, {&nothing, Pose::Identity()});
  EXPECT_TRUE(FindSharedPlanes(empty).empty());
}

TEST(SharedPlanesTest, ChecksOptions) {
  STRATA_EXPECT_OK(SharedPlaneOptions().Validate());
  SharedPlaneOptions bad;
  bad.corridor_m = std::numeric_limits<double>::quiet_NaN();
  bad.max_extent_m = 0.0;
  EXPECT_THAT(bad.Validate(),
              StatusIs(absl::StatusCode::kInvalidArgument,
                       AllOf(HasSubstr("corridor_m"), HasSubstr("max_extent_m is 0"))));
}

}  // namespace
}  // namespace strata
