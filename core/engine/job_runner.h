// The thread behind a map that runs its jobs, one at a time. What changes derived data is handed to
// the worker; the rest runs beside uploads, integration and reads.
#ifndef STRATA_CORE_ENGINE_JOB_RUNNER_H_
#define STRATA_CORE_ENGINE_JOB_RUNNER_H_

#include <thread>

#include "absl/base/thread_annotations.h"
#include "absl/status/status.h"
#include "absl/synchronization/mutex.h"

#include "core/common/stop.h"
#include "core/engine/job_board.h"
#include "core/engine/map_core.h"
#include "core/engine/worker.h"

namespace strata {

// Thread-safe.
class JobRunner {
 public:
  // All must outlive the runner. Jobs that are queued begin at once.
  JobRunner(MapCore& core, JobBoard& jobs, Worker& worker);
  ~JobRunner() { Close(); }

  // A job was queued.
  void JobQueued();

  // Ends the thread; a running job goes back to the queue. Before the worker is closed. Safe to
  // call again.
  void Close();

 private:
  void Loop();
  bool HasWork() const ABSL_SHARED_LOCKS_REQUIRED(mutex_) { return closed_ || job_waits_; }
  absl::Status Run(const JobInfo& job, JobContext& context);

  MapCore& core_;
  JobBoard& jobs_;
  Worker& worker_;
  const Stop closing_;
  absl::Mutex mutex_;
  bool job_waits_ ABSL_GUARDED_BY(mutex_);
  bool closed_ ABSL_GUARDED_BY(mutex_) = false;
  std::thread thread_;
};

}  // namespace strata

#endif  // STRATA_CORE_ENGINE_JOB_RUNNER_H_
