#include "server/rpc/connections.h"

#include <cstdlib>
#include <filesystem>
#include <string>
#include <system_error>

#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_replace.h"
#include "absl/strings/string_view.h"
#include <arpa/inet.h>
#include <netinet/in.h>
#include <sys/socket.h>

namespace strata::server {
namespace {

std::string Text(int family, const void* address) {
  char text[INET6_ADDRSTRLEN] = {};
  return inet_ntop(family, address, text, sizeof(text)) == nullptr ? "" : text;
}

// As gRPC writes it, but for its escapes; empty for a file that is no TCP connection.
std::string PeerOf(int file) {
  sockaddr_storage storage = {};
  socklen_t size = sizeof(storage);
  if (::getpeername(file, reinterpret_cast<sockaddr*>(&storage), &size) != 0) return "";
  if (storage.ss_family == AF_INET) {
    const auto& v4 = reinterpret_cast<const sockaddr_in&>(storage);
    return absl::StrCat("ipv4:", Text(AF_INET, &v4.sin_addr), ":", ntohs(v4.sin_port));
  }
  if (storage.ss_family != AF_INET6) return "";
  const auto& v6 = reinterpret_cast<const sockaddr_in6&>(storage);
  const int port = ntohs(v6.sin6_port);
  if (IN6_IS_ADDR_V4MAPPED(&v6.sin6_addr)) {
    return absl::StrCat("ipv4:", Text(AF_INET, &v6.sin6_addr.s6_addr[12]), ":", port);
  }
  return absl::StrCat("ipv6:[", Text(AF_INET6, &v6.sin6_addr), "]:", port);
}

}  // namespace

bool CutConnection(absl::string_view peer) {
  if (peer.empty()) return false;
  const std::string wanted =
      absl::StrReplaceAll(peer, {{"%5B", "["}, {"%5D", "]"}, {"%5b", "["}, {"%5d", "]"}});
  bool cut = false;
  std::error_code error;
  for (const auto& entry : std::filesystem::directory_iterator("/proc/self/fd", error)) {
    int file = -1;
    if (!absl::SimpleAtoi(entry.path().filename().string(), &file)) continue;
    if (PeerOf(file) != wanted) continue;
    cut = ::shutdown(file, SHUT_RDWR) == 0 || cut;
  }
  return cut;
}

}  // namespace strata::server
