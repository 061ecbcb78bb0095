#include "client/sdk/remote_jobs.h"

#include "core/common/status.h"
#include "proto/translate/jobs.h"

namespace strata::sdk {
namespace {

template <typename In>
In RequestFor(absl::string_view map, std::uint64_t id) {
  In in;
  in.set_map(std::string(map));
  in.set_id(id);
  return in;
}

}  // namespace

using translate::FromProto;

absl::StatusOr<JobInfo> RemoteJobs::Start(const api::Call& call,
                                          absl::string_view map,
                                          absl::string_view kind,
                                          const std::map<std::string, std::string>& parameters) {
  v1::StartJobRequest in;
  in.set_map(std::string(map));
  in.set_kind(std::string(kind));
  in.mutable_parameters()->insert(parameters.begin(), parameters.end());
  STRATA_ASSIGN_OR_RETURN(
      const v1::StartJobResponse out,
      CallUnary(connection_, *stub_, &v1::Jobs::Stub::Start, call, Repeat::kNever, in));
  return FromProto(out.job());
}

absl::StatusOr<JobInfo> RemoteJobs::Get(const api::Call& call,
                                        absl::string_view map,
                                        std::uint64_t id) {
  STRATA_ASSIGN_OR_RETURN(const v1::GetJobResponse out,
                          CallUnary(connection_,
                                    *stub_,
                                    &v1::Jobs::Stub::Get,
                                    call,
                                    Repeat::kOnTrouble,
                                    RequestFor<v1::GetJobRequest>(map, id)));
  return FromProto(out.job());
}

absl::StatusOr<std::vector<JobInfo>> RemoteJobs::List(const api::Call& call,
                                                      absl::string_view map) {
  v1::ListJobsRequest in;
  in.set_map(std::string(map));
  STRATA_ASSIGN_OR_RETURN(
      const v1::ListJobsResponse out,
      CallUnary(connection_, *stub_, &v1::Jobs::Stub::List, call, Repeat::kOnTrouble, in));
  std::vector<JobInfo> jobs;
  for (const v1::Job& job : out.jobs()) {
    STRATA_ASSIGN_OR_RETURN(JobInfo added, FromProto(job));
    jobs.push_back(std::move(added));
  }
  return jobs;
}

absl::StatusOr<JobInfo> RemoteJobs::Cancel(const api::Call& call,
                                           absl::string_view map,
                                           std::uint64_t id) {
  STRATA_ASSIGN_OR_RETURN(const v1::CancelJobResponse out,
                          CallUnary(connection_,
                                    *stub_,
                                    &v1::Jobs::Stub::Cancel,
                                    call,
                                    Repeat::kOnTrouble,
                                    RequestFor<v1::CancelJobRequest>(map, id)));
  return FromProto(out.job());
}

absl::StatusOr<JobInfo> RemoteJobs::Accept(const api::Call& call,
                                           absl::string_view map,
                                           std::uint64_t id) {
  STRATA_ASSIGN_OR_RETURN(const v1::AcceptJobResponse out,
                          CallUnary(connection_,
                                    *stub_,
                                    &v1::Jobs::Stub::Accept,
                                    call,
                                    Repeat::kNever,
                                    RequestFor<v1::AcceptJobRequest>(map, id)));
  return FromProto(out.job());
}

absl::StatusOr<JobInfo> RemoteJobs::Revert(const api::Call& call,
                                           absl::string_view map,
                                           std::uint64_t id) {
  STRATA_ASSIGN_OR_RETURN(const v1::RevertJobResponse out,
                          CallUnary(connection_,
                                    *stub_,
                                    &v1::Jobs::Stub::Revert,
                                    call,
                                    Repeat::kNever,
                                    RequestFor<v1::RevertJobRequest>(map, id)));
  return FromProto(out.job());
}

absl::Status RemoteJobs::Watch(const api::Call& call,
                               absl::string_view map,
                               std::uint64_t id,
                               absl::FunctionRef<absl::Status(const JobInfo&)> sink) {
  const auto deliver = [&sink](const v1::WatchJobResponse& out) -> absl::Status {
    STRATA_ASSIGN_OR_RETURN(const JobInfo job, FromProto(out.job()));
    return sink(job);
  };
  return CallStream(connection_,
                    *stub_,
                    &v1::Jobs::Stub::Watch,
                    call,
                    RequestFor<v1::WatchJobRequest>(map, id),
                    deliver);
}

}  // namespace strata::sdk
