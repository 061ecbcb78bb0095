// What else goes on at a server while it is killed: jobs, deletions, labels, backups, another map's
// life.
#ifndef STRATA_TESTS_INTEGRATION_BACKGROUND_WORK_H_
#define STRATA_TESTS_INTEGRATION_BACKGROUND_WORK_H_

#include <atomic>
#include <cstdint>
#include <map>
#include <set>
#include <string>
#include <vector>

#include "tests/integration/campaigns/campaign_world.h"
#include "tests/integration/clients.h"

namespace strata::testing {

class BackgroundWork {
 public:
  // Begins; the world must outlive it.
  BackgroundWork(CampaignWorld& world, std::uint64_t seed);

  // Ends it all; then what was answered with OK must have happened.
  void StopAndCheck(api::Database& db);
  // How often what was answered.
  std::map<std::string, double> Numbers() const;

 private:
  void StepJobs(api::Database& db, const api::Call& call);
  void StepLabels(api::Database& db, const api::Call& call);
  void StepDeletions(api::Database& db, const api::Call& call);
  void StepBackups(api::Database& db, const api::Call& call);
  void StepOtherMap(api::Database& db, const api::Call& call);
  void CheckLabels(api::Database& db);
  void CheckBackup();

  CampaignWorld& world_;
  const std::uint64_t seed_;
  int jobs_started_ = 0;
  std::map<std::string, int> jobs_;         // by kind and state
  std::map<ScanId, std::uint16_t> labels_;  // of all points of a scan, if SetLabels said OK
  std::set<ScanId> deleted_;                // Delete said OK
  std::set<ScanId> backup_holds_;           // what the last whole backup must have
  int backups_ = 0;
  int other_maps_ = 0;
  bool other_gone_ = false;  // Delete said OK, and nothing was asked since
  Clients clients_;
};

}  // namespace strata::testing

#endif  // STRATA_TESTS_INTEGRATION_BACKGROUND_WORK_H_
