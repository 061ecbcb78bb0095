#include "server/rpc/listener.h"

#include <algorithm>
#include <cerrno>
#include <climits>
#include <cstddef>
#include <cstring>
#include <string>
#include <utility>

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"
#include "absl/time/clock.h"
#include <fcntl.h>
#include <glog/logging.h>
#include <netdb.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <sys/eventfd.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <unistd.h>

#include "core/common/log_line.h"
#include "core/common/status.h"
#include "core/common/steady_time.h"
#include "core/common/this_thread.h"

namespace strata::server {
namespace {

// Where the files have run out altogether: until somebody gives one back. Also between offers of a
// connection that was not taken.
constexpr absl::Duration kPause = absl::Milliseconds(100);
constexpr std::uint64_t kRefusalsALogLine = 1000;

int MostConnectionFd() {
  rlimit files{};
  if (getrlimit(RLIMIT_NOFILE, &files) != 0) return INT_MAX;
  return static_cast<int>(std::min<rlim_t>(files.rlim_cur / 4 * 3, INT_MAX));
}

void SetOption(int socket, int level, int option, int value) {
  setsockopt(socket, level, option, &value, sizeof(value));
}

// A listening socket, or -1 with errno.
int ListenOn(const addrinfo& where, int port) {
  const int made = socket(where.ai_family, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0);
  if (made < 0) return -1;
  SetOption(made, SOL_SOCKET, SO_REUSEADDR, 1);
  SetOption(made, IPPROTO_TCP, TCP_NODELAY, 1);  // connections take after it
  // [::] means IPv4, too, whatever the system's default is.
  if (where.ai_family == AF_INET6) SetOption(made, IPPROTO_IPV6, IPV6_V6ONLY, 0);
  sockaddr_storage address{};
  std::memcpy(&address, where.ai_addr, where.ai_addrlen);
  // At the same place in both.
  reinterpret_cast<sockaddr_in*>(&address)->sin_port = htons(static_cast<std::uint16_t>(port));
  if (bind(made, reinterpret_cast<const sockaddr*>(&address), where.ai_addrlen) == 0 &&
      listen(made, SOMAXCONN) == 0) {
    return made;
  }
  const int error = errno;
  close(made);
  errno = error;
  return -1;
}

int PortOf(int socket) {
  sockaddr_storage address{};
  socklen_t size = sizeof(address);
  getsockname(socket, reinterpret_cast<sockaddr*>(&address), &size);
  return ntohs(reinterpret_cast<const sockaddr_in*>(&address)->sin_port);
}

}  // namespace

absl::StatusOr<std::unique_ptr<Listener>> Listener::Open(const HostPort& address) {
  addrinfo hints{};
  hints.ai_flags = AI_PASSIVE;
  hints.ai_socktype = SOCK_STREAM;
  addrinfo* found = nullptr;
  if (const int error = getaddrinfo(address.host.c_str(), nullptr, &hints, &found); error != 0) {
    return absl::NotFoundError(
        absl::StrCat("cannot listen on ", address.ToString(), ": ", gai_strerror(error)));
  }
  std::unique_ptr<Listener> listener(new Listener());
  listener->port_ = address.port;
  int error = 0;
  for (const addrinfo* each = found; each != nullptr; each = each->ai_next) {
    const int socket = ListenOn(*each, listener->port_);
    if (socket < 0) {
      error = errno;
      continue;
    }
    listener->sockets_.push_back(socket);
    listener->port_ = PortOf(socket);
  }
  freeaddrinfo(found);
  listener->wake_ = eventfd(0, EFD_CLOEXEC);
  if (listener->sockets_.empty() || listener->wake_ < 0) {
    return absl::UnavailableError(absl::StrCat("cannot listen on ",
                                               address.ToString(),
                                               ": ",
                                               std::strerror(error),
                                               "; is the port in use?"));
  }
  listener->most_fd_ = MostConnectionFd();
  return listener;
}

void Listener::Accept(Take take) {
  take_ = std::move(take);
  thread_ = std::thread([this] { Loop(); });
}

void Listener::Close() {
  if (thread_.joinable()) {
    eventfd_write(wake_, 1);
    thread_.join();
  }
  for (const int socket : sockets_) close(socket);
  sockets_.clear();
  for (const int held : held_) close(held);
  held_.clear();
  if (wake_ >= 0) close(std::exchange(wake_, -1));
}

absl::Duration Listener::since_refused() const {
  const std::int64_t at_ms = refused_at_ms_;
  return at_ms < 0 ? absl::InfiniteDuration() : SteadyNow() - absl::FromUnixMillis(at_ms);
}

void Listener::Loop() {
  NameThisThread("accept");
  std::vector<pollfd> waited;
  for (const int socket : sockets_)
    waited.push_back({.fd = socket, .events = POLLIN, .revents = 0});
  waited.push_back({.fd = wake_, .events = POLLIN, .revents = 0});
  while (true) {
    const int patience_ms = held_.empty() ? -1 : static_cast<int>(kPause / absl::Milliseconds(1));
    if (poll(waited.data(), waited.size(), patience_ms) < 0) continue;
    if (waited.back().revents != 0) return;
    OfferHeld();
    bool files_left = true;
    for (const int socket : sockets_) files_left = AcceptAll(socket) && files_left;
    if (!files_left) absl::SleepFor(kPause);
  }
}

bool Listener::AcceptAll(int socket) {
  while (true) {
    const int fd = accept4(socket, nullptr, nullptr, SOCK_NONBLOCK | SOCK_CLOEXEC);
    if (fd > most_fd_) {
      Refuse(fd);
    } else if (fd >= 0) {
      if (!take_(fd)) held_.push_back(fd);
    } else if (errno == EAGAIN) {
      return true;
    } else if (errno != ECONNABORTED && errno != EINTR) {
      Refuse(-1);
      return false;
    }
  }
}

void Listener::OfferHeld() {
  const absl::Time now = SteadyNow();
  if (now - offered_ < kPause) return;
  offered_ = now;
  std::erase_if(held_, [this](int fd) { return take_(fd); });
}

void Listener::Refuse(int fd) {
  if (fd >= 0) close(fd);
  refused_at_ms_ = absl::ToUnixMillis(SteadyNow());
  if (refused_++ % kRefusalsALogLine != 0) return;
  LOG(WARNING) << LogLine("connection")
                      .Add("refused", refused_.load())
                      .Add("why", "three quarters of the files this process may open are in use");
}

}  // namespace strata::server
