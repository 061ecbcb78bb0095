#include "client/formats/laz/arithmetic_decoder.h"

#include <algorithm>
#include <cstddef>
#include <cstdint>

#include "absl/strings/string_view.h"

namespace strata {
namespace {

constexpr std::uint32_t kShortest = 1U << 24;  // of the interval, before bytes are taken in
constexpr int kBitShareBits = 13;
constexpr std::uint32_t kMostBits = 1U << kBitShareBits;
constexpr std::uint32_t kLongestBitCycle = 64;
constexpr std::uint32_t kMostSymbols = 1U << SymbolModel::kShareBits;
constexpr std::uint32_t kOne = 1U << 31;
// With fewer symbols than this, halving finds one as fast as a table.
constexpr std::uint32_t kTableFrom = 17;

std::uint32_t Longer(std::uint32_t cycle) { return 5 * cycle / 4; }

}  // namespace

void BitModel::Count(bool one) {
  zeros_ += one ? 0 : 1;
  if (--left_ > 0) return;
  bits_ += cycle_;
  if (bits_ > kMostBits) {
    bits_ = (bits_ + 1) / 2;
    zeros_ = (zeros_ + 1) / 2;
    if (zeros_ == bits_) ++bits_;
  }
  zero_share_ = (zeros_ * (kOne / bits_)) >> (31 - kBitShareBits);
  cycle_ = std::min(Longer(cycle_), kLongestBitCycle);
  left_ = cycle_;
}

SymbolModel::SymbolModel(std::uint32_t symbols) : symbols_(symbols), cycle_(symbols) {
  std::size_t table = 0;
  if (symbols >= kTableFrom) {
    int bits = 3;
    while (symbols > 1U << (bits + 2)) ++bits;
    table_shift_ = kShareBits - bits;
    table = (std::size_t{1} << bits) + 1;
  }
  numbers_.resize(2 * symbols + table);
  std::fill(counts(), counts() + symbols, 1U);
  Reckon();
  left_ = cycle_ = (symbols + 6) / 2;
}

std::uint32_t SymbolModel::At(std::uint32_t share) const {
  std::uint32_t low = 0;
  std::uint32_t high = symbols_;
  if (table_shift_ < kShareBits) {
    const std::uint32_t* const piece = numbers_.data() + 2 * symbols_ + (share >> table_shift_);
    low = piece[0];
    high = piece[1] + 1;
  }
  while (high > low + 1) {
    const std::uint32_t middle = (low + high) / 2;
    (numbers_[middle] > share ? high : low) = middle;
  }
  return low;
}

void SymbolModel::Count(std::uint32_t symbol) {
  ++counts()[symbol];
  if (--left_ > 0) return;
  Reckon();
  cycle_ = std::min(Longer(cycle_), (symbols_ + 6) * 8);
  left_ = cycle_;
}

// The shares anew from the counts, which are halved where they have become too many.
void SymbolModel::Reckon() {
  std::uint32_t* const count = counts();
  total_ += cycle_;
  if (total_ > kMostSymbols) {
    total_ = 0;
    for (std::uint32_t i = 0; i < symbols_; ++i) total_ += count[i] = (count[i] + 1) / 2;
  }
  const std::uint32_t scale = kOne / total_;
  std::uint32_t before = 0;
  for (std::uint32_t i = 0; i < symbols_; ++i) {
    numbers_[i] = (scale * before) >> (31 - kShareBits);
    before += count[i];
  }
  if (table_shift_ < kShareBits) FillTable();
}

void SymbolModel::FillTable() {
  std::uint32_t* const table = counts() + symbols_;
  std::uint32_t piece = 0;
  for (std::uint32_t i = 1; i < symbols_; ++i) {
    for (; piece << table_shift_ < numbers_[i]; ++piece) table[piece] = i - 1;
  }
  for (; piece <= kMostSymbols >> table_shift_; ++piece) table[piece] = symbols_ - 1;
}

ArithmeticDecoder::ArithmeticDecoder(absl::string_view bytes) : bytes_(bytes) {
  if (bytes.empty()) return;
  for (int i = 0; i < 4; ++i) value_ = value_ << 8 | NextByte();
  value_ = std::min(value_, length_ - 1);  // no encoder writes more
}

std::uint32_t ArithmeticDecoder::NextByte() {
  if (at_ < bytes_.size()) return static_cast<std::uint8_t>(bytes_[at_++]);
  beyond_ = bytes_.empty() ? kLeftOut + 1 : std::min(beyond_, kLeftOut) + 1;
  return 0;
}

void ArithmeticDecoder::Refill() {
  while (length_ < kShortest) {
    value_ = value_ << 8 | NextByte();
    length_ <<= 8;
  }
}

bool ArithmeticDecoder::Bit(BitModel& model) {
  const std::uint32_t zeros = model.zero_share() * (length_ >> kBitShareBits);
  const bool one = value_ >= zeros;
  if (one) {
    value_ -= zeros;
    length_ -= zeros;
  } else {
    length_ = zeros;
  }
  Refill();
  model.Count(one);
  return one;
}

std::uint32_t ArithmeticDecoder::Symbol(SymbolModel& model) {
  const std::uint32_t step = length_ >> SymbolModel::kShareBits;
  const std::uint32_t symbol = model.At(std::min(value_ / step, kMostSymbols - 1));
  const std::uint32_t begin = model.Before(symbol) * step;
  const std::uint32_t end = symbol == model.last() ? length_ : model.Before(symbol + 1) * step;
  value_ -= begin;
  length_ = end - begin;
  Refill();
  model.Count(symbol);
  return symbol;
}

std::uint32_t ArithmeticDecoder::FewBits(int count) {
  length_ >>= count;
  const std::uint32_t bits = value_ / length_;
  value_ -= bits * length_;
  Refill();
  return bits;
}

std::uint32_t ArithmeticDecoder::Bits(int count) {
  constexpr int kFew = 19;
  constexpr int kLow = 16;
  if (count <= kFew) return FewBits(count);
  const std::uint32_t low = FewBits(kLow);
  return FewBits(count - kLow) << kLow | low;
}

}  // namespace strata
