#include "server/rpc/connections.h"

#include <cerrno>
#include <optional>
#include <string>
#include <utility>

#include "absl/time/time.h"
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

namespace strata::server {
namespace {

// A connection over loopback; the accepting end is the server's.
class Pair {
 public:
  explicit Pair(int family) {
    const int listener = ::socket(family, SOCK_STREAM, 0);
    sockaddr_storage address = {};
    address.ss_family = static_cast<sa_family_t>(family);
    if (family == AF_INET) {
      reinterpret_cast<sockaddr_in&>(address).sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    } else {
      reinterpret_cast<sockaddr_in6&>(address).sin6_addr = in6addr_loopback;
    }
    socklen_t size = family == AF_INET ? sizeof(sockaddr_in) : sizeof(sockaddr_in6);
    if (::bind(listener, reinterpret_cast<sockaddr*>(&address), size) == 0 &&
        ::listen(listener, 1) == 0) {
      ::getsockname(listener, reinterpret_cast<sockaddr*>(&address), &size);
      client_ = ::socket(family, SOCK_STREAM, 0);
      ::connect(client_, reinterpret_cast<sockaddr*>(&address), size);
      server_ = ::accept(listener, reinterpret_cast<sockaddr*>(&address), &size);
    }
    ::close(listener);
  }
  ~Pair() {
    ::close(client_);
    if (server_ >= 0) ::close(server_);
  }
  Pair(const Pair&) = delete;
  Pair& operator=(const Pair&) = delete;

  bool there() const { return server_ >= 0; }
  int server() const { return server_; }
  void CloseServer() { ::close(std::exchange(server_, -1)); }
  void Send(const std::string& bytes) const {
    ASSERT_EQ(::send(client_, bytes.data(), bytes.size(), MSG_NOSIGNAL),
              static_cast<ssize_t>(bytes.size()));
  }
  bool IsCut() const {
    char byte = 0;
    return ::recv(client_, &byte, 1, MSG_DONTWAIT) < 0 && errno == ECONNRESET;
  }
  // What the server can read at once, or -1.
  ssize_t Readable() const {
    char bytes[100];
    return ::recv(server_, bytes, sizeof(bytes), MSG_DONTWAIT);
  }

 private:
  int client_ = -1;
  int server_ = -1;
};

const absl::Time kNow = absl::FromUnixSeconds(1'000'000);

TEST(ConnectionsTest, CutsALaneAndDropsWhatWasNotRead) {
  for (const int family : {AF_INET, AF_INET6}) {
    const Pair one(family);
    const Pair other(family);
    if (!one.there()) continue;  // no loopback of version 6 on this machine
    Connections connections(2);
    EXPECT_EQ(connections.Add(one.server(), kNow), 0);
    EXPECT_EQ(connections.Add(other.server(), kNow), 1);
    one.Send("calls");
    other.Send("calls");
    connections.Cut(0, kNow);
    EXPECT_TRUE(one.IsCut());
    EXPECT_EQ(one.Readable(), -1);
    EXPECT_FALSE(other.IsCut());
    EXPECT_EQ(other.Readable(), 5);
    EXPECT_EQ(connections.cut(), 1U);
  }
}

TEST(ConnectionsTest, ALaneForgetsWhatWasClosed) {
  Pair closed(AF_INET);
  Connections connections(1);
  EXPECT_EQ(connections.Add(closed.server(), kNow), 0);
  closed.CloseServer();
  const Pair next(AF_INET);  // mostly with the same number, and not handed in
  connections.Cut(0, kNow);
  EXPECT_FALSE(next.IsCut());
  EXPECT_EQ(connections.Add(next.server(), kNow), 0);
}

TEST(ConnectionsTest, LanesAreTakenInTurn) {
  const Pair pairs[] = {Pair(AF_INET), Pair(AF_INET), Pair(AF_INET), Pair(AF_INET)};
  Connections connections(3);
  for (int i = 0; i < 4; ++i) EXPECT_EQ(connections.Add(pairs[i].server(), kNow), i % 3);
  connections.Cut(0, kNow);
  EXPECT_TRUE(pairs[0].IsCut());
  EXPECT_FALSE(pairs[1].IsCut());
  EXPECT_TRUE(pairs[3].IsCut());
  EXPECT_EQ(connections.cut(), 2U);
}

TEST(ConnectionsTest, AHostThatWasCutWaitsASecond) {
  const Pair one(AF_INET);
  const Pair again(AF_INET);
  Connections connections(4);
  EXPECT_EQ(connections.Add(one.server(), kNow), 0);
  connections.Cut(0, kNow);
  EXPECT_EQ(connections.Add(again.server(), kNow + absl::Milliseconds(999)), std::nullopt);
  EXPECT_NE(connections.Add(again.server(), kNow + absl::Milliseconds(1'001)), std::nullopt);
  connections.Cut(3, kNow);  // empty
}

}  // namespace
}  // namespace strata::server
