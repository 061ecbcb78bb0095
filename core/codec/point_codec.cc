#include "core/codec/point_codec.h"

#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/string_view.h"

#include "core/codec/blob.h"
#include "core/codec/bytes.h"
#include "core/codec/columns.h"
#include "core/common/status.h"

namespace strata {
namespace {

constexpr std::uint8_t kHasIntensity = 1;
constexpr std::uint8_t kHasColour = 2;
constexpr std::uint8_t kHasLabel = 4;
constexpr std::uint32_t kNanBits = 0x7FC00000;

std::uint32_t BitsOf(float value) {
  return std::isnan(value) ? kNanBits : std::bit_cast<std::uint32_t>(value);
}

// Numbers of neighbouring points differ little: their differences, zigzag, byte by byte in planes,
// so that what is nearly constant and what is noise end up in different columns.
template <typename Word>
Word ZigzagDifference(Word word, Word previous) {
  const auto difference = static_cast<Word>(word - previous);
  const auto sign = static_cast<Word>(0 - (difference >> (8 * sizeof(Word) - 1)));
  return static_cast<Word>(static_cast<Word>(difference << 1) ^ sign);
}

template <typename Word, typename Get>
void PutPlanes(std::string& out, std::size_t count, Get get) {
  // Loop by loop, so that the compiler makes vectors of each.
  std::vector<Word> words(count);
  for (std::size_t i = 0; i < count; ++i) words[i] = get(i);
  std::vector<Word> zigzag(count);
  if (count > 0) zigzag[0] = ZigzagDifference<Word>(words[0], 0);
  for (std::size_t i = 1; i < count; ++i) zigzag[i] = ZigzagDifference(words[i], words[i - 1]);
  std::string plane(count, '\0');
  for (std::size_t k = 0; k < sizeof(Word); ++k) {
    for (std::size_t i = 0; i < count; ++i) plane[i] = static_cast<char>(zigzag[i] >> (8 * k));
    PutNoisyColumn(out, plane);
  }
}

template <typename Word, typename Set>
absl::Status TakePlanes(ByteReader& reader, std::size_t count, Set set) {
  std::string planes[sizeof(Word)];
  for (std::string& plane : planes) {
    STRATA_RETURN_IF_ERROR(TakeColumn(reader, count, plane));
    if (plane.size() != count) {
      return absl::DataLossError(
          absl::StrCat("points: a column of ", plane.size(), " for ", count, " points"));
    }
  }
  Word previous = 0;
  for (std::size_t i = 0; i < count; ++i) {
    Word zigzag = 0;
    for (std::size_t k = 0; k < sizeof(Word); ++k) {
      zigzag |= static_cast<Word>(Word{static_cast<std::uint8_t>(planes[k][i])} << (8 * k));
    }
    const auto sign = static_cast<Word>(0 - (zigzag & 1));
    previous = static_cast<Word>(previous + static_cast<Word>((zigzag >> 1) ^ sign));
    set(i, previous);
  }
  return absl::OkStatus();
}

}  // namespace

absl::StatusOr<std::string> EncodePoints(const PointCloud& chunk) {
  const std::size_t n = chunk.size();
  if (n > kMaxEncodedPoints) {
    return absl::InvalidArgumentError(
        absl::StrCat("points: ", n, " of them; at most ", kMaxEncodedPoints, " a piece"));
  }
  STRATA_RETURN_IF_ERROR(CheckColumns(chunk));
  std::string body;
  PutVarint(body, n);
  body.push_back(static_cast<char>((chunk.intensity.empty() ? 0 : kHasIntensity) |
                                   (chunk.colour.empty() ? 0 : kHasColour) |
                                   (chunk.label.empty() ? 0 : kHasLabel)));
  for (int axis = 0; axis < 3; ++axis) {
    PutPlanes<std::uint32_t>(body, n, [&](std::size_t i) { return BitsOf(chunk.points[i][axis]); });
  }
  if (!chunk.intensity.empty()) {
    PutPlanes<std::uint32_t>(body, n, [&](std::size_t i) { return BitsOf(chunk.intensity[i]); });
  }
  if (!chunk.colour.empty()) {
    for (std::uint8_t Colour::*const channel : {&Colour::r, &Colour::g, &Colour::b}) {
      PutPlanes<std::uint8_t>(body, n, [&](std::size_t i) { return chunk.colour[i].*channel; });
    }
  }
  if (!chunk.label.empty()) {
    PutPlanes<std::uint16_t>(body, n, [&](std::size_t i) { return chunk.label[i]; });
  }
  return SealBlob(BlobKind::kPoints, kPointsVersion, body);
}

absl::StatusOr<PointCloud> DecodePoints(absl::string_view bytes) {
  STRATA_ASSIGN_OR_RETURN(const absl::string_view body,
                          OpenBlob(BlobKind::kPoints, kPointsVersion, bytes));
  ByteReader reader(body);
  const std::uint64_t n = reader.Varint();
  const auto columns = reader.Fixed<std::uint8_t>();
  if (!reader.ok() || n > kMaxEncodedPoints || columns > (kHasIntensity | kHasColour | kHasLabel)) {
    return absl::DataLossError(absl::StrCat("points: ", n, " of them, columns ", columns));
  }
  PointCloud chunk;
  chunk.points.resize(n);
  for (int axis = 0; axis < 3; ++axis) {
    STRATA_RETURN_IF_ERROR(
        TakePlanes<std::uint32_t>(reader, n, [&](std::size_t i, std::uint32_t word) {
          chunk.points[i][axis] = std::bit_cast<float>(word);
        }));
  }
  if ((columns & kHasIntensity) != 0) {
    chunk.intensity.resize(n);
    STRATA_RETURN_IF_ERROR(
        TakePlanes<std::uint32_t>(reader, n, [&](std::size_t i, std::uint32_t word) {
          chunk.intensity[i] = std::bit_cast<float>(word);
        }));
  }
  if ((columns & kHasColour) != 0) {
    chunk.colour.resize(n);
    for (std::uint8_t Colour::*const channel : {&Colour::r, &Colour::g, &Colour::b}) {
      STRATA_RETURN_IF_ERROR(TakePlanes<std::uint8_t>(
          reader, n, [&](std::size_t i, std::uint8_t value) { chunk.colour[i].*channel = value; }));
    }
  }
  if ((columns & kHasLabel) != 0) {
    chunk.label.resize(n);
    STRATA_RETURN_IF_ERROR(TakePlanes<std::uint16_t>(
        reader, n, [&](std::size_t i, std::uint16_t value) { chunk.label[i] = value; }));
  }
  if (reader.remaining() != 0) return absl::DataLossError("points: bytes left over");
  return chunk;
}

}  // namespace strata
