/* commands_board.c -- goniocam board: a printable board, and the capture.yaml that goes with it. */
#include "board_draw.h"
#include "commands.h"

#include <stdlib.h>

const struct option board_options[] = {
    {"output", "PDF", "the page to print, at 100 %", 'o'},
    {"paper", "PAPER", "a4 (default), a3, letter, ... or WIDTHxHEIGHT in mm", 0},
    {"family", "NAME", "AprilTag family (default tag36h11)", 0},
    {"tag", "MM", "side of a tag's black square (default: a ninth of the paper)", 0},
    {"measured", "MM", "length of the ruler as your printer printed it", 0},
    {0},
};

bool option_length(const struct arguments *args, const char *name, double *value)
{
    const char *text = cap_option(args, name);
    char *end;
    *value = 0;
    if (!text)
        return true;
    *value = strtod(text, &end);
    if (end != text && !*end && *value > 0 && *value < 1e5)
        return true;
    fprintf(stderr, "goniocam: --%s wants a length in mm, not '%s'\n", name, text);
    return false;
}

static void print_corner(const char *before, double x, double y)
{
    printf("%s[%.3f, %.3f, 0]", before, x, y);
}

/** A capture.yaml to begin with: what the board is, and what the person has to fill in. */
static void print_yaml(const struct board_plan *plan, const char *family)
{
    printf("goniocam: 1\nboard:\n  family: %s\n  tags:\n", family);
    for (int i = 0; i < plan->tags; i++) {
        const struct tag_place *tag = &plan->tag[i];
        printf("  - {id: %d, size: %.4f, center: [%.3f, %.3f, 0]}\n", tag->id, tag->size,
               tag->center.x, tag->center.y);
    }
    double half = 0.5 * plan->patch_side, x = plan->patch[0], y = plan->patch[1];
    printf("# Measure the sample; its center is where it stands on the circle, its radius high:\n"
           "# sample: {shape: sphere, radius: 25, center: [0, 0, 25]}\n"
           "# Raise the patch's corners (0) by its thickness, and give its albedo:\n"
           "# reference:\n#   albedo: 0.99\n#   corners: ");
    print_corner("[", x - half, y - half);
    print_corner(", ", x + half, y - half);
    print_corner(", ", x + half, y + half);
    print_corner(", ", x - half, y + half);
    printf("]\n");
}

int run_board(const struct arguments *args)
{
    const char *out = cap_option(args, "output"), *name = cap_option(args, "paper");
    const char *family_name = cap_option(args, "family");
    double paper[2], size, measured;
    if (args->count != 0 || !out) {
        fprintf(stderr, "goniocam board: wants -o PDF\n");
        return 2;
    }
    if (!board_plan_paper(paper, name ? name : "a4")) {
        fprintf(stderr, "goniocam board: no paper is called '%s': a4, letter, ... or 420x297\n",
                name);
        return 2;
    }
    if (!option_length(args, "tag", &size) || !option_length(args, "measured", &measured))
        return 2;
    family_name = family_name ? family_name : "tag36h11";
    struct tag_family family = {0};
    struct board_plan plan;
    struct error err = {0};
    enum status status = pattern_open(&family, family_name, &err);
    if (!status)
        status = board_plan_make(&plan, paper, size, &family, &err);
    if (!status && measured > 0 && fabs(measured / plan.ruler - 1) > 0.2)
        status = cap_fail(&err, STATUS_DATA,
                          "--measured %.4g: the ruler is %.4g mm long; measure it from end to end, "
                          "and print at 100 %%",
                          measured, plan.ruler);
    if (!status)
        status = board_write_pdf(out, &plan, &family, &err);
    if (!status && measured > 0)
        board_plan_scale(&plan, measured);
    if (!status)
        print_yaml(&plan, family_name);
    pattern_close(&family);
    return cap_exit(status, &err);
}
