#include "core/planning/prepared_tile.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>
#include <tuple>
#include <utility>
#include <vector>

#include "core/mls/surface_tile.h"
#include "core/mls/tile_key.h"
#include "core/planning/ground/ground_checks.h"
#include "core/planning/ground/ground_fit.h"
#include "core/planning/ground/ground_window.h"
#include "core/planning/ground/profile_checks.h"
#include "core/planning/ground/rows.h"
#include "core/planning/move_cost.h"
#include "core/planning/patch_index.h"

namespace strata {
namespace {

constexpr int kCells = kTileCells * kTileCells;

// Builds one PreparedTile; holds what is known of the window's surfaces while it does.
class Preparation {
 public:
  Preparation(const GroundWindow& window, const ProfileChecks& checks, const ParallelLoop& loop)
      : window_(window),
        checks_(checks),
        loop_(loop),
        step_costs_(checks.cell_size_m, checks.step_m),
        ground_(window, checks, GroundChecks::Edges::kOfGround, loop) {}

  PreparedTile Run(const SurfaceTile& surfaces) {
    tile_.key = surfaces.key;
    CheckSurfaces();
    NumberPatches();
    SetHeights();
    SetClasses(surfaces);
    AddMoves();
    return std::move(tile_);
  }

 private:
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
    const double danger = checks_.Danger(fit, std::sqrt(surface.variance_m2), distance);
    danger_[i] = OnePlusDanger(DangerCode(danger)) - 1.0F;
  }

  bool CanStand(std::uint32_t i) const { return danger_[i] >= 0.0F; }

  // Calls visit(cell, surface, level) for the surfaces of the tile where the robot can stand, or
  // for the others; levels are counted among those.
  template <typename Visit>
  void ForEachSurface(bool standing, const Visit& visit) const {
    for (int c = 0; c < kCells; ++c) {
      const auto cell = static_cast<std::uint16_t>(c);
      const int at = window_.CellOfTile(cell);
      std::uint32_t level = 0;
      for (std::uint32_t i = window_.begin(at); i < window_.begin(at + 1); ++i) {
        if (CanStand(i) == standing) visit(cell, i, level++);
      }
    }
  }

  PatchIndex Index(bool standing) const {
    std::vector<std::uint8_t> counts(kCells, 0);
    ForEachSurface(standing, [&](std::uint16_t cell, std::uint32_t /*i*/, std::uint32_t level) {
      counts[cell] = static_cast<std::uint8_t>(level + 1);
    });
    return PatchIndex(counts);
  }

  void NumberPatches() {
    tile_.standing = Index(true);
    tile_.other = Index(false);
    number_.assign(window_.surface_count(), PatchIndex::kNone);
    surface_.resize(tile_.standing.size());
    place_.resize(tile_.standing.size());
    tile_.patches.resize(tile_.standing.size());
    ForEachSurface(true, [&](std::uint16_t cell, std::uint32_t i, std::uint32_t level) {
      const std::uint32_t place = tile_.standing.Place(cell, level);
      const std::uint32_t number = tile_.standing.Number(place);
      number_[i] = number;
      surface_[number] = i;
      place_[number] = place;
      tile_.patches[number].danger = DangerCode(danger_[i]);
      tile_.patches[number].edge_distance =
          static_cast<std::uint8_t>(distance_[i] / checks_.reach_m * 255.0F);
    });
  }

  void SetHeights() {
    std::vector<float> heights(tile_.standing.size() + tile_.other.size());
    for (std::uint32_t n = 0; n < surface_.size(); ++n)
      heights[n] = window_.surface(surface_[n]).z_m;
    ForEachSurface(false, [&](std::uint16_t cell, std::uint32_t i, std::uint32_t level) {
      const std::uint32_t number = tile_.other.Number(tile_.other.Place(cell, level));
      heights[tile_.standing.size() + number] = window_.surface(i).z_m;
    });
    tile_.other_heights.resize(tile_.other.size());
    float low = std::numeric_limits<float>::infinity();
    float high = -low;
    bool whole = true;
    for (const float z : heights) {
      low = std::min(low, z);
      high = std::max(high, z);
      // Below what a float holds exactly.
      whole = whole && std::abs(z) < 16384.0F &&
              z * kHeightStepsPerM == std::floor(z * kHeightStepsPerM);
    }
    if (!whole || (high - low) * kHeightStepsPerM > 65535.0F) {
      tile_.exact_heights = std::move(heights);
      return;
    }
    if (heights.empty()) return;
    tile_.base_steps = static_cast<std::int32_t>(low * kHeightStepsPerM);
    const auto steps = [this](float z) {
      return static_cast<std::uint16_t>(static_cast<std::int32_t>(z * kHeightStepsPerM) -
                                        tile_.base_steps);
    };
    for (std::uint32_t n = 0; n < surface_.size(); ++n) tile_.patches[n].height = steps(heights[n]);
    for (std::uint32_t n = 0; n < tile_.other.size(); ++n) {
      tile_.other_heights[n] = steps(heights[surface_.size() + n]);
    }
  }

