/* board_check.c -- what capture.yaml says of the board and of cameras.
 *
 * Everything found wrong is told with the file, the line and the key.
 */
#include "capture_yaml.h"

#include <stdlib.h>
#include <string.h>
#include <unistd.h>

static vec3 vec3_of(const double v[3])
{
    return (vec3){v[0], v[1], v[2]};
}

static bool is_there(const struct capture_yaml *yaml, const char *path)
{
    return yaml_source_line(&yaml->source, path) > 0;
}

static enum status check_tag(struct tag_place *tag, const struct capture_yaml *yaml, unsigned i,
                             struct error *err)
{
    const struct yaml_tag *given = &yaml->root->board->tag[i];
    char path[64];
    double size = given->size;
    snprintf(path, sizeof path, "board.tags[%u].size", i);
    if (!is_there(yaml, path))
        size = yaml->root->board->tag_size;
    if (!is_there(yaml, path) && !is_there(yaml, "board.tag_size"))
        return yaml_source_fail(&yaml->source, err, path,
                                "is missing (or one `tag_size` for all tags of the board)");
    if (!(size > 0))
        return yaml_source_fail(&yaml->source, err, path, "has to be positive");
    *tag = (struct tag_place){.id = given->id, .size = size, .center = vec3_of(given->center)};
    snprintf(path, sizeof path, "board.tags[%u].center", i);
    tag->unplaced = !is_there(yaml, path);
    snprintf(path, sizeof path, "board.tags[%u].id", i);
    if (given->id < 0)
        return yaml_source_fail(&yaml->source, err, path, "ids of tags are not negative");
    for (unsigned k = 0; k < i; k++)
        if (yaml->root->board->tag[k].id == given->id)
            return yaml_source_fail(&yaml->source, err, path, "tag %d stands here twice",
                                    given->id);
    snprintf(path, sizeof path, "board.tags[%u].x_axis", i);
    enum status status =
        capture_check_axis(&tag->x_axis, yaml, path, given->x_axis, (vec3){1, 0, 0}, err);
    snprintf(path, sizeof path, "board.tags[%u].y_axis", i);
    if (!status)
        status = capture_check_axis(&tag->y_axis, yaml, path, given->y_axis, (vec3){0, 1, 0}, err);
    if (!status && !(fabs(vec3_dot(tag->x_axis, tag->y_axis)) <= CAPTURE_AXIS_TOLERANCE))
        status = yaml_source_fail(&yaml->source, err, path, "is not at right angles to x_axis");
    return status;
}

enum status capture_check_board(struct capture *capture, const struct capture_yaml *yaml,
                                struct error *err)
{
    const struct yaml_board *board = yaml->root->board;
    if (!board)
        return STATUS_OK;
    if (board->tags == 0 && !is_there(yaml, "board.tag_size"))
        return yaml_source_fail(&yaml->source, err, "board",
                                "says neither `tags` nor `tag_size`, the side of all tags, whose "
                                "places the photographs then tell");
    if (is_there(yaml, "board.tag_size") && !(board->tag_size > 0))
        return yaml_source_fail(&yaml->source, err, "board.tag_size", "has to be positive");
    if (is_there(yaml, "board.place_sigma") && !(board->place_sigma > 0))
        return yaml_source_fail(&yaml->source, err, "board.place_sigma", "has to be positive");
    capture->tag_size = board->tag_size;
    capture->place_sigma = board->place_sigma;
    capture->family = strdup(board->family);
    capture->tag = calloc(board->tags + 1, sizeof *capture->tag);
    if (!capture->family || !capture->tag)
        return cap_fail(err, STATUS_MEMORY, "%s", yaml->source.file);
    capture->tags = (int)board->tags;
    enum status status = STATUS_OK;
    for (unsigned i = 0; i < board->tags && !status; i++)
        status = check_tag(&capture->tag[i], yaml, i, err);
    return status;
}

enum status capture_check_cameras(struct capture *capture, const struct capture_yaml *yaml,
                                  struct error *err)
{
    unsigned count = yaml->root->cameras;
    capture->given = calloc(count + 1, sizeof *capture->given);
    if (!capture->given)
        return cap_fail(err, STATUS_MEMORY, "%s", yaml->source.file);
    for (unsigned i = 0; i < count; i++) {
        const struct yaml_camera *given = &yaml->root->camera[i];
        struct camera_given *camera = &capture->given[capture->givens++];
        char path[64];
        snprintf(path, sizeof path, "camera[%u].use", i);
        if (given->use && strcmp(given->use, "fixed") != 0 && strcmp(given->use, "prior") != 0)
            return yaml_source_fail(&yaml->source, err, path, "'%s' is neither fixed nor prior",
                                    given->use);
        if (given->use && !given->intrinsics)
            return yaml_source_fail(&yaml->source, err, path, "wants `intrinsics` to use");
        camera->prior = given->use && strcmp(given->use, "prior") == 0;
        if (!given->intrinsics)
            continue;
        camera->file = *given->intrinsics == '/' || !capture->folder
                           ? strdup(given->intrinsics)
                           : cap_path(capture->folder, given->intrinsics);
        if (!camera->file)
            return cap_fail(err, STATUS_MEMORY, "%s", given->intrinsics);
        snprintf(path, sizeof path, "camera[%u].intrinsics", i);
        if (access(camera->file, R_OK) != 0)
            return yaml_source_fail(&yaml->source, err, path, "%s: there is no such file",
                                    camera->file);
    }
    return STATUS_OK;
}

vec3 cap_tag_corner(const struct tag_place *tag, int k)
{
    double right = k == 1 || k == 2 ? 0.5 : -0.5, up = k >= 2 ? 0.5 : -0.5;
    return vec3_add(tag->center, vec3_add(vec3_scale(tag->x_axis, right * tag->size),
                                          vec3_scale(tag->y_axis, up * tag->size)));
}
