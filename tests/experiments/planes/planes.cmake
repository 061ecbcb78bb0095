strata_executable(
  global_constraints global_constraints
  SOURCES planes/global_constraints.cc
  DEPS strata::posegraph strata::planes strata::registration strata::mls strata::simulator strata::test_support
       strata::test_recordings
)
# Table 7.1 stopped to hold once without anybody seeing it.
# Four of the ten starts, and of figure 7.9 three views, table 7.1 has four; the rest is the campaign `thesis`.
set(table_7_1_sample 4)
set(fig_7_9_sample 3 4)
foreach(table table_7_1 fig_7_9 directions)
  add_test(NAME thesis_${table} COMMAND global_constraints ${table} ${${table}_sample})
  set_tests_properties(thesis_${table} PROPERTIES LABELS smoke COST 100)
endforeach()
strata_executable(
  plane_models plane_models
  SOURCES planes/plane_models.cc planes/plane_cases.h planes/plane_colours.cc planes/plane_directions.cc
          planes/plane_recorded.cc planes/plane_thin_walls.cc
  DEPS strata::planes strata::simulator strata::test_support strata::test_recordings
)
# Table 5.1's bounds, and those of the figures.
add_test(NAME thesis_table_5_1 COMMAND plane_models rooms)
set_tests_properties(thesis_table_5_1 PROPERTIES LABELS smoke COST 20)
foreach(figure walls rack boxes carpet jacket corridor thin)
  add_test(NAME thesis_planes_${figure} COMMAND plane_models ${figure})
  set_tests_properties(thesis_planes_${figure} PROPERTIES LABELS smoke COST 20)
endforeach()
# Recorded ones, where they are.
foreach(recording building hall)
  add_test(NAME thesis_planes_${recording} COMMAND plane_models ${recording})
  set_tests_properties(thesis_planes_${recording} PROPERTIES LABELS smoke COST 60 SKIP_RETURN_CODE 77)
endforeach()
