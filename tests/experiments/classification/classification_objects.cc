#include <cmath>
#include <cstddef>
#include <numbers>
#include <utility>

#include <Eigen/Geometry>

#include "core/geometry/pose.h"
#include "tests/experiments/classification/classification_scenes.h"
#include "tests/support/simulator/scene.h"
#include "tests/support/simulator/simulator.h"

namespace strata::testing {
namespace {

using Eigen::Vector3d;

constexpr std::uint16_t kChair = 1, kTable = 2, kScreen = 3, kFan = 4, kTrashCan = 5;
constexpr double kTurn = 2.0 * std::numbers::pi;

Pose Turned(double x, double y, double z, double yaw) {
  return MakePose(Eigen::Quaterniond(Eigen::AngleAxisd(yaw, Vector3d::UnitZ())), {x, y, z});
}

// Puts furniture into a scene; every piece is drawn anew.
class Furniture {
 public:
  Furniture(Scene& scene, Random& random) : scene_(scene), random_(random) {}

  void AddChair(const Pose& T_world_object) {
    T_ = T_world_object;
    label_ = kChair;
    const double width = In(0.40, 0.50);
    const double seat = In(0.42, 0.50);
    Block({0, 0, seat - 0.025}, {width, width, In(0.03, 0.06)});
    const double back = In(0.35, 0.50);
    const double lean = In(0.05, 0.25);
    Tilted({-width / 2 - 0.5 * back * std::sin(lean), 0, seat + 0.06 + back / 2},
           {0.03, width - 0.04, back},
           -lean);
    if (In(0, 1) < 0.5) {  // on wheels, or on four legs
      Upright(0, 0, 0.08, seat, In(0.025, 0.04));
      for (int k = 0; k < 5; ++k) Spoke({0, 0, 0.07}, kTurn * k / 5, 0.0, 0.30, 0.04);
    } else {
      for (const double x : {-1.0, 1.0}) {
        for (const double y : {-1.0, 1.0}) {
          Block({x * (width / 2 - 0.02), y * (width / 2 - 0.02), seat / 2}, {0.035, 0.035, seat});
        }
      }
    }
    if (In(0, 1) < 0.4) {  // armrests
      for (const double y : {-1.0, 1.0}) {
        Block({0, y * (width / 2 + 0.03), seat + 0.2}, {0.28, 0.05, 0.03});
        Block({0, y * (width / 2 + 0.03), seat + 0.09}, {0.04, 0.03, 0.2});
      }
    }
  }

  // The height of its top.
  double AddTable(const Pose& T_world_object) {
    T_ = T_world_object;
    label_ = kTable;
    const double length = In(1.1, 1.6);
    const double depth = In(0.6, 0.8);
    const double top = In(0.70, 0.76);
    Block({0, 0, top - 0.0125}, {depth, length, 0.025});
    const double leg = In(0.04, 0.07);
    for (const double x : {-1.0, 1.0}) {
      for (const double y : {-1.0, 1.0}) {
        Block({x * (depth / 2 - 0.05), y * (length / 2 - 0.05), top / 2}, {leg, leg, top});
      }
    }
    if (In(0, 1) < 0.4) {
      Block({-depth / 2 + 0.03, 0, top - 0.2}, {0.02, length - 0.1, 0.35});
    }
    return top;
  }

  void AddScreen(const Pose& T_world_object) {
    T_ = T_world_object;
    label_ = kScreen;
    const double width = In(0.38, 0.55);
    const double height = width * In(0.65, 0.8);
    const double low = In(0.08, 0.14);
    Block({0, 0, low + height / 2}, {0.05, width, height});
    if (In(0, 1) < 0.4) {  // a tube behind it
      const double z = low + height / 2;
      Solid tube = Hull({{T_ * Vector3d(0.0, 0, z), Axes(0.02, width / 2, height / 2)},
                         {T_ * Vector3d(-0.3, 0, z), Axes(0.05, width / 4, height / 4)}});
      Put(std::move(tube));
    }
    Block({-0.03, 0, low / 2}, {0.05, 0.08, low});
    Upright(-0.03, 0, 0.0, 0.02, In(0.10, 0.13));
  }

