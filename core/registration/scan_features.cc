#include "core/registration/scan_features.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include <Eigen/Core>
#include <Eigen/Eigenvalues>

#include "core/common/option_checks.h"
#include "core/common/random.h"
#include "core/mls/features.h"
#include "core/mls/mls_map.h"
#include "core/mls/sides.h"
#include "core/registration/column_grid.h"
#include "core/registration/upright_offsets.h"

namespace strata {
namespace {

// Columns of this width hold a few tens of features near the sensor, and the nearest one is most
// often in the first.
constexpr float kColumnSizeM = 0.4F;

using ClassPoints = std::array<std::vector<Eigen::Vector3f>, kFeatureClasses>;

std::vector<Eigen::Vector3f>& ListOf(FeatureClass c, ClassPoints& points) {
  return points[static_cast<std::size_t>(c)];
}

// `cell` and `place` of a patch of the map that `offsets`, if any, are of.
void AppendVertical(const Patch& patch,
                    const Eigen::Vector2f& middle,
                    double samples_per_metre,
                    const UprightOffsets* offsets,
                    CellIndex cell,
                    std::size_t place,
                    ClassPoints& points) {
  const double depth = patch.depth_m();
  const int n = SamplesOf(patch, samples_per_metre);
  for (int i = 0; i < n; ++i) {
    const Eigen::Vector2f p =
        offsets == nullptr ? middle : middle + offsets->Of(cell, patch, place, i);
    ListOf(FeatureClass::kVertical, points)
        .emplace_back(p.x(), p.y(), static_cast<float>(patch.bottom_m() + (i + 0.5) * depth / n));
  }
}

std::uint64_t ContentHash(const ClassPoints& points) {
  std::uint64_t hash = 0;
  for (const auto& list : points) {
    for (const Eigen::Vector3f& p : list) {
      hash = SplitMix64(hash ^ std::bit_cast<std::uint32_t>(p.z())).Next();
    }
  }
  return hash;
}

}  // namespace

absl::Status ScanFeatureOptions::Validate() const {
  OptionChecks checks("feature options");
  checks.InRange("samples_per_metre", samples_per_metre, 0.1, 100.0);
  checks.InRange("max_range_m", max_range_m, 1.0, 1e4);
  checks.InRange("sample_count", sample_count, 0, 1000000);
  checks.InRange("neighbours", neighbours, 4, ColumnGrid::kMaxNeighbours);
  checks.InRange("neighbour_radius_m", neighbour_radius_m, 0.01, 100.0);
  checks.InRange("|sensor_origin|", sensor_origin.norm(), 0.0, 1e8);
  checks.InRange("|up|", up.norm(), 0.999, 1.001);
  return checks.status();
}

float NeighbourMoments::SpreadAlong(const Eigen::Vector3f& direction) const {
  const float along = direction.dot(mean());
  const float square = direction.dot(squares * direction) / static_cast<float>(n);
  return std::sqrt(std::max(0.0F, square - along * along));
}

SurfaceElement ElementAt(const Eigen::Vector3f& p, const NeighbourMoments& neighbours) {
  SurfaceElement element{p, Eigen::Vector3f::Zero()};
  if (neighbours.n < 4) return element;
  const Eigen::Vector3f mean = neighbours.mean();
  const Eigen::Matrix3d covariance =
      (neighbours.squares - neighbours.sum * mean.transpose()).cast<double>();
  Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> eigen;
  eigen.computeDirect(covariance);
  if (eigen.eigenvalues()[1] < 1e-3 * eigen.eigenvalues()[2]) return element;
  element.normal = eigen.eigenvectors().col(0).cast<float>();
  element.point += element.normal.dot(mean) * element.normal;
  return element;
}

SurfaceElement FitSurfaceElement(const ColumnGrid& grid,
                                 const Eigen::Vector3f& p,
                                 int neighbours,
                                 float radius_m) {
  std::array<std::uint32_t, ColumnGrid::kMaxNeighbours> indices;
  const int n = grid.Nearest(p, neighbours, radius_m, indices.data());
  NeighbourMoments moments;
  for (int i = 0; i < n; ++i) moments.Add(grid.points()[indices[i]] - p);
  return ElementAt(p, moments);
}

ScanFeatures ScanFeatures::FromMap(const MlsMap& local_map,
                                   const ScanFeatureOptions& options,
                                   const UprightOffsets* offsets) {
  ClassPoints points;
  const double cell_size = local_map.parameters.cell_size_m;
  const double max_range_m2 = options.max_range_m * options.max_range_m;
  for (const FeatureClass c : {FeatureClass::kTraversable, FeatureClass::kVertical}) {
    ListOf(c, points).reserve(local_map.patch_count());
  }
  const Eigen::Vector3d p_map_sensor = options.R_map_scan * options.sensor_origin;
  const std::vector<Side> sides =
      SidesOf(local_map, p_map_sensor, options.max_range_m, options.R_map_scan * options.up);
  // Tops above the sensor, behind the others: samples are drawn by place, and recorded figures with
  // them.
  std::vector<Eigen::Vector3f> overhead;
  std::vector<Eigen::Vector3f> doubtful;
  std::size_t place = 0;
  for (const MlsTile& tile : local_map.tiles) {
    for (const Patch& patch : tile.patches) {
      const std::size_t here = place++;
      const Side side = sides[here];
      const CellIndex cell = CellOf(tile.key, static_cast<std::uint16_t>(patch.cell));
      const double x = (cell.x + 0.5) * cell_size;
      const double y = (cell.y + 0.5) * cell_size;
      if (x * x + y * y > max_range_m2) continue;
      const Eigen::Vector3f p = Eigen::Vector3d(x, y, patch.mean_m()).cast<float>();
      if (patch.vertical()) {
        AppendVertical(patch, p.head<2>(), options.samples_per_metre, offsets, cell, here, points);
      } else if (side == Side::kUnderside) {
        ListOf(FeatureClass::kNonTraversable, points).push_back(p);
      } else if (side == Side::kDoubtful) {  // taken for a top it pulls a storey down onto it
        doubtful.push_back(p);
      } else {
        const bool above = patch.mean_m() > p_map_sensor.z();
        (above ? overhead : ListOf(FeatureClass::kTraversable, points)).push_back(p);
      }
    }
  }
  std::vector<Eigen::Vector3f>& tops = ListOf(FeatureClass::kTraversable, points);
  tops.insert(tops.end(), overhead.begin(), overhead.end());
  if (!options.R_map_scan.isIdentity(0.0)) {
    const Eigen::Matrix3f R_scan_map = options.R_map_scan.transpose().cast<float>();
    const auto turn_back = [&](std::vector<Eigen::Vector3f>& list) {
      for (Eigen::Vector3f& p : list) p = R_scan_map * p;
    };
    std::ranges::for_each(points, turn_back);
    turn_back(doubtful);
  }
  for (auto& list : points) list.shrink_to_fit();
  doubtful.shrink_to_fit();
  ScanFeatures features = FromPoints(std::move(points), options);
  features.doubtful_ = std::move(doubtful);
  return features;
}

ScanFeatures ScanFeatures::FromFeatures(std::span<const Feature> features,
                                        const ScanFeatureOptions& options) {
  ClassPoints points;
  const double max_range_m2 = options.max_range_m * options.max_range_m;
  for (const Feature& feature : features) {
    if (feature.p_map.head<2>().squaredNorm() > max_range_m2) continue;
    ListOf(feature.feature_class, points).emplace_back(feature.p_map.cast<float>());
  }
  return FromPoints(std::move(points), options);
}

ScanFeatures ScanFeatures::FromPoints(ClassPoints points, const ScanFeatureOptions& options) {
  ScanFeatures features;
  features.points_ = std::move(points);
  features.sensor_origin_ = options.sensor_origin;
  features.up_ = options.up;
  std::array<ColumnGrid, kFeatureClasses> grids;
  if (options.sample_count == 0) return features;
  for (int c = 0; c < kFeatureClasses; ++c) {
    grids[c] = ColumnGrid(features.points_[c], kColumnSizeM);
  }
  // Not the same places in every scan, or their bias would add up along a chain of scans.
  SplitMix64 random(options.seed ^ ContentHash(features.points_));
  const std::vector<std::uint32_t> chosen =
      SampleIndices(static_cast<std::uint32_t>(features.size()),
                    static_cast<std::uint32_t>(options.sample_count),
                    random);
  features.sample_.resize(chosen.size());
  for (std::size_t i = 0; i < chosen.size(); ++i) {
    std::size_t c = 0;
    std::size_t place = chosen[i];
    while (place >= features.points_[c].size()) place -= features.points_[c++].size();
    SampledFeature& sampled = features.sample_[i];
    sampled.feature_class = static_cast<FeatureClass>(c);
    sampled.element = FitSurfaceElement(grids[c],
                                        features.points_[c][place],
                                        options.neighbours,
                                        static_cast<float>(options.neighbour_radius_m));
  }
  return features;
}

std::size_t ScanFeatures::size() const {
  std::size_t size = 0;
  for (const auto& list : points_) size += list.size();
  return size;
}

std::size_t ScanFeatures::memory_bytes() const {
  std::size_t bytes = sizeof(*this) + sample_.capacity() * sizeof(SampledFeature) +
                      doubtful_.capacity() * sizeof(Eigen::Vector3f);
  for (const auto& list : points_) bytes += list.capacity() * sizeof(Eigen::Vector3f);
  return bytes;
}

}  // namespace strata
