#pragma once

#include <string_view>

namespace meshsmooth::gateway {

/// The page at "/": one document that needs nothing else.
extern const std::string_view page_html;
/// The Content-Security-Policy that it is sent with.
extern const std::string_view page_policy;

}  // namespace meshsmooth::gateway
