#include "core/engine/engine.h"

#include <memory>
#include <utility>

#include "absl/status/statusor.h"

#include "core/common/status.h"
#include "core/engine/doors/classifiers.h"
#include "core/engine/doors/jobs.h"
#include "core/engine/doors/maps.h"
#include "core/engine/doors/models.h"
#include "core/engine/doors/objects.h"
#include "core/engine/doors/planning.h"
#include "core/engine/doors/posegraph.h"
#include "core/engine/doors/scans.h"
#include "core/engine/doors/tiles.h"
#include "core/engine/map/map_core.h"
#include "core/engine/map/numbers.h"

namespace strata {
namespace {

class Engine final : public api::Database, public NumbersSource {
 public:
  explicit Engine(std::unique_ptr<EngineMaps> maps) : maps_(std::move(maps)) {}

  api::Maps& maps() override { return *maps_; }
  api::Scans& scans() override { return scans_; }
  api::Tiles& tiles() override { return tiles_; }
  api::Planning& planning() override { return planning_; }
  api::Jobs& jobs() override { return jobs_; }
  api::PoseGraph& posegraph() override { return posegraph_; }
  api::Classifiers& classifiers() override { return classifiers_; }
  api::Models& models() override { return models_; }
  api::Objects& objects() override { return objects_; }
  EngineNumbers Numbers() override { return maps_->Numbers(); }
  EngineHealth Health() override { return maps_->Health(); }

 private:
  std::unique_ptr<EngineMaps> maps_;
  EngineScans scans_{*maps_};
  EngineTiles tiles_{*maps_};
  EnginePlanning planning_{*maps_};
  EngineJobs jobs_{*maps_};
  EnginePoseGraph posegraph_{*maps_};
  EngineClassifiers classifiers_{*maps_};
  EngineModels models_{*maps_};
  EngineObjects objects_{*maps_};
};

}  // namespace

absl::StatusOr<std::unique_ptr<api::Database>> OpenEngine(const EngineOptions& options,
                                                          OpenStores open) {
  STRATA_RETURN_IF_ERROR(options.Validate());
  // Made while there is memory. Abseil gathers randomness at its first use; where memory ended just
  // then, all later ones would wait for it forever.
  MapCore::NextUpload();
  BeingClosed();
  STRATA_ASSIGN_OR_RETURN(std::unique_ptr<EngineMaps> maps, EngineMaps::Open(options, open));
  return std::make_unique<Engine>(std::move(maps));
}

}  // namespace strata
