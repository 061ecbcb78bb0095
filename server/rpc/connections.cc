#include "server/rpc/connections.h"

#include <cstring>
#include <utility>

#include <glog/logging.h>
#include <netinet/in.h>

#include "core/common/log_line.h"

namespace strata::server {
namespace {

constexpr absl::Duration kPause = absl::Seconds(1);
constexpr absl::Duration kBetweenLines = absl::Seconds(1);

sockaddr_storage PeerOf(int socket) {
  sockaddr_storage peer = {};
  socklen_t size = sizeof(peer);
  if (::getpeername(socket, reinterpret_cast<sockaddr*>(&peer), &size) != 0) return {};
  return peer;
}

// Its address as bytes, without the port.
std::string HostOf(const sockaddr_storage& peer) {
  const void* address = &reinterpret_cast<const sockaddr_in6&>(peer).sin6_addr;
  std::size_t size = sizeof(in6_addr);
  if (peer.ss_family == AF_INET) {
    address = &reinterpret_cast<const sockaddr_in&>(peer).sin_addr;
    size = sizeof(in_addr);
  }
  return {static_cast<const char*>(address), size};
}

// After a shutdown what has come in would be read still: some megabytes, and a hundred thousand
// calls.
void Reset(int socket) {
  const sockaddr nobody = {.sa_family = AF_UNSPEC, .sa_data = {}};
  ::connect(socket, &nobody, sizeof(nobody));
}

}  // namespace

std::optional<int> Connections::Add(int socket, absl::Time now) {
  const sockaddr_storage peer = PeerOf(socket);
  absl::MutexLock lock(&mutex_);
  if (WasCut(HostOf(peer), now)) return std::nullopt;
  Lane& lane = lanes_[next_];
  if (lane.connections.size() >= lane.sweep_at) Sweep(lane);
  lane.connections.push_back({socket, peer});
  return static_cast<int>(std::exchange(next_, (next_ + 1) % lanes_.size()));
}

void Connections::Cut(int lane, absl::Time now) {
  absl::MutexLock lock(&mutex_);
  Lane& cut = lanes_[static_cast<std::size_t>(lane)];
  Sweep(cut);
  for (const Connection& connection : cut.connections) {
    Reset(connection.socket);
    hosts_cut_[HostOf(connection.peer)] = now;
  }
  cut_ += cut.connections.size();
  cut.connections.clear();
  if (absl::AbsDuration(now - logged_) < kBetweenLines) return;
  logged_ = now;
  LOG(WARNING) << LogLine("connection")
                      .Add("cut", cut_)
                      .Add("why", "hundreds of calls by them were refused within a second");
}

std::uint64_t Connections::cut() const {
  absl::MutexLock lock(&mutex_);
  return cut_;
}

bool Connections::WasCut(const std::string& host, absl::Time now) {
  // A clock that was set back lets everybody in.
  std::erase_if(hosts_cut_,
                [now](const auto& cut) { return absl::AbsDuration(now - cut.second) > kPause; });
  return hosts_cut_.contains(host);
}

void Connections::Sweep(Lane& lane) {
  // The number of a socket that was closed may be that of another one.
  std::erase_if(lane.connections, [](const Connection& connection) {
    const sockaddr_storage now = PeerOf(connection.socket);
    return now.ss_family == AF_UNSPEC || std::memcmp(&now, &connection.peer, sizeof(now)) != 0;
  });
  lane.sweep_at = 2 * lane.connections.size() + 1;
}

}  // namespace strata::server
