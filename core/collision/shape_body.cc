#include "core/collision/shape_body.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <utility>
#include <vector>

#include <fcl/geometry/bvh/BVH_model.h>
#include <fcl/geometry/shape/box.h>
#include <fcl/geometry/shape/cylinder.h>
#include <fcl/geometry/shape/sphere.h>
#include <fcl/math/bv/OBBRSS.h>
#include <fcl/narrowphase/collision.h>
#include <fcl/narrowphase/distance.h>

namespace strata {
namespace {

using Eigen::AlignedBox3d;
using Eigen::Vector2d;
using Eigen::Vector3d;

using Mesh = fcl::BVHModel<fcl::OBBRSSd>;

constexpr std::size_t kMostContacts = 64;  // of a part, of which the deepest counts
constexpr int kMostColumns = 64;           // of a mesh, along x and y
// Triangles may be as large as the mesh: so many entries of columns, beyond one for each triangle.
constexpr std::size_t kMostEntries = std::size_t{1} << 20;
// Points asked for are moved by as much, so that no ray runs along an edge of a grid [m].
constexpr double kAside = 1.37e-7;

using Triangle = std::array<Vector3d, 3>;

// In the shape's frame.
struct SolidBox {
  Vector3d centre;
  Eigen::Matrix3d axes;  // columns
  Vector3d half;         // its sizes
};

struct Part {
  std::shared_ptr<fcl::CollisionGeometryd> geometry;
  fcl::Transform3d T_shape_part = fcl::Transform3d::Identity();
};

// How far one must move along the axis to leave the other.
double OverlapAlong(const Vector3d& axis, const Triangle& triangle, const SolidBox& box) {
  double low = axis.dot(triangle[0] - box.centre), high = low;
  for (const Vector3d& corner : triangle) {
    low = std::min(low, axis.dot(corner - box.centre));
    high = std::max(high, axis.dot(corner - box.centre));
  }
  const double reach = (box.axes.transpose() * axis).cwiseAbs().dot(box.half);
  return std::max(0.0, std::min(high + reach, reach - low));
}

// The least way that parts the two, which touch: along one of the axes that can (Gottschalk et al.,
// "OBBTree", 1996). The library's depth of such contacts is longer than the solids are.
double DepthOf(const Triangle& triangle, const SolidBox& box) {
  const std::array<Vector3d, 3> edges = {
      triangle[1] - triangle[0], triangle[2] - triangle[1], triangle[0] - triangle[2]};
  double depth = std::numeric_limits<double>::infinity();
  const auto along = [&](const Vector3d& axis) {
    constexpr double kNone = 1e-9;  // of edges that are parallel
    if (axis.norm() > kNone) {
      depth = std::min(depth, OverlapAlong(axis.normalized(), triangle, box));
    }
  };
  along(edges[0].cross(edges[1]));
  for (int k = 0; k < 3; ++k) {
    along(box.axes.col(k));
    for (const Vector3d& edge : edges) along(edge.cross(box.axes.col(k)));
  }
  return depth;
}

std::shared_ptr<Mesh> MeshOf(const CollisionShape& shape) {
  auto mesh = std::make_shared<Mesh>();
  std::vector<Vector3d> vertices;
  vertices.reserve(shape.vertices.size());
  for (const Eigen::Vector3f& v : shape.vertices) vertices.emplace_back(v.cast<double>());
  std::vector<fcl::Triangle> triangles;
  triangles.reserve(shape.triangles.size());
  for (const auto& [a, b, c] : shape.triangles) triangles.emplace_back(a, b, c);
  mesh->beginModel(static_cast<int>(triangles.size()), static_cast<int>(vertices.size()));
  mesh->addSubModel(vertices, triangles);
  mesh->endModel();
  mesh->computeLocalAABB();
  return mesh;
}

Part PartOf(const ShapePart& part) {
  const Vector3d& size = part.size_m;
  const fcl::Transform3d T(part.T_shape_part.matrix());
  switch (part.kind) {
    case ShapePart::Kind::kBox:
      return {std::make_shared<fcl::Boxd>(size), T};
    case ShapePart::Kind::kCylinder:
      return {std::make_shared<fcl::Cylinderd>(size.x(), size.z()), T};
    case ShapePart::Kind::kSphere:
      break;
  }
  return {std::make_shared<fcl::Sphered>(size.x()), T};
}

AlignedBox3d BoundsOf(const Part& part) {
  part.geometry->computeLocalAABB();
  const AlignedBox3d box(part.geometry->aabb_local.min_, part.geometry->aabb_local.max_);
  AlignedBox3d bounds;
  for (int i = 0; i < 8; ++i) {
    bounds.extend(part.T_shape_part * box.corner(static_cast<AlignedBox3d::CornerType>(i)));
  }
  return bounds;
}

}  // namespace

struct ShapeBody::Geometry {
  std::vector<Part> parts;     // the mesh first, if there is one
  std::shared_ptr<Mesh> mesh;  // nullptr: none
  CollisionShape shape;        // its triangles
  AlignedBox3d mesh_bounds;
  int column_count = kMostColumns;                  // along x and y
  std::vector<std::vector<std::uint32_t>> columns;  // triangles over each

