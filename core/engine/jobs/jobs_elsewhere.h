// The thread of an engine that runs jobs of maps that it has not got, one at a time: those that ask
// nothing of who has the map (JobHandler::anywhere).
#ifndef STRATA_CORE_ENGINE_JOBS_JOBS_ELSEWHERE_H_
#define STRATA_CORE_ENGINE_JOBS_JOBS_ELSEWHERE_H_

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <thread>

#include "absl/base/thread_annotations.h"
#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "absl/synchronization/mutex.h"

#include "core/common/cache_budget.h"
#include "core/common/stop.h"
#include "core/engine/jobs/job_changes.h"
#include "core/engine/map/engine_options.h"
#include "core/engine/map/map_stores.h"
#include "core/storage/records.h"
#include "core/world/job.h"

namespace strata {

// A job is taken in a commit that writes into it who runs it, and every later commit of the run
// asks for that: it is run once, however often a server is lost or frozen, and only one writes its
// result. Jobs of a map are run one at a time, wherever.
class JobsElsewhere {
 public:
  // `stores` must outlive it. `holder`: of this engine (LiveServer). `is_open`: whether this engine
  // has the map, whose jobs its own runner does.
  JobsElsewhere(const EngineOptions& options,
                const MapStores& stores,
                std::shared_ptr<CacheBudget> caches,
                std::string holder,
                std::function<bool(const std::string&)> is_open);
  // A job that runs waits again.
  ~JobsElsewhere();
  JobsElsewhere(const JobsElsewhere&) = delete;
  JobsElsewhere& operator=(const JobsElsewhere&) = delete;

 private:
  void Loop();
  // Runs the first job that may be run here; whether there was one.
  absl::StatusOr<bool> RunNext();
  // nullopt: it has gone to another, or has ended.
  absl::StatusOr<std::optional<JobInfo>> Take(const UnfinishedJob& job, const std::string& run_by);
  absl::Status Run(const UnfinishedJob& job, const JobInfo& taken, const std::string& run_by);
  absl::Status Compute(const UnfinishedJob& job,
                       const JobInfo& taken,
                       const std::string& run_by,
                       const Stop& stop,
                       JobResult& result);
  // Until it is known to be written, or to be another's.
  absl::Status RecordEnd(const UnfinishedJob& job,
                         const std::string& run_by,
                         const absl::Status& ended,
                         const JobResult& result,
                         bool again);
  // Whether to go on.
  bool Pause();

  const EngineOptions options_;
  const MapStores& stores_;
  const std::shared_ptr<CacheBudget> caches_;
  const std::string holder_;
  const std::function<bool(const std::string&)> is_open_;
  const Stop closing_;
  absl::Mutex mutex_;
  bool closed_ ABSL_GUARDED_BY(mutex_) = false;
  std::thread thread_;
};

}  // namespace strata

#endif  // STRATA_CORE_ENGINE_JOBS_JOBS_ELSEWHERE_H_
