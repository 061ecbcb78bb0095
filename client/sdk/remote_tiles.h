// api::Tiles over strata.v1.Tiles.
#ifndef STRATA_CLIENT_SDK_REMOTE_TILES_H_
#define STRATA_CLIENT_SDK_REMOTE_TILES_H_

#include <memory>

#include "client/sdk/connection.h"
#include "core/api/tiles.h"
#include "strata/v1/tiles.grpc.pb.h"

namespace strata::sdk {

// Thread-safe.
class RemoteTiles final : public api::Tiles {
 public:
  explicit RemoteTiles(Connection& connection)
      : connection_(connection), stub_(v1::Tiles::NewStub(connection.channel())) {}

  absl::StatusOr<api::EncodedTile> Get(const api::Call& call,
                                       absl::string_view map,
                                       const TileKey& key) override;
  absl::StatusOr<std::vector<api::TileInfo>> List(const api::Call& call,
                                                  absl::string_view map,
                                                  const api::TileArea& area) override;
  absl::Status Fetch(const api::Call& call,
                     absl::string_view map,
                     const api::TileArea& area,
                     const std::vector<api::HeldTile>& held,
                     absl::FunctionRef<absl::Status(const api::TileUpdate&)> sink) override;

 private:
  Connection& connection_;
  const std::unique_ptr<v1::Tiles::Stub> stub_;
};

}  // namespace strata::sdk

#endif  // STRATA_CLIENT_SDK_REMOTE_TILES_H_
