// How scans are matched to each other: by ingest, by jobs and to find places alike.
#ifndef STRATA_CORE_ENGINE_SCANS_MATCHING_H_
#define STRATA_CORE_ENGINE_SCANS_MATCHING_H_

#include "core/geometry/pose.h"
#include "core/registration/mls_registration.h"
#include "core/registration/scan_features.h"
#include "core/storage/storage.h"

namespace strata {

// T_matching_scan: the frame in which a scan with points becomes what it is matched by, turned
// about z. Robots drive along walls and through doors at right angles to them, and a wall along the
// cells lies up to half a cell off its features, all of them on one side.
Pose MatchingFrame();
// How features of a scan are made everywhere in the engine. Where `scan` has points they are made
// of a map in MatchingFrame().
ScanFeatureOptions FeatureOptionsOf(const ScanRecord& scan);
// How scans are matched everywhere in the engine.
MlsRegistrationOptions EngineRegistrationOptions();

}  // namespace strata

#endif  // STRATA_CORE_ENGINE_SCANS_MATCHING_H_
