// The queue of jobs alone: who decides, who waits, who has a turn, what is kept.
#include "core/engine/jobs/job_board.h"

#include <atomic>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <set>
#include <string>
#include <thread>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/str_cat.h"
#include "absl/time/clock.h"
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/common/cache_budget.h"
#include "core/common/status.h"
#include "core/engine/jobs/job_beside.h"
#include "core/engine/jobs/job_changes.h"
#include "core/engine/map/map_core.h"
#include "core/engine/map/quarantine.h"
#include "core/storage/sqlite/sqlite_storage.h"
#include "tests/support/status_matchers.h"
#include "tests/support/temp_dir.h"

namespace strata {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using testing::StatusIs;

class JobBoardTest : public ::testing::Test {
 protected:
  void SetUp() override {
    STRATA_ASSERT_OK(CreateSqliteMap(file_, {}, absl::Now()));
    Open();
  }
  void TearDown() override { Close(); }

  void Open(bool works = true) {
    EngineOptions options;
    options.directory = directory_.path();
    options.works = works;
    STRATA_ASSERT_OK_AND_ASSIGN(
        core_, MapCore::Open("map", file_, options, std::make_shared<CacheBudget>(1 << 20)));
    STRATA_ASSERT_OK_AND_ASSIGN(quarantine_, Quarantine::Open(*core_));
    STRATA_ASSERT_OK_AND_ASSIGN(board_, JobBoard::Open(*core_, *quarantine_));
  }
  void Close() {
    if (core_ != nullptr) core_->Close();
    board_.reset();
    quarantine_.reset();
    core_.reset();
  }
  absl::StatusOr<JobInfo> Start(const std::string& owner) {
    return board_->Start(Stop(), owner, "verify", {});
  }
  absl::Status Run(absl::FunctionRef<absl::Status(const JobInfo&, JobContext&)> body) {
    return board_->RunNext(Stop(), body);
  }
  absl::Status RunOne() {
    return Run([](const JobInfo&, JobContext&) { return absl::OkStatus(); });
  }

  // The store as another engine has it beside this one.
  std::unique_ptr<MapStorage> Beside() const {
    auto opened = OpenSqliteStorage(file_, {});
    EXPECT_THAT(opened, testing::IsOk());
    return *std::move(opened);
  }
  // Runs the job whose turn it is until `body` has done with it, as a process that ends does.
  absl::Status RunUntilClosed(absl::FunctionRef<void()> body) {
    const Stop closing;
    return board_->RunNext(closing, [&](const JobInfo&, JobContext& context) {
      body();
      closing.Request();
      return context.Progress(0.5, "half");
    });
  }

