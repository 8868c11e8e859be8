/* strip_angles.c -- half and difference angles of a strip's photosites, without a local frame.
 *
 * Method.   With h = (wi + wo)/|wi + wo| and c = n x h:
 *               theta_h = atan2(|c|, n.h)          theta_d = atan2(|wi - wo|, |wi + wo|)
 *               phi_d   = atan2(wi.c, (wi.h)(n.h) - wi.n)
 *           which are the definitions of rec_half_diff() with the axes b = c/|c| and t = b x h put
 *           in. The arc tangent is of S. L. Moshier's Cephes library (atan.c, double precision): it
 *           folds the ratio into [0, 0.66] and takes x + x^3 P(x^2)/Q(x^2).
 * Accuracy. The arc tangent to 2e-16; phi_d to 1e-16 / (sin theta_h sin theta_d).
 */
#include "strip.h"

static inline double positive_atan2(double y, double x)
{
    const double fold = 0.66;
    double small = y < x ? y : x, large = y < x ? x : y;
    bool upper = small > fold * large;
    double top = upper ? small - large : small, bottom = upper ? small + large : large;
    double t = top / (bottom > 0 ? bottom : 1), z = t * t;
    double p = -8.750608600031904122785e-1;
    p = p * z - 1.615753718733365076637e1;
    p = p * z - 7.500855792314704667340e1;
    p = p * z - 1.228866684490136173410e2;
    p = p * z - 6.485021904942025371773e1;
    double q = z + 2.485846490142306297962e1;
    q = q * z + 1.650270098316988542046e2;
    q = q * z + 4.328810604912902668951e2;
    q = q * z + 4.853903996359136964868e2;
    q = q * z + 1.945506571482613964425e2;
    double angle = t + t * z * p / q + (upper ? CAP_PI / 4 : 0);
    return y < x ? angle : CAP_PI / 2 - angle;
}

static inline double any_atan2(double y, double x)
{
    double angle = positive_atan2(y < 0 ? -y : y, x < 0 ? -x : x);
    angle = x < 0 ? CAP_PI - angle : angle;
    return y < 0 ? -angle : angle;
}

WIDE static void take_angles(struct strip *s)
{
    FOR_LANES (i, s->use) {
        double nx = s->normal.x[i], ny = s->normal.y[i], nz = s->normal.z[i];
        double ix = s->wi.x[i], iy = s->wi.y[i], iz = s->wi.z[i];
        double ox = s->wo.x[i], oy = s->wo.y[i], oz = s->wo.z[i];
        double px = ix + ox, py = iy + oy, pz = iz + oz;
        double dx = ix - ox, dy = iy - oy, dz = iz - oz;
        double sum = sqrt(px * px + py * py + pz * pz);
        double difference = sqrt(dx * dx + dy * dy + dz * dz), scale = 1 / sum;
        double hx = px * scale, hy = py * scale, hz = pz * scale;
        double cx = ny * hz - nz * hy, cy = nz * hx - nx * hz, cz = nx * hy - ny * hx;
        double n_h = nx * hx + ny * hy + nz * hz;
        double i_n = ix * nx + iy * ny + iz * nz, i_h = ix * hx + iy * hy + iz * hz;
        s->theta_h[i] = positive_atan2(sqrt(cx * cx + cy * cy + cz * cz), n_h > 0 ? n_h : 0);
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
        double phi_d = s->phi_d[i] < 0 ? s->phi_d[i] + CAP_PI : s->phi_d[i];
        int h = bin_of(sqrt(s->theta_h[i] * per_right) * MERL_THETA_H, MERL_THETA_H);
        int d = bin_of(s->theta_d[i] * per_right * MERL_THETA_D, MERL_THETA_D);
        int p = bin_of(phi_d / CAP_PI * MERL_PHI_D, MERL_PHI_D);
        s->bin[i] = p + MERL_PHI_D * (d + MERL_THETA_D * h);
    }
}

void rec_strip_angles(struct strip *s)
{
    take_angles(s);
    take_bins(s);
}
