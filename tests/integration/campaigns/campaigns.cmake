# A robot that can be killed, and campaigns of it; tests and tests/experiments run them.
find_package(CLI11 REQUIRED)
strata_library(
  campaign_scans
  NO_INSTALL
  SOURCES campaigns/campaign_scans.cc marked_yard.cc
  HEADERS campaigns/campaign_scans.h marked_yard.h
  DEPS strata::simulator strata::world
)
strata_executable(spool_robot spool_robot SOURCES campaigns/spool_robot.cc DEPS strata::campaign_scans strata::sdk CLI11::CLI11)
strata_library(
  campaigns
  NO_INSTALL
  SOURCES clients.cc stratad_process.cc campaigns/background_work.cc campaigns/campaign_world.cc campaigns/clock_campaign.cc
          campaigns/kill_campaign.cc campaigns/robot_keeper.cc campaigns/term_campaign.cc
  HEADERS clients.h stratad_process.h campaigns/background_work.h campaigns/campaign_world.h campaigns/clock_campaign.h
          campaigns/kill_campaign.h campaigns/robot_keeper.h campaigns/term_campaign.h
  DEPS strata::campaign_scans strata::sdk strata::test_support GTest::gmock
)
add_dependencies(strata_campaigns stratad spool_robot strata_jumping_clock)

strata_test(
  kill_campaign_test
  SOURCES campaigns/kill_campaign_test.cc
  DEPS strata::campaigns
  LABELS integration
  COST 300
)
