// api::PoseGraph on the maps of an engine.
#ifndef STRATA_CORE_ENGINE_DOORS_POSEGRAPH_H_
#define STRATA_CORE_ENGINE_DOORS_POSEGRAPH_H_

#include <cstdint>
#include <memory>
#include <utility>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"

#include "core/api/posegraph.h"
#include "core/engine/consistency/localizer.h"
#include "core/engine/consistency/surfaces_around.h"
#include "core/engine/doors/kept_elsewhere.h"
#include "core/engine/doors/map_reading.h"
#include "core/engine/doors/maps.h"
#include "core/engine/scans/scan_access.h"

namespace strata {

class EnginePoseGraph final : public api::PoseGraph {
 public:
  explicit EnginePoseGraph(EngineMaps& maps) : maps_(maps), elsewhere_(maps.options()) {}

  absl::StatusOr<api::PoseGraphState> Get(const api::Call& call, absl::string_view map) override;
  absl::Status SetPose(const api::Call& call,
                       absl::string_view map,
                       const ScanId& id,
                       const Pose& T_map_scan) override;
  absl::StatusOr<Constraint> AddConstraint(const api::Call& call,
                                           absl::string_view map,
                                           const Constraint& constraint) override;
  absl::Status RemoveConstraint(const api::Call& call,
                                absl::string_view map,
                                std::uint64_t id) override;
  absl::Status EnableConstraint(const api::Call& call,
                                absl::string_view map,
                                std::uint64_t id,
                                bool enabled) override;
  absl::StatusOr<api::PoseLookup> LookupPose(const api::Call& call,
                                             absl::string_view map,
                                             const ScanId& id) override;
  absl::StatusOr<LocalizeResult> Localize(const api::Call& call,
                                          absl::string_view map,
                                          const LocalizeQuery& query) override;
  absl::StatusOr<std::unique_ptr<api::Tracking>> Track(const api::Call& call,
                                                       absl::string_view map,
                                                       const TrackStart& start) override;

 private:
  class Following;

  // What is kept of a map that another engine has.
  struct Elsewhere {
    Elsewhere(std::unique_ptr<MapStorage> from,
              const MapParameters& of,
              const EngineOptions& options,
              const std::shared_ptr<CacheBudget>& caches)
        : store(std::move(from)),
          parameters(of),
          localizer(ScanAccess(*store, parameters, options, caches)),
          surfaces(parameters, caches) {}

    const std::unique_ptr<MapStorage> store;
    const MapParameters parameters;
    Localizer localizer;
    SurfacesAround surfaces;
  };
  // `found`: by this call.
  absl::StatusOr<std::shared_ptr<Elsewhere>> FindElsewhere(const api::Call& call,
                                                           const MapReading& found);

  EngineMaps& maps_;
  KeptElsewhere<Elsewhere> elsewhere_;
};

}  // namespace strata

#endif  // STRATA_CORE_ENGINE_DOORS_POSEGRAPH_H_
