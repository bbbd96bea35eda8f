// What the thread sanitizer must know of Debian's gRPC and protobuf, which are not
// built with it: it cannot see how they hand memory from thread to thread.
#if defined(__SANITIZE_THREAD__)
extern "C" {

const char* __tsan_default_options() { return "ignore_noninstrumented_modules=1"; }

// Templates of their headers, compiled into our programs.
const char* __tsan_default_suppressions() { return "race:grpc::\nrace:google::protobuf\n"; }

}  // extern "C"
#endif
