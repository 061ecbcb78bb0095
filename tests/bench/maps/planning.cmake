find_package(Boost 1.74 REQUIRED)
strata_executable(
  planning_benchmark planning_benchmark
  SOURCES maps/planning_benchmark.cc
  DEPS strata::planning strata::test_support Boost::headers
)
# g++ 12 sees writes out of bounds in Boost 1.74's CSR constructor where there are none.
target_compile_options(planning_benchmark PRIVATE -Wno-array-bounds -Wno-stringop-overflow)
strata_executable(
  long_plan_benchmark long_plan_benchmark
  SOURCES maps/long_plan_benchmark.cc
  DEPS strata::engine strata::planning strata::codec
)
strata_smoke(planning_benchmark 2 1)
strata_smoke(long_plan_benchmark street 160 300)