  void AddFan(const Pose& T_world_object) {
    T_ = T_world_object;
    label_ = kFan;
    const double hub = In(0.85, 1.25);
    const double radius = In(0.18, 0.24);
    Upright(0, 0, 0.0, 0.03, In(0.18, 0.22), 16);
    Upright(0, 0, 0.03, hub, In(0.013, 0.02));
    Put(Hull({{T_ * Vector3d(-0.14, 0, hub), Axes(0.03, 0.06, 0.06)},
              {T_ * Vector3d(-0.02, 0, hub), Axes(0.03, 0.07, 0.07)}}));
    // A cage of wires: two bowls that meet in a ring.
    constexpr int kWires = 28;
    for (int k = 0; k < kWires; ++k) {
      const double angle = kTurn * k / kWires;
      const Vector3d rim(0.06, radius * std::cos(angle), hub + radius * std::sin(angle));
      const Vector3d next(0.06,
                          radius * std::cos(angle + kTurn / kWires),
                          hub + radius * std::sin(angle + kTurn / kWires));
      Wire({0.13, 0, hub}, rim);
      Wire({0.0, 0, hub}, rim);
      Wire(rim, next);
    }
    for (int k = 0; k < 3; ++k) {  // blades
      const double angle = kTurn * k / 3 + 0.4;
      Pose T_object_blade = Pose::Identity();
      T_object_blade.linear() = Eigen::AngleAxisd(angle, Vector3d::UnitX()).toRotationMatrix() *
                                Eigen::AngleAxisd(0.4, Vector3d::UnitY()).toRotationMatrix();
      T_object_blade.translation() =
          Vector3d(0.06, 0.5 * radius * std::cos(angle), hub + 0.5 * radius * std::sin(angle));
      Put(OrientedBox(T_ * T_object_blade, {0.005, 0.75 * radius, 0.12}));
    }
  }

  // Hollow, wider above.
  void AddTrashCan(const Pose& T_world_object) {
    T_ = T_world_object;
    label_ = kTrashCan;
    const double height = In(0.28, 0.42);
    const double low = In(0.10, 0.14);
    const double high = low + In(0.02, 0.05);
    constexpr int kSides = 16;
    const double lean = std::atan2(high - low, height);
    for (int k = 0; k < kSides; ++k) {
      const double angle = kTurn * k / kSides;
      const double middle = (low + high) / 2;
      Pose T_object_side =
          Turned(middle * std::cos(angle), middle * std::sin(angle), height / 2, angle);
      T_object_side.linear() =
          T_object_side.linear() * Eigen::AngleAxisd(lean, Vector3d::UnitY()).toRotationMatrix();
      Put(OrientedBox(T_ * T_object_side,
                      {0.006, 1.02 * kTurn * middle / kSides, height / std::cos(lean)}));
    }
    Upright(0, 0, 0.0, 0.01, low, kSides);
  }

 private:
  double In(double low, double high) { return random_.Uniform(low, high); }
  void Put(Solid solid) {
    solid.label = label_;
    scene_.Add(std::move(solid));
  }
  Eigen::Matrix3d Axes(double x, double y, double z) const {
    return T_.linear() * Vector3d(x, y, z).asDiagonal();
  }
  // In the object's frame.
  void Block(const Vector3d& centre, const Vector3d& size) { Tilted(centre, size, 0.0); }
  void Tilted(const Vector3d& centre, const Vector3d& size, double about_y) {
    Pose T_object_box = Pose::Identity();
    T_object_box.linear() = Eigen::AngleAxisd(about_y, Vector3d::UnitY()).toRotationMatrix();
    T_object_box.translation() = centre;
    Put(OrientedBox(T_ * T_object_box, size));
  }
  void Upright(double x, double y, double z_min, double z_max, double radius, int sides = 8) {
    const Vector3d at = T_ * Vector3d(x, y, 0.0);
    Put(Post(at.x(), at.y(), at.z() + z_min, at.z() + z_max, radius, sides));
  }
  void Spoke(const Vector3d& from, double yaw, double drop, double length, double width) {
    Bar(from, from + Vector3d(length * std::cos(yaw), length * std::sin(yaw), -drop), width);
  }
  void Wire(const Vector3d& a, const Vector3d& b) { Bar(a, b, 0.006); }
  void Bar(const Vector3d& a, const Vector3d& b, double width) {
    Pose T_object_bar = Pose::Identity();
    T_object_bar.linear() =
        Eigen::Quaterniond::FromTwoVectors(Vector3d::UnitX(), b - a).toRotationMatrix();
    T_object_bar.translation() = 0.5 * (a + b);
    Put(OrientedBox(T_ * T_object_bar, {(b - a).norm(), width, width}));
  }

