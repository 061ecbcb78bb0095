// What commands print: data on stdout, as text for people or as JSON for programs; talk on stderr.
#ifndef STRATA_CLIENT_CLI_TERMINAL_OUTPUT_H_
#define STRATA_CLIENT_CLI_TERMINAL_OUTPUT_H_

#include <cstdint>
#include <functional>
#include <iosfwd>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

namespace strata::cli {

// Keys stay in the order in which they were set.
using Json = nlohmann::ordered_json;

enum class OutputFormat : std::uint8_t { kText, kJson };

// A column of a text table: the value under `key` of each row.
struct Column {
  std::string key;
  std::string title;
};

// Not thread-safe.
class Output {
 public:
  Output(OutputFormat format, std::ostream& data, std::ostream& talk)
      : format_(format), data_(data), talk_(talk) {}

  bool json() const { return format_ == OutputFormat::kJson; }
  // One thing: as JSON an object, as text a line "key  value" for each key.
  void Object(const Json& object);
  // Several things of a kind: as JSON an array of objects, as text a table of `columns`.
  void List(const Json& rows, const std::vector<Column>& columns);
  // JSON on one line whatever the format.
  void JsonLine(const Json& value);
  // A line of text; nothing in JSON mode.
  void Text(const std::string& line);
  // To people: stderr.
  void Talk(const std::string& line);
  std::ostream& talk() { return talk_; }

 private:
  OutputFormat format_;
  std::ostream& data_;
  std::ostream& talk_;
};

}  // namespace strata::cli

#endif  // STRATA_CLIENT_CLI_TERMINAL_OUTPUT_H_
