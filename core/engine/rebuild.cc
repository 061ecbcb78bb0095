#include "core/engine/rebuild.h"

namespace strata {

absl::Status RunRebuildJob(Integrator&, const JobInfo&, JobContext&) {
  return absl::UnimplementedError("rebuild");
}
absl::Status RecoverDerived(Integrator&, const Stop&) { return absl::OkStatus(); }

}  // namespace strata
