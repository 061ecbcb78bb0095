#include "core/planes/planar_cells.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include <Eigen/Core>

#include "core/common/hash_map.h"
#include "core/planes/extraction.h"
#include "core/planes/moments.h"

namespace strata {
namespace {

constexpr std::uint32_t kMinPoints = 6;
constexpr int kCoordinateBits = 16;
constexpr std::int32_t kOffset = 1 << (kCoordinateBits - 1);
// A node is kept whole while its mean squared residual is at most this much above that of its
// children: noise is the same in both, a step or a bend is not.
constexpr double kMergeRatio = 1.5;
constexpr double kLeastSquaresM2 = 1e-8;  // of a spread, for points on one line
constexpr double kMinFlatness = 9.0;      // second over first eigenvalue: 3 σ of thickness
constexpr double kMinRoundness = 0.01;    // second over third: a single scan line is no surface
constexpr double kFacesRatio = 2.0;       // as kMergeRatio, of two faces

struct CodedPoint {
  std::uint64_t code;  // interleaved coordinates of the smallest cell: nodes are ranges
  std::uint32_t index;
};

std::uint64_t SpreadBits(std::uint64_t v) {
  v = (v | v << 32) & 0x001F00000000FFFFU;
  v = (v | v << 16) & 0x001F0000FF0000FFU;
  v = (v | v << 8) & 0x100F00F00F00F00FU;
  v = (v | v << 4) & 0x10C30C30C30C30C3U;
  v = (v | v << 2) & 0x1249249249249249U;
  return v;
}

class CellFinder {
 public:
  CellFinder(std::span<const Eigen::Vector3f> points,
             const Eigen::Vector3f& sensor_origin,
             const PlaneExtractionOptions& options,
             CellCheck check,
             const SensorOfPoint& sensor_of)
      : points_(points),
        sensor_(sensor_origin),
        options_(options),
        check_(check),
        sensor_of_(sensor_of),
        smallest_m_(options.cell_size_m / (1 << (kCellLevels - 1))) {}

  std::vector<PlanarCell> Run() {
    CodePoints();
    const auto end = static_cast<std::uint32_t>(coded_.size());
    for (std::uint32_t b = 0; b < end;) {
      const std::uint32_t e = RangeEnd(b, end, kCellLevels - 1);
      Visit(b, e, kCellLevels - 1);
      b = e;
    }
    return std::move(cells_);
  }

 private:
  struct Node {
    MomentsFit fit;  // about `reference`
    Eigen::Vector3d reference;
    double rms_m = 0.0;
    double sigma_m = 0.0;
    bool flat = false;
  };

  void CodePoints() {
    coded_.reserve(points_.size());
    for (std::uint32_t i = 0; i < points_.size(); ++i) {
      const double range = (points_[i] - sensor_).norm();
      if (!options_.sensor.Takes(range) || range > options_.max_range_m) continue;
      std::uint64_t code = 0;
      for (int axis = 0; axis < 3; ++axis) {
        const double cell = std::floor((points_[i] - sensor_)(axis) / smallest_m_) + kOffset;
        code |= SpreadBits(static_cast<std::uint64_t>(cell)) << axis;
      }
      coded_.push_back({code, i});
    }
    std::sort(coded_.begin(), coded_.end(), [](const CodedPoint& a, const CodedPoint& b) {
      return a.code != b.code ? a.code < b.code : a.index < b.index;
    });
  }

  std::uint32_t RangeEnd(std::uint32_t begin, std::uint32_t end, int level) const {
    const std::uint64_t node = coded_[begin].code >> (3 * level);
    std::uint32_t e = begin + 1;
    while (e < end && coded_[e].code >> (3 * level) == node) ++e;
    return e;
  }

  Node Judge(std::uint32_t begin, std::uint32_t end) const {
    Node node;
    const auto n = static_cast<double>(end - begin);
    const Eigen::Vector3f reference = points_[coded_[begin].index];
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    Eigen::Matrix3d squares = Eigen::Matrix3d::Zero();
    for (std::uint32_t i = begin; i < end; ++i) {
      const Eigen::Vector3d p = (points_[coded_[i].index] - reference).cast<double>();
      sum += p;
      squares.noalias() += p * p.transpose();
    }
    const Eigen::Vector3d mean = sum / n;
    node.reference = reference.cast<double>();
    node.fit = FitMoments(MomentsOf(1.0, mean, squares / n - mean * mean.transpose()));
    const Eigen::Vector3d& e = node.fit.eigenvalues;
    node.rms_m = std::sqrt(e(0) * n / (n - 3.0));
    node.sigma_m = options_.sensor.SigmaAt((node.reference + mean - sensor_.cast<double>()).norm());
    node.flat = node.rms_m <= options_.max_rms_m && e(1) >= kMinFlatness * e(0) &&
                e(1) >= kMinRoundness * e(2) && e(1) > 0.0;
    return node;
  }

