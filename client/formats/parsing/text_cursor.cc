#include "client/formats/parsing/text_cursor.h"

#include <charconv>
#include <cstddef>
#include <optional>
#include <system_error>
#include <vector>

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/string_view.h"

namespace strata {
namespace {

bool IsBlank(char c) { return c == ' ' || c == '\t' || c == '\r' || c == '\v' || c == '\f'; }

template <typename T>
std::optional<T> Parse(absl::string_view token) {
  T value{};
  const char* const end = token.data() + token.size();
  const auto [stop, error] = std::from_chars(token.data(), end, value);
  if (error != std::errc() || stop != end) return std::nullopt;
  return value;
}

}  // namespace

std::optional<double> ParseNumber(absl::string_view token) {
  if (token.size() > 1 && token[0] == '+' && token[1] != '-') token.remove_prefix(1);
  return Parse<double>(token);
}

std::optional<std::size_t> ParseCount(absl::string_view token) { return Parse<std::size_t>(token); }

std::vector<absl::string_view> SplitWords(absl::string_view line, bool commas) {
  const auto separates = [commas](char c) {
    return IsBlank(c) || (commas && (c == ',' || c == ';'));
  };
  std::vector<absl::string_view> words;
  for (std::size_t i = 0; i < line.size();) {
    if (separates(line[i])) {
      ++i;
      continue;
    }
    std::size_t end = i;
    while (end < line.size() && !separates(line[end])) ++end;
    words.push_back(line.substr(i, end - i));
    i = end;
  }
  return words;
}

std::optional<absl::string_view> TextCursor::NextLine() {
  if (position_ == text_.size()) return std::nullopt;
  const std::size_t end = text_.find('\n', position_);
  absl::string_view line =
      text_.substr(position_, end == absl::string_view::npos ? end : end - position_);
  position_ += line.size() + (end == absl::string_view::npos ? 0 : 1);
  if (!line.empty() && line.back() == '\r') line.remove_suffix(1);
  if (!in_line_) ++line_;
  in_line_ = false;
  return line;
}

absl::string_view TextCursor::NextWord() {
  while (position_ < text_.size() && (IsBlank(text_[position_]) || text_[position_] == '\n')) {
    if (!in_line_) ++line_;
    in_line_ = text_[position_] != '\n';
    ++position_;
  }
  if (position_ == text_.size()) return {};
  if (!in_line_) ++line_;
  in_line_ = true;
  const std::size_t begin = position_;
  while (position_ < text_.size() && !IsBlank(text_[position_]) && text_[position_] != '\n') {
    ++position_;
  }
  return text_.substr(begin, position_ - begin);
}

absl::Status TextCursor::Error(absl::string_view what) const {
  return absl::InvalidArgumentError(absl::StrCat("line ", line_, ": ", what));
}

}  // namespace strata
