#include "tests/core/completion/planted_things.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "core/completion/square_voxels.h"
#include "core/completion/upright_box.h"

namespace strata::testing {
namespace {

Eigen::AlignedBox3d Box(double x, double y, double z, double to_x, double to_y, double to_z) {
  return {Eigen::Vector3d(x, y, z), Eigen::Vector3d(to_x, to_y, to_z)};
}

bool IsInside(const Solid& solid, const Eigen::Vector3d& p) {
  return std::any_of(solid.begin(), solid.end(), [&](const Eigen::AlignedBox3d& box) {
    return ((p - box.min()).array() > 1e-6).all() && ((box.max() - p).array() > 1e-6).all();
  });
}

// Points of all faces but those that lie inside another box, or on the ground.
std::vector<Eigen::Vector3d> SurfaceOf(const Solid& solid, double spacing_m) {
  std::vector<Eigen::Vector3d> points;
  for (const Eigen::AlignedBox3d& box : solid) {
    for (int axis = 0; axis < 3; ++axis) {
      const int u = (axis + 1) % 3, v = (axis + 2) % 3;
      for (const double at : {box.min()[axis], box.max()[axis]}) {
        if (axis == 2 && at <= 0.0) continue;
        for (double a = box.min()[u]; a <= box.max()[u]; a += spacing_m) {
          for (double b = box.min()[v]; b <= box.max()[v]; b += spacing_m) {
            Eigen::Vector3d p;
            p[axis] = at;
            p[u] = a;
            p[v] = b;
            if (!IsInside(solid, p)) points.push_back(p);
          }
        }
      }
    }
  }
  return points;
}

}  // namespace

std::vector<PlantedClass> PlantedClasses() {
  const Solid saloon = {Box(-2.2, -0.9, 0.2, 2.2, 0.9, 0.8), Box(-1.2, -0.8, 0.8, 0.9, 0.8, 1.4)};
  const Solid van = {Box(-2.2, -0.9, 0.2, 2.2, 0.9, 1.0), Box(-2.2, -0.9, 1.0, 1.5, 0.9, 2.0)};
  const Solid truck = {Box(-3.5, -1.2, 0.6, 1.6, 1.2, 3.0), Box(1.6, -1.1, 0.4, 3.5, 1.1, 2.4)};
  const Solid bench = {Box(-0.9, -0.25, 0.4, 0.9, 0.25, 0.5),
                       Box(-0.9, 0.2, 0.5, 0.9, 0.3, 1.0),
                       Box(-0.8, -0.2, 0.0, -0.7, 0.2, 0.4),
                       Box(0.7, -0.2, 0.0, 0.8, 0.2, 0.4)};
  const Solid table = {Box(-0.9, -0.4, 0.65, 0.9, 0.4, 0.75),
                       Box(-0.1, -0.1, 0.0, 0.1, 0.1, 0.65),
                       Box(-0.9, -0.9, 0.35, 0.9, -0.6, 0.45),
                       Box(-0.9, 0.6, 0.35, 0.9, 0.9, 0.45)};
  const Solid lamp = {Box(-0.08, -0.08, 0.0, 0.08, 0.08, 4.0),
                      Box(-0.1, -0.15, 3.9, 1.5, 0.15, 4.1)};
  const Solid sign = {Box(-0.06, -0.06, 0.0, 0.06, 0.06, 2.4),
                      Box(-0.4, -0.05, 1.8, 0.4, 0.05, 2.6)};
  const Solid hydrant = {Box(-0.2, -0.2, 0.0, 0.2, 0.2, 0.9),
                         Box(-0.45, -0.12, 0.5, 0.45, 0.12, 0.7)};
  return {{3, {saloon, van, truck}}, {4, {bench, table}}, {5, {lamp, sign, hydrant}}};
}

std::vector<Eigen::Vector3d> SeenOf(const Solid& solid,
                                    bool partial,
                                    const PlantedOptions& options,
                                    std::mt19937_64& random) {
  std::normal_distribution<double> noise(0.0, options.noise_m);
  std::uniform_real_distribution<double> turn(0.0, 2.0 * std::numbers::pi);
  std::vector<Eigen::Vector3d> points = SurfaceOf(solid, options.spacing_m);
  if (partial) {
    const double angle = turn(random);
    const Eigen::Vector3d away(std::cos(angle), std::sin(angle), 0.0);
    Eigen::AlignedBox3d box;
    for (const Eigen::Vector3d& p : points) box.extend(p);
    std::vector<double> along;
    for (const Eigen::Vector3d& p : points) along.push_back(away.dot(p));
    std::sort(along.begin(), along.end());
    const double limit = along[along.size() * 3 / 5];
    std::erase_if(points, [&](const Eigen::Vector3d& p) { return away.dot(p) > limit; });
  }
  for (Eigen::Vector3d& p : points) {
    for (double& x : p) x += noise(random);
  }
  return points;
}

FoundEntity EntityOf(std::uint16_t class_id, const std::vector<Eigen::Vector3d>& points) {
  const Eigen::AlignedBox2d everywhere(Eigen::Vector2d(-1e4, -1e4), Eigen::Vector2d(1e4, 1e4));
  SquareVoxels voxels(everywhere, 0.05, 0.0);
  std::vector<LabelledPoint> labelled;
  for (const Eigen::Vector3d& p : points) labelled.push_back({p, class_id});
  voxels.Add(labelled, 0);
  FoundEntity entity;
  entity.class_id = class_id;
  entity.points = points.size();
  entity.scans = {{0, points.size()}};
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  for (const SquareVoxels::Voxel& voxel : voxels.voxels()) {
    entity.voxels.push_back(voxels.MeanOf(voxel));
    mean += entity.voxels.back();
  }
  mean /= static_cast<double>(entity.voxels.size());
  for (const Eigen::Vector3d& p : entity.voxels) {
    entity.radius_m = std::max(entity.radius_m, (p - mean).norm());
  }
  entity.box = UprightBoxOf(entity.voxels);
  return entity;
}

std::vector<PlantedThing> PlantThings(const std::vector<PlantedClass>& classes,
                                      const PlantedOptions& options,
                                      std::uint64_t seed) {
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> turn(0.0, 2.0 * std::numbers::pi);
  std::uniform_real_distribution<double> place(-200.0, 200.0);
  std::vector<PlantedThing> things;
  for (const PlantedClass& of : classes) {
    for (std::size_t kind = 0; kind < of.kinds.size(); ++kind) {
      for (std::size_t i = 0; i < options.of_each; ++i) {
        PlantedThing thing;
        thing.class_id = of.class_id;
        thing.kind = kind;
        thing.partial = i < options.partial;
        std::vector<Eigen::Vector3d> points =
            SeenOf(of.kinds[kind], thing.partial, options, random);
        const double angle = turn(random);
        const double x = place(random);
        const double y = place(random);
        thing.T_map_kind.linear() =
            Eigen::AngleAxisd(angle, Eigen::Vector3d::UnitZ()).toRotationMatrix();
        thing.T_map_kind.translation() = Eigen::Vector3d(x, y, 3.0);
        for (Eigen::Vector3d& p : points) p = thing.T_map_kind * p;
        thing.entity = EntityOf(of.class_id, points);
        things.push_back(std::move(thing));
      }
    }
  }
  std::shuffle(things.begin(), things.end(), random);
  return things;
}

}  // namespace strata::testing
