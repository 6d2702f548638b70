/* SPDX-License-Identifier: BSD-3-Clause */
/* The report of modes: the mechanism moving along each, its loops closed in every frame, with all results.
 */
#include "base/memory.h"
#include "constraints/closing/charts.h"
#include "report/encode.h"
#include "report/motion_picture.h"
#include "report/page.h"
#include "studies/modes/modes.h"
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
    const kmp_linear *l = &w->m->station->linear;
    for (int f = 0; f < FRAMES; f++) {
        double *q = w->q + (ptrdiff_t)f * l->n;
        if (kmp_station_move(w->m->station, &w->m->modes, c, amplitude, 2 * acos(-1) * f / (FRAMES - 1), q))
            return false;
        if (w->m->station->state->chart) /* as the user counts the angles */
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

static void release(maker *w)
{
    kmp_free(w->modes);
    kmp_free(w->q);
    kmp_free(w->zero);
    kmp_samples_free(&w->row);
}

/* -- data -------------------------------------------------------------------------------------------- */

static void put_string(kmp_text *text, const char *key, const char *s)
{
    kmp_text_printf(text, ",\"%s\":", key);
    kmp_encode_string(text, s ? s : "");
}

static void put_number(kmp_text *text, const char *key, double x)
{
    kmp_text_printf(text, ",\"%s\":", key);
    kmp_text_rounded(text, x, 9);
}

static void put_numbers(kmp_text *text, const char *key, int count, const double *x, int digits)
{
    kmp_text_printf(text, ",\"%s\":", key);
    kmp_encode_numbers(text, count, x, digits);
}

static void put_mode(kmp_text *text, const kempe_modes *m, const shown *s)
{
    int c = s->eigenvalue, n = m->modes.n;
    double re = m->modes.spectrum.re[c], im = m->modes.spectrum.im[c];
    ptrdiff_t at = (ptrdiff_t)c * n;
    kmp_text words = {0};
    bool zero = c < m->modes.spectrum.zeros;
    kmp_text_printf(text, "{\"zero\":%s,\"frames\":%d", zero ? "true" : "false", s->frames);
    put_number(text, "amplitude", s->amplitude);
    put_number(text, "re", re);
    put_number(text, "im", im);
    put_number(text, "frequency", kmp_mode_frequency(re, im));
    put_number(text, "damping", kmp_mode_damping(re, im));
    if (zero)
        kmp_modes_put_along(&words, m, c);
    else
        kmp_modes_put_movers(&words, m, c);
    put_string(text, "moves", words.s);
    text->failed = text->failed || words.failed;
    kmp_text_free(&words);
    put_numbers(text, "shape_re", n, m->modes.shown_re + at, 6);
    put_numbers(text, "shape_im", n, m->modes.shown_im + at, 6);
    put_numbers(text, "kinetic", n, m->modes.kinetic + at, 4);
    put_numbers(text, "potential", n, m->modes.potential + at, 4);
    kmp_text_put(text, "}");
}

static void put_rows(kmp_text *text, const char *key, const kmp_locus *l, const double *x)
{
    kmp_text_printf(text, ",\"%s\":[", key);
    for (int k = 0; k < l->reached; k++) {
        kmp_text_put(text, k ? "," : "");
        kmp_encode_numbers(text, l->count, x + (ptrdiff_t)k * l->count, 6);
    }
    kmp_text_put(text, "]");
}

static void put_locus(kmp_text *text, const kempe_modes *m)
{
    const kmp_locus *l = &m->locus;
    kmp_text_put(text, ",\"locus\":");
    if (!m->name || l->reached == 0) {
        kmp_text_put(text, "null");
        return;
    }
    kmp_text_put(text, "{\"name\":");
    kmp_encode_string(text, m->name);
    put_numbers(text, "values", l->reached, l->value, 9);
    put_numbers(text, "orders", m->order_count, m->order, 6);
    put_rows(text, "re", l, l->re);
    put_rows(text, "im", l, l->im);
    kmp_text_put(text, ",\"critical\":[");
    for (int k = 0; k < l->critical_count; k++) {
        const kmp_critical *c = &l->critical[k];
        kmp_text_printf(text, "%s{\"grows\":\"%s\"", k ? "," : "", c->grows_above ? "above" : "below");
        put_number(text, "value", c->value);
        put_number(text, "re", c->re);
        put_number(text, "im", c->im);
        kmp_text_put(text, "}");
    }
    kmp_text_put(text, "]}");
}

static bool put_data(kmp_text *text, const maker *w)
{
    const kempe_modes *m = w->m;
    kmp_text because = {0};
    kmp_text_put(text, "{\"kempe\":");
    kmp_encode_string(text, KEMPE_VERSION);
    put_string(text, "model", m->system->model->name);
    put_string(text, "at", m->station->state->equilibrium ? "the equilibrium" : "the assembled start");
    put_string(text, "stability", kmp_modes_verdict(m));
    kmp_modes_put_verdict(&because, m);
    put_string(text, "reasons", because.s);
    text->failed = text->failed || because.failed;
    kmp_text_free(&because);
    put_string(text, "reason", m->reason);
    kmp_text_printf(text, ",\"freedoms\":%d,\"frames\":%d,\"coordinates\":[", m->modes.p, FRAMES);
    for (int k = 0; k < m->modes.n; k++) {
        kmp_text_put(text, k ? "," : "");
        kmp_encode_string(text, m->system->model->motions[k].name);
    }
    kmp_text_put(text, "],\"modes\":[");
    for (int k = 0; k < w->count; k++) {
        kmp_text_put(text, k ? "," : "");
        put_mode(text, m, &w->modes[k]);
    }
    kmp_text_put(text, "]");
    put_locus(text, m);
    kmp_text_put(text, ",\"picture\":");
    if (w->row.rows > 0 && !kmp_motion_picture(text, m->system->model, &w->row))
        return false;
    kmp_text_put(text, w->row.rows > 0 ? "}" : "null}");
    return !text->failed;
}

/* -- the page ---------------------------------------------------------------------------------------- */

static kempe_status write_page(const maker *w, const kmp_page_libraries *libraries, const char *path)
{
    static const char *const *const scripts[] = {kmp_phrases_js, kmp_shapes_js, kmp_animation_js, kmp_modes_view_js,
                                                 NULL};
    kmp_text data = {0};
    kempe_status status = KEMPE_E_MEMORY;
    if (put_data(&data, w)) {
        const kmp_sheet sheet = {.html = kmp_modes_view_html,
                                 .model = w->m->system->model->name,
                                 .subject = "modes",
                                 .scripts = scripts,
                                 .libraries = libraries,
                                 .data = data.s};
        status = kmp_sheet_write(w->m->system->context, &sheet, path);
    } else {
        status = kmp_fail_memory(w->m->system->context);
    }
    kmp_text_free(&data);
    return status;
}

kempe_status kempe_modes_write_report(kempe_modes *modes, const char *path)
{
    KMP_WANTED(NULL, modes, "modes");
    KMP_WANTED(modes->system->context, path, "path");
    kempe_context *context = modes->system->context;
    kmp_page_libraries libraries;
    maker w = {.m = modes};
    kmp_context_clear(context);
    KMP_TRY(kmp_page_libraries_read(context, &libraries));
    kempe_status status = make_frames(&w) ? write_page(&w, &libraries, path) : kmp_fail_memory(context);
    release(&w);
    kmp_page_libraries_free(&libraries);
    return status;
}
