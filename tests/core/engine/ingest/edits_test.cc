// Edits that are asked for where another engine has the map: by rows of the store that both use.
#include "core/engine/ingest/edits.h"

#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <memory>
#include <optional>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/synchronization/notification.h"
#include "absl/time/clock.h"
#include "absl/time/time.h"
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/common/cache_budget.h"
#include "core/common/retry_delay.h"
#include "core/common/status.h"
#include "core/common/steady_time.h"
#include "core/common/stop.h"
#include "core/engine/doors/map.h"
#include "core/engine/map/change_log.h"
#include "core/engine/map/map_core.h"
#include "core/engine/map/scan_lookup.h"
#include "core/storage/outcome.h"
#include "core/storage/postgresql/connection.h"
#include "core/storage/postgresql/postgres_maps.h"
#include "core/world/job_kinds.h"
#include "tests/core/engine/engine_fixture.h"
#include "tests/support/patience.h"
#include "tests/support/postgres_cluster.h"
#include "tests/support/status_matchers.h"

namespace strata::testing {
namespace {

using ::testing::HasSubstr;
using ::testing::StartsWith;

const ScanId kScan = {"run", 1};

class EditBesideTest : public EngineTest {
 protected:
  void SetUp() override {
    const auto cluster = SharedPostgresCluster();
    if (absl::IsFailedPrecondition(cluster.status())) GTEST_SKIP() << cluster.status().message();
    STRATA_ASSERT_OK(cluster);
    store_ = (*cluster)->AddressOfOwn(directory_.path().string());
    Reopen(OptionsOfOne());
    MakeMap();
    UploadRooms(3);
    WaitIntegrated(db());
    Close();
    OpenMap();
    other_.emplace(ConnectAs("other"));
    STRATA_ASSERT_OK_AND_ASSIGN(beside_, other_->OpenToAdd(kMapName, 100));
    STRATA_ASSERT_OK_AND_ASSIGN(reader_, beside_->NewReader());
  }
  EngineOptions OptionsOfOne() const {
    EngineOptions options = Options();
    options.store = store_;
    return options;
  }
  PostgresMaps ConnectAs(const std::string& name) const {
    PostgresOptions options;
    options.where = store_;
    options.lease = {.holder = name, .server = name, .roles = {}, .time = absl::Minutes(10)};
    auto maps = PostgresMaps::Connect(options);
    STRATA_EXPECT_OK(maps);
    return *std::move(maps);
  }
  // As the engine that has it; it is not told of edits unless the test does so.
  void OpenMap() {
    owner_.emplace(ConnectAs("owner"));
    STRATA_ASSERT_OK_AND_ASSIGN(auto storage, owner_->OpenAlone(kMapName));
    STRATA_ASSERT_OK_AND_ASSIGN(
        map_,
        Map::Open(kMapName,
                  {std::move(storage), {}},
                  OptionsOfOne(),
                  std::make_shared<CacheBudget>(OptionsOfOne().cache_bytes)));
  }
  void Sql(const std::string& sql) const {
    STRATA_ASSERT_OK_AND_ASSIGN(const auto connection, Connection::Open(store_));
    STRATA_ASSERT_OK(connection->Execute(sql.c_str()));
  }
  // Its number.
  std::uint64_t Ask(const EditRequest& edit) {
    std::uint64_t number = 0;
    StorageWriter& writer = beside_->writer();
    STRATA_EXPECT_OK(writer.Commit(Durability::kFull, [&]() -> absl::Status {
      STRATA_ASSIGN_OR_RETURN(number, writer.PutEdit(edit));
      return absl::OkStatus();
    }));
    return number;
  }
  bool IsAnswered(std::uint64_t edit) {
    const auto connection = beside_->NewReader();
    const auto answer = (*connection)->FindAnswer(edit);
    return answer.ok() && answer->has_value();
  }
  absl::Status AwaitAnswer(std::uint64_t edit) {
    const absl::Time end = absl::Now() + kPatience;
    while (!IsAnswered(edit) && absl::Now() < end) absl::SleepFor(absl::Milliseconds(5));
    const auto answer = reader_->FindAnswer(edit);
    if (!answer.ok()) return answer.status();
    return answer->value_or(absl::DeadlineExceededError("no answer"));
  }
  std::uint64_t Epoch() { return reader_->GetClock()->epoch; }

