#include "core/planning/search_workspace.h"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <utility>

#include "absl/status/status.h"

#include "core/common/cache_budget.h"
#include "core/common/status.h"
#include "core/common/stop.h"
#include "core/mls/tile_key.h"
#include "core/planning/prepared_tile.h"

namespace strata {
namespace {

// Parts of the budget, beside the small share that every search begins with: what a large one waits
// for, some of the tiles that it parks included; and of that what the tiles at hand may take.
constexpr std::size_t kLargeShare = 8;
constexpr std::size_t kAtHandShare = 9;
// A way of n cells makes a search expand more than n times this.
constexpr std::size_t kLeastBreadth = 64;

// What a search adds to a tile, whose own memory is the cache's.
std::size_t BytesAtHand(const PreparedTile& tile) {
  return tile.standing.places() * (sizeof(std::uint32_t) + sizeof(std::uint8_t));
}

}  // namespace

absl::Status SearchWorkspace::Begin(int bucket_shift, const Stop& stop) {
  Clear(bucket_shift);
  if (budget_ == nullptr) return absl::OkStatus();
  GiveBackShare();
  STRATA_RETURN_IF_ERROR(budget_->AwaitSmallShare(stop));
  has_small_share_ = true;
  granted_ = budget_->small_share();
  return absl::OkStatus();
}

absl::Status SearchWorkspace::BeginLarge(int bucket_shift, const Stop& stop) {
  Clear(bucket_shift);
  return TakeLargeShare(stop);
}

std::size_t SearchWorkspace::large_share() const { return budget_->max_bytes() / kLargeShare; }

void SearchWorkspace::Clear(int bucket_shift) {
  while (!at_hand_.empty()) Dismiss(at_hand_.back());
  parked_.clear();
  AccountParked();
  queue_.Clear(bucket_shift);
}

// Whoever waits holds nothing: searches that wait for each other would wait for ever.
absl::Status SearchWorkspace::TakeLargeShare(const Stop& stop) {
  GiveBackShare();
  STRATA_RETURN_IF_ERROR(budget_->AwaitReserve(large_share(), stop));
  granted_ = large_share();
  return absl::OkStatus();
}

void SearchWorkspace::GiveBackShare() {
  if (has_small_share_) {
    budget_->ReleaseSmallShare();
  } else {
    budget_->Release(granted_);
  }
  has_small_share_ = false;
  granted_ = 0;
}

absl::Status SearchWorkspace::Admit(int slot,
                                    std::shared_ptr<const PreparedTile> tile,
                                    const Stop& stop) {
  bytes_at_hand_ += BytesAtHand(*tile);
  if (budget_ != nullptr) {
    if (bytes_at_hand_ > granted_ && granted_ < large_share()) {
      STRATA_RETURN_IF_ERROR(TakeLargeShare(stop));
    }
  }
  if (static_cast<std::size_t>(slot) >= members_.size()) members_.resize(slot + 1);
  Member& member = members_[slot];
  if (!spare_.empty()) {
    member = std::move(spare_.back());
    spare_.pop_back();
  }
  member.costs.assign(tile->standing.places(), Member::kUnreached);
  member.states.assign(tile->standing.places(), 0);
  member.tile = std::move(tile);
  at_hand_.push_back(slot);
  return absl::OkStatus();
}

bool SearchWorkspace::HasRoomFor(const PreparedTile& tile) const {
  return budget_ == nullptr || at_hand_.empty() ||
         bytes_at_hand_ + BytesAtHand(tile) <= budget_->max_bytes() / kAtHandShare;
}

bool SearchWorkspace::IsLarge(std::uint64_t cells) const {
  return budget_ != nullptr &&
         cells * kLeastBreadth * (sizeof(std::uint32_t) + sizeof(std::uint8_t)) >
             budget_->max_bytes() / kAtHandShare;
}

int SearchWorkspace::LongestUnused() const {
  return *std::min_element(at_hand_.begin(), at_hand_.end(), [this](int a, int b) {
    return members_[a].last_used < members_[b].last_used;
  });
}

void SearchWorkspace::Dismiss(int slot) {
  Member& member = members_[slot];
  bytes_at_hand_ -= BytesAtHand(*member.tile);
  member.tile.reset();
  if (spare_.empty()) spare_.push_back(std::move(member));
  member = {};
  at_hand_.erase(std::find(at_hand_.begin(), at_hand_.end(), slot));
}

bool SearchWorkspace::AccountParked() {
  if (budget_ == nullptr) return true;
  std::size_t bytes = 0;
  for (const auto& [key, parked] : parked_) bytes += sizeof(parked) + parked.memory_bytes();
  // Some of it is in what large searches have.
  const std::size_t group = budget_->max_bytes() / kAtHandShare;
  bytes -= std::min(bytes, granted_ > group ? granted_ - group : 0);
  if (bytes > granted_parked_) {
    if (!budget_->Reserve(bytes - granted_parked_)) return false;
  } else {
    budget_->Release(granted_parked_ - bytes);
  }
  granted_parked_ = bytes;
  return true;
}

void SearchWorkspace::EndSearch() {
  if (budget_ == nullptr) return;
  while (!at_hand_.empty()) Dismiss(at_hand_.back());
  spare_ = {};
  queue_ = {};
  GiveBackShare();
  AccountParked();
}

SearchWorkspace::~SearchWorkspace() {
  if (budget_ == nullptr) return;
  GiveBackShare();
  budget_->Release(granted_parked_);
}

std::uint8_t SearchWorkspace::DirectionOf(int slot,
                                          const PreparedTile& tile,
                                          std::uint32_t place) const {
  if (AtHand(slot) && members_[slot].costs[place] != Member::kUnreached) {
    return members_[slot].states[place] & 7U;
  }
  const auto found = parked_.find(tile.key);
  return found == parked_.end() || found->second.directions.empty()
             ? ParkedTile::kUnreached
             : ParkedTile::DirectionOf(found->second.directions, tile.standing.Number(place));
}

}  // namespace strata
