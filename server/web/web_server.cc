#include "server/web/web_server.h"

#include <algorithm>
#include <system_error>
#include <thread>
#include <utility>

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"
#include <boost/asio/executor_work_guard.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/ssl/context.hpp>
#include <glog/logging.h>
#include <grpcpp/generic/generic_stub.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <sys/socket.h>
#include <unistd.h>

#include "core/common/log_line.h"
#include "core/common/status.h"
#include "core/common/this_thread.h"
#include "server/rpc/listener.h"
#include "server/web/call.h"
#include "server/web/contract.h"
#include "server/web/hosts.h"
#include "server/web/pages.h"
#include "server/web/router.h"
#include "server/web/rpc.h"
#include "server/web/session.h"
#include "server/web/sessions.h"
#include "server/web/tls_context.h"

namespace strata::server::web {
namespace {

namespace net = boost::asio;
using net::ip::tcp;

// They parse, and write JSON; what takes long is done by the services.
constexpr int kThreads = 2;
// A browser that vanished without a word is noticed after some minute.
constexpr int kKeepaliveIdle_s = 30;
constexpr int kKeepaliveInterval_s = 10;
constexpr int kKeepaliveCount = 3;

void KeepAlive(int fd) {
  const auto set = [fd](int level, int option, int value) {
    setsockopt(fd, level, option, &value, sizeof(value));
  };
  set(SOL_SOCKET, SO_KEEPALIVE, 1);
  set(IPPROTO_TCP, TCP_KEEPIDLE, kKeepaliveIdle_s);
  set(IPPROTO_TCP, TCP_KEEPINTVL, kKeepaliveInterval_s);
  set(IPPROTO_TCP, TCP_KEEPCNT, kKeepaliveCount);
}

std::vector<std::string> NamesOf(const WebServerOptions& options) {
  std::vector<std::string> names = options.names;
  names.push_back(options.listen.host);
  return names;
}

class BeastServer final : public WebServer {
 public:
  BeastServer(WebServerOptions options, std::shared_ptr<grpc::Channel> channel)
      : options_(std::move(options)),
        stub_(std::move(channel)),
        contract_(options_.services),
        hosts_(NamesOf(options_)),
        sessions_(options_.max_connections, options_.max_bodies_bytes),
        rpc_(contract_, stub_, calls_) {}
  ~BeastServer() override { BeastServer::Close(); }

  absl::Status Listen();
  const std::string& url() const override { return url_; }
  void StopAccepting() override {
    if (listener_ != nullptr) listener_->Close();
  }
  void Close() override;
  std::size_t connections() const override { return sessions_.count(); }
  std::uint64_t refused() const override { return sessions_.refused(); }
  int calls() const override { return calls_.count(); }

 private:
  void Take(int fd);

  const WebServerOptions options_;
  grpc::GenericStub stub_;
  CallCount calls_;
  const Contract contract_;
  const Hosts hosts_;
  Sessions sessions_;
  const Rpc rpc_;
  std::unique_ptr<Pages> pages_;
  std::unique_ptr<Router> router_;
  std::unique_ptr<SessionShared> shared_;
  std::unique_ptr<TlsContext> tls_;  // null: plain text
  net::io_context io_{kThreads};
  net::executor_work_guard<net::io_context::executor_type> work_ = net::make_work_guard(io_);
  std::string url_;
  std::vector<std::thread> threads_;
  std::unique_ptr<Listener> listener_;
};

absl::Status BeastServer::Listen() {
  STRATA_ASSIGN_OR_RETURN(pages_, Pages::Make(options_.viewer, contract_, stub_, calls_));
  if (options_.tls.enabled()) {
    STRATA_ASSIGN_OR_RETURN(tls_, TlsContext::Open(options_.tls));
  }
  STRATA_ASSIGN_OR_RETURN(listener_, Listener::Open(options_.listen));
  router_ = std::make_unique<Router>(hosts_, *pages_, rpc_);
  shared_ = std::make_unique<SessionShared>(
      SessionShared{.router = *router_,
                    .sessions = sessions_,
                    .limits = {.body_bytes = options_.max_body_bytes,
                               .body_time = options_.slow_sender_timeout,
                               .write_time = options_.slow_reader_timeout},
                    .known = options_.known});
  HostPort address = options_.listen;
  address.port = listener_->port();
  url_ = absl::StrCat(options_.tls.enabled() ? "https://" : "http://", address.ToString());
  for (int i = 0; i < kThreads; ++i) {
    threads_.emplace_back([this] {
      NameThisThread("web");
      io_.run();
    });
  }
  listener_->Accept([this](int fd) {
    Take(fd);
    return true;
  });
  return absl::OkStatus();
}

void BeastServer::Take(int fd) {
  KeepAlive(fd);
  sockaddr_storage address{};
  socklen_t size = sizeof(address);
  getsockname(fd, reinterpret_cast<sockaddr*>(&address), &size);
  tcp::socket socket(io_);
  boost::system::error_code error;
  socket.assign(address.ss_family == AF_INET6 ? tcp::v6() : tcp::v4(), fd, error);
  if (error) {
    close(fd);
    return;
  }
  const auto session =
      MakeSession(std::move(socket), tls_ == nullptr ? nullptr : tls_->Current(), *shared_);
  if (sessions_.Add(session)) session->Start();
}

void BeastServer::Close() {
  if (threads_.empty()) return;
  StopAccepting();
  sessions_.CloseAll();
  calls_.AwaitNone();
  work_.reset();  // the threads end with the last session
  for (std::thread& thread : threads_) thread.join();
  threads_.clear();
}

}  // namespace

absl::StatusOr<std::unique_ptr<WebServer>> WebServer::Open(WebServerOptions options,
                                                           std::shared_ptr<grpc::Channel> channel) {
  auto server = std::make_unique<BeastServer>(std::move(options), std::move(channel));
  STRATA_RETURN_IF_ERROR(server->Listen());
  return server;
}

}  // namespace strata::server::web
