// Seeded samples of the campaigns; the whole is tests/experiments/kill_campaign.
#include "tests/integration/campaigns/kill_campaign.h"

#include <cstdlib>
#include <iostream>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/integration/campaigns/clock_campaign.h"
#include "tests/integration/campaigns/term_campaign.h"
#include "tests/support/temp_dir.h"

namespace strata::testing {
namespace {

void ExpectNoViolation(const CampaignReport& report) {
  for (const auto& [name, number] : report.numbers) std::cout << name << " " << number << "\n";
  EXPECT_THAT(report.violations, ::testing::IsEmpty());
}

class KillCampaignTest : public ::testing::Test {
 protected:
  KillCampaignTest() {
    setenv("GLOG_minloglevel", "1", 1);  // of the servers
    std::cout << "seed " << kSeed << "\n";
    world_.seed = kSeed;
    world_.folder = folder_.path();
    world_.robots = 4;
    world_.period_ms = 100;
    world_.columns = 160;
  }

  static constexpr std::uint64_t kSeed = 5;
  TempDir folder_;
  CampaignOptions world_;
};

TEST_F(KillCampaignTest, WhatWasAcknowledgedOutlivesServersAndRobots) {
  KillOptions options;
  options.world = world_;
  options.server_kills = 10;
  options.robot_kills = 5;
  options.verify_every = 5;
  ExpectNoViolation(RunKillCampaign(options));
}

TEST_F(KillCampaignTest, WorkThatIsUnderWayOutlivesTheServer) {
  KillOptions options;
  options.world = world_;
  options.server_kills = 5;
  options.robot_kills = 0;
  options.work = true;
  ExpectNoViolation(RunKillCampaign(options));
}

TEST_F(KillCampaignTest, AServerThatIsToldToEndEndsWell) {
  TermOptions options;
  options.world = world_;
  options.terms = 2;
  options.longest_s = 60.0;
  ExpectNoViolation(RunTermCampaign(options));
}

TEST_F(KillCampaignTest, NothingIsLostWhenTheClockIsSet) {
  ClockOptions options;
  options.world = world_;
  // Robots send while jobs run, and jobs take as long as there are scans: on a machine that does
  // much else ten a second became a thousand.
  options.world.period_ms = 400;
  options.jumps = 1;
  ExpectNoViolation(RunClockCampaign(options));
}

}  // namespace
}  // namespace strata::testing
