#include "core/mls/overview.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <utility>
#include <vector>

#include "core/mls/mls_parameters.h"
#include "core/mls/surface_tile.h"
#include "core/mls/tile_key.h"

namespace strata {
namespace {

constexpr double kSlopeOfGround = 0.5;
constexpr double kMinSigmaM = 1e-6;

struct ChildSurface {
  const Surface* surface;
  int child_cell;  // 0 to 3
};

bool HoldsOneCellTwice(std::span<const ChildSurface> chain) {
  unsigned seen = 0;
  for (const ChildSurface& child : chain) {
    const unsigned bit = 1U << child.child_cell;
    if ((seen & bit) != 0) return true;
    seen |= bit;
  }
  return false;
}

// Number of surfaces below the largest gap of a chain sorted by height; the lowest on a tie.
std::size_t LargestGap(std::span<const ChildSurface> chain) {
  std::size_t cut = 1;
  float largest = -1.0F;
  for (std::size_t i = 1; i < chain.size(); ++i) {
    const float gap = chain[i].surface->z_m - chain[i - 1].surface->z_m;
    if (gap <= largest) continue;
    largest = gap;
    cut = i;
  }
  return cut;
}

// What most of the chain's surfaces with a class are, and how sure that is on average; those of
// other classes are not at all.
struct Majority {
  std::uint8_t class_id = 0;
  std::uint8_t confidence = 0;
};

Majority MajorityClass(std::span<const ChildSurface> chain) {
  std::uint8_t best = 0;
  std::ptrdiff_t best_count = 0;
  for (const ChildSurface& candidate : chain) {
    const std::uint8_t id = candidate.surface->class_id;
    if (id == 0) continue;
    const std::ptrdiff_t count =
        std::count_if(chain.begin(), chain.end(), [id](const ChildSurface& other) {
          return other.surface->class_id == id;
        });
    if (count < best_count || (count == best_count && id >= best)) continue;
    best = id;
    best_count = count;
  }
  if (best == 0) return {};
  unsigned sum = 0;
  unsigned with_class = 0;
  for (const ChildSurface& child : chain) {
    if (child.surface->class_id == best) sum += child.surface->confidence;
    if (child.surface->class_id != 0) ++with_class;
  }
  const unsigned mean = (2 * sum + with_class) / (2 * with_class);
  return {best, static_cast<std::uint8_t>(sum == 0 ? 0 : std::max(mean, 1U))};
}

Traversability MajorityTraversability(std::span<const ChildSurface> chain) {
  std::array<int, 4> count{};
  for (const ChildSurface& child : chain) {
    ++count[static_cast<std::size_t>(child.surface->traversability)];
  }
  const int yes = count[static_cast<std::size_t>(Traversability::kTraversable)];
  const int no = count[static_cast<std::size_t>(Traversability::kNonTraversable)];
  if (yes == 0 && no == 0) {
    const bool some_unknown = count[static_cast<std::size_t>(Traversability::kUnknown)] > 0;
    return some_unknown ? Traversability::kUnknown : Traversability::kUnderside;
  }
  return yes > no ? Traversability::kTraversable : Traversability::kNonTraversable;
}

// The mean of those that have one.
Colour MeanColour(std::span<const ChildSurface> chain) {
  ColourSum sum;
  for (const ChildSurface& child : chain) {
    if (!child.surface->coloured()) continue;
    sum.r += child.surface->colour.r;
    sum.g += child.surface->colour.g;
    sum.b += child.surface->colour.b;
    ++sum.count;
  }
  return MeanColour(sum);
}

float DepthOf(std::span<const ChildSurface> chain, double z_m, double thickness_m) {
  std::size_t vertical = 0;
  double bottom_m = std::numeric_limits<double>::infinity();
  for (const ChildSurface& child : chain) {
    if (!child.surface->vertical()) continue;
    ++vertical;
    bottom_m = std::min(bottom_m, double{child.surface->bottom_m()});
  }
  if (2 * vertical < chain.size() || z_m - bottom_m <= thickness_m) return 0.0F;
  return static_cast<float>(z_m - bottom_m);
}

Surface Summarise(std::uint16_t cell, std::span<const ChildSurface> chain, double thickness_m) {
  const double reference = chain.front().surface->z_m;
  double sum_w = 0.0;
  double sum_wz = 0.0;
  double sum_wzz = 0.0;
  double sum_cost = 0.0;
  for (const ChildSurface& child : chain) {
    const double sigma = std::max(double{child.surface->sigma_m}, kMinSigmaM);
    const double w = 1.0 / (sigma * sigma);
    const double z = child.surface->z_m - reference;
    sum_w += w;
    sum_wz += w * z;
    sum_wzz += w * z * z;
    sum_cost += child.surface->cost;
  }
  const double mean = sum_wz / sum_w;
  const double spread = std::max(0.0, sum_wzz / sum_w - mean * mean);
  const double z_m = reference + mean;
  const Majority majority = MajorityClass(chain);
  return {.cell = cell,
          .traversability = MajorityTraversability(chain),
          .class_id = majority.class_id,
          .confidence = majority.confidence,
          .colour = MeanColour(chain),
          .z_m = static_cast<float>(z_m),
          .sigma_m = static_cast<float>(std::sqrt(1.0 / sum_w + spread)),
          .depth_m = DepthOf(chain, z_m, thickness_m),
          .cost = static_cast<float>(sum_cost / static_cast<double>(chain.size()))};
}

// Appends the surfaces of one chain, cut where it holds two surfaces of one child cell.
void AppendChain(std::uint16_t cell,
                 std::span<const ChildSurface> chain,
                 double thickness_m,
                 std::vector<Surface>& surfaces) {
  while (HoldsOneCellTwice(chain)) {
    const std::size_t cut = LargestGap(chain);
    AppendChain(cell, chain.first(cut), thickness_m, surfaces);
    chain = chain.subspan(cut);
  }
  surfaces.push_back(Summarise(cell, chain, thickness_m));
}

// Hands out the surfaces of one row of a child, cell by cell from the left.
class RowReader {
 public:
  RowReader(const SurfaceTile& tile, int row)
      : next_(tile.surfaces.data() + tile.row_begin[row]),
        end_(tile.surfaces.data() + tile.row_begin[row + 1]) {}

