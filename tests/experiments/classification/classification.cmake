strata_library(
  classification_scenes
  NO_INSTALL
  SOURCES classification/classification_facade.cc classification/classification_objects.cc classification/classification_people.cc classification/classification_places.cc
  HEADERS classification/classification_cases.h classification/classification_scenes.h
  DEPS strata::classification strata::cloud strata::simulator
)
strata_library(
  place_methods
  NO_INSTALL
  SOURCES classification/place_methods.cc
  HEADERS classification/place_methods.h
  DEPS strata::classification
)
strata_executable(
  classification_thesis classification_thesis
  SOURCES classification/classification_thesis.cc
  DEPS strata::classification strata::classification_scenes strata::place_methods strata::simulator
)
strata_executable(
  recorded_places recorded_places
  SOURCES classification/recorded_places.cc
  DEPS strata::classification strata::place_methods strata::test_support bz2
)
strata_executable(
  learn_places learn_places
  SOURCES classification/learn_places.cc
  DEPS strata::classification strata::floor_plans strata::place_methods absl::str_format
)
