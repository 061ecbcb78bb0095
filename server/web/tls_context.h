// The server's certificate for browsers.
#ifndef STRATA_SERVER_WEB_TLS_CONTEXT_H_
#define STRATA_SERVER_WEB_TLS_CONTEXT_H_

#include <filesystem>
#include <memory>

#include "absl/base/thread_annotations.h"
#include "absl/status/statusor.h"
#include "absl/synchronization/mutex.h"
#include "absl/time/time.h"
#include <boost/asio/ssl/context.hpp>

#include "server/tls.h"

namespace strata::server::web {

// Follows the files, as that of gRPC does: another certificate is taken up within seconds,
// connections that are there keep theirs. TLS 1.2 and 1.3. Thread-safe.
class TlsContext {
 public:
  // INVALID_ARGUMENT for files that make no server's certificate.
  static absl::StatusOr<std::unique_ptr<TlsContext>> Open(const TlsFiles& files);

  // For a connection from now on. Never null: where the files are broken, what they were.
  std::shared_ptr<boost::asio::ssl::context> Current();

 private:
  explicit TlsContext(const TlsFiles& files) : files_(files) {}
  // When any of the files was written last.
  std::filesystem::file_time_type Written() const;

  const TlsFiles files_;
  absl::Mutex mutex_;
  absl::Time looked_ ABSL_GUARDED_BY(mutex_);
  std::filesystem::file_time_type written_ ABSL_GUARDED_BY(mutex_);
  std::shared_ptr<boost::asio::ssl::context> context_ ABSL_GUARDED_BY(mutex_);
};

}  // namespace strata::server::web

#endif  // STRATA_SERVER_WEB_TLS_CONTEXT_H_
