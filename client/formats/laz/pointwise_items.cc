#include "client/formats/laz/pointwise_items.h"

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <memory>

#include "client/formats/laz/arithmetic_decoder.h"
#include "client/formats/laz/colour_decoder.h"
#include "client/formats/laz/first_items.h"
#include "client/formats/laz/gps_time_decoder.h"
#include "client/formats/laz/integer_decoder.h"
#include "client/formats/laz/item_bytes.h"
#include "client/formats/laz/laz_format.h"
#include "client/formats/laz/step_median.h"

namespace strata {
namespace {

// Which context a return has, by how many returns its pulse has and which of them it is. What
// cannot be, such as the third of two, is in files all the same.
constexpr std::uint8_t kReturnContexts[8][8] = {{15, 14, 13, 12, 11, 10, 9, 8},
                                                {14, 0, 1, 3, 6, 10, 10, 9},
                                                {13, 1, 2, 4, 7, 11, 11, 10},
                                                {12, 3, 4, 5, 8, 12, 12, 11},
                                                {11, 6, 7, 8, 9, 13, 13, 12},
                                                {10, 10, 11, 12, 13, 14, 14, 13},
                                                {9, 10, 11, 12, 13, 14, 15, 14},
                                                {8, 9, 10, 11, 12, 13, 14, 15}};
constexpr std::size_t kReturnContextCount = 16;
constexpr std::size_t kHeightContextCount = 8;

// The symbol of what changed, bit by bit.
enum Point10Change : std::uint32_t {
  kSourceChanged = 1,
  kUserDataChanged = 2,
  kAngleChanged = 4,
  kClassChanged = 8,
  kIntensityChanged = 16,
  kReturnsChanged = 32,
};

// Where the fields of a point are (LAS 1.0, point data record format 0).
constexpr std::size_t kYAt = 4;
constexpr std::size_t kZAt = 8;
constexpr std::size_t kIntensityBytesAt = 12;
constexpr std::size_t kReturnsAt = 14;
constexpr std::size_t kClassAt = 15;
constexpr std::size_t kAngleAt = 16;
constexpr std::size_t kUserDataAt = 17;
constexpr std::size_t kSourceAt = 18;

std::uint8_t ByteAt(const char* item, std::size_t at) {
  return static_cast<std::uint8_t>(item[at]);
}

void AddTo(std::int32_t step, char* coordinate) {
  SetNumber(NumberOf<std::uint32_t>(coordinate) + static_cast<std::uint32_t>(step), coordinate);
}

class Point10 final : public PointwiseItem {
 public:
  void Next(ArithmeticDecoder& decoder, char* item) override {
    const std::uint32_t changed = decoder.Symbol(changed_);
    if ((changed & kReturnsChanged) != 0) Replace(decoder, returns_, kReturnsAt, item);
    const std::uint32_t number = ByteAt(item, kReturnsAt) & 7;
    const std::uint32_t count = ByteAt(item, kReturnsAt) >> 3 & 7;
    const std::size_t context = kReturnContexts[count][number];
    NextIntensity(decoder, (changed & kIntensityChanged) != 0, context, item);
    if ((changed & kClassChanged) != 0) Replace(decoder, classes_, kClassAt, item);
    if ((changed & kAngleChanged) != 0) {
      SymbolModel& model = angles_[ByteAt(item, kReturnsAt) >> 6 & 1];
      item[kAngleAt] = static_cast<char>(ByteAt(item, kAngleAt) + decoder.Symbol(model));
    }
    if ((changed & kUserDataChanged) != 0) Replace(decoder, user_data_, kUserDataAt, item);
    if ((changed & kSourceChanged) != 0) {
      const std::int32_t last = NumberOf<std::uint16_t>(item + kSourceAt);
      SetNumber(static_cast<std::uint16_t>(sources_.Next(decoder, last)), item + kSourceAt);
    }
    const auto level =
        static_cast<std::size_t>(std::abs(static_cast<int>(count) - static_cast<int>(number)));
    NextPlace(decoder, count == 1 ? 1 : 0, context, level, item);
  }

