find_package(nanoflann REQUIRED)

strata_executable(
  mesh_methods mesh_methods
  SOURCES mesh_methods.cc
  DEPS strata::mesh strata::mls strata::simulator strata::test_support strata::test_recordings nanoflann::nanoflann
)
