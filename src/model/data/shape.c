/* SPDX-License-Identifier: BSD-3-Clause */
/* Mass properties of shapes in closed form, as numbers that follow the parameters. A shape has its radii of gyration
 * squared about its centre, times its mass; several are added by the theorem of parallel axes. Moments of solids:
 * Goldstein, Poole, Safko, Classical Mechanics (2002), chapter 5; of a hemisphere: Greenwood, Principles of Dynamics
 * (1988), appendix A. */
#include "model/data/shape.h"
#include "model/language/number_algebra.h"
#include <stdlib.h>
#include <string.h>

const char *const kmp_shape_words[KMP_SHAPE_KINDS] = {
#define KMP_SHAPE(kind, word, keys) #word,
#include "model/data/shape_kinds.def"
#undef KMP_SHAPE
};

const char *const kmp_shape_more[KMP_SHAPE_KINDS] = {
#define KMP_SHAPE(kind, word, keys) keys,
#include "model/data/shape_kinds.def"
#undef KMP_SHAPE
};

static const struct colour {
    const char *name;
    int rgb;
} colours[] = {
#define KMP_COLOUR(name, rgb) {#name, rgb},
#include "model/data/colours.def"
#undef KMP_COLOUR
};

const kmp_name_list kmp_colour_names = {colours, sizeof *colours, sizeof colours / sizeof *colours};

int kmp_colour_find(const char *text)
{
    int found = kmp_name_find(kmp_colour_names, text);
    bool digits = text[0] == '#' && strspn(text + 1, "0123456789abcdefABCDEF") == 6 && text[7] == '\0';
    return found >= 0 ? colours[found].rgb : digits ? (int)strtol(text + 1, NULL, 16) : -1;
}

static const double pi = 3.14159265358979323846;
static const int row[6] = {0, 1, 2, 0, 0, 1}, column[6] = {0, 1, 2, 1, 2, 2}; /* of kmp_body.inertia */

static kmp_number plus(kmp_arena *a, kmp_number x, kmp_number y)
{
    return kmp_number_add(a, x, y);
}

static kmp_number times(kmp_arena *a, kmp_number x, kmp_number y)
{
    return kmp_number_times(a, x, y);
}

static kmp_number square(kmp_arena *a, kmp_number x)
{
    return kmp_number_times(a, x, x);
}

/* x + factor y */
static kmp_number plus_scaled(kmp_arena *a, kmp_number x, double factor, kmp_number y)
{
    return kmp_number_add(a, x, kmp_number_scale(a, factor, y));
}

/* Entry k of d.d E - d d', the inertia of a unit of mass at d. */
static kmp_number spread(kmp_arena *a, const kmp_number d[3], int k)
{
    if (k >= 3)
        return kmp_number_scale(a, -1, times(a, d[row[k]], d[column[k]]));
    return plus(a, square(a, d[(k + 1) % 3]), square(a, d[(k + 2) % 3]));
}

/* -- a shape ----------------------------------------------------------------------------------------- */

/* Volume, and the squared radii of gyration: of a body of revolution about its axis and across it, of any other the
 * entries in its own axes. */
typedef struct gyration {
    kmp_number volume, axial, transverse, entry[6];
    kmp_number centre[3]; /* in its own axes, from where it is put */
    bool revolves;
} gyration;

static gyration of_box(kmp_arena *a, const kmp_shape *s)
{
    const kmp_number *e = s->edge;
    gyration g = {.volume = times(a, times(a, e[0], e[1]), e[2])};
    for (int k = 0; k < 3; k++)
        g.entry[k] = kmp_number_over(a, spread(a, e, k), (kmp_number){.value = 12});
    return g;
}

static gyration of_ellipsoid(kmp_arena *a, const kmp_shape *s)
{
    const kmp_number *r = s->edge;
    gyration g = {.volume = kmp_number_scale(a, 4 * pi / 3, times(a, times(a, r[0], r[1]), r[2]))};
    for (int k = 0; k < 3; k++)
        g.entry[k] = kmp_number_scale(a, 0.2, spread(a, r, k));
    return g;
}

