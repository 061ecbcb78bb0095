// Maps.Watch: follows a map.
#ifndef STRATA_SERVER_SERVICES_MAP_WATCH_REACTOR_H_
#define STRATA_SERVER_SERVICES_MAP_WATCH_REACTOR_H_

#include <cstddef>
#include <deque>
#include <optional>

#include "core/api/maps.h"
#include "server/rpc/poll.h"
#include "strata/v1/maps.grpc.pb.h"

namespace strata::server {

// Asks the map again and again what has changed since the last look, and sends that in parts. What
// it holds for a slow reader is one look's updates; the next look comes when they are sent.
class MapWatchReactor final : public PollReactor<v1::WatchMapResponse> {
 public:
  MapWatchReactor(Runtime& runtime,
                  grpc::CallbackServerContext& context,
                  const v1::WatchMapRequest& in);

 private:
  absl::StatusOr<News> Look(v1::WatchMapResponse& out) override;
  absl::string_view shutdown_message() const override;

  // Fills `updates_` with what is new; the first look always finds something.
  absl::Status LookAtMap();
  // The next part of the first of `updates_`, which goes with its last part.
  void TakePart(v1::WatchMapResponse& out);

  const v1::WatchMapRequest& in_;
  std::optional<api::WatchOptions> options_;  // of the next look; nullopt: there was none yet
  std::deque<api::MapUpdate> updates_;
  std::size_t scans_sent_ = 0;  // of the first update
  std::size_t tiles_sent_ = 0;
  std::uint64_t resume_from_ = 0;  // told last
};

}  // namespace strata::server

#endif  // STRATA_SERVER_SERVICES_MAP_WATCH_REACTOR_H_
