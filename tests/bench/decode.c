/* decode.c -- the floor of speed: how long libtiff, or LibRaw, takes to decode photographs, and
 * nothing else.
 *
 *     decode THREADS FILE.tif|.dng...      prints seconds
 */
#include <libraw/libraw.h>
#include <omp.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <tiffio.h>

/** Unpack a raw file; the bytes of its photosites, 0 where it cannot be read. */
static size_t decode_raw(const char *path)
{
    libraw_data_t *raw = libraw_init(0);
    bool good = raw && !libraw_open_file(raw, path) && !libraw_unpack(raw);
    size_t total = good ? (size_t)raw->sizes.raw_pitch * raw->sizes.raw_height : 0;
    if (raw)
        libraw_close(raw);
    return total;
}

/** Decode all strips or tiles of one file; its size in bytes, 0 where it cannot be read. */
static size_t decode_tiff(const char *path)
{
    TIFF *tiff = TIFFOpen(path, "r");
    if (!tiff)
        return 0;
    bool tiled = TIFFIsTiled(tiff);
    tmsize_t size = tiled ? TIFFTileSize(tiff) : TIFFStripSize(tiff);
    uint32_t parts = tiled ? TIFFNumberOfTiles(tiff) : TIFFNumberOfStrips(tiff);
    void *buffer = malloc((size_t)size);
    size_t total = 0;
    for (uint32_t i = 0; buffer && i < parts; i++) {
        tmsize_t got = tiled ? TIFFReadEncodedTile(tiff, i, buffer, size)
                             : TIFFReadEncodedStrip(tiff, i, buffer, size);
        total += got > 0 ? (size_t)got : 0;
    }
    free(buffer);
    TIFFClose(tiff);
    return total;
}

static size_t decode(const char *path)
{
    const char *end = strrchr(path, '.');
    return end && strcmp(end, ".dng") == 0 ? decode_raw(path) : decode_tiff(path);
}

int main(int argc, char **argv)
{
    int threads = argc > 2 ? atoi(argv[1]) : 0, failed = 0;
    if (threads < 1) {
        fprintf(stderr, "usage: decode THREADS FILE.tif|.dng...\n");
        return 2;
    }
    double begin = omp_get_wtime();
#pragma omp parallel for schedule(dynamic) num_threads(threads) reduction(+ : failed)
    for (int i = 2; i < argc; i++)
        failed += decode(argv[i]) == 0;
    printf("%.4f\n", omp_get_wtime() - begin);
    return failed ? 1 : 0;
}
