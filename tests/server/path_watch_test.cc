#include <atomic>
#include <cstdint>
#include <limits>
#include <memory>

#include "absl/time/clock.h"
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "strata/v1/planning.grpc.pb.h"
#include "tests/server/served_mock.h"

namespace strata::server {
namespace {

using ::strata::testing::StatusIs;
using ::testing::_;
using ::testing::HasSubstr;

class PathWatchTest : public ServedMock {
 protected:
  void SetUp() override {
    Serve();
    ON_CALL(db_.planning(), CheckPath(_, _, _))
        .WillByDefault([this](auto&, auto, const PathQuery& query) {
          ++looks_;
          known_ = query.known.has_value();
          PathCheck check;
          check.valid = valid_;
          check.commit_sequence = ++commit_;
          return absl::StatusOr<PathCheck>(check);
        });
    stub_ = v1::Planning::NewStub(channel_);
  }
  void Watch(double x_m = 1.0) {
    in_.set_map("m");
    in_.add_waypoints()->set_x(x_m);
    reader_ = stub_->WatchPath(&context_, in_);
  }
  void AwaitLooks(int more) const {
    const int enough = looks_ + more;
    while (looks_ < enough) absl::SleepFor(absl::Milliseconds(5));
  }
  absl::Status End() { return translate::FromGrpcStatus(reader_->Finish()); }

  std::atomic<bool> valid_ = true;
  std::atomic<bool> known_ = false;
  std::atomic<int> looks_ = 0;
  std::atomic<int> asked_ = 0;  // whether the map has changed
  std::atomic<std::uint64_t> commit_ = 0;
  v1::WatchPathRequest in_;
  std::unique_ptr<v1::Planning::Stub> stub_;
  grpc::ClientContext context_;
  std::unique_ptr<grpc::ClientReader<v1::WatchPathResponse>> reader_;
  v1::WatchPathResponse message_;
};

TEST_F(PathWatchTest, TellsHowThePathStandsAndWhenThatChanges) {
  Watch();
  ASSERT_TRUE(reader_->Read(&message_));
  EXPECT_TRUE(message_.check().valid());
  EXPECT_EQ(message_.check().commit_sequence(), 1U);
  AwaitLooks(2);
  EXPECT_TRUE(known_);  // a look says what is known already
  valid_ = false;
  ASSERT_TRUE(reader_->Read(&message_));
  EXPECT_FALSE(message_.check().valid());
  AwaitLooks(2);
  valid_ = true;
  ASSERT_TRUE(reader_->Read(&message_));
  EXPECT_TRUE(message_.check().valid());
  server_->Shutdown();
  EXPECT_FALSE(reader_->Read(&message_));
  EXPECT_THAT(End(), StatusIs(absl::StatusCode::kUnavailable, HasSubstr("ask again")));
}

TEST_F(PathWatchTest, IsCheckedAgainOnlyWhenTheMapHasChanged) {
  commit_ = 7;
  ON_CALL(db_.planning(), CheckPath(_, _, _)).WillByDefault([this](auto&, auto, auto&) {
    ++looks_;
    PathCheck check;
    check.valid = looks_ % 2 == 1;
    check.commit_sequence = commit_;
    return absl::StatusOr<PathCheck>(check);
  });
  ON_CALL(db_.maps(), Watch(_, _, _, _))
      .WillByDefault([this](auto&, auto, auto& options, auto sink) {
        EXPECT_TRUE(options.once);
        EXPECT_LE(options.since, commit_);
        ++asked_;
        api::MapUpdate update;
        update.commit_sequence = commit_;
        return sink(update);
      });
  Watch();
  ASSERT_TRUE(reader_->Read(&message_));
  while (asked_ < 3) absl::SleepFor(absl::Milliseconds(5));
  EXPECT_EQ(looks_, 1);
  commit_ = 8;
  ASSERT_TRUE(reader_->Read(&message_));
  EXPECT_EQ(message_.check().commit_sequence(), 8U);
  EXPECT_EQ(looks_, 2);
  context_.TryCancel();
  EXPECT_THAT(End(), StatusIs(absl::StatusCode::kCancelled, _));
}

TEST_F(PathWatchTest, APathThatIsNoneIsRefusedAtTheDoor) {
  Watch(std::numeric_limits<double>::infinity());
  EXPECT_FALSE(reader_->Read(&message_));
  EXPECT_THAT(End(), StatusIs(absl::StatusCode::kInvalidArgument, HasSubstr("waypoint")));
  EXPECT_EQ(looks_, 0);
}

}  // namespace
}  // namespace strata::server
