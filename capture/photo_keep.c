/* photo_keep.c -- files that are decoded all at once stay decoded for who opens them next: what a
 * sensor's levels are learnt from is merged next.
 *
 * The last few only, and what is decoded takes the room of one that is kept: memory does not grow
 * with the number of photographs. A file belongs to whoever has it open, or to the list.
 */
#include "photo.h"

#include <string.h>
#include <sys/stat.h>

enum { KEPT = 6 };

static struct kept {
    struct photo_file *file;
    struct stat seen;
} kept[KEPT];
static int count;

static bool same_file(const struct stat *a, const struct stat *b)
{
    return a->st_dev == b->st_dev && a->st_ino == b->st_ino && a->st_size == b->st_size
           && a->st_mtim.tv_sec == b->st_mtim.tv_sec && a->st_mtim.tv_nsec == b->st_mtim.tv_nsec;
}

static struct photo_file *take_out(int k)
{
    struct photo_file *file = kept[k].file;
    memmove(kept + k, kept + k + 1, (size_t)(--count - k) * sizeof *kept);
    return file;
}

struct photo_file *photo_kept(const char *path)
{
    struct photo_file *file = NULL;
    struct stat now;
    if (stat(path, &now) != 0)
        return NULL;
#pragma omp critical(photo_keep)
    for (int k = count - 1; k >= 0 && !file; k--)
        if (strcmp(kept[k].file->path, path) == 0 && same_file(&kept[k].seen, &now))
            file = take_out(k);
    if (file)
        file->row = 0;
    return file;
}

struct photo_file *photo_keep(struct photo_file *file)
{
    struct kept one = {.file = file};
    struct photo_file *other = NULL;
    if (stat(file->path, &one.seen) != 0)
        return file;
#pragma omp critical(photo_keep)
    {
        if (count == KEPT)
            other = take_out(0);
        kept[count++] = one;
    }
    return other;
}

void photo_make_room(void)
{
    struct photo_file *oldest = NULL;
#pragma omp critical(photo_keep)
    if (count > 0)
        oldest = take_out(0);
    photo_end(oldest);
}

void photo_forget(void)
{
#pragma omp critical(photo_keep)
    while (count > 0)
        photo_end(take_out(0));
}
