#pragma once

#include <cstdint>
#include <string>
#include <utility>
#include <variant>
#include <vector>

namespace meshsmooth::server {

using LogValue = std::variant<bool, std::int64_t, double, std::string>;

/// What a line says, in order.
using LogFields = std::vector<std::pair<std::string, LogValue>>;

/// key=value key="a value": in quotes what is empty or has anything but visible
/// ASCII without quote, '=' and '\'.
[[nodiscard]] std::string to_text(const LogFields& fields);

/// "key":value,"key":"a value": the inside of a JSON object. Bytes beyond ASCII
/// are escaped one by one, as nothing says that they are UTF-8.
[[nodiscard]] std::string to_json(const LogFields& fields);

}  // namespace meshsmooth::server
