#include "core/planning/search_space.h"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <memory>
#include <utility>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/str_cat.h"
#include <Eigen/Core>

#include "core/common/status.h"
#include "core/mls/tile_key.h"
#include "core/planning/ground_window.h"
#include "core/planning/prepared_tile.h"

namespace strata {
namespace {

constexpr int kMaxSlots = 65535;
constexpr std::size_t kHeldShare = 32;
constexpr std::size_t kMinHeld = 2;  // to and fro over a border

// Length of a straight move inside a tile.
int CellsBetween(std::uint16_t a, std::uint16_t b) {
  return std::max(std::abs((a & (kTileCells - 1)) - (b & (kTileCells - 1))),
                  std::abs((a >> kTileShift) - (b >> kTileShift)));
}

}  // namespace

int SearchSpace::SlotOf(const TileKey& key) {
  const auto [found, inserted] = slot_of_.try_emplace(key, -1);
  if (!inserted || !status_.ok()) return found->second;
  absl::StatusOr<std::shared_ptr<const PreparedTile>> tile = Fetch(key);
  if (tile.ok() && slots_.size() >= kMaxSlots) {
    tile = absl::OutOfRangeError(absl::StrCat("a query touches at most ", kMaxSlots, " tiles"));
  }
  if (!tile.ok()) {
    status_ = tile.status();
    return -1;
  }
  if (*tile == nullptr) return -1;
  const auto slot = static_cast<int>(slots_.size());
  const std::uint32_t size = (*tile)->size();
  slots_.push_back({key, nullptr, end(), size, key.x << kTileShift, key.y << kTileShift});
  page_slot_.insert(page_slot_.end(), (size >> kPageShift) + 1, static_cast<std::uint16_t>(slot));
  found->second = slot;
  Hold(slot, *std::move(tile));
  return slot;
}

absl::StatusOr<std::shared_ptr<const PreparedTile>> SearchSpace::Fetch(const TileKey& key) {
  STRATA_RETURN_IF_ERROR(stop_.status());
  return cache_.Get(source_, key, checks_);
}

const SearchSpace::Slot& SearchSpace::At(int slot) {
  if (slots_[slot].tile == nullptr) Hold(slot, TileAgain(slots_[slot]));
  return slots_[slot];
}

std::shared_ptr<const PreparedTile> SearchSpace::TileAgain(const Slot& slot) {
  absl::StatusOr<std::shared_ptr<const PreparedTile>> tile = Fetch(slot.key);
  // The same versions of the same tile: the same patches.
  if (tile.ok() && *tile != nullptr && (*tile)->size() == slot.size) return *std::move(tile);
  if (status_.ok()) {
    status_ = tile.ok() ? absl::InternalError(absl::StrCat(
                              "tile ", slot.key.ToString(), " changed within one version"))
                        : tile.status();
  }
  auto blank = std::make_shared<PreparedTile>();
  blank->key = slot.key;
  blank->moves.resize(slot.size);
  blank->cell.resize(slot.size);
  blank->z_m.resize(slot.size);
  blank->danger.resize(slot.size, -1.0F);
  blank->edge_distance.resize(slot.size);
  return blank;
}

void SearchSpace::Hold(int slot, std::shared_ptr<const PreparedTile> tile) {
  held_bytes_ += tile->memory_bytes();
  slots_[slot].tile = std::move(tile);
  held_.push_back(slot);
  while (held_bytes_ > cache_.max_bytes() / kHeldShare && held_.size() > kMinHeld) {
    Slot& first = slots_[held_.front()];
    held_.pop_front();
    held_bytes_ -= first.tile->memory_bytes();
    first.tile.reset();
  }
}

std::uint32_t SearchSpace::FindCell(CellIndex cell, PatchId* first) {
  const int slot = SlotOf(TileOfCell(cell));
  if (slot < 0) return 0;
  std::uint32_t local = 0;
  std::uint32_t count = 0;
  At(slot).tile->FindCell(CellInTile(cell), &local, &count);
  *first = slots_[slot].base + local;
  return count;
}

PatchId SearchSpace::Resolve(CellIndex from, FarMove move) {
  const CellIndex cell = {from.x + move.cells * kStepX[move.direction],
                          from.y + move.cells * kStepY[move.direction]};
  PatchId first = 0;
  const std::uint32_t count = FindCell(cell, &first);
  return move.level < count ? first + move.level : kNoPatchId;
}

CellIndex SearchSpace::CellIn(const Slot& slot, std::uint32_t local) {
  const std::uint16_t cell = slot.tile->cell[local];
  return {slot.x0 + (cell & (kTileCells - 1)), slot.y0 + (cell >> kTileShift)};
}

PatchId SearchSpace::Follow(PatchId patch, int direction, std::uint32_t* cost, int* cells) {
  const PatchId target = FollowGround(patch, direction, cost, cells);
  if (target == kNoPatchId || classes_.plain()) return target;
  const std::uint8_t from = ClassOf(patch);
  const std::uint8_t to = ClassOf(target);
  if (classes_.Forbidden(from) || classes_.Forbidden(to)) return kNoPatchId;
  *cost = classes_.Scaled(*cost, from, to);
  return target;
}

PatchId SearchSpace::FollowGround(PatchId patch, int direction, std::uint32_t* cost, int* cells) {
  const Slot& slot = SlotOfPatch(patch);
  const Move move = slot.tile->moves[patch - slot.base][direction];
  if (move.cost == Move::kNone) return kNoPatchId;
  if (move.cost != Move::kFar) {
    const std::uint16_t* const own = &slot.tile->cell[patch - slot.base];
    *cost = move.cost;
    *cells = CellsBetween(own[0], own[move.delta]);
    return patch + move.delta;
  }
  const FarMove& far = slot.tile->Far(patch - slot.base, direction);
  *cost = far.cost;
  *cells = far.cells;
  return Resolve(CellIn(slot, patch - slot.base), far);
}

CellIndex SearchSpace::CellOfPatch(PatchId patch) {
  const Slot& slot = SlotOfPatch(patch);
  return CellIn(slot, patch - slot.base);
}

float SearchSpace::Height(PatchId patch) {
  const Slot& slot = SlotOfPatch(patch);
  return slot.tile->z_m[patch - slot.base];
}

float SearchSpace::Danger(PatchId patch) {
  const Slot& slot = SlotOfPatch(patch);
  if (classes_.Forbidden(slot.tile->ClassOf(patch - slot.base))) return -1.0F;
  return slot.tile->danger[patch - slot.base];
}

std::uint8_t SearchSpace::ClassOf(PatchId patch) {
  const Slot& slot = SlotOfPatch(patch);
  return slot.tile->ClassOf(patch - slot.base);
}

float SearchSpace::EdgeDistance(PatchId patch) {
  const Slot& slot = SlotOfPatch(patch);
  return static_cast<float>(slot.tile->edge_distance[patch - slot.base]) / 255.0F * checks_.reach_m;
}

Eigen::Vector3d SearchSpace::Position(PatchId patch) {
  const CellIndex cell = CellOfPatch(patch);
  return {
      (cell.x + 0.5) * checks_.cell_size_m, (cell.y + 0.5) * checks_.cell_size_m, Height(patch)};
}

}  // namespace strata
