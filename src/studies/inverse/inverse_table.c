/* SPDX-License-Identifier: BSD-3-Clause */
/* Inverse dynamics as a table. One traversal makes the columns and then each row. */
#include "output/result_table.h"
#include "studies/inverse/inverse.h"
#include <kempe/inverse.h>
#include <string.h>

typedef struct writer {
    kempe_table *table;
    const kempe_inverse *r;
    bool columns; /* this traversal makes the columns */
    size_t row;
} writer;

static void put(writer *w, const char *unit, double value, const char *prefix, const char *name, const char *after)
{
    if (w->columns)
        kmp_tabulate_column(w->table, unit, "%s%s%s", prefix, name, after);
    else
        kmp_tabulate_number(w->table, value);
}

static void put_state(writer *w, const char *prefix, const double *values, const char *const unit[2])
{
    const kempe_model *model = w->r->system->model;
    for (int k = 0; k < w->r->n; k++)
        put(w, unit[model->motions[k].rotation ? 0 : 1], values[w->row * (size_t)w->r->n + (size_t)k], prefix,
            model->motions[k].name, "");
}

static void put_actuators(writer *w, const char *prefix, const double *values, const char *const unit[2])
{
    const kempe_model *model = w->r->system->model;
    for (int k = 0; k < w->r->a; k++) {
        const kmp_motion *motion = &model->motions[w->r->actuator[k]];
        put(w, unit[motion->rotation ? 0 : 1], values[w->row * (size_t)w->r->a + (size_t)k], prefix, motion->name, "");
    }
}

/* Rows of drives are none. */
static void put_multipliers(writer *w)
{
    static const char *const unit[] = {"N m", "N", "N/m"}; /* energy over the unit of the row */
    const kempe_system *s = w->r->system;
    for (int r = 0, l = 0; r < s->m; r++) {
        while (l < w->r->loops && w->r->loop[l] < s->rows[r].closure)
            l++;
        if (l == w->r->loops || w->r->loop[l] != s->rows[r].closure)
            continue;
        int power = s->rows[r].length_power;
        put(w, power >= 0 && power <= 2 ? unit[power] : "", w->r->lambda[w->row * (size_t)s->m + (size_t)r], "lambda.",
            s->row_names[r], "");
    }
}

static void put_reactions(writer *w, bool moment)
{
    static const char *const axis[] = {".x", ".y", ".z"};
    const kempe_inverse *r = w->r;
    for (int l = 0; l < r->loops; l++)
        for (int k = 0; k < 3; k++)
            put(w, moment ? "N m" : "N",
                r->reaction[(w->row * (size_t)r->loops + (size_t)l) * KMP_REACTION + (size_t)(k + (moment ? 3 : 0))],
                moment ? "moment." : "reaction.", r->system->model->closures[r->loop[l]].name, axis[k]);
}

static void put_row(writer *w)
{
    static const char *const efforts[] = {"N m", "N"}, *const powers[] = {"W", "W"};
    static const char *const state[3][2] = {{"rad", "m"}, {"rad/s", "m/s"}, {"rad/s^2", "m/s^2"}};
    const kempe_inverse *r = w->r;
    put(w, "s", r->t[w->row], "t", "", "");
    put_actuators(w, "tau.", r->tau, efforts);
    put_actuators(w, "power.", r->power, powers);
    put_state(w, "q.", r->q, state[0]);
    put_state(w, "qd.", r->qd, state[1]);
    put_state(w, "qdd.", r->qdd, state[2]);
    put_multipliers(w);
    put_reactions(w, false);
    put_reactions(w, true);
}

kempe_status kempe_inverse_table(const kempe_inverse *inverse, const char *name, kempe_table **table)
{
    KMP_WANTED(NULL, inverse, "inverse");
    kempe_context *context = inverse->system->context;
    KMP_WANTED(context, name, "name");
    KMP_WANTED(context, table, "table");
    kmp_context_clear(context);
    if (strcmp(name, "rows") != 0)
        return kmp_tabulate_unknown(context, name, "rows");
    writer w = {.table = kmp_tabulate(context, name), .r = inverse, .columns = true};
    put_row(&w);
    w.columns = false;
    for (; w.row < (size_t)inverse->rows; w.row++) {
        kmp_tabulate_row(w.table);
        put_row(&w);
    }
    return kmp_tabulate_finish(context, w.table, table);
}
