/* charconv_shim.cc -- numbers to text and back by the C++ library's <charconv>. */
#include "charconv_shim.h"

#include <charconv>
#include <cmath>

int rec_number_read(const char **text, const char *end, double *value)
{
    const char *begin = *text;
    if (end - begin > 1 && *begin == '+' && begin[1] != '-')
        begin++;
    std::from_chars_result result = std::from_chars(begin, end, *value);
    if (result.ec != std::errc())
        return 0;
    *text = result.ptr;
    return 1;
}

int rec_number_write(char *to, double value)
{
    double size = std::fabs(value);
    bool near = size == 0 || (size > 1e-37 && size < 1e38);
    std::to_chars_result result =
        near ? std::to_chars(to, to + NUMBER_CHARACTERS, static_cast<float>(value))
             : std::to_chars(to, to + NUMBER_CHARACTERS, value);
    return static_cast<int>(result.ptr - to);
}
