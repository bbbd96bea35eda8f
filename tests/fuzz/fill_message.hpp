#pragma once

#include <google/protobuf/message.h>

#include <string>

#include "fuzz/choices.hpp"

namespace meshsmooth::testing {

/// Valid UTF-8, as a string that has come over the wire is.
inline std::string printable(std::string text) {
  for (char& c : text) c = static_cast<char>(0x20 + static_cast<unsigned char>(c) % 0x5f);
  return text;
}

inline void fill_message(google::protobuf::Message& message, Choices& choices, int depth = 0);

/// One value of the field: set, or appended to a repeated one.
inline void fill_field(google::protobuf::Message& message,
                       const google::protobuf::FieldDescriptor& field, Choices& choices,
                       int depth) {
  using Field = google::protobuf::FieldDescriptor;
  const google::protobuf::Reflection& reflection = *message.GetReflection();
  const auto put = [&](auto add, auto set, auto value) {
    if (field.is_repeated()) {
      (reflection.*add)(&message, &field, value);
    } else {
      (reflection.*set)(&message, &field, value);
    }
  };
  using Reflection = google::protobuf::Reflection;
  switch (field.cpp_type()) {
    case Field::CPPTYPE_INT32:
      return put(&Reflection::AddInt32, &Reflection::SetInt32,
                 static_cast<std::int32_t>(choices.number()));
    case Field::CPPTYPE_INT64:
      return put(&Reflection::AddInt64, &Reflection::SetInt64, choices.number());
    case Field::CPPTYPE_UINT32:
      return put(&Reflection::AddUInt32, &Reflection::SetUInt32,
                 static_cast<std::uint32_t>(choices.number()));
    case Field::CPPTYPE_UINT64:
      return put(&Reflection::AddUInt64, &Reflection::SetUInt64,
                 static_cast<std::uint64_t>(choices.number()));
    case Field::CPPTYPE_DOUBLE:
      return put(&Reflection::AddDouble, &Reflection::SetDouble, choices.real());
    case Field::CPPTYPE_FLOAT:
      return put(&Reflection::AddFloat, &Reflection::SetFloat, static_cast<float>(choices.real()));
    case Field::CPPTYPE_BOOL:
      return put(&Reflection::AddBool, &Reflection::SetBool, choices.flag());
    case Field::CPPTYPE_ENUM:  // also such as no version has
      return put(&Reflection::AddEnumValue, &Reflection::SetEnumValue,
                 static_cast<int>(choices.number()));
    case Field::CPPTYPE_STRING:
      return put(
          &Reflection::AddString, &Reflection::SetString,
          field.type() == Field::TYPE_BYTES ? choices.text(64) : printable(choices.text(40)));
    case Field::CPPTYPE_MESSAGE:
      return fill_message(*(field.is_repeated() ? reflection.AddMessage(&message, &field)
                                                : reflection.MutableMessage(&message, &field)),
                          choices, depth + 1);
  }
}

/// Any message of this type, with values of its own types, known and unknown
/// fields: the grammar of everything that can be told to the other end.
inline void fill_message(google::protobuf::Message& message, Choices& choices, int depth) {
  const google::protobuf::Descriptor& type = *message.GetDescriptor();
  for (std::size_t left = choices.below(12); left > 0 && depth < 6 && !choices.empty(); --left) {
    const std::size_t place = choices.below(static_cast<std::size_t>(type.field_count()) + 1);
    if (place < static_cast<std::size_t>(type.field_count())) {
      fill_field(message, *type.field(static_cast<int>(place)), choices, depth);
    } else {
      message.GetReflection()->MutableUnknownFields(&message)->AddVarint(
          1000 + static_cast<int>(choices.byte()), static_cast<std::uint64_t>(choices.number()));
    }
  }
}

}  // namespace meshsmooth::testing
