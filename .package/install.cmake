# What `cmake --install` and CPack install, in three parts: the program, goniocam-mpi, the libraries.
include(GNUInstallDirs)
include(CMakePackageConfigHelpers)

# ---- the program: binary, manual, completion, examples
set(made ${PROJECT_BINARY_DIR}/manual)
add_custom_command(
    OUTPUT ${made}/goniocam.1 ${made}/goniocam.bash ${made}/_goniocam ${made}/goniocam.fish
    COMMAND ${CMAKE_COMMAND} -E make_directory ${made}
    COMMAND goniocam manual > ${made}/goniocam.1
    COMMAND goniocam completion bash > ${made}/goniocam.bash
    COMMAND goniocam completion zsh > ${made}/_goniocam
    COMMAND goniocam completion fish > ${made}/goniocam.fish
    DEPENDS goniocam VERBATIM)
add_custom_target(manual ALL DEPENDS ${made}/goniocam.1)
install(TARGETS goniocam RUNTIME COMPONENT goniocam)
install(FILES ${made}/goniocam.1 DESTINATION ${CMAKE_INSTALL_MANDIR}/man1 COMPONENT goniocam)
install(FILES ${made}/goniocam.bash DESTINATION ${CMAKE_INSTALL_DATADIR}/bash-completion/completions
    RENAME goniocam COMPONENT goniocam)
install(FILES ${made}/_goniocam DESTINATION ${CMAKE_INSTALL_DATADIR}/zsh/vendor-completions COMPONENT goniocam)
install(FILES ${made}/goniocam.fish DESTINATION ${CMAKE_INSTALL_DATADIR}/fish/vendor_completions.d COMPONENT goniocam)
install(FILES README.md LICENSE DESTINATION ${CMAKE_INSTALL_DOCDIR} COMPONENT goniocam)
file(GLOB examples samples/*.yaml samples/*.ply)
install(FILES ${examples} DESTINATION ${CMAKE_INSTALL_DOCDIR}/examples COMPONENT goniocam)

# ---- the same job under mpirun
install(TARGETS goniocam-mpi RUNTIME COMPONENT goniocam-mpi)

# ---- the libraries, for others to link
set(cmake_folder ${CMAKE_INSTALL_LIBDIR}/cmake/goniocam)
foreach(folder capture calib reconstruct samples)
    set_target_properties(${folder} PROPERTIES OUTPUT_NAME goniocam-${folder})
    install(TARGETS ${folder} EXPORT goniocam COMPONENT libgoniocam-dev
        ARCHIVE COMPONENT libgoniocam-dev
        FILE_SET HEADERS DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/goniocam COMPONENT libgoniocam-dev)
endforeach()
install(TARGETS project_options EXPORT goniocam COMPONENT libgoniocam-dev)
install(EXPORT goniocam FILE goniocamTargets.cmake NAMESPACE goniocam:: DESTINATION ${cmake_folder}
    COMPONENT libgoniocam-dev)
write_basic_package_version_file(goniocamConfigVersion.cmake COMPATIBILITY SameMinorVersion)
file(RELATIVE_PATH GONIOCAM_PC_UP /${CMAKE_INSTALL_LIBDIR}/pkgconfig /)  # from the .pc file to the prefix
set(GONIOCAM_PC_APRILTAG "")
if(APRILTAG_UTILS)
    set(GONIOCAM_PC_APRILTAG -lapriltag-utils)
endif()
set(GONIOCAM_PC_GPHOTO "")
if(GPHOTO_FOUND)
    set(GONIOCAM_PC_GPHOTO libgphoto2)
endif()
configure_file(.package/goniocam.pc.in goniocam.pc @ONLY)
install(FILES .package/goniocamConfig.cmake .package/dependencies.cmake
    ${PROJECT_BINARY_DIR}/goniocamConfigVersion.cmake DESTINATION ${cmake_folder} COMPONENT libgoniocam-dev)
install(FILES ${PROJECT_BINARY_DIR}/goniocam.pc DESTINATION ${CMAKE_INSTALL_LIBDIR}/pkgconfig COMPONENT libgoniocam-dev)

# ---- Debian packages: cpack --preset release, or cpack in the build folder
set(CPACK_GENERATOR DEB)
set(CPACK_PACKAGE_CONTACT "the goniocam developers <goniocam@example.org>")
set(CPACK_PACKAGE_HOMEPAGE_URL "")
set(CPACK_PACKAGING_INSTALL_PREFIX /usr)
set(CPACK_COMPONENTS_ALL goniocam goniocam-mpi libgoniocam-dev)
set(CPACK_DEB_COMPONENT_INSTALL ON)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS ON)  # what the binaries need, by dpkg-shlibdeps
set(CPACK_DEBIAN_PACKAGE_SECTION graphics)
set(CPACK_DEBIAN_GONIOCAM_PACKAGE_NAME goniocam)
set(CPACK_DEBIAN_GONIOCAM-MPI_PACKAGE_NAME goniocam-mpi)
set(CPACK_DEBIAN_GONIOCAM-MPI_PACKAGE_RECOMMENDS "openmpi-bin")
set(CPACK_DEBIAN_LIBGONIOCAM-DEV_PACKAGE_NAME libgoniocam-dev)
set(CPACK_DEBIAN_LIBGONIOCAM-DEV_PACKAGE_SECTION libdevel)
file(STRINGS .ci/packages libraries REGEX "^(lib|zlib).*-dev$")
list(FILTER libraries EXCLUDE REGEX "cmocka|openmpi|libomp|clang")
list(JOIN libraries ", " CPACK_DEBIAN_LIBGONIOCAM-DEV_PACKAGE_DEPENDS)
set(CPACK_STRIP_FILES ON)
set(CPACK_COMPONENT_GONIOCAM_DESCRIPTION
    "Merges exposure brackets, calibrates camera, sample and lamp from AprilTags, and measures a MERL table")
set(CPACK_COMPONENT_GONIOCAM-MPI_DESCRIPTION "The same job for many machines, under mpirun or srun")
set(CPACK_COMPONENT_LIBGONIOCAM-DEV_DESCRIPTION "Libraries to evaluate, sample and fit measured BRDFs")
include(CPack)
