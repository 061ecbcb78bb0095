// What becomes of a question: refused by its header, or answered by a page or a call.
#ifndef STRATA_SERVER_WEB_ROUTER_H_
#define STRATA_SERVER_WEB_ROUTER_H_

#include <memory>
#include <optional>

#include "server/web/exchange.h"
#include "server/web/hosts.h"
#include "server/web/pages.h"
#include "server/web/rpc.h"

namespace strata::server::web {

// Thread-safe.
class Router {
 public:
  // All must outlive it.
  Router(const Hosts& hosts, const Pages& pages, const Rpc& rpc)
      : hosts_(hosts), pages_(pages), rpc_(rpc) {}

  // Before the body is read: 403 for a Host that is no name of the server's or a page of another
  // site; 404; 405 for a verb that the path does not have; Rpc::Refuse().
  std::optional<Answer> Refuse(const Question& question) const;
  // Of a question that was not refused. Null: answered at once.
  std::shared_ptr<Exchange> Handle(const Question& question,
                                   const std::shared_ptr<AnswerSink>& sink) const;

 private:
  std::optional<Answer> RefuseSite(const Question& question) const;

  const Hosts& hosts_;
  const Pages& pages_;
  const Rpc& rpc_;
};

}  // namespace strata::server::web

#endif  // STRATA_SERVER_WEB_ROUTER_H_
