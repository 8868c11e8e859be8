# find_package(goniocam) gives goniocam::capture, goniocam::calib, goniocam::reconstruct, goniocam::samples.
# They hold C++ (the shims of OpenCV and Ceres): the project that links them enables CXX.
include("${CMAKE_CURRENT_LIST_DIR}/dependencies.cmake")
include("${CMAKE_CURRENT_LIST_DIR}/goniocamTargets.cmake")
