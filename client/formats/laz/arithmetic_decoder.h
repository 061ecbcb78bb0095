// Numbers out of the bits of an adaptive arithmetic coder, as LAZ has it (A. Said, "Introduction to
// Arithmetic Coding – Theory and Practice", HPL-2004-76).
#ifndef STRATA_CLIENT_FORMATS_LAZ_ARITHMETIC_DECODER_H_
#define STRATA_CLIENT_FORMATS_LAZ_ARITHMETIC_DECODER_H_

#include <cstddef>
#include <cstdint>
#include <vector>

#include "absl/strings/string_view.h"

namespace strata {

// How likely a bit is to be 0, after those that were read with it.
class BitModel {
 public:
  std::uint32_t zero_share() const { return zero_share_; }  // [2⁻¹³]
  void Count(bool one);

 private:
  std::uint32_t zeros_ = 1;
  std::uint32_t bits_ = 2;
  std::uint32_t zero_share_ = 1 << 12;
  std::uint32_t cycle_ = 4;  // bits between two reckonings of the share
  std::uint32_t left_ = 4;
};

// How likely each of some symbols is, after those that were read with it.
class SymbolModel {
 public:
  static constexpr int kShareBits = 15;

  SymbolModel() = default;  // of none: not ready
  // 2 to 516, as LAZ has them.
  explicit SymbolModel(std::uint32_t symbols);
  bool ready() const { return symbols_ > 0; }
  std::uint32_t last() const { return symbols_ - 1; }

  // The share [2⁻¹⁵] of all symbols before this one.
  std::uint32_t Before(std::uint32_t symbol) const { return numbers_[symbol]; }
  // Of which symbol this share of all symbols is, < 2¹⁵.
  std::uint32_t At(std::uint32_t share) const;
  void Count(std::uint32_t symbol);

 private:
  void Reckon();
  void FillTable();
  std::uint32_t* counts() { return numbers_.data() + symbols_; }

  std::uint32_t symbols_ = 0;
  std::uint32_t total_ = 0;
  std::uint32_t cycle_ = 0;
  std::uint32_t left_ = 0;
  int table_shift_ = kShareBits;
  // Of each symbol the share before it; how often it was read; and for pieces of 2^table_shift_ of
  // the share the symbol at its begin, and one more.
  std::vector<std::uint32_t> numbers_;
};

// Models of equally many symbols, each made when it is first asked for: most never are.
class SymbolModels {
 public:
  SymbolModels(std::size_t count, std::uint32_t symbols) : symbols_(symbols), models_(count) {}
  SymbolModel& operator[](std::size_t i) {
    if (!models_[i].ready()) models_[i] = SymbolModel(symbols_);
    return models_[i];
  }

 private:
  std::uint32_t symbols_;
  std::vector<SymbolModel> models_;
};

// Reads no byte that is not there: behind the last one there are zeros, which an encoder may leave
// out; more than a few of them are a fault. Any bytes give some numbers. The bytes must outlive it.
class ArithmeticDecoder {
 public:
  ArithmeticDecoder() = default;  // of nothing
  explicit ArithmeticDecoder(absl::string_view bytes);

  bool Bit(BitModel& model);
  std::uint32_t Symbol(SymbolModel& model);
  // 1 to 32 bits that are equally likely 0 and 1.
  std::uint32_t Bits(int count);

  // No bytes were written for what would be here: nothing changes.
  bool empty() const { return bytes_.empty(); }
  // Whether the bytes were an encoder's that wrote all that was read.
  bool ok() const { return beyond_ <= kLeftOut; }

 private:
  static constexpr std::uint32_t kLeftOut = 4;

  std::uint32_t NextByte();
  void Refill();
  std::uint32_t FewBits(int count);

  absl::string_view bytes_;
  std::size_t at_ = 0;
  std::uint32_t beyond_ = 0;  // zeros behind the end
  std::uint32_t value_ = 0;   // < length_
  std::uint32_t length_ = 0xFFFFFFFF;
};

}  // namespace strata

#endif  // STRATA_CLIENT_FORMATS_LAZ_ARITHMETIC_DECODER_H_
