# Every third-party library and its least version, in one place. The versions are those of
# Debian 12; Debian 13 has newer ones of most.
find_package(Threads REQUIRED)
find_package(TBB 2021.8 REQUIRED)
# By its own configuration where there is one, and before gRPC, whose configuration looks for it too:
# from version 22 on it needs Abseil, which CMake's module does not know.
find_package(Protobuf CONFIG QUIET)
if(NOT Protobuf_FOUND)
  find_package(Protobuf 3.21 REQUIRED)
endif()
find_package(gRPC 1.51 CONFIG REQUIRED)
find_package(OpenSSL 3.0 REQUIRED)
if(MESHSMOOTH_BUILD_SERVER)
  find_package(spdlog 1.10 REQUIRED)
  # Not by their packages, which look for the whole of curl and zlib; an archive is taken
  # where there is one.
  find_path(PROMETHEUS_CPP_INCLUDE_DIR prometheus/registry.h REQUIRED)  # 1.0
  find_library(PROMETHEUS_CPP_LIBRARY NAMES libprometheus-cpp-core.a prometheus-cpp-core REQUIRED)
endif()
if(MESHSMOOTH_BUILD_SERVER OR MESHSMOOTH_BUILD_CLI)
  find_package(CLI11 2.1 REQUIRED)
endif()
if(MESHSMOOTH_BUILD_CLI)
  find_package(ZLIB 1.2.13 REQUIRED)
  if(MESHSMOOTH_WITH_VTK)
    set(vtk_components CommonCore CommonDataModel IOCore IOLegacy IOXML)
    if(MESHSMOOTH_BUILD_TESTS)
      list(APPEND vtk_components FiltersCore FiltersVerdict)
    endif()
    find_package(VTK 9.1 REQUIRED COMPONENTS ${vtk_components})
  elseif(MESHSMOOTH_WITH_GMSH)
    message(FATAL_ERROR "Gmsh's formats pass through VTK's data sets: set MESHSMOOTH_WITH_VTK=ON "
      "or MESHSMOOTH_WITH_GMSH=OFF")
  endif()
  if(MESHSMOOTH_WITH_GMSH)
    find_path(GMSH_INCLUDE_DIR gmsh.h REQUIRED)      # 4.8
    find_library(GMSH_LIBRARY gmsh REQUIRED)
  endif()
  if(MESHSMOOTH_WITH_HDF5)
    # By pkg-config, which tells the serial HDF5 from those for MPI; netCDF stands on the same.
    find_package(PkgConfig REQUIRED)
    pkg_check_modules(HDF5 REQUIRED IMPORTED_TARGET hdf5-serial>=1.10)
    pkg_check_modules(NETCDF REQUIRED IMPORTED_TARGET netcdf>=4.9)
    pkg_check_modules(LIBXML REQUIRED IMPORTED_TARGET libxml-2.0>=2.9)
  endif()
  if(MESHSMOOTH_WITH_TETGEN)
    find_path(TETGEN_INCLUDE_DIR tetgen.h REQUIRED)  # 1.5
    find_library(TETGEN_LIBRARY tet REQUIRED)
  endif()
endif()
if(MESHSMOOTH_BUILD_SERVER)
  find_package(PkgConfig REQUIRED)
  pkg_check_modules(HTTPLIB REQUIRED IMPORTED_TARGET cpp-httplib>=0.11)
endif()
if(MESHSMOOTH_BUILD_SERVER OR (MESHSMOOTH_BUILD_CLI AND MESHSMOOTH_BUILD_GATEWAY))
  find_package(nlohmann_json 3.11 REQUIRED)
endif()
if(MESHSMOOTH_BUILD_CLI AND MESHSMOOTH_BUILD_GATEWAY)
  find_package(Boost 1.74 CONFIG REQUIRED)  # its headers: Asio, Beast
endif()
if(MESHSMOOTH_BUILD_TESTS)
  find_package(GTest 1.12 REQUIRED)
  # 3.4, or 5, whose configuration takes itself for none.
  find_package(Eigen3 REQUIRED NO_MODULE)
  if(Eigen3_VERSION VERSION_LESS 3.4)
    message(FATAL_ERROR "Eigen ${Eigen3_VERSION} is too old: 3.4 is needed")
  endif()
endif()
if(MESHSMOOTH_BUILD_BENCHMARKS)
  find_package(benchmark 1.7 REQUIRED)
endif()

option(MESHSMOOTH_STATIC_GRPC "Link gRPC, protobuf and what they need from their archives" ON)
# The sanitizers' suppressions name the shared libraries.
if(MESHSMOOTH_STATIC_GRPC AND NOT CMAKE_CXX_FLAGS MATCHES "-fsanitize")
  include(static_archives)
  meshsmooth_prefer_archives(gRPC::grpc++ gRPC::grpc++_reflection protobuf::libprotobuf OpenSSL::SSL)
endif()
