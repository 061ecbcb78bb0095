// Pieces put together to regions that are nowhere above themselves.
#ifndef STRATA_CORE_PLANNING_FLOORS_REGIONS_H_
#define STRATA_CORE_PLANNING_FLOORS_REGIONS_H_

#include <cstdint>
#include <vector>

#include "absl/status/statusor.h"

#include "core/common/stop.h"
#include "core/planning/floors/pieces.h"

namespace strata {

// Slope of the ground between the middles of two pieces, as a tangent.
double SlopeAcross(const Piece& a, const Piece& b, double cell_size_m);

// Of each piece, the first piece of its region. RESOURCE_EXHAUSTED where ever so many pieces lie
// above each other; errors of `stop`.
absl::StatusOr<std::vector<std::uint32_t>> JoinPieces(const Pieces& pieces,
                                                      double cell_size_m,
                                                      const Stop& stop);

}  // namespace strata

#endif  // STRATA_CORE_PLANNING_FLOORS_REGIONS_H_
