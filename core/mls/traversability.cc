#include "core/mls/traversability.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <limits>
#include <optional>
#include <span>
#include <tuple>
#include <vector>

#include <Eigen/Core>

#include "core/mls/local_plane.h"
#include "core/mls/surface_tile.h"
#include "core/mls/tile_key.h"

namespace strata {
namespace {

// Next to a surface a cell may be one of an unseen deck.
constexpr int kMargin = std::max(kPlaneRadiusCells, 1 + kMaxUnseenDeckCells);
constexpr int kPaddedCells = kTileCells + 2 * kMargin;
constexpr double kMaxRatio = 4.0;
constexpr std::array<std::array<int, 2>, 4> kQuarters = {{{1, 1}, {-1, 1}, {1, -1}, {-1, -1}}};

// The samples of a tile and of the margin around it, cell by cell in one array; undersides apart.
class PaddedTile {
 public:
  PaddedTile(const SurfaceTile& tile, const SurfaceNeighbourhood& neighbours, double cell_size_m)
      : begin_(kPaddedCells * kPaddedCells + 1) {
    samples_.reserve(tile.surfaces.size() + tile.surfaces.size() / 16 + 64);
    std::size_t next_cell = 0;
    for (int y = -kMargin; y < kTileCells + kMargin; ++y) {
      for (int dx = -1; dx <= 1; ++dx) {
        const int dy = y < 0 ? -1 : y / kTileCells;
        const bool middle = dx == 0 && dy == 0;
        const SurfaceTile* source = middle ? &tile : neighbours[(dy + 1) * 3 + dx + 1];
        if (source != nullptr) AppendRow(*source, y, dx, cell_size_m, next_cell);
      }
    }
    while (next_cell < begin_.size()) begin_[next_cell++] = size();
    samples_.emplace_back();  // so that the last cells, too, have something to read
    IndexUndersides();
  }

  // Index of cell (x, y) of the tile; x, y in [−kMargin, kTileCells + kMargin).
  static int IndexOf(int x, int y) { return (y + kMargin) * kPaddedCells + x + kMargin; }
  // data() may be read even when the cell is empty.
  std::span<const HeightSample> Cell(int index) const {
    return {samples_.data() + begin_[index], begin_[index + 1] - begin_[index]};
  }
  bool has_undersides() const { return !undersides_.empty(); }
  // REQUIRES: has_undersides().
  std::span<const HeightSample> Undersides(int index) const {
    const std::uint32_t first = underside_begin_[index];
    return {undersides_.data() + first, underside_begin_[index + 1] - first};
  }

 private:
  std::uint32_t size() const { return static_cast<std::uint32_t>(samples_.size()); }

  void AppendRow(
      const SurfaceTile& source, int y, int dx, double cell_size_m, std::size_t& next_cell) {
    const int row = y & (kTileCells - 1);
    for (std::uint32_t i = source.row_begin[row]; i < source.row_begin[row + 1]; ++i) {
      const int x = (source.surfaces[i].cell & (kTileCells - 1)) + dx * kTileCells;
      if (x < -kMargin || x >= kTileCells + kMargin) continue;
      const std::size_t cell = IndexOf(x, y);
      while (next_cell <= cell) begin_[next_cell++] = size();
      const HeightSample sample = SampleOf(source.surfaces[i], cell_size_m);
      if (sample.underside()) {
        undersides_.push_back(sample);
        cells_of_undersides_.push_back(static_cast<std::uint32_t>(cell));
      } else {
        samples_.push_back(sample);
      }
    }
  }

  void IndexUndersides() {
    if (!has_undersides()) return;
    underside_begin_.assign(begin_.size(), 0);
    for (const std::uint32_t cell : cells_of_undersides_) ++underside_begin_[cell + 1];
    for (std::size_t i = 1; i < begin_.size(); ++i) underside_begin_[i] += underside_begin_[i - 1];
  }

