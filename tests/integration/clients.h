// Clients that work against a server for as long as a test wants, whatever becomes of the server.
#ifndef STRATA_TESTS_INTEGRATION_CLIENTS_H_
#define STRATA_TESTS_INTEGRATION_CLIENTS_H_

#include <functional>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "core/api/database.h"

namespace strata::testing {

// A client that tries again soon and often, as beside a server that is cut off or killed.
std::unique_ptr<api::Database> ConnectPatiently(const std::string& address);

// A thread a client, each with a connection of its own.
class Clients {
 public:
  // Does one thing of its client; called over and over.
  using Step = std::function<void(api::Database&, const api::Call&)>;

  ~Clients() { Stop(); }
  // Connects to `target`, where a server must be, and begins.
  void Add(const std::string& target, Step step);
  // Cancels what the clients do, and ends them. Safe to call again.
  void Stop();

 private:
  const api::Call call_;
  std::vector<std::unique_ptr<api::Database>> connections_;
  std::vector<std::thread> threads_;
};

}  // namespace strata::testing

#endif  // STRATA_TESTS_INTEGRATION_CLIENTS_H_
