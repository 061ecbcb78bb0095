// Hash tables that outlive a failed allocation.
#ifndef STRATA_CORE_COMMON_HASH_MAP_H_
#define STRATA_CORE_COMMON_HASH_MAP_H_

#include <unordered_map>
#include <unordered_set>

#include "absl/hash/hash.h"

namespace strata {

// Not absl::flat_hash_map: that of Abseil 20220623 notes its larger size before it has the memory,
// and where there is none its destructor frees what it never had.
template <typename Key, typename Value>
using HashMap = std::unordered_map<Key, Value, absl::Hash<Key>>;
template <typename Key>
using HashSet = std::unordered_set<Key, absl::Hash<Key>>;

}  // namespace strata

#endif  // STRATA_CORE_COMMON_HASH_MAP_H_
