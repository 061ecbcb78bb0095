#include "core/classification/places/places.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <map>
#include <set>
#include <utility>

#include "core/classification/places/place_features.h"
#include "core/classification/places/place_model.h"
#include "core/common/disjoint_sets.h"
#include "core/common/status.h"

namespace strata {
namespace {

constexpr double kLeastPlaceM2 = 1.0;  // but doorways

// Samples of one kind that hang together: the first of them, for each.
std::vector<std::uint32_t> Joined(const std::vector<PlaceKind>& kinds,
                                  std::span<const NetworkEdge> edges) {
  DisjointSets sets;
  for (const NetworkEdge& edge : edges) {
    if (kinds[edge.i] == kinds[edge.j]) sets.Join(edge.i, edge.j);
  }
  std::vector<std::uint32_t> first(kinds.size());
  for (std::size_t i = 0; i < kinds.size(); ++i) {
    first[i] = static_cast<std::uint32_t>(sets.Root(i));
  }
  return first;
}

// How many free cells the square of each sample has.
std::vector<std::uint32_t> FreeCells(const FreeSpace& space, const PlaceSamples& samples) {
  std::vector<std::uint32_t> count(samples.size(), 0);
  for (int row = 0; row < space.rows(); ++row) {
    for (int column = 0; column < space.columns(); ++column) {
      if (space.cells()[space.Index(column, row)] == kOpenFree) {
        ++count[samples.SampleOf(column, row)];
      }
    }
  }
  return count;
}

// Gives what is too small for a room or a corridor the kind of what it touches most, the smallest
// first; of equals the first kind.
void TakeInSmall(std::span<const NetworkEdge> edges,
                 const std::vector<std::uint32_t>& free_cells,
                 double least_cells,
                 std::vector<PlaceKind>& kinds) {
  const std::vector<std::uint32_t> joined = Joined(kinds, edges);
  std::map<std::uint32_t, double> cells;
  for (std::size_t i = 0; i < joined.size(); ++i) cells[joined[i]] += free_cells[i];
  std::map<std::uint32_t, std::map<PlaceKind, int>> touched;
  for (const NetworkEdge& edge : edges) {
    const std::uint32_t a = joined[edge.i];
    const std::uint32_t b = joined[edge.j];
    if (a == b) continue;
    if (cells[a] < least_cells && cells[b] >= least_cells) ++touched[a][kinds[edge.j]];
    if (cells[b] < least_cells && cells[a] >= least_cells) ++touched[b][kinds[edge.i]];
  }
  for (std::size_t i = 0; i < joined.size(); ++i) {
    if (kinds[i] == PlaceKind::kDoorway) continue;
    const auto found = touched.find(joined[i]);
    if (found == touched.end()) continue;
    kinds[i] = std::max_element(found->second.begin(),
                                found->second.end(),
                                [](const auto& a, const auto& b) { return a.second < b.second; })
                   ->first;
  }
}

// What is known of a place while its cells are gone through.
struct Sum {
  std::uint64_t cells = 0;
  Eigen::Vector2d total = Eigen::Vector2d::Zero();
  Eigen::Array2i low = Eigen::Array2i::Constant(std::numeric_limits<int>::max());
  Eigen::Array2i high = Eigen::Array2i::Constant(std::numeric_limits<int>::min());
  double nearest = std::numeric_limits<double>::max();
  Eigen::Vector2i middle = Eigen::Vector2i::Zero();
};

class PlaceList {
 public:
  PlaceList(const FreeSpace& space, const PlaceSamples& samples, std::vector<PlaceKind> kinds)
      : space_(space), samples_(samples), kinds_(std::move(kinds)), edges_(samples.Edges()) {}

  absl::StatusOr<std::vector<Place>> Make(bool cells, const Stop& stop) {
    const double cell_m2 = space_.cell_m() * space_.cell_m();
    TakeInSmall(edges_, FreeCells(space_, samples_), kLeastPlaceM2 / cell_m2, kinds_);
    STRATA_RETURN_IF_ERROR(stop.status());
    Number();
    STRATA_RETURN_IF_ERROR(stop.status());
    std::vector<Place> places = Describe();
    STRATA_RETURN_IF_ERROR(stop.status());
    if (cells) FillBlocks(places);
    return places;
  }

 private:
  template <typename Use>
  void ForEachCell(const Use& use) const {
    for (int row = 0; row < space_.rows(); ++row) {
      for (int column = 0; column < space_.columns(); ++column) {
        if (space_.cells()[space_.Index(column, row)] != kOpenFree) continue;
        use(column, row, place_of_[samples_.SampleOf(column, row)]);
      }
    }
  }

