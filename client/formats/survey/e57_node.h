// The XML of an E57 file as a tree (ASTM E2807-11, 8.4).
#ifndef STRATA_CLIENT_FORMATS_SURVEY_E57_NODE_H_
#define STRATA_CLIENT_FORMATS_SURVEY_E57_NODE_H_

#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"

namespace strata {

struct E57Node {
  std::string name;  // with its namespace's prefix, if any
  std::vector<std::pair<std::string, std::string>> attributes;
  std::string text;  // of its own
  std::vector<E57Node> children;

  // Null if there is none of that name.
  const E57Node* Child(absl::string_view child_name) const;
  const std::string* Attribute(absl::string_view attribute_name) const;
  absl::string_view type() const;  // "Structure", "Float", …

  // The number that is its text, 0 for none. INVALID_ARGUMENT naming the node.
  absl::StatusOr<double> Number() const;
  // That of a child; `otherwise` without such a child.
  absl::StatusOr<double> NumberOf(absl::string_view child_name, double otherwise) const;
  // As an attribute has it; `otherwise` without it. INVALID_ARGUMENT naming both.
  absl::StatusOr<double> NumberAttribute(absl::string_view attribute_name, double otherwise) const;
  absl::StatusOr<std::int64_t> WholeAttribute(absl::string_view attribute_name,
                                              std::int64_t otherwise) const;
};

// The root. INVALID_ARGUMENT with the line, also for a document type and for what is nested deeper
// than 64.
absl::StatusOr<E57Node> ParseE57Xml(absl::string_view xml);

}  // namespace strata

#endif  // STRATA_CLIENT_FORMATS_SURVEY_E57_NODE_H_