  // Whether a plane for what was seen from before it and another for what was seen from behind
  // are straighter: those may be at an angle to it, with a strip of either face.
  bool HasTwoFaces(const Node& node, std::uint32_t begin, std::uint32_t end) const {
    if (!sensor_of_ || node.rms_m <= node.sigma_m) return false;
    const Eigen::Vector3d normal = node.fit.plane.normal;
    const Eigen::Vector3d mean = node.reference + node.fit.mean;
    Eigen::Matrix4d sums[2] = {Eigen::Matrix4d::Zero(), Eigen::Matrix4d::Zero()};
    for (std::uint32_t i = begin; i < end; ++i) {
      const std::uint32_t index = coded_[i].index;
      const bool before = normal.dot(sensor_of_(index).cast<double>() - mean) > 0.0;
      const Eigen::Vector4d p = (points_[index].cast<double>() - mean).homogeneous();
      sums[before ? 1 : 0] += p * p.transpose();
    }
    double squares = 0.0, count = 0.0;
    for (const Eigen::Matrix4d& sum : sums) {
      const double n = sum(3, 3);
      if (n < 1.0) return false;
      squares += n * FitMoments(sum).eigenvalues(0);
      count += std::max(0.0, n - 3.0);
    }
    return node.rms_m * node.rms_m * count > kFacesRatio * squares;
  }

  void Visit(std::uint32_t begin, std::uint32_t end, int level) {
    if (end - begin < kMinPoints) return;
    Node node = Judge(begin, end);
    node.flat = node.flat && !HasTwoFaces(node, begin, end);
    if (level == 0 || (node.flat && node.rms_m <= node.sigma_m)) {
      if (node.flat) Keep(node, begin, end, level);
      return;
    }
    const std::size_t before = cells_.size();
    for (std::uint32_t b = begin; b < end;) {
      const std::uint32_t e = RangeEnd(b, end, level - 1);
      Visit(b, e, level - 1);
      b = e;
    }
    if (node.flat && !ChildrenAreFlatter(node, before, end - begin) &&
        !(check_ == CellCheck::kEven && ChildrenLieAcross(node, begin, end, level))) {
      cells_.resize(before);
      Keep(node, begin, end, level);
    }
  }

  // Of the points along the node's normal, but for what the best plane through them explains.
  static double Residual(const Node& child, const Eigen::Vector3d& normal, double count) {
    const Eigen::Vector3d along = child.fit.eigenvectors.transpose() * normal;
    const Eigen::Array3d squares = child.fit.eigenvalues.array() + kLeastSquaresM2;
    return count / (count - 3.0) / (along.array().square() / squares).sum();
  }

  // Whether what the children hold, flat or not, is straighter than the node along its normal: it
  // is then at an angle to it.
  bool ChildrenLieAcross(const Node& node,
                         std::uint32_t begin,
                         std::uint32_t end,
                         int level) const {
    double squares = 0.0, held = 0.0;
    for (std::uint32_t b = begin; b < end;) {
      const std::uint32_t e = RangeEnd(b, end, level - 1);
      if (e - b >= kMinPoints) {
        const double count = e - b;
        squares += count * Residual(Judge(b, e), node.fit.plane.normal, count);
        held += count;
      }
      b = e;
    }
    return 2.0 * held >= end - begin && node.rms_m * node.rms_m * held > kMergeRatio * squares;
  }

  // Children that hold less than half of the points prove nothing.
  bool ChildrenAreFlatter(const Node& node, std::size_t first, std::uint32_t point_count) const {
    double squares = 0.0;
    std::uint32_t held = 0;
    for (std::size_t i = first; i < cells_.size(); ++i) {
      squares += cells_[i].point_count * cells_[i].rms_m * cells_[i].rms_m;
      held += cells_[i].point_count;
    }
    return 2 * held >= point_count && node.rms_m * node.rms_m * held > kMergeRatio * squares;
  }