  testing::TempDir directory_;
  const std::filesystem::path file_ = directory_.path() / "map.strata";
  std::unique_ptr<MapCore> core_;
  std::unique_ptr<Quarantine> quarantine_;
  std::unique_ptr<JobBoard> board_;
};

TEST_F(JobBoardTest, OfManyWhoDecideAboutAProposalOneWins) {
  constexpr int kRounds = 40;
  constexpr int kThreads = 8;
  for (int round = 0; round < kRounds; ++round) {
    STRATA_ASSERT_OK_AND_ASSIGN(const JobInfo job, Start("a"));
    STRATA_ASSERT_OK(Run([](const JobInfo&, JobContext& context) {
      context.SetProposed();
      return absl::OkStatus();
    }));
    std::atomic<int> accepted = 0;
    std::atomic<int> discarded = 0;
    std::vector<std::thread> threads;
    for (int i = 0; i < kThreads; ++i) {
      threads.emplace_back([&, i] {
        const absl::Status told =
            i % 2 == 0 ? board_->Accept(job.id).status() : board_->Discard(job.id).status();
        if (told.ok()) ++(i % 2 == 0 ? accepted : discarded);
        if (!told.ok()) {
          EXPECT_THAT(told, StatusIs(absl::StatusCode::kFailedPrecondition, ::testing::_));
        }
      });
    }
    for (std::thread& thread : threads) thread.join();
    ASSERT_EQ(accepted + discarded, 1) << "round " << round;
    STRATA_ASSERT_OK(RunOne());
    EXPECT_EQ(board_->Get(job.id)->state,
              accepted == 1 ? JobState::kSucceeded : JobState::kCancelled);
  }
}

TEST_F(JobBoardTest, AJobWhoseStoreWasAwayGoesOnLater) {
  STRATA_ASSERT_OK_AND_ASSIGN(const JobInfo job, Start("a"));
  const auto away = [](const JobInfo&, JobContext&) {
    return absl::UnavailableError("store: the server closed the connection");
  };
  EXPECT_THAT(Run(away), StatusIs(absl::StatusCode::kUnavailable, HasSubstr("closed")));
  EXPECT_EQ(board_->Get(job.id)->state, JobState::kQueued);
  // Unless somebody has had enough of it.
  STRATA_EXPECT_OK(Run([&](const JobInfo&, JobContext&) {
    STRATA_EXPECT_OK(board_->Cancel(job.id));
    return absl::UnavailableError("store: the server closed the connection");
  }));
  EXPECT_EQ(board_->Get(job.id)->state, JobState::kCancelled);
}

TEST_F(JobBoardTest, WhoeverIsToldCancelledSeesNoJobRun) {
  constexpr int kJobs = 60;
  std::set<std::uint64_t> ran;
  std::atomic<bool> all = false;
  std::thread runner([&] {
    while (!all || board_->NextId().has_value()) {
      STRATA_EXPECT_OK(Run([&ran](const JobInfo& job, JobContext&) {
        ran.insert(job.id);
        return absl::OkStatus();
      }));
    }
  });
  std::set<std::uint64_t> cancelled;
  for (int i = 0; i < kJobs; ++i) {
    const absl::StatusOr<JobInfo> job = Start("a");
    STRATA_ASSERT_OK(job);
    const absl::StatusOr<JobInfo> told = board_->Cancel(job->id);
    STRATA_ASSERT_OK(told);
    EXPECT_NE(told->state, JobState::kQueued);
    if (told->state == JobState::kCancelled) cancelled.insert(job->id);
  }
  all = true;
  runner.join();
  for (const std::uint64_t id : cancelled) {
    EXPECT_FALSE(ran.contains(id)) << id;
    EXPECT_EQ(board_->Get(id)->state, JobState::kCancelled);
  }
  EXPECT_EQ(ran.size() + cancelled.size(), kJobs);
}

TEST_F(JobBoardTest, ACancelOfAProposalDoesNotCancelItsAcceptance) {
  STRATA_ASSERT_OK_AND_ASSIGN(const JobInfo job, Start("a"));
  const auto propose = [](const JobInfo&, JobContext& context) {
    context.SetProposed();
    return absl::OkStatus();
  };
  STRATA_ASSERT_OK(Run(propose));
  EXPECT_EQ(board_->Cancel(job.id)->state, JobState::kProposed);
  STRATA_ASSERT_OK(board_->Accept(job.id));
  STRATA_ASSERT_OK(
      Run([](const JobInfo&, JobContext& context) { return context.Progress(0.5, "half"); }));
  EXPECT_EQ(board_->Get(job.id)->state, JobState::kSucceeded);
}

absl::Status Propose(const JobInfo&, JobContext& context) {
  context.SetProposed();
  return absl::OkStatus();
}

// Whatever another engine writes at whatever moment: of all who decide one wins, here as there.
TEST_F(JobBoardTest, WhoDecidesBesideTheBoardIsOneOfMany) {
  constexpr int kRounds = 30;
  for (int round = 0; round < kRounds; ++round) {
    STRATA_ASSERT_OK_AND_ASSIGN(const JobInfo job, Start("a"));
    STRATA_ASSERT_OK(Run(Propose));
    std::atomic<int> accepted = 0;
    std::atomic<int> discarded = 0;
    const auto note = [](const absl::StatusOr<JobInfo>& told, std::atomic<int>& count) {
      if (told.ok()) ++count;
    };
    std::vector<std::thread> threads;
    for (int i = 0; i < 2; ++i) {
      threads.emplace_back([&] {
        const auto beside = Beside();
        note(AcceptJobBeside(*beside, job.id), accepted);
        note(RevertJobBeside(*beside, job.id), discarded);
      });
      threads.emplace_back([&] { note(board_->Accept(job.id), accepted); });
      threads.emplace_back([&] { note(board_->Discard(job.id), discarded); });
      threads.emplace_back([&] { STRATA_EXPECT_OK(board_->TakeIn()); });
    }
    for (std::thread& thread : threads) thread.join();
    ASSERT_EQ(accepted + discarded, 1) << "round " << round;
    EXPECT_THAT(board_->TakeIn(), testing::IsOkAndHolds(accepted == 1));
    EXPECT_EQ(board_->Get(job.id)->state, accepted == 1 ? JobState::kQueued : JobState::kCancelled);
    STRATA_ASSERT_OK(RunOne());
    EXPECT_EQ(board_->Get(job.id)->state,
              accepted == 1 ? JobState::kSucceeded : JobState::kCancelled);
  }
}

TEST_F(JobBoardTest, AJobThatIsCancelledBesideTheBoardEnds) {
  const auto beside = Beside();
  // One that waits: at once. It is not run, also where nobody has looked.
  STRATA_ASSERT_OK_AND_ASSIGN(const JobInfo waits, Start("a"));
  EXPECT_EQ(CancelJobBeside(*beside, waits.id)->state, JobState::kCancelled);
  STRATA_ASSERT_OK(Run([](const JobInfo& job, JobContext&) {
    ADD_FAILURE() << "job " << job.id << " runs";
    return absl::OkStatus();
  }));
  EXPECT_EQ(board_->Get(waits.id)->state, JobState::kCancelled);
  // One that runs: once somebody looks.
  STRATA_ASSERT_OK_AND_ASSIGN(const JobInfo runs, Start("a"));
  STRATA_ASSERT_OK(Run([&](const JobInfo& job, JobContext& context) -> absl::Status {
    EXPECT_EQ(CancelJobBeside(*beside, job.id)->state, JobState::kRunning);
    STRATA_EXPECT_OK(context.Progress(0.5, "half"));
    STRATA_EXPECT_OK(board_->TakeIn());
    return context.Progress(0.6, "over");
  }));
  EXPECT_EQ(board_->Get(runs.id)->state, JobState::kCancelled);
  EXPECT_TRUE(board_->Get(runs.id)->parameters.empty());
  // One that has ended stays as it is.
  const absl::Time updated = board_->Get(runs.id)->updated;
  EXPECT_EQ(CancelJobBeside(*beside, runs.id)->state, JobState::kCancelled);
  EXPECT_EQ((*(*beside->NewReader())->FindJob(runs.id))->updated, updated);
  EXPECT_THAT(CancelJobBeside(*beside, 77).status(),
              StatusIs(absl::StatusCode::kNotFound, HasSubstr("77")));
}

// Whoever has the map next, and runs what was running, finds that it was cancelled; what it had
// done before it was told is done.
TEST_F(JobBoardTest, ACancelOutlivesTheProcessThatRunsTheJob) {
  for (const bool here : {true, false}) {
    STRATA_ASSERT_OK_AND_ASSIGN(const JobInfo job, Start("a"));
    STRATA_ASSERT_OK(RunUntilClosed([&] {
      EXPECT_EQ(here ? board_->Cancel(job.id)->state : CancelJobBeside(*Beside(), job.id)->state,
                JobState::kRunning);
    }));
    Close();
    Open();
    EXPECT_EQ(board_->Get(job.id)->state, JobState::kQueued);
    STRATA_ASSERT_OK(Run([](const JobInfo&, JobContext& context) {
      EXPECT_TRUE(context.stop().requested());
      return context.stop().status();
    }));
    EXPECT_EQ(board_->Get(job.id)->state, JobState::kCancelled);
    EXPECT_TRUE(board_->Get(job.id)->parameters.empty());
  }
}

TEST_F(JobBoardTest, ACancelBesideMeansNoLaterRun) {
  const auto beside = Beside();
  STRATA_ASSERT_OK_AND_ASSIGN(const JobInfo job, Start("a"));
  // Too late: it has its proposal already.
  STRATA_ASSERT_OK(Run([&](const JobInfo& now, JobContext& context) {
    context.SetProposed();
    return CancelJobBeside(*beside, now.id).status();
  }));
  EXPECT_EQ(board_->Get(job.id)->state, JobState::kProposed);
  STRATA_ASSERT_OK_AND_ASSIGN(const JobInfo accepted, AcceptJobBeside(*beside, job.id));
  EXPECT_EQ(accepted.state, JobState::kQueued);
  EXPECT_THAT(board_->TakeIn(), testing::IsOkAndHolds(true));
  STRATA_ASSERT_OK(Run([&](const JobInfo&, JobContext& context) -> absl::Status {
    STRATA_EXPECT_OK(board_->TakeIn());
    return context.Progress(0.5, "half");
  }));
  EXPECT_EQ(board_->Get(job.id)->state, JobState::kSucceeded);
}

// One job of a map at a time, whoever runs it; the board shows it, and tells it to end.
TEST_F(JobBoardTest, AJobThatAnotherEngineRunsIsShownAndLeftToIt) {
  const std::unique_ptr<MapStorage> beside = Beside();
  StorageWriter& writer = beside->writer();
  const auto change = [&](std::uint64_t id, absl::FunctionRef<void(JobInfo&)> how) {
    STRATA_ASSERT_OK(writer.Commit(Durability::kFull, [&] {
      return ChangeStoredJob(writer,
                             id,
                             [&](JobInfo& job, StorageWriter&) {
                               how(job);
                               return absl::OkStatus();
                             })
          .status();
    }));
    STRATA_ASSERT_OK(board_->TakeIn());
  };
  STRATA_ASSERT_OK_AND_ASSIGN(const JobInfo first, Start("a"));
  STRATA_ASSERT_OK_AND_ASSIGN(const JobInfo second, Start("a"));
  change(first.id, [](JobInfo& job) {
    job.state = JobState::kRunning;
    job.parameters[kRunBy] = "worker/1";
  });
  EXPECT_EQ(board_->Get(first.id)->state, JobState::kRunning);
  EXPECT_FALSE(board_->NextId().has_value());
  STRATA_EXPECT_OK(RunOne());
  EXPECT_EQ(board_->Get(second.id)->state, JobState::kQueued);
  change(first.id, [](JobInfo& job) { job.progress = 0.5; });
  EXPECT_EQ(board_->Get(first.id)->progress, 0.5);
  // As the map's next owner.
  Close();
  Open();
  EXPECT_EQ(board_->Get(first.id)->state, JobState::kRunning);
  EXPECT_TRUE(board_->AnyElsewhere());
  STRATA_EXPECT_OK(board_->ReturnDead({"worker"}));
  EXPECT_EQ(board_->Get(first.id)->state, JobState::kRunning);
  STRATA_EXPECT_OK(board_->Cancel(first.id).status());
  EXPECT_EQ(board_->Get(first.id)->state, JobState::kRunning);
  EXPECT_TRUE(IsToldToEnd(*board_->Get(first.id)));
  change(first.id, [](JobInfo& job) { EndJob(job, absl::CancelledError("told"), {}); });
  EXPECT_EQ(board_->Get(first.id)->state, JobState::kCancelled);
  EXPECT_TRUE(board_->Get(first.id)->parameters.empty());
  EXPECT_EQ(board_->NextId(), second.id);
  STRATA_EXPECT_OK(RunOne());
  EXPECT_EQ(board_->Get(second.id)->state, JobState::kSucceeded);
}

// Also where its owner has seen nothing of the run; what was cancelled meanwhile is not applied.
TEST_F(JobBoardTest, AProposalOfAWorkerIsAppliedByWhoHasTheMap) {
  Close();
  Open(/*works=*/false);
  const std::unique_ptr<MapStorage> beside = Beside();
  StorageWriter& writer = beside->writer();
  for (const bool told : {false, true}) {
    STRATA_ASSERT_OK_AND_ASSIGN(const JobInfo job, board_->Start(Stop(), "a", "optimize", {}));
    EXPECT_FALSE(board_->NextId().has_value());
    STRATA_ASSERT_OK(writer.Commit(Durability::kFull, [&] {
      const auto propose = [&](JobInfo& now, StorageWriter&) {
        if (told) TellToEnd(now);
        JobResult result;
        result.accepted = true;
        result.message = "found";
        EndJob(now, absl::OkStatus(), result);
        return absl::OkStatus();
      };
      return ChangeStoredJob(writer, job.id, propose).status();
    }));
    EXPECT_THAT(board_->TakeIn(), testing::IsOkAndHolds(true));
    EXPECT_EQ(board_->NextId(), job.id);
    STRATA_EXPECT_OK(Run([](const JobInfo& now, JobContext& context) {
      EXPECT_TRUE(IsAccepted(now));
      EXPECT_EQ(now.message, "found");
      return context.stop().status();
    }));
    EXPECT_EQ(board_->Get(job.id)->state, told ? JobState::kCancelled : JobState::kSucceeded);
  }
}

TEST_F(JobBoardTest, AJobWhoseEngineIsGoneWaitsAgainUntilItWasTooOften) {
  STRATA_ASSERT_OK_AND_ASSIGN(const JobInfo job, Start("a"));
  const std::unique_ptr<MapStorage> beside = Beside();
  StorageWriter& writer = beside->writer();
  for (std::uint32_t death = 1; death <= kMostDeathsOfMany; ++death) {
    EXPECT_EQ(board_->NextId(), job.id) << death;
    STRATA_ASSERT_OK(writer.Commit(Durability::kFull, [&] {
      return ChangeStoredJob(writer,
                             job.id,
                             [](JobInfo& now, StorageWriter&) {
                               now.state = JobState::kRunning;
                               now.parameters[kRunBy] = "worker/1";
                               return absl::OkStatus();
                             })
          .status();
    }));
    STRATA_ASSERT_OK(board_->TakeIn());
    STRATA_ASSERT_OK(board_->ReturnDead({"another"}));
    EXPECT_FALSE(board_->AnyElsewhere());
  }
  EXPECT_FALSE(board_->NextId().has_value());
  EXPECT_TRUE(IsQuarantined(*board_->Get(job.id))) << board_->Get(job.id)->message;
  STRATA_EXPECT_OK(writer.Commit(Durability::kFull, [&] {
    return Release(writer, {WorkKind::kJob, job.id});
  }));
}

TEST_F(JobBoardTest, WaitingJobsAreBoundedOfOneAndOfAll) {
  for (std::size_t i = 0; i < kMaxWaitingJobsOfOne; ++i) STRATA_ASSERT_OK(Start("a"));
  EXPECT_THAT(Start("a").status(),
              StatusIs(absl::StatusCode::kResourceExhausted, HasSubstr("50 of them yours")));
  while (board_->List().size() < kMaxWaitingJobs) {
    STRATA_ASSERT_OK(Start(absl::StrCat("b", board_->List().size())));
  }
  EXPECT_THAT(Start("c").status(),
              StatusIs(absl::StatusCode::kResourceExhausted, HasSubstr("100 jobs wait")));
  STRATA_ASSERT_OK(board_->Cancel(1));
  STRATA_EXPECT_OK(Start("a"));
}

TEST_F(JobBoardTest, ClientsTakeTurns) {
  for (int i = 0; i < 4; ++i) STRATA_ASSERT_OK(Start("a"));  // 1 to 4
  STRATA_ASSERT_OK(Start("b"));                              // 5
  STRATA_ASSERT_OK(Start("c"));                              // 6
  STRATA_ASSERT_OK(Start("b"));                              // 7
  std::vector<std::uint64_t> order;
  while (board_->NextId().has_value()) {
    STRATA_ASSERT_OK(Run([&order](const JobInfo& job, JobContext&) {
      order.push_back(job.id);
      return absl::OkStatus();
    }));
  }
  EXPECT_THAT(order, ElementsAre(1, 5, 6, 2, 7, 3, 4));
}

TEST_F(JobBoardTest, OldJobsGoProposalsStay) {
  STRATA_ASSERT_OK(Start("a"));
  STRATA_ASSERT_OK(Run([](const JobInfo&, JobContext& context) {
    context.SetProposed();
    return absl::OkStatus();
  }));
  for (std::size_t i = 0; i < kKeptJobs + 20; ++i) {
    STRATA_ASSERT_OK(Start("a"));
    STRATA_ASSERT_OK(RunOne());
  }
  const auto check = [this] {
    const std::vector<JobInfo> jobs = board_->List();
    EXPECT_LE(jobs.size(), kKeptJobs + 2);
    EXPECT_GE(jobs.size(), kKeptJobs);
    EXPECT_EQ(jobs.front().state, JobState::kProposed);
    EXPECT_EQ(jobs.back().id, kKeptJobs + 21);
  };
  check();
  Close();
  Open();
  check();
}

TEST_F(JobBoardTest, AJobThatThrowsFails) {
  STRATA_ASSERT_OK(Start("a"));
  STRATA_ASSERT_OK(
      Run([](const JobInfo&, JobContext&) -> absl::Status { throw std::bad_alloc(); }));
  EXPECT_EQ(board_->Get(1)->state, JobState::kFailed);
  EXPECT_THAT(board_->Get(1)->message, HasSubstr("out of memory"));
}

// A process that ends by itself is no death of the job; one that is found running is.
TEST_F(JobBoardTest, AJobThatWasRunningTwiceWhenTheProcessDiedIsPutAside) {
  STRATA_ASSERT_OK(Start("a"));
  STRATA_ASSERT_OK(Start("b"));
  const Stop closing;
  closing.Request();
  STRATA_ASSERT_OK(board_->RunNext(
      closing, [&](const JobInfo&, JobContext& context) { return context.Progress(0.0, "now"); }));
  Close();
  Open();
  EXPECT_FALSE(quarantine_->IsSuspect({WorkKind::kJob, 1}));
  for (int death = 1; death <= 2; ++death) {
    const std::filesystem::path copy = directory_.path() / "copy.strata";
    STRATA_ASSERT_OK(Run([&](const JobInfo& job, JobContext&) -> absl::Status {
      EXPECT_EQ(job.id, 1U);
      // The file as a process leaves it that dies now.
      std::filesystem::remove(copy);
      const absl::StatusOr<ReaderPool::Lease> reader = core_->Reader();
      STRATA_RETURN_IF_ERROR(reader.status());
      return (*reader)->CopyTo(copy, Stop());
    }));
    Close();
    for (const char* suffix : {"-wal", "-shm"}) std::filesystem::remove(file_.string() + suffix);
    std::filesystem::rename(copy, file_);
    Open();
    EXPECT_TRUE(quarantine_->IsSuspect({WorkKind::kJob, 1}));
  }
  const JobInfo job = *board_->Get(1);
  EXPECT_EQ(job.state, JobState::kFailed);
  EXPECT_THAT(job.message, HasSubstr("quarantined: the server died 2 times while it ran"));
  EXPECT_TRUE(board_->LastIsQuarantined("verify") == false);  // job 2 is newer
  STRATA_ASSERT_OK(RunOne());
  EXPECT_EQ(board_->Get(2)->state, JobState::kSucceeded);
}

}  // namespace
}  // namespace strata
