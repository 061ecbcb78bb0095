// Bytes as a file that a reader can be given.
#ifndef STRATA_TESTS_FUZZ_INPUT_FILE_H_
#define STRATA_TESTS_FUZZ_INPUT_FILE_H_

#include <string>

#include "absl/strings/str_cat.h"
#include "absl/strings/string_view.h"
#include <sys/mman.h>
#include <unistd.h>

#include "tests/fuzz/require.h"

namespace strata::fuzz {

// In memory, gone with its owner.
class InputFile {
 public:
  explicit InputFile(absl::string_view bytes) : descriptor_(memfd_create("input", 0)) {
    Require(write(descriptor_, bytes.data(), bytes.size()) == static_cast<ssize_t>(bytes.size()),
            "memory can be written");
  }
  ~InputFile() { close(descriptor_); }
  InputFile(const InputFile&) = delete;
  InputFile& operator=(const InputFile&) = delete;

  std::string path() const { return absl::StrCat("/proc/self/fd/", descriptor_); }

 private:
  const int descriptor_;
};

}  // namespace strata::fuzz

#endif  // STRATA_TESTS_FUZZ_INPUT_FILE_H_
