/* calib.h -- the face of calib/: radiance maps become cameras, poses, the sample, the lamps.
 *
 * A camera's frame is OpenCV's: x right, y down, z forward; p_view = R p_world + t, and R is kept
 * as a rotation vector (Rodrigues). The lens is Brown-Conrady: k1 k2 p1 p2 k3. Pixels are [x, y];
 * the centre of the first pixel is (0, 0). sigma_ members are one standard deviation.
 */
#ifndef GONIOCAM_CALIB_H
#define GONIOCAM_CALIB_H

#include "beam.h"
#include "capture.h"
#include "glare.h"

#ifdef __cplusplus
extern "C" {
#endif

/** A pinhole with a lens, from the photographs of one camera_kind. vignetting: V = 1 + v0 q +
 *  v1 q^2 with q = |pixel - center|^2 / (half the diagonal)^2, what is left after the flat frame
 *  (0 with one): a map's radiance is V times the scene's. */
struct camera {
    char *name;
    int width, height;
    double focal[2], center[2], distortion[5];
    double sigma_focal[2], sigma_center[2], sigma_distortion[5];
    double vignetting[2];
    double rms_px;
};

/** p_view = rotate(rotation) p_world + translation. */
typedef struct {
    vec3 rotation, translation;
} pose;

/** A tag as measured in one shot; corners bottom left, bottom right, top right, top left of the
 *  printed tag. */
struct seen_tag {
    int id;
    double corner[4][2];
};

/** A tag of the board where it is taken to be. Sigmas are 0 where capture.yaml's place was held. */
struct board_tag {
    struct tag_place place;
    double sigma_turn[3], sigma_center[3];  // about the world's axes, rad; mm
    int views;                              // in which it was used
    double rms_px;                          // there
};

/** A shot, calibrated. The light on it is lamp.intensity * power. */
struct view {
    char *name;  // of the shot
    int camera, light;
    pose view_from_world;
    double sigma_rotation[3], sigma_translation[3];
    double power, sigma_power;
    double rms_px;
    double blur_px;  // 1 sigma of the lens's point spread each way, by the tags; 0: not seen
    // Shares of light that the lens spreads over the image (glare.h), taken off its map wherever it
    // is read, and the standard deviation of their sum. 0 where the tags' ink does not tell of any.
    double glare[GLARE_TERMS], sigma_glare;
    struct seen_tag *tag;  // [tags]
    int tags;
};

/** What one kind of evidence alone says of a lamp, seen from the sample: all of it together, the
 *  shading of board and patch, the shading of the sample, the highlights on it, its shadow on the
 * board, the highlights on balls beside it. */
enum cue { CUE_JOINT, CUE_BOARD, CUE_SAMPLE, CUE_HIGHLIGHT, CUE_SHADOW, CUE_BALL, CUES };
struct lamp_cue {
    vec3 direction;                   // unit, in the lamp's frame
    double sigma;                     // of direction, rad, each way; 0: this cue tells nothing
    double distance, sigma_distance;  // 0: it does not tell a distance
};
/** "joint", "board", "sample", "highlight", "shadow", "ball". */
const char *cal_cue_name(enum cue cue);

/** How strong a lamp is by a capture of its own: ln of its intensity (at infinity: irradiance), at
 *  the mean power of this capture's shots. `of`: the first lamp here that is the same one there. */
struct lamp_strength {
    int of;
    bool at_infinity;
    double log_intensity[3];
    double sigma_all, sigma_each;  // what the channels share, and what each has; 0: nothing known
    double sigma_power;            // of the mean power here beside that there
};

/** A lamp: a point (frame world, or camera: it moves with it), or at infinity.
 *  A point:     L = f intensity power share cos(theta_i) / r^2, r from the position; beam.h
 *  At infinity: L = f irradiance power cos(theta_i), direction is unit and towards the lamp */
struct lamp {
    char *name;
    bool on_camera, at_infinity;
    vec3 position, direction;
    double radius;        // of a point's ball, which is seen evenly bright, mm; 0: not known
    double sigma_radius;  // where photographs told it
    double intensity[3];  // or irradiance
    double sigma_position[3], sigma_direction[3], sigma_intensity[3];
    // Of position (at infinity: direction) and ln intensity, the mean of its channels: a lamp that
    // is further away than thought is stronger, too. 0: not known, they are taken as independent.
    double covariance[4][4];
    struct lamp_cue cue[CUES];
    struct beam beam;  // of a point: its fall-off to the side
    struct lamp_strength known;
};

/** A scanned object: triangles with smooth normals. */
struct mesh;
/** Read PLY or OBJ (or what else Assimp reads), all of its meshes as one. Normals that the file
 *  does not give are made, smooth over edges below 60 degrees. Lengths are multiplied by `scale`,
 *  then placed by p_world = R p_file + t. On success the caller owns *mesh. STATUS_IO,
 *  STATUS_FORMAT (no triangles), STATUS_MEMORY. */
enum status cal_mesh_read(struct mesh **mesh, const char *path, double scale, pose world_from_file,
                          struct error *err);
/** From arrays: point and normal [points], triangle [triangles] of indices, counter-clockwise from
 *  outside. */
enum status cal_mesh_make(struct mesh **mesh, const vec3 *point, const vec3 *normal, int points,
                          const unsigned (*triangle)[3], int triangles, struct error *err);
void cal_mesh_free(struct mesh *mesh);
/** A ball about the mesh, around the middle of the box about it. */
void cal_mesh_reach(const struct mesh *mesh, vec3 *center, double *radius);
void cal_mesh_move(struct mesh *mesh, vec3 by);
int cal_mesh_triangles(const struct mesh *mesh);
/** Where origin + s direction (unit) first meets a mesh with s > 0, far enough from the start not
 *  to meet the surface it starts from: 1e-4 of the mesh's radius; s is INFINITY where it does not.
 *  The normal is the smooth one, turned to the side of the ray's origin where it would show its
 *  back. Any thread. */
typedef struct {
    double s;
    vec3 normal;
} mesh_hit;
mesh_hit cal_mesh_meet(const struct mesh *mesh, vec3 origin, vec3 direction);
/** The same of rays beside each other, 1 to MESH_RAYS: faster. */
enum { MESH_RAYS = 16 };
void cal_mesh_meet_all(mesh_hit *hit, const struct mesh *mesh, const vec3 *origin,
                       const vec3 *direction, int count);

/** The sample, placed. Of a mesh, radius and center are those of a ball about it. */
struct sample {
    enum shape shape;
    double radius, height;
    vec3 center, axis;
    double sigma_center[3], sigma_radius;
    double sigma_turn[3];   // rad, about the world's axes; 0 for a sphere
    double outline_rms_px;  // of the outline's edges about the fit; 0: not measured
    int outline_edges;
    char *file;    // of a mesh: its path; owned by the calibration, as mesh is
    double scale;  // of its file's lengths to mm
    pose world_from_file;
    struct mesh *mesh;
};

/** A first guess of the sample's reflectance, good to a few per cent: tables of the flexible lobe
 *  that finds the lamps (lobe.c). Enough to say what the board's light does to it. */
enum { LOBE_TABLE = 2048, LOBE_ANGLES = 16 };
struct lobe_table {
    float diffuse[3], distribution[LOBE_TABLE + 1], shadowing[LOBE_TABLE + 1];
    float fresnel[3][LOBE_TABLE + 1];
    float matte[3];  // diffuse, and what of the rest is alike in all directions
    float gloss_albedo[LOBE_ANGLES + 1][3];  // of f - matte, for even steps of cos_o from 0 to 1
    double gloss_width;                      // theta_h where the gloss is half of what it is at 0
};
/** f [3] in 1/sr for the cosines of wi, wo and h with the normal, and of wi with h. */
void cal_lobe_lookup(const struct lobe_table *table, double cos_i, double cos_o, double cos_h,
                     double cos_d, double f[3]);

/** Read the mesh of a sample from its file, and set radius and center by it. Statuses are those of
 *  cal_mesh_read. */
enum status cal_sample_load(struct sample *sample, struct error *err);

/** A square piece of lit board: it shines on the sample. Its sides are x and normal cross x. */
struct glow {
    vec3 point, normal, x;
    double side;
    double radiance[3];  // under one lamp with power 1
};
/** What shines on the sample besides the lamps. Not in calibration.yaml: only photographs hold it.
 */
struct surroundings {
    struct glow *glow;  // [lamps][count]
    int count;
    double paper[3];  // albedo of the tags' paper
    // What of the light that geometry and board predict is there, by the sample's night side, which
    // nothing else lights: 1, but for room light (more) and renderings of direct light alone (0).
    double strength, sigma_strength;
    bool told;                    // that side was seen; else it is taken for granted
    bool has_lobe, peak_unknown;  // no facet shows the lobe's peak: too small, or saturated
    double mirror[3];             // then: the most that it may mirror, face on
    struct lobe_table lobe;
};

/** What calibrate finds, and calibration.yaml holds. Owns everything below it; {0} is empty;
 *  release with cal_calibration_free(). */
struct calibration {
    struct camera *camera;
    struct view *view;
    struct lamp *lamp;
    struct sample sample;
    struct sample ball[BALLS_MAX];  // spheres beside it that show the lamps
    int cameras, views, lamps, balls;
    char *family;           // of the tags, NULL: the calibration has no board
    struct board_tag *tag;  // [tags]
    int tags;
    struct surroundings surroundings;
};

/** Radiance [3] that the lit board adds, through the sample's reflectance, to what a view sees of
 *  the sample at a point with a unit normal in the unit direction wo. 0 where no surroundings are
 *  known (a calibration that was read from a file). */
void cal_bounce(const struct calibration *calibration, int view, vec3 point, vec3 normal, vec3 wo,
                double radiance[3]);

void cal_calibration_free(struct calibration *calibration);
/** calibration.yaml. On success the caller owns *calibration; on failure it is untouched.
 *  STATUS_IO, STATUS_FORMAT (file, line, key). */
enum status cal_calibration_read(struct calibration *calibration, const char *path,
                                 struct error *err);
/** A calibration of any program: calibration.yaml; one camera in OpenCV's YAML, or ROS's; Kalibr's
 *  camchain (pinhole, radtan); COLMAP's text model (a folder, with the views that it has, or a
 *  cameras.txt). Other lens models are STATUS_FORMAT. As cal_calibration_read(). */
enum status cal_calibration_import(struct calibration *calibration, const char *path,
                                   struct error *err);
enum status cal_calibration_write(const struct calibration *calibration, const char *path,
                                  struct error *err);

/** Find cameras, poses and the board: fills camera, view (name, camera, light, pose, sigmas, tags,
 *  rms_px; power is 1) and the board's tags, for every usable shot (NULL: all) with enough of them.
 *  Tags that capture.yaml does not place (tag_size) are placed by the photographs; where it places
 *  none, the world is the frame of the tag with the lowest id: its middle, right and up. A shot in
 *  which too few tags are found is left out with a warning that names it, and so is a tag that is
 *  not where capture.yaml says. Reads OUT/radiance/SHOT.exr. On success the caller owns what
 *  *calibration holds; on failure it is untouched.
 *  STATUS_DATA: no board, an unknown family, fewer than three usable shots; STATUS_FORMAT: a file
 *  of intrinsics; STATUS_IO; STATUS_SOLVER. */
enum status cal_geometry(struct calibration *calibration, const struct capture *capture,
                         const char *out, const bool *usable, struct run *run, struct error *err);

/** What new photographs say of a camera whose intrinsics a calibration holds. */
enum verdict { VERDICT_HOLDS, VERDICT_DRIFTED, VERDICT_WRONG };
struct camera_check {
    char name[64];
    int shots, tags;                // tags in all shots
    double held_px;                 // rms of the tags with the lens as it was
    double free_px;                 // with a lens of the photographs' own; 0: too few for one
    double worst_px;                // of the shots, held
    char worst[64];                 // its name
    double focal_off, sigma_focal;  // of the own lens against the held one, relative
    double rays_px;                 // how far they put the same ray apart, at most over the image
    enum verdict verdict;
};
const char *cal_verdict_text(enum verdict verdict);
/** Hold the intrinsics of the calibration in `path` (see cal_calibration_import) and find the poses
 *  of a merged capture: one usable shot is enough. A board that capture.yaml does not name is the
 *  calibration's. On success the caller owns *held and *check, [held->cameras]. As cal_geometry().
 */
enum status cal_check(struct calibration *held, struct camera_check **check,
                      const struct capture *capture, const char *path, const char *out,
                      const bool *usable, struct run *run, struct error *err);

/** Calibrate a merged capture: reads OUT/radiance/SHOT.exr, writes OUT/overlay/SHOT.png. usable
 *  ([shots], NULL: all) tells which shots have a map. A shot in which no tag is found, or too
 *  few, is left out with a warning. Without a sample in capture.yaml that is cal_geometry(). On
 * success the caller owns *calibration. STATUS_DATA: fewer than three usable shots, no board,
 * nothing that fixes the lamp, ... */
enum status cal_calibrate(struct calibration *calibration, const struct capture *capture,
                          const char *out, const bool *usable, struct run *run, struct error *err);

/** What the board shines on the sample of a calibration that was read from a file: surroundings, by
 *  OUT/radiance/SHOT.exr, at the strength that geometry says, told by nothing yet and without a
 *  lobe. None where neither capture.yaml nor the file places tags. STATUS_IO, STATUS_MEMORY. */
enum status cal_look_around(struct calibration *calibration, const struct capture *capture,
                            const char *out, struct run *run, struct error *err);

/** The share of light that the lens spread over the image and that is taken off, of the view that
 *  had most of it, with its standard deviation; 0 where there is none. */
void cal_glare_of(const struct calibration *calibration, double *share, double *sigma);

extern const struct command cal_commands[];

/* ---- camera and pose arithmetic ------------------------------------------------------------ */

typedef struct {
    double m[3][3];
} mat3;

/** Rotation matrix of a rotation vector (Rodrigues' formula; exact to rounding near 0). */
mat3 cal_rotation(vec3 rotation);
static inline vec3 mat3_mul(const mat3 *a, vec3 v)
{
    vec3 r = {a->m[0][0] * v.x + a->m[0][1] * v.y + a->m[0][2] * v.z,
              a->m[1][0] * v.x + a->m[1][1] * v.y + a->m[1][2] * v.z,
              a->m[2][0] * v.x + a->m[2][1] * v.y + a->m[2][2] * v.z};
    return r;
}
/** transpose(a) v: the inverse rotation. */
static inline vec3 mat3_mul_t(const mat3 *a, vec3 v)
{
    vec3 r = {a->m[0][0] * v.x + a->m[1][0] * v.y + a->m[2][0] * v.z,
              a->m[0][1] * v.x + a->m[1][1] * v.y + a->m[2][1] * v.z,
              a->m[0][2] * v.x + a->m[1][2] * v.y + a->m[2][2] * v.z};
    return r;
}
/** The camera's centre in the world: -R^T t. */
vec3 cal_eye(pose view_from_world);
/** p_view = R p_world + t. */
vec3 cal_to_view(pose view_from_world, vec3 p_world);
/** Pixel of a point in the camera's frame. Requires p_view.z > 0. */
void cal_project(const struct camera *camera, vec3 p_view, double pixel[2]);
/** Unit direction, in the camera's frame, of the ray through a pixel: cal_project inverted by
 *  Newton's method to 1e-12 of a focal length. */
vec3 cal_ray(const struct camera *camera, const double pixel[2]);
/** What vignetting leaves of the light at a pixel, (0, 1]. */
double cal_vignetting(const struct camera *camera, const double pixel[2]);
/** Where the lamp is in the world for a view (a lamp on the camera moves with it); for one at
 *  infinity, a point 1e8 mm away, good for shadows. */
vec3 cal_lamp_position(const struct lamp *lamp, pose view_from_world);
/** Unit direction from a point to the lamp, and what is left of its light there: irradiance on a
 *  surface that faces it is intensity power falloff, with 1/r^2, or 1 for a lamp at infinity. */
vec3 cal_lamp_way(const struct lamp *lamp, pose view_from_world, vec3 point, double *falloff);

#ifdef __cplusplus
}
#endif
#endif
