// api::Models on the maps of an engine.
#ifndef STRATA_CORE_ENGINE_DOORS_MODELS_H_
#define STRATA_CORE_ENGINE_DOORS_MODELS_H_

#include "core/api/models.h"
#include "core/engine/doors/maps.h"

namespace strata {

class EngineModels final : public api::Models {
 public:
  explicit EngineModels(EngineMaps& maps) : maps_(maps) {}

  absl::StatusOr<PlaneModelInfo> GetPlaneModel(
      const api::Call& call,
      absl::string_view map,
      absl::FunctionRef<absl::Status(const ModelPlane&)> sink) override;

 private:
  EngineMaps& maps_;
};

}  // namespace strata

#endif  // STRATA_CORE_ENGINE_DOORS_MODELS_H_
