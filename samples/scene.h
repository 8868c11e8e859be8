/* scene.h -- what SCENE.yaml describes: camera, lamps, sample, board, and the photographs to take.
 *
 * SCENE.yaml speaks millimetres, seconds and degrees; samples/README.md describes its keys.
 */
#ifndef GONIOCAM_SAMPLES_SCENE_H
#define GONIOCAM_SAMPLES_SCENE_H

#include "calib.h"
#include "things.h"
#include "flaws.h"

#include <string.h>

enum { SCENE_NAME = 64, PATCHES_MAX = 16 };

/** How radiance becomes numbers (expose.c). */
struct sensor_model {
    double electrons;  // of a photosite, for radiance 1 in a second, f-number and ISO included
    double dn_per_electron;        // the gain of the converter
    double full_well, read_noise;  // electrons
    int black_level, adc_max;      // DN
    double channel_gain[3];
    double vignetting[3];  // V = 1 + v1 q + v2 q^2 + v3 q^3, q as in struct camera
    bool mosaic;           // one channel a photosite
    char cfa[CFA_SIZE];    // its cell, "RGGB"
    double prnu;           // relative standard deviation of a photosite's gain
    double hot_fraction,
        hot_rate;       // photosites that leak, and electrons a second they do on average
    double time_error;  // relative standard deviation of exposure times about what EXIF says
};

/** What the lens does besides distortion and vignetting. */
struct optics {
    double blur;   // pixels, standard deviation of a Gaussian point spread
    double glare;  // share of the light that ends up spread evenly over the picture
};

enum { TONES_MAX = 64 };
/** How encoded photographs are encoded: sRGB, or a power, or a table at even steps of linear light
 *  from 0 to full, between which it is linear. */
struct tone_curve {
    double gamma;  // encoded = linear^(1/gamma); 0: not this one
    double value[TONES_MAX];
    int values;  // 0: not this one
};

/** What photographs are written as: 16-bit RGB, 8-bit encoded, 16-bit mosaic, 16-bit RGB. */
enum photo_format { PHOTO_TIFF, PHOTO_JPEG, PHOTO_DNG, PHOTO_PNG };

/** What the camera writes into every photograph. */
struct exif {
    double aperture, iso, focal_length;  // f-number, ISO, mm
    char make[SCENE_NAME], model[SCENE_NAME];
};

/** Shots of which there is a photograph without the lamp. */
enum ambient_frames { AMBIENT_NONE, AMBIENT_FIRST, AMBIENT_EACH };

enum lamp_kind { LAMP_POINT, LAMP_DISTANT };

/** A lamp, in the world or, with on_camera, in the camera's frame (x right, y down, z forward). */
struct scene_lamp {
    char name[SCENE_NAME];
    enum lamp_kind kind;
    bool on_camera;
    vec3 position;
    double radius;         // of a ball that radiates evenly; 0: a point
    vec3 direction;        // towards a distant lamp; unit
    double intensity[3];   // L = f I cos / r^2; of a distant lamp the irradiance, L = f E cos
    vec3 beam;             // where it points to; unit
    double beam_exponent;  // intensity falls off as cos^exponent from there; 0: it does not
};

struct scene_sample {
    struct sample_place place;    // where it is; of a mesh, a ball about it
    struct sample_place nominal;  // where capture.yaml says it is
    struct material material;
    struct flaws flaws;
    struct mesh *mesh;  // NULL for other shapes
    char *file;         // of the mesh: its path; owned
    double scale;       // of its lengths to mm
    pose world_from_file;
};
/** The mesh's file beside the photographs, where render puts a copy. */
static inline const char *sam_mesh_name(const struct scene_sample *sample)
{
    const char *slash = strrchr(sample->file, '/');
    return slash ? slash + 1 : sample->file;
}

/** A grey sheet with printed tags on paper. The paper's surface is the plane of the tags; the
 *  sheet lies below it by the paper's thickness. */
struct scene_board {
    double size[2], albedo;  // of the sheet, centred on the origin; size 0: no sheet
    char family[SCENE_NAME];
    struct tag_place *tag;  // [tags]
    int tags;
    double margin;        // white paper around the black square
    double thickness;     // of the paper
    double white, black;  // albedos of the print
};

/** A white patch: the top of a slab that lies on the board. */
struct scene_patch {
    struct patch patch;
    double thickness;
};

/** What holds the sample: an upright round post below its centre. Radius 0: none. */
struct scene_post {
    double radius, albedo;
};

/** One bracket of photographs. */
struct scene_shot {
    pose view_from_world;
    int lamp;
    double power;  // of the lamp in this shot, about 1
};

/** Owns what it points to; {0} is empty; release with sam_scene_free(). */
struct scene {
    char name[SCENE_NAME];
    uint64_t seed;
    struct camera camera;  // name stays NULL
    struct sensor_model sensor;
    struct optics optics;
    struct exif exif;
    enum photo_format format;
    struct tone_curve tone;
    double *exposure;  // [exposures] seconds
    int exposures;
    struct scene_lamp *lamp;  // [lamps]
    int lamps;
    struct scene_sample sample;
    struct scene_board board;
    struct scene_patch *patch;  // [patches]
    int patches;
    struct scene_post post;
    struct things things;
    struct scene_shot *shot;  // [shots]
    int shots;
    int bounces;                         // of light between board and sample: 0 to 2
    double ambient[3];                   // radiance that comes from everywhere, lamp on or off
    bool flat, dark;                     // write a frame of an even wall; one of darkness
    enum ambient_frames ambient_frames;  // views that are photographed without the lamp
    bool radiance, table;                // write OUT/radiance; write OUT/truth.binary
};

/** Read SCENE.yaml. On success the caller owns *scene; on failure it is untouched.
 *  STATUS_IO; STATUS_FORMAT (file, line and key of what is wrong); STATUS_MEMORY. */
enum status sam_scene_read(struct scene *scene, const char *path, struct error *err);
void sam_scene_free(struct scene *scene);
#endif
