// The number types that binary point files are made of.
#ifndef STRATA_CLIENT_FORMATS_PARSING_SCALAR_H_
#define STRATA_CLIENT_FORMATS_PARSING_SCALAR_H_

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

#include "absl/strings/string_view.h"

namespace strata {

enum class ScalarType : std::uint8_t {
  kInt8,
  kUint8,
  kInt16,
  kUint16,
  kInt32,
  kUint32,
  kInt64,
  kUint64,
  kFloat32,
  kFloat64,
};

std::size_t SizeOf(ScalarType type);
// By the names of PLY and VTK ("float", "uchar", "int16", "unsigned_char", …).
std::optional<ScalarType> ScalarTypeOfName(absl::string_view name);
// By PCD's letter (I, U, F) and size in bytes.
std::optional<ScalarType> ScalarTypeOfPcd(char letter, std::size_t size);

// The number at the beginning of `bytes`, which must have SizeOf(type) of them.
double ScalarAt(const char* bytes, ScalarType type, bool big_endian);
// values[i] = ScalarAt(first + i · stride, …), for all of `values`.
void ReadScalars(const char* first,
                 std::size_t stride,
                 ScalarType type,
                 bool big_endian,
                 std::span<double> values);

}  // namespace strata

#endif  // STRATA_CLIENT_FORMATS_PARSING_SCALAR_H_
