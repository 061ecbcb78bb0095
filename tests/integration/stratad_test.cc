// A real server, real clients, and the worst that can happen to them.
#include <cmath>
#include <csignal>
#include <map>
#include <memory>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "absl/base/thread_annotations.h"
#include "absl/strings/str_cat.h"
#include "absl/synchronization/mutex.h"
#include "absl/time/clock.h"
#include "absl/time/time.h"
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "client/sdk/client.h"
#include "core/common/status.h"
#include "tests/integration/stratad_process.h"
#include "tests/support/patience.h"
#include "tests/support/status_matchers.h"
#include "tests/support/temp_dir.h"

namespace strata::testing {
namespace {

using ::testing::HasSubstr;

constexpr char kMap[] = "world";

class StratadTest : public ::testing::Test {
 protected:
  std::vector<std::string> Arguments(const std::string& listen = "127.0.0.1:0") const {
    return {"--data", (directory_.path() / "maps").string(), "--listen", listen};
  }

  std::unique_ptr<api::Database> ConnectTo(StratadProcess& process, int max_attempts = 6) {
    ClientOptions options;
    options.target = process.Address();
    options.backoff.max_attempts = max_attempts;
    auto client = Connect(options);
    EXPECT_THAT(client, IsOk());
    return client.ok() ? *std::move(client) : nullptr;
  }

  TempDir directory_;
};

// A ring of points on a sloping floor; every sequence has its own.
PointCloud CloudOf(std::uint64_t sequence) {
  PointCloud cloud;
  for (int i = 0; i < 20'000; ++i) {
    const auto angle = static_cast<float>(i) * 0.0314159F;
    const float range = 1.0F + 0.0005F * static_cast<float>(i);
    cloud.points.emplace_back(range * std::cos(angle),
                              range * std::sin(angle),
                              0.01F * range + 0.001F * static_cast<float>(sequence % 7));
  }
  return cloud;
}

absl::StatusOr<ScanAck> Upload(api::Database& db, const ScanId& id) {
  const PointCloud cloud = CloudOf(id.sequence);
  ScanHeader header;
  header.id = id;
  header.T_map_scan =
      MakePose(Eigen::Quaterniond::Identity(), {0.5 * static_cast<double>(id.sequence), 0.0, 0.0});
  header.sensor_origin.z() = 1.0F;
  header.alignment = Alignment::kOff;
  header.point_count = cloud.size();
  STRATA_ASSIGN_OR_RETURN(const auto upload, db.scans().Upload({}, kMap, header));
  STRATA_RETURN_IF_ERROR(upload->Write(cloud));
  return upload->Finish();
}

// Uploads `trajectory` from where the server has it to `last`; what was acknowledged is counted.
class Robot {
 public:
  Robot(std::string trajectory, std::uint64_t last)
      : trajectory_(std::move(trajectory)), last_(last) {}

  absl::Status Run(api::Database& db) {
    STRATA_ASSIGN_OR_RETURN(const UploadState state,
                            db.scans().GetUploadState({}, kMap, trajectory_));
    for (std::uint64_t next = state.last_sequence + 1; next <= last_; ++next) {
      STRATA_RETURN_IF_ERROR(Upload(db, {trajectory_, next}).status());
      absl::MutexLock lock(&mutex_);
      acknowledged_ = next;
    }
    return absl::OkStatus();
  }
  std::uint64_t acknowledged() {
    absl::MutexLock lock(&mutex_);
    return acknowledged_;
  }
  void AwaitAcknowledged(std::uint64_t sequence) {
    const auto reached = [this, sequence]() ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_) {
      return acknowledged_ >= sequence;
    };
    absl::MutexLock lock(&mutex_, absl::Condition(&reached));
  }

