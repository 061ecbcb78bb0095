#include "client/formats/grid_writer.h"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <limits>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"

namespace strata {
namespace {

constexpr std::int64_t kMostCells = std::int64_t{1} << 28;

char ValueOf(GridCell cell, GridMode mode) {
  switch (cell) {
    case GridCell::kFree:
      return static_cast<char>(254);
    case GridCell::kOccupied:
      return 0;
    case GridCell::kGround:
      return static_cast<char>(mode == GridMode::kScale ? 110 : 205);
    case GridCell::kUnknown:
      break;
  }
  return static_cast<char>(mode == GridMode::kScale ? 150 : 205);
}

// In double quotes, as YAML reads them.
std::string Quoted(absl::string_view text) {
  std::string quoted = "\"";
  for (const char c : text) {
    if (c == '"' || c == '\\') quoted += '\\';
    quoted += c;
  }
  return quoted + '"';
}

}  // namespace

absl::StatusOr<OccupancyGrid> GridOf(const Floor& floor, double cell_size_m) {
  OccupancyGrid grid;
  if (floor.blocks.empty()) return grid;
  std::int64_t low[2] = {std::numeric_limits<std::int64_t>::max(), floor.blocks.front().y};
  std::int64_t high[2] = {std::numeric_limits<std::int64_t>::min(), floor.blocks.back().y};
  for (const FloorBlock& block : floor.blocks) {
    low[0] = std::min<std::int64_t>(low[0], block.x);
    high[0] = std::max<std::int64_t>(high[0], block.x);
  }
  const std::int64_t width = (high[0] - low[0] + 1) * kFloorBlockCells;
  const std::int64_t height = (high[1] - low[1] + 1) * kFloorBlockCells;
  if (width > kMostCells || height > kMostCells || width * height > kMostCells) {
    return absl::ResourceExhaustedError(absl::StrCat(
        "a grid of ", width, " x ", height, " cells; at most ", kMostCells, " are written"));
  }
  grid.width = static_cast<int>(width);
  grid.height = static_cast<int>(height);
  grid.resolution_m = cell_size_m;
  grid.x_m = static_cast<double>(low[0] * kFloorBlockCells) * cell_size_m;
  grid.y_m = static_cast<double>(low[1] * kFloorBlockCells) * cell_size_m;
  grid.cells.assign(static_cast<std::size_t>(width * height), GridCell::kUnknown);
  for (const FloorBlock& block : floor.blocks) {
    for (int cell = 0; cell < kFloorBlockCells * kFloorBlockCells; ++cell) {
      const auto has = [cell](std::uint64_t mask) { return (mask >> cell & 1U) != 0; };
      const std::int64_t x = (block.x - low[0]) * kFloorBlockCells + cell % kFloorBlockCells;
      const std::int64_t y = (block.y - low[1]) * kFloorBlockCells + cell / kFloorBlockCells;
      grid.cells[static_cast<std::size_t>(y * width + x)] =
          has(block.free)       ? GridCell::kFree
          : has(block.occupied) ? GridCell::kOccupied
          : has(block.ground)   ? GridCell::kGround
                                : GridCell::kUnknown;
    }
  }
  return grid;
}

std::string PgmBytes(const OccupancyGrid& grid, GridMode mode) {
  std::string bytes = absl::StrCat("P5\n", grid.width, " ", grid.height, "\n255\n");
  bytes.reserve(bytes.size() + grid.cells.size());
  for (int y = grid.height - 1; y >= 0; --y) {
    for (int x = 0; x < grid.width; ++x) {
      bytes += ValueOf(grid.cells[static_cast<std::size_t>(y) * grid.width + x], mode);
    }
  }
  return bytes;
}

std::string Nav2Yaml(const OccupancyGrid& grid, GridMode mode, absl::string_view image) {
  return absl::StrFormat(
      "image: %s\nmode: %s\nresolution: %.15g\norigin: [%.9g, %.9g, 0.0]\nnegate: 0\n"
      "occupied_thresh: 0.65\nfree_thresh: 0.196\n",
      Quoted(image),
      mode == GridMode::kScale ? "scale" : "trinary",
      grid.resolution_m,
      grid.x_m,
      grid.y_m);
}

}  // namespace strata
