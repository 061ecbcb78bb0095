// A directory that goes away with its owner.
#ifndef STRATA_TESTS_SUPPORT_TEMP_DIR_H_
#define STRATA_TESTS_SUPPORT_TEMP_DIR_H_

#include <filesystem>

namespace strata::testing {

class TempDir {
 public:
  TempDir();
  ~TempDir();
  TempDir(const TempDir&) = delete;
  TempDir& operator=(const TempDir&) = delete;
  const std::filesystem::path& path() const { return path_; }

 private:
  std::filesystem::path path_;
};

}  // namespace strata::testing

#endif  // STRATA_TESTS_SUPPORT_TEMP_DIR_H_