  // place_of_ and sums_: the largest place first, then by its first sample.
  void Number() {
    const std::vector<std::uint32_t> joined = Joined(kinds_, edges_);
    place_of_ = joined;
    sums_.assign(joined.size(), {});
    ForEachCell([&](int column, int row, std::uint32_t first) {
      Sum& sum = sums_[first];
      ++sum.cells;
      sum.total += Eigen::Vector2d(column, row);
      sum.low = sum.low.min(Eigen::Array2i(column, row));
      sum.high = sum.high.max(Eigen::Array2i(column, row));
    });
    for (std::uint32_t i = 0; i < joined.size(); ++i) {
      if (joined[i] == i) order_.push_back(i);
    }
    std::stable_sort(order_.begin(), order_.end(), [&](std::uint32_t a, std::uint32_t b) {
      return sums_[a].cells > sums_[b].cells;
    });
    std::vector<std::uint32_t> number(joined.size(), 0);
    for (std::uint32_t k = 0; k < order_.size(); ++k) number[order_[k]] = k;
    for (std::uint32_t& place : place_of_) place = number[place];
  }

  Eigen::Vector2d At(const Eigen::Vector2d& cell) const {
    return space_.min_m() + space_.cell_m() * cell;
  }

  std::vector<Place> Describe() {
    ForEachCell([&](int column, int row, std::uint32_t number) {
      Sum& sum = sums_[order_[number]];
      const Eigen::Vector2d mean = sum.total / static_cast<double>(sum.cells);
      const double off = (Eigen::Vector2d(column, row) - mean).squaredNorm();
      if (off >= sum.nearest) return;
      sum.nearest = off;
      sum.middle = {column, row};
    });
    std::vector<Place> places;
    places.reserve(order_.size());
    for (const std::uint32_t first : order_) {
      const Sum& sum = sums_[first];
      Place& place = places.emplace_back();
      place.kind = kinds_[first];
      place.area_m2 = static_cast<double>(sum.cells) * space_.cell_m() * space_.cell_m();
      place.low = At(sum.low.matrix().cast<double>());
      place.high = At((sum.high + 1).matrix().cast<double>());
      place.middle = At(sum.middle.cast<double>() + Eigen::Vector2d(0.5, 0.5));
    }
    AddNeighbours(places);
    return places;
  }

  void AddNeighbours(std::vector<Place>& places) const {
    std::set<std::pair<std::uint32_t, std::uint32_t>> touching;
    for (const NetworkEdge& edge : edges_) {
      const std::uint32_t a = place_of_[edge.i];
      const std::uint32_t b = place_of_[edge.j];
      if (a == b) continue;
      touching.insert({a, b});
      touching.insert({b, a});
    }
    for (const auto& [a, b] : touching) places[a].neighbours.push_back(static_cast<int>(b));
  }

  void FillBlocks(std::vector<Place>& places) const {
    const auto first_x = static_cast<std::int32_t>(
        std::lround(space_.min_m().x() / space_.cell_m()) / kFloorBlockCells);
    const auto first_y = static_cast<std::int32_t>(
        std::lround(space_.min_m().y() / space_.cell_m()) / kFloorBlockCells);
    for (int y = 0; y < space_.rows() / kFloorBlockCells; ++y) {
      for (int x = 0; x < space_.columns() / kFloorBlockCells; ++x) {
        std::map<std::uint32_t, std::uint64_t> cells;
        for (int bit = 0; bit < kFloorBlockCells * kFloorBlockCells; ++bit) {
          const int column = x * kFloorBlockCells + bit % kFloorBlockCells;
          const int row = y * kFloorBlockCells + bit / kFloorBlockCells;
          if (space_.cells()[space_.Index(column, row)] != kOpenFree) continue;
          cells[place_of_[samples_.SampleOf(column, row)]] |= std::uint64_t{1} << bit;
        }
        for (const auto& [number, mask] : cells) {
          places[number].blocks.push_back({first_x + x, first_y + y, mask});
        }
      }
    }
  }

  const FreeSpace& space_;
  const PlaceSamples& samples_;
  std::vector<PlaceKind> kinds_;  // of every sample
  const std::vector<NetworkEdge> edges_;
  std::vector<std::uint32_t> place_of_;  // of every sample
  std::vector<Sum> sums_;                // by the first sample of a place
  std::vector<std::uint32_t> order_;     // the first sample of every place
};

}  // namespace

absl::StatusOr<std::vector<Place>> FindPlaces(std::span<const FloorBlock> blocks,
                                              double cell_size_m,
                                              bool cells,
                                              const Stop& stop) {
  STRATA_RETURN_IF_ERROR(stop.status());
  STRATA_ASSIGN_OR_RETURN(const FreeSpace space, OpenSpace(blocks, cell_size_m));
  STRATA_ASSIGN_OR_RETURN(const PlaceSamples samples, PlaceSamples::Of(space));
  STRATA_ASSIGN_OR_RETURN(std::vector<PlaceKind> kinds,
                          NamePlaces(LearnedPlaceModel(), space, samples, stop));
  return PlaceList(space, samples, std::move(kinds)).Make(cells, stop);
}

}  // namespace strata
