#include "server/web/hosts.h"

#include <algorithm>
#include <array>
#include <optional>

#include "absl/strings/ascii.h"
#include "absl/strings/numbers.h"
#include "absl/strings/strip.h"
#include <arpa/inet.h>

namespace strata::server::web {
namespace {

constexpr int kHttpPort = 80;
constexpr int kHttpsPort = 443;

struct Authority {
  std::string name;         // lower case, IPv6 without brackets
  std::optional<int> port;  // where one is written
};

std::optional<Authority> ParseAuthority(absl::string_view text) {
  Authority result;
  absl::string_view port;
  if (absl::ConsumePrefix(&text, "[")) {
    const std::size_t end = text.find(']');
    if (end == absl::string_view::npos) return std::nullopt;
    result.name = absl::AsciiStrToLower(text.substr(0, end));
    port = text.substr(end + 1);
  } else {
    const std::size_t end = std::min(text.find(':'), text.size());
    result.name = absl::AsciiStrToLower(absl::StripSuffix(text.substr(0, end), "."));
    port = text.substr(end);
  }
  if (result.name.empty()) return std::nullopt;
  if (port.empty()) return result;
  int number = 0;
  if (!absl::ConsumePrefix(&port, ":") || port.size() > 5 ||
      !std::all_of(port.begin(), port.end(), absl::ascii_isdigit) ||
      !absl::SimpleAtoi(port, &number)) {
    return std::nullopt;
  }
  result.port = number;
  return result;
}

bool IsAddress(const std::string& name) {
  std::array<unsigned char, sizeof(in6_addr)> address{};
  return inet_pton(AF_INET, name.c_str(), address.data()) == 1 ||
         inet_pton(AF_INET6, name.c_str(), address.data()) == 1;
}

}  // namespace

Hosts::Hosts(const std::vector<std::string>& names) : names_{"localhost"} {
  for (const std::string& name : names) {
    names_.insert(absl::AsciiStrToLower(absl::StripSuffix(name, ".")));
  }
}

bool Hosts::Take(absl::string_view host) const {
  const std::optional<Authority> authority = ParseAuthority(host);
  if (!authority.has_value()) return false;
  return names_.contains(authority->name) || IsAddress(authority->name);
}

bool IsSameOrigin(absl::string_view origin, absl::string_view host) {
  int usual = kHttpPort;
  if (absl::ConsumePrefix(&origin, "https://")) {
    usual = kHttpsPort;
  } else if (!absl::ConsumePrefix(&origin, "http://")) {
    return false;
  }
  const std::optional<Authority> page = ParseAuthority(origin);
  const std::optional<Authority> server = ParseAuthority(host);
  return page.has_value() && server.has_value() && page->name == server->name &&
         page->port.value_or(usual) == server->port.value_or(usual);
}

}  // namespace strata::server::web
