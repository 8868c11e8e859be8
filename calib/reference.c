/* reference.c -- how strong the lamps are, by a capture of its own.
 *
 * Method.   A map's radiance is in full scales of the sensor a second. So a lamp's intensity, which
 *           holds the camera's gains, is the same in two captures of one camera, but for ISO and
 *           the aperture's area: those the photographs' metadata tell,
 *
 *               I / I' = (ISO / N^2) / (ISO' / N'^2),     means over the shots of a lamp
 *
 *           The lamp may have been moved between them, for the intensity is not that at any place;
 *           not so one that is so far that it has none: its irradiance is taken to be the same.
 * Accuracy. That of the reference's own calibration; the wavering of the lamp's power, as the
 *           reference's shots show it; nominal apertures and sensitivities, where they differ.
 */
#include "reference.h"

#include <stdlib.h>
#include <string.h>

static const double APERTURE_SIGMA = 0.03, ISO_SIGMA = 0.02;  // of what nominal numbers say
static const double SAME = 1e-3;                              // of ratios of such numbers
static const double WAVER = 0.01;  // of a lamp's power, where too few shots show it
enum { ENOUGH = 4 };               // shots to tell how a power wavers

/* ---- is it the same camera? ------------------------------------------------------------------ */

static const struct photo *first_photo(const struct capture *capture)
{
    return &capture->photo[capture->shot[0].photo[0]];
}

static bool differ(const char *a, const char *b)
{
    return *a && *b && strcmp(a, b) != 0;
}

static enum status check_camera(const struct capture *capture, const struct capture *other,
                                struct error *err)
{
    const struct photo *theirs = first_photo(other);
    for (int i = 0; i < capture->photos; i++) {
        const struct photo *ours = &capture->photo[i];
        if (ours->shot < 0)
            continue;
        const char *what =
            differ(ours->make, theirs->make) || differ(ours->model, theirs->model)
                ? "another camera"
            : differ(ours->lens, theirs->lens) ? "another lens"
            : ours->focal_length > 0 && theirs->focal_length > 0
                    && fabs(ours->focal_length - theirs->focal_length) > 0.01 * theirs->focal_length
                ? "another focal length"
            : ours->encoded != theirs->encoded || !*ours->cfa != !*theirs->cfa
                ? "another kind of files"
                : NULL;
        if (what)
            return cap_fail(err, STATUS_DATA,
                            "it was taken with %s than %s, so it "
                            "does not tell how bright the lamp is there",
                            what, ours->name);
    }
    if (!capture->flat != !other->flat)
        return cap_fail(err, STATUS_DATA,
                        "one of the two has a flat frame and the other has none: name the same "
                        "one in both");
    return STATUS_OK;
}

static enum status check_reference(const struct capture *capture, const struct capture *other,
                                   struct error *err)
{
    if (other->reference)
        return cap_fail(err, STATUS_FORMAT, "it names another one, %s: name that one alone",
                        other->reference);
    if (capture->reference_albedo > 0 && other->sample.shape == SHAPE_NONE)
        return cap_fail(err, STATUS_FORMAT, "it has no `sample` whose albedo could be %g",
                        capture->reference_albedo);
    if (capture->reference_albedo <= 0 && other->patches == 0)
        return cap_fail(err, STATUS_DATA,
                        "it has no `reference` patch; or say `albedo`, that of its sample, beside "
                        "`capture`");
    return check_camera(capture, other, err);
}

/** Merge and calibrate it. On success the caller owns both, on failure neither. */
static enum status calibrate_other(struct calibration *reference, struct capture *other,
                                   const struct capture *capture, const char *out, struct run *run,
                                   struct error *err)
{
    bool *usable = NULL;
    char *folder = cap_path(out, "reference");
    enum status status = folder ? STATUS_OK : cap_fail(err, STATUS_MEMORY, "%s", out);
    if (!status)
        status = cap_capture_read(other, capture->reference, run, err);
    if (!status)
        status = check_reference(capture, other, err);
    if (!status)
        status = cap_make_folder(folder, err);
    if (!status && !(usable = calloc((size_t)other->shots + 1, sizeof *usable)))
        status = cap_fail(err, STATUS_MEMORY, "%d shots", other->shots);
    if (!status)
        status = cap_capture_settle(other, run, err);
    if (!status)
        status = cap_merge(other, folder, NULL, usable, run, err);
    other->gives_scale = true;
    other->sample_albedo = capture->reference_albedo;
    if (!status)
        status = cal_calibrate(reference, other, folder, usable, run, err);
    if (status)
        cap_capture_free(other);
    free(usable);
    free(folder);
    return status;
}

/* ---- how much light a camera's settings let in ----------------------------------------------- */

/** Sums over a lamp's shots; counts of those whose photographs tell. */
struct settings {
    double iso, area;  // means of ISO and 1/N^2; 0: not told by all
    double waver;      // standard deviation of ln power, beside what the settings explain
    int shots;
};

