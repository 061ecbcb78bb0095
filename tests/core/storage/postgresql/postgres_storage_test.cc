// What only a database of maps does: several writers, its errors, its maps, its end.
#include <atomic>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <thread>
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

#include "core/common/status.h"
#include "core/storage/postgresql/connection.h"
#include "core/storage/postgresql/connection_pool.h"
#include "core/storage/postgresql/postgres_maps.h"
#include "core/storage/postgresql/sql_state.h"
#include "core/storage/sqlite/sqlite_storage.h"
#include "core/storage/storage.h"
#include "tests/support/postgres_cluster.h"
#include "tests/support/status_matchers.h"
#include "tests/support/temp_dir.h"

namespace strata::testing {
namespace {

using ::testing::Contains;
using ::testing::HasSubstr;
using ::testing::Not;

class PostgresStorageTest : public ::testing::Test {
 protected:
  void SetUp() override {
    const auto cluster = SharedPostgresCluster();
    if (absl::IsFailedPrecondition(cluster.status())) GTEST_SKIP() << cluster.status().message();
    ASSERT_THAT(cluster, IsOk());
    address_ = (*cluster)->Address();
    auto made = PostgresMaps::Connect(Options());
    ASSERT_THAT(made, IsOk());
    maps_.emplace(*std::move(made));
    static int last = 0;
    name_ = absl::StrCat("map ", ++last);
    STRATA_ASSERT_OK(maps_->Create(name_, MapParameters(), absl::Now()));
    auto connection = Connection::Open(address_);
    ASSERT_THAT(connection, IsOk());
    other_ = *std::move(connection);
    storage_ = Opened();
  }
  void TearDown() override {
    if (other_ == nullptr) return;
    other_
        ->Execute(
            "DROP TRIGGER IF EXISTS fault ON truth_chunk; DROP TRIGGER IF EXISTS late_fault ON "
            "truth_chunk; DROP SEQUENCE IF EXISTS faults")
        .IgnoreError();
  }
  PostgresOptions Options() const {
    PostgresOptions options;
    options.where = address_;
    return options;
  }
  std::unique_ptr<MapStorage> Opened() {
    auto opened = maps_->Open(name_);
    EXPECT_THAT(opened, IsOk());
    return opened.ok() ? *std::move(opened) : nullptr;
  }
  std::unique_ptr<StorageReader> Reader() {
    auto reader = storage_->NewReader();
    EXPECT_THAT(reader, IsOk());
    return *std::move(reader);
  }
  // Runs `function` before each piece; sequences go on when a transaction fails.
  void FailPieces(const char* function) {
    STRATA_ASSERT_OK(
        other_->Execute(absl::StrCat("CREATE SEQUENCE faults; CREATE OR REPLACE FUNCTION fail() "
                                     "RETURNS trigger LANGUAGE plpgsql AS $f$ BEGIN ",
                                     function,
                                     " RETURN NEW; END $f$; CREATE TRIGGER fault BEFORE INSERT ON "
                                     "truth_chunk FOR EACH ROW EXECUTE FUNCTION fail()")
                            .c_str()));
  }
  absl::Status PutPiece(std::uint64_t upload, int* runs = nullptr) {
    return storage_->writer().Commit(Durability::kFull, [&] {
      if (runs != nullptr) ++*runs;
      return storage_->writer().PutChunk(upload, 0, "bytes");
    });
  }

