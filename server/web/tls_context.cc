#include "server/web/tls_context.h"

#include <algorithm>
#include <system_error>
#include <utility>

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"
#include <glog/logging.h>

#include "core/common/log_line.h"
#include "core/common/status.h"
#include "core/common/steady_time.h"

namespace strata::server::web {
namespace {

namespace fs = std::filesystem;
namespace ssl = boost::asio::ssl;

constexpr absl::Duration kLookInterval = absl::Seconds(5);

absl::StatusOr<std::shared_ptr<ssl::context>> Read(const TlsFiles& files) {
  auto context = std::make_shared<ssl::context>(ssl::context::tls_server);
  context->set_options(ssl::context::default_workarounds | ssl::context::no_sslv2 |
                       ssl::context::no_sslv3 | ssl::context::no_tlsv1 | ssl::context::no_tlsv1_1 |
                       ssl::context::no_compression);
  boost::system::error_code error;
  context->use_certificate_chain_file(files.certificate.string(), error);
  if (!error) context->use_private_key_file(files.key.string(), ssl::context::pem, error);
  if (!error && !files.client_ca.empty()) {
    context->load_verify_file(files.client_ca.string(), error);
    context->set_verify_mode(ssl::verify_peer | ssl::verify_fail_if_no_peer_cert);
    // Or a browser that shows a certificate cannot come again: a session is of one context.
    SSL_CTX_set_session_cache_mode(context->native_handle(), SSL_SESS_CACHE_OFF);
    SSL_CTX_set_options(context->native_handle(), SSL_OP_NO_TICKET);
  }
  if (!error) return context;
  return absl::InvalidArgumentError(absl::StrCat("no certificate for browsers: ", error.message()));
}

}  // namespace

absl::StatusOr<std::unique_ptr<TlsContext>> TlsContext::Open(const TlsFiles& files) {
  std::unique_ptr<TlsContext> result(new TlsContext(files));
  absl::MutexLock lock(&result->mutex_);
  result->written_ = result->Written();
  result->looked_ = SteadyNow();
  STRATA_ASSIGN_OR_RETURN(result->context_, Read(files));
  return result;
}

fs::file_time_type TlsContext::Written() const {
  fs::file_time_type latest = fs::file_time_type::min();
  for (const fs::path& file : {files_.certificate, files_.key, files_.client_ca}) {
    std::error_code error;
    const fs::file_time_type written = fs::last_write_time(file, error);
    if (!error) latest = std::max(latest, written);
  }
  return latest;
}

std::shared_ptr<ssl::context> TlsContext::Current() {
  absl::MutexLock lock(&mutex_);
  const absl::Time now = SteadyNow();
  if (now - looked_ < kLookInterval) return context_;
  looked_ = now;
  const fs::file_time_type written = Written();
  if (written == written_) return context_;
  absl::StatusOr<std::shared_ptr<ssl::context>> context = Read(files_);
  if (!context.ok()) {  // half of two files may be written; again the next time
    LOG(WARNING) << LogLine("web").Add("certificate", context.status().message());
    return context_;
  }
  written_ = written;
  context_ = *std::move(context);
  return context_;
}

}  // namespace strata::server::web
