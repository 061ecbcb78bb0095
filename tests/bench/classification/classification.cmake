# Header-only. Its own package file brings libraries of exact numbers, which nothing here needs.
find_path(CGAL_INCLUDE_DIR CGAL/Classification.h REQUIRED)

strata_library(
  classification_peers
  NO_INSTALL
  SOURCES classification/classification_peers.cc
  HEADERS classification/classification_peers.h
  DEPS strata::classification
)
target_include_directories(strata_classification_peers SYSTEM PRIVATE ${CGAL_INCLUDE_DIR})
target_compile_definitions(strata_classification_peers PRIVATE CGAL_EIGEN3_ENABLED)
# g++ 12 sees values used uninitialised inside Boost where CGAL instantiates it.
set_source_files_properties(classification/classification_peers.cc PROPERTIES COMPILE_OPTIONS -Wno-maybe-uninitialized)

strata_executable(
  classification_benchmark classification_benchmark
  SOURCES classification/classification_benchmark.cc
  DEPS strata::classification strata::classification_peers strata::labelled_clouds
)
strata_smoke(classification_benchmark --rounds 1 --only cut --points 20000)
