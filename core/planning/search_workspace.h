// What a search knows: of the tiles at hand all, of those it has left what it takes to go on there.
#ifndef STRATA_CORE_PLANNING_SEARCH_WORKSPACE_H_
#define STRATA_CORE_PLANNING_SEARCH_WORKSPACE_H_

#include <cstddef>
#include <cstdint>
#include <memory>
#include <utility>
#include <vector>

#include "absl/status/status.h"

#include "core/common/cache_budget.h"
#include "core/common/hash_map.h"
#include "core/common/stop.h"
#include "core/mls/tile_key.h"
#include "core/planning/bucket_queue.h"
#include "core/planning/prepared_tile.h"

namespace strata {

// A way to a place in a tile that is not at hand.
struct TileEntry {
  std::uint32_t cost = 0;  // from the start
  std::uint32_t move = 0;  // what comes on top, before classes
  std::uint16_t cell = 0;  // CellInTile
  std::uint8_t level = 0;  // among the patches of the cell, 0 = lowest
  std::uint8_t direction = 0;
  std::uint8_t class_id = 0;  // of where it comes from; of the place itself in `known`
};

// What a search keeps of a tile that it has left, or has not been in yet: enough to go on in it as
// if it had stayed.
struct ParkedTile {
  static constexpr std::uint8_t kUnreached = 8;
  static constexpr std::uint8_t kNoDirections = kUnreached << 4 | kUnreached;
  static constexpr std::uint32_t kNotAwaited = 0xFFFFFFFFU;

  std::vector<TileEntry> known;   // costs of places that moves from outside lead to, by place
  std::vector<TileEntry> offers;  // what others found since
  // Lower bound of the cost of a path by any of the offers, or by what is left to expand.
  std::uint32_t lowest = UINT32_MAX;
  std::uint32_t awaited = kNotAwaited;  // number in the search's queue
  // By which patches were reached, two a byte.
  std::vector<std::uint8_t> directions;

  static std::uint8_t DirectionOf(const std::vector<std::uint8_t>& directions,
                                  std::uint32_t number) {
    return (directions[number / 2] >> (number % 2 * 4)) & 15U;
  }
  void SetDirection(std::uint32_t number, std::uint32_t direction) {
    std::uint8_t& two = directions[number / 2];
    const std::uint32_t shift = number % 2 * 4;
    two = static_cast<std::uint8_t>((two & ~(15U << shift)) | direction << shift);
  }
  std::size_t memory_bytes() const {
    return (known.capacity() + offers.capacity()) * sizeof(TileEntry) + directions.capacity();
  }
};

// Memory of one search. With a budget it has few tiles at hand at a time, a ninth of it with
// 0.33 MB a tile of one level, and parks the others. The prepared tiles themselves are the cache's.
class SearchWorkspace {
 public:
  // A tile at hand, and what the search knows of its patches, by place.
  struct Member {
    static constexpr std::uint32_t kUnreached = 0xFFFFFFFFU;
    static constexpr std::uint8_t kClosed = 8;

    std::shared_ptr<const PreparedTile> tile;
    std::vector<std::uint32_t> costs;  // from the start
    std::vector<std::uint8_t> states;  // kClosed | direction it was reached by
    std::uint64_t last_used = 0;
  };

  // Without a budget all tiles stay at hand, also after the search.
  explicit SearchWorkspace(std::shared_ptr<CacheBudget> budget = nullptr)
      : budget_(std::move(budget)) {}
  ~SearchWorkspace();
  SearchWorkspace(const SearchWorkspace&) = delete;
  SearchWorkspace& operator=(const SearchWorkspace&) = delete;

  // Starts anew, with a queue of buckets of 2^bucket_shift. Waits while other searches have the
  // memory that it needs; errors are those of `stop`.
  absl::Status Begin(int bucket_shift, const Stop& stop);
  // The same with all that a large search has: large_share(), which is its own until it takes
  // tiles in. REQUIRES: budget() != nullptr.
  absl::Status BeginLarge(int bucket_shift, const Stop& stop);
  std::size_t large_share() const;
  // Whether this tile too may be at hand.
  bool HasRoomFor(const PreparedTile& tile) const;
  // Whether a search over a way of so many cells will not have room for all that it touches.
  bool IsLarge(std::uint64_t cells) const;
  // As Begin(). REQUIRES: HasRoomFor(*tile).
  absl::Status Admit(int slot, std::shared_ptr<const PreparedTile> tile, const Stop& stop);
  bool AtHand(int slot) const {
    return static_cast<std::size_t>(slot) < members_.size() && members_[slot].tile != nullptr;
  }
  // REQUIRES: AtHand(slot).
  Member& member(int slot) { return members_[slot]; }
  const std::vector<int>& at_hand() const { return at_hand_; }
  // The slot at hand that was used longest ago. REQUIRES: one is.
  int LongestUnused() const;
  // Lets go of a tile at hand.
  void Dismiss(int slot);

  HashMap<TileKey, ParkedTile>& parked() { return parked_; }
  // Takes what parked tiles need from the budget; false where there is not that much.
  bool AccountParked();
  // Gives back all but what is parked.
  void EndSearch();

  // The direction that a patch of a slot's tile was reached by, ParkedTile::kUnreached if it was
  // not.
  std::uint8_t DirectionOf(int slot, const PreparedTile& tile, std::uint32_t place) const;
  BucketQueue& queue() { return queue_; }
  const std::shared_ptr<CacheBudget>& budget() const { return budget_; }

 private:
  void Clear(int bucket_shift);
  absl::Status TakeLargeShare(const Stop& stop);
  void GiveBackShare();

  const std::shared_ptr<CacheBudget> budget_;
  std::size_t granted_ = 0;       // of the budget, for tiles at hand
  bool has_small_share_ = false;  // which then is what was granted
  std::size_t granted_parked_ = 0;
  std::size_t bytes_at_hand_ = 0;
  std::vector<Member> members_;  // by slot
  std::vector<int> at_hand_;
  std::vector<Member> spare_;  // memory of members that were dismissed
  HashMap<TileKey, ParkedTile> parked_;
  BucketQueue queue_;
};

}  // namespace strata

#endif  // STRATA_CORE_PLANNING_SEARCH_WORKSPACE_H_
