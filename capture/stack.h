/* stack.h -- several photographs of the same (dark, flat, ambient frames), averaged. */
#ifndef GONIOCAM_STACK_H
#define GONIOCAM_STACK_H

#include "response.h"

/** The mean of frames, in DN (linear where encoded). Owns mean; {0} is empty; stack_free(). */
struct stack {
    int frames, width, height, channels;
    char cfa[CFA_SIZE];
    double seconds;  // all exposure times together; 0 where one is not known
    float *mean;     // [height][width][channels]
};

/** Average those of the named files that have the camera's size. STATUS_IO, STATUS_FORMAT,
 *  STATUS_MEMORY; frames is 0, and nothing else is there, where no file has that size. */
enum status stack_read(struct stack *stack, const struct capture *capture,
                       const struct frame_names *names, int camera, const struct curve *curve,
                       struct error *err);
void stack_free(struct stack *stack);
/** The channel of value i of row y. */
int stack_channel(const struct stack *stack, size_t i, int y);
/** Means of the channels. */
void stack_levels(double level[3], const struct stack *stack);
#endif
