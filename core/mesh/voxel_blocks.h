// A grid that has nodes only where something is: cubes of 8 × 8 × 8 nodes, found by their place.
#ifndef STRATA_CORE_MESH_VOXEL_BLOCKS_H_
#define STRATA_CORE_MESH_VOXEL_BLOCKS_H_

#include <algorithm>
#include <array>
#include <compare>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <utility>
#include <vector>

#include <Eigen/Core>

#include "core/common/hash_map.h"

namespace strata {

inline constexpr int kBlockEdge = 8;
inline constexpr std::size_t kBlockNodes = 512;

// Nodes [8·key, 8·key + 8) along each axis; or a place in another grid.
struct BlockKey {
  std::int32_t x = 0, y = 0, z = 0;

  friend auto operator<=>(const BlockKey&, const BlockKey&) = default;
  template <typename H>
  friend H AbslHashValue(H h, const BlockKey& key) {
    return H::combine(std::move(h), key.x, key.y, key.z);
  }
};

// Blocks [low, high) along each axis.
struct BlockBox {
  BlockKey low, high;

  bool Contains(const BlockKey& key) const {
    return key.x >= low.x && key.y >= low.y && key.z >= low.z && key.x < high.x && key.y < high.y &&
           key.z < high.z;
  }
};

inline BlockKey BlockOf(const Eigen::Vector3i& node) {
  return {node.x() >> 3, node.y() >> 3, node.z() >> 3};
}
inline std::size_t NodeInBlock(const Eigen::Vector3i& node) {
  return static_cast<std::size_t>((node.z() & 7) << 6 | (node.y() & 7) << 3 | (node.x() & 7));
}

// Where the nodes are: node n at origin + spacing · n.
struct NodeGrid {
  Eigen::Vector3d origin = Eigen::Vector3d::Zero();
  double spacing_m = 1.0;

  Eigen::Vector3d InNodes(const Eigen::Vector3d& point) const {
    return (point - origin) / spacing_m;
  }
};

// Coordinates beyond are not represented: half of what 32 bits hold.
inline constexpr double kMostNodes = 1e9;

// Not thread-safe, reading neither: the block found last is remembered.
template <typename Node>
class VoxelBlocks {
 public:
  using Block = std::array<Node, kBlockNodes>;

  VoxelBlocks() = default;
  VoxelBlocks(const VoxelBlocks& other)
      : index_(other.index_), keys_(other.keys_), blocks_(other.blocks_) {}
  VoxelBlocks(VoxelBlocks&&) = default;
  VoxelBlocks& operator=(VoxelBlocks&&) = default;
  VoxelBlocks& operator=(const VoxelBlocks&) = delete;
  ~VoxelBlocks() = default;

  std::size_t size() const { return keys_.size(); }
  // In the order in which they were made.
  const std::vector<BlockKey>& keys() const { return keys_; }
  const Block& block(std::size_t i) const { return blocks_[i]; }

  Block* Find(const BlockKey& key) {
    if (last_ != nullptr && key == last_key_) return last_;
    const auto it = index_.find(key);
    if (it == index_.end()) return nullptr;
    last_key_ = key;
    return last_ = &blocks_[it->second];
  }
  // The same for many threads at a time, while nobody adds blocks.
  const Block* Peek(const BlockKey& key) const {
    const auto it = index_.find(key);
    return it == index_.end() ? nullptr : &blocks_[it->second];
  }
  Block& FindOrAdd(const BlockKey& key) {
    if (Block* const found = Find(key)) return *found;
    index_.emplace(key, static_cast<std::uint32_t>(keys_.size()));
    keys_.push_back(key);
    blocks_.emplace_back();
    last_key_ = key;
    return *(last_ = &blocks_.back());
  }

  template <typename Change>
  void ForEach(const Change& change) {
    for (Block& block : blocks_) std::for_each(block.begin(), block.end(), change);
  }

  // What they occupy, roughly.
  std::size_t bytes() const { return size() * (sizeof(Block) + 80); }

 private:
  HashMap<BlockKey, std::uint32_t> index_;
  std::vector<BlockKey> keys_;
  std::deque<Block> blocks_;
  BlockKey last_key_;
  Block* last_ = nullptr;  // of blocks_
};

}  // namespace strata

#endif  // STRATA_CORE_MESH_VOXEL_BLOCKS_H_
