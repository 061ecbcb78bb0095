#include "core/engine/jobs.h"

#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "absl/functional/function_ref.h"
#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/string_view.h"

#include "core/common/status.h"
#include "core/engine/rebuild.h"

namespace strata {
namespace {

absl::Status CheckJob(absl::string_view kind,
                      const std::map<std::string, std::string>& parameters) {
  if (kind != kRebuildJob && kind != kVerifyJob) {
    return absl::InvalidArgumentError(absl::StrCat(
        "job kind '", kind.substr(0, 100), "': use ", kRebuildJob, " or ", kVerifyJob));
  }
  for (const auto& [name, value] : parameters) {
    int threads = 0;
    if (name != "threads") {
      return absl::InvalidArgumentError(
          absl::StrCat("job parameter '", name.substr(0, 100), "': ", kind, " takes threads only"));
    }
    if (!absl::SimpleAtoi(value, &threads) || threads < 1 || threads > 64) {
      return absl::InvalidArgumentError(
          absl::StrCat("job parameter threads = '", value.substr(0, 100), "' is not in [1, 64]"));
    }
  }
  return absl::OkStatus();
}

}  // namespace

absl::StatusOr<JobInfo> EngineJobs::Start(const api::Call& call,
                                          absl::string_view map,
                                          absl::string_view kind,
                                          const std::map<std::string, std::string>& parameters) {
  STRATA_RETURN_IF_ERROR(call.stop.status());
  STRATA_ASSIGN_OR_RETURN(const std::shared_ptr<Map> found, maps_.Find(map));
  STRATA_RETURN_IF_ERROR(CheckJob(kind, parameters));
  STRATA_ASSIGN_OR_RETURN(JobInfo info, found->jobs().Start(call.stop, kind, parameters));
  found->worker().JobQueued();
  return info;
}

absl::StatusOr<JobInfo> EngineJobs::Get(const api::Call& call,
                                        absl::string_view map,
                                        std::uint64_t id) {
  STRATA_RETURN_IF_ERROR(call.stop.status());
  STRATA_ASSIGN_OR_RETURN(const std::shared_ptr<Map> found, maps_.Find(map));
  return found->jobs().Get(id);
}

absl::StatusOr<std::vector<JobInfo>> EngineJobs::List(const api::Call& call,
                                                      absl::string_view map) {
  STRATA_RETURN_IF_ERROR(call.stop.status());
  STRATA_ASSIGN_OR_RETURN(const std::shared_ptr<Map> found, maps_.Find(map));
  return found->jobs().List();
}

absl::StatusOr<JobInfo> EngineJobs::Cancel(const api::Call& call,
                                           absl::string_view map,
                                           std::uint64_t id) {
  STRATA_RETURN_IF_ERROR(call.stop.status());
  STRATA_ASSIGN_OR_RETURN(const std::shared_ptr<Map> found, maps_.Find(map));
  return found->jobs().Cancel(id);
}

absl::StatusOr<JobInfo> EngineJobs::Accept(const api::Call&, absl::string_view, std::uint64_t) {
  return absl::UnimplementedError("accept");
}

absl::StatusOr<JobInfo> EngineJobs::Revert(const api::Call&, absl::string_view, std::uint64_t) {
  return absl::UnimplementedError("revert");
}

absl::Status EngineJobs::Watch(const api::Call& call,
                               absl::string_view map,
                               std::uint64_t id,
                               absl::FunctionRef<absl::Status(const JobInfo&)> sink) {
  STRATA_ASSIGN_OR_RETURN(const std::shared_ptr<Map> found, maps_.Find(map));
  return found->jobs().Watch(call.stop, id, sink);
}

}  // namespace strata
