// Maps: create, find, measure and delete whole worlds.
#ifndef STRATA_CORE_API_MAPS_H_
#define STRATA_CORE_API_MAPS_H_

#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"

#include "core/api/call.h"
#include "core/world/map_info.h"

namespace strata::api {

// Thread-safe. An unknown map is NOT_FOUND in every call of every interface.
class Maps {
 public:
  virtual ~Maps() = default;

  // INVALID_ARGUMENT for a bad name or parameter; ALREADY_EXISTS.
  virtual absl::StatusOr<MapInfo> Create(const Call& call,
                                         absl::string_view name,
                                         const MapParameters& parameters) = 0;
  virtual absl::StatusOr<MapInfo> Get(const Call& call, absl::string_view name) = 0;
  // By name.
  virtual absl::StatusOr<std::vector<MapInfo>> List(const Call& call) = 0;
  // Deletes the map and its file. FAILED_PRECONDITION while a job runs on it, and for a file of
  // that name that is no map.
  virtual absl::Status Delete(const Call& call, absl::string_view name) = 0;
  virtual absl::StatusOr<MapStats> Stats(const Call& call, absl::string_view name) = 0;
};

}  // namespace strata::api

#endif  // STRATA_CORE_API_MAPS_H_
