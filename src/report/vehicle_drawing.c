/* SPDX-License-Identifier: BSD-3-Clause */
#include "report/vehicle_drawing.h"
#include "analyses/comfort/comfort_study.h"
#include "base/base64.h"
#include "base/memory.h"
#include "model/data/compliant.h"
#include "model/data/model.h"
#include "model/language/dimension.h"
#include "output/print.h"
#include "rail/model/wheel_words.h"
#include "rail/running_safety.h"
#include "studies/simulate/observed.h"
#include "studies/simulate/trajectory_print.h"
#include "symbolic/table_function.h"
#include <math.h>
#include <string.h>

/* Points of a curve, and digits of a number, that a picture shows. */
enum { POINTS = 800, DIGITS = 6 };

static int stride_of(const kmp_running_safety *s)
{
    return 1 + (s->samples - 1) / POINTS;
}

/* Every stride-th sample; null where it is unknown. */
static void put_samples(kmp_json *json, const char *key, const kmp_running_safety *s, const double *x)
{
    kmp_json_array(json, key);
    for (int k = 0; k < s->samples; k += stride_of(s))
        kmp_json_rounded(json, NULL, x[k], DIGITS);
    kmp_json_end(json);
}

static void put_wheels(kmp_json *json, const kmp_running_safety *s)
{
    kmp_json_array(json, "wheels");
    for (int w = 0; w < s->wheels; w++) {
        const ptrdiff_t at = (ptrdiff_t)w * s->samples;
        kmp_json_object(json, NULL);
        put_samples(json, "Q", s, s->load + at);
        put_samples(json, "Y", s, s->across + at);
        put_samples(json, "wear", s, s->wear + at);
        put_samples(json, "means", s, s->mean + at);
        kmp_json_end(json);
    }
    kmp_json_end(json);
}

/* The body that carries both wheels, or their names. */
static void put_axle_name(kmp_json *json, const kempe_model *model, const kmp_safety_axle *axle)
{
    const kmp_wheel *left = &model->wheels[axle->left], *right = &model->wheels[axle->right];
    const int body = model->points[left->point].body;
    kmp_text name = {0};
    if (model->points[right->point].body == body)
        kmp_text_put(&name, model->bodies[body].name);
    else
        kmp_text_printf(&name, "%s, %s", left->name, right->name);
    kmp_json_text(json, "name", &name);
}

/* -- the track ---------------------------------------------------------------------------------------- */

static const kmp_table *irregularity(const kmp_track *track, int k)
{
    const kmp_named_table *named = track->irregularities.named[k];
    return named ? named->table : track->irregularities.made[k];
}

static double curvature(const kmp_track *track, double s)
{
    return kmp_table_value(track->x, 1, s) * kmp_table_value(track->y, 2, s) -
           kmp_table_value(track->y, 1, s) * kmp_table_value(track->x, 2, s);
}

static void put_curve(kmp_json *json, const char *key, const kmp_track *track, const kmp_table *table, double from,
                      double to)
{
    kmp_json_array(json, key);
    for (int k = 0; k <= POINTS; k++) {
        double s = from + (to - from) * k / POINTS;
        kmp_json_rounded(json, NULL, table ? kmp_table_value(table, 0, s) : curvature(track, s), DIGITS);
    }
    kmp_json_end(json);
}

/* The part of a track on which wheels ran, of each track of the model. */
static void put_tracks(kmp_json *json, const kempe_model *model, const kmp_running_safety *s)
{
    kmp_json_array(json, "tracks");
    for (int number = 0; number < model->track_count; number++) {
        const kmp_track *track = &model->tracks[number];
        double from = INFINITY, to = -INFINITY;
        for (int w = 0; w < s->wheels; w++)
            for (int k = 0; model->wheels[w].track == number && k < s->samples; k++) {
                from = fmin(from, s->along[(ptrdiff_t)w * s->samples + k]);
                to = fmax(to, s->along[(ptrdiff_t)w * s->samples + k]);
            }
        if (!(from < to))
            continue;
        kmp_json_put(json, "{ name %s from %g to %g", track->name, from, to);
        for (int k = 0; k < KMP_IRREGULARITIES; k++)
            if (irregularity(track, k))
                put_curve(json, kmp_irregularity_words[k], track, irregularity(track, k), from, to);
        if (track->curved)
            put_curve(json, "curvature", track, NULL, from, to);
        if (track->curved && track->cant)
            put_curve(json, "cant", track, track->cant, from, to);
        kmp_json_end(json);
    }
    kmp_json_end(json);
}

/* -- comfort ------------------------------------------------------------------------------------------ */

