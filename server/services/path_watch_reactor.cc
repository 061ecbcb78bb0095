#include "server/services/path_watch_reactor.h"

#include <utility>

#include "core/common/status.h"
#include "proto/translate/planning.h"

namespace strata::server {

PathWatchReactor::PathWatchReactor(Runtime& runtime,
                                   grpc::CallbackServerContext& context,
                                   const v1::WatchPathRequest& in)
    : PollReactor(runtime, context, "Planning.WatchPath", in), in_(in) {}

absl::StatusOr<PathWatchReactor::News> PathWatchReactor::Look(v1::WatchPathResponse& out) {
  if (!query_.has_value()) {
    STRATA_ASSIGN_OR_RETURN(query_, AtTheDoor(translate::FromProto(in_)));
  }
  STRATA_ASSIGN_OR_RETURN(PathCheck check,
                          runtime().db.planning().CheckPath(request().call(), in_.map(), *query_));
  const bool news = !query_->known.has_value() || query_->known->valid != check.valid;
  if (news) *out.mutable_check() = translate::ToProto(check);
  query_->known = std::move(check);
  return news ? News::kSome : News::kNone;
}

absl::string_view PathWatchReactor::shutdown_message() const {
  return "the server is shutting down; ask again after its restart";
}

}  // namespace strata::server
