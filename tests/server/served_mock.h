// A server on a free port around a database that the test decides on.
#ifndef STRATA_TESTS_SERVER_SERVED_MOCK_H_
#define STRATA_TESTS_SERVER_SERVED_MOCK_H_

#include <memory>
#include <string>

#include <gmock/gmock.h>
#include <grpcpp/client_context.h>
#include <grpcpp/create_channel.h>
#include <gtest/gtest.h>

#include "proto/translate/status.h"
#include "server/server.h"
#include "tests/support/mock_database.h"
#include "tests/support/status_matchers.h"

namespace strata::server {

class ServedMock : public ::testing::Test {
 protected:
  void Serve(ServerOptions options = {}) {
    options.listen = "127.0.0.1:0";
    auto server = Server::Start(db_, options);
    ASSERT_THAT(server, ::strata::testing::IsOk());
    server_ = *std::move(server);
    channel_ = grpc::CreateChannel(server_->address(), grpc::InsecureChannelCredentials());
  }

  // The status of a call on a service's stub as the core knows it.
  template <typename Service, typename Method, typename In, typename Out>
  absl::Status Call(Method method, const In& in, Out* out, grpc::ClientContext* context = nullptr) {
    const auto stub = Service::NewStub(channel_);
    grpc::ClientContext own;
    return translate::FromGrpcStatus(
        (stub.get()->*method)(context == nullptr ? &own : context, in, out));
  }

  static std::string ReasonOf(const absl::Status& status) {
    const auto detail = translate::DetailOf(status);
    return detail.has_value() ? detail->reason() : "none";
  }

  ::strata::testing::MockDatabase db_;
  std::unique_ptr<Server> server_;
  std::shared_ptr<grpc::Channel> channel_;
};

}  // namespace strata::server

#endif  // STRATA_TESTS_SERVER_SERVED_MOCK_H_
