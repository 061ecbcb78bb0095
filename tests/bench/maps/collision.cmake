strata_executable(
  collision_benchmark collision_benchmark
  SOURCES maps/collision_benchmark.cc
  DEPS strata::collision strata::planning strata::test_support
)
strata_smoke(collision_benchmark 10 0)
