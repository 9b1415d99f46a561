# How every room of Lodestone is built: one function per kind of target, one place for flags.

set(CMAKE_CXX_STANDARD 20)
set(CMAKE_CXX_STANDARD_REQUIRED ON)
set(CMAKE_CXX_EXTENSIONS OFF)
set(CMAKE_POSITION_INDEPENDENT_CODE ON)
set(CMAKE_EXPORT_COMPILE_COMMANDS ON)
set(CMAKE_RUNTIME_OUTPUT_DIRECTORY "${CMAKE_BINARY_DIR}/bin")
set(THREADS_PREFER_PTHREAD_FLAG ON)
if(NOT CMAKE_BUILD_TYPE AND NOT CMAKE_CONFIGURATION_TYPES)
  set(CMAKE_BUILD_TYPE Release CACHE STRING "Build type" FORCE)
endif()

find_program(LODESTONE_CCACHE ccache)
if(LODESTONE_CCACHE)
  set(CMAKE_CXX_COMPILER_LAUNCHER "${LODESTONE_CCACHE}")
endif()

include(GNUInstallDirs)

# Flags of our own code. Contraction of a*b+c is off: the same input gives the same bytes with every compiler.
add_library(lodestone_flags INTERFACE)
target_compile_features(lodestone_flags INTERFACE cxx_std_20)
target_compile_options(lodestone_flags INTERFACE
  $<BUILD_INTERFACE:-Wall;-Wextra;-Wpedantic;-Wshadow;-Wnon-virtual-dtor;-ffp-contract=off>
  $<BUILD_INTERFACE:$<$<BOOL:${LODESTONE_WERROR}>:-Werror>>
  # Where several files are compiled as one, a local variable may have the name of a constant of another file, and a type of a file's own
  # seems to be of a header. Single files are looked at by clang-tidy.
  $<BUILD_INTERFACE:$<$<BOOL:${CMAKE_UNITY_BUILD}>:-Wno-shadow>>
  $<BUILD_INTERFACE:$<$<AND:$<BOOL:${CMAKE_UNITY_BUILD}>,$<CXX_COMPILER_ID:GNU>>:-Wno-subobject-linkage>>
  # GCC 12 warns of overlaps that cannot be in "literal" + std::string (its bug 105651).
  $<BUILD_INTERFACE:$<$<CXX_COMPILER_ID:GNU>:-Wno-restrict>>)
if(LODESTONE_SANITIZE)
  if(CMAKE_CXX_COMPILER_ID STREQUAL GNU)
    # Sanitizers hide from GCC what is initialised.
    target_compile_options(lodestone_flags INTERFACE $<BUILD_INTERFACE:-Wno-maybe-uninitialized>)
  endif()
  add_compile_options(-fsanitize=${LODESTONE_SANITIZE} -fno-omit-frame-pointer)
  add_link_options(-fsanitize=${LODESTONE_SANITIZE})
  if(LODESTONE_SANITIZE MATCHES "undefined")
    add_compile_options(-fno-sanitize-recover=undefined)
  endif()
endif()
if(LODESTONE_FUZZ)
  # Counters of what ran, which cost the tests little; calls at each comparison are for readers alone.
  add_compile_options(-fsanitize-coverage=inline-8bit-counters,pc-table)
endif()
set_property(GLOBAL PROPERTY LODESTONE_LIBRARIES lodestone_flags)

# lodestone_sources(OUT [folder...])   every .cpp of the current folder and of the folders named below it.
function(lodestone_sources out)
  set(patterns "${CMAKE_CURRENT_SOURCE_DIR}/*.cpp")
  foreach(folder ${ARGN})
    list(APPEND patterns "${CMAKE_CURRENT_SOURCE_DIR}/${folder}/*.cpp")
  endforeach()
  file(GLOB found CONFIGURE_DEPENDS ${patterns})
  set(${out} ${found} PARENT_SCOPE)
endfunction()

