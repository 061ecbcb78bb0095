// Tiles: the world in squares.
#ifndef STRATA_CORE_API_TILES_H_
#define STRATA_CORE_API_TILES_H_

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "absl/functional/function_ref.h"
#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"

#include "core/api/call.h"
#include "core/mls/tile_key.h"

namespace strata::api {

// A served tile: core/codec's surface-tile bytes (DecodeSurfaceTile reads them).
struct EncodedTile {
  TileKey key;
  std::uint64_t version = 0;
  std::uint64_t epoch = 0;
  std::string bytes;
};

struct TileInfo {
  TileKey key;
  std::uint64_t version = 0;
  std::uint64_t bytes = 0;
  std::uint64_t patches = 0;
};

// Tiles x_min ≤ x < x_max, y_min ≤ y < y_max of one level of detail, in one epoch.
struct TileArea {
  std::int32_t level = 0;
  std::int64_t x_min = -(std::int64_t{1} << 31), x_max = std::int64_t{1} << 31;
  std::int64_t y_min = -(std::int64_t{1} << 31), y_max = std::int64_t{1} << 31;
  // 0: the current one. An earlier one has the tiles that its poses make of the scans that are
  // there now and had a pose in it, level 0 only; they are made when asked for. Those that are not
  // as they are now have version 0, which no reader holds: they are sent again each time.
  std::uint64_t epoch = 0;
};

// A tile the reader has already.
struct HeldTile {
  TileKey key;
  std::uint64_t version = 0;
};

// One message of Fetch.
struct TileUpdate {
  // kDamaged: what is stored cannot be read; the reader keeps what it has. A rebuild mends it.
  enum class Kind : std::uint8_t { kNew = 1, kChanged = 2, kGone = 3, kDamaged = 4 };
  Kind kind = Kind::kNew;
  EncodedTile tile;  // gone: key and epoch only; damaged: all but the bytes
};

// Thread-safe. Every answer is of one epoch.
class Tiles {
 public:
  virtual ~Tiles() = default;

  // NOT_FOUND where the map has nothing; DATA_LOSS if the stored tile is damaged (others are
  // served).
  virtual absl::StatusOr<EncodedTile> Get(const Call& call,
                                          absl::string_view map,
                                          const TileKey& key) = 0;
  // What Get() returns, where it is at hand: without waiting for a disk or a network. nullopt where
  // it is not.
  virtual absl::StatusOr<std::optional<EncodedTile>> GetAtHand(const Call& /*call*/,
                                                               absl::string_view /*map*/,
                                                               const TileKey& /*key*/) {
    return std::nullopt;
  }
  // By key. INVALID_ARGUMENT for a level outside 0 to kMaxLevel, and above 0 in an earlier epoch;
  // NOT_FOUND for an epoch that is not kept; DATA_LOSS naming a damaged scan, ABORTED naming one
  // that was deleted meanwhile, where tiles of an earlier epoch are made.
  virtual absl::StatusOr<std::vector<TileInfo>> List(const Call& call,
                                                     absl::string_view map,
                                                     const TileArea& area) = 0;
  // What is new, changed or gone in the area against what the reader holds; nothing else is sent. A
  // damaged tile is marked, Get says why, and the others are served. Errors of List. A sink's error
  // ends the stream and is handed back.
  virtual absl::Status Fetch(const Call& call,
                             absl::string_view map,
                             const TileArea& area,
                             const std::vector<HeldTile>& held,
                             absl::FunctionRef<absl::Status(const TileUpdate&)> sink) = 0;
};

}  // namespace strata::api

#endif  // STRATA_CORE_API_TILES_H_
