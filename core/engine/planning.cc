#include "core/engine/planning.h"

#include <map>
#include <memory>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"

#include "core/common/status.h"
#include "core/world/names.h"

namespace strata {

absl::StatusOr<PlanResult> EnginePlanning::PlanPath(const api::Call& call,
                                                    absl::string_view,
                                                    const PlanQuery&) {
  STRATA_RETURN_IF_ERROR(call.stop.status());
  return absl::UnimplementedError("planning");
}

absl::StatusOr<std::vector<SurfaceColumn>> EnginePlanning::SampleSurfaces(
    const api::Call& call, absl::string_view, const std::vector<Eigen::Vector2d>&) {
  STRATA_RETURN_IF_ERROR(call.stop.status());
  return absl::UnimplementedError("planning");
}

absl::Status EnginePlanning::SetProfile(const api::Call& call,
                                        absl::string_view map,
                                        absl::string_view name,
                                        const RobotProfile& profile) {
  STRATA_RETURN_IF_ERROR(call.stop.status());
  STRATA_ASSIGN_OR_RETURN(const std::shared_ptr<Map> found, maps_.Find(map));
  STRATA_RETURN_IF_ERROR(ValidateName("profile name", name));
  STRATA_RETURN_IF_ERROR(ValidateRobotProfile(profile));
  if (name == api::kDefaultProfile) {
    return found->worker().Execute(call.stop, [&](Integrator& integrator) {
      return integrator.SetDefaultProfile(profile, call.stop);
    });
  }
  return found->core().writer().Run(Durability::kFull, 0, call.stop, [&](StorageWriter& writer) {
    return writer.PutProfile(name, profile);
  });
}

absl::StatusOr<std::map<std::string, RobotProfile>> EnginePlanning::ListProfiles(
    const api::Call& call, absl::string_view map) {
  STRATA_RETURN_IF_ERROR(call.stop.status());
  STRATA_ASSIGN_OR_RETURN(const std::shared_ptr<Map> found, maps_.Find(map));
  STRATA_ASSIGN_OR_RETURN(const ReaderPool::Lease reader, found->core().Reader());
  return reader->ListProfiles();
}

}  // namespace strata
