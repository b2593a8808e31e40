include(GNUInstallDirs)

# OpenVINO's libraries are installed into LIBDIR/deepuav; the Python package finds them in OpenVINO's, beside its own folder.
if(DEEPUAV_WHEEL)
  set(CMAKE_INSTALL_LIBDIR lib)
  set(DEEPUAV_LIBRARY_RPATH "$ORIGIN/../../openvino/libs")
  set(DEEPUAV_PROGRAM_RPATH "${DEEPUAV_LIBRARY_RPATH}")
else()
  set(DEEPUAV_LIBRARY_RPATH "$ORIGIN/deepuav")
  set(DEEPUAV_PROGRAM_RPATH "$ORIGIN/../${CMAKE_INSTALL_LIBDIR}/deepuav")
endif()
file(RELATIVE_PATH DEEPUAV_PREFIX_FROM_PKGCONFIG /${CMAKE_INSTALL_LIBDIR}/pkgconfig /)
string(REGEX REPLACE "/$" "" DEEPUAV_PREFIX_FROM_PKGCONFIG "${DEEPUAV_PREFIX_FROM_PKGCONFIG}")

install(DIRECTORY ${PROJECT_SOURCE_DIR}/models DESTINATION share/deepuav)
install(FILES ${PROJECT_SOURCE_DIR}/LICENSE DESTINATION share/doc/deepuav)
if(DEEPUAV_SIMULATION)
  install(DIRECTORY ${PROJECT_SOURCE_DIR}/flights DESTINATION share/deepuav)
endif()
if(NOT DEEPUAV_WHEEL)
  # Of OpenVINO what runs: the CPU, and models as ONNX and IR.
  install(DIRECTORY ${DEEPUAV_OPENVINO}/libs/ DESTINATION ${CMAKE_INSTALL_LIBDIR}/deepuav
    FILES_MATCHING PATTERN "libopenvino.so*" PATTERN "libopenvino_intel_cpu_plugin.so" PATTERN "libopenvino_ir_frontend.so*"
    PATTERN "libopenvino_onnx_frontend.so*" PATTERN "libtbb*.so*" PATTERN "libhwloc.so*" PATTERN "cache.json")
endif()

# `cpack -G DEB` in the build folder packs what was built there.
set(CMAKE_SKIP_INSTALL_ALL_DEPENDENCY ON)
set(CPACK_GENERATOR DEB)
set(CPACK_PACKAGE_NAME deepuav)
set(CPACK_PACKAGE_CONTACT "The Deep-UAV SLAM authors")
set(CPACK_PACKAGE_DESCRIPTION_SUMMARY "Monocular SLAM for drones with learned features")
set(CPACK_RESOURCE_FILE_LICENSE ${PROJECT_SOURCE_DIR}/LICENSE)
set(CPACK_PACKAGING_INSTALL_PREFIX /usr)
set(CPACK_STRIP_FILES ON)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_SECTION science)
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS ON)
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS_PRIVATE_DIRS ${DEEPUAV_OPENVINO}/libs)
include(CPack)
