/* SPDX-License-Identifier: BSD-3-Clause */
/* Bearings by pairs, in the order of the model. */
#include "output/bearing_loads.h"
#include "model/data/model.h"
#include "output/print.h"
#include "output/result_table.h"
#include <math.h>
#include <stdio.h>
#include <string.h>

/* Columns of places and loads, and of times and exponents. */
enum { VALUE = 11, TIME = 10, EQUIVALENT = 13, EXPONENT = 7 };

bool kmp_bearing_loads_init(kmp_bearing_loads *b, const kempe_system *system, kmp_arena *arena)
{
    const int count = 2 * system->model->bearing_count;
    const kmp_reaction_peak none = {NAN, NAN, {NAN, NAN, NAN}};
    *b = (kmp_bearing_loads){.system = system, .of = KMP_ARENA_NEW(arena, kmp_bearing_peak, count + 1)};
    for (int k = 0; b->of && k < count; k++)
        b->of[k] = (kmp_bearing_peak){none, none, NAN};
    return b->of;
}

double kmp_bearing_radial(const double *values, int bearing)
{
    const double *x = values + 3 * (ptrdiff_t)bearing;
    return sqrt(x[0] * x[0] + x[1] * x[1] + x[2] * x[2]);
}

void kmp_bearing_loads_meet(kmp_bearing_loads *b, double t, const double *values)
{
    const kempe_model *model = b->system->model;
    for (int k = 0; k < 2 * model->bearing_count; k++) {
        const double *of = values + (ptrdiff_t)KMP_BEARING_VALUES * (k / 2);
        const double *radial = of + 3 * (ptrdiff_t)(k % 2);
        kmp_reaction_peak_take(&b->of[k].radial, t, kmp_bearing_radial(of, k % 2), radial, 3);
        if (model->bearings[k / 2].thrust == 1 + k % 2)
            kmp_reaction_peak_take(&b->of[k].axial, t, fabs(of[6]), of + 6, 1);
    }
}

/* The reaction of the joint of a pair; NULL: it is not in the list. */
static const kmp_reaction *reaction_of(const kmp_reactions *r, const kmp_bearing_pair *pair)
{
    for (const kmp_reaction *of = r->of; of < r->of + r->count; of++)
        if (pair->closure >= 0 ? of->closure == pair->closure : of->body == pair->body)
            return of;
    return NULL;
}

static bool is_shared(const kmp_reactions *r, const kmp_bearing_pair *pair)
{
    const kmp_reaction *of = reaction_of(r, pair);
    return of && of->shared != 0;
}

static const char *note_of(const kmp_reactions *r, const kmp_bearing_pair *pair)
{
    const kmp_reaction *of = reaction_of(r, pair);
    return of ? of->note : NULL;
}

/* -- text ----------------------------------------------------------------------------------------------- */

static void put_peak(kmp_text *text, const kmp_reaction_peak *peak, double factor, double noise)
{
    const bool zero = peak->size <= noise;
    kmp_print_cells(text, "  %*.6g", VALUE, zero ? 0.0 : factor * peak->size);
    kmp_print_cells(text, "  %*.6g", TIME, zero ? NAN : peak->t);
}

static void show_heads(kmp_text *text, const char *length, const char *force, int width)
{
    const char *const heads[] = {"at", "radial", "axial", "equivalent"};
    char head[4][40];
    for (int k = 0; k < 4; k++)
        (void)snprintf(head[k], sizeof head[k], "%s, %s", heads[k], k == 0 ? length : force);
    kmp_text_printf(text, "  %-*s  %*s  %*s  %*s  %*s  %*s  %*s  %*s\n", width, "", TIME, head[0], VALUE, head[1], TIME,
                    "at t, s", VALUE, head[2], TIME, "at t, s", EQUIVALENT, head[3], EXPONENT, "p");
}

