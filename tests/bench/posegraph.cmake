strata_executable(
  posegraph_benchmark posegraph_benchmark
  SOURCES posegraph_benchmark.cc posegraph_peer.cc
  DEPS strata::posegraph strata::formats strata::test_support Ceres::ceres
)
strata_smoke(posegraph_benchmark 1)
