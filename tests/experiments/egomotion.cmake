# By hand: not all bounds of the recorded logs hold yet (RESULTS.md).
strata_executable(
  car car
  SOURCES car.cc simulated_car.cc
  DEPS strata::egomotion strata::formats strata::simulated_drive strata::simulator strata::test_support
)
