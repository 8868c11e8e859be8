/* calibrate.c -- the order of calibration: geometry, glare, sample, lamps, pictures. */
#include "balls.h"
#include "board_light.h"
#include "cues.h"
#include "glare_ink.h"
#include "lamp.h"
#include "overlay.h"
#include "sample_start.h"
#include "solid_place.h"
#include "sphere.h"

#include <errno.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

/** The edges that a sample was placed by: a sphere's, or another solid's. Owns them. */
struct outline {
    struct edge *sphere;
    struct contour_edge *solid;
    int count;
};

static enum status place_sample(struct outline *edges, struct calibration *c,
                                struct solid_prior *prior, const struct capture *capture,
                                const char *out, struct run *run, struct error *err)
{
    cap_stage(run, "outline", 0);
    if (c->sample.shape == SHAPE_SPHERE)
        return cal_sphere_place(&edges->sphere, &edges->count, c, capture, out, run, err);
    enum status status = cal_solid_place(&edges->solid, &edges->count, prior, c, out, run, err);
    if (status == STATUS_DATA)  // the size may be why
        cal_mesh_size_check(c, out, run, NULL);
    return status;
}

/** Lamps by all that is lit. They may show that some of the edges were not the sphere's but the
 *  light's: a sphere is then moved, and lamps follow it. */
static enum status finish_lamps(struct lamp_search *search, struct calibration *c,
                                const struct outline *edges, const struct capture *capture,
                                const char *out, struct run *run, struct error *err)
{
    const struct sample placed = c->sample;
    const bool sphere = placed.shape == SHAPE_SPHERE;
    bool moved = false;
    cap_stage(run, "all light", sphere ? c->views : 0);
    enum status status = cal_lamps_end(search, c, run, err);
    if (!status && sphere)
        status = cal_sphere_settle(&moved, c, &placed, capture, edges->sphere, edges->count, err);
    if (!status && moved)
        status = cal_lamps_end(search, c, run, err);
    for (int l = 0; l < c->lamps && !status; l++)
        cal_cues_compare(&c->lamp[l], run);
    if (!status)
        status = sphere ? cal_sphere_check(c, edges->sphere, edges->count, run, err)
                        : cal_solid_check(c, edges->solid, edges->count, run, err);
    return status ? status : cal_mesh_size_check(c, out, run, err);
}

/** Sample and lamps need each other: the sample roughly, the lamps by the board that it leaves
 *  free, the sample by edges that are its own and not the light's, the lamps by all that is lit. */
static enum status find_sample_and_lamps(struct calibration *c, const struct capture *capture,
                                         const char *out, struct run *run, struct error *err)
{
    struct lamp_search search = {0};
    struct solid_prior prior = {0};
    struct outline edges = {0};
    cap_stage(run, "sample", 0);
    enum status status = cal_sample_start(c, &prior, capture, out, run, err);
    if (!status)
        status = cal_balls_start(c, capture, out, run, err);
    if (!status) {
        cap_stage(run, "lamps", c->views);
        status = cal_lamps_begin(&search, c, capture, out, run, err);
    }
    if (!status)
        status = place_sample(&edges, c, &prior, capture, out, run, err);
    if (!status)
        status = cal_balls_place(c, capture, out, run, err);
    if (!status)
        status = finish_lamps(&search, c, &edges, capture, out, run, err);
    cal_lamp_search_free(&search);
    free(edges.sphere);
    free(edges.solid);
    return status;
}

/** The capture with its tags where they were found. They are those of *board, [calibration->tags].
 */
static struct capture with_board(const struct capture *capture, struct tag_place *board,
                                 const struct calibration *c)
{
    struct capture placed = *capture;
    for (int i = 0; i < c->tags; i++)
        board[i] = c->tag[i].place;
    placed.tag = board;
    placed.tags = c->tags;
    return placed;
}

enum status cal_calibrate(struct calibration *calibration, const struct capture *capture,
                          const char *out, const bool *usable, struct run *run, struct error *err)
{
    struct calibration c = {0};
    struct tag_place *board = NULL;
    enum status status = cal_geometry(&c, capture, out, usable, run, err);
    if (!status && !(board = calloc((size_t)c.tags + 1, sizeof *board)))
        status = cap_fail(err, STATUS_MEMORY, "%d tags", c.tags);
    if (!status) {
        const struct capture placed = with_board(capture, board, &c);
        status = cal_glare(&c, &placed, out, run, err);
        if (!status && capture->sample.shape != SHAPE_NONE)
            status = find_sample_and_lamps(&c, &placed, out, run, err);
        else if (!status && capture->gives_scale)
            status = cal_lamps_by_board(&c, &placed, out, run, err);
        cap_stage(run, "overlays", c.views);
        if (!status)
            status = cal_overlay(&c, &placed, out, run, err);
    }
    cap_stage(run, "", 0);
    free(board);
    if (status)
        cal_calibration_free(&c);
    else
        *calibration = c;
    return status;
}

// Tags that a calibration measured must be where it projects those of the board.
static bool same_board(const struct calibration *c, const struct capture *board)
{
    const double far_px = 5;
    for (int v = 0; v < c->views; v++)
        for (int t = 0; t < c->view[v].tags; t++)
            for (int k = 0; k < board->tags; k++) {
                const struct seen_tag *seen = &c->view[v].tag[t];
                double pixel[2];
                if (board->tag[k].id != seen->id)
                    continue;
                vec3 corner = cap_tag_corner(&board->tag[k], 0);
                vec3 p = cal_to_view(c->view[v].view_from_world, corner);
                if (p.z <= 0)
                    return false;
                cal_project(&c->camera[c->view[v].camera], p, pixel);
                if (hypot(pixel[0] - seen->corner[0][0], pixel[1] - seen->corner[0][1]) > far_px)
                    return false;
            }
    return true;
}

enum status cal_look_around(struct calibration *calibration, const struct capture *capture,
                            const char *out, struct run *run, struct error *err)
{
    struct board_survey survey = {0};
    struct tag_place *own = calloc((size_t)calibration->tags + 1, sizeof *own);
    if (!own)
        return cap_fail(err, STATUS_MEMORY, "%d tags", calibration->tags);
    const struct capture board =
        calibration->tags ? with_board(capture, own, calibration) : *capture;
    const struct facets none = {0};
    enum status status = STATUS_OK;
    if (board.tags > 0 && !same_board(calibration, &board)) {
        cap_warn(run, "the calibration's world is not the board's: what light the board throws on "
                      "the sample is not known");
    } else if (board.tags > 0) {
        cap_stage(run, "board", 0);
        status = cal_board_survey(&survey, calibration, &board, out, run, err);
        if (!status)
            status = cal_board_light(calibration, &survey, run, err);
        if (!status)
            status = cal_board_light_strength(calibration, &none, run, err);
    }
    cal_board_survey_free(&survey);
    free(own);
    return status;
}
