#include "client/cli/terminal/output.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <ostream>
#include <string>
#include <vector>

#include "absl/strings/str_format.h"

namespace strata::cli {
namespace {

// At most six decimals (a micrometre) and at least one; what is smaller is zero.
std::string Decimal(double value) {
  constexpr double kMost = 1e15;
  if (!(std::abs(value) < kMost)) return absl::StrFormat("%g", value);
  std::string text = absl::StrFormat("%.6f", value);
  const std::size_t last = text.find_last_not_of('0');
  text.erase(std::max(last, text.find('.') + 1) + 1);
  return text == "-0.0" ? "0.0" : text;
}

std::string TextOf(const Json& value) {
  if (value.is_null()) return "-";
  if (value.is_string()) return value.get<std::string>();
  if (value.is_number_float()) return Decimal(value.get<double>());
  if (value.is_boolean()) return value.get<bool>() ? "yes" : "no";
  if (value.is_array()) {
    std::string text;
    for (const Json& element : value) {
      if (!text.empty()) text += value.front().is_object() ? "; " : ", ";
      text += TextOf(element);
    }
    return text.empty() ? "-" : text;
  }
  if (value.is_object()) {
    std::string text;
    for (const auto& [key, element] : value.items()) {
      text += (text.empty() ? "" : ", ") + key + " " + TextOf(element);
    }
    return text.empty() ? "-" : text;
  }
  return value.dump();
}

std::string Padded(const std::string& text, std::size_t width, bool right) {
  const std::string blank(width - std::min(width, text.size()), ' ');
  return right ? blank + text : text + blank;
}

std::string StripEnd(std::string line) {
  line.erase(line.find_last_not_of(' ') + 1);
  return line;
}

}  // namespace

void Output::Object(const Json& object) {
  if (json()) {
    data_ << object.dump(2) << std::endl;
    return;
  }
  std::size_t width = 0;
  for (const auto& item : object.items()) width = std::max(width, item.key().size());
  for (const auto& [key, value] : object.items()) {
    data_ << StripEnd(Padded(key, width + 2, false) + TextOf(value)) << '\n';
  }
  data_.flush();
}

void Output::List(const Json& rows, const std::vector<Column>& columns) {
  if (json()) {
    data_ << rows.dump(2) << std::endl;
    return;
  }
  std::vector<std::vector<std::string>> table(columns.size());
  std::vector<std::size_t> widths;
  std::vector<bool> right;  // numbers stand below each other
  for (std::size_t c = 0; c < columns.size(); ++c) {
    table[c].push_back(columns[c].title);
    for (const Json& row : rows) table[c].push_back(TextOf(row.value(columns[c].key, Json())));
    right.push_back(!rows.empty() && rows.front().value(columns[c].key, Json()).is_number());
    std::size_t width = 0;
    for (const std::string& cell : table[c]) width = std::max(width, cell.size());
    widths.push_back(width);
  }
  for (std::size_t r = 0; r <= rows.size(); ++r) {
    std::string line;
    for (std::size_t c = 0; c < columns.size(); ++c) {
      line += (c == 0 ? "" : "  ") + Padded(table[c][r], widths[c], right[c]);
    }
    data_ << StripEnd(line) << '\n';
  }
  data_.flush();
}

void Output::JsonLine(const Json& value) { data_ << value.dump() << std::endl; }

void Output::Text(const std::string& line) {
  if (!json()) data_ << line << std::endl;
}

void Output::Talk(const std::string& line) { talk_ << line << std::endl; }

}  // namespace strata::cli
