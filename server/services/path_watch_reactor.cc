#include "server/services/path_watch_reactor.h"

#include <utility>

#include "core/common/status.h"
#include "proto/translate/planning.h"

namespace strata::server {

absl::Status PathWatchReactor::Ask(const In& in) {
  map_ = in.map();
  STRATA_ASSIGN_OR_RETURN(query_, AtTheDoor(translate::FromProto(in)));
  return absl::OkStatus();
}

absl::StatusOr<bool> PathWatchReactor::Unchanged() {
  if (!query_.known.has_value()) return false;
  api::WatchOptions since;
  since.since = query_.known->commit_sequence;
  since.epoch = query_.known->epoch;
  since.tiles = false;
  since.once = true;
  since.lag = api::kWatchLag;
  bool unchanged = false;
  const auto compare = [&](const api::MapUpdate& update) {
    unchanged = update.commit_sequence == since.since && update.epoch == since.epoch;
    return absl::OkStatus();
  };
  STRATA_RETURN_IF_ERROR(runtime().db.maps().Watch(request().call(), map_, since, compare));
  return unchanged;
}

absl::StatusOr<PathWatchReactor::News> PathWatchReactor::Look(Out& out) {
  STRATA_ASSIGN_OR_RETURN(const bool unchanged, Unchanged());
  if (unchanged) return News::kNone;
  STRATA_ASSIGN_OR_RETURN(PathCheck check,
                          runtime().db.planning().CheckPath(request().call(), map_, query_));
  const bool news = !query_.known.has_value() || query_.known->valid != check.valid;
  if (news) *out.mutable_check() = translate::ToProto(check);
  query_.known = std::move(check);
  return news ? News::kSome : News::kNone;
}

std::size_t PathWatchReactor::kept_bytes() const {
  const std::size_t tiles = query_.known.has_value() ? query_.known->tiles.capacity() : 0;
  return sizeof(Eigen::Vector3d) * query_.waypoints.capacity() + sizeof(TileKey) * tiles;
}

absl::string_view PathWatchReactor::shutdown_message() const {
  return "the server is shutting down; ask again after its restart";
}

}  // namespace strata::server
