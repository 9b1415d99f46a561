# Writes OUT: the function FUNCTION, which adds every one of SHADERS to the library of shaders. FOLDER has their SPIR-V.
set(words "")
set(adds "")
foreach(shader IN LISTS SHADERS)
  string(MAKE_C_IDENTIFIER "${shader}" symbol)
  file(READ "${FOLDER}/${symbol}.spv" bytes HEX)
  string(REGEX REPLACE "(..)(..)(..)(..)" "0x\\4\\3\\2\\1," bytes "${bytes}")
  string(APPEND words "const uint32_t ${symbol}[] = {${bytes}};\n")
  string(APPEND adds "    add_shader(\"${shader}\", ${symbol});\n")
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
