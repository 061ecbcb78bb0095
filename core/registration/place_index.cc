#include "core/registration/place_index.h"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

#include "absl/functional/function_ref.h"
#include <Eigen/Core>

namespace strata {
namespace {

constexpr std::size_t kInvariant =
    static_cast<std::size_t>(PlaceDescriptor::kWaves * PlaceDescriptor::kHarmonics);
// Spectra compared for an answer of `count`: the invariant part ranks the right place among them.
constexpr std::size_t kComparedAtLeast = 50;
constexpr std::size_t kComparedFactor = 4;

using Invariant = Eigen::Map<const Eigen::Matrix<float, static_cast<int>(kInvariant), 1>>;

}  // namespace

void PlaceIndex::Add(std::uint64_t number, const PlaceDescriptor& descriptor) {
  const auto [entry, is_new] = index_of_.try_emplace(number, places_.size());
  if (is_new) {
    places_.emplace_back();
    invariants_.resize(places_.size() * kInvariant);
  }
  places_[entry->second] = {number, descriptor};
  const std::vector<float> invariant = InvariantOf(descriptor);
  std::copy(invariant.begin(),
            invariant.end(),
            invariants_.begin() + static_cast<std::ptrdiff_t>(entry->second * kInvariant));
}

const PlaceDescriptor* PlaceIndex::Find(std::uint64_t number) const {
  const auto entry = index_of_.find(number);
  return entry == index_of_.end() ? nullptr : &places_[entry->second].descriptor;
}

bool PlaceIndex::Remove(std::uint64_t number) {
  const auto entry = index_of_.find(number);
  if (entry == index_of_.end()) return false;
  const std::size_t hole = entry->second;
  const std::size_t last = places_.size() - 1;
  if (hole != last) {
    places_[hole] = places_[last];
    std::copy_n(&invariants_[last * kInvariant], kInvariant, &invariants_[hole * kInvariant]);
    index_of_[places_[hole].number] = hole;
  }
  places_.pop_back();
  invariants_.resize(places_.size() * kInvariant);
  index_of_.erase(entry);
  return true;
}

std::vector<PlaceIndex::Neighbour> PlaceIndex::Nearest(
    const PlaceDescriptor& descriptor,
    std::size_t count,
    absl::FunctionRef<bool(std::uint64_t)> excluded) const {
  if (descriptor.empty() || count == 0) return {};
  const std::vector<float> own = InvariantOf(descriptor);
  const Invariant wanted(own.data());
  std::vector<std::pair<float, std::uint64_t>> ranked;  // (−likeness, number)
  for (std::size_t i = 0; i < places_.size(); ++i) {
    if (excluded(places_[i].number) || places_[i].descriptor.empty()) continue;
    const float likeness = Invariant(&invariants_[i * kInvariant]).dot(wanted);
    ranked.emplace_back(-likeness, places_[i].number);
  }
  const std::size_t compared =
      std::min(ranked.size(), std::max(kComparedAtLeast, kComparedFactor * count));
  std::partial_sort(
      ranked.begin(), ranked.begin() + static_cast<std::ptrdiff_t>(compared), ranked.end());
  std::vector<Neighbour> nearest;
  for (std::size_t i = 0; i < compared; ++i) {
    const Place& place = places_[index_of_.at(ranked[i].second)];
    nearest.push_back({place.number, ComparePlaces(place.descriptor, descriptor)});
  }
  std::sort(nearest.begin(), nearest.end(), [](const Neighbour& a, const Neighbour& b) {
    return std::pair(a.similarity.distance, a.number) < std::pair(b.similarity.distance, b.number);
  });
  nearest.resize(std::min(nearest.size(), count));
  return nearest;
}

}  // namespace strata
