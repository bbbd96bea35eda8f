// Under the thread sanitizer protobuf's map_field.h gives maps two more members, which the
// protobuf of the distribution, built without it, does not know: it would look for the others in
// the wrong places. This file stands before that one in the thread sanitizer's build and includes
// it as the library was built.
#pragma once
#pragma push_macro("__SANITIZE_THREAD__")
#undef __SANITIZE_THREAD__
#include_next <google/protobuf/map_field.h>
#pragma pop_macro("__SANITIZE_THREAD__")
