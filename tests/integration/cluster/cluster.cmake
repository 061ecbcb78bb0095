# Two servers on a database of the test's own.
strata_executable(
  two_servers_test two_servers_test
  SOURCES stratad_process.cc cluster/two_servers_test.cc
  DEPS strata::codec strata::mls strata::postgres_cluster strata::sdk strata::test_support GTest::gmock_main
  SHARED_HEADERS strata_test_headers
)
add_dependencies(two_servers_test stratad)
add_test(NAME two_servers_test COMMAND two_servers_test)
set_tests_properties(two_servers_test PROPERTIES LABELS integration TIMEOUT 1200 COST 300)

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
set_tests_properties(beside_suite_test PROPERTIES LABELS integration TIMEOUT 2400 COST 600)
add_test(
  NAME worked_suite_test
  COMMAND beside_suite_test --gtest_filter=TheOwner/*Job*:TheOwner/*Kind*:TheOwner/*Thing*:TheOwner/*Infer*:TheOwner/*Plane*:TheOwner/*Propos*:TheOwner/*DryRun*:TheOwner/*Epoch*:TheOwner/*Watch*
)
set_tests_properties(worked_suite_test PROPERTIES LABELS integration TIMEOUT 1200 COST 300)

# Plans by the server that has not got the map.
strata_executable(
  plans_elsewhere_test plans_elsewhere_test
  SOURCES stratad_process.cc cluster/plans_elsewhere_test.cc
  DEPS strata::postgres_cluster strata::proto_translate strata::sdk strata::storage_postgresql strata::test_support GTest::gmock_main
  SHARED_HEADERS strata_test_headers
)
add_dependencies(plans_elsewhere_test stratad)
add_test(NAME plans_elsewhere_test COMMAND plans_elsewhere_test)
set_tests_properties(plans_elsewhere_test PROPERTIES LABELS integration TIMEOUT 1200 COST 300)

# Edits by the server that has not got the map.
strata_executable(
  edits_elsewhere_test edits_elsewhere_test
  SOURCES stratad_process.cc cluster/edits_elsewhere_test.cc
  DEPS strata::postgres_cluster strata::sdk strata::storage_postgresql strata::test_support GTest::gmock_main
  SHARED_HEADERS strata_test_headers
)
add_dependencies(edits_elsewhere_test stratad)
add_test(NAME edits_elsewhere_test COMMAND edits_elsewhere_test)
set_tests_properties(edits_elsewhere_test PROPERTIES LABELS integration TIMEOUT 300 COST 300)

# Servers that take maps and servers that do not, and those that run jobs of others' maps; and maps that are deleted by servers that
# have not got them.
strata_executable(
  roles_test roles_test
  SOURCES stratad_process.cc cluster/roles_test.cc cluster/workers_test.cc
  DEPS strata::postgres_cluster strata::sdk strata::storage_postgresql strata::test_support GTest::gmock_main
  SHARED_HEADERS strata_test_headers
)
add_dependencies(roles_test stratad)
add_test(NAME roles_test COMMAND roles_test)
set_tests_properties(roles_test PROPERTIES LABELS integration TIMEOUT 600 COST 300)

# Watches by the server that has not got the map.
strata_executable(
  watch_elsewhere_test watch_elsewhere_test
  SOURCES stratad_process.cc cluster/watch_elsewhere_test.cc
  DEPS strata::postgres_cluster strata::sdk strata::storage_postgresql strata::test_support GTest::gmock_main
  SHARED_HEADERS strata_test_headers
)
add_dependencies(watch_elsewhere_test stratad)
add_test(NAME watch_elsewhere_test COMMAND watch_elsewhere_test)
set_tests_properties(watch_elsewhere_test PROPERTIES LABELS integration TIMEOUT 1200 COST 300)

# Maps between files and a database.
strata_executable(
  map_import_test map_import_test
  SOURCES cluster/map_import_test.cc stratad_process.cc
  DEPS strata::engine strata::postgres_cluster strata::sdk strata::storage_postgresql strata::test_support GTest::gmock_main
  SHARED_HEADERS strata_test_headers
)
add_dependencies(map_import_test stratad)
add_test(NAME map_import_test COMMAND map_import_test)
set_tests_properties(map_import_test PROPERTIES LABELS integration TIMEOUT 1200 COST 300)

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
  TIMEOUT 300
)
