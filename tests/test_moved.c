/* Moved frames: found by the image's own displacement, and no others. */
#include "moved.h"
#include "synthetic.h"

enum { WIDTH = 200, ROWS = 20, FRAMES = 5, COUNT = WIDTH * ROWS };

static const struct chip chip = {128, 4, 5, 60000, 16383};

/* Electrons a second of a scene of soft edges, at any place. */
static double scene(double x, double y)
{
    return 2e6 * (1.2 + sin(0.31 * x + 0.5 * sin(0.2 * y)) * cos(0.23 * y + 0.4 * sin(0.17 * x)));
}

/* Frame f stands at (dx[f], 0.5 dx[f]); which are left out is returned as bits. */
static int find_moved(const double dx[FRAMES])
{
    static float dn[3][FRAMES][COUNT];
    float *pointer[3][FRAMES];
    double time[FRAMES];
    int photo[FRAMES], bits = 0;
    bool left_out[FRAMES] = {false};
    uint64_t state = 5;
    struct bracket_sample sample[3];
    struct sample_set set = {.samples = 1, .width = WIDTH, .rows = ROWS};
    struct sensor sensor = {0};
    for (int c = 0; c < 3; c++) {
        for (int f = 0; f < FRAMES; f++) {
            pointer[c][f] = dn[c][f];
            time[f] = pow(2, f) / 1024;
            photo[f] = f;
            for (int i = 0; i < COUNT; i++) {
                double x = i % WIDTH - dx[f], y = i / WIDTH - 0.5 * dx[f];
                dn[c][f][i] = chip_expose(&chip, scene(x, y) * time[f], &state);
            }
        }
        sample[c] = (struct bracket_sample){
            .frames = FRAMES, .time = time, .dn = pointer[c], .photosites = COUNT, .photo = photo};
        set.channel[c] = &sample[c];
        sensor.black[c] = chip.black;
        sensor.white[c] = chip.black + chip.full_well / chip.gain;
        sensor.usable[c] = sensor.white[c] - 20;
    }
    struct photo photos[FRAMES] = {
        {.name = "a"}, {.name = "b"}, {.name = "c"}, {.name = "d"}, {.name = "e"}};
    struct shot shot = {.name = "a"};
    struct capture capture = {.photo = photos, .photos = FRAMES, .shot = &shot, .shots = 1};
    struct run run;
    cap_run_begin(&run, 1, true);
    moved_find(left_out, &capture, &set, &sensor, &run);
    for (int f = 0; f < FRAMES; f++)
        bits |= left_out[f] << f;
    int told = run.warnings, expected = 0;
    for (int f = 0; f < FRAMES; f++)
        expected += left_out[f];
    cap_run_end(&run);
    assert_int_equal(told, expected);  // every one is named
    return bits;
}

static struct row {
    const char *name;
    double dx[FRAMES];
    int moved;  // bits
} rows[] = {
    {"a tripod", {0, 0, 0, 0, 0}, 0},
    {"steps that do no harm", {0, 0.05, 0.1, 0.05, 0}, 0},
    {"the last frame", {0, 0, 0, 0, 1}, 1 << 4},
    {"the first frame", {2, 0, 0, 0, 0}, 1},
    {"one in the middle, and back", {0, 0, 1.5, 0, 0}, 1 << 2},
    {"two of five stay behind", {1, 1, 0, 0, 0}, 3},
};
enum { ROWS_OF_TABLE = sizeof rows / sizeof *rows };

static void test_row(void **state)
{
    const struct row *r = *state;
    assert_int_equal(find_moved(r->dx), r->moved);
}

int main(void)
{
    struct CMUnitTest tests[ROWS_OF_TABLE];
    for (int i = 0; i < ROWS_OF_TABLE; i++)
        tests[i] = (struct CMUnitTest){rows[i].name, test_row, NULL, NULL, &rows[i]};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
