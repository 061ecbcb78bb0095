// Shortest paths over the patches of a SearchSpace: A* and, without a goal, Dijkstra's algorithm.
//
// A search that fits its memory is plain A*, and its path the cheapest. A larger one goes on in the
// tiles that are at hand until others promise cheaper paths; what leads out of them is offered to
// the tiles there. Then it parks them and turns to the most promising tile, taking its neighbours
// in as it comes to them. A parked tile that gets a cheaper offer than what it knows, or where
// something is left to expand, is searched again from the costs at its border. Its path costs at
// most 1 % more than the cheapest. What is found depends on the size of the budget, not on what
// caches hold.
#ifndef STRATA_CORE_PLANNING_SEARCH_H_
#define STRATA_CORE_PLANNING_SEARCH_H_

#include <cstddef>
#include <cstdint>
#include <memory>
#include <utility>
#include <vector>

#include "absl/container/flat_hash_map.h"
#include "absl/status/status.h"
#include "absl/status/statusor.h"

#include "core/common/cache_budget.h"
#include "core/common/stop.h"
#include "core/mls/tile_key.h"
#include "core/planning/bucket_queue.h"
#include "core/planning/prepared_tile.h"
#include "core/planning/search_space.h"

namespace strata {

class Landmarks;

// What a search knows of a patch.
struct SearchNode {
  std::uint32_t cost = 0;   // from the start
  std::uint32_t stamp = 0;  // kReached | kClosed | direction it was reached by

  static constexpr std::uint32_t kClosed = 8;
  static constexpr std::uint32_t kReached = 16;
};

// A way to a place in a tile that is not at hand.
struct TileEntry {
  std::uint32_t cost = 0;  // from the start
  std::uint32_t move = 0;  // what comes on top, before classes
  std::uint16_t cell = 0;  // CellInTile
  std::uint8_t level = 0;  // among the surfaces of the cell, 0 = lowest
  std::uint8_t direction = 0;
  std::uint8_t class_id = 0;  // of where it comes from; of the place itself in `known`
};

// What a search keeps of a tile that it has left, or has not been in yet: enough to go on in it as
// if it had stayed.
struct ParkedTile {
  static constexpr std::uint8_t kUnreached = 8;

  std::vector<TileEntry> known;       // costs of places that moves from outside lead to, by place
  std::vector<TileEntry> offers;      // what others found since
  std::uint32_t lowest = UINT32_MAX;  // lower bound of the cost of a path by any of the offers
  std::vector<std::uint8_t> directions;  // by which patches were reached, two a byte

  std::uint8_t DirectionOf(std::uint32_t patch) const {
    return (directions[patch / 2] >> (patch % 2 * 4)) & 15U;
  }
  std::size_t memory_bytes() const {
    return (known.capacity() + offers.capacity()) * sizeof(TileEntry) + directions.capacity();
  }
};

// Memory of one search. With a budget it has few tiles at hand at a time, an eighth of the budget
// together with what is prepared of them, and parks the others.
class SearchWorkspace {
 public:
  // A tile at hand.
  struct Member {
    std::shared_ptr<const PreparedTile> tile;
    std::vector<SearchNode> nodes;
    bool again = false;  // was parked before
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
  // Whether one more tile may be at hand.
  bool HasRoom() const { return budget_ == nullptr || bytes_at_hand_ < budget_->max_bytes() / 8; }
  // As Begin().
  absl::Status Admit(int slot, std::shared_ptr<const PreparedTile> tile, const Stop& stop);
  bool AtHand(int slot) const {
    return static_cast<std::size_t>(slot) < members_.size() && members_[slot].tile != nullptr;
  }
  // REQUIRES: AtHand(slot).
  Member& member(int slot) { return members_[slot]; }
  const std::vector<int>& at_hand() const { return at_hand_; }
  // Lets go of all tiles at hand.
  void Dismiss();

  absl::flat_hash_map<TileKey, ParkedTile>& parked() { return parked_; }
  // Takes what parked tiles need from the budget; false where there is not that much.
  bool AccountParked();
  // Gives back all but what is parked.
  void EndSearch();

  // The direction a patch was reached by, ParkedTile::kUnreached if it was not.
  std::uint8_t DirectionOf(const SearchSpace::Slot& slot, int number, std::uint32_t local) const;
  BucketQueue& queue() { return queue_; }
  const std::shared_ptr<CacheBudget>& budget() const { return budget_; }

 private:
  absl::Status Exchange(std::size_t bytes, const Stop& stop);

  const std::shared_ptr<CacheBudget> budget_;
  std::size_t granted_ = 0;  // of the budget, for tiles at hand
  std::size_t granted_parked_ = 0;
  std::size_t bytes_at_hand_ = 0;
  std::vector<Member> members_;  // by slot
  std::vector<int> at_hand_;
  std::vector<std::vector<SearchNode>> spare_;  // of members that were dismissed
  absl::flat_hash_map<TileKey, ParkedTile> parked_;
  BucketQueue queue_;
};

struct SearchOutcome {
  // kLimit: of what may be expanded; kFull: of memory.
  enum class End : std::uint8_t { kFound, kExhausted, kLimit, kFull };
  End end = End::kExhausted;
  std::uint64_t expanded = 0;
  std::uint32_t cost = 0;        // of the path
  std::vector<PatchId> path;     // start to goal
  PatchId dearest = kNoPatchId;  // the patch expanded that was the most expensive to reach
};

// A path from `start` to `goal`, both places where the robot can stand. `landmarks`
// (optional) must fit the space's source and profile; costs of classes only add to what they know.
// CANCELLED and DEADLINE_EXCEEDED by `stop`; errors of the source.
absl::StatusOr<SearchOutcome> FindPath(SearchSpace& space,
                                       PatchId start,
                                       PatchId goal,
                                       const Landmarks* landmarks,
                                       std::uint64_t max_expanded,
                                       SearchWorkspace& workspace,
                                       const Stop& stop);

// Costs from `start` to everything that can be reached, left in `workspace`; returns the patch that
// is the most expensive to reach.
absl::StatusOr<PatchId> ReachAll(SearchSpace& space,
                                 PatchId start,
                                 SearchWorkspace& workspace,
                                 const Stop& stop);

}  // namespace strata

#endif  // STRATA_CORE_PLANNING_SEARCH_H_
