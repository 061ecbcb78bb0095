// Damage of all kinds, for decoders of self-checking bytes.
#ifndef STRATA_TESTS_CORE_CODEC_HOSTILE_H_
#define STRATA_TESTS_CORE_CODEC_HOSTILE_H_

#include <cstdint>
#include <random>
#include <string>

#include "absl/status/status.h"
#include "absl/strings/string_view.h"
#include <gtest/gtest.h>

#include "core/codec/blob.h"

namespace strata::testing {

// Every truncation (of long inputs: a seeded sample) and `flips` single flipped bits are DATA_LOSS.
template <typename Decode>
void ExpectDamageIsDataLoss(const std::string& bytes,
                            Decode decode,
                            std::uint64_t seed,
                            int flips) {
  const std::size_t step = bytes.size() / 2000 + 1;
  for (std::size_t size = 0; size < bytes.size(); size += step) {
    EXPECT_EQ(decode(absl::string_view(bytes).substr(0, size)).status().code(),
              absl::StatusCode::kDataLoss)
        << "cut to " << size << " bytes";
  }
  EXPECT_EQ(decode(bytes + "x").status().code(), absl::StatusCode::kDataLoss);
  std::mt19937_64 random(seed);
  for (int i = 0; i < flips; ++i) {
    const std::size_t bit = random() % (8 * bytes.size());
    std::string damaged = bytes;
    damaged[bit / 8] = static_cast<char>(damaged[bit / 8] ^ (1 << bit % 8));
    EXPECT_EQ(decode(damaged).status().code(), absl::StatusCode::kDataLoss)
        << "seed " << seed << ", bit " << bit;
  }
}

// Bodies changed at random and sealed again, as an attacker would: never a crash. Returns how many
// were accepted, so that a test can see that both outcomes occur.
template <typename Decode>
int DecodeForgedBodies(
    BlobKind kind, const std::string& bytes, Decode decode, std::uint64_t seed, int tries) {
  const std::uint16_t version = VersionOfBlob(bytes);
  const std::string body(*OpenBlob(kind, version, bytes));
  std::mt19937_64 random(seed);
  int accepted = 0;
  for (int i = 0; i < tries; ++i) {
    std::string forged = body;
    for (std::uint64_t k = 1 + random() % 4; k > 0; --k) {
      forged[random() % forged.size()] = static_cast<char>(random());
    }
    if (random() % 4 == 0) forged.resize(random() % forged.size());
    const auto decoded = decode(SealBlob(kind, version, forged));
    if (decoded.ok()) {
      ++accepted;
    } else {
      EXPECT_EQ(decoded.status().code(), absl::StatusCode::kDataLoss) << decoded.status();
    }
  }
  return accepted;
}

}  // namespace strata::testing

#endif  // STRATA_TESTS_CORE_CODEC_HOSTILE_H_
