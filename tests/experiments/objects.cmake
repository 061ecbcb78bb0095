strata_executable(
  hidden_windows hidden_windows
  SOURCES objects/hidden_windows.cc objects/facade.cc
  DEPS strata::cloud strata::database_suite strata::engine strata::simulator strata::test_support CLI11::CLI11
)
