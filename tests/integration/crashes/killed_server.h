// A server that is killed while its jobs run, with a client of it.
#ifndef STRATA_TESTS_INTEGRATION_KILLED_SERVER_H_
#define STRATA_TESTS_INTEGRATION_KILLED_SERVER_H_

#include <cstdint>
#include <memory>
#include <string>
#include <utility>

#include "core/api/database.h"
#include "core/world/job.h"
#include "tests/integration/stratad_process.h"
#include "tests/support/temp_dir.h"

namespace strata::testing {

// On a folder of its own.
class KilledServer {
 public:
  explicit KilledServer(std::string map) : map_(std::move(map)) { Start(); }

  api::Database& db() { return *client_; }
  // By SIGKILL; it is up again, at another address, when this returns.
  void Kill();
  // The job's end, which is to be a success.
  JobInfo Follow(std::uint64_t job);
  // Starts one and follows it.
  JobInfo Run(const std::string& kind, const JobParameters& parameters = {});
  void AwaitIntegrated();

 private:
  void Start();

  const std::string map_;
  TempDir directory_;
  std::unique_ptr<StratadProcess> process_;
  std::unique_ptr<api::Database> client_;
};

}  // namespace strata::testing

#endif  // STRATA_TESTS_INTEGRATION_KILLED_SERVER_H_
