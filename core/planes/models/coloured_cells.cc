#include "core/planes/models/coloured_cells.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <iterator>
#include <span>
#include <utility>
#include <vector>

#include <Eigen/Core>

#include "core/common/hash_map.h"
#include "core/geometry/eigen_solvers.h"

namespace strata {
namespace {

constexpr std::size_t kLeastPart = 6;  // points, as of a cell
constexpr int kMostSplits = 2;         // of a part in halves: four parts
constexpr double kApart = 20.0;        // between the means of two parts, at least
// The squared distance of two parts over their variance along it. Two halves of a Gaussian have 7,
// of an even gradient 12.
constexpr double kValley = 16.0;
constexpr double kSurfaces = 3.0;  // in one of the largest cells, at most
constexpr double kAnyArea = 1e9;
constexpr double kSidesCosine = 0.97;  // between normals of two sides of one surface
constexpr double kSidesSigmas = 3.0;   // between their means, across it
// Of the smaller of two cells, what both cover: below the one they lie side by side, above the
// other they are two sides of one surface. Between them, the rims of what few points are in a cell.
constexpr double kSideBySide = 0.25, kTwoSides = 0.75;
constexpr double kLeastKept = 0.05;  // of a cell's area

struct ColouredPoint {
  std::array<std::int32_t, 3> at;  // one of the largest cells
  Eigen::Vector3f place;
  Eigen::Vector3f colour;  // LabColour
  float along = 0.0F;      // where it is on the line of a split
};
using Part = std::span<ColouredPoint>;

// The direction in which the colours differ most.
LabColour MainDifference(Part part) {
  LabColour mean = LabColour::Zero();
  for (const ColouredPoint& point : part) mean += point.colour.cast<double>();
  mean /= static_cast<double>(part.size());
  Eigen::Matrix3d squares = Eigen::Matrix3d::Zero();
  for (const ColouredPoint& point : part) {
    const LabColour off = point.colour.cast<double>() - mean;
    squares += off * off.transpose();
  }
  return Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(squares).eigenvectors().col(2);
}

// Points of the first of two parts, which then come first; none where the colours are one. The two
// have the least variance along the line of most (Otsu 1979).
std::size_t SplitPart(Part part) {
  if (part.size() < 2 * kLeastPart) return 0;
  const LabColour line = MainDifference(part);
  for (ColouredPoint& point : part) point.along = line.cast<float>().dot(point.colour);
  std::stable_sort(
      part.begin(), part.end(), [](const auto& a, const auto& b) { return a.along < b.along; });
  double sum = 0.0, squares = 0.0;
  for (const ColouredPoint& point : part) {
    const double along = point.along;
    sum += along;
    squares += along * along;
  }
  const auto n = static_cast<double>(part.size());
  double below = 0.0, best = 0.0, apart = 0.0;
  std::size_t split = 0;
  for (std::size_t i = 1; i + kLeastPart <= part.size(); ++i) {
    below += part[i - 1].along;
    if (i < kLeastPart) continue;
    const auto k = static_cast<double>(i);
    const double distance = (sum - below) / (n - k) - below / k;
    const double between = k * (n - k) * distance * distance;
    if (between <= best) continue;
    best = between;
    apart = distance;
    split = i;
  }
  const double within = squares / n - sum / n * (sum / n) - best / (n * n);
  return apart >= kApart && apart * apart >= kValley * within ? split : 0;
}

void Divide(Part part, int splits, std::vector<Part>& parts) {
  const std::size_t first = splits > 0 ? SplitPart(part) : 0;
  if (first == 0) {
    parts.push_back(part);
    return;
  }
  Divide(part.first(first), splits - 1, parts);
  Divide(part.subspan(first), splits - 1, parts);
}

CellColour MeanOf(Part part) {
  CellColour colour;
  const auto n = static_cast<double>(part.size());
  for (const ColouredPoint& point : part) colour.mean += point.colour.cast<double>() / n;
  for (const ColouredPoint& point : part) {
    colour.variance += (point.colour.cast<double>() - colour.mean).squaredNorm() / n;
  }
  return colour;
}

// `most_m2`: of all its cells.
void AddCells(Part part, double most_m2, const PlaneExtractionOptions& options, CellLayer& layer) {
  const CellColour colour = MeanOf(part);
  std::vector<Eigen::Vector3f> places;
  for (const ColouredPoint& point : part) places.push_back(point.place);
  for (PlanarCell& cell :
       FindPlanarCells(places, Eigen::Vector3f::Zero(), options, CellCheck::kEven)) {
    const double share = static_cast<double>(cell.point_count) / static_cast<double>(part.size());
    const double less = std::min(1.0, share * most_m2 / cell.area_m2);
    cell.area_m2 *= less;
    cell.moments *= less;
    layer.cells.push_back(cell);
    layer.colours.push_back(colour);
  }
}

std::vector<ColouredPoint> ByCell(const PosedPoints& points, double cell_size_m) {
  std::vector<ColouredPoint> all;
  all.reserve(points.points.size());
  const double smallest_m = cell_size_m / (1 << (kCellLevels - 1));
  for (std::size_t i = 0; i < points.points.size(); ++i) {
    ColouredPoint point;
    point.place = points.points[i];
    for (std::size_t axis = 0; axis < 3; ++axis) {
      // As the cells' own grid rounds.
      const double at = std::floor(point.place(static_cast<Eigen::Index>(axis)) / smallest_m);
      point.at[axis] = static_cast<std::int32_t>(at) >> (kCellLevels - 1);
    }
    point.colour = LabOf(points.colour[i]).cast<float>();
    all.push_back(point);
  }
  std::stable_sort(
      all.begin(), all.end(), [](const auto& a, const auto& b) { return a.at < b.at; });
  return all;
}

// A cell of any layer.
struct SharedCell {
  PlanarCell* cell = nullptr;
  LabColour colour;
  double lost_m2 = 0.0;
};
using CellPlaces = HashMap<std::uint64_t, std::vector<std::uint32_t>>;  // by level and place

std::uint64_t PlaceKey(int level, const std::array<std::int32_t, 3>& at) {
  auto key = static_cast<std::uint64_t>(level);
  for (const std::int32_t c : at) key = key << 20 | static_cast<std::uint64_t>(c & 0xFFFFF);
  return key;
}

// Half of the side of a rectangle that is spread as the cell's points are.
double HalfSide(const PlanarCell& cell, Eigen::Index axis) {
  const double square =
      cell.moments(axis, axis) / cell.moments(3, 3) - std::pow(cell.mean(axis), 2);
  return std::sqrt(3.0 * std::max(0.0, square));
}

// How much of the smaller of two cells is before or behind the other, seen along an axis of the
// grid; 0 unless they are of one surface.
double CommonShare(const PlanarCell& a, const PlanarCell& b, Eigen::Index axis) {
  const double off = std::abs(a.normal.dot(b.mean - a.mean));
  if (std::abs(a.normal.dot(b.normal)) < kSidesCosine ||
      off > kSidesSigmas * std::hypot(a.rms_m, b.rms_m)) {
    return 0.0;
  }
  double common_m2 = 1.0 / std::abs(a.normal(axis));
  for (Eigen::Index k = 0; k < 3; ++k) {
    if (k == axis) continue;
    const double half_a = HalfSide(a, k), half_b = HalfSide(b, k);
    const double begin = std::max(a.mean(k) - half_a, b.mean(k) - half_b);
    const double end = std::min(a.mean(k) + half_a, b.mean(k) + half_b);
    common_m2 *= std::max(0.0, end - begin);
  }
  const double share = common_m2 / std::min(a.area_m2, b.area_m2);
  return std::clamp((share - kSideBySide) / (kTwoSides - kSideBySide), 0.0, 1.0);
}

// `other` is as large as `one` or larger.
void ShareBetween(SharedCell& one, SharedCell& other, Eigen::Index axis) {
  if (!AreAlike(one.colour, other.colour)) return;
  const double common = CommonShare(*one.cell, *other.cell, axis);
  if (!(common > 0.0)) return;
  const double part = std::pow(one.cell->size_m / other.cell->size_m, 2);  // of the other's
  const double own = one.cell->point_count, others = part * other.cell->point_count;
  one.lost_m2 += common * one.cell->area_m2 * others / (own + others);
  other.lost_m2 += common * part * other.cell->area_m2 * own / (own + others);
}

void ShareWithNeighbours(std::uint32_t i, const CellPlaces& places, std::vector<SharedCell>& all) {
  const PlanarCell& cell = *all[i].cell;
  Eigen::Index axis = 0;
  cell.normal.cwiseAbs().maxCoeff(&axis);
  for (const std::int32_t step : {-1, 1}) {
    std::array<std::int32_t, 3> at = cell.at;
    at[static_cast<std::size_t>(axis)] += step;
    for (int level = cell.level; level < kCellLevels; ++level) {
      const auto found = places.find(PlaceKey(level, at));
      for (std::int32_t& c : at) c >>= 1;
      if (found == places.end()) continue;
      for (const std::uint32_t j : found->second) {
        // Two of one size find each other; a larger one may be the cell's own.
        if (j == i || (level == cell.level && j < i)) continue;
        ShareBetween(all[i], all[j], axis);
      }
    }
  }
}

std::vector<CellLayer> CellsByColour(const PosedPoints& points,
                                     const PlaneExtractionOptions& options) {
  std::vector<CellLayer> layers(1);
  std::vector<ColouredPoint> all = ByCell(points, options.cell_size_m);
  for (auto begin = all.begin(); begin != all.end();) {
    const auto end =
        std::find_if(begin, all.end(), [&](const auto& point) { return point.at != begin->at; });
    const auto count = static_cast<double>(std::distance(begin, end));
    std::vector<Part> parts;
    Divide(Part(begin, end), kMostSplits, parts);
    std::stable_sort(
        parts.begin(), parts.end(), [](Part a, Part b) { return a.size() > b.size(); });
    if (layers.size() < parts.size()) layers.resize(parts.size());
    const double most_m2 = kSurfaces * options.cell_size_m * options.cell_size_m;
    for (std::size_t k = 0; k < parts.size(); ++k) {
      const double share = static_cast<double>(parts[k].size()) / count;
      AddCells(parts[k], parts.size() > 1 ? share * most_m2 : kAnyArea, options, layers[k]);
    }
    begin = end;
  }
  return layers;
}

}  // namespace

std::vector<CellLayer> FindColouredCells(const PosedPoints& points,
                                         const PlaneExtractionOptions& options) {
  if (!points.colour.empty()) {
    std::vector<CellLayer> layers = CellsByColour(points, options);
    ShareBorders(layers);
    return layers;
  }
  std::vector<CellLayer> layers(1);
  const SensorOfPoint sensor_of = [&points](std::uint32_t i) {
    const auto view = std::upper_bound(
        points.views.begin(), points.views.end(), i, [](std::size_t k, const auto& one) {
          return k < one.end;
        });
    return view->sensor;
  };
  layers[0].cells =
      FindPlanarCells(points.points, Eigen::Vector3f::Zero(), options, CellCheck::kEven, sensor_of);
  layers[0].colours.resize(layers[0].cells.size());
  ShareBorders(layers);
  return layers;
}

void ShareBorders(std::vector<CellLayer>& layers) {
  std::vector<SharedCell> all;
  CellPlaces places;
  for (CellLayer& layer : layers) {
    for (std::size_t i = 0; i < layer.cells.size(); ++i) {
      PlanarCell& cell = layer.cells[i];
      places[PlaceKey(cell.level, cell.at)].push_back(static_cast<std::uint32_t>(all.size()));
      all.push_back({&cell, layer.colours[i].mean, 0.0});
    }
  }
  for (std::uint32_t i = 0; i < all.size(); ++i) ShareWithNeighbours(i, places, all);
  for (const SharedCell& one : all) {
    const double kept = std::max(kLeastKept, 1.0 - one.lost_m2 / one.cell->area_m2);
    one.cell->area_m2 *= kept;
    one.cell->moments *= kept;
  }
}

}  // namespace strata
