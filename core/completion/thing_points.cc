#include "core/completion/thing_points.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "core/cloud/point_cloud.h"
#include "core/registration/clouds/thinning.h"

namespace strata {
namespace {

constexpr double kFinestM = 0.04;              // cubes that points are thinned by
constexpr std::size_t kMostThinned = 200'000;  // before, every so manyth is left
constexpr double kLeastEdgeM = 0.05;           // of flat boxes, so that they have a volume
constexpr std::size_t kFourth = 5;             // with the point itself
constexpr std::size_t kSpacingSamples = 500;

bool ComesFirst(const Eigen::Vector3f& a, const Eigen::Vector3f& b) {
  return std::lexicographical_compare(a.data(), a.data() + 3, b.data(), b.data() + 3);
}

}  // namespace

Pose BaseFrameOf(const UprightBox& box) {
  Pose T = Pose::Identity();
  T.linear() = Eigen::AngleAxisd(box.yaw_rad, Eigen::Vector3d::UnitZ()).toRotationMatrix();
  T.translation() = box.centre - 0.5 * box.size.z() * Eigen::Vector3d::UnitZ();
  return T;
}

std::vector<Eigen::Vector3f> ThinnedInFrame(std::span<const Eigen::Vector3d> points,
                                            const Pose& T_map_thing,
                                            std::size_t most) {
  const Pose T_thing_map = T_map_thing.inverse();
  PointCloud cloud;
  cloud.points.reserve(points.size());
  for (const Eigen::Vector3d& p : points) cloud.points.push_back((T_thing_map * p).cast<float>());
  std::sort(cloud.points.begin(), cloud.points.end(), ComesFirst);
  if (cloud.size() > kMostThinned) {
    std::vector<Eigen::Vector3f> fewer;
    for (std::size_t i = 0; i < kMostThinned; ++i) {
      fewer.push_back(cloud.points[i * cloud.size() / kMostThinned]);
    }
    cloud.points = std::move(fewer);
  }
  for (double edge_m = kFinestM; cloud.size() > most; edge_m *= 1.25) {
    cloud = ThinCloud(cloud, edge_m);
  }
  return std::move(cloud.points);
}

ThingPoints::ThingPoints(std::vector<Eigen::Vector3f> points)
    : points_(std::move(points)),
      view_{points_},
      tree_(3, view_, nanoflann::KDTreeSingleIndexAdaptorParams(16)) {
  tree_.buildIndex();
  for (const Eigen::Vector3f& p : points_) bounds_.extend(p);
  spacing_m_ = MedianSpacing();
}

double ThingPoints::MedianSpacing() const {
  std::vector<float> squares;
  const std::size_t step = points_.size() / kSpacingSamples + 1;
  for (std::size_t i = 0; i < points_.size(); i += step) {
    std::uint32_t at[kFourth];
    float squared[kFourth];
    if (tree_.knnSearch(points_[i].data(), kFourth, at, squared) < kFourth) continue;
    squares.push_back(squared[kFourth - 1]);
  }
  if (squares.empty()) return 0.0;
  const auto middle = squares.begin() + static_cast<std::ptrdiff_t>(squares.size() / 2);
  std::nth_element(squares.begin(), middle, squares.end());
  return std::sqrt(static_cast<double>(*middle));
}

std::optional<std::size_t> ThingPoints::NearestTo(const Eigen::Vector3f& p, double reach_m) const {
  std::uint32_t at = 0;
  float squared = std::numeric_limits<float>::max();
  if (tree_.knnSearch(p.data(), 1, &at, &squared) == 0) return std::nullopt;
  if (!(static_cast<double>(squared) <= reach_m * reach_m)) return std::nullopt;
  return at;
}

std::vector<std::uint32_t> ThingPoints::NeighboursOf(const Eigen::Vector3f& p,
                                                     std::size_t count) const {
  std::vector<std::uint32_t> at(count);
  std::vector<float> squared(count);
  at.resize(tree_.knnSearch(p.data(), count, at.data(), squared.data()));
  return at;
}

KindFeatures KindFeaturesOf(const Eigen::Vector3d& box_size, double radius_m) {
  Eigen::Array3d edges = box_size.array().max(kLeastEdgeM);
  std::sort(edges.begin(), edges.end());
  return {std::log(edges.prod()), edges[1] / edges[2], std::log(std::max(radius_m, kLeastEdgeM))};
}

}  // namespace strata
