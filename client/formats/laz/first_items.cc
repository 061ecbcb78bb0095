#include "client/formats/laz/first_items.h"

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>

#include "client/formats/laz/arithmetic_decoder.h"
#include "client/formats/laz/integer_decoder.h"
#include "client/formats/laz/item_bytes.h"
#include "client/formats/laz/laz_format.h"
#include "client/formats/laz/pointwise_items.h"

namespace strata {
namespace {

// The next number of some bytes, predicted to be the last one.
template <typename T>
void NextNumber(ArithmeticDecoder& decoder,
                IntegerDecoder& numbers,
                char* bytes,
                std::size_t context = 0) {
  const auto last = static_cast<std::int32_t>(NumberOf<T>(bytes));
  SetNumber(static_cast<T>(numbers.Next(decoder, last, context)), bytes);
}

// A byte that is modelled behind each value of the one before.
void NextByteOf(ArithmeticDecoder& decoder, SymbolModels& models, char* byte) {
  *byte = static_cast<char>(decoder.Symbol(models[NumberOf<std::uint8_t>(byte)]));
}

std::uint64_t WholeNumber(ArithmeticDecoder& decoder) {
  const std::uint64_t low = decoder.Bits(32);
  return std::uint64_t{decoder.Bits(32)} << 32 | low;
}

// The last three differences of a coordinate.
class ThreeSteps {
 public:
  std::int32_t Median() const {
    std::array<std::int32_t, 3> sorted = steps_;
    std::sort(sorted.begin(), sorted.end());
    return sorted[1];
  }
  void Add(std::int32_t step) {
    steps_[oldest_] = step;
    oldest_ = (oldest_ + 1) % steps_.size();
  }

 private:
  std::array<std::int32_t, 3> steps_{};
  std::size_t oldest_ = 0;
};

enum FirstPoint10Change : std::uint32_t {
  kFirstSourceChanged = 1,
  kFirstUserDataChanged = 2,
  kFirstAngleChanged = 4,
  kFirstClassChanged = 8,
  kFirstReturnsChanged = 16,
  kFirstIntensityChanged = 32,
};

class FirstPoint10 final : public PointwiseItem {
 public:
  void Next(ArithmeticDecoder& decoder, char* item) override {
    NextCoordinate(decoder, x_steps_, x_before_, 0, item);
    NextCoordinate(decoder, y_steps_, y_before_, Context(x_steps_.length()), item + 4);
    const std::uint32_t length = (x_steps_.length() + y_steps_.length()) / 2;
    NextNumber<std::int32_t>(decoder, heights_, item + 8, Context(length));
    const std::uint32_t changed = decoder.Symbol(changed_);
    if ((changed & kFirstIntensityChanged) != 0) {
      NextNumber<std::uint16_t>(decoder, intensities_, item + 12);
    }
    if ((changed & kFirstReturnsChanged) != 0) NextByteOf(decoder, returns_, item + 14);
    if ((changed & kFirstClassChanged) != 0) NextByteOf(decoder, classes_, item + 15);
    if ((changed & kFirstAngleChanged) != 0) {
      NextNumber<std::uint8_t>(decoder, angles_, item + 16, length < 3 ? 1 : 0);
    }
    if ((changed & kFirstUserDataChanged) != 0) NextByteOf(decoder, user_data_, item + 17);
    if ((changed & kFirstSourceChanged) != 0) {
      NextNumber<std::uint16_t>(decoder, sources_, item + 18);
    }
  }

 private:
  static std::size_t Context(std::uint32_t length) { return std::min<std::uint32_t>(length, 19); }

  static void NextCoordinate(ArithmeticDecoder& decoder,
                             IntegerDecoder& steps,
                             ThreeSteps& before,
                             std::size_t context,
                             char* coordinate) {
    const std::int32_t step = steps.Next(decoder, before.Median(), context);
    before.Add(step);
    SetNumber(NumberOf<std::uint32_t>(coordinate) + static_cast<std::uint32_t>(step), coordinate);
  }

  SymbolModel changed_{64};
  SymbolModels returns_{256, 256};
  SymbolModels classes_{256, 256};
  SymbolModels user_data_{256, 256};
  IntegerDecoder x_steps_{32, 1};
  IntegerDecoder y_steps_{32, 20};
  IntegerDecoder heights_{32, 20};
  IntegerDecoder intensities_{16, 1};
  IntegerDecoder angles_{8, 2};
  IntegerDecoder sources_{16, 1};
  ThreeSteps x_before_;
  ThreeSteps y_before_;
};

// One sequence of times, as multiples of a step: the code is the multiple, up to a most, or says
// that the time is there as a whole, or that it stays.
class FirstGpsTime11 final : public PointwiseItem {
 public:
  void Next(ArithmeticDecoder& decoder, char* item) override {
    const auto time = NumberOf<std::uint64_t>(item);
    const bool is_first = step_ == 0;
    const std::uint32_t code = decoder.Symbol(is_first ? first_codes_ : codes_);
    if (code == (is_first ? 2 : kWhole)) {
      SetNumber(WholeNumber(decoder), item);
    } else if (is_first ? code == 1 : code < kWhole) {
      const std::int32_t step = is_first ? FirstStep(decoder) : Step(decoder, code);
      SetNumber(time + static_cast<std::uint64_t>(std::int64_t{step}), item);
    }
  }

