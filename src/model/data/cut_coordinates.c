/* SPDX-License-Identifier: BSD-3-Clause */
/* A turn about a is that of any vector across a. In a chain Ra Rb the second axis b turns by the first angle about a,
 * and the first axis a by the second about b; in Ra Rb Rc the components of c across a turn by the first angle, those
 * of a across c by the third, and the sine of the second is the product of a on the first body and c on the second. */
#include "model/data/cut_coordinates.h"
#include "model/data/model.h"
#include "model/language/expression_references.h"
#include <stdio.h>
#include <string.h>

/* Axis k of the chain on the first or the second body. */
static kmp_measure_argument axis_on(kmp_arena *arena, const kmp_measure_argument *end, double m[3][3], int k)
{
    double *e = KMP_ARENA_NEW(arena, double, 3);
    kmp_measure_argument argument = *end;
    for (int i = 0; e && i < 3; i++)
        e[i] = m[i][k];
    argument.along = e;
    return argument;
}

static const kmp_expr *make(kmp_arena *arena, kmp_expr expr)
{
    kmp_expr *made = KMP_ARENA_NEW(arena, kmp_expr, 1);
    if (made)
        *made = expr;
    return made;
}

static const kmp_expr *number(kmp_arena *arena, double value)
{
    return make(arena, (kmp_expr){.kind = KMP_EXPR_NUMBER, .value = value});
}

/* The angle from u on the first body to u on the second about w, both axes of the chain. */
static const kmp_expr *turn(kmp_arena *arena, const kmp_measure_argument end[2], double m[3][3], int u, int w, int side)
{
    const kmp_measure_argument axes[] = {axis_on(arena, &end[0], m, u), axis_on(arena, &end[1], m, u),
                                         axis_on(arena, &end[side], m, w)};
    return kmp_expr_measure(arena, KMP_MEASURE_ANGLE, 3, axes);
}

/* pi/2 less the angle between a on the first body and c on the second. */
static const kmp_expr *rise(kmp_arena *arena, const kmp_measure_argument end[2], double m[3][3])
{
    const kmp_measure_argument axes[] = {axis_on(arena, &end[0], m, 0), axis_on(arena, &end[1], m, 2)};
    const kmp_expr *right = number(arena, 1.57079632679489661923);
    return make(arena,
                (kmp_expr){.kind = KMP_EXPR_SUB, .a = right, .b = kmp_expr_measure(arena, KMP_MEASURE_ANGLE, 2, axes)});
}

/* The way of the second point along axis k of the first body. */
static const kmp_expr *slide(kmp_arena *arena, const kmp_measure_argument end[2], double m[3][3], int k)
{
    const kmp_measure_argument points[] = {end[1], end[0]};
    const kmp_expr *sum = NULL;
    for (int i = 0; i < 3; i++) {
        const kmp_expr *place = kmp_expr_measure(arena, KMP_MEASURE_POSITION, 2, points), *part = NULL;
        if (m[i][k] == 0 || !place)
            continue;
        kmp_expr component = *place;
        component.number = i;
        part = make(arena, (kmp_expr){.kind = KMP_EXPR_MUL, .a = number(arena, m[i][k]), .b = make(arena, component)});
        sum = sum ? make(arena, (kmp_expr){.kind = KMP_EXPR_ADD, .a = sum, .b = part}) : part;
    }
    return sum;
}

const kmp_expr *kmp_cut_coordinate_of(kmp_arena *arena, const char *name, const char *chain, int k, double m[3][3],
                                      const kmp_measure_argument end[2])
{
    int turns = 0, before = 0;
    for (int i = 0; chain[2 * i]; i++) {
        turns += chain[2 * i] == 'R';
        before += chain[2 * i] == 'R' && i < k;
    }
    const kmp_expr *value = chain[2 * k] == 'T' ? slide(arena, end, m, chain[2 * k + 1] - 'a')
                            : turns == 1        ? turn(arena, end, m, 1, 0, 0)
                            : turns == 2        ? turn(arena, end, m, 1 - before, before, before)
                            : before == 1       ? rise(arena, end, m)
                                                : turn(arena, end, m, 2 - before, before, before / 2);
    kmp_measure *written = KMP_ARENA_NEW(arena, kmp_measure, 1);
    if (!value || !written)
        return NULL;
    *written = (kmp_measure){.kind = KMP_MEASURE_KINDS, .word = "q", .components = 1, .count = 1};
    written->argument[0] = (kmp_measure_argument){.point = -1, .axis = -1, .name = name};
    return make(arena, (kmp_expr){.kind = KMP_EXPR_CUT, .a = value, .measure = written});
}

int kmp_cut_coordinate_find(const kempe_model *model, const char *name)
{
    int found = kmp_name_find(KMP_NAMED(model, cut_coordinate), name);
    const char *dot = strrchr(name, '.');
    for (int k = 0; dot && found < 0 && k < model->cut_coordinate_count; k++) {
        const kmp_cut_coordinate *c = &model->cut_coordinates[k];
        char digits[16];
        snprintf(digits, sizeof digits, "%d", c->number);
        size_t length = strlen(c->joint);
        if (length == (size_t)(dot - name) && strncmp(c->joint, name, length) == 0 && strcmp(dot + 1, digits) == 0)
            found = k;
    }
    return found;
}
