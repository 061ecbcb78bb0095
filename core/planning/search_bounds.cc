#include "core/planning/search_bounds.h"

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <utility>

#include "core/planning/landmarks.h"
#include "core/planning/search_space.h"

namespace strata {
namespace {

std::uint32_t Cost(SearchSpace& space, const Landmarks& landmarks, PatchId patch, int l) {
  const SearchSpace::Slot& slot = space.SlotOfPatch(patch);
  const std::uint32_t number = slot.tile->standing.Number(patch - slot.base);
  return landmarks.Tile(slot.key)[std::size_t{slot.size} * l + number];
}

}  // namespace

LandmarkBound::LandmarkBound(SearchSpace& space,
                             const Landmarks& landmarks,
                             PatchId start,
                             PatchId goal)
    : octile_{space.CellOfPatch(goal)}, landmarks_(landmarks) {
  std::array<std::pair<std::uint32_t, int>, kMaxLandmarks> order;  // bound at the start, landmark
  for (int l = 0; l < landmarks.count(); ++l) {
    order[l] = {Apart(Cost(space, landmarks, start, l), Cost(space, landmarks, goal, l)), l};
  }
  std::sort(order.begin(), order.begin() + landmarks.count(), std::greater<>());
  for (int i = 0; i < kAsked; ++i) {
    asked_[i] = order[std::min(i, landmarks.count() - 1)].second;
    goal_costs_[i] = Cost(space, landmarks, goal, asked_[i]);
  }
}

bool LandmarkBound::Measured(SearchSpace& space, const Landmarks& landmarks, PatchId patch) {
  return landmarks.Tile(space.slots()[space.SlotOf(patch)].key) != nullptr &&
         Cost(space, landmarks, patch, 0) != Landmarks::kUnreached;
}

}  // namespace strata
