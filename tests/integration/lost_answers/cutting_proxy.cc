#include "tests/integration/lost_answers/cutting_proxy.h"

#include <algorithm>
#include <array>
#include <chrono>
#include <cstdlib>
#include <utility>

#include <arpa/inet.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

namespace strata::testing {
namespace {

// Long enough for the server to take what has come: a cut at once costs that too.
constexpr auto kStall = std::chrono::milliseconds(150);

sockaddr_in Loopback(int port) {
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  address.sin_port = htons(static_cast<std::uint16_t>(port));
  return address;
}

int PortOf(const std::string& address) {
  return std::atoi(address.substr(address.rfind(':') + 1).c_str());
}

bool SendAll(int socket, const char* bytes, std::size_t size) {
  while (size > 0) {
    const ssize_t sent = ::send(socket, bytes, size, MSG_NOSIGNAL);
    if (sent <= 0) return false;
    bytes += sent;
    size -= static_cast<std::size_t>(sent);
  }
  return true;
}

}  // namespace

CuttingProxy::CuttingProxy(const std::string& server, std::function<Allowance()> allowance)
    : server_port_(PortOf(server)),
      allowance_(std::move(allowance)),
      listener_(::socket(AF_INET, SOCK_STREAM, 0)) {
  sockaddr_in address = Loopback(0);
  socklen_t size = sizeof(address);
  if (::bind(listener_, reinterpret_cast<sockaddr*>(&address), size) != 0 ||
      ::listen(listener_, 16) != 0 ||
      ::getsockname(listener_, reinterpret_cast<sockaddr*>(&address), &size) != 0) {
    std::abort();
  }
  address_ = "127.0.0.1:" + std::to_string(ntohs(address.sin_port));
  thread_ = std::thread([this] { Loop(); });
}

CuttingProxy::~CuttingProxy() {
  ending_ = true;
  thread_.join();
  ::close(listener_);
}

void CuttingProxy::Loop() {
  while (!ending_) {
    pollfd waiting{.fd = listener_, .events = POLLIN, .revents = 0};
    if (::poll(&waiting, 1, 20) <= 0) continue;
    const int client = ::accept(listener_, nullptr, nullptr);
    const int server = ::socket(AF_INET, SOCK_STREAM, 0);
    const sockaddr_in address = Loopback(server_port_);
    if (::connect(server, reinterpret_cast<const sockaddr*>(&address), sizeof(address)) == 0) {
      Pass(client, server);
    }
    ::close(client);
    ::close(server);
  }
}

void CuttingProxy::Pass(int client, int server) {
  Allowance left = allowance_();
  std::string answers;
  std::array<char, 16384> buffer{};
  auto cut_at = std::chrono::steady_clock::time_point::max();
  while (!ending_) {
    if (std::chrono::steady_clock::now() > cut_at) {
      ++cuts_;
      return;
    }
    std::array<pollfd, 2> ends = {
        {{left.bytes == 0 ? -1 : client, POLLIN, 0}, {server, POLLIN, 0}}};
    if (::poll(ends.data(), ends.size(), 20) <= 0) continue;
    if (ends[1].revents != 0) {
      const ssize_t size = ::recv(server, buffer.data(), buffer.size(), 0);
      if (size <= 0) return;
      answers.append(buffer.data(), static_cast<std::size_t>(size));
      if (!PassAnswers(client, answers, left)) {
        ++cuts_;
        return;
      }
    }
    if (ends[0].revents != 0) {
      const std::size_t most =
          static_cast<std::size_t>(std::min<std::uint64_t>(left.bytes, buffer.size()));
      const ssize_t size = ::recv(client, buffer.data(), most, 0);
      if (size <= 0 || !SendAll(server, buffer.data(), static_cast<std::size_t>(size))) return;
      bytes_ += static_cast<std::uint64_t>(size);
      left.bytes -= static_cast<std::uint64_t>(size);
      if (left.bytes == 0) cut_at = std::chrono::steady_clock::now() + kStall;
    }
  }
}

bool CuttingProxy::PassAnswers(int client, std::string& answers, Allowance& left) {
  constexpr std::size_t kFrameHeader = 9;  // RFC 9113, 4.1; its first three bytes are the length
  while (answers.size() >= kFrameHeader) {
    std::size_t size = kFrameHeader;
    for (int i = 0; i < 3; ++i) {
      size += static_cast<std::size_t>(static_cast<unsigned char>(answers[i])) << (16 - 8 * i);
    }
    if (answers.size() < size) break;
    if (left.answer_frames == 0) return false;
    --left.answer_frames;
    if (!SendAll(client, answers.data(), size)) return false;
    answers.erase(0, size);
  }
  return true;
}

}  // namespace strata::testing
