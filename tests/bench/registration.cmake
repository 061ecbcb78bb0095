pkg_check_modules(pcl_registration REQUIRED IMPORTED_TARGET pcl_registration pcl_filters)

strata_executable(
  registration_benchmark registration_benchmark
  SOURCES registration_benchmark.cc registration_peers.cc simulated_bridge.cc
  DEPS strata::registration strata::mls strata::test_support strata::test_recordings
       PkgConfig::pcl_registration
)
# g++ 12 sees array bounds crossed inside Eigen where PCL instantiates it.
set_source_files_properties(registration_peers.cc PROPERTIES COMPILE_OPTIONS -Wno-array-bounds)
