// The terminal that output goes to, if it is one: how wide, how high, in colour or not.
#ifndef STRATA_CLIENT_CLI_TERMINAL_SCREEN_H_
#define STRATA_CLIENT_CLI_TERMINAL_SCREEN_H_

#include <cstddef>
#include <cstdint>
#include <string>

#include "absl/strings/string_view.h"

namespace strata::cli {

// The default is a file or a pipe: as wide and as long as it takes, without colour.
struct Screen {
  std::size_t columns = 0;  // 0: no terminal
  std::size_t rows = 0;     // 0: no terminal
  bool colour = false;

  bool terminal() const { return columns > 0; }
};

// Of the file descriptor `fd`. `colour` is auto, always or never; auto: on a terminal that is not
// dumb, unless the environment's NO_COLOR says something (no-color.org).
Screen ScreenOf(int fd, absl::string_view colour);

enum class Hue : std::uint8_t { kPlain, kGood, kDoubtful, kBad, kTitle };

// `text` in its colour on `screen`; as it is where there are none.
std::string Painted(absl::string_view text, Hue hue, const Screen& screen);

// Characters that `text` takes on a screen, for scripts whose letters are one wide.
std::size_t ShownWidth(absl::string_view text);

// `text` with its lines broken at blanks to be at most `columns` wide (0: as it is), what goes on
// standing `indent` to the right; words stay whole.
std::string Filled(absl::string_view text, std::size_t columns, std::size_t indent);

// The same for the lines of a help text: what goes on stands below the line's last column.
std::string FilledHelp(absl::string_view text, std::size_t columns);

}  // namespace strata::cli

#endif  // STRATA_CLIENT_CLI_TERMINAL_SCREEN_H_
