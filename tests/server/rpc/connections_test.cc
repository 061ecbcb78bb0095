#include "server/rpc/connections.h"

#include <string>

#include "absl/strings/str_cat.h"
#include <arpa/inet.h>
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
      port_ = family == AF_INET ? ntohs(reinterpret_cast<sockaddr_in&>(address).sin_port)
                                : ntohs(reinterpret_cast<sockaddr_in6&>(address).sin6_port);
    }
    ::close(listener);
  }
  ~Pair() {
    ::close(client_);
    ::close(server_);
  }
  Pair(const Pair&) = delete;
  Pair& operator=(const Pair&) = delete;

  bool there() const { return server_ >= 0; }
  int port() const { return port_; }  // the client's
  bool IsCut() const {
    char byte = 0;
    return ::recv(client_, &byte, 1, MSG_DONTWAIT) == 0;
  }

 private:
  int client_ = -1;
  int server_ = -1;
  int port_ = 0;
};

TEST(CutConnectionTest, EndsTheOneConnectionWithThePeer) {
  const Pair one(AF_INET);
  const Pair other(AF_INET);
  ASSERT_TRUE(one.there());
  ASSERT_TRUE(other.there());
  EXPECT_FALSE(CutConnection("ipv4:127.0.0.1:1"));
  EXPECT_FALSE(CutConnection("unix:/nowhere"));
  EXPECT_FALSE(CutConnection(""));
  EXPECT_FALSE(one.IsCut());
  EXPECT_TRUE(CutConnection(absl::StrCat("ipv4:127.0.0.1:", one.port())));
  EXPECT_TRUE(one.IsCut());
  EXPECT_FALSE(other.IsCut());
}

TEST(CutConnectionTest, KnowsAddressesOfVersion6AsGrpcWritesThem) {
  const Pair one(AF_INET6);
  if (!one.there()) GTEST_SKIP() << "no loopback of version 6 on this machine";
  EXPECT_TRUE(CutConnection(absl::StrCat("ipv6:%5B::1%5D:", one.port())));
  EXPECT_TRUE(one.IsCut());
}

}  // namespace
}  // namespace strata::server
