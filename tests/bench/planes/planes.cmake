find_package(nanoflann REQUIRED)
pkg_check_modules(pcl_plane_peers REQUIRED pcl_segmentation)
find_path(CGAL_PLANES_INCLUDE_DIR CGAL/Shape_detection/Efficient_RANSAC.h REQUIRED)

strata_library(
  plane_peers
  NO_INSTALL
  SOURCES planes/plane_cases.cc planes/plane_baselines.cc planes/plane_peers.cc planes/plane_peers_cgal.cc
  HEADERS planes/plane_cases.h planes/plane_baselines.h planes/plane_peers.h
  DEPS strata::planes strata::simulator
  PRIVATE_DEPS pcl_segmentation pcl_features pcl_sample_consensus pcl_search pcl_kdtree pcl_common nanoflann::nanoflann gmp mpfr
)
target_include_directories(strata_plane_peers SYSTEM PRIVATE ${pcl_plane_peers_INCLUDE_DIRS} ${CGAL_PLANES_INCLUDE_DIR})
set_source_files_properties(planes/plane_peers_cgal.cc PROPERTIES COMPILE_DEFINITIONS CGAL_EIGEN3_ENABLED)
# g++ 12 sees array bounds crossed and values used uninitialised inside Eigen and Boost where PCL and CGAL instantiate them.
set_source_files_properties(
  planes/plane_peers.cc planes/plane_peers_cgal.cc PROPERTIES COMPILE_OPTIONS "-Wno-array-bounds;$<$<CXX_COMPILER_ID:GNU>:-Wno-maybe-uninitialized>"
                                                SKIP_UNITY_BUILD_INCLUSION ON
)

strata_executable(
  planes_benchmark planes_benchmark
  SOURCES planes/planes_benchmark.cc
  DEPS strata::planes strata::plane_peers strata::test_support strata::test_recordings
)
strata_smoke(planes_benchmark --smoke)
