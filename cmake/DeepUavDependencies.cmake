find_package(Threads REQUIRED)
find_package(Eigen3 3.4 REQUIRED NO_MODULE)
find_package(OpenCV 4.6 REQUIRED COMPONENTS core imgproc imgcodecs calib3d videoio)
find_package(JPEG REQUIRED)
find_package(fmt REQUIRED)
find_package(spdlog REQUIRED)
find_package(yaml-cpp REQUIRED)
if(NOT TARGET yaml-cpp::yaml-cpp)  # Until 0.8 the target has no namespace.
  add_library(yaml-cpp::yaml-cpp ALIAS yaml-cpp)
endif()
find_package(nlohmann_json REQUIRED)
find_package(pugixml REQUIRED)
find_package(Boost 1.74 REQUIRED)
find_package(CLI11 REQUIRED)
if(DEEPUAV_BENCH)
  find_package(Ceres 2.1 QUIET)  # Only to compare the bundle adjustment with.
endif()
if(DEEPUAV_SIMULATION)
  find_package(embree 3.13 REQUIRED)
endif()
find_package(OpenSSL REQUIRED COMPONENTS Crypto)
find_package(PkgConfig REQUIRED)
pkg_check_modules(EXIF REQUIRED IMPORTED_TARGET libexif)
pkg_check_modules(ZSTD REQUIRED IMPORTED_TARGET libzstd)
pkg_check_modules(FFMPEG REQUIRED IMPORTED_TARGET libavformat libavcodec libavutil libswscale)
pkg_check_modules(GEOGRAPHICLIB REQUIRED IMPORTED_TARGET geographiclib)
pkg_check_modules(GDAL REQUIRED IMPORTED_TARGET gdal)

# The wheel of OpenVINO carries the C++ headers, libraries and CMake files: scripts/setup.sh unpacks it; pip, which builds
# the Python package, installs it.
set(openvino_folder ${PROJECT_SOURCE_DIR}/.deps/openvino)
if(DEEPUAV_WHEEL AND NOT EXISTS ${openvino_folder})
  find_package(Python 3.10 REQUIRED COMPONENTS Interpreter)
  execute_process(COMMAND ${Python_EXECUTABLE} -c "import importlib.util as u, os
print(os.path.dirname(u.find_spec('openvino').origin))"
    OUTPUT_VARIABLE openvino_folder OUTPUT_STRIP_TRAILING_WHITESPACE COMMAND_ERROR_IS_FATAL ANY)
endif()
set(DEEPUAV_OPENVINO ${openvino_folder} CACHE PATH "Folder of OpenVINO's wheel, unpacked or installed")
if(NOT EXISTS ${DEEPUAV_OPENVINO}/cmake/OpenVINOConfig.cmake)
  message(FATAL_ERROR "No OpenVINO in ${DEEPUAV_OPENVINO}: run scripts/setup.sh")
endif()
find_package(OpenVINO REQUIRED COMPONENTS Runtime PATHS ${DEEPUAV_OPENVINO}/cmake NO_DEFAULT_PATH)
if(DEEPUAV_TESTS)
  find_package(GTest REQUIRED)
  include(GoogleTest)
endif()

# MAVLink's messages, and what makes C++ of them: of pymavlink's wheel, as OpenVINO's.
if(DEEPUAV_MAVLINK)
  set(pymavlink_folder ${PROJECT_SOURCE_DIR}/.deps/pymavlink)
  if(DEEPUAV_WHEEL AND NOT EXISTS ${pymavlink_folder})
    find_package(Python 3.10 REQUIRED COMPONENTS Interpreter)
    execute_process(COMMAND ${Python_EXECUTABLE} -c "import importlib.util as u, os
print(os.path.dirname(os.path.dirname(u.find_spec('pymavlink').origin)))"
      OUTPUT_VARIABLE pymavlink_folder OUTPUT_STRIP_TRAILING_WHITESPACE COMMAND_ERROR_IS_FATAL ANY)
  endif()
  set(DEEPUAV_PYMAVLINK ${pymavlink_folder} CACHE PATH "Folder that holds the package pymavlink")
  if(NOT EXISTS ${DEEPUAV_PYMAVLINK}/pymavlink/dialects/v20/common.xml)
    message(FATAL_ERROR "No pymavlink in ${DEEPUAV_PYMAVLINK}: run scripts/setup.sh, or leave out what needs it by "
      "-DDEEPUAV_MAVLINK=OFF")
  endif()
endif()

if(NOT DEEPUAV_REPORT)
  return()
endif()

# What the report's page draws with: Debian's libjs-three and libjs-chart.js.
set(DEEPUAV_JAVASCRIPT /usr/share/javascript CACHE PATH "Folder of JavaScript libraries: three and chart.js")
set(DEEPUAV_PAGE_LIBRARIES
  ${DEEPUAV_JAVASCRIPT}/three/three.min.js
  ${DEEPUAV_JAVASCRIPT}/three/examples/js/controls/OrbitControls.js
  ${DEEPUAV_JAVASCRIPT}/three/examples/js/lines/LineSegmentsGeometry.js
  ${DEEPUAV_JAVASCRIPT}/three/examples/js/lines/LineGeometry.js
  ${DEEPUAV_JAVASCRIPT}/three/examples/js/lines/LineMaterial.js
  ${DEEPUAV_JAVASCRIPT}/three/examples/js/lines/LineSegments2.js
  ${DEEPUAV_JAVASCRIPT}/three/examples/js/lines/Line2.js
  ${DEEPUAV_JAVASCRIPT}/chart.js/chart.min.js)
foreach(library ${DEEPUAV_PAGE_LIBRARIES})
  if(NOT EXISTS ${library})
    message(FATAL_ERROR "No ${library}: install libjs-three and libjs-chart.js (scripts/setup.sh does), or name the folder "
      "that holds three/ and chart.js/ by -DDEEPUAV_JAVASCRIPT=")
  endif()
endforeach()
