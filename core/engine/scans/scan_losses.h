// What is said about a scan whose points do not all reach the map.
#ifndef STRATA_CORE_ENGINE_SCANS_SCAN_LOSSES_H_
#define STRATA_CORE_ENGINE_SCANS_SCAN_LOSSES_H_

#include <string>

#include "absl/status/status.h"

#include "core/cloud/sensor_model.h"
#include "core/mls/measurement.h"
#include "core/mls/mls_map.h"
#include "core/storage/records.h"
#include "core/world/scan.h"

namespace strata {

// INVALID_ARGUMENT if `contribution` has no patch, saying which bound all points of the scan are
// beyond and what cures it. A scan of which nothing is left but what has faded contributes nothing
// wherever it is, which is OK.
absl::Status CheckContributes(const MlsMap& contribution,
                              const DroppedPoints& dropped,
                              const ScanRecord& scan,
                              const SensorModel& sensor);

// How many points were left out and why; empty if none was. NaN of organised scans are no points.
std::string DescribeLosses(const DroppedPoints& dropped,
                           const ScanHeader& header,
                           const SensorModel& sensor);

}  // namespace strata

#endif  // STRATA_CORE_ENGINE_SCANS_SCAN_LOSSES_H_
