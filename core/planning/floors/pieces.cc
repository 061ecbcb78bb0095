#include "core/planning/floors/pieces.h"

#include <algorithm>
#include <array>
#include <cstddef>
#include <limits>
#include <memory>
#include <tuple>
#include <utility>

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"

#include "core/common/hash_map.h"
#include "core/common/status.h"

namespace strata {
namespace {

constexpr std::uint32_t kNoPiece = std::numeric_limits<std::uint32_t>::max();

// A move that leaves its piece, known by its end until all pieces are.
struct Crossing {
  std::uint32_t piece = 0;
  PatchId to = kNoPatchId;
};

// One place to stand of the block that is cut.
struct Standing {
  std::uint32_t place = 0;
  std::array<PatchId, 8> to{};  // where its moves lead
  std::uint32_t piece = kNoPiece;
};

class Cutter {
 public:
  Cutter(SearchSpace& space, const Stop& stop) : space_(space), stop_(stop) {}

  absl::Status Cut(const TileKey& key) {
    std::vector<std::uint32_t>& piece_of = result_.piece_of.emplace_back();
    const int slot = space_.SlotOf(key);
    STRATA_RETURN_IF_ERROR(space_.status());
    if (slot < 0) return absl::OkStatus();
    index_of_slot_[slot] = result_.piece_of.size() - 1;
    const std::shared_ptr<const PreparedTile> tile = space_.At(slot).tile;
    base_ = space_.slots()[slot].base;
    patches_ += tile->standing.size();
    if (patches_ > kMaxFloorPatches) {
      return absl::ResourceExhaustedError(
          absl::StrCat("more than ", kMaxFloorPatches, " places to stand; ask a smaller map"));
    }
    piece_of.reserve(tile->standing.size());
    std::uint32_t block = 0;
    absl::Status status;
    tile->standing.ForEach([&](std::uint32_t place, std::uint32_t /*number*/) {
      const std::uint32_t own = tile->standing.OnFirstSheet(place) / 64;
      if (own != block && status.ok()) {
        status = CutBlock(*tile, block, piece_of);
        block = own;
      }
      block_.push_back({place, {}, kNoPiece});
    });
    STRATA_RETURN_IF_ERROR(status);
    return CutBlock(*tile, block, piece_of);
  }

  absl::StatusOr<Pieces> Finish() && {
    std::vector<std::pair<std::uint32_t, std::uint32_t>> pairs;
    pairs.reserve(crossings_.size());
    for (std::size_t i = 0; i < crossings_.size(); ++i) {
      if (i % kStopInterval == 0) STRATA_RETURN_IF_ERROR(stop_.status());
      const std::uint32_t to = PieceOf(crossings_[i].to);
      if (to == kNoPiece || to == crossings_[i].piece) continue;
      pairs.push_back(std::minmax(crossings_[i].piece, to));
    }
    STRATA_RETURN_IF_ERROR(space_.status());
    std::sort(pairs.begin(), pairs.end());
    for (const auto& [a, b] : pairs) {
      if (result_.borders.empty() || result_.borders.back().a != a ||
          result_.borders.back().b != b) {
        result_.borders.push_back({a, b, 0});
      }
      ++result_.borders.back().moves;
    }
    return std::move(result_);
  }

 private:
  static constexpr std::size_t kStopInterval = 4096;

  // Pieces of the places collected in block_, which is emptied.
  absl::Status CutBlock(const PreparedTile& tile,
                        std::uint32_t block,
                        std::vector<std::uint32_t>& piece_of) {
    STRATA_RETURN_IF_ERROR(stop_.status());
    for (Standing& standing : block_) {
      for (int direction = 0; direction < 8; ++direction) {
        std::uint32_t cost = 0;
        int cells = 0;
        standing.to[direction] =
            space_.FollowGround(base_ + standing.place, direction, &cost, &cells);
      }
    }
    STRATA_RETURN_IF_ERROR(space_.status());
    const std::uint32_t first = static_cast<std::uint32_t>(piece_of.size());
    for (std::uint32_t i = 0; i < block_.size(); ++i) {
      if (block_[i].piece == kNoPiece) Grow(tile, block, first, i);
    }
    for (const Standing& standing : block_) {
      piece_of.push_back(standing.piece);
      // The other four are the same moves the other way.
      for (int direction = 0; direction < 4; ++direction) {
        const PatchId to = standing.to[direction];
        if (to == kNoPatchId) continue;
        const std::uint32_t inside = InBlock(tile, first, to);
        if (inside != kNoPiece && block_[inside].piece == standing.piece) continue;
        crossings_.push_back({standing.piece, to});
      }
    }
    block_.clear();
    return absl::OkStatus();
  }

