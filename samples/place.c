/* place.c -- where the cameras stand: poses from eyes and targets, arcs and spirals. */
#include "place.h"
#include "random.h"

#include <assert.h>
#include <stdlib.h>
#include <string.h>

static const double DEG = CAP_PI / 180;

/** The rotation vector of a rotation matrix, by way of the unit quaternion whose largest part is
 *  known best (Shepperd, J. Guidance and Control, 1978). */
static vec3 rotation_vector(const double m[3][3])
{
    double trace = m[0][0] + m[1][1] + m[2][2], q[4];  // q[3] is the scalar part
    int k = 3;
    double best = trace;
    for (int i = 0; i < 3; i++)
        if (m[i][i] > best) {
            best = m[i][i];
            k = i;
        }
    if (k == 3) {
        q[3] = 1 + trace;
        q[0] = m[2][1] - m[1][2];
        q[1] = m[0][2] - m[2][0];
        q[2] = m[1][0] - m[0][1];
    } else {
        int a = (k + 1) % 3, b = (k + 2) % 3;
        q[k] = 1 + 2 * best - trace;
        q[a] = m[k][a] + m[a][k];
        q[b] = m[k][b] + m[b][k];
        q[3] = m[b][a] - m[a][b];
    }
    vec3 v = {q[0], q[1], q[2]};
    double length = vec3_length(v), angle = 2 * atan2(length, q[3]);
    if (angle > CAP_PI)
        angle -= 2 * CAP_PI;
    return length > 0 ? vec3_scale(v, angle / length) : v;
}

pose sam_look_at(vec3 eye, vec3 target, double roll)
{
    vec3 z = vec3_normalize(vec3_sub(target, eye));
    vec3 up = fabs(z.z) < 1 - 1e-12 ? (vec3){0, 0, 1} : (vec3){0, 1, 0};
    vec3 right = vec3_normalize(vec3_cross(z, up)), down = vec3_cross(z, right);
    vec3 x = vec3_sub(vec3_scale(right, cos(roll)), vec3_scale(down, sin(roll)));
    vec3 y = vec3_add(vec3_scale(right, sin(roll)), vec3_scale(down, cos(roll)));
    const double m[3][3] = {{x.x, x.y, x.z}, {y.x, y.y, y.z}, {z.x, z.y, z.z}};
    vec3 t = {-vec3_dot(x, eye), -vec3_dot(y, eye), -vec3_dot(z, eye)};
    return (pose){rotation_vector(m), t};
}

vec3 sam_around(vec3 center, double azimuth, double elevation, double distance)
{
    vec3 direction = {cos(elevation) * cos(azimuth), cos(elevation) * sin(azimuth), sin(elevation)};
    return vec3_add(center, vec3_scale(direction, distance));
}

/** How far a hand strays from where it means to be: one standard deviation. */
struct handheld {
    double place, aim, roll;  // mm, rad, rad
};

/** The shots under construction. */
struct shot_list {
    struct scene *scene;
    struct doc *doc;
    struct handheld hand;
    bool memory;  // was there enough?
};

static struct scene_shot *append(struct shot_list *list)
{
    struct scene *scene = list->scene;
    struct scene_shot *grown =
        realloc(scene->shot, (size_t)(scene->shots + 1) * sizeof *scene->shot);
    if (!grown) {
        list->memory = false;
        return NULL;
    }
    scene->shot = grown;
    grown[scene->shots] = (struct scene_shot){.power = 1};
    return &grown[scene->shots++];
}

static int read_lamp(struct shot_list *list, doc_node node)
{
    const char *name = sam_doc_text(list->doc, node, "light", list->scene->lamp[0].name);
    for (int i = 0; i < list->scene->lamps; i++)
        if (strcmp(list->scene->lamp[i].name, name) == 0)
            return i;
    sam_doc_wrong(list->doc, sam_doc_get(list->doc, node, "light"), "light: no lamp is called '%s'",
                  name);
    return 0;
}

/** A shot from `eye`, as steady as the hand is. */
static void add_look(struct shot_list *list, int lamp, vec3 eye, vec3 target, double roll)
{
    struct scene_shot *shot = append(list);
    if (!shot)
        return;
    struct random random =
        sam_random_at(list->scene->seed, 0xFFFFFFFFu, (uint64_t)list->scene->shots);
    double n[7];
    for (int i = 0; i < 7; i++)
        n[i] = sam_normal(&random);
    double distance = vec3_length(vec3_sub(target, eye));
    eye = vec3_add(eye, vec3_scale((vec3){n[0], n[1], n[2]}, list->hand.place));
    target = vec3_add(target, vec3_scale((vec3){n[3], n[4], n[5]}, list->hand.aim * distance));
    shot->view_from_world = sam_look_at(eye, target, roll + n[6] * list->hand.roll);
    shot->lamp = lamp;
}

