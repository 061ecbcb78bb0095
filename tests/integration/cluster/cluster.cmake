# strata_cluster_test(NAME SOURCES... DEPS...): servers, as processes, on a database of the test's own, by one ctest test.
function(strata_cluster_test name)
  cmake_parse_arguments(ARG "" "" "SOURCES;DEPS" ${ARGN})
  strata_executable(
    ${name} ${name}
    SOURCES stratad_process.cc ${ARG_SOURCES}
    DEPS strata::postgres_cluster strata::sdk strata::storage_postgresql strata::test_support GTest::gmock_main ${ARG_DEPS}
    SHARED_HEADERS strata_test_headers
  )
  add_dependencies(${name} stratad)
  add_test(NAME ${name} COMMAND ${name})
  set_tests_properties(${name} PROPERTIES LABELS integration COST 300)
endfunction()

strata_cluster_test(two_servers_test SOURCES cluster/two_servers_test.cc DEPS strata::codec strata::mls)
# What a server does that has not got the map: plans, edits, watches.
strata_cluster_test(plans_elsewhere_test SOURCES cluster/plans_elsewhere_test.cc DEPS strata::proto_translate)
strata_cluster_test(edits_elsewhere_test SOURCES cluster/edits_elsewhere_test.cc)
strata_cluster_test(watch_elsewhere_test SOURCES cluster/watch_elsewhere_test.cc)
# Servers that take maps and servers that do not, and those that run jobs of others' maps; and maps that are deleted by servers that
# have not got them.
strata_cluster_test(roles_test SOURCES cluster/roles_test.cc cluster/workers_test.cc)
# Maps between files and a database.
strata_cluster_test(map_import_test SOURCES cluster/map_import_test.cc DEPS strata::engine)

# The conformance suite by a server without the map that works for its owner. Uploads that begin there do not go on where they
# broke, and tiles of earlier epochs are the owner's. Then what is about jobs by the owner.
strata_executable(
  beside_suite_test beside_suite_test
  SOURCES cluster/beside_suite_test.cc
  DEPS strata::database_suite strata::engine strata::postgres_cluster strata::sdk strata::server strata::test_support GTest::gmock_main
  SHARED_HEADERS strata_test_headers
)
add_test(
  NAME beside_suite_test
  COMMAND beside_suite_test --gtest_filter=-TheOwner/*:*AnAnnouncedUploadGoesOnWhereItBroke*:*TheLaterOfTwoUploadsOfAnAnnouncedScanTakesOver*:*AnEarlierEpochHasTheTilesOfItsPoses*
)
set_tests_properties(beside_suite_test PROPERTIES LABELS integration COST 600)
add_test(
  NAME worked_suite_test
  COMMAND beside_suite_test --gtest_filter=TheOwner/*Job*:TheOwner/*Kind*:TheOwner/*Thing*:TheOwner/*Infer*:TheOwner/*Plane*:TheOwner/*Propos*:TheOwner/*DryRun*:TheOwner/*Epoch*:TheOwner/*Watch*
)
set_tests_properties(worked_suite_test PROPERTIES LABELS integration COST 300)

# The kill campaign with several servers of one database.
strata_executable(unfenced_stratad unfenced_stratad SOURCES cluster/unfenced_stratad.cc DEPS strata::server_program)
strata_library(
  cluster_campaign
  NO_INSTALL
  SOURCES cluster/cluster_campaign.cc cluster/cluster_readers.cc
  HEADERS cluster/cluster_campaign.h cluster/cluster_readers.h
  DEPS strata::campaigns strata::postgres_cluster
)
add_dependencies(strata_cluster_campaign unfenced_stratad)
strata_test(
  cluster_campaign_test
  SOURCES cluster/cluster_campaign_test.cc
  DEPS strata::cluster_campaign
  LABELS integration
  COST 300
)
