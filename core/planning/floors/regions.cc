#include "core/planning/floors/regions.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numeric>
#include <tuple>
#include <utility>

#include "absl/status/status.h"

#include "core/common/hash_map.h"
#include "core/common/status.h"
#include "core/world/floor.h"

namespace strata {
namespace {

constexpr std::size_t kStopInterval = 4096;
constexpr std::size_t kMaxOverlaps = 20'000'000;  // pairs of pieces above each other

class Joiner {
 public:
  explicit Joiner(const std::vector<Piece>& pieces)
      : pieces_(pieces), parent_(pieces.size()), size_(pieces.size(), 1) {
    std::iota(parent_.begin(), parent_.end(), 0U);
  }

  // Notes which pieces lie above each other: they are of one block.
  absl::Status FindOverlaps(const Stop& stop) {
    std::size_t count = 0;
    for (std::size_t begin = 0, end = 0; begin < pieces_.size(); begin = end) {
      while (end < pieces_.size() && pieces_[end].block_x == pieces_[begin].block_x &&
             pieces_[end].block_y == pieces_[begin].block_y) {
        ++end;
      }
      STRATA_RETURN_IF_ERROR(stop.status());
      for (std::size_t a = begin; a < end; ++a) {
        for (std::size_t b = a + 1; b < end; ++b) {
          if ((pieces_[a].cells & pieces_[b].cells) == 0) continue;
          if (++count > kMaxOverlaps) {
            return absl::ResourceExhaustedError("too many surfaces to stand on above each other");
          }
          overlaps_[static_cast<std::uint32_t>(a)].insert(static_cast<std::uint32_t>(b));
          overlaps_[static_cast<std::uint32_t>(b)].insert(static_cast<std::uint32_t>(a));
        }
      }
    }
    return absl::OkStatus();
  }

  std::uint32_t Root(std::uint32_t piece) {
    while (parent_[piece] != piece) piece = parent_[piece] = parent_[parent_[piece]];
    return piece;
  }

  void JoinUnlessAbove(std::uint32_t a, std::uint32_t b) {
    a = Root(a);
    b = Root(b);
    if (a == b) return;
    const auto of_a = overlaps_.find(a);
    if (of_a != overlaps_.end() && of_a->second.count(b) != 0) return;
    if (std::make_pair(Overlaps(a), size_[a]) < std::make_pair(Overlaps(b), size_[b])) {
      std::swap(a, b);
    }
    parent_[b] = a;
    size_[a] += size_[b];
    const auto of_b = overlaps_.find(b);
    if (of_b == overlaps_.end()) return;
    const HashSet<std::uint32_t> moved = std::move(of_b->second);
    overlaps_.erase(of_b);
    for (const std::uint32_t other : moved) {
      overlaps_[other].erase(b);
      overlaps_[other].insert(a);
      overlaps_[a].insert(other);
    }
  }

 private:
  std::size_t Overlaps(std::uint32_t region) const {
    const auto found = overlaps_.find(region);
    return found == overlaps_.end() ? 0 : found->second.size();
  }

  const std::vector<Piece>& pieces_;
  std::vector<std::uint32_t> parent_;
  std::vector<std::uint32_t> size_;
  HashMap<std::uint32_t, HashSet<std::uint32_t>> overlaps_;  // between regions, by their roots
};

}  // namespace

double SlopeAcross(const Piece& a, const Piece& b, double cell_size_m) {
  const double dx = (a.block_x - b.block_x) * double{kFloorBlockCells} + a.mean_x - b.mean_x;
  const double dy = (a.block_y - b.block_y) * double{kFloorBlockCells} + a.mean_y - b.mean_y;
  const double run_m = std::max(1.0, std::hypot(dx, dy)) * cell_size_m;
  return std::abs(double{a.mean_z} - b.mean_z) / run_m;
}

absl::StatusOr<std::vector<std::uint32_t>> JoinPieces(const Pieces& cut,
                                                      double cell_size_m,
                                                      const Stop& stop) {
  const std::vector<Piece>& pieces = cut.pieces;
  Joiner joiner(pieces);
  STRATA_RETURN_IF_ERROR(joiner.FindOverlaps(stop));
  std::vector<std::pair<float, std::uint32_t>> order;  // slope and number of a border
  order.reserve(cut.borders.size());
  for (std::uint32_t i = 0; i < cut.borders.size(); ++i) {
    const Border& border = cut.borders[i];
    order.emplace_back(
        static_cast<float>(SlopeAcross(pieces[border.a], pieces[border.b], cell_size_m)), i);
  }
  std::sort(order.begin(), order.end());
  for (std::size_t i = 0; i < order.size(); ++i) {
    if (i % kStopInterval == 0) STRATA_RETURN_IF_ERROR(stop.status());
    const Border& border = cut.borders[order[i].second];
    joiner.JoinUnlessAbove(border.a, border.b);
  }
  std::vector<std::uint32_t> first(pieces.size(), 0xFFFFFFFFU);  // of each root
  std::vector<std::uint32_t> region(pieces.size());
  for (std::uint32_t i = 0; i < pieces.size(); ++i) {
    std::uint32_t& of_root = first[joiner.Root(i)];
    of_root = std::min(of_root, i);
    region[i] = of_root;
  }
  return region;
}

}  // namespace strata
