/* tag_image.c -- what a tag looks like: its square in the image, and its blurred pattern.
 *
 * Method.   The blurred pattern at (u, v) is the sum over cells of their weight under a Gaussian
 *           with deviations s_u, s_v and correlation r (the blur in the image, seen in the tag's
 *           plane), by the tetrachoric series to r^2. Across an edge the Gaussian has the fourth
 *           cumulant of a square photosite (Edgeworth's first term), without which sharp edges
 *           err with their phase by 0.05 of the contrast. Cells at the rim reach to infinity.
 * Accuracy. The series is off by less than r^3/6, and r is below 0.5 except at grazing views; the
 *           edge by less than 0.01 of the contrast where the lens adds any blur to the photosite's.
 */
#include "tag_image.h"

#include <string.h>

const double tag_image_corner[4][2] = {{0, 1}, {1, 1}, {1, 0}, {0, 0}};

// ---- the square and the image

// Unit square to quadrangle: P. Heckbert, "Fundamentals of Texture Mapping", 1989, section 2.2.3.
void tag_image_set(struct tag_image *image)
{
    const double *p0 = image->corner[3], *p1 = image->corner[2], *p2 = image->corner[1],
                 *p3 = image->corner[0];
    double sum[2], d1[2], d2[2];
    for (int i = 0; i < 2; i++) {
        sum[i] = p0[i] - p1[i] + p2[i] - p3[i];
        d1[i] = p1[i] - p2[i];
        d2[i] = p3[i] - p2[i];
    }
    double det = d1[0] * d2[1] - d2[0] * d1[1];
    double g = (sum[0] * d2[1] - d2[0] * sum[1]) / det, h = (d1[0] * sum[1] - sum[0] * d1[1]) / det;
    double(*n)[3] = image->q_from_square.m, (*m)[3] = image->square_from_q.m;
    for (int i = 0; i < 2; i++) {
        n[i][0] = p1[i] - p0[i] + g * p1[i];
        n[i][1] = p3[i] - p0[i] + h * p3[i];
        n[i][2] = p0[i];
    }
    n[2][0] = g;
    n[2][1] = h;
    n[2][2] = 1;
    for (int i = 0; i < 3; i++)  // the adjugate is the inverse up to scale
        for (int j = 0; j < 3; j++) {
            int a = (j + 1) % 3, b = (j + 2) % 3, c = (i + 1) % 3, d = (i + 2) % 3;
            m[i][j] = n[a][c] * n[b][d] - n[a][d] * n[b][c];
        }
}

// h applied to a point, and its derivative.
void tag_image_apply(const mat3 *h, const double p[2], double out[2], double by_p[2][2])
{
    double w = h->m[2][0] * p[0] + h->m[2][1] * p[1] + h->m[2][2];
    for (int i = 0; i < 2; i++) {
        out[i] = (h->m[i][0] * p[0] + h->m[i][1] * p[1] + h->m[i][2]) / w;
        for (int j = 0; j < 2; j++)
            by_p[i][j] = (h->m[i][j] - out[i] * h->m[2][j]) / w;
    }
}

void tag_image_undistort(const struct camera *camera, const double pixel[2], double q[2])
{
    double d[2], x[2];
    for (int i = 0; i < 2; i++)
        d[i] = (pixel[i] - camera->center[i]) / camera->focal[i];
    lens_undistort(camera->distortion, d, x);
    for (int i = 0; i < 2; i++)
        q[i] = camera->focal[i] * x[i] + camera->center[i];
}

void tag_image_distort(const struct camera *camera, const double q[2], double pixel[2],
                       double pixel_by_q[2][2])
{
    double x[2], d[2];
    for (int i = 0; i < 2; i++)
        x[i] = (q[i] - camera->center[i]) / camera->focal[i];
    lens_distort(camera->distortion, x, d, pixel_by_q);
    for (int i = 0; i < 2; i++)
        pixel[i] = camera->focal[i] * d[i] + camera->center[i];
    pixel_by_q[0][1] *= camera->focal[0] / camera->focal[1];
    pixel_by_q[1][0] *= camera->focal[1] / camera->focal[0];
}

void tag_image_by_lens(const struct camera *camera, const double q[2],
                       double pixel_by[2][LENS_PARAMETERS])
{
    double parameters[LENS_PARAMETERS], pixel[2];
    lens_to_array(parameters, camera);
    const vec3 p = {(q[0] - camera->center[0]) / camera->focal[0],
                    (q[1] - camera->center[1]) / camera->focal[1], 1};
    lens_project(parameters, p, pixel, NULL, pixel_by);
}

// ---- the blurred pattern

