// How cheap the ways through a tile may be, block by block: what bounds of long ways are made of.
#ifndef STRATA_CORE_PLANNING_LEAST_DANGERS_H_
#define STRATA_CORE_PLANNING_LEAST_DANGERS_H_

#include <array>
#include <cstdint>

#include "core/planning/patch_index.h"
#include "core/planning/prepared_tile.h"

namespace strata {

// Of each block of a tile (PatchIndex), all levels together: no part of a move that lies over it
// costs less than it would between patches of this danger (DangerCode()). kClosedBlock: none does.
using LeastDangers = std::array<std::uint16_t, PatchIndex::kBlocks>;
inline constexpr std::uint16_t kClosedBlock = 0xFFFF;

// Over the corners of a tile go moves over gaps, too, that neither begin nor end in it; those are
// not looked for here.
LeastDangers LeastDangersOf(const PreparedTile& tile);

// The least a move over a gap has: half of its cells or more are unobserved (kGapDanger).
std::uint16_t LeastGapDanger();

}  // namespace strata

#endif  // STRATA_CORE_PLANNING_LEAST_DANGERS_H_
