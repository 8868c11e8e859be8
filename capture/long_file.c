/* long_file.c -- long files, written by a thread of their own, past the page cache where that is
 * of no use.
 *
 * A radiance map of 24 megapixels is 576 MB. Where memory does not hold all maps of a capture, the
 * page cache has lost them before anybody looks at them; and to find pages for all of it, and to
 * copy it there, costs a processor up to three seconds a gigabyte. A disk fetches it from where it
 * lies in a tenth (O_DIRECT). So it is gathered in two blocks: while one is filled, the other is on
 * its way, which costs no processor. Through the page cache the caller copies by itself, so that no
 * more threads work than were asked for. The first block waits until the end, since tables in it
 * are filled in last. Files of file systems that know no O_DIRECT take the same way through the
 * page cache.
 */
#include "long_file.h"

#include <errno.h>
#include <fcntl.h>
#include <pthread.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

enum { BLOCK = LONG_FILE_BLOCK, ALIGNMENT = 4096 };

struct long_file {
    int fd;
    bool direct;
    unsigned char *first, *filled, *sent;  // [BLOCK]: of the file's begin; going round
    size_t head, fill;                     // bytes of first and of filled
    uint64_t begin;                        // of filled, in the file
    pthread_t thread;
    bool threaded;  // the file was begun past the cache
    // What both threads touch, under the mutex.
    pthread_mutex_t mutex;
    pthread_cond_t turned;
    size_t sending;  // bytes of `sent` that are to be written; 0: it is free
    uint64_t place;  // where
    bool stop;
    int failure;  // errno of the first
};

// Some file systems open a file so, and then refuse to write.
static bool go_through_cache(struct long_file *f)
{
    if (errno != EINVAL || !f->direct)
        return false;
    f->direct = false;
    int flags = fcntl(f->fd, F_GETFL);
    return flags >= 0 && fcntl(f->fd, F_SETFL, flags & ~O_DIRECT) == 0;
}

// 0, or errno.
static int put(struct long_file *f, const unsigned char *data, size_t size, uint64_t offset)
{
    while (size > 0) {
        ssize_t n = pwrite(f->fd, data, size, (off_t)offset);
        if (n < 0 && (errno == EINTR || go_through_cache(f)))
            continue;
        if (n <= 0)
            return n < 0 ? errno : ENOSPC;
        if (f->direct && (size_t)n % ALIGNMENT != 0 && (size_t)n < size) {
            errno = EINVAL;  // the rest begins where no direct write may
            if (!go_through_cache(f))
                return errno;
        }
        data += n;
        offset += (uint64_t)n;
        size -= (size_t)n;
    }
    return 0;
}

static void *send_blocks(void *context)
{
    struct long_file *f = context;
    pthread_mutex_lock(&f->mutex);
    while (!f->stop || f->sending > 0) {
        if (f->sending == 0) {
            pthread_cond_wait(&f->turned, &f->mutex);
            continue;
        }
        size_t size = f->sending;
        uint64_t place = f->place;
        bool go = f->failure == 0;
        pthread_mutex_unlock(&f->mutex);
        int failure = go ? put(f, f->sent, size, place) : 0;
        pthread_mutex_lock(&f->mutex);
        f->failure = f->failure ? f->failure : failure;
        f->sending = 0;
        pthread_cond_broadcast(&f->turned);
    }
    pthread_mutex_unlock(&f->mutex);
    return NULL;
}

// Waits until the block before has gone. false: something has failed.
static bool send_filled(struct long_file *f)
{
    if (f->fill == 0)
        return true;
    if (!f->threaded) {
        f->failure = f->failure ? f->failure : put(f, f->filled, f->fill, f->begin);
        f->begin += f->fill;
        f->fill = 0;
        errno = f->failure;
        return f->failure == 0;
    }
    pthread_mutex_lock(&f->mutex);
    while (f->sending > 0)
        pthread_cond_wait(&f->turned, &f->mutex);
    unsigned char *free_block = f->sent;
    f->sent = f->filled;
    f->filled = free_block;
    // A direct write ends at a multiple, too; the file is cut at its end.
    size_t rest = f->fill % ALIGNMENT, more = rest ? ALIGNMENT - rest : 0;
    memset(f->sent + f->fill, 0, more);
    f->sending = f->fill + more;
    f->place = f->begin;
    int failure = f->failure;
    pthread_cond_broadcast(&f->turned);
    pthread_mutex_unlock(&f->mutex);
    f->begin += f->fill;
    f->fill = 0;
    errno = failure;
    return failure == 0;
}

