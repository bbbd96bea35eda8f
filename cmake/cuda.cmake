# The CUDA backend: MESHSMOOTH_CUDA is ON, OFF or AUTO (on where an nvcc of CUDA 13 or
# newer is found). Sets MESHSMOOTH_HAVE_CUDA. `scripts/setup --cuda` puts NVIDIA's
# compiler into .cuda where there is none.
set(MESHSMOOTH_CUDA AUTO CACHE STRING "Build the CUDA backend: ON, OFF or AUTO")
set_property(CACHE MESHSMOOTH_CUDA PROPERTY STRINGS AUTO ON OFF)

set(MESHSMOOTH_HAVE_CUDA OFF)
if(MESHSMOOTH_CUDA)
  if(NOT CMAKE_CUDA_COMPILER AND NOT DEFINED ENV{CUDACXX})
    function(meshsmooth_check_nvcc is_new_enough nvcc)
      execute_process(COMMAND ${nvcc} --version OUTPUT_VARIABLE text ERROR_QUIET)
      if(NOT text MATCHES "release ([0-9.]+)" OR CMAKE_MATCH_1 VERSION_LESS 13)
        set(${is_new_enough} FALSE PARENT_SCOPE)
      endif()
    endfunction()
    find_program(MESHSMOOTH_NVCC nvcc VALIDATOR meshsmooth_check_nvcc
      HINTS ${PROJECT_SOURCE_DIR}/.cuda/bin ENV CUDA_HOME PATHS /usr/local/cuda/bin)
    set(CMAKE_CUDA_COMPILER ${MESHSMOOTH_NVCC})
  endif()
  # Machine code for the data-centre cards in use, portable code for the others.
  if(NOT DEFINED CMAKE_CUDA_ARCHITECTURES AND NOT DEFINED ENV{CUDAARCHS})
    set(CMAKE_CUDA_ARCHITECTURES 75-virtual 80-real 90-real)
  endif()
  # The newest GCC that nvcc 13.0 takes, where the compiler of C++ is a newer one.
  if(NOT CMAKE_CUDA_HOST_COMPILER AND NOT DEFINED ENV{CUDAHOSTCXX} AND CMAKE_CXX_COMPILER_ID STREQUAL "GNU"
     AND CMAKE_CXX_COMPILER_VERSION VERSION_GREATER_EQUAL 16)
    find_program(CMAKE_CUDA_HOST_COMPILER g++-15)
  endif()
  set(CMAKE_CUDA_RUNTIME_LIBRARY Static)
  include(CheckLanguage)
  check_language(CUDA)
  if(CMAKE_CUDA_COMPILER)
    enable_language(CUDA)
    if(NOT CMAKE_CUDA20_STANDARD_COMPILE_OPTION)  # CMake 3.25 does not know that nvcc can
      set(CMAKE_CUDA20_STANDARD_COMPILE_OPTION -std=c++20)
      set(CMAKE_CUDA20_EXTENSION_COMPILE_OPTION -std=c++20)
    endif()
    set(CMAKE_CUDA_STANDARD 20)
    set(CMAKE_CUDA_STANDARD_REQUIRED ON)
    set(CMAKE_CUDA_EXTENSIONS OFF)
    set(MESHSMOOTH_HAVE_CUDA ON)
    # CMake 3.25 deprecates this target without asking whether there is one: CUDA 13 has none.
    if(NOT TARGET CUDA::nvToolsExt)
      add_library(CUDA::nvToolsExt INTERFACE IMPORTED)
    endif()
    find_package(CUDAToolkit REQUIRED)
  elseif(MESHSMOOTH_CUDA STREQUAL "ON")
    message(FATAL_ERROR "MESHSMOOTH_CUDA is ON, but there is no nvcc of CUDA 13: run scripts/setup --cuda, "
      "or name it by CMAKE_CUDA_COMPILER")
  endif()
endif()
message(STATUS "CUDA backend: ${MESHSMOOTH_HAVE_CUDA}")
