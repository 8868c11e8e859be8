/* error.c -- the story of a failure, for the person at the keyboard. */
#include "capture.h"

#include <stdarg.h>
#include <string.h>

enum status cap_fail(struct error *err, enum status status, const char *format, ...)
{
    if (err) {
        va_list args;
        va_start(args, format);
        vsnprintf(err->text, sizeof err->text, format, args);
        va_end(args);
        err->status = status;
    }
    return status;
}

enum status cap_fail_within(struct error *err, const char *format, ...)
{
    if (!err)
        return STATUS_OK;
    struct error inner = *err;
    va_list args;
    va_start(args, format);
    vsnprintf(err->text, sizeof err->text, format, args);
    va_end(args);
    size_t used = strlen(err->text);
    snprintf(err->text + used, sizeof err->text - used, ": %s", inner.text);
    return err->status;
}

const char *cap_status_text(enum status status)
{
#define STATUS_TEXT(name, text) [STATUS_##name] = text,
    static const char *const texts[] = {STATUS_LIST(STATUS_TEXT)};
#undef STATUS_TEXT
    return texts[status];
}
