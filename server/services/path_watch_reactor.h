// Planning.WatchPath: follows whether a path holds.
#ifndef STRATA_SERVER_SERVICES_PATH_WATCH_REACTOR_H_
#define STRATA_SERVER_SERVICES_PATH_WATCH_REACTOR_H_

#include <optional>

#include "core/world/plan.h"
#include "server/rpc/poll.h"
#include "strata/v1/planning.grpc.pb.h"

namespace strata::server {

// Asks again and again, with the answer before as what is known, so that a look at a path where
// nothing changed costs next to nothing. (api::Planning::WatchPath would block a thread.)
class PathWatchReactor final : public PollReactor<v1::WatchPathResponse> {
 public:
  PathWatchReactor(Runtime& runtime,
                   grpc::CallbackServerContext& context,
                   const v1::WatchPathRequest& in);

 private:
  absl::StatusOr<News> Look(v1::WatchPathResponse& out) override;
  absl::string_view shutdown_message() const override;

  const v1::WatchPathRequest& in_;
  std::optional<PathQuery> query_;  // nullopt: there was no look yet
};

}  // namespace strata::server

#endif  // STRATA_SERVER_SERVICES_PATH_WATCH_REACTOR_H_
