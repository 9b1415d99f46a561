# Writes OUT: C++ that includes HEADER and defines, in NAMESPACE, a std::string_view for every NAME=FILE of TEXTS.
# Texts may be longer than the standard asks of compilers.
set(code "#pragma GCC diagnostic ignored \"-Woverlength-strings\"\n#include \"${HEADER}\"\nnamespace ${NAMESPACE} {\n")
foreach(pair IN LISTS TEXTS)
  string(REGEX MATCH "^([a-z_]+)=(.*)$" matched "${pair}")
  set(name "${CMAKE_MATCH_1}")
  file(READ "${CMAKE_MATCH_2}" text)
  string(APPEND code "const std::string_view ${name} = R\"LODE(")
  string(APPEND code "${text}")
  string(APPEND code ")LODE\";\n")
endforeach()
string(APPEND code "}\n")
file(WRITE "${OUT}" "${code}")
