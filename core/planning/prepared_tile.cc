#include "core/planning/prepared_tile.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <tuple>
#include <vector>

#include "core/mls/tile_key.h"
#include "core/planning/ground_checks.h"
#include "core/planning/ground_fit.h"
#include "core/planning/ground_window.h"
#include "core/planning/profile_checks.h"
#include "core/planning/rows.h"

namespace strata {
namespace {

constexpr int kCells = kTileCells * kTileCells;

// Every second bit of a 16-bit number.
std::uint32_t EvenBits(std::uint32_t v) {
  v &= 0x5555;
  v = (v | (v >> 1)) & 0x3333;
  v = (v | (v >> 2)) & 0x0F0F;
  return (v | (v >> 4)) & 0x00FF;
}
std::uint32_t SpreadBits(std::uint32_t v) {
  v = (v | (v << 4)) & 0x0F0F;
  v = (v | (v << 2)) & 0x3333;
  return (v | (v << 1)) & 0x5555;
}
std::uint16_t CellOfMorton(std::uint32_t morton) {
  return static_cast<std::uint16_t>((EvenBits(morton >> 1) << kTileShift) | EvenBits(morton));
}
std::uint32_t MortonOfCell(std::uint16_t cell) {
  return (SpreadBits(cell >> kTileShift) << 1) | SpreadBits(cell & (kTileCells - 1));
}

// Builds one PreparedTile; holds what is known of the window's surfaces while it does.
class Preparation {
 public:
  Preparation(const GroundWindow& window, const ProfileChecks& checks, const ParallelLoop& loop)
      : window_(window),
        checks_(checks),
        loop_(loop),
        ground_(window, checks, GroundChecks::Edges::kOfGround, loop) {}

  PreparedTile Run(const TileKey& key) {
    tile_.key = key;
    CheckSurfaces();
    NumberPatches();
    AddMoves();
    std::sort(
        tile_.far_moves.begin(), tile_.far_moves.end(), [](const FarMove& a, const FarMove& b) {
          return std::tie(a.patch, a.direction) < std::tie(b.patch, b.direction);
        });
    tile_.far_moves.shrink_to_fit();
    return std::move(tile_);
  }

 private:
  bool InTile(int x, int y) const {
    const int m = window_.margin();
    return x >= m && y >= m && x < m + kTileCells && y < m + kTileCells;
  }

  // Danger and distance of all surfaces of the tile and of the ring that moves lead to.
  void CheckSurfaces() {
    danger_.assign(window_.surface_count(), -1.0F);
    distance_.assign(window_.surface_count(), 0.0F);
    const int ring = checks_.gap_cells[0] + 1;
    const int low = window_.margin() - ring;
    const int high = window_.margin() + kTileCells + ring;
    ForRows(loop_, low, high, [&](int /*band*/, int y) {
      const int row = y * window_.width();
      for (std::uint32_t i = window_.begin(row + low); i < window_.begin(row + high); ++i) {
        CheckSurface(i);
      }
    });
  }

  void CheckSurface(std::uint32_t i) {
    if (!ground_.OnGround(i)) return;
    const WindowSurface& surface = window_.surface(i);
    const float distance = ground_.EdgeDistance(static_cast<int>(surface.cell), surface.z_m);
    distance_[i] = distance;
    if (distance < checks_.footprint_m) return;
    const GroundFit fit = FitGround(window_, i);
    if (fit.certain_slope_tan > checks_.slope_tan || fit.roughness_m > checks_.roughness_m) return;
    danger_[i] = static_cast<float>(checks_.Danger(fit, std::sqrt(surface.variance_m2), distance));
  }

  void NumberPatches() {
    number_.assign(window_.surface_count(), PreparedTile::kNoPatch);
    std::size_t patches = 0;
    for (int y = 0; y < kTileCells; ++y) {
      const int row = window_.CellOfTile(static_cast<std::uint16_t>(y << kTileShift));
      patches += window_.begin(row + kTileCells) - window_.begin(row);
    }
    surface_.reserve(patches);
    tile_.cell.reserve(patches);
    tile_.z_m.reserve(patches);
    tile_.danger.reserve(patches);
    tile_.edge_distance.reserve(patches);
    for (std::uint32_t morton = 0; morton < kCells; ++morton) {
      if (morton % 64 == 0) tile_.block_begin[morton / 64] = tile_.size();
      const std::uint16_t cell = CellOfMorton(morton);
      const int at = window_.CellOfTile(cell);
      for (std::uint32_t i = window_.begin(at); i < window_.begin(at + 1); ++i) {
        number_[i] = tile_.size();
        surface_.push_back(i);
        tile_.cell.push_back(cell);
        tile_.z_m.push_back(window_.surface(i).z_m);
        tile_.danger.push_back(danger_[i]);
        tile_.edge_distance.push_back(
            static_cast<std::uint8_t>(distance_[i] / checks_.reach_m * 255.0F));
      }
    }
    tile_.block_begin[kCells / 64] = tile_.size();
  }

  // Blocks of 8 × 8 cells, in whose order patches are numbered, in rows of 32. Every move of every
  // patch is set by one of its ends.
  void AddMoves() {
    constexpr int kRow = 32;
    tile_.moves.resize(tile_.size());
    std::array<std::vector<FarMove>, kRowBands> far;
    ForRows(loop_, 0, kRow, [&](int band, int row) {
      const std::uint32_t end = tile_.block_begin[(row + 1) * kRow];
      for (std::uint32_t patch = tile_.block_begin[row * kRow]; patch < end; ++patch) {
        if (!tile_.CanStand(patch)) continue;
        for (int k = 0; k < 4; ++k) AddMove(patch, k, &far[band]);
        for (int k = 4; k < 8; ++k) AddMoveOut(patch, k, &far[band]);
      }
    });
    for (const std::vector<FarMove>& moves : far) {
      tile_.far_moves.insert(tile_.far_moves.end(), moves.begin(), moves.end());
    }
  }

