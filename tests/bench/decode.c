/* decode.c -- the floor of speed: how long libtiff takes to decode photographs, and nothing else.
 *
 *     decode THREADS FILE.tif...      prints seconds
 */
#include <omp.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <tiffio.h>

/** Decode all strips or tiles of one file; its size in bytes, 0 where it cannot be read. */
static size_t decode(const char *path)
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

int main(int argc, char **argv)
{
    int threads = argc > 2 ? atoi(argv[1]) : 0, failed = 0;
    if (threads < 1) {
        fprintf(stderr, "usage: decode THREADS FILE.tif...\n");
        return 2;
    }
    double begin = omp_get_wtime();
#pragma omp parallel for schedule(dynamic) num_threads(threads) reduction(+ : failed)
    for (int i = 2; i < argc; i++)
        failed += decode(argv[i]) == 0;
    printf("%.4f\n", omp_get_wtime() - begin);
    return failed ? 1 : 0;
}
