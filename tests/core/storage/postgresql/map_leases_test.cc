// Leases of maps: who has one, who gets it when, and that whoever lost it writes nothing more.
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "absl/functional/function_ref.h"
#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/str_cat.h"
#include "absl/time/clock.h"
#include "absl/time/time.h"
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/common/map_owner.h"
#include "core/common/retry_delay.h"
#include "core/common/status.h"
#include "core/storage/outcome.h"
#include "core/storage/postgresql/connection.h"
#include "core/storage/postgresql/postgres_maps.h"
#include "core/storage/storage.h"
#include "tests/support/patience.h"
#include "tests/support/postgres_cluster.h"
#include "tests/support/status_matchers.h"

namespace strata::testing {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;

constexpr char kName[] = "leased";

// Nobody renews so soon that a test meets it, but for once right after it was taken.
constexpr absl::Duration kLong = absl::Hours(1);
// A machine that is busy may hold up whoever renews for two thirds of it.
constexpr absl::Duration kShort = absl::Seconds(3);

// Until `happened`, for at most as long as a machine that is busy could need.
bool InTime(absl::FunctionRef<bool()> happened) {
  const absl::Time end = absl::Now() + kPatience;
  while (!happened()) {
    if (absl::Now() > end) return false;
    absl::SleepFor(absl::Milliseconds(20));
  }
  return true;
}

class MapLeasesTest : public ::testing::Test {
 protected:
  void SetUp() override {
    const auto cluster = SharedPostgresCluster();
    if (absl::IsFailedPrecondition(cluster.status())) GTEST_SKIP() << cluster.status().message();
    STRATA_ASSERT_OK(cluster);
    address_ =
        (*cluster)->AddressOfOwn(::testing::UnitTest::GetInstance()->current_test_info()->name());
    STRATA_ASSERT_OK(Server("any").Create(kName, MapParameters(), absl::Now()));
    STRATA_ASSERT_OK_AND_ASSIGN(sql_, Connection::Open(address_));
    STRATA_ASSERT_OK(sql_->Execute(
        "CREATE SEQUENCE renewals; CREATE FUNCTION count_renewal() RETURNS trigger LANGUAGE "
        "plpgsql AS $f$ "
        "BEGIN PERFORM nextval('renewals'); RETURN NEW; END $f$; CREATE TRIGGER renewal BEFORE "
        "UPDATE ON map_lease FOR EACH ROW EXECUTE FUNCTION count_renewal()"));
  }
  PostgresMaps Server(const std::string& name,
                      absl::Duration time = kLong,
                      bool fenced = true,
                      const std::string& roles = "") {
    PostgresOptions options;
    options.where = address_;
    options.lease = {
        .holder = name, .server = absl::StrCat("server ", name), .roles = roles, .time = time};
    options.fenced = fenced;
    auto maps = PostgresMaps::Connect(options);
    STRATA_EXPECT_OK(maps);
    return *std::move(maps);
  }
  // As if its owner had been frozen for longer than it lasts.
  void LetLapse() {
    ASSERT_TRUE(InTime([this] {
      auto renewed = sql_->Query("SELECT is_called FROM renewals");
      return renewed.ok() && renewed->Next() && renewed->Int(0) != 0;
    }));
    STRATA_ASSERT_OK(sql_->Execute(
        "UPDATE map_lease SET expires = clock_timestamp() - interval '1 microsecond'"));
  }
  static absl::StatusOr<std::uint64_t> Tick(MapStorage& map) {
    std::uint64_t number = 0;
    const absl::Status done = map.writer().Commit(Durability::kFull, [&]() -> absl::Status {
      auto next = map.writer().NextCommitSequence();
      number = next.value_or(0);
      return next.status();
    });
    if (!done.ok()) return done;
    return number;
  }
  static absl::Status Stage(MapStorage& map, std::uint64_t upload) {
    return map.writer().Commit(Durability::kRelaxed,
                               [&] { return map.writer().PutChunk(upload, 0, "bytes"); });
  }

