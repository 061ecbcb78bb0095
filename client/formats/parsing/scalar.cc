#include "client/formats/parsing/scalar.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <optional>
#include <span>

#include "absl/strings/string_view.h"

namespace strata {
namespace {

struct NamedType {
  absl::string_view name;
  ScalarType type;
};

constexpr NamedType kNames[] = {
    {"char", ScalarType::kInt8},           {"int8", ScalarType::kInt8},
    {"uchar", ScalarType::kUint8},         {"uint8", ScalarType::kUint8},
    {"unsigned_char", ScalarType::kUint8}, {"short", ScalarType::kInt16},
    {"int16", ScalarType::kInt16},         {"ushort", ScalarType::kUint16},
    {"uint16", ScalarType::kUint16},       {"unsigned_short", ScalarType::kUint16},
    {"int", ScalarType::kInt32},           {"int32", ScalarType::kInt32},
    {"uint", ScalarType::kUint32},         {"uint32", ScalarType::kUint32},
    {"unsigned_int", ScalarType::kUint32}, {"long", ScalarType::kInt64},
    {"vtktypeint64", ScalarType::kInt64},  {"unsigned_long", ScalarType::kUint64},
    {"float", ScalarType::kFloat32},       {"float32", ScalarType::kFloat32},
    {"double", ScalarType::kFloat64},      {"float64", ScalarType::kFloat64},
};

template <typename T, bool kSwapped>
void Read(const char* first, std::size_t stride, std::span<double> values) {
  for (std::size_t i = 0; i < values.size(); ++i) {
    std::array<char, sizeof(T)> bytes;
    std::memcpy(bytes.data(), first + i * stride, sizeof(T));
    if constexpr (kSwapped) std::reverse(bytes.begin(), bytes.end());
    values[i] = static_cast<double>(std::bit_cast<T>(bytes));
  }
}

template <typename T>
void Read(const char* first, std::size_t stride, bool big_endian, std::span<double> values) {
  const bool swapped = big_endian != (std::endian::native == std::endian::big);
  swapped ? Read<T, true>(first, stride, values) : Read<T, false>(first, stride, values);
}

}  // namespace

std::size_t SizeOf(ScalarType type) {
  switch (type) {
    case ScalarType::kInt8:
    case ScalarType::kUint8:
      return 1;
    case ScalarType::kInt16:
    case ScalarType::kUint16:
      return 2;
    case ScalarType::kInt32:
    case ScalarType::kUint32:
    case ScalarType::kFloat32:
      return 4;
    case ScalarType::kInt64:
    case ScalarType::kUint64:
    case ScalarType::kFloat64:
      return 8;
  }
  return 8;
}

std::optional<ScalarType> ScalarTypeOfName(absl::string_view name) {
  for (const NamedType& named : kNames) {
    if (named.name == name) return named.type;
  }
  return std::nullopt;
}

std::optional<ScalarType> ScalarTypeOfPcd(char letter, std::size_t size) {
  const bool is_signed = letter == 'I';
  if (letter == 'F' && size == 4) return ScalarType::kFloat32;
  if (letter == 'F' && size == 8) return ScalarType::kFloat64;
  if (letter != 'I' && letter != 'U') return std::nullopt;
  switch (size) {
    case 1:
      return is_signed ? ScalarType::kInt8 : ScalarType::kUint8;
    case 2:
      return is_signed ? ScalarType::kInt16 : ScalarType::kUint16;
    case 4:
      return is_signed ? ScalarType::kInt32 : ScalarType::kUint32;
    case 8:
      return is_signed ? ScalarType::kInt64 : ScalarType::kUint64;
    default:
      return std::nullopt;
  }
}

void ReadScalars(const char* first,
                 std::size_t stride,
                 ScalarType type,
                 bool big_endian,
                 std::span<double> values) {
  switch (type) {
    case ScalarType::kInt8:
      return Read<std::int8_t>(first, stride, big_endian, values);
    case ScalarType::kUint8:
      return Read<std::uint8_t>(first, stride, big_endian, values);
    case ScalarType::kInt16:
      return Read<std::int16_t>(first, stride, big_endian, values);
    case ScalarType::kUint16:
      return Read<std::uint16_t>(first, stride, big_endian, values);
    case ScalarType::kInt32:
      return Read<std::int32_t>(first, stride, big_endian, values);
    case ScalarType::kUint32:
      return Read<std::uint32_t>(first, stride, big_endian, values);
    case ScalarType::kInt64:
      return Read<std::int64_t>(first, stride, big_endian, values);
    case ScalarType::kUint64:
      return Read<std::uint64_t>(first, stride, big_endian, values);
    case ScalarType::kFloat32:
      return Read<float>(first, stride, big_endian, values);
    case ScalarType::kFloat64:
      return Read<double>(first, stride, big_endian, values);
  }
}

double ScalarAt(const char* bytes, ScalarType type, bool big_endian) {
  double value = 0.0;
  ReadScalars(bytes, 0, type, big_endian, {&value, 1});
  return value;
}

}  // namespace strata
