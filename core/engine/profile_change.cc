// Another default robot: every tile is annotated again.
#include "absl/status/status.h"

#include "core/engine/integrator.h"

namespace strata {

absl::Status Integrator::SetDefaultProfile(const RobotProfile&, const Stop&) {
  return absl::UnimplementedError("default profile");
}

}  // namespace strata
