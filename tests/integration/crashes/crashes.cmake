strata_test(
  optimize_crash_test
  SOURCES clients.cc marked_yard.cc stratad_process.cc crashes/epoch_ledger.cc crashes/epoch_ledger_test.cc
          crashes/optimize_crash_test.cc crashes/yard_clients.cc
  DEPS strata::codec strata::sdk strata::simulator strata::test_support
  LABELS integration
  COST 300
)
add_dependencies(optimize_crash_test stratad)

strata_test(
  classify_crash_test
  SOURCES crashes/classify_crash_test.cc crashes/killed_server.cc stratad_process.cc
  DEPS strata::sdk strata::test_support
  LABELS integration
)
add_dependencies(classify_crash_test stratad)

strata_test(
  objects_crash_test
  SOURCES crashes/objects_crash_test.cc crashes/killed_server.cc stratad_process.cc
  DEPS strata::sdk strata::simulator strata::test_support
  LABELS integration
)
add_dependencies(objects_crash_test stratad)
