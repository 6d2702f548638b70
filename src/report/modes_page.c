/* SPDX-License-Identifier: BSD-3-Clause */
/* The report of modes: the mechanism moving along each, its loops closed in every frame, with all results.
 */
#include "analyses/modes/modes_print.h"
#include "analyses/modes/modes_study.h"
#include "base/memory.h"
#include "constraints/evaluation/charts.h"
#include "model/data/model.h"
#include "output/samples.h"
#include "report/motion_picture.h"
#include "report/page.h"
#include <kempe/compare.h>
#include <kempe/modes.h>
#include <math.h>
#include <string.h>

/* Frames of a period, the last one equal to the first; the drawn amplitude of a shape, and the most halvings of it
 * where the loops do not close. */
enum { FRAMES = 33, MOST_HALVINGS = 7 };
#define AMPLITUDE 0.2

typedef struct shown {
    int eigenvalue, frames; /* the first of its frames, -1: none */
    double amplitude;
} shown;

typedef struct maker {
    kempe_modes *m;
    shown *modes;
    int count;
    kmp_samples row;
    double *q, *zero; /* FRAMES x n; n + m */
} maker;

/* -- frames ------------------------------------------------------------------------------------------ */

/* All frames of a mode in room; false where the loops do not close. */
static bool move(maker *w, int c, double amplitude)
{
    const kmp_linear *l = &w->m->family->linear;
    for (int f = 0; f < FRAMES; f++) {
        double *q = w->q + (ptrdiff_t)f * l->n;
        if (kmp_operating_family_move(w->m->family, &w->m->modes, c, amplitude, 2 * acos(-1) * f / (FRAMES - 1), q))
            return false;
        if (w->m->family->state->chart) /* as the user counts the angles */
            kmp_charts_show(l->system, l->eval->chart, w->m->q, q, w->zero);
    }
    return true;
}

static bool add_frames(maker *w, shown *s)
{
    int n = w->m->system->n;
    s->frames = -1;
    if (w->row.rows + FRAMES > kmp_motion_picture_frames(w->m->system->model))
        return true; /* there is no room for more */
    s->amplitude = AMPLITUDE;
    bool closed = move(w, s->eigenvalue, s->amplitude);
    for (int k = 0; k < MOST_HALVINGS && !closed; k++) {
        s->amplitude /= 2;
        closed = move(w, s->eigenvalue, s->amplitude);
    }
    if (!closed)
        return true;
    s->frames = w->row.rows;
    memset(w->zero, 0, (size_t)(n + w->m->system->m) * sizeof *w->zero);
    for (int f = 0; f < FRAMES; f++)
        if (kmp_samples_add(&w->row, w->row.rows, w->q + (ptrdiff_t)f * n, w->zero, w->zero, w->zero, 0))
            return false;
    return true;
}

static bool make_frames(maker *w)
{
    const kmp_spectrum *s = &w->m->modes.spectrum;
    int n = w->m->system->n;
    w->modes = KMP_NEW(shown, s->count);
    w->q = KMP_NEW(double, FRAMES *n);
    w->zero = KMP_NEW(double, n + w->m->system->m);
    kmp_samples_init(&w->row, n, w->m->system->m);
    bool ok = w->modes && w->q && w->zero;
    for (int c = 0; ok && c < s->count; c++)
        if (c < s->still || (c >= s->zeros && s->im[c] >= 0)) {
            w->modes[w->count].eigenvalue = c;
            ok = add_frames(w, &w->modes[w->count++]);
        }
    return ok;
}

/* -- data -------------------------------------------------------------------------------------------- */

static void put_mode(kmp_json *json, const kempe_modes *m, const shown *s)
{
    int c = s->eigenvalue, n = m->modes.n;
    double re = m->modes.spectrum.re[c], im = m->modes.spectrum.im[c];
    ptrdiff_t at = (ptrdiff_t)c * n;
    kmp_text words = {0};
    bool zero = c < m->modes.spectrum.zeros;
    kmp_json_put(json, "{ zero %i frames %d amplitude %.9g re %.9g im %.9g frequency %.9g damping %.9g", zero,
                 s->frames, s->amplitude, re, im, kmp_mode_frequency(re, im), kmp_mode_damping(re, im));
    if (zero)
        kmp_modes_put_along(&words, m, c);
    else
        kmp_modes_put_movers(&words, m, c);
    kmp_json_text(json, "moves", &words);
    kmp_json_rounded_numbers(json, "shape_re", n, m->modes.shown_re + at, 6);
    kmp_json_rounded_numbers(json, "shape_im", n, m->modes.shown_im + at, 6);
    kmp_json_rounded_numbers(json, "kinetic", n, m->modes.kinetic + at, 4);
    kmp_json_rounded_numbers(json, "potential", n, m->modes.potential + at, 4);
    kmp_json_end(json);
}