  int ColumnAt(double at, int axis) const {
    if (mesh_bounds.sizes()[axis] <= 0.0) return 0;  // a plate
    const double share = (at - mesh_bounds.min()[axis]) / mesh_bounds.sizes()[axis];
    return std::clamp(static_cast<int>(share * column_count), 0, column_count - 1);
  }
  Triangle TriangleAt(std::intptr_t t) const {
    const auto& [a, b, c] = shape.triangles[static_cast<std::size_t>(t)];
    return {shape.vertices[a].cast<double>(),
            shape.vertices[b].cast<double>(),
            shape.vertices[c].cast<double>()};
  }
  AlignedBox3d BoxOf(std::uint32_t triangle) const {
    AlignedBox3d box;
    for (const Vector3d& corner : TriangleAt(triangle)) box.extend(corner);
    return box;
  }
  // Of all columns together.
  std::size_t Entries() const;
  void SortTriangles();
  int Side(std::uint32_t triangle, const Vector3d& p) const;
};

std::size_t ShapeBody::Geometry::Entries() const {
  const auto width = [this](const AlignedBox3d& box, int axis) {
    return static_cast<std::size_t>(ColumnAt(box.max()[axis], axis) -
                                    ColumnAt(box.min()[axis], axis) + 1);
  };
  std::size_t entries = 0;
  for (std::uint32_t t = 0; t < shape.triangles.size(); ++t) {
    const AlignedBox3d box = BoxOf(t);
    entries += width(box, 0) * width(box, 1);
  }
  return entries;
}

void ShapeBody::Geometry::SortTriangles() {
  for (const Eigen::Vector3f& v : shape.vertices) mesh_bounds.extend(v.cast<double>());
  while (column_count > 1 && Entries() > shape.triangles.size() + kMostEntries) column_count /= 2;
  columns.resize(static_cast<std::size_t>(column_count) * column_count);
  for (std::uint32_t t = 0; t < shape.triangles.size(); ++t) {
    const AlignedBox3d box = BoxOf(t);
    for (int y = ColumnAt(box.min().y(), 1); y <= ColumnAt(box.max().y(), 1); ++y) {
      for (int x = ColumnAt(box.min().x(), 0); x <= ColumnAt(box.max().x(), 0); ++x) {
        columns[static_cast<std::size_t>(y) * column_count + x].push_back(t);
      }
    }
  }
}

// Whether the triangle is above (1) or below (-1) a point, or neither (0).
int ShapeBody::Geometry::Side(std::uint32_t triangle, const Vector3d& p) const {
  std::array<Vector3d, 3> v;
  for (int i = 0; i < 3; ++i) {
    v[i] = shape.vertices[shape.triangles[triangle][i]].cast<double>() - p;
  }
  std::array<double, 3> side{};
  for (int i = 0; i < 3; ++i) {
    const Vector3d& a = v[(i + 1) % 3];
    const Vector3d& b = v[(i + 2) % 3];
    side[i] = a.x() * b.y() - a.y() * b.x();
  }
  const bool over = (side[0] > 0.0) == (side[1] > 0.0) && (side[1] > 0.0) == (side[2] > 0.0);
  const double area = side[0] + side[1] + side[2];
  if (!over || area == 0.0) return 0;
  return (side[0] * v[0].z() + side[1] * v[1].z() + side[2] * v[2].z()) / area > 0.0 ? 1 : -1;
}

ShapeBody::ShapeBody(const CollisionShape& shape) {
  auto geometry = std::make_unique<Geometry>();
  if (!shape.triangles.empty()) {
    geometry->mesh = MeshOf(shape);
    geometry->parts.push_back({geometry->mesh});
    geometry->shape.vertices = shape.vertices;
    geometry->shape.triangles = shape.triangles;
    geometry->SortTriangles();
  }
  for (const ShapePart& part : shape.parts) geometry->parts.push_back(PartOf(part));
  for (const Part& part : geometry->parts) bounds_.extend(BoundsOf(part));
  geometry_ = std::move(geometry);
}

ShapeBody::~ShapeBody() = default;

bool ShapeBody::Holds(const Vector3d& p_shape) const {
  const Geometry& g = *geometry_;
  if (!g.mesh_bounds.contains(p_shape)) return false;
  const Vector3d p = p_shape + Vector3d(kAside, 1.7 * kAside, 0.0);
  const std::size_t column =
      static_cast<std::size_t>(g.ColumnAt(p.y(), 1)) * g.column_count + g.ColumnAt(p.x(), 0);
  int above = 0, below = 0;
  for (const std::uint32_t t : g.columns[column]) {
    const int side = g.Side(t, p);
    above += side > 0;
    below += side < 0;
  }
  return above % 2 != 0 && below % 2 != 0;
}

std::optional<ShapeTouch> ShapeBody::Touches(const Pose& T_map_shape,
                                             const AlignedBox3d& box) const {
  const fcl::Boxd solid(box.sizes());
  // Near the shape, where numbers are small.
  const Vector3d p_shape = T_map_shape.inverse() * box.center();
  if (bounds_.exteriorDistance(p_shape) > box.sizes().norm() / 2.0) return std::nullopt;
  fcl::Transform3d T_shape_box = fcl::Transform3d::Identity();
  T_shape_box.linear() = T_map_shape.linear().transpose();
  T_shape_box.translation() = p_shape;
  const SolidBox solid_box{p_shape, T_shape_box.linear(), box.sizes() / 2.0};
  std::optional<ShapeTouch> deepest;
  const fcl::CollisionRequestd request(kMostContacts, true);
  for (const Part& part : geometry_->parts) {
    fcl::CollisionResultd result;
    fcl::collide(part.geometry.get(), part.T_shape_part, &solid, T_shape_box, request, result);
    for (std::size_t i = 0; i < result.numContacts(); ++i) {
      const fcl::Contactd& contact = result.getContact(i);
      const double depth = part.geometry == geometry_->mesh
                               ? DepthOf(geometry_->TriangleAt(contact.b1), solid_box)
                               : std::abs(contact.penetration_depth);
      if (deepest.has_value() && deepest->depth_m >= depth) continue;
      deepest = ShapeTouch{depth, T_map_shape * Vector3d(contact.pos)};
    }
  }
  if (geometry_->mesh == nullptr || !Holds(p_shape)) return deepest;
  const double depth = DistanceToMesh(p_shape);
  if (deepest.has_value() && deepest->depth_m >= depth) return deepest;
  return ShapeTouch{depth, box.center()};
}

double ShapeBody::DistanceToMesh(const Vector3d& p_shape) const {
  const fcl::Sphered point(1e-4);
  fcl::DistanceResultd distance;
  fcl::distance(geometry_->mesh.get(),
                fcl::Transform3d::Identity(),
                &point,
                fcl::Transform3d(Eigen::Translation3d(p_shape)),
                fcl::DistanceRequestd(),
                distance);
  return std::abs(distance.min_distance);
}

}  // namespace strata
