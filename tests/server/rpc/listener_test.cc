#include "server/rpc/listener.h"

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/synchronization/notification.h"
#include "absl/time/clock.h"
#include "absl/time/time.h"
#include <arpa/inet.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <unistd.h>

#include "tests/support/patience.h"
#include "tests/support/status_matchers.h"

namespace strata::server {
namespace {

using ::strata::testing::IsOk;
using ::strata::testing::StatusIs;
using ::testing::HasSubstr;

// A hang, not a slow machine.

// A connection to a port of 127.0.0.1.
class Peer {
 public:
  explicit Peer(int port) : socket_(socket(AF_INET, SOCK_STREAM, 0)) {
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_port = htons(static_cast<std::uint16_t>(port));
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    connect(socket_, reinterpret_cast<sockaddr*>(&address), sizeof(address));
  }
  ~Peer() {
    if (socket_ >= 0) close(socket_);
  }
  Peer(Peer&& other) noexcept : socket_(std::exchange(other.socket_, -1)) {}
  Peer& operator=(Peer&&) = delete;

  // Waits for the other end to close.
  bool Ended() const {
    char byte = 0;
    return recv(socket_, &byte, 1, 0) <= 0;
  }

 private:
  int socket_;
};

TEST(ListenerTest, HandsConnectionsOnAndTellsItsPort) {
  STRATA_ASSERT_OK_AND_ASSIGN(const auto listener, Listener::Open({"127.0.0.1", 0}));
  ASSERT_GT(listener->port(), 0);
  const Peer early(listener->port());  // waits
  absl::Notification taken;
  listener->Accept([&taken](int fd) {
    close(fd);
    taken.Notify();
    return true;
  });
  EXPECT_TRUE(taken.WaitForNotificationWithTimeout(testing::kPatience));
  EXPECT_TRUE(early.Ended());
  EXPECT_EQ(listener->refused(), 0U);
  EXPECT_EQ(listener->since_refused(), absl::InfiniteDuration());
}

TEST(ListenerTest, WhatIsNotTakenIsOfferedAgainOrClosedAtTheEnd) {
  STRATA_ASSERT_OK_AND_ASSIGN(auto listener, Listener::Open({"127.0.0.1", 0}));
  std::atomic<int> offers = 0;
  absl::Notification taken;
  listener->Accept([&](int fd) {
    if (++offers != 3) return false;
    close(fd);
    taken.Notify();
    return true;
  });
  const Peer peer(listener->port());
  EXPECT_TRUE(taken.WaitForNotificationWithTimeout(testing::kPatience));
  EXPECT_TRUE(peer.Ended());
  const Peer never(listener->port());
  while (offers < 5) absl::SleepFor(absl::Milliseconds(1));
  listener.reset();
  EXPECT_TRUE(never.Ended());
}

TEST(ListenerTest, ANameMayHaveSeveralAddresses) {
  STRATA_ASSERT_OK_AND_ASSIGN(const auto listener, Listener::Open({"localhost", 0}));
  absl::Notification taken;
  listener->Accept([&taken](int fd) {
    close(fd);
    taken.Notify();
    return true;
  });
  const Peer peer(listener->port());
  EXPECT_TRUE(taken.WaitForNotificationWithTimeout(testing::kPatience));
}

TEST(ListenerTest, WhatCannotBeListenedOnIsSaid) {
  STRATA_ASSERT_OK_AND_ASSIGN(const auto listener, Listener::Open({"127.0.0.1", 0}));
  EXPECT_THAT(Listener::Open({"127.0.0.1", listener->port()}),
              StatusIs(absl::StatusCode::kUnavailable, HasSubstr("in use")));
  EXPECT_THAT(Listener::Open({"no.such.name.invalid", 0}),
              StatusIs(absl::StatusCode::kNotFound, HasSubstr("no.such.name.invalid")));
}

TEST(ListenerTest, AQuarterOfTheFilesStaysForOthers) {
  rlimit before{};
  ASSERT_EQ(getrlimit(RLIMIT_NOFILE, &before), 0);
  rlimit few = before;
  few.rlim_cur = 400;
  ASSERT_EQ(setrlimit(RLIMIT_NOFILE, &few), 0);
  {
    STRATA_ASSERT_OK_AND_ASSIGN(const auto listener, Listener::Open({"127.0.0.1", 0}));
    std::atomic<std::size_t> taken = 0;
    std::atomic<int> highest = 0;
    std::vector<Peer> peers;
    listener->Accept([&](int fd) {
      highest = std::max(highest.load(), fd);
      ++taken;
      return true;  // stays open
    });
    // Both ends are files of this process, so a peer takes a number, too; it waits for its other
    // end, or slow listeners find nothing but numbers of peers.
    const absl::Time until = absl::Now() + testing::kPatience;
    while (listener->refused() == 0 && absl::Now() < until) {
      peers.emplace_back(listener->port());
      while (taken + listener->refused() < peers.size() && absl::Now() < until) {
        absl::SleepFor(absl::Microseconds(10));
      }
    }
    EXPECT_GT(listener->refused(), 0U);
    EXPECT_LT(listener->since_refused(), absl::Seconds(60));
    EXPECT_GT(taken, 100U);
    EXPECT_LE(highest, 300);
    listener->Close();
    for (int fd = 3; fd <= highest; ++fd) {
      sockaddr_in address{};
      socklen_t size = sizeof(address);
      if (getsockname(fd, reinterpret_cast<sockaddr*>(&address), &size) == 0 &&
          ntohs(address.sin_port) == listener->port()) {
        close(fd);
      }
    }
  }
  ASSERT_EQ(setrlimit(RLIMIT_NOFILE, &before), 0);
}

}  // namespace
}  // namespace strata::server
