strata_test(
  exactly_once_test
  SOURCES lost_answers/cutting_proxy.cc lost_answers/exactly_once_test.cc lost_answers/lost_answers_test.cc
  DEPS strata::campaigns
  LABELS integration
)
