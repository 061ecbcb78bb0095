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
constexpr double kSidesApart = 0.25;   // of a cell's edge, along it

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
  for (PlanarCell& cell : FindPlanarCells(places, Eigen::Vector3f::Zero(), options)) {
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

// Cells by level and place; of several layers.
struct CellPlace {
  std::size_t layer = 0, index = 0;
};
using CellPlaces = HashMap<std::uint64_t, std::vector<CellPlace>>;

std::uint64_t PlaceKey(int level, const std::array<std::int32_t, 3>& at) {
  auto key = static_cast<std::uint64_t>(level);
  for (const std::int32_t c : at) key = key << 20 | static_cast<std::uint64_t>(c & 0xFFFFF);
  return key;
}

// Whether they are two sides of one surface, and not two parts of it side by side.
bool AreTwoSides(const PlanarCell& a, const PlanarCell& b) {
  const Eigen::Vector3d apart = b.mean - a.mean;
  const double off = apart.dot(a.normal);
  return std::abs(a.normal.dot(b.normal)) >= kSidesCosine &&
         std::abs(off) <= kSidesSigmas * std::hypot(a.rms_m, b.rms_m) &&
         (apart - off * a.normal).norm() <= kSidesApart * a.size_m;
}

// Points of the other sides of the surface that is in a cell.
double PointsBeside(const PlanarCell& cell,
                    const CellColour& colour,
                    const std::vector<CellLayer>& layers,
                    const CellPlaces& places) {
  Eigen::Index axis = 0;
  cell.normal.cwiseAbs().maxCoeff(&axis);
  double points = 0.0;
  for (const int step : {-1, 1}) {
    std::array<std::int32_t, 3> at = cell.at;
    at[static_cast<std::size_t>(axis)] += step;
    const auto found = places.find(PlaceKey(cell.level, at));
    if (found == places.end()) continue;
    for (const CellPlace& place : found->second) {
      const PlanarCell& other = layers[place.layer].cells[place.index];
      if (!AreAlike(colour.mean, layers[place.layer].colours[place.index].mean)) continue;
      if (AreTwoSides(cell, other)) points += other.point_count;
    }
  }
  return points;
}

void ShareSides(std::vector<CellLayer>& layers) {
  CellPlaces places;
  for (std::size_t k = 0; k < layers.size(); ++k) {
    for (std::size_t i = 0; i < layers[k].cells.size(); ++i) {
      places[PlaceKey(layers[k].cells[i].level, layers[k].cells[i].at)].push_back({k, i});
    }
  }
  for (CellLayer& layer : layers) {
    for (std::size_t i = 0; i < layer.cells.size(); ++i) {
      PlanarCell& cell = layer.cells[i];
      const double beside = PointsBeside(cell, layer.colours[i], layers, places);
      const double share = cell.point_count / (cell.point_count + beside);
      cell.area_m2 *= share;
      cell.moments *= share;
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
    ShareSides(layers);
    return layers;
  }
  std::vector<CellLayer> layers(1);
  layers[0].cells = FindPlanarCells(points.points, Eigen::Vector3f::Zero(), options);
  ShareBorders(layers[0].cells);
  layers[0].colours.resize(layers[0].cells.size());
  return layers;
}

}  // namespace strata
