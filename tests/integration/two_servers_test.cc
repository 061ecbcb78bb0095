// Two real servers on one database: one has a map, the other says which; where it dies or freezes
// the other takes over, and nothing that was acknowledged by either is lost or there twice.
#include <array>
#include <atomic>
#include <csignal>
#include <cstdint>
#include <cstdio>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/string_view.h"
#include "absl/synchronization/mutex.h"
#include "absl/time/clock.h"
#include "absl/time/time.h"
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "client/sdk/client.h"
#include "core/common/map_owner.h"
#include "core/common/retry_delay.h"
#include "core/common/status.h"
#include "core/common/steady_time.h"
#include "tests/integration/numbered_scans.h"
#include "tests/integration/stratad_process.h"
#include "tests/support/postgres_cluster.h"
#include "tests/support/status_matchers.h"
#include "tests/support/temp_dir.h"

namespace strata::testing {
namespace {

using ::testing::HasSubstr;

constexpr char kMap[] = "shared";
constexpr std::size_t kPoints = 100;
constexpr absl::Duration kPatience = absl::Seconds(30);

class SharingServer {
 public:
  SharingServer(std::string name, std::string store)
      : name_(std::move(name)), store_(std::move(store)) {}

  void Start() {
    process_ = std::make_unique<StratadProcess>(std::vector<std::string>{"--data",
                                                                         data_.path().string(),
                                                                         "--listen",
                                                                         "127.0.0.1:0",
                                                                         "--store",
                                                                         store_,
                                                                         "--map-lease",
                                                                         "1",
                                                                         "--server-name",
                                                                         name_,
                                                                         "--optimize-every",
                                                                         "0"});
    ClientOptions options;
    options.target = process_->Address();
    options.backoff.max_attempts = 1;  // whoever asks goes to another server
    auto connected = Connect(options);
    STRATA_ASSERT_OK(connected);
    absl::MutexLock lock(&mutex_);
    db_ = *std::move(connected);
  }
  void Kill() {
    process_->Signal(SIGKILL);
    process_->Wait();
  }
  void Signal(int signal) { process_->Signal(signal); }
  std::shared_ptr<api::Database> db() {
    absl::MutexLock lock(&mutex_);
    return db_;
  }

 private:
  const std::string name_;
  const std::string store_;
  const TempDir data_;
  std::unique_ptr<StratadProcess> process_;
  absl::Mutex mutex_;
  std::shared_ptr<api::Database> db_;
};

absl::StatusOr<ScanAck> Put(api::Database& db, const char* map, std::uint64_t sequence) {
  api::Call call;
  call.stop = Stop(SteadyNow() + absl::Seconds(5));
  const PointCloud cloud = NumberedCloud(sequence, kPoints);
  STRATA_ASSIGN_OR_RETURN(const auto upload,
                          db.scans().Upload(call, map, NumberedHeader(sequence, cloud)));
  if (upload->points_held() < cloud.size()) STRATA_RETURN_IF_ERROR(upload->Write(cloud));
  return upload->Finish();
}

class TwoServersTest : public ::testing::Test {
 protected:
  void SetUp() override {
    const auto cluster = SharedPostgresCluster();
    if (absl::IsFailedPrecondition(cluster.status())) GTEST_SKIP() << cluster.status().message();
    STRATA_ASSERT_OK(cluster);
    store_ = (*cluster)->AddressOfOwn(
        ::testing::UnitTest::GetInstance()->current_test_info()->name());
    for (const char* name : {"a", "b"}) {
      servers_.push_back(std::make_unique<SharingServer>(name, store_));
      servers_.back()->Start();
    }
    STRATA_ASSERT_OK(servers_[0]->db()->maps().Create({}, kMap, MapParameters()));
  }
  api::Database& db(int server) {
    held_.push_back(servers_[server]->db());
    return *held_.back();
  }
  // Until `call` is not refused for who asks whom any more.
  static absl::Status Insist(const std::function<absl::Status()>& call) {
    const absl::Time end = absl::Now() + kPatience;
    while (true) {
      absl::Status done = call();
      const bool again = absl::IsUnavailable(done) || absl::IsDeadlineExceeded(done) ||
                         absl::IsCancelled(done);
      if (!again || absl::Now() >= end) return done;
      absl::SleepFor(absl::Milliseconds(20));
    }
  }
  // Sends a scan to one server after the other until one acknowledges it.
  void PutSomewhere(std::uint64_t sequence, std::size_t first) {
    std::size_t server = first;
    STRATA_EXPECT_OK(Insist([&] {
      const auto ack = Put(*servers_[server++ % 2]->db(), kMap, sequence);
      if (ack.ok()) Note(sequence, ack->commit_sequence);
      return ack.status();
    }));
  }
  void Note(std::uint64_t sequence, std::uint64_t number) {
    absl::MutexLock lock(&mutex_);
    numbers_[sequence] = number;
  }
  std::size_t acknowledged() {
    absl::MutexLock lock(&mutex_);
    return numbers_.size();
  }
  // All that was acknowledged is there once, joined, and as if one server had taken it in.
  void CheckAll(int server);

