/* photo_keep.c -- files that are decoded all at once stay decoded for who opens them next: what a
 * sensor's levels are learnt from is merged next.
 *
 * Decoded rows wait in files of the output's folder, up to so many bytes; where they cannot, in
 * memory, and then the last few only: memory does not grow with the number of photographs. A file
 * belongs to whoever has it open, or to the list.
 */
#include "photo.h"
#include "photo_aside.h"

#include <string.h>
#include <sys/stat.h>

enum { KEPT = 128, HELD = 6 };                // files; of them in memory
static const size_t ASIDE = (size_t)2 << 30;  // bytes of those aside

static struct kept {
    struct photo_file *file;
    struct stat seen;
} kept[KEPT];
static int count;
static size_t aside;

static bool same_file(const struct stat *a, const struct stat *b)
{
    return a->st_dev == b->st_dev && a->st_ino == b->st_ino && a->st_size == b->st_size
           && a->st_mtim.tv_sec == b->st_mtim.tv_sec && a->st_mtim.tv_nsec == b->st_mtim.tv_nsec;
}

static size_t size_of(const struct photo *info)
{
    return 2 * (size_t)info->width * (size_t)info->height * (size_t)info->channels;
}

static struct photo_file *take_out(int k)
{
    struct photo_file *file = kept[k].file;
    memmove(kept + k, kept + k + 1, (size_t)(--count - k) * sizeof *kept);
    aside -= file->aside ? size_of(&file->info) : 0;
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

/* What waits aside stays where it is while there is room: photographs come again in the order they
 * came in, so that the first ones serve best. In memory are the last ones. */
static bool has_room(const struct photo_file *file)
{
    return count < KEPT && (!file->aside || aside + size_of(&file->info) <= ASIDE);
}

/* The one that has been in memory longest, where there are so many. */
static struct photo_file *take_held(int many)
{
    int held = 0, oldest = -1;
    for (int k = count - 1; k >= 0; k--)
        if (!kept[k].file->aside) {
            held++;
            oldest = k;
        }
    return held > 0 && held >= many ? take_out(oldest) : NULL;
}

struct photo_file *photo_keep(struct photo_file *file)
{
    struct kept one = {.file = file};
    struct photo_file *other = NULL;
    if (stat(file->path, &one.seen) != 0)
        return file;
#pragma omp critical(photo_keep)
    {
        other = file->aside ? NULL : take_held(HELD);
        if (!has_room(file)) {
            other = file;
        } else {
            kept[count++] = one;
            aside += file->aside ? size_of(&file->info) : 0;
        }
    }
    return other;
}

void photo_make_room(void)
{
    struct photo_file *oldest = NULL;
#pragma omp critical(photo_keep)
    oldest = take_held(1);
    photo_end(oldest);
}

void photo_keep_in(const char *folder)
{
    aside_in(folder);
}

void photo_forget(void)
{
#pragma omp critical(photo_keep)
    while (count > 0)
        photo_end(take_out(0));
    aside_in(NULL);
}
