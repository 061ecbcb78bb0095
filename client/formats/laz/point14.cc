#include "client/formats/laz/point14.h"

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <memory>
#include <utility>
#include <vector>

#include "client/formats/laz/arithmetic_decoder.h"
#include "client/formats/laz/gps_time_decoder.h"
#include "client/formats/laz/integer_decoder.h"
#include "client/formats/laz/item_bytes.h"
#include "client/formats/laz/step_median.h"

namespace strata {
namespace {

enum Point14Layer : std::size_t {
  kPlaneLayer,  // what changes, returns, x and y
  kHeightLayer,
  kClassLayer,
  kFlagsLayer,
  kIntensityLayer,
  kAngleLayer,
  kUserDataLayer,
  kSourceLayer,
  kTimeLayer,
};

// The contexts of x and y of a return, by how many returns its pulse has and which of them it is.
constexpr std::uint8_t kPlaneContexts[16][16] = {{0, 1, 2, 3, 4, 5, 3, 4, 4, 5, 5, 5, 5, 5, 5, 5},
                                                 {1, 0, 1, 3, 3, 3, 3, 3, 3, 3, 3, 3, 3, 3, 3, 3},
                                                 {2, 1, 2, 4, 4, 4, 4, 4, 4, 4, 4, 3, 3, 3, 3, 3},
                                                 {3, 3, 4, 5, 4, 4, 4, 4, 4, 4, 4, 4, 4, 4, 4, 4},
                                                 {4, 3, 4, 4, 5, 4, 4, 4, 4, 4, 4, 4, 4, 4, 4, 4},
                                                 {5, 3, 4, 4, 4, 5, 4, 4, 4, 4, 4, 4, 4, 4, 4, 4},
                                                 {3, 3, 4, 4, 4, 4, 5, 4, 4, 4, 4, 4, 4, 4, 4, 4},
                                                 {4, 3, 4, 4, 4, 4, 4, 5, 4, 4, 4, 4, 4, 4, 4, 4},
                                                 {4, 3, 4, 4, 4, 4, 4, 4, 5, 4, 4, 4, 4, 4, 4, 4},
                                                 {5, 3, 4, 4, 4, 4, 4, 4, 4, 5, 4, 4, 4, 4, 4, 4},
                                                 {5, 3, 4, 4, 4, 4, 4, 4, 4, 4, 5, 4, 4, 4, 4, 4},
                                                 {5, 3, 3, 4, 4, 4, 4, 4, 4, 4, 4, 5, 5, 4, 4, 4},
                                                 {5, 3, 3, 4, 4, 4, 4, 4, 4, 4, 4, 5, 5, 5, 4, 4},
                                                 {5, 3, 3, 4, 4, 4, 4, 4, 4, 4, 4, 4, 5, 5, 5, 4},
                                                 {5, 3, 3, 4, 4, 4, 4, 4, 4, 4, 4, 4, 4, 5, 5, 5},
                                                 {5, 3, 3, 4, 4, 4, 4, 4, 4, 4, 4, 4, 4, 4, 5, 5}};
constexpr std::size_t kPlaneContextCount = 6;
constexpr std::size_t kHeightContextCount14 = 8;

}  // namespace

// A point of 30 bytes (LAS 1.4, point data record format 6), its bits taken apart.
struct Point14::Fields {
  explicit Fields(const char* item)
      : x(NumberOf<std::int32_t>(item)),
        y(NumberOf<std::int32_t>(item + 4)),
        z(NumberOf<std::int32_t>(item + 8)),
        intensity(NumberOf<std::uint16_t>(item + 12)),
        number(NumberOf<std::uint8_t>(item + 14) & 15),
        count(NumberOf<std::uint8_t>(item + 14) >> 4),
        flags((NumberOf<std::uint8_t>(item + 15) & 15) | (NumberOf<std::uint8_t>(item + 15) >> 6)
                                                             << 4),
        channel(NumberOf<std::uint8_t>(item + 15) >> 4 & 3),
        label(NumberOf<std::uint8_t>(item + 16)),
        user_data(NumberOf<std::uint8_t>(item + 17)),
        angle(NumberOf<std::int16_t>(item + 18)),
        source(NumberOf<std::uint16_t>(item + 20)),
        time(NumberOf<std::uint64_t>(item + 22)) {}

