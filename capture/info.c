/* info.c -- what a photograph or radiance map says of itself. */
#include "photo.h"

#include <string.h>

/* One key: as JSON, or a line for people where it is known. */
struct printer {
    FILE *to;
    bool json, any;
};

static void put_key(struct printer *p, const char *key)
{
    if (p->json)
        fprintf(p->to, "%s\"%s\": ", p->any ? ", " : "{", key);
    else
        fprintf(p->to, "%-14s ", key);
    p->any = true;
}

static void put_text(struct printer *p, const char *key, const char *text)
{
    if (!p->json && !*text)
        return;
    put_key(p, key);
    if (!p->json) {
        fprintf(p->to, "%s\n", text);
        return;
    }
    if (!*text) {
        fputs("null", p->to);
        return;
    }
    fputc('"', p->to);
    for (const unsigned char *c = (const unsigned char *)text; *c; c++)
        if (*c == '"' || *c == '\\')
            fprintf(p->to, "\\%c", *c);
        else if (*c < 0x20 || *c >= 0x7F)  // what cameras put there need not be UTF-8
            fprintf(p->to, "\\u%04x", *c);
        else
            fputc(*c, p->to);
    fputc('"', p->to);
}

static void put_number(struct printer *p, const char *key, double value, bool known)
{
    if (!p->json && !known)
        return;
    put_key(p, key);
    if (known)
        fprintf(p->to, "%.7g", value);  // EXIF's ratios, LibRaw's floats
    else
        fputs("null", p->to);
    if (!p->json)
        fputc('\n', p->to);
}

enum status cap_info(const char *path, bool json, FILE *to, struct error *err)
{
    struct photo_file *file = NULL;
    enum status status = photo_open(&file, path, err);
    if (status)
        return status;
    const struct photo *info = &file->info;
    struct printer p = {.to = to, .json = json};
    put_text(&p, "make", info->make);
    put_text(&p, "model", info->model);
    put_text(&p, "lens", info->lens);
    put_text(&p, "taken", info->taken);
    put_number(&p, "width", info->width, true);
    put_number(&p, "height", info->height, true);
    put_number(&p, "channels", info->gray ? 1 : info->channels, true);
    put_number(&p, "bits", info->bits, true);
    put_text(&p, "cfa", info->cfa);
    put_number(&p, "black", info->black, !isnan(info->black));
    put_number(&p, "white", info->white, !isnan(info->white));
    put_number(&p, "exposure_time", info->exposure_time, info->exposure_time > 0);
    put_number(&p, "aperture", info->aperture, info->aperture > 0);
    put_number(&p, "iso", info->iso, info->iso > 0);
    put_number(&p, "focal_length", info->focal_length, info->focal_length > 0);
    put_number(&p, "orientation", info->orientation, info->orientation > 0);
    if (json)
        fputs("}\n", to);
    photo_close(file);
    return STATUS_OK;
}