static gyration of_sphere(kmp_arena *a, const kmp_shape *s)
{
    kmp_number r2 = square(a, s->radius), k2 = kmp_number_scale(a, 0.4, r2);
    return (gyration){.volume = kmp_number_scale(a, 4 * pi / 3, times(a, r2, s->radius)), .entry = {k2, k2, k2}};
}

static gyration of_cylinder(kmp_arena *a, const kmp_shape *s)
{
    kmp_number r2 = square(a, s->radius);
    kmp_number l2 = kmp_number_over(a, square(a, s->length), (kmp_number){.value = 12});
    return (gyration){.volume = times(a, kmp_number_scale(a, pi, r2), s->length),
                      .axial = kmp_number_scale(a, 0.5, r2),
                      .transverse = plus_scaled(a, l2, 0.25, r2),
                      .revolves = true};
}

/* The centres of its hemispheres are 3 r / 8 beyond the ends of the cylinder. */
static gyration of_capsule(kmp_arena *a, const kmp_shape *s)
{
    gyration rod = of_cylinder(a, s), ball = of_sphere(a, s), g = {.revolves = true};
    kmp_number l2 = kmp_number_scale(a, 0.25, square(a, s->length)), rl = times(a, s->radius, s->length);
    kmp_number across = plus(a, ball.entry[0], plus_scaled(a, l2, 0.375, rl));
    g.volume = plus(a, rod.volume, ball.volume);
    kmp_number part = kmp_number_over(a, ball.volume, g.volume), rest = kmp_number_over(a, rod.volume, g.volume);
    g.axial = plus(a, times(a, rest, rod.axial), times(a, part, ball.entry[0]));
    g.transverse = plus(a, times(a, rest, rod.transverse), times(a, part, across));
    return g;
}

static gyration of_mesh(kmp_arena *a, const kmp_shape *s)
{
    const kmp_mesh_volume *e = &s->enclosed;
    kmp_number s2 = square(a, s->scale);
    gyration g = {.volume = kmp_number_scale(a, e->volume, times(a, s2, s->scale))};
    for (int k = 0; k < 3; k++)
        g.centre[k] = kmp_number_scale(a, e->centre[k], s->scale);
    for (int k = 0; k < 6; k++)
        g.entry[k] = kmp_number_scale(a, e->inertia[k] / e->volume, s2);
    return g;
}

/* Entry k of transverse (E - u u') + axial u u'. */
static kmp_number turned_by_axis(kmp_arena *a, const gyration *g, const kmp_number u[3], int k)
{
    kmp_number uu = times(a, u[row[k]], u[column[k]]);
    kmp_number rest = kmp_number_subtract(a, (kmp_number){.value = k < 3}, uu);
    return plus(a, times(a, g->transverse, rest), times(a, g->axial, uu));
}

/* Entry k of R I R'. */
static kmp_number turned_by_axes(kmp_arena *a, const kmp_number entry[6], double (*const r)[3], int k)
{
    static const int at[3][3] = {{0, 3, 4}, {3, 1, 5}, {4, 5, 2}};
    kmp_number sum = {.value = 0};
    for (int i = 0; i < 9; i++)
        sum = plus_scaled(a, sum, r[row[k]][i / 3] * r[column[k]][i % 3], entry[at[i / 3][i % 3]]);
    return sum;
}

static void of_solid(kmp_arena *a, const kmp_shape *s, kmp_mass_part *part)
{
    static gyration (*const of[])(kmp_arena *, const kmp_shape *) = {
        [KMP_SHAPE_BOX] = of_box,           [KMP_SHAPE_SPHERE] = of_sphere,   [KMP_SHAPE_ELLIPSOID] = of_ellipsoid,
        [KMP_SHAPE_CYLINDER] = of_cylinder, [KMP_SHAPE_CAPSULE] = of_capsule, [KMP_SHAPE_MESH] = of_mesh};
    gyration g = of[s->kind](a, s);
    double axes[3][3];
    memcpy(axes, s->axes, sizeof axes);
    part->mass = s->by_density ? times(a, s->matter, g.volume) : s->matter;
    memcpy(part->com, s->at, sizeof part->com);
    for (int k = 0; k < 3; k++)
        for (int i = 0; i < 3; i++)
            part->com[k] = plus_scaled(a, part->com[k], axes[k][i], g.centre[i]);
    for (int k = 0; k < 6; k++) {
        kmp_number entry = g.revolves  ? turned_by_axis(a, &g, s->along, k)
                           : s->turned ? turned_by_axes(a, g.entry, axes, k)
                                       : g.entry[k];
        part->inertia[k] = times(a, part->mass, entry);
    }
}

