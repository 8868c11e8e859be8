/* EXR images of every form as photographs: the values that were put in, or one message. */
#include "photo_forms.h"

#include <openexr.h>

static struct exr_row {
    const char *name;
    const char *channel[5];  // in alphabetical order, as files have them
    int of[5];               // the colour that each holds; 3: something else
    exr_pixel_type_t type;
    int data[2], shown[2];  // where the windows begin; the data is WIDTH x HEIGHT, the image too
    int tile;               // 0: scan lines
    bool second_part;       // the image stands behind a part of depths
    const char *refused;
} exr_rows[] = {
    {"half", {"B", "G", "R"}, {2, 1, 0}, EXR_PIXEL_HALF, {0, 0}, {0, 0}, 0, false, NULL},
    {"tiles", {"B", "G", "R"}, {2, 1, 0}, EXR_PIXEL_FLOAT, {0, 0}, {0, 0}, 16, false, NULL},
    {"tiles of half, more channels",
     {"A", "B", "G", "R", "Z"},
     {3, 2, 1, 0, 3},
     EXR_PIXEL_HALF,
     {0, 0},
     {0, 0},
     32,
     false,
     NULL},
    {"windows begin elsewhere",
     {"B", "G", "R"},
     {2, 1, 0},
     EXR_PIXEL_FLOAT,
     {-7, 100},
     {-7, 100},
     0,
     false,
     NULL},
    {"the data overlaps the image",
     {"B", "G", "R"},
     {2, 1, 0},
     EXR_PIXEL_FLOAT,
     {3, 5},
     {0, 0},
     0,
     false,
     NULL},
    {"the same in tiles",
     {"B", "G", "R"},
     {2, 1, 0},
     EXR_PIXEL_HALF,
     {-3, -5},
     {0, 0},
     16,
     false,
     NULL},
    {"a layer",
     {"beauty.B", "beauty.G", "beauty.R"},
     {2, 1, 0},
     EXR_PIXEL_FLOAT,
     {0, 0},
     {0, 0},
     0,
     false,
     NULL},
    {"words", {"blue", "green", "red"}, {2, 1, 0}, EXR_PIXEL_FLOAT, {0, 0}, {0, 0}, 0, false, NULL},
    {"gray", {"Y"}, {0}, EXR_PIXEL_FLOAT, {0, 0}, {0, 0}, 0, false, NULL},
    {"one channel", {"luma"}, {0}, EXR_PIXEL_HALF, {0, 0}, {0, 0}, 0, false, NULL},
    {"the second part", {"B", "G", "R"}, {2, 1, 0}, EXR_PIXEL_FLOAT, {0, 0}, {0, 0}, 0, true, NULL},
    {"several layers",
     {"a.B", "a.G", "a.R", "b.R"},
     {2, 1, 0, 3},
     EXR_PIXEL_FLOAT,
     {0, 0},
     {0, 0},
     0,
     false,
     NULL},
    {"whole numbers",
     {"B", "G", "R"},
     {2, 1, 0},
     EXR_PIXEL_UINT,
     {0, 0},
     {0, 0},
     0,
     false,
     "no image"},
    {"no image", {"U", "V"}, {3, 3}, EXR_PIXEL_FLOAT, {0, 0}, {0, 0}, 0, false, "no image"},
};
enum { EXR_ROWS = sizeof exr_rows / sizeof *exr_rows };

static void put_window(exr_attr_box2i_t *box, const int begin[2])
{
    box->min.x = begin[0];
    box->min.y = begin[1];
    box->max.x = begin[0] + WIDTH - 1;
    box->max.y = begin[1] + HEIGHT - 1;
}

static void begin_part(exr_context_t file, const char *name, const struct exr_row *r, bool depths)
{
    int part;
    exr_attr_box2i_t data, shown;
    exr_attr_v2f_t middle;
    put_window(&data, r->data);
    put_window(&shown, r->shown);
    middle.x = middle.y = 0;
    assert_int_equal(
        exr_add_part(file, name, r->tile ? EXR_STORAGE_TILED : EXR_STORAGE_SCANLINE, &part), 0);
    assert_int_equal(exr_initialize_required_attr(file, part, &shown, &data, 1, &middle, 1,
                                                  EXR_LINEORDER_INCREASING_Y, EXR_COMPRESSION_NONE),
                     0);
    if (r->tile)
        assert_int_equal(exr_set_tile_descriptor(file, part, (uint32_t)r->tile, (uint32_t)r->tile,
                                                 EXR_TILE_ONE_LEVEL, EXR_TILE_ROUND_DOWN),
                         0);
    for (int i = 0; i < 5 && (depths ? i < 1 : r->channel[i] != NULL); i++)
        assert_int_equal(exr_add_channel(file, part, depths ? "depth.Z" : r->channel[i], r->type,
                                         EXR_PERCEPTUALLY_LINEAR, 1, 1),
                         0);
}

