# For the headers; of the libraries those that are used, by name: pkg-config names OpenNI, too.
pkg_check_modules(pcl_io REQUIRED pcl_io)

strata_library(
  formats_peers
  NO_INSTALL
  SOURCES formats/formats_peers.cc
  HEADERS formats/formats_peers.h
  DEPS strata::cloud Eigen3::Eigen
  PRIVATE_DEPS pcl_io pcl_io_ply pcl_common
)
target_include_directories(strata_formats_peers SYSTEM PRIVATE ${pcl_io_INCLUDE_DIRS})
# g++ 12 sees array bounds crossed inside Eigen where PCL instantiates it.
set_source_files_properties(formats/formats_peers.cc PROPERTIES COMPILE_OPTIONS -Wno-array-bounds)

strata_executable(
  formats_benchmark formats_benchmark
  SOURCES formats/formats_benchmark.cc
  DEPS strata::formats strata::formats_peers strata::test_support absl::str_format
)

strata_executable(
  bags_benchmark bags_benchmark
  SOURCES formats/bags_benchmark.cc
  DEPS strata::bag_writer strata::formats strata::test_support absl::str_format
)
strata_smoke(bags_benchmark --clouds 3 --points 2000 --rounds 1)
