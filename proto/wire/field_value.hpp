#pragma once

#include <google/protobuf/descriptor.h>
#include <google/protobuf/duration.pb.h>
#include <google/protobuf/message.h>

#include <chrono>
#include <optional>
#include <string>
#include <string_view>
#include <type_traits>

#include "meshsmooth/error.hpp"
#include "wire/codec.hpp"
#include "wire/wire_enum.hpp"

/// Fields of messages by their descriptors, as the tables of methods and options name them.
namespace meshsmooth::wire {

using google::protobuf::FieldDescriptor;
using google::protobuf::Message;

[[noreturn]] inline void throw_not_supported(const std::string& field, const std::string& what) {
  throw NotSupported("OPTION_NOT_SUPPORTED", field + ": " + what, {{"field", field}});
}

/// The enumerator of a number. Throws NotSupported (OPTION_NOT_SUPPORTED): "goal: unknown goal 9".
template <class Enum>
Enum decode_choice(int number, const std::string& field, std::string_view what) {
  if (const auto value = decode_enum<Enum>(number)) return *value;
  throw_not_supported(field, "unknown " + std::string(what) + " " + std::to_string(number));
}

inline const FieldDescriptor& field_of(const Message& message, std::string_view name) {
  return *message.GetDescriptor()->FindFieldByName(std::string(name));
}

/// Sets a field; without a value it stays unset.
template <class Value>
void set_field(Message& message, const FieldDescriptor& field, const Value& value) {
  const google::protobuf::Reflection& reflection = *message.GetReflection();
  if constexpr (std::is_same_v<Value, bool>) {
    reflection.SetBool(&message, &field, value);
  } else if constexpr (std::is_same_v<Value, double>) {
    reflection.SetDouble(&message, &field, value);
  } else if constexpr (std::is_same_v<Value, std::chrono::nanoseconds>) {
    reflection.MutableMessage(&message, &field)->CopyFrom(encode_duration(value));
  } else if constexpr (std::is_enum_v<Value>) {
    reflection.SetEnumValue(&message, &field, encode_enum(value));
  } else if (value) {
    set_field(message, field, *value);
  }
}

/// Reads a field if it is set; an enumeration's 0 is unset.
/// @param path of the field, for errors
/// @param noun of an enumeration's values
template <class Value>
void get_field(const Message& message, const FieldDescriptor& field, const std::string& path,
               std::string_view noun, Value& value) {
  const google::protobuf::Reflection& reflection = *message.GetReflection();
  if (!reflection.HasField(message, &field)) return;
  if constexpr (std::is_same_v<Value, bool>) {
    value = reflection.GetBool(message, &field);
  } else if constexpr (std::is_same_v<Value, double>) {
    value = reflection.GetDouble(message, &field);
  } else if constexpr (std::is_same_v<Value, std::chrono::nanoseconds>) {
    const Message& duration = reflection.GetMessage(message, &field);
    value = decode_duration(static_cast<const google::protobuf::Duration&>(duration), path);
  } else if constexpr (std::is_enum_v<Value>) {
    value = decode_choice<Value>(reflection.GetEnumValue(message, &field), path, noun);
  } else {
    get_field(message, field, path, noun, value.emplace());
  }
}

}  // namespace meshsmooth::wire
