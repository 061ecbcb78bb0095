#include "client/cli/terminal/values.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "absl/strings/str_replace.h"

namespace strata::cli {
namespace {

constexpr double kMost = 1e15;  // larger ones are not exact to the unit

// At most six decimals (a micrometre) and at least one; what is smaller is zero.
std::string Decimal(double value) {
  if (!(std::abs(value) < kMost)) return absl::StrFormat("%g", value);
  std::string text = absl::StrFormat("%.6f", value);
  const std::size_t last = text.find_last_not_of('0');
  text.erase(std::max(last, text.find('.') + 1) + 1);
  return text == "-0.0" ? "0.0" : text;
}

std::string ListText(const Json& value) {
  std::string text;
  for (const Json& element : value) {
    if (!text.empty()) text += value.front().is_object() ? "; " : ", ";
    text += TextOf(element);
  }
  return text.empty() ? "-" : text;
}

std::string ObjectText(const Json& value) {
  std::string text;
  for (const auto& [key, element] : value.items()) {
    text += (text.empty() ? "" : ", ") + key + " " + TextOf(element);
  }
  return text.empty() ? "-" : text;
}

// Sums leave -24.150000000000002 of what was -24.15.
double Rounded(double value) {
  constexpr double kNano = 1e9;
  if (std::round(value * kNano) / kNano == value) return value;  // most are, and this is cheap
  double rounded = value;
  const bool read = absl::SimpleAtod(absl::StrFormat("%.15g", value), &rounded);
  return read ? rounded : value;
}

void Shorten(Json& value) {
  if (value.is_structured()) {
    for (Json& element : value) Shorten(element);
  } else if (value.is_number_float()) {
    const double number = value.get<double>();
    if (!std::isfinite(number)) return;
    if (number == std::trunc(number) && std::abs(number) < kMost) {
      value = static_cast<std::int64_t>(number);
    } else {
      value = Rounded(number);
    }
  }
}

void AddLeaves(const std::string& name,
               const Json& value,
               std::vector<std::pair<std::string, Json>>& leaves) {
  if (!value.is_object()) {
    leaves.emplace_back(name, value);
    return;
  }
  for (const auto& [key, element] : value.items()) {
    AddLeaves(name.empty() ? key : absl::StrCat(name, ".", key), element, leaves);
  }
}

}  // namespace

std::string TextOf(const Json& value) {
  if (value.is_null()) return "-";
  if (value.is_string()) return value.get<std::string>();
  if (value.is_number_float()) return Decimal(value.get<double>());
  if (value.is_boolean()) return value.get<bool>() ? "yes" : "no";
  if (value.is_array()) return ListText(value);
  if (value.is_object()) return ObjectText(value);
  return value.dump();
}

Json Shortest(Json value) {
  Shorten(value);
  return value;
}

std::vector<std::pair<std::string, Json>> LeavesOf(const Json& row) {
  std::vector<std::pair<std::string, Json>> leaves;
  AddLeaves("", row, leaves);
  return leaves;
}

std::string CsvCell(const Json& value) {
  if (value.is_null()) return "";
  const std::string text = value.is_string() ? value.get<std::string>() : Shortest(value).dump();
  if (text.find_first_of(",\"\r\n") == std::string::npos) return text;
  return absl::StrCat("\"", absl::StrReplaceAll(text, {{"\"", "\"\""}}), "\"");
}

}  // namespace strata::cli
