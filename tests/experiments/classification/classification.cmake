strata_library(
  classification_scenes
  NO_INSTALL
  SOURCES classification/classification_facade.cc classification/classification_objects.cc classification/classification_people.cc classification/classification_places.cc
  HEADERS classification/classification_cases.h classification/classification_scenes.h
  DEPS strata::cloud strata::simulator
)
strata_executable(
  classification_thesis classification_thesis
  SOURCES classification/classification_thesis.cc classification/range_scan_features.cc
  DEPS strata::classification strata::classification_scenes strata::simulator
)
