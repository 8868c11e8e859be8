/* test_layout.c -- boards that nobody measured, or measured badly: places, sizes and focal lengths
 * from synthetic sightings of known truth and noise. */
#include "layout.h"
#include "board_scene.h"
#include "rigid.h"
#include "start.h"
#include "tag_trouble.h"
#include "zoom.h"

static struct tag_place given[TAGS], truth[TAGS];
static double sigma_place[TAGS][6];

/** The scene of board_scene.h, whose bundle may move tags. */
static void make_free(struct scene *s, double sigma_px, uint64_t first_seed)
{
    make_scene(s, sigma_px, first_seed);
    memcpy(truth, places, sizeof truth);
    memcpy(given, places, sizeof given);
    s->bundle.given = given;
    s->bundle.sigma_place = sigma_place;
}

static void adjust(struct scene *s)
{
    struct error err = {0};
    if (bundle_adjust(&s->bundle, BUNDLE_FOCAL, &err) || start_poses_again(&s->bundle, &err)
        || bundle_adjust(&s->bundle, BUNDLE_LENS, &err)
        || bundle_adjust(&s->bundle, BUNDLE_CHOOSE, &err))
        fail_msg("%s", err.text);
}

/** Forget where the tags from `first` on are, lay the board out again, and adjust. */
static void lay_out(struct scene *s, int first)
{
    struct error err = {0};
    bool posed[VIEWS];
    for (int i = first; i < TAGS; i++) {
        places[i].unplaced = true;
        places[i].center = (vec3){NAN, 0, 0};
    }
    if (layout_start(&s->bundle, posed, &err))
        fail_msg("%s", err.text);
    for (int v = 0; v < VIEWS; v++)
        assert_true(posed[v]);
    memcpy(given, places, sizeof given);
    adjust(s);
}

/** Root mean square distance of corners from the truth, mm, `motion` applied first. */
static double off(pose motion)
{
    mat3 r = cal_rotation(motion.rotation);
    double sum = 0;
    for (int i = 0; i < TAGS; i++) {
        struct tag_place moved = rigid_move(places + i, &r, motion.translation);
        for (int k = 0; k < 4; k++) {
            vec3 d = vec3_sub(cap_tag_corner(&moved, k), cap_tag_corner(truth + i, k));
            sum += vec3_dot(d, d);
        }
    }
    return sqrt(sum / (4 * TAGS));
}

// 0.02 px at 500 mm and 1500 px of focal length are 0.007 mm; ten views and slanted lines of sight
// make that 0.005 to 0.01 mm across and along.
static const double enough_mm = 0.03;

static void test_a_board_of_one_tag_size(void **state)
{
    (void)state;
    struct scene s;
    make_free(&s, 0.02, 3);
    lay_out(&s, 0);
    assert_near(vec3_length(places[0].center), 0, 1e-12);  // the lowest id begins the world
    assert_near(places[0].x_axis.x, 1, 1e-12);
    for (int i = 0; i < TAGS; i++)
        assert_true(bundle_placed(places + i));
    assert_near(off(rigid_motion(places, truth, TAGS)), 0, enough_mm);
    assert_near(s.camera.focal[0], 1500, 4 * s.camera.sigma_focal[0]);
    assert_true(s.camera.sigma_focal[0] < 2);
}

static void test_measured_tags_say_where_the_world_is(void **state)
{
    (void)state;
    struct scene s;
    make_free(&s, 0.02, 4);
    lay_out(&s, 3);
    for (int i = 0; i < 3; i++) {
        assert_near(vec3_length(vec3_sub(places[i].center, truth[i].center)), 0, 1e-12);
        assert_near(sigma_place[i][3], 0, 0);
    }
    assert_near(off((pose){{0, 0, 0}, {0, 0, 0}}), 0, 2 * enough_mm);
    for (int i = 3; i < TAGS; i++)
        for (int k = 3; k < 6; k++)
            assert_true(sigma_place[i][k] > 0 && sigma_place[i][k] < 0.1);
}

