// A server that is told to end (SIGTERM) under load, again and again.
#ifndef STRATA_TESTS_INTEGRATION_TERM_CAMPAIGN_H_
#define STRATA_TESTS_INTEGRATION_TERM_CAMPAIGN_H_

#include "tests/integration/campaigns/campaign_world.h"

namespace strata::testing {

struct TermOptions {
  CampaignOptions world;
  // Each: one SIGTERM, two of them, or one and then SIGKILL, in turn.
  int terms = 20;
  // From SIGTERM to the end: the server lets calls end for 5 s; then it closes its maps.
  double longest_s = 15.0;
};

// Robots upload, others read tiles, poses and lists, and a job runs.
CampaignReport RunTermCampaign(const TermOptions& options);

}  // namespace strata::testing

#endif  // STRATA_TESTS_INTEGRATION_TERM_CAMPAIGN_H_
