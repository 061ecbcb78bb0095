#include "core/planes/models/peeled_cells.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include <Eigen/Core>

#include "core/common/hash_map.h"
#include "core/common/random.h"
#include "core/geometry/primitives.h"
#include "core/planes/extraction.h"
#include "core/planes/models/coloured_cells.h"
#include "core/planes/moments.h"
#include "core/planes/planar_cells.h"

namespace strata {
namespace {

constexpr std::size_t kLeastOn = 8;
constexpr std::size_t kMostPeels = 4;  // of one place
constexpr int kDraws = 100;
constexpr int kRefits = 3;
constexpr double kPeelBandM = 0.03;  // of a drawn plane
constexpr double kPeelSigmas = 2.5;  // of a fitted one, at least half and at most twice that
constexpr double kPeelFlatness = 4.0, kPeelRoundness = 0.005;  // as of cells, but for rims
constexpr double kFlankRatio = 3.0;   // of points in the band to those beside it, as wide again
constexpr double kKnownRatio = 3.0;   // of known points in it to those of the peel, at most
constexpr double kReachSigmas = 1.8;  // of a peel's points along its sides: all of an even surface

using Place = std::array<std::int32_t, 3>;  // of one of the largest cells
struct PlacedPoint {
  Place at;
  Eigen::Vector3d p;
};
using Points = std::span<PlacedPoint>;

Place PlaceOf(const Eigen::Vector3f& p, double cell_size_m) {
  Place at;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const double cell = std::floor(p(static_cast<Eigen::Index>(axis)) / cell_size_m);
    at[axis] = static_cast<std::int32_t>(cell);
  }
  return at;
}

// `known` points by places that have enough others.
using KnownPoints = HashMap<Place, std::vector<Eigen::Vector3f>>;

struct Peel {
  MomentsFit fit;
  double rms_m = 0.0;
  double band_m = kPeelBandM;
  std::size_t on = 0;
};

std::optional<Plane> DrawPlane(Points points, SplitMix64& random) {
  const auto n = static_cast<std::uint32_t>(points.size());
  double best = 0.0;
  std::optional<Plane> plane;
  for (int draw = 0; draw < kDraws; ++draw) {
    const std::uint32_t i = random.Below(n), j = random.Below(n), k = random.Below(n);
    const Eigen::Vector3d across = (points[j].p - points[i].p).cross(points[k].p - points[i].p);
    if (across.norm() < 1e-3) continue;
    Plane drawn;
    drawn.normal = across.normalized();
    drawn.distance = drawn.normal.dot(points[i].p);
    double score = 0.0;
    for (const PlacedPoint& point : points) {
      const double off = SignedDistance(point.p, drawn) / kPeelBandM;
      score += std::max(0.0, 1.0 - off * off);
    }
    if (score <= best) continue;
    best = score;
    plane = drawn;
  }
  return plane;
}

// False with too few points.
bool Refit(Points points, const Plane& plane, Peel& peel) {
  Eigen::Matrix4d sum = Eigen::Matrix4d::Zero();
  for (const PlacedPoint& point : points) {
    if (Distance(point.p, plane) > peel.band_m) continue;
    const Eigen::Vector4d x = point.p.homogeneous();
    sum += x * x.transpose();
  }
  const double n = sum(3, 3);
  peel.on = static_cast<std::size_t>(n);
  if (peel.on < kLeastOn) return false;
  peel.fit = FitMoments(sum);
  peel.rms_m = std::sqrt(peel.fit.eigenvalues(0) * n / (n - 3.0));
  peel.band_m = std::clamp(kPeelSigmas * peel.rms_m, 0.5 * kPeelBandM, 2.0 * kPeelBandM);
  return true;
}

bool IsSurface(Points points, const Peel& peel, const PlaneExtractionOptions& options) {
  const Eigen::Vector3d& e = peel.fit.eigenvalues;
  if (peel.rms_m > options.max_rms_m || e(1) < kPeelFlatness * e(0) ||
      e(1) < kPeelRoundness * e(2)) {
    return false;
  }
  const auto wide = std::count_if(points.begin(), points.end(), [&](const PlacedPoint& point) {
    return Distance(point.p, peel.fit.plane) <= 2.0 * peel.band_m;
  });
  const auto on = static_cast<double>(peel.on);
  return on >= kFlankRatio * (static_cast<double>(wide) - on);
}

std::optional<Peel> PeelOf(Points points,
                           const PlaneExtractionOptions& options,
                           SplitMix64& random) {
  std::optional<Plane> plane = DrawPlane(points, random);
  if (!plane.has_value()) return std::nullopt;
  Peel peel;
  for (int i = 0; i < kRefits; ++i) {
    if (!Refit(points, *plane, peel)) return std::nullopt;
    plane = peel.fit.plane;
  }
  return IsSurface(points, peel, options) ? std::optional(peel) : std::nullopt;
}

// Whether known points are by far more in its band and where it is.
bool IsScatter(const Peel& peel, std::span<const Eigen::Vector3f> known) {
  const Eigen::Array3d sides = kReachSigmas * peel.fit.eigenvalues.cwiseSqrt();
  const Eigen::Array3d reach(peel.band_m, sides(1), sides(2));
  const auto in = std::count_if(known.begin(), known.end(), [&](const Eigen::Vector3f& p) {
    const Eigen::Vector3d at =
        peel.fit.eigenvectors.transpose() * (p.cast<double>() - peel.fit.mean);
    return (at.array().abs() <= reach).all();
  });
  return static_cast<double>(in) > kKnownRatio * static_cast<double>(peel.on);
}

PlanarCell CellOfPeel(const Peel& peel, const Place& at, const PlaneExtractionOptions& options) {
  PlanarCell cell;
  cell.level = kCellLevels - 1;
  cell.at = at;
  cell.size_m = options.cell_size_m;
  cell.point_count = static_cast<std::uint32_t>(peel.on);
  cell.normal = peel.fit.plane.normal;
  const Eigen::Vector3d& e = peel.fit.eigenvalues;
  cell.area_m2 = SpreadArea(e, CrossSectionOf(cell.size_m, cell.normal));
  cell.sigma_m = options.sensor.sigma_m;
  cell.rms_m = peel.rms_m;
  cell.mean = peel.fit.mean;
  const Eigen::Matrix3d& V = peel.fit.eigenvectors;
  cell.moments = MomentsOf(cell.area_m2, cell.mean, V * e.asDiagonal() * V.transpose());
  return cell;
}

std::vector<PlacedPoint> ByPlace(std::span<const Eigen::Vector3f> points, double cell_size_m) {
  std::vector<PlacedPoint> all;
  all.reserve(points.size());
  for (const Eigen::Vector3f& p : points) {
    all.push_back({PlaceOf(p, cell_size_m), p.cast<double>()});
  }
  std::stable_sort(
      all.begin(), all.end(), [](const auto& a, const auto& b) { return a.at < b.at; });
  return all;
}

KnownPoints KnownNear(std::span<const PlacedPoint> left,
                      std::span<const Eigen::Vector3f> known,
                      double cell_size_m) {
  KnownPoints near;
  for (std::size_t i = 0; i + kLeastOn <= left.size(); ++i) {
    if (left[i + kLeastOn - 1].at == left[i].at) near.try_emplace(left[i].at);
  }
  for (const Eigen::Vector3f& p : known) {
    const auto found = near.find(PlaceOf(p, cell_size_m));
    if (found != near.end()) found->second.push_back(p);
  }
  return near;
}

// All cells of one place.
void PeelPlace(Points points,
               std::span<const Eigen::Vector3f> known,
               const PlaneExtractionOptions& options,
               SplitMix64& random,
               std::vector<CellLayer>& layers) {
  for (std::size_t k = 0; k < kMostPeels && points.size() >= kLeastOn; ++k) {
    const std::optional<Peel> peel = PeelOf(points, options, random);
    if (!peel.has_value()) return;
    if (layers.size() <= k) layers.resize(k + 1);
    if (!IsScatter(*peel, known)) {
      layers[k].cells.push_back(CellOfPeel(*peel, points.front().at, options));
    }
    const auto rest =
        std::stable_partition(points.begin(), points.end(), [&](const PlacedPoint& point) {
          return Distance(point.p, peel->fit.plane) > peel->band_m;
        });
    points = Points(points.begin(), rest);
  }
}

}  // namespace

std::vector<CellLayer> PeelCells(std::span<const Eigen::Vector3f> left,
                                 std::span<const Eigen::Vector3f> known,
                                 const PlaneExtractionOptions& options) {
  std::vector<PlacedPoint> all = ByPlace(left, options.cell_size_m);
  const KnownPoints near = KnownNear(all, known, options.cell_size_m);
  SplitMix64 random(1);
  std::vector<CellLayer> layers;
  for (auto begin = all.begin(); begin != all.end();) {
    const auto end =
        std::find_if(begin, all.end(), [&](const auto& point) { return point.at != begin->at; });
    const auto found = near.find(begin->at);
    if (found != near.end()) {
      PeelPlace(Points(begin, end), found->second, options, random, layers);
    }
    begin = end;
  }
  for (CellLayer& layer : layers) layer.colours.resize(layer.cells.size());
  return layers;
}

}  // namespace strata
