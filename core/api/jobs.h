// Jobs: durable background work on a map.
#ifndef STRATA_CORE_API_JOBS_H_
#define STRATA_CORE_API_JOBS_H_

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "absl/functional/function_ref.h"
#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"

#include "core/api/call.h"
#include "core/world/job.h"

namespace strata::api {

// Thread-safe. Jobs of a map run one at a time, those of a client by id, clients in turn. They
// survive a restart, and leave the world as it was when they fail or are cancelled; only "classify"
// goes scan by scan. A job that was running twice when the process died has failed. The last
// thousand that have ended are kept, beside proposals.
class Jobs {
 public:
  virtual ~Jobs() = default;

  // Kinds and their parameters: core/world/job_kinds.h. INVALID_ARGUMENT for an unknown kind or
  // parameter, or a value out of its bounds; NOT_FOUND, ALREADY_EXISTS for a classifier or class
  // that it names; FAILED_PRECONDITION for "fade", "planes" or "objects" of a map that drops
  // points; RESOURCE_EXHAUSTED while 100 jobs of the map wait, or 50 of this client.
  virtual absl::StatusOr<JobInfo> Start(const Call& call,
                                        absl::string_view map,
                                        absl::string_view kind,
                                        const std::map<std::string, std::string>& parameters) = 0;
  virtual absl::StatusOr<JobInfo> Get(const Call& call,
                                      absl::string_view map,
                                      std::uint64_t id) = 0;
  virtual absl::StatusOr<std::vector<JobInfo>> List(const Call& call, absl::string_view map) = 0;
  // Asks a queued or running job to end; one that has ended stays as it is.
  virtual absl::StatusOr<JobInfo> Cancel(const Call& call,
                                         absl::string_view map,
                                         std::uint64_t id) = 0;
  // Makes what a dry run proposed real; the job is queued again and then ends as succeeded.
  // FAILED_PRECONDITION unless it is proposed; of several calls of Accept and Revert at once one is
  // OK.
  virtual absl::StatusOr<JobInfo> Accept(const Call& call,
                                         absl::string_view map,
                                         std::uint64_t id) = 0;
  // Of a proposed job: forgets the proposal; the job is cancelled, and returned. Of an optimize or
  // revert job that made the current epoch: queues a job that brings back the epoch before, and
  // returns that. FAILED_PRECONDITION for any other.
  virtual absl::StatusOr<JobInfo> Revert(const Call& call,
                                         absl::string_view map,
                                         std::uint64_t id) = 0;
  // Delivers the job's state now and after every change, at most ten times a second, until it has
  // ended.
  virtual absl::Status Watch(const Call& call,
                             absl::string_view map,
                             std::uint64_t id,
                             absl::FunctionRef<absl::Status(const JobInfo&)> sink) = 0;
};

}  // namespace strata::api

#endif  // STRATA_CORE_API_JOBS_H_