// Of 13 free tags x 3 numbers in 12 scenes, whose errors are shared by about half of the tags.
static void test_sigmas_of_places_are_true(void **state)
{
    (void)state;
    enum { SCENES = 12 };
    double sum = 0;
    for (int n = 0; n < SCENES; n++) {
        struct scene s;
        make_free(&s, 0.02, 50 + (uint64_t)n);
        lay_out(&s, 1);
        for (int i = 1; i < TAGS; i++) {
            vec3 e = vec3_sub(places[i].center, truth[i].center);
            const double error[3] = {e.x, e.y, e.z};
            for (int k = 0; k < 3; k++)
                sum += error[k] * error[k] / (sigma_place[i][3 + k] * sigma_place[i][3 + k]);
        }
    }
    assert_near(sum / (3 * (TAGS - 1) * SCENES), 1, 0.4);
}

/** Tags that stand `mm` away from where the board's list has them. */
static void misplace_all(double mm)
{
    for (int i = 0; i < TAGS; i++) {
        places[i].center.x += mm * normal();
        places[i].center.y += mm * normal();
    }
    memcpy(given, places, sizeof given);
}

static void test_places_are_adjusted_when_wanted(void **state)
{
    (void)state;
    struct scene s;
    double share;
    make_free(&s, 0.02, 5);
    assert_int_equal(start_cameras(&s.bundle, NULL), STATUS_OK);
    adjust(&s);
    assert_int_equal(bundle_places_share(&s.bundle, &share, NULL), STATUS_OK);
    assert_true(share < 0.2);  // the board is as it is said to be

    make_free(&s, 0.02, 6);
    misplace_all(0.3);
    assert_int_equal(start_cameras(&s.bundle, NULL), STATUS_OK);
    adjust(&s);
    assert_int_equal(bundle_places_share(&s.bundle, &share, NULL), STATUS_OK);
    assert_true(share > 0.8);
    s.bundle.place_sigma = 0.3;
    adjust(&s);
    // The size of the tags holds the scale; where the board lies, 14 tags say to 0.3 / sqrt(14).
    assert_near(off(rigid_motion(places, truth, TAGS)), 0, enough_mm);
    assert_near(off((pose){{0, 0, 0}, {0, 0, 0}}), 0, 0.35);
}

/** What tag_trouble says of tag 5 once the others have fixed the cameras. */
static void trouble(struct scene *s, char *text, size_t room)
{
    assert_int_equal(start_cameras(&s->bundle, NULL), STATUS_OK);
    adjust(s);
    int rejected = 0;
    for (int i = 0; i < s->bundle.sightings; i++)
        rejected += s->sighting[i].place == 5 && s->sighting[i].rejected;
    assert_true(rejected >= VIEWS - 1);
    tag_trouble(&s->bundle, 5, text, room);
}

static void test_tags_that_are_wrong_are_described(void **state)
{
    (void)state;
    struct scene s;
    char text[200];
    make_free(&s, 0.02, 8);
    places[5].size = 25;
    trouble(&s, text, sizeof text);
    assert_string_equal(text, "is 24.00 mm wide, not 25.00 as capture.yaml says");

    make_free(&s, 0.02, 9);
    places[5].center.x += 2;
    trouble(&s, text, sizeof text);
    assert_non_null(strstr(text, "2.00 mm from where capture.yaml says"));
    assert_false(tag_in_place(&s.bundle, 5));

    make_free(&s, 0.02, 10);
    places[5].x_axis = (vec3){0, 1, 0};
    places[5].y_axis = (vec3){-1, 0, 0};
    trouble(&s, text, sizeof text);
    assert_non_null(strstr(text, "turned by 90 degrees"));

    make_free(&s, 0.02, 11);
    for (int i = 0; i < s.bundle.sightings; i++)  // after half of the photographs, to the right
        for (int k = 0; k < 4 && s.sighting[i].place == 5; k++)
            s.sighting[i].corner[k][0] += s.sighting[i].view < VIEWS / 2 ? -25 : 25;
    trouble(&s, text, sizeof text);
    assert_non_null(strstr(text, "moved between the photographs"));
}

