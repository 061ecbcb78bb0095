#include "client/formats/point_fields.h"

#include <bit>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace strata {

double PackedColourOf(double value, ScalarType type) {
  constexpr std::uint32_t kMask = 0xFFFFFF;
  if (type == ScalarType::kFloat32) {
    return std::bit_cast<std::uint32_t>(static_cast<float>(value)) & kMask;
  }
  constexpr double kLimit = 4294967296.0;
  if (!(value > -kLimit && value < kLimit)) return 0.0;
  return static_cast<std::uint32_t>(static_cast<std::int64_t>(value)) & kMask;
}

void AddPoints(std::span<const PointField> fields,
               std::size_t count,
               bool big_endian,
               CloudBuilder& builder) {
  std::vector<double> values(fields.size());
  for (std::size_t i = 0; i < count; ++i) {
    for (std::size_t k = 0; k < fields.size(); ++k) {
      const PointField& field = fields[k];
      if (field.meaning == Meaning::kIgnored) continue;
      values[k] = ScalarAt(field.first + i * field.stride, field.type, big_endian);
      if (field.meaning == Meaning::kPackedColour)
        values[k] = PackedColourOf(values[k], field.type);
    }
    builder.Add(values.data());
  }
}

}  // namespace strata
