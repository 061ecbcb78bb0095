#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>

#include "absl/strings/str_cat.h"
#include <Eigen/Geometry>

#include "core/classification/features/feature_columns.h"
#include "core/classification/features/ground_height.h"
#include "core/classification/features/local_shape.h"
#include "core/classification/features/neighbours.h"
#include "core/common/status.h"
#include "core/planes/extraction.h"

namespace strata {
namespace {

constexpr int kAngleBins = 8;
constexpr int kSides = 3;
constexpr int kColumns = kAngleBins + kSides + 1;
// A wall is upright to this: |n · z|.
constexpr double kMaxUprightTilt = 0.26;
constexpr double kMinWallM2 = 2.0;

// Up to eight bins of up to 255 in one number, which is added to faster than memory is.
class Histogram {
 public:
  void Add(int bin) { bins_ += std::uint64_t{1} << (8 * bin); }
  float At(int bin) const { return static_cast<float>(bins_ >> (8 * bin) & 0xFF); }

 private:
  std::uint64_t bins_ = 0;
};

class Walls {
 public:
  Walls(const PointCloud& cloud, double distance_m) : distance_m_(distance_m) {
    PlaneExtractionOptions options;
    options.max_edges = 0;
    for (PlanePatch& patch : ExtractPlanes(cloud, options).patches) {
      if (std::abs(patch.plane.normal.z()) > kMaxUprightTilt || patch.area_m2 < kMinWallM2)
        continue;
      patches_.push_back(std::move(patch));
    }
  }

  // The direction that p's surroundings are held against: the normal of the nearest wall, else up.
  Eigen::Vector3f DirectionAt(const Eigen::Vector3f& p) const {
    const Eigen::Vector3d at = p.cast<double>();
    double nearest = distance_m_;
    Eigen::Vector3d direction = Eigen::Vector3d::UnitZ();
    for (const PlanePatch& patch : patches_) {
      const double distance = std::abs(patch.plane.normal.dot(at) - patch.plane.distance);
      if (distance > nearest || !Beside(patch, at)) continue;
      nearest = distance;
      direction = patch.plane.normal;
    }
    return direction.cast<float>();
  }

 private:
  bool Beside(const PlanePatch& patch, const Eigen::Vector3d& at) const {
    const Eigen::Vector3d r = at - patch.centroid;
    const Eigen::Vector2d uv(r.dot(patch.axis_u), r.dot(patch.plane.normal.cross(patch.axis_u)));
    return ((uv - patch.extent_min).array() >= -distance_m_).all() &&
           ((patch.extent_max - uv).array() >= -distance_m_).all();
  }

  const double distance_m_;
  std::vector<PlanePatch> patches_;
};

}  // namespace

std::vector<std::string> WallFeatureNames() {
  std::vector<std::string> names;
  for (int bin = 0; bin < kAngleBins; ++bin) names.push_back(absl::StrCat("angle.", bin));
  for (const char* side : {"front", "in", "behind"}) names.push_back(absl::StrCat("side.", side));
  names.emplace_back("height");
  return names;
}

absl::StatusOr<FeatureMatrix> WallFeatures(const PointCloud& cloud,
                                           const PointFeatureOptions& options,
                                           const Stop& stop) {
  const std::span<const Eigen::Vector3f> points = cloud.points;
  const Neighbours neighbours =
      Neighbours::Find(points, static_cast<std::size_t>(options.neighbours));
  std::vector<Eigen::Vector3f> normals(points.size());
  for (std::size_t i = 0; i < points.size(); ++i) {
    normals[i] = DescribeShape(points[i], points, neighbours.Of(i)).normal;
  }
  STRATA_RETURN_IF_ERROR(stop.status());
  const Walls walls(cloud, options.wall_distance_m);
  STRATA_RETURN_IF_ERROR(stop.status());
  STRATA_ASSIGN_OR_RETURN(const std::vector<float> heights, HeightsAboveLowest(points));
  const auto epsilon = static_cast<float>(options.plane_side_m);
  FeatureMatrix features =
      FeatureMatrix::Zero(static_cast<Eigen::Index>(points.size()), kColumns + 1);
  for (std::size_t i = 0; i < points.size(); ++i) {
    const auto row = static_cast<Eigen::Index>(i);
    const Eigen::Vector3f n = walls.DirectionAt(points[i]);
    Histogram angles;
    Histogram sides;
    for (const std::uint32_t other : neighbours.Of(i)) {
      const float alpha = std::abs(normals[other].dot(n));
      angles.Add(std::min(kAngleBins - 1, static_cast<int>(alpha * kAngleBins)));
      const float side = (points[other] - points[i]).dot(n);
      sides.Add(side > epsilon ? 0 : side < -epsilon ? 2 : 1);
    }
    const float each = 1.0F / static_cast<float>(std::max<std::size_t>(1, neighbours.count()));
    for (int bin = 0; bin < kAngleBins; ++bin) features(row, bin) = each * angles.At(bin);
    for (int bin = 0; bin < kSides; ++bin) features(row, kAngleBins + bin) = each * sides.At(bin);
    features(row, kColumns - 1) =
        std::min(1.0F, heights[i] / static_cast<float>(options.max_height_m));
  }
  return features;
}

}  // namespace strata
