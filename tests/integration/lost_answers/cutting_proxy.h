// A way to a server that breaks again and again.
#ifndef STRATA_TESTS_INTEGRATION_CUTTING_PROXY_H_
#define STRATA_TESTS_INTEGRATION_CUTTING_PROXY_H_

#include <atomic>
#include <cstdint>
#include <functional>
#include <limits>
#include <string>
#include <thread>

namespace strata::testing {

// Passes one connection at a time on to the server. Once the client has sent as many bytes as
// `allowance` said for it, nothing of it comes through any more, and soon after it is cut; once the
// server has sent more frames of HTTP/2 than that, at once.
class CuttingProxy {
 public:
  struct Allowance {
    std::uint64_t bytes = std::numeric_limits<std::uint64_t>::max();
    int answer_frames = std::numeric_limits<int>::max();
  };

  CuttingProxy(const std::string& server, std::function<Allowance()> allowance);
  ~CuttingProxy();
  CuttingProxy(const CuttingProxy&) = delete;
  CuttingProxy& operator=(const CuttingProxy&) = delete;

  // HOST:PORT
  const std::string& address() const { return address_; }
  int cuts() const { return cuts_; }
  // From the client to the server, over all connections.
  std::uint64_t bytes() const { return bytes_; }

 private:
  void Loop();
  // Until one end closes or the allowance is used up.
  void Pass(int client, int server);
  // Sends on what frames of `answers` are whole and allowed. False if there are more, or no client.
  static bool PassAnswers(int client, std::string& answers, Allowance& left);

  const int server_port_;
  const std::function<Allowance()> allowance_;
  int listener_;
  std::string address_;
  std::atomic<bool> ending_ = false;
  std::atomic<int> cuts_ = 0;
  std::atomic<std::uint64_t> bytes_ = 0;
  std::thread thread_;
};

}  // namespace strata::testing

#endif  // STRATA_TESTS_INTEGRATION_CUTTING_PROXY_H_
