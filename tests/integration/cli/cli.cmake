# The programs as their users have them.
find_package(nlohmann_json REQUIRED)
strata_test(
  integration_cli_test
  SOURCES cli/cli_fixture.cc cli/cli_test.cc cli/import_test.cc stratad_process.cc cli/three_clients_test.cc cli/world_test.cc
          ${PROJECT_SOURCE_DIR}/tests/client/cli/run_strata.cc
  DEPS strata::codec strata::robot_files strata::simulator strata::sdk strata::test_support nlohmann_json::nlohmann_json absl::str_format
  LABELS integration
  COST 300
  TOGETHER ImportTest
)
add_dependencies(integration_cli_test stratad strata_cli strata_python)

strata_test(
  doors_test
  SOURCES cli/doors_test.cc stratad_process.cc ${PROJECT_SOURCE_DIR}/tests/client/cli/run_strata.cc
  DEPS strata::test_certificates strata::test_support
  LABELS integration
)
add_dependencies(doors_test stratad strata_cli)
