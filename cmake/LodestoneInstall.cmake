# Installed, in four components that are packages of their own (LodestonePackages.cmake):
#   program      the program, and the one that reads .vdb for it
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
  install(DIRECTORY "${PROJECT_SOURCE_DIR}/examples/c" DESTINATION "${CMAKE_INSTALL_DATADIR}/doc/liblodestone-dev/examples"
    COMPONENT development)

  # The manual page and the completion are what the program says of itself.
  find_package(Python3 REQUIRED COMPONENTS Interpreter)
  set(beside "${PROJECT_BINARY_DIR}/beside")
  add_custom_command(OUTPUT "${beside}/lodestone.1" "${beside}/lodestone.bash"
    COMMAND "${CMAKE_COMMAND}" -E env "${LODESTONE_DRIVER_ENVIRONMENT}" "${Python3_EXECUTABLE}" "${PROJECT_SOURCE_DIR}/scripts/program-files.py" "$<TARGET_FILE:lodestone>" "${beside}"
    DEPENDS lodestone "${PROJECT_SOURCE_DIR}/scripts/program-files.py" VERBATIM)
  add_custom_target(program_files ALL DEPENDS "${beside}/lodestone.1" "${beside}/lodestone.bash")
  install(FILES "${beside}/lodestone.1" DESTINATION "${CMAKE_INSTALL_MANDIR}/man1" COMPONENT program)
  install(FILES "${beside}/lodestone.bash" DESTINATION "${CMAKE_INSTALL_DATADIR}/bash-completion/completions" RENAME lodestone
    COMPONENT program)
  foreach(pair "program;lodestone" "library;liblodestone${PROJECT_VERSION_MAJOR}" "development;liblodestone-dev" "python;python3-lodestone")
    list(GET pair 0 component)
    list(GET pair 1 name)
    if(TARGET lodestone_python OR NOT component STREQUAL python)
      install(FILES "${PROJECT_SOURCE_DIR}/LICENSE" DESTINATION "${CMAKE_INSTALL_DATADIR}/doc/${name}" RENAME copyright COMPONENT ${component})
    endif()
  endforeach()
  if(TARGET lodestone_python)
    # Where Debian's Python looks; elsewhere PYTHONPATH names it.
    install(TARGETS lodestone_python LIBRARY DESTINATION "lib/python3/dist-packages/lodestone" COMPONENT python)
    install(DIRECTORY "${PROJECT_SOURCE_DIR}/apps/python/lodestone/" DESTINATION "lib/python3/dist-packages/lodestone" COMPONENT python)
    install(DIRECTORY "${PROJECT_SOURCE_DIR}/examples/python" DESTINATION "${CMAKE_INSTALL_DATADIR}/doc/python3-lodestone/examples"
      COMPONENT python)
  endif()
endif()
