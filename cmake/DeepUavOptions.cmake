option(DEEPUAV_TESTS "Build the tests (GoogleTest)" ON)
option(DEEPUAV_BENCH "Build the micro benchmarks" ON)
option(DEEPUAV_SIMULATION "Build the simulator and the commands that need it (Embree)" ON)
option(DEEPUAV_REPORT "Build the report's page (three.js and Chart.js)" ON)
option(DEEPUAV_MAVLINK "Build what tells an autopilot where the vehicle is (pymavlink makes its headers)" ON)
option(DEEPUAV_WHEEL "Build and install what the Python package holds: pyproject.toml sets it" OFF)
set(DEEPUAV_SANITIZER "" CACHE STRING "address (with undefined), thread or empty")
set(DEEPUAV_ARCH "x86-64-v3" CACHE STRING "-march= on x86-64; one level for all, so results do not depend on the machine that built")

find_program(CCACHE_PROGRAM ccache)
if(CCACHE_PROGRAM AND NOT CMAKE_CXX_COMPILER_LAUNCHER)
  set(CMAKE_CXX_COMPILER_LAUNCHER ${CCACHE_PROGRAM})
endif()

# Compile and link settings that every target of the project shares.
add_library(deepuav_settings INTERFACE)
target_compile_options(deepuav_settings INTERFACE
  -Wall -Wextra -Wpedantic -Werror -Wshadow -Wnon-virtual-dtor -Woverloaded-virtual
  # What is installed names no folder of the machine that compiled it.
  -ffile-prefix-map=${PROJECT_SOURCE_DIR}/=)
if(CMAKE_SYSTEM_PROCESSOR MATCHES "x86_64|AMD64" AND DEEPUAV_ARCH)
  target_compile_options(deepuav_settings INTERFACE -march=${DEEPUAV_ARCH})
endif()
target_include_directories(deepuav_settings INTERFACE ${PROJECT_SOURCE_DIR}/src)

if(DEEPUAV_SANITIZER STREQUAL "address")
  set(sanitizer_flags -fsanitize=address,undefined -fno-sanitize-recover=undefined -fno-omit-frame-pointer)
elseif(DEEPUAV_SANITIZER STREQUAL "thread")
  # Asio's fences are not seen, nor needed: it takes locks beside them.
  set(sanitizer_flags -fsanitize=thread -fno-omit-frame-pointer -Wno-tsan)
elseif(DEEPUAV_SANITIZER)
  message(FATAL_ERROR "DEEPUAV_SANITIZER is '${DEEPUAV_SANITIZER}': expected address, thread or nothing")
endif()
if(sanitizer_flags)
  # Line tables are all that a report needs, and a third of the compile time less than -g.
  # At -O1, g++ 12 sees the delete of asio's coroutines, but not their new; with the sanitizers it takes what std::regex
  # moves from for uninitialized.
  target_compile_options(deepuav_settings INTERFACE ${sanitizer_flags} -O1 -g1 -Wno-mismatched-new-delete
    -Wno-maybe-uninitialized)
  target_link_options(deepuav_settings INTERFACE ${sanitizer_flags})
endif()
