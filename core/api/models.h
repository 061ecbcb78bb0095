// Models of what a map is made of, found by jobs.
#ifndef STRATA_CORE_API_MODELS_H_
#define STRATA_CORE_API_MODELS_H_

#include "absl/functional/function_ref.h"
#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"

#include "core/api/call.h"
#include "core/world/plane_model.h"

namespace strata::api {

// Thread-safe.
class Models {
 public:
  virtual ~Models() = default;

  // The planes that the last job `planes` found, by falling area: each to `sink`, whose error ends
  // the call. Returns how the model came about; its epoch may be older than the map's. NOT_FOUND
  // where no job has found any; ABORTED where another one replaced it meanwhile; DATA_LOSS naming
  // the plane that is damaged.
  virtual absl::StatusOr<PlaneModelInfo> GetPlaneModel(
      const Call& call,
      absl::string_view map,
      absl::FunctionRef<absl::Status(const ModelPlane&)> sink) = 0;
};

}  // namespace strata::api

#endif  // STRATA_CORE_API_MODELS_H_