// A Gaussian over the cells of one axis: w[n][j] is the difference across cell first + j of its
// n-th integral: 0 the distribution function, 1 the density, 2 and 3 its derivatives.
struct axis {
    int first, count;
    double w[4][PATTERN_MAX];
};

// The density is below 1e-4 of its peak beyond this many deviations.
static const double reach = 4.3;

static void spread(struct axis *axis, double at, double sigma, double flat, int cells)
{
    int first = (int)fmin(fmax(floor(at - reach * sigma), 0), cells - 1);
    int last = (int)fmin(fmax(floor(at + reach * sigma), 0), cells - 1);
    axis->first = first;
    axis->count = last - first + 1;
    double below[4] = {0};
    for (int j = 0; j < axis->count; j++) {
        double above[4] = {1, 0, 0, 0};
        if (first + j < last) {
            double a = (first + j + 1 - at) / sigma, a2 = a * a, k = flat / 24;
            double density = exp(-0.5 * a2) / sqrt(2 * CAP_PI);
            above[0] = 0.5 * erfc(-a * sqrt(0.5)) - density * k * a * (a2 - 3);
            above[1] = density * (1 + k * (a2 * (a2 - 6) + 3));
            above[2] = -density * a * (1 + k * (a2 * (a2 - 10) + 15));
            above[3] = density * (a2 - 1 + k * (a2 * (a2 * (a2 - 15) + 45) - 15));
        }
        for (int n = 0; n < 4; n++) {
            axis->w[n][j] = above[n] - below[n];
            below[n] = above[n];
        }
    }
}

// Excess kurtosis, across an edge whose gradient over the image is g, of a photosite's square (a
// fourth cumulant of -1/120 px^4 along either side) blurred to a variance of `blur`.
static double kurtosis(const double g[2], double blur)
{
    double x2 = g[0] * g[0], y2 = g[1] * g[1], sum = x2 + y2;
    return -(x2 * x2 + y2 * y2) / (sum * sum) / (120 * blur * blur);
}

bool tag_image_whiteness(const struct tag_image *image, const double q[2], double st[2],
                         struct whiteness *out)
{
    const struct tag_pattern *p = image->pattern;
    double by_q[2][2], by_pixel[2][2], side = p->side;
    tag_image_apply(&image->square_from_q, q, st, by_q);
    for (int i = 0; i < 2; i++)
        for (int j = 0; j < 2; j++)
            by_pixel[i][j] =
                side
                * (by_q[i][0] * image->q_by_pixel[0][j] + by_q[i][1] * image->q_by_pixel[1][j]);
    double uu = by_pixel[0][0] * by_pixel[0][0] + by_pixel[0][1] * by_pixel[0][1];
    double vv = by_pixel[1][0] * by_pixel[1][0] + by_pixel[1][1] * by_pixel[1][1];
    double uv = by_pixel[0][0] * by_pixel[1][0] + by_pixel[0][1] * by_pixel[1][1];
    double su = sqrt(image->blur * uu), sv = sqrt(image->blur * vv), r = uv / sqrt(uu * vv);
    struct axis a, b;
    spread(&a, st[0] * side + p->begin, su, kurtosis(by_pixel[0], image->blur), p->width);
    spread(&b, st[1] * side + p->begin, sv, kurtosis(by_pixel[1], image->blur), p->width);
    *out = (struct whiteness){0};
    for (int j = 0; j < b.count; j++)
        for (int i = 0; i < a.count; i++) {
            int cell = p->cell[b.first + j][a.first + i];
            if (cell == CELL_UNKNOWN)
                return false;
            if (cell == CELL_BLACK)
                continue;
            const double a0 = a.w[0][i], a1 = a.w[1][i], a2 = a.w[2][i], a3 = a.w[3][i];
            const double b0 = b.w[0][j], b1 = b.w[1][j], b2 = b.w[2][j], b3 = b.w[3][j];
            out->value += a0 * b0 + r * (a1 * b1 + r / 2 * a2 * b2);
            out->by_s -= a1 * b0 + r * (a2 * b1 + r / 2 * a3 * b2);
            out->by_t -= a0 * b1 + r * (a1 * b2 + r / 2 * a2 * b3);
            out->by_blur += a2 * b0 + 2 * r * a1 * b1 + a0 * b2;  // the heat equation
        }
    out->by_s *= side / su;
    out->by_t *= side / sv;
    out->by_blur /= 2 * image->blur;
    double gx = out->by_s * by_q[0][0] + out->by_t * by_q[1][0];
    double gy = out->by_s * by_q[0][1] + out->by_t * by_q[1][1];
    out->slope2 = gx * gx + gy * gy;
    return true;
}
