#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "text.hpp"
#include "vtk/number_block.hpp"

namespace meshsmooth::formats {

/// The arrays of a legacy VTK file, in text or binary, on the way through it.
class LegacyArrays {
 public:
  /// `scanner` is moved over what is read. All must outlive this object.
  LegacyArrays(const std::filesystem::path& path, std::string_view file, Scanner& scanner)
      : path_(path), file_(file), scanner_(scanner) {}
  void set_binary(bool binary) { binary_ = binary; }

  /// Of a type as the file calls it, with what VTK notes of it behind. An empty block where they
  /// are not numbers.
  NumberBlock read_array(std::string_view type_name, std::size_t rows, std::size_t width);
  NumberBlock read_numbers_of(NumberType type, std::size_t count);
  /// Bytes in binary files, from 0 to 1 in text.
  void read_colours(std::size_t width, std::size_t rows);
  /// What VTK's reader of text needs to find instead of numbers that it does not know.
  [[nodiscard]] std::vector<Edit>& replaced() { return replaced_; }

 private:
  [[nodiscard]] std::size_t product(std::size_t rows, std::size_t width) const;
  void check_number(std::string_view word, NumberType type);
  /// In text a line for each; in binary files its length before it, in one, two, four or eight
  /// bytes, as the first two bits say.
  void read_strings(std::size_t count);
  /// What may follow an array: names of its components and more, up to an empty line.
  void skip_metadata(std::size_t width);

  const std::filesystem::path& path_;
  std::string_view file_;
  Scanner& scanner_;
  bool binary_ = false;
  bool in_colours_ = false;
  std::vector<Edit> replaced_;
};

[[nodiscard]] std::string lower_case(std::string_view word);

}  // namespace meshsmooth::formats
