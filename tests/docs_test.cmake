# What the documents say of the code is true where that can be checked: the tutorial's example
# is examples/smooth.cpp, which tests/package builds and runs, as is that of docs/c.md, and docs/protocol.md lists every reason
# that the sources give, and no other. Run by ctest: cmake -DROOT=… -P docs_test.cmake
cmake_minimum_required(VERSION 3.25)

file(READ ${ROOT}/docs/tutorial.md tutorial)
file(READ ${ROOT}/examples/smooth.cpp example)
string(FIND "${tutorial}" "```cpp\n${example}```" place)
if(place EQUAL -1)
  message(SEND_ERROR "docs/tutorial.md: the C++ example differs from examples/smooth.cpp")
endif()

file(READ ${ROOT}/docs/c.md document)
file(READ ${ROOT}/examples/c/smooth.c example)
string(FIND "${document}" "```c\n${example}```" place)
if(place EQUAL -1)
  message(SEND_ERROR "docs/c.md: the example differs from examples/c/smooth.c")
endif()

file(READ ${ROOT}/docs/protocol.md protocol)
file(GLOB_RECURSE sources ${ROOT}/core/*.[ch]pp ${ROOT}/proto/*.[ch]pp ${ROOT}/server/*.[ch]pp
  ${ROOT}/client/*.[ch]pp)
list(FILTER sources EXCLUDE REGEX "error_reason\\.[ch]pp$") # the table itself
set(reasons "")
foreach(source IN LISTS sources)
  file(READ ${source} text)
  string(REGEX MATCHALL "\"[A-Z]+(_[A-Z]+)+\"" found "${text}")
  list(APPEND reasons ${found})
endforeach()
list(REMOVE_DUPLICATES reasons)
list(FILTER reasons EXCLUDE REGEX  # environment; gRPC; SU2; Nastran; VTK; XDMF
  "MESHSMOOTH_|OTEL_|SOURCE_DATE_|RST_STREAM|NOT_SERVING|MARKER_|SEND_REC|ANSA_NAME|UNSTRUCTURED_GRID|_DATA\"|LOOKUP_TABLE|NULL_ARRAY|X_Y")
list(LENGTH reasons reason_count)
if(reason_count LESS 20)
  message(SEND_ERROR "only ${reason_count} reasons found in the sources: has their form changed?")
endif()
foreach(reason IN LISTS reasons)
  string(REPLACE "\"" "`" quoted ${reason})
  string(FIND "${protocol}" "${quoted}" place)
  if(place EQUAL -1)
    message(SEND_ERROR "docs/protocol.md does not list the reason ${quoted}")
  endif()
endforeach()

string(REGEX MATCHALL "`[A-Z]+(_[A-Z]+)+`" listed "${protocol}")
list(FILTER listed EXCLUDE REGEX "COORDINATES|ELEMENT_QUALITY|ELEMENT_REGIONS|FIXED_MASK|NODE_PAIRS|PRESCRIBED_NODES|SURFACE_(POINTS|TRIANGLES|PATCHES)")  # arrays
foreach(quoted IN LISTS listed)
  string(REPLACE "`" "\"" reason ${quoted})
  if(NOT reason IN_LIST reasons)
    message(SEND_ERROR "docs/protocol.md lists ${quoted}, but nothing in the sources gives it")
  endif()
endforeach()
