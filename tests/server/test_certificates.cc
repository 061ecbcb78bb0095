#include "tests/server/test_certificates.h"

#include <atomic>
#include <cstdio>
#include <stdexcept>
#include <string>
#include <utility>

#include "absl/strings/str_cat.h"
#include <openssl/ec.h>
#include <openssl/pem.h>
#include <openssl/x509v3.h>

namespace strata::testing {
namespace {

namespace fs = std::filesystem;

void Must(bool good, const char* what) {
  if (!good) throw std::runtime_error(absl::StrCat("test certificate: ", what));
}

EVP_PKEY* NewKey() {
  EVP_PKEY* key = EVP_EC_gen("P-256");
  Must(key != nullptr, "key");
  return key;
}

// Written beside and renamed: a server that follows the file never sees half of it.
template <typename Write>
fs::path WritePem(const fs::path& path, const Write& write) {
  const fs::path making = path.string() + ".making";
  std::FILE* file = std::fopen(making.c_str(), "we");
  Must(file != nullptr && write(file) == 1, "file");
  std::fclose(file);
  fs::rename(making, path);
  return path;
}

void AddExtension(X509& certificate, X509& issuer, int kind, const std::string& value) {
  X509V3_CTX context;
  X509V3_set_ctx(&context, &issuer, &certificate, nullptr, nullptr, 0);
  X509_EXTENSION* extension = X509V3_EXT_conf_nid(nullptr, &context, kind, value.c_str());
  Must(extension != nullptr, "extension");
  X509_add_ext(&certificate, extension, -1);
  X509_EXTENSION_free(extension);
}

}  // namespace

TestAuthority::TestAuthority(fs::path directory, const std::string& name)
    : directory_(std::move(directory)),
      name_(name),
      key_(NewKey(), &EVP_PKEY_free),
      own_(Make(name, *key_, -absl::Hours(24), absl::Hours(24), true)),
      certificate_(WritePem(directory_ / (name + ".pem"),
                            [this](std::FILE* file) { return PEM_write_X509(file, own_.get()); })) {
}

TestAuthority::Certificate TestAuthority::Make(const std::string& common_name,
                                               EVP_PKEY& key,
                                               absl::Duration begins,
                                               absl::Duration ends,
                                               bool authority) const {
  static std::atomic<long> serial = 1;
  Certificate made(X509_new(), &X509_free);
  X509_set_version(made.get(), 2);
  ASN1_INTEGER_set(X509_get_serialNumber(made.get()), serial.fetch_add(1));
  X509_gmtime_adj(X509_getm_notBefore(made.get()), absl::ToInt64Seconds(begins));
  X509_gmtime_adj(X509_getm_notAfter(made.get()), absl::ToInt64Seconds(ends));
  X509_set_pubkey(made.get(), &key);
  const auto named = [](X509_NAME* name, const std::string& text) {
    Must(X509_NAME_add_entry_by_txt(name,
                                    "CN",
                                    MBSTRING_UTF8,
                                    reinterpret_cast<const unsigned char*>(text.c_str()),
                                    -1,
                                    -1,
                                    0) == 1,
         "name");
  };
  named(X509_get_subject_name(made.get()), common_name);
  named(X509_get_issuer_name(made.get()), name_);
  X509& issuer = authority ? *made : *own_;
  AddExtension(*made, issuer, NID_basic_constraints, authority ? "critical,CA:TRUE" : "CA:FALSE");
  if (!authority) {
    AddExtension(
        *made, issuer, NID_subject_alt_name, absl::StrCat("DNS:", common_name, ",IP:127.0.0.1"));
  }
  Must(X509_sign(made.get(), key_.get(), EVP_sha256()) > 0, "signature");
  return made;
}

TestCertificate TestAuthority::Issue(const std::string& file,
                                     const std::string& common_name,
                                     absl::Duration begins,
                                     absl::Duration ends) const {
  const Key key(NewKey(), &EVP_PKEY_free);
  const Certificate made = Make(common_name, *key, begins, ends, false);
  TestCertificate paths;
  paths.key = WritePem(directory_ / (file + ".key"), [&key](std::FILE* out) {
    return PEM_write_PrivateKey(out, key.get(), nullptr, nullptr, 0, nullptr, nullptr);
  });
  paths.certificate = WritePem(directory_ / (file + ".pem"),
                               [&made](std::FILE* out) { return PEM_write_X509(out, made.get()); });
  return paths;
}

}  // namespace strata::testing
