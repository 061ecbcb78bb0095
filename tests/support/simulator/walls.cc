#include "tests/support/simulator/walls.h"

#include <algorithm>
#include <utility>

namespace strata::testing {
namespace {

using Eigen::Vector3d;

// A box in the wall, from `front` to `back` metres behind its face.
void AddPart(Scene& scene,
             const Wall& wall,
             const Opening& extent,
             double front,
             double back,
             std::uint16_t label) {
  if (extent.to - extent.from < 1e-9 || extent.lintel - extent.sill < 1e-9) return;
  const double a = wall.face + wall.inwards * front;
  const double b = wall.face + wall.inwards * back;
  Vector3d min(extent.from, std::min(a, b), extent.sill);
  Vector3d max(extent.to, std::max(a, b), extent.lintel);
  if (wall.along_y) {
    std::swap(min.x(), min.y());
    std::swap(max.x(), max.y());
  }
  scene.Add(Labelled(Box(min, max), label));
}

}  // namespace

void AddWall(Scene& scene,
             const Wall& wall,
             double low,
             double high,
             double thickness,
             const std::vector<Opening>& openings,
             double pane_depth) {
  const auto solid = [&](const Opening& extent) {
    AddPart(scene, wall, extent, 0.0, thickness, wall.label);
  };
  double done = wall.from;
  for (const Opening& o : openings) {
    solid({done, o.from, low, high});
    solid({o.from, o.to, low, o.sill});
    solid({o.from, o.to, o.lintel, high});
    if (pane_depth > 0.0) AddPart(scene, wall, o, pane_depth, thickness, wall.pane_label);
    done = o.to;
  }
  solid({done, wall.to, low, high});
}

}  // namespace strata::testing
