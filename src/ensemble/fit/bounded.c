/* SPDX-License-Identifier: BSD-3-Clause */
#include "ensemble/fit/bounded.h"
#include "analyses/parts/ranges.h"
#include "model/data/model_context.h"
#include "model/files/csv_reader.h"
#include <math.h>
#include <string.h>

/* -- bounds ------------------------------------------------------------------------------------------ */

static kempe_status read_bounds(const kempe_model *model, kmp_box_bounds *b, int k, const char *text)
{
    kempe_context *context = kmp_model_context(model);
    const char *upper = strchr(text, ':');
    if (!upper || strchr(upper + 1, ':'))
        return kmp_fail(context, KEMPE_E_ARGUMENT,
                        "parameter '%s': two bounds are expected, NAME:LOW:HIGH; one may be left out, NAME:LOW: or "
                        "NAME::HIGH",
                        b->name[k]);
    if (upper > text)
        KMP_TRY(kmp_range_of_variable(model, "bounds", b->name[k], text, (size_t)(upper - text), &b->lower[k]));
    if (upper[1])
        KMP_TRY(kmp_range_of_variable(model, "bounds", b->name[k], upper + 1, strlen(upper + 1), &b->upper[k]));
    if (!(b->lower[k] < b->upper[k]))
        return kmp_fail(context, KEMPE_E_ARGUMENT, "parameter '%s': the bound %g is not below %g", b->name[k],
                        b->lower[k], b->upper[k]);
    return KEMPE_OK;
}

kempe_status kmp_box_bounds_read(const kempe_model *model, const char *list, kmp_arena *arena, kmp_box_bounds *bounded)
{
    kempe_context *context = kmp_model_context(model);
    char **word = NULL;
    bounded->count = kmp_text_words(arena, list, &word);
    if (bounded->count == 0)
        return arena->failed ? kmp_fail_memory(context)
                             : kmp_fail(context, KEMPE_E_ARGUMENT,
                                        "no parameter to find is given: give names of parameters of the model, or "
                                        "start values as q.NAME and qd.NAME");
    KMP_TRY(kmp_made(context, KMP_ARENA_MAKE(arena, KMP_ROOM(char *, bounded->count, &bounded->name),
                                             KMP_ROOM(double, bounded->count, &bounded->lower, &bounded->upper))));
    for (int k = 0; k < bounded->count; k++) {
        size_t length = strcspn(word[k], ":=");
        bounded->name[k] = kmp_arena_printf(arena, "%.*s", (int)length, word[k]);
        KMP_TRY(kmp_made(context, bounded->name[k]));
        bounded->lower[k] = -INFINITY;
        bounded->upper[k] = INFINITY;
        if (word[k][length])
            KMP_TRY(read_bounds(model, bounded, k, word[k] + length + 1));
    }
    return KEMPE_OK;
}

kempe_status kmp_box_bounds_check(kempe_context *context, const kmp_box_bounds *bounded, const double *start)
{
    for (int k = 0; k < bounded->count; k++)
        if (start[k] < bounded->lower[k] || start[k] > bounded->upper[k])
            return kmp_fail(context, KEMPE_E_ARGUMENT,
                            "parameter '%s': its start %g is not between its bounds %g and %g; --set gives another "
                            "start",
                            bounded->name[k], start[k], bounded->lower[k], bounded->upper[k]);
    return KEMPE_OK;
}

/* -- another search as the start --------------------------------------------------------------------- */

typedef struct estimates {
    const kmp_box_bounds *bounded;
    int name, value, fields;
    double *start;
    bool *found; /* of each parameter */
} estimates;

static bool read_head(kmp_csv *csv, const char *line)
{
    estimates *e = csv->user;
    e->name = e->value = -1;
    for (const char *s = line; s; e->fields++) {
        kmp_csv_field field = kmp_csv_name(&s);
        if (kmp_csv_is(field, "parameter"))
            e->name = e->fields;
        else if (kmp_csv_is(field, "value"))
            e->value = e->fields;
    }
    if (e->name < 0 || e->value < 0)
        kmp_csv_complain(csv, line,
                         "columns 'parameter' and 'value' are expected, as --output of a search writes them");
    return true;
}

static bool read_estimate(kmp_csv *csv, const char *line)
{
    estimates *e = csv->user;
    int at = -1;
    kmp_csv_field value = {line, 0};
    const char *s = line;
    for (int k = 0; s && k < e->fields; k++) {
        kmp_csv_field field = kmp_csv_next(&s);
        for (int p = 0; k == e->name && p < e->bounded->count; p++)
            at = kmp_csv_is(field, e->bounded->name[p]) ? p : at;
        value = k == e->value ? field : value;
    }
    if (at >= 0 && !kmp_csv_number(csv, e->value, value, &e->start[at]))
        kmp_csv_complain(csv, value.s, "a number is expected here");
    else if (at >= 0)
        e->found[at] = true;
    kmp_csv_check_row(csv, line);
    return true;
}

static const kmp_csv_form form = {"the header line is missing; it has the columns parameter and value", NULL, read_head,
                                  read_estimate, false};

kempe_status kmp_box_bounds_read_start(kempe_context *context, const char *path, const kmp_box_bounds *bounded,
                                       double *start)
{
    kmp_arena arena = {0};
    estimates e = {.bounded = bounded, .start = start, .found = KMP_ARENA_NEW(&arena, bool, bounded->count)};
    kempe_status status = kmp_made(context, e.found);
    if (status == KEMPE_OK)
        status = kmp_csv_read(context, path, &form, &e);
    for (int k = 0; k < bounded->count && status == KEMPE_OK; k++)
        if (!e.found[k])
            status = kmp_complain(context, path, 0, 0, "there is no row of the parameter '%s'", bounded->name[k]);
    kmp_arena_free(&arena);
    return status;
}
