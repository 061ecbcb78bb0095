// How scans are matched to each other: by ingest, by jobs and to find places alike.
#ifndef STRATA_CORE_ENGINE_SCANS_MATCHING_H_
#define STRATA_CORE_ENGINE_SCANS_MATCHING_H_

#include "core/registration/mls_registration.h"
#include "core/registration/scan_features.h"
#include "core/storage/storage.h"

namespace strata {

// How features of a scan are made everywhere in the engine.
ScanFeatureOptions FeatureOptionsOf(const ScanRecord& scan);
// How scans are matched everywhere in the engine.
MlsRegistrationOptions EngineRegistrationOptions();

}  // namespace strata

#endif  // STRATA_CORE_ENGINE_SCANS_MATCHING_H_
