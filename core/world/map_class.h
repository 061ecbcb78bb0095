// The classes of a map: what the labels of its points and surfaces mean.
#ifndef STRATA_CORE_WORLD_MAP_CLASS_H_
#define STRATA_CORE_WORLD_MAP_CLASS_H_

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"

#include "core/cloud/point_cloud.h"

namespace strata {

// Largest id that a class can have: what a served surface has room for. Larger labels are
// refused.
inline constexpr std::uint16_t kMaxClassId = 255;

// A class keeps its id for ever; its name and colour may change. A label whose id is in no table is
// fine, and is shown as its number.
struct MapClass {
  std::uint16_t id = 0;  // as in PointCloud::label; in [1, kMaxClassId]
  std::string name;      // unique in the map; ValidateName
  Colour colour;         // in pictures
  friend bool operator==(const MapClass&, const MapClass&) = default;
};

// INVALID_ARGUMENT for an id out of its range and for a bad name.
absl::Status ValidateMapClass(const MapClass& map_class);

// The class `id`, from a map's table; one that has no name there is called by its number, in its
// default colour.
MapClass ClassOf(const std::vector<MapClass>& classes, std::uint16_t id);

// The id of the class that `text` names: by its name in the table, or as a number in [1,
// kMaxClassId], in the table or not. NOT_FOUND listing the names there are.
absl::StatusOr<std::uint16_t> ClassIdOf(const std::vector<MapClass>& classes,
                                        absl::string_view text);

// The id of the class called `name` in `table`, to which it is added if it is not there: as `id`
// where that is free, else as the first that is. RESOURCE_EXHAUSTED when none is left,
// INVALID_ARGUMENT for a bad name.
absl::StatusOr<std::uint16_t> IdInTable(std::vector<MapClass>& table,
                                        const std::string& name,
                                        std::uint16_t id);

// INVALID_ARGUMENT for a label that is no class's id, nor 0; the first one is that of
// `first_point`.
absl::Status ValidateLabels(std::span<const std::uint16_t> labels, std::uint64_t first_point = 0);

// A colour for a class that nobody chose one for: the same for an id always, and well apart from
// those of the ids beside it.
Colour DefaultClassColour(std::uint16_t id);

}  // namespace strata

#endif  // STRATA_CORE_WORLD_MAP_CLASS_H_
