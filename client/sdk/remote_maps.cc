#include "client/sdk/remote_maps.h"

#include <cstdint>
#include <memory>
#include <string>

#include "core/common/checksum.h"
#include "core/common/status.h"
#include "proto/translate/maps.h"
#include "proto/translate/watch.h"

namespace strata::sdk {

using translate::FromProto;
using translate::ToProto;

absl::StatusOr<MapInfo> RemoteMaps::Create(const api::Call& call,
                                           absl::string_view name,
                                           const MapParameters& parameters) {
  v1::CreateMapRequest in;
  in.set_name(std::string(name));
  *in.mutable_parameters() = ToProto(parameters);
  STRATA_ASSIGN_OR_RETURN(
      const v1::CreateMapResponse out,
      CallUnary(connection_, *stub_, &v1::Maps::Stub::Create, call, Repeat::kNever, in));
  return FromProto(out.map());
}

absl::StatusOr<MapInfo> RemoteMaps::Get(const api::Call& call, absl::string_view name) {
  v1::GetMapRequest in;
  in.set_name(std::string(name));
  STRATA_ASSIGN_OR_RETURN(
      const v1::GetMapResponse out,
      CallUnary(connection_, *stub_, &v1::Maps::Stub::Get, call, Repeat::kOnTrouble, in));
  return FromProto(out.map());
}

absl::StatusOr<std::vector<MapInfo>> RemoteMaps::List(const api::Call& call) {
  STRATA_ASSIGN_OR_RETURN(const v1::ListMapsResponse out,
                          CallUnary(connection_,
                                    *stub_,
                                    &v1::Maps::Stub::List,
                                    call,
                                    Repeat::kOnTrouble,
                                    v1::ListMapsRequest()));
  std::vector<MapInfo> maps;
  for (const v1::MapInfo& map : out.maps()) {
    STRATA_ASSIGN_OR_RETURN(MapInfo added, FromProto(map));
    maps.push_back(std::move(added));
  }
  return maps;
}

absl::Status RemoteMaps::Delete(const api::Call& call, absl::string_view name) {
  v1::DeleteMapRequest in;
  in.set_name(std::string(name));
  return CallUnary(connection_, *stub_, &v1::Maps::Stub::Delete, call, Repeat::kNever, in).status();
}

absl::StatusOr<MapStats> RemoteMaps::Stats(const api::Call& call, absl::string_view name) {
  v1::GetMapStatsRequest in;
  in.set_name(std::string(name));
  STRATA_ASSIGN_OR_RETURN(
      const v1::GetMapStatsResponse out,
      CallUnary(connection_, *stub_, &v1::Maps::Stub::Stats, call, Repeat::kOnTrouble, in));
  return FromProto(out.stats());
}

absl::StatusOr<std::vector<EpochInfo>> RemoteMaps::History(const api::Call& call,
                                                           absl::string_view name) {
  v1::GetMapHistoryRequest in;
  in.set_name(std::string(name));
  STRATA_ASSIGN_OR_RETURN(
      const v1::GetMapHistoryResponse out,
      CallUnary(connection_, *stub_, &v1::Maps::Stub::History, call, Repeat::kOnTrouble, in));
  std::vector<EpochInfo> epochs;
  for (const v1::Epoch& epoch : out.epochs()) {
    STRATA_ASSIGN_OR_RETURN(EpochInfo added, FromProto(epoch));
    epochs.push_back(std::move(added));
  }
  return epochs;
}

absl::StatusOr<std::vector<MapClass>> RemoteMaps::ListClasses(const api::Call& call,
                                                              absl::string_view name) {
  v1::ListMapClassesRequest in;
  in.set_name(std::string(name));
  STRATA_ASSIGN_OR_RETURN(
      const v1::ListMapClassesResponse out,
      CallUnary(connection_, *stub_, &v1::Maps::Stub::ListClasses, call, Repeat::kOnTrouble, in));
  std::vector<MapClass> classes;
  for (const v1::MapClass& map_class : out.classes()) {
    STRATA_ASSIGN_OR_RETURN(MapClass added, FromProto(map_class));
    classes.push_back(std::move(added));
  }
  return classes;
}

absl::Status RemoteMaps::SetClass(const api::Call& call,
                                  absl::string_view name,
                                  const MapClass& map_class) {
  v1::SetMapClassRequest in;
  in.set_name(std::string(name));
  *in.mutable_map_class() = ToProto(map_class);
  return CallUnary(connection_, *stub_, &v1::Maps::Stub::SetClass, call, Repeat::kOnTrouble, in)
      .status();
}

absl::Status RemoteMaps::SetOrigin(const api::Call& call,
                                   absl::string_view name,
                                   const GeodeticOrigin& origin) {
  v1::SetMapOriginRequest in;
  in.set_name(std::string(name));
  *in.mutable_origin() = ToProto(origin);
  return CallUnary(connection_, *stub_, &v1::Maps::Stub::SetOrigin, call, Repeat::kOnTrouble, in)
      .status();
}

absl::Status RemoteMaps::Watch(const api::Call& call,
                               absl::string_view name,
                               const api::WatchOptions& options,
                               absl::FunctionRef<absl::Status(const api::MapUpdate&)> sink) {
  v1::WatchMapRequest in = ToProto(name, options);
  const auto new_backoff = [&] {
    return options.once ? connection_.NewBackoff() : connection_.NewEndlessBackoff();
  };
  Backoff backoff = new_backoff();
  Route<v1::Maps::Stub> route(connection_, *stub_);
  while (true) {
    STRATA_RETURN_IF_ERROR(call.stop.status());
    absl::Status taken;
    const auto deliver = [&](const v1::WatchMapResponse& out) -> absl::Status {
      STRATA_ASSIGN_OR_RETURN(const api::MapUpdate update, FromProto(out));
      taken = sink(update);
      in.set_since(update.commit_sequence);
      in.set_epoch(update.epoch);
      return taken;
    };
    AttemptContext context(connection_, call);
    bool delivered = false;
    const std::unique_ptr<grpc::ClientReader<v1::WatchMapResponse>> reader =
        route.stub().Watch(context.get(), in);
    const absl::Status ended = ReadStream(context, *reader, call, deliver, delivered);
    if (delivered) backoff = new_backoff();
    if (ended.ok() || !taken.ok()) return ended;
    route.Follow(ended, backoff);
    if (!backoff.Wait(ended, call.stop)) return call.stop.requested() ? call.stop.status() : ended;
  }
}

absl::Status RemoteMaps::Backup(const api::Call& call,
                                absl::string_view name,
                                absl::FunctionRef<absl::Status(const api::BackupPiece&)> sink) {
  v1::BackupMapRequest in;
  in.set_name(std::string(name));
  ContentHasher hasher;
  std::uint64_t received = 0;
  bool whole = false;
  const auto deliver = [&](const v1::BackupMapResponse& out) -> absl::Status {
    const api::BackupPiece piece = FromProto(out);
    hasher.Add(piece.bytes);
    received += piece.bytes.size();
    if (!piece.content_hash.empty()) {
      whole = received == piece.total_bytes && hasher.HexDigest() == piece.content_hash;
      if (!whole) return absl::DataLossError("backup: what arrived is not what was sent");
    }
    return sink(piece);
  };
  STRATA_RETURN_IF_ERROR(
      CallStream(connection_, *stub_, &v1::Maps::Stub::Backup, call, in, deliver));
  return whole ? absl::OkStatus() : absl::DataLossError("backup: it ended before its end");
}

}  // namespace strata::sdk
