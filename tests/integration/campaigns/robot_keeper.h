// A robot of its own process that is started again whenever it was killed.
#ifndef STRATA_TESTS_INTEGRATION_ROBOT_KEEPER_H_
#define STRATA_TESTS_INTEGRATION_ROBOT_KEEPER_H_

#include <atomic>
#include <cstdint>
#include <filesystem>
#include <map>
#include <memory>
#include <set>
#include <string>
#include <thread>

#include "absl/base/thread_annotations.h"
#include "absl/synchronization/mutex.h"

#include "core/world/scan.h"
#include "tests/integration/stratad_process.h"

namespace strata::testing {

struct RobotOptions {
  std::filesystem::path spool;
  std::string server;  // HOST:PORT
  int number = 1;      // its trajectory is that of YardScan
  int period_ms = 500;
  int columns = 640;  // of CampaignCloud
  bool align = false;
};

// Thread-safe.
class RobotKeeper {
 public:
  explicit RobotKeeper(const RobotOptions& options);
  ~RobotKeeper() { Retire(); }
  RobotKeeper(const RobotKeeper&) = delete;
  RobotKeeper& operator=(const RobotKeeper&) = delete;

  // Kills the robot that is there now.
  void Kill();
  // Lets it take no further scan, and returns once its spool is empty. Again: nothing.
  void Retire();

  // Its robots' word: scans that were safe in the spool, with their content hash.
  std::map<ScanId, std::string> Added() const;
  // Those that the spool has let go since.
  std::set<ScanId> Acknowledged() const;
  // Robots that ended for another reason than being killed or retired.
  int failures() const { return failures_; }

 private:
  void Loop();
  std::vector<std::string> Arguments() const ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  void Heed(const std::string& line);

  const RobotOptions options_;
  mutable absl::Mutex mutex_;
  std::unique_ptr<ChildProcess> process_ ABSL_GUARDED_BY(mutex_);
  bool retiring_ ABSL_GUARDED_BY(mutex_) = false;
  std::map<ScanId, std::string> added_ ABSL_GUARDED_BY(mutex_);
  std::set<ScanId> acknowledged_ ABSL_GUARDED_BY(mutex_);
  std::atomic<int> failures_ = 0;
  std::thread thread_;
};

}  // namespace strata::testing

#endif  // STRATA_TESTS_INTEGRATION_ROBOT_KEEPER_H_
