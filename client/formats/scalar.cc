#include "client/formats/scalar.h"

#include <bit>
#include <cstddef>
#include <cstdint>
#include <optional>

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

template <typename T>
double As(std::uint64_t bits) {
  return static_cast<double>(static_cast<T>(bits));
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

double ScalarAt(const char* bytes, ScalarType type, bool big_endian) {
  const std::size_t size = SizeOf(type);
  std::uint64_t bits = 0;
  for (std::size_t i = 0; i < size; ++i) {
    const std::size_t shift = 8 * (big_endian ? size - 1 - i : i);
    bits |= std::uint64_t{static_cast<std::uint8_t>(bytes[i])} << shift;
  }
  switch (type) {
    case ScalarType::kInt8:
      return As<std::int8_t>(bits);
    case ScalarType::kInt16:
      return As<std::int16_t>(bits);
    case ScalarType::kInt32:
      return As<std::int32_t>(bits);
    case ScalarType::kInt64:
      return As<std::int64_t>(bits);
    case ScalarType::kUint8:
    case ScalarType::kUint16:
    case ScalarType::kUint32:
    case ScalarType::kUint64:
      return As<std::uint64_t>(bits);
    case ScalarType::kFloat32:
      return double{std::bit_cast<float>(static_cast<std::uint32_t>(bits))};
    case ScalarType::kFloat64:
      return std::bit_cast<double>(bits);
  }
  return 0.0;
}

}  // namespace strata
