#include "core/planning/search_space.h"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <utility>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/str_cat.h"
#include <Eigen/Core>

#include "core/common/status.h"
#include "core/mls/tile_key.h"
#include "core/planning/ground/ground_window.h"
#include "core/planning/least_dangers.h"
#include "core/planning/patch_index.h"
#include "core/planning/prepared_tile.h"

namespace strata {
namespace {

constexpr std::size_t kMaxSlots = 65535;
constexpr std::size_t kHeldShare = 32;
constexpr std::size_t kMinHeld = 2;  // to and fro over a border

}  // namespace

int SearchSpace::SlotOf(const TileKey& key) {
  const auto [found, inserted] = slot_of_.try_emplace(key, -1);
  if (!inserted || !status_.ok()) return found->second;
  absl::StatusOr<std::shared_ptr<const PreparedTile>> tile = Fetch(key);
  if (tile.ok() && *tile != nullptr && !HasRoomFor(**tile)) {
    tile = absl::OutOfRangeError(
        absl::StrCat("a query touches at most ", slots_.size(), " tiles of this map"));
  }
  if (!tile.ok()) {
    status_ = tile.status();
    return -1;
  }
  if (*tile == nullptr) return -1;
  const auto slot = static_cast<int>(slots_.size());
  const std::uint32_t places = (*tile)->places();
  slots_.push_back({.key = key,
                    .tile = nullptr,
                    .base = end(),
                    .places = places,
                    .size = (*tile)->standing.size(),
                    .x0 = key.x << kTileShift,
                    .y0 = key.y << kTileShift});
  page_slot_.insert(page_slot_.end(), (places >> kPageShift) + 1, static_cast<std::uint16_t>(slot));
  found->second = slot;
  Hold(slot, *std::move(tile));
  return slot;
}

bool SearchSpace::HasRoomFor(const PreparedTile& tile) const {
  const std::uint64_t pages = page_slot_.size() + (tile.places() >> kPageShift) + 1;
  return slots_.size() < kMaxSlots && pages << kPageShift <= kMaxPatchIds;
}

absl::StatusOr<std::shared_ptr<const PreparedTile>> SearchSpace::Fetch(const TileKey& key) {
  STRATA_RETURN_IF_ERROR(stop_.status());
  return cache_.Get(source_, key, checks_);
}

absl::StatusOr<std::shared_ptr<const LeastDangers>> SearchSpace::KeptDangers(const TileKey& key) {
  STRATA_RETURN_IF_ERROR(stop_.status());
  return cache_.KeptDangers(source_, key, checks_);
}

const SearchSpace::Slot& SearchSpace::At(int slot) {
  if (slots_[slot].tile == nullptr) Hold(slot, TileAgain(slots_[slot]));
  return slots_[slot];
}

std::shared_ptr<const PreparedTile> SearchSpace::TileAgain(const Slot& slot) {
  absl::StatusOr<std::shared_ptr<const PreparedTile>> tile = Fetch(slot.key);
  // The same versions of the same tile: the same patches.
  if (tile.ok() && *tile != nullptr && (*tile)->standing.size() == slot.size &&
      (*tile)->places() == slot.places) {
    return *std::move(tile);
  }
  if (status_.ok()) {
    status_ = tile.ok() ? absl::InternalError(absl::StrCat(
                              "tile ", slot.key.ToString(), " changed within one version"))
                        : tile.status();
  }
  auto blank = std::make_shared<PreparedTile>();
  blank->key = slot.key;
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

SearchSpace::Column SearchSpace::FindCell(CellIndex cell) {
  Column column;
  const int slot = SlotOf(TileOfCell(cell));
  if (slot < 0) return column;
  const PreparedTile& tile = *At(slot).tile;
  const PatchId base = slots_[slot].base;
  const PatchIndex* const indices[] = {&tile.standing, &tile.other};
  for (const PatchIndex* const index : indices) {
    const PatchId begin = index == &tile.standing ? base : base + tile.standing.places();
    for (std::uint32_t level = 0;; ++level) {
      const std::uint32_t place = index->Place(CellInTile(cell), level);
      if (place == PatchIndex::kNone) break;
      column.push_back(begin + place);
    }
  }
  if (column.size() > 1) {
    std::stable_sort(column.begin(), column.end(), [&tile, base](PatchId a, PatchId b) {
      return tile.Height(a - base) < tile.Height(b - base);
    });
  }
  return column;
}

PatchId SearchSpace::Resolve(CellIndex from, const FarMove& move) {
  const CellIndex cell = {from.x + move.cells * kStepX[move.direction],
                          from.y + move.cells * kStepY[move.direction]};
  const int slot = SlotOf(TileOfCell(cell));
  if (slot < 0) return kNoPatchId;
  const std::uint32_t place = At(slot).tile->standing.Place(CellInTile(cell), move.level);
  return place == PatchIndex::kNone ? kNoPatchId : slots_[slot].base + place;
}

bool SearchSpace::HasMove(PatchId patch, int direction) {
  const Slot& slot = SlotOfPatch(patch);
  const std::uint32_t place = patch - slot.base;
  if (!slot.tile->CanStand(place)) return false;
  const PreparedPatch& own = slot.tile->patches[slot.tile->standing.Number(place)];
  return (own.moves >> direction & 1U) != 0 || slot.tile->Far(place, direction) != nullptr;
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
  const PreparedTile& tile = *slot.tile;
  const std::uint32_t place = patch - slot.base;
  if (!tile.CanStand(place)) return kNoPatchId;
  const std::uint32_t number = tile.standing.Number(place);
  if ((tile.patches[number].moves >> direction & 1U) != 0) {
    const std::uint32_t to = tile.Target(place, number, direction, cells);
    *cost = tile.Cost(step_costs_, number, tile.standing.Number(to), direction, *cells);
    return slot.base + to;
  }
  const FarMove* const far = tile.Far(place, direction);
  if (far == nullptr) return kNoPatchId;
  *cost = far->cost;
  *cells = far->cells;
  return Resolve(CellIn(slot, place), FarMove(*far));
}

CellIndex SearchSpace::CellOfPatch(PatchId patch) {
  const Slot& slot = SlotOfPatch(patch);
  return CellIn(slot, patch - slot.base);
}

float SearchSpace::Height(PatchId patch) {
  const Slot& slot = SlotOfPatch(patch);
  const std::uint32_t place = patch - slot.base;
  return slot.tile->HasSurface(place) ? slot.tile->Height(place) : 0.0F;
}

float SearchSpace::Danger(PatchId patch) {
  const Slot& slot = SlotOfPatch(patch);
  const PreparedTile& tile = *slot.tile;
  if (!tile.CanStand(patch - slot.base)) return -1.0F;
  const std::uint32_t number = tile.standing.Number(patch - slot.base);
  if (classes_.Forbidden(tile.ClassOf(number))) return -1.0F;
  return OnePlusDanger(tile.patches[number].danger) - 1.0F;
}

std::uint8_t SearchSpace::ClassOf(PatchId patch) {
  const Slot& slot = SlotOfPatch(patch);
  if (!slot.tile->CanStand(patch - slot.base)) return 0;
  return slot.tile->ClassOf(slot.tile->standing.Number(patch - slot.base));
}

float SearchSpace::EdgeDistance(PatchId patch) {
  const Slot& slot = SlotOfPatch(patch);
  if (!slot.tile->CanStand(patch - slot.base)) return 0.0F;
  const PreparedPatch& own = slot.tile->patches[slot.tile->standing.Number(patch - slot.base)];
  return static_cast<float>(own.edge_distance) / 255.0F * checks_.reach_m;
}

Eigen::Vector3d SearchSpace::Position(PatchId patch) {
  const CellIndex cell = CellOfPatch(patch);
  return {
      (cell.x + 0.5) * checks_.cell_size_m, (cell.y + 0.5) * checks_.cell_size_m, Height(patch)};
}

}  // namespace strata
