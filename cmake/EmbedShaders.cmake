# Writes OUT: the function FUNCTION, which adds every one of SHADERS to the library of shaders. FOLDER has their SPIR-V; where OPTIMISED is
# true that of drivers, too.
function(words_of name file to)
  file(READ "${file}" bytes HEX)
  string(REGEX REPLACE "(..)(..)(..)(..)" "0x\\4\\3\\2\\1," bytes "${bytes}")
  set(${to} "const uint32_t ${name}[] = {${bytes}};\n" PARENT_SCOPE)
endfunction()
set(words "")
set(adds "")
foreach(shader IN LISTS SHADERS)
  string(MAKE_C_IDENTIFIER "${shader}" symbol)
  words_of(${symbol} "${FOLDER}/${symbol}.spv" compiled)
  string(APPEND words "${compiled}")
  set(for_drivers ${symbol})
  if(OPTIMISED)
    set(for_drivers ${symbol}_opt)
    words_of(${for_drivers} "${FOLDER}/${symbol}.spv.opt" optimised)
    string(APPEND words "${optimised}")
  endif()
  string(APPEND adds "    add_shader(\"${shader}\", {${for_drivers}, ${symbol}});\n")
endforeach()
file(WRITE "${OUT}" "#include <cstdint>
#include \"render/shader_library.h\"
namespace {
${words}}  // namespace
namespace lodestone {
void ${FUNCTION}();
void ${FUNCTION}() {
${adds}}
}  // namespace lodestone
")
