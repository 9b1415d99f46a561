# Installed, in four components that are packages of their own (LodestonePackages.cmake):
#   program      the program
#   library      the shared library of the C interface
#   development  its header, the C++ libraries with their headers, and what find_package(Lodestone) and pkg-config look for
#   python       the Python module (apps/python)
include(CMakePackageConfigHelpers)
include(PublicHeaders)

foreach(header ${LODESTONE_PUBLIC_HEADERS})
  get_filename_component(folder "${header}" DIRECTORY)
  install(FILES "${PROJECT_SOURCE_DIR}/src/${header}" DESTINATION "${CMAKE_INSTALL_INCLUDEDIR}/lodestone/${folder}" COMPONENT development)
endforeach()

install(DIRECTORY "${PROJECT_SOURCE_DIR}/shaders/shared" DESTINATION "${CMAKE_INSTALL_INCLUDEDIR}/lodestone/shaders" COMPONENT development
  FILES_MATCHING PATTERN "*.h")
get_property(libraries GLOBAL PROPERTY LODESTONE_LIBRARIES)
set(package "${CMAKE_INSTALL_LIBDIR}/cmake/Lodestone")
install(TARGETS ${libraries} EXPORT LodestoneTargets
  ARCHIVE DESTINATION "${CMAKE_INSTALL_LIBDIR}" COMPONENT development
  LIBRARY DESTINATION "${CMAKE_INSTALL_LIBDIR}" COMPONENT development)
install(EXPORT LodestoneTargets NAMESPACE Lodestone:: DESTINATION "${package}" COMPONENT development)
configure_package_config_file("${PROJECT_SOURCE_DIR}/cmake/LodestoneConfig.cmake.in"
  "${PROJECT_BINARY_DIR}/LodestoneConfig.cmake" INSTALL_DESTINATION "${package}")
write_basic_package_version_file("${PROJECT_BINARY_DIR}/LodestoneConfigVersion.cmake" COMPATIBILITY SameMinorVersion)
install(FILES "${PROJECT_BINARY_DIR}/LodestoneConfig.cmake" "${PROJECT_BINARY_DIR}/LodestoneConfigVersion.cmake"
  DESTINATION "${package}" COMPONENT development)

if(LODESTONE_APPS)
  install(TARGETS lodestone RUNTIME DESTINATION "${CMAKE_INSTALL_BINDIR}" COMPONENT program)
  install(TARGETS lodestone_c EXPORT LodestoneCTargets LIBRARY DESTINATION "${CMAKE_INSTALL_LIBDIR}"
    COMPONENT library NAMELINK_COMPONENT development)
  install(EXPORT LodestoneCTargets NAMESPACE Lodestone:: DESTINATION "${package}" COMPONENT development)
  install(FILES "${PROJECT_SOURCE_DIR}/apps/c/lodestone.h" DESTINATION "${CMAKE_INSTALL_INCLUDEDIR}" COMPONENT development)
  set(pkgconfig "${CMAKE_INSTALL_LIBDIR}/pkgconfig")
  file(RELATIVE_PATH LODESTONE_PREFIX_FROM_PC "/prefix/${pkgconfig}" "/prefix")
  string(REGEX REPLACE "/$" "" LODESTONE_PREFIX_FROM_PC "${LODESTONE_PREFIX_FROM_PC}")
  configure_file("${PROJECT_SOURCE_DIR}/apps/c/lodestone.pc.in" "${PROJECT_BINARY_DIR}/lodestone.pc" @ONLY)
  install(FILES "${PROJECT_BINARY_DIR}/lodestone.pc" DESTINATION "${pkgconfig}" COMPONENT development)
  install(DIRECTORY "${PROJECT_SOURCE_DIR}/examples/c" DESTINATION "${CMAKE_INSTALL_DOCDIR}/examples" COMPONENT development)
endif()
