# Libraries, command with its completions, manual pages and documents, headers, CMake package and pkg-config files.
# Components are those of packages: library, experiment, command, development.
include(CMakePackageConfigHelpers)

install(TARGETS btfield EXPORT btfield_targets
        LIBRARY COMPONENT library NAMELINK_COMPONENT development ARCHIVE COMPONENT development)
install(TARGETS btfield_experiment EXPORT btfield_targets
        LIBRARY COMPONENT experiment NAMELINK_COMPONENT development ARCHIVE COMPONENT development)
if(TARGET btfield_pictures)
    install(TARGETS btfield_pictures LIBRARY DESTINATION ${CMAKE_INSTALL_LIBDIR}/btfield COMPONENT library)
endif()
install(TARGETS btfield_cli COMPONENT command)
install(DIRECTORY include/btfield TYPE INCLUDE COMPONENT development)

# Completions and manual pages are what the command says of itself.
set(BTFIELD_ZSH_COMPLETIONS ${CMAKE_INSTALL_DATADIR}/zsh/site-functions CACHE STRING "Folder of zsh completions")
set(texts ${CMAKE_CURRENT_BINARY_DIR}/command_texts)
if(NOT BTFIELD_SANITIZE)  # nothing is installed from there
    add_custom_command(
        TARGET btfield_cli POST_BUILD
        COMMAND ${CMAKE_COMMAND} -E rm -rf ${texts}
        COMMAND ${CMAKE_COMMAND} -E make_directory ${texts}/man1
        COMMAND btfield_cli completion bash -o ${texts}/btfield
        COMMAND btfield_cli completion zsh -o ${texts}/_btfield
        COMMAND btfield_cli completion fish -o ${texts}/btfield.fish
        COMMAND btfield_cli man --all ${texts}/man1
        COMMENT "Completions and manual pages" VERBATIM)
endif()
install(FILES ${texts}/btfield DESTINATION ${CMAKE_INSTALL_DATADIR}/bash-completion/completions COMPONENT command)
install(FILES ${texts}/_btfield DESTINATION ${BTFIELD_ZSH_COMPLETIONS} COMPONENT command)
install(FILES ${texts}/btfield.fish DESTINATION ${CMAKE_INSTALL_DATADIR}/fish/vendor_completions.d COMPONENT command)
install(DIRECTORY ${texts}/man1 DESTINATION ${CMAKE_INSTALL_MANDIR} COMPONENT command)

# Documents as messages and each other name them: docs/NAME beside README.md. A program to paste from belongs to those
# who compile.
set(documents ${CMAKE_INSTALL_DATADIR}/doc/btfield)
install(FILES README.md CITATION.cff DESTINATION ${documents} COMPONENT command)
install(DIRECTORY docs DESTINATION ${documents} COMPONENT command)
install(DIRECTORY examples DESTINATION ${documents} COMPONENT development FILES_MATCHING PATTERN "*.cpp")
if(NOT BTFIELD_PACKAGES)  # which have them in the form that Debian wants
    install(FILES LICENSE CHANGELOG.md DESTINATION ${documents} COMPONENT command)
endif()

set(package_dir ${CMAKE_INSTALL_LIBDIR}/cmake/btfield)
install(EXPORT btfield_targets NAMESPACE btfield:: DESTINATION ${package_dir} COMPONENT development)
configure_package_config_file(cmake/btfield-config.cmake.in ${CMAKE_CURRENT_BINARY_DIR}/btfield-config.cmake
                              INSTALL_DESTINATION ${package_dir})
write_basic_package_version_file(${CMAKE_CURRENT_BINARY_DIR}/btfield-config-version.cmake
                                 COMPATIBILITY SameMinorVersion)
install(FILES ${CMAKE_CURRENT_BINARY_DIR}/btfield-config.cmake ${CMAKE_CURRENT_BINARY_DIR}/btfield-config-version.cmake
        DESTINATION ${package_dir} COMPONENT development)

file(RELATIVE_PATH PC_PREFIX /${CMAKE_INSTALL_LIBDIR}/pkgconfig /)  # wherever the tree is moved to
# A program finds the library where it was linked to it, in a folder of one's own too; packages install where the loader
# looks.
if(BUILD_SHARED_LIBS AND NOT CMAKE_SKIP_INSTALL_RPATH)
    set(PC_RPATH " -Wl,-rpath,\${libdir}")
endif()
# pkg-config wants private requirements to be installed even where it only lists flags: a shared library names none.
if(NOT BUILD_SHARED_LIBS)
    set(PC_PRIVATE "Requires.private: OpenCL clFFT OpenImageIO libpng libtiff-4 libjpeg zlib lcms2 libzip\nLibs.private: -pthread")
    set(PC_EXPERIMENT_PRIVATE "Requires.private: sqlite3")
endif()
foreach(name btfield btfield-experiment)
    configure_file(cmake/${name}.pc.in ${CMAKE_CURRENT_BINARY_DIR}/${name}.pc @ONLY)
    install(FILES ${CMAKE_CURRENT_BINARY_DIR}/${name}.pc DESTINATION ${CMAKE_INSTALL_LIBDIR}/pkgconfig
            COMPONENT development)
endforeach()
