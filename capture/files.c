/* files.c -- folders, and files that appear under their names only when complete.
 *
 * A file is written aside, in the same folder, and renamed: rename() replaces atomically, so a
 * reader sees the old file or the whole new one, and a full disk leaves the old one.
 */
#include "capture.h"

#include <errno.h>
#include <pthread.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

char *cap_path(const char *folder, const char *name)
{
    size_t size = strlen(folder) + strlen(name) + 2;
    char *path = malloc(size);
    if (path) {
        bool slash = *folder && folder[strlen(folder) - 1] == '/';
        snprintf(path, size, "%s%s%s", folder, slash ? "" : "/", name);
    }
    return path;
}

static enum status make_one(const char *path, struct error *err)
{
    struct stat info;
    if (mkdir(path, 0777) == 0)
        return STATUS_OK;
    if (errno != EEXIST)
        return cap_fail(err, STATUS_IO, "%s: cannot make this folder: %s", path, strerror(errno));
    if (stat(path, &info) != 0 || !S_ISDIR(info.st_mode))
        return cap_fail(err, STATUS_IO, "%s: exists and is not a folder", path);
    return STATUS_OK;
}

enum status cap_make_folder(const char *path, struct error *err)
{
    char *part = strdup(path);
    if (!part)
        return cap_fail(err, STATUS_MEMORY, "%s", path);
    enum status status = STATUS_OK;
    for (char *slash = strchr(part + 1, '/'); slash && !status; slash = strchr(slash + 1, '/')) {
        *slash = '\0';
        if (access(part, F_OK) != 0)
            status = make_one(part, err);
        *slash = '/';
    }
    if (!status)
        status = make_one(part, err);
    if (!status && access(path, W_OK | X_OK) != 0)
        status =
            cap_fail(err, STATUS_IO, "%s: this folder is not writable: %s", path, strerror(errno));
    free(part);
    return status;
}

// The files that are being written, by their names aside: what a stopped program removes.
static pthread_mutex_t lock = PTHREAD_MUTEX_INITIALIZER;
static const char **open_aside = NULL;
static size_t opened = 0;

static bool register_aside(const char *aside)
{
    pthread_mutex_lock(&lock);
    const char **grown = realloc(open_aside, (opened + 1) * sizeof *grown);
    if (grown) {
        open_aside = grown;
        open_aside[opened++] = aside;
    }
    pthread_mutex_unlock(&lock);
    return grown != NULL;
}

// The last one's end gives the list back.
static void forget_aside(const char *aside)
{
    size_t i = 0;
    while (i < opened && open_aside[i] != aside)
        i++;
    if (i < opened)
        open_aside[i] = open_aside[--opened];
    if (opened == 0) {
        free(open_aside);
        open_aside = NULL;
    }
}

static void release(struct atomic_file *file)
{
    pthread_mutex_lock(&lock);
    forget_aside(file->aside);
    pthread_mutex_unlock(&lock);
    free(file->name);
    free(file->aside);
    *file = (struct atomic_file){0};
}

void cap_files_stop(void)
{
    pthread_mutex_lock(&lock);  // for good: no file appears any more
    for (size_t i = 0; i < opened; i++)
        remove(open_aside[i]);
}

enum status cap_file_begin(struct atomic_file *file, const char *path, bool with_stream,
                           struct error *err)
{
    enum status status = STATUS_OK;
    struct atomic_file made = {.name = strdup(path)};
    // The process id keeps two runs into one folder apart.
    bool named = made.name && asprintf(&made.aside, "%s.%ld.part", path, (long)getpid()) >= 0;
    if (!named)
        made.aside = NULL;
    if (!named || !register_aside(made.aside)) {
        status = cap_fail(err, STATUS_MEMORY, "%s", path);
    } else if (with_stream && !(made.stream = fopen(made.aside, "wb"))) {
        status = cap_fail(err, STATUS_IO, "%s: cannot be written: %s", path, strerror(errno));
    } else {
        *file = made;
        return STATUS_OK;
    }
    release(&made);
    return status;
}

enum status cap_file_commit(struct atomic_file *file, struct error *err)
{
    bool written = true;
    if (file->stream) {
        written = fflush(file->stream) == 0 && !ferror(file->stream);
        int reason = errno;
        if (fclose(file->stream) != 0 && written)  // NFS tells of a full disk only here
            written = false;
        else
            errno = reason;
        file->stream = NULL;
    }
    enum status status = STATUS_OK;
    if (!written || rename(file->aside, file->name) != 0) {
        status = cap_fail(err, STATUS_IO, "%s: cannot be written: %s", file->name, strerror(errno));
        remove(file->aside);
    }
    release(file);
    return status;
}

void cap_file_abandon(struct atomic_file *file)
{
    if (file->stream)
        fclose(file->stream);
    if (file->aside)
        remove(file->aside);
    release(file);
}
