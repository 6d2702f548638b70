/* SPDX-License-Identifier: BSD-3-Clause */
/* The page of modes: the mechanism moving along each, its loops closed in every frame, with all results. */
#include "report/modes_page.h"
#include "analyses/modes/modes_print.h"
#include "analyses/modes/modes_study.h"
#include "constraints/evaluation/charts.h"
#include "output/print.h"
#include "picture/motion_picture.h"
#include <math.h>

/* Frames of a period, the last one equal to the first; the drawn amplitude of a shape, and the most halvings of it
 * where the loops do not close; digits of the data. */
enum { FRAMES = 33, MOST_HALVINGS = 7, DIGITS = 9 };
#define AMPLITUDE 0.2

/* -- frames ------------------------------------------------------------------------------------------ */

/* All frames of a mode in room for FRAMES x n; false where the loops do not close. */
static bool move(const kempe_modes *m, int c, double amplitude, double *q, double *zero)
{
    const kmp_linear *l = &m->family->linear;
    for (int f = 0; f < FRAMES; f++, q += l->n) {
        if (kmp_operating_family_move(m->family, &m->modes, c, amplitude, 2 * acos(-1) * f / (FRAMES - 1), q))
            return false;
        if (m->family->state->chart) /* as the user counts the angles */
            kmp_charts_show(l->system, l->eval->chart, m->q, q, zero);
    }
    return true;
}

/* Adds the frames of a mode, and puts the first of them, -1 for none, with their amplitude. */
static kempe_status add_mode(kmp_result_page *page, const kempe_modes *m, int c, double *q, double *zero)
{
    int first = page->picture.states.rows;
    double amplitude = AMPLITUDE;
    bool shown = first + FRAMES <= kmp_motion_picture_frames(m->system->model); /* there is room for it */
    bool closed = shown && move(m, c, amplitude, q, zero);
    for (int k = 0; k < MOST_HALVINGS && shown && !closed; k++) {
        amplitude /= 2;
        closed = move(m, c, amplitude, q, zero);
    }
    kmp_json_put(&page->data, "{ frames %d amplitude %g }", closed ? first : -1, amplitude);
    return closed ? kmp_page_add_frames(page, FRAMES, q, m->system->n, NULL) : KEMPE_OK;
}

/* -- data -------------------------------------------------------------------------------------------- */

/* Units of coordinates and of the parameter that varies. */
static void put_units(kmp_json *json, const kempe_modes *m)
{
    kmp_json_array(json, "coordinates");
    for (int k = 0; k < m->modes.n; k++) {
        kmp_shown as = kmp_shown_as(m->system->context, kmp_quantity_unit(m->system, KMP_QUANTITY_Q, k));
        kmp_json_put(json, "{ name %s unit %s factor %g }", kmp_name_of_coordinate(m->system, k), as.unit, as.factor);
    }
    kmp_json_end(json);
    if (!m->name)
        return;
    kmp_shown as = kmp_modes_shown(m);
    kmp_json_put(json, "sweep { unit %s factor %g highest %g", as.unit, as.factor, m->highest);
    kmp_json_numbers(json, "orders", m->order_count, m->order);
    kmp_json_end(json);
}

kempe_status kmp_modes_fill(kmp_result_page *page, const void *result)
{
    const kempe_modes *m = result;
    int freedoms = m->modes.moving;
    page->head.outcome = kmp_outcome_of(m->status);
    page->head.reason = m->reason;
    page->head.scene = kmp_arena_printf(&page->arena, "at %s \xc2\xb7 %d degree%s of freedom",
                                        m->family->state->equilibrium ? "the equilibrium" : "the assembled start",
                                        freedoms, freedoms == 1 ? "" : "s");
    const kmp_spectrum *s = &m->modes.spectrum;
    int n = m->system->n;
    double *q = KMP_ARENA_NEW(&page->arena, double, FRAMES *n);
    double *zero = KMP_ARENA_NEW(&page->arena, double, n + m->system->m);
    KMP_TRY(kmp_made(page->context, q && zero));
    kmp_json_put(&page->data, "frames %d moving [", FRAMES);
    for (int c = 0; c < s->count; c++)
        if (kmp_modes_is_listed(m, c))
            KMP_TRY(add_mode(page, m, c, q, zero));
    kmp_json_end(&page->data);
    put_units(&page->data, m);
    kmp_json_string(&page->data, "warnings", m->warnings ? m->warnings : "");
    page->data.digits = DIGITS;
    kmp_modes_json(&page->data, m);
    page->data.digits = 0;
    return KEMPE_OK;
}

static const char *const *const scripts[] = {kmp_modes_view_js, NULL};
const kmp_page_view kmp_modes_view = {kmp_modes_view_html, scripts, NULL};
