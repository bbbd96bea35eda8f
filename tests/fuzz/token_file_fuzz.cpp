// The file of bearer tokens, and a token that somebody shows.
#include "fuzz/choices.hpp"
#include "fuzz/scratch_file.hpp"
#include "meshsmooth/error.hpp"
#include "token_file.hpp"

namespace {

using namespace meshsmooth;
using meshsmooth::testing::Choices;
using meshsmooth::testing::require;

/// Whose token it is by the file's description: of several equal ones the last counts.
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

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const testing::ScratchFiles files;
  Choices choices({data, size});
  const std::string token = choices.text(40);
  const std::string text = choices.rest();
  const auto path = files.write("tokens", text);
  try {
    server::TokenFile tokens(path, std::chrono::hours(1));
    const auto found = tokens.identity_of(token);
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
    // Long enough to be no chance: an error never shows a token.
    require(token.size() < 12 || std::string(error.what()).find(token) == std::string::npos,
            "an error shows no token");
  }
  return 0;
}
