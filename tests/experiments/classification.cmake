strata_library(
  classification_scenes
  NO_INSTALL
  SOURCES classification_facade.cc classification_objects.cc classification_people.cc classification_places.cc
  HEADERS classification_cases.h classification_scenes.h
  DEPS strata::cloud strata::simulator
)
strata_executable(
  classification_thesis classification_thesis
  SOURCES classification_thesis.cc range_scan_features.cc
  DEPS strata::classification strata::classification_scenes strata::simulator
)
