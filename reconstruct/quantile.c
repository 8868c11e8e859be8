/* quantile.c -- order statistics by selection.
 *
 * Method.   Hoare's: the part that holds the wanted rank is divided about the median of three until
 *           it is one value. Any order of the input gives the same result.
 */
#include "quantile.h"

#include <math.h>

static void swap(double *a, double *b)
{
    double kept = *a;
    *a = *b;
    *b = kept;
}

static double median_of_three(double a, double b, double c)
{
    return fmax(fmin(a, b), fmin(fmax(a, b), c));
}

double rec_quantile(double *value, int count, double q)
{
    if (count <= 0)
        return NAN;
    int rank = (int)(q * (count - 1)), low = 0, high = count - 1;
    while (low < high) {
        double pivot = median_of_three(value[low], value[low + (high - low) / 2], value[high]);
        int i = low, j = high;
        while (i <= j) {
            while (value[i] < pivot)
                i++;
            while (value[j] > pivot)
                j--;
            if (i <= j)
                swap(&value[i++], &value[j--]);
        }
        if (rank <= j)
            high = j;
        else if (rank >= i)
            low = i;
        else
            break;
    }
    return value[rank];
}
