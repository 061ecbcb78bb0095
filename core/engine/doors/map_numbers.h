// What is measured of a map that is open.
#ifndef STRATA_CORE_ENGINE_DOORS_MAP_NUMBERS_H_
#define STRATA_CORE_ENGINE_DOORS_MAP_NUMBERS_H_

#include <filesystem>

#include "core/engine/doors/map.h"
#include "core/engine/map/numbers.h"

namespace strata {

// Numbers that cannot be read now stay zero: they are looked at again in some seconds. `file`: that
// the map lies in, if any.
MapNumbers NumbersOfMap(Map& map, const std::filesystem::path& file);

// Adds what was counted while the map was open before.
void AddCounts(const MapNumbers& before, MapNumbers& numbers);

}  // namespace strata

#endif  // STRATA_CORE_ENGINE_DOORS_MAP_NUMBERS_H_
