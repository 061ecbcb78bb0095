strata_executable(
  labelled_clouds labelled_clouds
  SOURCES classification/labelled_clouds.cc
  DEPS strata::classification strata::classification_peers strata::labelled_clouds
)
strata_executable(
  labelled_entities labelled_entities
  SOURCES classification/labelled_entities.cc
  DEPS strata::classification strata::labelled_clouds
)
