#include "core/world/things/inferred_tile.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <memory>
#include <span>
#include <utility>
#include <vector>

#include "absl/strings/string_view.h"

#include "core/common/checksum.h"

namespace strata {
namespace {

// REQUIRES: by (cell, height).
std::vector<InferredSpan> SpansOf(const std::vector<std::pair<std::uint16_t, float>>& heights) {
  std::vector<InferredSpan> spans;
  for (const auto& [cell, z] : heights) {
    if (!spans.empty() && spans.back().cell == cell &&
        z - spans.back().high_m <= kInferredSpanGapM) {
      spans.back().high_m = z;
    } else {
      spans.push_back({cell, z, z});
    }
  }
  spans.shrink_to_fit();
  return spans;
}

std::uint64_t VersionOf(const std::vector<InferredSpan>& spans) {
  std::vector<float> numbers;  // spans have bytes that nobody sets
  numbers.reserve(3 * spans.size());
  for (const InferredSpan& span : spans) {
    numbers.insert(numbers.end(), {static_cast<float>(span.cell), span.low_m, span.high_m});
  }
  return Checksum64(absl::string_view(reinterpret_cast<const char*>(numbers.data()),
                                      numbers.size() * sizeof(float)));
}

}  // namespace

std::span<const InferredSpan> InferredTile::Cells(std::uint32_t begin, std::uint32_t end) const {
  const auto before = [](const InferredSpan& span, std::uint32_t cell) { return span.cell < cell; };
  const auto first = std::lower_bound(spans.begin(), spans.end(), begin, before);
  return {first, std::lower_bound(first, spans.end(), end, before)};
}

void InferredTileMaker::Add(std::span<const Eigen::Vector3d> points) {
  for (const Eigen::Vector3d& p : points) {
    const Eigen::Vector2d at = (p.head<2>() / cell_size_m_).array().floor();
    if (!p.allFinite() || at.cwiseAbs().maxCoeff() >= kMaxCellIndex) continue;
    const CellIndex cell{static_cast<std::int32_t>(at.x()), static_cast<std::int32_t>(at.y())};
    heights_[TileOfCell(cell)].emplace_back(CellInTile(cell), static_cast<float>(p.z()));
  }
}

InferredTileMap InferredTileMaker::Finish() {
  InferredTileMap tiles;
  for (auto& [key, heights] : heights_) {
    std::sort(heights.begin(), heights.end());
    auto tile = std::make_shared<InferredTile>();
    tile->key = key;
    tile->spans = SpansOf(heights);
    tile->version = VersionOf(tile->spans);
    tiles.emplace(key, std::move(tile));
    heights = {};
  }
  heights_.clear();
  return tiles;
}

}  // namespace strata
