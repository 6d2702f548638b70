/* SPDX-License-Identifier: BSD-3-Clause */
#include "report/contact_drawing.h"
#include "base/memory.h"
#include "model/data/compliant.h"
#include "model/data/model.h"
#include "studies/simulate/observed.h"
#include "studies/simulate/trajectory.h"
#include "studies/simulate/trajectory_print.h"
#include <math.h>
#include <string.h>

/* Bars of a histogram of depths. */
enum { BARS = 24 };

static bool is_drawn(const kempe_model *model, int force)
{
    return model->forces[force].kind == KMP_FORCE_COMPLIANT ||
           isfinite(kmp_force_clearance(model, &model->forces[force]));
}

bool kmp_contact_drawing_has_paths(const kempe_model *model)
{
    for (int k = 0; k < model->force_count; k++)
        if (isfinite(kmp_force_clearance(model, &model->forces[k])))
            return true;
    return false;
}

/* -- paths --------------------------------------------------------------------------------------------- */

static int column_of(const kmp_output_program *observed, const char *name, const char *component)
{
    kmp_text wanted = {0};
    int found = -1;
    kmp_text_printf(&wanted, "force.%s.%s", name, component);
    for (int k = 0; wanted.s && k < observed->columns.count; k++)
        if (strcmp(observed->columns.name[k], wanted.s) == 0)
            found = k;
    kmp_text_free(&wanted);
    return found;
}

static bool fill_path(kmp_output_program *observed, const char *name, const kmp_samples *rows, double *x, double *y)
{
    int at[2] = {column_of(observed, name, "x"), column_of(observed, name, "y")};
    double *values = KMP_NEW(double, observed->columns.count);
    bool ok = values && at[0] >= 0 && at[1] >= 0;
    for (int row = 0; ok && row < rows->rows; row++) {
        kmp_output_program_fill(observed, rows, row, values);
        x[row] = values[at[0]];
        y[row] = values[at[1]];
    }
    kmp_free(values);
    return ok;
}

/* The place of the journal's centre in the bearing at each row; nothing of any other contact. */
static void put_path(kmp_json *json, const kempe_system *system, const kmp_force *force, const kmp_samples *rows)
{
    double clearance = kmp_force_clearance(system->model, force);
    if (!isfinite(clearance))
        return;
    double *x = KMP_NEW(double, 2 * rows->rows + 1);
    kmp_output_program observed = {0};
    kmp_text word = {0};
    kmp_text_printf(&word, "force(%s)", force->name);
    bool ok = x && word.s && kmp_output_program_init(&observed, system, word.s, 0, NULL) == KEMPE_OK &&
              fill_path(&observed, force->name, rows, x, x + rows->rows);
    json->text->failed = json->text->failed || !ok;
    if (ok) {
        kmp_json_number(json, "clearance", clearance);
        kmp_json_floats(json, "x", (size_t)rows->rows, x);
        kmp_json_floats(json, "y", (size_t)rows->rows, x + rows->rows);
    }
    kmp_output_program_free(&observed);
    kmp_text_free(&word);
    kmp_free(x);
}

/* -- depths --------------------------------------------------------------------------------------------- */

static void put_depths(kmp_json *json, const kempe_trajectory *t, int force)
{
    kmp_contact_times times;
    if (t->system->model->forces[force].kind != KMP_FORCE_COMPLIANT)
        return;
    if (kmp_contact_times_find(t, force, &times) != KEMPE_OK) {
        json->text->failed = true;
        return;
    }
    kmp_json_put(json, "depths { began %d ended %d cut %i touching %.4g turning %s turns %.6g", times.begun,
                 times.ended, t->log.contacts_cut, times.touching, times.turning, times.turns);
    kmp_json_rounded_numbers(json, "quartiles", KMP_DEPTHS, times.depth, 5);
    /* A histogram of the largest depths of contacts, over equal parts of the largest one. */
    int count[BARS] = {0};
    for (int k = 0; k < t->log.contact_count; k++) {
        double depth = kmp_contact_time_depth(t, k);
        if (t->log.contacts[k].force != times.force || isnan(depth))
            continue;
        int bar = (int)(BARS * depth / times.depth[KMP_DEPTHS - 1]);
        count[bar < 0 ? 0 : bar < BARS ? bar : BARS - 1]++;
    }
    kmp_json_array(json, "bars");
    for (int k = 0; k < BARS && times.ended > 0; k++)
        kmp_json_whole(json, NULL, count[k]);
    kmp_json_put(json, "] }");
}

void kmp_contact_drawing(kmp_json *json, const kempe_trajectory *t, const kmp_samples *rows)
{
    const kempe_model *model = t ? t->system->model : NULL;
    kmp_json_array(json, "contacts");
    for (int k = 0; model && k < model->force_count; k++) {
        if (!is_drawn(model, k))
            continue;
        kmp_json_put(json, "{ name %s unit %s", model->forces[k].name, model->forces[k].turns ? "rad" : "m");
        put_path(json, t->system, &model->forces[k], rows);
        put_depths(json, t, k);
        kmp_json_end(json);
    }
    kmp_json_end(json);
}
