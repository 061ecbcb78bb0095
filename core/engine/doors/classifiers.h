// api::Classifiers on the maps of an engine.
#ifndef STRATA_CORE_ENGINE_DOORS_CLASSIFIERS_H_
#define STRATA_CORE_ENGINE_DOORS_CLASSIFIERS_H_

#include <vector>

#include "core/api/classifiers.h"
#include "core/engine/doors/maps.h"

namespace strata {

class EngineClassifiers final : public api::Classifiers {
 public:
  explicit EngineClassifiers(EngineMaps& maps) : maps_(maps) {}

  absl::StatusOr<ClassifierInfo> Get(const api::Call& call,
                                     absl::string_view map,
                                     absl::string_view name) override;
  absl::StatusOr<std::vector<ClassifierInfo>> List(const api::Call& call,
                                                   absl::string_view map) override;
  absl::Status Delete(const api::Call& call,
                      absl::string_view map,
                      absl::string_view name) override;
  absl::Status Export(const api::Call& call,
                      absl::string_view map,
                      absl::string_view name,
                      absl::FunctionRef<absl::Status(absl::string_view)> sink) override;
  absl::StatusOr<ClassifierInfo> Import(const api::Call& call,
                                        absl::string_view map,
                                        absl::string_view name,
                                        absl::string_view bytes) override;

 private:
  EngineMaps& maps_;
};

}  // namespace strata

#endif  // STRATA_CORE_ENGINE_DOORS_CLASSIFIERS_H_
