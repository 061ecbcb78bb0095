#include <cmath>
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

constexpr std::uint16_t kHead = 1, kTorso = 2, kLegs = 3, kArms = 4;

// A body of rounded limbs; x is forward, the feet are at z = 0 of its own frame.
class Person {
 public:
  Person(Scene& scene, Random& random, const Pose& T_world_person)
      : scene_(scene), random_(random), T_(T_world_person) {}

  void Add() {
    height_ = In(1.62, 1.90);
    broad_ = In(0.9, 1.1);
    const bool sits = In(0, 1) < 0.2;
    hip_ = sits ? 0.28 * height_ : 0.50 * height_;
    AddTrunk();
    for (const double side : {-1.0, 1.0}) {
      AddLeg(side, sits);
      AddArm(side);
    }
  }

 private:
  double In(double low, double high) { return random_.Uniform(low, high); }

  void Put(std::uint16_t label, const std::vector<Ellipsoid>& parts) {
    Solid solid = Hull(parts, 80);
    solid.label = label;
    scene_.Add(std::move(solid));
  }
  Ellipsoid Part(const Vector3d& centre, double x, double y, double z) const {
    return {T_ * centre, T_.linear() * Vector3d(x, y, z).asDiagonal()};
  }
  void Limb(std::uint16_t label, const Vector3d& a, double ra, const Vector3d& b, double rb) {
    Put(label, {Part(a, ra, ra, ra), Part(b, rb, rb, rb)});
  }
  // A unit vector that hangs down, swung forward about y and then outward about x.
  static Vector3d Hanging(double forward, double outward, double side) {
    return {std::sin(forward) * std::cos(outward),
            side * std::sin(outward),
            -std::cos(forward) * std::cos(outward)};
  }

  void AddTrunk() {
    const double bow = In(-0.05, 0.25);
    const double length = 0.30 * height_;
    shoulder_ = Vector3d(length * std::sin(bow), 0.0, hip_ + length * std::cos(bow));
    Put(kTorso,
        {Part({0, 0, hip_}, 0.11 * broad_, 0.16 * broad_, 0.08),
         Part({0.5 * shoulder_.x(), 0, 0.5 * (hip_ + shoulder_.z())},
              0.11 * broad_,
              0.15 * broad_,
              0.1),
         Part(shoulder_, 0.10 * broad_, 0.20 * broad_, 0.07)});
    const Vector3d head = shoulder_ + Vector3d(In(0.0, 0.06), In(-0.03, 0.03), 0.155 * height_);
    Limb(kHead, shoulder_ + Vector3d(0, 0, 0.06), 0.055, head - Vector3d(0, 0, 0.05), 0.055);
    Put(kHead, {Part(head, 0.10, 0.08, 0.125)});
  }

  void AddLeg(double side, bool sits) {
    const Vector3d joint(0.0, 0.09 * side, hip_);
    const double forward = sits ? In(1.3, 1.6) : In(-0.35, 0.45);
    const Vector3d knee = joint + 0.25 * height_ * Hanging(forward, In(0.0, 0.15), side);
    const double shank = sits ? In(-0.2, 0.3) : forward - In(0.0, 0.3);
    const Vector3d ankle = knee + 0.23 * height_ * Hanging(shank, 0.0, side);
    Limb(kLegs, joint, 0.085 * broad_, knee, 0.06);
    Limb(kLegs, knee, 0.06, ankle, 0.045);
    Limb(kLegs, ankle, 0.045, ankle + Vector3d(0.16, 0.0, -0.03), 0.035);
  }

  void AddArm(double side) {
    const Vector3d joint = shoulder_ + Vector3d(0.0, side * 0.20 * broad_, 0.0);
    // Anything between hanging down, pointing ahead and raised aside.
    const double forward = In(-0.4, 1.7);
    const double outward = In(0.08, 1.3);
    const Vector3d upper = Hanging(forward, outward, side);
    const Vector3d elbow = joint + 0.17 * height_ * upper;
    const double bend = In(0.0, 1.4);
    const Vector3d lower =
        (std::cos(bend) * upper + std::sin(bend) * Vector3d(0.8, -0.3 * side, 0.5)).normalized();
    const Vector3d wrist = elbow + 0.15 * height_ * lower;
    Limb(kArms, joint, 0.055 * broad_, elbow, 0.045);
    Limb(kArms, elbow, 0.045, wrist, 0.03);
    Limb(kArms, wrist, 0.035, wrist + 0.14 * lower, 0.03);
  }

  Scene& scene_;
  Random& random_;
  const Pose T_;
  double height_ = 0.0, broad_ = 1.0, hip_ = 0.0;
  Vector3d shoulder_ = Vector3d::Zero();
};

}  // namespace

std::vector<std::string> PeopleClasses() { return {"head", "torso", "legs", "arms"}; }

PointCloud ScanPeople(std::uint64_t seed) {
  Random random(seed);
  Scene scene;
  for (const double side : {-1.0, 1.0}) {
    const Eigen::AngleAxisd yaw(random.Uniform(-std::numbers::pi, std::numbers::pi),
                                Vector3d::UnitZ());
    const Vector3d at(random.Uniform(2.4, 3.4), side * random.Uniform(0.6, 1.0), 0.0);
    Person(scene, random, MakePose(Eigen::Quaterniond(yaw), at)).Add();
  }
  scene.Build();
  SensorOptions sensor;
  sensor.rings = 144;
  sensor.columns = 720;
  sensor.elevation_min_rad = -0.65;
  sensor.elevation_max_rad = 0.6;
  sensor.max_range_m = 15.0;
  sensor.sigma_per_metre = 0.0;
  sensor.labelled = true;
  return SimulateScan(
      scene, sensor, MakePose(Eigen::Quaterniond::Identity(), {0.0, 0.0, 1.0}), seed);
}

}  // namespace strata::testing
