#include <algorithm>
#include <cmath>
#include <cstddef>
#include <utility>

#include "absl/strings/str_cat.h"

#include "core/classification/features/feature_columns.h"
#include "core/classification/features/local_shape.h"
#include "core/classification/features/neighbours.h"
#include "core/cloud/point_tree.h"
#include "core/common/status.h"

namespace strata {
namespace {

constexpr int kAcross = 5;  // bins of the distance from the axis
constexpr int kAlong = 10;  // bins of the height along it
constexpr float kRadiusSpacings = 10.0F;

// A point's share of the four bins whose centres are around it, so that noise moves little over the
// bins' edges (Johnson 1997).
template <typename Row>
void AddBilinear(float across, float along, float share, Row&& bins) {
  const float a = across - 0.5F;
  const float b = along - 0.5F;
  const float a_low = std::floor(a);
  const float b_low = std::floor(b);
  for (int k = 0; k < 4; ++k) {
    const int right = k % 2;
    const int up = k / 2;
    const float weight =
        (right == 1 ? a - a_low : 1.0F - (a - a_low)) * (up == 1 ? b - b_low : 1.0F - (b - b_low));
    const int bin_a = std::clamp(static_cast<int>(a_low) + right, 0, kAcross - 1);
    const int bin_b = std::clamp(static_cast<int>(b_low) + up, 0, kAlong - 1);
    bins[bin_a * kAlong + bin_b] += weight * share;
  }
}

float MedianSpacing(const Neighbours& neighbours) {
  std::vector<float> squared;
  for (std::size_t i = 0; i < neighbours.size(); ++i) {
    if (neighbours.count() > 0) squared.push_back(neighbours.SquaredDistances(i).front());
  }
  if (squared.empty()) return 0.0F;
  const auto middle = squared.begin() + static_cast<std::ptrdiff_t>(squared.size() / 2);
  std::nth_element(squared.begin(), middle, squared.end());
  return std::sqrt(*middle);
}

}  // namespace

std::vector<std::string> SpinFeatureNames() {
  std::vector<std::string> names;
  for (int across = 0; across < kAcross; ++across) {
    for (int along = 0; along < kAlong; ++along) {
      names.push_back(absl::StrCat("spin.", across, ".", along));
    }
  }
  return names;
}

absl::StatusOr<FeatureMatrix> SpinFeatures(const PointCloud& cloud,
                                           const PointFeatureOptions& options,
                                           const Stop& stop) {
  const std::span<const Eigen::Vector3f> points = cloud.points;
  const Neighbours neighbours =
      Neighbours::Find(points, static_cast<std::size_t>(options.neighbours));
  const float radius = options.spin_radius_m > 0.0
                           ? static_cast<float>(options.spin_radius_m)
                           : std::max(1e-3F, kRadiusSpacings * MedianSpacing(neighbours));
  FeatureMatrix features =
      FeatureMatrix::Zero(static_cast<Eigen::Index>(points.size()), kAcross * kAlong + 1);
  const PointsView view{points};
  const PointTree tree(3, view, nanoflann::KDTreeSingleIndexAdaptorParams(10));
  std::vector<std::pair<std::uint32_t, float>> found;
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (i % 4096 == 0) STRATA_RETURN_IF_ERROR(stop.status());
    Eigen::Vector3f normal = DescribeShape(points[i], points, neighbours.Of(i)).normal;
    // Towards the sensor, so that both sides of a thin thing do not look alike.
    if (normal.dot(cloud.sensor_origin - points[i]) < 0.0F) normal = -normal;
    tree.radiusSearch(points[i].data(), radius * radius, found, nanoflann::SearchParams());
    const float each = 1.0F / static_cast<float>(std::max<std::size_t>(1, found.size()));
    for (const auto& [other, squared] : found) {
      const float along = (points[other] - points[i]).dot(normal);
      const float across = std::sqrt(std::max(0.0F, squared - along * along));
      AddBilinear(kAcross * across / radius,
                  kAlong * (along + radius) / (2.0F * radius),
                  each,
                  features.row(static_cast<Eigen::Index>(i)));
    }
  }
  // Counts vary by their root: as roots, full and sparse bins weigh alike.
  features = features.cwiseSqrt();
  return features;
}

}  // namespace strata
