// Text files line by line, number by number, with the line at hand for error messages.
#ifndef STRATA_CLIENT_FORMATS_PARSING_TEXT_CURSOR_H_
#define STRATA_CLIENT_FORMATS_PARSING_TEXT_CURSOR_H_

#include <cstddef>
#include <optional>
#include <vector>

#include "absl/status/status.h"
#include "absl/strings/string_view.h"

namespace strata {

// A number as text files write it (sign, decimals, exponent, nan, inf); nullopt for anything else.
// Not dependent on the locale.
std::optional<double> ParseNumber(absl::string_view token);
// A whole number ≥ 0.
std::optional<std::size_t> ParseCount(absl::string_view token);

// The words of a line; blanks, tabs and, if asked for, commas and semicolons separate.
std::vector<absl::string_view> SplitWords(absl::string_view line, bool commas = false);

// Walks through text that must outlive it.
class TextCursor {
 public:
  explicit TextCursor(absl::string_view text) : text_(text) {}

  // The next line without its end (\n or \r\n); nullopt at the end of the text.
  std::optional<absl::string_view> NextLine();
  // The next word, across lines; empty at the end.
  absl::string_view NextWord();

  std::size_t line_number() const { return line_; }   // of what was read last, from 1
  std::size_t position() const { return position_; }  // bytes read
  std::size_t remaining() const { return text_.size() - position_; }

  // INVALID_ARGUMENT "line 12: …".
  absl::Status Error(absl::string_view what) const;

 private:
  absl::string_view text_;
  std::size_t position_ = 0;
  std::size_t line_ = 0;
  bool in_line_ = false;  // NextWord stopped within a line
};

}  // namespace strata

#endif  // STRATA_CLIENT_FORMATS_PARSING_TEXT_CURSOR_H_
