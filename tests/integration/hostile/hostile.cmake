strata_test(
  idle_watchers_test
  SOURCES hostile/idle_watchers_test.cc stratad_process.cc
  DEPS strata::proto strata::sdk strata::test_support gRPC::grpc++
  LABELS integration
)
add_dependencies(idle_watchers_test stratad)

strata_test(
  hostile_test
  SOURCES hostile/hostile_memory_test.cc hostile/hostile_test.cc stratad_process.cc
  DEPS strata::codec strata::common strata::proto strata::sdk strata::test_support gRPC::grpc++
  LABELS integration
)
add_dependencies(hostile_test stratad)

strata_test(
  scarcity_test
  SOURCES hostile/scarcity_test.cc stratad_process.cc
  DEPS strata::common strata::proto strata::test_support gRPC::grpc++
  LABELS integration
)
add_dependencies(scarcity_test stratad)
