/* SPDX-License-Identifier: BSD-3-Clause */
/* The first cycle of a branch, by the eigenvector of the mode that begins to oscillate. */
#include "base/memory.h"
#include "constraints/tolerances.h"
#include "studies/limit_cycles/limit_cycles_study.h"
#include <math.h>
#include <string.h>

enum { SMALLER_PARTS = 2 };

/* -- start values ---------------------------------------------------------------------------------------- */

static bool contains(const int *list, int count, int x)
{
    for (int k = 0; k < count; k++)
        if (list[k] == x)
            return true;
    return false;
}

kempe_status kmp_moving_entries(kmp_linear *linear, int keeps, int *count, kmp_flow_entry *entry)
{
    kmp_linear *l = linear;
    const kempe_model *model = l->system->model;
    int *idle = KMP_NEW(int, l->p), idles = idle ? kmp_equilibrium_idle(l, idle) : -1;
    *count = 0;
    for (int k = 0; idles >= 0 && k < 2 * l->p; k++) {
        int motion = l->part.u[k % l->p];
        bool rate = k >= l->p, state = kmp_state_of(model, motion);
        if (rate ? motion != keeps : !(state || contains(idle, idles, motion)))
            entry[(*count)++] = (kmp_flow_entry){motion, state  ? KMP_FLOW_STATE
                                                         : rate ? KMP_FLOW_RATE
                                                                : KMP_FLOW_POSITION};
    }
    kmp_free(idle);
    return kmp_made(model->context, idles >= 0);
}

/* -- the cycles ------------------------------------------------------------------------------------------ */

/* The Hopf point, with the mode as its tangent. */
static kmp_cycle *make_hopf(kempe_limit_cycles *cycles, const kmp_critical *critical, const kmp_modes *modes, int mode)
{
    kmp_shooting *s = &cycles->shooting;
    const kmp_operating *state = cycles->family->state;
    kmp_cycle *c = kmp_shooting_room(s);
    if (!c)
        return NULL;
    c->word = KMP_CYCLE_HOPF;
    c->stability = KMP_CYCLE_UNDECIDED;
    c->value = critical->value;
    c->period = 2 * acos(-1) / critical->im;
    /* The part of a start value in the mode at its phase 0, and its change per time. */
    const kmp_flow *f = cycles->flow;
    double w = modes->spectrum.im[mode];
    for (int i = 0; i < f->size; i++) {
        ptrdiff_t at = f->entry[i].motion + (ptrdiff_t)mode * modes->n;
        double re = KMP_CYCLE_FIRST * modes->shown_re[at], im = KMP_CYCLE_FIRST * modes->shown_im[at];
        c->tangent[i] = f->entry[i].kind == KMP_FLOW_RATE ? -w * im : re;
        c->rate[i] = f->entry[i].kind == KMP_FLOW_RATE ? -w * w * re : -w * im;
    }
    /* Half the range of each start value in the mode. */
    double *reach = c->reach;
    for (int i = 0; i < f->size; i++) {
        ptrdiff_t at = f->entry[i].motion + (ptrdiff_t)mode * modes->n;
        reach[i] = KMP_CYCLE_FIRST * hypot(modes->shown_re[at], modes->shown_im[at]) *
                   (f->entry[i].kind == KMP_FLOW_RATE ? w : 1);
    }
    for (int i = 0; i < s->size; i++) {
        const kmp_flow_entry *e = &s->flow->entry[i];
        c->x[i] = (e->kind != KMP_FLOW_POSITION ? state->qd : state->q)[e->motion];
    }
    kmp_cycles_loads_at_rest(cycles, c);
    return c;
}

/* The cycle whose motion begins as `part` of the mode. */
static kempe_status find_part(kempe_limit_cycles *cycles, const kmp_cycle *hopf, double part, kmp_cycle **first)
{
    kmp_shooting *s = &cycles->shooting;
    double *border = KMP_NEW(double, s->width), *guess = KMP_NEW(double, s->width), *reach = KMP_NEW(double, s->width);
    kempe_status status = kmp_made(cycles->system->context, border && guess && reach);
    if (status == KEMPE_OK) {
        for (int i = 0; i < s->size; i++)
            reach[i] = part * hopf->reach[i];
        kmp_shooting_weigh(s, hopf->x, reach, hopf->period, KMP_CYCLE_RANGE * fabs(cycles->to - cycles->from));
        for (int i = 0; i < s->size; i++) {
            guess[i] = hopf->x[i] + part * hopf->tangent[i];
            border[i] = part * hopf->tangent[i] / s->span[i];
        }
        guess[s->size] = hopf->period;
        guess[s->size + 1] = hopf->value;
        kmp_shooting_refer(s, guess, hopf->rate);
        status = kmp_shooting_correct(s, guess, border);
    }
    if (status == KEMPE_OK)
        status = kmp_shooting_finish(s, border, first);
    kmp_free(border);
    kmp_free(guess);
    kmp_free(reach);
    return status;
}

/* The first cycle of the branch. A cycle with a smaller motion is tried if the parameter is far from the Hopf point, as
 * with wheels whose place on the rail moves fast. */
static kempe_status find_first(kempe_limit_cycles *cycles, const kmp_cycle *hopf, kmp_cycle **first)
{
    double near = KMP_CYCLE_NEAR * fabs(cycles->to - cycles->from), part = 1;
    kempe_status status = find_part(cycles, hopf, part, first);
    for (int k = 0; k < SMALLER_PARTS; k++) {
        kmp_cycle *smaller;
        if (status != KEMPE_E_FAILED && !(status == KEMPE_OK && fabs((*first)->value - hopf->value) > near))
            return status;
        bool found = status == KEMPE_OK;
        part /= 10;
        kmp_context_clear(cycles->system->context);
        status = find_part(cycles, hopf, part, found ? &smaller : first);
        if (found && status == KEMPE_E_FAILED) {
            kmp_context_clear(cycles->system->context);
            return KEMPE_OK;
        }
        if (found && status == KEMPE_OK)
            *first = smaller;
    }
    return status;
}

kempe_status kmp_hopf_cycles(kempe_limit_cycles *cycles, const kmp_critical *critical, kmp_cycle **hopf,
                             kmp_cycle **first)
{
    kempe_context *context = cycles->system->context;
    kmp_modes modes;
    KMP_TRY(kmp_operating_family_go(cycles->family, critical->value, &modes));
    /* The eigenvalue above the real axis that is nearest to i w. */
    double w = critical->im;
    int mode = -1;
    double least = INFINITY;
    for (int k = 0; k < modes.count; k++) {
        double away = hypot(modes.spectrum.re[k], modes.spectrum.im[k] - w);
        if (away < least) {
            least = away;
            mode = k;
        }
    }
    *hopf = mode >= 0 ? make_hopf(cycles, critical, &modes, mode) : NULL;
    kmp_modes_free(&modes);
    KMP_TRY(kmp_made(context, *hopf));
    KMP_TRY(find_first(cycles, *hopf, first));
    /* x moves along the branch, and neither the period nor the parameter are known to change to first order */
    return KEMPE_OK;
}
