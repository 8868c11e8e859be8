/* charconv_shim.h -- numbers to text and back by the C++ library, ten times faster than printf. */
#ifndef GONIOCAM_CHARCONV_SHIM_H
#define GONIOCAM_CHARCONV_SHIM_H

#ifdef __cplusplus
extern "C" {
#endif

enum { NUMBER_CHARACTERS = 32 };  // what rec_number_write may write

/** The number that *text begins with, in text that ends before `end`; *text moves behind it. NULL
 *  ends nothing here: the text need not be a string. Returns 0 where there is no number. */
int rec_number_read(const char **text, const char *end, double *value);
/** The shortest decimal that reads back as the same float (as the same double, where no float is
 *  near); returns how many characters, without a zero at the end. */
int rec_number_write(char *to, double value);

#ifdef __cplusplus
}
#endif
#endif
