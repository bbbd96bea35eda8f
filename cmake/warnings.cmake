# One interface target carries warnings and floating-point rules for our own code.
add_library(meshsmooth_flags INTERFACE)
# Contraction to fused multiply-add would make the bits depend on the compiler
# and differ between backends. A CUDA target that may says so by the property
# MESHSMOOTH_FUSED. Nothing reads errno or floating-point exceptions; without
# them the compiler vectorizes roots, divisions and branches, with the same bits.
target_compile_options(meshsmooth_flags INTERFACE
  $<$<COMPILE_LANGUAGE:CXX>:-Wall -Wextra -Wpedantic -Wshadow -Wconversion -Wno-sign-conversion
    -ffp-contract=off -fno-math-errno -fno-trapping-math>
  $<$<AND:$<COMPILE_LANGUAGE:CXX>,$<BOOL:${MESHSMOOTH_WERROR}>>:-Werror>
  $<$<COMPILE_LANGUAGE:CUDA>:-fmad=$<IF:$<BOOL:$<TARGET_PROPERTY:MESHSMOOTH_FUSED>>,true,false>
    --extended-lambda --expt-relaxed-constexpr --compress-mode=size
    -Xcompiler=-Wall,-Wextra,-ffp-contract=off>
  $<$<AND:$<COMPILE_LANGUAGE:CUDA>,$<BOOL:${MESHSMOOTH_WERROR}>>:-Werror=all-warnings>)
if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU" AND CMAKE_CXX_COMPILER_VERSION VERSION_LESS 13)
  # False alarms on the concatenation of strings, GCC bug 105651.
  target_compile_options(meshsmooth_flags INTERFACE $<$<COMPILE_LANGUAGE:CXX>:-Wno-restrict>)
endif()