// Photographs so good that a twentieth of a pixel shows: uneven light does that to a tag.
static void test_a_tag_that_hardly_strays_is_in_its_place(void **state)
{
    (void)state;
    struct scene s;
    make_free(&s, 0.002, 13);
    places[5].center.x += 0.02;  // about 0.04 px
    assert_int_equal(start_cameras(&s.bundle, NULL), STATUS_OK);
    adjust(&s);
    assert_true(tag_in_place(&s.bundle, 5));
    places[5].center.x += 0.2;
    assert_false(tag_in_place(&s.bundle, 5));
    for (int i = 0; i < s.bundle.sightings; i++)  // a shadow's rim across it may do that
        s.sighting[i].covered = 0.09;
    assert_true(tag_in_place(&s.bundle, 5));
    places[5].center.x += 2;
    assert_false(tag_in_place(&s.bundle, 5));
}

static void test_a_zoom_makes_two_cameras(void **state)
{
    (void)state;
    struct scene s;
    struct run run = {.threads = 1, .mute = true};
    struct camera *cameras = calloc(1, sizeof *cameras);
    make_free(&s, 0.1, 12);
    for (int v = VIEWS / 2; v < VIEWS; v++) {  // five views through a lens of 1700 px
        struct camera zoomed = true_camera;
        zoomed.focal[0] = zoomed.focal[1] = 1700;
        for (int i = 0; i < TAGS; i++) {
            struct sighting *seen = s.sighting + v * TAGS + i;
            for (int k = 0; k < 4; k++)
                cal_project(&zoomed, cal_to_view(true_pose[v], cap_tag_corner(places + i, k)),
                            seen->corner[k]);
        }
    }
    *cameras = s.camera;
    cameras->name = strdup("a");
    s.calibration.camera = cameras;
    assert_int_equal(start_cameras(&s.bundle, NULL), STATUS_OK);
    assert_int_equal(bundle_adjust(&s.bundle, BUNDLE_FOCAL, NULL), STATUS_OK);
    assert_int_equal(bundle_adjust(&s.bundle, BUNDLE_LENS, NULL), STATUS_OK);
    assert_int_equal(zoom_split(&s.bundle, &run, NULL), STATUS_OK);
    assert_int_equal(s.calibration.cameras, 2);
    for (int v = 0; v < VIEWS; v++)
        assert_int_equal(s.view[v].camera == s.view[0].camera, v < VIEWS / 2);
    adjust(&s);
    cameras = s.calibration.camera;
    for (int k = 0; k < 2; k++) {
        bool first = k == s.view[0].camera;
        assert_near(cameras[k].focal[0], first ? 1500 : 1700, 5 * cameras[k].sigma_focal[0]);
        free(cameras[k].name);
    }
    free(cameras);
    cap_run_end(&run);
}

static void test_given_intrinsics_are_held_or_weighed(void **state)
{
    (void)state;
    struct scene s;
    struct lens_prior prior = {0};
    make_free(&s, 0.02, 13);
    s.bundle.prior = &prior;
    s.camera = true_camera;
    lens_to_array(prior.value, &true_camera);
    memset(prior.sigma, 0, sizeof prior.sigma);
    assert_int_equal(start_cameras(&s.bundle, NULL), STATUS_OK);
    adjust(&s);
    assert_near(s.camera.focal[0], 1500, 0);
    assert_near(s.camera.distortion[1], 0.05, 0);
    assert_near(s.camera.sigma_focal[0], 0, 0);
    double held = s.view[0].sigma_translation[2];

    for (int k = 0; k < LENS_PARAMETERS; k++)
        prior.sigma[k] = INFINITY;
    prior.sigma[0] = prior.sigma[1] = 0.05;  // sharper than what the views say, about 0.2
    prior.value[0] = 1500.05;
    adjust(&s);
    assert_near(s.camera.focal[0], 1500.05, 0.15);
    assert_true(s.camera.sigma_focal[0] > 0.02 && s.camera.sigma_focal[0] <= 0.051);
    assert_true(s.view[0].sigma_translation[2] > held);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_a_board_of_one_tag_size),
        cmocka_unit_test(test_measured_tags_say_where_the_world_is),
        cmocka_unit_test(test_sigmas_of_places_are_true),
        cmocka_unit_test(test_places_are_adjusted_when_wanted),
        cmocka_unit_test(test_tags_that_are_wrong_are_described),
        cmocka_unit_test(test_a_tag_that_hardly_strays_is_in_its_place),
        cmocka_unit_test(test_a_zoom_makes_two_cameras),
        cmocka_unit_test(test_given_intrinsics_are_held_or_weighed),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
