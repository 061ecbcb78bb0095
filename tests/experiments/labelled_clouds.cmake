strata_executable(
  labelled_clouds labelled_clouds
  SOURCES labelled_clouds.cc
  DEPS strata::classification strata::classification_peers strata::labelled_clouds
)
