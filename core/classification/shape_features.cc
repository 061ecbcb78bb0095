#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <utility>

#include "absl/strings/str_cat.h"

#include "core/classification/feature_columns.h"
#include "core/classification/ground_height.h"
#include "core/classification/local_shape.h"
#include "core/classification/neighbours.h"
#include "core/classification/voxels.h"
#include "core/common/status.h"

namespace strata {
namespace {

constexpr std::array kPerScale = {
    "linearity", "planarity", "scattering", "verticality", "axis_verticality"};
// Heights as shares of these [m], at most 1: linear classifiers cannot bend a height themselves.
// The last is h_max.
constexpr std::array kHeightsM = {0.5, 3.0};

void PutShape(const LocalShape& shape, Eigen::Index row, Eigen::Index column, FeatureMatrix& to) {
  to(row, column) = shape.linearity();
  to(row, column + 1) = shape.planarity();
  to(row, column + 2) = shape.scattering();
  to(row, column + 3) = shape.verticality();
  to(row, column + 4) = std::abs(shape.axis.z());
}

// The shapes among `around`, from column `column` on.
void PutScale(std::span<const Eigen::Vector3f> points,
              std::span<const Eigen::Vector3f> around,
              const Neighbours& neighbours,
              Eigen::Index column,
              FeatureMatrix& to) {
  for (std::size_t i = 0; i < points.size(); ++i) {
    const LocalShape shape = DescribeShape(points[i], around, neighbours.Of(i));
    PutShape(shape, static_cast<Eigen::Index>(i), column, to);
  }
}

}  // namespace

std::vector<std::string> ShapeFeatureNames(const PointFeatureOptions& options) {
  std::vector<std::string> names;
  for (int scale = 0; scale < options.scales; ++scale) {
    for (const char* name : kPerScale) names.push_back(absl::StrCat(name, ".", scale));
  }
  for (const double height : kHeightsM) names.push_back(absl::StrCat("height.", height));
  names.push_back(absl::StrCat("height.", options.max_height_m));
  return names;
}

absl::StatusOr<FeatureMatrix> ShapeFeatures(const PointCloud& cloud,
                                            const PointFeatureOptions& options,
                                            const Stop& stop) {
  const std::span<const Eigen::Vector3f> points = cloud.points;
  const auto count = static_cast<std::size_t>(options.neighbours);
  const auto per_scale = static_cast<Eigen::Index>(kPerScale.size());
  const Eigen::Index height_column = options.scales * per_scale;
  FeatureMatrix features(static_cast<Eigen::Index>(points.size()),
                         height_column + static_cast<Eigen::Index>(kHeightsM.size()) + 1);
  PutScale(points, points, Neighbours::Find(points, count), 0, features);
  double voxel_m = options.voxel_m;
  for (int scale = 1; scale < options.scales; ++scale, voxel_m *= 2.0) {
    STRATA_RETURN_IF_ERROR(stop.status());
    const std::vector<Eigen::Vector3f> around = VoxelMeans(points, voxel_m);
    PutScale(points, around, Neighbours::Find(points, around, count), scale * per_scale, features);
  }
  STRATA_RETURN_IF_ERROR(stop.status());
  STRATA_ASSIGN_OR_RETURN(const std::vector<float> heights, HeightsAboveLowest(points));
  for (std::size_t i = 0; i < heights.size(); ++i) {
    Eigen::Index column = height_column;
    const auto row = static_cast<Eigen::Index>(i);
    const auto share = [&](double of) {
      return std::min(1.0F, heights[i] / static_cast<float>(of));
    };
    for (const double height : kHeightsM) features(row, column++) = share(height);
    features(row, column) = share(options.max_height_m);
  }
  return features;
}

}  // namespace strata
