// The map's own row: its parameters and its clock; profiles, jobs and attempts.
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/time/clock.h"
#include "absl/time/time.h"
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/common/retry_delay.h"
#include "core/common/status.h"
#include "core/storage/storage.h"
#include "tests/core/storage/contract/storage_contract.h"
#include "tests/support/status_matchers.h"

namespace strata::testing {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

class MapContractTest : public StorageContractTest {};

TEST_F(MapContractTest, ParametersComeBackToTheBit) {
  EXPECT_EQ(reader().GetMapInfo()->parameters, MapParameters());
  EXPECT_EQ(reader().GetMapInfo()->created, absl::FromUnixSeconds(1000));
  MapParameters parameters;
  parameters.mls.cell_size_m = 0.1 + 1e-17;
  parameters.sensor = {0.01, 0.002, 0.3, 77.7};
  parameters.default_profile.max_slope_rad = 1.0 / 3.0;
  parameters.fade_after = 7;
  parameters.origin = GeodeticOrigin{0.9, -0.1, 540.25};
  TempDir elsewhere;
  STRATA_ASSERT_OK_AND_ASSIGN(const auto store, MakeTestStore(elsewhere.path()));
  STRATA_ASSERT_OK(store->Create(parameters, absl::FromUnixMicros(1'234'567), 40));
  EXPECT_THAT(store->Create(parameters, absl::Now(), 0),
              StatusIs(absl::StatusCode::kAlreadyExists, ::testing::_));
  STRATA_ASSERT_OK_AND_ASSIGN(const auto storage, store->Open());
  STRATA_ASSERT_OK_AND_ASSIGN(const auto reader, storage->NewReader());
  STRATA_ASSERT_OK_AND_ASSIGN(const MapInfo info, reader->GetMapInfo());
  EXPECT_EQ(info.parameters, parameters);
  EXPECT_EQ(info.created, absl::FromUnixMicros(1'234'567));
  STRATA_ASSERT_OK_AND_ASSIGN(const MapClock clock, reader->GetClock());
  EXPECT_EQ(clock.commit_sequence, 40U);
  EXPECT_EQ(clock.epoch, 1U);
  EXPECT_EQ(clock.tile_version, 0U);
  EXPECT_TRUE(clock.derived_complete);
}

TEST_F(MapContractTest, AMapIsRefusedWithParametersThatAreNone) {
  TempDir elsewhere;
  STRATA_ASSERT_OK_AND_ASSIGN(const auto store, MakeTestStore(elsewhere.path()));
  MapParameters bad;
  bad.mls.cell_size_m = -1.0;
  EXPECT_THAT(store->Create(bad, absl::Now(), 0),
              StatusIs(absl::StatusCode::kInvalidArgument, ::testing::_));
  EXPECT_THAT(store->Open(), StatusIs(absl::StatusCode::kNotFound, ::testing::_));
}

TEST_F(MapContractTest, TheClockTicksAndNeverInACommitThatMayBeLost) {
  STRATA_ASSERT_OK(Commit([&]() -> absl::Status {
    STRATA_ASSIGN_OR_RETURN(const std::uint64_t first, writer().NextCommitSequence());
    STRATA_ASSIGN_OR_RETURN(const std::uint64_t second, writer().NextCommitSequence());
    EXPECT_EQ(first, 1U);
    EXPECT_EQ(second, 2U);
    EXPECT_EQ(writer().reader().GetClock()->commit_sequence, 2U);
    EXPECT_EQ(reader().GetClock()->commit_sequence, 0U);  // not committed yet
    return absl::OkStatus();
  }));
  EXPECT_EQ(reader().GetClock()->commit_sequence, 2U);
  const absl::Status relaxed =
      writer().Commit(Durability::kRelaxed, [&] { return writer().NextCommitSequence().status(); });
  EXPECT_THAT(relaxed, StatusIs(absl::StatusCode::kInternal, HasSubstr("may be lost")));
  Reopen();
  EXPECT_EQ(reader().GetClock()->commit_sequence, 2U);
}

TEST_F(MapContractTest, WhatWasTakenAwayTakesNoMore) {
  STRATA_EXPECT_OK(storage().CheckInPlace());
  STRATA_EXPECT_OK(storage().CheckHeld());
  EXPECT_NE(storage().last_owner(), LastOwner::kOther);
  Put(1);
  STRATA_ASSERT_OK(store().TakeAway());
  EXPECT_THAT(storage().CheckInPlace(), StatusIs(absl::StatusCode::kUnavailable, ::testing::_));
  EXPECT_THAT(Commit([&] { return writer().PutChunk(9, 0, "lost"); }),
              StatusIs(absl::StatusCode::kUnavailable, HasSubstr("removed")));
}

TEST_F(MapContractTest, ANumberTellsItFromAnotherOfItsName) {
  const std::int64_t number = storage().number();
  Reopen();
  EXPECT_EQ(storage().number(), number);
  if (number == 0) return;
  STRATA_ASSERT_OK(store().TakeAway());
  STRATA_ASSERT_OK(store().Create(MapParameters(), absl::UnixEpoch(), 0));
  STRATA_ASSERT_OK_AND_ASSIGN(const auto another, store().Open());
  EXPECT_NE(another->number(), number);
}

TEST_F(MapContractTest, ProfilesAndTheOriginAreReplaced) {
  RobotProfile profile;
  profile.radius_m = 0.1 + 0.2;
  STRATA_ASSERT_OK(Commit([&]() -> absl::Status {
    STRATA_RETURN_IF_ERROR(writer().PutProfile("cart", RobotProfile()));
    STRATA_RETURN_IF_ERROR(writer().PutProfile("cart", profile));
    return writer().PutOrigin({0.5, -1.5, 12.25});
  }));
  Reopen();
  STRATA_ASSERT_OK_AND_ASSIGN(const auto profiles, reader().ListProfiles());
  ASSERT_EQ(profiles.size(), 2U);
  EXPECT_EQ(profiles.at("cart"), profile);
  EXPECT_EQ(profiles.at("default"), RobotProfile());
  EXPECT_EQ(reader().GetMapInfo()->parameters.origin, (GeodeticOrigin{0.5, -1.5, 12.25}));
}

TEST_F(MapContractTest, JobsAreReplacedAndGoWithTheirDetails) {
  JobInfo job;
  job.id = 7;
  job.kind = "optimize";
  job.parameters = {{"dry_run", "1"}, {"threads", "2"}};
  job.metrics = {{"rounds", 1.0}};
  job.state = JobState::kRunning;
  job.progress = 1.0 / 3.0;
  job.phase = "matching";
  job.created = absl::FromUnixMicros(5);
  job.updated = absl::FromUnixMicros(6);
  const auto put = [&] { return Commit([&] { return writer().PutJob(job); }); };
  STRATA_ASSERT_OK(put());
  job.state = JobState::kFailed;
  job.message = "gänzlich";
  job.parameters.erase("threads");
  job.metrics = {{"scans", 0.1}};
  STRATA_ASSERT_OK(put());
  job.metrics["scans"] = 0.3;
  STRATA_ASSERT_OK(put());
  Reopen();
  STRATA_ASSERT_OK_AND_ASSIGN(const std::vector<JobInfo> jobs, reader().ListJobs());
  ASSERT_EQ(jobs.size(), 1U);
  STRATA_ASSERT_OK_AND_ASSIGN(const std::optional<JobInfo> found, reader().FindJob(7));
  ASSERT_TRUE(found.has_value());
  EXPECT_EQ(found->kind, job.kind);
  EXPECT_EQ(found->state, job.state);
  EXPECT_EQ(found->progress, job.progress);
  EXPECT_EQ(found->phase, job.phase);
  EXPECT_EQ(found->message, job.message);
  EXPECT_EQ(found->parameters, job.parameters);
  EXPECT_EQ(found->metrics, job.metrics);
  EXPECT_EQ(found->created, job.created);
  EXPECT_EQ(jobs[0].updated, job.updated);
  EXPECT_FALSE(reader().FindJob(8)->has_value());
  STRATA_ASSERT_OK(Commit([&] { return writer().DeleteJob(7); }));
  EXPECT_FALSE(reader().FindJob(7)->has_value());
  job.parameters.clear();
  job.metrics.clear();
  STRATA_ASSERT_OK(put());
  EXPECT_TRUE(reader().FindJob(7)->value().metrics.empty());
  EXPECT_TRUE(reader().FindJob(7)->value().parameters.empty());
}

TEST_F(MapContractTest, AttemptsAreKeptByTheirWork) {
  const WorkId scan{WorkKind::kScan, 9};
  const WorkId job{WorkKind::kJob, 9};
  STRATA_ASSERT_OK(Commit([&]() -> absl::Status {
    STRATA_RETURN_IF_ERROR(writer().PutAttempt({job, 0, true}));
    STRATA_RETURN_IF_ERROR(writer().PutAttempt({scan, 0, true}));
    return writer().PutAttempt({scan, 2, false});
  }));
  Reopen();
  STRATA_ASSERT_OK_AND_ASSIGN(const std::vector<Attempt> attempts, reader().ListAttempts());
  ASSERT_EQ(attempts.size(), 2U);
  EXPECT_EQ(attempts[0].work, scan);
  EXPECT_EQ(attempts[0].deaths, 2U);
  EXPECT_FALSE(attempts[0].under_way);
  EXPECT_TRUE(attempts[1].under_way);
  STRATA_ASSERT_OK(Commit([&] { return writer().DeleteAttempt(scan); }));
  EXPECT_EQ(reader().ListAttempts()->size(), 1U);
}

// The numbers of edits that wait.
std::vector<std::uint64_t> Waiting(StorageReader& reader, std::uint64_t until) {
  std::vector<std::uint64_t> numbers = {0};
  while (true) {
    const auto edit = reader.FindEdit(numbers.back(), until);
    if (!edit.ok() || !edit->has_value()) break;
    numbers.push_back((*edit)->number);
  }
  numbers.erase(numbers.begin());
  return numbers;
}

TEST_F(MapContractTest, EditsWaitUntilTheyAreAnsweredOrWithdrawn) {
  EditRequest edit;
  edit.kind = EditKind::kSetLabels;
  edit.scan = {"run", 7};
  edit.value = std::string("\0\xFF", 2);
  std::vector<std::uint64_t> numbers;
  const auto put = [&]() -> absl::Status {
    STRATA_ASSIGN_OR_RETURN(const std::uint64_t number, writer().PutEdit(edit));
    numbers.push_back(number);
    return absl::OkStatus();
  };
  const absl::Status first = Commit(put);
  if (storage().number() == 0) {  // who has a store alone asks nobody
    EXPECT_THAT(first, StatusIs(absl::StatusCode::kUnimplemented, ::testing::_));
    EXPECT_FALSE(reader().FindEdit(0, 10)->has_value());
    EXPECT_EQ(*reader().LastEdit(), 0U);
    return;
  }
  STRATA_ASSERT_OK(first);
  STRATA_ASSERT_OK(Commit(put));
  STRATA_ASSERT_OK(Commit(put));
  EXPECT_THAT(Waiting(reader(), numbers[2]), ElementsAre(numbers[0], numbers[1], numbers[2]));
  EXPECT_THAT(Waiting(reader(), numbers[1]), ElementsAre(numbers[0], numbers[1]));
  EXPECT_EQ(*reader().LastEdit(), numbers[2]);
  STRATA_ASSERT_OK(Commit([&] { return writer().BeginEdit(numbers[0]); }));
  STRATA_ASSERT_OK_AND_ASSIGN(const auto found, reader().FindEdit(0, numbers[0]));
  EXPECT_EQ(found->kind, edit.kind);
  EXPECT_EQ(found->scan, edit.scan);
  EXPECT_EQ(found->value, edit.value);
  EXPECT_EQ(found->begun, 1U);
  EXPECT_FALSE(reader().FindAnswer(numbers[0])->has_value());
  // All that an answer has comes back.
  const absl::Status refused =
      WithRetryDelay(absl::ResourceExhaustedError("no \xFF room"), absl::Milliseconds(250));
  const auto answer = [&](std::uint64_t number, const absl::Status& what) {
    return Commit([&] { return writer().AnswerEdit(number, what); });
  };
  STRATA_ASSERT_OK(answer(numbers[0], absl::OkStatus()));
  STRATA_ASSERT_OK(answer(numbers[1], refused));
  EXPECT_EQ(reader().FindAnswer(numbers[0])->value(), absl::OkStatus());
  EXPECT_EQ(reader().FindAnswer(numbers[1])->value(), refused);
  EXPECT_EQ(RetryDelayOf(reader().FindAnswer(numbers[1])->value()), absl::Milliseconds(250));
  // Once: of two who answer, or of who answers and who withdraws, one is first.
  EXPECT_THAT(answer(numbers[1], absl::OkStatus()),
              StatusIs(absl::StatusCode::kAborted, HasSubstr("withdrawn")));
  bool waited = true;
  const auto withdraw = [&](std::uint64_t number) {
    return Commit([&]() -> absl::Status {
      STRATA_ASSIGN_OR_RETURN(waited, writer().WithdrawEdit(number));
      return absl::OkStatus();
    });
  };
  STRATA_ASSERT_OK(withdraw(numbers[1]));
  EXPECT_FALSE(waited);
  STRATA_ASSERT_OK(withdraw(numbers[2]));
  EXPECT_TRUE(waited);
  EXPECT_THAT(answer(numbers[2], absl::OkStatus()),
              StatusIs(absl::StatusCode::kAborted, ::testing::_));
  Reopen();
  EXPECT_THAT(Waiting(reader(), numbers[2]), ElementsAre());
  EXPECT_EQ(*reader().LastEdit(), 0U);
  EXPECT_EQ(reader().FindAnswer(numbers[1])->value(), refused);
  STRATA_ASSERT_OK(Commit([&] { return writer().ForgetEdit(numbers[1]); }));
  for (const std::uint64_t gone : {numbers[1], numbers[2]}) {
    EXPECT_THAT(reader().FindAnswer(gone), StatusIs(absl::StatusCode::kNotFound, ::testing::_));
  }
}

TEST_F(MapContractTest, SoManyEditsWaitAndNoMore) {
  if (storage().number() == 0) return;
  std::uint64_t number = 0;
  const auto put = [&]() -> absl::Status {
    STRATA_ASSIGN_OR_RETURN(number, writer().PutEdit({}));
    return absl::OkStatus();
  };
  STRATA_ASSERT_OK(Commit([&]() -> absl::Status {
    for (std::uint64_t i = 0; i < kMostEdits; ++i) STRATA_RETURN_IF_ERROR(put());
    return absl::OkStatus();
  }));
  const absl::Status refused = Commit(put);
  EXPECT_THAT(refused, StatusIs(absl::StatusCode::kResourceExhausted, HasSubstr("retry")));
  EXPECT_TRUE(RetryDelayOf(refused).has_value());
  STRATA_ASSERT_OK(Commit([&] { return writer().AnswerEdit(number, absl::OkStatus()); }));
  STRATA_EXPECT_OK(Commit(put));
}

}  // namespace
}  // namespace strata::testing
