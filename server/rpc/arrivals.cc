#include "server/rpc/arrivals.h"

namespace strata::server {
namespace {

// A call that is cancelled in the very moment never gets to its handler, which would see it leave.
// There are few of those; when nobody has left for so long, they are all there is.
constexpr absl::Duration kForgotten = absl::Seconds(5);

}  // namespace

bool Arrivals::Enter(absl::string_view client, absl::Time now) {
  absl::MutexLock lock(&mutex_);
  const auto found = clients_.find(client);
  Client& entry = found == clients_.end() ? clients_[std::string(client)] : found->second;
  if (entry.here == 0) entry.left = now;
  if (entry.here >= most_) {
    if (now - entry.left < kForgotten) return false;
    entry = {.here = 0, .left = now};
  }
  ++entry.here;
  return true;
}

void Arrivals::Leave(absl::string_view client, absl::Time now) {
  absl::MutexLock lock(&mutex_);
  const auto found = clients_.find(client);
  if (found == clients_.end()) return;
  found->second.left = now;
  if (--found->second.here <= 0) clients_.erase(found);
}

}  // namespace strata::server