 private:
  static constexpr std::uint32_t kCodes = 512;
  static constexpr std::uint32_t kWhole = kCodes - 2;
  static constexpr int kMostUnlike = 3;

  std::int32_t FirstStep(ArithmeticDecoder& decoder) {
    step_ = numbers_.Next(decoder, 0, 0);
    return step_;
  }

  std::int32_t Step(ArithmeticDecoder& decoder, std::uint32_t code) {
    const auto predicted = static_cast<std::int32_t>(static_cast<std::uint32_t>(step_) * code);
    const std::int32_t step =
        numbers_.Next(decoder, code == 0 ? step_ / 4 : predicted, ContextOf(code));
    const bool unlike = code == 0 || code == kWhole - 1;
    if (code == 1 || (unlike && ++unlike_steps_ > kMostUnlike)) {
      step_ = step;
      unlike_steps_ = 0;
    }
    return step;
  }

  static std::size_t ContextOf(std::uint32_t code) {
    if (code < 2) return code == 1 ? 1 : 2;
    return code < 10 ? 3 : code < 50 ? 4 : 5;
  }

  SymbolModel first_codes_{3};
  SymbolModel codes_{kCodes};
  IntegerDecoder numbers_{32, 6};
  std::int32_t step_ = 0;
  int unlike_steps_ = 0;
};

class FirstRgb12 final : public PointwiseItem {
 public:
  void Next(ArithmeticDecoder& decoder, char* item) override {
    const std::uint32_t changed = decoder.Symbol(changed_);
    for (std::size_t i = 0; i < 6; ++i) {  // low and high byte of each channel
      if ((changed >> i & 1) != 0) NextNumber<std::uint8_t>(decoder, bytes_, item + i, i);
    }
  }

 private:
  SymbolModel changed_{64};
  IntegerDecoder bytes_{8, 6};
};

class FirstExtraBytes final : public PointwiseItem {
 public:
  explicit FirstExtraBytes(std::size_t count) : count_(count), bytes_(8, count) {}
  void Next(ArithmeticDecoder& decoder, char* item) override {
    for (std::size_t i = 0; i < count_; ++i) NextNumber<std::uint8_t>(decoder, bytes_, item + i, i);
  }

 private:
  std::size_t count_;
  IntegerDecoder bytes_;
};

// Which descriptor, where in the file and how large the packet is, and its place on the pulse.
class WavePacket13 final : public PointwiseItem {
 public:
  void Next(ArithmeticDecoder& decoder, char* item) override {
    item[0] = static_cast<char>(decoder.Symbol(descriptors_));
    NextPlace(decoder, item);
    NextNumber<std::uint32_t>(decoder, sizes_, item + kSizeAt);
    NextNumber<std::uint32_t>(decoder, returns_, item + kReturnAt);
    for (std::size_t i = 0; i < 3; ++i) {
      NextNumber<std::uint32_t>(decoder, directions_, item + kDirectionAt + 4 * i, i);
    }
  }

 private:
  static constexpr std::size_t kPlaceAt = 1;
  static constexpr std::size_t kSizeAt = 9;
  static constexpr std::size_t kReturnAt = 13;
  static constexpr std::size_t kDirectionAt = 17;

  // The same, behind the last one, some bytes on, or anywhere.
  void NextPlace(ArithmeticDecoder& decoder, char* item) {
    std::uint64_t place = NumberOf<std::uint64_t>(item + kPlaceAt);
    how_ = decoder.Symbol(ways_[how_]);
    if (how_ == 1) place += NumberOf<std::uint32_t>(item + kSizeAt);
    if (how_ == 2) {
      step_ = steps_.Next(decoder, step_);
      place += static_cast<std::uint64_t>(std::int64_t{step_});
    }
    if (how_ == 3) place = WholeNumber(decoder);
    SetNumber(place, item + kPlaceAt);
  }

  SymbolModel descriptors_{256};
  SymbolModels ways_{4, 4};
  IntegerDecoder steps_{32, 1};
  IntegerDecoder sizes_{32, 1};
  IntegerDecoder returns_{32, 1};
  IntegerDecoder directions_{32, 3};
  std::uint32_t how_ = 0;
  std::int32_t step_ = 0;
};

}  // namespace

std::unique_ptr<PointwiseItem> MakeFirstItem(const LazItem& item) {
  switch (item.type) {
    case LazItemType::kPoint10:
      return std::make_unique<FirstPoint10>();
    case LazItemType::kGpsTime11:
      return std::make_unique<FirstGpsTime11>();
    case LazItemType::kRgb12:
      return std::make_unique<FirstRgb12>();
    case LazItemType::kWavePacket13:
      return std::make_unique<WavePacket13>();
    default:
      return std::make_unique<FirstExtraBytes>(item.bytes);
  }
}

}  // namespace strata
