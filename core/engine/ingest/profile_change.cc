// Another default robot: every tile is annotated again.
#include <cstdint>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"

#include "core/api/planning.h"
#include "core/common/status.h"
#include "core/engine/ingest/integrator.h"
#include "core/engine/tiles/staged_tiles.h"

namespace strata {

absl::Status Integrator::SetDefaultProfile(const RobotProfile& profile,
                                           const Stop& stop,
                                           Decision also) {
  STRATA_ASSIGN_OR_RETURN(const ReaderPool::Lease reader, core_.Reader());
  STRATA_ASSIGN_OR_RETURN(const std::uint64_t version, NextVersion());
  StagedTiles staged(core_, version);
  const MlsTileMap unchanged;
  SurfaceTileMaker maker(
      core_,
      *reader,
      store_,
      unchanged,
      {.version = version, .threads = core_.options().worker_threads, .profile = profile});
  const absl::Status made = MakeAllSurfaces(
      maker,
      *reader,
      {},
      stop,
      [&stop](double) { return stop.status(); },
      [&staged](const SurfaceTileMaker::Rows& rows) { return staged.Put({}, rows); });
  STRATA_RETURN_IF_ERROR(made);
  STRATA_RETURN_IF_ERROR(staged.Publish({}, [&](StorageWriter& writer) -> absl::Status {
    STRATA_RETURN_IF_ERROR(writer.PutProfile(api::kDefaultProfile, profile));
    return also(writer);
  }));
  core_.set_default_profile(profile);
  return absl::OkStatus();
}

}  // namespace strata
