// A way to a server that breaks again and again.
#ifndef STRATA_TESTS_INTEGRATION_CUTTING_PROXY_H_
#define STRATA_TESTS_INTEGRATION_CUTTING_PROXY_H_

#include <atomic>
#include <cstdint>
#include <functional>
#include <string>
#include <thread>

namespace strata::testing {

// Passes one connection at a time on to the server. Once the client has sent as many bytes as
// `allowance` said for it, nothing of it comes through any more, and soon after it is cut.
class CuttingProxy {
 public:
  CuttingProxy(const std::string& server, std::function<std::uint64_t()> allowance);
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

  const int server_port_;
  const std::function<std::uint64_t()> allowance_;
  int listener_;
  std::string address_;
  std::atomic<bool> ending_ = false;
  std::atomic<int> cuts_ = 0;
  std::atomic<std::uint64_t> bytes_ = 0;
  std::thread thread_;
};

}  // namespace strata::testing

#endif  // STRATA_TESTS_INTEGRATION_CUTTING_PROXY_H_
