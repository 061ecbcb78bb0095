#include "client/sdk/remote_objects.h"

#include <string>
#include <utility>

#include "absl/status/status.h"
#include "absl/status/statusor.h"

#include "core/common/status.h"
#include "proto/translate/objects.h"

namespace strata::sdk {

using translate::FromProto;

namespace {

// A request that names a kind.
template <typename Request>
Request NamingKind(absl::string_view map, absl::string_view kind) {
  Request in;
  in.set_map(std::string(map));
  in.set_kind(std::string(kind));
  return in;
}

}  // namespace

absl::StatusOr<EntitiesInfo> RemoteObjects::ListEntities(
    const api::Call& call,
    absl::string_view map,
    const EntityQuery& query,
    absl::FunctionRef<absl::Status(const Entity&)> sink) {
  EntitiesInfo info;
  const auto take = [&](const v1::ListEntitiesResponse& out) -> absl::Status {
    if (out.has_search()) {
      STRATA_ASSIGN_OR_RETURN(info, FromProto(out.search()));
      return absl::OkStatus();
    }
    STRATA_ASSIGN_OR_RETURN(const Entity entity, FromProto(out.entity()));
    return sink(entity);
  };
  STRATA_RETURN_IF_ERROR(CallStream(connection_,
                                    *stub_,
                                    &v1::Objects::Stub::ListEntities,
                                    call,
                                    translate::ToProto(map, query),
                                    take));
  return info;
}

absl::StatusOr<std::vector<KindInfo>> RemoteObjects::ListKinds(const api::Call& call,
                                                               absl::string_view map) {
  v1::ListKindsRequest in;
  in.set_map(std::string(map));
  STRATA_ASSIGN_OR_RETURN(
      const v1::ListKindsResponse out,
      CallUnary(connection_, *stub_, &v1::Objects::Stub::ListKinds, call, Repeat::kOnTrouble, in));
  std::vector<KindInfo> kinds;
  for (const v1::KindInfo& proto : out.kinds()) {
    STRATA_ASSIGN_OR_RETURN(KindInfo info, FromProto(proto));
    kinds.push_back(std::move(info));
  }
  return kinds;
}

absl::StatusOr<ThingKind> RemoteObjects::GetKind(const api::Call& call,
                                                 absl::string_view map,
                                                 absl::string_view kind) {
  STRATA_ASSIGN_OR_RETURN(const v1::GetKindResponse out,
                          CallUnary(connection_,
                                    *stub_,
                                    &v1::Objects::Stub::GetKind,
                                    call,
                                    Repeat::kOnTrouble,
                                    NamingKind<v1::GetKindRequest>(map, kind)));
  ThingKind read;
  STRATA_ASSIGN_OR_RETURN(read.info, FromProto(out.kind()));
  STRATA_ASSIGN_OR_RETURN(read.shape, FromProto(out.shape()));
  return read;
}

absl::StatusOr<KindInfo> RemoteObjects::RenameKind(const api::Call& call,
                                                   absl::string_view map,
                                                   absl::string_view kind,
                                                   absl::string_view name) {
  auto in = NamingKind<v1::RenameKindRequest>(map, kind);
  in.set_name(std::string(name));
  STRATA_ASSIGN_OR_RETURN(
      const v1::RenameKindResponse out,
      CallUnary(connection_, *stub_, &v1::Objects::Stub::RenameKind, call, Repeat::kNever, in));
  return FromProto(out.kind());
}

absl::StatusOr<KindInfo> RemoteObjects::ImportKind(const api::Call& call,
                                                   absl::string_view map,
                                                   const NewKind& kind) {
  STRATA_ASSIGN_OR_RETURN(const v1::ImportKindResponse out,
                          CallUnary(connection_,
                                    *stub_,
                                    &v1::Objects::Stub::ImportKind,
                                    call,
                                    Repeat::kNever,
                                    translate::ToProto(map, kind)));
  return FromProto(out.kind());
}

absl::Status RemoteObjects::DeleteKind(const api::Call& call,
                                       absl::string_view map,
                                       absl::string_view kind) {
  return CallUnary(connection_,
                   *stub_,
                   &v1::Objects::Stub::DeleteKind,
                   call,
                   Repeat::kNever,
                   NamingKind<v1::DeleteKindRequest>(map, kind))
      .status();
}

absl::StatusOr<InferredInfo> RemoteObjects::ListInferred(
    const api::Call& call,
    absl::string_view map,
    const EntityQuery& query,
    absl::FunctionRef<absl::Status(const InferredPart&)> sink) {
  InferredInfo info;
  const auto take = [&](const v1::ListInferredResponse& out) -> absl::Status {
    if (out.has_search()) {
      STRATA_ASSIGN_OR_RETURN(info, FromProto(out.search()));
      return absl::OkStatus();
    }
    STRATA_ASSIGN_OR_RETURN(const InferredPart part, FromProto(out.inferred()));
    return sink(part);
  };
  STRATA_RETURN_IF_ERROR(CallStream(connection_,
                                    *stub_,
                                    &v1::Objects::Stub::ListInferred,
                                    call,
                                    translate::ToInferredRequest(map, query),
                                    take));
  return info;
}

}  // namespace strata::sdk
