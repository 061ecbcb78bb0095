// Poses, constraints, planes and epochs.
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/str_cat.h"
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/common/status.h"
#include "core/storage/storage.h"
#include "tests/core/storage/contract/storage_contract.h"
#include "tests/support/status_matchers.h"

namespace strata::testing {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

class PosegraphContractTest : public StorageContractTest {};

TEST_F(PosegraphContractTest, PoseOfAnEpochIsTheNewestUpToIt) {
  const ScanNumber number = Put(1);
  const auto put = [&](std::uint64_t epoch, double x) {
    PoseRecord pose;
    pose.scan = number;
    pose.epoch = epoch;
    pose.T_map_scan.translation().x() = x;
    STRATA_EXPECT_OK(Commit([&] { return writer().PutPose(pose); }));
  };
  put(1, 10.0);
  put(4, 40.0);
  for (const auto& [epoch, x] :
       std::vector<std::pair<int, double>>{{1, 10}, {3, 10}, {4, 40}, {9, 40}}) {
    STRATA_ASSERT_OK_AND_ASSIGN(const PosedScan scan, reader().GetScan(number, epoch));
    ASSERT_TRUE(scan.pose.has_value());
    EXPECT_EQ(scan.pose->T_map_scan.translation().x(), x) << epoch;
  }
  EXPECT_FALSE(reader().GetScan(number, 0)->pose.has_value());
  STRATA_ASSERT_OK(Commit([&] { return writer().BeginEpoch("empty", 0).status(); }));
  STRATA_ASSERT_OK_AND_ASSIGN(const auto epochs, reader().ListEpochs());
  ASSERT_EQ(epochs.size(), 2U);
  EXPECT_EQ(epochs[0].decided, 0U);
  EXPECT_EQ(epochs[1].decided, 1U);
  STRATA_ASSERT_OK_AND_ASSIGN(const auto found, reader().FindEpoch(2));
  ASSERT_TRUE(found.has_value());
  EXPECT_EQ(found->reason, "empty");
  EXPECT_TRUE(found->current);
  EXPECT_FALSE(reader().FindEpoch(1)->value().current);
  EXPECT_FALSE(reader().FindEpoch(3)->has_value());
  EXPECT_EQ(reader().GetScan(number, 9)->scan.header.T_map_scan.translation().x(), 1.1);
}

ConstraintRecord Between(ScanNumber i, ScanNumber j, ConstraintOrigin origin) {
  ConstraintRecord record;
  record.scan_i = i;
  record.scan_j = j;
  record.constraint.origin = origin;
  return record;
}

PlaneRecord PlaneOf(const std::vector<ScanNumber>& scans) {
  PlaneRecord record;
  record.plane.plane.distance = 2.5;
  record.scans = scans;
  record.plane.supports.assign(scans.size(), {{}, 4.0, 0.01});
  return record;
}

TEST_F(PosegraphContractTest, ConstraintsAndPlanesShareTheirIds) {
  const ScanNumber a = Put(1);
  const ScanNumber b = Put(2);
  std::uint64_t first = 0;
  STRATA_ASSERT_OK(Commit([&]() -> absl::Status {
    STRATA_ASSIGN_OR_RETURN(first,
                            writer().PutConstraint(Between(a, b, ConstraintOrigin::kIngest)));
    STRATA_RETURN_IF_ERROR(writer().ProposePlane(7, PlaneOf({a, b})));
    STRATA_RETURN_IF_ERROR(writer().AdoptProposal(7));
    return writer().PutConstraint(Between(0, b, ConstraintOrigin::kPerson)).status();
  }));
  STRATA_ASSERT_OK_AND_ASSIGN(const auto constraints, reader().ListConstraints(1));
  STRATA_ASSERT_OK_AND_ASSIGN(const auto planes, reader().ListPlanes(1));
  ASSERT_EQ(constraints.size(), 2U);
  ASSERT_EQ(planes.size(), 1U);
  EXPECT_EQ(constraints[0].constraint.id, first);
  EXPECT_EQ(planes[0].plane.id, first + 1);
  EXPECT_EQ(constraints[1].constraint.id, first + 2);
  EXPECT_TRUE(constraints[1].constraint.is_prior());
  EXPECT_EQ(planes[0].plane.plane.distance, 2.5);
  EXPECT_THAT(planes[0].scans, ElementsAre(a, b));
  EXPECT_EQ(planes[0].plane.supports[1].scan.sequence, 2U);
  for (const std::uint64_t id : {first, first + 1}) {
    STRATA_EXPECT_OK(Commit([&] { return writer().EnableConstraint(id, false); }));
  }
  EXPECT_FALSE(reader().ListConstraints(1)->at(0).constraint.enabled);
  EXPECT_FALSE(reader().ListPlanes(1)->at(0).plane.enabled);
  EXPECT_THAT(Commit([&] { return writer().EnableConstraint(first + 3, false); }),
              StatusIs(absl::StatusCode::kNotFound, HasSubstr("constraint")));
  EXPECT_THAT(Commit([&] { return writer().DeleteConstraint(first + 3); }),
              StatusIs(absl::StatusCode::kNotFound, HasSubstr("constraint")));
  STRATA_EXPECT_OK(Commit([&] { return writer().DeleteConstraint(first); }));
  EXPECT_EQ(reader().ListConstraints(1)->size(), 1U);
}

TEST_F(PosegraphContractTest, ProposalsAreSeenOnceAdoptedAndGoneOnceDiscarded) {
  const ScanNumber a = Put(1);
  const ScanNumber b = Put(2);
  const auto propose = [&](std::uint64_t job) {
    return Commit([&]() -> absl::Status {
      Pose pose = Pose::Identity();
      pose.translation().x() = static_cast<double>(job);
      STRATA_RETURN_IF_ERROR(writer().ProposePose(job, {a, pose}));
      STRATA_RETURN_IF_ERROR(
          writer().ProposeConstraint(job, Between(a, b, ConstraintOrigin::kOptimize)));
      return writer().ProposePlane(job, PlaneOf({a, b}));
    });
  };
  STRATA_ASSERT_OK(propose(3));
  STRATA_ASSERT_OK(propose(4));
  EXPECT_TRUE(reader().ListConstraints(1)->empty());
  EXPECT_TRUE(reader().ListPlanes(1)->empty());
  ASSERT_EQ(reader().ListProposedPoses(3)->size(), 1U);
  EXPECT_EQ(reader().ListProposedPoses(3)->at(0).T_map_scan.translation().x(), 3.0);
  STRATA_ASSERT_OK(Commit([&] { return writer().DiscardProposal(4); }));
  EXPECT_TRUE(reader().ListProposedPoses(4)->empty());
  const auto adopt = [&](std::uint64_t job) {
    return Commit([&]() -> absl::Status {
      STRATA_RETURN_IF_ERROR(writer().BeginEpoch("better", job).status());
      return writer().AdoptProposal(job);
    });
  };
  STRATA_ASSERT_OK(adopt(3));
  EXPECT_TRUE(reader().ListConstraints(1)->empty());
  EXPECT_EQ(reader().ListConstraints(2)->size(), 1U);
  EXPECT_EQ(reader().ListPlanes(2)->size(), 1U);
  EXPECT_TRUE(reader().ListProposedPoses(3)->empty());
  // The next one's planes replace them, its constraints come on top.
  STRATA_ASSERT_OK(propose(5));
  STRATA_ASSERT_OK(adopt(5));
  EXPECT_EQ(reader().ListConstraints(3)->size(), 2U);
  EXPECT_EQ(reader().ListPlanes(3)->size(), 1U);
  EXPECT_NE(reader().ListPlanes(3)->at(0).plane.id, reader().ListPlanes(2)->at(0).plane.id);
}

// What a job proposes is listed nowhere yet, and what an epoch ended is history.
TEST_F(PosegraphContractTest, WhatIsNotInForceIsNeitherSwitchedNorRemoved) {
  const ScanNumber a = Put(1);
  const ScanNumber b = Put(2);
  STRATA_ASSERT_OK(Commit([&]() -> absl::Status {
    STRATA_RETURN_IF_ERROR(
        writer().ProposeConstraint(3, Between(a, b, ConstraintOrigin::kOptimize)));
    return writer().ProposePlane(3, PlaneOf({a, b}));
  }));
  const auto expect_none = [&](std::uint64_t id) {
    for (const bool enabled : {false, true}) {
      EXPECT_THAT(Commit([&] { return writer().EnableConstraint(id, enabled); }),
                  StatusIs(absl::StatusCode::kNotFound, HasSubstr("constraint")))
          << id;
    }
    EXPECT_THAT(Commit([&] { return writer().DeleteConstraint(id); }),
                StatusIs(absl::StatusCode::kNotFound, HasSubstr("constraint")))
        << id;
  };
  expect_none(1);
  expect_none(2);
  STRATA_ASSERT_OK(Commit([&]() -> absl::Status {
    STRATA_RETURN_IF_ERROR(writer().BeginEpoch("better", 3).status());
    return writer().AdoptProposal(3);
  }));
  for (const std::uint64_t id : {1, 2}) {
    STRATA_EXPECT_OK(Commit([&] { return writer().EnableConstraint(id, false); }));
  }
  STRATA_ASSERT_OK(Commit([&]() -> absl::Status {
    STRATA_RETURN_IF_ERROR(writer().BeginEpoch("back", 0).status());
    return writer().RestoreConstraints(1);
  }));
  expect_none(1);
  expect_none(2);
  EXPECT_EQ(reader().ListConstraints(2)->size(), 1U);
}

TEST_F(PosegraphContractTest, AnEpochComesBackWithItsConstraints) {
  const ScanNumber a = Put(1);
  const ScanNumber b = Put(2);
  const auto epoch = [&](std::uint64_t job) {
    return Commit([&]() -> absl::Status {
      STRATA_RETURN_IF_ERROR(
          writer().ProposeConstraint(job, Between(a, b, ConstraintOrigin::kOptimize)));
      STRATA_RETURN_IF_ERROR(writer().ProposePlane(job, PlaneOf({a, b})));
      STRATA_RETURN_IF_ERROR(writer().BeginEpoch("better", job).status());
      return writer().AdoptProposal(job);
    });
  };
  const auto back_to = [&](std::uint64_t old) {
    return Commit([&]() -> absl::Status {
      STRATA_RETURN_IF_ERROR(writer().BeginEpoch("back", 0).status());
      return writer().RestoreConstraints(old);
    });
  };
  STRATA_ASSERT_OK(epoch(1));  // 2: one closure
  STRATA_ASSERT_OK(epoch(2));  // 3: two
  ConstraintRecord doubtful = Between(a, b, ConstraintOrigin::kPerson);
  doubtful.constraint.may_be_false = true;
  STRATA_ASSERT_OK(Commit([&] { return writer().PutConstraint(doubtful).status(); }));
  STRATA_ASSERT_OK(back_to(1));  // 4: the person's only
  STRATA_ASSERT_OK(back_to(3));  // 5: all three
  STRATA_ASSERT_OK(back_to(2));  // 6: one closure, the person's
  const std::vector<std::size_t> expected = {0, 1, 3, 1, 3, 2};
  for (std::size_t e = 1; e <= 6; ++e) {
    EXPECT_EQ(reader().ListConstraints(e)->size(), expected[e - 1]) << "epoch " << e;
    EXPECT_EQ(reader().ListPlanes(e)->size(), e == 1 || e == 4 ? 0U : 1U) << "epoch " << e;
    STRATA_ASSERT_OK_AND_ASSIGN(const auto constraints, reader().ListConstraints(e));
    for (const ConstraintRecord& record : constraints) {
      EXPECT_EQ(record.constraint.may_be_false,
                record.constraint.origin == ConstraintOrigin::kPerson)
          << "epoch " << e;
    }
  }
  STRATA_ASSERT_OK_AND_ASSIGN(const auto epochs, reader().ListEpochs());
  ASSERT_EQ(epochs.size(), 6U);
  EXPECT_TRUE(epochs.front().current);
  EXPECT_EQ(epochs.front().epoch, 6U);
  EXPECT_EQ(epochs[3].job, 2U);
  STRATA_ASSERT_OK(Commit([&] { return writer().ForgetEpochsBefore(5); }));
  EXPECT_EQ(reader().ListConstraints(6)->size(), 2U);
  EXPECT_EQ(reader().ListConstraints(5)->size(), 3U);
  EXPECT_FALSE(reader().ListEpochs()->at(2).kept);
  EXPECT_TRUE(reader().ListEpochs()->at(1).kept);
  EXPECT_FALSE(reader().FindEpoch(4)->value().kept);
  EXPECT_TRUE(reader().FindEpoch(5)->value().kept);
}

TEST_F(PosegraphContractTest, ForgottenEpochsKeepWhatLaterOnesUse) {
  const ScanNumber number = Put(1);
  for (const std::uint64_t epoch : {1, 3, 5}) {
    PoseRecord pose;
    pose.scan = number;
    pose.epoch = epoch;
    pose.T_map_scan.translation().x() = static_cast<double>(epoch);
    STRATA_ASSERT_OK(Commit([&] { return writer().PutPose(pose); }));
  }
  STRATA_ASSERT_OK(Commit([&] { return writer().ForgetEpochsBefore(4); }));
  EXPECT_FALSE(reader().GetScan(number, 2)->pose.has_value());
  EXPECT_EQ(reader().GetScan(number, 4)->pose->T_map_scan.translation().x(), 3.0);
  EXPECT_EQ(reader().GetScan(number, 5)->pose->T_map_scan.translation().x(), 5.0);
}

}  // namespace
}  // namespace strata::testing
