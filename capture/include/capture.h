/* capture.h -- the face of capture/: a folder of photographs becomes radiance maps.
 *
 * It is the lowest face; what all folders share (status, vec3, the run) is in program.h beside it.
 *
 * Lengths are millimetres, times seconds, angles radians. The world is the board's frame: x right
 * and y up along the board, z out of it. Pixel centres are whole numbers, the first is (0, 0).
 * Images are float, row-major, top row first, channels interleaved, linear in radiance; the
 * radiance of a map is in full scales of the sensor per second, (DN - black)/(white - black)/s.
 * Any function that takes struct error accepts NULL there.
 */
#ifndef GONIOCAM_CAPTURE_H
#define GONIOCAM_CAPTURE_H

#include "program.h"

#ifdef __cplusplus
extern "C" {
#endif

/** The commands of capture/, in one table. */
extern const struct command cap_commands[];

/* ---- colour filters --------------------------------------------------------------------- */

/** The square cell of a mosaic's colour filters, by rows, in letters R, G and B: "RGGB", the 36 of
 *  X-Trans. No mosaic: "". */
enum { CFA_SIDE_MAX = 8, CFA_SIZE = CFA_SIDE_MAX * CFA_SIDE_MAX + 1 };
/** Is it a cell of 2, 4, 6 or 8 photosites a side? */
bool cap_cfa_is_valid(const char *cfa);
/** The cell's side in photosites. Requires a mosaic. */
static inline int cap_cfa_side(const char *cfa)
{
    return !cfa[4] ? 2 : !cfa[16] ? 4 : !cfa[36] ? 6 : 8;
}
/** The channel (0 R, 1 G, 2 B) of a mosaic's photosite (x, y). */
static inline int cap_cfa_channel(const char *cfa, int x, int y)
{
    int side = cap_cfa_side(cfa);
    char letter = side == 2 ? cfa[2 * (y & 1) + (x & 1)] : cfa[side * (y % side) + x % side];
    return letter == 'R' ? 0 : letter == 'G' ? 1 : 2;
}

/* ---- capture.yaml ----------------------------------------------------------------------- */

/** A printed tag. size is the side of the black square's outer border; x_axis and y_axis are the
 *  unit vectors of the printed tag's right and up. */
struct tag_place {
    int id;
    double size;
    vec3 center, x_axis, y_axis;
    bool unplaced;  // nobody measured its place: the photographs tell
};
/** Corner k of a tag in the world: bottom left, bottom right, top right, top left. */
vec3 cap_tag_corner(const struct tag_place *tag, int k);

enum shape { SHAPE_NONE, SHAPE_SPHERE, SHAPE_CYLINDER, SHAPE_MESH };
/** Where the sample is, nominally. A cylinder's height is its full length, its center the middle. A
 *  mesh stands where p_world = R p_file + t, R of a rotation vector.
 */
struct sample_place {
    enum shape shape;
    double radius, height;
    double radius_sigma;  // how well the radius is known, mm
    vec3 center, axis;
    char *file;    // of a mesh: its path
    double scale;  // millimetres in a unit of the file
    vec3 rotation, translation;
};

/** A ball beside the sample that shows the lamps, as a mirror does. */
enum { BALLS_MAX = 4 };
struct ball_place {
    double radius, radius_sigma;  // how well the radius is known, mm
    vec3 center;
};

/** A solid that stands in the way of light or view. A cylinder as the sample's; a box with its
 *  middle, its size along its own axes and a rotation vector; a mesh with its file's pose:
 * rotation, and the translation in center. */
struct occluder {
    enum { OCCLUDER_CYLINDER, OCCLUDER_BOX, OCCLUDER_MESH } shape;
    double radius, height;
    vec3 center, axis, size, rotation;
    char *file;
};

/** A flat diffuse white patch; corners run bottom left, bottom right, top right, top left. */
struct patch {
    double albedo;
    vec3 corner[4];
};

/** A lamp, and the photographs made under it. */
struct light_place {
    char *name;
    bool on_camera;     // frame: camera
    bool has_position;  // measured by hand
    vec3 position;
    double radius;  // of the ball that shines, mm; 0: a point, or not known
};

/** How the numbers of encoded photographs become linear. */
enum response { RESPONSE_RECOVER, RESPONSE_SRGB, RESPONSE_LINEAR, RESPONSE_FILE };

/** One photograph: what its file says of itself. Numbers that are not known are 0. */
struct photo {
    char *name;         // of the file, without folder
    int width, height;  // as stored: orientation tags are ignored
    int channels, bits;
    bool encoded;         // gamma encoded (JPEG): a response applies
    bool decoded;         // a 16-bit file that says it is: its reader makes it linear
    bool gray;            // the file has one channel, which stands for all three
    char cfa[CFA_SIZE];   // of a mosaic (channels 1); else ""
    int chroma[2];        // so many across and down share their colour (JPEG 4:2:0: 2, 2); or 0
    double black, white;  // DN that a raw file states; NAN: it does not
    double exposure_time, aperture, iso, focal_length;  // s, f-number, ISO, mm
    char make[64], model[64], lens[64], taken[32];      // taken: "2026:11:22 10:00:00"
    int orientation;  // EXIF's 1..8, 0 unknown; told, never applied
    int light;        // index into lights, or -1
    int given;        // index into given cameras, or -1
    int shot;         // index into shots, or -1: left out
    int missing;      // photographs right before it, by name, that cannot be read
};

/** One view of the scene: a bracket of photographs that differ by exposure time only. */
struct shot {
    char *name;  // of its first photograph, without extension
    int *photo;  // [photos] indices, in order of the names
    int photos;
    int light;        // index into lights, or -1 (merge needs none)
    int camera;       // index into cameras
    const char *why;  // it begins where it does
};

/** Photographs of one kind: same make, model, size and focal length. */
struct camera_kind {
    char *name;
    int width, height;
    double focal_length;  // mm, 0: unknown
    int given;            // index into given, or -1
};

/** What capture.yaml says of a camera: a file of its intrinsics, held or (prior) adjusted. */
struct camera_given {
    char *file;  // its path, or NULL: only tells which photographs are one camera's
    bool prior;
};

/** Names of calibration frames, in order. */
struct frame_names {
    char **name;
    int count;
};

/** A capture folder: capture.yaml and what the photographs say. Owns everything below it; {0} is
 *  empty; release with cap_capture_free(). Counts are 0 for what capture.yaml does not name. */
struct capture {
    char *folder;
    char *family;  // of the tags, "tag36h11"; NULL without a board
    struct tag_place *tag;
    int tags;
    double tag_size;     // of tags that are in the photographs and not in the list; 0: not used
    double place_sigma;  // how well places in the list are known, mm; 0: exactly
    struct sample_place sample;
    struct ball_place ball[BALLS_MAX];
    int balls;
    struct patch *patch;
    struct occluder *occluder;
    int occluders;
    int patches;
    // In the place of patches: the path of a second capture, which tells how strong the lamps are.
    char *reference;
    double reference_albedo;  // of that capture's sample, 0: it has patches of its own
    // Of such a capture, while it is calibrated: its lamps are wanted even without a sample; the
    // albedo of its sample, 0: patches give the scale.
    bool gives_scale;
    double sample_albedo;
    struct light_place *light;  // at least one: without `lights`, all photographs share "light"
    int lights;
    struct photo *photo;  // ordered by name, digits compared as numbers
    int photos;
    struct shot *shot;
    int shots;
    struct camera_kind *camera;
    int cameras;
    struct camera_given *given;
    int givens;
    char *flat, *dark, *ambient;  // the first of each kind of frame, or NULL; borrowed from
    struct frame_names flat_frames, dark_frames, ambient_frames;  // all of them
    enum response response;                                       // of encoded photographs
    char *response_file;      // of RESPONSE_FILE, within the folder; else NULL
    double black, white;      // DN, from `noise`; NAN: find them
    double gain, read_noise;  // electrons a DN, electrons; NAN: find them
};

/** Read FOLDER/capture.yaml and the metadata of the photographs it selects, and group them into
 *  shots. A photograph that cannot be read is left out with a warning that names it.
 *  STATUS_IO (no folder, no capture.yaml, no photographs), STATUS_FORMAT (file, line and key of
 *  what is wrong), STATUS_DATA (no exposure time; a photograph under no lamp or two; ...). */
enum status cap_capture_read(struct capture *capture, const char *folder, struct run *run,
                             struct error *err);
/** A folder of photographs as if it had no capture.yaml: all that EXIF and names tell. Files called
 *  flat*, dark* and ambient* are taken for such frames. As cap_capture_read(). */
enum status cap_capture_of_photos(struct capture *capture, const char *folder, struct run *run,
                                  struct error *err);
/** Keep at most so many shots, spread evenly; the photographs of the others belong to no shot. */
void cap_capture_thin(struct capture *capture, int most);
/** Put shots and photographs in an order of what the files hold, so that what is computed from them
 *  is the same to the last bit whatever they are called. STATUS_IO, STATUS_MEMORY. */
enum status cap_capture_settle(struct capture *capture, struct run *run, struct error *err);
void cap_capture_free(struct capture *capture);

/* ---- radiance --------------------------------------------------------------------------- */

struct radiance_file;
/** A linear image with its noise. Owns value, variance and file; {0} is empty; cap_radiance_free().
 *  A photosite saturated in all frames holds its lower bound and variance +inf; variance +inf also
 *  marks what was not measured (a defective photosite, see below for mosaics). */
struct radiance {
    int width, height;
    float *value;                // [height][width][channels], full scales per second
    float *variance;             // [height][width][channels], of value
    int channels;                // 3; 1 only from cap_radiance_read_stored() of a mosaic
    char cfa[CFA_SIZE];          // of a mosaic; else ""
    int chroma[2];               // of struct photo
    struct radiance_file *file;  // where it stays there (cap_radiance_open): value is NULL then
};

/** Linearity and noise of the photographs of one camera, per channel, in DN of the file:
 *  DN = black + signal, variance of DN = read_noise^2 + signal / gain. Encoded photographs are
 *  linearised first, and their DN are then 0..65535. */
struct sensor {
    double black[3];
    double white[3];       // saturated photosites pile up here
    double usable[3];      // values from here up are not used: the pile's lower edge, 4 sigma
    double gain[3];        // electrons a DN
    double read_noise[3];  // DN, rounding included
    double relative[3];    // of the signal: photosites' unequal response, or the curve's error
};

/** Find black, white, gain and noise of camera `camera` from its brackets, where capture.yaml
 *  does not give them (method: sensor.c). STATUS_DATA where the photographs do not tell. */
enum status cap_sensor_find(struct sensor *sensor, const struct capture *capture, int camera,
                            struct run *run, struct error *err);

/** Merge all shots: OUT/radiance/SHOT.exr, each complete or absent. What is there already from
 *  the same photographs and settings is kept. *sensor ([cameras], may be NULL) receives what was
 *  found; usable[] ([shots], may be NULL) which shots have a map: one with fewer readable
 *  photographs than needed is left out with a warning. */
enum status cap_merge(const struct capture *capture, const char *out, struct sensor *sensor,
                      bool *usable, struct run *run, struct error *err);

/** OUT/radiance/SHOT.exr: R, G, B and var.R, var.G, var.B, all float. On success the caller owns
 *  *map; on failure it is untouched. A mosaic (Y, var.Y and the attribute cfa) is spread over three
 *  channels: the one that a photosite measured keeps value and variance, the others hold the mean
 *  of their neighbours and variance +inf. */
enum status cap_radiance_read(struct radiance *map, const char *path, struct error *err);
/** The same, but an uncompressed map, as cap_merge() writes it, stays in the file: then value and
 *  variance are NULL, and memory and time go with the photosites that are looked at. */
enum status cap_radiance_open(struct radiance *map, const char *path, struct error *err);
/** Value and variance (which may be NULL: not asked for) of a photosite in all three channels; of
 *  any map with channels 3. */
void cap_radiance_at(const struct radiance *map, int x, int y, float value[3], float variance[3]);
/** The same of the photosites from <= x < end of a row: [end - from][3]. variance may be NULL. */
void cap_radiance_row(const struct radiance *map, int y, int from, int end, float *value,
                      float *variance);
/** Bring the photosites low <= (x, y) < end of a map that stays in its file into memory: value and
 *  variance hold them then, and anything elsewhere. Other maps stay as they are. STATUS_MEMORY. */
enum status cap_radiance_load(struct radiance *map, const int low[2], const int end[2],
                              struct error *err);
/** cap_radiance_read(), as the file holds it: a mosaic has channels 1. */
enum status cap_radiance_read_stored(struct radiance *map, const char *path, struct error *err);
/** The channel (0 R, 1 G, 2 B) that the photosite (x, y) of a mosaic measured; -1: all of them. */
int cap_radiance_channel(const struct radiance *map, int x, int y);
enum status cap_radiance_write(const struct radiance *map, const char *path, struct error *err);
void cap_radiance_free(struct radiance *map);
/** What maps were loaded into is kept for the next ones; now it goes. */
void cap_radiance_forget(void);
/** A plain picture as OpenEXR, rgb [height][width][3] in channels R, G, B. Complete or not at all:
 *  STATUS_IO, STATUS_MEMORY. */
enum status cap_picture_write(const float *rgb, int width, int height, const char *path,
                              struct error *err);

/** A picture as PNG: 0xRRGGBB (what stands above is passed over) in rows `stride` apart. Complete
 * or not at all: STATUS_IO, STATUS_MEMORY. */
enum status cap_png_write(const uint32_t *rgb, int width, int height, int stride, const char *path,
                          struct error *err);

/** What a photograph or map (any format that is read) says of itself, as lines for people or one
 *  JSON object: make model lens taken width height channels bits cfa black white exposure_time
 *  aperture iso focal_length orientation; null where unknown. */
enum status cap_info(const char *path, bool json, FILE *to, struct error *err);

/** 128 bits of XXH3 over names and contents of capture.yaml and all photographs, as 32 hex
 *  digits: the identity of the input, the same for any order. */
enum status cap_capture_hash(char hash[33], const struct capture *capture, struct error *err);

#ifdef __cplusplus
}
#endif
#endif
