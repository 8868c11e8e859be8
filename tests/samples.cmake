pkg_check_modules(LIBRAW REQUIRED IMPORTED_TARGET libraw_r)

foreach(module shapes random pixel place tags light bounce film optics expose tiff_write dng_write
               jpeg_write scene render reflectance sampling material
               things mesh png_write goniometer flaws)
    brdf_test(samples ${module})
endforeach()
target_include_directories(test_reflectance PRIVATE ${PROJECT_SOURCE_DIR}/reconstruct)
target_include_directories(test_goniometer PRIVATE ${PROJECT_SOURCE_DIR}/reconstruct)
target_include_directories(test_sampling PRIVATE ${PROJECT_SOURCE_DIR}/reconstruct)
target_link_libraries(test_tags PRIVATE apriltag_images)
target_link_libraries(test_tiff_write PRIVATE TIFF::TIFF)
target_link_libraries(test_png_write PRIVATE PkgConfig::PNG)
target_link_libraries(test_dng_write PRIVATE PkgConfig::LIBRAW)
target_link_libraries(test_jpeg_write PRIVATE JPEG::JPEG PkgConfig::EXIF)
target_link_libraries(test_render PRIVATE PkgConfig::JANSSON)
foreach(test film render)
    target_compile_definitions(test_${test} PRIVATE SCENES="${PROJECT_SOURCE_DIR}/samples")
endforeach()

# The whole pipeline over shapes, materials, lamps and cameras: a minute, so not under sanitizers.
script_test(room_light)
script_test(round_trip_matrix)
set_tests_properties(whole/round_trip_matrix PROPERTIES LABELS slow TIMEOUT 1500)