  void Keep(const Node& node, std::uint32_t begin, std::uint32_t end, int level) {
    PlanarCell cell;
    cell.level = level;
    cell.size_m = smallest_m_ * (1 << level);
    const Eigen::Vector3f p = points_[coded_[begin].index] - sensor_;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const double at = std::floor(p(static_cast<Eigen::Index>(axis)) / smallest_m_) + kOffset;
      cell.at[axis] = static_cast<std::int32_t>(at) >> level;
    }
    cell.point_count = end - begin;
    const Eigen::Vector3d& e = node.fit.eigenvalues;
    cell.area_m2 = SpreadArea(e, CrossSectionOf(cell.size_m, node.fit.plane.normal));
    cell.sigma_m = node.sigma_m;
    cell.rms_m = node.rms_m;
    cell.mean = node.reference + node.fit.mean;
    cell.normal = node.fit.plane.normal;
    const Eigen::Matrix3d& V = node.fit.eigenvectors;
    cell.moments = MomentsOf(cell.area_m2, cell.mean, V * e.asDiagonal() * V.transpose());
    cells_.push_back(cell);
  }

  std::span<const Eigen::Vector3f> points_;
  Eigen::Vector3f sensor_;
  const PlaneExtractionOptions& options_;
  CellCheck check_;
  const SensorOfPoint& sensor_of_;
  double smallest_m_;
  std::vector<CodedPoint> coded_;
  std::vector<PlanarCell> cells_;
};

std::uint64_t KeyOf(int level, const std::array<std::int32_t, 3>& at) {
  std::uint64_t key = static_cast<std::uint64_t>(level);
  for (const std::int32_t c : at) key = key << 20 | static_cast<std::uint64_t>(c & 0xFFFFF);
  return key;
}

using PlaceIndex = HashMap<std::uint64_t, std::uint32_t>;

PlaceIndex IndexOf(std::span<const PlanarCell> cells) {
  PlaceIndex index;
  index.reserve(cells.size());
  for (std::uint32_t i = 0; i < cells.size(); ++i) index[KeyOf(cells[i].level, cells[i].at)] = i;
  return index;
}

// The cell there, of this level or larger, but not `self`.
std::optional<std::uint32_t> CellAt(const PlaceIndex& index,
                                    int level,
                                    std::array<std::int32_t, 3> at,
                                    std::uint32_t self) {
  for (; level < kCellLevels; ++level) {
    const auto found = index.find(KeyOf(level, at));
    if (found != index.end() && found->second != self) return found->second;
    for (std::int32_t& c : at) c >>= 1;
  }
  return std::nullopt;
}

}  // namespace

std::vector<PlanarCell> FindPlanarCells(std::span<const Eigen::Vector3f> points,
                                        const Eigen::Vector3f& sensor_origin,
                                        const PlaneExtractionOptions& options,
                                        CellCheck check,
                                        const SensorOfPoint& sensor_of) {
  return CellFinder(points, sensor_origin, options, check, sensor_of).Run();
}

double SpreadArea(const Eigen::Vector3d& eigenvalues, double most_m2) {
  return std::min(12.0 * std::sqrt(eigenvalues(1) * eigenvalues(2)), most_m2);
}

double CrossSectionOf(double size_m, const Eigen::Vector3d& normal) {
  return size_m * size_m / normal.cwiseAbs().maxCoeff();
}

std::vector<std::vector<std::uint32_t>> TouchingCells(std::span<const PlanarCell> cells) {
  const PlaceIndex index = IndexOf(cells);
  std::vector<std::vector<std::uint32_t>> touching(cells.size());
  // Every cell looks for those of its size or larger; the smaller ones find it.
  for (std::uint32_t i = 0; i < cells.size(); ++i) {
    for (int k = 0; k < 27; ++k) {
      std::array<std::int32_t, 3> at = {
          cells[i].at[0] + k % 3 - 1, cells[i].at[1] + k / 3 % 3 - 1, cells[i].at[2] + k / 9 - 1};
      const std::optional<std::uint32_t> other = CellAt(index, cells[i].level, at, i);
      if (!other.has_value()) continue;
      touching[i].push_back(*other);
      touching[*other].push_back(i);
    }
  }
  for (std::vector<std::uint32_t>& list : touching) {
    std::sort(list.begin(), list.end());
    list.erase(std::unique(list.begin(), list.end()), list.end());
  }
  return touching;
}

}  // namespace strata
