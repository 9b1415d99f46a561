# lodestone_shaders(TARGET FOLDER FUNCTION)
#   Compiles every .vert .frag .comp .tesc .tese below FOLDER to SPIR-V and embeds them in TARGET, as the function
#   `void lodestone::FUNCTION()` that adds each under "folder/file.stage" (render/shader_library.h). What a shader includes is
#   tracked.

# What a driver would do for every pipeline is done once for every shader. None of these passes changes how a number is rounded, as those
# of -O and -Os may.
set(lodestone_shader_passes --wrap-opkill --eliminate-dead-branches --merge-return --inline-entry-points-exhaustive --eliminate-dead-functions
  --private-to-local --eliminate-local-single-block --eliminate-local-single-store --eliminate-dead-code-aggressive --scalar-replacement=0
  --convert-local-access-chains --eliminate-local-single-block --eliminate-local-single-store --eliminate-dead-code-aggressive --ssa-rewrite
  --eliminate-dead-code-aggressive --ccp --eliminate-dead-code-aggressive --eliminate-dead-branches --copy-propagate-arrays --vector-dce
  --eliminate-dead-inserts --eliminate-dead-members --merge-blocks --redundancy-elimination --eliminate-dead-code-aggressive --cfg-cleanup)

function(lodestone_shaders target folder function)
  file(GLOB_RECURSE shaders CONFIGURE_DEPENDS RELATIVE "${folder}"
    "${folder}/*.vert" "${folder}/*.frag" "${folder}/*.comp" "${folder}/*.tesc" "${folder}/*.tese")
  set(out "${CMAKE_CURRENT_BINARY_DIR}/shaders")
  set(compiled)
  foreach(shader IN LISTS shaders)
    string(MAKE_C_IDENTIFIER "${shader}" symbol)
    set(spirv "${out}/${symbol}.spv")
    set(outputs "${spirv}")
    set(optimize)
    if(SPIRV_OPT)
      list(APPEND outputs "${spirv}.opt")
      set(optimize COMMAND "${SPIRV_OPT}" --target-env=vulkan1.3 ${lodestone_shader_passes} "${spirv}" -o "${spirv}.opt")
    endif()
    add_custom_command(OUTPUT ${outputs}
      COMMAND "${CMAKE_COMMAND}" -E make_directory "${out}"
      COMMAND Vulkan::glslangValidator --target-env vulkan1.3 -g0 --quiet "-I${PROJECT_SOURCE_DIR}/shaders"
        --depfile "${spirv}.d" -o "${spirv}" "${folder}/${shader}"
      ${optimize}
      DEPENDS "${folder}/${shader}"
      DEPFILE "${spirv}.d"
      COMMENT "Shader ${shader}" VERBATIM)
    list(APPEND compiled ${outputs})
  endforeach()
  set(source "${out}/${function}.cpp")
  add_custom_command(OUTPUT "${source}"
    COMMAND "${CMAKE_COMMAND}" "-DOUT=${source}" "-DFOLDER=${out}" "-DSHADERS=${shaders}" "-DFUNCTION=${function}"
      "-DOPTIMISED=${SPIRV_OPT}"
      -P "${PROJECT_SOURCE_DIR}/cmake/EmbedShaders.cmake"
    DEPENDS ${compiled} "${PROJECT_SOURCE_DIR}/cmake/EmbedShaders.cmake" VERBATIM)
  set_source_files_properties("${source}" PROPERTIES SKIP_UNITY_BUILD_INCLUSION ON)  # made by a build: units are of what is written
  target_sources(${target} PRIVATE "${source}")
endfunction()
