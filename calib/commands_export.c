/* commands_export.c -- goniocam export-calibration and import-calibration: calibrations for other
 * programs, and from them. */
#include "commands.h"
#include "interchange.h"

#include <string.h>

const struct option export_options[] = {
    {"to", "FORMAT", "opencv (a YAML file of one camera) or colmap (a folder: text model)", 0},
    {"output", "OUT", "file (opencv) or folder (colmap)", 'o'},
    {0},
};

int run_export(const struct arguments *args)
{
    const char *out = cap_option(args, "output"), *to = cap_option(args, "to");
    bool opencv = to && strcmp(to, "opencv") == 0, colmap = to && strcmp(to, "colmap") == 0;
    if (args->count != 1 || !out || (!opencv && !colmap)) {
        fprintf(stderr, "goniocam export-calibration: wants one CALIBRATION file, --to opencv or "
                        "colmap, and -o OUT\n");
        return 2;
    }
    struct calibration c = {0};
    struct error err = {0};
    enum status status = cal_calibration_import(&c, args->positional[0], &err);
    if (!status && opencv && c.cameras != 1)
        status = cap_fail(&err, STATUS_DATA, "%s: %d cameras, and the file holds one: use colmap",
                          args->positional[0], c.cameras);
    if (!status)
        status = opencv ? cal_write_opencv(c.camera, out, &err) : cal_write_colmap(&c, out, &err);
    cal_calibration_free(&c);
    return cap_exit(status, &err);
}

const struct option import_options[] = {
    {"output", "FILE", "calibration.yaml", 'o'},
    {0},
};

int run_import(const struct arguments *args)
{
    const char *out = cap_option(args, "output");
    if (args->count != 1 || !out) {
        fprintf(stderr, "goniocam import-calibration: wants one CALIBRATION (OpenCV's or Kalibr's "
                        "YAML, COLMAP's folder or cameras.txt), and -o FILE\n");
        return 2;
    }
    struct calibration c = {0};
    struct error err = {0};
    enum status status = cal_calibration_import(&c, args->positional[0], &err);
    if (!status)
        status = cal_calibration_write(&c, out, &err);
    if (!status)
        printf("%s: %d cameras, %d views\n", out, c.cameras, c.views);
    cal_calibration_free(&c);
    return cap_exit(status, &err);
}
