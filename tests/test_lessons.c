/* What a merge learns: who follows another process knows what the leader found, and has looked at
 * no photograph. */
#include "lessons.h"
#include "synthetic.h"

#include <unistd.h>

enum { WIDTH = 96, HEIGHT = 64, COUNT = 3 * WIDTH * HEIGHT, SHOTS = 4, FRAMES = 3, HOT = 1000 };

static const struct chip chip = {128, 12.6, 5, 48000, 4095};
static char folder[] = "/tmp/test_lessons_XXXXXX";
static struct capture capture;
static struct run run;

/* Bytes that the leader told, and how far they were heard. */
static struct {
    unsigned char *data;
    size_t size, heard;
} wire;

static void speak(void *team, void *data, size_t size)
{
    (void)team;
    wire.data = realloc(wire.data, wire.size + size);
    assert_non_null(wire.data);
    memcpy(wire.data + wire.size, data, size);
    wire.size += size;
}

static void listen(void *team, void *data, size_t size)
{
    (void)team;
    assert_true(wire.heard + size <= wire.size);
    memcpy(data, wire.data + wire.heard, size);
    wire.heard += size;
}

/* A view of its own for each shot, and a photosite that is hot in all of them. */
static void put_photo(int shot, int frame)
{
    static uint16_t rgb[COUNT];
    const double seconds = pow(4, frame) / 64;
    uint64_t seed = (uint64_t)(10 * shot + frame);
    struct tiff_form form = {16, 3, COMPRESSION_ADOBE_DEFLATE, 0, false, seconds};
    char name[32];
    snprintf(name, sizeof name, "s%d_%d.tif", shot, frame);
    char *path = cap_path(folder, name);
    for (int i = 0; i < COUNT; i++) {
        int x = (i / 3 + 31 * shot) % WIDTH, y = i / 3 / WIDTH + 17 * shot;
        double rate = 2e3 * pow(10, 3.0 * x / WIDTH) * (1 + 0.2 * (y & 8)) + (i == HOT ? 3e5 : 0);
        rgb[i] = chip_expose(&chip, rate * seconds, &seed);
    }
    write_tiff(path, rgb, WIDTH, HEIGHT, &form);
    free(path);
}

static int make_capture(void **state)
{
    (void)state;
    struct error err = {0};
    if (!mkdtemp(folder))
        return -1;
    for (int s = 0; s < SHOTS; s++)
        for (int f = 0; f < FRAMES; f++)
            put_photo(s, f);
    char *path = cap_path(folder, "capture.yaml");
    FILE *file = fopen(path, "wb");
    assert_non_null(file);
    fputs("goniocam: 1\nphotos: {pattern: \"s*.tif\"}\n", file);
    fclose(file);
    free(path);
    cap_run_begin(&run, 1, true);
    enum status status = cap_capture_read(&capture, folder, &run, &err);
    if (status)
        fprintf(stderr, "%s\n", err.text);
    return status ? -1 : 0;
}

static void remove_photographs(void)
{
    char command[80];
    snprintf(command, sizeof command, "rm -rf '%s'", folder);
    assert_int_equal(system(command), 0);
}

static int end(void **state)
{
    (void)state;
    remove_photographs();
    cap_capture_free(&capture);
    cap_run_end(&run);
    free(wire.data);
    return 0;
}

static void join_team(bool leads)
{
    run.tell = leads ? speak : listen;
    run.follows = !leads;
    wire.heard = 0;
    wire.size = leads ? 0 : wire.size;
}

static enum status learn(struct lessons *lessons, bool *left_out, enum status failed,
                         struct error *err)
{
    return lessons_learn(lessons, left_out, &capture, folder, failed, &run, err);
}

static void test_a_failure_is_everyones(void **state)
{
    (void)state;
    struct lessons a = {0}, b = {0};
    bool left_out[SHOTS * FRAMES] = {false};
    struct error err = {STATUS_IO, "the disk is gone"}, heard = {0};
    join_team(true);
    assert_int_equal(learn(&a, left_out, STATUS_IO, &err), STATUS_IO);
    join_team(false);
    assert_int_equal(learn(&b, left_out, STATUS_OK, &heard), STATUS_IO);
    assert_string_equal(heard.text, "the disk is gone");
    assert_int_equal(wire.heard, wire.size);
    lessons_free(&a, capture.cameras);
    lessons_free(&b, capture.cameras);
}

static void test_who_follows_knows_the_same(void **state)
{
    (void)state;
    struct lessons a = {0}, b = {0};
    bool left_out[2][SHOTS * FRAMES] = {{false}};
    struct error err = {0};
    join_team(true);
    assert_int_equal(learn(&a, left_out[0], STATUS_OK, &err), STATUS_OK);
    assert_near(a.learned[0].sensor.black[1], chip.black, 0.5);
    remove_photographs();
    join_team(false);
    assert_int_equal(learn(&b, left_out[1], STATUS_OK, &err), STATUS_OK);
    assert_int_equal(wire.heard, wire.size);
    assert_memory_equal(&a.learned[0].sensor, &b.learned[0].sensor, sizeof a.learned[0].sensor);
    assert_memory_equal(a.seconds, b.seconds, SHOTS * FRAMES * sizeof *a.seconds);
    assert_memory_equal(left_out[0], left_out[1], sizeof left_out[0]);
    const struct evenness *own = &a.frames[0].defects.sites, *told = &b.frames[0].defects.sites;
    assert_int_equal(own->defects, 1);
    assert_int_equal(own->defect[0], HOT);
    assert_int_equal(told->defects, 1);
    assert_int_equal(told->defect[0], HOT);
    lessons_free(&a, capture.cameras);
    lessons_free(&b, capture.cameras);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_a_failure_is_everyones),
        cmocka_unit_test(test_who_follows_knows_the_same),
    };
    return cmocka_run_group_tests(tests, make_capture, end);
}
