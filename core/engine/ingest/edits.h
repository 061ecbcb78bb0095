// Edits of a map that its worker carries out, wherever they are asked for: as a request that can be
// stored, and what becomes of it.
#ifndef STRATA_CORE_ENGINE_INGEST_EDITS_H_
#define STRATA_CORE_ENGINE_INGEST_EDITS_H_

#include <cstdint>
#include <vector>

#include "absl/functional/function_ref.h"
#include "absl/status/status.h"

#include "core/common/stop.h"
#include "core/engine/ingest/integrator.h"
#include "core/storage/storage.h"
#include "core/world/robot_profile.h"
#include "core/world/scan.h"

namespace strata {

// As Integrator's functions. All must be valid.
EditRequest SettingPose(const ScanId& id, const Pose& T_map_scan);
EditRequest DeletingScan(const ScanId& id);
EditRequest SettingLabels(const ScanId& id, const std::vector<std::uint16_t>& labels, bool update);
EditRequest SettingDefaultProfile(const RobotProfile& profile);
// For AskForEdit() only: no work of the worker's.
EditRequest DeletingMap();

// On the worker's thread. `also`: in the same commit.
absl::Status CarryOut(const EditRequest& edit,
                      Integrator& integrator,
                      const Stop& stop,
                      Integrator::Decision also = Integrator::Nothing);

// Where another engine has the map: asks that one by `store`, as of MapStores::OpenToAdd(), and
// waits for its answer, by polling. `stop` takes the edit back unless it has been carried out;
// `look`, once a second, does so with its error. UNAVAILABLE, outcome unknown, where the store is
// away for ten seconds; NOT_FOUND once the map was deleted.
absl::Status AskForEdit(MapStorage& store,
                        const EditRequest& edit,
                        const Stop& stop,
                        absl::FunctionRef<absl::Status()> look);

}  // namespace strata

#endif  // STRATA_CORE_ENGINE_INGEST_EDITS_H_
