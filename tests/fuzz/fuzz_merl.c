/* fuzz_merl.c -- any bytes as a MERL table. */
#include "file.h"
#include "reconstruct.h"

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    const char *name = fuzz_file(data, size, "binary");
    struct merl table = {0};
    rec_merl_read(&table, name, NULL);
    rec_merl_free(&table);
    unlink(name);
    return 0;
}
