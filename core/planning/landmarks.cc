#include "core/planning/landmarks.h"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/str_cat.h"

#include "core/common/status.h"
#include "core/common/stop.h"
#include "core/mls/tile_key.h"
#include "core/planning/prepared_tile.h"
#include "core/planning/search.h"
#include "core/planning/search_space.h"
#include "core/planning/search_workspace.h"
#include "core/planning/tile_cache.h"

namespace strata {
namespace {

// Patches of the last search of a workspace that keeps all tiles at hand.
template <typename Visit>
void ForEachReached(const SearchSpace& space, SearchWorkspace& workspace, Visit visit) {
  for (const int slot : workspace.at_hand()) {
    const PatchId base = space.slots()[slot].base;
    const SearchWorkspace::Member& member = workspace.member(slot);
    member.tile->standing.ForEach([&](std::uint32_t place, std::uint32_t number) {
      const std::uint32_t cost = member.costs[place];
      if (cost != SearchWorkspace::Member::kUnreached) visit(slot, base + place, number, cost);
    });
  }
}

// Adds the patches connected to `seed` to `seen` and returns how many they are.
std::size_t Flood(SearchSpace& space, PatchId seed, std::vector<bool>& seen) {
  std::vector<PatchId> stack = {seed};
  seen[seed] = true;
  std::size_t count = 0;
  while (!stack.empty()) {
    const PatchId patch = stack.back();
    stack.pop_back();
    ++count;
    for (int k = 0; k < 8; ++k) {
      std::uint32_t cost = 0;
      int cells = 0;
      const PatchId next = space.Follow(patch, k, &cost, &cells);
      if (next == kNoPatchId) continue;
      if (next >= seen.size()) seen.resize(space.end());
      if (seen[next]) continue;
      seen[next] = true;
      stack.push_back(next);
    }
  }
  return count;
}

// A patch of the largest connected part, kNoPatchId if there is nowhere to stand.
absl::StatusOr<PatchId> LargestPart(SearchSpace& space,
                                    const std::vector<TileKey>& tiles,
                                    const Stop& stop) {
  PatchId best = kNoPatchId;
  std::size_t best_size = 0;
  std::vector<bool> seen;
  for (const TileKey& key : tiles) {
    STRATA_RETURN_IF_ERROR(stop.status());
    const int slot = space.SlotOf(key);
    STRATA_RETURN_IF_ERROR(space.status());
    if (slot < 0) continue;
    const PatchId base = space.slots()[slot].base;
    const std::shared_ptr<const PreparedTile> tile = space.At(slot).tile;
    seen.resize(space.end());
    tile->standing.ForEach([&](std::uint32_t place, std::uint32_t /*number*/) {
      if (seen[base + place]) return;
      const std::size_t size = Flood(space, base + place, seen);
      if (size <= best_size) return;
      best_size = size;
      best = base + place;
    });
  }
  STRATA_RETURN_IF_ERROR(space.status());
  return best;
}

}  // namespace

absl::StatusOr<std::shared_ptr<const Landmarks>> Landmarks::Make(SearchSpace& space,
                                                                 const std::vector<TileKey>& tiles,
                                                                 int count,
                                                                 const Stop& stop) {
  if (count < 1 || count > kMaxLandmarks) {
    return absl::InvalidArgumentError(
        absl::StrCat("count = ", count, " landmarks is not in [1, ", kMaxLandmarks, "]"));
  }
  auto landmarks = std::make_shared<Landmarks>();
  SearchWorkspace workspace;
  landmarks->count_ = count;
  landmarks->profile_ = space.checks().profile;
  STRATA_ASSIGN_OR_RETURN(const PatchId part, LargestPart(space, tiles, stop));
  if (part == kNoPatchId) return landmarks;
  STRATA_ASSIGN_OR_RETURN(PatchId next, ReachAll(space, part, workspace, stop));
  std::vector<std::uint32_t> nearest(space.end(), kUnreached);
  for (int l = 0; l < count; ++l) {
    STRATA_RETURN_IF_ERROR(ReachAll(space, next, workspace, stop).status());
    landmarks->Store(space, workspace, l);
    std::uint32_t farthest = 0;
    ForEachReached(space,
                   workspace,
                   [&](int /*slot*/, PatchId p, std::uint32_t /*number*/, std::uint32_t cost) {
                     nearest[p] = std::min(nearest[p], cost);
                     if (nearest[p] <= farthest) return;
                     farthest = nearest[p];
                     next = p;
                   });
  }
  for (auto& [key, tile] : landmarks->tiles_) {
    tile.versions = VersionsAround(space.source(), key);
  }
  return landmarks;
}

void Landmarks::Store(const SearchSpace& space, SearchWorkspace& workspace, int landmark) {
  std::vector<std::uint32_t*> of_slot;
  for (const SearchSpace::Slot& slot : space.slots()) {
    std::vector<std::uint32_t>& costs = tiles_[slot.key].costs;
    costs.resize(static_cast<std::size_t>(slot.size) * count_, kUnreached);
    of_slot.push_back(costs.data() + static_cast<std::size_t>(slot.size) * landmark);
  }
  ForEachReached(
      space, workspace, [&](int slot, PatchId /*p*/, std::uint32_t number, std::uint32_t cost) {
        of_slot[slot][number] = cost;
      });
}

bool Landmarks::Fits(TileSource& source) const {
  return std::all_of(tiles_.begin(), tiles_.end(), [&source](const auto& entry) {
    return VersionsAround(source, entry.first) == entry.second.versions;
  });
}

const std::uint32_t* Landmarks::Tile(const TileKey& key) const {
  const auto found = tiles_.find(key);
  return found == tiles_.end() ? nullptr : found->second.costs.data();
}

std::size_t Landmarks::memory_bytes() const {
  std::size_t bytes = sizeof(*this);
  for (const auto& [key, tile] : tiles_) bytes += tile.costs.capacity() * sizeof(std::uint32_t);
  return bytes;
}

}  // namespace strata
