# Install rules and the exported package: find_package(meshsmooth CONFIG) gives
# meshsmooth::mesh, ::smooth, ::wire and ::client.
include(CMakePackageConfigHelpers)
include(GNUInstallDirs)

foreach(library mesh smooth wire client)
  if(TARGET meshsmooth_${library})
    set_target_properties(meshsmooth_${library} PROPERTIES EXPORT_NAME ${library})
    install(TARGETS meshsmooth_${library} EXPORT meshsmooth COMPONENT libraries)
  endif()
endforeach()
foreach(program meshsmooth-server meshsmooth)
  if(TARGET ${program})
    install(TARGETS ${program} COMPONENT programs)
  endif()
endforeach()

install(DIRECTORY core/include/ client/include/ TYPE INCLUDE COMPONENT libraries
  FILES_MATCHING PATTERN "*.hpp")
install(DIRECTORY proto/meshsmooth TYPE DATA COMPONENT libraries FILES_MATCHING PATTERN "*.proto")

set(package_dir ${CMAKE_INSTALL_LIBDIR}/cmake/meshsmooth)
configure_package_config_file(cmake/meshsmoothConfig.cmake.in
  ${PROJECT_BINARY_DIR}/meshsmoothConfig.cmake INSTALL_DESTINATION ${package_dir})
write_basic_package_version_file(${PROJECT_BINARY_DIR}/meshsmoothConfigVersion.cmake
  COMPATIBILITY SameMinorVersion)
install(EXPORT meshsmooth NAMESPACE meshsmooth:: FILE meshsmoothTargets.cmake
  DESTINATION ${package_dir} COMPONENT libraries)
install(FILES ${PROJECT_BINARY_DIR}/meshsmoothConfig.cmake
  ${PROJECT_BINARY_DIR}/meshsmoothConfigVersion.cmake
  DESTINATION ${package_dir} COMPONENT libraries)
