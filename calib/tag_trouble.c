/* tag_trouble.c -- what is wrong with a tag that the others contradict.
 *
 * Method.   The poses are those that the other tags give. Each corner of the tag is put where its
 *           rays meet best (linear least squares); what the four corners make is then compared with
 *           what capture.yaml says: side, place, turn, squareness. Rays that do not meet tell that
 *           the tag was not in one place.
 *           Whether a tag is in its place is a test. Where it was put, its corners lie as far from
 *           where they were given as noise (of each photograph by itself, as the other tags have
 *           it) and a bias (light that is uneven beside the sample: alike in all photographs)
 *           allow, along what the rays determine: chi^2 with 12 degrees of freedom. And the rays
 *           miss each other by what noise and bias allow: chi^2 with the other degrees. Each test
 *           errs on one of all tags of a board in FALSE_ALARMS / 2 of the calibrations.
 */
#include "tag_trouble.h"

#include "bundle_noise.h"
#include "dense.h"

#include <string.h>

// A sample's light on a tag moves corners by some hundredths: one sigma.
static const double BIAS_PX = 0.05;
// And where a shadow's rim, or the sample's, lies across it, by this part of the tag's side, times
// the share that it covers.
static const double COVERED = 0.1;
static const double FALSE_ALARMS = 0.001;  // of calibrations

// A ray of a corner: from an eye in a unit direction, in the world.
static void corner_ray(const struct bundle *b, const struct sighting *s, int k, vec3 *eye,
                       vec3 *direction)
{
    const struct view *view = b->calibration->view + s->view;
    mat3 r = cal_rotation(view->view_from_world.rotation);
    *eye = cal_eye(view->view_from_world);
    *direction = mat3_mul_t(&r, cal_ray(b->calibration->camera + view->camera, s->corner[k]));
}

// The point nearest to the rays of a corner.
static bool meet(const struct bundle *b, int place, int k, vec3 *point)
{
    double a[9] = {0}, x[3] = {0};
    int rays = 0;
    for (int i = 0; i < b->sightings; i++) {
        const struct sighting *s = b->sighting + i;
        if (s->place != place)
            continue;
        vec3 eye, way;
        corner_ray(b, s, k, &eye, &way);
        const double d[3] = {way.x, way.y, way.z}, e[3] = {eye.x, eye.y, eye.z};
        for (int r = 0; r < 3; r++)
            for (int c = 0; c < 3; c++) {
                double across = (r == c) - d[r] * d[c];
                a[3 * r + c] += across;
                x[r] += across * e[c];
            }
        rays++;
    }
    if (rays < 2 || !dense_cholesky(3, a))
        return false;
    // Rays within a degree of each other leave the smallest pivot below sin^2 of half of that.
    if (a[8] * a[8] < 1e-4 * rays)
        return false;
    dense_solve(3, a, x);
    *point = (vec3){x[0], x[1], x[2]};
    return true;
}

bool tag_locate(const struct bundle *b, int place, vec3 corner[4], double *rms_px)
{
    double sum = 0;
    int n = 0;
    for (int k = 0; k < 4; k++)
        if (!meet(b, place, k, corner + k))
            return false;
    for (int i = 0; i < b->sightings; i++) {
        const struct sighting *s = b->sighting + i;
        const struct view *view = b->calibration->view + s->view;
        for (int k = 0; s->place == place && k < 4; k++) {
            vec3 p = cal_to_view(view->view_from_world, corner[k]);
            double pixel[2];
            if (!(p.z > 0))
                return false;
            cal_project(b->calibration->camera + view->camera, p, pixel);
            sum += (s->corner[k][0] - pixel[0]) * (s->corner[k][0] - pixel[0])
                   + (s->corner[k][1] - pixel[1]) * (s->corner[k][1] - pixel[1]);
            n++;
        }
    }
    *rms_px = sqrt(sum / fmax(n, 1));
    return true;
}

static double mean_side(const vec3 corner[4], double *spread)
{
    double sum = 0, low = INFINITY, high = 0;
    for (int k = 0; k < 4; k++) {
        double side = vec3_length(vec3_sub(corner[(k + 1) % 4], corner[k]));
        sum += side / 4;
        low = fmin(low, side);
        high = fmax(high, side);
    }
    *spread = (high - low) / sum;
    return sum;
}

// A side in the image, px: what a residual is to be compared with.
static double side_px(const struct bundle *b, int place)
{
    double sum = 0;
    int n = 0;
    for (int i = 0; i < b->sightings; i++) {
        const struct sighting *s = b->sighting + i;
        if (s->place != place)
            continue;
        sum += hypot(s->corner[1][0] - s->corner[0][0], s->corner[1][1] - s->corner[0][1]);
        n++;
    }
    return sum / fmax(n, 1);
}

