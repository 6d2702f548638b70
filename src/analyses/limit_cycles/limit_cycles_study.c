/* SPDX-License-Identifier: BSD-3-Clause */
/* The study of limit cycles: options, equilibria with their Hopf points, branches. */
#include "analyses/limit_cycles/limit_cycles_study.h"
#include "analyses/limit_cycles/driven_model.h"
#include "analyses/parts/ranges.h"
#include "analyses/parts/unsupported.h"
#include "base/arena.h"
#include "base/context.h"
#include "base/memory.h"
#include "base/text.h"
#include "constraints/evaluation/charts.h"
#include "constraints/inexact/nearest_exact.h"
#include "constraints/tolerances.h"
#include "dynamics/load_dependent.h"
#include "model/data/model.h"
#include "model/data/wheels.h"
#include "model/read/loads.h"
#include "pipeline.h"
#include "platform/platform.h"
#include "studies/simulate/trajectory.h"
#include <kempe/kempe.h>
#include <kempe/limit_cycles.h>
#include <math.h>
#include <stdbool.h>
#include <string.h>

/* -- held speeds ----------------------------------------------------------------------------------------- */

/* Vehicles whose speed no force decides, or a load holds (analyses/equilibrium/running_state.c): in a limit cycle they
 * keep the speed of the start, by a load that changes over the period. The equations belong to a copy of the model,
 * in which drives have these rates. */

/* The first track that is curved, inclined or irregular; NULL: there is none. */
static const kmp_track *find_curved(const kempe_model *model)
{
    for (int k = 0; k < model->track_count; k++)
        if (model->tracks[k].curved)
            return &model->tracks[k];
    return NULL;
}

/* The copy of the model: with drives, and unless `as_given` a start at which all independent coordinates keep their
 * values. */
static kempe_status make_copy(kempe_limit_cycles *c, bool as_given)
{
    const kmp_linear *l = &c->family->linear;
    bool *hold = KMP_ARENA_NEW(&c->arena, bool, l->n);
    KMP_TRY(kmp_made(c->system->context, hold));
    for (int k = 0; k < l->p; k++)
        hold[l->part.u[k]] = true;
    for (int k = 0; k < c->held; k++)
        hold[c->held_motion[k]] = false;
    const kmp_operating *state = c->family->state;
    as_given = as_given || !kmp_charts_are_own(c->system, state->chart);
    const kmp_driven driven = {c->held, c->held_motion, as_given ? NULL : hold, state->q};
    KMP_TRY(kmp_driven_model(c->system->model, &driven, &c->copy));
    return kmp_system_new(c->copy, NULL, &c->driven);
}

static kempe_status hold_speed(kempe_limit_cycles *c, bool as_given)
{
    const kmp_operating_family_options options = {.name = c->name};
    kmp_modes modes;
    KMP_TRY(kmp_operating_family_new(c->system, &options, &c->family));
    KMP_TRY(kmp_operating_family_go(c->family, c->from, &modes));
    kmp_modes_free(&modes);
    /* Coordinates whose rates no force decides, or a load holds, at the state of the family. */
    const kmp_operating_family *f = c->family;
    const kempe_model *model = c->system->model;
    c->held_motion = KMP_ARENA_NEW(&c->arena, int, f->rate_count);
    KMP_TRY(kmp_made(c->system->context, c->held_motion));
    for (int k = 0; k < f->rate_count; k++) {
        int motion = f->rates[k].coordinate;
        if (f->rates[k].how != KMP_RATE_KEPT && f->rates[k].how != KMP_RATE_HELD)
            continue;
        if (!model->start.qd_given[motion])
            return kmp_fail(c->system->context, KEMPE_E_FAILED,
                            "no force fixes the velocity of '%s', and the start does not give it: add it (start: {qd: "
                            "{%s: ..}}), or drive it at a constant velocity (drives:)",
                            model->motions[motion].name, model->motions[motion].name);
        c->held_motion[c->held++] = motion;
    }
    const kmp_track *curved = c->held > 0 ? find_curved(c->system->model) : NULL;
    if (curved)
        KMP_TRY(
            kmp_fail(c->system->context, KEMPE_E_FAILED,
                     "track '%s' is curved, inclined or irregular, so that motions along it are not periodic; take a "
                     "straight one, or find the motions that simulations reach (--settle T)",
                     curved->name));
    return c->held > 0 || (c->system->m > 0 && !as_given) ? make_copy(c, as_given) : KEMPE_OK;
}

