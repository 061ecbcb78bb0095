// Conformance: one consistent world after another.
#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/database_suite/database_suite.h"
#include "tests/support/status_matchers.h"

namespace strata::testing {
namespace {

using ::testing::_;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;
using ::testing::SizeIs;
using Code = absl::StatusCode;
using Parameters = std::map<std::string, std::string>;

// Poses follow from what people say alone: nothing is looked for.
Parameters Given(Parameters more = {}) {
  more.insert({{"closures", "0"}, {"planes", "0"}});
  return more;
}

JobInfo Follow(api::Database& db, std::uint64_t id) {
  JobInfo last;
  STRATA_EXPECT_OK(db.jobs().Watch({}, kMap, id, [&last](const JobInfo& job) {
    last = job;
    return absl::OkStatus();
  }));
  return last;
}

JobInfo Optimize(api::Database& db, const Parameters& parameters) {
  const auto started = db.jobs().Start({}, kMap, "optimize", parameters);
  STRATA_EXPECT_OK(started);
  return started.ok() ? Follow(db, started->id) : JobInfo();
}

// Two scans uploaded three metres apart, of which a person knows that it is 3.2 m.
void PutTwoScans(api::Database& db) {
  PutFloor(db, {"run", 1});
  PutFloor(db, {"run", 2}, 3.0);
  Constraint constraint;
  constraint.i = {"run", 1};
  constraint.j = {"run", 2};
  constraint.T_i_j = MakePose(Eigen::Quaterniond::Identity(), {3.2, 0.0, 0.0});
  constraint.information = Matrix6d::Identity() * 1e8;
  STRATA_ASSERT_OK(db.posegraph().AddConstraint({}, kMap, constraint));
}

// Of run/2 from run/1.
double DistanceOf(api::Database& db) {
  std::vector<Pose> poses;
  for (const std::uint64_t sequence : {1, 2}) {
    const auto lookup = db.posegraph().LookupPose({}, kMap, {"run", sequence});
    STRATA_EXPECT_OK(lookup);
    if (!lookup.ok()) return -1.0;
    poses.push_back(lookup->T_map_scan);
  }
  return (poses[0].inverse() * poses[1]).translation().x();
}

MapStats StatsOf(api::Database& db) {
  const auto stats = db.maps().Stats({}, kMap);
  STRATA_EXPECT_OK(stats);
  return stats.value_or(MapStats());
}

TEST_P(DatabaseSuite, AMapBeginsWithOneEpoch) {
  STRATA_ASSERT_OK_AND_ASSIGN(const auto epochs, db().maps().History({}, kMap));
  ASSERT_THAT(epochs, SizeIs(1));
  EXPECT_TRUE(epochs[0].current);
  EXPECT_TRUE(epochs[0].kept);
  EXPECT_EQ(epochs[0].epoch, StatsOf(db()).epoch);
}

TEST_P(DatabaseSuite, OptimizeMakesAnEpochThatAgreesWithWhatPeopleSay) {
  PutTwoScans(db());
  const MapStats before = StatsOf(db());
  const JobInfo job = Optimize(db(), Given());
  ASSERT_EQ(job.state, JobState::kSucceeded) << job.message;
  EXPECT_NEAR(DistanceOf(db()), 3.2, 0.005);
  const MapStats after = StatsOf(db());
  EXPECT_GT(after.epoch, before.epoch);
  EXPECT_EQ(after.scans, before.scans);
  STRATA_ASSERT_OK_AND_ASSIGN(const auto epochs, db().maps().History({}, kMap));
  ASSERT_THAT(epochs, SizeIs(2));
  EXPECT_EQ(epochs[0].epoch, after.epoch);
  EXPECT_TRUE(epochs[0].current);
  EXPECT_EQ(epochs[0].job, job.id);
  EXPECT_NE(epochs[0].reason, "");
  EXPECT_FALSE(epochs[1].current);
  // A watcher of the old epoch is told why there is another.
  std::string reason;
  STRATA_ASSERT_OK(db().maps().Watch(
      {},
      kMap,
      {.since = before.commit_sequence, .epoch = before.epoch, .trajectory = "", .once = true},
      [&reason](const api::MapUpdate& update) {
        if (!update.epoch_reason.empty()) reason = update.epoch_reason;
        return absl::OkStatus();
      }));
  EXPECT_NE(reason, "");
}

TEST_P(DatabaseSuite, ADryRunChangesNothingUntilItIsAccepted) {
  PutTwoScans(db());
  const MapStats before = StatsOf(db());
  const JobInfo job = Optimize(db(), Given({{"dry_run", "1"}}));
  ASSERT_EQ(job.state, JobState::kProposed) << job.message;
  EXPECT_THAT(job.metrics, Not(IsEmpty()));
  EXPECT_EQ(StatsOf(db()).epoch, before.epoch);
  EXPECT_EQ(StatsOf(db()).content_digest, before.content_digest);
  EXPECT_NEAR(DistanceOf(db()), 3.0, 1e-9);

  STRATA_ASSERT_OK_AND_ASSIGN(const JobInfo accepted, db().jobs().Accept({}, kMap, job.id));
  EXPECT_EQ(accepted.id, job.id);
  EXPECT_EQ(Follow(db(), job.id).state, JobState::kSucceeded);
  EXPECT_NEAR(DistanceOf(db()), 3.2, 0.005);
  EXPECT_THAT(db().jobs().Accept({}, kMap, job.id), StatusIs(Code::kFailedPrecondition, _));
}

TEST_P(DatabaseSuite, AProposalMayBeForgotten) {
  PutTwoScans(db());
  const MapStats before = StatsOf(db());
  const JobInfo job = Optimize(db(), Given({{"dry_run", "1"}}));
  ASSERT_EQ(job.state, JobState::kProposed) << job.message;
  STRATA_ASSERT_OK_AND_ASSIGN(const JobInfo forgotten, db().jobs().Revert({}, kMap, job.id));
  EXPECT_EQ(forgotten.id, job.id);
  EXPECT_EQ(forgotten.state, JobState::kCancelled);
  EXPECT_EQ(StatsOf(db()).content_digest, before.content_digest);
  EXPECT_THAT(db().jobs().Accept({}, kMap, job.id), StatusIs(Code::kFailedPrecondition, _));
}

TEST_P(DatabaseSuite, AnEpochIsBroughtBack) {
  PutTwoScans(db());
  const MapStats before = StatsOf(db());
  const JobInfo job = Optimize(db(), Given());
  ASSERT_EQ(job.state, JobState::kSucceeded) << job.message;
  STRATA_ASSERT_OK_AND_ASSIGN(const JobInfo undo, db().jobs().Revert({}, kMap, job.id));
  EXPECT_NE(undo.id, job.id);
  EXPECT_EQ(undo.kind, "revert");
  EXPECT_EQ(Follow(db(), undo.id).state, JobState::kSucceeded);
  EXPECT_NEAR(DistanceOf(db()), 3.0, 1e-9);
  EXPECT_EQ(StatsOf(db()).content_digest, before.content_digest);
  EXPECT_GT(StatsOf(db()).epoch, before.epoch);  // numbers only grow
  // What made an epoch that is no longer current cannot be undone.
  EXPECT_THAT(db().jobs().Revert({}, kMap, job.id), StatusIs(Code::kFailedPrecondition, _));
}

TEST_P(DatabaseSuite, OnlyWhatMayBeDecidedIsDecided) {
  STRATA_ASSERT_OK_AND_ASSIGN(const JobInfo job, db().jobs().Start({}, kMap, "verify", {}));
  EXPECT_EQ(Follow(db(), job.id).state, JobState::kSucceeded);
  EXPECT_THAT(db().jobs().Accept({}, kMap, job.id), StatusIs(Code::kFailedPrecondition, _));
  EXPECT_THAT(db().jobs().Revert({}, kMap, job.id), StatusIs(Code::kFailedPrecondition, _));
  EXPECT_THAT(db().jobs().Accept({}, kMap, 999), StatusIs(Code::kNotFound, _));
  EXPECT_THAT(db().jobs().Revert({}, kMap, 999), StatusIs(Code::kNotFound, _));
}

TEST_P(DatabaseSuite, BadParametersOfAJobAreNamed) {
  const std::vector<std::pair<std::string, std::string>> bad = {{"dry_run", "maybe"},
                                                                {"closures", "2"},
                                                                {"rounds", "0"},
                                                                {"rounds", "51"},
                                                                {"pool", "51"},
                                                                {"local_weight", "1.5"},
                                                                {"weighting", "by_taste"},
                                                                {"tolerance_m", "nan"},
                                                                {"threads", "0"},
                                                                {"epoch", "1"}};
  for (const auto& [name, value] : bad) {
    EXPECT_THAT(db().jobs().Start({}, kMap, "optimize", {{name, value}}),
                StatusIs(Code::kInvalidArgument, HasSubstr(name)))
        << value;
  }
  EXPECT_THAT(db().jobs().Start({}, kMap, "revert", {}), StatusIs(Code::kInvalidArgument, _));
  EXPECT_THAT(db().jobs().Start({}, kMap, "revert", {{"epoch", "one"}}),
              StatusIs(Code::kInvalidArgument, HasSubstr("epoch")));
}

}  // namespace
}  // namespace strata::testing