  std::vector<HeightSample> samples_;
  std::vector<std::uint32_t> begin_;  // of each cell, and the end
  std::vector<HeightSample> undersides_;
  std::vector<std::uint32_t> cells_of_undersides_;
  std::vector<std::uint32_t> underside_begin_;  // of each cell, and the end; empty without any
};

// A cell of the window around a surface.
struct Offset {
  double dx = 0.0;
  double dy = 0.0;
  int cells = 0;          // in the padded tile
  bool adjacent = false;  // one of the eight cells around
  double reach_m = 0.0;   // largest height difference that still belongs to the same ground
  double step_m = 0.0;    // largest one a robot takes at once
};

std::vector<Offset> MakeWindow(double cell_size_m, const TraversabilityLimits& limits) {
  std::vector<Offset> window;
  for (int dy = -kPlaneRadiusCells; dy <= kPlaneRadiusCells; ++dy) {
    for (int dx = -kPlaneRadiusCells; dx <= kPlaneRadiusCells; ++dx) {
      const int squared = dx * dx + dy * dy;
      if (squared == 0 || squared > kPlaneRadiusCells * kPlaneRadiusCells + 1) continue;
      const double cells = std::sqrt(squared);
      const double ramp = cells * cell_size_m * std::tan(limits.max_slope_rad);
      const double stairs = std::min(cells * limits.max_step_m, 0.5 * limits.clearance_m);
      window.push_back({.dx = static_cast<double>(dx),
                        .dy = static_cast<double>(dy),
                        .cells = dy * kPaddedCells + dx,
                        .adjacent = squared <= 2,
                        .reach_m = std::max(stairs, ramp),
                        .step_m = std::max(limits.max_step_m, ramp)});
    }
  }
  return window;
}

double Noise(const HeightSample& a, const HeightSample& b) {
  return kNoiseGate * std::sqrt(double{a.variance_m2} + b.variance_m2);
}

// The part of a column, lowest first, that has its nearest top: thousands may lie above each other,
// and every surface beside them asks.
std::span<const HeightSample> AroundHeight(std::span<const HeightSample> column, float z_m) {
  const auto distance = [z_m](const HeightSample& sample) { return std::abs(sample.z_m - z_m); };
  const auto above = std::lower_bound(
      column.begin(), column.end(), z_m, [](const HeightSample& sample, float height_m) {
        return sample.z_m < height_m;
      });
  auto first = above == column.begin() ? above : above - 1;
  while (first != column.begin() && distance(*(first - 1)) == distance(*first)) --first;
  return {first, above == column.end() ? above : above + 1};
}

// The lowest of those that are nearest; of an empty column whatever lies there.
const HeightSample& Nearest(std::span<const HeightSample> column, float z_m) {
  constexpr std::size_t kFew = 16;
  if (column.size() > kFew) column = AroundHeight(column, z_m);
  const HeightSample* nearest = column.data();
  for (std::size_t i = 1; i < column.size(); ++i) {
    if (std::abs(column[i].z_m - z_m) < std::abs(nearest->z_m - z_m)) nearest = &column[i];
  }
  return *nearest;
}

// The tops around a surface that are the same ground, itself first.
struct Ground {
  struct Top {
    double dx, dy, dz_m;
    HeightSample sample;
  };
  std::array<Top, (2 * kPlaneRadiusCells + 1) * (2 * kPlaneRadiusCells + 1) + 1> tops;
  std::size_t count = 0;

  std::span<const Top> span() const { return {tops.data(), count}; }
};

// What the rules say about one surface.
struct Finding {
  std::optional<LocalPlane> plane;
  double step_m = 0.0;
  Traversability traversability = Traversability::kUnknown;
  double danger = 0.0;
};

class Judge {
 public:
  Judge(const SurfaceTile& tile,
        const SurfaceNeighbourhood& neighbours,
        double cell_size_m,
        const TraversabilityLimits& limits)
      : padded_(tile, neighbours, cell_size_m),
        window_(MakeWindow(cell_size_m, limits)),
        cell_size_m_(cell_size_m),
        limits_(limits),
        tan_limit_(std::tan(limits.max_slope_rad)) {}

  // Surface number `level`, undersides not counted, of cell (x, y).
  Finding Examine(int x, int y, std::size_t level) const {
    const int cell = PaddedTile::IndexOf(x, y);
    const std::span<const HeightSample> column = padded_.Cell(cell);
    const HeightSample& self = column[level];
    Finding finding;
    FitAndCheckSteps(cell, self, finding);
    const bool too_low = (level + 1 < column.size() && IsOverhead(column[level + 1], self)) ||
                         UndersideBlocks(cell, self, 0.0);
    double slope = limits_.max_slope_rad;
    double roughness = limits_.max_roughness_m;
    if (finding.plane.has_value()) {
      slope = finding.plane->slope_rad();
      roughness = finding.plane->roughness_m();
    }
    finding.traversability = Decide(self, finding, roughness, too_low);
    const double sigma = std::sqrt(double{self.variance_m2});
    finding.danger = Danger(slope, roughness, finding.step_m, sigma, limits_);
    return finding;
  }

 private:
  Traversability Decide(const HeightSample& self,
                        const Finding& finding,
                        double roughness_m,
                        bool too_low) const {
    const bool fits = !too_low && std::isfinite(finding.step_m);
    if (!fits) return Traversability::kNonTraversable;
    if (!finding.plane.has_value()) {
      const bool vertical = self.bottom_m < self.z_m;
      return vertical ? Traversability::kNonTraversable : Traversability::kUnknown;
    }
    const bool smooth =
        !finding.plane->SteeperThan(tan_limit_) && roughness_m <= limits_.max_roughness_m;
    return smooth ? Traversability::kTraversable : Traversability::kNonTraversable;
  }

