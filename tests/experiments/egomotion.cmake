strata_executable(
  car car
  SOURCES car.cc
  DEPS strata::egomotion strata::formats strata::simulator strata::test_support
)
# Bounds of the two recorded logs.
foreach(log husky dresden)
  add_test(NAME egomotion_${log} COMMAND car ${log})
  set_tests_properties(egomotion_${log} PROPERTIES LABELS smoke TIMEOUT 300 COST 60 SKIP_RETURN_CODE 77)
endforeach()
