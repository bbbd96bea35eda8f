#pragma once

#include <cstdint>
#include <string>
#include <utility>
#include <variant>
#include <vector>

namespace meshsmooth::server {

using LogValue = std::variant<bool, std::int64_t, double, std::string>;

/// The fields of a log line, in order.
using LogFields = std::vector<std::pair<std::string, LogValue>>;

/// key=value key="a value": values are quoted when they are empty or have anything but visible
/// ASCII without quote, '=' and '\'.
[[nodiscard]] std::string to_text(const LogFields& fields);

/// "key":value,"key":"a value": the members of a JSON object. Bytes beyond ASCII are escaped one
/// by one, because they may not be UTF-8.
[[nodiscard]] std::string to_json(const LogFields& fields);

}  // namespace meshsmooth::server