static void put_rows(kmp_json *json, const char *key, const kmp_locus *l, const double *x)
{
    kmp_json_array(json, key);
    for (int k = 0; k < l->reached; k++)
        kmp_json_rounded_numbers(json, NULL, l->count, x + (ptrdiff_t)k * l->count, 6);
    kmp_json_end(json);
}

static void put_locus(kmp_json *json, const kempe_modes *m)
{
    const kmp_locus *l = &m->locus;
    if (!m->name || l->reached == 0) {
        kmp_json_string(json, "locus", NULL);
        return;
    }
    kmp_shown as = kmp_modes_shown(m);
    kmp_json_put(json, "locus { name %s unit %s factor %.17g", m->name, as.unit, as.factor);
    kmp_json_rounded_numbers(json, "values", l->reached, l->value, 9);
    kmp_json_rounded_numbers(json, "orders", m->order_count, m->order, 6);
    kmp_json_put(json, "highest %.9g", m->highest);
    put_rows(json, "re", l, l->re);
    put_rows(json, "im", l, l->im);
    kmp_json_array(json, "critical");
    for (int k = 0; k < l->critical_count; k++) {
        const kmp_critical *c = &l->critical[k];
        kmp_json_put(json, "{ grows %s value %.9g re %.9g im %.9g }", c->grows_above ? "above" : "below", c->value,
                     c->re, c->im);
    }
    kmp_json_put(json, "] }");
}

/* -- the page ---------------------------------------------------------------------------------------- */

static kempe_status write_page(const maker *w, const char *path)
{
    static const char *const *const scripts[] = {kmp_phrases_js, kmp_plots_js, KMP_PICTURE_SCRIPTS, kmp_modes_view_js,
                                                 NULL};
    kmp_text data = {0};
    const kempe_modes *m = w->m;
    kmp_json json = kmp_json_begin_as(&data, KMP_JSON_COMPACT);
    kmp_text because = {0};
    kmp_json_put(&json, "{ kempe %s model %s at %s stability %s", KEMPE_VERSION, m->system->model->name,
                 m->family->state->equilibrium ? "the equilibrium" : "the assembled start", kmp_modes_verdict(m));
    kmp_modes_put_verdict(&because, m);
    kmp_json_text(&json, "reasons", &because);
    kmp_json_put(&json, "reason %s dof %d frames %d coordinates [", m->reason ? m->reason : "", m->modes.moving,
                 FRAMES);
    for (int k = 0; k < m->modes.n; k++) {
        kmp_shown as = kmp_shown_as(m->system->context, kmp_quantity_unit(m->system, KMP_QUANTITY_Q, k));
        kmp_json_put(&json, "{ name %s unit %s factor %.17g }", m->system->model->motions[k].name, as.unit, as.factor);
    }
    kmp_json_put(&json, "] modes [");
    for (int k = 0; k < w->count; k++)
        put_mode(&json, m, &w->modes[k]);
    kmp_json_end(&json);
    put_locus(&json, m);
    kmp_motion_picture(&json, "picture", m->system->model, &w->row, NULL);
    kmp_json_end(&json);
    return kmp_sheet_write(w->m->system->context,
                           &(kmp_sheet){.body = kmp_modes_view_html,
                                        .model = w->m->system->model->name,
                                        .subject = "modes",
                                        .scripts = scripts,
                                        .data = &data},
                           path);
}

kempe_status kempe_modes_write_report(kempe_modes *modes, const char *path)
{
    KMP_WANTED(NULL, modes, "modes");
    KMP_WANTED(modes->system->context, path, "path");
    kempe_context *context = modes->system->context;
    maker w = {.m = modes};
    KMP_TRY(kempe_report_check(context));
    kempe_status status = make_frames(&w) ? write_page(&w, path) : kmp_fail_memory(context);
    kmp_free(w.modes);
    kmp_free(w.q);
    kmp_free(w.zero);
    kmp_samples_free(&w.row);
    return status;
}
