#include "client/cli/terminal/output.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <ostream>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "absl/strings/str_join.h"
#include "absl/strings/str_split.h"
#include "absl/strings/string_view.h"

namespace strata::cli {
namespace {

constexpr std::size_t kFewestRows = 10;     // of a table on a low terminal
constexpr std::size_t kNarrowestCell = 20;  // of one whose text goes on in further lines
constexpr std::size_t kIndent = 4;          // of one that has lines of its own

std::string Padded(const std::string& text, std::size_t width, bool right) {
  const std::string blank(width - std::min(width, ShownWidth(text)), ' ');
  return right ? blank + text : text + blank;
}

std::string StripEnd(std::string line) {
  line.erase(line.find_last_not_of(' ') + 1);
  return line;
}

// How good it is what a verdict says; other values have no colour.
Hue HueOf(const std::string& key, const std::string& text) {
  constexpr std::array<absl::string_view, 4> kVerdicts = {"state", "found", "valid", "aligned"};
  constexpr std::array<absl::string_view, 3> kGood = {"integrated", "succeeded", "yes"};
  constexpr std::array<absl::string_view, 2> kBad = {"failed", "no"};
  constexpr std::array<absl::string_view, 5> kDoubtful = {
      "cancelled", "pending", "proposed", "queued", "running"};
  const auto in = [](const auto& words, const std::string& word) {
    return std::find(words.begin(), words.end(), word) != words.end();
  };
  if (!in(kVerdicts, key)) return Hue::kPlain;
  if (in(kGood, text)) return Hue::kGood;
  if (in(kBad, text)) return Hue::kBad;
  return in(kDoubtful, text) ? Hue::kDoubtful : Hue::kPlain;
}

// Lines of no more than `columns`, all but the first behind `indent` blanks.
std::string Block(const std::string& text, std::size_t columns, std::size_t indent) {
  return absl::StrJoin(absl::StrSplit(Filled(text, columns - indent, 0), '\n'),
                       "\n" + std::string(indent, ' '));
}

// To a tenth of a degree, and small ones to three digits.
std::string DegreesOf(double angle_rad) {
  const double degrees = angle_rad * 180.0 / std::numbers::pi;
  return std::abs(degrees) < 10.0 ? absl::StrFormat("%.3g°", degrees)
                                  : absl::StrFormat("%.1f°", degrees);
}

std::string CellOf(const std::string& key, const Json& value) {
  const bool is_angle = absl::EndsWith(key, "_rad") && value.is_number();
  return is_angle ? DegreesOf(value.get<double>()) : TextOf(value);
}

// A table of text: cells, widths, and what stands right.
struct Table {
  std::vector<std::string> keys;
  std::vector<std::vector<std::string>> lines;  // of cells; the first has the titles
  std::vector<std::size_t> widths;
  std::vector<bool> right;  // numbers stand below each other
};

Table TableOf(const Json& rows, const std::vector<Column>& columns, std::size_t shown) {
  Table table;
  table.lines.resize(shown + 1);
  for (const Column& column : columns) {
    table.keys.push_back(column.key);
    table.lines[0].push_back(column.title);
    std::size_t width = ShownWidth(column.title);
    for (std::size_t r = 0; r < shown; ++r) {
      table.lines[r + 1].push_back(CellOf(column.key, rows[r].value(column.key, Json())));
      width = std::max(width, ShownWidth(table.lines[r + 1].back()));
    }
    table.widths.push_back(width);
    table.right.push_back(!rows.empty() && rows.front().value(column.key, Json()).is_number());
  }
  return table;
}

std::string LineOf(const Table& table, std::size_t r, const Screen& screen) {
  std::string line;
  std::size_t left = 0;  // columns before the last
  for (std::size_t c = 0; c < table.widths.size(); ++c) {
    std::string cell = table.lines[r][c];
    const Hue hue = r == 0 ? Hue::kTitle : HueOf(table.keys[c], cell);
    if (c + 1 < table.widths.size()) {
      left += table.widths[c] + 2;
      cell = Padded(cell, table.widths[c], table.right[c]) + "  ";
    } else if (left + kNarrowestCell <= screen.columns) {
      cell = Block(Padded(cell, table.widths[c], table.right[c]), screen.columns, left);
    } else if (r > 0 && screen.columns > kIndent && left + ShownWidth(cell) > screen.columns) {
      line = StripEnd(line);
      cell = "\n" + std::string(kIndent, ' ') + Block(cell, screen.columns, kIndent);
    } else {
      cell = Padded(cell, table.widths[c], table.right[c]);
    }
    line += Painted(cell, hue, screen);
  }
  return StripEnd(line);
}

}  // namespace

OutputFormat ParseOutputFormat(const std::string& text) {
  if (text == "json") return OutputFormat::kJson;
  return text == "csv" ? OutputFormat::kCsv : OutputFormat::kText;
}

void Output::Object(const Json& object) {
  if (json()) {
    data_ << Shortest(object).dump(2) << std::endl;
    return;
  }
  if (csv()) {
    csv_object_ = object;
    return;
  }
  std::size_t width = 0;
  for (const auto& item : object.items()) width = std::max(width, item.key().size());
  for (const auto& [key, value] : object.items()) {
    const std::string text = TextOf(value);
    const std::string head = Padded(key, width + 2, false);
    const Hue hue = HueOf(key, text);
    data_ << (hue == Hue::kPlain ? Filled(StripEnd(head + text), data_screen_.columns, width + 2)
                                 : head + Painted(text, hue, data_screen_))
          << '\n';
  }
  data_.flush();
}

void Output::List(const Json& rows, const std::vector<Column>& columns) {
  if (json()) {
    data_ << Shortest(rows).dump(2) << std::endl;
    return;
  }
  if (csv()) {
    if (csv_printed_) return;
    std::vector<std::string> keys;
    for (const Column& column : columns) keys.push_back(column.key);
    return Csv(rows, keys);
  }
  const std::size_t fit = std::max(kFewestRows, data_screen_.rows) - 4;
  const bool cut = data_screen_.terminal() && rows.size() > fit + 2;
  const std::size_t shown = cut ? fit : rows.size();
  const Table table = TableOf(rows, columns, shown);
  for (std::size_t r = 0; r <= shown; ++r) data_ << LineOf(table, r, data_screen_) << '\n';
  if (cut) {
    data_ << "… and " << rows.size() - shown
          << " more; all of them through a pipe, or with -o csv\n";
  }
  data_.flush();
}

// `keys` are the columns of a table without rows.
void Output::Csv(const Json& rows, const std::vector<std::string>& keys) {
  std::vector<std::vector<std::pair<std::string, Json>>> lines;
  for (const Json& row : rows) {
    lines.push_back(LeavesOf(row));
    if (csv_printed_) continue;  // a line with the keys stands already
    for (const auto& [key, value] : lines.back()) {
      if (std::find(csv_keys_.begin(), csv_keys_.end(), key) == csv_keys_.end()) {
        csv_keys_.push_back(key);
      }
    }
  }
  if (csv_keys_.empty()) csv_keys_ = keys;
  if (!csv_printed_) data_ << absl::StrJoin(csv_keys_, ",") << '\n';
  csv_printed_ = true;
  for (const auto& line : lines) {
    std::vector<std::string> cells;
    for (const std::string& key : csv_keys_) {
      const auto found = std::find_if(
          line.begin(), line.end(), [&](const auto& leaf) { return leaf.first == key; });
      cells.push_back(found == line.end() ? "" : CsvCell(found->second));
    }
    data_ << absl::StrJoin(cells, ",") << '\n';
  }
  data_.flush();
}

void Output::JsonLine(const Json& value) {
  if (csv()) return Csv(Json::array({value}), {});
  data_ << Shortest(value).dump() << std::endl;
}

void Output::Text(const std::string& line) {
  if (text()) data_ << line << std::endl;
}

void Output::Verdict(const std::string& line, bool good) {
  Text(Painted(line, good ? Hue::kGood : Hue::kBad, data_screen_));
}

void Output::Talk(const std::string& line) {
  for (const auto& [word, hue] :
       {std::pair<absl::string_view, Hue>("error:", Hue::kBad), {"warning:", Hue::kDoubtful}}) {
    if (!absl::StartsWith(line, word)) continue;
    talk_ << Painted(word, hue, talk_screen_) << line.substr(word.size()) << std::endl;
    return;
  }
  talk_ << line << std::endl;
}

void Output::Finish() {
  if (!csv() || csv_printed_) return;
  if (csv_object_.is_null()) return Talk("nothing of this is a table; --output json tells all");
  Csv(Json::array({std::exchange(csv_object_, Json())}), {});
}

}  // namespace strata::cli
