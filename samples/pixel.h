/* pixel.h -- the mean of a scene over the square of a pixel. */
#ifndef GONIOCAM_SAMPLES_PIXEL_H
#define GONIOCAM_SAMPLES_PIXEL_H

/** What is seen at one place of the image. Places of one id are one smooth surface under one
 *  light: the radiance is continuous among them. */
struct sight {
    int id;
    int curved;  // the surface bends away at its edge: radiance is steep there
    int rough;   // radiance has small steps of its own, as a penumbra has: no use to look closer
    double rgb[3];
};

/** The image plane as a function. With shade false only the id is asked for. */
struct image_plane {
    struct sight (*look)(const void *scene, double x, double y, int shade);
    const void *scene;
    double tolerance;  // relative, of how far a cell's middle may be off the mean of its corners
    double floor;      // the same in radiance: what is too dark to matter
};

/** Mean over the square of side `size` centred at (x, y), given what its four corners see: (-, -),
 *  (+, -), (+, +), (-, +). The square is halved at least `depth` times. */
void sam_pixel_mean(const struct image_plane *plane, double x, double y, double size, int depth,
                    const struct sight corner[4], double rgb[3]);
#endif