  std::string store_;
  std::vector<std::unique_ptr<SharingServer>> servers_;
  std::vector<std::shared_ptr<api::Database>> held_;
  absl::Mutex mutex_;
  std::map<std::uint64_t, std::uint64_t> numbers_;  // of acknowledged scans
};

absl::StatusOr<MapStats> AtRest(api::Database& db, const char* map) {
  while (true) {
    STRATA_ASSIGN_OR_RETURN(MapStats stats, db.maps().Stats({}, map));
    if (stats.scans_pending == 0) return stats;
    absl::SleepFor(absl::Milliseconds(20));
  }
}

absl::Status Verify(api::Database& db, const char* map) {
  STRATA_ASSIGN_OR_RETURN(const JobInfo job, db.jobs().Start({}, map, "verify", {}));
  JobInfo last;
  STRATA_RETURN_IF_ERROR(db.jobs().Watch({}, map, job.id, [&last](const JobInfo& now) {
    last = now;
    return absl::OkStatus();
  }));
  if (last.state == JobState::kSucceeded) return absl::OkStatus();
  return absl::InternalError(absl::StrCat("verify: ", last.message));
}

void TwoServersTest::CheckAll(int server) {
  api::Database& found = db(server);
  MapStats stats;
  STRATA_ASSERT_OK(Insist([&]() -> absl::Status {
    STRATA_ASSIGN_OR_RETURN(stats, AtRest(found, kMap));
    return absl::OkStatus();
  }));
  EXPECT_EQ(stats.scans, numbers_.size());
  for (const auto& [sequence, number] : numbers_) {
    const auto info = found.scans().Get({}, kMap, {"run", sequence});
    STRATA_ASSERT_OK(info);
    EXPECT_EQ(info->commit_sequence, number) << sequence;
    EXPECT_EQ(info->state, ScanState::kIntegrated) << sequence;
  }
  STRATA_EXPECT_OK(Insist([&] { return Verify(found, kMap); }));
  STRATA_ASSERT_OK(found.maps().Create({}, "alone", MapParameters()));
  for (const auto& [sequence, number] : numbers_) STRATA_ASSERT_OK(Put(found, "alone", sequence));
  STRATA_ASSERT_OK_AND_ASSIGN(const MapStats alone, AtRest(found, "alone"));
  EXPECT_EQ(stats.content_digest, alone.content_digest);
}

TEST_F(TwoServersTest, TheOneWithoutTheMapSaysWhoHasIt) {
  STRATA_ASSERT_OK(Put(db(0), kMap, 1));
  const absl::Status refused = Put(db(1), kMap, 2).status();
  EXPECT_THAT(refused, StatusIs(absl::StatusCode::kUnavailable, HasSubstr("server a")));
  EXPECT_EQ(MapOwnerOf(refused), "a");
  EXPECT_TRUE(RetryDelayOf(refused).has_value());
  EXPECT_EQ(MapOwnerOf(db(1).maps().Delete({}, kMap)), "a");
  const auto names = db(1).maps().List({});
  STRATA_ASSERT_OK(names);
  ASSERT_EQ(names->size(), 1U);
  EXPECT_EQ(names->front().name, kMap);
  // Other maps are other matters, and what one server removes the other has no more.
  STRATA_ASSERT_OK(db(1).maps().Create({}, "other", MapParameters()));
  EXPECT_EQ(MapOwnerOf(Put(db(0), "other", 1).status()), "b");
  STRATA_EXPECT_OK(db(1).maps().Delete({}, "other"));
  STRATA_EXPECT_OK(Insist([&] {
    const absl::Status gone = db(0).maps().Get({}, "other").status();
    return absl::IsNotFound(gone) ? absl::OkStatus() : gone;
  }));
  // A server that ends gives its maps up at once.
  servers_[0]->Signal(SIGTERM);
  const absl::Time ended = absl::Now();
  STRATA_EXPECT_OK(Insist([&] { return Put(db(1), kMap, 2).status(); }));
  std::printf("taken over after %s\n", absl::FormatDuration(absl::Now() - ended).c_str());
}

TEST_F(TwoServersTest, WhenTheOwnerIsKilledTheOtherTakesOverAndNothingIsLost) {
  constexpr std::uint64_t kRobots = 3;
  constexpr std::size_t kKills = 2;
  std::atomic<bool> stop = false;
  std::vector<std::thread> robots;
  for (std::uint64_t robot = 0; robot < kRobots; ++robot) {
    robots.emplace_back([&, robot] {
      for (std::uint64_t i = 0; !stop; ++i) PutSomewhere(1 + robot + kRobots * i, robot + i);
    });
  }
  for (std::size_t kill = 0; kill < kKills; ++kill) {
    const std::size_t before = acknowledged();
    const absl::Time end = absl::Now() + kPatience;
    while (acknowledged() < before + 10 && absl::Now() < end) absl::SleepFor(absl::Milliseconds(5));
    EXPECT_GE(acknowledged(), before + 10) << "nobody took over";
    servers_[kill % 2]->Kill();
    absl::SleepFor(absl::Milliseconds(1500));
    servers_[kill % 2]->Start();
  }
  stop = true;
  for (std::thread& robot : robots) robot.join();
  std::printf("%zu acknowledged\n", acknowledged());
  CheckAll(static_cast<int>(kKills % 2));
}

TEST_F(TwoServersTest, AFrozenOwnerThatWakesUpWritesNothingMore) {
  PutSomewhere(1, 0);
  std::uint64_t sequence = 2;
  for (int round = 0; round < 3; ++round) {
    const int owner = round % 2;
    const int other = 1 - owner;
    // Uploads are on their way at the moment it freezes, and go on where it stopped.
    std::vector<std::thread> robots;
    for (int robot = 0; robot < 4; ++robot) {
      const std::uint64_t mine = sequence++;
      robots.emplace_back([&, mine] {
        const auto ack = Put(*servers_[owner]->db(), kMap, mine);
        if (ack.ok()) Note(mine, ack->commit_sequence);
      });
    }
    absl::SleepFor(absl::Milliseconds(3));
    servers_[owner]->Signal(SIGSTOP);
    PutSomewhere(sequence++, static_cast<std::size_t>(other));
    STRATA_EXPECT_OK(Put(db(other), kMap, sequence).status());
    Note(sequence, Put(db(other), kMap, sequence)->commit_sequence);
    ++sequence;
    servers_[owner]->Signal(SIGCONT);
    for (std::thread& robot : robots) robot.join();
    // Awake, it knows at once, and does not answer from what it remembers.
    const absl::Status read = db(owner).maps().Stats({}, kMap).status();
    EXPECT_THAT(read, StatusIs(absl::StatusCode::kUnavailable, ::testing::_));
  }
  // Whatever was not acknowledged then is sent again.
  for (std::uint64_t again = 1; again < sequence; ++again) PutSomewhere(again, 0);
  EXPECT_EQ(acknowledged(), sequence - 1);
  CheckAll(1);
}

}  // namespace
}  // namespace strata::testing