static const struct photo *photo_of(const struct capture *capture, const char *shot)
{
    for (int i = 0; i < capture->shots; i++)
        if (strcmp(capture->shot[i].name, shot) == 0)
            return &capture->photo[capture->shot[i].photo[0]];
    return NULL;
}

static struct settings settings_of(const struct calibration *c, const struct capture *capture,
                                   int lamp)
{
    struct settings s = {0};
    double sum = 0, square = 0;
    bool iso = true, area = true;
    for (int v = 0; v < c->views; v++) {
        const struct photo *photo = photo_of(capture, c->view[v].name);
        if (c->view[v].light != lamp || !photo)
            continue;
        iso = iso && photo->iso > 0;
        area = area && photo->aperture > 0;
        double let = (photo->iso > 0 ? photo->iso : 1)
                     / (photo->aperture > 0 ? photo->aperture * photo->aperture : 1);
        double power = log(c->view[v].power / let);
        s.iso += photo->iso;
        s.area += photo->aperture > 0 ? 1 / (photo->aperture * photo->aperture) : 0;
        sum += power;
        square += power * power;
        s.shots++;
    }
    const double n = s.shots > 0 ? s.shots : 1;
    s.waver = s.shots < ENOUGH ? WAVER : sqrt(fmax(square - sum * sum / n, 0) / (n - 1));
    s.iso = iso ? s.iso / n : 0;
    s.area = area ? s.area / n : 0;
    return s;
}

/** ln of how much more is let in here than there; adds to *variance. */
static double log_ratio(double here, double there, double sigma, const char *what, double *variance,
                        struct run *run)
{
    if (here <= 0 || there <= 0) {
        cap_warn(run,
                 "the photographs do not all tell their %s: it is taken to be the same as in the "
                 "reference capture",
                 what);
        return 0;
    }
    double ratio = log(here / there);
    if (fabs(ratio) > SAME)
        *variance += sigma * sigma;
    return ratio;
}

/* ---- the lamps ------------------------------------------------------------------------------- */

static const struct lamp *lamp_there(const struct calibration *reference, const char *name)
{
    for (int l = 0; l < reference->lamps; l++)
        if (strcmp(reference->lamp[l].name, name) == 0)
            return &reference->lamp[l];
    return reference->lamps == 1 ? &reference->lamp[0] : NULL;
}

/** The first lamp here that is the same there. */
static int first_of(const struct calibration *c, const struct calibration *reference,
                    const struct lamp *there)
{
    int l = 0;
    while (lamp_there(reference, c->lamp[l].name) != there)
        l++;
    return l;
}

static void fill_strength(struct lamp *lamp, const struct lamp *there, double log_more,
                          double variance)
{
    struct lamp_strength *known = &lamp->known;
    double all = there->covariance[3][3] + variance, each = 0;
    for (int k = 0; k < 3; k++) {
        double sigma = there->sigma_intensity[k] / there->intensity[k];
        known->log_intensity[k] = log(there->intensity[k]) + log_more;
        each += fmax(sigma * sigma - there->covariance[3][3], 0) / 3;
        if (!there->at_infinity)
            lamp->intensity[k] = exp(known->log_intensity[k]);
    }
    known->at_infinity = there->at_infinity;
    known->sigma_all = sqrt(fmax(all, 1e-12));
    known->sigma_each = sqrt(each);
}

static enum status take_strengths(struct calibration *c, const struct capture *capture,
                                  const struct calibration *reference, const struct capture *other,
                                  struct run *run, struct error *err)
{
    for (int l = 0; l < c->lamps; l++) {
        const struct lamp *there = lamp_there(reference, c->lamp[l].name);
        if (!there)
            return cap_fail(err, STATUS_DATA, "it has %d lamps, and none is called '%s'",
                            reference->lamps, c->lamp[l].name);
        struct settings ours = settings_of(c, capture, l);
        struct settings theirs = settings_of(reference, other, (int)(there - reference->lamp));
        const double waver = theirs.waver / sqrt(theirs.shots > 0 ? theirs.shots : 1);
        double variance = waver * waver;
        double more = log_ratio(ours.area, theirs.area, APERTURE_SIGMA, "aperture", &variance, run)
                      + log_ratio(ours.iso, theirs.iso, ISO_SIGMA, "ISO", &variance, run);
        fill_strength(&c->lamp[l], there, more, variance);
        c->lamp[l].known.of = first_of(c, reference, there);
        c->lamp[l].known.sigma_power = theirs.waver / sqrt(ours.shots > 0 ? ours.shots : 1);
    }
    return STATUS_OK;
}

enum status reference_strengths(struct calibration *c, const struct capture *capture,
                                const char *out, struct run *run, struct error *err)
{
    struct calibration reference = {0};
    struct capture other = {0};
    enum status status = calibrate_other(&reference, &other, capture, out, run, err);
    if (!status)
        status = take_strengths(c, capture, &reference, &other, run, err);
    if (status)
        cap_fail_within(err, "the reference capture %s", capture->reference);
    cal_calibration_free(&reference);
    cap_capture_free(&other);
    return status;
}