/* Finds the coordinates whose rates a load holds, and makes the equations with their drives.
 * KEMPE_E_FAILED: there is no equilibrium at the first value, the start does not give such a rate, or the track is
 * not straight. With `settle` these are not errors: the speed is then free. */
static kempe_status hold_speeds(kempe_limit_cycles *c)
{
    bool tries = c->settle > 0;
    if (tries && (c->system->model->wheel_count == 0 || find_curved(c->system->model)))
        return KEMPE_OK;
    kempe_status status = hold_speed(c, tries);
    kmp_operating_family_free(c->family);
    c->family = NULL;
    if (!tries || status != KEMPE_E_FAILED)
        return status;
    kmp_context_clear(c->system->context);
    c->held = 0;
    return KEMPE_OK;
}

/* -- loads --------------------------------------------------------------------------------------------- */

/* Appends `outputs` and the loads; false: no memory. Takes the names and units of the columns of such a run: values
 * of the outputs are kept, and *load (held) has the loads; -1: there is none. KEMPE_E_MEMORY. */
static bool put_words(const kempe_limit_cycles *cycles, const char *outputs, kmp_text *words)
{
    kmp_text_put(words, outputs);
    for (int k = 0; k < cycles->held; k++)
        kmp_text_printf(words, ",lambda(load.%s)", cycles->system->model->motions[cycles->held_motion[k]].name);
    return !words->failed;
}

static kempe_status take_names(kempe_limit_cycles *c, int count, char *const *columns, char *const *units, int **load)
{
    int *column = *load = KMP_ARENA_NEW(&c->arena, int, c->held), outputs = count;
    for (int k = c->held - 1; column && k >= 0; k--) {
        const char *name =
            kmp_arena_printf(&c->arena, "lambda.load.%s.1", c->system->model->motions[c->held_motion[k]].name);
        column[k] = -1;
        for (int i = 0; name && i < count; i++)
            column[k] = strcmp(columns[i], name) == 0 ? i : column[k];
        outputs -= column[k] == outputs - 1; /* a caller who asks for all multipliers has them among them */
    }
    c->output = KMP_ARENA_NEW(&c->arena, char *, outputs);
    c->unit = KMP_ARENA_NEW(&c->arena, char *, outputs);
    for (int k = 0; !c->arena.failed && k < outputs; k++) {
        c->output[k] = kmp_arena_strdup(&c->arena, columns[k]);
        c->unit[k] = kmp_arena_strdup(&c->arena, units[k]);
    }
    c->outputs = c->arena.failed ? 0 : outputs;
    return kmp_made(c->system->context, !c->arena.failed);
}

/* Start values that a periodic motion repeats, in `entry` with room for 2 n: not positions of coordinates that nothing
 * depends on, at the state of `linear`; `keeps`: a rate that keeps its start
 * value, -1: none. KEMPE_E_MEMORY. */
static kempe_status list_entries(kmp_linear *l, int keeps, int *count, kmp_flow_entry *entry)
{
    const kempe_model *model = l->system->model;
    int *idle = KMP_NEW(int, l->p), idles = idle ? kmp_equilibrium_idle(l, idle) : -1;
    *count = 0;
    for (int k = 0; idles >= 0 && k < 2 * l->p; k++) {
        int motion = l->part.u[k % l->p];
        bool rate = k >= l->p, state = kmp_state_of(model, motion), is_idle = false;
        for (int i = 0; i < idles; i++)
            is_idle = is_idle || idle[i] == motion;
        if (rate ? motion != keeps : !(state || is_idle))
            entry[(*count)++] = (kmp_flow_entry){motion, state  ? KMP_FLOW_STATE
                                                         : rate ? KMP_FLOW_RATE
                                                                : KMP_FLOW_POSITION};
    }
    kmp_free(idle);
    return kmp_made(model->context, idles >= 0);
}

/* Makes the equations of cycles, at the state of the family, and their columns: `outputs`, and the loads. Errors as
 * kmp_flow_new. */
static kempe_status make_flow(kempe_limit_cycles *c, const char *outputs, const kempe_run_options *run)
{
    kmp_flow_entry *entry = KMP_ARENA_NEW(&c->arena, kmp_flow_entry, 2 * c->system->n);
    const kempe_run_options none = {0};
    kmp_text words = {0};
    int count;
    KMP_TRY(kmp_made(c->system->context, entry));
    KMP_TRY(list_entries(&c->family->linear, -1, &count, entry));
    kempe_status status = !put_words(c, outputs, &words) ? kmp_fail_memory(c->system->context)
                                                         : kmp_flow_new(kmp_cycles_equations(c), c->name, words.s,
                                                                        run ? run : &none, count, entry, &c->flow);
    kmp_text_free(&words);
    KMP_TRY(status);
    const kempe_sensitivity *rows = c->flow->rows;
    int *load;
    KMP_TRY(take_names(c, rows->columns, rows->column, rows->unit, &load));
    return kmp_shooting_init(&c->shooting, c->flow, c->held, load, &c->arena);
}

