// Bytes of messages as they were sent once: today's code reads them, and writes the same.
// A file in recorded/ is never changed, only added; `protoc --encode` makes them.
#include <google/protobuf/descriptor.h>
#include <google/protobuf/message.h>
#include <google/protobuf/text_format.h>
#include <google/protobuf/util/message_differencer.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <iterator>
#include <memory>
#include <string>

#include "meshsmooth/v1/error_details.pb.h"
#include "meshsmooth/v1/smoothing.pb.h"

namespace meshsmooth::wire {
namespace {

using google::protobuf::Message;

std::string read(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

std::unique_ptr<Message> make_message(const std::string& text) {
  const std::string mark = "# proto-message: ";
  const std::string type = text.substr(mark.size(), text.find('\n') - mark.size());
  const auto* const descriptor =
      google::protobuf::DescriptorPool::generated_pool()->FindMessageTypeByName(type);
  if (descriptor == nullptr) return nullptr;
  auto* const factory = google::protobuf::MessageFactory::generated_factory();
  return std::unique_ptr<Message>(factory->GetPrototype(descriptor)->New());
}

TEST(Recorded, MessagesMeanWhatTheyMeant) {
  // Link both files' messages.
  (void)v1::Status::default_instance();
  (void)v1::SmoothRequest::default_instance();
  int count = 0;
  for (const auto& entry : std::filesystem::directory_iterator(MESHSMOOTH_RECORDED_MESSAGES)) {
    if (entry.path().extension() != ".txtpb") continue;
    ++count;
    const std::string text = read(entry.path());
    const std::string bytes = read(std::filesystem::path(entry.path()).replace_extension(".bin"));
    const auto expected = make_message(text);
    ASSERT_NE(expected, nullptr) << entry.path();
    ASSERT_TRUE(google::protobuf::TextFormat::ParseFromString(text, expected.get()))
        << entry.path();
    const std::unique_ptr<Message> recorded(expected->New());
    ASSERT_TRUE(recorded->ParseFromString(bytes)) << entry.path();
    EXPECT_TRUE(google::protobuf::util::MessageDifferencer::Equals(*recorded, *expected))
        << entry.path() << ": " << recorded->DebugString();
    EXPECT_EQ(expected->SerializeAsString(), bytes) << entry.path();
  }
  EXPECT_GE(count, 11);
}

}  // namespace
}  // namespace meshsmooth::wire
