// Robots upload to a map that several servers share; servers are killed and frozen, and their
// database crashes.
#ifndef STRATA_TESTS_INTEGRATION_CLUSTER_CAMPAIGN_H_
#define STRATA_TESTS_INTEGRATION_CLUSTER_CAMPAIGN_H_

#include "tests/integration/campaigns/campaign_world.h"

namespace strata::testing {

struct ClusterOptions {
  CampaignOptions world;  // `store` and `lease` are the campaign's to say
  int faults = 60;
  int robot_kills = 10;
  // Jobs, deletions, labels, backups and another map's life go on meanwhile, so that no undisturbed
  // server could be compared.
  bool work = false;
  int verify_every = 20;  // faults
  // false: servers whose commits do not ask whether their map was taken away; what the campaign
  // must then find.
  bool fenced = true;
};

// FAILED_PRECONDITION without PostgreSQL.
absl::StatusOr<CampaignReport> RunClusterCampaign(const ClusterOptions& options);

}  // namespace strata::testing

#endif  // STRATA_TESTS_INTEGRATION_CLUSTER_CAMPAIGN_H_
