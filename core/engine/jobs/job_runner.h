// The thread behind a map that runs its jobs, one at a time, and between them looks whether one is
// due that nobody asked for. What changes derived data is handed to the worker; the rest runs
// beside uploads, integration and reads.
#ifndef STRATA_CORE_ENGINE_JOBS_JOB_RUNNER_H_
#define STRATA_CORE_ENGINE_JOBS_JOB_RUNNER_H_

#include <thread>

#include "absl/base/thread_annotations.h"
#include "absl/status/status.h"
#include "absl/synchronization/mutex.h"
#include "absl/time/time.h"

#include "core/common/stop.h"
#include "core/engine/consistency/closure_watch.h"
#include "core/engine/ingest/worker.h"
#include "core/engine/jobs/job_board.h"
#include "core/engine/map/map_core.h"
#include "core/engine/map/quarantine.h"

namespace strata {

// Thread-safe.
class JobRunner {
 public:
  // All must outlive the runner. Jobs that are queued begin at once, but for one that the process
  // may have died of: after the scans of which that is true.
  // `seen`: by an earlier runner of the map.
  JobRunner(MapCore& core,
            Quarantine& quarantine,
            JobBoard& jobs,
            Worker& worker,
            const SeenClosures& seen = {});
  ~JobRunner() { Close(); }

  // A job was queued.
  void JobQueued();

  // Nothing is under way or due: no job, and no look at scans that came in.
  bool AtRest() const;
  // What has been looked at.
  SeenClosures seen() const;

  // Ends the thread; a running job goes back to the queue. Before the worker is closed. Safe to
  // call again.
  void Close();

 private:
  enum class Step { kClosed, kJob, kLook };
  void Loop();
  bool HasWork() const ABSL_SHARED_LOCKS_REQUIRED(mutex_) { return closed_ || job_waits_; }
  // Waits until there is something to do.
  Step NextStep();
  void RunJob();
  // Whether the next job must wait for a scan.
  absl::StatusOr<bool> MustWait();
  absl::Status Run(const JobInfo& job, JobContext& context);
  // Queues what nobody has asked for and is due.
  void Look();
  absl::Status StartWhatIsDue();
  // Whether closures were found that no optimize job has had a chance to use.
  absl::StatusOr<bool> OptimizeIsDue();
  // After something that began at `begun`: leaves at least as much time to others.
  void PlanNextLook(absl::Time begun);

  MapCore& core_;
  Quarantine& quarantine_;
  JobBoard& jobs_;
  Worker& worker_;
  ClosureWatch closures_;  // the thread's
  const Stop closing_;
  mutable absl::Mutex mutex_;
  bool steps_ ABSL_GUARDED_BY(mutex_) = true;  // the thread is at one
  bool look_failed_ ABSL_GUARDED_BY(mutex_) = false;
  SeenClosures seen_ ABSL_GUARDED_BY(mutex_);  // of closures_, between two steps
  bool job_waits_ ABSL_GUARDED_BY(mutex_);
  bool closed_ ABSL_GUARDED_BY(mutex_) = false;
  absl::Time next_look_ ABSL_GUARDED_BY(mutex_);
  Stop look_ ABSL_GUARDED_BY(mutex_);  // ends the look under way
  std::thread thread_;
};

}  // namespace strata

#endif  // STRATA_CORE_ENGINE_JOBS_JOB_RUNNER_H_
