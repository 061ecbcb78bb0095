// api::Tiles on the maps of an engine.
#ifndef STRATA_CORE_ENGINE_DOORS_TILES_H_
#define STRATA_CORE_ENGINE_DOORS_TILES_H_

#include <optional>
#include <vector>

#include "absl/functional/function_ref.h"
#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"

#include "core/api/tiles.h"
#include "core/engine/doors/maps.h"

namespace strata {

class EngineTiles final : public api::Tiles {
 public:
  explicit EngineTiles(EngineMaps& maps) : maps_(maps) {}

  absl::StatusOr<api::EncodedTile> Get(const api::Call& call,
                                       absl::string_view map,
                                       const TileKey& key) override;
  absl::StatusOr<std::optional<api::EncodedTile>> GetAtHand(const api::Call& call,
                                                            absl::string_view map,
                                                            const TileKey& key) override;
  absl::StatusOr<std::vector<api::TileInfo>> List(const api::Call& call,
                                                  absl::string_view map,
                                                  const api::TileArea& area) override;
  absl::Status Fetch(const api::Call& call,
                     absl::string_view map,
                     const api::TileArea& area,
                     const std::vector<api::HeldTile>& held,
                     absl::FunctionRef<absl::Status(const api::TileUpdate&)> sink) override;

 private:
  EngineMaps& maps_;
};

}  // namespace strata

#endif  // STRATA_CORE_ENGINE_DOORS_TILES_H_
