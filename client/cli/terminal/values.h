// How one value reads: to people, in JSON, in a cell of CSV.
#ifndef STRATA_CLIENT_CLI_TERMINAL_VALUES_H_
#define STRATA_CLIENT_CLI_TERMINAL_VALUES_H_

#include <string>
#include <utility>
#include <vector>

#include <nlohmann/json.hpp>

namespace strata::cli {

// Keys stay in the order in which they were set.
using Json = nlohmann::ordered_json;

// For people: decimals that mean something, lists with commas, "-" for what is unknown.
std::string TextOf(const Json& value);

// `value` with every number as its shortest decimal of at most 15 digits; whole ones are integers.
Json Shortest(Json value);

// The leaves of a row: those of objects are named as in sensor.sigma_m; lists stay whole.
std::vector<std::pair<std::string, Json>> LeavesOf(const Json& row);

// A cell of CSV, quoted where it must be (RFC 4180); empty for what is unknown.
std::string CsvCell(const Json& value);

}  // namespace strata::cli

#endif  // STRATA_CLIENT_CLI_TERMINAL_VALUES_H_
