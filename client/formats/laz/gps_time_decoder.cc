#include "client/formats/laz/gps_time_decoder.h"

#include <cstddef>
#include <cstdint>

#include "client/formats/laz/arithmetic_decoder.h"

namespace strata {
namespace {

// What is coded where the sequence has a step: a multiple of it up to the largest, then the
// negative ones, then (GPSTIME11) nothing, a far time, or one of the three other sequences.
constexpr std::uint32_t kMostSteps = 500;
constexpr std::uint32_t kMostStepsBack = 10;
constexpr std::uint32_t kMultiples = kMostSteps + kMostStepsBack + 1;
constexpr std::uint32_t kOtherCodes = 4;
constexpr int kMostUnlikeSteps = 3;

// Contexts of numbers_.
enum GpsTimeContext : std::size_t {
  kNoStep,
  kOneStep,
  kFewSteps,
  kManySteps,
  kMostStepsOrMore,
  kFewStepsBack,
  kMostStepsBackOrMore,
  kZeroSteps,
  kFar,
  kContexts,
};

std::int32_t Times(std::int32_t step, std::int32_t factor) {
  return static_cast<std::int32_t>(static_cast<std::uint32_t>(step) *
                                   static_cast<std::uint32_t>(factor));
}

GpsTimeContext ContextOf(std::int32_t factor) {
  if (factor == 1) return kOneStep;
  if (factor == 0) return kZeroSteps;
  if (factor == static_cast<std::int32_t>(kMostSteps)) return kMostStepsOrMore;
  if (factor == -static_cast<std::int32_t>(kMostStepsBack)) return kMostStepsBackOrMore;
  if (factor < 0) return kFewStepsBack;
  return factor < 10 ? kFewSteps : kManySteps;
}

}  // namespace

GpsTimeDecoder::GpsTimeDecoder(bool may_stay, std::uint64_t first)
    : stay_(may_stay ? 1 : 0),
      first_steps_(stay_ + 1 + kOtherCodes),
      steps_(kMultiples + stay_ + kOtherCodes),
      numbers_(32, kContexts) {
  sequences_[0].time = first;
}

std::uint64_t GpsTimeDecoder::Next(ArithmeticDecoder& decoder) {
  // An encoder changes to the right sequence at once.
  for (std::size_t i = 0; i < sequences_.size(); ++i) {
    const Found found = sequences_[current_].step == 0 ? FirstStep(decoder) : Step(decoder);
    if (found == Found::kTime) break;
  }
  return sequences_[current_].time;
}

GpsTimeDecoder::Found GpsTimeDecoder::FirstStep(ArithmeticDecoder& decoder) {
  Sequence& sequence = sequences_[current_];
  const std::uint32_t code = decoder.Symbol(first_steps_);
  if (code < stay_) return Found::kTime;
  if (code == stay_) {
    sequence.step = numbers_.Next(decoder, 0, kNoStep);
    sequence.time += static_cast<std::uint64_t>(std::int64_t{sequence.step});
    sequence.unlike_steps = 0;
  } else if (code == stay_ + 1) {
    FarTime(decoder);
  } else {
    Switch(code - stay_ - 1);
    return Found::kOtherSequence;
  }
  return Found::kTime;
}

GpsTimeDecoder::Found GpsTimeDecoder::Step(ArithmeticDecoder& decoder) {
  const std::uint32_t code = decoder.Symbol(steps_);
  if (code < kMultiples) {
    StepBy(decoder, code);
  } else if (code == kMultiples + stay_) {
    FarTime(decoder);
  } else if (code > kMultiples + stay_) {
    Switch(code - kMultiples - stay_);
    return Found::kOtherSequence;
  }
  return Found::kTime;
}

void GpsTimeDecoder::StepBy(ArithmeticDecoder& decoder, std::uint32_t code) {
  Sequence& sequence = sequences_[current_];
  const auto factor = code <= kMostSteps ? static_cast<std::int32_t>(code)
                                         : static_cast<std::int32_t>(kMostSteps - code);
  const GpsTimeContext context = ContextOf(factor);
  const std::int32_t difference = numbers_.Next(decoder, Times(sequence.step, factor), context);
  sequence.time += static_cast<std::uint64_t>(std::int64_t{difference});
  if (context == kOneStep) sequence.unlike_steps = 0;
  const bool unlike =
      context == kZeroSteps || context == kMostStepsOrMore || context == kMostStepsBackOrMore;
  if (!unlike || ++sequence.unlike_steps <= kMostUnlikeSteps) return;
  sequence.step = difference;
  sequence.unlike_steps = 0;
}

// The upper half as what it differs by, the lower as it is: a sequence of its own begins.
void GpsTimeDecoder::FarTime(ArithmeticDecoder& decoder) {
  const auto before = static_cast<std::int32_t>(sequences_[current_].time >> 32);
  newest_ = (newest_ + 1) % sequences_.size();
  current_ = newest_;
  const auto high = static_cast<std::uint32_t>(numbers_.Next(decoder, before, kFar));
  sequences_[current_] = {.time = std::uint64_t{high} << 32 | decoder.Bits(32)};
}

}  // namespace strata
