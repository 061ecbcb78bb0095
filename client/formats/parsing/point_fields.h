// Fields of many points at fixed distances in a block of bytes: how binary files hold them.
#ifndef STRATA_CLIENT_FORMATS_PARSING_POINT_FIELDS_H_
#define STRATA_CLIENT_FORMATS_PARSING_POINT_FIELDS_H_

#include <cstddef>
#include <span>

#include "client/formats/parsing/cloud_builder.h"
#include "client/formats/parsing/scalar.h"

namespace strata {

// One field: the value of point i begins at first + i · stride.
struct PointField {
  Meaning meaning = Meaning::kIgnored;
  ScalarType type = ScalarType::kFloat32;
  const char* first = nullptr;
  std::size_t stride = 0;
};

// Adds `count` points to a builder made for the meanings of `fields`, that has none. REQUIRES: all
// bytes are there.
void AddPoints(std::span<const PointField> fields,
               std::size_t count,
               bool big_endian,
               CloudBuilder& builder);

// As what the bits of a packed colour of `type` are read: a float with an opacity in its highest
// byte may be a NaN that signals, which no conversion leaves as it is.
ScalarType BitsOfColour(ScalarType type);

// A packed colour read as a number of a field of `type`: its 24 bits. A float holds them as its
// bits.
double PackedColourOf(double value, ScalarType type);

}  // namespace strata

#endif  // STRATA_CLIENT_FORMATS_PARSING_POINT_FIELDS_H_
