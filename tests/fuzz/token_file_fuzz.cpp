// The file of bearer tokens, and a token that somebody shows.
#include <set>
#include <string>
#include <string_view>

#include "fuzz/choices.hpp"
#include "fuzz/scratch_file.hpp"
#include "meshsmooth/error.hpp"
#include "token_file.hpp"

namespace {

using namespace meshsmooth;
using meshsmooth::testing::Choices;
using meshsmooth::testing::require;

/// Whose token it is by the file's description.
std::string owner_of(const std::string& token, const std::string& text) {
  std::string owner;
  for (std::size_t at = 0; at < text.size();) {
    const std::size_t end = std::min(text.find('\n', at), text.size());
    std::string line = text.substr(at, end - at);
    at = end + 1;
    if (line.ends_with('\r')) line.pop_back();
    const std::size_t colon = line.find(':');
    if (line.starts_with('#') || colon == std::string::npos) continue;
    if (line.substr(colon + 1) == token && !token.starts_with("sha256:")) {
      owner = line.substr(0, colon);
    }
  }
  return owner;
}

/// What the error says, but for where: the file's path is the target's own and could hold what a
/// line does.
std::string complaint(const InvalidOption& error, const std::string& path) {
  std::string text = error.what();
  if (const std::size_t at = text.find(path); at != std::string::npos) text.erase(at, path.size());
  if (const std::size_t at = text.find("line "); at != std::string::npos) {
    const std::size_t number = at + std::string_view("line ").size();
    text.erase(number, text.find_first_not_of("0123456789", number) - number);
  }
  return text;
}

/// All that it may say: that of files without a token.
std::set<std::string> complaints(const testing::ScratchFiles& files) {
  std::set<std::string> texts;
  for (const char* text : {"\n", "x\n", ":\n", "x:sha256:\n", "x:a\ny:a\n"}) {
    const auto path = files.write("tokens", text);
    try {
      const server::TokenFile tokens(path, std::chrono::hours(1));
      require(false, "a file without a token is wrong");
    } catch (const InvalidOption& error) {
      texts.insert(complaint(error, path));
    }
  }
  return texts;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const testing::ScratchFiles files;
  static const std::set<std::string> allowed = complaints(files);
  Choices choices({data, size});
  const std::string token = choices.text(40);
  const std::string text = choices.rest();
  const auto path = files.write("tokens", text);
  try {
    server::TokenFile tokens(path, std::chrono::hours(1));
    const auto found = tokens.find_caller(token);
    const std::string owner = owner_of(token, text);
    // A line may also give the digest of that very token, which the model does not know.
    require(owner.empty() || found.has_value(), "a token of the file is known");
    require(owner.empty() || *found == owner || text.find("sha256:") != std::string::npos,
            "a token is its owner's");
    require(found || owner.empty(), "nobody else comes in");
    require(!found || !found->empty(), "who comes in has a name");
    require(!found || !owner.empty() || text.find("sha256:") != std::string::npos,
            "what is not in the file is nobody's");
  } catch (const InvalidOption& error) {
    require(error.reason() == "OPTION_OUT_OF_RANGE", error.reason());
    require(allowed.contains(complaint(error, path)), "an error shows no token");
  }
  return 0;
}
