#include "error.hpp"

#include <algorithm>
#include <charconv>
#include <cstdint>
#include <exception>
#include <memory>
#include <new>
#include <sstream>
#include <string_view>

#include "meshsmooth/client.hpp"
#include "meshsmooth/error_reason.hpp"

namespace meshsmooth::c {
namespace {

/// Hints name members of C++'s credentials; C's have the same names.
std::string in_c(std::string hint) {
  constexpr std::string_view kCpp = "Credentials::";
  constexpr std::string_view kC = "meshsmooth_credentials.";
  for (std::size_t at = 0; (at = hint.find(kCpp, at)) != std::string::npos; at += kC.size()) {
    hint.replace(at, kCpp.size(), kC);
  }
  return hint;
}

int status_of(const std::string& reason) {
  const ErrorReason* const row = find_error_reason(reason);
  return row != nullptr ? static_cast<int>(row->status) : MESHSMOOTH_INTERNAL;
}

/// Fills in what the exception that is being handled says.
void describe(meshsmooth_error& error) {
  try {
    throw;
  } catch (const client::ServiceError& e) {
    error = {static_cast<int>(e.code()),
             e.reason(),
             e.what(),
             in_c(e.hint()),
             e.details(),
             e.retry_delay()};
  } catch (const Error& e) {
    error = {status_of(e.reason()), e.reason(), e.what(), {}, e.details(), {}};
  } catch (const std::bad_alloc&) {
    error = {MESHSMOOTH_RESOURCE_EXHAUSTED, {}, "not enough memory for the call", {}, {}, {}};
  } catch (const std::exception& e) {
    error = {MESHSMOOTH_INTERNAL, {}, e.what(), {}, {}, {}};
  } catch (...) {
    error = {MESHSMOOTH_UNKNOWN, {}, "an exception of another library", {}, {}, {}};
  }
}

const std::string* find_detail(const meshsmooth_error& error, std::string_view name) {
  const auto found = std::ranges::find(error.details, name, &ErrorDetails::value_type::first);
  return found != error.details.end() ? &found->second : nullptr;
}

std::int64_t number_of(const meshsmooth_error* error, std::string_view name) {
  const std::string* const text = error != nullptr ? find_detail(*error, name) : nullptr;
  std::int64_t number = -1;
  if (text != nullptr) std::from_chars(text->data(), text->data() + text->size(), number);
  return number;
}

}  // namespace

InvalidOption invalid_argument(const std::string& field, const std::string& what) {
  return {"ARGUMENT_INVALID", field + " " + what, {{"field", field}}};
}

InvalidOption out_of_range(const std::string& field, double value, const std::string& range) {
  std::ostringstream message;
  message << field << " is " << value << ", it must be " << range;
  return {"OPTION_OUT_OF_RANGE", message.str(), {{"field", field}}};
}

void need(const void* pointer, const std::string& field) {
  if (pointer == nullptr) throw invalid_argument(field, "is null");
}

void need_size(std::size_t size, std::size_t known, const std::string& structure) {
  constexpr std::size_t kMember = 8;
  if (size >= 2 * kMember && size <= known && size % kMember == 0) return;
  throw invalid_argument(structure + ".size",
                         "is " + std::to_string(size) +
                             ", this library (" MESHSMOOTH_VERSION ") knows up to " +
                             std::to_string(known) +
                             " bytes, in steps of 8; set "
                             "it to sizeof, and use the header of this or an older library");
}

int report_exception(meshsmooth_error** error) noexcept {
  try {
    auto made = std::make_unique<meshsmooth_error>();
    describe(*made);
    const int code = made->code;
    if (error != nullptr) *error = made.release();
    return code;
  } catch (...) {  // no memory even for the error: a null one says so
    return MESHSMOOTH_RESOURCE_EXHAUSTED;
  }
}

}  // namespace meshsmooth::c

using meshsmooth::c::find_detail;
using meshsmooth::c::number_of;

int meshsmooth_error_code(const meshsmooth_error* error) {
  return error != nullptr ? error->code : MESHSMOOTH_OK;
}

const char* meshsmooth_error_reason(const meshsmooth_error* error) {
  return error != nullptr ? error->reason.c_str() : "";
}

const char* meshsmooth_error_message(const meshsmooth_error* error) {
  return error != nullptr ? error->message.c_str() : "";
}

const char* meshsmooth_error_hint(const meshsmooth_error* error) {
  return error != nullptr ? error->hint.c_str() : "";
}

int64_t meshsmooth_error_element(const meshsmooth_error* error) {
  return number_of(error, "element");
}

int64_t meshsmooth_error_node(const meshsmooth_error* error) { return number_of(error, "node"); }

const char* meshsmooth_error_detail(const meshsmooth_error* error, const char* name) {
  if (error == nullptr || name == nullptr) return nullptr;
  const std::string* const found = find_detail(*error, name);
  return found != nullptr ? found->c_str() : nullptr;
}

double meshsmooth_error_retry_seconds(const meshsmooth_error* error) {
  if (error == nullptr || !error->retry_delay) return -1;
  return std::chrono::duration<double>(*error->retry_delay).count();
}

void meshsmooth_error_free(meshsmooth_error* error) { delete error; }
