#include "tests/support/simulator/scene.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <limits>
#include <numbers>
#include <optional>
#include <set>
#include <utility>
#include <vector>

#include <Eigen/Geometry>

namespace strata::testing {
namespace {

using Eigen::Vector3d;

constexpr double kNothing = std::numeric_limits<double>::infinity();
constexpr std::size_t kSolidsPerLeaf = 2;

Solid::Face FaceThrough(const Vector3d& normal, const Vector3d& point) {
  const Vector3d unit = normal.normalized();
  return {unit, unit.dot(point)};
}

// Distance to the box, 0 from inside, kNothing when missed within `limit`.
double CastBox(const Eigen::AlignedBox3d& box,
               const Vector3d& origin,
               const Vector3d& direction,
               double limit) {
  double enter = 0.0;
  double leave = limit;
  for (int axis = 0; axis < 3; ++axis) {
    if (direction[axis] == 0.0) {
      if (origin[axis] < box.min()[axis] || origin[axis] > box.max()[axis]) return kNothing;
      continue;
    }
    const double near = (box.min()[axis] - origin[axis]) / direction[axis];
    const double far = (box.max()[axis] - origin[axis]) / direction[axis];
    enter = std::max(enter, std::min(near, far));
    leave = std::min(leave, std::max(near, far));
  }
  return enter <= leave ? enter : kNothing;
}

double CastSolid(const Solid& solid,
                 const Vector3d& origin,
                 const Vector3d& direction,
                 double limit) {
  double enter = -kNothing;
  double leave = kNothing;
  for (const Solid::Face& face : solid.faces) {
    const double speed = face.normal.dot(direction);
    const double outside = face.normal.dot(origin) - face.offset;
    if (speed == 0.0) {
      if (outside > 0.0) return kNothing;
      continue;
    }
    const double t = -outside / speed;
    if (speed < 0.0) {
      enter = std::max(enter, t);
    } else {
      leave = std::min(leave, t);
    }
  }
  return enter > 0.0 && enter <= leave && enter < limit ? enter : kNothing;
}

double CastTriangle(const Vector3d& a,
                    const Vector3d& b,
                    const Vector3d& c,
                    const Vector3d& origin,
                    const Vector3d& direction) {
  const Vector3d ab = b - a;
  const Vector3d ac = c - a;
  const Vector3d p = direction.cross(ac);
  const double determinant = ab.dot(p);
  if (determinant == 0.0) return kNothing;
  const Vector3d from_a = origin - a;
  const double u = from_a.dot(p) / determinant;
  const Vector3d q = from_a.cross(ab);
  const double v = direction.dot(q) / determinant;
  // The tolerance closes the seam between triangles.
  if (u < -1e-12 || v < -1e-12 || u + v > 1.0 + 1e-12) return kNothing;
  const double t = ac.dot(q) / determinant;
  return t > 0.0 ? t : kNothing;
}

}  // namespace

Solid Box(const Vector3d& min, const Vector3d& max) {
  Solid solid;
  for (int axis = 0; axis < 3; ++axis) {
    solid.faces.push_back({Vector3d::Unit(axis), max[axis]});
    solid.faces.push_back({-Vector3d::Unit(axis), -min[axis]});
  }
  solid.box = {min, max};
  return solid;
}

Solid OrientedBox(const Eigen::Isometry3d& T_world_box, const Vector3d& size) {
  Solid solid;
  for (int axis = 0; axis < 3; ++axis) {
    for (const double side : {-0.5, 0.5}) {
      const Vector3d half = side * size[axis] * Vector3d::Unit(axis);
      solid.faces.push_back(FaceThrough(T_world_box.linear() * half, T_world_box * half));
    }
  }
  for (int corner = 0; corner < 8; ++corner) {
    const Vector3d sign((corner & 1) - 0.5, ((corner >> 1) & 1) - 0.5, (corner >> 2) - 0.5);
    solid.box.extend(T_world_box * Vector3d(sign.cwiseProduct(size)));
  }
  return solid;
}

Solid RampX(double x_low, double x_high, double y_min, double y_max, double z_base, double z_top) {
  const double rise = z_top - z_base;
  const double run = x_high - x_low;
  Solid solid =
      Box({std::min(x_low, x_high), y_min, z_base}, {std::max(x_low, x_high), y_max, z_top});
  // The plane's normal is perpendicular to (run, 0, rise) and points up whichever way it rises.
  const Vector3d normal = run > 0.0 ? Vector3d(-rise, 0.0, run) : Vector3d(rise, 0.0, -run);
  solid.faces.push_back(FaceThrough(normal, {x_low, 0.0, z_base}));
  return solid;
}

Solid Post(double x, double y, double z_min, double z_max, double radius, int sides) {
  const double reach = radius / std::cos(std::numbers::pi / sides);
  Solid solid = Box({x - reach, y - reach, z_min}, {x + reach, y + reach, z_max});
  for (int side = 0; side < sides; ++side) {
    const double angle = 2.0 * std::numbers::pi * side / sides;
    const Vector3d normal(std::cos(angle), std::sin(angle), 0.0);
    solid.faces.push_back(FaceThrough(normal, Vector3d(x, y, 0.0) + radius * normal));
  }
  return solid;
}

Solid Hull(const std::vector<Ellipsoid>& ellipsoids, int faces) {
  const auto reach = [&ellipsoids](const Vector3d& normal) {
    double most = -kNothing;
    for (const Ellipsoid& e : ellipsoids) {
      most = std::max(most, normal.dot(e.centre) + (e.axes.transpose() * normal).norm());
    }
    return most;
  };
  Solid solid;
  for (int k = 0; k < faces; ++k) {  // normals evenly over the sphere, along a spiral
    const double z = 1.0 - (2.0 * k + 1.0) / faces;
    const double angle = k * std::numbers::pi * (3.0 - std::sqrt(5.0));
    const double r = std::sqrt(1.0 - z * z);
    const Vector3d normal(r * std::cos(angle), r * std::sin(angle), z);
    solid.faces.push_back({normal, reach(normal)});
  }
  Vector3d min, max;
  for (int axis = 0; axis < 3; ++axis) {
    max[axis] = reach(Vector3d::Unit(axis));
    min[axis] = -reach(-Vector3d::Unit(axis));
    solid.faces.push_back({Vector3d::Unit(axis), max[axis]});
    solid.faces.push_back({-Vector3d::Unit(axis), -min[axis]});
  }
  solid.box = {min, max};
  return solid;
}

Solid Labelled(Solid solid, std::uint16_t label) {
  solid.label = label;
  return solid;
}

void Scene::SetTerrain(const Eigen::AlignedBox2d& area,
                       double cell_m,
                       const std::function<double(double, double)>& height,
                       std::uint16_t label) {
  Terrain terrain;
  terrain.label = label;
  terrain.origin = area.min();
  terrain.cell = cell_m;
  terrain.columns = static_cast<int>(std::ceil(area.sizes().x() / cell_m - 1e-9));
  terrain.rows = static_cast<int>(std::ceil(area.sizes().y() / cell_m - 1e-9));
  for (int row = 0; row <= terrain.rows; ++row) {
    for (int column = 0; column <= terrain.columns; ++column) {
      terrain.heights.push_back(
          height(area.min().x() + column * cell_m, area.min().y() + row * cell_m));
    }
  }
  const auto [low, high] = std::minmax_element(terrain.heights.begin(), terrain.heights.end());
  terrain.min_z = *low;
  terrain.max_z = *high;
  terrain_ = std::move(terrain);
}

void Scene::Build() {
  nodes_.clear();
  if (solids_.empty()) return;
  nodes_.push_back({.box = {}, .first = 0, .count = solids_.size()});
  Split(0);
}

void Scene::Split(std::size_t node) {
  const std::size_t first = nodes_[node].first;
  const std::size_t count = nodes_[node].count;
  Eigen::AlignedBox3d box;
  for (std::size_t i = first; i < first + count; ++i) box.extend(solids_[i].box);
  nodes_[node].box = box;
  if (count <= kSolidsPerLeaf) return;
  Eigen::Index axis = 0;
  box.sizes().maxCoeff(&axis);
  const auto begin = solids_.begin() + static_cast<std::ptrdiff_t>(first);
  const auto middle = begin + static_cast<std::ptrdiff_t>(count / 2);
  std::nth_element(begin,
                   middle,
                   begin + static_cast<std::ptrdiff_t>(count),
                   [axis](const Solid& a, const Solid& b) {
                     return a.box.center()[axis] < b.box.center()[axis];
                   });
  const std::size_t child = nodes_.size();
  nodes_.push_back({.box = {}, .first = first, .count = count / 2});
  nodes_.push_back({.box = {}, .first = first + count / 2, .count = count - count / 2});
  nodes_[node].first = child;
  nodes_[node].count = 0;
  Split(child);
  Split(child + 1);
}

std::optional<Scene::Hit> Scene::Trace(const Vector3d& origin,
                                       const Vector3d& direction,
                                       double max_range) const {
  const Hit solid = CastSolids(origin, direction, max_range);
  const double ground = CastTerrain(origin, direction, std::min(solid.range, max_range));
  const Hit hit = ground < solid.range ? Hit{ground, terrain_->label} : solid;
  if (hit.range > max_range) return std::nullopt;
  return hit;
}

std::optional<double> Scene::Cast(const Vector3d& origin,
                                  const Vector3d& direction,
                                  double max_range) const {
  const std::optional<Hit> hit = Trace(origin, direction, max_range);
  if (!hit.has_value()) return std::nullopt;
  return hit->range;
}

std::optional<double> Scene::GroundBelow(double x, double y, double z) const {
  const auto range = Cast({x, y, z}, -Vector3d::UnitZ(), 1e4);
  if (!range.has_value()) return std::nullopt;
  return z - *range;
}

std::set<std::uint16_t> Scene::Labels() const {
  std::set<std::uint16_t> labels;
  for (const Solid& solid : solids_) labels.insert(solid.label);
  if (terrain_.has_value()) labels.insert(terrain_->label);
  labels.erase(0);
  return labels;
}

Scene::Hit Scene::CastSolids(const Vector3d& origin,
                             const Vector3d& direction,
                             double limit) const {
  Hit nearest{.range = kNothing};
  if (nodes_.empty()) return nearest;
  std::array<std::size_t, 64> stack{};
  std::size_t depth = 1;
  while (depth > 0) {
    const Node& node = nodes_[stack[--depth]];
    if (CastBox(node.box, origin, direction, std::min(limit, nearest.range)) == kNothing) continue;
    if (node.count == 0) {
      stack[depth++] = node.first;
      stack[depth++] = node.first + 1;
      continue;
    }
    for (std::size_t i = node.first; i < node.first + node.count; ++i) {
      const double range = CastSolid(solids_[i], origin, direction, std::min(limit, nearest.range));
      if (range < nearest.range) nearest = {range, solids_[i].label};
    }
  }
  return nearest;
}

double Scene::CastTerrain(const Vector3d& origin, const Vector3d& direction, double limit) const {
  if (!terrain_.has_value()) return kNothing;
  const Terrain& terrain = *terrain_;
  const Eigen::AlignedBox3d box(
      Vector3d(terrain.origin.x(), terrain.origin.y(), terrain.min_z - 1e-6),
      Vector3d(terrain.origin.x() + terrain.columns * terrain.cell,
               terrain.origin.y() + terrain.rows * terrain.cell,
               terrain.max_z + 1e-6));
  const double enter = CastBox(box, origin, direction, std::min(limit, 1e6));
  if (enter == kNothing) return kNothing;
  // Walks the cells along the ray (Amanatides and Woo 1987).
  const Vector3d start = origin + enter * direction;
  std::array<int, 2> cell{};
  std::array<double, 2> next{};   // distance at which the ray leaves the cell along the axis
  std::array<double, 2> width{};  // and takes to cross one
  const std::array<int, 2> size = {terrain.columns, terrain.rows};
  for (std::size_t axis = 0; axis < 2; ++axis) {
    const auto i = static_cast<Eigen::Index>(axis);
    const double position = (start[i] - terrain.origin[i]) / terrain.cell;
    cell[axis] = std::clamp(static_cast<int>(std::floor(position)), 0, size[axis] - 1);
    const double border = terrain.origin[i] + (cell[axis] + (direction[i] > 0.0)) * terrain.cell;
    next[axis] = direction[i] == 0.0 ? kNothing : (border - origin[i]) / direction[i];
    width[axis] = direction[i] == 0.0 ? kNothing : terrain.cell / std::abs(direction[i]);
  }
  double z = start.z();
  while (cell[0] >= 0 && cell[0] < size[0] && cell[1] >= 0 && cell[1] < size[1]) {
    const std::size_t axis = next[0] < next[1] ? 0 : 1;
    const double z_behind = origin.z() + next[axis] * direction.z();
    if (terrain.Reaches(cell[0], cell[1], std::min(z, z_behind), std::max(z, z_behind))) {
      const double hit = CastTerrainCell(cell[0], cell[1], origin, direction, limit);
      if (hit != kNothing) return hit;
    }
    if (next[axis] >= limit) break;
    z = z_behind;
    cell[axis] += direction[static_cast<Eigen::Index>(axis)] > 0.0 ? 1 : -1;
    next[axis] += width[axis];
  }
  return kNothing;
}

double Scene::CastTerrainCell(
    int column, int row, const Vector3d& origin, const Vector3d& direction, double limit) const {
  const Terrain& terrain = *terrain_;
  const auto corner = [&](int dx, int dy) {
    return Vector3d(terrain.origin.x() + (column + dx) * terrain.cell,
                    terrain.origin.y() + (row + dy) * terrain.cell,
                    terrain.At(column + dx, row + dy));
  };
  const Vector3d a = corner(0, 0);
  const Vector3d b = corner(1, 0);
  const Vector3d c = corner(1, 1);
  const Vector3d d = corner(0, 1);
  const double hit =
      std::min(CastTriangle(a, b, c, origin, direction), CastTriangle(a, c, d, origin, direction));
  return hit < limit ? hit : kNothing;
}

}  // namespace strata::testing
