/* SPDX-License-Identifier: BSD-3-Clause */
/* Limit cycles as simulations reach them, for models whose forces jump or have too many contacts for Newton's method:
 * the parameter goes up and down in steps, and each simulation begins where the last one ended: its start gives the
 * independent coordinates that move with their rates, and the others are found from the model's start. A motion that
 * has decayed begins again with the displacement of the model's start. */
#include "analyses/limit_cycles/settled_cycles.h"
#include "analyses/limit_cycles/limit_cycles_study.h"
#include "base/memory.h"
#include "constraints/evaluation/charts.h"
#include "constraints/inexact/nearest_exact.h"
#include "constraints/tolerances.h"
#include "model/data/model.h"
#include "model/language/ranges.h"
#include "pipeline.h"
#include <math.h>
#include <string.h>

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
    bool *keeps;        /* by coordinate: the start gives it; NULL: those that the model gives */
    double *q, *qd;     /* by coordinate: at the model's start */
    kempe_model *model; /* a copy that gives these; NULL: it is the given one */
    kmp_variant *variant;
    kempe_system *system;
    kmp_linear none;
    double *start, *values; /* count + 1: those of the model; of the next simulation */
} stepped;

/* -- start values ----------------------------------------------------------------------------------------- */

/* Records the model's start, and the coordinates that starts of simulations give: the independent ones that move, and
 * that of the travel if no closure decides it. */
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
        /* The coordinate along which a vehicle on rails moves fastest at the start: its speed stays that of the start.
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
            status = kmp_moving_entries(&linear, travel, &s->count, s->entry);
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
    double high, low;
    find_range(y, count - window, window, &x->high[k], &x->low[k]);
    find_range(y, count - 2 * window, window, &high, &low);
    double size = x->high[k] - x->low[k], shift = fabs(x->high[k] + x->low[k] - high - low) / 2;
    /* the middle moves by as much as the window is wide, and both ends of the window differ by that */
    if (shift > size / 4 && fabs(y[count - 1] - y[count - window]) > size / 2) {
        x->high[k] = x->low[k] = NAN;
        return;
    }
    *before = fmax(*before, (high - low) / 2);
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
    return kmp_cycles_name(s->c, count, list, list + count, &s->load);
}

static kempe_status simulate(stepped *s, double value, kmp_cycle **cycle)
{
    kempe_context *context = s->c->system->context;
    kempe_trajectory *motion = NULL;
    kempe_table *rows = NULL;
    s->values[0] = value;
    KMP_TRY(kmp_linear_vary(&s->none, s->system, s->variant, s->values));
    kempe_status status = kmp_simulate(s->system, &s->run, &motion);
    bool degrees = kmp_context_use_degrees(context, false);
    if (status == KEMPE_OK)
        status = kempe_trajectory_outputs(motion, s->words.s, &rows);
    if (status == KEMPE_OK && s->c->outputs == 0)
        status = name_outputs(s, rows);
    if (status == KEMPE_OK)
        status = take_cycle(s, rows, value, cycle);
    (void)kmp_context_use_degrees(context, degrees);
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

static kempe_status step_up_and_down(stepped *s)
{
    kempe_limit_cycles *c = s->c;
    KMP_TRY(find_entries(s));
    KMP_TRY(kmp_made(c->system->context, name_entries(s)));
    /* The equations, with start values that vary. */
    const kempe_model *model = kmp_cycles_equations(s->c)->model;
    const kmp_driven start = {.hold = s->keeps, .q = s->q};
    if (s->keeps) {
        KMP_TRY(kmp_variant_driven(model, &start, &s->model));
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
            kmp_cycle *x;
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
    /* Motions that have decayed to a small part of the largest one, or still decay from there, are at rest. */
    double largest = 0;
    for (int b = 0; b < c->branches; b++)
        for (int k = 0; k < c->branch[b].count; k++)
            largest = fmax(largest, c->branch[b].cycle[k]->amplitude);
    for (int b = 0; b < c->branches; b++)
        for (int k = 0; k < c->branch[b].count; k++) {
            kmp_cycle *x = c->branch[b].cycle[k];
            bool small = x->amplitude <= KMP_CYCLE_RESTS * largest;
            if (small || (!x->growing && x->amplitude <= KMP_CYCLE_DECAYED * largest)) {
                x->word = KMP_CYCLE_REST;
                x->stability = KMP_CYCLE_STABLE;
            }
        }
    return KEMPE_OK;
}

kempe_status kmp_settled_cycles(kempe_limit_cycles *cycles, const char *outputs, const kempe_run_options *run)
{
    stepped s = {.c = cycles};
    KMP_TRY(kmp_cycles_hold_speed(cycles));
    if (run)
        s.run = *run;
    s.run.t_end = cycles->settle;
    s.run.output_step = cycles->settle / SAMPLES;
    s.run.no_convergence_check = 1;
    kempe_status status = kmp_made(cycles->system->context, kmp_cycles_words(cycles, outputs, &s.words));
    if (status == KEMPE_OK)
        status = step_up_and_down(&s);
    kmp_text_free(&s.words);
    kempe_system_free(s.system);
    kmp_variant_free(s.variant);
    kempe_model_free(s.model);
    kmp_arena_free(&s.arena);
    return status;
}
