// Labels of points as bytes: what people and models say of a scan that is stored already.
#ifndef STRATA_CORE_CODEC_LABEL_CODEC_H_
#define STRATA_CORE_CODEC_LABEL_CODEC_H_

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"

namespace strata {

inline constexpr std::uint16_t kLabelsVersion = 1;
inline constexpr std::size_t kMaxEncodedLabels = 400'000;

// In the format of FORMAT.md, envelope included, below 1 MiB. A pure function of the labels.
// REQUIRES: at most kMaxEncodedLabels. Thread-safe.
std::string EncodeLabels(std::span<const std::uint16_t> labels);

// DATA_LOSS for bytes that are not an intact piece, UNIMPLEMENTED for those of a later version.
// Thread-safe.
absl::StatusOr<std::vector<std::uint16_t>> DecodeLabels(absl::string_view bytes);

}  // namespace strata

#endif  // STRATA_CORE_CODEC_LABEL_CODEC_H_