/* -- sums -------------------------------------------------------------------------------------------- */

/* Centres are taken from the centre of the first part, so that a distant origin costs no digits. */
static void add_up(kmp_arena *a, int count, const kmp_mass_part *parts, kmp_mass_part *sum)
{
    kmp_number first[3] = {{.value = 0}};
    *sum = parts[0];
    for (int i = 1; i < count; i++) {
        kmp_number d[3];
        for (int k = 0; k < 3; k++) {
            d[k] = kmp_number_subtract(a, parts[i].com[k], parts[0].com[k]);
            first[k] = plus(a, first[k], times(a, parts[i].mass, d[k]));
        }
        sum->mass = plus(a, sum->mass, parts[i].mass);
        for (int k = 0; k < 6; k++)
            sum->inertia[k] =
                plus(a, plus(a, sum->inertia[k], parts[i].inertia[k]), times(a, parts[i].mass, spread(a, d, k)));
    }
    if (count == 1)
        return;
    for (int k = 0; k < 3; k++) {
        first[k] = kmp_number_over(a, first[k], sum->mass);
        sum->com[k] = plus(a, parts[0].com[k], first[k]);
    }
    for (int k = 0; k < 6; k++)
        sum->inertia[k] = kmp_number_subtract(a, sum->inertia[k], times(a, sum->mass, spread(a, first, k)));
}

static void middle_of(kmp_arena *a, const kmp_number from[3], const kmp_number to[3], kmp_number way[3],
                      kmp_number middle[3])
{
    for (int k = 0; k < 3; k++) {
        way[k] = kmp_number_subtract(a, to[k], from[k]);
        middle[k] = kmp_number_scale(a, 0.5, plus(a, from[k], to[k]));
    }
}

/* The parts of a line are thin rods whose masses are as their lengths. */
static void of_line(kmp_arena *a, const kmp_shape *s, kmp_mass_part *sum)
{
    int count = s->through_count - 1;
    kmp_mass_part *parts = KMP_ARENA_NEW(a, kmp_mass_part, count);
    kmp_number *length = KMP_ARENA_NEW(a, kmp_number, count), way[3], whole = {.value = 0};
    if (!parts || !length)
        return;
    for (int i = 0; i < count; i++) {
        middle_of(a, s->through[i], s->through[i + 1], way, parts[i].com);
        length[i] = kmp_number_root(a, plus(a, plus(a, square(a, way[0]), square(a, way[1])), square(a, way[2])));
        whole = plus(a, whole, length[i]);
    }
    for (int i = 0; i < count; i++) {
        middle_of(a, s->through[i], s->through[i + 1], way, parts[i].com);
        parts[i].mass = count > 1 ? times(a, s->matter, kmp_number_over(a, length[i], whole)) : s->matter;
        for (int k = 0; k < 6; k++)
            parts[i].inertia[k] =
                times(a, kmp_number_over(a, parts[i].mass, (kmp_number){.value = 12}), spread(a, way, k));
    }
    add_up(a, count, parts, sum);
}

void kmp_shapes_mass(kmp_arena *arena, int count, const kmp_shape *shapes, kmp_mass_part *sum)
{
    kmp_mass_part *parts = KMP_ARENA_NEW(arena, kmp_mass_part, count);
    int heavy = 0;
    for (int i = 0; parts && i < count; i++) {
        if (!shapes[i].heavy)
            continue;
        kmp_mass_part *part = &parts[heavy++];
        (shapes[i].kind == KMP_SHAPE_LINE ? of_line : of_solid)(arena, &shapes[i], part);
        if (shapes[i].hole)
            part->mass = kmp_number_scale(arena, -1, part->mass);
        for (int k = 0; k < 6 && shapes[i].hole; k++)
            part->inertia[k] = kmp_number_scale(arena, -1, part->inertia[k]);
    }
    if (heavy > 0)
        add_up(arena, heavy, parts, sum);
}
