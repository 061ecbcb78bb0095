#include "client/formats/laz/layered_items.h"

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "client/formats/laz/arithmetic_decoder.h"
#include "client/formats/laz/colour_decoder.h"
#include "client/formats/laz/item_bytes.h"
#include "client/formats/laz/laz_format.h"
#include "client/formats/laz/point14.h"

namespace strata {
namespace {

// What is known of the points of each channel: the last value, and models.
template <typename Value, typename Models>
class ChannelMemory {
 public:
  struct Now {
    Value& last;
    Models& models;
  };

  ChannelMemory(std::uint16_t version, std::size_t channel, const Value& first, const Models& fresh)
      : fresh_(fresh), version_(version), current_(channel) {
    channels_[channel].emplace(first, fresh);
  }

  Now At(std::size_t channel) {
    Value* last = &channels_[current_]->first;
    if (channel != current_) {
      const bool is_new = !channels_[channel].has_value();
      if (is_new) channels_[channel].emplace(*last, fresh_);
      if (is_new || version_ >= kRemembersChannels) last = &channels_[channel]->first;
      current_ = channel;
    }
    return {*last, channels_[channel]->second};
  }

 private:
  Models fresh_;
  std::uint16_t version_;
  std::size_t current_;
  std::array<std::optional<std::pair<Value, Models>>, kScannerChannels> channels_;
};

bool AllOk(const std::vector<ArithmeticDecoder>& layers) {
  return std::all_of(layers.begin(), layers.end(), [](const auto& layer) { return layer.ok(); });
}

// Red, green, blue and what may be behind them.
struct Colour14Value {
  explicit Colour14Value(const char* item, bool has_infrared) {
    for (std::size_t i = 0; i < colour.size(); ++i)
      colour[i] = NumberOf<std::uint16_t>(item + 2 * i);
    if (has_infrared) infrared = NumberOf<std::uint16_t>(item + 6);
  }
  Channels colour{};
  std::uint16_t infrared = 0;
};

struct Colour14Models {
  ColourDecoder colour;
  InfraredDecoder infrared;
};

// RGB14, and RGBNIR14 with a second layer.
class Colour14 final : public LayeredItem {
 public:
  Colour14(std::uint16_t version,
           std::vector<ArithmeticDecoder> layers,
           const char* first,
           std::size_t channel)
      : layers_(std::move(layers)),
        memory_(version, channel, Colour14Value(first, HasInfrared()), Colour14Models()) {}

  void Next(std::size_t& channel, char* item) override {
    const auto [last, models] = memory_.At(channel);
    if (!layers_[0].empty()) last.colour = models.colour.Next(layers_[0], last.colour);
    for (std::size_t i = 0; i < last.colour.size(); ++i) SetNumber(last.colour[i], item + 2 * i);
    if (!HasInfrared()) return;
    if (!layers_[1].empty()) last.infrared = models.infrared.Next(layers_[1], last.infrared);
    SetNumber(last.infrared, item + 6);
  }

  bool ok() const override { return AllOk(layers_); }

 private:
  bool HasInfrared() const { return layers_.size() > 1; }

  std::vector<ArithmeticDecoder> layers_;
  ChannelMemory<Colour14Value, Colour14Models> memory_;
};

// What a program added to the points: each byte is a layer.
class ExtraBytes14 final : public LayeredItem {
 public:
  ExtraBytes14(std::uint16_t version,
               std::vector<ArithmeticDecoder> layers,
               const char* first,
               std::size_t channel)
      : layers_(std::move(layers)),
        memory_(version,
                channel,
                std::vector<char>(first, first + layers_.size()),
                SymbolModels(layers_.size(), 256)) {}

  void Next(std::size_t& channel, char* item) override {
    const auto [last, models] = memory_.At(channel);
    for (std::size_t i = 0; i < layers_.size(); ++i) {
      if (!layers_[i].empty()) {
        last[i] =
            static_cast<char>(static_cast<std::uint8_t>(last[i]) + layers_[i].Symbol(models[i]));
      }
      item[i] = last[i];
    }
  }

  bool ok() const override { return AllOk(layers_); }

 private:
  std::vector<ArithmeticDecoder> layers_;
  ChannelMemory<std::vector<char>, SymbolModels> memory_;
};

// Wave packets, which nobody looks at.
class PassedOver final : public LayeredItem {
 public:
  void Next(std::size_t& /*channel*/, char* /*item*/) override {}
  bool ok() const override { return true; }
};

}  // namespace

std::size_t LayersOf(const LazItem& item) {
  switch (item.type) {
    case LazItemType::kPoint14:
      return kPoint14Layers;
    case LazItemType::kRgbNir14:
      return 2;
    case LazItemType::kByte14:
      return item.bytes;
    default:
      return 1;
  }
}

std::unique_ptr<LayeredItem> MakeLayeredItem(const LazItem& item,
                                             std::vector<ArithmeticDecoder> layers,
                                             const char* first,
                                             std::size_t& channel) {
  switch (item.type) {
    case LazItemType::kPoint14:
      return std::make_unique<Point14>(item.version, std::move(layers), first, channel);
    case LazItemType::kRgb14:
    case LazItemType::kRgbNir14:
      return std::make_unique<Colour14>(item.version, std::move(layers), first, channel);
    case LazItemType::kByte14:
      return std::make_unique<ExtraBytes14>(item.version, std::move(layers), first, channel);
    default:
      return std::make_unique<PassedOver>();
  }
}

}  // namespace strata
