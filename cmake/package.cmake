# Debian packages, one for each component of install.cmake: ./dev package. CMAKE_INSTALL_PREFIX is /usr, so that libraries
# go to the folder of their architecture.
set(library_package libbtfield${PROJECT_VERSION_MAJOR})
set(experiment_package libbtfield-experiment${PROJECT_VERSION_MAJOR})

set(CPACK_GENERATOR DEB)
set(CPACK_OUTPUT_FILE_PREFIX packages)
set(CPACK_PACKAGING_INSTALL_PREFIX ${CMAKE_INSTALL_PREFIX})
set(CPACK_STRIP_FILES ON)
set(CPACK_INSTALL_DEFAULT_DIRECTORY_PERMISSIONS
    OWNER_READ OWNER_WRITE OWNER_EXECUTE GROUP_READ GROUP_EXECUTE WORLD_READ WORLD_EXECUTE)
set(CPACK_PACKAGE_DESCRIPTION_SUMMARY "")  # each package has its own
set(CPACK_PACKAGE_CONTACT "btfield developers <developers@btfield.invalid>")
set(CPACK_RESOURCE_FILE_LICENSE ${PROJECT_SOURCE_DIR}/LICENSE)

set(CPACK_DEB_COMPONENT_INSTALL ON)
set(CPACK_COMPONENTS_ALL command library experiment development)
set(CPACK_COMPONENTS_GROUPING IGNORE)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_RELEASE 1)
set(CPACK_DEBIAN_COMPRESSION_TYPE xz)
# What the files need is read from them; the packages among themselves go together to the version.
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS ON)
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS_PRIVATE_DIRS ${BTFIELD_LIBRARY_DIR})
set(CPACK_DEBIAN_ENABLE_COMPONENT_DEPENDS ON)
set(CPACK_COMPONENT_COMMAND_DEPENDS library experiment)
set(CPACK_COMPONENT_EXPERIMENT_DEPENDS library)
set(CPACK_COMPONENT_DEVELOPMENT_DEPENDS library experiment)

set(CPACK_DEBIAN_COMMAND_PACKAGE_NAME btfield)
set(CPACK_DEBIAN_COMMAND_PACKAGE_SECTION graphics)
set(CPACK_DEBIAN_COMMAND_PACKAGE_RECOMMENDS "pocl-opencl-icd | opencl-icd")
set(CPACK_DEBIAN_COMMAND_DESCRIPTION "random-field models of material textures
The command learns a model of a material from a picture and grows new texture
from it: any size, seamless at the edges, as many variants as there are seeds.
It computes on any OpenCL device.")

set(CPACK_DEBIAN_LIBRARY_PACKAGE_NAME ${library_package})
set(CPACK_DEBIAN_LIBRARY_PACKAGE_SECTION libs)
set(CPACK_DEBIAN_LIBRARY_PACKAGE_SUGGESTS "pocl-opencl-icd | opencl-icd")
set(CPACK_DEBIAN_LIBRARY_DESCRIPTION "random-field models of material textures: library
A C++20 library that fits random-field models to pictures of materials and
synthesises texture of any size on any OpenCL device. With the module that
reads and writes pictures.")

set(CPACK_DEBIAN_EXPERIMENT_PACKAGE_NAME ${experiment_package})
set(CPACK_DEBIAN_EXPERIMENT_PACKAGE_SECTION libs)
set(CPACK_DEBIAN_EXPERIMENT_DESCRIPTION "random-field models of material textures: experiments
A C++20 library that holds many models against many pictures and keeps the
results in a database.")

set(CPACK_DEBIAN_DEVELOPMENT_PACKAGE_NAME libbtfield-dev)
set(CPACK_DEBIAN_DEVELOPMENT_PACKAGE_SECTION libdevel)
set(CPACK_DEBIAN_DEVELOPMENT_DESCRIPTION "random-field models of material textures: development
Headers of the btfield libraries, with their CMake package and pkg-config
files.")

# What Debian wants beside the files: licence and changes of each package, and compressed manual pages.
find_program(GZIP gzip REQUIRED)
set(notices ${CMAKE_CURRENT_BINARY_DIR}/package_notices)
string(TIMESTAMP DEBIAN_YEAR "%Y" UTC)
string(TIMESTAMP DEBIAN_DATE "%a, %d %b %Y %H:%M:%S +0000" UTC)  # or $SOURCE_DATE_EPOCH
configure_file(cmake/debian/copyright.in ${notices}/copyright @ONLY)
configure_file(cmake/debian/changelog.in ${notices}/changelog.Debian @ONLY)
configure_file(CHANGELOG.md ${notices}/changelog COPYONLY)
execute_process(COMMAND ${GZIP} -9nf ${notices}/changelog.Debian ${notices}/changelog COMMAND_ERROR_IS_FATAL ANY)
foreach(component IN LISTS CPACK_COMPONENTS_ALL)
    string(TOUPPER ${component} upper)
    install(FILES ${notices}/copyright ${notices}/changelog.Debian.gz ${notices}/changelog.gz COMPONENT ${component}
            DESTINATION ${CMAKE_INSTALL_DATADIR}/doc/${CPACK_DEBIAN_${upper}_PACKAGE_NAME})
endforeach()
install(CODE "file(GLOB pages \"\$ENV{DESTDIR}\${CMAKE_INSTALL_PREFIX}/${CMAKE_INSTALL_MANDIR}/man1/*.1\")
              execute_process(COMMAND ${GZIP} -9nf \${pages} COMMAND_ERROR_IS_FATAL ANY)" COMPONENT command)
# Of the libraries: how packages that link them depend on them, and that the loader is to learn of them.
math(EXPR next "${PROJECT_VERSION_MINOR} + 1")
foreach(component library experiment)
    string(TOUPPER ${component} upper)
    set(package ${CPACK_DEBIAN_${upper}_PACKAGE_NAME})
    string(REGEX REPLACE "${PROJECT_VERSION_MAJOR}$" "" name ${package})
    string(REPLACE - _ name ${name})
    set(control ${notices}/${component})
    file(WRITE ${control}/triggers "activate-noawait ldconfig\n")
    file(WRITE ${control}/shlibs "${name} ${PROJECT_VERSION_MAJOR} ${package} (>= ${PROJECT_VERSION}), \
${package} (<< ${PROJECT_VERSION_MAJOR}.${next})\n")
    set(CPACK_DEBIAN_${upper}_PACKAGE_CONTROL_EXTRA ${control}/triggers ${control}/shlibs)
endforeach()

include(CPack)
