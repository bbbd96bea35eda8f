#include <wire/codec.hpp>

int main() {
  const meshsmooth::SmoothOptions options{.max_iterations = 7};
  const auto message = meshsmooth::wire::encode_options(options);
  return meshsmooth::wire::decode_options(message).max_iterations == 7 ? 0 : 1;
}