  void TakeCell(int x, int child_cell, std::vector<ChildSurface>& out) {
    for (; next_ != end_ && (next_->cell & (kTileCells - 1)) == x; ++next_) {
      out.push_back({next_, child_cell});
    }
  }

 private:
  const Surface* next_;
  const Surface* end_;
};

// `surfaces` are sorted by (cell, z).
void KeepHighest(std::vector<Surface>& surfaces) {
  std::size_t kept = 0;
  for (std::size_t begin = 0; begin < surfaces.size();) {
    std::size_t end = begin + 1;
    while (end < surfaces.size() && surfaces[end].cell == surfaces[begin].cell) ++end;
    const std::size_t first = end - std::min(end - begin, kOverviewLayers);
    for (std::size_t i = first; i < end; ++i) surfaces[kept++] = surfaces[i];
    begin = end;
  }
  surfaces.resize(kept);
}

class OverviewMaker {
 public:
  OverviewMaker(const TileKey& parent, const MlsParameters& parameters)
      : chain_gap_m_(std::max(
            parameters.gap_size_m,
            kSlopeOfGround * parameters.cell_size_m * std::exp2(std::max(parent.level - 1, 0)))),
        thickness_m_(parameters.thickness_m) {
    tile_.key = parent;
  }

  // Adds the half row of parent cells that lies over two rows of one child.
  void AddHalfRow(const SurfaceTile& child, int index, int half_row) {
    RowReader low(child, 2 * half_row);
    RowReader high(child, 2 * half_row + 1);
    const int y = (index >> 1) * (kTileCells / 2) + half_row;
    for (int half_x = 0; half_x < kTileCells / 2; ++half_x) {
      const int x = (index & 1) * (kTileCells / 2) + half_x;
      members_.clear();
      low.TakeCell(2 * half_x, 0, members_);
      low.TakeCell(2 * half_x + 1, 1, members_);
      high.TakeCell(2 * half_x, 2, members_);
      high.TakeCell(2 * half_x + 1, 3, members_);
      if (!members_.empty()) AddCell(CellInTile({x, y}));
    }
  }

  SurfaceTile Finish() {
    if (tile_.surfaces.size() > kMaxOverviewSurfaces) KeepHighest(tile_.surfaces);
    tile_.IndexRows();
    return std::move(tile_);
  }

 private:
  void AddCell(std::uint16_t cell) {
    std::stable_sort(members_.begin(), members_.end(), [](const auto& a, const auto& b) {
      return a.surface->z_m < b.surface->z_m;
    });
    const std::span<const ChildSurface> all(members_);
    std::size_t first = 0;
    for (std::size_t i = 1; i <= all.size(); ++i) {
      if (i < all.size() && double{all[i].surface->z_m} - all[i - 1].surface->z_m < chain_gap_m_) {
        continue;
      }
      AppendChain(cell, all.subspan(first, i - first), thickness_m_, tile_.surfaces);
      first = i;
    }
  }

  double chain_gap_m_;
  double thickness_m_;
  SurfaceTile tile_;
  std::vector<ChildSurface> members_;  // of the parent cell at work
};

}  // namespace

TileKey ParentOf(const TileKey& key) { return {key.level + 1, key.x >> 1, key.y >> 1}; }

TileKey ChildOf(const TileKey& parent, int index) {
  return {parent.level - 1, parent.x * 2 + (index & 1), parent.y * 2 + (index >> 1)};
}

SurfaceTile MakeOverviewTile(const TileKey& parent,
                             const std::array<const SurfaceTile*, 4>& children,
                             const MlsParameters& parameters) {
  OverviewMaker maker(parent, parameters);
  for (int y = 0; y < kTileCells; ++y) {
    for (int side = 0; side < 2; ++side) {
      const int index = (y / (kTileCells / 2)) * 2 + side;
      const SurfaceTile* child = children[index];
      if (child != nullptr) maker.AddHalfRow(*child, index, y % (kTileCells / 2));
    }
  }
  return maker.Finish();
}

}  // namespace strata
