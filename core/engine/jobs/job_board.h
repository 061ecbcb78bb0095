// The jobs of a map: a durable queue that people can watch.
#ifndef STRATA_CORE_ENGINE_JOBS_JOB_BOARD_H_
#define STRATA_CORE_ENGINE_JOBS_JOB_BOARD_H_

#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "absl/base/thread_annotations.h"
#include "absl/functional/function_ref.h"
#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "absl/synchronization/mutex.h"

#include "core/common/stop.h"
#include "core/engine/jobs/job_changes.h"
#include "core/engine/map/job_context.h"
#include "core/engine/map/map_core.h"
#include "core/engine/map/quarantine.h"
#include "core/world/job.h"

namespace strata {

// Jobs of a map that wait, of all clients and of one.
inline constexpr std::size_t kMaxWaitingJobs = 100;
inline constexpr std::size_t kMaxWaitingJobsOfOne = 50;
// Jobs that have ended and are kept, the newest; proposals and the job that made the current epoch
// beside them.
inline constexpr std::size_t kKeptJobs = 1'000;

// Every change of a job's state is decided inside the commit that records it, so that of several at
// once one wins, and whoever is told of it is told what happens. Thread-safe.
class JobBoard {
 public:
  // Reads the jobs of the map; those that were running are queued again, unless another engine runs
  // them. `quarantine` is told what
  // is under way, and must outlive the board.
  static absl::StatusOr<std::unique_ptr<JobBoard>> Open(MapCore& core, Quarantine& quarantine);

  // Durable when it returns. `kind` and `parameters` must have been checked. `owner`: who asks;
  // owners take turns. RESOURCE_EXHAUSTED while too many jobs wait.
  absl::StatusOr<JobInfo> Start(const Stop& stop,
                                absl::string_view owner,
                                absl::string_view kind,
                                const std::map<std::string, std::string>& parameters);
  // Shows what other engines have queued, cancelled and decided in the store, of all jobs or of
  // one, and ends what they have told to end; whether more waits now.
  absl::StatusOr<bool> TakeIn(std::optional<std::uint64_t> id = std::nullopt);
  absl::StatusOr<JobInfo> Get(std::uint64_t id) const;
  std::vector<JobInfo> List() const;
  // Durable, also of a job that runs: whoever would run it again ends it.
  absl::StatusOr<JobInfo> Cancel(std::uint64_t id);
  // As AcceptProposal(), DiscardProposal().
  absl::StatusOr<JobInfo> Accept(std::uint64_t id);
  absl::StatusOr<JobInfo> Discard(std::uint64_t id);
  absl::Status Watch(const Stop& stop,
                     std::uint64_t id,
                     absl::FunctionRef<absl::Status(const JobInfo&)> sink) const;
  bool AnyIn(JobState state) const;
  // Of jobs that other engines run: whether there are any; those whose engine is not of `alive`
  // wait again.
  bool AnyElsewhere() const;
  absl::Status ReturnDead(const std::set<std::string>& alive);
  // Whether the newest job of the kind is in quarantine: no other begins by itself.
  bool LastIsQuarantined(absl::string_view kind) const;
  // Whose turn it is, if any waits that this engine runs, and no other engine runs one of the map.
  std::optional<std::uint64_t> NextId() const;
  // Tells the running job to end; see RunNext().
  void StopRunning();

  // Runs the job whose turn it is, if any, and records how it ended. A job that ends because
  // `closing` was requested stays queued for the next start, and one whose state cannot be stored
  // for the next call, which returns the error; one that was cancelled before finds its
  // JobContext::stop() requested.
  absl::Status RunNext(const Stop& closing,
                       absl::FunctionRef<absl::Status(const JobInfo&, JobContext&)> body);

 private:
  class Running;
  class StartTurn;
  struct Entry {
    JobInfo info;
    Stop stop;
    std::uint64_t changes = 0;
    std::string owner;  // of jobs of this process; empty of others
  };
  // A job as it was shown before the store was read.
  struct Shown {
    std::uint64_t changes = 0;
    JobState state = JobState::kQueued;
    Stop stop;
  };
  using AllShown = std::map<std::uint64_t, Shown>;

  JobBoard(MapCore& core, Quarantine& quarantine) : core_(core), quarantine_(quarantine) {}
  // Changes a job, in the store and then for those who look; returns it as it is then. NOT_FOUND.
  absl::StatusOr<JobInfo> Change(std::uint64_t id, Durability durability, ChangeFunction change);
  // Shows a job as it was committed.
  void Show(const JobInfo& info);
  // Progress of the running job; `durable`: also to the store.
  void Report(std::uint64_t id, double progress, const std::string& phase, bool durable);
  absl::Status CheckRoom(absl::string_view owner) const ABSL_SHARED_LOCKS_REQUIRED(mutex_);
  // What ends the run of a job that has begun; its progress is newer here than in the store.
  std::optional<Stop> StopOfRun(JobInfo& job) const;
  AllShown WhatIsShown(std::optional<std::uint64_t> id) const;
  void TakeInOne(JobInfo&& stored, const AllShown& before) ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  std::optional<std::uint64_t> NextIdLocked() const ABSL_SHARED_LOCKS_REQUIRED(mutex_);
  // Ended jobs beyond those that are kept.
  std::vector<std::uint64_t> Outdated() const;
  // The job whose turn it is, marked running.
  absl::StatusOr<std::optional<JobInfo>> TakeNext(Stop& stop);
  // It has not ended, and is tried again.
  absl::Status Requeue(std::uint64_t id);
  absl::Status Finish(std::uint64_t id, const absl::Status& ended, Running& context);

  MapCore& core_;
  Quarantine& quarantine_;
  mutable absl::Mutex mutex_;
  // Shared with those who watch: an entry may be forgotten meanwhile.
  std::map<std::uint64_t, std::shared_ptr<Entry>> jobs_ ABSL_GUARDED_BY(mutex_);
  std::uint64_t last_id_ ABSL_GUARDED_BY(mutex_) = 0;
  std::multiset<std::string> starting_ ABSL_GUARDED_BY(mutex_);  // owners of jobs not yet shown
  // When an owner had its last turn.
  std::map<std::string, std::uint64_t> turns_ ABSL_GUARDED_BY(mutex_);
  std::uint64_t turn_ ABSL_GUARDED_BY(mutex_) = 0;
};

}  // namespace strata

#endif  // STRATA_CORE_ENGINE_JOBS_JOB_BOARD_H_
