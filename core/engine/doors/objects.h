// api::Objects on the maps of an engine.
#ifndef STRATA_CORE_ENGINE_DOORS_OBJECTS_H_
#define STRATA_CORE_ENGINE_DOORS_OBJECTS_H_

#include <vector>

#include "core/api/objects.h"
#include "core/engine/doors/maps.h"

namespace strata {

class EngineObjects final : public api::Objects {
 public:
  explicit EngineObjects(EngineMaps& maps) : maps_(maps) {}

  absl::StatusOr<EntitiesInfo> ListEntities(
      const api::Call& call,
      absl::string_view map,
      const EntityQuery& query,
      absl::FunctionRef<absl::Status(const Entity&)> sink) override;

  absl::StatusOr<std::vector<KindInfo>> ListKinds(const api::Call& call,
                                                  absl::string_view map) override;
  absl::StatusOr<ThingKind> GetKind(const api::Call& call,
                                    absl::string_view map,
                                    absl::string_view kind) override;
  absl::StatusOr<KindInfo> RenameKind(const api::Call& call,
                                      absl::string_view map,
                                      absl::string_view kind,
                                      absl::string_view name) override;
  absl::StatusOr<KindInfo> ImportKind(const api::Call& call,
                                      absl::string_view map,
                                      const NewKind& kind) override;
  absl::Status DeleteKind(const api::Call& call,
                          absl::string_view map,
                          absl::string_view kind) override;

  absl::StatusOr<InferredInfo> ListInferred(
      const api::Call& call,
      absl::string_view map,
      const EntityQuery& query,
      absl::FunctionRef<absl::Status(const InferredPart&)> sink) override;

 private:
  EngineMaps& maps_;
};

}  // namespace strata

#endif  // STRATA_CORE_ENGINE_DOORS_OBJECTS_H_