/* -- the first cycle ------------------------------------------------------------------------------------- */

/* The first cycle of a branch, by the eigenvector of the mode that begins to oscillate. */

enum { SMALLER_PARTS = 2 };

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
    /* The mode as the tangent of a Hopf point: the part of each start value in it at its phase 0, the change of that
     * per time, and half its range. */
    double w = modes->spectrum.im[mode];
    for (int i = 0; i < cycles->flow->size; i++) {
        ptrdiff_t at = cycles->flow->entry[i].motion + (ptrdiff_t)mode * modes->n;
        double re = KMP_CYCLE_FIRST * modes->shown_re[at], im = KMP_CYCLE_FIRST * modes->shown_im[at];
        bool rate = cycles->flow->entry[i].kind == KMP_FLOW_RATE;
        c->tangent[i] = rate ? -w * im : re;
        c->rate[i] = rate ? -w * w * re : -w * im;
        c->reach[i] = KMP_CYCLE_FIRST * hypot(modes->shown_re[at], modes->shown_im[at]) * (rate ? w : 1);
    }
    for (int i = 0; i < s->size; i++) {
        const kmp_flow_entry *e = &s->flow->entry[i];
        c->x[i] = (e->kind != KMP_FLOW_POSITION ? state->qd : state->q)[e->motion];
    }
    /* The loads at the equilibrium of a Hopf point, the last state of the family. */
    const kmp_linear *l = &cycles->family->linear;
    for (int r = 0; r < l->m; r++) {
        int k = l->system->rows[r].closure - cycles->system->model->closure_count;
        if (k >= 0 && k < cycles->held)
            c->load[k] = l->lambda[r];
    }
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

