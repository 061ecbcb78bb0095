// What was inferred of things, cell by cell, for whoever is to be kept out of it. Beside the tiles
// of what was measured, never part of them.
#ifndef STRATA_CORE_WORLD_THINGS_INFERRED_TILE_H_
#define STRATA_CORE_WORLD_THINGS_INFERRED_TILE_H_

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <utility>
#include <vector>

#include "absl/container/btree_map.h"
#include <Eigen/Core>

#include "core/mls/tile_key.h"

namespace strata {

// Places above each other in one cell, none farther than kInferredSpanGapM from the next [m].
struct InferredSpan {
  std::uint16_t cell = 0;  // CellInTile
  float low_m = 0.0F;
  float high_m = 0.0F;

  friend bool operator==(const InferredSpan&, const InferredSpan&) = default;
};

// Shapes of kinds are voxels of 5 cm or so: what is nearer is one surface.
inline constexpr float kInferredSpanGapM = 0.1F;

struct InferredTile {
  TileKey key;                      // of level 0
  std::uint64_t version = 0;        // of the content: tiles of a key with equal ones are equal
  std::vector<InferredSpan> spans;  // by (cell, low_m)

  // Of the cells [begin, end).
  std::span<const InferredSpan> Cells(std::uint32_t begin, std::uint32_t end) const;
  std::size_t memory_bytes() const {
    return sizeof(InferredTile) + spans.capacity() * sizeof(InferredSpan);
  }
};

using InferredTileMap = absl::btree_map<TileKey, std::shared_ptr<const InferredTile>>;

// Makes tiles of points.
class InferredTileMaker {
 public:
  explicit InferredTileMaker(double cell_size_m) : cell_size_m_(cell_size_m) {}

  // In the map frame. Points beyond the map's range are left out.
  void Add(std::span<const Eigen::Vector3d> points);
  // Of all points; the same in whatever order they came.
  InferredTileMap Finish();

 private:
  double cell_size_m_;
  absl::btree_map<TileKey, std::vector<std::pair<std::uint16_t, float>>> heights_;
};

}  // namespace strata

#endif  // STRATA_CORE_WORLD_THINGS_INFERRED_TILE_H_
