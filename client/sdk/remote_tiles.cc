#include "client/sdk/remote_tiles.h"

#include <string>
#include <utility>

#include "core/common/status.h"
#include "proto/translate/tiles.h"

namespace strata::sdk {

using translate::FromProto;
using translate::ToProto;

absl::StatusOr<api::EncodedTile> RemoteTiles::Get(const api::Call& call,
                                                  absl::string_view map,
                                                  const TileKey& key) {
  v1::GetTileRequest in;
  in.set_map(std::string(map));
  *in.mutable_key() = ToProto(key);
  STRATA_ASSIGN_OR_RETURN(
      const v1::GetTileResponse out,
      CallUnary(connection_, *stub_, &v1::Tiles::Stub::Get, call, Repeat::kOnTrouble, in));
  return FromProto(out.tile());
}

absl::StatusOr<std::vector<api::TileInfo>> RemoteTiles::List(const api::Call& call,
                                                             absl::string_view map,
                                                             const api::TileArea& area) {
  v1::ListTilesRequest in;
  in.set_map(std::string(map));
  *in.mutable_area() = ToProto(area);
  std::vector<api::TileInfo> tiles;
  const auto collect = [&tiles](const v1::ListTilesResponse& out) -> absl::Status {
    for (const v1::TileInfo& tile : out.tiles()) {
      STRATA_ASSIGN_OR_RETURN(const api::TileInfo added, FromProto(tile));
      tiles.push_back(added);
    }
    return absl::OkStatus();
  };
  STRATA_RETURN_IF_ERROR(
      CallStream(connection_, *stub_, &v1::Tiles::Stub::List, call, in, collect));
  return tiles;
}

absl::Status RemoteTiles::Fetch(const api::Call& call,
                                absl::string_view map,
                                const api::TileArea& area,
                                const std::vector<api::HeldTile>& held,
                                absl::FunctionRef<absl::Status(const api::TileUpdate&)> sink) {
  v1::FetchTilesRequest in;
  in.set_map(std::string(map));
  *in.mutable_area() = ToProto(area);
  for (const api::HeldTile& tile : held) *in.add_held() = ToProto(tile);
  const auto deliver = [&sink](const v1::FetchTilesResponse& out) -> absl::Status {
    STRATA_ASSIGN_OR_RETURN(const api::TileUpdate update, FromProto(out));
    return sink(update);
  };
  return CallStream(connection_, *stub_, &v1::Tiles::Stub::Fetch, call, in, deliver);
}

}  // namespace strata::sdk
