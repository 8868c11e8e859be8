/* bracket.h -- the frames of one shot, read side by side. */
#ifndef GONIOCAM_BRACKET_H
#define GONIOCAM_BRACKET_H

#include "photo.h"
#include "response.h"

enum { BRACKET_FRAMES_MAX = 64 };

/** Open photographs of a shot, shortest exposure first, and a band of their rows. {0} is empty;
 *  release with bracket_close(). */
struct bracket {
    int frames, width, height, channels, rows;  // rows that fit into the band
    int photo[BRACKET_FRAMES_MAX];              // index into capture->photo
    double time[BRACKET_FRAMES_MAX];            // ascending
    float *dn[BRACKET_FRAMES_MAX];              // [rows][width][channels]
    struct photo_file *file[BRACKET_FRAMES_MAX];
    bool any_row;                  // rows can be passed over without decoding them
    bool at_once;                  // a frame is decoded by the first row that is read
    int rows_at_once;              // best read together
    int threads;                   // for reading frames beside each other; 1 at first
    const struct curve *response;  // of encoded photographs; NULL: codes stay codes
};

/** Which photographs of a shot, and how: photographs with skip[] true are left out, seconds[] are
 *  exposure times (both [capture->photos]; NULL: none, and those of the files). */
struct bracket_choice {
    const struct capture *capture;
    const struct shot *shot;
    const bool *skip;
    const double *seconds;
    const struct curve *response;
};

/** Open the frames of a shot; rows 0: a band of the frames' own rows_at_once, 8 at least. On a
 *  failure *bad (may be NULL) is the photograph, or -1 where no single one is to blame. */
enum status bracket_open(struct bracket *bracket, const struct bracket_choice *choice, int rows,
                         int *bad, struct error *err);
/** Read the next rows (at most bracket->rows) of all frames into dn. */
enum status bracket_read(struct bracket *bracket, int rows, int *bad, struct error *err);
/** Pass over rows. */
enum status bracket_skip(struct bracket *bracket, int rows, int *bad, struct error *err);
/** Go to a row; backwards only where any_row. */
enum status bracket_seek(struct bracket *bracket, int row, int *bad, struct error *err);
void bracket_close(struct bracket *bracket);
#endif