  void Write(char* item) const {
    SetNumber(x, item);
    SetNumber(y, item + 4);
    SetNumber(z, item + 8);
    SetNumber(intensity, item + 12);
    item[14] = static_cast<char>(number | count << 4);
    item[15] = static_cast<char>((flags & 15) | channel << 4 | flags >> 4 << 6);
    SetNumber(label, item + 16);
    SetNumber(user_data, item + 17);
    SetNumber(angle, item + 18);
    SetNumber(source, item + 20);
    SetNumber(time, item + 22);
  }

  std::int32_t x, y, z;
  std::uint16_t intensity;
  std::uint32_t number, count;  // of this return and of all of its pulse, < 16
  std::uint32_t flags;          // of the classification, scan direction, edge of flight line
  std::uint32_t channel;
  std::uint8_t label, user_data;
  std::int16_t angle;
  std::uint16_t source;
  std::uint64_t time;
};

// What is known of the points of one of the scanner's channels.
struct Point14::Channel {
  explicit Channel(const Fields& first) : last(first), times(false, first.time) {
    intensity_before.fill(first.intensity);
    height_before.fill(first.z);
  }

  Fields last;
  bool time_changed = false;  // at `last`
  SymbolModels changed{8, 128};
  SymbolModel other_channel{3};
  SymbolModels counts{16, 16};
  SymbolModels numbers{16, 16};
  SymbolModel number_steps{13};
  IntegerDecoder x_steps{32, 2};
  IntegerDecoder y_steps{32, 22};
  IntegerDecoder heights{32, 20};
  std::array<StepMedian, 2 * kPlaneContextCount> x_medians;
  std::array<StepMedian, 2 * kPlaneContextCount> y_medians;
  std::array<std::int32_t, kHeightContextCount14> height_before;
  SymbolModels labels{64, 256};
  SymbolModels flags{64, 64};
  SymbolModels user_data{64, 256};
  IntegerDecoder intensities{16, 4};
  std::array<std::uint16_t, 8> intensity_before;
  IntegerDecoder angles{16, 2};
  IntegerDecoder sources{16, 1};
  GpsTimeDecoder times;
};

struct Point14::Change {
  explicit Change(std::uint32_t symbol)
      : number(symbol & 3),
        count((symbol >> 2 & 1) != 0),
        angle((symbol >> 3 & 1) != 0),
        time((symbol >> 4 & 1) != 0),
        source((symbol >> 5 & 1) != 0),
        channel((symbol >> 6 & 1) != 0) {}

