# The arrows point inward (docs/architecture.md): who may include what, as patterns over
# the #include lines of the sources. Run by ctest: cmake -DROOT=… -P layering_test.cmake
cmake_minimum_required(VERSION 3.25)

set(failures "")
set(file_count 0)

# report_includes(FILE PATTERN LAW): adds the lines of FILE that include what matches PATTERN.
macro(report_includes file pattern law)
  file(STRINGS ${ROOT}/${file} lines REGEX "^[ \t]*#[ \t]*include[ \t]*[<\"]${pattern}")
  foreach(line IN LISTS lines)
    string(APPEND failures "${file}: ${line}\n    ${law}\n")
  endforeach()
endmacro()

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
      report_includes(${file} "${pattern}" "${law}")
    endif()
  endforeach()
  set(failures "${failures}" PARENT_SCOPE)
endfunction()

# keep_below(FOLDER PATTERN LAW): files in FOLDER must not include what matches PATTERN.
function(keep_below folder pattern law)
  foreach(file IN LISTS sources)
    if(file MATCHES "^${folder}")
      report_includes(${file} "${pattern}" "${law}")
    endif()
  endforeach()
  set(failures "${failures}" PARENT_SCOPE)
endfunction()

# law(FOLDER ALLOWED…): files of that folder of core/src/smooth include of the others only the
# ALLOWED.
function(law folder)
  set(allowed "")
  foreach(other IN LISTS folder ARGN)
    string(APPEND allowed "|${other}/[^/]*")
  endforeach()
  foreach(file IN LISTS sources)
    get_filename_component(own ${file} DIRECTORY)
    if(NOT own STREQUAL "core/src/smooth/${folder}")
      continue()
    endif()
    file(STRINGS ${ROOT}/${file} lines REGEX "^[ \t]*#[ \t]*include[ \t]*\"smooth/")
    foreach(line IN LISTS lines)
      if(NOT line MATCHES "\"smooth/(-${allowed})\"")
        string(APPEND failures "${file}: ${line}\n    ${folder}/ may not know that folder\n")
      endif()
    endforeach()
  endforeach()
  set(laws ${laws} core/src/smooth/${folder} PARENT_SCOPE)
  set(failures "${failures}" PARENT_SCOPE)
endfunction()

# find_circles(FILES): names the files that include each other in a circle.
function(find_circles)
  foreach(file IN LISTS ARGN)
    set(known_${file} TRUE)
  endforeach()
  foreach(file IN LISTS ARGN)
    get_filename_component(folder ${file} DIRECTORY)
    file(STRINGS ${ROOT}/${file} lines REGEX "^[ \t]*#[ \t]*include[ \t]*\"")
    foreach(line IN LISTS lines)
      string(REGEX REPLACE "^[^\"]*\"([^\"]*)\".*" "\\1" name "${line}")
      foreach(root ${folder} core/src core/include proto server/src server/include client
          client/library/src client/library/include client/c/src client/c/include client/cli
          client/formats client/gateway tests tests/bench)
        if(DEFINED known_${root}/${name})
          list(APPEND needs_${file} ${root}/${name})
          list(APPEND users_${root}/${name} ${file})
          break()
        endif()
      endforeach()
    endforeach()
  endforeach()
  # Leaves go first, by what they include, then by who includes them: a circle is left.
  set(open ${ARGN})
  foreach(relation needs users)
    set(count -1)
    while(NOT count EQUAL 0)
      set(count 0)
      set(left "")
      foreach(file IN LISTS open)
        set(waits FALSE)
        foreach(other IN LISTS ${relation}_${file})
          if(DEFINED known_${other})
            set(waits TRUE)
            break()
          endif()
        endforeach()
        if(waits)
          list(APPEND left ${file})
        else()
          unset(known_${file})
          math(EXPR count "${count} + 1")
        endif()
      endforeach()
      set(open ${left})
    endwhile()
  endforeach()
  foreach(file IN LISTS open)
    string(APPEND failures "${file}: in a circle of #includes\n")
  endforeach()
  set(failures "${failures}" PARENT_SCOPE)
endfunction()

