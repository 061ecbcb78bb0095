#include <atomic>
#include <thread>

#include "absl/time/clock.h"
#include "absl/time/time.h"
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "strata/v1/jobs.grpc.pb.h"
#include "tests/server/served_mock.h"

namespace strata::server {
namespace {

using ::strata::testing::IsOk;
using ::strata::testing::StatusIs;
using ::testing::_;
using ::testing::HasSubstr;

class WatchTest : public ServedMock {
 protected:
  void SetUp() override {
    Serve();
    ON_CALL(db_.jobs(), Get(_, _, _)).WillByDefault([this](auto&, auto, std::uint64_t id) {
      JobInfo job;
      job.id = id;
      job.created = job.updated = absl::UnixEpoch();
      const int step = step_;
      if (step == kAway) {
        ++looks_away_;
        return absl::StatusOr<JobInfo>(absl::UnavailableError("store: away"));
      }
      job.progress = 0.25 * step;
      job.state = step == 4 ? JobState::kSucceeded : JobState::kRunning;
      return absl::StatusOr<JobInfo>(job);
    });
    stub_ = v1::Jobs::NewStub(channel_);
    reader_ = stub_->Watch(&context_, v1::WatchJobRequest());
  }

  static constexpr int kAway = -1;
  std::atomic<int> step_ = 1;
  std::atomic<int> looks_away_ = 0;
  std::unique_ptr<v1::Jobs::Stub> stub_;
  grpc::ClientContext context_;
  std::unique_ptr<grpc::ClientReader<v1::WatchJobResponse>> reader_;
  v1::WatchJobResponse message_;
};

TEST_F(WatchTest, TellsEveryChangeOnceAndEndsWithTheJob) {
  for (int step = 1; step <= 4; ++step) {
    step_ = step;
    ASSERT_TRUE(reader_->Read(&message_));
    EXPECT_EQ(message_.job().progress(), 0.25 * step);
  }
  EXPECT_EQ(message_.job().state(), v1::JOB_STATE_SUCCEEDED);
  EXPECT_FALSE(reader_->Read(&message_));
  EXPECT_THAT(translate::FromGrpcStatus(reader_->Finish()), IsOk());
}

// The job goes on meanwhile.
TEST_F(WatchTest, GoesOnWhereTheStoreIsAwayForAWhile) {
  ASSERT_TRUE(reader_->Read(&message_));
  step_ = kAway;
  while (looks_away_ < 3) absl::SleepFor(absl::Milliseconds(10));
  step_ = 4;
  ASSERT_TRUE(reader_->Read(&message_));
  EXPECT_EQ(message_.job().state(), v1::JOB_STATE_SUCCEEDED);
  EXPECT_FALSE(reader_->Read(&message_));
  EXPECT_THAT(translate::FromGrpcStatus(reader_->Finish()), IsOk());
}

TEST_F(WatchTest, AShutdownTellsThatTheJobGoesOn) {
  ASSERT_TRUE(reader_->Read(&message_));
  server_->Shutdown();
  EXPECT_FALSE(reader_->Read(&message_));
  EXPECT_THAT(translate::FromGrpcStatus(reader_->Finish()),
              StatusIs(absl::StatusCode::kUnavailable, HasSubstr("the job goes on")));
}

TEST_F(WatchTest, AReaderMayGoAway) {
  ASSERT_TRUE(reader_->Read(&message_));
  context_.TryCancel();
  EXPECT_EQ(reader_->Finish().error_code(), grpc::StatusCode::CANCELLED);
}

}  // namespace
}  // namespace strata::server