  Scene& scene_;
  Random& random_;
  Pose T_ = Pose::Identity();
  std::uint16_t label_ = 0;
};

// A quarter of the sphere at half a degree, from the height of a small robot's scanner.
PointCloud Scan(Scene& scene, std::uint64_t seed) {
  scene.Build();
  SensorOptions sensor;
  sensor.rings = 144;
  sensor.columns = 720;
  sensor.elevation_min_rad = -0.75;
  sensor.elevation_max_rad = 0.5;
  sensor.max_range_m = 15.0;
  sensor.sigma_per_metre = 0.0;
  sensor.labelled = true;
  return SimulateScan(scene, sensor, Turned(0.0, 0.0, 1.1, 0.0), seed);
}

void AddObject(Furniture& furniture,
               std::uint16_t label,
               const Pose& T_world_object,
               Random& random) {
  switch (label) {
    case kChair:
      return furniture.AddChair(T_world_object);
    case kTable: {
      const double top = furniture.AddTable(T_world_object);
      furniture.AddScreen(T_world_object * Turned(random.Uniform(-0.1, 0.1),
                                                  random.Uniform(-0.25, 0.25),
                                                  top,
                                                  random.Uniform(-0.5, 0.5)));
      return;
    }
    case kFan:
      return furniture.AddFan(T_world_object);
    default:
      return furniture.AddTrashCan(T_world_object);
  }
}

}  // namespace

std::vector<std::string> ObjectClasses() {
  return {"chair", "table", "screen", "fan", "trash can"};
}

PointCloud ScanSingleObjects(std::uint64_t seed) {
  Random random(seed);
  Scene scene;
  Furniture furniture(scene, random);
  double bearing = random.Uniform(0.0, kTurn);
  for (const std::uint16_t label : {kChair, kTable, kFan, kTrashCan}) {
    const double distance = random.Uniform(2.2, 3.2);
    AddObject(furniture,
              label,
              Turned(distance * std::cos(bearing),
                     distance * std::sin(bearing),
                     0.0,
                     random.Uniform(0.0, kTurn)),
              random);
    bearing += random.Uniform(1.0, 1.3);
  }
  return Scan(scene, seed);
}

PointCloud ScanManyObjects(std::uint64_t seed) {
  Random random(seed);
  Scene scene;
  Furniture furniture(scene, random);
  std::vector<std::uint16_t> pieces;
  for (const std::uint16_t label : {kChair, kTable, kFan, kTrashCan}) {
    const std::size_t count = 2 + random.Bits() % 2;
    pieces.insert(pieces.end(), count, label);
  }
  for (std::size_t k = pieces.size(); k > 1; --k) {
    std::swap(pieces[k - 1], pieces[random.Bits() % k]);
  }
  // Two rows in less than half of the circle, the farther one behind the gaps and pieces of the
  // nearer.
  for (std::size_t k = 0; k < pieces.size(); ++k) {
    const double distance = k % 2 == 0 ? random.Uniform(2.2, 2.7) : random.Uniform(3.3, 4.0);
    const double bearing =
        (static_cast<double>(k) - 0.5 * static_cast<double>(pieces.size())) * 0.28 +
        random.Uniform(-0.05, 0.05);
    AddObject(furniture,
              pieces[k],
              Turned(distance * std::cos(bearing),
                     distance * std::sin(bearing),
                     0.0,
                     random.Uniform(0.0, kTurn)),
              random);
  }
  return Scan(scene, seed);
}

}  // namespace strata::testing
