#include "client/formats/grid/octree_writer.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <utility>
#include <vector>

#include "absl/strings/str_format.h"

#include "core/mesh/voxel_blocks.h"

namespace strata {
namespace {

// What two bits say of a child: an Occupancy, or that it has children itself.
constexpr int kDivided = 3;

constexpr int kLevels = 16;  // of OctoMap
constexpr int kLevelsOfBlocks = kLevels - 3;

// The ways down the octree to a block, three bits a level, x the lowest: blocks in this order are
// in the file's.
std::uint64_t WayTo(const BlockKey& key) {
  constexpr int kShift = 1 << (kLevelsOfBlocks - 1);  // OctoMap counts from the corner
  std::uint64_t way = 0;
  for (int bit = kLevelsOfBlocks - 1; bit >= 0; --bit) {
    const auto of = [bit](std::int32_t at) {
      return static_cast<std::uint64_t>(at + kShift) >> bit & 1U;
    };
    way = way << 3 | of(key.z) << 2 | of(key.y) << 1 | of(key.x);
  }
  return way;
}

class BtWriter {
 public:
  BtWriter(const OccupancyVoxels& grid, bool with_free) : grid_(grid), with_free_(with_free) {
    for (std::size_t i = 0; i < grid.keys().size(); ++i) {
      blocks_.emplace_back(WayTo(grid.keys()[i]), i);
    }
    std::sort(blocks_.begin(), blocks_.end());
  }

  OctreeFile Write() {
    const bool any = Above(blocks_.begin(), blocks_.end(), 0) == kDivided;
    OctreeFile file;
    file.nodes = any ? nodes_ + 1 : 0;
    file.bytes =
        absl::StrFormat("# Octomap OcTree binary file\nid OcTree\nsize %d\nres %.15g\ndata\n",
                        file.nodes,
                        grid_.voxel_m()) +
        data_;
    const double voxel_m3 = std::pow(grid_.voxel_m(), 3);
    file.free_m3 = voxel_m3 * static_cast<double>(free_);
    file.occupied_m3 = voxel_m3 * static_cast<double>(occupied_);
    return file;
  }

 private:
  using Blocks = std::vector<std::pair<std::uint64_t, std::size_t>>;
  using Place = Blocks::const_iterator;

  // A node whose children are what `child` says of each; what is to be said of it.
  template <typename Child>
  int Node(const Child& child) {
    const std::size_t place = data_.size();
    data_.append(2, '\0');
    std::array<int, 8> kinds{};
    for (int i = 0; i < 8; ++i) kinds[i] = child(i);
    const bool alike = std::count(kinds.begin(), kinds.end(), kinds[0]) == 8;
    if (alike && kinds[0] != kDivided) {
      data_.resize(place);
      return kinds[0];
    }
    for (int i = 0; i < 8; ++i) {
      data_[place + i / 4] = static_cast<char>(data_[place + i / 4] | kinds[i] << 2 * (i % 4));
      nodes_ += kinds[i] != 0;
    }
    return kDivided;
  }

  // A node `level` below the root, over some blocks.
  int Above(Place begin, Place end, int level) {
    if (begin == end) return static_cast<int>(Occupancy::kUnknown);
    if (level == kLevelsOfBlocks) {
      block_ = grid_.block(begin->second);
      if (!with_free_) {
        std::replace(block_.begin(), block_.end(), Occupancy::kFree, Occupancy::kUnknown);
      }
      free_ += std::count(block_.begin(), block_.end(), Occupancy::kFree);
      occupied_ += std::count(block_.begin(), block_.end(), Occupancy::kOccupied);
      return Within({0, 0, 0}, kBlockEdge);
    }
    const int shift = 3 * (kLevelsOfBlocks - 1 - level);
    return Node([&](int i) {
      const Place first = begin;
      begin = std::find_if(begin, end, [&](const auto& block) {
        return (block.first >> shift & 7U) != static_cast<std::uint64_t>(i);
      });
      return Above(first, begin, level + 1);
    });
  }

  // A cube of voxels of the block at hand.
  int Within(const Eigen::Vector3i& at, int edge) {
    if (edge == 1) return static_cast<int>(block_[NodeInBlock(at)]);
    const int half = edge / 2;
    return Node([&](int i) {
      return Within(at + half * Eigen::Vector3i(i & 1, i >> 1 & 1, i >> 2), half);
    });
  }

  const OccupancyVoxels& grid_;
  const bool with_free_;
  Blocks blocks_;  // in the file's order
  OccupancyBlock block_{};
  std::string data_;
  std::size_t nodes_ = 0;
  std::ptrdiff_t free_ = 0;
  std::ptrdiff_t occupied_ = 0;
};

}  // namespace

OctreeFile BtFile(const OccupancyVoxels& grid, bool with_free) {
  return BtWriter(grid, with_free).Write();
}

}  // namespace strata
