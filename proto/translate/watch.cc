#include "proto/translate/watch.h"

#include <string>
#include <utility>

#include "core/common/status.h"
#include "core/world/names.h"
#include "proto/translate/geometry.h"
#include "proto/translate/scans.h"
#include "proto/translate/tiles.h"

namespace strata::translate {

v1::Epoch ToProto(const EpochInfo& epoch) {
  v1::Epoch proto;
  proto.set_epoch(epoch.epoch);
  *proto.mutable_created() = ToProto(epoch.created);
  proto.set_reason(epoch.reason);
  proto.set_job(epoch.job);
  proto.set_decided(epoch.decided);
  proto.set_current(epoch.current);
  proto.set_kept(epoch.kept);
  return proto;
}

absl::StatusOr<EpochInfo> FromProto(const v1::Epoch& proto) {
  EpochInfo epoch;
  epoch.epoch = proto.epoch();
  STRATA_ASSIGN_OR_RETURN(epoch.created, FromProto("created", proto.created()));
  epoch.reason = proto.reason();
  epoch.job = proto.job();
  epoch.decided = proto.decided();
  epoch.current = proto.current();
  epoch.kept = proto.kept();
  return epoch;
}

v1::WatchMapRequest ToProto(absl::string_view map, const api::WatchOptions& options) {
  v1::WatchMapRequest proto;
  proto.set_name(std::string(map));
  proto.set_since(options.since);
  proto.set_epoch(options.epoch);
  proto.set_trajectory(options.trajectory);
  proto.set_tiles(options.tiles);
  proto.set_once(options.once);
  return proto;
}

absl::StatusOr<api::WatchOptions> FromProto(const v1::WatchMapRequest& proto) {
  if (!proto.trajectory().empty()) {
    STRATA_RETURN_IF_ERROR(ValidateName("trajectory name", proto.trajectory()));
  }
  api::WatchOptions options;
  options.since = proto.since();
  options.epoch = proto.epoch();
  options.trajectory = proto.trajectory();
  if (proto.has_tiles()) options.tiles = proto.tiles();
  options.once = proto.once();
  return options;
}

v1::ScanChange ToProto(const api::ScanChange& change) {
  v1::ScanChange proto;
  *proto.mutable_id() = ToProto(change.id);
  proto.set_state(ToProto(change.state));
  *proto.mutable_pose() = ToProto(change.T_map_scan);
  proto.set_gone(change.gone);
  return proto;
}

absl::StatusOr<api::ScanChange> FromProto(const v1::ScanChange& proto) {
  api::ScanChange change;
  change.id = FromProto(proto.id());
  STRATA_ASSIGN_OR_RETURN(change.state, FromProto(proto.state()));
  STRATA_ASSIGN_OR_RETURN(change.T_map_scan, FromProto("pose", proto.pose()));
  change.gone = proto.gone();
  return change;
}

v1::TileChange ToProto(const api::TileChangeNotice& change) {
  v1::TileChange proto;
  *proto.mutable_key() = ToProto(change.key);
  proto.set_version(change.version);
  proto.set_gone(change.gone);
  return proto;
}

absl::StatusOr<api::TileChangeNotice> FromProto(const v1::TileChange& proto) {
  STRATA_ASSIGN_OR_RETURN(const TileKey key, FromProto(proto.key()));
  return api::TileChangeNotice{key, proto.version(), proto.gone()};
}

v1::WatchMapResponse ToProto(const api::MapUpdate& update) {
  v1::WatchMapResponse proto;
  proto.set_commit_sequence(update.commit_sequence);
  proto.set_epoch(update.epoch);
  proto.set_epoch_reason(update.epoch_reason);
  proto.set_whole(update.whole);
  proto.set_inferred(update.inferred);
  for (const api::ScanChange& scan : update.scans) *proto.add_scans() = ToProto(scan);
  for (const api::TileChangeNotice& tile : update.tiles) *proto.add_tiles() = ToProto(tile);
  return proto;
}

absl::StatusOr<api::MapUpdate> FromProto(const v1::WatchMapResponse& proto) {
  api::MapUpdate update;
  update.commit_sequence = proto.commit_sequence();
  update.epoch = proto.epoch();
  update.epoch_reason = proto.epoch_reason();
  update.whole = proto.whole();
  update.inferred = proto.inferred();
  for (const v1::ScanChange& scan : proto.scans()) {
    STRATA_ASSIGN_OR_RETURN(api::ScanChange added, FromProto(scan));
    update.scans.push_back(std::move(added));
  }
  for (const v1::TileChange& tile : proto.tiles()) {
    STRATA_ASSIGN_OR_RETURN(const api::TileChangeNotice added, FromProto(tile));
    update.tiles.push_back(added);
  }
  return update;
}

}  // namespace strata::translate