  std::string address_;
  std::string name_;
  std::optional<PostgresMaps> maps_;
  std::unique_ptr<Connection> other_;
  std::unique_ptr<MapStorage> storage_;
};

TEST_F(PostgresStorageTest, DecisionsOfSeveralWritersFollowEachOther) {
  constexpr int kWriters = 4;
  constexpr int kCommits = 50;
  std::vector<std::vector<std::uint64_t>> numbers(kWriters);
  std::vector<std::thread> threads;
  for (int w = 0; w < kWriters; ++w) {
    threads.emplace_back([&, w] {
      const std::unique_ptr<MapStorage> storage = Opened();
      StorageWriter& writer = storage->writer();
      for (int i = 0; i < kCommits; ++i) {
        STRATA_EXPECT_OK(writer.Commit(Durability::kFull, [&]() -> absl::Status {
          // A read, then a write that trusts it: the number of attempts kept.
          STRATA_ASSIGN_OR_RETURN(const std::vector<Attempt> before,
                                  writer.reader().ListAttempts());
          STRATA_ASSIGN_OR_RETURN(const std::uint64_t number, writer.NextCommitSequence());
          numbers[static_cast<std::size_t>(w)].push_back(number);
          return writer.PutAttempt({{WorkKind::kJob, before.size()}, 0, false});
        }));
      }
    });
  }
  for (std::thread& thread : threads) thread.join();
  std::set<std::uint64_t> all;
  for (const auto& some : numbers) all.insert(some.begin(), some.end());
  EXPECT_EQ(all.size(), std::size_t{kWriters * kCommits});
  EXPECT_EQ(*all.rbegin(), std::uint64_t{kWriters * kCommits});
  EXPECT_EQ(Reader()->ListAttempts()->size(), std::size_t{kWriters * kCommits});
}

TEST_F(PostgresStorageTest, ABodyIsRunAgainAfterASerialisationFailure) {
  FailPieces(
      "IF nextval('faults') <= 3 THEN RAISE EXCEPTION 'busy' USING ERRCODE = '40001'; END IF;");
  int runs = 0;
  STRATA_EXPECT_OK(PutPiece(1, &runs));
  EXPECT_EQ(runs, 4);
  EXPECT_THAT(Reader()->GetChunk(1, 0), IsOkAndHolds(std::string("bytes")));
}

// A part that fails is its caller's, a deadlock in it everybody's.
TEST_F(PostgresStorageTest, ADeadlockInAPartRunsTheWholeBodyAgain) {
  FailPieces(
      "IF nextval('faults') <= 1 THEN RAISE EXCEPTION 'dead' USING ERRCODE = '40P01'; END IF;");
  int runs = 0;
  StorageWriter& writer = storage_->writer();
  STRATA_EXPECT_OK(writer.Commit(Durability::kFull, [&]() -> absl::Status {
    ++runs;
    writer.Part([&] { return writer.PutChunk(1, 0, "a"); }).IgnoreError();
    return writer.Part([&] { return writer.PutChunk(2, 0, "b"); });
  }));
  EXPECT_EQ(runs, 2);
  EXPECT_THAT(Reader()->GetChunk(1, 0), IsOk());
}

TEST_F(PostgresStorageTest, AfterFiveRepetitionsItIsAborted) {
  FailPieces("RAISE EXCEPTION 'busy' USING ERRCODE = '40001';");
  int runs = 0;
  EXPECT_THAT(PutPiece(1, &runs), StatusIs(absl::StatusCode::kAborted, HasSubstr("in the way")));
  EXPECT_EQ(runs, 6);
}

TEST_F(PostgresStorageTest, AFullDiskIsSaidAndLosesNothing) {
  STRATA_ASSERT_OK(PutPiece(1));
  FailPieces("RAISE EXCEPTION 'no space left' USING ERRCODE = '53100';");
  int runs = 0;
  EXPECT_THAT(PutPiece(2, &runs),
              StatusIs(absl::StatusCode::kResourceExhausted, HasSubstr("53100")));
  EXPECT_EQ(runs, 1);
  EXPECT_FALSE(Reader()->GetChunk(2, 0).ok());
  STRATA_ASSERT_OK(other_->Execute("DROP TRIGGER fault ON truth_chunk"));
  STRATA_EXPECT_OK(PutPiece(2));
}

TEST_F(PostgresStorageTest, AConnectionCutInTheBodyLeavesNothing) {
  FailPieces("PERFORM pg_terminate_backend(pg_backend_pid()); PERFORM pg_sleep(1);");
  EXPECT_THAT(PutPiece(2),
              StatusIs(absl::StatusCode::kUnavailable, Not(HasSubstr("outcome unknown"))));
  STRATA_ASSERT_OK(other_->Execute("DROP TRIGGER fault ON truth_chunk"));
  EXPECT_FALSE(Reader()->GetChunk(2, 0).ok());
  STRATA_EXPECT_OK(PutPiece(2));
}

TEST_F(PostgresStorageTest, AConnectionCutInTheCommitSaysThatNobodyKnows) {
  STRATA_ASSERT_OK(other_->Execute(
      "CREATE OR REPLACE FUNCTION fail_late() RETURNS trigger LANGUAGE plpgsql AS $f$ BEGIN "
      "PERFORM pg_terminate_backend(pg_backend_pid()); PERFORM pg_sleep(1); RETURN NULL; END $f$; "
      "CREATE CONSTRAINT TRIGGER late_fault AFTER INSERT ON truth_chunk DEFERRABLE INITIALLY "
      "DEFERRED FOR EACH ROW EXECUTE FUNCTION fail_late()"));
  EXPECT_THAT(storage_->writer().Commit(Durability::kRelaxed,
                                        [&] { return storage_->writer().PutChunk(1, 0, "a"); }),
              StatusIs(absl::StatusCode::kUnavailable, HasSubstr("outcome unknown")));
  // Of a full one nothing was committed, and another may have written since.
  int runs = 0;
  EXPECT_THAT(PutPiece(2, &runs),
              StatusIs(absl::StatusCode::kUnavailable, HasSubstr("outcome unknown")));
  EXPECT_EQ(runs, 1);
  // Nobody else has: it is known, and made again.
  STRATA_ASSERT_OK_AND_ASSIGN(storage_, maps_->OpenAlone(name_));
  runs = 0;
  EXPECT_THAT(PutPiece(2, &runs),
              StatusIs(absl::StatusCode::kUnavailable, Not(HasSubstr("outcome unknown"))));
  EXPECT_EQ(runs, 6);
  STRATA_ASSERT_OK(other_->Execute("DROP TRIGGER late_fault ON truth_chunk"));
  STRATA_EXPECT_OK(PutPiece(2));
}

TEST_F(PostgresStorageTest, WhoeverWaitsForTheMapsRowForTooLongIsTold) {
  STRATA_ASSERT_OK(other_->Execute("BEGIN; SELECT 1 FROM truth_map FOR UPDATE"));
  STRATA_ASSERT_OK(other_->Execute("SET idle_in_transaction_session_timeout = 0"));
  EXPECT_THAT(PutPiece(1), StatusIs(absl::StatusCode::kResourceExhausted, HasSubstr("55P03")));
  STRATA_ASSERT_OK(other_->Execute("ROLLBACK"));
  STRATA_EXPECT_OK(PutPiece(1));
}

TEST_F(PostgresStorageTest, TextThatPostgresqlHasNotIsRefused) {
  for (const std::string& text : {std::string("a\0b", 3), std::string("\xff\xfe")}) {
    EXPECT_THAT(
        storage_->writer().Commit(
            Durability::kFull, [&] { return storage_->writer().PutProfile(text, RobotProfile()); }),
        StatusIs(absl::StatusCode::kInvalidArgument, HasSubstr("store")))
        << text;
  }
}

TEST_F(PostgresStorageTest, NamesAreValuesNeverSql) {
  const std::string evil = "x'); DROP TABLE truth_scan; --\\";
  STRATA_ASSERT_OK(maps_->Create(evil, MapParameters(), absl::Now()));
  EXPECT_THAT(maps_->List(), IsOkAndHolds(Contains(evil)));
  EXPECT_THAT(Reader()->GetUploadState(evil), IsOk());
  STRATA_EXPECT_OK(storage_->writer().Commit(
      Durability::kFull, [&] { return storage_->writer().BeginEpoch(evil, 0).status(); }));
  EXPECT_EQ(Reader()->ListEpochs()->front().reason, evil);
  STRATA_EXPECT_OK(maps_->Delete(evil));
  EXPECT_THAT(maps_->Delete(evil), StatusIs(absl::StatusCode::kNotFound, HasSubstr(evil)));
}

TEST_F(PostgresStorageTest, WhoeverOpensAMapAloneKeepsOthersOut) {
  STRATA_ASSERT_OK_AND_ASSIGN(storage_, maps_->OpenAlone(name_));
  STRATA_EXPECT_OK(PutPiece(1));
  STRATA_EXPECT_OK(storage_->CheckInPlace());
  STRATA_ASSERT_OK_AND_ASSIGN(const auto later, maps_->OpenAlone(name_));
  // The writer finds out, or whoever renews the lease, whichever is first.
  const auto refused =
      StatusIs(absl::StatusCode::kUnavailable,
               ::testing::AnyOf(HasSubstr("another process"), HasSubstr("was taken")));
  EXPECT_THAT(PutPiece(2), refused);
  EXPECT_THAT(storage_->writer().Commit(Durability::kRelaxed,
                                        [&] { return storage_->writer().PutChunk(2, 0, "a"); }),
              refused);
  EXPECT_THAT(storage_->CheckInPlace(), refused);
  STRATA_EXPECT_OK(later->writer().Commit(Durability::kFull,
                                          [&] { return later->writer().PutChunk(3, 0, "b"); }));
  EXPECT_THAT(Reader()->GetChunk(3, 0), IsOk());
  EXPECT_FALSE(Reader()->GetChunk(2, 0).ok());
}

// Of a thousand and some maps two have something to do.
TEST_F(PostgresStorageTest, ASurveyTellsOfEveryMapOnce) {
  STRATA_ASSERT_OK(other_->Execute("CREATE DATABASE survey"));
  STRATA_ASSERT_OK_AND_ASSIGN(PostgresCluster* const cluster, SharedPostgresCluster());
  PostgresOptions options;
  options.where = cluster->AddressOf("survey");
  STRATA_ASSERT_OK_AND_ASSIGN(const PostgresMaps maps, PostgresMaps::Connect(options));
  constexpr int kMaps = 1050;
  MapParameters parameters;
  parameters.mls.cell_size_m = 0.25;
  for (int i = 0; i < kMaps; ++i) {
    STRATA_ASSERT_OK(maps.Create(
        absl::StrCat("m", i), parameters, absl::UnixEpoch(), static_cast<std::uint64_t>(i)));
  }
  STRATA_ASSERT_OK(maps.Delete("m3"));
  STRATA_ASSERT_OK_AND_ASSIGN(const auto pending, maps.Open("m5"));
  STRATA_ASSERT_OK(pending->writer().Commit(Durability::kFull, [&]() -> absl::Status {
    ScanRecord scan;
    scan.header.id = {"run", 1};
    scan.upload = 1;
    STRATA_ASSIGN_OR_RETURN(scan.number, pending->writer().NextCommitSequence());
    return pending->writer().PutScan(scan);
  }));
  STRATA_ASSERT_OK_AND_ASSIGN(const auto working, maps.Open("m1040"));
  STRATA_ASSERT_OK(working->writer().Commit(Durability::kFull, [&]() -> absl::Status {
    JobInfo ended;
    ended.id = 1;
    ended.state = JobState::kFailed;
    JobInfo waits;
    waits.id = 2;
    waits.state = JobState::kQueued;
    STRATA_RETURN_IF_ERROR(working->writer().PutJob(ended));
    return working->writer().PutJob(waits);
  }));
  std::set<std::string> seen;
  std::set<std::string> with_work;
  STRATA_ASSERT_OK(maps.Survey(Stop(), [&](absl::StatusOr<MapAtRest> map, const std::string& name) {
    STRATA_ASSERT_OK(map);
    EXPECT_TRUE(seen.insert(name).second) << name;
    EXPECT_EQ(map->info.name, name);
    EXPECT_EQ(map->info.parameters, parameters);
    if (map->has_work) with_work.insert(name);
    EXPECT_TRUE(name != "m7" || map->clock == 7U);
  }));
  EXPECT_EQ(seen.size(), std::size_t{kMaps - 1});
  EXPECT_THAT(with_work, ::testing::ElementsAre("m1040", "m5"));
  const Stop stop;
  stop.Request();
  EXPECT_THAT(maps.Survey(stop, [](const auto&, const auto&) {}),
              StatusIs(absl::StatusCode::kCancelled, ::testing::_));
}

TEST_F(PostgresStorageTest, TheClockOfADeletedMapIsRemembered) {
  STRATA_ASSERT_OK(storage_->writer().Commit(Durability::kFull, [&]() -> absl::Status {
    std::uint64_t number = 0;
    while (number < 1000) {
      STRATA_ASSIGN_OR_RETURN(number, storage_->writer().NextCommitSequence());
    }
    return absl::OkStatus();
  }));
  STRATA_ASSERT_OK(maps_->Delete(name_));
  EXPECT_GE(*maps_->RemovedClock(), 1000U);
}

TEST_F(PostgresStorageTest, ADeletedMapLeavesItsNameAndNoRows) {
  STRATA_ASSERT_OK(PutPiece(1));
  STRATA_ASSERT_OK(storage_->writer().Commit(
      Durability::kFull, [&] { return storage_->writer().PutEdit({}).status(); }));
  const std::unique_ptr<StorageReader> reader = Reader();
  STRATA_ASSERT_OK(maps_->Delete(name_));
  EXPECT_THAT(PutPiece(2), StatusIs(absl::StatusCode::kUnavailable, HasSubstr("removed")));
  EXPECT_THAT(reader->GetClock(), StatusIs(absl::StatusCode::kDataLoss, HasSubstr("own row")));
  STRATA_ASSERT_OK(maps_->Create(name_, MapParameters(), absl::Now(), 30));
  EXPECT_THAT(PutPiece(2), StatusIs(absl::StatusCode::kUnavailable, HasSubstr("removed")));
  storage_ = Opened();
  EXPECT_FALSE(Reader()->GetChunk(1, 0).ok());
  EXPECT_EQ(Reader()->GetClock()->commit_sequence, 30U);
  // All tables with a map are emptied, those too that somebody adds later.
  STRATA_ASSERT_OK(maps_->Delete(name_));
  STRATA_ASSERT_OK_AND_ASSIGN(
      Rows tables,
      other_->Query("SELECT c.table_name::text FROM information_schema.columns AS c WHERE "
                    "c.column_name = 'map' AND c.table_schema = 'public'"));
  EXPECT_EQ(tables.size(), 41);
  while (tables.Next()) {
    const std::string sql =
        absl::StrCat("SELECT count(*) FROM ",
                     tables.Text(0),
                     " WHERE map NOT IN (SELECT map FROM map_place WHERE state = 1)");
    STRATA_ASSERT_OK_AND_ASSIGN(const auto asking, Connection::Open(address_));
    STRATA_ASSERT_OK_AND_ASSIGN(Rows left, asking->Query(sql.c_str()));
    left.Next();
    EXPECT_EQ(left.Int(0), 0) << tables.Text(0);
  }
}

TEST_F(PostgresStorageTest, ADeletionThatWasCutShortIsCarriedOutByTheNextStart) {
  STRATA_ASSERT_OK(PutPiece(1));
  STRATA_ASSERT_OK(
      other_
          ->Change("DELETE FROM truth_map WHERE map = (SELECT map FROM map_place WHERE name = $1)",
                   name_)
          .status());
  STRATA_ASSERT_OK(
      other_->Change("UPDATE map_place SET state = 2 WHERE name = $1", name_).status());
  EXPECT_THAT(maps_->List(), IsOkAndHolds(Not(Contains(name_))));
  STRATA_ASSERT_OK(PostgresMaps::Connect(Options()));
  STRATA_ASSERT_OK_AND_ASSIGN(
      Rows left, other_->Query("SELECT count(*) FROM map_place WHERE name = $1", name_));
  left.Next();
  EXPECT_EQ(left.Int(0), 0);
}

TEST_F(PostgresStorageTest, TilesOfAnotherFormatAreDropped) {
  STRATA_ASSERT_OK(storage_->writer().Commit(Durability::kFull, [&]() -> absl::Status {
    SurfaceTileRow row;
    row.version = 1;
    STRATA_RETURN_IF_ERROR(storage_->writer().PutSurfaceTile(row));
    return storage_->writer().PublishTiles(1, true);
  }));
  STRATA_ASSERT_OK(other_
                       ->Change("UPDATE derived_state SET schema = schema + 1 WHERE map = (SELECT "
                                "map FROM map_place WHERE name = $1)",
                                name_)
                       .status());
  storage_ = Opened();
  EXPECT_FALSE(Reader()->GetClock()->derived_complete);
  EXPECT_FALSE(Reader()->FindSurfaceTile({}, 9)->has_value());
}

TEST_F(PostgresStorageTest, CopiesAreRunByNobody) {
  JobInfo job;
  job.id = 7;
  job.kind = "objects";
  job.state = JobState::kRunning;
  job.parameters = {{"scans", "2"}, {kRunBy, "who lives here/1"}};
  STRATA_ASSERT_OK(
      storage_->writer().Commit(Durability::kFull, [&] { return storage_->writer().PutJob(job); }));
  const TempDir directory;
  const std::filesystem::path file = directory.path() / "copy.strata";
  STRATA_ASSERT_OK(Reader()->CopyTo(file, Stop()));
  STRATA_ASSERT_OK_AND_ASSIGN(const auto copy, OpenSqliteStorage(file, {}));
  STRATA_ASSERT_OK_AND_ASSIGN(const auto reader, copy->NewReader());
  STRATA_ASSERT_OK_AND_ASSIGN(const std::vector<JobInfo> copied, reader->ListJobs());
  ASSERT_THAT(copied, ::testing::SizeIs(1));
  EXPECT_THAT(copied[0].parameters, ::testing::ElementsAre(::testing::Pair("scans", "2")));
  // Nor where a file says so.
  STRATA_ASSERT_OK(
      copy->writer().Commit(Durability::kFull, [&] { return copy->writer().PutJob(job); }));
  const std::filesystem::path says_so = directory.path() / "says_so.strata";
  STRATA_ASSERT_OK(reader->CopyTo(says_so, Stop()));
  STRATA_ASSERT_OK(maps_->Import("imported", says_so, Stop()));
  STRATA_ASSERT_OK_AND_ASSIGN(const auto imported, maps_->Open("imported"));
  STRATA_ASSERT_OK_AND_ASSIGN(const auto there, imported->NewReader());
  STRATA_ASSERT_OK_AND_ASSIGN(const std::vector<JobInfo> jobs, there->ListJobs());
  ASSERT_THAT(jobs, ::testing::SizeIs(1));
  EXPECT_FALSE(jobs[0].parameters.contains(kRunBy));
}

TEST_F(PostgresStorageTest, TablesThatAreOthersOrNewerAreNotReadAsOurs) {
  STRATA_ASSERT_OK(other_->Execute("CREATE DATABASE strange"));
  STRATA_ASSERT_OK_AND_ASSIGN(PostgresCluster* const cluster, SharedPostgresCluster());
  PostgresOptions options;
  options.where = cluster->AddressOf("strange");
  STRATA_ASSERT_OK_AND_ASSIGN(const PostgresMaps maps, PostgresMaps::Connect(options));
  STRATA_ASSERT_OK(maps.Create("a", MapParameters(), absl::Now()));
  STRATA_ASSERT_OK_AND_ASSIGN(const auto storage, maps.Open("a"));
  STRATA_ASSERT_OK_AND_ASSIGN(const auto reader, storage->NewReader());
  STRATA_ASSERT_OK_AND_ASSIGN(const auto strange, Connection::Open(options.where));
  STRATA_ASSERT_OK(strange->Execute("ALTER TABLE truth_map ALTER cell_size_m TYPE numeric"));
  EXPECT_THAT(reader->GetMapInfo(),  // prepared for the table as it was
              StatusIs(absl::StatusCode::kUnavailable, HasSubstr("plan")));
  EXPECT_THAT(reader->GetMapInfo(), StatusIs(absl::StatusCode::kDataLoss, HasSubstr("type 1700")));
  STRATA_ASSERT_OK(strange->Execute("ALTER TABLE truth_scan DROP COLUMN header CASCADE"));
  EXPECT_THAT(reader->ListScans(ScanQuery(), 1),
              StatusIs(absl::StatusCode::kDataLoss, HasSubstr("header")));
  STRATA_ASSERT_OK(strange->Execute("UPDATE strata_format SET version = 99"));
  EXPECT_THAT(PostgresMaps::Connect(options).status(),
              StatusIs(absl::StatusCode::kFailedPrecondition, HasSubstr("format 99")));
}

// One that is frozen in the middle of a deletion keeps no other from starting.
TEST_F(PostgresStorageTest, ADeletionThatAnotherIsAtIsLeftToHim) {
  const auto going = [&]() -> std::int64_t {
    auto rows = other_->Query("SELECT count(*) FROM map_place WHERE state = 2");
    return rows.ok() && rows->Next() ? rows->Int(0) : -1;
  };
  STRATA_ASSERT_OK(other_->Execute("INSERT INTO map_place (name, state) VALUES ('going', 2)"));
  STRATA_ASSERT_OK(other_->Execute("BEGIN; SELECT 1 FROM map_place WHERE state = 2 FOR UPDATE"));
  STRATA_EXPECT_OK(PostgresMaps::Connect(Options()));
  EXPECT_EQ(going(), 1);
  STRATA_ASSERT_OK(other_->Execute("COMMIT"));
  STRATA_EXPECT_OK(PostgresMaps::Connect(Options()));
  EXPECT_EQ(going(), 0);
}

TEST_F(PostgresStorageTest, ChangesAreKeptForAnHour) {
  StorageWriter& writer = storage_->writer();
  std::uint64_t at = 0;
  const auto change = [&] {
    STRATA_ASSERT_OK(writer.Commit(Durability::kFull, [&]() -> absl::Status {
      STRATA_ASSIGN_OR_RETURN(at, writer.NextCommitSequence());
      return writer.PutChanges({{at, {"run", 1}, {}, 0, false}, {at, {}, {0, 1, 2}, at, false}});
    }));
  };
  for (int i = 0; i < 3; ++i) change();
  const std::uint64_t last_old = at;
  STRATA_ASSERT_OK(
      other_->Execute("UPDATE map_change SET made = made - interval '61 minutes' WHERE at < 3"));
  while (Reader()->ListChanges(1)->complete) change();
  EXPECT_LE(at, last_old + 64);
  const auto kept = Reader()->ListChanges(2);
  STRATA_ASSERT_OK(kept);
  EXPECT_TRUE(kept->complete);
  EXPECT_EQ(kept->changes.front().commit_sequence, last_old);
  EXPECT_EQ(kept->changes.size(), 2 * (at - 2));
  STRATA_ASSERT_OK_AND_ASSIGN(const auto clocks, maps_->ListClocks({name_, "nowhere"}));
  ASSERT_EQ(clocks.size(), 1U);
  EXPECT_EQ(clocks.front().first, name_);
  EXPECT_EQ(clocks.front().second.commit_sequence, at);
}

TEST_F(PostgresStorageTest, EditsWaitAndTheirAnswersStayForAnHour) {
  StorageWriter& writer = storage_->writer();
  std::uint64_t number = 0;
  const auto put = [&] {
    STRATA_ASSERT_OK(writer.Commit(Durability::kFull, [&]() -> absl::Status {
      STRATA_ASSIGN_OR_RETURN(number, writer.PutEdit({}));
      return absl::OkStatus();
    }));
  };
  put();
  const std::uint64_t answered = number;
  STRATA_ASSERT_OK(writer.Commit(
      Durability::kFull, [&] { return writer.AnswerEdit(answered, absl::AbortedError("no")); }));
  put();
  const std::uint64_t waits = number;
  EXPECT_TRUE(Reader()->FindEdit(0, waits)->has_value());
  STRATA_ASSERT_OK(other_->Execute("UPDATE map_edit SET made = made - interval '61 minutes'"));
  EXPECT_FALSE(Reader()->FindEdit(0, waits)->has_value()) << "who asked has given up";
  STRATA_EXPECT_OK(Reader()->FindAnswer(answered));
  put();
  for (const std::uint64_t gone : {answered, waits}) {
    EXPECT_TRUE(absl::IsNotFound(Reader()->FindAnswer(gone).status()));
  }
  EXPECT_TRUE(Reader()->FindEdit(0, number)->has_value());
}

TEST_F(PostgresStorageTest, ManyMayMakeTheTablesAtTheSameMoment) {
  STRATA_ASSERT_OK(other_->Execute("CREATE DATABASE fresh"));
  STRATA_ASSERT_OK_AND_ASSIGN(PostgresCluster* const cluster, SharedPostgresCluster());
  PostgresOptions options;
  options.where = cluster->AddressOf("fresh");
  std::vector<std::thread> threads;
  for (int i = 0; i < 8; ++i) {
    threads.emplace_back([&, i] {
      const auto maps = PostgresMaps::Connect(options);
      STRATA_EXPECT_OK(maps);
      if (!maps.ok()) return;
      STRATA_EXPECT_OK(maps->Create(absl::StrCat(i), MapParameters(), absl::Now()));
    });
  }
  for (std::thread& thread : threads) thread.join();
  STRATA_ASSERT_OK_AND_ASSIGN(const PostgresMaps maps, PostgresMaps::Connect(options));
  EXPECT_EQ(maps.List()->size(), 8U);
}

TEST_F(PostgresStorageTest, AddressesThatAreNoneSayNoPassword) {
  PostgresOptions options;
  options.where = "postgresql://robot:secret@[/x";
  EXPECT_THAT(PostgresMaps::Connect(options).status(),
              StatusIs(absl::StatusCode::kInvalidArgument, Not(HasSubstr("secret"))));
  options.where = "postgresql://robot:secret@127.0.0.1:1/x?connect_timeout=2";
  EXPECT_THAT(PostgresMaps::Connect(options).status(),
              StatusIs(absl::StatusCode::kUnavailable, Not(HasSubstr("secret"))));
}

TEST(SqlStateTest, CodesAreThoseOfTheirClass) {
  using Code = absl::StatusCode;
  for (const auto& [state, code] :
       std::vector<std::pair<const char*, Code>>{{"", Code::kUnavailable},
                                                 {"08006", Code::kUnavailable},
                                                 {"57P01", Code::kUnavailable},
                                                 {"57P03", Code::kUnavailable},
                                                 {"53100", Code::kResourceExhausted},
                                                 {"53300", Code::kResourceExhausted},
                                                 {"40001", Code::kAborted},
                                                 {"40P01", Code::kAborted},
                                                 {"57014", Code::kDeadlineExceeded},
                                                 {"55P03", Code::kResourceExhausted},
                                                 {"23505", Code::kAlreadyExists},
                                                 {"42501", Code::kPermissionDenied},
                                                 {"25006", Code::kUnavailable},
                                                 {"XX001", Code::kDataLoss},
                                                 {"42P01", Code::kDataLoss},
                                                 {"XX000", Code::kInternal},
                                                 {"99999", Code::kInternal}}) {
    EXPECT_EQ(CodeOfSqlState(state), code) << state;
  }
  EXPECT_TRUE(MayBeRedone("40001"));
  EXPECT_FALSE(MayBeRedone("40003"));
}

}  // namespace
}  // namespace strata::testing
