/* bracket.h -- the frames of one shot, read side by side. */
#ifndef GONIOCAM_BRACKET_H
#define GONIOCAM_BRACKET_H

#include "photo.h"

enum { BRACKET_FRAMES_MAX = 64 };

/** DN of an 8-bit code: linear in radiance, from 0 to 65535 (16-bit photographs are linear).
 *  sRGB: IEC 61966-2-1. */
void response_table(uint16_t dn[256], enum response response);

/** Open photographs of a shot, shortest exposure first, and a band of their rows. {0} is empty;
 *  release with bracket_close(). */
struct bracket {
    int frames, width, height, rows;   // rows that fit into the band
    int photo[BRACKET_FRAMES_MAX];     // index into capture->photo
    double time[BRACKET_FRAMES_MAX];   // ascending
    uint16_t *dn[BRACKET_FRAMES_MAX];  // [rows][width][3]
    struct photo_file *file[BRACKET_FRAMES_MAX];
    bool encoded;
    uint16_t table[256];
};

/** Open the frames of a shot for which skip[] ([capture->photos], may be NULL) is false. On a
 *  failure *bad (may be NULL) is the photograph, or -1 where no single one is to blame. */
enum status bracket_open(struct bracket *bracket, const struct capture *capture,
                         const struct shot *shot, const bool *skip, int rows, int *bad,
                         struct error *err);
/** Read the next rows (at most bracket->rows) of all frames into dn. */
enum status bracket_read(struct bracket *bracket, int rows, int *bad, struct error *err);
/** Pass over rows. */
enum status bracket_skip(struct bracket *bracket, int rows, int *bad, struct error *err);
void bracket_close(struct bracket *bracket);
#endif
