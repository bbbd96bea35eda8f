# Manual pages and completions of the programs, and the Debian packages that CPack makes of the
# components client, server and libraries: meshsmooth, meshsmooth-server and libmeshsmooth-dev.
# scripts/packages builds, packs and checks them.
if(NOT TARGET meshsmooth OR NOT TARGET meshsmooth-server OR MESHSMOOTH_FUZZ)
  return()
endif()

# The time of the last commit, for pages and archives that are the same whenever they are made.
set(source_date "$ENV{SOURCE_DATE_EPOCH}")
if(NOT source_date)
  execute_process(COMMAND git log -1 --format=%ct WORKING_DIRECTORY ${PROJECT_SOURCE_DIR}
    OUTPUT_VARIABLE source_date OUTPUT_STRIP_TRAILING_WHITESPACE ERROR_QUIET)
endif()
if(NOT source_date)
  set(source_date 0)
endif()

set(manual_dir ${PROJECT_BINARY_DIR}/manual)
add_custom_command(OUTPUT ${manual_dir}/man1/meshsmooth.1 VERBATIM
  COMMAND ${CMAKE_COMMAND} -E rm -rf ${manual_dir}
  COMMAND ${CMAKE_COMMAND} -E env SOURCE_DATE_EPOCH=${source_date}
    $<TARGET_FILE:meshsmooth> write-manual ${manual_dir}
  DEPENDS meshsmooth COMMENT "Writing manual pages and completions")
add_custom_target(manual ALL DEPENDS ${manual_dir}/man1/meshsmooth.1)

foreach(component client server)
  set(program meshsmooth)
  set(section 1)
  if(component STREQUAL server)
    set(program meshsmooth-server)
    set(section 8)
  endif()
  install(DIRECTORY ${manual_dir}/man${section} DESTINATION ${CMAKE_INSTALL_MANDIR}
    COMPONENT ${component})
  install(FILES ${manual_dir}/bash/${program}
    DESTINATION ${CMAKE_INSTALL_DATADIR}/bash-completion/completions COMPONENT ${component})
  install(FILES ${manual_dir}/zsh/_${program}
    DESTINATION ${CMAKE_INSTALL_DATADIR}/zsh/vendor-completions COMPONENT ${component})
  install(FILES ${manual_dir}/fish/${program}.fish
    DESTINATION ${CMAKE_INSTALL_DATADIR}/fish/vendor_completions.d COMPONENT ${component})
endforeach()

find_program(MESHSMOOTH_DPKG dpkg)
find_program(MESHSMOOTH_GZIP gzip)
if(NOT MESHSMOOTH_DPKG OR NOT MESHSMOOTH_GZIP)
  return()
endif()

# One release of a version for each Debian, whose libraries the packages need: 0.1.0-1~deb12.
file(STRINGS /etc/os-release os_release REGEX "^VERSION_ID=")
string(REGEX REPLACE ".*=\"?([0-9.]*)\"?" "\\1" debian "${os_release}")
set(CPACK_DEBIAN_PACKAGE_RELEASE "1~deb${debian}")
# The name as in CITATION.cff, which has no address; DEBEMAIL adds one.
set(contact "The meshsmooth authors")
if(DEFINED ENV{DEBEMAIL})
  string(APPEND contact " <$ENV{DEBEMAIL}>")
endif()

# Files that only packages have, below the folder that the pre-build script moves into place.
set(debian_dir ${PROJECT_BINARY_DIR}/debian)
set(MESHSMOOTH_SOURCE_DATE ${source_date})
execute_process(COMMAND date -u -R -d @${source_date} OUTPUT_VARIABLE changelog_date
  OUTPUT_STRIP_TRAILING_WHITESPACE)
set(changelog_contact "${contact}")
if(NOT contact MATCHES "<")
  string(APPEND changelog_contact " <>")
