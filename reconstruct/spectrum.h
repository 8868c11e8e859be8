/* spectrum.h -- reflectance spectra and linear sRGB, both ways. */
#ifndef GONIOCAM_SPECTRUM_H
#define GONIOCAM_SPECTRUM_H

/** What each of `count` wavelengths (nm, ascending) adds to linear sRGB of a reflectance under D65,
 *  weight [count][3]. Between wavelengths the spectrum is linear, beyond them constant: a flat
 *  spectrum of 1 is (1, 1, 1). One wavelength alone is grey. */
void rec_spectrum_weights(double (*weight)[3], const double *wavelength, int count);

enum { SPECTRUM_SIZE = 11 };  // 400 to 700 nm in steps of 30
double rec_spectrum_wavelength(int i);
/** A smooth spectrum [SPECTRUM_SIZE] of linear sRGB: not negative, flat for greys, linear in the
 *  colour (within each order of the three channels), and under D65 exactly that colour. Negative
 *  channels count as 0. */
void rec_spectrum_of_rgb(double *spectrum, const double rgb[3]);
#endif
