// api::Maps over strata.v1.Maps.
#ifndef STRATA_CLIENT_SDK_REMOTE_MAPS_H_
#define STRATA_CLIENT_SDK_REMOTE_MAPS_H_

#include <memory>

#include "client/sdk/connection.h"
#include "core/api/maps.h"
#include "strata/v1/maps.grpc.pb.h"

namespace strata::sdk {

// Thread-safe.
class RemoteMaps final : public api::Maps {
 public:
  explicit RemoteMaps(Connection& connection)
      : connection_(connection), stub_(v1::Maps::NewStub(connection.channel())) {}

  absl::StatusOr<MapInfo> Create(const api::Call& call,
                                 absl::string_view name,
                                 const MapParameters& parameters) override;
  absl::StatusOr<MapInfo> Get(const api::Call& call, absl::string_view name) override;
  absl::StatusOr<std::vector<MapInfo>> List(const api::Call& call) override;
  absl::Status Delete(const api::Call& call, absl::string_view name) override;
  absl::StatusOr<MapStats> Stats(const api::Call& call, absl::string_view name) override;
  absl::StatusOr<std::vector<EpochInfo>> History(const api::Call& call,
                                                 absl::string_view name) override;
  absl::StatusOr<std::vector<MapClass>> ListClasses(const api::Call& call,
                                                    absl::string_view name) override;
  absl::Status SetOrigin(const api::Call& call,
                         absl::string_view name,
                         const GeodeticOrigin& origin) override;
  absl::Status SetClass(const api::Call& call,
                        absl::string_view name,
                        const MapClass& map_class) override;
  // Resumes by itself whenever the server comes back.
  absl::Status Watch(const api::Call& call,
                     absl::string_view name,
                     const api::WatchOptions& options,
                     absl::FunctionRef<absl::Status(const api::MapUpdate&)> sink) override;
  absl::Status Backup(const api::Call& call,
                      absl::string_view name,
                      absl::FunctionRef<absl::Status(const api::BackupPiece&)> sink) override;

 private:
  Connection& connection_;
  const std::unique_ptr<v1::Maps::Stub> stub_;
};

}  // namespace strata::sdk

#endif  // STRATA_CLIENT_SDK_REMOTE_MAPS_H_
