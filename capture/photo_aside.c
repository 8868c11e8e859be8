/* photo_aside.c -- decoded photographs wait in files without a name instead of in memory.
 *
 * The pages of such a file are the system's, which writes them to the disk when it needs their
 * memory. Where the disk has no plenty of room for them, photographs stay in memory: what fails on
 * a full disk is what a person asked for, and is told once.
 */
#include "photo_aside.h"
#include "capture.h"

#include <errno.h>
#include <fcntl.h>
#include <pthread.h>
#include <stdlib.h>
#include <string.h>
#include <sys/statvfs.h>
#include <unistd.h>

// Two keep two processors busy; a third is decoded while they wait for the disk. Three mosaics of
// 16 bits are 1.5 float images.
enum { AT_ONCE = 3 };
// A file is made where so many find room: the result has to find it too.
enum { PLENTY = 16 };

static pthread_mutex_t lock = PTHREAD_MUTEX_INITIALIZER;
static pthread_cond_t freed = PTHREAD_COND_INITIALIZER;
static int busy;
static char *folder;

void aside_in(const char *path)
{
    free(folder);
    folder = path ? strdup(path) : NULL;
}

static bool has_plenty(size_t size)
{
    struct statvfs disk;
    return statvfs(folder, &disk) == 0
           && (double)disk.f_bavail * (double)disk.f_frsize > (double)size * PLENTY;
}

/* File systems that know no files without a name get one whose name goes at once. */
static int open_named(void)
{
    char *path = cap_path(folder, ".aside_XXXXXX");
    int file = path ? mkstemp(path) : -1;
    if (file >= 0)
        unlink(path);
    free(path);
    return file;
}

int aside_open(size_t size)
{
    if (!folder || !has_plenty(size))
        return -1;
    int file = open(folder, O_TMPFILE | O_RDWR | O_CLOEXEC, 0600);
    return file >= 0 ? file : open_named();
}

bool aside_write(int file, const void *from, size_t size, size_t at)
{
    for (size_t done = 0; done < size;) {
        ssize_t now = pwrite(file, (const char *)from + done, size - done, (off_t)(at + done));
        if (now <= 0 && errno != EINTR)
            return false;
        done += now > 0 ? (size_t)now : 0;
    }
    return true;
}

bool aside_read(int file, void *to, size_t size, size_t at)
{
    for (size_t done = 0; done < size;) {
        ssize_t now = pread(file, (char *)to + done, size - done, (off_t)(at + done));
        if (now == 0 || (now < 0 && errno != EINTR))
            return false;
        done += now > 0 ? (size_t)now : 0;
    }
    return true;
}

void aside_begin(void)
{
    pthread_mutex_lock(&lock);
    while (busy == AT_ONCE)
        pthread_cond_wait(&freed, &lock);
    busy++;
    pthread_mutex_unlock(&lock);
}

void aside_end(void)
{
    pthread_mutex_lock(&lock);
    busy--;
    pthread_cond_signal(&freed);
    pthread_mutex_unlock(&lock);
}
