# Installed: the libraries with their headers, the program, and a package for find_package(Lodestone).
include(CMakePackageConfigHelpers)
include(PublicHeaders)

foreach(header ${LODESTONE_PUBLIC_HEADERS})
  get_filename_component(folder "${header}" DIRECTORY)
  install(FILES "${PROJECT_SOURCE_DIR}/src/${header}" DESTINATION "${CMAKE_INSTALL_INCLUDEDIR}/lodestone/${folder}")
endforeach()

install(DIRECTORY "${PROJECT_SOURCE_DIR}/shaders/shared" DESTINATION "${CMAKE_INSTALL_INCLUDEDIR}/lodestone/shaders"
  FILES_MATCHING PATTERN "*.h")
get_property(libraries GLOBAL PROPERTY LODESTONE_LIBRARIES)
install(TARGETS ${libraries} EXPORT LodestoneTargets
  ARCHIVE DESTINATION "${CMAKE_INSTALL_LIBDIR}" LIBRARY DESTINATION "${CMAKE_INSTALL_LIBDIR}")
install(EXPORT LodestoneTargets NAMESPACE Lodestone:: DESTINATION "${CMAKE_INSTALL_LIBDIR}/cmake/Lodestone")
configure_package_config_file("${PROJECT_SOURCE_DIR}/cmake/LodestoneConfig.cmake.in"
  "${PROJECT_BINARY_DIR}/LodestoneConfig.cmake" INSTALL_DESTINATION "${CMAKE_INSTALL_LIBDIR}/cmake/Lodestone")
write_basic_package_version_file("${PROJECT_BINARY_DIR}/LodestoneConfigVersion.cmake" COMPATIBILITY SameMinorVersion)
install(FILES "${PROJECT_BINARY_DIR}/LodestoneConfig.cmake" "${PROJECT_BINARY_DIR}/LodestoneConfigVersion.cmake"
  DESTINATION "${CMAKE_INSTALL_LIBDIR}/cmake/Lodestone")