  std::string store_;
  std::optional<PostgresMaps> owner_;
  std::optional<PostgresMaps> other_;
  std::shared_ptr<Map> map_;
  std::unique_ptr<MapStorage> beside_;
  std::unique_ptr<StorageReader> reader_;
};

// Keeps the worker at work.
class HeldWorker {
 public:
  explicit HeldWorker(Worker& worker)
      : thread_([this, &worker] {
          STRATA_EXPECT_OK(worker.Execute(Stop(), [this](Integrator&) {
            begun_.Notify();
            over_.WaitForNotification();
            return absl::OkStatus();
          }));
        }) {
    begun_.WaitForNotification();
  }
  ~HeldWorker() {
    if (!over_.HasBeenNotified()) over_.Notify();
    thread_.join();
  }
  HeldWorker(const HeldWorker&) = delete;
  HeldWorker& operator=(const HeldWorker&) = delete;
  void LetGo() { over_.Notify(); }

 private:
  absl::Notification begun_, over_;
  std::thread thread_;
};

TEST_F(EditBesideTest, EachIsCarriedOutOnceInItsOrder) {
  const std::uint64_t epoch = Epoch();
  const std::uint64_t moved = Ask(SettingPose(kScan, PoseAt(3.0, 1.0)));
  const std::uint64_t deleted = Ask(DeletingScan({"run", 2}));
  const std::uint64_t again = Ask(DeletingScan({"run", 2}));
  const std::uint64_t late = Ask(SettingPose(kScan, PoseAt(4.0, 1.0)));
  map_->EditsWait(again);
  STRATA_EXPECT_OK(AwaitAnswer(moved));
  STRATA_EXPECT_OK(AwaitAnswer(deleted));
  EXPECT_THAT(AwaitAnswer(again), StatusIs(absl::StatusCode::kNotFound, HasSubstr("run/2")));
  EXPECT_EQ(Epoch(), epoch + 1);
  EXPECT_FALSE(IsAnswered(late)) << "it came after the look";
  map_->EditsWait(late);
  STRATA_EXPECT_OK(AwaitAnswer(late));
  EXPECT_EQ(Epoch(), epoch + 2);
  EXPECT_NEAR(GetScanById(*reader_, kScan, Epoch())->pose->T_map_scan.translation().x(), 4, 1e-9);
}

TEST_F(EditBesideTest, AllKindsAreCarriedOut) {
  const std::vector<std::uint16_t> labels(MakeRoom(1).size(), 7);
  RobotProfile robot;
  robot.radius_m = 0.123;
  std::uint64_t last = 0;
  for (const EditRequest& edit : {SettingLabels(kScan, labels, false),
                                  SettingLabels({"run", 3}, labels, true),
                                  SettingDefaultProfile(robot)}) {
    last = Ask(edit);
  }
  map_->EditsWait(last);
  for (std::uint64_t edit = last - 2; edit <= last; ++edit) STRATA_EXPECT_OK(AwaitAnswer(edit));
  EXPECT_TRUE(GetScanById(*reader_, kScan, Epoch())->scan.person_labels);
  EXPECT_TRUE(GetScanById(*reader_, {"run", 3}, Epoch())->scan.person_labels);
  EXPECT_EQ(reader_->GetMapInfo()->parameters.default_profile, robot);
  EditRequest odd;
  odd.kind = static_cast<EditKind>(99);
  const std::uint64_t unreadable = Ask(odd);
  odd = SettingLabels(kScan, {1}, false);
  odd.value.pop_back();
  const std::uint64_t half = Ask(odd);
  map_->EditsWait(half);
  EXPECT_THAT(AwaitAnswer(unreadable), StatusIs(absl::StatusCode::kDataLoss, ::testing::_));
  EXPECT_THAT(AwaitAnswer(half), StatusIs(absl::StatusCode::kDataLoss, ::testing::_));
}

// Whoever knows a later number of the owner's than the job's is told of one that is later still, at
// either; and nobody by a job that was given to another.
TEST_F(EditBesideTest, WhatAJobPublishesBesideTheOwnerHeTellsToo) {
  const auto give = [this](const std::string& run_by) {
    JobInfo job;
    job.id = 1;
    job.kind = std::string(kCompleteJob);
    job.state = JobState::kRunning;
    job.parameters[kRunBy] = run_by;
    StorageWriter& writer = beside_->writer();
    STRATA_ASSERT_OK(writer.Commit(Durability::kFull, [&] { return writer.PutJob(job); }));
  };
  give("other/1");
  STRATA_ASSERT_OK_AND_ASSIGN(auto storage, other_->OpenToWork(kMapName, 1, "other/1"));
  STRATA_ASSERT_OK_AND_ASSIGN(
      const std::unique_ptr<MapCore> core,
      MapCore::OpenBeside(kMapName,
                          {std::move(storage), {}},
                          OptionsOfOne(),
                          std::make_shared<CacheBudget>(OptionsOfOne().cache_bytes)));
  const auto publish = [&core](bool inferred) {
    return core->Publish({}, {}, true, [&](StorageWriter&) {
      if (inferred) core->NoteInferred();
      return absl::OkStatus();
    });
  };
  STRATA_ASSERT_OK(publish(false));
  EXPECT_EQ(core->asked_to_tell(), 0U);
  STRATA_ASSERT_OK(publish(true));
  const std::uint64_t asked = core->asked_to_tell();
  EXPECT_GT(asked, 0U);
  STRATA_ASSERT_OK(map_->worker().Execute(
      Stop(), [](Integrator& integrator) { return integrator.SetPose(kScan, PoseAt(3.0, 1.0)); }));
  const std::uint64_t known = map_->core().changes().last();
  EXPECT_GT(known, core->changes().last());
  map_->EditsWait(asked);
  STRATA_EXPECT_OK(AwaitAnswer(asked));
  EXPECT_GT(map_->core().changes().inferred(), known);
  STRATA_ASSERT_OK_AND_ASSIGN(const StoredChanges stored, reader_->ListChanges(known));
  EXPECT_GT(ChangesOf(stored, reader_->GetClock()->commit_sequence).inferred, known);
  give("third/2");
  EXPECT_TRUE(MustBeOpenedAnew(publish(true)));
  EXPECT_EQ(reader_->LastEdit().value_or(9), 0U);
}

// Withdrawn while it was carried out, say.
TEST_F(EditBesideTest, AnEditThatCannotBeAnsweredChangesNothing) {
  const std::vector<std::uint16_t> labels(MakeRoom(1).size(), 7);
  const std::uint64_t epoch = Epoch();
  const auto refuse = [](StorageWriter&) { return absl::AbortedError("nobody waits"); };
  for (const EditRequest& edit : {SettingPose(kScan, PoseAt(3.0, 1.0)),
                                  DeletingScan(kScan),
                                  SettingLabels(kScan, labels, false),
                                  SettingDefaultProfile({.radius_m = 0.123})}) {
    const absl::Status done = map_->worker().Execute(
        Stop(), [&](Integrator& integrator) { return CarryOut(edit, integrator, Stop(), refuse); });
    EXPECT_THAT(done, StatusIs(absl::StatusCode::kAborted, "nobody waits"));
  }
  EXPECT_EQ(Epoch(), epoch);
  STRATA_ASSERT_OK_AND_ASSIGN(const PosedScan scan, GetScanById(*reader_, kScan, epoch));
  EXPECT_FALSE(scan.scan.person_labels);
  EXPECT_EQ(reader_->GetMapInfo()->parameters.default_profile, RobotProfile());
  EXPECT_EQ(map_->core().info().parameters.default_profile, RobotProfile());
  // And the worker goes on from there.
  STRATA_EXPECT_OK(map_->worker().Execute(
      Stop(), [&](Integrator& integrator) { return integrator.SetPose(kScan, PoseAt(3.0, 1.0)); }));
}

// However many ask elsewhere, and go on asking: what came later goes behind.
TEST_F(EditBesideTest, WhoAsksTheOwnerHasATurn) {
  constexpr std::size_t kEdits = 8;
  std::vector<std::uint64_t> edits;
  std::size_t before = 0;
  std::thread caller;
  {
    HeldWorker held(map_->worker());
    for (std::size_t i = 0; i < kEdits; ++i) edits.push_back(Ask(DeletingScan({"nobody", i})));
    map_->EditsWait(edits.back());
    absl::Notification asks;
    caller = std::thread([&] {
      const auto count = [&](Integrator&) {
        for (const std::uint64_t edit : edits) before += IsAnswered(edit) ? 1 : 0;
        return absl::OkStatus();
      };
      asks.Notify();
      STRATA_EXPECT_OK(map_->worker().Execute(Stop(), count, "an edit", edits[2]));
    });
    asks.WaitForNotification();
    absl::SleepFor(absl::Milliseconds(100));  // so that it has its place
  }
  caller.join();
  EXPECT_EQ(before, 3U);
  for (const std::uint64_t edit : edits) {
    EXPECT_THAT(AwaitAnswer(edit), StatusIs(absl::StatusCode::kNotFound, ::testing::_));
  }
}

// Of which nobody has told the worker.
TEST_F(EditBesideTest, WhoAsksTheOwnerGoesBehindThoseWhoWait) {
  const std::uint64_t edit = Ask(SettingPose(kScan, PoseAt(3.0, 1.0)));
  bool answered = false;
  const auto look = [&](Integrator&) {
    answered = IsAnswered(edit);
    return absl::OkStatus();
  };
  STRATA_EXPECT_OK(map_->worker().Execute(Stop(), look));
  EXPECT_FALSE(answered);
  STRATA_EXPECT_OK(map_->worker().Execute(Stop(), look, "an edit", edit));
  EXPECT_TRUE(answered);
}

TEST_F(EditBesideTest, WhatTheOwnerWasAtTooOftenIsLetBe) {
  const std::uint64_t edit = Ask(SettingPose(kScan, PoseAt(3.0, 1.0)));
  Sql("UPDATE map_edit SET begun = 10");
  const std::uint64_t epoch = Epoch();
  map_->EditsWait(edit);
  EXPECT_THAT(AwaitAnswer(edit), StatusIs(absl::StatusCode::kAborted, HasSubstr("10 times")));
  EXPECT_EQ(Epoch(), epoch);
}

TEST_F(EditBesideTest, AMapInQuarantineRefusesThemAsItDoesCommands) {
  map_.reset();
  Sql("UPDATE derived_state SET complete = 0; INSERT INTO attempt (map, kind, id, deaths, "
      "under_way) SELECT map, 3, 0, 10, 0 FROM truth_map");
  OpenMap();
  const std::uint64_t edit = Ask(DeletingScan(kScan));
  map_->EditsWait(edit);
  EXPECT_THAT(AwaitAnswer(edit),
              StatusIs(absl::StatusCode::kFailedPrecondition, StartsWith("quarantined: ")));
}

// All that is asked while it waits.
absl::Status GoOn() { return absl::OkStatus(); }

TEST_F(EditBesideTest, WhoAsksIsToldAllThatTheAnswerSays) {
  const absl::Status refused =
      WithRetryDelay(absl::ResourceExhaustedError("no room"), absl::Milliseconds(700));
  std::thread owner([&] {
    std::optional<EditRequest> edit;
    while (!edit.has_value()) edit = reader_->FindEdit(0, 1'000'000).value_or(std::nullopt);
    STRATA_EXPECT_OK(
        map_->core().writer().Run(Durability::kFull, 0, Stop(), [&](StorageWriter& writer) {
          return writer.AnswerEdit(edit->number, refused);
        }));
  });
  EXPECT_EQ(AskForEdit(*beside_, DeletingScan(kScan), Stop(), GoOn), refused);
  owner.join();
  EXPECT_TRUE(absl::IsNotFound(reader_->FindAnswer(1).status())) << "it was read";
}

TEST_F(EditBesideTest, WhoGivesUpTakesItBack) {
  const Stop patience(SteadyNow() + absl::Milliseconds(50));
  EXPECT_THAT(AskForEdit(*beside_, DeletingScan(kScan), patience, GoOn),
              StatusIs(absl::StatusCode::kDeadlineExceeded, HasSubstr("the server that has")));
  EXPECT_FALSE(reader_->FindEdit(0, 1'000'000)->has_value());
  const auto gone = [] { return absl::NotFoundError("the map is gone"); };
  EXPECT_THAT(AskForEdit(*beside_, DeletingScan(kScan), Stop(), gone),
              StatusIs(absl::StatusCode::kNotFound, HasSubstr("the map is gone")));
  EXPECT_FALSE(reader_->FindEdit(0, 1'000'000)->has_value());
}

// Of one that was carried out and one who gives up at the same moment, each is told what happened.
TEST_F(EditBesideTest, WhoGivesUpTooLateIsToldTheAnswer) {
  int carried_out = 0;
  std::uint64_t epoch = Epoch();
  for (int round = 0; round < 30; ++round) {
    const Stop stop;
    std::thread owner([&] {
      std::optional<EditRequest> edit;
      while (!edit.has_value()) edit = reader_->FindEdit(0, 1'000'000).value_or(std::nullopt);
      map_->EditsWait(edit->number);
      absl::SleepFor(absl::Milliseconds(round));
      stop.Request();
    });
    const absl::Status told =
        AskForEdit(*beside_, SettingPose(kScan, PoseAt(3.0, 0.1 * round)), stop, GoOn);
    owner.join();
    STRATA_EXPECT_OK(map_->worker().Execute(Stop(), [](Integrator&) { return GoOn(); }));
    const std::uint64_t now = Epoch();
    EXPECT_EQ(now - epoch, told.ok() ? 1U : 0U) << round << ": " << told;
    carried_out += told.ok() ? 1 : 0;
    epoch = now;
  }
  std::printf("%d of 30 were carried out\n", carried_out);
}

}  // namespace
}  // namespace strata::testing
