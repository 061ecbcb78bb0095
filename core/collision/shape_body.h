// A shape, made ready to be held against boxes.
#ifndef STRATA_CORE_COLLISION_SHAPE_BODY_H_
#define STRATA_CORE_COLLISION_SHAPE_BODY_H_

#include <memory>
#include <optional>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "core/geometry/pose.h"
#include "core/world/shape.h"

namespace strata {

struct ShapeTouch {
  // How far the two reach into each other: of solids the shortest way out, of a mesh that of its
  // deepest triangle, or of the box's middle to the mesh where that is inside.
  double depth_m = 0.0;
  Eigen::Vector3d where = Eigen::Vector3d::Zero();  // in the map
};

// Its mesh is a tree of oriented boxes (OBBRSS of FCL: Gottschalk et al., "OBBTree", 1996, as
// thesis 4.3.2, with swept spheres for distances), its parts are convex solids. Many threads may
// ask.
class ShapeBody {
 public:
  // REQUIRES: a valid shape.
  explicit ShapeBody(const CollisionShape& shape);
  ~ShapeBody();
  ShapeBody(const ShapeBody&) = delete;
  ShapeBody& operator=(const ShapeBody&) = delete;

  // Around all of it, in its own frame.
  const Eigen::AlignedBox3d& bounds() const { return bounds_; }
  // nullopt unless the shape, there, has a point in common with the box, or all of the box inside
  // of a closed mesh.
  std::optional<ShapeTouch> Touches(const Pose& T_map_shape, const Eigen::AlignedBox3d& box) const;

 private:
  struct Geometry;

  // Whether a point is inside of the mesh: the numbers of triangles above and below it are odd.
  bool Holds(const Eigen::Vector3d& p_shape) const;
  double DistanceToMesh(const Eigen::Vector3d& p_shape) const;

  std::unique_ptr<const Geometry> geometry_;
  Eigen::AlignedBox3d bounds_;
};

}  // namespace strata

#endif  // STRATA_CORE_COLLISION_SHAPE_BODY_H_
