// api::Jobs over strata.v1.Jobs.
#ifndef STRATA_CLIENT_SDK_REMOTE_JOBS_H_
#define STRATA_CLIENT_SDK_REMOTE_JOBS_H_

#include <memory>

#include "client/sdk/connection.h"
#include "core/api/jobs.h"
#include "strata/v1/jobs.grpc.pb.h"

namespace strata::sdk {

// Thread-safe.
class RemoteJobs final : public api::Jobs {
 public:
  explicit RemoteJobs(Connection& connection)
      : connection_(connection), stub_(v1::Jobs::NewStub(connection.channel())) {}

  absl::StatusOr<JobInfo> Start(const api::Call& call,
                                absl::string_view map,
                                absl::string_view kind,
                                const std::map<std::string, std::string>& parameters) override;
  absl::StatusOr<JobInfo> Get(const api::Call& call,
                              absl::string_view map,
                              std::uint64_t id) override;
  absl::StatusOr<std::vector<JobInfo>> List(const api::Call& call, absl::string_view map) override;
  absl::StatusOr<JobInfo> Cancel(const api::Call& call,
                                 absl::string_view map,
                                 std::uint64_t id) override;
  absl::StatusOr<JobInfo> Accept(const api::Call& call,
                                 absl::string_view map,
                                 std::uint64_t id) override;
  absl::StatusOr<JobInfo> Revert(const api::Call& call,
                                 absl::string_view map,
                                 std::uint64_t id) override;
  absl::Status Watch(const api::Call& call,
                     absl::string_view map,
                     std::uint64_t id,
                     absl::FunctionRef<absl::Status(const JobInfo&)> sink) override;

 private:
  Connection& connection_;
  const std::unique_ptr<v1::Jobs::Stub> stub_;
};

}  // namespace strata::sdk

#endif  // STRATA_CLIENT_SDK_REMOTE_JOBS_H_
