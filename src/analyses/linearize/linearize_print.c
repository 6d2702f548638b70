/* SPDX-License-Identifier: BSD-3-Clause */
/* Output of `linearize`: the state, names, the matrices that are small enough to be read. */
#include "analyses/linearize/linearize_study.h"
#include "base/memory.h"
#include "model/data/model.h"
#include "output/print.h"
#include <kempe/linearize.h>
#include <math.h>

enum { MOST_COLUMNS = 8, MOST_ROWS = 24 };

/* -- text -------------------------------------------------------------------------------------------- */

static const char *state_sentence(const kmp_channels *c)
{
    return c->at->equilibrium ? (c->goes_on ? "about the steady motion" : "at the equilibrium")
           : c->goes_on       ? "at the start, which is a steady motion"
           : c->rests         ? "at the start, which is an equilibrium"
                              : "at the start, which is not steady: the matrices hold at this instant";
}

static void list(kmp_text *text, const char *what, const kmp_names *names)
{
    if (names->count == 0)
        return;
    kmp_text_printf(text, "  %-8s ", what);
    for (int k = 0; k < names->count; k++)
        kmp_text_printf(text, "%s%s%s%s%s", k ? ", " : "", names->name[k], names->unit[k][0] ? " [" : "",
                        names->unit[k], names->unit[k][0] ? "]" : "");
    kmp_text_put(text, "\n");
}

static void show_matrix(kmp_text *text, const kmp_matrix_row *row)
{
    if (row->rows == 0 || row->columns == 0)
        return;
    bool fits = row->columns <= MOST_COLUMNS && row->rows <= MOST_ROWS;
    kmp_text_printf(text, "\n%s  %d x %d%s%s%s\n", row->name, row->rows, row->columns, row->meaning[0] ? "   " : "",
                    row->meaning, fits ? "" : "   (in -o FILE.npz and --json)");
    for (int i = 0; fits && i < row->rows; i++) {
        for (int k = 0; k < row->columns; k++)
            kmp_text_printf(text, " %13.6g", row->values[i + k * row->rows] + 0.0);
        kmp_text_put(text, "\n");
    }
}

static double largest_of(const kempe_linearization *l)
{
    kmp_matrix_row z = kmp_linearization_row(l, KEMPE_MATRIX_Z);
    double largest = 0;
    for (int k = 0; k < z.rows; k++)
        largest = fmax(largest, hypot(z.values[k], z.values[k + z.rows]));
    return largest;
}

static void show(kmp_text *text, const void *result)
{
    const kempe_linearization *l = result;
    const kmp_channels *c = &l->channels;
    int freedoms = c->linear.p - c->system->model->state_count;
    kmp_print_title(text, c->system->model, kmp_status_word(c->status));
    kmp_text_printf(text, "linear %s (t = 0), %d degree%s of freedom\n", state_sentence(c), freedoms,
                    freedoms == 1 ? "" : "s");
    if (l->period > 0)
        kmp_text_printf(text, "  samples  from one to the next after %.9g s: largest |z| %.9g, %s\n", l->period,
                        largest_of(l),
                        largest_of(l) < 1   ? "stable"
                        : largest_of(l) > 1 ? "unstable"
                                            : "neutral");
    kmp_print_held(text, "  held     ", c->system, c->at->qd);
    list(text, "states", &c->states);
    list(text, "inputs", &c->loads);
    list(text, "outputs", &c->outputs);
    for (int k = 0; k < l->delays.count; k++) {
        kmp_shown as = kmp_shown_as(c->system->context, "s");
        kmp_text_printf(text, "  delays   input %s is the output of that name %.9g %s before\n", l->delays.name[k],
                        as.factor * l->delay[k], as.unit);
    }
    for (int k = 0; k < KMP_MATRICES; k++) {
        kmp_matrix_row row = kmp_linearization_row(l, k);
        show_matrix(text, &row);
    }
}

/* -- JSON -------------------------------------------------------------------------------------------- */

static void json_names(kmp_json *j, const char *key, const kmp_names *names)
{
    kmp_json_array(j, key);
    for (int k = 0; k < names->count; k++)
        kmp_json_put(j, "{ name %s unit %s }", names->name[k], names->unit[k]);
    kmp_json_end(j);
}

/* One array per row. */
static void json_matrix(kmp_json *j, const kmp_matrix_row *row)
{
    double *room = KMP_NEW(double, row->columns);
    j->text->failed = j->text->failed || !room;
    kmp_json_array(j, row->name);
    for (int i = 0; room && i < row->rows; i++) {
        for (int k = 0; k < row->columns; k++)
            room[k] = row->values[i + k * row->rows] + 0.0;
        kmp_json_numbers(j, NULL, row->columns, room);
    }
    kmp_json_end(j);
    kmp_free(room);
}

static void json(kmp_text *text, const void *result)
{
    const kempe_linearization *l = result;
    const kmp_channels *c = &l->channels;
    kmp_json j = kmp_json_begin(text);
    kmp_print_head(&j, c->system, kmp_status_word(c->status), "", c->build_s, c->warnings);
    kmp_json_put(&j, "at %s state %s residual %g", c->at->equilibrium ? "equilibrium" : "start",
                 c->goes_on ? "steady"
                 : c->rests ? "rests"
                            : "moves",
                 c->residual);
    kmp_print_names(&j, "u", c->system, kmp_name_of_coordinate, l->count, l->u);
    kmp_print_entries(&j, "q", c->system, KMP_QUANTITY_Q, c->at->q);
    kmp_print_entries(&j, "qd", c->system, KMP_QUANTITY_QD, c->at->qd);
    if (l->period > 0)
        kmp_json_number(&j, "sample_time", l->period);
    kmp_print_held_json(&j, c->system, c->at->qd);
    json_names(&j, "states", &c->states);
    json_names(&j, "inputs", &c->loads);
    json_names(&j, "outputs", &c->outputs);
    if (l->delays.count > 0) {
        kmp_json_array(&j, "delays");
        for (int k = 0; k < l->delays.count; k++)
            kmp_json_put(&j, "{ name %s time %g }", l->delays.name[k], l->delay[k]);
        kmp_json_end(&j);
    }
    kmp_json_numbers(&j, "y", c->outputs.count, l->y);
    for (int k = 0; k < KMP_MATRICES; k++) {
        kmp_matrix_row row = kmp_linearization_row(l, k);
        if (k != KEMPE_MATRIX_Z || l->z)
            json_matrix(&j, &row);
    }
    kmp_json_end(&j);
}

KMP_PRINT(kempe_linearization, linearization, linearization->channels.system->context, json, show)
