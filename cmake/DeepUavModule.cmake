# deepuav_module(NAME [ROOMS folders...] [DEPENDS modules...] [LINK targets...] [TEST_LINK targets...]
#                [OPENVINO_TESTS filter] [EXCLUDE regex])
#
# One library target of the sources of the folder and of its ROOMS, and one test program of their *_test.cc, but for those
# that EXCLUDE matches. Modules are made so that they can become part of the shared library, which shows nothing of them.
# DEPENDS are the modules whose headers this one may include: tests/include_graph_test.py holds the sources to them.
# OPENVINO_TESTS, a filter as of --gtest_filter, picks the tests that run a network; ctest knows them by the label
# "network".
function(deepuav_module NAME)
  cmake_parse_arguments(ARG "" "OPENVINO_TESTS;EXCLUDE" "ROOMS;DEPENDS;LINK;TEST_LINK" ${ARGN})
  list(TRANSFORM ARG_ROOMS APPEND "/*.cc")
  file(GLOB sources CONFIGURE_DEPENDS *.cc ${ARG_ROOMS})
  if(ARG_EXCLUDE)
    list(FILTER sources EXCLUDE REGEX "${ARG_EXCLUDE}")
  endif()
  set(tests ${sources})
  list(FILTER sources EXCLUDE REGEX "_test\\.cc$")
  list(FILTER tests INCLUDE REGEX "_test\\.cc$")
  list(TRANSFORM ARG_DEPENDS PREPEND "deepuav_")

  if(sources)
    add_library(deepuav_${NAME} STATIC ${sources})
    target_link_libraries(deepuav_${NAME} PUBLIC deepuav_settings ${ARG_DEPENDS} ${ARG_LINK})
    set_target_properties(deepuav_${NAME} PROPERTIES POSITION_INDEPENDENT_CODE ON CXX_VISIBILITY_PRESET hidden
      VISIBILITY_INLINES_HIDDEN ON)
  else()
    add_library(deepuav_${NAME} INTERFACE)
    target_link_libraries(deepuav_${NAME} INTERFACE deepuav_settings ${ARG_DEPENDS} ${ARG_LINK})
  endif()

  if(tests AND DEEPUAV_TESTS)
    add_executable(deepuav_${NAME}_test ${tests})
    target_link_libraries(deepuav_${NAME}_test PRIVATE deepuav_${NAME} ${ARG_TEST_LINK} GTest::gmock GTest::gtest_main)
    # A program's first start reads its libraries from a cold disk: 5 s, the default, are not always enough to list tests.
    set(discovery deepuav_${NAME}_test TEST_PREFIX "${NAME}." DISCOVERY_MODE PRE_TEST DISCOVERY_TIMEOUT 120)
    if(ARG_OPENVINO_TESTS)
      gtest_discover_tests(${discovery} TEST_FILTER "${ARG_OPENVINO_TESTS}" PROPERTIES LABELS network)
      gtest_discover_tests(${discovery} TEST_FILTER "-${ARG_OPENVINO_TESTS}")
    else()
      gtest_discover_tests(${discovery})
    endif()
  endif()
endfunction()

# deepuav_embed_files(TARGET HEADER function FILES...): the files as strings, found by their names with the function that
# HEADER declares.
function(deepuav_embed_files TARGET HEADER FUNCTION)
  string(REPLACE ";" "|" files "${ARGN}")
  set(output ${CMAKE_CURRENT_BINARY_DIR}/${FUNCTION}.cc)
  add_custom_command(OUTPUT ${output}
    COMMAND ${CMAKE_COMMAND} -DOUTPUT=${output} -DHEADER=${HEADER} -DFUNCTION=${FUNCTION} "-DFILES=${files}"
            -P ${PROJECT_SOURCE_DIR}/cmake/EmbedFiles.cmake
    DEPENDS ${ARGN} ${PROJECT_SOURCE_DIR}/cmake/EmbedFiles.cmake
    VERBATIM)
  target_sources(${TARGET} PRIVATE ${output})
endfunction()
