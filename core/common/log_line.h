// One line of the log: key=value pairs that people and programs read.
#ifndef STRATA_CORE_COMMON_LOG_LINE_H_
#define STRATA_CORE_COMMON_LOG_LINE_H_

#include <ostream>
#include <string>
#include <type_traits>

#include "absl/strings/str_cat.h"
#include "absl/strings/string_view.h"

namespace strata {

//   LOG(INFO) << LogLine("shutdown").Add("signal", signal);
// writes: event=shutdown signal=15
class LogLine {
 public:
  // `event`: a word for what happened.
  explicit LogLine(absl::string_view event) { Add("event", event); }

  // `key`: a word. A value that is empty or holds anything but printable characters without space,
  // quote and '=' is quoted, with \" \\ \n and \xNN inside: a line stays one line, whatever a
  // client sent.
  LogLine& Add(absl::string_view key, absl::string_view value);
  template <typename Number, typename = std::enable_if_t<std::is_arithmetic_v<Number>>>
  LogLine& Add(absl::string_view key, Number value) {
    return Add(key, absl::string_view(absl::StrCat(value)));
  }

  const std::string& text() const { return text_; }

 private:
  std::string text_;
};

inline std::ostream& operator<<(std::ostream& out, const LogLine& line) {
  return out << line.text();
}

}  // namespace strata

#endif  // STRATA_CORE_COMMON_LOG_LINE_H_
