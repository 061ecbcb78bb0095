#include "client/formats/packets/velodyne_packet.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <iterator>
#include <numbers>

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "absl/strings/string_view.h"

#include "client/formats/parsing/byte_cursor.h"
#include "client/formats/parsing/cloud_builder.h"

namespace strata {
namespace {

constexpr std::uint8_t kHdl32e = 0x21;
constexpr std::uint8_t kVlp16 = 0x22;
constexpr std::uint8_t kTwoReturns = 0x39;
constexpr std::uint16_t kBlockFlag = 0xEEFF;

constexpr std::size_t kBlockBytes = 100;
constexpr std::size_t kBlockHeadBytes = 4;
constexpr std::size_t kShotBytes = 3;
constexpr std::size_t kShots = 32;  // of a block
constexpr std::size_t kTimeAt = 1200;
constexpr std::size_t kModeAt = 1204;
constexpr std::size_t kModelAt = 1205;

constexpr double kTickMetres = 0.002;
constexpr int kTurn = 36000;
// Farther apart two blocks are no neighbours: one was lost, or the sensor is told to leave out a
// sector. At its fastest, 20 turns a second, there are 0.8°.
constexpr int kMostStep = 200;

struct Laser {
  double elevation_deg;
  double lift_mm;  // of its beam's origin
};

// In the order of their shots.
constexpr std::array<Laser, 16> kVlp16Lasers = {{{-15, 11.2},
                                                 {1, -0.7},
                                                 {-13, 9.7},
                                                 {3, -2.2},
                                                 {-11, 8.1},
                                                 {5, -3.7},
                                                 {-9, 6.6},
                                                 {7, -5.1},
                                                 {-7, 5.1},
                                                 {9, -6.6},
                                                 {-5, 3.7},
                                                 {11, -8.1},
                                                 {-3, 2.2},
                                                 {13, -9.7},
                                                 {-1, 0.7},
                                                 {15, -11.2}}};
constexpr double kVlp16ShotUs = 2.304;
constexpr double kVlp16FiringUs = 55.296;  // of all 16, two of which are a block

constexpr double kHdl32eShotUs = 1.152;
constexpr double kHdl32eFiringUs = 46.08;

// Two rows of 16 by turns, 4/3° from one to the next.
Laser Hdl32eLaser(std::size_t i) {
  const double lowest_deg = i % 2 == 0 ? -92.0 / 3.0 : -28.0 / 3.0;
  return {std::round((lowest_deg + 4.0 / 3.0 * static_cast<double>(i / 2)) * 100.0) / 100.0, 0.0};
}

struct KnownSensor {
  std::uint8_t code;
  absl::string_view name;
};
constexpr KnownSensor kOtherSensors[] = {{0x23, "VLP-32A/B"},
                                         {0x24, "Puck Hi-Res"},
                                         {0x28, "VLP-32C"},
                                         {0x31, "Velarray"},
                                         {0x63, "VLS-128"},
                                         {0xA0, "HDL-64"},
                                         {0xA1, "VLS-128"}};

std::uint16_t Word(absl::string_view bytes, std::size_t at) {
  return ByteCursor(bytes.substr(at)).Get<std::uint16_t>();
}

std::uint8_t ByteOfPacket(absl::string_view bytes, std::size_t at) {
  return static_cast<std::uint8_t>(bytes[at]);
}

// When a shot of a block is, after the block's first [µs].
double ShotUs(bool vlp16, std::size_t shot) {
  if (!vlp16) return kHdl32eShotUs * static_cast<double>(shot);
  const std::size_t lasers = kVlp16Lasers.size();
  return kVlp16FiringUs * static_cast<double>(shot / lasers) +
         kVlp16ShotUs * static_cast<double>(shot % lasers);
}

double BlockUs(bool vlp16) { return vlp16 ? 2.0 * kVlp16FiringUs : kHdl32eFiringUs; }

double Radians(double degrees) { return degrees * std::numbers::pi / 180.0; }

}  // namespace

absl::Status VelodynePacket::Check() const {
  const std::uint8_t model = ByteOfPacket(payload_, kModelAt);
  if (model != kVlp16 && model != kHdl32e) {
    const auto* const known = std::find_if(
        std::begin(kOtherSensors), std::end(kOtherSensors), [model](const KnownSensor& sensor) {
          return sensor.code == model;
        });
    return absl::InvalidArgumentError(absl::StrCat(
        "packets of a ",
        known != std::end(kOtherSensors) ? known->name : "sensor not known",
        absl::StrFormat(" (factory byte 0x%02X)", model),
        "; VLP-16 (0x22) and HDL-32E (0x21) are read; VeloView writes PCD or CSV of others"));
  }
  for (std::size_t block = 0; block < kVelodyneBlocks; ++block) {
    if (Word(payload_, block * kBlockBytes) == kBlockFlag && azimuth(block) < kTurn) continue;
    return absl::InvalidArgumentError(
        absl::StrCat("block ", block, " of a packet has no flag 0xEEFF or no azimuth"));
  }
  return absl::OkStatus();
}

std::uint16_t VelodynePacket::azimuth(std::size_t block) const {
  return Word(payload_, block * kBlockBytes + 2);
}

bool VelodynePacket::IsVlp16() const { return ByteOfPacket(payload_, kModelAt) == kVlp16; }
bool VelodynePacket::HasTwoReturns() const {
  return ByteOfPacket(payload_, kModeAt) == kTwoReturns;
}

double VelodynePacket::time_us(std::size_t block) const {
  const std::size_t firing = HasTwoReturns() ? block / 2 : block;
  return ByteCursor(payload_.substr(kTimeAt)).Get<std::uint32_t>() +
         BlockUs(IsVlp16()) * static_cast<double>(firing);
}

// By how much the head turns during a block [0.01°]: as far as to the next one, or from the one
// before.
double VelodynePacket::StepOf(std::size_t block) const {
  const std::size_t next = HasTwoReturns() ? 2 : 1;
  const auto between = [this](std::size_t a, std::size_t b) {
    return (azimuth(b) - azimuth(a) + kTurn) % kTurn;
  };
  int step = block + next < kVelodyneBlocks ? between(block, block + next) : kTurn;
  if (step > kMostStep && block >= next) step = between(block - next, block);
  return step > kMostStep ? 0.0 : step;
}

absl::string_view VelodynePacket::Shot(std::size_t block, std::size_t i) const {
  return payload_.substr(block * kBlockBytes + kBlockHeadBytes + i * kShotBytes, kShotBytes);
}

void VelodynePacket::AddBlock(std::size_t block, double start_us, CloudBuilder& builder) const {
  const bool vlp16 = IsVlp16();
  const double step = StepOf(block);
  for (std::size_t i = 0; i < kShots; ++i) {
    const absl::string_view shot = Shot(block, i);
    const std::uint16_t ticks = Word(shot, 0);
    const bool again = HasTwoReturns() && block % 2 == 1 && shot == Shot(block - 1, i);
    if (ticks == 0 || again) continue;
    const Laser laser = vlp16 ? kVlp16Lasers[i % kVlp16Lasers.size()] : Hdl32eLaser(i);
    const double shot_us = ShotUs(vlp16, i);
    const double azimuth_deg = (azimuth(block) + step * shot_us / BlockUs(vlp16)) / 100.0;
    const double range = kTickMetres * ticks;
    const double level = range * std::cos(Radians(laser.elevation_deg));
    const std::array values = {
        level * std::cos(Radians(azimuth_deg)),
        -level * std::sin(Radians(azimuth_deg)),
        range * std::sin(Radians(laser.elevation_deg)) + laser.lift_mm / 1000.0,
        static_cast<double>(ByteOfPacket(shot, 2)),
        (time_us(block) + shot_us - start_us) / 1e6};
    builder.Add(values.data());
  }
}

}  // namespace strata
