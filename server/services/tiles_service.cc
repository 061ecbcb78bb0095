#include "server/services/tiles_service.h"

#include <optional>
#include <utility>
#include <vector>

#include "core/common/status.h"
#include "proto/translate/tiles.h"
#include "server/rpc/stream.h"

namespace strata::server {
namespace {

using translate::FromProto;
using translate::ToProto;

constexpr int kMaxTilesPerMessage = 4096;

absl::Status Get(api::Database& db,
                 const api::Call& call,
                 const v1::GetTileRequest& in,
                 v1::GetTileResponse& out) {
  STRATA_ASSIGN_OR_RETURN(const TileKey key, AtTheDoor(FromProto(in.key())));
  STRATA_ASSIGN_OR_RETURN(api::EncodedTile tile, db.tiles().Get(call, in.map(), key));
  *out.mutable_tile() = ToProto(std::move(tile));
  return absl::OkStatus();
}

absl::StatusOr<bool> GetAtHand(api::Database& db,
                               const api::Call& call,
                               const v1::GetTileRequest& in,
                               v1::GetTileResponse& out) {
  STRATA_ASSIGN_OR_RETURN(const TileKey key, AtTheDoor(FromProto(in.key())));
  STRATA_ASSIGN_OR_RETURN(std::optional<api::EncodedTile> tile,
                          db.tiles().GetAtHand(call, in.map(), key));
  if (tile.has_value()) *out.mutable_tile() = ToProto(*std::move(tile));
  return tile.has_value();
}

absl::Status List(api::Database& db,
                  const api::Call& call,
                  const v1::ListTilesRequest& in,
                  StreamSink<v1::ListTilesResponse> sink) {
  STRATA_ASSIGN_OR_RETURN(const api::TileArea area, AtTheDoor(FromProto(in.area())));
  STRATA_ASSIGN_OR_RETURN(const std::vector<api::TileInfo> tiles,
                          db.tiles().List(call, in.map(), area));
  v1::ListTilesResponse out;
  for (const api::TileInfo& tile : tiles) {
    *out.add_tiles() = ToProto(tile);
    if (out.tiles_size() < kMaxTilesPerMessage) continue;
    STRATA_RETURN_IF_ERROR(sink(out));
    out.clear_tiles();
  }
  return out.tiles().empty() ? absl::OkStatus() : sink(out);
}

absl::StatusOr<std::vector<api::HeldTile>> HeldOf(const v1::FetchTilesRequest& in) {
  std::vector<api::HeldTile> held;
  held.reserve(static_cast<std::size_t>(in.held_size()));
  for (const v1::HeldTile& tile : in.held()) {
    STRATA_ASSIGN_OR_RETURN(const api::HeldTile added, FromProto(tile));
    held.push_back(added);
  }
  return held;
}

absl::Status Fetch(api::Database& db,
                   const api::Call& call,
                   const v1::FetchTilesRequest& in,
                   StreamSink<v1::FetchTilesResponse> sink) {
  STRATA_ASSIGN_OR_RETURN(const api::TileArea area, AtTheDoor(FromProto(in.area())));
  STRATA_ASSIGN_OR_RETURN(const std::vector<api::HeldTile> held, AtTheDoor(HeldOf(in)));
  return db.tiles().Fetch(call, in.map(), area, held, [&sink](const api::TileUpdate& update) {
    return sink(ToProto(update));
  });
}

}  // namespace

TilesService::TilesService(Runtime& runtime) : Service(runtime, "Tiles") {
  Unary("Get", &Get, &GetAtHand);
  Stream("List", &List);
  Stream("Fetch", &Fetch);
}

}  // namespace strata::server
