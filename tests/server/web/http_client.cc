#include "tests/server/web/http_client.h"

#include <algorithm>
#include <array>
#include <cstdint>
#include <cstdlib>
#include <utility>

#include "absl/strings/ascii.h"
#include "absl/strings/match.h"
#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/strip.h"
#include <arpa/inet.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

namespace strata::server::web {
namespace {

constexpr char kHttp[] = "http://127.0.0.1:";

}  // namespace

HttpConnection::HttpConnection(const std::string& url, int receive_bytes)
    : socket_(socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0)),
      host_(absl::StripPrefix(url, "http://")) {
  if (receive_bytes > 0) {
    setsockopt(socket_, SOL_SOCKET, SO_RCVBUF, &receive_bytes, sizeof(receive_bytes));
  }
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  address.sin_port = htons(
      static_cast<std::uint16_t>(std::atoi(std::string(absl::StripPrefix(url, kHttp)).c_str())));
  if (connect(socket_, reinterpret_cast<const sockaddr*>(&address), sizeof(address)) != 0) {
    close(std::exchange(socket_, -1));
  }
}

HttpConnection::~HttpConnection() {
  if (socket_ >= 0) close(socket_);
}

bool HttpConnection::Say(absl::string_view bytes) {
  while (!bytes.empty()) {
    const ssize_t sent = send(socket_, bytes.data(), bytes.size(), MSG_NOSIGNAL);
    if (sent <= 0) return false;
    bytes.remove_prefix(static_cast<std::size_t>(sent));
  }
  return true;
}

bool HttpConnection::Ask(const std::string& verb,
                         const std::string& target,
                         const Headers& headers,
                         const std::string& body) {
  std::string text = absl::StrCat(verb, " ", target, " HTTP/1.1\r\n");
  bool has_host = false;
  for (const auto& [name, value] : headers) {
    has_host = has_host || absl::EqualsIgnoreCase(name, "host");
    absl::StrAppend(&text, name, ": ", value, "\r\n");
  }
  if (!has_host) absl::StrAppend(&text, "Host: ", host_, "\r\n");
  if (verb == "POST" || !body.empty()) {
    absl::StrAppend(&text, "Content-Length: ", body.size(), "\r\n");
  }
  return Say(absl::StrCat(text, "\r\n", body));
}

bool HttpConnection::Receive() {
  pollfd waited{.fd = socket_, .events = POLLIN, .revents = 0};
  if (poll(&waited, 1, static_cast<int>(absl::ToInt64Milliseconds(testing::kPatience))) != 1)
    return false;
  std::array<char, 65536> piece{};
  const ssize_t count = recv(socket_, piece.data(), piece.size(), 0);
  if (count <= 0) return false;
  bytes_.append(piece.data(), static_cast<std::size_t>(count));
  return true;
}

std::string HttpConnection::TakeLine() {
  while (!absl::StrContains(bytes_, "\r\n")) {
    if (!Receive()) return "";
  }
  const std::size_t end = bytes_.find("\r\n");
  std::string line = bytes_.substr(0, end);
  bytes_.erase(0, end + 2);
  return line;
}

std::string HttpConnection::TakeBytes(std::size_t count) {
  while (bytes_.size() < count && Receive()) {
  }
  const std::size_t size = std::min(count, bytes_.size());
  std::string taken = bytes_.substr(0, size);
  bytes_.erase(0, size);
  return taken;
}

std::string HttpConnection::TakeUntil(absl::string_view text) {
  while (!absl::StrContains(bytes_, text) && Receive()) {
  }
  return std::exchange(bytes_, "");
}

HttpAnswer HttpConnection::Take(bool to_head) {
  HttpAnswer answer;
  const std::string first = TakeLine();
  if (!absl::StartsWith(first, "HTTP/1.1 ")) return answer;
  answer.status = std::atoi(first.c_str() + 9);
  for (std::string line = TakeLine(); !line.empty(); line = TakeLine()) {
    const std::size_t colon = line.find(": ");
    if (colon == std::string::npos) continue;
    answer.headers[absl::AsciiStrToLower(line.substr(0, colon))] = line.substr(colon + 2);
  }
  if (to_head || answer.status == 304 || answer.status == 100) return answer;
  if (answer.headers["transfer-encoding"] != "chunked") {
    std::size_t length = 0;
    if (absl::SimpleAtoi(answer.headers["content-length"], &length)) {
      answer.body = TakeBytes(length);
    }
    return answer;
  }
  while (true) {
    std::uint32_t size = 0;
    if (!absl::SimpleHexAtoi(TakeLine(), &size)) break;
    answer.body += TakeBytes(size);
    TakeLine();
    if (size == 0) break;
  }
  return answer;
}

bool HttpConnection::IsClosed(absl::Duration patience) {
  pollfd waited{.fd = socket_, .events = POLLIN, .revents = 0};
  while (poll(&waited, 1, static_cast<int>(absl::ToInt64Milliseconds(patience))) == 1) {
    std::array<char, 4096> piece{};
    if (recv(socket_, piece.data(), piece.size(), 0) <= 0) return true;
  }
  return false;
}

HttpAnswer AskOnce(const std::string& url,
                   const std::string& verb,
                   const std::string& target,
                   const Headers& headers,
                   const std::string& body) {
  HttpConnection connection(url);
  connection.Ask(verb, target, headers, body);
  return connection.Take(verb == "HEAD");
}

}  // namespace strata::server::web
