#pragma once

#include "http/connection.hpp"
#include "service.hpp"

namespace meshsmooth::gateway {

/// Throws `Problem` (UPLOAD_TOO_LARGE) where the announced length of the form is beyond the limit.
void check_length(const Connection& connection, const Settings& settings);

/// Takes the form of a request into the folder, as it arrives. Throws `Problem`.
void read_form(Connection& connection, const Request& request, const Service& service,
               const RequestFolder& folder, Order& order);

/// The token of `Authorization: Bearer TOKEN`; empty: there is none. Throws `Problem`
/// (TOKEN_UNKNOWN) for any other credentials.
[[nodiscard]] std::string bearer_token(const Request& request);

}  // namespace meshsmooth::gateway