 private:
  const std::string trajectory_;
  const std::uint64_t last_;
  absl::Mutex mutex_;
  std::uint64_t acknowledged_ ABSL_GUARDED_BY(mutex_) = 0;
};

void ExpectVerified(api::Database& db) {
  STRATA_ASSERT_OK_AND_ASSIGN(const JobInfo job, db.jobs().Start({}, kMap, "verify", {}));
  JobInfo last;
  STRATA_ASSERT_OK(db.jobs().Watch({}, kMap, job.id, [&last](const JobInfo& now) {
    last = now;
    return absl::OkStatus();
  }));
  EXPECT_EQ(last.state, JobState::kSucceeded) << last.message;
}

TEST_F(StratadTest, PrintsItsAddressAndEndsWellOnSigterm) {
  StratadProcess stratad(Arguments());
  EXPECT_THAT(stratad.Address(), ::testing::MatchesRegex("127\\.0\\.0\\.1:[1-9][0-9]*"));
  const auto db = ConnectTo(stratad);
  STRATA_EXPECT_OK(db->maps().Create({}, kMap, {}));
  stratad.Signal(SIGTERM);
  EXPECT_EQ(stratad.Wait(), 0);
  EXPECT_EQ(stratad.ReadLine(), "");  // nothing else was printed
}

// Ten seconds after the last change; what is prepared then outlives the process.
TEST_F(StratadTest, AMapAtRestIsPreparedForPlansAndStaysSo) {
  MapStats rested;
  {
    StratadProcess stratad(Arguments());
    const auto db = ConnectTo(stratad);
    STRATA_ASSERT_OK(db->maps().Create({}, kMap, {}));
    STRATA_ASSERT_OK(Upload(*db, {"robot", 1}));
    STRATA_ASSERT_OK(Upload(*db, {"robot", 60}));
    const absl::Time deadline = absl::Now() + kPatience;
    do {
      ASSERT_LT(absl::Now(), deadline);
      absl::SleepFor(absl::Milliseconds(100));
      STRATA_ASSERT_OK_AND_ASSIGN(rested, db->maps().Stats({}, kMap));
    } while (rested.scans_pending > 0 || rested.tiles_prepared < rested.tiles);
    EXPECT_GT(rested.tiles_prepared, 1U);
    stratad.Signal(SIGKILL);
    EXPECT_EQ(stratad.Wait(), -SIGKILL);
  }
  StratadProcess stratad(Arguments());
  const auto db = ConnectTo(stratad);
  EXPECT_EQ(db->maps().Stats({}, kMap)->tiles_prepared, rested.tiles_prepared);
  ExpectVerified(*db);
}

TEST_F(StratadTest, RefusesToListenBeyondLoopback) {
  StratadProcess stratad(Arguments("0.0.0.0:0"));
  EXPECT_EQ(stratad.ReadLine(), "");
  EXPECT_EQ(stratad.Wait(), 1);
  StratadProcess usage({"--no-such-option"});
  EXPECT_EQ(usage.Wait(), 2);
  for (const char* seconds : {"nan", "-1", "1e9", "soon"}) {
    StratadProcess drain({"--data", directory_.path().string(), "--drain", seconds});
    EXPECT_EQ(drain.Wait(), 2) << seconds;
  }
}

TEST_F(StratadTest, TwoRobotsUploadAtOnce) {
  constexpr std::uint64_t kScans = 20;
  StratadProcess stratad(Arguments());
  const auto db = ConnectTo(stratad);
  STRATA_ASSERT_OK(db->maps().Create({}, kMap, {}));
  Robot red("red", kScans);
  Robot blue("blue", kScans);
  const auto drive = [&](Robot& robot) {
    const auto own = ConnectTo(stratad);
    STRATA_EXPECT_OK(robot.Run(*own));
  };
  std::thread first([&] { drive(red); });
  std::thread second([&] { drive(blue); });
  first.join();
  second.join();
  STRATA_ASSERT_OK_AND_ASSIGN(const MapStats stats, db->maps().Stats({}, kMap));
  EXPECT_EQ(stats.scans, 2 * kScans);
  EXPECT_EQ(stats.points, 2 * kScans * 20'000);
  ExpectVerified(*db);
}

TEST_F(StratadTest, KilledDuringUploadsItHasWhatItAcknowledgedAndGoesOn) {
  constexpr std::uint64_t kScans = 40;
  Robot red("red", kScans);
  Robot blue("blue", kScans);
  {
    StratadProcess stratad(Arguments());
    STRATA_ASSERT_OK(ConnectTo(stratad)->maps().Create({}, kMap, {}));
    const auto drive = [&](Robot& robot) {
      const auto own = ConnectTo(stratad, 1);
      EXPECT_THAT(robot.Run(*own), StatusIs(absl::StatusCode::kUnavailable, ::testing::_));
    };
    std::thread first([&] { drive(red); });
    std::thread second([&] { drive(blue); });
    red.AwaitAcknowledged(5);
    stratad.Signal(SIGKILL);
    EXPECT_EQ(stratad.Wait(), -SIGKILL);
    first.join();
    second.join();
  }
  StratadProcess stratad(Arguments());
  const auto db = ConnectTo(stratad);
  for (auto& [name, robot] : std::map<std::string, Robot*>{{"red", &red}, {"blue", &blue}}) {
    const std::uint64_t acknowledged = robot->acknowledged();
    for (std::uint64_t sequence = 1; sequence <= acknowledged; ++sequence) {
      PointCloud back;
      STRATA_EXPECT_OK(
          db->scans().GetPoints({}, kMap, {name, sequence}, [&back](const PointCloud& piece) {
            back.points.insert(back.points.end(), piece.points.begin(), piece.points.end());
            return absl::OkStatus();
          }));
      EXPECT_EQ(back.points, CloudOf(sequence).points) << name << "/" << sequence;
    }
    STRATA_EXPECT_OK(robot->Run(*db));  // from where the server has it
    STRATA_ASSERT_OK_AND_ASSIGN(const UploadState state,
                                db->scans().GetUploadState({}, kMap, name));
    EXPECT_EQ(state.scans, kScans);
  }
  ExpectVerified(*db);
}

TEST_F(StratadTest, AShutdownEndsAWatchAndTheJobGoesOnAfterwards) {
  JobInfo last;
  // A job that ends before the signal is no failure, so there are several tries.
  for (int attempt = 0; attempt < 10; ++attempt) {
    SCOPED_TRACE(attempt);
    StratadProcess stratad(Arguments());
    const auto db = ConnectTo(stratad, 1);
    if (attempt == 0) {
      STRATA_ASSERT_OK(db->maps().Create({}, kMap, {}));
      Robot red("red", 40);
      STRATA_ASSERT_OK(red.Run(*db));
    }
    STRATA_ASSERT_OK_AND_ASSIGN(last, db->jobs().Start({}, kMap, "rebuild", {{"threads", "1"}}));
    const absl::Status ended = db->jobs().Watch({}, kMap, last.id, [&](const JobInfo& now) {
      last = now;
      if (now.state == JobState::kRunning) stratad.Signal(SIGTERM);
      return absl::OkStatus();
    });
    stratad.Signal(SIGTERM);
    EXPECT_EQ(stratad.Wait(), 0);
    if (IsFinal(last.state)) continue;
    EXPECT_THAT(ended, StatusIs(absl::StatusCode::kUnavailable, ::testing::_));
    break;
  }
  ASSERT_FALSE(IsFinal(last.state)) << "every job ended before the shutdown";
  StratadProcess stratad(Arguments());
  const auto db = ConnectTo(stratad);
  STRATA_ASSERT_OK(db->jobs().Watch({}, kMap, last.id, [&last](const JobInfo& now) {
    last = now;
    return absl::OkStatus();
  }));
  EXPECT_EQ(last.state, JobState::kSucceeded) << last.message;
  ExpectVerified(*db);
}

TEST_F(StratadTest, AClientRidesOutARestart) {
  {
    StratadProcess stratad(Arguments());
    const std::string address = stratad.Address();
    STRATA_ASSERT_OK(ConnectTo(stratad)->maps().Create({}, kMap, {}));
    const auto db = ConnectTo(stratad);
    STRATA_ASSERT_OK_AND_ASSIGN(const auto before, db->maps().Get({}, kMap));
    stratad.Signal(SIGKILL);
    stratad.Wait();
    StratadProcess again(Arguments(address));
    ASSERT_EQ(again.Address(), address);
    // The same connection, and an upload that is repeated by itself.
    STRATA_EXPECT_OK(Upload(*db, {"run", 1}));
    STRATA_ASSERT_OK_AND_ASSIGN(const auto after, db->maps().Get({}, kMap));
    EXPECT_EQ(after.created, before.created);
  }
}

}  // namespace
}  // namespace strata::testing
