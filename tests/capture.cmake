brdf_test(capture exr)
brdf_test(capture photo)
brdf_test(capture shots)
