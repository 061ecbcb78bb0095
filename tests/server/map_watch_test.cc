#include <atomic>
#include <string>
#include <vector>

#include "absl/base/thread_annotations.h"
#include "absl/strings/str_cat.h"
#include "absl/synchronization/mutex.h"
#include "absl/time/clock.h"
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/common/retry_delay.h"
#include "strata/v1/maps.grpc.pb.h"
#include "tests/server/served_mock.h"

namespace strata::server {
namespace {

using ::strata::testing::IsOk;
using ::strata::testing::StatusIs;
using ::testing::_;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::SizeIs;
using Code = absl::StatusCode;

// A map that stands where the test puts it.
class MapWatchTest : public ServedMock {
 protected:
  void SetUp() override {
    Serve(Options());
    stub_ = v1::Maps::NewStub(channel_);
    ON_CALL(db_.maps(), Watch(_, _, _, _))
        .WillByDefault([this](auto&, auto, const api::WatchOptions& options, auto sink) {
          absl::MutexLock lock(&mutex_);
          asked_.push_back(options);
          api::MapUpdate update;
          update.commit_sequence = now_.commit_sequence;
          update.epoch = now_.epoch;
          return sink(options.since < now_.commit_sequence ? now_ : update);
        });
  }

  virtual ServerOptions Options() const { return {}; }
  void Put(const api::MapUpdate& now) {
    absl::MutexLock lock(&mutex_);
    now_ = now;
  }
  std::vector<api::WatchOptions> asked() {
    absl::MutexLock lock(&mutex_);
    return asked_;
  }
  // Until the map was looked at so many times more.
  void AwaitLooks(std::size_t looks) {
    absl::MutexLock lock(&mutex_);
    const std::size_t enough = asked_.size() + looks;
    const auto looked = [this, enough]() ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_) {
      return asked_.size() >= enough;
    };
    mutex_.Await(absl::Condition(&looked));
  }
  void Watch(const v1::WatchMapRequest& in) { reader_ = stub_->Watch(&context_, in); }
  absl::Status End() { return translate::FromGrpcStatus(reader_->Finish()); }

  static api::MapUpdate Update(std::uint64_t commit_sequence, std::size_t scans) {
    api::MapUpdate update;
    update.commit_sequence = commit_sequence;
    update.epoch = 3;
    for (std::uint64_t i = 1; i <= scans; ++i) {
      update.scans.push_back({{"run", i}, ScanState::kIntegrated, Pose::Identity(), false});
    }
    return update;
  }

