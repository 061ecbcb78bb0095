// Files made by hand, and damaged ones, for readers: whatever happens, it is a status.
#ifndef STRATA_TESTS_CLIENT_FORMATS_HOSTILE_FILES_H_
#define STRATA_TESTS_CLIENT_FORMATS_HOSTILE_FILES_H_

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <random>
#include <string>

#include "absl/status/status.h"
#include "absl/strings/string_view.h"
#include <gtest/gtest.h>

#include "core/cloud/point_cloud.h"

namespace strata::testing {

// Writes a value as it is in memory; the file grows to hold it.
template <typename T>
void PutAt(std::string& bytes, std::size_t at, T value) {
  if (bytes.size() < at + sizeof value) bytes.resize(at + sizeof value);
  std::memcpy(bytes.data() + at, &value, sizeof value);
}

// Truncations at every byte and seeded changes of single bytes: the reader answers with a valid
// cloud or with INVALID_ARGUMENT.
template <typename Read>
void ExpectSoundOnDamage(const std::string& file, Read read, std::uint64_t seed) {
  const auto check = [&read](absl::string_view bytes) {
    const auto cloud = read(bytes);
    if (cloud.ok()) {
      EXPECT_TRUE(ValidateCloud(*cloud).ok());
    } else {
      EXPECT_EQ(cloud.status().code(), absl::StatusCode::kInvalidArgument) << cloud.status();
    }
  };
  for (std::size_t size = 0; size < file.size(); ++size) check(file.substr(0, size));
  std::mt19937_64 random(seed);
  for (int i = 0; i < 5000; ++i) {
    std::string damaged = file;
    for (std::uint64_t k = 1 + random() % 3; k > 0; --k) {
      damaged[random() % damaged.size()] = static_cast<char>(random());
    }
    SCOPED_TRACE(i);
    check(damaged);
  }
}

}  // namespace strata::testing

#endif  // STRATA_TESTS_CLIENT_FORMATS_HOSTILE_FILES_H_
