#pragma once

#include <httplib.h>

#include "service.hpp"

namespace meshsmooth::gateway {

/// Takes the form of a request into the folder, as it arrives. A form that is refused is read to
/// its end where that is not far, so that the caller hears why. Throws `Problem`.
void read_form(const httplib::Request& request, const httplib::ContentReader& content,
               const Service& service, const RequestFolder& folder, Order& order);

/// The token of `Authorization: Bearer TOKEN`; empty: there is none. Throws `Problem`
/// (TOKEN_UNKNOWN) for any other credentials.
[[nodiscard]] std::string bearer_token(const httplib::Request& request);

/// The connection of a request, to be asked whether it is still there; -1: it was not found.
[[nodiscard]] int find_connection(const httplib::Request& request);

}  // namespace meshsmooth::gateway
