#include "client/sdk/answering.h"

#include <array>
#include <cstdint>
#include <string>
#include <thread>

#include <arpa/inet.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include "client/sdk/client.h"
#include "tests/client/sdk/connected_mock.h"

namespace strata::sdk {
namespace {

using ::strata::testing::StatusIs;
using ::testing::AllOf;
using ::testing::HasSubstr;

// A port of 127.0.0.1.
class Port {
 public:
  Port() : socket_(::socket(AF_INET, SOCK_STREAM, 0)) {
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    EXPECT_EQ(bind(socket_, reinterpret_cast<sockaddr*>(&address), sizeof(address)), 0);
    socklen_t size = sizeof(address);
    getsockname(socket_, reinterpret_cast<sockaddr*>(&address), &size);
    address_ = {"127.0.0.1", ntohs(address.sin_port)};
  }
  ~Port() { close(socket_); }
  Port(const Port&) = delete;
  Port& operator=(const Port&) = delete;

  const HostPort& address() const { return address_; }
  int socket() const { return socket_; }

 private:
  int socket_;
  HostPort address_;
};

// What is said of a port that takes a connection, hears something, says `answer`, and closes.
std::string WhatSays(const std::string& answer, bool tls) {
  const Port port;
  EXPECT_EQ(listen(port.socket(), 1), 0);
  std::thread other([&] {
    const int connection = accept(port.socket(), nullptr, nullptr);
    std::array<char, 200> heard;
    EXPECT_GT(recv(connection, heard.data(), heard.size(), 0), 0);
    send(connection, answer.data(), answer.size(), MSG_NOSIGNAL);
    close(connection);
  });
  const std::string what = WhatAnswers(port.address(), tls);
  other.join();
  return what;
}

TEST(AnsweringTest, OthersThanStratadAreKnownByWhatTheySay) {
  EXPECT_THAT(WhatSays("HTTP/1.1 400 Bad Request\r\nContent-Length: 0\r\n\r\n", false),
              HasSubstr("an HTTP server answers there (HTTP/1.1 400 Bad Request)"));
  EXPECT_THAT(WhatSays("SSH-2.0-OpenSSH_9.2p1\r\n", true),
              HasSubstr("something else answers there (SSH-2.0-OpenSSH_9.2p1)"));
  EXPECT_THAT(WhatSays("\x1b[31m\n", false), HasSubstr("(?[31m)"));
  EXPECT_THAT(WhatSays(std::string("\x15\x03\x01\x00\x02\x02\x46", 7), false),
              HasSubstr("wants TLS"));
  EXPECT_THAT(WhatSays("", false), HasSubstr("wants TLS"));
  EXPECT_THAT(WhatSays("", true), HasSubstr("certificate of that authority"));
}

TEST(AnsweringTest, NothingListens) {
  const Port bound_only;
  EXPECT_THAT(WhatAnswers(bound_only.address(), false), HasSubstr("nothing listens there"));
  EXPECT_THAT(WhatAnswers({"no-such-host.invalid", 1}, false),
              HasSubstr("the name no-such-host.invalid is not known"));
}

TEST(AnsweringTest, SomethingListensAndSaysNothing) {
  const Port port;
  ASSERT_EQ(listen(port.socket(), 1), 0);
  EXPECT_THAT(WhatAnswers(port.address(), false), HasSubstr("says nothing"));
}

using AnsweringServerTest = ConnectedMock;

TEST_F(AnsweringServerTest, StratadWithoutTls) {
  EXPECT_THAT(WhatAnswers(*ParseHostPort(server_->address()), true),
              HasSubstr("speaks without TLS"));
}

TEST_F(AnsweringServerTest, ConnectSaysWhatAnswers) {
  const Port bound_only;
  ClientOptions options;
  options.target = bound_only.address().ToString();
  options.connect_timeout = absl::Milliseconds(50);
  EXPECT_THAT(Connect(options).status(),
              StatusIs(absl::StatusCode::kUnavailable,
                       AllOf(HasSubstr("no server answers"), HasSubstr("nothing listens there"))));
}

}  // namespace
}  // namespace strata::sdk
