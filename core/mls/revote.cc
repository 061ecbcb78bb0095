#include "core/mls/revote.h"

#include <algorithm>
#include <cstdint>
#include <limits>
#include <tuple>
#include <vector>

#include "core/mls/patch.h"

namespace strata {
namespace {

constexpr std::uint32_t kSaturated = std::numeric_limits<std::uint32_t>::max();

// A vote that comes (count > 0) or leaves.
struct Change {
  std::uint32_t patch;
  std::uint16_t class_id;
  std::int64_t count;
};

// The patch of `tile` that each patch of `part` is in; nullopt if one is in none. Both are sorted,
// and a part's patch lies within one patch of the whole.
std::optional<std::vector<std::uint32_t>> PlacesIn(const MlsTile& tile, const MlsTile& part) {
  std::vector<std::uint32_t> places;
  places.reserve(part.patches.size());
  std::uint32_t at = 0;
  for (const Patch& patch : part.patches) {
    const auto ends_before = [&patch](const Patch& held) {
      return held.cell != patch.cell ? held.cell < patch.cell : held.z_max < patch.z_min;
    };
    while (at < tile.patches.size() && ends_before(tile.patches[at])) ++at;
    if (at == tile.patches.size()) return std::nullopt;
    const Patch& held = tile.patches[at];
    if (held.cell != patch.cell || held.z_min > patch.z_min || held.z_max < patch.z_max) {
      return std::nullopt;
    }
    places.push_back(at);
  }
  return places;
}

void Append(const MlsTile& part,
            const std::vector<std::uint32_t>& places,
            int sign,
            std::vector<Change>& changes) {
  for (const ClassVotes& vote : part.votes) {
    changes.push_back({places[vote.patch], vote.class_id, sign * std::int64_t{vote.count}});
  }
}

template <typename A, typename B>
bool Before(const A& a, const B& b) {
  return std::tie(a.patch, a.class_id) < std::tie(b.patch, b.class_id);
}

}  // namespace

std::optional<MlsTile> ReplaceVotes(const MlsTile& tile,
                                    const MlsTile& before,
                                    const MlsTile& after) {
  if (before.patches != after.patches) return std::nullopt;
  const std::optional<std::vector<std::uint32_t>> places = PlacesIn(tile, before);
  if (!places.has_value()) return std::nullopt;
  std::vector<Change> changes;
  Append(before, *places, -1, changes);
  Append(after, *places, 1, changes);
  std::sort(changes.begin(), changes.end(), Before<Change, Change>);
  MlsTile changed = tile;
  changed.votes.clear();
  auto held = tile.votes.begin();
  auto change = changes.begin();
  while (held != tile.votes.end() || change != changes.end()) {
    if (change == changes.end() || (held != tile.votes.end() && Before(*held, *change))) {
      changed.votes.push_back(*held++);
      continue;
    }
    ClassVotes vote{change->patch, change->class_id, 0};
    std::int64_t count = 0;
    if (held != tile.votes.end() && !Before(*change, *held)) {
      if (held->count == kSaturated) return std::nullopt;
      count = held++->count;
    }
    for (; change != changes.end() && !Before(vote, *change); ++change) count += change->count;
    if (count < 0 || count >= kSaturated) return std::nullopt;
    vote.count = static_cast<std::uint32_t>(count);
    if (count > 0) changed.votes.push_back(vote);
  }
  changed.votes.shrink_to_fit();
  return changed;
}

}  // namespace strata
