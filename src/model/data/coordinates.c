/* SPDX-License-Identifier: BSD-3-Clause */
/* Coordinates and joints by name; coordinates of joints that are cut, as functions of the coordinates of the tree. */
#include "model/data/coordinates.h"
#include "model/data/model.h"
#include "model/language/expression_references.h"
#include "model/language/nearest.h"
#include <stdio.h>
#include <string.h>

kempe_status kmp_coordinate_find(const kempe_model *model, const char *what, const char *name, size_t length,
                                 int *coordinate)
{
    kmp_arena arena = {0};
    kmp_text hint = {0};
    for (; length > 0 && strchr(" \t", *name); length--)
        name++;
    while (length > 0 && strchr(" \t", name[length - 1]))
        length--;
    const char *word = kmp_arena_printf(&arena, "%.*s", (int)length, name);
    KMP_TRY(kmp_made(model->context, word));
    kempe_status status = KEMPE_OK;
    int found = kmp_name_find(KMP_COORDINATES(model), word);
    kmp_nearest nearest = kmp_nearest_of(word, KMP_COORDINATES(model));
    if (found >= 0)
        *coordinate = found;
    else if (kmp_name_find(KMP_NAMED(model, cut), word) >= 0)
        kmp_text_put(&hint, ": the joint is cut (cut: no in the model keeps it)");
    else
        kmp_nearest_suggest(&nearest, &hint);
    if (found < 0)
        status = kmp_fail(model->context, KEMPE_E_ARGUMENT, "%s: unknown coordinate '%s'%s", what, word,
                          hint.s ? hint.s : "");
    kmp_text_free(&hint);
    kmp_arena_free(&arena);
    return status;
}

kempe_status kmp_coordinates_read(const kempe_model *model, const char *what, const char *text, int *list, int *count)
{
    *count = 0;
    for (const char *s = text; s && *s;) {
        size_t length = strcspn(s, ",");
        int k = -1;
        KMP_TRY(kmp_coordinate_find(model, what, s, length, &k));
        for (int i = 0; i < *count; i++)
            if (list[i] == k)
                return kmp_fail(model->context, KEMPE_E_ARGUMENT, "%s: coordinate '%s' is given twice", what,
                                model->motions[k].name);
        list[(*count)++] = k;
        s += length + (s[length] == ',');
    }
    return KEMPE_OK;
}

/* -- coordinates of joints that are cut -------------------------------------------------------------- */

/* A turn about a is the turn of any vector across a. In a chain Ra Rb the second axis b turns by the first angle about
 * a, and the first axis a by the second about b; in Ra Rb Rc the components of c across a turn by the first angle, the
 * components of a across c by the third, and the sine of the second is the product of a on the first body and c on the
 * second. */

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

static const kmp_expr *number(kmp_arena *arena, double value)
{
    return kmp_expr_make(arena, (kmp_expr){.kind = KMP_EXPR_NUMBER, .value = value});
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
    return kmp_expr_make(
        arena, (kmp_expr){.kind = KMP_EXPR_SUB, .a = right, .b = kmp_expr_measure(arena, KMP_MEASURE_ANGLE, 2, axes)});
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
        part = kmp_expr_make(
            arena, (kmp_expr){.kind = KMP_EXPR_MUL, .a = number(arena, m[i][k]), .b = kmp_expr_make(arena, component)});
        sum = sum ? kmp_expr_make(arena, (kmp_expr){.kind = KMP_EXPR_ADD, .a = sum, .b = part}) : part;
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
    return kmp_expr_make(arena, (kmp_expr){.kind = KMP_EXPR_CUT, .a = value, .measure = written});
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

/* -- joints by name, for their loads ----------------------------------------------------------------- */

/* The joint that a name selects for its load, and the reason if it has none. */

bool kmp_motion_is_for_load(const kempe_model *model, int motion)
{
    return motion < kmp_joint_first_free(&model->bodies[model->motions[motion].body]);
}

int kmp_joint_find(const kempe_model *model, const char *name)
{
    for (int b = 1; b < model->body_count; b++)
        if (strcmp(model->bodies[b].joint, name) == 0)
            return b;
    return -1;
}

const char *kmp_joint_obstacle(const kempe_model *model, int body)
{
    const kmp_body *b = &model->bodies[body];
    int first = kmp_joint_first_free(b), changes = 0;
    for (int k = first + 1; k < first + kmp_joint_free_count(b); k++)
        changes += model->motions[k].rotation != model->motions[k - 1].rotation;
    return kmp_joint_free_count(b) == 0
               ? "it is a weld, whose bodies are one; with 'cut: yes', or as a loop 'weld', it has a reaction"
           : changes > 1 ? "it has translations before and after a rotation"
                         : NULL;
}
