#include "server/services/jobs_service.h"

#include <map>
#include <string>
#include <vector>

#include "core/common/status.h"
#include "core/world/job.h"
#include "proto/translate/jobs.h"
#include "server/services/job_watch_reactor.h"

namespace strata::server {
namespace {

using translate::ToProto;

absl::Status Start(api::Database& db,
                   const api::Call& call,
                   const v1::StartJobRequest& in,
                   v1::StartJobResponse& out) {
  const std::map<std::string, std::string> parameters(in.parameters().begin(),
                                                      in.parameters().end());
  STRATA_ASSIGN_OR_RETURN(const JobInfo job,
                          db.jobs().Start(call, in.map(), in.kind(), parameters));
  *out.mutable_job() = ToProto(job);
  return absl::OkStatus();
}

absl::Status Get(api::Database& db,
                 const api::Call& call,
                 const v1::GetJobRequest& in,
                 v1::GetJobResponse& out) {
  STRATA_ASSIGN_OR_RETURN(const JobInfo job, db.jobs().Get(call, in.map(), in.id()));
  *out.mutable_job() = ToProto(job);
  return absl::OkStatus();
}

absl::Status List(api::Database& db,
                  const api::Call& call,
                  const v1::ListJobsRequest& in,
                  v1::ListJobsResponse& out) {
  STRATA_ASSIGN_OR_RETURN(const std::vector<JobInfo> jobs, db.jobs().List(call, in.map()));
  for (const JobInfo& job : jobs) *out.add_jobs() = ToProto(job);
  return absl::OkStatus();
}

absl::Status Cancel(api::Database& db,
                    const api::Call& call,
                    const v1::CancelJobRequest& in,
                    v1::CancelJobResponse& out) {
  STRATA_ASSIGN_OR_RETURN(const JobInfo job, db.jobs().Cancel(call, in.map(), in.id()));
  *out.mutable_job() = ToProto(job);
  return absl::OkStatus();
}

absl::Status Accept(api::Database& db,
                    const api::Call& call,
                    const v1::AcceptJobRequest& in,
                    v1::AcceptJobResponse& out) {
  STRATA_ASSIGN_OR_RETURN(const JobInfo job, db.jobs().Accept(call, in.map(), in.id()));
  *out.mutable_job() = ToProto(job);
  return absl::OkStatus();
}

absl::Status Revert(api::Database& db,
                    const api::Call& call,
                    const v1::RevertJobRequest& in,
                    v1::RevertJobResponse& out) {
  STRATA_ASSIGN_OR_RETURN(const JobInfo job, db.jobs().Revert(call, in.map(), in.id()));
  *out.mutable_job() = ToProto(job);
  return absl::OkStatus();
}

}  // namespace

JobsService::JobsService(Runtime& runtime) : Service(runtime, "Jobs") {
  Unary("Start", &Start);
  Unary("Get", &Get);
  Unary("List", &List);
  Unary("Cancel", &Cancel);
  Unary("Accept", &Accept);
  Unary("Revert", &Revert);
  Poll<JobWatchReactor>("Watch");
}

}  // namespace strata::server