  void Grow(const PreparedTile& tile,
            std::uint32_t block,
            std::uint32_t first,
            std::uint32_t seed) {
    const auto number = static_cast<std::uint32_t>(result_.pieces.size());
    Piece& piece = result_.pieces.emplace_back();
    piece.block_x = tile.key.x * 32 + static_cast<std::int32_t>(block % 32);
    piece.block_y = tile.key.y * 32 + static_cast<std::int32_t>(block / 32);
    piece.low_z = std::numeric_limits<float>::max();
    piece.high_z = std::numeric_limits<float>::lowest();
    std::vector<std::uint32_t>& queue = queue_;
    queue.assign(1, seed);
    const auto take = [&](std::uint32_t i) {
      block_[i].piece = number;
      piece.cells |= std::uint64_t{1} << (block_[i].place % 64);
    };
    take(seed);
    double x = 0.0;
    double y = 0.0;
    double z = 0.0;
    for (std::size_t at = 0; at < queue.size(); ++at) {
      const Standing& standing = block_[queue[at]];
      const float height = tile.HeightOf(first + queue[at]);
      x += standing.place % 8 + 0.5;
      y += standing.place / 8 % 8 + 0.5;
      z += height;
      piece.low_z = std::min(piece.low_z, height);
      piece.high_z = std::max(piece.high_z, height);
      for (const PatchId to : standing.to) {
        if (to == kNoPatchId) continue;
        const std::uint32_t i = InBlock(tile, first, to);
        if (i == kNoPiece || block_[i].piece != kNoPiece) continue;
        if ((piece.cells >> (block_[i].place % 64) & 1U) == 0) {
          take(i);
          queue.push_back(i);
        }
      }
    }
    const auto count = static_cast<double>(queue.size());
    piece.count = static_cast<std::uint32_t>(queue.size());
    piece.mean_x = static_cast<float>(x / count);
    piece.mean_y = static_cast<float>(y / count);
    piece.mean_z = static_cast<float>(z / count);
  }

  // Which of block_ a patch is; kNoPiece if it is of another block.
  std::uint32_t InBlock(const PreparedTile& tile, std::uint32_t first, PatchId patch) const {
    if (patch < base_ || patch - base_ >= tile.standing.places()) return kNoPiece;
    const std::uint32_t number = tile.standing.Number(patch - base_);
    return number >= first && number - first < block_.size() ? number - first : kNoPiece;
  }

  std::uint32_t PieceOf(PatchId patch) {
    const int slot = space_.SlotOf(patch);
    const auto found = index_of_slot_.find(slot);
    if (found == index_of_slot_.end()) return kNoPiece;
    const SearchSpace::Slot& at = space_.At(slot);
    if (!at.tile->CanStand(patch - at.base)) return kNoPiece;
    return result_.piece_of[found->second][at.tile->standing.Number(patch - at.base)];
  }

  SearchSpace& space_;
  const Stop& stop_;
  PatchId base_ = 0;
  std::uint64_t patches_ = 0;
  std::vector<Standing> block_;
  std::vector<std::uint32_t> queue_;
  std::vector<Crossing> crossings_;
  HashMap<int, std::size_t> index_of_slot_;
  Pieces result_;
};

}  // namespace

absl::StatusOr<Pieces> CutIntoPieces(SearchSpace& space,
                                     const std::vector<TileKey>& tiles,
                                     const Stop& stop) {
  Cutter cutter(space, stop);
  for (const TileKey& tile : tiles) STRATA_RETURN_IF_ERROR(cutter.Cut(tile));
  return std::move(cutter).Finish();
}

}  // namespace strata
