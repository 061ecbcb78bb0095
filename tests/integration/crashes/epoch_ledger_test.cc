// That a mix of epochs would be noticed.
#include "tests/integration/crashes/epoch_ledger.h"

#include <iterator>
#include <map>

#include <gtest/gtest-spi.h>
#include <gtest/gtest.h>

#include "core/mls/build.h"
#include "tests/integration/marked_yard.h"

namespace strata::testing {
namespace {

const ScanId& Scan() {
  static const ScanId* const scan = new ScanId(YardScan(3, 14));
  return *scan;
}

Pose Lifted(const ScanId& id, double metres) {
  Pose pose = YardTruth(id);
  pose.translation().z() += metres;
  return pose;
}

std::map<ScanId, Mark> MarksAt(double metres) {
  const auto built =
      BuildMlsMap(SeeYard(Scan()), Lifted(Scan(), metres), SensorModel(), MlsParameters());
  EXPECT_TRUE(built.ok()) << built.status();
  std::map<ScanId, Mark> marks;
  for (const MlsTile& tile : built->map.tiles) CollectMarks(SurfacesOf(tile), marks);
  return marks;
}

// Failures are looked for in statements that see no local variables.
EpochLedger& Ledger() {
  static auto* const ledger = new EpochLedger();
  return *ledger;
}

TEST(EpochLedgerTest, AMarkTellsWhichScanItIsOfAndWhere) {
  for (const double lift : {0.0, 0.35, -0.3}) {
    const std::map<ScanId, Mark> marks = MarksAt(lift);
    ASSERT_EQ(marks.size(), 1U) << "and nothing else in the yard is so high";
    EXPECT_EQ(marks.begin()->first, Scan());
    const Mark& mark = marks.begin()->second;
    EXPECT_EQ(Misplaced(Scan(), Lifted(Scan(), lift), mark), "");
    EXPECT_NE(Misplaced(Scan(), Lifted(Scan(), lift + 0.03), mark), "");
    Mark part(mark.begin(), std::next(mark.begin(), 10));
    EXPECT_NE(Misplaced(Scan(), Lifted(Scan(), lift), part), "");
    Pose aside = Lifted(Scan(), lift);
    aside.translation().x() += 0.4;
    EXPECT_NE(Misplaced(Scan(), aside, mark), "");
  }
}

TEST(EpochLedgerTest, WhatContradictsItselfInAnEpochFails) {
  Ledger().SawPose("a", 1, Scan(), Lifted(Scan(), 0.0));
  Ledger().SawPose("b", 1, Scan(), Lifted(Scan(), 0.0));
  Ledger().SawPose("a", 2, Scan(), Lifted(Scan(), 0.3));
  EXPECT_NONFATAL_FAILURE(Ledger().SawPose("b", 2, Scan(), Lifted(Scan(), 0.0)), "two poses");
  Ledger().SawMarks("a", 1, MarksAt(0.0));
  Ledger().SawMarks("b", 1, MarksAt(0.0));
  EXPECT_NONFATAL_FAILURE(Ledger().SawMarks("b", 1, MarksAt(0.3)), "in two ways");
  EXPECT_EQ(Ledger().Compare().marks, 1U);

  Ledger().SawMarks("a", 2, MarksAt(0.0));  // as they were in the epoch before
  EXPECT_NONFATAL_FAILURE(Ledger().Compare(), "in epoch 2");
}

EpochLedger& PlanLedger() {
  static auto* const ledger = new EpochLedger();
  return *ledger;
}

TEST(EpochLedgerTest, APathOnTheGroundOfAnotherEpochFails) {
  PlanLedger().SawPose("a", 7, YardScan(1, 1), Lifted(YardScan(1, 1), 0.3));
  PlanResult plan;
  plan.epoch = 7;
  plan.waypoints = {{0.0, 0.0, 0.28}, {1.0, 0.0, 0.31}};
  PlanLedger().SawPlan(plan);
  EXPECT_EQ(PlanLedger().Compare().plans, 1U);
  plan.waypoints.back().z() = 0.0;
  PlanLedger().SawPlan(plan);
  EXPECT_NONFATAL_FAILURE(PlanLedger().Compare(), "a path of epoch 7");
}

}  // namespace
}  // namespace strata::testing
