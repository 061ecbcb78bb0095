#include "core/classification/places/place_features.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <numbers>

#include "absl/status/status.h"
#include "absl/strings/str_format.h"

#include "core/classification/places/range_scan_features.h"
#include "core/common/status.h"

namespace strata {
namespace {

constexpr std::uint32_t kSamplesAStop = 32;  // samples, some 2 ms

int FloorMod(std::int64_t value, int by) { return static_cast<int>(((value % by) + by) % by); }

// Blocks from `low` to `high`, both inside.
struct BlockBox {
  std::int64_t low_x = std::numeric_limits<std::int32_t>::max();
  std::int64_t low_y = std::numeric_limits<std::int32_t>::max();
  std::int64_t high_x = std::numeric_limits<std::int32_t>::min();
  std::int64_t high_y = std::numeric_limits<std::int32_t>::min();

  std::int64_t width() const { return (high_x - low_x + 1) * kFloorBlockCells; }
  std::int64_t height() const { return (high_y - low_y + 1) * kFloorBlockCells; }
};

BlockBox BoxOf(std::span<const FloorBlock> blocks) {
  BlockBox box;
  for (const FloorBlock& block : blocks) {
    box.low_x = std::min<std::int64_t>(box.low_x, block.x);
    box.low_y = std::min<std::int64_t>(box.low_y, block.y);
    box.high_x = std::max<std::int64_t>(box.high_x, block.x);
    box.high_y = std::max<std::int64_t>(box.high_y, block.y);
  }
  return box;
}

}  // namespace

absl::StatusOr<FreeSpace> OpenSpace(std::span<const FloorBlock> blocks, double cell_size_m) {
  if (blocks.empty()) return FreeSpace(Eigen::Vector2d::Zero(), cell_size_m, 0, 0);
  const BlockBox box = BoxOf(blocks);
  // Each side first: their product may be no 64-bit number.
  if (box.width() > kMaxPlaceBoxCells || box.height() > kMaxPlaceBoxCells ||
      box.width() * box.height() > kMaxPlaceBoxCells) {
    return absl::ResourceExhaustedError(
        absl::StrFormat("the floor is %.0f m × %.0f m, more than the %d cells of %g m that places "
                        "are looked for in; ask a map with larger cells, or a smaller one",
                        static_cast<double>(box.width()) * cell_size_m,
                        static_cast<double>(box.height()) * cell_size_m,
                        kMaxPlaceBoxCells,
                        cell_size_m));
  }
  const Eigen::Vector2d low(static_cast<double>(box.low_x), static_cast<double>(box.low_y));
  FreeSpace space(kFloorBlockCells * cell_size_m * low,
                  cell_size_m,
                  static_cast<int>(box.width()),
                  static_cast<int>(box.height()));
  for (const FloorBlock& block : blocks) {
    const int column = static_cast<int>(block.x - box.low_x) * kFloorBlockCells;
    const int row = static_cast<int>(block.y - box.low_y) * kFloorBlockCells;
    for (int cell = 0; cell < kFloorBlockCells * kFloorBlockCells; ++cell) {
      std::uint8_t& at =
          space.At(space.Index(column + cell % kFloorBlockCells, row + cell / kFloorBlockCells));
      if ((block.free >> cell & 1U) != 0) {
        at = kOpenFree;
      } else if ((block.ground >> cell & 1U) != 0) {
        at = kOpenGround;
      }
    }
  }
  return space;
}

absl::StatusOr<PlaceSamples> PlaceSamples::Of(const FreeSpace& space) {
  PlaceSamples samples;
  const double cell_m = space.cell_m();
  samples.side_ = std::max(1, static_cast<int>(std::lround(kPlaceSpacingM / cell_m)));
  const int side = samples.side_;
  samples.offset_ = {FloorMod(std::llround(space.min_m().x() / cell_m), side),
                     FloorMod(std::llround(space.min_m().y() / cell_m), side)};
  samples.columns_ =
      static_cast<std::size_t>((space.columns() + samples.offset_.x() + side - 1) / side);
  const auto rows =
      static_cast<std::size_t>((space.rows() + samples.offset_.y() + side - 1) / side);
  samples.sample_of_.assign(samples.columns_ * rows, kNone);
  for (std::size_t square = 0; square < samples.sample_of_.size(); ++square) {
    const int column = static_cast<int>(square % samples.columns_) * side - samples.offset_.x();
    const int row = static_cast<int>(square / samples.columns_) * side - samples.offset_.y();
    const Eigen::Vector2d middle(column + 0.5 * (side - 1), row + 0.5 * (side - 1));
    double nearest = std::numeric_limits<double>::max();
    Eigen::Vector2i best;
    for (int y = std::max(0, row); y < std::min(space.rows(), row + side); ++y) {
      for (int x = std::max(0, column); x < std::min(space.columns(), column + side); ++x) {
        if (space.cells()[space.Index(x, y)] != kOpenFree) continue;
        const double off = (Eigen::Vector2d(x, y) - middle).squaredNorm();
        if (off >= nearest) continue;
        nearest = off;
        best = {x, y};
      }
    }
    if (nearest == std::numeric_limits<double>::max()) continue;
    if (samples.size() == kMaxPlaceSamples) {
      return absl::ResourceExhaustedError(
          absl::StrFormat("the floor has more than %d squares of %.2f m to stand in, which is "
                          "what places are looked for in at most; ask a smaller map",
                          kMaxPlaceSamples,
                          side * cell_m));
    }
    samples.sample_of_[square] = samples.size();
    samples.cells_.push_back(best);
  }
  return samples;
}

std::vector<NetworkEdge> PlaceSamples::Edges() const {
  std::vector<NetworkEdge> edges;
  for (std::size_t square = 0; square < sample_of_.size(); ++square) {
    const std::uint32_t i = sample_of_[square];
    if (i == kNone) continue;
    const bool last = (square + 1) % columns_ == 0;
    if (!last && sample_of_[square + 1] != kNone) edges.push_back({i, sample_of_[square + 1]});
    const std::size_t above = square + columns_;
    if (above < sample_of_.size() && sample_of_[above] != kNone) {
      edges.push_back({i, sample_of_[above]});
    }
  }
  return edges;
}

absl::StatusOr<FeatureMatrix> PlaceFeatures(const FreeSpace& space,
                                            const PlaceSamples& samples,
                                            std::span<const std::uint32_t> columns,
                                            const Stop& stop) {
  const RangeScanFeatures features(kPlaceBeams);
  std::vector<float> ranges(kPlaceBeams);
  FeatureMatrix matrix;
  for (std::uint32_t i = 0; i < samples.size(); ++i) {
    if (i % kSamplesAStop == 0) STRATA_RETURN_IF_ERROR(stop.status());
    const Eigen::Vector2d from = space.min_m() + space.cell_m() * (samples.cell(i).cast<double>() +
                                                                   Eigen::Vector2d(0.5, 0.5));
    for (int k = 0; k < kPlaceBeams; ++k) {
      ranges[static_cast<std::size_t>(k)] = static_cast<float>(
          space.Cast(from, 2.0 * std::numbers::pi * k / kPlaceBeams, kPlaceReachM));
    }
    const std::vector<float> all = features.Of(ranges);
    const std::size_t width = columns.empty() ? all.size() : columns.size();
    if (i == 0) matrix.resize(samples.size(), static_cast<Eigen::Index>(width));
    for (std::size_t c = 0; c < width; ++c) {
      matrix(i, static_cast<Eigen::Index>(c)) = columns.empty() ? all[c] : all[columns[c]];
    }
  }
  return matrix;
}

}  // namespace strata
