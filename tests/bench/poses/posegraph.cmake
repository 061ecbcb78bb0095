strata_executable(
  posegraph_benchmark posegraph_benchmark
  SOURCES poses/posegraph_benchmark.cc poses/posegraph_peer.cc
  DEPS strata::posegraph strata::formats strata::test_support Ceres::ceres
)
strata_smoke(posegraph_benchmark 1)