  // A move and its opposite, which costs the same.
  void AddMove(std::uint32_t patch, int k, std::vector<FarMove>* far) {
    const std::uint32_t from = surface_[patch];
    int cells = 0;
    const std::uint32_t to = ground_.Target(from, k, &cells);
    if (to == GroundChecks::kNoSurface || danger_[to] < 0.0F) return;
    double danger = 0.5 * (static_cast<double>(danger_[from]) + danger_[to]);
    if (cells > 1) {
      if (!ground_.GapIsClear(from, to, k, cells)) return;
      danger += kGapDanger * (cells - 1) / cells;
    }
    const double rise = window_.surface(to).z_m - window_.surface(from).z_m;
    const std::uint32_t cost =
        MoveCost(cells * checks_.StepLength(k), rise, danger, checks_.cell_size_m);
    SetMove(from, to, k, cells, cost, far);
    if (number_[to] != PreparedTile::kNoPatch) SetMove(to, from, k ^ 4, cells, cost, far);
  }

  // The same if it leads out of the tile; AddMove() adds the others from where they lead to.
  void AddMoveOut(std::uint32_t patch, int k, std::vector<FarMove>* far) {
    const int reach = checks_.GapCells(k) + 1;
    const int x = (tile_.cell[patch] & (kTileCells - 1)) + kStepX[k] * reach;
    const int y = (tile_.cell[patch] >> kTileShift) + kStepY[k] * reach;
    if (x >= 0 && y >= 0 && x < kTileCells && y < kTileCells) return;
    int cells = 0;
    const std::uint32_t to = ground_.Target(surface_[patch], k, &cells);
    if (to == GroundChecks::kNoSurface || number_[to] != PreparedTile::kNoPatch) return;
    AddMove(patch, k, far);
  }

  void SetMove(std::uint32_t from,
               std::uint32_t to,
               int k,
               int cells,
               std::uint32_t cost,
               std::vector<FarMove>* far) {
    const std::uint32_t patch = number_[from];
    Move& move = tile_.moves[patch][k];
    const std::int64_t delta = static_cast<std::int64_t>(number_[to]) - patch;
    const bool near =
        number_[to] != PreparedTile::kNoPatch && cost < Move::kFar && std::abs(delta) <= INT16_MAX;
    if (near) {
      move = {static_cast<std::int16_t>(delta), static_cast<std::uint16_t>(cost)};
      return;
    }
    move.cost = Move::kFar;
    const auto level = to - window_.begin(static_cast<int>(window_.surface(to).cell));
    far->push_back({patch,
                    static_cast<std::uint8_t>(k),
                    static_cast<std::uint8_t>(level),
                    static_cast<std::uint16_t>(cells),
                    cost});
  }

  const GroundWindow& window_;
  const ProfileChecks& checks_;
  const ParallelLoop& loop_;
  const GroundChecks ground_;
  PreparedTile tile_;
  // Per surface of the window.
  std::vector<float> danger_;
  std::vector<float> distance_;
  std::vector<std::uint32_t> number_;
  std::vector<std::uint32_t> surface_;  // per patch
};

}  // namespace

void PreparedTile::FindCell(std::uint16_t cell_in_tile,
                            std::uint32_t* first,
                            std::uint32_t* count) const {
  const std::uint32_t block = MortonOfCell(cell_in_tile) / 64;
  std::uint32_t i = block_begin[block];
  const std::uint32_t end = block_begin[block + 1];
  while (i < end && cell[i] != cell_in_tile) ++i;
  *first = i;
  while (i < end && cell[i] == cell_in_tile) ++i;
  *count = i - *first;
}

const FarMove& PreparedTile::Far(std::uint32_t patch, int direction) const {
  return *std::lower_bound(
      far_moves.begin(), far_moves.end(), direction, [patch](const FarMove& move, int k) {
        return std::tuple<std::uint32_t, int>(move.patch, move.direction) <
               std::tuple<std::uint32_t, int>(patch, k);
      });
}

std::size_t PreparedTile::memory_bytes() const {
  return sizeof(*this) + moves.capacity() * sizeof(moves[0]) +
         far_moves.capacity() * sizeof(FarMove) + cell.capacity() * sizeof(cell[0]) +
         z_m.capacity() * sizeof(float) + danger.capacity() * sizeof(float) +
         edge_distance.capacity() + class_id.capacity();
}

PreparedTile PrepareTile(const TileKey& key,
                         const GroundWindow& window,
                         const ProfileChecks& checks,
                         const ParallelLoop& loop) {
  return Preparation(window, checks, loop).Run(key);
}

std::vector<std::uint8_t> ClassesOf(const PreparedTile& tile, const SurfaceTile& surfaces) {
  const auto has_class = [](const Surface& surface) { return surface.class_id != 0; };
  if (std::none_of(surfaces.surfaces.begin(), surfaces.surfaces.end(), has_class)) return {};
  std::vector<std::uint8_t> classes;
  classes.reserve(tile.size());
  while (classes.size() < tile.size()) {
    // Patches of a cell follow each other, lowest first, as its surfaces do.
    for (const Surface& surface : surfaces.Cell(tile.cell[classes.size()])) {
      classes.push_back(surface.class_id);
    }
  }
  return classes;
}

}  // namespace strata
