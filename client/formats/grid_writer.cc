#include "client/formats/grid_writer.h"

#include <cstddef>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"

namespace strata {
namespace {

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
