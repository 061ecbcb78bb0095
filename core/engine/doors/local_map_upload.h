// Takes in a scan as a ready local map.
#ifndef STRATA_CORE_ENGINE_DOORS_LOCAL_MAP_UPLOAD_H_
#define STRATA_CORE_ENGINE_DOORS_LOCAL_MAP_UPLOAD_H_

#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"

#include "core/api/call.h"
#include "core/engine/doors/map.h"
#include "core/mls/mls_parameters.h"
#include "core/storage/storage.h"
#include "core/world/scan.h"

namespace strata {

// As api::Scans::UploadLocalMap. `header` must be valid.
absl::StatusOr<ScanAck> UploadLocalMap(Map& map,
                                       const api::Call& call,
                                       const ScanHeader& header,
                                       const MlsParameters& parameters,
                                       absl::string_view bytes);

// The same into a map that another engine has; `store` as of MapStores::OpenToAdd().
absl::StatusOr<ScanAck> UploadLocalMapBeside(MapStorage& store,
                                             const ScanHeader& header,
                                             const MlsParameters& parameters,
                                             absl::string_view bytes);

}  // namespace strata

#endif  // STRATA_CORE_ENGINE_DOORS_LOCAL_MAP_UPLOAD_H_