  std::string address_;
  std::unique_ptr<Connection> sql_;
};

TEST_F(MapLeasesTest, OneHasItAtATime) {
  const PostgresMaps a = Server("a");
  const PostgresMaps b = Server("b");
  STRATA_ASSERT_OK_AND_ASSIGN(std::unique_ptr<MapStorage> held, a.OpenAlone(kName));
  const absl::Status refused = b.OpenAlone(kName).status();
  EXPECT_THAT(refused, StatusIs(absl::StatusCode::kUnavailable, ::testing::HasSubstr("server a")));
  EXPECT_EQ(MapOwnerOf(refused), "server a");
  EXPECT_TRUE(RetryDelayOf(refused).has_value());
  EXPECT_EQ(MapOwnerOf(b.Delete(kName)), "server a");
  EXPECT_THAT(b.ListAbandoned(), IsOkAndHolds(IsEmpty()));
  STRATA_EXPECT_OK(Tick(*held));
  STRATA_EXPECT_OK(held->CheckHeld());
  // Whoever goes gives it up at once.
  held.reset();
  EXPECT_TRUE(InTime([&] { return b.OpenAlone(kName).ok(); }));
}

TEST_F(MapLeasesTest, WhoTakesNoMapsIsAlwaysRefused) {
  const PostgresMaps gateway = Server("g", kLong, true, "gateway");
  const absl::Status refused = gateway.OpenAlone(kName).status();
  EXPECT_EQ(MapOwnerOf(refused), "nobody") << refused;
  EXPECT_TRUE(absl::IsNotFound(gateway.OpenAlone("nowhere").status()));
  const PostgresMaps a = Server("a");
  STRATA_ASSERT_OK_AND_ASSIGN(const auto held, a.OpenAlone(kName));
  EXPECT_EQ(MapOwnerOf(gateway.OpenAlone(kName).status()), "server a");
}

// To those that take maps, as one whose server died, and only where some of them lives.
TEST_F(MapLeasesTest, AMapThatNobodyHasIsOffered) {
  const PostgresMaps gateway = Server("g", kLong, true, "gateway");
  EXPECT_THAT(gateway.Offer(kName),
              StatusIs(absl::StatusCode::kUnavailable, ::testing::HasSubstr("--role integrator")));
  EXPECT_TRUE(absl::IsNotFound(gateway.Offer("nowhere")));
  const PostgresMaps a = Server("a", kLong, true, "gateway,integrator");
  STRATA_EXPECT_OK(gateway.Offer(kName));
  EXPECT_THAT(a.ListAbandoned(), IsOkAndHolds(ElementsAre(kName)));
  STRATA_ASSERT_OK_AND_ASSIGN(const auto held, a.OpenAlone(kName));
  EXPECT_EQ(held->last_owner(), LastOwner::kNobody);
  STRATA_EXPECT_OK(gateway.Offer(kName));
  EXPECT_THAT(a.ListAbandoned(), IsOkAndHolds(IsEmpty()));
  STRATA_EXPECT_OK(Tick(*held));
}

TEST_F(MapLeasesTest, ServersLiveAsLongAsTheySaySo) {
  const PostgresMaps any = Server("any");
  EXPECT_THAT(any.ListWorkers(), IsOkAndHolds(IsEmpty())) << "who has no roles is no server";
  const PostgresMaps gateway = Server("g", kShort, true, "gateway");
  {
    const PostgresMaps worker = Server("w", kShort, true, "gateway,worker");
    {
      const PostgresMaps other = Server("x", kLong, true, "worker");
      EXPECT_THAT(any.ListWorkers(), IsOkAndHolds(ElementsAre("w", "x")));
    }
    EXPECT_THAT(any.ListWorkers(), IsOkAndHolds(ElementsAre("w"))) << "who ends says so";
    absl::SleepFor(2 * kShort);
    EXPECT_THAT(any.ListWorkers(), IsOkAndHolds(ElementsAre("w"))) << "it is renewed";
  }
  EXPECT_THAT(any.ListWorkers(), IsOkAndHolds(IsEmpty()));
}

// Beside who has the map, until the job is given to another.
TEST_F(MapLeasesTest, CommitsOfAJobAskWhoRunsIt) {
  const PostgresMaps owner = Server("a");
  const PostgresMaps worker = Server("w", kLong, true, "worker");
  STRATA_ASSERT_OK_AND_ASSIGN(const auto held, owner.OpenAlone(kName));
  JobInfo job;
  job.id = 3;
  job.kind = "verify";
  job.state = JobState::kRunning;
  const auto put = [&](MapStorage& map, const std::string& run_by) {
    job.parameters[kRunBy] = run_by;
    return map.writer().Commit(Durability::kFull, [&] { return map.writer().PutJob(job); });
  };
  STRATA_ASSERT_OK_AND_ASSIGN(const auto taking, worker.OpenToWork(kName, 3, ""));
  STRATA_ASSERT_OK(put(*taking, "w/1"));
  STRATA_ASSERT_OK_AND_ASSIGN(const std::vector<UnfinishedJob> jobs, worker.ListUnfinishedJobs());
  ASSERT_EQ(jobs.size(), 1U);
  EXPECT_EQ(jobs[0].map, kName);
  EXPECT_EQ(jobs[0].id, 3U);
  EXPECT_EQ(jobs[0].state, JobState::kRunning);
  EXPECT_EQ(jobs[0].run_by, "w/1");
  STRATA_ASSERT_OK_AND_ASSIGN(const auto running, worker.OpenToWork(kName, 3, "w/1"));
  STRATA_EXPECT_OK(Stage(*running, 7));
  STRATA_EXPECT_OK(put(*running, "w/1"));
  STRATA_EXPECT_OK(Tick(*held));  // neither is in the other's way
  STRATA_ASSERT_OK(put(*held, "x/2"));
  for (const absl::Status& done : {Stage(*running, 8), put(*running, "w/1")}) {
    EXPECT_TRUE(MustBeOpenedAnew(done)) << done;
  }
  EXPECT_EQ(worker.ListUnfinishedJobs()->front().run_by, "x/2");
  job.state = JobState::kSucceeded;
  STRATA_ASSERT_OK(put(*held, "x/2"));
  EXPECT_THAT(worker.ListUnfinishedJobs(), IsOkAndHolds(IsEmpty()));
}

TEST_F(MapLeasesTest, AMapIsDeletedAsAskedUntilThatIsWithdrawn) {
  const PostgresMaps owner = Server("a");
  const PostgresMaps asker = Server("b");
  STRATA_ASSERT_OK_AND_ASSIGN(auto held, owner.OpenAlone(kName));
  STRATA_ASSERT_OK_AND_ASSIGN(const auto beside, asker.OpenToAdd(kName, 10));
  StorageWriter& writer = beside->writer();
  std::uint64_t asked = 0;
  const auto ask = [&] {
    return writer.Commit(Durability::kFull, [&]() -> absl::Status {
      EditRequest edit;
      edit.kind = EditKind::kDeleteMap;
      STRATA_ASSIGN_OR_RETURN(asked, writer.PutEdit(edit));
      return absl::OkStatus();
    });
  };
  STRATA_ASSERT_OK(ask());
  EXPECT_EQ(held->writer().reader().LastEdit().value_or(9), 0U) << "no work of its worker's";
  ASSERT_EQ(owner.ListWaiting()->size(), 1U);
  EXPECT_TRUE(owner.ListWaiting()->front().deletion);
  STRATA_ASSERT_OK(
      writer.Commit(Durability::kFull, [&] { return writer.WithdrawEdit(asked).status(); }));
  EXPECT_TRUE(absl::IsAborted(owner.DeleteAsAsked(kName)));
  STRATA_EXPECT_OK(asker.Has(kName));
  STRATA_ASSERT_OK(ask());
  EXPECT_EQ(MapOwnerOf(asker.DeleteAsAsked(kName)), "server a");
  STRATA_ASSERT_OK(owner.DeleteAsAsked(kName));
  EXPECT_THAT(asker.Has(kName), IsOkAndHolds(false));
  EXPECT_TRUE(MustBeOpenedAnew(beside->CheckInPlace()));
  STRATA_EXPECT_OK(asker.FinishDeletions());
  STRATA_ASSERT_OK_AND_ASSIGN(Rows left, sql_->Query("SELECT count(*) FROM map_place"));
  ASSERT_TRUE(left.Next());
  EXPECT_EQ(left.Int(0), 0);
}

// Of the same server, started again before its lease has ended.
TEST_F(MapLeasesTest, ItsSuccessorGetsItAtOnce) {
  const PostgresMaps dead = Server("a");
  STRATA_ASSERT_OK_AND_ASSIGN(const auto before, dead.OpenAlone(kName));
  const PostgresMaps started = Server("a");
  STRATA_ASSERT_OK_AND_ASSIGN(const auto after, started.OpenAlone(kName));
  STRATA_EXPECT_OK(Tick(*after));
  EXPECT_TRUE(MustBeOpenedAnew(Tick(*before).status()));
}

TEST_F(MapLeasesTest, WhoeverLostItWritesNothingMore) {
  const PostgresMaps a = Server("a");
  const PostgresMaps b = Server("b");
  STRATA_ASSERT_OK_AND_ASSIGN(const auto frozen, a.OpenAlone(kName));
  STRATA_ASSERT_OK_AND_ASSIGN(const std::uint64_t first, Tick(*frozen));
  LetLapse();
  EXPECT_THAT(b.ListAbandoned(), IsOkAndHolds(ElementsAre(kName)));
  STRATA_EXPECT_OK(Tick(*frozen));  // nobody else has it yet
  STRATA_ASSERT_OK_AND_ASSIGN(const auto taken, b.OpenAlone(kName));
  for (const absl::Status& done : {Tick(*frozen).status(), Stage(*frozen, 7)}) {
    EXPECT_THAT(done, StatusIs(absl::StatusCode::kUnavailable, ::testing::_));
    EXPECT_TRUE(MustBeOpenedAnew(done));
    EXPECT_FALSE(IsOutcomeUnknown(done));
  }
  EXPECT_THAT(Tick(*taken), IsOkAndHolds(first + 2));
  STRATA_ASSERT_OK_AND_ASSIGN(const auto reader, taken->NewReader());
  EXPECT_FALSE(reader->GetChunk(7, 0).ok());
}

// That the test above can fail: with the check off, two write beside each other.
TEST_F(MapLeasesTest, WithoutTheFenceItWouldWrite) {
  const PostgresMaps a = Server("a", kLong, /*fenced=*/false);
  const PostgresMaps b = Server("b");
  STRATA_ASSERT_OK_AND_ASSIGN(const auto frozen, a.OpenAlone(kName));
  STRATA_EXPECT_OK(Tick(*frozen));
  LetLapse();
  STRATA_ASSERT_OK_AND_ASSIGN(const auto taken, b.OpenAlone(kName));
  STRATA_EXPECT_OK(Tick(*frozen));
  STRATA_EXPECT_OK(Stage(*frozen, 7));
}

TEST_F(MapLeasesTest, ItIsRenewedUntilAnotherHasIt) {
  const PostgresMaps a = Server("a", kShort);
  const PostgresMaps b = Server("b");
  STRATA_ASSERT_OK_AND_ASSIGN(const auto held, a.OpenAlone(kName));
  for (const absl::Time end = absl::Now() + 2 * kShort; absl::Now() < end;) {
    EXPECT_NE(MapOwnerOf(b.OpenAlone(kName).status()), std::nullopt);
    absl::SleepFor(absl::Milliseconds(100));
  }
  // A row that somebody holds who looks at it is not waited for, and its lease ends meanwhile.
  STRATA_ASSERT_OK(sql_->Execute("BEGIN; SELECT 1 FROM map_lease FOR UPDATE"));
  EXPECT_TRUE(InTime([&] { return !held->CheckHeld().ok(); }));
  const absl::Status unsure = held->CheckHeld();
  EXPECT_THAT(unsure, StatusIs(absl::StatusCode::kUnavailable, ::testing::_));
  EXPECT_FALSE(MustBeOpenedAnew(unsure));
  STRATA_ASSERT_OK(sql_->Execute("COMMIT"));
  EXPECT_TRUE(InTime([&] { return held->CheckHeld().ok(); }));
  // Taken, it is known here at the next renewal.
  STRATA_ASSERT_OK(
      sql_->Execute("UPDATE map_lease SET token = 1, holder = 'x', server = 'server x', expires = "
                    "clock_timestamp() + interval '1 hour'"));
  EXPECT_TRUE(InTime([&] { return MustBeOpenedAnew(held->CheckHeld()); }));
  EXPECT_EQ(MapOwnerOf(held->CheckHeld()), "server x");
}

TEST_F(MapLeasesTest, TablesOfTheVersionBeforeGetLeases) {
  STRATA_ASSERT_OK(
      sql_->Execute("DROP TABLE map_lease; DROP TABLE map_change; DROP TABLE map_edit; DROP TABLE "
                    "map_server; DROP INDEX truth_job_unfinished; ALTER TABLE derived_state DROP "
                    "COLUMN changes_after; UPDATE strata_format SET version = 1"));
  const PostgresMaps a = Server("a");
  STRATA_ASSERT_OK_AND_ASSIGN(const auto held, a.OpenAlone(kName));
  STRATA_ASSERT_OK_AND_ASSIGN(const auto reader, held->NewReader());
  const std::uint64_t before = reader->GetClock()->commit_sequence;
  STRATA_EXPECT_OK(Tick(*held));
  // What changed before nobody has kept.
  EXPECT_TRUE(reader->ListChanges(before)->complete);
  EXPECT_TRUE(before == 0 || !reader->ListChanges(before - 1)->complete);
}

// What waits in kName.
MATCHER_P3(WaitsWith, scans, jobs, edits, "") {
  return arg.name == kName && arg.scans == scans && arg.jobs == jobs && arg.edits == edits;
}

ScanRecord ScanOf(std::uint64_t sequence, std::uint64_t number, std::uint32_t chunks) {
  ScanRecord scan;
  scan.header.id = {"run", sequence};
  scan.number = number;
  scan.upload = 1000 + sequence;
  scan.chunks = chunks;
  scan.content_hash = "h";
  return scan;
}

// Puts a scan of one chunk, whose other chunks were staged before.
absl::Status PutScanOf(MapStorage& storage, std::uint64_t sequence, std::uint32_t staged = 0) {
  StorageWriter& writer = storage.writer();
  return writer.Commit(Durability::kFull, [&]() -> absl::Status {
    STRATA_ASSIGN_OR_RETURN(const std::uint64_t number, writer.NextCommitSequence());
    STRATA_RETURN_IF_ERROR(writer.PutChunk(1000 + sequence, staged, "points"));
    return writer.PutScan(ScanOf(sequence, number, staged + 1));
  });
}

absl::Status StageChunk(MapStorage& storage, std::uint64_t sequence) {
  StorageWriter& writer = storage.writer();
  return writer.Commit(Durability::kRelaxed,
                       [&] { return writer.PutChunk(1000 + sequence, 0, "points"); });
}

TEST_F(MapLeasesTest, ScansAreAddedBesideTheOneWhoHasTheMap) {
  const PostgresMaps a = Server("a");
  const PostgresMaps b = Server("b");
  EXPECT_THAT(b.OpenToAdd(kName, 3), StatusIs(absl::StatusCode::kUnavailable, ::testing::_))
      << "nobody has it";
  STRATA_ASSERT_OK_AND_ASSIGN(const auto owner, a.OpenAlone(kName));
  STRATA_ASSERT_OK_AND_ASSIGN(const auto beside, b.OpenToAdd(kName, 3));
  // By turns, full and relaxed: neither takes the other's commit for a lost one of its own.
  STRATA_ASSERT_OK(PutScanOf(*owner, 1));
  EXPECT_THAT(a.ListWaiting(), IsOkAndHolds(ElementsAre(WaitsWith(true, false, 0U))));
  STRATA_ASSERT_OK(StageChunk(*beside, 2));
  STRATA_ASSERT_OK(PutScanOf(*beside, 2, 1));
  STRATA_ASSERT_OK(StageChunk(*owner, 3));
  STRATA_ASSERT_OK(PutScanOf(*owner, 3, 1));
  EXPECT_THAT(b.ListWaiting(), IsOkAndHolds(IsEmpty())) << "who only adds has nothing to do";
  JobInfo job;
  job.id = 1;
  job.kind = "verify";
  STRATA_ASSERT_OK(
      beside->writer().Commit(Durability::kFull, [&] { return beside->writer().PutJob(job); }));
  EXPECT_THAT(a.ListWaiting(), IsOkAndHolds(ElementsAre(WaitsWith(true, true, 0U))));
  std::uint64_t edit = 0;
  STRATA_ASSERT_OK(beside->writer().Commit(Durability::kFull, [&]() -> absl::Status {
    STRATA_ASSIGN_OR_RETURN(edit, beside->writer().PutEdit({}));
    return absl::OkStatus();
  }));
  EXPECT_THAT(a.ListWaiting(), IsOkAndHolds(ElementsAre(WaitsWith(true, true, edit))));
  STRATA_ASSERT_OK(owner->writer().Commit(
      Durability::kFull, [&] { return owner->writer().AnswerEdit(edit, absl::OkStatus()); }));
  EXPECT_THAT(a.ListWaiting(), IsOkAndHolds(ElementsAre(WaitsWith(true, true, 0U))));
  STRATA_ASSERT_OK_AND_ASSIGN(const auto reader, owner->NewReader());
  EXPECT_THAT(reader->ListScanNumbers(), IsOkAndHolds(ElementsAre(1, 2, 3)));
  // There is room for as many as were said to be let wait.
  EXPECT_THAT(PutScanOf(*beside, 4), StatusIs(absl::StatusCode::kResourceExhausted, ::testing::_));
  STRATA_ASSERT_OK(PutScanOf(*owner, 4)) << "whose engine counts itself";
  STRATA_ASSERT_OK_AND_ASSIGN(const auto patient, b.OpenToAdd(kName, 100));
  // The next owner clears away what belongs to no scan, so the scan is not made without it.
  STRATA_ASSERT_OK(StageChunk(*patient, 5));
  STRATA_ASSERT_OK(
      owner->writer().Commit(Durability::kFull, [&] { return owner->writer().AbandonOrphans(); }));
  EXPECT_THAT(PutScanOf(*patient, 5, 1), StatusIs(absl::StatusCode::kUnavailable, ::testing::_));
  STRATA_ASSERT_OK(PutScanOf(*patient, 6));
}

}  // namespace
}  // namespace strata::testing