/** The value that chi^2 of so many degrees of freedom exceeds with a small probability: Wilson and
 *  Hilferty (1931) on Abramowitz and Stegun's 26.2.23. */
static double chi2_beyond(double freedom, double probability)
{
    const double t = sqrt(-2 * log(probability)), part = 2 / (9 * freedom);
    const double z = t
                     - (2.515517 + t * (0.802853 + t * 0.010328))
                           / (1 + t * (1.432788 + t * (0.189269 + t * 0.001308)));
    return freedom * pow(1 - part + z * sqrt(part), 3);
}

/** Sums over the corners of a tag in all views, px^2: of how far what was found there is from its
 *  rays, of how far its given place is from where it was found, and mean variances of noise and of
 * bias of a number. */
struct strays {
    double missed, moved, noise, bias;
    int views;
};

static bool strays_of(struct strays *sum, const struct bundle *b, int place, const vec3 corner[4])
{
    const double scale = bundle_noise_scale(b);
    *sum = (struct strays){.views = 0};
    for (int i = 0; i < b->sightings; i++) {
        const struct sighting *s = b->sighting + i;
        const struct view *view = b->calibration->view + s->view;
        for (int k = 0; s->place == place && k < 4; k++) {
            const vec3 at[2] = {corner[k], cap_tag_corner(b->capture->tag + place, k)};
            double pixel[2][2];
            for (int e = 0; e < 2; e++) {
                vec3 p = cal_to_view(view->view_from_world, at[e]);
                if (!(p.z > 0))
                    return false;
                cal_project(b->calibration->camera + view->camera, p, pixel[e]);
            }
            for (int a = 0; a < 2; a++) {
                sum->missed += pow(s->corner[k][a] - pixel[0][a], 2);
                sum->moved += pow(pixel[1][a] - pixel[0][a], 2);
                sum->noise += scale * exp(s->log_noise) * s->covariance[2 * k + a][2 * k + a];
            }
        }
        if (s->place != place)
            continue;
        const double side =
            hypot(s->corner[1][0] - s->corner[0][0], s->corner[1][1] - s->corner[0][1]);
        sum->bias += BIAS_PX * BIAS_PX + pow(COVERED * side * s->covered, 2);
        sum->views++;
    }
    sum->noise /= TAG_NUMBERS * fmax(sum->views, 1);
    sum->bias /= fmax(sum->views, 1);
    return !isnan(scale);
}

bool tag_in_place(const struct bundle *b, int place)
{
    const double probability = 0.5 * FALSE_ALARMS / fmax(b->capture->tags, 1);
    vec3 corner[4];
    double rms;
    struct strays sum;
    if (!tag_locate(b, place, corner, &rms) || !strays_of(&sum, b, place, corner))
        return false;
    return sum.moved < chi2_beyond(12, probability) * (sum.noise + sum.views * sum.bias)
           && sum.missed
                  < chi2_beyond(TAG_NUMBERS * sum.views - 12, probability) * (sum.noise + sum.bias);
}

void tag_trouble(const struct bundle *b, int place, char *text, size_t room)
{
    const struct tag_place *tag = b->capture->tag + place;
    vec3 corner[4], middle = {0, 0, 0};
    double rms, spread;
    if (!tag_locate(b, place, corner, &rms)) {
        snprintf(text, room, "is not where capture.yaml says");
        return;
    }
    double side = mean_side(corner, &spread);
    for (int k = 0; k < 4; k++)
        middle = vec3_add(middle, vec3_scale(corner[k], 0.25));
    vec3 right = vec3_normalize(vec3_sub(corner[1], corner[0]));
    vec3 off = vec3_sub(middle, tag->center);
    double cosine = fmin(fmax(vec3_dot(right, tag->x_axis), -1), 1);
    double turn = acos(cosine) * 180 / CAP_PI;
    if (rms > fmax(0.5, 0.02 * side_px(b, place)))
        snprintf(text, room, "was not in one place: it moved between the photographs (%.1f px)",
                 rms);
    else if (fabs(side / tag->size - 1) > 0.01)
        snprintf(text, room, "is %.2f mm wide, not %.2f as capture.yaml says", side, tag->size);
    else if (spread > 0.02)
        snprintf(text, room, "is no square: its sides differ by %.1f %%", 100 * spread);
    else if (turn > 2)
        snprintf(text, room,
                 "is turned by %.0f degrees from what capture.yaml says, in (%.1f, %.1f, %.1f)",
                 turn, middle.x, middle.y, middle.z);
    else
        snprintf(text, room, "is in (%.2f, %.2f, %.2f), %.2f mm from where capture.yaml says",
                 middle.x, middle.y, middle.z, vec3_length(off));
}
