// The points of one thing, ready to be compared with those of others.
// Internal to core, not installed: whoever includes it links nanoflann.
#ifndef STRATA_CORE_COMPLETION_THING_POINTS_H_
#define STRATA_CORE_COMPLETION_THING_POINTS_H_

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "core/cloud/point_tree.h"
#include "core/geometry/pose.h"
#include "core/world/things/entity.h"

namespace strata {

// T_map_thing: x along the box, z up, zero in the middle of its base.
Pose BaseFrameOf(const UprightBox& box);

// At most `most` of the points, evenly over space, in that frame; the same in whatever order they
// come. REQUIRES: finite points within 10⁶ m of the frame's origin.
std::vector<Eigen::Vector3f> ThinnedInFrame(std::span<const Eigen::Vector3d> points,
                                            const Pose& T_map_thing,
                                            std::size_t most);

// Safe to read from several threads.
class ThingPoints {
 public:
  // REQUIRES: at least kMinKindPoints of them.
  explicit ThingPoints(std::vector<Eigen::Vector3f> points);
  ThingPoints(const ThingPoints&) = delete;
  ThingPoints& operator=(const ThingPoints&) = delete;

  const std::vector<Eigen::Vector3f>& points() const { return points_; }
  const Eigen::AlignedBox3f& bounds() const { return bounds_; }
  // Median distance of a point to its fourth neighbour [m].
  double spacing_m() const { return spacing_m_; }
  // Index of the point that is nearest to p, if it is within reach.
  std::optional<std::size_t> NearestTo(const Eigen::Vector3f& p, double reach_m) const;
  // Indexes of the `count` nearest points.
  std::vector<std::uint32_t> NeighboursOf(const Eigen::Vector3f& p, std::size_t count) const;

 private:
  double MedianSpacing() const;

  const std::vector<Eigen::Vector3f> points_;
  const PointsView view_;
  PointTree tree_;
  Eigen::AlignedBox3f bounds_;
  double spacing_m_ = 0.0;
};

// Thesis 11.2.1: what tells kinds apart before their shapes are looked at. The volume as its
// logarithm, or large things would swamp the others, and so the radius.
struct KindFeatures {
  double log_volume = 0.0;
  double ratio = 0.0;  // of the second-longest edge of the box to the longest
  double log_radius = 0.0;
};
KindFeatures KindFeaturesOf(const Eigen::Vector3d& box_size, double radius_m);

}  // namespace strata

#endif  // STRATA_CORE_COMPLETION_THING_POINTS_H_
