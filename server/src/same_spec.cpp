#include "same_spec.hpp"

#include <google/protobuf/util/message_differencer.h>

#include <vector>

namespace meshsmooth::server {

std::string differing_field(const v1::JobSpec& a, const v1::JobSpec& b) {
  const google::protobuf::Descriptor* const type = v1::JobSpec::descriptor();
  for (int i = 0; i < type->field_count(); ++i) {
    const google::protobuf::FieldDescriptor* const field = type->field(i);
    if (field->number() == v1::JobSpec::kProgressIntervalFieldNumber ||
        field->number() == v1::JobSpec::kMaxResultChunkBytesFieldNumber) {
      continue;
    }
    const std::vector fields = {field};
    google::protobuf::util::MessageDifferencer differencer;
    if (!differencer.CompareWithFields(a, b, fields, fields)) return field->name();
  }
  return {};
}

}  // namespace meshsmooth::server