kempe_status kmp_vehicle_comfort(const kempe_trajectory *t, kempe_comfort **comfort)
{
    const kempe_model *model = t->system->model;
    const kmp_run_spec *spec = &t->spec;
    bool any = false;
    *comfort = NULL;
    for (int k = 0; k < model->output_count; k++)
        any = any || model->outputs[k].kind == KMP_OUTPUT_ACCELERATION;
    if (!any || model->wheel_count == 0 || !kmp_is_complete(t->status) || t->report.ended || spec->t_start > 0 ||
        spec->t_end < KMP_COMFORT_WINDOW)
        return KEMPE_OK;
    kempe_run_options run = {.size = sizeof run,
                             .formulation = spec->formulation,
                             .form = spec->form,
                             .linear = spec->linear,
                             .backend = spec->backend,
                             .change_points = spec->change_points,
                             .no_convergence_check = 1};
    kmp_spec_numbers(spec, &run);
    const kempe_comfort_options options = {.size = sizeof options, .run = &run};
    const bool quiet = kmp_context_quiet(model->context, true);
    kempe_status status = kempe_comfort_new(t->system, &options, comfort);
    (void)kmp_context_quiet(model->context, quiet);
    if (status == KEMPE_E_MEMORY || status == KEMPE_STOPPED)
        return status;
    kmp_context_clear(model->context);
    return KEMPE_OK;
}

/* Lateral positions are taken at the middle between the wheels. */
static void put_axles(kmp_json *json, const kempe_model *model, const kmp_running_safety *s)
{
    double *room = KMP_NEW(double, s->samples);
    json->text->failed = json->text->failed || !room;
    kmp_json_array(json, "axles");
    for (int a = 0; room && a < s->axles; a++) {
        const double *left = s->aside + (ptrdiff_t)s->axle[a].left * s->samples;
        const double *right = s->aside + (ptrdiff_t)s->axle[a].right * s->samples;
        for (int k = 0; k < s->samples; k++)
            room[k] = (left[k] + right[k]) / 2;
        kmp_json_object(json, NULL);
        put_axle_name(json, model, &s->axle[a]);
        put_samples(json, "sums", s, s->sum + (ptrdiff_t)a * s->samples);
        put_samples(json, "aside", s, room);
        kmp_json_end(json);
    }
    kmp_json_end(json);
    kmp_free(room);
}

/* The units of the page, each with the factor of its numbers in SI. */
static void put_units(kmp_json *json, const kempe_context *context)
{
    static const struct {
        const char *key, *unit;
        kmp_shown customary;
    } shown[] = {{"force", "N", {"kN", 1e-3}},
                 {"way", "m", {"m", 1}},
                 {"aside", "m", {"mm", 1e3}},
                 {"wear", "J/m", {"J/m", 1}},
                 {"curvature", "1/m", {"1/km", 1e3}},
                 {"angle", "rad", {"deg", 360 / KMP_TURN}},
                 {"acceleration", "m/s^2", {"m/s^2", 1}}};
    kmp_json_object(json, "units");
    for (size_t k = 0; k < sizeof shown / sizeof *shown; k++) {
        const kmp_shown as = kmp_print_customary(context, shown[k].unit, shown[k].customary);
        kmp_json_put(json, "%s { unit %s factor %g }", shown[k].key, as.unit, as.factor);
    }
    kmp_json_end(json);
}

void kmp_vehicle_drawing(kmp_json *json, const kempe_trajectory *run, const kempe_comfort *comfort)
{
    const kmp_running_safety *s = run ? run->judged : NULL;
    if (!s || s->wheels == 0)
        return;
    const kempe_model *model = run->system->model;
    kmp_safety_judge.json(json, model, s);
    kmp_json_put(json, "vehicle { loads %s stride %d", kmp_safety_loads_from(s), stride_of(s));
    put_units(json, model->context);
    put_samples(json, "t", s, s->t);
    put_wheels(json, s);
    put_axles(json, model, s);
    put_tracks(json, model, s);
    kmp_json_object(json, "comfort");
    if (comfort)
        kmp_comfort_json(json, comfort);
    kmp_json_put(json, "} }");
}

/* -- contacts -------------------------------------------------------------------------------------------- */

/* Contacts of a run as a page draws them: the path of each journal in its bearing, and how deep contacts were. */

/* Bars of a histogram of depths. */
enum { BARS = 24 };

bool kmp_contact_drawing_has_paths(const kempe_model *model)
{
    for (int k = 0; k < model->force_count; k++)
        if (isfinite(kmp_force_clearance(model, &model->forces[k])))
            return true;
    return false;
}

/* -- paths --------------------------------------------------------------------------------------------- */

/* The last column with this ending after the column of the time, which it is where there is none. */
static int column_of(const kmp_output_program *observed, const char *ending)
{
    int k = observed->columns.count - 1;
    while (k > 0 && strcmp(strrchr(observed->columns.name[k], '.'), ending) != 0)
        k--;
    return k;
}

static bool fill_path(kmp_output_program *observed, const kmp_samples *rows, double *x, double *y)
{
    int at[2] = {column_of(observed, ".x"), column_of(observed, ".y")};
    double *values = KMP_NEW(double, observed->columns.count);
    bool ok = values && at[0] > 0 && at[1] > 0;
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
              fill_path(&observed, rows, x, x + rows->rows);
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
        const kmp_force *force = &model->forces[k];
        if (force->kind != KMP_FORCE_COMPLIANT && !isfinite(kmp_force_clearance(model, force)))
            continue;
        kmp_json_put(json, "{ name %s unit %s", force->name, force->turns ? "rad" : "m");
        put_path(json, t->system, force, rows);
        put_depths(json, t, k);
        kmp_json_end(json);
    }
    kmp_json_end(json);
}
