brdf_test(capture exr)
