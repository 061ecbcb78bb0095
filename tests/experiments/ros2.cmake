# A robot of ROS 2 for minutes.
strata_executable(
  ros2_campaign
  ros2_campaign
  SOURCES ros2_campaign.cc ${PROJECT_SOURCE_DIR}/tests/integration/stratad_process.cc
  DEPS strata::bag_writer strata::fast_node strata::sdk strata::simulator strata::test_support absl::str_format CLI11::CLI11
)
add_dependencies(ros2_campaign stratad strata_cli strata_ros2_program)
