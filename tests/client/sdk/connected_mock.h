// A client of a server around a database that the test decides on.
#ifndef STRATA_TESTS_CLIENT_SDK_CONNECTED_MOCK_H_
#define STRATA_TESTS_CLIENT_SDK_CONNECTED_MOCK_H_

#include <memory>
#include <string>
#include <utility>

#include <gtest/gtest.h>

#include "client/sdk/client.h"
#include "server/server.h"
#include "tests/support/mock_database.h"
#include "tests/support/status_matchers.h"

namespace strata::sdk {

class ConnectedMock : public ::testing::Test {
 protected:
  void SetUp() override {
    StartServer("127.0.0.1:0");
    ClientOptions options;
    options.target = server_->address();
    options.backoff.initial = absl::Milliseconds(1);
    auto client = Connect(options);
    ASSERT_THAT(client, ::strata::testing::IsOk());
    client_ = *std::move(client);
  }
  void TearDown() override {
    client_.reset();
    server_.reset();
  }

  void StartServer(const std::string& listen) {
    server::ServerOptions options;
    options.listen = listen;
    auto server = server::Server::Start(behind_, options);
    ASSERT_THAT(server, ::strata::testing::IsOk());
    server_ = *std::move(server);
  }
  // Ends the server, then starts another one at its address.
  void RestartServer() {
    const std::string address = server_->address();
    server_.reset();
    StartServer(address);
  }

  ::strata::testing::MockDatabase behind_;
  std::unique_ptr<server::Server> server_;
  std::unique_ptr<api::Database> client_;
};

}  // namespace strata::sdk

#endif  // STRATA_TESTS_CLIENT_SDK_CONNECTED_MOCK_H_
