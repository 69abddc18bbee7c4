# Libraries, command, headers, CMake package and pkg-config files.
include(CMakePackageConfigHelpers)

install(TARGETS btfield btfield_experiment EXPORT btfield_targets)
if(TARGET btfield_pictures)
    install(TARGETS btfield_pictures LIBRARY DESTINATION ${CMAKE_INSTALL_LIBDIR}/btfield)
endif()
install(TARGETS btfield_cli)
install(DIRECTORY include/btfield TYPE INCLUDE)

set(package_dir ${CMAKE_INSTALL_LIBDIR}/cmake/btfield)
install(EXPORT btfield_targets NAMESPACE btfield:: DESTINATION ${package_dir})
configure_package_config_file(cmake/btfield-config.cmake.in ${CMAKE_CURRENT_BINARY_DIR}/btfield-config.cmake
                              INSTALL_DESTINATION ${package_dir})
write_basic_package_version_file(${CMAKE_CURRENT_BINARY_DIR}/btfield-config-version.cmake
                                 COMPATIBILITY SameMinorVersion)
install(FILES ${CMAKE_CURRENT_BINARY_DIR}/btfield-config.cmake ${CMAKE_CURRENT_BINARY_DIR}/btfield-config-version.cmake
        DESTINATION ${package_dir})

file(RELATIVE_PATH PC_PREFIX /${CMAKE_INSTALL_LIBDIR}/pkgconfig /)  # wherever the tree is moved to
foreach(name btfield btfield-experiment)
    configure_file(cmake/${name}.pc.in ${CMAKE_CURRENT_BINARY_DIR}/${name}.pc @ONLY)
    install(FILES ${CMAKE_CURRENT_BINARY_DIR}/${name}.pc DESTINATION ${CMAKE_INSTALL_LIBDIR}/pkgconfig)
endforeach()