static void close_all(struct long_file *f)
{
    if (f->fd >= 0)
        close(f->fd);
    free(f->first);
    free(f->filled);
    free(f->sent);
    free(f);
}

static int open_for(const char *path, bool direct)
{
    return open(path, O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC | (direct ? O_DIRECT : 0), 0666);
}

static bool open_file(struct long_file *f, const char *path, bool past_cache)
{
    f->direct = past_cache;
    f->fd = open_for(path, f->direct);
    if (f->fd < 0 && errno == EINVAL && f->direct) {
        f->direct = false;
        f->fd = open_for(path, false);
    }
    return f->fd >= 0;
}

struct long_file *long_file_begin(const char *path, uint64_t size, bool past_cache)
{
    struct long_file *f = calloc(1, sizeof *f);
    if (!f)
        return NULL;
    f->begin = BLOCK;
    f->fd = -1;
    f->first = aligned_alloc(ALIGNMENT, BLOCK);
    f->filled = aligned_alloc(ALIGNMENT, BLOCK);
    f->sent = aligned_alloc(ALIGNMENT, BLOCK);
    int failure = ENOMEM;
    if (f->first && f->filled && f->sent) {
        pthread_mutex_init(&f->mutex, NULL);
        pthread_cond_init(&f->turned, NULL);
        failure = open_file(f, path, past_cache) ? 0 : errno;
        // The file system finds room at once instead of block by block; one that cannot, later.
        if (!failure)
            (void)fallocate(f->fd, FALLOC_FL_KEEP_SIZE, 0, (off_t)size);
    }
    f->threaded = f->direct;
    if (!failure && f->threaded)
        failure = pthread_create(&f->thread, NULL, send_blocks, f);
    if (failure) {
        close_all(f);
        errno = failure;
        return NULL;
    }
    return f;
}

bool long_file_write(struct long_file *f, const void *data, size_t size, uint64_t offset)
{
    const unsigned char *from = data;
    if (offset < BLOCK) {
        size_t room = BLOCK - (size_t)offset, here = size < room ? size : room;
        if (offset > f->head)
            memset(f->first + f->head, 0, (size_t)offset - f->head);
        memcpy(f->first + offset, from, here);
        f->head = offset + here > f->head ? (size_t)offset + here : f->head;
        from += here;
        size -= here;
        offset += here;
    }
    if (size > 0 && offset != f->begin + f->fill) {
        errno = ESPIPE;
        return false;
    }
    while (size > 0) {
        size_t room = BLOCK - f->fill, here = size < room ? size : room;
        memcpy(f->filled + f->fill, from, here);
        f->fill += here;
        from += here;
        size -= here;
        if (f->fill == BLOCK && !send_filled(f))
            return false;
    }
    return true;
}

// The first block goes last; direct writes end at a multiple, and the file where it should.
static int finish(struct long_file *f, uint64_t end)
{
    size_t size = f->direct ? (f->head + ALIGNMENT - 1) / ALIGNMENT * ALIGNMENT : f->head;
    int failure = f->failure ? f->failure : put(f, f->first, size, 0);
    if (!failure && ftruncate(f->fd, (off_t)end) != 0)
        failure = errno;
    if (close(f->fd) != 0 && !failure)
        failure = errno;
    f->fd = -1;
    return failure;
}

bool long_file_end(struct long_file *f, bool keep)
{
    if (!f)
        return true;
    uint64_t end = f->begin > BLOCK || f->fill > 0 ? f->begin + f->fill : f->head;
    if (keep)
        (void)send_filled(f);
    pthread_mutex_lock(&f->mutex);
    f->stop = true;
    pthread_cond_broadcast(&f->turned);
    pthread_mutex_unlock(&f->mutex);
    if (f->threaded)
        pthread_join(f->thread, NULL);
    int failure = keep ? finish(f, end) : 0;
    pthread_cond_destroy(&f->turned);
    pthread_mutex_destroy(&f->mutex);
    close_all(f);
    errno = failure;
    return failure == 0;
}
