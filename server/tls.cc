#include "server/tls.h"

#include <cerrno>
#include <cstdio>
#include <ctime>

#include "absl/cleanup/cleanup.h"
#include "absl/status/status.h"
#include "absl/strings/str_cat.h"
#include <grpcpp/security/tls_certificate_provider.h>
#include <grpcpp/security/tls_credentials_options.h>
#include <openssl/bio.h>
#include <openssl/pem.h>
#include <openssl/x509.h>

#include "core/common/status.h"
#include "server/access/utc_text.h"

namespace strata::server {
namespace {

constexpr unsigned int kRefreshSeconds = 5;

using File = std::unique_ptr<std::FILE, int (*)(std::FILE*)>;
using Certificate = std::unique_ptr<X509, void (*)(X509*)>;
using Key = std::unique_ptr<EVP_PKEY, void (*)(EVP_PKEY*)>;

absl::StatusOr<File> Open(const std::filesystem::path& path) {
  File file(std::fopen(path.c_str(), "re"), &std::fclose);
  if (file == nullptr) {
    return absl::ErrnoToStatus(errno, absl::StrCat("cannot open ", path.string()));
  }
  return file;
}

absl::Status NoPem(const std::filesystem::path& path, absl::string_view what) {
  return absl::InvalidArgumentError(absl::StrCat(path.string(), " holds no ", what, " in PEM"));
}

absl::StatusOr<Certificate> ReadCertificate(const std::filesystem::path& path) {
  STRATA_ASSIGN_OR_RETURN(const File file, Open(path));
  Certificate certificate(PEM_read_X509(file.get(), nullptr, nullptr, nullptr), &X509_free);
  if (certificate == nullptr) return NoPem(path, "certificate");
  return certificate;
}

absl::StatusOr<Key> ReadKey(const std::filesystem::path& path) {
  STRATA_ASSIGN_OR_RETURN(const File file, Open(path));
  // A passphrase would have to be typed; without the callback OpenSSL asks at the terminal.
  const auto none = [](char*, int, int, void*) { return 0; };
  Key key(PEM_read_PrivateKey(file.get(), nullptr, none, nullptr), &EVP_PKEY_free);
  if (key == nullptr) return NoPem(path, "private key without a passphrase");
  return key;
}

std::string SubjectOf(const X509& certificate) {
  const std::unique_ptr<BIO, int (*)(BIO*)> text(BIO_new(BIO_s_mem()), &BIO_free);
  X509_NAME_print_ex(text.get(), X509_get_subject_name(&certificate), 0, XN_FLAG_ONELINE);
  char* data = nullptr;
  const long size = BIO_get_mem_data(text.get(), &data);
  return {data, static_cast<std::size_t>(size)};
}

absl::StatusOr<absl::Time> TimeOf(const ASN1_TIME* time) {
  std::tm parts{};
  if (time == nullptr || ASN1_TIME_to_tm(time, &parts) != 1) {
    return absl::InvalidArgumentError("the certificate's dates cannot be read");
  }
  return absl::FromTM(parts, absl::UTCTimeZone());
}

}  // namespace

absl::StatusOr<TlsCertificate> CheckTls(const TlsFiles& files, absl::Time now) {
  STRATA_ASSIGN_OR_RETURN(const Certificate certificate, ReadCertificate(files.certificate));
  STRATA_ASSIGN_OR_RETURN(const Key key, ReadKey(files.key));
  if (X509_check_private_key(certificate.get(), key.get()) != 1) {
    return absl::InvalidArgumentError(absl::StrCat(
        files.key.string(), " is not the key of the certificate ", files.certificate.string()));
  }
  if (!files.client_ca.empty()) {
    STRATA_RETURN_IF_ERROR(ReadCertificate(files.client_ca).status());
  }
  TlsCertificate result;
  result.subject = SubjectOf(*certificate);
  STRATA_ASSIGN_OR_RETURN(result.expires, TimeOf(X509_get0_notAfter(certificate.get())));
  STRATA_ASSIGN_OR_RETURN(const absl::Time begins, TimeOf(X509_get0_notBefore(certificate.get())));
  if (now < begins || now >= result.expires) {
    return absl::FailedPreconditionError(absl::StrCat(files.certificate.string(),
                                                      " is valid from ",
                                                      UtcText(begins),
                                                      " to ",
                                                      UtcText(result.expires),
                                                      ", and it is ",
                                                      UtcText(now)));
  }
  return result;
}

std::vector<std::shared_ptr<grpc::ServerCredentials>> TlsCredentials(const TlsFiles& files,
                                                                     int count) {
  namespace tls = grpc::experimental;
  const auto provider = std::make_shared<tls::FileWatcherCertificateProvider>(
      files.key.string(), files.certificate.string(), files.client_ca.string(), kRefreshSeconds);
  std::vector<std::shared_ptr<grpc::ServerCredentials>> result;
  for (int i = 0; i < count; ++i) {
    tls::TlsServerCredentialsOptions options(provider);  // credentials take what it holds
    options.watch_identity_key_cert_pairs();
    if (!files.client_ca.empty()) {
      options.watch_root_certs();
      options.set_cert_request_type(GRPC_SSL_REQUEST_AND_REQUIRE_CLIENT_CERTIFICATE_AND_VERIFY);
    }
    result.push_back(tls::TlsServerCredentials(options));
  }
  return result;
}

}  // namespace strata::server