void kmp_bearing_loads_show(kmp_text *text, const kmp_bearing_loads *b, const kmp_reactions *r)
{
    const kempe_model *model = b->system->model;
    const kmp_shown length = kmp_shown_as(model->context, "m"), force = kmp_shown_as(model->context, "N");
    int width = 4;
    double noise = 0;
    if (model->bearing_count == 0 || !b->whole)
        return;
    for (int k = 0; k < 2 * model->bearing_count; k++) {
        const kmp_bearing_pair *pair = &model->bearings[k / 2];
        const int size = (int)strlen(pair->name) + (is_shared(r, pair) ? 4 : 2);
        width = size > width ? size : width;
        noise = fmax(noise, KMP_PRINT_NOISE * fmax(b->of[k].radial.size, b->of[k].axial.size));
    }
    kmp_text_printf(text, "\nbearings, on the second body: loads of the motion from %.6g to %.6g s\n", b->from,
                    b->until);
    show_heads(text, length.unit, force.unit, width);
    for (int k = 0; k < 2 * model->bearing_count; k++) {
        const kmp_bearing_pair *pair = &model->bearings[k / 2];
        const kmp_bearing_peak *of = &b->of[k];
        char label[200];
        (void)snprintf(label, sizeof label, "%s %d%s", pair->name, 1 + k % 2, is_shared(r, pair) ? " *" : "");
        kmp_text_printf(text, "  %-*s", width, label);
        kmp_print_cells(text, "  %*.6g", TIME, length.factor * pair->at[k % 2].value);
        put_peak(text, &of->radial, force.factor, noise);
        put_peak(text, &of->axial, force.factor, noise);
        kmp_print_cells(text, "  %*.6g", EQUIVALENT, force.factor * (of->equivalent <= noise ? 0.0 : of->equivalent));
        kmp_print_cells(text, "  %*.6g", EXPONENT, pair->life[k % 2]);
        kmp_text_put(text, "\n");
    }
}

/* -- JSON and table ------------------------------------------------------------------------------------- */

static void json_peak(kmp_json *json, const char *key, const kmp_reaction_peak *peak, int count)
{
    if (isnan(peak->size)) {
        kmp_json_string(json, key, NULL);
        return;
    }
    kmp_json_object(json, key);
    kmp_json_put(json, "peak %g t %g", peak->size, peak->t);
    kmp_json_numbers(json, "components", count, peak->x);
    kmp_json_end(json);
}

void kmp_bearing_loads_json(kmp_json *json, const kmp_bearing_loads *b, const kmp_reactions *r)
{
    const kempe_model *model = b->system->model;
    if (model->bearing_count == 0)
        return;
    kmp_json_array(json, "bearings");
    for (int k = 0; k < 2 * model->bearing_count; k++) {
        const kmp_bearing_pair *pair = &model->bearings[k / 2];
        kmp_json_put(json, "{ bearings %s bearing %d joint %s at %g", pair->name, 1 + k % 2, pair->joint,
                     pair->at[k % 2].value);
        json_peak(json, "radial", &b->of[k].radial, 3);
        json_peak(json, "axial", &b->of[k].axial, 1);
        kmp_json_put(json, "equivalent %g life %g", b->of[k].equivalent, pair->life[k % 2]);
        if (r->unexamined)
            kmp_json_string(json, "unique", NULL);
        else
            kmp_json_boolean(json, "unique", !is_shared(r, pair));
        kmp_json_put(json, "note %s }", note_of(r, pair));
    }
    kmp_json_end(json);
}

void kmp_bearing_loads_columns(kempe_table *table)
{
    kmp_tabulate_columns(table, "bearings[words] bearing joint[words] at[m] radial[N] radial.t[s] radial.x[N] "
                                "radial.y[N] radial.z[N] axial[N] axial.t[s] equivalent[N] life unique note[words]");
}

void kmp_bearing_loads_tabulate(kempe_table *table, const kmp_bearing_loads *b, const kmp_reactions *r)
{
    const kempe_model *model = b->system->model;
    for (int k = 0; k < 2 * model->bearing_count; k++) {
        const kmp_bearing_pair *pair = &model->bearings[k / 2];
        const kmp_bearing_peak *of = &b->of[k];
        const char *note = note_of(r, pair);
        kmp_tabulate_row(table);
        kmp_tabulate_cells(table, "%s %d %s %g %g %g", pair->name, 1 + k % 2, pair->joint, pair->at[k % 2].value,
                           of->radial.size, of->radial.t);
        kmp_tabulate_numbers(table, 3, of->radial.x);
        kmp_tabulate_cells(table, "%g %g %g %g %g %s", of->axial.x[0], of->axial.t, of->equivalent, pair->life[k % 2],
                           r->unexamined ? NAN : !is_shared(r, pair), note ? note : "");
    }
}
