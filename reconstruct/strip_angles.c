/* strip_angles.c -- half and difference angles of a strip's photosites, without a local frame.
 *
 * Method.   With h = (wi + wo)/|wi + wo| and c = n x h:
 *               theta_h = atan2(|c|, n.h)          theta_d = atan2(|wi - wo|, |wi + wo|)
 *               phi_d   = atan2(wi.c, (wi.h)(n.h) - wi.n)
 *           which are the definitions of rec_half_diff() with the axes b = c/|c| and t = b x h put
 *           in. The arc tangent is of S. L. Moshier's Cephes library (atanf.c, single precision):
 * it folds the ratio into [0, tan pi/8] and takes x + x^3 P(x^2). Accuracy. Angles to 2e-7, a
 * thousandth of the narrowest bin; phi_d to 2e-7 / (sin theta_h sin theta_d).
 */
#include "strip.h"

// A right angle, rounded down: twice that is not more than pi.
static const float QUARTER = 1.57079625F;

static inline float positive_atan2(float y, float x)
{
    const float fold = 0.41421356F;  // tan(pi/8)
    float small = y < x ? y : x, large = y < x ? x : y;
    bool upper = small > fold * large;
    float top = upper ? small - large : small, bottom = upper ? small + large : large;
    float t = top / (bottom > 0 ? bottom : 1), z = t * t;
    float p = 8.05374449538e-2F;
    p = p * z - 1.38776856032e-1F;
    p = p * z + 1.99777106478e-1F;
    p = p * z - 3.33329491539e-1F;
    float angle = t + t * z * p + (upper ? QUARTER / 2 : 0);
    return y < x ? angle : QUARTER - angle;
}

static inline float any_atan2(float y, float x)
{
    float angle = positive_atan2(y < 0 ? -y : y, x < 0 ? -x : x);
    angle = x < 0 ? 2 * QUARTER - angle : angle;
    return y < 0 ? -angle : angle;
}

WIDE static void take_angles(struct strip *s)
{
    FOR_LANES (i, s->use) {
        float nx = s->normal.x[i], ny = s->normal.y[i], nz = s->normal.z[i];
        float ix = s->wi.x[i], iy = s->wi.y[i], iz = s->wi.z[i];
        float ox = s->wo.x[i], oy = s->wo.y[i], oz = s->wo.z[i];
        float px = ix + ox, py = iy + oy, pz = iz + oz;
        float dx = ix - ox, dy = iy - oy, dz = iz - oz;
        float sum = sqrtf(px * px + py * py + pz * pz);
        float difference = sqrtf(dx * dx + dy * dy + dz * dz), scale = 1 / sum;
        float hx = px * scale, hy = py * scale, hz = pz * scale;
        float cx = ny * hz - nz * hy, cy = nz * hx - nx * hz, cz = nx * hy - ny * hx;
        float n_h = nx * hx + ny * hy + nz * hz;
        float i_n = ix * nx + iy * ny + iz * nz, i_h = ix * hx + iy * hy + iz * hz;
        s->theta_h[i] = positive_atan2(sqrtf(cx * cx + cy * cy + cz * cz), n_h > 0 ? n_h : 0);
        s->theta_d[i] = positive_atan2(difference, sum);
        s->phi_d[i] = any_atan2(ix * cx + iy * cy + iz * cz, i_h * n_h - i_n);
    }
}

// Whatever the place: lanes that are not in use may hold no number.
static inline int bin_of(double place, int bins)
{
    place = place > 0 ? place : 0;
    return (int)(place < bins - 1 ? place : bins - 1);
}

WIDE static void take_bins(struct strip *s)
{
    const double per_right = 2 / CAP_PI;  // 1 / a right angle
    FOR_LANES (i, s->use) {
        double theta_h = (double)s->theta_h[i], theta_d = (double)s->theta_d[i];
        double phi_d = (double)s->phi_d[i] + (s->phi_d[i] < 0 ? CAP_PI : 0);
        int h = bin_of(sqrt(theta_h * per_right) * MERL_THETA_H, MERL_THETA_H);
        int d = bin_of(theta_d * per_right * MERL_THETA_D, MERL_THETA_D);
        int p = bin_of(phi_d / CAP_PI * MERL_PHI_D, MERL_PHI_D);
        s->bin[i] = p + MERL_PHI_D * (d + MERL_THETA_D * h);
    }
}

void rec_strip_angles(struct strip *s)
{
    take_angles(s);
    take_bins(s);
}