  void FitAndCheckSteps(int cell, const HeightSample& self, Finding& finding) const {
    Ground ground;
    finding.step_m = GatherGround(cell, self, ground);
    LocalPlaneFit fit(cell_size_m_);
    for (const Ground::Top& top : ground.span()) fit.Add(top.dx, top.dy, top.dz_m, top.sample);
    finding.plane = fit.Solve();
    if (finding.plane.has_value() && finding.plane->SteeperThan(tan_limit_) &&
        finding.plane->roughness_m() > 0.0) {
      StandBesideStep(ground, *finding.plane);
    }
  }

  // Returns the largest step. Which cells are occupied and within reach is as good as random, so
  // every cell is computed and written, and kept or not: branches would cost more.
  double GatherGround(int cell, const HeightSample& self, Ground& ground) const {
    ground.tops[0] = {0.0, 0.0, 0.0, self};
    ground.count = 1;
    double step_m = 0.0;
    for (const Offset& offset : window_) {
      const std::span<const HeightSample> column = padded_.Cell(cell + offset.cells);
      const HeightSample& sample = Nearest(column, self.z_m);
      const double dz = column.empty() ? 0.0 : double{sample.z_m} - self.z_m;
      const double noise = Noise(self, sample);
      const bool within_reach = std::abs(dz) <= offset.reach_m + noise;
      ground.tops[ground.count] = {offset.dx, offset.dy, dz, sample};
      ground.count += (!column.empty() & within_reach) ? 1 : 0;
      if (!offset.adjacent) continue;
      const double beyond_noise = std::abs(dz) - noise;
      if (beyond_noise > offset.step_m && std::abs(dz) > step_m) [[unlikely]] {
        if (Blocks(cell + offset.cells, self, offset.step_m)) {
          step_m = std::numeric_limits<double>::infinity();
        }
      } else {
        step_m = std::max(step_m, beyond_noise);
        if (column.empty() && UndersideBlocks(cell + offset.cells, self, offset.step_m)) {
          step_m = std::numeric_limits<double>::infinity();
        }
      }
    }
    return step_m;
  }

  // True of a column whose nearest top is out of a step's reach: a wall or a drop; false of one
  // that is all above the robot's head, or below a deck.
  bool Blocks(int cell, const HeightSample& self, double step_m) const {
    if (UndersideBlocks(cell, self, step_m)) return true;
    const bool hidden = HidesGround(cell, self, step_m) || DeckIsUnseen(cell, self);
    const std::span<const HeightSample> column = padded_.Cell(cell);
    return std::any_of(column.begin(), column.end(), [&](const HeightSample& sample) {
      return sample.z_m < self.z_m ? !hidden : IsOverhead(sample, self);
    });
  }

  // True if a robot on `self` would hit the body of `other`, which is above it.
  bool IsOverhead(const HeightSample& other, const HeightSample& self) const {
    return double{other.bottom_m} - self.z_m < limits_.clearance_m;
  }

  // True if a deck whose top was not seen may go on where `self` is.
  bool HidesGround(int cell, const HeightSample& self, double step_m) const {
    if (!padded_.has_undersides()) return false;
    const std::span<const HeightSample> undersides = padded_.Undersides(cell);
    return std::any_of(undersides.begin(), undersides.end(), [&](const HeightSample& underside) {
      const double dz = double{underside.z_m} - self.z_m;
      return dz >= -kMaxDeckM && dz <= step_m;
    });
  }

  // True if the deck that `self` is on goes on there, though no beam hit it.
  bool DeckIsUnseen(int cell, const HeightSample& self) const {
    return DeckGoesOn(self.z_m, cell_size_m_, [&](int dx, int dy) {
      return padded_.Cell(cell + dy * kPaddedCells + dx);
    });
  }

  // True if an underside more than a step above `self` is lower than the robot.
  bool UndersideBlocks(int cell, const HeightSample& self, double step_m) const {
    if (!padded_.has_undersides()) return false;
    const std::span<const HeightSample> undersides = padded_.Undersides(cell);
    return std::any_of(undersides.begin(), undersides.end(), [&](const HeightSample& underside) {
      return double{underside.z_m} - self.z_m > step_m && IsOverhead(underside, self);
    });
  }

