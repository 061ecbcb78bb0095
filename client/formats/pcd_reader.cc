#include "client/formats/pcd_reader.h"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/string_view.h"

#include "client/formats/lzf.h"
#include "client/formats/parsing/cloud_builder.h"
#include "client/formats/parsing/point_fields.h"
#include "client/formats/parsing/scalar.h"
#include "client/formats/parsing/text_cursor.h"
#include "core/common/status.h"

namespace strata {
namespace {

constexpr std::size_t kMaxFields = 1000;
constexpr std::size_t kMaxFieldCount = 1'000'000;

struct Header {
  std::vector<std::string> names;
  std::vector<std::size_t> sizes, counts;
  std::string letters;
  std::size_t width = 0, height = 1;
  std::optional<std::size_t> points;
  Eigen::Vector3d viewpoint = Eigen::Vector3d::Zero();
  std::string data;

  std::size_t record_size() const {
    std::size_t size = 0;
    for (std::size_t i = 0; i < names.size(); ++i) size += sizes[i] * counts[i];
    return size;
  }
  std::size_t words_per_line() const {
    std::size_t words = 0;
    for (const std::size_t count : counts) words += count;
    return words;
  }
};

absl::StatusOr<std::vector<std::size_t>> Counts(const TextCursor& cursor,
                                                const std::vector<absl::string_view>& words,
                                                std::size_t most) {
  std::vector<std::size_t> counts;
  for (std::size_t i = 1; i < words.size(); ++i) {
    const std::optional<std::size_t> count = ParseCount(words[i]);
    if (!count.has_value() || *count > most) {
      return cursor.Error(absl::StrCat(words[0],
                                       " expects whole numbers up to ",
                                       most,
                                       ", found '",
                                       words[i].substr(0, 40),
                                       "'"));
    }
    counts.push_back(*count);
  }
  return counts;
}

absl::Status ReadViewpoint(const TextCursor& cursor,
                           const std::vector<absl::string_view>& words,
                           Header& header) {
  for (std::size_t k = 0; k < 3; ++k) {
    const auto number = k + 1 < words.size() ? ParseNumber(words[k + 1]) : std::nullopt;
    if (!number.has_value()) return cursor.Error("VIEWPOINT expects seven numbers");
    header.viewpoint[static_cast<Eigen::Index>(k)] = *number;
  }
  return absl::OkStatus();
}

absl::Status ReadSize(const TextCursor& cursor,
                      const std::vector<absl::string_view>& words,
                      std::size_t& value) {
  STRATA_ASSIGN_OR_RETURN(const std::vector<std::size_t> counts,
                          Counts(cursor, words, std::numeric_limits<std::uint32_t>::max()));
  if (counts.size() != 1) return cursor.Error(absl::StrCat(words[0], " expects one number"));
  value = counts[0];
  return absl::OkStatus();
}

absl::Status ReadEntry(const TextCursor& cursor,
                       const std::vector<absl::string_view>& words,
                       Header& header) {
  const absl::string_view key = words[0];
  if (key == "FIELDS" || key == "COLUMNS") {
    header.names.clear();
    for (std::size_t i = 1; i < words.size(); ++i) header.names.emplace_back(words[i]);
  } else if (key == "SIZE") {
    STRATA_ASSIGN_OR_RETURN(header.sizes, Counts(cursor, words, 8));
  } else if (key == "COUNT") {
    STRATA_ASSIGN_OR_RETURN(header.counts, Counts(cursor, words, kMaxFieldCount));
  } else if (key == "TYPE") {
    header.letters.clear();
    for (std::size_t i = 1; i < words.size(); ++i) header.letters.push_back(words[i][0]);
  } else if (key == "WIDTH") {
    return ReadSize(cursor, words, header.width);
  } else if (key == "HEIGHT") {
    return ReadSize(cursor, words, header.height);
  } else if (key == "POINTS") {
    header.points.emplace();
    return ReadSize(cursor, words, *header.points);
  } else if (key == "VIEWPOINT") {
    return ReadViewpoint(cursor, words, header);
  } else if (key == "DATA") {
    header.data = words.size() == 2 ? std::string(words[1]) : std::string();
  } else if (key != "VERSION") {
    return cursor.Error(
        absl::StrCat("expected a PCD header entry, found '", key.substr(0, 40), "'"));
  }
  return absl::OkStatus();
}

absl::Status CheckHeader(const TextCursor& cursor, Header& header) {
  const std::size_t fields = header.names.size();
  if (header.counts.empty()) header.counts.assign(fields, 1);
  if (fields == 0 || fields > kMaxFields || header.sizes.size() != fields ||
      header.letters.size() != fields || header.counts.size() != fields) {
    return cursor.Error(absl::StrCat("FIELDS, SIZE, TYPE and COUNT have ",
                                     fields,
                                     ", ",
                                     header.sizes.size(),
                                     ", ",
                                     header.letters.size(),
                                     " and ",
                                     header.counts.size(),
                                     " entries; expected equally many"));
  }
  for (std::size_t i = 0; i < fields; ++i) {
    if (!ScalarTypeOfPcd(header.letters[i], header.sizes[i]).has_value()) {
      return cursor.Error(absl::StrCat("field ",
                                       header.names[i],
                                       " has no known type: ",
                                       header.letters.substr(i, 1),
                                       header.sizes[i]));
    }
  }
  if (header.width == 0 && header.points.has_value()) header.width = *header.points;
  const std::size_t points = header.width * header.height;  // both below 2^32
  if (header.points.has_value() && *header.points != points) {
    return cursor.Error(absl::StrCat("POINTS is ", *header.points, ", WIDTH × HEIGHT is ", points));
  }
  header.points = points;
  return absl::OkStatus();
}

absl::StatusOr<Header> ReadHeader(TextCursor& cursor) {
  Header header;
  while (header.data.empty()) {
    const std::optional<absl::string_view> line = cursor.NextLine();
    if (!line.has_value()) return cursor.Error("expected a DATA line, found the end of the file");
    const std::vector<absl::string_view> words = SplitWords(*line);
    if (words.empty() || words[0][0] == '#') continue;
    STRATA_RETURN_IF_ERROR(ReadEntry(cursor, words, header));
    if (words[0] == "DATA" && header.data.empty()) {
      return cursor.Error("DATA expects ascii, binary or binary_compressed");
    }
  }
  STRATA_RETURN_IF_ERROR(CheckHeader(cursor, header));
  return header;
}

absl::Status TooShort(std::size_t points, std::size_t needed, std::size_t at, std::size_t have) {
  return absl::InvalidArgumentError(absl::StrCat(
      points, " points need ", needed, " bytes from byte ", at, " on, there are ", have));
}

std::vector<Meaning> MeaningsOf(const Header& header) {
  std::vector<Meaning> meanings;
  for (std::size_t i = 0; i < header.names.size(); ++i) {
    meanings.push_back(header.counts[i] == 1 ? MeaningOf(header.names[i]) : Meaning::kIgnored);
  }
  return meanings;
}

// `block` holds the points one after the other, or field after field.
void AddBlock(const Header& header,
              absl::string_view block,
              bool field_by_field,
              CloudBuilder& builder) {
  const std::vector<Meaning> meanings = MeaningsOf(header);
  const std::size_t points = *header.points;
  std::vector<PointField> fields;
  std::size_t offset = 0;
  for (std::size_t i = 0; i < meanings.size(); ++i) {
    const std::size_t size = header.sizes[i] * header.counts[i];
    fields.push_back({.meaning = meanings[i],
                      .type = *ScalarTypeOfPcd(header.letters[i], header.sizes[i]),
                      .first = block.data() + (field_by_field ? offset * points : offset),
                      .stride = field_by_field ? size : header.record_size()});
    offset += size;
  }
  AddPoints(fields, points, false, builder);
}

absl::Status ReadBinary(const Header& header,
                        TextCursor& cursor,
                        absl::string_view bytes,
                        CloudBuilder& builder) {
  const std::size_t points = *header.points;
  const absl::string_view block = bytes.substr(cursor.position());
  if (points > 0 && header.record_size() > block.size() / points) {
    return TooShort(points, points * header.record_size(), cursor.position(), block.size());
  }
  AddBlock(header, block, false, builder);
  return absl::OkStatus();
}

absl::Status ReadCompressed(const Header& header,
                            TextCursor& cursor,
                            absl::string_view bytes,
                            CloudBuilder& builder) {
  const std::size_t at = cursor.position();
  const absl::string_view block = bytes.substr(at);
  if (block.size() < 8) return TooShort(*header.points, 8, at, block.size());
  const auto packed = static_cast<std::size_t>(ScalarAt(block.data(), ScalarType::kUint32, false));
  const auto unpacked =
      static_cast<std::size_t>(ScalarAt(block.data() + 4, ScalarType::kUint32, false));
  const bool fits = *header.points == 0 ? unpacked == 0
                                        : unpacked / *header.points == header.record_size() &&
                                              unpacked % *header.points == 0;
  if (!fits) {
    return absl::InvalidArgumentError(absl::StrCat("byte ",
                                                   at + 4,
                                                   ": ",
                                                   *header.points,
                                                   " points of ",
                                                   header.record_size(),
                                                   " bytes do not make ",
                                                   unpacked,
                                                   " bytes"));
  }
  if (packed > block.size() - 8) return TooShort(*header.points, packed, at + 8, block.size() - 8);
  STRATA_ASSIGN_OR_RETURN(const std::string plain,
                          DecompressLzf(block.substr(8, packed), unpacked));
  AddBlock(header, plain, true, builder);
  return absl::OkStatus();
}

absl::Status ReadAscii(const Header& header, TextCursor& cursor, CloudBuilder& builder) {
  const std::vector<Meaning> meanings = MeaningsOf(header);
  const std::size_t words_per_line = header.words_per_line();
  builder.Reserve(std::min(*header.points, cursor.remaining() / (2 * words_per_line) + 1));
  std::vector<double> values(meanings.size());
  std::size_t points = 0;
  while (points < *header.points) {
    const std::optional<absl::string_view> line = cursor.NextLine();
    if (!line.has_value()) {
      return cursor.Error(absl::StrCat("expected ", *header.points, " points, found ", points));
    }
    const std::vector<absl::string_view> words = SplitWords(*line);
    if (words.empty()) continue;
    if (words.size() != words_per_line) {
      return cursor.Error(
          absl::StrCat("expected ", words_per_line, " numbers, found ", words.size(), " words"));
    }
    for (std::size_t i = 0, word = 0; i < meanings.size(); word += header.counts[i], ++i) {
      if (meanings[i] == Meaning::kIgnored) continue;
      const std::optional<double> number = ParseNumber(words[word]);
      if (!number.has_value()) {
        return cursor.Error(absl::StrCat(
            "field ", header.names[i], " is no number: '", words[word].substr(0, 40), "'"));
      }
      values[i] =
          meanings[i] == Meaning::kPackedColour
              ? PackedColourOf(*number, *ScalarTypeOfPcd(header.letters[i], header.sizes[i]))
              : *number;
    }
    builder.Add(values.data());
    ++points;
  }
  return absl::OkStatus();
}

}  // namespace

absl::StatusOr<PointCloud> ReadPcd(absl::string_view bytes) {
  TextCursor cursor(bytes);
  STRATA_ASSIGN_OR_RETURN(const Header header, ReadHeader(cursor));
  STRATA_ASSIGN_OR_RETURN(CloudBuilder builder, CloudBuilder::Create(MeaningsOf(header)));
  if (header.height > 1) {
    builder.SetGrid(static_cast<std::uint32_t>(header.height),
                    static_cast<std::uint32_t>(header.width));
  }
  builder.SetSensorOrigin(header.viewpoint);
  if (header.data == "ascii") {
    STRATA_RETURN_IF_ERROR(ReadAscii(header, cursor, builder));
  } else if (header.data == "binary") {
    STRATA_RETURN_IF_ERROR(ReadBinary(header, cursor, bytes, builder));
  } else if (header.data == "binary_compressed") {
    STRATA_RETURN_IF_ERROR(ReadCompressed(header, cursor, bytes, builder));
  } else {
    return cursor.Error(absl::StrCat("DATA expects ascii, binary or binary_compressed, found '",
                                     absl::string_view(header.data).substr(0, 40),
                                     "'"));
  }
  return std::move(builder).Build();
}

bool HasPcdViewpoint(absl::string_view beginning) {
  TextCursor cursor(beginning);
  const absl::StatusOr<Header> header = ReadHeader(cursor);
  return header.ok() && !header->viewpoint.isZero(0.0);
}

}  // namespace strata
