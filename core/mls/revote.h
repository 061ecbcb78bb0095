// Other labels for points that are in a map already: votes leave and come, geometry stays.
#ifndef STRATA_CORE_MLS_REVOTE_H_
#define STRATA_CORE_MLS_REVOTE_H_

#include <optional>

#include "core/mls/mls_map.h"

namespace strata {

// `tile`, one of whose joined parts was `before`, with `after` in its place: what JoinTiles of all
// parts but `before`, and `after`, would give, bit for bit, without having the other parts.
// `before` and `after` are the contributions of the same points, so their patches are equal; only
// their votes are not. nullopt where it is seen that `tile` cannot hold `before`, or where a count
// was saturated: it has to be made from all its parts then.
std::optional<MlsTile> ReplaceVotes(const MlsTile& tile,
                                    const MlsTile& before,
                                    const MlsTile& after);

}  // namespace strata

#endif  // STRATA_CORE_MLS_REVOTE_H_