static void read_look(struct shot_list *list, doc_node node)
{
    struct doc *doc = list->doc;
    vec3 center = list->scene->sample.nominal.center;
    vec3 target = sam_doc_vec3(doc, node, "target", center);
    vec3 eye = sam_doc_vec3(doc, node, "eye", target);
    double roll = sam_doc_number(doc, node, "roll_deg", 0, -360, 360) * DEG;
    int lamp = read_lamp(list, node);
    if (vec3_length(vec3_sub(eye, target)) > 0)
        add_look(list, lamp, eye, target, roll);
    else
        sam_doc_wrong(doc, node, "look: an eye is wanted, somewhere else than its target");
}

/** A pose as it stands, for scenes that rebuild another one. */
static void read_pose(struct shot_list *list, doc_node node)
{
    struct doc *doc = list->doc;
    int lamp = read_lamp(list, node);
    struct scene_shot *shot = append(list);
    if (!shot)
        return;
    shot->view_from_world.rotation = sam_doc_vec3(doc, node, "rotation", (vec3){0, 0, 0});
    shot->view_from_world.translation = sam_doc_vec3(doc, node, "translation", (vec3){0, 0, 0});
    shot->power = sam_doc_number(doc, node, "power", 1, 1e-3, 1e3);
    shot->lamp = lamp;
}

/** An arc (turns 0) keeps its azimuth while its elevation runs from one value to another; a spiral
 *  turns on the way. */
static void read_sweep(struct shot_list *list, doc_node node, double turns)
{
    struct doc *doc = list->doc;
    int count = sam_doc_int(doc, node, "count", 1, 1, 10000);
    vec3 target = sam_doc_vec3(doc, node, "target", list->scene->sample.nominal.center);
    double azimuth = sam_doc_number(doc, node, "azimuth_deg", 0, -720, 720) * DEG;
    double distance = sam_doc_number(doc, node, "distance", NAN, 1e-3, 1e6);
    double roll = sam_doc_number(doc, node, "roll_deg", 0, -360, 360) * DEG;
    double elevation[2] = {30, 80};
    sam_doc_numbers(doc, node, "elevation_deg", elevation, 2, true, -180, 180);
    int lamp = read_lamp(list, node);
    for (int i = 0; i < count && sam_doc_fine(doc); i++) {
        double way = count > 1 ? (double)i / (count - 1) : 0;
        double height = (elevation[0] + way * (elevation[1] - elevation[0])) * DEG;
        double turn = azimuth + 2 * CAP_PI * turns * way;
        add_look(list, lamp, sam_around(target, turn, height, distance), target, roll);
    }
}

static void read_shot(struct shot_list *list, doc_node item)
{
    struct doc *doc = list->doc;
    doc_node node;
    if ((node = sam_doc_get(doc, item, "look")))
        read_look(list, node);
    else if ((node = sam_doc_get(doc, item, "arc")))
        read_sweep(list, node, 0);
    else if ((node = sam_doc_get(doc, item, "spiral")))
        read_sweep(list, node, sam_doc_number(doc, node, "turns", 1, -100, 100));
    else if ((node = sam_doc_get(doc, item, "pose")))
        read_pose(list, node);
    else
        sam_doc_wrong(doc, item, "shots: 'look', 'arc', 'spiral' or 'pose' is wanted here");
}

bool sam_read_shots(struct scene *scene, struct doc *doc)
{
    assert(scene->lamps > 0);
    doc_node root = sam_doc_root(doc), hand = sam_doc_get(doc, root, "handheld");
    struct shot_list list = {.scene = scene, .doc = doc, .memory = true};
    list.hand.place = sam_doc_number(doc, hand, "place", 0, 0, 1e3);
    list.hand.aim = sam_doc_number(doc, hand, "aim_deg", 0, 0, 45) * DEG;
    list.hand.roll = sam_doc_number(doc, hand, "roll_deg", 0, 0, 180) * DEG;
    doc_node shots = sam_doc_need(doc, root, "shots");
    for (int i = 0; i < sam_doc_count(doc, shots) && sam_doc_fine(doc) && list.memory; i++)
        read_shot(&list, sam_doc_item(doc, shots, i));
    if (sam_doc_fine(doc) && scene->shots == 0)
        sam_doc_wrong(doc, shots, "shots: at least one is wanted");
    return list.memory;
}
