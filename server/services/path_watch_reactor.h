// Planning.WatchPath: follows whether a path holds.
#ifndef STRATA_SERVER_SERVICES_PATH_WATCH_REACTOR_H_
#define STRATA_SERVER_SERVICES_PATH_WATCH_REACTOR_H_

#include <cstddef>
#include <string>

#include "absl/time/time.h"

#include "core/world/plan.h"
#include "server/rpc/poll.h"
#include "strata/v1/planning.grpc.pb.h"

namespace strata::server {

// Asks again when the map has changed, with the answer before as what is known.
// (api::Planning::WatchPath would block a thread.)
class PathWatchReactor final : public PollReactor<v1::WatchPathRequest, v1::WatchPathResponse> {
 public:
  PathWatchReactor(Runtime& runtime, grpc::CallbackServerContext& context, Sealed<In>& in)
      : PollReactor(runtime, context, "Planning.WatchPath", in) {}

 private:
  absl::Status Ask(const In& in) override;
  absl::StatusOr<News> Look(Out& out) override;
  std::size_t kept_bytes() const override;
  absl::Duration patience() const override { return absl::Seconds(10); }
  absl::string_view shutdown_message() const override;

  // Whether the map is as it was at the look before.
  absl::StatusOr<bool> Unchanged();

  std::string map_;
  PathQuery query_;
};

}  // namespace strata::server

#endif  // STRATA_SERVER_SERVICES_PATH_WATCH_REACTOR_H_
