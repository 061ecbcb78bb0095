#include "client/formats/vtk_reader.h"

#include <cstddef>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/ascii.h"
#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/string_view.h"

#include "client/formats/parsing/cloud_builder.h"
#include "client/formats/parsing/point_fields.h"
#include "client/formats/parsing/scalar.h"
#include "client/formats/parsing/text_cursor.h"
#include "core/common/status.h"

namespace strata {
namespace {

const std::vector<Meaning>& Coordinates() {
  static const std::vector<Meaning> meanings = {Meaning::kX, Meaning::kY, Meaning::kZ};
  return meanings;
}

struct PointsSection {
  std::size_t count = 0;
  ScalarType type = ScalarType::kFloat32;
};

// Goes on to the line after "POINTS n type".
absl::StatusOr<PointsSection> FindPoints(TextCursor& cursor) {
  while (const std::optional<absl::string_view> line = cursor.NextLine()) {
    const std::vector<absl::string_view> words = SplitWords(*line);
    if (words.empty() || !absl::EqualsIgnoreCase(words[0], "POINTS")) continue;
    const auto count = words.size() == 3 ? ParseCount(words[1]) : std::nullopt;
    const auto type =
        words.size() == 3 ? ScalarTypeOfName(absl::AsciiStrToLower(words[2])) : std::nullopt;
    if (!count.has_value() || !type.has_value()) return cursor.Error("expected 'POINTS N TYPE'");
    return PointsSection{*count, *type};
  }
  return cursor.Error("expected a section POINTS, found the end of the file");
}

absl::Status ReadAscii(const PointsSection& section, TextCursor& cursor, CloudBuilder& builder) {
  builder.Reserve(section.count);
  for (std::size_t i = 0; i < section.count; ++i) {
    double values[3];
    for (double& value : values) {
      const absl::string_view word = cursor.NextWord();
      const std::optional<double> number = ParseNumber(word);
      if (!number.has_value()) {
        return cursor.Error(absl::StrCat(
            "expected ", section.count, " points, found '", word.substr(0, 40), "' in point ", i));
      }
      value = *number;
    }
    builder.Add(values);
  }
  return absl::OkStatus();
}

void ReadBinary(const PointsSection& section, const char* first, CloudBuilder& builder) {
  std::vector<PointField> fields;
  const std::size_t size = SizeOf(section.type);
  for (std::size_t k = 0; k < 3; ++k) {
    fields.push_back({Coordinates()[k], section.type, first + k * size, 3 * size});
  }
  AddPoints(fields, section.count, true, builder);
}

}  // namespace

absl::StatusOr<PointCloud> ReadVtk(absl::string_view bytes) {
  TextCursor cursor(bytes);
  if (!absl::StartsWithIgnoreCase(cursor.NextLine().value_or(""), "# vtk DataFile Version")) {
    return cursor.Error("expected '# vtk DataFile Version'");
  }
  cursor.NextLine();  // a title
  const std::string encoding =
      absl::AsciiStrToUpper(absl::StripAsciiWhitespace(cursor.NextLine().value_or("")));
  const bool ascii = encoding == "ASCII";
  if (!ascii && encoding != "BINARY") return cursor.Error("expected ASCII or BINARY");
  STRATA_ASSIGN_OR_RETURN(const PointsSection section, FindPoints(cursor));
  const std::size_t point_size = ascii ? 6 : 3 * SizeOf(section.type);
  if (section.count > (cursor.remaining() + 1) / point_size) {
    return cursor.Error(absl::StrCat(
        section.count, " points do not fit the ", cursor.remaining(), " bytes that follow"));
  }
  STRATA_ASSIGN_OR_RETURN(CloudBuilder builder, CloudBuilder::Create(Coordinates()));
  if (ascii) {
    STRATA_RETURN_IF_ERROR(ReadAscii(section, cursor, builder));
  } else {
    ReadBinary(section, bytes.data() + cursor.position(), builder);
  }
  return std::move(builder).Build();
}

}  // namespace strata