  // Puts the plane of the quarter window with the smallest residual in place of `plane`, if noise
  // explains that residual.
  void StandBesideStep(const Ground& ground, LocalPlane& plane) const {
    std::optional<LocalPlane> best;
    for (const auto& [sx, sy] : kQuarters) {
      std::array<std::uint8_t, std::tuple_size_v<decltype(ground.tops)>> in_quarter;
      std::size_t count = 0;
      for (std::size_t i = 0; i < ground.count; ++i) {
        const Ground::Top& top = ground.tops[i];
        in_quarter[count] = static_cast<std::uint8_t>(i);
        count += ((top.dx * sx >= 0.0) & (top.dy * sy >= 0.0)) ? 1 : 0;
      }
      LocalPlaneFit fit(cell_size_m_);
      for (std::size_t i = 0; i < count; ++i) {
        const Ground::Top& top = ground.tops[in_quarter[i]];
        fit.Add(top.dx, top.dy, top.dz_m, top.sample);
      }
      const std::optional<LocalPlane> quarter = fit.Solve();
      if (!quarter.has_value() || quarter->roughness_m() > 0.0) continue;
      if (!best.has_value() || quarter->residual_m < best->residual_m) best = quarter;
    }
    if (best.has_value()) plane = *best;
  }

  PaddedTile padded_;
  std::vector<Offset> window_;
  double cell_size_m_;
  TraversabilityLimits limits_;
  double tan_limit_;
};

// Calls visit(i, finding) for every surface of the tile that is no underside.
template <typename Visit>
void ForEachTop(const SurfaceTile& tile, const Judge& judge, Visit visit) {
  std::size_t level = 0;
  for (std::size_t i = 0; i < tile.surfaces.size(); ++i) {
    const std::uint16_t cell = tile.surfaces[i].cell;
    if (i > 0 && tile.surfaces[i - 1].cell != cell) level = 0;
    if (tile.surfaces[i].underside()) continue;
    visit(i, judge.Examine(cell & (kTileCells - 1), cell >> kTileShift, level++));
  }
}

SurfaceAssessment AssessmentOf(const Finding& finding) {
  SurfaceAssessment result = {.traversability = finding.traversability,
                              .step_m = static_cast<float>(finding.step_m),
                              .danger = static_cast<float>(finding.danger)};
  if (finding.plane.has_value()) {
    result.normal = finding.plane->Normal().cast<float>();
    result.slope_rad = static_cast<float>(finding.plane->slope_rad());
    result.roughness_m = static_cast<float>(finding.plane->roughness_m());
  }
  return result;
}

}  // namespace

double Danger(double slope_rad,
              double roughness_m,
              double step_m,
              double sigma_m,
              const TraversabilityLimits& limits) {
  const auto squared_ratio = [](double value, double limit) {
    if (value <= 0.0) return 0.0;
    const double ratio = value < kMaxRatio * limit ? value / limit : kMaxRatio;
    return ratio * ratio;
  };
  return squared_ratio(slope_rad, limits.max_slope_rad) +
         squared_ratio(roughness_m, limits.max_roughness_m) +
         squared_ratio(step_m, limits.max_step_m) + squared_ratio(sigma_m, limits.max_step_m);
}

std::vector<SurfaceAssessment> AssessSurfaces(const SurfaceTile& tile,
                                              const SurfaceNeighbourhood& neighbours,
                                              double cell_size_m,
                                              const TraversabilityLimits& limits) {
  std::vector<SurfaceAssessment> result(tile.surfaces.size(),
                                        {.traversability = Traversability::kUnderside});
  const Judge judge(tile, neighbours, cell_size_m, limits);
  ForEachTop(tile, judge, [&result](std::size_t i, const Finding& finding) {
    result[i] = AssessmentOf(finding);
  });
  return result;
}

void AnnotateTraversability(SurfaceTile& tile,
                            const SurfaceNeighbourhood& neighbours,
                            double cell_size_m,
                            const TraversabilityLimits& limits) {
  const Judge judge(tile, neighbours, cell_size_m, limits);
  ForEachTop(tile, judge, [&tile](std::size_t i, const Finding& finding) {
    tile.surfaces[i].traversability = finding.traversability;
    tile.surfaces[i].cost = static_cast<float>(finding.danger);
  });
}

std::vector<Eigen::Vector3f> EstimateNormals(const SurfaceTile& tile,
                                             const SurfaceNeighbourhood& neighbours,
                                             double cell_size_m,
                                             const TraversabilityLimits& limits) {
  std::vector<Eigen::Vector3f> normals(tile.surfaces.size(), Eigen::Vector3f::Zero());
  const Judge judge(tile, neighbours, cell_size_m, limits);
  ForEachTop(tile, judge, [&normals](std::size_t i, const Finding& finding) {
    if (finding.plane.has_value()) normals[i] = finding.plane->Normal().cast<float>();
  });
  return normals;
}

}  // namespace strata
