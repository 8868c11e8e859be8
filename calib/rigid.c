/* rigid.c -- rigid motions of tags: least squares over their corners and normals. */
#include "rigid.h"

#include "solid.h"

mat3 rigid_nearest_rotation(const mat3 *m)
{
    mat3 x = *m;
    for (int round = 0; round < 60; round++) {
        mat3 next;
        double change = 0, det = 0;
        for (int i = 0; i < 3; i++)
            for (int j = 0; j < 3; j++) {  // the cofactor: det times the inverse transposed
                int a = (i + 1) % 3, b = (i + 2) % 3, c = (j + 1) % 3, d = (j + 2) % 3;
                next.m[i][j] = x.m[a][c] * x.m[b][d] - x.m[a][d] * x.m[b][c];
            }
        for (int j = 0; j < 3; j++)
            det += x.m[0][j] * next.m[0][j];
        for (int i = 0; i < 3; i++)
            for (int j = 0; j < 3; j++) {
                next.m[i][j] = 0.5 * (x.m[i][j] + next.m[i][j] / det);
                change = fmax(change, fabs(next.m[i][j] - x.m[i][j]));
            }
        x = next;
        if (change < 1e-15)
            break;
    }
    return x;
}

static vec3 normal_of(const struct tag_place *tag)
{
    return vec3_cross(tag->x_axis, tag->y_axis);
}

static void add_pair(mat3 *m, vec3 from, vec3 to)
{
    const double a[3] = {from.x, from.y, from.z}, b[3] = {to.x, to.y, to.z};
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++)
            m->m[i][j] += b[i] * a[j];
}

static bool tells(const struct tag_place *from, const struct tag_place *to)
{
    return !to->unplaced && bundle_placed(from) && bundle_placed(to);
}

pose rigid_motion(const struct tag_place *from, const struct tag_place *to, int tags)
{
    vec3 from_middle = {0, 0, 0}, to_middle = {0, 0, 0};
    int n = 0;
    for (int i = 0; i < tags; i++)
        if (tells(from + i, to + i)) {
            from_middle = vec3_add(from_middle, from[i].center);
            to_middle = vec3_add(to_middle, to[i].center);
            n++;
        }
    from_middle = vec3_scale(from_middle, 1 / fmax(n, 1));
    to_middle = vec3_scale(to_middle, 1 / fmax(n, 1));
    mat3 m = {{{0}}};
    for (int i = 0; i < tags; i++) {
        if (!tells(from + i, to + i))
            continue;
        double length = to[i].size;
        for (int k = 0; k < 4; k++)
            add_pair(&m, vec3_sub(cap_tag_corner(from + i, k), from_middle),
                     vec3_sub(cap_tag_corner(to + i, k), to_middle));
        add_pair(&m, vec3_scale(normal_of(from + i), length),
                 vec3_scale(normal_of(to + i), length));
    }
    mat3 turn = rigid_nearest_rotation(&m);
    return (pose){cal_rotation_vector(&turn), vec3_sub(to_middle, mat3_mul(&turn, from_middle))};
}

struct tag_place rigid_move(const struct tag_place *tag, const mat3 *rotation, vec3 translation)
{
    struct tag_place moved = *tag;
    moved.center = vec3_add(mat3_mul(rotation, tag->center), translation);
    moved.x_axis = mat3_mul(rotation, tag->x_axis);
    moved.y_axis = mat3_mul(rotation, tag->y_axis);
    return moved;
}

pose rigid_inverse(pose motion)
{
    mat3 r = cal_rotation(motion.rotation);
    return (pose){vec3_scale(motion.rotation, -1),
                  vec3_scale(mat3_mul_t(&r, motion.translation), -1)};
}

pose rigid_chain(pose first, pose second)
{
    mat3 a = cal_rotation(first.rotation), b = cal_rotation(second.rotation), both;
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++) {
            both.m[i][j] = 0;
            for (int k = 0; k < 3; k++)
                both.m[i][j] += b.m[i][k] * a.m[k][j];
        }
    return (pose){cal_rotation_vector(&both),
                  vec3_add(mat3_mul(&b, first.translation), second.translation)};
}
