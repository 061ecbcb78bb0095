#include "tests/experiments/objects/facade.h"

#include <utility>

namespace strata::testing {
namespace {

using Eigen::Vector3d;

constexpr double kThicknessM = 0.5;
constexpr int kColumns = 5;

struct WindowShape {
  double width_m, height_m, sill_m;
  int panes;
};
// From below.
constexpr WindowShape kBasementShape = {1.0, 0.5, 0.3, 1};
constexpr WindowShape kDoubleShape = {1.9, 1.5, 1.8, 4};
constexpr WindowShape kRoofShape = {0.95, 1.1, 7.5, 2};
constexpr double kStoreyM = 2.8;
constexpr double kEavesM = 9.2;

class Drawing {
 public:
  explicit Drawing(std::uint64_t seed) : random_(seed) {}

  Facade Draw() {
    pitch_m_ = random_.Uniform(2.9, 3.2);
    left_m_ = -0.5 * pitch_m_ * kColumns;
    AddRow(WindowKind::kBasement, kBasementShape, 0.0, 1.2);
    AddRow(WindowKind::kDouble, kDoubleShape, 1.2, 4.0);
    WindowShape upper = kDoubleShape;
    upper.sill_m += kStoreyM;
    AddRow(WindowKind::kDouble, upper, 4.0, 4.0 + kStoreyM);
    AddRow(WindowKind::kRoof, kRoofShape, 4.0 + kStoreyM, kEavesM);
    Put(kGutterClass, {left_m_, -0.2, kEavesM}, {-left_m_, 0.0, kEavesM + 0.12});
    Put(0, {-14.0, -14.0, -0.5}, {14.0, 0.0, 0.0});
    facade_.with_tree = facade_.bare;
    AddTree();
    facade_.bare.Build();
    facade_.with_tree.Build();
    return std::move(facade_);
  }

 private:
  void Put(std::uint16_t label, const Vector3d& min, const Vector3d& max) {
    facade_.bare.Add(Labelled(Box(min, max), label));
  }

  // Windows and the wall around them, from z = low to high.
  void AddRow(WindowKind kind, const WindowShape& shape, double low, double high) {
    const double sill = shape.sill_m, lintel = sill + shape.height_m;
    double done = left_m_;
    for (int column = 0; column < kColumns; ++column) {
      const double middle = left_m_ + pitch_m_ * (column + 0.5) + random_.Uniform(-0.05, 0.05);
      const double left = middle - 0.5 * shape.width_m, right = middle + 0.5 * shape.width_m;
      Put(kWallClass, {done, 0.0, low}, {left, kThicknessM, high});
      Put(kWallClass, {left, 0.0, low}, {right, kThicknessM, sill});
      Put(kWallClass, {left, 0.0, lintel}, {right, kThicknessM, high});
      AddWindow(left, right, sill, lintel, shape.panes);
      facade_.windows.push_back(
          {kind,
           {Vector3d(left - 0.3, -0.4, sill - 0.3), Vector3d(right + 0.3, 0.6, lintel + 0.2)}});
      done = right;
    }
    Put(kWallClass, {done, 0.0, low}, {-left_m_, kThicknessM, high});
  }

  void AddWindow(double left, double right, double sill, double lintel, int panes) {
    constexpr double kFrame = 0.08, kFace = 0.12, kPane = 0.2, kBack = 0.18;
    Put(kWindowClass, {left, kPane, sill}, {right, kThicknessM, lintel});
    Put(kWindowClass, {left, kFace, sill}, {left + kFrame, kBack, lintel});
    Put(kWindowClass, {right - kFrame, kFace, sill}, {right, kBack, lintel});
    Put(kWindowClass, {left, kFace, sill}, {right, kBack, sill + kFrame});
    Put(kWindowClass, {left, kFace, lintel - kFrame}, {right, kBack, lintel});
    for (int k = 1; k < panes; ++k) {
      const double x = left + (right - left) * k / panes;
      Put(kWindowClass, {x - kFrame / 2, kFace, sill}, {x + kFrame / 2, kBack, lintel});
    }
    Put(kWindowClass, {left - 0.06, -0.10, sill - 0.05}, {right + 0.06, kFace, sill});
  }

  // Leaves before the second column, in clumps.
  void AddTree() {
    const double x = left_m_ + 1.5 * pitch_m_ + random_.Uniform(-0.3, 0.3);
    const double y = random_.Uniform(-4.5, -3.5);
    facade_.with_tree.Add(Post(0.75 * x, y, 0.0, 3.0, 0.15));
    for (int k = 0; k < 16; ++k) {
      const double along = random_.Uniform(-0.75, 0.75), out = random_.Uniform(-0.8, 0.8);
      const double up = random_.Uniform(1.9, 5.2), radius = random_.Uniform(0.2, 0.4);
      const Vector3d centre(0.75 * x + along, y + out, up);
      facade_.with_tree.Add(Hull({{centre, radius * Eigen::Matrix3d::Identity()}}, 24));
    }
  }

  Random random_;
  double pitch_m_ = 0.0, left_m_ = 0.0;
  Facade facade_;
};

}  // namespace

Facade DrawFacade(std::uint64_t seed) { return Drawing(seed).Draw(); }

SensorOptions FacadeSensor() {
  SensorOptions sensor;
  sensor.rings = 480;
  sensor.columns = 2800;
  sensor.elevation_min_rad = -0.4;
  sensor.elevation_max_rad = 0.66;
  sensor.sigma_m = 0.005;
  sensor.sigma_per_metre = 0.0;
  sensor.labelled = true;
  return sensor;
}

}  // namespace strata::testing
