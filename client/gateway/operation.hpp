#pragma once

#include <map>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "http/request.hpp"

namespace meshsmooth::gateway {

/// The OpenAPI document, which scripts/tables makes of proto/declaration.
extern const std::string_view openapi_document;

/// What a POST can be given, as the document has it.
struct Operation {
  std::string name;                  // "smooth"
  std::set<std::string> parameters;  // of the query
  std::set<std::string> parts;       // of the form: files
  bool can_be_job = false;           // with an address of its own
};

/// All of them, by their path.
[[nodiscard]] std::map<std::string, Operation> read_operations();
/// The methods of HTTP that each path of the document has; "{job}" stands for any name.
[[nodiscard]] std::map<std::string, std::set<std::string>> read_paths();

/// The parameters as flags of the client, which checks their values: "--goal=worst", each one
/// argument, so that no value can be taken for a flag. Without those that are the gateway's own:
/// "to", "partial". Throws `Problem` (OPTION_MISPLACED) for a parameter that the operation does not
/// have.
[[nodiscard]] std::vector<std::string> to_flags(const Operation& operation,
                                                const Parameters& parameters);

/// The value of one of them; empty: it is not given. Throws `Problem` (OPTION_MISPLACED) where it
/// is given twice.
[[nodiscard]] std::string value_of(const Parameters& parameters, const std::string& name);

/// ".inp.gz" of "C:\\x\\Part.INP.gz": the only part of a caller's file name that names a file here,
/// and then in lower case letters and digits; empty: there is no such.
[[nodiscard]] std::string safe_extension(std::string_view name);
/// The name for the result of a caller's file: "part-smooth.vtu" of "../part.inp", for a header.
[[nodiscard]] std::string result_name(std::string_view name, const std::string& operation,
                                      const std::string& extension);

}  // namespace meshsmooth::gateway
