// Joins maps, exactly and in any order (thesis 6.5.2): for clouds A and B with the same parameters,
// join(map(A), map(B)) = map(A ∪ B), bit for bit, commutative and associative. An interval of one
// map may bridge several of the other; colours and votes follow their patches.
#ifndef STRATA_CORE_MLS_JOIN_H_
#define STRATA_CORE_MLS_JOIN_H_

#include <span>

#include "core/geometry/pose.h"
#include "core/mls/mls_map.h"
#include "core/mls/mls_parameters.h"

namespace strata {

// The tile of both multisets of measurements. REQUIRES: a.key == b.key; both were made with
// `parameters`.
MlsTile JoinTiles(const MlsTile& a, const MlsTile& b, const MlsParameters& parameters);

// The map of both. REQUIRES: a.parameters == b.parameters.
MlsMap JoinMaps(const MlsMap& a, const MlsMap& b);

// map = JoinMaps(map, contribution), touching only the tiles the contribution has.
// REQUIRES: map.parameters == contribution.parameters.
void JoinInto(MlsMap& map, const MlsMap& contribution);

// The join of all of `maps` (none: an empty map), pairwise as a balanced tree so that a patch is
// copied O(log n) times. REQUIRES: all have `parameters`.
MlsMap JoinAll(std::span<const MlsMap> maps, const MlsParameters& parameters);

// What a local map (scan frame) contributes to the map frame when its points are gone: every patch
// moves as a whole. Its surface point (centre of its cell, Patch::mean_m()) is transformed by
// T_map_scan; the patch goes to the cell the point falls in, its heights move by the whole number
// of ticks nearest to the point's change of height, its statistics, colour and votes come along
// exactly; patches that then touch in one cell join. A pure function of local map and pose.
//
// Approximates BuildMlsMap of the points: positions inside a cell are forgotten (up to half a cell
// diagonal sideways; two source cells may fall into one target cell and leave its neighbour empty
// when turned), and a tilted pose does not shear an interval: it stays as tall as it was. For
// poses that shift by whole cells and ticks it is exact. Patches that would leave the map
// (kMaxZTicks, kMaxCellIndex) are dropped. REQUIRES: ValidatePose(T_map_scan).
MlsMap TransformContribution(const MlsMap& local_map, const Pose& T_map_scan);

}  // namespace strata

#endif  // STRATA_CORE_MLS_JOIN_H_