 private:
  static void Replace(ArithmeticDecoder& decoder,
                      SymbolModels& models,
                      std::size_t at,
                      char* item) {
    item[at] = static_cast<char>(decoder.Symbol(models[ByteAt(item, at)]));
  }

  void NextIntensity(ArithmeticDecoder& decoder, bool changed, std::size_t context, char* item) {
    std::uint16_t& last = intensity_before_[context];
    if (changed) {
      last = static_cast<std::uint16_t>(
          intensities_.Next(decoder, last, std::min<std::size_t>(context, 3)));
    }
    SetNumber(last, item + kIntensityBytesAt);
  }

  void NextPlace(ArithmeticDecoder& decoder,
                 std::size_t single,
                 std::size_t context,
                 std::size_t level,
                 char* item) {
    const std::int32_t dx = x_steps_.Next(decoder, x_medians_[context].Get(), single);
    x_medians_[context].Add(dx);
    AddTo(dx, item);
    const std::size_t x_length = EvenLength(x_steps_.length(), 20);
    const std::int32_t dy = y_steps_.Next(decoder, y_medians_[context].Get(), single + x_length);
    y_medians_[context].Add(dy);
    AddTo(dy, item + kYAt);
    const std::size_t length = EvenLength((x_steps_.length() + y_steps_.length()) / 2, 18);
    heights_before_[level] = heights_.Next(decoder, heights_before_[level], single + length);
    SetNumber(heights_before_[level], item + kZAt);
  }

  SymbolModel changed_{64};
  SymbolModels returns_{256, 256};
  SymbolModels classes_{256, 256};
  SymbolModels angles_{2, 256};
  SymbolModels user_data_{256, 256};
  IntegerDecoder intensities_{16, 4};
  IntegerDecoder sources_{16, 1};
  IntegerDecoder x_steps_{32, 2};
  IntegerDecoder y_steps_{32, 22};
  IntegerDecoder heights_{32, 20};
  std::array<StepMedian, kReturnContextCount> x_medians_;
  std::array<StepMedian, kReturnContextCount> y_medians_;
  std::array<std::uint16_t, kReturnContextCount> intensity_before_{};
  std::array<std::int32_t, kHeightContextCount> heights_before_{};
};

class GpsTime11 final : public PointwiseItem {
 public:
  explicit GpsTime11(const char* first) : times_(true, NumberOf<std::uint64_t>(first)) {}
  void Next(ArithmeticDecoder& decoder, char* item) override {
    SetNumber(times_.Next(decoder), item);
  }

 private:
  GpsTimeDecoder times_;
};

class Rgb12 final : public PointwiseItem {
 public:
  void Next(ArithmeticDecoder& decoder, char* item) override {
    Channels last;
    for (std::size_t i = 0; i < last.size(); ++i) last[i] = NumberOf<std::uint16_t>(item + 2 * i);
    const Channels next = colours_.Next(decoder, last);
    for (std::size_t i = 0; i < next.size(); ++i) SetNumber(next[i], item + 2 * i);
  }

 private:
  ColourDecoder colours_;
};

// What a program added to the points, byte by byte.
class ExtraBytes final : public PointwiseItem {
 public:
  explicit ExtraBytes(std::size_t bytes) : bytes_(bytes), differences_(bytes, 256) {}
  void Next(ArithmeticDecoder& decoder, char* item) override {
    for (std::size_t i = 0; i < bytes_; ++i) {
      item[i] = static_cast<char>(ByteAt(item, i) + decoder.Symbol(differences_[i]));
    }
  }

 private:
  std::size_t bytes_;
  SymbolModels differences_;
};

}  // namespace

std::unique_ptr<PointwiseItem> MakePointwiseItem(const LazItem& item, const char* first) {
  if (item.version == 1) return MakeFirstItem(item);
  switch (item.type) {
    case LazItemType::kPoint10:
      return std::make_unique<Point10>();
    case LazItemType::kGpsTime11:
      return std::make_unique<GpsTime11>(first);
    case LazItemType::kRgb12:
      return std::make_unique<Rgb12>();
    default:
      return std::make_unique<ExtraBytes>(item.bytes);
  }
}

}  // namespace strata