/* Puts a start on the cycle near a Hopf point into the shooting, and finds it. */
static kempe_status begin_branch(kempe_limit_cycles *cycles, const kmp_critical *critical, kmp_cycle **hopf,
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

enum { USUAL_VALUES = 31, MOST_VALUES = 10000, USUAL_CYCLES = 1000 };

/* A Hopf point is the end of another branch: relative to the range. */
#define SAME_HOPF 1e-3

/* -- options ----------------------------------------------------------------------------------------------- */

static kempe_status take_range(kempe_limit_cycles *c, const kmp_range *range)
{
    kempe_context *context = c->system->context;
    kmp_text why = {0};
    c->name = kmp_arena_strdup(&c->arena, range->name);
    c->from = range->from;
    c->to = range->to;
    c->values = range->count > 0 ? range->count : USUAL_VALUES;
    KMP_TRY(kmp_made(context, c->name));
    if (kmp_parameter_find(c->system->model, c->name) < 0 || !kmp_variant_may(c->system->model, c->name, &why)) {
        if (why.length == 0)
            kmp_text_printf(&why, "limit cycles are followed over a parameter of the model, which '%s' is not",
                            c->name);
        return kmp_fail_text(context, KEMPE_E_ARGUMENT, &why);
    }
    KMP_TRY(kmp_range_fits_variable(c->system->model, "sweep", range));
    if (c->values < 2 || c->values > MOST_VALUES || c->from == c->to)
        return kmp_fail(context, KEMPE_E_ARGUMENT, "a sweep needs two ends and 2 to %d values, as in '%s=1:2:31'",
                        MOST_VALUES, c->name);
    return KEMPE_OK;
}

/* -- equilibria -------------------------------------------------------------------------------------------- */

static kempe_status find_equilibria(kempe_limit_cycles *c)
{
    const kmp_operating_family_options options = {.name = c->name};
    double *values = KMP_ARENA_NEW(&c->arena, double, c->values);
    const kmp_range range = {.from = c->from, .to = c->to};
    KMP_TRY(kmp_made(c->system->context, values));
    for (int k = 0; k < c->values; k++)
        values[k] = kmp_range_value(&range, k, c->values);
    KMP_TRY(hold_speeds(c));
    KMP_TRY(kmp_operating_family_new(kmp_cycles_equations(c), &options, &c->family));
    kempe_status status = kmp_locus_make(c->family, c->values, values, &c->locus);
    if (status == KEMPE_STOPPED && !kmp_interrupted(c->system->context)) {
        kmp_doubt(c->system->context, "equilibria are known only from %g to %g: %s", c->from,
                  c->locus.value[c->locus.reached > 0 ? c->locus.reached - 1 : 0],
                  kempe_context_message(c->system->context));
        kmp_context_clear(c->system->context);
        status = KEMPE_OK;
    }
    return status;
}

double kmp_limit_cycles_growth(const kempe_limit_cycles *cycles, int k)
{
    const kmp_locus *l = &cycles->locus;
    double most = -INFINITY;
    for (int b = 0; b < l->count; b++)
        most = fmax(most, l->re[b + (ptrdiff_t)k * l->count]);
    return most;
}

/* -- branches ----------------------------------------------------------------------------------------------- */

/* True if a branch that was followed before ends there. */
static bool is_reached(const kempe_limit_cycles *c, const kmp_critical *at, int *branch)
{
    for (int b = 0; b < c->branches; b++) {
        const kmp_cycle_branch *x = &c->branch[b];
        double away = x->ends_at_hopf ? fabs(x->cycle[x->count - 1]->value - at->value) : INFINITY;
        if (away <= SAME_HOPF * fabs(c->to - c->from)) {
            *branch = b + 1;
            return true;
        }
    }
    return false;
}

static kempe_status follow_from(kempe_limit_cycles *c, int critical, const kmp_branch_options *ask)
{
    const kmp_critical *at = &c->locus.critical[critical];
    kmp_cycle *hopf, *first;
    kempe_context *context = c->system->context;
    kempe_status status = begin_branch(c, at, &hopf, &first);
    if (status == KEMPE_E_FAILED) {
        kmp_doubt(context, "no limit cycle is found near the Hopf point at %s = %.9g: %s", c->name, at->value,
                  kempe_context_message(context));
        kmp_context_clear(context);
        return KEMPE_OK;
    }
    KMP_TRY(status);
    kmp_cycle_branch *branch = &c->branch[c->branches++];
    c->branch_of[critical] = c->branches;
    KMP_TRY(kmp_branch_add(context, &c->arena, branch, hopf));
    return kmp_branch_follow(&c->shooting, ask, first, branch);
}

/* -- cycles that simulations reach -------------------------------------------------------------------------- */

/* For models whose forces jump or have too many contacts for Newton's method: the parameter goes up and down in steps,
 * and each simulation begins where the last one ended: its start gives the independent coordinates that move with their
 * rates, and the others are found from the model's start. A motion that has decayed begins again with the displacement
 * of the model's start. */

enum { SAMPLES = 4000, WINDOW = SAMPLES / 4 };

typedef struct stepped {
    kempe_limit_cycles *c;
    kmp_arena arena;
    kempe_run_options run;
    kmp_text words; /* of the outputs and loads */
    int *load;      /* columns of the loads */
    int count;      /* start values that vary */
    kmp_flow_entry *entry;
    char **name;        /* count + 1, the parameter first */
    bool *keeps;        /* by coordinate: the start gives it; NULL: the ones that the model gives */
    double *q, *qd;     /* by coordinate: at the model's start */
    kempe_model *model; /* a copy that gives these; NULL: it is the given one */
    kmp_variant *variant;
    kempe_system *system;
    kmp_linear none;
    double *start, *values; /* count + 1: the rates of the model; of the next simulation */
} stepped;

/* Records the model's start, and the coordinates that starts of simulations give: the independent ones that move, and
 * the travel if no closure determines it. */
static bool note_start(stepped *s, const kmp_operating *start, const kmp_linear *linear, int travel)
{
    const int n = start->system->n;
    bool *keeps = KMP_ARENA_NEW(&s->arena, bool, n);
    s->q = kmp_arena_copy(&s->arena, start->q, n, sizeof *start->q);
    s->qd = kmp_arena_copy(&s->arena, start->qd, n, sizeof *start->qd);
    for (int k = 0; keeps && k < s->count; k++)
        if (s->entry[k].kind != KMP_FLOW_STATE)
            keeps[s->entry[k].motion] = true;
    for (int k = 0; keeps && k < linear->p; k++)
        keeps[linear->part.u[k]] = keeps[linear->part.u[k]] || linear->part.u[k] == travel;
    s->keeps = kmp_charts_are_own(start->system, start->chart) ? keeps : NULL;
    return !s->arena.failed;
}

/* Takes the start with the coordinate of the travel as an independent one, unless closures decide it. */
static kempe_status take_start(kmp_operating *start, kmp_linear *linear, int travel)
{
    kempe_status status = travel >= 0 ? kmp_operating_take(start, linear, &travel, 1) : KEMPE_E_FAILED;
    if (status == KEMPE_OK || status == KEMPE_E_MEMORY)
        return status;
    kmp_context_clear(start->system->context);
    return kmp_operating_take(start, linear, NULL, 0);
}

static kempe_status find_entries(stepped *s)
{
    kmp_operating *start = NULL;
    kmp_linear linear;
    const kempe_system *system = kmp_cycles_equations(s->c);
    s->entry = KMP_ARENA_NEW(&s->arena, kmp_flow_entry, 2 * system->n);
    KMP_TRY(kmp_made(system->context, s->entry));
    KMP_TRY(kmp_operating_new(system, "start", NULL, &start));
    kempe_status status = kmp_linear_init(&linear, system, kmp_backend_default());
    if (status == KEMPE_OK) {
        /* The coordinate along which a vehicle on rails moves fastest at the start: its speed keeps its start value.
         */
        const kempe_model *model = system->model;
        int travel = -1;
        for (int i = 0; model->wheel_count > 0 && i < kmp_model_coordinates(model); i++)
            if (!model->motions[i].rotation && model->start.qd[i].value != 0 &&
                (travel < 0 || fabs(model->start.qd[i].value) > fabs(model->start.qd[travel].value)))
                travel = i;
        status = take_start(start, &linear, travel);
        if (status == KEMPE_OK) {
            kmp_linear_matrices(&linear);
            status = list_entries(&linear, travel, &s->count, s->entry);
            if (status == KEMPE_OK)
                status = kmp_made(system->context, note_start(s, start, &linear, travel));
        }
        kmp_linear_free(&linear);
    }
    kmp_operating_free(start);
    return status;
}

static bool name_entries(stepped *s)
{
    const kempe_model *model = s->c->system->model;
    s->name = KMP_ARENA_NEW(&s->arena, char *, s->count + 1);
    KMP_ARENA_EACH(&s->arena, double, s->count + 1, &s->start, &s->values);
    if (s->arena.failed)
        return false;
    s->name[0] = s->c->name;
    for (int k = 0; k < s->count; k++) {
        const kmp_flow_entry *e = &s->entry[k];
        s->name[k + 1] = kmp_arena_printf(&s->arena, "%s.%s", kmp_flow_kinds[e->kind], kmp_flow_name(model, e));
        s->start[k + 1] = e->kind == KMP_FLOW_STATE      ? model->start.qd[e->motion].value
                          : e->kind == KMP_FLOW_POSITION ? s->q[e->motion]
                                                         : s->qd[e->motion];
    }
    memcpy(s->values, s->start, (size_t)(s->count + 1) * sizeof *s->values);
    return !s->arena.failed;
}

/* -- a simulation ------------------------------------------------------------------------------------------ */

/* Largest and least value of an output in a window. */
static void find_range(const double *x, int first, int count, double *high, double *low)
{
    *high = *low = x[first];
    for (int k = first; k < first + count; k++) {
        *high = fmax(*high, x[k]);
        *low = fmin(*low, x[k]);
    }
}

/* The mean time between upward passes of the middle of a range; NaN: fewer than two. */
static double period_of(const double *t, const double *x, int first, int count, double middle)
{
    double begin = NAN, end = NAN;
    int passes = 0;
    for (int k = first + 1; k < first + count; k++) {
        if (!(x[k - 1] < middle && x[k] >= middle))
            continue;
        end = t[k - 1] + (t[k] - t[k - 1]) * (middle - x[k - 1]) / (x[k] - x[k - 1]);
        begin = passes++ == 0 ? end : begin;
    }
    return passes > 1 ? (end - begin) / (passes - 1) : NAN;
}

/* An output in the last window, and the window before it. */
static void take_output(const kempe_table *rows, int k, kmp_cycle *x, double *before)
{
    int count = kempe_table_row_count(rows), window = count / 4;
    const double *t = kempe_table_values(rows, 0), *y = kempe_table_values(rows, k + 1);
    double high, low, high_of_all, low_of_all;
    find_range(y, count - window, window, &x->high[k], &x->low[k]);
    find_range(y, count - 2 * window, window, &high, &low);
    double size = x->high[k] - x->low[k], shift = fabs(x->high[k] + x->low[k] - high - low) / 2;
    /* the middle moves by as much as the window is wide, and both ends of the window differ by that */
    if (shift > size / 4 && fabs(y[count - 1] - y[count - window]) > size / 2) {
        x->high[k] = x->low[k] = NAN;
        return;
    }
    *before = fmax(*before, (high - low) / 2);
    find_range(y, 0, count, &high_of_all, &low_of_all);
    x->moved = x->moved || high_of_all - low_of_all > KMP_CYCLE_UNMOVED;
    if (size > 0)
        x->residual = fmax(x->residual, fmax(fabs(x->high[k] - high), fabs(x->low[k] - low)) / size);
    if (isnan(x->period))
        x->period = period_of(t, y, count - window, window, (x->high[k] + x->low[k]) / 2);
}

/* The cycle in the last window of rows; it has settled if the window before has the same ranges. */
static kempe_status take_cycle(stepped *s, const kempe_table *rows, double value, kmp_cycle **cycle)
{
    kempe_limit_cycles *c = s->c;
    kmp_cycle *x = KMP_ARENA_NEW(&c->arena, kmp_cycle, 1);
    double *high, *low, *load = NULL, before = 0;
    KMP_TRY(kmp_made(c->system->context, x && KMP_ARENA_EACH(&c->arena, double, c->outputs, &high, &low) &&
                                             KMP_ARENA_EACH(&c->arena, double, c->held, &load)));
    *x = (kmp_cycle){.value = value, .period = NAN, .along = NAN, .high = high, .low = low, .load = load};
    /* Means of the loads in the last window. */
    int count = kempe_table_row_count(rows), window = count / 4;
    for (int k = 0; load && s->load && k < c->held; k++) {
        for (int row = count - window; row < count; row++)
            load[k] += kempe_table_values(rows, s->load[k] + 1)[row];
        load[k] /= window;
    }
    for (int k = 0; k < c->outputs; k++)
        take_output(rows, k, x, &before);
    for (int k = 0; k < c->outputs; k++)
        x->amplitude = fmax(x->amplitude, kmp_cycle_amplitude(x, k));
    x->growing = x->amplitude > before;
    x->stability = x->residual <= KMP_CYCLE_SETTLED ? KMP_CYCLE_STABLE : KMP_CYCLE_UNDECIDED;
    *cycle = x;
    return KEMPE_OK;
}

static kempe_status name_outputs(stepped *s, const kempe_table *rows)
{
    int count = kempe_table_column_count(rows) - 1;
    char **list = KMP_ARENA_NEW(&s->arena, char *, 2 * count);
    KMP_TRY(kmp_made(s->c->system->context, list));
    for (int k = 0; k < count; k++) {
        list[k] = kmp_arena_strdup(&s->arena, kempe_table_column_name(rows, k + 1));
        list[count + k] = kmp_arena_strdup(&s->arena, kempe_table_unit(rows, k + 1));
    }
    KMP_TRY(kmp_made(s->c->system->context, !s->arena.failed));
    return take_names(s->c, count, list, list + count, &s->load);
}

static kempe_status simulate(stepped *s, double value, kmp_cycle **cycle)
{
    kempe_context *context = s->c->system->context;
    kempe_trajectory *motion = NULL;
    kempe_table *rows = NULL;
    s->values[0] = value;
    KMP_TRY(kmp_linear_vary(&s->none, s->system, s->variant, s->values));
    kempe_status status = kmp_simulate(s->system, &s->run, &motion);
    const kmp_shown_in shown = kmp_context_show_in(context, (kmp_shown_in){0});
    if (status == KEMPE_OK)
        status = kempe_trajectory_outputs(motion, s->words.s, &rows);
    if (status == KEMPE_OK && s->c->outputs == 0)
        status = name_outputs(s, rows);
    if (status == KEMPE_OK)
        status = take_cycle(s, rows, value, cycle);
    (void)kmp_context_show_in(context, shown);
    if (status == KEMPE_OK) {
        /* The start of the next simulation. */
        int last = kempe_trajectory_row_count(motion) - 1;
        const double *q = kempe_trajectory_q(motion, last), *qd = kempe_trajectory_qd(motion, last);
        for (int k = 0; k < s->count; k++)
            s->values[k + 1] = (s->entry[k].kind == KMP_FLOW_POSITION ? q : qd)[s->entry[k].motion];
    }
    kempe_table_free(rows);
    kempe_trajectory_free(motion);
    return status;
}

/* -- up and down --------------------------------------------------------------------------------------------- */

/* Motions that have decayed to a small part of the largest one, or still decay from there, are at rest. A simulation
 * that begins at rest without a disturbance shows no stability. */
static void find_rests(kempe_limit_cycles *c)
{
    double largest = 0;
    int still = 0, count = 0;
    for (int b = 0; b < c->branches; b++)
        for (int k = 0; k < c->branch[b].count; k++)
            largest = fmax(largest, c->branch[b].cycle[k]->amplitude);
    for (int b = 0; b < c->branches; b++)
        for (int k = 0; k < c->branch[b].count; k++, count++) {
            kmp_cycle *x = c->branch[b].cycle[k];
            const bool small = x->amplitude <= KMP_CYCLE_RESTS * largest;
            still += !x->moved;
            if (x->moved && !small && (x->growing || x->amplitude > KMP_CYCLE_DECAYED * largest))
                continue;
            x->word = KMP_CYCLE_REST;
            x->stability = x->moved ? KMP_CYCLE_STABLE : KMP_CYCLE_UNDECIDED;
        }
    if (still > 0)
        kmp_log(
            c->system->context, KEMPE_LOG_WARNING,
            "in %d of %d simulations nothing moves, so that they show no stability: give the start a disturbance, as a "
            "displacement (start: q)",
            still, count);
}

static kempe_status step_up_and_down(stepped *s)
{
    kempe_limit_cycles *c = s->c;
    KMP_TRY(find_entries(s));
    KMP_TRY(kmp_made(c->system->context, name_entries(s)));
    /* The equations, with start values that vary. */
    const kempe_model *model = kmp_cycles_equations(s->c)->model;
    const kmp_driven start = {.hold = s->keeps, .q = s->q};
    if (s->keeps) {
        KMP_TRY(kmp_driven_model(model, &start, &s->model));
        model = s->model;
    }
    KMP_TRY(kmp_variant_new(model, s->count + 1, (const char *const *)s->name, &s->variant));
    KMP_TRY(kmp_system_of_variant(s->variant, &s->system));
    s->system->kept_length = c->system->length;
    c->branch = KMP_ARENA_NEW(&c->arena, kmp_cycle_branch, 2);
    KMP_TRY(kmp_made(c->system->context, c->branch));
    for (int b = 0; b < 2; b++) {
        c->branches = b + 1;
        /* Each simulation begins where the last one ended, or from the start where the motion has decayed. */
        const kmp_range range = {.from = c->from, .to = c->to};
        double most = 0;
        for (int k = 0; k < c->values; k++) {
            kmp_cycle *x = NULL;
            KMP_TRY(simulate(s, kmp_range_value(&range, b == 0 ? k : c->values - 1 - k, c->values), &x));
            KMP_TRY(kmp_branch_add(c->system->context, &c->arena, &c->branch[b], x));
            most = fmax(most, x->amplitude);
            if (!x->growing && x->amplitude <= KMP_CYCLE_DECAYED * most)
                memcpy(s->values + 1, s->start + 1, (size_t)s->count * sizeof *s->values);
            kmp_progress(c->system->context, KMP_PROGRESS_STUDY, b * c->values + k + 1, 2 * c->values, "simulations");
        }
        c->branch[b].end =
            kmp_arena_printf(&c->arena, "from %.9g to %.9g", b == 0 ? c->from : c->to, b == 0 ? c->to : c->from);
    }
    find_rests(c);
    return KEMPE_OK;
}

/* Simulates at each value of the sweep, up and down, each time from the last state: a branch for each direction.
 * (limit_cycles_study.c) */
static kempe_status settled_cycles(kempe_limit_cycles *cycles, const char *outputs, const kempe_run_options *run)
{
    stepped s = {.c = cycles};
    KMP_TRY(hold_speeds(cycles));
    if (run)
        s.run = *run;
    s.run.t_end = cycles->settle;
    s.run.output_step = cycles->settle / SAMPLES;
    s.run.no_convergence_check = 1;
    kempe_status status = kmp_made(cycles->system->context, put_words(cycles, outputs, &s.words));
    if (status == KEMPE_OK)
        status = step_up_and_down(&s);
    kmp_text_free(&s.words);
    kempe_system_free(s.system);
    kmp_variant_free(s.variant);
    kempe_model_free(s.model);
    kmp_arena_free(&s.arena);
    return status;
}

/* -- construction -------------------------------------------------------------------------------------------- */

static kempe_status make(kempe_limit_cycles *c, const kempe_limit_cycles_options *options)
{
    kempe_context *context = c->system->context;
    const kempe_model *model = c->system->model;
    const char *outputs = options->outputs ? options->outputs : model->state_count > 0 ? "q,state" : "q";
    kmp_ranges ranges;
    if (!options->sweep)
        return kmp_fail(context, KEMPE_E_ARGUMENT,
                        "limit cycles need a parameter and its range, as in --sweep NAME=A:B:N");
    KMP_TRY(kmp_ranges_read(context, options->sweep, &ranges));
    kempe_status status = ranges.count == 1
                              ? take_range(c, &ranges.range[0])
                              : kmp_fail(context, KEMPE_E_ARGUMENT,
                                         "only one parameter can be swept, as in '%s=1:2:31'", ranges.range[0].name);
    kmp_ranges_free(&ranges);
    KMP_TRY(status);
    c->settle = options->settle;
    if (c->settle > 0)
        return settled_cycles(c, outputs, options->run);
    KMP_TRY(kmp_refuse_samples(model, "limit cycles", true));
    KMP_TRY(kmp_refuse_friction(model, "limit cycles"));
    KMP_TRY(kmp_refuse_contacts(model, "limit cycles"));
    KMP_TRY(kmp_refuse_delays(model, "limit cycles", "simulate it, and read the amplitudes of its last periods"));
    KMP_TRY(find_equilibria(c));
    /* A branch from each Hopf point that no other branch reaches. */
    const kmp_branch_options ask = {c->from, c->to, c->values, options->most > 0 ? options->most : USUAL_CYCLES};
    int count = c->locus.critical_count;
    c->branch = KMP_ARENA_NEW(&c->arena, kmp_cycle_branch, count);
    c->branch_of = KMP_ARENA_NEW(&c->arena, int, count);
    KMP_TRY(kmp_made(c->system->context, !c->arena.failed));
    for (int k = 0; k < count; k++) {
        const kmp_critical *at = &c->locus.critical[k];
        if (!(at->im > 0) || is_reached(c, at, &c->branch_of[k]))
            continue;
        if (!c->flow) {
            kmp_modes modes;
            KMP_TRY(kmp_operating_family_go(c->family, at->value, &modes));
            kmp_modes_free(&modes);
            KMP_TRY(make_flow(c, outputs, options->run));
        }
        KMP_TRY(follow_from(c, k, &ask));
    }
    return KEMPE_OK;
}

kempe_status kempe_limit_cycles_new(const kempe_system *system, const kempe_limit_cycles_options *options,
                                    kempe_limit_cycles **cycles)
{
    KMP_WANTED_BOTH(system, cycles);
    KMP_OPTIONS(system->context, kempe_limit_cycles_options, options);
    const kempe_run_options *run = options->run;
    KMP_OPTIONS(system->context, kempe_run_options, run);
    KMP_TRY(kmp_run_options_check(system->context, run, KMP_STUDY_CYCLES));
    double begin = kmp_cpu_now();
    kmp_model_begin_forces(system->model);
    KMP_MAKE(system->context, kempe_limit_cycles, c);
    c->system = system;
    kempe_status status = make(c, options);
    if (status == KEMPE_STOPPED)
        c->reason = kmp_arena_strdup(&c->arena, "interrupted");
    c->status = status = kmp_context_verdict(system->context, status);
    c->warnings = kmp_context_warnings(system->context);
    c->cpu_s = kmp_cpu_now() - begin;
    return KMP_GIVE_IF(kmp_is_complete(status) || (status == KEMPE_STOPPED && c->name), status, cycles, c,
                       kempe_limit_cycles_free);
}

KMP_FREES(kempe_limit_cycles, cycles, kmp_shooting_free(&cycles->shooting), kmp_flow_free(cycles->flow),
          kmp_locus_free(&cycles->locus), kmp_operating_family_free(cycles->family), kempe_system_free(cycles->driven),
          kempe_model_free(cycles->copy), kmp_free(cycles->warnings), kmp_arena_free(&cycles->arena))

/* -- queries -------------------------------------------------------------------------------------------------- */

KMP_GETTER(int kempe_limit_cycles_branch_count(const kempe_limit_cycles *cycles), cycles, cycles->branches, 0)
KMP_GETTER_AT(int kempe_limit_cycles_count(const kempe_limit_cycles *cycles, int branch), cycles, branch,
              cycles->branches, cycles->branch[branch].count, 0)

const char *kmp_cycles_load_unit(const kempe_limit_cycles *c, int k)
{
    return c->system->model->motions[c->held_motion[k]].rotation ? "N m" : "N";
}
