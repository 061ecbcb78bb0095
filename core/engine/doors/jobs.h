// api::Jobs on the maps of an engine.
#ifndef STRATA_CORE_ENGINE_DOORS_JOBS_H_
#define STRATA_CORE_ENGINE_DOORS_JOBS_H_

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "absl/functional/function_ref.h"
#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"

#include "core/api/jobs.h"
#include "core/engine/doors/maps.h"

namespace strata {

class EngineJobs final : public api::Jobs {
 public:
  explicit EngineJobs(EngineMaps& maps) : maps_(maps) {}

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
  absl::StatusOr<JobInfo> Find(Map& map, std::uint64_t id);

  EngineMaps& maps_;
};

}  // namespace strata

#endif  // STRATA_CORE_ENGINE_DOORS_JOBS_H_
