// What goes on beside long work, and what waits for it.
#include <atomic>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <string>
#include <thread>
#include <utility>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "absl/synchronization/notification.h"
#include "absl/time/time.h"
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/common/blocking.h"
#include "core/common/cache_budget.h"
#include "core/common/steady_time.h"
#include "core/common/stop.h"
#include "core/engine/doors/map.h"
#include "core/engine/ingest/worker.h"
#include "core/engine/map/numbers.h"
#include "core/engine/repair/rebuild.h"
#include "core/world/job_kinds.h"
#include "tests/core/engine/engine_fixture.h"
#include "tests/support/patience.h"
#include "tests/support/status_matchers.h"

namespace strata::testing {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

class BesideTest : public EngineTest {
 protected:
  // The map's file in this test's hands; the engine is closed meanwhile.
  std::shared_ptr<Map> OpenMap() {
    WaitIntegrated(db());
    Close();
    absl::StatusOr<std::shared_ptr<Map>> map = Map::Open(
        kMapName, MapFile(), Options(), std::make_shared<CacheBudget>(Options().cache_bytes));
    EXPECT_THAT(map, IsOk());
    return map.value_or(nullptr);
  }
};

// Calls `step` each time the job says how far it is.
class Stepping final : public JobContext {
 public:
  explicit Stepping(std::function<void()> step) : step_(std::move(step)) {}
  absl::Status Progress(double, absl::string_view) override {
    step_();
    return absl::OkStatus();
  }
  const Stop& stop() const override { return stop_; }
  void SetMetric(const std::string&, double) override {}
  void SetMessage(std::string) override {}
  void SetProposed() override {}
  void SetAccepted() override {}

 private:
  const std::function<void()> step_;
  const Stop stop_;
};

TEST_F(BesideTest, VerifyLooksAtOneStateWhileScansMoveAndLeave) {
  MakeMap();
  UploadRooms(12);
  const std::shared_ptr<Map> map = OpenMap();
  ASSERT_NE(map, nullptr);
  std::uint64_t steps = 0;
  Stepping context([&] {
    if (++steps % 5 != 0) return;
    STRATA_EXPECT_OK(map->worker().Execute(Stop(), [&](Integrator& integrator) {
      const ScanId id{"run", 1 + steps % 12};
      if (steps == 10 || steps == 30) return integrator.DeleteScan(id);
      const absl::Status moved =
          integrator.SetPose(id, PoseAt(0.3 * static_cast<double>(steps % 50), 1.0));
      return absl::IsNotFound(moved) ? absl::OkStatus() : moved;
    }));
  });
  EXPECT_THAT(RunVerifyJob(map->core(), 2, context), IsOk());
  EXPECT_GT(steps, 12U);
  // And what came of it is sound, too.
  SilentContext silent{Stop()};
  EXPECT_THAT(RunVerifyJob(map->core(), 2, silent), IsOk());
}

TEST_F(BesideTest, VerifyGoesOnBesideUploads) {
  MakeMap();
  UploadRooms(4);
  std::atomic<bool> over = false;
  std::thread robot([&] {
    for (std::uint64_t i = 5; i < 60 && !over; ++i) UploadRoom(i, RoomPose(i % 8));
  });
  for (int round = 0; round < 3; ++round) {
    const JobInfo verified = RunJob(db(), "verify");
    EXPECT_EQ(verified.state, JobState::kSucceeded) << verified.message;
  }
  over = true;
  robot.join();
}

// Keeps a map's worker at work until its end.
class BusyWorker {
 public:
  BusyWorker(Worker& worker, const std::string& what)
      : thread_([this, &worker, what] {
          const auto work = [this](Integrator&) {
            begun_.Notify();
            over_.WaitForNotification();
            return absl::OkStatus();
          };
          STRATA_EXPECT_OK(worker.Execute(Stop(), work, what));
        }) {
    begun_.WaitForNotification();
  }
  ~BusyWorker() {
    over_.Notify();
    thread_.join();
  }
  BusyWorker(const BusyWorker&) = delete;
  BusyWorker& operator=(const BusyWorker&) = delete;

 private:
  absl::Notification begun_, over_;
  std::thread thread_;
};

TEST_F(BesideTest, WhoGivesUpWaitingIsToldWhatItWaitedFor) {
  MakeMap();
  const std::shared_ptr<Map> map = OpenMap();
  ASSERT_NE(map, nullptr);
  const BusyWorker busy(map->worker(), "job 3 (rebuild)");
  const Stop given_up;
  given_up.Request();
  EXPECT_THAT(map->worker().Execute(given_up, [](Integrator&) { return absl::OkStatus(); }),
              StatusIs(absl::StatusCode::kCancelled, HasSubstr("job 3 (rebuild) of map world")));
}

TEST_F(BesideTest, AJobThatWaitsForTheWorkerEndsWhenItIsCancelled) {
  MakeMap();
  const std::shared_ptr<Map> map = OpenMap();
  ASSERT_NE(map, nullptr);
  const BusyWorker busy(map->worker(), "an edit");
  const absl::StatusOr<JobInfo> job = map->jobs().Start(Stop(), "a", kRebuildJob, {});
  map->JobQueued();
  JobInfo last = job.value_or(JobInfo());
  const Stop patience(SteadyNow() + kPatience);
  STRATA_EXPECT_OK(map->jobs().Watch(patience, last.id, [&](const JobInfo& now) {
    last = now;
    const bool runs = now.state == JobState::kRunning;
    return runs ? map->jobs().Cancel(now.id).status() : absl::OkStatus();
  }));
  EXPECT_EQ(last.state, JobState::kCancelled) << last.message;
}

TEST_F(BesideTest, HealthNamesMapsThatAreNotOpenAndTheDisk) {
  MakeMap();
  MakeMap(SmallMap(), "other");
  EXPECT_TRUE(HealthOf(db()).maps_not_opened.empty());
  EXPECT_TRUE(HealthOf(db()).maps_not_written.empty());
  EXPECT_GT(HealthOf(db()).disk_bytes, 0U);
  Close();
  std::filesystem::resize_file(MapFile("other"), 1000);
  Reopen();
  EXPECT_THAT(HealthOf(db()).maps_not_opened, ElementsAre("other"));
}

class CountingWaits final : public BlockingObserver {
 public:
  void BlockingBegins() override { ++begun; }
  void BlockingEnds(bool) override { ++ended; }
  int begun = 0;
  int ended = 0;
};

TEST_F(BesideTest, WhoWaitsForAMapSaysSo) {
  MakeMap();
  UploadRooms(1);
  const std::shared_ptr<Map> map = OpenMap();
  ASSERT_NE(map, nullptr);
  CountingWaits waits;
  SetBlockingObserver(&waits);
  STRATA_EXPECT_OK(map->worker().Execute(Stop(), [](Integrator&) { return absl::OkStatus(); }));
  EXPECT_EQ(waits.begun, 1) << "for the worker";
  STRATA_EXPECT_OK(map->core().writer().Run(
      Durability::kFull, 0, Stop(), [](StorageWriter&) { return absl::OkStatus(); }));
  EXPECT_EQ(waits.begun, 2) << "for the writer";
  EXPECT_EQ(waits.ended, waits.begun);
  SetBlockingObserver(nullptr);
}

}  // namespace
}  // namespace strata::testing
