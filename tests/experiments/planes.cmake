strata_executable(
  global_constraints global_constraints
  SOURCES global_constraints.cc
  DEPS strata::posegraph strata::planes strata::registration strata::mls strata::simulator strata::test_support
       strata::test_recordings
)
