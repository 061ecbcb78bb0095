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

#include "core/common/hash_map.h"
#include "core/common/option_checks.h"
#include "core/common/random.h"
#include "core/mls/features.h"
#include "core/mls/mls_map.h"
#include "core/registration/column_grid.h"

namespace strata {
namespace {

// Columns of this width hold a few tens of features near the sensor, and the nearest one is most
// often in the first.
constexpr float kColumnSizeM = 0.4F;

// The surface around a point is judged in cubes of this edge [m], and is none where points spread
// more about it [m].
constexpr float kFacingCubeM = 1.0F;
constexpr double kMaxSpreadM = 0.05;
constexpr int kMinSurfacePoints = 4;
// Of the normal to the vertical, as a cosine: what is level, and what leans too much to be.
constexpr double kLevel = 0.9;
// A ceiling shows in layers of this height [m] with as many points as this.
constexpr float kCeilingLayerM = 0.25F;
constexpr int kMinCeilingPoints = 50;

using ClassPoints = std::array<std::vector<Eigen::Vector3f>, kFeatureClasses>;

std::vector<Eigen::Vector3f>& ListOf(FeatureClass c, ClassPoints& points) {
  return points[static_cast<std::size_t>(c)];
}

void AppendPatch(
    const Patch& patch, float x, float y, double samples_per_metre, ClassPoints& points) {
  if (!patch.vertical()) {
    ListOf(FeatureClass::kTraversable, points)
        .emplace_back(x, y, static_cast<float>(patch.mean_m()));
    return;
  }
  const double depth = patch.depth_m();
  const int n = std::max(1, static_cast<int>(std::lround(depth * samples_per_metre)));
  for (int i = 0; i < n; ++i) {
    ListOf(FeatureClass::kVertical, points)
        .emplace_back(x, y, static_cast<float>(patch.bottom_m() + (i + 0.5) * depth / n));
  }
}

// Moments of points, from the first of them.
struct Moments {
  int n = 0;
  Eigen::Vector3d first = Eigen::Vector3d::Zero();
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  Eigen::Matrix3d squares = Eigen::Matrix3d::Zero();

  void Add(const Eigen::Vector3d& p) {
    if (n++ == 0) first = p;
    sum += p - first;
    squares += (p - first) * (p - first).transpose();
  }
};

enum class Side { kTop, kUnderside, kUnknown };

// Which side of what its points span was seen from `origin`. What spans no surface, or one that is
// not level, is taken for a top: leaves, a hillside, the lines that beams draw on a wall.
Side SideOf(const Moments& m, const Eigen::Vector3d& origin) {
  if (m.n < kMinSurfacePoints) return Side::kUnknown;
  const Eigen::Vector3d mean = m.sum / m.n;
  Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> eigen;
  eigen.computeDirect(m.squares / m.n - mean * mean.transpose());
  const Eigen::Vector3d variances = eigen.eigenvalues();
  if (variances[0] > kMaxSpreadM * kMaxSpreadM) return Side::kTop;
  if (variances[1] < kMaxSpreadM * kMaxSpreadM) return Side::kUnknown;  // a line
  Eigen::Vector3d normal = eigen.eigenvectors().col(0);
  if (normal.dot(origin - m.first - mean) < 0.0) normal = -normal;
  return normal.z() < -kLevel ? Side::kUnderside : Side::kTop;
}

// Heights at which a scan shows undersides.
class Ceilings {
 public:
  void Add(float z) { ++counts_[LayerOf(z)]; }
  bool MayBeAt(float z) const {
    const int layer = LayerOf(z);
    return IsAt(layer - 1) || IsAt(layer) || IsAt(layer + 1);
  }