endif()
file(CONFIGURE OUTPUT ${debian_dir}/changelog.Debian @ONLY CONTENT
"meshsmooth (@PROJECT_VERSION@-@CPACK_DEBIAN_PACKAGE_RELEASE@) stable; urgency=medium

  * Version @PROJECT_VERSION@; its changes are in changelog.gz.

 -- @changelog_contact@  @changelog_date@
")
configure_file(CHANGELOG.md ${debian_dir}/changelog COPYONLY)
configure_file(cmake/pack_debian.cmake.in ${debian_dir}/pack_debian.cmake @ONLY)

set(CPACK_GENERATOR DEB)
set(CPACK_PACKAGE_NAME meshsmooth)
set(CPACK_PACKAGE_VENDOR meshsmooth)
set(CPACK_PACKAGE_CONTACT "${contact}")
set(CPACK_PACKAGING_INSTALL_PREFIX /usr)
set(CPACK_VERBATIM_VARIABLES ON)
set(CPACK_STRIP_FILES ON)
set(CPACK_COMPONENTS_ALL client server libraries)
set(CPACK_COMPONENTS_GROUPING IGNORE)
set(CPACK_PRE_BUILD_SCRIPTS ${debian_dir}/pack_debian.cmake)
set(CPACK_INSTALL_DEFAULT_DIRECTORY_PERMISSIONS OWNER_READ OWNER_WRITE OWNER_EXECUTE
  GROUP_READ GROUP_EXECUTE WORLD_READ WORLD_EXECUTE)

set(CPACK_DEB_COMPONENT_INSTALL ON)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_COMPRESSION_TYPE xz)
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS ON)
set(CPACK_DEBIAN_PACKAGE_CONTROL_STRICT_PERMISSION ON)
set(CPACK_DEBIAN_PACKAGE_SOURCE meshsmooth)

set(CPACK_DEBIAN_CLIENT_PACKAGE_NAME meshsmooth)
set(CPACK_DEBIAN_CLIENT_PACKAGE_SECTION science)
set(CPACK_DEBIAN_CLIENT_PACKAGE_SUGGESTS meshsmooth-server)
set(CPACK_DEBIAN_CLIENT_DESCRIPTION "improves finite-element meshes by moving their nodes
Smooths, optimizes and untangles surface and volume meshes of triangles,
quads, tetrahedra, pyramids, wedges and hexahedra, mixed or not. Nodes move,
nothing else changes, and a valid mesh stays valid.

This package has the command line client, which computes by itself or on a
server, with the file formats of VTK, Gmsh and TetGen, and meshsmooth-gateway,
which serves plain HTTP by it.")

set(CPACK_DEBIAN_SERVER_PACKAGE_NAME meshsmooth-server)
set(CPACK_DEBIAN_SERVER_PACKAGE_SECTION science)
set(CPACK_DEBIAN_SERVER_DESCRIPTION "gRPC service that improves finite-element meshes
Smooths, optimizes and untangles meshes for many callers, with a bounded
queue, memory admission, TLS, tokens and metrics.

This package has the server for CPUs and its systemd unit, which listens on
127.0.0.1:50051 until /etc/meshsmooth/server.toml says otherwise.")
set(CPACK_DEBIAN_SERVER_PACKAGE_CONTROL_EXTRA
  "${PROJECT_SOURCE_DIR}/deploy/debian/conffiles;${PROJECT_SOURCE_DIR}/deploy/debian/postinst;${PROJECT_SOURCE_DIR}/deploy/debian/postrm;${PROJECT_SOURCE_DIR}/deploy/debian/prerm")

set(CPACK_DEBIAN_LIBRARIES_PACKAGE_NAME libmeshsmooth-dev)
set(CPACK_DEBIAN_LIBRARIES_PACKAGE_SECTION libdevel)
set(CPACK_DEBIAN_LIBRARIES_PACKAGE_DEPENDS
  "libgrpc++-dev, libprotobuf-dev, libssl-dev, libtbb-dev, protobuf-compiler, protobuf-compiler-grpc")
set(CPACK_DEBIAN_LIBRARIES_DESCRIPTION "C++ libraries that improve finite-element meshes
Smooths, optimizes and untangles meshes in the own process, or on a server
by a client.

This package has headers, static libraries, the protocol and the CMake package
meshsmooth with the targets meshsmooth::client, ::smooth, ::wire and ::mesh.")

# Only with the component: an install below another prefix must not write to /etc.
install(FILES deploy/systemd/meshsmooth-server.service DESTINATION lib/systemd/system
  COMPONENT server EXCLUDE_FROM_ALL)
install(FILES deploy/systemd/server.toml DESTINATION /etc/meshsmooth
  COMPONENT server EXCLUDE_FROM_ALL)
include(CPack)