# lodestone_library(NAME [FOLDERS folder...] [PUBLIC lib...] [PRIVATE lib...])
#   Builds every .cpp of the current folder and of FOLDERS below it into the static library lodestone_NAME, known as
#   Lodestone::NAME. PUBLIC libraries appear in its headers, PRIVATE ones only in its .cpp files.
function(lodestone_library name)
  cmake_parse_arguments(PARSE_ARGV 1 arg "" "" "FOLDERS;PUBLIC;PRIVATE")
  lodestone_sources(sources ${arg_FOLDERS})
  add_library(lodestone_${name} STATIC ${sources})
  add_library(Lodestone::${name} ALIAS lodestone_${name})
  set_target_properties(lodestone_${name} PROPERTIES EXPORT_NAME ${name})
  target_include_directories(lodestone_${name} PUBLIC
    $<BUILD_INTERFACE:${PROJECT_SOURCE_DIR}/src>
    $<BUILD_INTERFACE:${PROJECT_SOURCE_DIR}>  # for "shaders/shared/..."
    $<INSTALL_INTERFACE:${CMAKE_INSTALL_INCLUDEDIR}/lodestone>)
  target_link_libraries(lodestone_${name} PUBLIC lodestone_flags ${arg_PUBLIC} PRIVATE ${arg_PRIVATE})
  set_property(GLOBAL APPEND PROPERTY LODESTONE_LIBRARIES lodestone_${name})
endfunction()

# Vulkan drivers and layers leak and race in ways that are theirs. Objects of ours that outlive the device are found by validation.
if(LODESTONE_SANITIZE MATCHES "thread")
  set(LODESTONE_DRIVER_ENVIRONMENT "TSAN_OPTIONS=suppressions=${PROJECT_SOURCE_DIR}/cmake/drivers.tsan")
else()
  set(LODESTONE_DRIVER_ENVIRONMENT "ASAN_OPTIONS=detect_leaks=0")
endif()

# lodestone_reader(TARGET)
#   Where the drivers of libFuzzer are built, they are told of each comparison in the target: of the words a format asks for.
function(lodestone_reader target)
  if(LODESTONE_FUZZ)
    target_compile_options(${target} PRIVATE -fsanitize-coverage=trace-cmp)
  endif()
endfunction()

# lodestone_test(NAME [DRAWS] [FOLDERS folder...] [UNCHECKED pattern...] [TOGETHER suite...] LIBRARIES lib...)
#   Builds every .cpp of the current folder and of FOLDERS below it into the GoogleTest program test_NAME. Its tests have the label
#   `fast`, which `make check` runs with sanitizers, but for these: `draws` where it DRAWS (needs a Vulkan driver); `unchecked` where a
#   pattern names them, because they take minutes with sanitizers and others run the same code; `long` in suites whose name ends
#   with Long, which `make test` leaves out. Suites named by TOGETHER are one test each: what all of a suite's tests share, and takes
#   long to make, is made once (but for those that are UNCHECKED). The target fast_tests builds the programs that have tests labelled
#   `fast`.
function(lodestone_test name)
  cmake_parse_arguments(PARSE_ARGV 1 arg "DRAWS" "" "FOLDERS;UNCHECKED;TOGETHER;LIBRARIES")
  lodestone_sources(sources ${arg_FOLDERS})
  add_executable(test_${name} ${sources})
  target_link_libraries(test_${name} PRIVATE lodestone_flags ${arg_LIBRARIES} GTest::gmock GTest::gtest_main)
  target_include_directories(test_${name} PRIVATE "${PROJECT_SOURCE_DIR}/tests")
  # What they test is optimised, they compile in half the time.
  target_compile_options(test_${name} PRIVATE $<$<CONFIG:Release,None>:-O1>)
  target_compile_definitions(test_${name} PRIVATE
    LODESTONE_SOURCE_DIR="${PROJECT_SOURCE_DIR}" LODESTONE_BINARY_DIR="${PROJECT_BINARY_DIR}")
  set(properties TIMEOUT 900)
  set(label fast)
  if(arg_DRAWS)
    list(APPEND properties ENVIRONMENT "${LODESTONE_DRIVER_ENVIRONMENT}")
    set(label draws)
  else()
    add_dependencies(fast_tests test_${name})
  endif()
  list(JOIN arg_UNCHECKED ":" unchecked)
  set(filter_${label} "-*Long.*:${unchecked}")
  foreach(suite IN LISTS arg_TOGETHER)
    string(APPEND filter_${label} ":${suite}.*")
    add_test(NAME ${name}.${suite} COMMAND test_${name} "--gtest_filter=${suite}.*-${unchecked}")
    set_tests_properties(${name}.${suite} PROPERTIES ${properties} LABELS ${label})
  endforeach()
  set(filter_unchecked "${unchecked}")
  set(filter_long "*Long.*")
  foreach(each ${label} unchecked long)
    if(filter_${each})
      gtest_discover_tests(test_${name} TEST_PREFIX "${name}." DISCOVERY_TIMEOUT 60 TEST_FILTER "${filter_${each}}"
        TEST_LIST found_${name}_${each} PROPERTIES ${properties} LABELS ${each})
    endif()
  endforeach()
endfunction()
