// What people decide about a job, wherever its map is open: changes of the job as it is stored,
// inside the commit that records them.
#ifndef STRATA_CORE_ENGINE_JOBS_JOB_CHANGES_H_
#define STRATA_CORE_ENGINE_JOBS_JOB_CHANGES_H_

#include <cstdint>
#include <map>
#include <string>

#include "absl/functional/function_ref.h"
#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "absl/time/time.h"

#include "core/storage/storage.h"
#include "core/world/job.h"

namespace strata {

// As jobs are stored.
absl::Time NowInMicros();
absl::Status NoSuchJob(std::uint64_t id);

// An error of it leaves the job.
using ChangeFunction = absl::FunctionRef<absl::Status(JobInfo&, StorageWriter&)>;
// The job as it then is. NOT_FOUND.
absl::StatusOr<JobInfo> ChangeStoredJob(StorageWriter& writer,
                                        std::uint64_t id,
                                        ChangeFunction change);

// Queues a proposed job again, with the parameter kAccepted. FAILED_PRECONDITION.
absl::Status AcceptProposal(JobInfo& job, StorageWriter& writer);
// Ends a proposed job as cancelled and forgets its proposal. FAILED_PRECONDITION.
absl::Status DiscardProposal(JobInfo& job, StorageWriter& writer);

// Takes what it proposed out of the store if it failed or was cancelled: nobody can accept it.
absl::Status DropProposalOfEnded(const JobInfo& job, StorageWriter& writer);

// What a run of a job told.
struct JobResult {
  std::map<std::string, double> metrics;
  std::string message;
  bool proposed = false;
  bool accepted = false;  // by itself: who has the map is to apply it
};
// The job has ended so, or waits for who has the map.
void EndJob(JobInfo& job, const absl::Status& ended, const JobResult& result);

// Of a job that a server runs that has not got the map (kRunBy).
bool RunsElsewhere(const JobInfo& job);
std::string RunBy(const JobInfo& job);
std::string HolderOf(absl::string_view run_by);
bool IsAccepted(const JobInfo& job);
// The server that ran it so has died: the job waits again, has ended if it was told to, or is put
// aside if that was the last of many deaths. Inside a commit that puts the job afterwards.
absl::Status ReturnDeadJob(JobInfo& job, StorageWriter& writer);

// Of a job that runs: whoever runs it, or would run it again, ends it.
void TellToEnd(JobInfo& job);
bool IsToldToEnd(const JobInfo& job);
// It has ended: whoever was told meant what is over.
void ForgetToldToEnd(JobInfo& job);

}  // namespace strata

#endif  // STRATA_CORE_ENGINE_JOBS_JOB_CHANGES_H_
