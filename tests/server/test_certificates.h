// Certificates of a test's own, made when it runs.
#ifndef STRATA_TESTS_SERVER_TEST_CERTIFICATES_H_
#define STRATA_TESTS_SERVER_TEST_CERTIFICATES_H_

#include <filesystem>
#include <memory>
#include <string>

#include "absl/time/time.h"
#include <openssl/evp.h>
#include <openssl/x509.h>

namespace strata::testing {

// A certificate and its key, as PEM files: NAME.pem and NAME.key in the directory it was made in.
struct TestCertificate {
  std::filesystem::path certificate;
  std::filesystem::path key;
};

// An authority that signs what a test needs.
class TestAuthority {
 public:
  // Its own certificate is in DIR/NAME.pem.
  TestAuthority(std::filesystem::path directory, const std::string& name);

  const std::filesystem::path& certificate() const { return certificate_; }
  // `common_name` is also its name in the DNS, and 127.0.0.1 its address. Files of that `file` name
  // that are there are replaced as a whole. `begins` and `ends` from now on.
  TestCertificate Issue(const std::string& file,
                        const std::string& common_name,
                        absl::Duration begins = -absl::Hours(1),
                        absl::Duration ends = absl::Hours(1)) const;

 private:
  using Key = std::unique_ptr<EVP_PKEY, void (*)(EVP_PKEY*)>;
  using Certificate = std::unique_ptr<X509, void (*)(X509*)>;

  Certificate Make(const std::string& common_name,
                   EVP_PKEY& key,
                   absl::Duration begins,
                   absl::Duration ends,
                   bool authority) const;

  const std::filesystem::path directory_;
  const std::string name_;
  const Key key_;
  const Certificate own_;
  const std::filesystem::path certificate_;
};

}  // namespace strata::testing

#endif  // STRATA_TESTS_SERVER_TEST_CERTIFICATES_H_