  std::uint32_t number;  // stays, one more, one less, any other
  bool count, angle, time, source, channel;
};

Point14::Point14(std::uint16_t version,
                 std::vector<ArithmeticDecoder> layers,
                 const char* first,
                 std::size_t& channel)
    : tells_channel_(version >= kRemembersChannels), layers_(std::move(layers)) {
  const Fields fields(first);
  current_ = channel = fields.channel;
  channels_[current_] = std::make_unique<Channel>(fields);
}

Point14::~Point14() = default;

bool Point14::ok() const {
  return std::all_of(layers_.begin(), layers_.end(), [](const auto& layer) { return layer.ok(); });
}

void Point14::Next(std::size_t& channel, char* item) {
  const Change change = NextChange();
  channel = change.channel || tells_channel_ ? current_ : 0;
  Channel& now = *channels_[current_];
  NextReturn(change, now);
  NextPlace(change, now);
  NextFlags(now);
  NextRest(change, now);
  now.time_changed = change.time;
  now.last.Write(item);
}

// Also goes to the channel of the next point.
Point14::Change Point14::NextChange() {
  ArithmeticDecoder& plane = layers_[kPlaneLayer];
  Channel& before = *channels_[current_];
  const Fields& last = before.last;
  const std::size_t context = (last.number == 1 ? 1U : 0U) | (last.number >= last.count ? 2U : 0U) |
                              (before.time_changed ? 4U : 0U);
  const Change change(plane.Symbol(before.changed[context]));
  if (!change.channel) return change;
  current_ = (current_ + plane.Symbol(before.other_channel) + 1) % kScannerChannels;
  std::unique_ptr<Channel>& channel = channels_[current_];
  if (channel == nullptr) channel = std::make_unique<Channel>(last);
  channel->last.channel = static_cast<std::uint32_t>(current_);
  return change;
}

void Point14::NextReturn(const Change& change, Channel& channel) {
  ArithmeticDecoder& plane = layers_[kPlaneLayer];
  Fields& last = channel.last;
  if (change.count) last.count = plane.Symbol(channel.counts[last.count]);
  if (change.number == 1) last.number += 1;
  if (change.number == 2) last.number += 15;
  if (change.number == 3) {
    last.number = change.time ? plane.Symbol(channel.numbers[last.number])
                              : last.number + plane.Symbol(channel.number_steps) + 2;
  }
  last.number %= 16;
}

void Point14::NextPlace(const Change& change, Channel& channel) {
  Fields& last = channel.last;
  const auto step = [](std::int32_t by, std::int32_t& coordinate) {
    coordinate = static_cast<std::int32_t>(static_cast<std::uint32_t>(coordinate) +
                                           static_cast<std::uint32_t>(by));
  };
  const std::size_t context =
      std::size_t{2} * kPlaneContexts[last.count][last.number] + (change.time ? 1 : 0);
  const std::size_t single = last.count == 1 ? 1 : 0;
  ArithmeticDecoder& plane = layers_[kPlaneLayer];
  StepMedian& x_median = channel.x_medians[context];
  const std::int32_t dx = channel.x_steps.Next(plane, x_median.Get(), single);
  x_median.Add(dx);
  step(dx, last.x);
  const std::size_t x_length = EvenLength(channel.x_steps.length(), 20);
  StepMedian& y_median = channel.y_medians[context];
  const std::int32_t dy = channel.y_steps.Next(plane, y_median.Get(), single + x_length);
  y_median.Add(dy);
  step(dy, last.y);
  if (layers_[kHeightLayer].empty()) return;
  const std::size_t length =
      EvenLength((channel.x_steps.length() + channel.y_steps.length()) / 2, 18);
  const int level = std::abs(static_cast<int>(last.count) - static_cast<int>(last.number));
  std::int32_t& height = channel.height_before[static_cast<std::size_t>(std::min(level, 7))];
  height = channel.heights.Next(layers_[kHeightLayer], height, single + length);
  last.z = height;
}

void Point14::NextFlags(Channel& channel) {
  Fields& last = channel.last;
  if (ArithmeticDecoder& layer = layers_[kClassLayer]; !layer.empty()) {
    const bool single = last.number == 1 && last.number >= last.count;
    const std::size_t context = std::size_t{2} * (last.label & 31U) + (single ? 1 : 0);
    last.label = static_cast<std::uint8_t>(layer.Symbol(channel.labels[context]));
  }
  if (ArithmeticDecoder& layer = layers_[kFlagsLayer]; !layer.empty()) {
    last.flags = layer.Symbol(channel.flags[last.flags]);
  }
}

void Point14::NextRest(const Change& change, Channel& channel) {
  Fields& last = channel.last;
  if (ArithmeticDecoder& layer = layers_[kIntensityLayer]; !layer.empty()) {
    const std::size_t context =
        (last.number == 1 ? 2U : 0U) | (last.number >= last.count ? 1U : 0U);
    std::uint16_t& before = channel.intensity_before[2 * context + (change.time ? 1 : 0)];
    before = static_cast<std::uint16_t>(channel.intensities.Next(layer, before, context));
    last.intensity = before;
  }
  if (ArithmeticDecoder& layer = layers_[kAngleLayer]; change.angle && !layer.empty()) {
    last.angle =
        static_cast<std::int16_t>(channel.angles.Next(layer, last.angle, change.time ? 1 : 0));
  }
  if (ArithmeticDecoder& layer = layers_[kUserDataLayer]; !layer.empty()) {
    last.user_data = static_cast<std::uint8_t>(layer.Symbol(channel.user_data[last.user_data / 4]));
  }
  if (ArithmeticDecoder& layer = layers_[kSourceLayer]; change.source && !layer.empty()) {
    last.source = static_cast<std::uint16_t>(channel.sources.Next(layer, last.source));
  }
  if (ArithmeticDecoder& layer = layers_[kTimeLayer]; change.time && !layer.empty()) {
    last.time = channel.times.Next(layer);
  }
}

}  // namespace strata
