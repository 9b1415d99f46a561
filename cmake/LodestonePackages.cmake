# Packages for Debian 12: `cpack --config BUILD/CPackConfig.cmake` writes lodestone, liblodestone0, liblodestone-dev and
# python3-lodestone. Packages that a program or library needs are found by dpkg-shlibdeps.
set(CPACK_GENERATOR DEB)
set(CPACK_PACKAGE_NAME lodestone)
set(CPACK_PACKAGE_VENDOR "The Lodestone maintainers")
set(CPACK_PACKAGE_CONTACT "The Lodestone maintainers <maintainers@lodestone.invalid>")
set(CPACK_PACKAGE_DESCRIPTION_SUMMARY "continuous level-of-detail engine")
set(CPACK_PACKAGING_INSTALL_PREFIX /usr)
set(CPACK_COMPONENTS_ALL program library development)
if(TARGET lodestone_python)
  list(APPEND CPACK_COMPONENTS_ALL python)
endif()
set(CPACK_STRIP_FILES ON)
set(CPACK_DEB_COMPONENT_INSTALL ON)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_RELEASE 1)
set(CPACK_DEBIAN_PACKAGE_CONTROL_STRICT_PERMISSION ON)
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS ON)

set(CPACK_DEBIAN_PROGRAM_PACKAGE_NAME lodestone)
set(CPACK_DEBIAN_PROGRAM_PACKAGE_SECTION graphics)
set(CPACK_DEBIAN_PROGRAM_PACKAGE_RECOMMENDS mesa-vulkan-drivers)
set(CPACK_COMPONENT_PROGRAM_DESCRIPTION "continuous level-of-detail engine: the program
 Bakes meshes of millions of triangles into progressive meshes and virtual
 geometry images, and draws, measures and exports them.")

set(CPACK_DEBIAN_LIBRARY_PACKAGE_NAME liblodestone${PROJECT_VERSION_MAJOR})
set(CPACK_DEBIAN_LIBRARY_PACKAGE_SECTION libs)
set(CPACK_DEBIAN_LIBRARY_PACKAGE_GENERATE_SHLIBS ON)
set(CPACK_COMPONENT_LIBRARY_DESCRIPTION "continuous level-of-detail engine: the shared library
 Its C interface bakes and opens assets, simplifies meshes, and gives what is
 to be drawn for a view as vertices and indices.")

# The C interface needs no other package; find_package(Lodestone) for C++ needs those that are recommended.
set(CPACK_DEBIAN_DEVELOPMENT_PACKAGE_NAME liblodestone-dev)
set(CPACK_DEBIAN_DEVELOPMENT_PACKAGE_SECTION libdevel)
set(CPACK_DEBIAN_DEVELOPMENT_PACKAGE_SHLIBDEPS OFF)
set(CPACK_DEBIAN_DEVELOPMENT_PACKAGE_DEPENDS "liblodestone${PROJECT_VERSION_MAJOR} (= ${PROJECT_VERSION}-1)")
set(CPACK_DEBIAN_DEVELOPMENT_PACKAGE_RECOMMENDS "g++, cmake, pkg-config, libopenmesh-dev, libeigen3-dev, libglm-dev, libmeshoptimizer-dev, libtinygltf-dev, libdraco-dev, libwebp-dev, libstb-dev, libopenvdb-dev, nlohmann-json3-dev, libexpected-dev, libpng-dev, libjpeg-dev, libtiff-dev, libproj-dev, zlib1g-dev, libzstd-dev, libvulkan-dev, libglfw3-dev, libimgui-dev")
set(CPACK_COMPONENT_DEVELOPMENT_DESCRIPTION "continuous level-of-detail engine: headers and static libraries
 The header of the C interface, and the C++ libraries with their headers.")

set(CPACK_DEBIAN_PYTHON_PACKAGE_NAME python3-lodestone)
set(CPACK_DEBIAN_PYTHON_PACKAGE_SECTION python)
set(CPACK_DEBIAN_PYTHON_PACKAGE_DEPENDS "python3 (>= ${LODESTONE_PYTHON_VERSION}~), python3 (<< ${LODESTONE_PYTHON_NEXT}~), python3-numpy")
set(CPACK_DEBIAN_PYTHON_PACKAGE_RECOMMENDS mesa-vulkan-drivers)
set(CPACK_DEBIAN_PYTHON_PACKAGE_SUGGESTS python3-matplotlib)
set(CPACK_COMPONENT_PYTHON_DESCRIPTION "continuous level-of-detail engine: Python module
 Bakes, simplifies, measures and draws meshes from numpy arrays.")
include(CPack)
