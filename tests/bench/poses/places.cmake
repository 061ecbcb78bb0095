strata_executable(
  places_benchmark places_benchmark
  SOURCES poses/places_benchmark.cc
  DEPS strata::posegraph strata::registration
)
strata_smoke(places_benchmark --runs 1)
