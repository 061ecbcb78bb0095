#include "client/formats/survey/e57_node.h"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/ascii.h"
#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/string_view.h"
#include <expat.h>

#include "client/formats/parsing/text_cursor.h"

namespace strata {
namespace {

constexpr std::size_t kDeepest = 64;
constexpr std::size_t kXmlBytesAtATime = std::size_t{1} << 20;

// Builds the tree as expat finds the parts of it.
class E57TreeBuilder {
 public:
  E57TreeBuilder() : parser_(XML_ParserCreate(nullptr), &XML_ParserFree) {
    XML_SetUserData(parser_.get(), this);
    XML_SetElementHandler(parser_.get(), &Begin, &End);
    XML_SetCharacterDataHandler(parser_.get(), &Text);
    XML_SetStartDoctypeDeclHandler(parser_.get(), &Doctype);
  }

  absl::StatusOr<E57Node> Parse(absl::string_view xml) {
    for (std::size_t at = 0; at < xml.size(); at += kXmlBytesAtATime) {
      const absl::string_view piece = xml.substr(at, kXmlBytesAtATime);
      const bool last = at + piece.size() == xml.size();
      if (XML_Parse(parser_.get(), piece.data(), static_cast<int>(piece.size()), last) ==
          XML_STATUS_ERROR) {
        return absl::InvalidArgumentError(absl::StrCat(
            "line ",
            XML_GetCurrentLineNumber(parser_.get()),
            " of the XML: ",
            refused_.empty() ? absl::string_view(XML_ErrorString(XML_GetErrorCode(parser_.get())))
                             : absl::string_view(refused_)));
      }
    }
    if (!root_.has_value()) return absl::InvalidArgumentError("the XML is empty");
    return *std::move(root_);
  }

 private:
  static void XMLCALL Begin(void* self, const XML_Char* name, const XML_Char** attributes) {
    auto& builder = *static_cast<E57TreeBuilder*>(self);
    if (builder.open_.size() == kDeepest) {
      return builder.Refuse(absl::StrCat("nested deeper than ", kDeepest));
    }
    E57Node& node = builder.open_.emplace_back();
    node.name = name;
    for (; *attributes != nullptr; attributes += 2) {
      node.attributes.emplace_back(attributes[0], attributes[1]);
    }
  }

  static void XMLCALL End(void* self, const XML_Char* /*name*/) {
    auto& builder = *static_cast<E57TreeBuilder*>(self);
    if (builder.open_.empty()) return;
    E57Node node = std::move(builder.open_.back());
    builder.open_.pop_back();
    if (builder.open_.empty()) {
      builder.root_ = std::move(node);
    } else {
      builder.open_.back().children.push_back(std::move(node));
    }
  }

  static void XMLCALL Text(void* self, const XML_Char* text, int length) {
    auto& builder = *static_cast<E57TreeBuilder*>(self);
    if (!builder.open_.empty()) {
      builder.open_.back().text.append(text, static_cast<std::size_t>(length));
    }
  }

  // Entities could make much of little.
  static void XMLCALL
  Doctype(void* self, const XML_Char* /*name*/, const XML_Char*, const XML_Char*, int) {
    static_cast<E57TreeBuilder*>(self)->Refuse("a document type, which E57 does not have");
  }

  void Refuse(std::string why) {
    refused_ = std::move(why);
    XML_StopParser(parser_.get(), XML_FALSE);
  }

  const std::unique_ptr<XML_ParserStruct, decltype(&XML_ParserFree)> parser_;
  std::vector<E57Node> open_;
  std::optional<E57Node> root_;
  std::string refused_;
};

absl::Status NoNumber(const E57Node& node, absl::string_view where, absl::string_view text) {
  return absl::InvalidArgumentError(absl::StrCat(
      "'", node.name.substr(0, 40), "'", where, " is no number: '", text.substr(0, 40), "'"));
}

}  // namespace

const E57Node* E57Node::Child(absl::string_view child_name) const {
  const auto found = std::find_if(children.begin(), children.end(), [&](const E57Node& child) {
    return child.name == child_name;
  });
  return found == children.end() ? nullptr : &*found;
}

const std::string* E57Node::Attribute(absl::string_view attribute_name) const {
  const auto found = std::find_if(attributes.begin(), attributes.end(), [&](const auto& named) {
    return named.first == attribute_name;
  });
  return found == attributes.end() ? nullptr : &found->second;
}

absl::string_view E57Node::type() const {
  const std::string* const said = Attribute("type");
  return said == nullptr ? absl::string_view() : absl::string_view(*said);
}

absl::StatusOr<double> E57Node::Number() const {
  const absl::string_view trimmed = absl::StripAsciiWhitespace(text);
  if (trimmed.empty()) return 0.0;
  const std::optional<double> number = ParseNumber(trimmed);
  if (!number.has_value()) return NoNumber(*this, "", trimmed);
  return *number;
}

absl::StatusOr<double> E57Node::NumberOf(absl::string_view child_name, double otherwise) const {
  const E57Node* const child = Child(child_name);
  return child == nullptr ? absl::StatusOr<double>(otherwise) : child->Number();
}

absl::StatusOr<double> E57Node::NumberAttribute(absl::string_view attribute_name,
                                                double otherwise) const {
  const std::string* const said = Attribute(attribute_name);
  if (said == nullptr) return otherwise;
  const std::optional<double> number = ParseNumber(absl::StripAsciiWhitespace(*said));
  if (!number.has_value()) return NoNumber(*this, absl::StrCat(": ", attribute_name), *said);
  return *number;
}

absl::StatusOr<std::int64_t> E57Node::WholeAttribute(absl::string_view attribute_name,
                                                     std::int64_t otherwise) const {
  const std::string* const said = Attribute(attribute_name);
  if (said == nullptr) return otherwise;
  std::int64_t number = 0;
  if (!absl::SimpleAtoi(*said, &number)) {
    return NoNumber(*this, absl::StrCat(": ", attribute_name), *said);
  }
  return number;
}

absl::StatusOr<E57Node> ParseE57Xml(absl::string_view xml) { return E57TreeBuilder().Parse(xml); }

}  // namespace strata