  void SetClasses(const SurfaceTile& surfaces) {
    const auto has_class = [](const Surface& surface) { return surface.class_id != 0; };
    if (std::none_of(surfaces.surfaces.begin(), surfaces.surfaces.end(), has_class)) return;
    tile_.class_id.resize(surface_.size());
    for (std::uint32_t n = 0; n < surface_.size(); ++n) {
      const std::uint16_t cell = tile_.standing.CellOf(place_[n]);
      // The window has a cell's surfaces in the tile's order.
      const std::uint32_t level = surface_[n] - window_.begin(window_.CellOfTile(cell));
      tile_.class_id[n] = surfaces.Cell(cell)[level].class_id;
    }
  }

  // What the rows of blocks, which are looked at side by side, find for each other.
  struct Found {
    std::vector<FarMove> far;
    std::vector<std::pair<std::uint32_t, std::uint8_t>> moves;  // number, direction
  };

  // Every move of every patch is set by one of its ends.
  void AddMoves() {
    constexpr int kRow = 32;  // blocks
    std::array<Found, kRowBands> found;
    ForRows(loop_, 0, kRow, [&](int band, int row) {
      const std::uint32_t begin = tile_.standing.FirstOf(row * kRow);
      const std::uint32_t end = tile_.standing.FirstOf((row + 1) * kRow);
      for (std::uint32_t number = begin; number < end; ++number) {
        for (int k = 0; k < 4; ++k) AddMove(number, k, begin, end, &found[band]);
        for (int k = 4; k < 8; ++k) AddMoveOut(number, k, begin, end, &found[band]);
      }
    });
    for (const Found& band : found) {
      for (const auto& [number, k] : band.moves) AddBit(number, k);
      tile_.far_moves.insert(tile_.far_moves.end(), band.far.begin(), band.far.end());
    }
    std::sort(
        tile_.far_moves.begin(), tile_.far_moves.end(), [](const FarMove& a, const FarMove& b) {
          return std::tie(a.place, a.direction) < std::tie(b.place, b.direction);
        });
    tile_.far_moves.shrink_to_fit();
    IndexFarMoves(tile_);
  }

  void AddBit(std::uint32_t number, int k) {
    tile_.patches[number].moves |= static_cast<std::uint8_t>(1U << k);
  }

  // A move and its opposite, which costs the same. The row has numbers [begin, end).
  void AddMove(std::uint32_t number, int k, std::uint32_t begin, std::uint32_t end, Found* found) {
    const std::uint32_t from = surface_[number];
    int cells = 0;
    const std::uint32_t to = ground_.Target(from, k, &cells);
    if (to == GroundChecks::kNoSurface || !CanStand(to)) return;
    if (cells > 1 && !ground_.GapIsClear(from, to, k, cells)) return;
    const std::uint32_t there = number_[to];
    if (IsRegular(from, to, k, cells)) {
      AddBit(number, k);
    } else {
      AddFar(from, to, k, cells, found);
    }
    if (there == PatchIndex::kNone) return;
    if (!IsRegular(to, from, k ^ 4, cells)) {
      AddFar(to, from, k ^ 4, cells, found);
    } else if (there >= begin && there < end) {
      AddBit(there, k ^ 4);
    } else {
      found->moves.emplace_back(there, static_cast<std::uint8_t>(k ^ 4));
    }
  }

  // The same if it leads out of the tile; AddMove() adds the others from where they lead to.
  void AddMoveOut(
      std::uint32_t number, int k, std::uint32_t begin, std::uint32_t end, Found* found) {
    const int reach = checks_.GapCells(k) + 1;
    const std::uint16_t cell = tile_.standing.CellOf(place_[number]);
    const int x = (cell & (kTileCells - 1)) + kStepX[k] * reach;
    const int y = (cell >> kTileShift) + kStepY[k] * reach;
    if (x >= 0 && y >= 0 && x < kTileCells && y < kTileCells) return;
    int cells = 0;
    const std::uint32_t to = ground_.Target(surface_[number], k, &cells);
    if (to == GroundChecks::kNoSurface || number_[to] != PatchIndex::kNone) return;
    AddMove(number, k, begin, end, found);
  }

  // True for what PreparedPatch::moves can tell.
  bool IsRegular(std::uint32_t from, std::uint32_t to, int k, int cells) const {
    if (number_[to] == PatchIndex::kNone) return false;
    auto cell = static_cast<int>(window_.surface(from).cell);
    for (int n = 1; n < cells; ++n) {
      cell += window_.Step(k);
      for (std::uint32_t i = window_.begin(cell); i < window_.begin(cell + 1); ++i) {
        if (CanStand(i)) return false;
      }
    }
    cell += window_.Step(k);
    const float z = window_.surface(from).z_m;
    const float off = std::abs(window_.surface(to).z_m - z);
    for (std::uint32_t i = window_.begin(cell); i < window_.begin(cell + 1); ++i) {
      if (i == to || !CanStand(i)) continue;
      const float other = std::abs(window_.surface(i).z_m - z);
      if (other < off || (other == off && i < to)) return false;
    }
    return true;
  }

