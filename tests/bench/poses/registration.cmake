pkg_check_modules(pcl_registration REQUIRED IMPORTED_TARGET GLOBAL pcl_registration pcl_filters)

strata_library(
  registration_peers
  NO_INSTALL
  SOURCES poses/registration_peers.cc
  HEADERS poses/registration_peers.h
  DEPS strata::cloud strata::geometry
  PRIVATE_DEPS PkgConfig::pcl_registration
)
# g++ 12 sees array bounds crossed inside Eigen where PCL instantiates it.
set_source_files_properties(poses/registration_peers.cc PROPERTIES COMPILE_OPTIONS -Wno-array-bounds)

strata_executable(
  registration_benchmark registration_benchmark
  SOURCES poses/registration_benchmark.cc poses/simulated_bridge.cc
  DEPS strata::registration strata::registration_peers strata::mls strata::test_support strata::test_recordings
)
strata_smoke(registration_benchmark --pairs 1)
