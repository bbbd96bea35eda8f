# Install rules and the exported package: find_package(meshsmooth CONFIG) gives
# meshsmooth::mesh, ::smooth, ::wire, ::client and ::c. Components: libraries, c, client, server.
include(CMakePackageConfigHelpers)
include(GNUInstallDirs)

# All public headers are C++20.
target_compile_features(meshsmooth_mesh INTERFACE cxx_std_20)

foreach(library mesh smooth wire client)
  if(NOT TARGET meshsmooth_${library})
    continue()
  endif()
  set_target_properties(meshsmooth_${library} PROPERTIES EXPORT_NAME ${library})
  install(TARGETS meshsmooth_${library} EXPORT meshsmooth COMPONENT libraries
    INCLUDES DESTINATION ${CMAKE_INSTALL_INCLUDEDIR})
endforeach()
if(MESHSMOOTH_HAVE_CUDA)
  # CUDA's static runtime goes along, so that users of the package need no CUDA.
  install(FILES ${CUDA_cudart_static_LIBRARY} TYPE LIB COMPONENT libraries)
  target_link_libraries(meshsmooth_smooth PRIVATE
    $<INSTALL_INTERFACE:$<INSTALL_PREFIX>/${CMAKE_INSTALL_LIBDIR}/libcudart_static.a>
    $<INSTALL_INTERFACE:${CMAKE_DL_LIBS}> $<INSTALL_INTERFACE:rt> $<INSTALL_INTERFACE:Threads::Threads>)
endif()
if(TARGET meshsmooth-server)
  install(TARGETS meshsmooth-server COMPONENT server)
endif()
if(TARGET meshsmooth)
  install(TARGETS meshsmooth COMPONENT client)
endif()
if(TARGET meshsmooth-gateway)
  install(TARGETS meshsmooth-gateway COMPONENT client)
  install(FILES client/gateway/meshsmooth-gateway.8 DESTINATION ${CMAKE_INSTALL_MANDIR}/man8
    COMPONENT client)
endif()

install(DIRECTORY core/include/ client/library/include/ TYPE INCLUDE COMPONENT libraries
  FILES_MATCHING PATTERN "*.hpp")
install(DIRECTORY ${PROJECT_BINARY_DIR}/proto/generated/ TYPE INCLUDE COMPONENT libraries
  FILES_MATCHING PATTERN "*.pb.h")
install(DIRECTORY proto/meshsmooth TYPE DATA COMPONENT libraries FILES_MATCHING PATTERN "*.proto")
# In a folder of its own: "wire/" alone would be too common a name among all includes.
set(wire_include_dir ${CMAKE_INSTALL_INCLUDEDIR}/meshsmooth-wire)
target_include_directories(meshsmooth_wire PUBLIC $<INSTALL_INTERFACE:${wire_include_dir}>)
install(DIRECTORY proto/wire DESTINATION ${wire_include_dir} COMPONENT libraries
  FILES_MATCHING PATTERN "*.hpp")

set(package_dir ${CMAKE_INSTALL_LIBDIR}/cmake/meshsmooth)
# The C library is a component, with targets of its own: it needs none of the others.
if(TARGET meshsmooth_c)
  install(TARGETS meshsmooth_c EXPORT meshsmooth_c COMPONENT c)
  install(DIRECTORY client/c/include/ TYPE INCLUDE COMPONENT c FILES_MATCHING PATTERN "*.h")
  install(EXPORT meshsmooth_c NAMESPACE meshsmooth:: FILE meshsmoothCTargets.cmake
    DESTINATION ${package_dir} COMPONENT c)
  # Relative to the file itself, so that an install may be moved.
  file(RELATIVE_PATH prefix ${CMAKE_INSTALL_FULL_LIBDIR}/pkgconfig ${CMAKE_INSTALL_PREFIX})
  configure_file(client/c/meshsmooth.pc.in ${PROJECT_BINARY_DIR}/meshsmooth.pc @ONLY)
  install(FILES ${PROJECT_BINARY_DIR}/meshsmooth.pc DESTINATION ${CMAKE_INSTALL_LIBDIR}/pkgconfig
    COMPONENT c)
endif()
configure_package_config_file(cmake/meshsmoothConfig.cmake.in
  ${PROJECT_BINARY_DIR}/meshsmoothConfig.cmake INSTALL_DESTINATION ${package_dir})
write_basic_package_version_file(${PROJECT_BINARY_DIR}/meshsmoothConfigVersion.cmake
  COMPATIBILITY SameMinorVersion)
install(EXPORT meshsmooth NAMESPACE meshsmooth:: FILE meshsmoothTargets.cmake
  DESTINATION ${package_dir} COMPONENT libraries)
install(FILES ${PROJECT_BINARY_DIR}/meshsmoothConfig.cmake
  ${PROJECT_BINARY_DIR}/meshsmoothConfigVersion.cmake
  DESTINATION ${package_dir} COMPONENT libraries)
