#include "tests/support/simulator/worlds.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <string>
#include <utility>
#include <vector>

#include <Eigen/Geometry>

#include "tests/support/simulator/simulator.h"

namespace strata::testing {
namespace {

using Eigen::AngleAxisd;
using Eigen::Vector2d;
using Eigen::Vector3d;

// An upright box of `size` turned by `yaw` that stands at `foot`.
Solid House(const Vector3d& foot, const Vector3d& size, double yaw) {
  Eigen::Isometry3d T_world_box = Eigen::Isometry3d::Identity();
  T_world_box.linear() = AngleAxisd(yaw, Vector3d::UnitZ()).toRotationMatrix();
  T_world_box.translation() = foot + Vector3d(0.0, 0.0, 0.5 * size.z());
  return Labelled(OrientedBox(T_world_box, size), kWall);
}

void AddTree(Scene& scene, const Vector3d& foot, double height) {
  const double crown = 0.28 * height;
  scene.Add(Labelled(Post(foot.x(), foot.y(), foot.z() - 0.5, foot.z() + 0.6 * height, 0.15),
                     kVegetation));
  Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
  T.translation() = foot + Vector3d(0.0, 0.0, 0.72 * height);
  // Three boxes turned against each other look rough enough to a laser.
  for (int i = 0; i < 3; ++i) {
    T.linear() = (AngleAxisd(0.7 * i, Vector3d::UnitZ()) * AngleAxisd(0.6 * i, Vector3d::UnitX()))
                     .toRotationMatrix();
    scene.Add(Labelled(OrientedBox(T, Vector3d::Constant(1.5 * crown)), kVegetation));
  }
}

// Walls of `height` above the ramps and the deck along y = ±edge.
void AddParapets(Scene& scene, double half_deck, double run, double edge, double deck_top) {
  constexpr double kHeight = 0.9;
  constexpr double kWidth = 0.15;
  const double slope = std::atan2(deck_top, run);
  for (const double side : {-1.0, 1.0}) {
    const double y = side * (edge - 0.5 * kWidth);
    scene.Add(Labelled(Box({-half_deck, y - 0.5 * kWidth, deck_top - 0.4},
                           {half_deck, y + 0.5 * kWidth, deck_top + kHeight}),
                       kWall));
    for (const double end : {-1.0, 1.0}) {
      Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
      T.linear() = AngleAxisd(end * slope, Vector3d::UnitY()).toRotationMatrix();
      T.translation() = Vector3d(end * (half_deck + 0.5 * run), y, 0.5 * deck_top) +
                        T.linear() * Vector3d(0.0, 0.0, 0.5 * kHeight - 0.1);
      scene.Add(
          Labelled(OrientedBox(T, {std::hypot(run, deck_top), kWidth, kHeight + 0.2}), kWall));
    }
  }
}

// What stands around the bridge, so that scans have something to hold on to.
void AddBridgeSurroundings(Scene& scene, double ramp_foot) {
  const double far = ramp_foot + 8.0;
  scene.Add(House({-0.6 * far, 17.0, 0.0}, {14.0, 7.0, 6.0}, 0.12));
  scene.Add(House({0.55 * far, 18.0, 0.0}, {12.0, 8.0, 8.0}, -0.2));
  scene.Add(House({-0.5 * far, -18.0, 0.0}, {16.0, 6.0, 5.0}, -0.08));
  scene.Add(House({0.6 * far, -17.0, 0.0}, {10.0, 9.0, 7.0}, 0.3));
  scene.Add(House({far + 5.0, 2.0, 0.0}, {5.0, 16.0, 6.0}, 0.05));
  scene.Add(House({-far - 5.0, -3.0, 0.0}, {5.0, 14.0, 6.0}, -0.1));
  scene.Add(House({6.0, 31.0, 0.0}, {18.0, 5.0, 6.0}, 0.07));
  scene.Add(House({-5.0, -31.0, 0.0}, {18.0, 5.0, 6.0}, -0.05));
  for (const double x : {-20.0, -12.0, 9.0, 17.0}) {
    scene.Add(Labelled(Post(x, 7.5, 0.0, 5.0, 0.12), kPole));
    scene.Add(Labelled(Post(x + 2.0, -8.0, 0.0, 5.0, 0.12), kPole));
  }
  AddTree(scene, {-8.0, 11.0, 0.0}, 6.0);
  AddTree(scene, {9.5, -11.5, 0.0}, 7.0);
  AddTree(scene, {7.0, 22.0, 0.0}, 6.5);
}

}  // namespace

std::string ToString(WorldClass world_class) {
  switch (world_class) {
    case kGround:
      return "ground";
    case kWall:
      return "wall";
    case kWindow:
      return "window";
    case kStairs:
      return "stairs";
    case kVegetation:
      return "vegetation";
    case kPole:
      return "pole";
  }
  return "";
}

World BridgeWorld(const BridgeOptions& options) {
  constexpr double kHalfDeck = 6.0;
  constexpr double kEdge = 2.0;
  constexpr double kDeckThickness = 0.4;
  const double deck_top = options.clearance_m + kDeckThickness;
  const double run = deck_top / 0.2;
  const double ramp_foot = kHalfDeck + run;
  World world;
  Scene& scene = world.scene;
  scene.Add(Labelled(Box({-60.0, -60.0, -1.0}, {60.0, 60.0, 0.0}), kGround));
  scene.Add(Labelled(Box({-kHalfDeck, -kEdge, options.clearance_m}, {kHalfDeck, kEdge, deck_top}),
                     kGround));
  scene.Add(Labelled(RampX(-ramp_foot, -kHalfDeck, -kEdge, kEdge, 0.0, deck_top), kGround));
  scene.Add(Labelled(RampX(ramp_foot, kHalfDeck, -kEdge, kEdge, 0.0, deck_top), kGround));
  if (options.parapets) AddParapets(scene, kHalfDeck, run, kEdge, deck_top);
  AddBridgeSurroundings(scene, ramp_foot);
  scene.Build();
  const double turn = ramp_foot + 8.0;
  world.robots = {{"over", {{-turn, 0.0, 0.0}, {turn, 0.0, 0.0}}},
                  {"under", {{0.0, -24.0, 0.0}, {0.0, 24.0, 0.0}}}};
  const double bend = ramp_foot + 6.0;
  world.loops = {{"eight",
                  {{-bend, 0.0, 0.0},
                   {bend, 0.0, 0.0},
                   {bend, 10.3, 0.0},
                   {0.0, 10.3, 0.0},
                   {0.0, -11.2, 0.0},
                   {-bend, -11.2, 0.0},
                   {-bend, 0.0, 0.0},
                   {-ramp_foot + 6.0, 0.0, 0.0}}}};
  world.places = {{"west", {-ramp_foot - 3.0, 0.0, 0.0}},
                  {"east", {ramp_foot + 3.0, 0.0, 0.0}},
                  {"south", {0.0, -20.0, 0.0}},
                  {"north", {0.0, 20.0, 0.0}},
                  {"deck", {0.0, 0.0, deck_top}},
                  {"under", {0.0, 0.0, 0.0}}};
  return world;
}

World CarParkWorld(double slab_m) {
  constexpr double kFloor = 3.2;  // top of the upper slab
  World world;
  Scene& scene = world.scene;
  scene.Add(Labelled(Box({-30.0, -22.0, -1.0}, {30.0, 22.0, 0.0}), kGround));
  // The upper slab leaves out the ramp's well: x from -8 to 8, y from -2.5 to 2.5.
  scene.Add(Labelled(Box({-20.0, 2.5, kFloor - slab_m}, {20.0, 12.0, kFloor}), kGround));
  scene.Add(Labelled(Box({-20.0, -12.0, kFloor - slab_m}, {20.0, -2.5, kFloor}), kGround));
  scene.Add(Labelled(Box({-20.0, -2.5, kFloor - slab_m}, {-8.0, 2.5, kFloor}), kGround));
  scene.Add(Labelled(Box({8.0, -2.5, kFloor - slab_m}, {20.0, 2.5, kFloor}), kGround));
  scene.Add(Labelled(RampX(-8.0, 8.0, -2.0, 2.0, 0.0, kFloor), kGround));
  for (const double side : {-1.0, 1.0}) {  // a kerb wall along the well
    scene.Add(Labelled(
        Box({-8.0, side * 2.6 - 0.1, kFloor - slab_m}, {8.0, side * 2.6 + 0.1, kFloor + 1.0}),
        kWall));
  }
  for (const double x : {-14.0, -5.0, 5.0, 14.0}) {
    for (const double y : {-7.0, 7.0})
      scene.Add(Labelled(Box({x - 0.2, y - 0.2, 0.0}, {x + 0.2, y + 0.2, kFloor - slab_m}), kWall));
  }
  for (const double base : {0.0, kFloor}) {  // breast walls on both storeys, open above
    for (const double side : {-1.0, 1.0}) {
      scene.Add(Labelled(
          Box({-20.0, side * 12.0 - 0.15, base}, {20.0, side * 12.0 + 0.15, base + 1.1}), kWall));
      if (base > 0.0 || side > 0.0) {  // below, the way in is at x = -20
        scene.Add(Labelled(
            Box({side * 20.0 - 0.15, -12.0, base}, {side * 20.0 + 0.15, 12.0, base + 1.1}), kWall));
      }
    }
  }
  scene.Add(House({15.5, 9.0, kFloor}, {4.0, 3.0, 2.6}, 0.0));
  scene.Add(House({-25.0, 17.0, 0.0}, {6.0, 5.0, 7.0}, 0.4));
  scene.Add(House({24.0, -17.0, 0.0}, {7.0, 5.0, 6.0}, -0.3));
  scene.Build();
  world.robots = {{"visitor",
                   {{-25.0, -9.5, 0.0},
                    {17.0, -9.5, 0.0},
                    {17.0, 5.0, 0.0},
                    {-16.0, 5.0, 0.0},
                    {-16.0, 0.0, 0.0},
                    {14.0, 0.0, 0.0},
                    {14.0, -9.5, kFloor},
                    {-16.0, -9.5, kFloor},
                    {-16.0, 5.0, kFloor},
                    {10.0, 5.0, kFloor}}}};
  world.loops = {{"loop",
                  {{-16.0, -9.5, 0.0},
                   {17.0, -9.5, 0.0},
                   {17.0, 5.0, 0.0},
                   {-16.0, 5.0, 0.0},
                   {-16.0, 0.0, 0.0},
                   {14.0, 0.0, kFloor},
                   {14.0, -9.5, kFloor},
                   {-16.0, -9.5, kFloor},
                   {-16.0, 5.0, kFloor},
                   {14.0, 5.0, kFloor},
                   {14.0, 0.0, kFloor},
                   {-16.0, 0.0, 0.0},
                   {-16.0, -9.5, 0.0},
                   {-6.0, -9.5, 0.0}}}};
  world.places = {{"below", {0.0, -9.5, 0.0}},
                  {"above", {0.0, -9.5, kFloor}},
                  {"ramp_foot", {-9.5, 0.0, 0.0}},
                  {"ramp_head", {9.5, 0.0, kFloor}}};
  return world;
}

double CampusHeight(double x, double y) {
  return 2.0 * std::sin(x / 47.0) * std::cos(y / 61.0) + 0.8 * std::sin((x + 2.0 * y) / 29.0);
}

namespace {

Vector3d OnCampus(double x, double y) { return {x, y, CampusHeight(x, y)}; }

double DistanceToRoute(const std::vector<Vector3d>& route, const Vector2d& place) {
  double nearest = 1e9;
  for (std::size_t i = 0; i + 1 < route.size(); ++i) {
    const Vector2d a = route[i].head<2>();
    const Vector2d ab = route[i + 1].head<2>() - a;
    const double t = std::clamp((place - a).dot(ab) / ab.squaredNorm(), 0.0, 1.0);
    nearest = std::min(nearest, (place - a - t * ab).norm());
  }
  return nearest;
}

}  // namespace

World PlantCampus(std::vector<Robot> robots,
                  const Eigen::AlignedBox2d& area,
                  int houses,
                  int trees,
                  std::uint64_t seed) {
  constexpr double kMargin = 15.0;
  World world;
  world.robots = std::move(robots);
  world.scene.SetTerrain(area, 1.0, CampusHeight, kGround);
  Random random(seed);
  const auto free_place = [&](double distance) {
    while (true) {
      const Vector2d place(random.Uniform(area.min().x() + kMargin, area.max().x() - kMargin),
                           random.Uniform(area.min().y() + kMargin, area.max().y() - kMargin));
      if (std::all_of(world.robots.begin(), world.robots.end(), [&](const Robot& robot) {
            return DistanceToRoute(robot.waypoints, place) > distance;
          })) {
        return OnCampus(place.x(), place.y());
      }
    }
  };
  for (int i = 0; i < houses; ++i) {
    const Vector3d size(random.Uniform(8, 22), random.Uniform(8, 16), random.Uniform(5, 14));
    const Vector3d foot = free_place(0.5 * std::hypot(size.x(), size.y()) + 3.0);
    world.scene.Add(House(foot - Vector3d(0, 0, 2), size, random.Uniform(0, 3.1)));
  }
  for (int i = 0; i < trees; ++i) {
    AddTree(world.scene, free_place(4.0), random.Uniform(5, 10));
  }
  world.scene.Build();
  return world;
}

namespace {

World PlantCampus(std::vector<Robot> robots, std::uint64_t seed) {
  return PlantCampus(
      std::move(robots), {Vector2d(-150.0, -150.0), Vector2d(150.0, 150.0)}, 40, 150, seed);
}

// To and fro along streets 60 m apart: those along x, those along y, those along x again.
std::vector<Vector3d> DistrictTour(const Vector2d& corner) {
  constexpr int kStreets = 6;
  constexpr double kStreetM = 60.0;
  std::vector<Vector3d> tour;
  for (int pass = 0; pass < 3; ++pass) {
    for (int k = 0; k < 2 * kStreets; ++k) {
      const double across = kStreetM * (k / 2);
      const bool far = (k + 1) / 2 % 2 == 1;
      const double along = far ? kStreetM * (kStreets - 1) : 0.0;
      const Vector2d p = corner + (pass == 1 ? Vector2d(across, along) : Vector2d(along, across));
      tour.push_back(OnCampus(p.x(), p.y()));
    }
  }
  return tour;
}

}  // namespace

World CityWorld(int districts, std::uint64_t seed) {
  constexpr int kDistrictsARow = 5;
  constexpr double kDistrictM = 300.0;
  constexpr double kMarginM = 30.0;
  std::vector<Robot> robots;
  Eigen::AlignedBox2d area;
  for (int d = 0; d < districts; ++d) {
    const Vector2d corner = kDistrictM * Vector2d(d % kDistrictsARow, d / kDistrictsARow);
    robots.push_back({"robot" + std::to_string(d), DistrictTour(corner)});
    area.extend((corner - Vector2d::Constant(kMarginM)).eval());
    area.extend((corner + Vector2d::Constant(kDistrictM + kMarginM)).eval());
  }
  return PlantCampus(std::move(robots), area, 40 * districts, 150 * districts, seed);
}

World CampusWorld(std::uint64_t seed) {
  std::vector<Robot> robots = {{"north_loop", {}}, {"south_loop", {}}};
  const std::array<Vector2d, 6> loop = {Vector2d(-100, 0),
                                        Vector2d(100, 0),
                                        Vector2d(105, 60),
                                        Vector2d(20, 95),
                                        Vector2d(-80, 70),
                                        Vector2d(-100, 5)};
  for (const Vector2d& p : loop) {
    robots[0].waypoints.push_back(OnCampus(p.x(), p.y()));
    robots[1].waypoints.push_back(OnCampus(-p.x(), -p.y()));
  }
  World world = PlantCampus(std::move(robots), seed);
  world.places = {{"start", OnCampus(-100, 0)}, {"far", OnCampus(20, 95)}};
  return world;
}

World CampusLoopWorld(std::uint64_t seed) {
  constexpr int kCorners = 8;
  constexpr double kLength = 300.0;
  Random random(seed);
  std::vector<Vector2d> corners;
  for (int i = 0; i < kCorners; ++i) {
    const double angle = 2.0 * std::numbers::pi * i / kCorners;
    corners.push_back(random.Uniform(0.7, 1.3) * Vector2d(std::cos(angle), std::sin(angle)));
  }
  double length = 0.0;
  for (int i = 0; i < kCorners; ++i) length += (corners[(i + 1) % kCorners] - corners[i]).norm();
  const Vector2d centre(random.Uniform(-60, 60), random.Uniform(-60, 60));
  for (Vector2d& corner : corners) corner = centre + kLength / length * corner;
  corners.push_back(corners[0]);
  corners.push_back(corners[0] + 10.0 * (corners[1] - corners[0]).normalized());
  Robot robot{"loop", {}};
  for (const Vector2d& p : corners) robot.waypoints.push_back(OnCampus(p.x(), p.y()));
  World world = PlantCampus({robot}, seed);
  world.places = {{"start", robot.waypoints[0]}, {"far", robot.waypoints[kCorners / 2]}};
  return world;
}

Scene YardScene() {
  Scene scene;
  scene.Add(Box({-20.0, -15.0, -1.0}, {30.0, 15.0, 0.0}));
  scene.Add(Box({-20.0, 14.0, 0.0}, {30.0, 15.0, 4.0}));
  scene.Add(Box({-20.0, -15.0, 0.0}, {30.0, -14.0, 4.0}));
  scene.Add(Box({-20.0, -14.0, 0.0}, {-19.0, 14.0, 4.0}));
  scene.Add(Box({29.0, -14.0, 0.0}, {30.0, 14.0, 4.0}));
  scene.Add(Box({3.0, 4.0, 0.0}, {7.0, 7.0, 2.5}));
  scene.Add(Box({-4.0, -8.0, 0.0}, {-1.0, -5.0, 3.0}));
  scene.Add(Box({11.0, -7.0, 0.0}, {14.0, -4.0, 2.0}));
  for (const auto& [x, y] : {std::pair{0.0, 6.0}, {8.0, -5.0}, {16.0, 5.0}, {-6.0, 4.0}}) {
    scene.Add(Post(x, y, 0.0, 3.0, 0.2));
  }
  scene.Build();
  return scene;
}

}  // namespace strata::testing
