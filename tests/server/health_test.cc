#include "server/health.h"

#include <atomic>
#include <chrono>
#include <memory>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <google/protobuf/wrappers.pb.h>
#include <grpcpp/client_context.h>
#include <grpcpp/completion_queue.h>
#include <grpcpp/generic/generic_stub.h>
#include <grpcpp/impl/codegen/proto_utils.h>
#include <gtest/gtest.h>

#include "tests/server/raw_call.h"
#include "tests/server/served_mock.h"

namespace strata::server {
namespace {

using Asked = google::protobuf::StringValue;
using Told = google::protobuf::Int32Value;

constexpr int kServing = 1;
constexpr int kNotServing = 2;
constexpr int kServiceUnknown = 3;

// One watch, read a message at a time.
class HealthWatcher {
 public:
  HealthWatcher(const std::shared_ptr<grpc::Channel>& channel, const std::string& service)
      : stub_(channel) {
    context_.set_deadline(std::chrono::system_clock::now() + std::chrono::minutes(1));
    stream_ = stub_.PrepareCall(&context_, Health::kWatch, &queue_);
    stream_->StartCall(this);
    Await();
    Asked asked;
    asked.set_value(service);
    stream_->WriteLast(asked, grpc::WriteOptions(), this);
    Await();
  }
  ~HealthWatcher() {
    context_.TryCancel();
    grpc::Status status;
    stream_->Finish(&status, this);
    Await();
  }
  HealthWatcher(const HealthWatcher&) = delete;
  HealthWatcher& operator=(const HealthWatcher&) = delete;

  // What it is told next; 0: nothing any more.
  int Next() {
    Told told;
    stream_->Read(&told, this);
    return Await() ? told.value() : 0;
  }

 private:
  bool Await() {
    void* tag = nullptr;
    bool ok = false;
    return queue_.Next(&tag, &ok) && ok;
  }

  grpc::TemplatedGenericStub<Asked, Told> stub_;
  grpc::ClientContext context_;
  grpc::CompletionQueue queue_;
  std::unique_ptr<grpc::ClientAsyncReaderWriter<Asked, Told>> stream_;
};

class HealthTest : public ServedMock {
 protected:
  void SetUp() override {
    ServerOptions options;
    options.listen = "127.0.0.1:0";
    STRATA_ASSERT_OK_AND_ASSIGN(
        server_, Server::Start(db_, options, {{"log", [this] { return full_ ? "full" : ""; }}}));
    channel_ = grpc::CreateChannel(server_->address(), grpc::InsecureChannelCredentials());
  }
  grpc::StatusCode Check(const std::string& request) {
    return CallRaw(channel_, Health::kCheck, request).status.error_code();
  }

  std::atomic<bool> full_ = false;
};

TEST_F(HealthTest, AWatchIsToldEachChange) {
  HealthWatcher scans(channel_, "strata.v1.Scans");
  HealthWatcher nothing(channel_, "strata.v1.Nothing");
  EXPECT_EQ(nothing.Next(), kServiceUnknown);
  EXPECT_EQ(scans.Next(), kServing);
  full_ = true;
  EXPECT_EQ(scans.Next(), kNotServing);
  full_ = false;
  EXPECT_EQ(scans.Next(), kServing);
  server_->Shutdown();
  EXPECT_THAT(scans.Next(), ::testing::AnyOf(kNotServing, 0));
}

// A fleet behind one address, each robot watching: what is read is no longer bounded as what waits.
TEST_F(HealthTest, AHostMayHaveManyWatchesOpen) {
  std::vector<std::unique_ptr<HealthWatcher>> watches;
  for (int i = 0; i < 60; ++i) {
    watches.push_back(std::make_unique<HealthWatcher>(channel_, ""));
    ASSERT_EQ(watches.back()->Next(), kServing) << i;
  }
  EXPECT_EQ(Check(""), grpc::StatusCode::OK);
  for (int i = 60; i < 64; ++i) {
    watches.push_back(std::make_unique<HealthWatcher>(channel_, ""));
    ASSERT_EQ(watches.back()->Next(), kServing) << i;
  }
  EXPECT_EQ(HealthWatcher(channel_, "").Next(), 0);
  EXPECT_EQ(Check(""), grpc::StatusCode::OK);
}

TEST_F(HealthTest, WhatIsNoRequestForHealthIsRefused) {
  EXPECT_EQ(Check(""), grpc::StatusCode::OK);
  EXPECT_EQ(Check(std::string("\x0A\x07", 2) + "nothing"), grpc::StatusCode::NOT_FOUND);
  EXPECT_EQ(Check("\x0A"), grpc::StatusCode::INVALID_ARGUMENT);
  EXPECT_EQ(Check(std::string(100'000, '\0')), grpc::StatusCode::INVALID_ARGUMENT);
}

}  // namespace
}  // namespace strata::server
