#include "core/planning/packed_tile.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <string>
#include <type_traits>
#include <vector>

#include <zstd.h>

#include "core/mls/tile_key.h"
#include "core/planning/ground_window.h"
#include "core/planning/prepared_tile.h"

namespace strata {
namespace {

constexpr int kCells = kTileCells * kTileCells;
constexpr int kLevel = 1;  // of zstd: 3 saves another twentieth and takes twice the time

// A move that is not what PredictMoves says.
struct Exception {
  std::uint32_t patch = 0;
  std::uint32_t direction = 0;
  Move move;
};

constexpr int kForward = 4;  // directions; the others are their opposites

// Columns of one kind of value, byte by byte: what is alike lies together.
class Columns {
 public:
  template <typename T>
  void Put(const std::vector<T>& values) {
    static_assert(std::is_trivially_copyable_v<T>);
    const std::uint64_t count = values.size();
    raw_.append(reinterpret_cast<const char*>(&count), sizeof(count));
    const char* const from = reinterpret_cast<const char*>(values.data());
    for (std::size_t byte = 0; byte < sizeof(T); ++byte) {
      for (std::size_t i = 0; i < values.size(); ++i) raw_.push_back(from[i * sizeof(T) + byte]);
    }
  }
  std::string Compressed() const {
    std::string packed(sizeof(std::uint64_t) + ZSTD_compressBound(raw_.size()), '\0');
    const std::uint64_t size = raw_.size();
    std::memcpy(packed.data(), &size, sizeof(size));
    const std::size_t used = ZSTD_compress(packed.data() + sizeof(size),
                                           packed.size() - sizeof(size),
                                           raw_.data(),
                                           raw_.size(),
                                           kLevel);
    packed.resize(sizeof(size) + used);
    packed.shrink_to_fit();
    return packed;
  }

  Columns() = default;
  explicit Columns(const std::string& packed) {
    std::uint64_t size = 0;
    std::memcpy(&size, packed.data(), sizeof(size));
    raw_.resize(size);
    ZSTD_decompress(raw_.data(), size, packed.data() + sizeof(size), packed.size() - sizeof(size));
  }
  template <typename T>
  std::vector<T> Take() {
    std::uint64_t count = 0;
    std::memcpy(&count, &raw_[at_], sizeof(count));
    at_ += sizeof(count);
    std::vector<T> values(count);
    char* const to = reinterpret_cast<char*>(values.data());
    for (std::size_t byte = 0; byte < sizeof(T); ++byte) {
      for (std::size_t i = 0; i < count; ++i) to[i * sizeof(T) + byte] = raw_[at_++];
    }
    return values;
  }

