// What commands print: data on stdout, as text for people, as JSON for programs or as CSV for
// spreadsheets; talk on stderr.
#ifndef STRATA_CLIENT_CLI_TERMINAL_OUTPUT_H_
#define STRATA_CLIENT_CLI_TERMINAL_OUTPUT_H_

#include <cstdint>
#include <functional>
#include <iosfwd>
#include <string>
#include <vector>

#include "client/cli/terminal/screen.h"
#include "client/cli/terminal/values.h"

namespace strata::cli {

enum class OutputFormat : std::uint8_t { kText, kJson, kCsv };

// text, table (the same), json or csv.
OutputFormat ParseOutputFormat(const std::string& text);

// A column of a text table: the value under `key` of each row.
struct Column {
  std::string key;
  std::string title;
};

// Numbers of JSON and CSV have at most 15 digits, and whole ones no point. CSV (RFC 4180) has the
// first table of a command, or else its one thing as a row; a column for each key, those of objects
// as in sensor.sigma_m, lists as JSON. Text that goes to a terminal is broken and cut to what it
// shows. Not thread-safe.
class Output {
 public:
  Output(OutputFormat format,
         std::ostream& data,
         std::ostream& talk,
         const Screen& data_screen = {},
         const Screen& talk_screen = {})
      : format_(format),
        data_(data),
        talk_(talk),
        data_screen_(data_screen),
        talk_screen_(talk_screen) {}

  bool json() const { return format_ == OutputFormat::kJson; }
  bool csv() const { return format_ == OutputFormat::kCsv; }
  bool text() const { return format_ == OutputFormat::kText; }
  // One thing: as JSON an object, as text a line "key  value" for each key.
  void Object(const Json& object);
  // Several things of a kind: as JSON an array of objects, as text a table of `columns`, in which
  // angles (keys that end in _rad) are degrees.
  void List(const Json& rows, const std::vector<Column>& columns);
  // One of an unknown number of things: JSON on one line, also as text; as CSV a row with the keys
  // of the first.
  void JsonLine(const Json& value);
  // A line of text; nothing for programs.
  void Text(const std::string& line);
  // The same in the colour of what it says.
  void Verdict(const std::string& line, bool good);
  // To people: stderr. A line that begins with "error:" or "warning:" does so in colour.
  void Talk(const std::string& line);
  // After all that is to be printed.
  void Finish();
  std::ostream& talk() { return talk_; }

 private:
  void Csv(const Json& rows, const std::vector<std::string>& keys);

  OutputFormat format_;
  std::ostream& data_;
  std::ostream& talk_;
  Screen data_screen_;
  Screen talk_screen_;
  std::vector<std::string> csv_keys_;  // of the table under way
  bool csv_printed_ = false;
  Json csv_object_;  // printed where no table comes
};

}  // namespace strata::cli

#endif  // STRATA_CLIENT_CLI_TERMINAL_OUTPUT_H_
