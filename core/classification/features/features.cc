#include "core/classification/features/features.h"

#include <cstddef>
#include <utility>

#include "absl/strings/str_cat.h"

#include "core/classification/features/feature_columns.h"
#include "core/common/option_checks.h"
#include "core/common/status.h"

namespace strata {
namespace {

absl::StatusOr<FeatureMatrix> ColumnsOf(const PointCloud& cloud,
                                        const PointFeatureOptions& options,
                                        const Stop& stop) {
  switch (options.set) {
    case FeatureSet::kShape:
      return ShapeFeatures(cloud, options, stop);
    case FeatureSet::kWall:
      return WallFeatures(cloud, options, stop);
    case FeatureSet::kSpin:
      return SpinFeatures(cloud, options, stop);
  }
  return absl::InvalidArgumentError("feature options: set is none");
}

FeatureMatrix Spread(const FeatureMatrix& features,
                     const std::vector<std::size_t>& rows,
                     std::size_t size) {
  FeatureMatrix all = FeatureMatrix::Zero(static_cast<Eigen::Index>(size), features.cols());
  for (std::size_t k = 0; k < rows.size(); ++k) {
    all.row(static_cast<Eigen::Index>(rows[k])) = features.row(static_cast<Eigen::Index>(k));
  }
  return all;
}

}  // namespace

absl::Status PointFeatureOptions::Validate() const {
  OptionChecks checks("feature options");
  checks.InRange("set", static_cast<int>(set), 1, 3);
  checks.InRange("neighbours", neighbours, 4, 64);
  checks.InRange("scales", scales, 1, 8);
  checks.InRange("voxel_m", voxel_m, 0.01, 10.0);
  checks.InRange("max_height_m", max_height_m, 1e-3, 1000.0);
  checks.InRange("plane_side_m", plane_side_m, 1e-6, 1.0);
  checks.InRange("wall_distance_m", wall_distance_m, 1e-6, 10.0);
  checks.InRange("spin_radius_m", spin_radius_m, 0.0, 100.0);
  return checks.status();
}

absl::string_view ToString(FeatureSet set) {
  switch (set) {
    case FeatureSet::kShape:
      return "shape";
    case FeatureSet::kWall:
      return "wall";
    case FeatureSet::kSpin:
      return "spin";
  }
  return "unknown";
}

absl::StatusOr<FeatureSet> FeatureSetFromName(absl::string_view name) {
  for (const FeatureSet set : {FeatureSet::kShape, FeatureSet::kWall, FeatureSet::kSpin}) {
    if (name == ToString(set)) return set;
  }
  return absl::InvalidArgumentError(
      absl::StrCat("feature set '", name.substr(0, 100), "' is none of shape, wall, spin"));
}

std::vector<std::string> FeatureNames(const PointFeatureOptions& options) {
  std::vector<std::string> names = options.set == FeatureSet::kShape  ? ShapeFeatureNames(options)
                                   : options.set == FeatureSet::kWall ? WallFeatureNames()
                                                                      : SpinFeatureNames();
  names.emplace_back("constant");
  return names;
}

absl::StatusOr<FeatureMatrix> ComputeFeatures(const PointCloud& cloud,
                                              const PointFeatureOptions& options,
                                              const Stop& stop) {
  STRATA_RETURN_IF_ERROR(options.Validate());
  PointCloud finite;
  finite.sensor_origin = cloud.sensor_origin;
  std::vector<std::size_t> rows;
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    if (!cloud.points[i].allFinite()) continue;
    finite.points.push_back(cloud.points[i]);
    rows.push_back(i);
  }
  STRATA_ASSIGN_OR_RETURN(FeatureMatrix features, ColumnsOf(finite, options, stop));
  if (rows.size() < cloud.size()) features = Spread(features, rows, cloud.size());
  features.rightCols(1).setOnes();
  return features;
}

}  // namespace strata