file(GLOB_RECURSE sources RELATIVE ${ROOT}
  ${ROOT}/core/*.[ch]pp ${ROOT}/proto/*.[ch]pp ${ROOT}/server/*.[ch]pp ${ROOT}/client/*.[ch]pp
  ${ROOT}/client/*.h
  ${ROOT}/core/*.cu ${ROOT}/core/*.cuh ${ROOT}/tests/*.[ch]pp)
list(LENGTH sources file_count)
if(file_count LESS 20)
  message(FATAL_ERROR "only ${file_count} sources found under '${ROOT}': is ROOT the checkout?")
endif()

forbid("(grpc|grpcpp)/" "gRPC belongs to the server's edge and the client's inside"
  server/src/rpc/ server/src/server\\.cpp server/src/event_threads\\.cpp server/include/
  client/library/src/ tests/
  proto/wire/raw_message\\.) # its buffers, which both read and write
forbid("[^>\"]*\\.pb\\.h" "generated messages stay behind the codec"
  proto/wire/ server/src/rpc/ server/src/server\\.cpp server/include/ client/library/src/ tests/)
forbid("google/protobuf/" "protobuf stays behind the codec"
  proto/wire/ server/src/rpc/ server/src/server\\.cpp client/library/src/ tests/)
forbid("(vtk|gmsh)[A-Za-z0-9_]*\\.h" "file formats live on the client's side"
  client/formats/ client/generate/ tests/)
forbid("tetgen\\.h" "one file knows the library"
  client/generate/delaunay\\.cpp tests/)
forbid("vtk[A-Z][A-Za-z0-9]*\\.h" "builds without VTK have the other formats"
  client/formats/vtk/ client/formats/vtk_ client/formats/gmsh_ tests/)
forbid("(hdf5|netcdf)\\.h" "one file each knows the library"
  client/formats/hdf5_file\\.cpp client/formats/netcdf_file\\.cpp tests/)
forbid("libxml/" "one file knows the library"
  client/formats/xdmf/data\\.)
forbid("zlib\\.h" "one file knows the library"
  client/formats/gzip\\.cpp tests/)
forbid("prometheus/" "only one place knows how metrics are counted"
  server/src/metrics)
forbid("openssl/" "secrets and certificates are handled in few places"
  proto/wire/sha256\\.cpp server/src/port_probe\\.cpp server/src/token_file\\.cpp server/src/rpc/transport_security\\.cpp tests/)
forbid("(cuda|cub/|thrust/)" "CUDA stays in its backend"
  core/src/smooth/cuda/ tests/)
forbid("meshsmooth/(server|client|wire)[./]" "core knows nobody outside itself"
  proto/ server/ client/ tests/)
forbid("meshsmooth/client[./]" "the server and the wire do not know the client"
  client/ tests/)
forbid("meshsmooth/server[./]" "only the command line embeds a server"
  server/ client/cli/ tests/)

forbid("httplib\\.h" "the client of HTTP is for collectors of traces"
  server/src/traces/span_exporter\\.cpp tests/)
forbid("boost/(asio|beast)" "sockets and HTTP are in the gateway's folder for them"
  client/gateway/http/)

# The houses of the client know the mesh; only the command line knows them all.
keep_below(client/library/ "(formats|generate|bench)/" "the library reads no files")
keep_below(client/formats/ "(meshsmooth/client|generate/|bench/)" "formats are a library of their own")
keep_below(client/generate/ "(meshsmooth/client|bench/)" "test meshes need no service")
keep_below(client/c/ "(meshsmooth/(server|smoother|wire)|wire/|grpc|[^>\"]*pb\\.h|formats/|generate/|bench/|library/)"
  "the C library is the C++ client's interface once more, and knows nothing below it")
keep_below(client/c/include/ "[^\">]*(hpp|/)" "the header of C needs C's own headers alone")
keep_below("client/(library|cli|formats|generate|gateway)/" "meshsmooth(_options)?\\.h[\">]" "C++ has its own client")
keep_below(client/gateway/ "(meshsmooth/(client|server|smoother)|formats/|generate/|mesh_file|wire/|grpc|vtk|bench/)"
  "the gateway runs the command line client, and links nothing that reads a mesh")
keep_below(core/src/mesh/ "(smooth|surface)/" "a mesh knows no job")
keep_below(core/src/surface/ "(smooth|mesh)/" "a surface knows no job")

# Which folders of core/src/smooth the files of each may include, besides their own.
set(lowest plan base)
set(above_base guard energy constraints linear)
set(methods averaging optimize move fit)
law(plan)
law(base plan)
law(guard ${lowest})
law(energy ${lowest} guard)
law(constraints ${lowest})
law(linear ${lowest})
law(averaging ${lowest} guard energy constraints)
law(optimize ${lowest} guard energy linear)
law(move ${lowest} guard energy linear optimize)
law(fit ${lowest} guard energy constraints linear optimize)
law(pipeline ${lowest} ${above_base} ${methods})
law(second_order ${lowest} ${above_base} ${methods})
law(cpu ${lowest} ${above_base} ${methods} pipeline)
law(cuda/base ${lowest})
law(cuda/primitives ${lowest} cuda/base)
law(cuda/topology ${lowest} ${above_base} ${methods} cuda/base cuda/primitives)
law(cuda/quality ${lowest} guard cuda/base cuda/primitives cuda/topology)
law(cuda/sweeps ${lowest} ${above_base} ${methods} cuda/base cuda/primitives cuda/topology)
law(cuda ${lowest} ${above_base} ${methods} pipeline
  cuda/base cuda/primitives cuda/topology cuda/quality cuda/sweeps)
foreach(file IN LISTS sources)
  get_filename_component(folder ${file} DIRECTORY)
  if(folder MATCHES "^core/src/smooth/" AND NOT folder IN_LIST laws)
    string(APPEND failures "${file}: its folder has no law\n")
  endif()
endforeach()
find_circles(${sources})

if(failures)
  message(FATAL_ERROR "The arrows point inward:\n${failures}")
endif()
message(STATUS "${file_count} sources keep the layers")
