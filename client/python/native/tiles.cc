// What strata/native.py loads: the surface tiles of core/codec behind C functions, so that Python
// decodes them by the code that servers and robots use. The caller holds one Tile at a time a
// handle; different handles from any threads.
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <memory>
#include <new>
#include <span>
#include <utility>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"

#include "core/codec/surface_tile_codec.h"
#include "core/mls/surface_tile.h"
#include "core/mls/tile_key.h"

namespace strata {
namespace {

// A row of strata.SURFACE.
struct __attribute__((packed)) SurfaceRow {
  double x, y;
  float z, sigma, depth, cost;
  std::uint8_t traversability, class_id, confidence, rgb[3];
};
static_assert(sizeof(SurfaceRow) == 38);

// Begins as strata.native.Tile.
struct Decoded {
  std::int32_t level, x, y;
  std::uint64_t version;
  std::uint64_t surface_count;
  SurfaceTile tile;
};

SurfaceRow RowOf(const Surface& surface, const TileKey& key, double cell_size_m) {
  const double x_m =
      (static_cast<double>(key.x) * kTileCells + surface.cell % kTileCells + 0.5) * cell_size_m;
  const double y_m =
      (static_cast<double>(key.y) * kTileCells + surface.cell / kTileCells + 0.5) * cell_size_m;
  return {.x = x_m,
          .y = y_m,
          .z = surface.z_m,
          .sigma = surface.sigma_m,
          .depth = surface.depth_m,
          .cost = surface.cost,
          .traversability = static_cast<std::uint8_t>(surface.traversability),
          .class_id = surface.class_id,
          .confidence = surface.confidence,
          .rgb = {surface.colour.r, surface.colour.g, surface.colour.b}};
}

// No exception may reach C.
absl::StatusOr<SurfaceTile> Decode(absl::string_view bytes) {
  try {
    return DecodeSurfaceTile(bytes);
  } catch (const std::bad_alloc&) {
    return absl::ResourceExhaustedError("surface tile: no memory for its surfaces");
  }
}

int Tell(const absl::Status& status, std::span<char> message) {
  const absl::string_view text = status.message().substr(0, message.size() - 1);
  std::memcpy(message.data(), text.data(), text.size());
  message[text.size()] = '\0';
  return static_cast<int>(status.code());
}

}  // namespace
}  // namespace strata

extern "C" {

// 0 and the tile, or a canonical code and a message of at most `capacity` bytes, its zero included;
// capacity > 0.
__attribute__((visibility("default"))) int StrataDecodeTile(const char* data,
                                                            std::size_t size,
                                                            strata::Decoded** tile,
                                                            char* message,
                                                            std::size_t capacity) {
  absl::StatusOr<strata::SurfaceTile> decoded = strata::Decode({data, size});
  if (!decoded.ok()) return strata::Tell(decoded.status(), {message, capacity});
  const strata::TileKey key = decoded->key;
  *tile =
      std::make_unique<strata::Decoded>(strata::Decoded{.level = key.level,
                                                        .x = key.x,
                                                        .y = key.y,
                                                        .version = decoded->version,
                                                        .surface_count = decoded->surfaces.size(),
                                                        .tile = *std::move(decoded)})
          .release();
  return 0;
}

// Writes the tile's surfaces, surface_count rows of 38 bytes. cell_size_m: of the tile's level.
__attribute__((visibility("default"))) void StrataTileRows(const strata::Decoded* tile,
                                                           double cell_size_m,
                                                           char* rows) {
  for (const strata::Surface& surface : tile->tile.surfaces) {
    const strata::SurfaceRow row = strata::RowOf(surface, tile->tile.key, cell_size_m);
    std::memcpy(rows, &row, sizeof(row));
    rows += sizeof(row);
  }
}

__attribute__((visibility("default"))) void StrataFreeTile(strata::Decoded* tile) {
  const std::unique_ptr<strata::Decoded> freed(tile);
}

}  // extern "C"
