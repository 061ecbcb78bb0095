// Maps.Watch: follows a map.
#ifndef STRATA_SERVER_SERVICES_MAP_WATCH_REACTOR_H_
#define STRATA_SERVER_SERVICES_MAP_WATCH_REACTOR_H_

#include <cstddef>
#include <cstdint>
#include <deque>
#include <string>

#include "core/api/maps.h"
#include "server/rpc/poll.h"
#include "strata/v1/maps.grpc.pb.h"

namespace strata::server {

// Asks the map again and again what has changed since the last look, and sends that in parts. What
// it holds for a slow reader is one look's updates, as they go out; the next look comes when they
// are sent.
class MapWatchReactor final : public PollReactor<v1::WatchMapRequest, v1::WatchMapResponse> {
 public:
  MapWatchReactor(Runtime& runtime, grpc::CallbackServerContext& context, Sealed<In>& in)
      : PollReactor(runtime, context, "Maps.Watch", in) {}

 private:
  absl::Status Ask(const In& in) override;
  absl::StatusOr<News> Look(Out& out) override;
  std::size_t kept_bytes() const override { return parts_bytes_; }
  absl::string_view shutdown_message() const override;

  // Fills `parts_` with what is new; the first look always finds something.
  absl::Status LookAtMap();
  void AddParts(const api::MapUpdate& update);

  std::string map_;
  bool once_ = false;
  bool looked_ = false;
  api::WatchOptions options_;      // of the next look
  std::deque<std::string> parts_;  // messages to be sent
  std::size_t parts_bytes_ = 0;
  std::uint64_t resume_from_ = 0;  // told last
};

}  // namespace strata::server

#endif  // STRATA_SERVER_SERVICES_MAP_WATCH_REACTOR_H_
