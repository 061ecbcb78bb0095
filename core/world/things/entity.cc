#include "core/world/things/entity.h"

#include <cmath>

namespace strata {

std::vector<Eigen::Vector3d> BaseOf(const UprightBox& box) {
  const Eigen::Vector3d along(std::cos(box.yaw_rad), std::sin(box.yaw_rad), 0.0);
  const Eigen::Vector3d across(-along.y(), along.x(), 0.0);
  const Eigen::Vector3d base = box.centre - 0.5 * box.size.z() * Eigen::Vector3d::UnitZ();
  const Eigen::Vector3d l = 0.5 * box.size.x() * along;
  const Eigen::Vector3d w = 0.5 * box.size.y() * across;
  return {base - l - w, base + l - w, base + l + w, base - l + w};
}

Eigen::AlignedBox3d BoundsOf(const UprightBox& box) {
  Eigen::AlignedBox3d bounds;
  for (const Eigen::Vector3d& corner : BaseOf(box)) {
    bounds.extend(corner);
    bounds.extend(corner + box.size.z() * Eigen::Vector3d::UnitZ());
  }
  return bounds;
}

bool EntityQuery::Takes(const Entity& entity) const {
  if (class_id != 0 && entity.class_id != class_id) return false;
  return !region.has_value() || region->intersects(BoundsOf(entity.box));
}

}  // namespace strata
