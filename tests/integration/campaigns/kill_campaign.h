// Robots upload to one server; server and robots are killed again and again.
#ifndef STRATA_TESTS_INTEGRATION_KILL_CAMPAIGN_H_
#define STRATA_TESTS_INTEGRATION_KILL_CAMPAIGN_H_

#include "tests/integration/campaigns/campaign_world.h"

namespace strata::testing {

struct KillOptions {
  CampaignOptions world;
  int server_kills = 200;
  int robot_kills = 100;
  // Jobs, deletions, labels, backups and another map's life go on meanwhile, so that no undisturbed
  // server could be compared.
  bool work = false;
  int verify_every = 25;  // restarts
};

CampaignReport RunKillCampaign(const KillOptions& options);

}  // namespace strata::testing

#endif  // STRATA_TESTS_INTEGRATION_KILL_CAMPAIGN_H_
