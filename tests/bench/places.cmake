strata_executable(
  places_benchmark places_benchmark
  SOURCES places_benchmark.cc
  DEPS strata::posegraph strata::registration
)
strata_smoke(places_benchmark --runs 1)
