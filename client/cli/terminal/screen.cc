#include "client/cli/terminal/screen.h"

#include <algorithm>
#include <cstdlib>
#include <string>
#include <vector>

#include "absl/strings/ascii.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "absl/strings/str_split.h"
#include <sys/ioctl.h>
#include <unistd.h>

namespace strata::cli {
namespace {

constexpr std::size_t kUsualColumns = 80;  // of a terminal that does not say
constexpr std::size_t kUsualRows = 24;

bool Says(const char* variable) {
  const char* value = std::getenv(variable);
  return value != nullptr && *value != '\0';
}

bool IsDumb() {
  const char* kind = std::getenv("TERM");
  return kind == nullptr || absl::string_view(kind) == "dumb";
}

const char* CodeOf(Hue hue) {
  switch (hue) {
    case Hue::kGood:
      return "\x1b[32m";
    case Hue::kDoubtful:
      return "\x1b[33m";
    case Hue::kBad:
      return "\x1b[31m";
    case Hue::kTitle:
      return "\x1b[1m";
    case Hue::kPlain:
      break;
  }
  return "";
}

// Where a line of help explains: behind the last gap of two blanks or more that follows a word.
std::size_t IndentOf(absl::string_view line, std::size_t columns) {
  const std::size_t begin = std::min(line.find_first_not_of(' '), line.size());
  const std::size_t gap = line.find("  ", begin);
  if (gap == absl::string_view::npos) return begin;
  const std::size_t column = line.find_first_not_of(' ', gap);
  return column == absl::string_view::npos || column > columns / 2 ? begin : column;
}

std::string Blanks(std::size_t count) { return std::string(count, ' '); }

// Where `line` is to be broken to be no wider than `room`: at the last blank that leaves that much,
// else at the first; npos: nowhere.
std::size_t BreakOf(absl::string_view line, std::size_t room) {
  if (room == 0 || ShownWidth(line) <= room) return absl::string_view::npos;
  std::size_t cut = absl::string_view::npos;
  const std::size_t begin = std::min(line.find_first_not_of(' '), line.size());
  std::size_t width = begin;
  for (std::size_t i = begin; i < line.size(); ++i) {
    if (line[i] == ' ') {
      if (width > room && cut != absl::string_view::npos) break;
      cut = i;
    }
    width += ShownWidth(line.substr(i, 1));
  }
  // What ends with blanks has nothing to put on another line.
  return cut != absl::string_view::npos &&
                 line.find_first_not_of(' ', cut) == absl::string_view::npos
             ? absl::string_view::npos
             : cut;
}

}  // namespace

Screen ScreenOf(int fd, absl::string_view colour) {
  Screen screen;
  if (isatty(fd) == 1) {
    winsize size = {};
    const bool known = ioctl(fd, TIOCGWINSZ, &size) == 0;
    screen.columns = known && size.ws_col > 0 ? size.ws_col : kUsualColumns;
    screen.rows = known && size.ws_row > 0 ? size.ws_row : kUsualRows;
  }
  screen.colour = colour == "always" ||
                  (colour == "auto" && screen.terminal() && !Says("NO_COLOR") && !IsDumb());
  return screen;
}

std::string Painted(absl::string_view text, Hue hue, const Screen& screen) {
  if (!screen.colour || hue == Hue::kPlain || text.empty()) return std::string(text);
  return absl::StrCat(CodeOf(hue), text, "\x1b[0m");
}

std::size_t ShownWidth(absl::string_view text) {
  return static_cast<std::size_t>(std::count_if(text.begin(), text.end(), [](char byte) {
    return (static_cast<unsigned char>(byte) & 0xC0U) != 0x80U;  // no further byte of a letter
  }));
}

std::string Filled(absl::string_view text, std::size_t columns, std::size_t indent) {
  std::string filled;
  std::size_t room = columns;
  for (std::size_t cut = 0; (cut = BreakOf(text, room)) != absl::string_view::npos;) {
    absl::StrAppend(
        &filled, absl::StripTrailingAsciiWhitespace(text.substr(0, cut)), "\n", Blanks(indent));
    text = absl::StripLeadingAsciiWhitespace(text.substr(cut));
    room = columns - std::min(indent, columns - 1);
  }
  return absl::StrCat(filled, text);
}

std::string FilledHelp(absl::string_view text, std::size_t columns) {
  if (columns == 0) return std::string(text);
  std::vector<std::string> lines;
  for (const absl::string_view line : absl::StrSplit(text, '\n')) {
    lines.push_back(Filled(line, columns, IndentOf(line, columns)));
  }
  return absl::StrJoin(lines, "\n");
}

}  // namespace strata::cli
