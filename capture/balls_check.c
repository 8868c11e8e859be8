/* balls_check.c -- balls beside the sample that show the lamps, as capture.yaml tells. */
#include "capture_yaml.h"

enum status capture_check_balls(struct capture *capture, const struct capture_yaml *yaml,
                                struct error *err)
{
    const unsigned count = yaml->root->balls;
    char path[64];
    if (count > BALLS_MAX)
        return yaml_source_fail(&yaml->source, err, "balls", "at most %d of them", BALLS_MAX);
    for (unsigned i = 0; i < count; i++) {
        const struct yaml_ball *given = &yaml->root->ball[i];
        snprintf(path, sizeof path, "balls[%u].radius", i);
        if (!(given->radius > 0))
            return yaml_source_fail(&yaml->source, err, path, "has to be positive");
        snprintf(path, sizeof path, "balls[%u].radius_sigma", i);
        const bool told = yaml_source_line(&yaml->source, path) > 0;
        if (told && !(given->radius_sigma > 0))
            return yaml_source_fail(&yaml->source, err, path, "has to be positive");
        capture->ball[capture->balls++] = (struct ball_place){
            .radius = given->radius,
            .radius_sigma = told ? given->radius_sigma : CAPTURE_CALIPER * given->radius,
            .center = {given->center[0], given->center[1], given->center[2]}};
    }
    return STATUS_OK;
}
