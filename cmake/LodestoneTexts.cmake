# lodestone_texts(TARGET HEADER NAMESPACE name=file...)
#   Embeds each file in TARGET as the std::string_view NAMESPACE::name, which HEADER declares; once for a target.
function(lodestone_texts target header namespace)
  set(source "${CMAKE_CURRENT_BINARY_DIR}/${target}_texts.cpp")
  list(TRANSFORM ARGN REPLACE "^[a-z_]+=" "" OUTPUT_VARIABLE files)
  add_custom_command(OUTPUT "${source}"
    COMMAND "${CMAKE_COMMAND}" "-DOUT=${source}" "-DHEADER=${header}" "-DNAMESPACE=${namespace}" "-DTEXTS=${ARGN}"
      -P "${PROJECT_SOURCE_DIR}/cmake/EmbedTexts.cmake"
    DEPENDS ${files} "${PROJECT_SOURCE_DIR}/cmake/EmbedTexts.cmake" VERBATIM)
  set_source_files_properties("${source}" PROPERTIES SKIP_UNITY_BUILD_INCLUSION ON)  # made by a build: units are of what is written
  target_sources(${target} PRIVATE "${source}")
endfunction()
