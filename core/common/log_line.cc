#include "core/common/log_line.h"

#include <algorithm>

#include "absl/strings/ascii.h"
#include "absl/strings/escaping.h"
#include "absl/strings/str_cat.h"

namespace strata {
namespace {

bool Plain(absl::string_view value) {
  return !value.empty() && std::all_of(value.begin(), value.end(), [](unsigned char c) {
    return absl::ascii_isgraph(c) && c != '"' && c != '=' && c != '\\';
  });
}

}  // namespace

LogLine& LogLine::Add(absl::string_view key, absl::string_view value) {
  if (!text_.empty()) text_ += ' ';
  absl::StrAppend(&text_, key, "=");
  if (Plain(value)) {
    absl::StrAppend(&text_, value);
  } else {
    absl::StrAppend(&text_, "\"", absl::CHexEscape(value), "\"");
  }
  return *this;
}

}  // namespace strata