 private:
  std::string raw_;
  std::size_t at_ = 0;
};

// Zigzag differences of heights in units of 1/512 m, which is what tiles have; empty if they are
// not.
std::vector<std::uint32_t> HeightSteps(const std::vector<float>& heights) {
  std::vector<std::uint32_t> steps;
  steps.reserve(heights.size());
  std::int32_t last = 0;
  for (const float z : heights) {
    const float units = z * 512.0F;
    if (!(std::abs(units) < 1e8F) || units != std::floor(units) || (z == 0.0F && std::signbit(z))) {
      return {};
    }
    const std::int32_t step = static_cast<std::int32_t>(units) - last;
    last += step;
    steps.push_back(static_cast<std::uint32_t>(step) << 1 ^ static_cast<std::uint32_t>(step >> 31));
  }
  return steps;
}

std::vector<float> HeightsOf(const std::vector<std::uint32_t>& steps) {
  std::vector<float> heights;
  heights.reserve(steps.size());
  std::int32_t last = 0;
  for (const std::uint32_t step : steps) {
    last += static_cast<std::int32_t>(step >> 1) ^ -static_cast<std::int32_t>(step & 1U);
    heights.push_back(static_cast<float>(last) / 512.0F);
  }
  return heights;
}

// The moves of one cell inside the tile to where the robot can stand nearest in height, both ways.
void PredictMoves(PreparedTile& tile, double cell_size_m) {
  tile.moves.assign(tile.size(), {});
  std::vector<std::uint32_t> first(kCells, PreparedTile::kNoPatch);
  for (std::uint32_t i = tile.size(); i-- > 0;) first[tile.cell[i]] = i;
  for (std::uint32_t i = 0; i < tile.size(); ++i) {
    if (!tile.CanStand(i)) continue;
    const int x = tile.cell[i] & (kTileCells - 1);
    const int y = tile.cell[i] >> kTileShift;
    for (int k = 0; k < kForward; ++k) {
      const int to_x = x + kStepX[k];
      const int to_y = y + kStepY[k];
      if (to_x < 0 || to_x >= kTileCells || to_y >= kTileCells) continue;
      const auto cell = static_cast<std::uint16_t>(to_y << kTileShift | to_x);
      std::uint32_t to = PreparedTile::kNoPatch;
      for (std::uint32_t j = first[cell]; j < tile.size() && tile.cell[j] == cell; ++j) {
        if (!tile.CanStand(j)) continue;
        if (to == PreparedTile::kNoPatch ||
            std::abs(tile.z_m[j] - tile.z_m[i]) < std::abs(tile.z_m[to] - tile.z_m[i])) {
          to = j;
        }
      }
      if (to == PreparedTile::kNoPatch) continue;
      const double run = (k & 1) != 0 ? cell_size_m * 1.4142135623730951 : cell_size_m;
      const double danger = 0.5 * (static_cast<double>(tile.danger[i]) + tile.danger[to]);
      const double rise = tile.z_m[to] - tile.z_m[i];
      const std::uint32_t cost = MoveCost(run, rise, danger, cell_size_m);
      const std::int64_t delta = static_cast<std::int64_t>(to) - i;
      if (cost >= Move::kFar || std::abs(delta) > INT16_MAX) continue;
      tile.moves[i][k] = {static_cast<std::int16_t>(delta), static_cast<std::uint16_t>(cost)};
      tile.moves[to][k + kForward] = {static_cast<std::int16_t>(-delta),
                                      static_cast<std::uint16_t>(cost)};
    }
  }
  for (const FarMove& move : tile.far_moves) {
    tile.moves[move.patch][move.direction] = {0, Move::kFar};
  }
}

std::vector<Exception> ExceptionsOf(const PreparedTile& tile, double cell_size_m) {
  PreparedTile predicted;
  predicted.far_moves = tile.far_moves;
  predicted.cell = tile.cell;
  predicted.z_m = tile.z_m;
  predicted.danger = tile.danger;
  PredictMoves(predicted, cell_size_m);
  std::vector<Exception> exceptions;
  for (std::uint32_t i = 0; i < tile.size(); ++i) {
    for (std::uint32_t k = 0; k < 8; ++k) {
      const Move& move = tile.moves[i][k];
      if (move == predicted.moves[i][k]) continue;
      exceptions.push_back({i, k, move});
    }
  }
  return exceptions;
}

}  // namespace

std::string PackTile(const PreparedTile& tile, double cell_size_m) {
  // Nobody asks how dangerous it is where nobody can stand: all that is < 0 is alike.
  std::vector<std::uint8_t> stands;
  std::vector<float> danger;
  for (std::uint32_t i = 0; i < tile.size(); ++i) {
    stands.push_back(tile.CanStand(i) ? 1 : 0);
    if (tile.CanStand(i)) danger.push_back(tile.danger[i]);
  }
  Columns columns;
  columns.Put(std::vector<TileKey>{tile.key});
  columns.Put(tile.far_moves);
  std::vector<std::uint16_t> steps;  // along the cells' own order
  std::uint16_t last = 0;
  for (const std::uint16_t cell : tile.cell) {
    steps.push_back(cell ^ last);
    last = cell;
  }
  columns.Put(steps);
  const std::vector<std::uint32_t> heights = HeightSteps(tile.z_m);
  columns.Put(heights);
  columns.Put(heights.empty() ? tile.z_m : std::vector<float>());
  columns.Put(stands);
  columns.Put(danger);
  columns.Put(tile.edge_distance);
  columns.Put(tile.class_id);
  columns.Put(std::vector<std::uint32_t>(tile.block_begin.begin(), tile.block_begin.end()));
  columns.Put(ExceptionsOf(tile, cell_size_m));
  return columns.Compressed();
}

PreparedTile UnpackTile(const std::string& packed, double cell_size_m) {
  Columns columns(packed);
  PreparedTile tile;
  tile.key = columns.Take<TileKey>().front();
  tile.far_moves = columns.Take<FarMove>();
  tile.cell = columns.Take<std::uint16_t>();
  std::uint16_t last = 0;
  for (std::uint16_t& cell : tile.cell) {
    cell ^= last;
    last = cell;
  }
  tile.z_m = HeightsOf(columns.Take<std::uint32_t>());
  if (const std::vector<float> z_m = columns.Take<float>(); !z_m.empty()) tile.z_m = z_m;
  const auto stands = columns.Take<std::uint8_t>();
  const auto danger = columns.Take<float>();
  tile.danger.reserve(tile.cell.size());
  std::size_t standing = 0;
  for (const std::uint8_t stand : stands) {
    tile.danger.push_back(stand != 0 ? danger[standing++] : -1.0F);
  }
  tile.edge_distance = columns.Take<std::uint8_t>();
  tile.class_id = columns.Take<std::uint8_t>();
  const auto blocks = columns.Take<std::uint32_t>();
  std::copy(blocks.begin(), blocks.end(), tile.block_begin.begin());
  PredictMoves(tile, cell_size_m);
  for (const Exception& exception : columns.Take<Exception>()) {
    tile.moves[exception.patch][exception.direction] = exception.move;
  }
  return tile;
}

}  // namespace strata
