strata_test(
  ros2_test
  SOURCES cli/cli_fixture.cc ros2/ros2_fixture.cc ros2/ros2_test.cc ros2/ros2_tracking_test.cc stratad_process.cc
          ${PROJECT_SOURCE_DIR}/tests/client/cli/run_strata.cc
  DEPS strata::bag_writer strata::fast_node strata::formats strata::robot_files strata::simulator strata::sdk strata::test_support
       nlohmann_json::nlohmann_json
  LABELS integration
  PROCESSORS 2
  COST 300
)
add_dependencies(ros2_test stratad strata_cli strata_ros2_program)
