#include "tests/fuzz/proto_mutator.h"

#include <array>
#include <cstdint>
#include <limits>
#include <string>

#include <google/protobuf/descriptor.h>

namespace strata::fuzz {
namespace {

using google::protobuf::FieldDescriptor;
using google::protobuf::Message;
using google::protobuf::Reflection;

constexpr int kMostRepeated = 64;

template <std::size_t N, typename T>
T Pick(const std::array<T, N>& values, std::minstd_rand& random) {
  return values[random() % N];
}

double AnyDouble(std::minstd_rand& random) {
  constexpr double kInf = std::numeric_limits<double>::infinity();
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  constexpr std::array kOdd = {
      0.0, -0.0, 1.0, -1.0, 0.1, 0.5, 1e-9, 1e6, -1e6, 1e300, -1e300, kInf, -kInf, kNan};
  return random() % 2 == 0 ? Pick(kOdd, random) : static_cast<double>(random() % 4000) / 100 - 20;
}

std::uint64_t AnyWhole(std::minstd_rand& random) {
  constexpr std::array<std::uint64_t, 9> kOdd = {
      0, 1, 2, 255, 256, UINT32_MAX, std::uint64_t{1} << 62, INT64_MAX, UINT64_MAX};
  switch (random() % 4) {
    case 0:
      return Pick(kOdd, random);
    case 1:
      return random() % 300;
    default:  // what the world of the fuzzer has
      return random() % 5;
  }
}

// Names of things that the world of the fuzzer has, among others.
std::string AnyText(std::minstd_rand& random) {
  switch (random() % 10) {
    case 0:
      return "";
    case 1:
      return "../etc/passwd";
    case 2:
      return std::string(random() % 300, 'a');
    case 3:
      return "threads";
    case 4:
      return "default";
    case 5:
      return "run";
    case 6:
      return "first";
    case 7:
      return std::to_string(random() % 5);
    default:
      return "world";
  }
}

// Bytes of columns of points are floats and labels.
std::string AnyBytes(std::minstd_rand& random) {
  std::string bytes(12 * (random() % 20), '\0');
  for (std::size_t i = 0; i + 4 <= bytes.size(); i += 4) {
    const auto value = static_cast<float>(AnyDouble(random));
    if (random() % 4 != 0) {
      bytes.replace(i, 4, reinterpret_cast<const char*>(&value), 4);
    }
  }
  if (random() % 8 == 0 && !bytes.empty()) bytes.pop_back();
  return bytes;
}

void SetValue(Message& message, const FieldDescriptor& field, std::minstd_rand& random, bool add) {
  const Reflection& reflection = *message.GetReflection();
  const auto put = [&](auto set, auto append, const auto& value) {
    if (add) {
      (reflection.*append)(&message, &field, value);
    } else {
      (reflection.*set)(&message, &field, value);
    }
  };
  switch (field.cpp_type()) {
    case FieldDescriptor::CPPTYPE_INT32:
      return put(&Reflection::SetInt32,
                 &Reflection::AddInt32,
                 static_cast<std::int32_t>(AnyWhole(random)));
    case FieldDescriptor::CPPTYPE_INT64:
      return put(&Reflection::SetInt64,
                 &Reflection::AddInt64,
                 static_cast<std::int64_t>(AnyWhole(random)));
    case FieldDescriptor::CPPTYPE_UINT32:
      return put(&Reflection::SetUInt32,
                 &Reflection::AddUInt32,
                 static_cast<std::uint32_t>(AnyWhole(random)));
    case FieldDescriptor::CPPTYPE_UINT64:
      return put(&Reflection::SetUInt64, &Reflection::AddUInt64, AnyWhole(random));
    case FieldDescriptor::CPPTYPE_DOUBLE:
      return put(&Reflection::SetDouble, &Reflection::AddDouble, AnyDouble(random));
    case FieldDescriptor::CPPTYPE_FLOAT:
      return put(
          &Reflection::SetFloat, &Reflection::AddFloat, static_cast<float>(AnyDouble(random)));
    case FieldDescriptor::CPPTYPE_BOOL:
      return put(&Reflection::SetBool, &Reflection::AddBool, random() % 2 == 0);
    case FieldDescriptor::CPPTYPE_ENUM:
      return put(
          &Reflection::SetEnumValue, &Reflection::AddEnumValue, static_cast<int>(random() % 12));
    case FieldDescriptor::CPPTYPE_STRING: {
      const std::string text =
          field.type() == FieldDescriptor::TYPE_BYTES ? AnyBytes(random) : AnyText(random);
      if (add) {
        reflection.AddString(&message, &field, text);
      } else {
        reflection.SetString(&message, &field, text);
      }
      return;
    }
    case FieldDescriptor::CPPTYPE_MESSAGE:
      Mutate(add ? *reflection.AddMessage(&message, &field)
                 : *reflection.MutableMessage(&message, &field),
             random);
  }
}

}  // namespace

void Mutate(Message& message, std::minstd_rand& random) {
  const google::protobuf::Descriptor& descriptor = *message.GetDescriptor();
  const Reflection& reflection = *message.GetReflection();
  if (descriptor.field_count() == 0) return;
  const FieldDescriptor& field = *descriptor.field(
      static_cast<int>(random() % static_cast<unsigned>(descriptor.field_count())));
  if (random() % 8 == 0) return reflection.ClearField(&message, &field);
  if (!field.is_repeated()) return SetValue(message, field, random, false);
  const int size = reflection.FieldSize(message, &field);
  if (size < kMostRepeated && (size == 0 || random() % 2 == 0)) {
    SetValue(message, field, random, true);
  } else if (field.cpp_type() == FieldDescriptor::CPPTYPE_MESSAGE && random() % 4 != 0) {
    const int which = static_cast<int>(random() % static_cast<unsigned>(size));
    Mutate(*reflection.MutableRepeatedMessage(&message, &field, which), random);
  } else {
    reflection.RemoveLast(&message, &field);
  }
}

}  // namespace strata::fuzz
