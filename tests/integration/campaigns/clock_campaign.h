// A server and robots whose wall clock is set forward and back by days and years.
#ifndef STRATA_TESTS_INTEGRATION_CLOCK_CAMPAIGN_H_
#define STRATA_TESTS_INTEGRATION_CLOCK_CAMPAIGN_H_

#include "tests/integration/campaigns/campaign_world.h"

namespace strata::testing {

struct ClockOptions {
  CampaignOptions world;
  // Each while it serves, and again between two runs of the server: a day back, ten years forward,
  // to 1970, right again, in turn.
  int jumps = 8;
};

// Uploads, reads, jobs and deadlines go on after each, and nothing is lost.
CampaignReport RunClockCampaign(const ClockOptions& options);

}  // namespace strata::testing

#endif  // STRATA_TESTS_INTEGRATION_CLOCK_CAMPAIGN_H_
