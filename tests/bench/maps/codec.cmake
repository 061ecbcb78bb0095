find_package(octomap REQUIRED)
strata_executable(
  codec_benchmark codec_benchmark
  SOURCES maps/codec_benchmark.cc
  DEPS strata::codec strata::codec_samples strata::test_support benchmark::benchmark PkgConfig::zstd
       ${OCTOMAP_LIBRARIES}
)
target_include_directories(codec_benchmark SYSTEM PRIVATE ${OCTOMAP_INCLUDE_DIRS})
strata_smoke(codec_benchmark --benchmark_filter=Tile|Points --benchmark_min_time=0.01)
