// Versions of what is stored, whatever the store.
#ifndef STRATA_CORE_STORAGE_FORMAT_H_
#define STRATA_CORE_STORAGE_FORMAT_H_

#include <cstdint>

namespace strata {

// Format of the derived tables and of what is in them; any other is dropped and rebuilt.
inline constexpr std::int32_t kDerivedVersion = 9;

}  // namespace strata

#endif  // STRATA_CORE_STORAGE_FORMAT_H_
