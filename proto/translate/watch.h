// What watchers of a map are told, and its history, between the core's words and the wire's.
#ifndef STRATA_PROTO_TRANSLATE_WATCH_H_
#define STRATA_PROTO_TRANSLATE_WATCH_H_

#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"

#include "core/api/maps.h"
#include "core/world/epoch.h"
#include "strata/v1/maps.pb.h"

namespace strata::translate {

v1::Epoch ToProto(const EpochInfo& epoch);
v1::WatchMapRequest ToProto(absl::string_view map, const api::WatchOptions& options);
v1::ScanChange ToProto(const api::ScanChange& change);
v1::TileChange ToProto(const api::TileChangeNotice& change);
v1::WatchMapResponse ToProto(const api::MapUpdate& update);

absl::StatusOr<EpochInfo> FromProto(const v1::Epoch& epoch);
// INVALID_ARGUMENT for a bad trajectory name.
absl::StatusOr<api::WatchOptions> FromProto(const v1::WatchMapRequest& request);
absl::StatusOr<api::ScanChange> FromProto(const v1::ScanChange& change);
absl::StatusOr<api::TileChangeNotice> FromProto(const v1::TileChange& change);
absl::StatusOr<api::MapUpdate> FromProto(const v1::WatchMapResponse& update);

}  // namespace strata::translate

#endif  // STRATA_PROTO_TRANSLATE_WATCH_H_