  void AddFar(std::uint32_t from, std::uint32_t to, int k, int cells, Found* found) const {
    const double dangers = 2.0 + static_cast<double>(danger_[from]) + danger_[to];
    const float rise = window_.surface(to).z_m - window_.surface(from).z_m;
    const std::uint32_t cost = step_costs_.OfRise(k, cells, rise, dangers);
    std::uint8_t level = 0;
    for (std::uint32_t i = window_.begin(static_cast<int>(window_.surface(to).cell)); i < to; ++i) {
      if (CanStand(i)) ++level;
    }
    found->far.push_back({place_[number_[from]],
                          static_cast<std::uint8_t>(k),
                          level,
                          static_cast<std::uint16_t>(cells),
                          cost});
  }

  const GroundWindow& window_;
  const ProfileChecks& checks_;
  const ParallelLoop& loop_;
  const StepCosts step_costs_;
  const GroundChecks ground_;
  PreparedTile tile_;
  // Per surface of the window.
  std::vector<float> danger_;
  std::vector<float> distance_;
  std::vector<std::uint32_t> number_;
  // Per patch.
  std::vector<std::uint32_t> surface_;
  std::vector<std::uint32_t> place_;
};

}  // namespace

std::uint16_t DangerCode(double danger) {
  const auto bits = std::bit_cast<std::uint32_t>(static_cast<float>(1.0 + danger));
  const std::uint32_t code = (bits - 0x3F800000U + (1U << 9)) >> 10;
  return static_cast<std::uint16_t>(std::min<std::uint32_t>(code, 0xFFFF));
}

float PreparedTile::Height(std::uint32_t place) const {
  if (place < standing.places()) return HeightOf(standing.Number(place));
  const std::uint32_t number = other.Number(place - standing.places());
  if (!exact_heights.empty()) return exact_heights[standing.size() + number];
  return static_cast<float>(base_steps + other_heights[number]) / kHeightStepsPerM;
}

std::uint32_t PreparedTile::FarTarget(std::uint32_t place,
                                      std::uint32_t number,
                                      int direction,
                                      int* cells) const {
  std::uint32_t lowest = PatchIndex::Beside(standing.OnFirstSheet(place), direction);
  for (; !standing.Has(lowest); ++*cells) lowest = PatchIndex::Beside(lowest, direction);
  if (standing.one_sheet()) return lowest;
  const float z = HeightOf(number);
  const std::uint16_t cell = PatchIndex::CellOnFirstSheet(lowest);
  std::uint32_t nearest = lowest;
  float off = std::abs(HeightOf(standing.Number(lowest)) - z);
  for (std::uint32_t level = 1;; ++level) {
    const std::uint32_t above = standing.Place(cell, level);
    if (above == PatchIndex::kNone) return nearest;
    const float above_off = std::abs(HeightOf(standing.Number(above)) - z);
    if (above_off >= off) return nearest;  // the higher, the farther
    nearest = above;
    off = above_off;
  }
}

std::size_t PreparedTile::FirstFarMove(std::uint32_t place) const {
  const auto first = std::lower_bound(
      far_moves.begin(), far_moves.end(), place, [](const FarMove& move, std::uint32_t wanted) {
        return move.place < wanted;
      });
  return static_cast<std::size_t>(first - far_moves.begin());
}

const FarMove* PreparedTile::Far(std::uint32_t place, int direction) const {
  if (!HasFarMoves(place)) return nullptr;
  for (std::size_t i = FirstFarMove(place); i < far_moves.size(); ++i) {
    if (far_moves[i].place != place) break;
    if (far_moves[i].direction == direction) return &far_moves[i];
  }
  return nullptr;
}

void IndexFarMoves(PreparedTile& tile) {
  tile.far_places.assign(tile.standing.sheets().size(), 0);
  for (const FarMove& move : tile.far_moves) {
    tile.far_places[move.place / 64] |= std::uint64_t{1} << (move.place % 64);
  }
}

std::size_t PreparedTile::memory_bytes() const {
  return sizeof(*this) + standing.memory_bytes() + other.memory_bytes() +
         patches.capacity() * sizeof(PreparedPatch) + class_id.capacity() +
         far_moves.capacity() * sizeof(FarMove) + far_places.capacity() * sizeof(std::uint64_t) +
         other_heights.capacity() * sizeof(std::uint16_t) +
         exact_heights.capacity() * sizeof(float);
}

PreparedTile PrepareTile(const SurfaceTile& surfaces,
                         const GroundWindow& window,
                         const ProfileChecks& checks,
                         const ParallelLoop& loop) {
  return Preparation(window, checks, loop).Run(surfaces);
}

}  // namespace strata
