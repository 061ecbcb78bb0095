strata_executable(
  explore explore
  SOURCES explore.cc
  DEPS strata::occupancy strata::test_support strata::test_recordings
)
strata_executable(
  explore_stool explore_stool
  SOURCES explore_stool.cc
  DEPS strata::occupancy strata::simulator strata::test_support CLI11::CLI11
)
strata_executable(
  explore_worlds explore_worlds
  SOURCES exploring/explore_worlds.cc exploring/explored_site.cc exploring/reached_ground.cc
  DEPS strata::engine strata::planning strata::codec strata::simulator strata::test_support CLI11::CLI11
)
