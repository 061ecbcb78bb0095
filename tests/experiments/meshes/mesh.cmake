find_package(nanoflann REQUIRED)
pkg_check_modules(pcl_mesh_peers REQUIRED pcl_features)

find_path(CGAL_MESH_INCLUDE_DIR CGAL/Alpha_shape_3.h REQUIRED)

# From PCL's headers: its library for surfaces brings VTK.
strata_library(
  mesh_peers
  NO_INSTALL
  SOURCES meshes/mesh_peers.cc meshes/mesh_peers_cgal.cc
  HEADERS meshes/mesh_peers.h meshes/stool.h
  DEPS strata::mesh strata::simulator
  PRIVATE_DEPS pcl_features pcl_search pcl_kdtree pcl_common gmp mpfr
)
target_include_directories(strata_mesh_peers SYSTEM PRIVATE ${pcl_mesh_peers_INCLUDE_DIRS} ${CGAL_MESH_INCLUDE_DIR})
set_source_files_properties(
  meshes/mesh_peers.cc meshes/mesh_peers_cgal.cc PROPERTIES COMPILE_OPTIONS -Wno-array-bounds SKIP_UNITY_BUILD_INCLUSION ON
)

strata_executable(
  mesh_methods mesh_methods
  SOURCES meshes/mesh_methods.cc meshes/mesh_recorded.cc
  DEPS strata::mesh strata::mesh_peers strata::mls strata::test_support strata::test_recordings nanoflann::nanoflann
)
# Table 4.1's bounds: what is closed, and how near meshes come with noise. Not of the gate, where mesh_test holds what is
# closed; the whole table is the campaign `thesis`.
add_test(NAME thesis_table_4_1 COMMAND mesh_methods stool 5)
set_tests_properties(thesis_table_4_1 PROPERTIES LABELS "smoke;long" COST 100)
