#include <cmath>
#include <numbers>
#include <utility>

#include "core/geometry/pose.h"
#include "tests/experiments/classification/classification_scenes.h"
#include "tests/support/simulator/scene.h"
#include "tests/support/simulator/simulator.h"

namespace strata::testing {
namespace {

using Eigen::Vector3d;

constexpr std::uint16_t kWall = 1, kWindow = 2, kGutter = 3;
constexpr double kHalfLengthM = 8.0, kThicknessM = 0.5;
constexpr double kStoreyM = 3.3;
constexpr int kStoreys = 2;
constexpr double kEavesM = kStoreys * kStoreyM + 0.4;

// The wall's face is the plane y = 0, the street y < 0.
class Facade {
 public:
  Facade(bool double_windows, std::uint64_t seed)
      : double_windows_(double_windows), random_(seed) {}

  Scene Make() {
    for (int storey = 0; storey < kStoreys; ++storey) AddStorey(storey * kStoreyM);
    Put(kWall, {-kHalfLengthM, 0.0, kStoreys * kStoreyM}, {kHalfLengthM, kThicknessM, kEavesM});
    AddGutter();
    Put(0, {-12.0, -10.0, -1.0}, {12.0, 1.0, 0.0});
    Eigen::Isometry3d T_world_roof = Eigen::Isometry3d::Identity();
    T_world_roof.linear() = Eigen::AngleAxisd(0.6, Vector3d::UnitX()).toRotationMatrix();
    T_world_roof.translation() = Vector3d(0.0, 3.0, kEavesM + 2.4);
    scene_.Add(OrientedBox(T_world_roof, {2.0 * kHalfLengthM + 0.6, 8.0, 0.2}));
    scene_.Build();
    return std::move(scene_);
  }

 private:
  void Put(std::uint16_t label, const Vector3d& min, const Vector3d& max) {
    Solid box = Box(min, max);
    box.label = label;
    scene_.Add(std::move(box));
  }

  // Windows and the wall between them, from left to right.
  void AddStorey(double low) {
    const double single = random_.Uniform(0.9, 1.1);
    const double sill = low + random_.Uniform(0.85, 1.0);
    const double lintel = sill + random_.Uniform(1.4, 1.7);
    const double pitch = random_.Uniform(2.4, 2.8);
    double done = -kHalfLengthM;
    for (double x = -kHalfLengthM + random_.Uniform(0.6, 1.2); true; x += pitch) {
      const bool wide = double_windows_ && random_.Uniform(0.0, 1.0) < 0.4;
      const double width = wide ? 1.9 * single : single;
      if (x + width > kHalfLengthM - 0.5) break;
      Put(kWall, {done, 0.0, low}, {x, kThicknessM, low + kStoreyM});
      Put(kWall, {x, 0.0, low}, {x + width, kThicknessM, sill});
      Put(kWall, {x, 0.0, lintel}, {x + width, kThicknessM, low + kStoreyM});
      AddWindow(x, x + width, sill, lintel, wide);
      done = x + width;
      if (wide) x += 0.9 * single;
    }
    Put(kWall, {done, 0.0, low}, {kHalfLengthM, kThicknessM, low + kStoreyM});
  }

  void AddWindow(double left, double right, double sill, double lintel, bool wide) {
    constexpr double kFrame = 0.08;
    const double face = random_.Uniform(0.10, 0.16);         // of the frame behind the wall's
    const double pane = face + random_.Uniform(0.03, 0.30);  // glass or curtain
    const double back = face + 0.06;
    Put(kWindow, {left, pane, sill}, {right, kThicknessM, lintel});
    Put(kWindow, {left, face, sill}, {left + kFrame, back, lintel});
    Put(kWindow, {right - kFrame, face, sill}, {right, back, lintel});
    Put(kWindow, {left, face, sill}, {right, back, sill + kFrame});
    Put(kWindow, {left, face, lintel - kFrame}, {right, back, lintel});
    const double bar = sill + 0.65 * (lintel - sill);
    Put(kWindow, {left, face, bar}, {right, back, bar + kFrame});
    for (int k = 1; k < (wide ? 4 : 2); ++k) {
      const double x = left + (right - left) * k / (wide ? 4 : 2);
      Put(kWindow, {x - kFrame / 2, face, sill}, {x + kFrame / 2, back, lintel});
    }
    Put(kWindow, {left - 0.06, -0.10, sill - 0.05}, {right + 0.06, face, sill});
  }

  // A half-round channel, as five boxes, before the eaves.
  void AddGutter() {
    constexpr double kRadius = 0.09;
    for (int k = 0; k < 5; ++k) {
      const double angle = std::numbers::pi * (k + 0.5) / 5.0;
      Eigen::Isometry3d T_world_box = Eigen::Isometry3d::Identity();
      T_world_box.linear() =
          Eigen::AngleAxisd(angle - std::numbers::pi / 2, Vector3d::UnitX()).toRotationMatrix();
      T_world_box.translation() =
          Vector3d(0.0, -0.14 - kRadius * std::cos(angle), kEavesM - kRadius * std::sin(angle));
      Solid part = OrientedBox(T_world_box, {2.0 * kHalfLengthM, 0.06, 0.01});
      part.label = kGutter;
      scene_.Add(std::move(part));
    }
  }

  const bool double_windows_;
  Random random_;
  Scene scene_;
};

}  // namespace

std::vector<std::string> FacadeClasses() { return {"wall", "window", "gutter"}; }

PointCloud ScanFacade(bool double_windows, std::uint64_t seed) {
  const Scene scene = Facade(double_windows, seed).Make();
  Random random(seed ^ 0xFACADE);
  SensorOptions sensor;
  sensor.rings = 180;
  sensor.columns = 1020;
  sensor.elevation_min_rad = -0.45;
  sensor.elevation_max_rad = 0.66;
  sensor.labelled = true;
  Pose T_world_sensor = Pose::Identity();
  T_world_sensor.translation() =
      Vector3d(random.Uniform(-2.0, 2.0), random.Uniform(-12.5, -11.5), 1.6);
  PointCloud cloud = SimulateScan(scene, sensor, T_world_sensor, seed);
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    const double y = static_cast<double>(cloud.points[i].y()) + T_world_sensor.translation().y();
    if (std::abs(y) > 0.5) cloud.label[i] = 0;
  }
  return cloud;
}

}  // namespace strata::testing
