#include "client/formats/ply_reader.h"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/string_view.h"

#include "client/formats/parsing/cloud_builder.h"
#include "client/formats/parsing/point_fields.h"
#include "client/formats/parsing/scalar.h"
#include "client/formats/parsing/text_cursor.h"
#include "core/common/status.h"

namespace strata {
namespace {

struct Property {
  std::string name;
  ScalarType type = ScalarType::kFloat32;
  std::optional<ScalarType> list_count_type;  // a list
};

struct Element {
  std::string name;
  std::size_t count = 0;
  std::vector<Property> properties;
};

struct Header {
  std::string format;
  std::vector<Element> elements;
};

absl::StatusOr<Property> ParseProperty(const TextCursor& cursor,
                                       const std::vector<absl::string_view>& words) {
  const bool is_list = words.size() == 5 && words[1] == "list";
  if (!is_list && words.size() != 3) return cursor.Error("expected 'property TYPE NAME'");
  const auto type = ScalarTypeOfName(words[words.size() - 2]);
  const auto count_type = is_list ? ScalarTypeOfName(words[2]) : type;
  if (!type.has_value() || !count_type.has_value()) {
    return cursor.Error(absl::StrCat("unknown type of property ", words.back().substr(0, 40)));
  }
  Property property{.name = std::string(words.back()), .type = *type, .list_count_type = {}};
  if (is_list) property.list_count_type = *count_type;
  return property;
}

absl::Status ReadEntry(const TextCursor& cursor,
                       const std::vector<absl::string_view>& words,
                       Header& header) {
  if (words[0] == "format") {
    header.format = words.size() == 3 ? std::string(words[1]) : std::string();
  } else if (words[0] == "element") {
    const auto count = words.size() == 3 ? ParseCount(words[2]) : std::nullopt;
    if (!count.has_value()) return cursor.Error("expected 'element NAME COUNT'");
    header.elements.push_back({std::string(words[1]), *count, {}});
  } else if (words[0] == "property") {
    if (header.elements.empty()) return cursor.Error("property before any element");
    STRATA_ASSIGN_OR_RETURN(Property property, ParseProperty(cursor, words));
    header.elements.back().properties.push_back(std::move(property));
  } else if (words[0] != "comment" && words[0] != "obj_info") {
    return cursor.Error(
        absl::StrCat("expected a PLY header entry, found '", words[0].substr(0, 40), "'"));
  }
  return absl::OkStatus();
}

absl::StatusOr<Header> ReadHeader(TextCursor& cursor) {
  if (cursor.NextLine().value_or("") != "ply") return cursor.Error("expected 'ply'");
  Header header;
  while (true) {
    const std::optional<absl::string_view> line = cursor.NextLine();
    if (!line.has_value()) return cursor.Error("expected end_header, found the end of the file");
    const std::vector<absl::string_view> words = SplitWords(*line);
    if (words.empty()) continue;
    if (words[0] == "end_header") return header;
    STRATA_RETURN_IF_ERROR(ReadEntry(cursor, words, header));
  }
}

std::vector<bool> PackedColours(const Element& element) {
  std::vector<bool> colours;
  for (const Property& property : element.properties) {
    colours.push_back(MeaningOf(property.name) == Meaning::kPackedColour);
  }
  return colours;
}

// Walks over elements value by value: `Source` yields numbers, ascii or binary.
template <typename Source>
absl::Status WalkElement(const Element& element, Source& source, CloudBuilder* builder) {
  if (element.properties.empty()) return absl::OkStatus();
  std::vector<double> values(element.properties.size());
  const std::vector<bool> colours = PackedColours(element);
  for (std::size_t i = 0; i < element.count; ++i) {
    for (std::size_t k = 0; k < values.size(); ++k) {
      const Property& property = element.properties[k];
      if (!property.list_count_type.has_value()) {
        STRATA_ASSIGN_OR_RETURN(
            values[k], colours[k] ? source.NextColour(property.type) : source.Next(property.type));
        continue;
      }
      STRATA_ASSIGN_OR_RETURN(const double length, source.Next(*property.list_count_type));
      if (!(length >= 0.0 && length < 1e9)) return source.Error("absurd length of a list");
      for (double n = 0.0; n < length; ++n) {
        STRATA_RETURN_IF_ERROR(source.Next(property.type).status());
      }
    }
    if (builder != nullptr) builder->Add(values.data());
  }
  return absl::OkStatus();
}

class AsciiSource {
 public:
  explicit AsciiSource(TextCursor& cursor) : cursor_(cursor) {}
  absl::StatusOr<double> Next(ScalarType /*type*/) {
    const absl::string_view word = cursor_.NextWord();
    const std::optional<double> number = ParseNumber(word);
    if (number.has_value()) return *number;
    if (word.empty()) return Error("expected a number, found the end of the file");
    return Error(absl::StrCat("expected a number, found '", word.substr(0, 40), "'"));
  }
  absl::StatusOr<double> NextColour(ScalarType type) {
    STRATA_ASSIGN_OR_RETURN(const double value, Next(type));
    return PackedColourOf(value, type);
  }
  absl::Status Error(absl::string_view what) const { return cursor_.Error(what); }