/* The numbers of the place in the image where one of the data window stands. */
static size_t pack_block(unsigned char *to, const struct exr_row *r, int left, int top, int columns,
                         int rows, bool depths)
{
    size_t size = 0;
    for (int y = top; y < top + rows; y++)
        for (int i = 0; i < 5 && (depths ? i < 1 : r->channel[i] != NULL); i++)
            for (int x = left; x < left + columns; x++) {
                int u = x + r->data[0] - r->shown[0], v = y + r->data[1] - r->shown[1];
                float real = (float)part_at(u + 256, v + 256, depths ? 0 : r->of[i]);
                uint16_t half = half_of((double)real);
                size_t bytes = r->type == EXR_PIXEL_HALF ? 2 : 4;
                memcpy(to + size, bytes == 2 ? (void *)&half : &real, bytes);
                size += bytes;
            }
    return size;
}

static void write_part(exr_context_t file, int part, const struct exr_row *r, bool depths)
{
    static unsigned char block[WIDTH * HEIGHT * 5 * 4];
    int columns = r->tile ? r->tile : WIDTH, rows = r->tile ? r->tile : 1;
    for (int top = 0; top < HEIGHT; top += rows)
        for (int left = 0; left < WIDTH; left += columns) {
            int wide = WIDTH - left < columns ? WIDTH - left : columns;
            int high = HEIGHT - top < rows ? HEIGHT - top : rows;
            size_t size = pack_block(block, r, left, top, wide, high, depths);
            exr_result_t result =
                r->tile ? exr_write_tile_chunk(file, part, left / columns, top / rows, 0, 0, block,
                                               size)
                        : exr_write_scanline_chunk(file, part, r->data[1] + top, block, size);
            assert_int_equal(result, 0);
        }
}

static void write_exr_form(const struct exr_row *r)
{
    exr_context_initializer_t init = EXR_DEFAULT_CONTEXT_INITIALIZER;
    exr_context_t file = NULL;
    assert_int_equal(exr_start_write(&file, path, EXR_WRITE_FILE_DIRECTLY, &init), 0);
    if (r->second_part)
        begin_part(file, "depth", r, true);
    begin_part(file, "image", r, false);
    assert_int_equal(exr_write_header(file), 0);
    if (r->second_part)
        write_part(file, 0, r, true);
    write_part(file, r->second_part, r, false);
    assert_int_equal(exr_finish(&file), 0);
}

static void test_exr(void **state)
{
    const struct exr_row *r = *state;
    struct photo info;
    write_exr_form(r);
    if (r->refused) {
        expect_refused(r->refused);
        return;
    }
    float *dn = read_all(&info);
    assert_int_equal(info.channels, 3);
    assert_int_equal(info.gray, !r->channel[1]);
    assert_int_equal(info.width, WIDTH);
    assert_int_equal(info.height, HEIGHT);
    for (int i = 0; i < 3 * PIXELS; i++) {
        int x = i / 3 % WIDTH, y = i / 3 / WIDTH;
        int u = x + r->shown[0] - r->data[0], v = y + r->shown[1] - r->data[1];
        bool there = u >= 0 && v >= 0 && u < WIDTH && v < HEIGHT;
        double due = 65535 * part_at(x + 256, y + 256, info.gray ? 0 : i % 3);
        if (there)
            assert_near((double)dn[i], due, 1e-6 * due);
        else
            assert_true(isinf(dn[i]));
    }
    free(dn);
}

int main(void)
{
    struct CMUnitTest tests[EXR_ROWS];
    int n = 0;
    for (int i = 0; i < EXR_ROWS; i++)
        tests[n++] = (struct CMUnitTest){exr_rows[i].name, test_exr, NULL, NULL, &exr_rows[i]};
    return cmocka_run_group_tests(tests, make_file, remove_file);
}
