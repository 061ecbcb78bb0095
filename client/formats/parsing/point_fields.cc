#include "client/formats/parsing/point_fields.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <span>

namespace strata {
namespace {

// Few enough for the columns of a block to stay in a processor's nearest cache.
constexpr std::size_t kBlockPoints = 512;

using FieldOfMeaning = std::array<const PointField*, kMeanings>;

FieldOfMeaning FirstOfEachMeaning(std::span<const PointField> fields) {
  FieldOfMeaning field_of{};
  for (const PointField& field : fields) {
    const PointField*& first = field_of[static_cast<std::size_t>(field.meaning)];
    if (field.meaning != Meaning::kIgnored && first == nullptr) first = &field;
  }
  return field_of;
}

// Whether floats hold all coordinates.
bool AreFloats(const FieldOfMeaning& field_of) {
  const std::array axes = {Meaning::kX, Meaning::kY, Meaning::kZ};
  return std::all_of(axes.begin(), axes.end(), [&field_of](Meaning axis) {
    const ScalarType type = field_of[static_cast<std::size_t>(axis)]->type;
    return type == ScalarType::kFloat32 || SizeOf(type) < sizeof(float);
  });
}

void ReadField(const PointField& field,
               std::size_t begin,
               bool big_endian,
               std::span<double> values) {
  const bool packed = field.meaning == Meaning::kPackedColour;
  const ScalarType type = packed ? BitsOfColour(field.type) : field.type;
  ReadScalars(field.first + begin * field.stride, field.stride, type, big_endian, values);
  if (!packed) return;
  for (double& value : values) value = PackedColourOf(value, type);
}

}  // namespace

ScalarType BitsOfColour(ScalarType type) {
  return type == ScalarType::kFloat32 ? ScalarType::kUint32 : type;
}

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
  const FieldOfMeaning field_of = FirstOfEachMeaning(fields);
  if (AreFloats(field_of)) builder.HoldFloats();
  builder.Reserve(count);
  std::array<std::array<double, kBlockPoints>, kMeanings> values;
  for (std::size_t begin = 0; begin < count; begin += kBlockPoints) {
    PointBlock block{.count = std::min(kBlockPoints, count - begin), .columns = {}};
    for (std::size_t m = 0; m < kMeanings; ++m) {
      if (field_of[m] == nullptr) continue;
      block.columns[m] = values[m].data();
      ReadField(*field_of[m], begin, big_endian, {values[m].data(), block.count});
    }
    builder.AddBlock(block);
  }
}

}  // namespace strata
