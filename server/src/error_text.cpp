#include "error_text.hpp"

#include <new>

#include "meshsmooth/error.hpp"

namespace meshsmooth::server {

ErrorText error_text(const std::exception_ptr& error) {
  if (!error) return {};
  try {
    std::rethrow_exception(error);
  } catch (const Error& e) {
    return {.reason = e.reason(), .message = e.what(), .ours = true};
  } catch (const std::bad_alloc& e) {
    return {.reason = "HOST_MEMORY_BUSY", .message = e.what(), .ours = false};
  } catch (const std::exception& e) {
    return {.reason = "INTERNAL", .message = e.what(), .ours = false};
  } catch (...) {
    return {.reason = "INTERNAL", .message = "unknown exception", .ours = false};
  }
}

}  // namespace meshsmooth::server
