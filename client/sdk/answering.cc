#include "client/sdk/answering.h"

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstddef>
#include <memory>
#include <string>

#include "absl/status/status.h"
#include "absl/strings/ascii.h"
#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/string_view.h"
#include "absl/time/time.h"
#include <netdb.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include "core/common/steady_time.h"

namespace strata::sdk {
namespace {

constexpr absl::Duration kPatience = absl::Seconds(1);

// How HTTP/2 begins, empty settings behind it: whoever speaks it answers with settings of its own,
// others with what they think of it.
constexpr char kHello[] = "PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n\0\0\0\4\0\0\0\0";

class Socket {
 public:
  explicit Socket(const addrinfo& address)
      : fd_(socket(address.ai_family, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0)) {}
  ~Socket() {
    if (fd_ >= 0) close(fd_);
  }
  Socket(const Socket&) = delete;
  Socket& operator=(const Socket&) = delete;

  int fd() const { return fd_; }

  bool WaitFor(short events, absl::Time until) const {
    pollfd wanted{fd_, events, 0};
    const auto ms = static_cast<int>(absl::ToInt64Milliseconds(until - SteadyNow()));
    return poll(&wanted, 1, std::max(0, ms)) == 1;
  }

  // 0, or why there is no connection.
  int Connect(const addrinfo& address, absl::Time until) const {
    if (fd_ < 0) return errno;
    if (connect(fd_, address.ai_addr, address.ai_addrlen) == 0) return 0;
    if (errno != EINPROGRESS) return errno;
    if (!WaitFor(POLLOUT, until)) return ETIMEDOUT;
    int error = 0;
    socklen_t size = sizeof(error);
    getsockopt(fd_, SOL_SOCKET, SO_ERROR, &error, &size);
    return error;
  }

 private:
  int fd_;
};

// What is said to kHello. `heard`: what came first; empty where it was the connection's end.
std::string Said(absl::string_view heard, bool tls) {
  constexpr std::size_t kFrameType = 3;  // behind three bytes of length; 4: settings
  if (absl::StartsWith(heard, "HTTP/1.")) {
    return absl::StrCat("an HTTP server answers there (",
                        absl::StripAsciiWhitespace(heard.substr(0, heard.find('\r'))),
                        "), which is no place for gRPC; is it another port of stratad?");
  }
  if (heard.size() > kFrameType && heard.substr(0, 2) == absl::string_view("\0\0", 2) &&
      heard[kFrameType] == 4) {
    return tls ? "the server there speaks without TLS"
               : "the server there speaks HTTP/2, but slowly; try again";
  }
  const bool is_tls = heard.size() > 1 && heard[1] == 3 && (heard[0] == 0x15 || heard[0] == 0x16);
  if (is_tls || heard.empty()) {
    return tls ? "is what answers there stratad, with a certificate of that authority for that "
                 "name, and does it take ours?"
               : "what answers there wants TLS; name its authority";
  }
  std::string text(heard.substr(0, heard.find_first_of("\r\n")));
  std::replace_if(
      text.begin(), text.end(), [](unsigned char c) { return !absl::ascii_isprint(c); }, '?');
  return absl::StrCat("something else answers there (", text, ")");
}

std::string Talk(const Socket& socket, absl::Time until, bool tls) {
  std::array<char, 80> heard{};
  if (send(socket.fd(), kHello, sizeof(kHello), MSG_NOSIGNAL) < 0 ||
      !socket.WaitFor(POLLIN, until)) {
    return "something takes connections there and says nothing";
  }
  const ssize_t size = recv(socket.fd(), heard.data(), heard.size(), 0);
  return Said({heard.data(), static_cast<std::size_t>(std::max<ssize_t>(0, size))}, tls);
}

}  // namespace

std::string WhatAnswers(const HostPort& address, bool tls) {
  addrinfo wanted{};
  wanted.ai_socktype = SOCK_STREAM;
  addrinfo* found = nullptr;
  const int unknown =
      getaddrinfo(address.host.c_str(), std::to_string(address.port).c_str(), &wanted, &found);
  const std::unique_ptr<addrinfo, decltype(&freeaddrinfo)> owned(found, &freeaddrinfo);
  if (unknown != 0) {
    return absl::StrCat("the name ", address.host, " is not known: ", gai_strerror(unknown));
  }
  const absl::Time until = SteadyNow() + kPatience;
  int error = 0;
  for (const addrinfo* at = found; at != nullptr; at = at->ai_next) {
    const Socket socket(*at);
    error = socket.Connect(*at, until);
    if (error == 0) return Talk(socket, until, tls);
  }
  if (error == ECONNREFUSED) return "nothing listens there; is stratad running?";
  return std::string(absl::ErrnoToStatus(error, "nothing can be reached there").message());
}

}  // namespace strata::sdk
