#include "tests/fuzz/tile_parts.h"

#include <algorithm>
#include <cstddef>

#include "core/codec/bytes.h"
#include "core/codec/columns.h"
#include "tests/fuzz/require.h"

namespace strata::fuzz {
namespace {

constexpr std::size_t kAddressBytes = 9;
constexpr std::size_t kVersionBytes = 8;
constexpr std::size_t kAnySize = std::size_t{1} << 26;

std::string Column(ByteReader& reader) {
  std::string bytes;
  Require(TakeColumn(reader, kAnySize, bytes).ok(), "an encoder's column can be read");
  return bytes;
}

int ColumnsOf(BlobKind kind, std::uint16_t version) {
  if (kind == BlobKind::kMlsTile) return 25;
  return version == 1 ? 17 : 18;
}

void DamageBytes(FuzzedDataProvider& input, std::string& bytes) {
  const auto position = input.ConsumeIntegralInRange<std::size_t>(0, bytes.size());
  const auto value = input.ConsumeIntegral<char>();
  switch (input.ConsumeIntegralInRange<int>(0, 3)) {
    case 0:
      if (position < bytes.size()) bytes[position] = value;
      break;
    case 1:
      bytes.insert(position, input.ConsumeIntegralInRange<std::size_t>(1, 300), value);
      break;
    case 2:
      bytes.resize(position);
      break;
    default:
      bytes.insert(position, input.ConsumeRandomLengthString(64));
  }
}

}  // namespace

TileParts TakeApart(BlobKind kind, absl::string_view bytes) {
  const auto body = OpenBlob(kind, UINT16_MAX, bytes);
  Require(body.ok(), "an encoder's bytes can be opened");
  ByteReader reader(*body);
  TileParts parts;
  parts.address = std::string(
      reader.Take(kAddressBytes + (kind == BlobKind::kSurfaceTile ? kVersionBytes : 0)));
  for (int i = 0; i < 2; ++i) parts.cells.push_back(Column(reader));
  if (kind == BlobKind::kMlsTile) {
    PutFixed(parts.flags, reader.Fixed<std::uint8_t>());
    PutVarint(parts.flags, reader.Varint());
  }
  for (int i = 0; i < ColumnsOf(kind, VersionOfBlob(bytes)); ++i) {
    parts.columns.push_back(Column(reader));
  }
  parts.raw = std::string(reader.Take(reader.Varint()));
  Require(reader.ok() && reader.remaining() == 0, "an encoder's bytes have these parts");
  return parts;
}

std::string PutTogether(BlobKind kind, std::uint16_t version, const TileParts& parts) {
  std::string body = parts.address;
  for (const std::string& column : parts.cells) PutColumn(body, column);
  body += parts.flags;
  for (const std::string& column : parts.columns) PutColumn(body, column);
  PutVarint(body, parts.raw.size());
  body += parts.raw;
  return SealBlob(kind, version, body);
}

void Damage(FuzzedDataProvider& input, TileParts& parts) {
  while (input.remaining_bytes() > 0) {
    const auto which = input.ConsumeIntegralInRange<std::size_t>(0, parts.columns.size() + 4);
    if (which < parts.columns.size()) {
      DamageBytes(input, parts.columns[which]);
    } else if (which - parts.columns.size() < 2) {
      DamageBytes(input, parts.cells[which - parts.columns.size()]);
    } else if (which == parts.columns.size() + 2) {
      DamageBytes(input, parts.address);
    } else if (which == parts.columns.size() + 3) {
      DamageBytes(input, parts.flags);
    } else {
      DamageBytes(input, parts.raw);
    }
  }
}

}  // namespace strata::fuzz
