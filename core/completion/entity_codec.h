// Entities as stored bytes.
#ifndef STRATA_CORE_COMPLETION_ENTITY_CODEC_H_
#define STRATA_CORE_COMPLETION_ENTITY_CODEC_H_

#include <cstdint>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"

#include "core/world/things/entity.h"

namespace strata {

// What is stored of an entity names scans by their numbers in the map.
struct StoredEntity {
  struct Seen {
    std::uint64_t scan = 0;
    std::uint64_t points = 0;

    friend bool operator==(const Seen&, const Seen&) = default;
  };
  Entity entity;            // without its scans and the name of its kind
  std::vector<Seen> scans;  // by number
};

// Little-endian numbers, doubles as their bits, in the envelope of core/codec. Entities of before
// there were kinds are read, too: they have none.
std::string EncodeEntitiesInfo(const EntitiesInfo& info);
std::string EncodeEntity(const StoredEntity& stored);

// DATA_LOSS for damaged bytes, and for numbers that are not finite or out of range.
absl::StatusOr<EntitiesInfo> DecodeEntitiesInfo(absl::string_view bytes);
absl::StatusOr<StoredEntity> DecodeEntity(absl::string_view bytes);

}  // namespace strata

#endif  // STRATA_CORE_COMPLETION_ENTITY_CODEC_H_
