// Migrations of the truth tables, on steps of a test's own.
#include "core/storage/sqlite/schema.h"

#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/storage/sqlite/database.h"
#include "tests/support/status_matchers.h"
#include "tests/support/temp_dir.h"

namespace strata::testing {
namespace {

using ::testing::HasSubstr;
using Migrations = std::vector<const char*>;

const Migrations kSteps = {
    "CREATE TABLE scan (number INTEGER PRIMARY KEY, length_cm INTEGER NOT NULL);"
    "INSERT INTO scan VALUES (1, 250), (2, 70);",
    "ALTER TABLE scan ADD COLUMN length_m REAL NOT NULL DEFAULT 0;"
    "UPDATE scan SET length_m = length_cm / 100.0;",
    "ALTER TABLE scan DROP COLUMN length_cm;"};

class SchemaTest : public ::testing::Test {
 protected:
  // The file as it is after its first `steps` steps.
  Database FileOf(std::size_t steps) const {
    auto database = Database::Open(directory_.path() / "file", Database::Mode::kCreate);
    EXPECT_THAT(database, IsOk());
    STRATA_EXPECT_OK(Migrate(*database, Migrations(kSteps.begin(), kSteps.begin() + steps)));
    return *std::move(database);
  }
  static std::int64_t Ask(Database& database, const char* sql) {
    const auto answer = database.Pragma(sql);
    EXPECT_THAT(answer, IsOk());
    return answer.value_or(-1);
  }

  TempDir directory_;
};

class SchemaStepsTest : public SchemaTest, public ::testing::WithParamInterface<int> {};

TEST_P(SchemaStepsTest, AFileOfAnyOlderVersionIsBroughtUpToDate) {
  Database database = FileOf(static_cast<std::size_t>(GetParam()));
  EXPECT_EQ(Ask(database, "PRAGMA user_version"), GetParam());
  STRATA_ASSERT_OK(Migrate(database, kSteps));
  EXPECT_EQ(Ask(database, "PRAGMA user_version"), 3);
  EXPECT_EQ(Ask(database, "SELECT round(10 * sum(length_m)) FROM scan"), 32);
  EXPECT_THAT(database.Pragma("SELECT max(length_cm) FROM scan"),
              StatusIs(absl::StatusCode::kDataLoss, HasSubstr("length_cm")));
  STRATA_EXPECT_OK(Migrate(database, kSteps));  // nothing left to do
}

INSTANTIATE_TEST_SUITE_P(From, SchemaStepsTest, ::testing::Values(0, 1, 2, 3));

TEST_F(SchemaTest, AStepThatFailsLeavesTheVersionBefore) {
  Database database = FileOf(1);
  Migrations bad = kSteps;
  bad[2] = "UPDATE scan SET length_m = 0; ALTER TABLE scan DROP COLUMN nothing;";
  EXPECT_FALSE(Migrate(database, bad).ok());
  EXPECT_EQ(Ask(database, "PRAGMA user_version"), 2);
  EXPECT_EQ(Ask(database, "SELECT round(10 * sum(length_m)) FROM scan"), 32);
  STRATA_EXPECT_OK(Migrate(database, kSteps));
}

TEST_F(SchemaTest, ANewerVersionIsRefusedWithWhatToDo) {
  Database database = FileOf(3);
  EXPECT_THAT(
      Migrate(database, Migrations(kSteps.begin(), kSteps.begin() + 2)),
      StatusIs(absl::StatusCode::kFailedPrecondition,
               "format version 3 is newer than 2, the newest this program reads; update it"));
  EXPECT_EQ(Ask(database, "PRAGMA user_version"), 3);
}

// As a program of its first days left it: nothing but the number says that it is of version 2.
TEST_F(SchemaTest, AnEarlyFileOfVersion2GetsWhatVersion2HadLater) {
  auto database = Database::Open(directory_.path() / "early", Database::Mode::kCreate);
  STRATA_ASSERT_OK(database);
  STRATA_ASSERT_OK(CreateSchema(*database));
  STRATA_ASSERT_OK(
      database->Execute("ALTER TABLE truth_constraint DROP COLUMN may_be_false;"
                        "ALTER TABLE truth_scan DROP COLUMN person_labels;"
                        "ALTER TABLE truth_scan DROP COLUMN label_model;"
                        "ALTER TABLE truth_scan DROP COLUMN faded_points;"
                        "ALTER TABLE truth_map DROP COLUMN fade_after;"
                        "DROP TABLE truth_label; DROP TABLE truth_model; DROP TABLE truth_class;"
                        "DROP TABLE truth_model_parameter; DROP TABLE truth_model_score;"
                        "DROP TABLE truth_model_piece; DROP TABLE truth_upload;"
                        "PRAGMA user_version = 2"));
  STRATA_ASSERT_OK(UpgradeSchema(*database));
  EXPECT_EQ(Ask(*database, "PRAGMA user_version"), kTruthVersion);
  for (const char* sql : {"SELECT count(may_be_false) FROM truth_constraint",
                          "SELECT count(person_labels) + count(label_model) FROM truth_scan",
                          "SELECT count(*) FROM truth_label, truth_model, truth_model_parameter",
                          "SELECT count(*) FROM truth_model_score, truth_model_piece",
                          "SELECT count(*) FROM truth_class, truth_upload"}) {
    EXPECT_EQ(Ask(*database, sql), 0) << sql;
  }
}

// As programs left it that knew of no prepared tiles; nothing derived is made again for them.
TEST_F(SchemaTest, AFileWithoutPreparedTilesGetsTheirTableAndKeepsWhatIsDerived) {
  auto database = Database::Open(directory_.path() / "earlier", Database::Mode::kCreate);
  STRATA_ASSERT_OK(database);
  STRATA_ASSERT_OK(CreateSchema(*database));
  STRATA_ASSERT_OK(
      database->Execute("DROP TABLE derived_prepared_tile;"
                        "UPDATE derived_state SET tile_version = 7, complete = 1"));
  STRATA_ASSERT_OK(UpgradeSchema(*database));
  EXPECT_EQ(Ask(*database, "SELECT tile_version + complete FROM derived_state"), 8);
  EXPECT_EQ(Ask(*database, "SELECT count(*) FROM derived_prepared_tile"), 0);
}

}  // namespace
}  // namespace strata::testing