 private:
  static int LayerOf(float z) { return static_cast<int>(std::floor(z / kCeilingLayerM)); }
  bool IsAt(int layer) const {
    const auto found = counts_.find(layer);
    return found != counts_.end() && found->second >= kMinCeilingPoints;
  }
  HashMap<int, int> counts_;
};

// Moves the undersides of decks and ceilings out of the traversable class. What may be of either
// side and is as high as a ceiling is left out: taken for a top it pulls a storey down onto it.
void SeparateUndersides(const Eigen::Vector3f& sensor_origin, ClassPoints& points) {
  using Cube = std::array<int, 3>;
  const auto cube_of = [](const Eigen::Vector3f& p) {
    const Eigen::Vector3f at = (p / kFacingCubeM).array().floor();
    return Cube{static_cast<int>(at.x()), static_cast<int>(at.y()), static_cast<int>(at.z())};
  };
  std::vector<Eigen::Vector3f>& horizontal = ListOf(FeatureClass::kTraversable, points);
  const auto above =
      std::stable_partition(horizontal.begin(), horizontal.end(), [&](const Eigen::Vector3f& p) {
        return p.z() <= sensor_origin.z();
      });
  HashMap<Cube, Moments> cubes;
  std::for_each(above, horizontal.end(), [&](const auto& p) {
    cubes[cube_of(p)].Add(p.template cast<double>());
  });
  HashMap<Cube, Side> sides;
  for (const auto& [cube, moments] : cubes) {
    sides[cube] = SideOf(moments, sensor_origin.cast<double>());
  }
  Ceilings ceilings;
  const auto undersides = std::stable_partition(above, horizontal.end(), [&](const auto& p) {
    return sides[cube_of(p)] != Side::kUnderside;
  });
  std::for_each(undersides, horizontal.end(), [&](const auto& p) { ceilings.Add(p.z()); });
  ListOf(FeatureClass::kNonTraversable, points).assign(undersides, horizontal.end());
  const auto doubtful = std::stable_partition(above, undersides, [&](const auto& p) {
    return sides[cube_of(p)] == Side::kTop || !ceilings.MayBeAt(p.z());
  });
  horizontal.erase(doubtful, horizontal.end());
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
  return checks.status();
}

SurfaceElement FitSurfaceElement(const ColumnGrid& grid,
                                 const Eigen::Vector3f& p,
                                 int neighbours,
                                 float radius_m) {
  SurfaceElement element{p, Eigen::Vector3f::Zero()};
  std::array<std::uint32_t, ColumnGrid::kMaxNeighbours> indices;
  const int n = grid.Nearest(p, neighbours, radius_m, indices.data());
  if (n < 4) return element;
  Eigen::Vector3f sum = Eigen::Vector3f::Zero();
  Eigen::Matrix3f moments = Eigen::Matrix3f::Zero();
  for (int i = 0; i < n; ++i) {
    const Eigen::Vector3f d = grid.points()[indices[i]] - p;  // small numbers: float suffices
    sum += d;
    moments += d * d.transpose();
  }
  const Eigen::Vector3f mean = sum / static_cast<float>(n);
  const Eigen::Matrix3d covariance = (moments - sum * mean.transpose()).cast<double>();
  Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> eigen;
  eigen.computeDirect(covariance);
  if (eigen.eigenvalues()[1] < 1e-3 * eigen.eigenvalues()[2]) return element;
  element.normal = eigen.eigenvectors().col(0).cast<float>();
  element.point += element.normal.dot(mean) * element.normal;
  return element;
}

ScanFeatures ScanFeatures::FromMap(const MlsMap& local_map, const ScanFeatureOptions& options) {
  ClassPoints points;
  const double cell_size = local_map.parameters.cell_size_m;
  const double max_range_m2 = options.max_range_m * options.max_range_m;
  for (const FeatureClass c : {FeatureClass::kTraversable, FeatureClass::kVertical}) {
    ListOf(c, points).reserve(local_map.patch_count());
  }
  for (const MlsTile& tile : local_map.tiles) {
    for (const Patch& patch : tile.patches) {
      const CellIndex cell = CellOf(tile.key, static_cast<std::uint16_t>(patch.cell));
      const double x = (cell.x + 0.5) * cell_size;
      const double y = (cell.y + 0.5) * cell_size;
      if (x * x + y * y > max_range_m2) continue;
      AppendPatch(
          patch, static_cast<float>(x), static_cast<float>(y), options.samples_per_metre, points);
    }
  }
  SeparateUndersides(options.sensor_origin.cast<float>(), points);
  for (auto& list : points) list.shrink_to_fit();
  return FromPoints(std::move(points), options);
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
  std::size_t bytes = sizeof(*this) + sample_.capacity() * sizeof(SampledFeature);
  for (const auto& list : points_) bytes += list.capacity() * sizeof(Eigen::Vector3f);
  return bytes;
}

}  // namespace strata
