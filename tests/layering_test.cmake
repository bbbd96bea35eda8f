# The arrows point inward (docs/architecture.md): who may include what, as patterns over
# the #include lines of the sources. Run by ctest: cmake -DROOT=… -P layering_test.cmake
cmake_minimum_required(VERSION 3.25)

set(failures "")
set(file_count 0)

# forbid(PATTERN LAW ALLOWED…): files whose path does not start with one of ALLOWED must
# not include what matches PATTERN.
function(forbid pattern law)
  foreach(file IN LISTS sources)
    set(allowed FALSE)
    foreach(prefix IN LISTS ARGN)
      if(file MATCHES "^${prefix}")
        set(allowed TRUE)
      endif()
    endforeach()
    if(NOT allowed)
      file(STRINGS ${ROOT}/${file} lines REGEX "^[ \t]*#[ \t]*include[ \t]*[<\"]${pattern}")
      foreach(line IN LISTS lines)
        string(APPEND failures "${file}: ${line}\n    ${law}\n")
      endforeach()
    endif()
  endforeach()
  set(failures "${failures}" PARENT_SCOPE)
endfunction()

file(GLOB_RECURSE sources RELATIVE ${ROOT}
  ${ROOT}/core/*.[ch]pp ${ROOT}/proto/*.[ch]pp ${ROOT}/server/*.[ch]pp ${ROOT}/client/*.[ch]pp
  ${ROOT}/core/*.cu ${ROOT}/core/*.cuh ${ROOT}/tests/*.[ch]pp)
list(LENGTH sources file_count)
if(file_count LESS 20)
  message(FATAL_ERROR "only ${file_count} sources found under '${ROOT}': is ROOT the checkout?")
endif()

forbid("(grpc|grpcpp)/" "gRPC belongs to the server's edge and the client's inside"
  server/src/rpc/ server/src/server\\.cpp server/include/ client/src/ tests/
  proto/wire/raw_message\\.) # its buffers, which both read and write
forbid("[^>\"]*\\.pb\\.h" "generated messages stay behind the codec"
  proto/wire/ server/src/rpc/ server/src/server\\.cpp server/include/ client/src/ tests/)
forbid("google/protobuf/" "protobuf stays behind the codec"
  proto/wire/ server/src/rpc/ server/src/server\\.cpp client/src/ tests/)
forbid("(vtk|gmsh|tetgen)[A-Za-z0-9_]*\\.h" "file formats live on the client's side"
  client/formats/ tests/)
forbid("vtk[A-Z][A-Za-z0-9]*\\.h" "builds without VTK have the other formats"
  client/formats/vtk_ client/formats/gmsh_ tests/)
forbid("prometheus/" "only one place knows how metrics are counted"
  server/src/metrics)
forbid("openssl/" "secrets and certificates are handled in few places"
  proto/wire/sha256\\.cpp server/src/token_file\\.cpp server/src/rpc/transport_security\\.cpp tests/)
forbid("civetweb\\.h" "only one place knows how HTTP is spoken"
  server/src/admin_server\\.cpp)
forbid("(cuda|cub/|thrust/)" "CUDA stays in its backend"
  core/src/smooth/cuda/ tests/)
forbid("meshsmooth/(server|client|wire)[./]" "core knows nobody outside itself"
  proto/ server/ client/ tests/)
forbid("meshsmooth/client[./]" "the server and the wire do not know the client"
  client/ tests/)
forbid("meshsmooth/server[./]" "only the command line embeds a server"
  server/ client/cli/ tests/)

if(failures)
  message(FATAL_ERROR "The arrows point inward:\n${failures}")
endif()
message(STATUS "${file_count} sources keep the layers")