 private:
  TextCursor& cursor_;
};

class BinarySource {
 public:
  BinarySource(absl::string_view bytes, std::size_t position, bool big_endian)
      : bytes_(bytes), position_(position), big_endian_(big_endian) {}
  absl::StatusOr<double> Next(ScalarType type) {
    const std::size_t size = SizeOf(type);
    if (size > bytes_.size() - position_) {
      return Error("expected more elements, found the end of the file");
    }
    position_ += size;
    return ScalarAt(bytes_.data() + position_ - size, type, big_endian_);
  }
  absl::StatusOr<double> NextColour(ScalarType type) {
    const ScalarType bits = BitsOfColour(type);
    STRATA_ASSIGN_OR_RETURN(const double value, Next(bits));
    return PackedColourOf(value, bits);
  }
  absl::Status Error(absl::string_view what) const {
    return absl::InvalidArgumentError(absl::StrCat("byte ", position_, ": ", what));
  }
  absl::string_view rest() const { return bytes_.substr(position_); }
  bool big_endian() const { return big_endian_; }

 private:
  absl::string_view bytes_;
  std::size_t position_;
  bool big_endian_;
};

// Walks over what comes before the vertices.
template <typename Source>
absl::Status SkipToVertices(const Header& header, Source& source) {
  for (const Element& element : header.elements) {
    if (element.name == "vertex") break;
    STRATA_RETURN_IF_ERROR(WalkElement(element, source, nullptr));
  }
  return absl::OkStatus();
}

template <typename Source>
absl::Status WalkVertices(const Element& vertex, Source& source, CloudBuilder& builder) {
  builder.Reserve(vertex.count);
  return WalkElement(vertex, source, &builder);
}

// The fields of elements that follow each other from `first` on; none if they have lists.
std::vector<PointField> FieldsOf(const Element& element, const char* first) {
  std::vector<PointField> fields;
  std::size_t size = 0;
  for (const Property& property : element.properties) {
    if (property.list_count_type.has_value()) return {};
    fields.push_back({MeaningOf(property.name), property.type, first + size});
    size += SizeOf(property.type);
  }
  for (PointField& field : fields) field.stride = size;
  return fields;
}

absl::Status ReadBinary(const Header& header,
                        const Element& vertex,
                        BinarySource source,
                        CloudBuilder& builder) {
  STRATA_RETURN_IF_ERROR(SkipToVertices(header, source));
  const absl::string_view rest = source.rest();
  const std::vector<PointField> fields = FieldsOf(vertex, rest.data());
  // Where there are too few bytes, the walk says where they end.
  if (fields.empty() || vertex.count > rest.size() / fields.front().stride) {
    return WalkVertices(vertex, source, builder);
  }
  AddPoints(fields, vertex.count, source.big_endian(), builder);
  return absl::OkStatus();
}

absl::Status ReadAscii(const Header& header,
                       const Element& vertex,
                       AsciiSource source,
                       CloudBuilder& builder) {
  STRATA_RETURN_IF_ERROR(SkipToVertices(header, source));
  return WalkVertices(vertex, source, builder);
}

// Bytes that one vertex takes at least.
std::size_t LeastSize(const Element& element, bool ascii) {
  std::size_t size = 0;
  for (const Property& property : element.properties) {
    size += ascii ? 2 : SizeOf(property.list_count_type.value_or(property.type));
  }
  return std::max<std::size_t>(size, 1);
}

}  // namespace

absl::StatusOr<PointCloud> ReadPly(absl::string_view bytes) {
  TextCursor cursor(bytes);
  STRATA_ASSIGN_OR_RETURN(const Header header, ReadHeader(cursor));
  const bool ascii = header.format == "ascii";
  const bool big_endian = header.format == "binary_big_endian";
  if (!ascii && !big_endian && header.format != "binary_little_endian") {
    return cursor.Error("format is none of ascii, binary_little_endian, binary_big_endian");
  }
  const auto vertex = std::find_if(header.elements.begin(),
                                   header.elements.end(),
                                   [](const auto& e) { return e.name == "vertex"; });
  if (vertex == header.elements.end()) return cursor.Error("no element vertex");
  if (vertex->count > (cursor.remaining() + 1) / LeastSize(*vertex, ascii)) {
    return cursor.Error(absl::StrCat(
        vertex->count, " vertices do not fit the ", cursor.remaining(), " bytes that follow"));
  }
  std::vector<Meaning> meanings;
  for (const Property& property : vertex->properties) {
    meanings.push_back(property.list_count_type.has_value() ? Meaning::kIgnored
                                                            : MeaningOf(property.name));
  }
  STRATA_ASSIGN_OR_RETURN(CloudBuilder builder, CloudBuilder::Create(std::move(meanings)));
  STRATA_RETURN_IF_ERROR(
      ascii ? ReadAscii(header, *vertex, AsciiSource(cursor), builder)
            : ReadBinary(
                  header, *vertex, BinarySource(bytes, cursor.position(), big_endian), builder));
  return std::move(builder).Build();
}

}  // namespace strata
