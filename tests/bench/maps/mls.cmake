find_package(octomap REQUIRED)
strata_executable(
  mls_benchmark
  mls_benchmark
  SOURCES maps/mls_benchmark.cc
  DEPS strata::mls strata::test_support ${OCTOMAP_LIBRARIES}
)
strata_smoke(mls_benchmark 1 0)
