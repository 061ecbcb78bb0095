#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <utility>

#include "absl/strings/str_cat.h"

#include "core/classification/features/columns.h"
#include "core/classification/features/feature_columns.h"
#include "core/classification/features/ground_height.h"
#include "core/classification/features/local_shape.h"
#include "core/classification/features/neighbours.h"
#include "core/classification/features/voxels.h"
#include "core/common/status.h"

namespace strata {
namespace {

constexpr std::array kPerScale = {
    "linearity", "planarity", "scattering", "verticality", "axis_verticality", "reach"};
// How far the farthest neighbour is, as a share of so many voxels: lines reach far, volumes do not.
constexpr double kReachVoxels = 8.0;
// Heights as shares of these [m], at most 1: linear classifiers cannot bend a height themselves.
// The last is h_max.
constexpr std::array kHeightsM = {0.5, 3.0};

// Edges of the columns that points are looked at in [m], and the distance in them that counts as 1.
constexpr std::array kColumnsM = {0.5, 2.0};
constexpr float kColumnReachM = 3.0F;
constexpr std::array kPerColumn = {"above", "below", "filled"};

void PutColumns(std::span<const Eigen::Vector3f> points,
                const std::vector<float>& heights,
                Eigen::Index column,
                FeatureMatrix& to) {
  std::vector<float> ground(points.size());
  for (std::size_t i = 0; i < points.size(); ++i) ground[i] = points[i].z() - heights[i];
  for (const double edge_m : kColumnsM) {
    const std::vector<ColumnPlace> places = ColumnPlaces(points, ground, edge_m);
    for (std::size_t i = 0; i < places.size(); ++i) {
      const auto row = static_cast<Eigen::Index>(i);
      to(row, column) = std::min(1.0F, places[i].above_m / kColumnReachM);
      to(row, column + 1) = std::min(1.0F, places[i].below_m / kColumnReachM);
      to(row, column + 2) = places[i].filled;
    }
    column += static_cast<Eigen::Index>(kPerColumn.size());
  }
}

// The shapes among `around`, from column `column` on.
void PutScale(std::span<const Eigen::Vector3f> points,
              std::span<const Eigen::Vector3f> around,
              const Neighbours& neighbours,
              double reach_m,
              Eigen::Index column,
              FeatureMatrix& to) {
  for (std::size_t i = 0; i < points.size(); ++i) {
    const LocalShape shape = DescribeShape(points[i], around, neighbours.Of(i));
    const auto row = static_cast<Eigen::Index>(i);
    to(row, column) = shape.linearity();
    to(row, column + 1) = shape.planarity();
    to(row, column + 2) = shape.scattering();
    to(row, column + 3) = shape.verticality();
    to(row, column + 4) = std::abs(shape.axis.z());
    const float farthest =
        neighbours.count() > 0 ? std::sqrt(neighbours.SquaredDistances(i).back()) : 0.0F;
    to(row, column + 5) = std::min(1.0F, farthest / static_cast<float>(reach_m));
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
  for (const double edge : kColumnsM) {
    for (const char* name : kPerColumn) names.push_back(absl::StrCat(name, ".", edge));
  }
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
                         height_column + static_cast<Eigen::Index>(kHeightsM.size()) + 1 +
                             static_cast<Eigen::Index>(kColumnsM.size() * kPerColumn.size()) + 1);
  PutScale(
      points, points, Neighbours::Find(points, count), kReachVoxels * options.voxel_m, 0, features);
  double voxel_m = options.voxel_m;
  for (int scale = 1; scale < options.scales; ++scale, voxel_m *= 2.0) {
    STRATA_RETURN_IF_ERROR(stop.status());
    const std::vector<Eigen::Vector3f> around = VoxelMeans(points, voxel_m);
    PutScale(points,
             around,
             Neighbours::Find(points, around, count),
             kReachVoxels * voxel_m,
             scale * per_scale,
             features);
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
  PutColumns(
      points, heights, height_column + static_cast<Eigen::Index>(kHeightsM.size()) + 1, features);
  return features;
}

}  // namespace strata
