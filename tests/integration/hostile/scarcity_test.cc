// A server that runs out of what the system gives it, and goes on.
#include <array>
#include <chrono>
#include <csignal>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/time/clock.h"
#include "absl/time/time.h"
#include <arpa/inet.h>
#include <fcntl.h>
#include <gmock/gmock.h>
#include <grpcpp/client_context.h>
#include <grpcpp/create_channel.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include "core/common/host_port.h"
#include "strata/v1/maps.grpc.pb.h"
#include "tests/integration/stratad_process.h"
#include "tests/support/paths.h"
#include "tests/support/status_matchers.h"
#include "tests/support/temp_dir.h"

namespace strata::testing {
namespace {

// A hang, not a slow machine.
constexpr std::chrono::seconds kPatience(60);

int ConnectTo(int port) {
  const int made = socket(AF_INET, SOCK_STREAM, 0);
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(static_cast<std::uint16_t>(port));
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  connect(made, reinterpret_cast<sockaddr*>(&address), sizeof(address));
  return made;
}

class ScarcityTest : public ::testing::Test {
 protected:
  std::vector<std::string> Stratad() const {
    return {StratadProgram(),
            "--data",
            (directory_.path() / "maps").string(),
            "--listen",
            "127.0.0.1:0"};
  }
  static std::unique_ptr<v1::Maps::Stub> NewClient(StratadProcess& stratad) {
    grpc::ChannelArguments own;
    own.SetInt(GRPC_ARG_USE_LOCAL_SUBCHANNEL_POOL, 1);
    return v1::Maps::NewStub(
        grpc::CreateCustomChannel(stratad.Address(), grpc::InsecureChannelCredentials(), own));
  }
  static grpc::Status ListMaps(v1::Maps::Stub& maps) {
    grpc::ClientContext context;
    context.set_wait_for_ready(true);
    context.set_deadline(std::chrono::system_clock::now() + kPatience);
    v1::ListMapsResponse out;
    return maps.List(&context, v1::ListMapsRequest(), &out);
  }

  TempDir directory_;
};

TEST_F(ScarcityTest, WhenFilesHaveRunOutAndAreBackNewClientsAreServed) {
  std::vector<std::string> arguments = Stratad();
  arguments.insert(arguments.begin(), "--nofile=256:256");
  StratadProcess stratad("/usr/bin/prlimit", arguments);
  STRATA_ASSERT_OK_AND_ASSIGN(const HostPort address, ParseHostPort(stratad.Address()));
  const auto old = NewClient(stratad);
  EXPECT_TRUE(ListMaps(*old).ok());
  std::vector<int> idle;
  for (int i = 0; i < 300; ++i) idle.push_back(ConnectTo(address.port));
  EXPECT_TRUE(ListMaps(*old).ok()) << "who was there is served";
  for (const int connection : idle) close(connection);
  const grpc::Status listed = ListMaps(*NewClient(stratad));
  EXPECT_TRUE(listed.ok()) << listed.error_message();
  stratad.Signal(SIGTERM);
  EXPECT_EQ(stratad.Wait(), 0);
}

TEST_F(ScarcityTest, ALogThatNobodyReadsStopsNothing) {
  std::array<int, 2> log{};
  ASSERT_EQ(pipe(log.data()), 0);
  fcntl(log[0], F_SETFD, FD_CLOEXEC);
  std::string command = "exec";
  for (const std::string& word : Stratad()) absl::StrAppend(&command, " '", word, "'");
  StratadProcess stratad("/bin/sh", {"-c", absl::StrCat(command, " 2>&", log[1])});
  close(log[1]);
  const auto maps = NewClient(stratad);
  // A line a call: many times what a pipe holds.
  for (int i = 0; i < 3000; ++i) {
    const grpc::Status listed = ListMaps(*maps);
    ASSERT_TRUE(listed.ok()) << "call " << i << ": " << listed.error_message();
  }
  stratad.Signal(SIGTERM);
  EXPECT_EQ(stratad.Wait(), 0);
  close(log[0]);
}

TEST_F(ScarcityTest, ALogWhoseReaderHasGoneStopsNothing) {
  std::array<int, 2> log{};
  ASSERT_EQ(pipe(log.data()), 0);
  fcntl(log[0], F_SETFD, FD_CLOEXEC);
  std::string command = "exec";
  for (const std::string& word : Stratad()) absl::StrAppend(&command, " '", word, "'");
  StratadProcess stratad("/bin/sh", {"-c", absl::StrCat(command, " 2>&", log[1])});
  close(log[1]);
  const auto maps = NewClient(stratad);
  EXPECT_TRUE(ListMaps(*maps).ok());
  close(log[0]);
  for (int i = 0; i < 10; ++i) EXPECT_TRUE(ListMaps(*maps).ok());
  stratad.Signal(SIGTERM);
  EXPECT_EQ(stratad.Wait(), 0);
}

}  // namespace
}  // namespace strata::testing
