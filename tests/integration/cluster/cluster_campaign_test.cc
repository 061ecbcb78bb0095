// Samples of the campaign of several servers; the whole is tests/experiments/kill_campaign.
#include "tests/integration/cluster/cluster_campaign.h"

#include <cstdint>
#include <cstdlib>
#include <iostream>
#include <random>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/status_matchers.h"
#include "tests/support/temp_dir.h"

namespace strata::testing {
namespace {

class ClusterCampaignTest : public ::testing::Test {
 protected:
  void SetUp() override {
    setenv("GLOG_minloglevel", "1", 1);  // of the servers
    options_.world.seed = std::random_device{}();
    std::cout << "seed " << options_.world.seed << "\n";
    options_.world.folder = folder_.path();
    options_.world.robots = 2;
    // Robots go on while a slow machine works: jobs take as long as there are scans.
    options_.world.period_ms = 400;
    options_.world.columns = 160;
    options_.world.servers = 3;
    options_.robot_kills = 2;
  }
  void Run() {
    const auto report = RunClusterCampaign(options_);
    if (absl::IsFailedPrecondition(report.status())) GTEST_SKIP() << report.status().message();
    STRATA_ASSERT_OK(report);
    for (const auto& [name, number] : report->numbers) std::cout << name << " " << number << "\n";
    EXPECT_THAT(report->violations, ::testing::IsEmpty());
  }

  TempDir folder_;
  ClusterOptions options_;
};

TEST_F(ClusterCampaignTest, WhatOneServerAcknowledgedAllKnowWhateverBecomesOfThem) {
  options_.faults = 4;
  Run();
}

TEST_F(ClusterCampaignTest, WorkThatIsUnderWayOutlivesItsServer) {
  options_.faults = 2;
  options_.work = true;
  Run();
}

TEST_F(ClusterCampaignTest, ServersOfAllRolesAreLostOneAfterTheOther) {
  options_.faults = 3;
  options_.work = true;
  options_.world.servers = 4;
  options_.world.roles = {"gateway", "integrator", "integrator,worker", "worker"};
  Run();
}

}  // namespace
}  // namespace strata::testing
