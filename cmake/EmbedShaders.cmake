# Writes OUT: the function FUNCTION, which adds every one of SHADERS to the library of shaders.
set(includes "")
set(adds "")
foreach(shader IN LISTS SHADERS)
  string(MAKE_C_IDENTIFIER "${shader}" symbol)
  string(APPEND includes "#include \"${symbol}.spv.h\"\n")
  string(APPEND adds "    add_shader(\"${shader}\", ${symbol});\n")
endforeach()
file(WRITE "${OUT}" "#include <cstdint>
#include \"render/shader_library.h\"
namespace {
${includes}}  // namespace
namespace lodestone {
void ${FUNCTION}();
void ${FUNCTION}() {
${adds}}
}  // namespace lodestone
")
