// Kinds of things as stored bytes, and as files that go from map to map.
#ifndef STRATA_CORE_COMPLETION_KIND_CODEC_H_
#define STRATA_CORE_COMPLETION_KIND_CODEC_H_

#include <cstdint>
#include <string>

#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"

#include "core/world/things/kind.h"

namespace strata {

// Little-endian numbers, floats as their bits, in the envelope of core/codec. A shape that
// ValidateKindShape() takes is less than 1 MiB.
std::string EncodeKindInfo(const KindInfo& info);  // without name and entities
std::string EncodeKindShape(const KindShape& shape);
// What another map needs to know it.
std::string EncodeKindFile(const NewKind& kind);

// DATA_LOSS for damaged bytes, and for what Validate… refuses; nothing is allocated before it is
// known to be there.
absl::StatusOr<KindInfo> DecodeKindInfo(absl::string_view bytes);
absl::StatusOr<KindShape> DecodeKindShape(absl::string_view bytes);
absl::StatusOr<NewKind> DecodeKindFile(absl::string_view bytes);

// KindInfo::id of a shape: of the hash of its bytes, so that a kind is the same in every map.
std::uint64_t KindIdOf(const KindShape& shape);

}  // namespace strata

#endif  // STRATA_CORE_COMPLETION_KIND_CODEC_H_