  absl::Mutex mutex_;
  api::MapUpdate now_ ABSL_GUARDED_BY(mutex_);
  std::vector<api::WatchOptions> asked_ ABSL_GUARDED_BY(mutex_);
  std::unique_ptr<v1::Maps::Stub> stub_;
  grpc::ClientContext context_;
  std::unique_ptr<grpc::ClientReader<v1::WatchMapResponse>> reader_;
  v1::WatchMapResponse message_;
};

TEST_F(MapWatchTest, TellsWhereTheMapStandsThenEveryChangeOnce) {
  Put(Update(5, 0));
  v1::WatchMapRequest in;
  in.set_name("campus");
  in.set_since(5);
  in.set_epoch(2);
  in.set_trajectory("run");
  in.set_tiles(false);
  Watch(in);
  ASSERT_TRUE(reader_->Read(&message_));
  EXPECT_EQ(message_.commit_sequence(), 5U);
  EXPECT_EQ(message_.epoch(), 3U);
  EXPECT_THAT(message_.scans(), IsEmpty());
  AwaitLooks(2);  // says nothing twice
  Put(Update(9, 2));
  ASSERT_TRUE(reader_->Read(&message_));
  EXPECT_EQ(message_.commit_sequence(), 9U);
  EXPECT_THAT(message_.scans(), SizeIs(2));
  AwaitLooks(2);
  for (const api::WatchOptions& options : asked()) {
    EXPECT_TRUE(options.once);
    EXPECT_FALSE(options.tiles);
    EXPECT_EQ(options.trajectory, "run");
  }
  EXPECT_EQ(asked().front().since, 5U);
  EXPECT_EQ(asked().front().epoch, 2U);
  EXPECT_EQ(asked().back().epoch, 3U);
  EXPECT_EQ(asked().back().since, 9U);
  context_.TryCancel();
  EXPECT_THAT(End(), StatusIs(Code::kCancelled, _));
}

TEST_F(MapWatchTest, OnlyTheLastPartOfAnUpdateMovesTheResumePoint) {
  api::MapUpdate update = Update(40, 2500);
  update.epoch_reason = "job 7";
  update.whole = true;
  for (int x = 0; x < 1030; ++x) update.tiles.push_back({{0, x, -x}, 12, x == 0});
  Put(update);
  v1::WatchMapRequest in;
  in.set_since(11);
  in.set_once(true);
  Watch(in);
  std::vector<std::uint64_t> resume;
  std::vector<int> scans;
  std::vector<int> tiles;
  std::vector<std::string> reasons;
  std::vector<bool> whole;
  std::uint64_t next_scan = 1;
  while (reader_->Read(&message_)) {
    resume.push_back(message_.commit_sequence());
    scans.push_back(message_.scans_size());
    tiles.push_back(message_.tiles_size());
    reasons.push_back(message_.epoch_reason());
    whole.push_back(message_.whole());
    EXPECT_EQ(message_.epoch(), 3U);
    for (const v1::ScanChange& scan : message_.scans()) {
      EXPECT_EQ(scan.id().sequence(), next_scan++);
    }
  }
  EXPECT_THAT(End(), IsOk());
  EXPECT_THAT(resume, ElementsAre(11U, 11U, 40U));
  EXPECT_THAT(scans, ElementsAre(1024, 1024, 452));
  EXPECT_THAT(tiles, ElementsAre(1024, 6, 0));
  EXPECT_THAT(reasons, ElementsAre("job 7", "", ""));
  EXPECT_THAT(whole, ElementsAre(true, false, false));
}

TEST_F(MapWatchTest, OnceEndsEvenWhereNothingIsNew) {
  v1::WatchMapRequest in;
  in.set_once(true);
  Watch(in);
  EXPECT_TRUE(reader_->Read(&message_));
  EXPECT_FALSE(reader_->Read(&message_));
  EXPECT_THAT(End(), IsOk());
  ASSERT_THAT(asked(), SizeIs(1));
  EXPECT_TRUE(asked()[0].tiles);  // the default of the contract
}

TEST_F(MapWatchTest, ASlowReaderHoldsTheLooksUp) {
  // Larger than what gRPC keeps for a reader.
  std::atomic<int> looks = 0;
  ON_CALL(db_.maps(), Watch(_, _, _, _)).WillByDefault([&looks](auto&, auto, auto&, auto sink) {
    api::MapUpdate update = Update(static_cast<std::uint64_t>(++looks), 1024);
    for (api::ScanChange& scan : update.scans) scan.id.trajectory = std::string(100, 'x');
    return sink(update);
  });
  Watch({});
  int before = -1;
  while (before != looks) {
    before = looks;
    absl::SleepFor(absl::Seconds(1));
  }
  // It goes on when it is read, and nothing of it is lost.
  for (int i = 1; i <= before + 1; ++i) {
    ASSERT_TRUE(reader_->Read(&message_));
    EXPECT_EQ(message_.commit_sequence(), static_cast<std::uint64_t>(i));
  }
  context_.TryCancel();
  EXPECT_THAT(End(), StatusIs(Code::kCancelled, _));
}

TEST_F(MapWatchTest, ErrorsEndTheStream) {
  v1::WatchMapRequest in;
  in.set_trajectory("../run");
  Watch(in);
  EXPECT_FALSE(reader_->Read(&message_));
  const absl::Status status = End();
  EXPECT_THAT(status, StatusIs(Code::kInvalidArgument, HasSubstr("trajectory name '../run'")));
  EXPECT_EQ(ReasonOf(status), "REQUEST");
  EXPECT_THAT(asked(), IsEmpty());
}

TEST_F(MapWatchTest, AnUnknownMapIsNotFound) {
  ON_CALL(db_.maps(), Watch(_, _, _, _))
      .WillByDefault(::testing::Return(absl::NotFoundError("map nowhere")));
  Watch({});
  EXPECT_FALSE(reader_->Read(&message_));
  EXPECT_THAT(End(), StatusIs(Code::kNotFound, "map nowhere"));
}

TEST_F(MapWatchTest, AShutdownTellsToResume) {
  Watch({});
  ASSERT_TRUE(reader_->Read(&message_));
  server_->Shutdown();
  EXPECT_FALSE(reader_->Read(&message_));
  const absl::Status status = End();
  EXPECT_THAT(status, StatusIs(Code::kUnavailable, HasSubstr("resume after its restart")));
  EXPECT_EQ(ReasonOf(status), "SHUTTING_DOWN");
}

// A server with room for one call and two watches.
class WatchLimitTest : public MapWatchTest {
 protected:
  ServerOptions Options() const override {
    ServerOptions options;
    options.max_calls = 1;
    options.max_watches = 2;
    return options;
  }
};

TEST_F(WatchLimitTest, WatchersAreNoCallsAndHaveALimitOfTheirOwn) {
  grpc::ClientContext other;
  Watch({});
  const auto second = stub_->Watch(&other, {});
  ASSERT_TRUE(reader_->Read(&message_));
  ASSERT_TRUE(second->Read(&message_));
  ON_CALL(db_.maps(), List(_)).WillByDefault(::testing::Return(std::vector<MapInfo>()));
  v1::ListMapsResponse maps;
  EXPECT_THAT(Call<v1::Maps>(&v1::Maps::Stub::List, v1::ListMapsRequest(), &maps), IsOk());

  grpc::ClientContext refused;
  const auto third = stub_->Watch(&refused, {});
  EXPECT_FALSE(third->Read(&message_));
  const absl::Status status = translate::FromGrpcStatus(third->Finish());
  EXPECT_THAT(status, StatusIs(Code::kResourceExhausted, HasSubstr("2 watches under way")));
  EXPECT_EQ(ReasonOf(status), "SERVER_BUSY");
  EXPECT_NE(RetryDelayOf(status), std::nullopt);

  other.TryCancel();
  second->Finish();
  context_.TryCancel();
  EXPECT_THAT(End(), StatusIs(Code::kCancelled, _));
}

TEST_F(MapWatchTest, ManyWatchersHoldNoThreads) {
  // More than there are threads for streams and queries together.
  constexpr int kWatchers = 64;
  std::vector<std::unique_ptr<grpc::ClientContext>> contexts;
  std::vector<std::unique_ptr<grpc::ClientReader<v1::WatchMapResponse>>> readers;
  for (int i = 0; i < kWatchers; ++i) {
    contexts.push_back(std::make_unique<grpc::ClientContext>());
    readers.push_back(stub_->Watch(contexts.back().get(), {}));
    ASSERT_TRUE(readers.back()->Read(&message_));
  }
  v1::GetMapHistoryResponse history;
  ON_CALL(db_.maps(), History(_, _)).WillByDefault([](auto&, auto) {
    EpochInfo epoch;
    epoch.epoch = 4;
    epoch.created = absl::UnixEpoch();
    return absl::StatusOr<std::vector<EpochInfo>>({epoch});
  });
  EXPECT_THAT(Call<v1::Maps>(&v1::Maps::Stub::History, v1::GetMapHistoryRequest(), &history),
              IsOk());
  ASSERT_THAT(history.epochs(), SizeIs(1));
  EXPECT_EQ(history.epochs(0).epoch(), 4U);
  Put(Update(1, 1));
  for (int i = 0; i < kWatchers; ++i) {
    ASSERT_TRUE(readers[static_cast<std::size_t>(i)]->Read(&message_));
    EXPECT_THAT(message_.scans(), SizeIs(1));
    contexts[static_cast<std::size_t>(i)]->TryCancel();
    readers[static_cast<std::size_t>(i)]->Finish();
  }
}

}  // namespace
}  // namespace strata::server
