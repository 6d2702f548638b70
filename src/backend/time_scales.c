/* SPDX-License-Identifier: BSD-3-Clause */
/* Pulses found before a run: functions only of time are collected, evaluated with bounds over intervals, and intervals
 * halved until each is known by its values. The ends of the short ones limit steps. */
#include "backend/time_scales.h"
#include "backend/bounds.h"
#include "base/context.h"
#include "base/quantile.h"
#include "dynamics/kinematics/kinematics_numbers.h"
#include "dynamics/kinematics/link_tree.h"
#include "model/data/model.h"
#include "model/data/rope.h"
#include "model/data/tyre.h"
#include "model/language/expression_value.h"
#include <math.h>
#include <string.h>

enum {
    MOST = 32,              /* functions that are studied together */
    FIRST = 8,              /* equal intervals whose ends give the first sizes, which may be too small */
    DEEPEST = 26,           /* halvings: a jump is not resolved further */
    MOST_INTERVALS = 20000, /* of a run; more of them have no place in memory */
    MOST_HALVINGS = 500000, /* of a study: a second for a short function */
    MOST_FINE = 50000,      /* of one by the range of the functions, which may be small against their values */
    CONTRAST = 64           /* times the shortest interval: the longest one, where some are short */
};
/* Part of the range of a function by which it may differ from a straight line within half an interval; and part of its
 * largest value that is rounding. */
static const double KNOWN = 0.05, ROUNDED = 1e-9;

/* -- the functions ----------------------------------------------------------------------------------------- */

typedef struct study {
    const kempe_model *model;
    kmp_timed_functions which;
    const kmp_expr *function[MOST];
    const char *name[MOST];
    int skipped, passed, count; /* functions of earlier studies, the ones met so far, the ones of this one */
    const kmp_program *program;
    kmp_bounds *bounds;
    kmp_arena *aside; /* of this study */
    double *end;      /* NULL: none, or no memory */
    int ends, halvings;
    long all_halvings; /* of this study's divisions */
    double shortest, longest;
    double late;                       /* s, by which the functions act after their time: of signals with a delay */
    double least[MOST], largest[MOST]; /* values so far */
    double size[MOST];                 /* their range, or where that leads to too many intervals the largest modulus */
    bool coarse;                       /* the latter */
} study;

static bool has_time(const kmp_expr *e)
{
    return kmp_expr_find_named(e, kmp_expr_is_time, NULL);
}

/* Inputs have separate limits, and pulses that they give are conditions. */
static bool depends_on_more(const kmp_expr *e, const void *user)
{
    (void)user;
    return e->kind == KMP_EXPR_Q || e->kind == KMP_EXPR_QD || e->kind == KMP_EXPR_LAMBDA || e->kind == KMP_EXPR_PLACE ||
           e->kind == KMP_EXPR_MEASURE || e->kind == KMP_EXPR_RATE || e->kind == KMP_EXPR_CUT ||
           e->kind == KMP_EXPR_INPUT || (e->kind == KMP_EXPR_UNKNOWN && !(e->unknowns && e->unknowns->count == 0));
}

/* A function of time that may be short: sums and products of polynomials, sines and cosines are not. */
static bool may_be_short(const kmp_expr *e, const void *user)
{
    (void)user;
    bool calls = e->kind == KMP_EXPR_CALL && e->function != KMP_FUNCTION_sin && e->function != KMP_FUNCTION_cos &&
                 e->function != KMP_FUNCTION_abs && e->function != KMP_FUNCTION_min &&
                 e->function != KMP_FUNCTION_max && e->function != KMP_FUNCTION_sign && e->function != KMP_FUNCTION_if;
    bool divides = e->kind == KMP_EXPR_DIV && has_time(e->b);
    bool powers = e->kind == KMP_EXPR_POW && !(e->b->kind == KMP_EXPR_NUMBER && e->b->value >= 0 && e->b->value <= 4);
    return (calls || divides || powers || e->kind == KMP_EXPR_TABLE) && has_time(e);
}

/* A function that may jump, by a condition. */
static bool may_jump(const kmp_expr *e, const void *user)
{
    return kmp_expr_compares(e, user) || (e->kind == KMP_EXPR_CALL && e->function == KMP_FUNCTION_if);
}

static bool counts(const study *s, const kmp_expr *e)
{
    return kmp_expr_find_named(e, may_be_short, NULL) ||
           (s->which == KMP_TIMED_ALL && !kmp_expr_find_named(e, may_jump, NULL));
}

/* Adds the largest parts of an expression that depend only on time. */
static void add(study *s, const kmp_expr *e, const char *name)
{
    if (!e || s->count == MOST || !has_time(e))
        return;
    const bool timed = !kmp_expr_find_named(e, depends_on_more, NULL);
    if (timed && (s->which == KMP_TIMED_SHORT || counts(s, e))) {
        if (!counts(s, e) || s->passed++ < s->skipped)
            return;
        s->name[s->count] = name;
        s->function[s->count++] = e;
        return;
    }
    if (e->kind == KMP_EXPR_UNKNOWN && s->model->unknowns[e->index].count == 0)
        add(s, s->model->unknowns[e->index].zero[0], name);
    if (e->kind == KMP_EXPR_UNKNOWN)
        return;
    add(s, e->a, name);
    add(s, e->b, name);
    add(s, e->c, name);
}

static void add_all(study *s)
{
    const kempe_model *m = s->model;
    for (const kmp_force *f = m->forces; f < m->forces + m->force_count; f++) {
        add(s, f->effort, f->name);
        add(s, f->holding_effort, f->name);
        add(s, f->sliding, f->name);
        add(s, f->touch.gap, f->name);
        for (int k = 0; k < 3; k++)
            add(s, f->vector[k], f->name);
    }
    for (const kmp_closure *c = m->closures; c < m->closures + m->closure_count; c++) {
        add(s, c->function, c->name);
        for (int k = 0; k < c->curve_count; k++)
            add(s, c->curve[k], c->name);
    }
    for (int k = 0; k < m->rope_count; k++)
        add(s, m->ropes[k].length, m->ropes[k].name);
    for (int k = 0; k < m->road_count; k++)
        add(s, m->roads[k].height, m->roads[k].name);
    for (int k = 0; k < m->state_count; k++)
        add(s, kmp_state_rate(m, k), m->states[k].name);
    for (int k = 0; k < m->unknowns_count; k++)
        for (int i = 0; i < m->unknowns[k].count; i++)
            add(s, m->unknowns[k].zero[i], m->unknowns[k].name);
}

static kmp_program *program_of(study *s)
{
    kmp_graph *graph = kmp_graph_new();
    if (!graph)
        return NULL;
    const kmp_tree tree = {.graph = graph, .model = s->model};
    kmp_ref out[MOST];
    const kmp_ref *const group[] = {out};
    for (int k = 0; k < s->count; k++)
        out[k] = kmp_tree_expression(&tree, s->function[k]);
    kmp_program *program = kmp_graph_failed(graph) ? NULL : kmp_program_new(graph, 1, &s->count, group);
    kmp_graph_free(graph);
    return program;
}

/* -- intervals --------------------------------------------------------------------------------------------- */

static void look(study *s, const double *parameters, double from, double to)
{
    for (int k = 0; k < s->program->input_count; k++) {
        const kmp_program_input *in = &s->program->input[k];
        double value = in->kind == KMP_IN_TIME ? 0 : parameters[in->index];
        kmp_bounds_set(s->bounds, k,
                       in->kind == KMP_IN_TIME ? (kmp_bound){from, to, 1, 1} : (kmp_bound){value, value, 0, 0});
    }
    kmp_bounds_run(s->bounds, true);
}

static void values_at(study *s, const double *parameters, double t, double *value)
{
    look(s, parameters, t, t);
    for (int k = 0; k < s->count; k++) {
        kmp_bound bound = kmp_bounds_get(s->bounds, k);
        value[k] = bound.low + (bound.high - bound.low) / 2;
        if (!isfinite(value[k]))
            continue;
        s->least[k] = fmin(s->least[k], value[k]);
        s->largest[k] = fmax(s->largest[k], value[k]);
        const double modulus = fmax(fabs(s->least[k]), fabs(s->largest[k]));
        s->size[k] = s->coarse ? modulus : fmax(s->largest[k] - s->least[k], ROUNDED * modulus);
    }
}

/* True if the functions stay near their values at the ends of an interval. A function without values at both ends, as
 * sqrt(1 - t) for t > 1, is not asked: the motion has ended before. */
static bool is_known(study *s, const double *parameters, double a, double b, const double *x, const double *y)
{
    look(s, parameters, a, b);
    for (int k = 0; k < s->count; k++) {
        kmp_bound bound = kmp_bounds_get(s->bounds, k);
        double off = KNOWN * s->size[k];
        if (isnan(x[k]) && isnan(y[k]))
            continue;
        if (!(bound.low >= fmin(x[k], y[k]) - off && bound.high <= fmax(x[k], y[k]) + off))
            return false;
    }
    return true;
}

/* Sources of what is known of an interval: bounds of the functions, only their values, or its parts. */
typedef enum knowledge { BY_BOUNDS, BY_VALUES, BY_PARTS } knowledge;

/* True if some functions change in more intervals than are kept, or were not known after many halvings. */
static bool ended_early(const study *s)
{
    return s->ends >= MOST_INTERVALS || s->halvings >= (s->coarse ? MOST_HALVINGS : MOST_FINE);
}

/* Bounds do not know a function around a place where it is continuous by jumps that cancel, as a periodic table where a
 * period ends: intervals there are joined with their neighbours while the values show nothing. */
static knowledge halve(study *s, const double *parameters, int depth, double a, double b, const double *x,
                       const double *y)
{
    double m = a + (b - a) / 2, middle[MOST] = {0};
    if (ended_early(s) || s->aside->failed)
        return BY_PARTS;
    s->halvings++;
    values_at(s, parameters, m, middle);
    bool even = true; /* the function is straight here */
    for (int k = 0; k < s->count; k++)
        even = even && !(fabs(middle[k] - (x[k] + y[k]) / 2) > KNOWN * s->size[k]);
    const bool known = even && is_known(s, parameters, a, m, x, middle) && is_known(s, parameters, m, b, middle, y);
    const int before = s->ends;
    const double longest = s->longest, shortest = s->shortest;
    knowledge parts[2] = {BY_BOUNDS, BY_VALUES};
    if (depth < DEEPEST && !known) {
        parts[0] = halve(s, parameters, depth + 1, a, m, x, middle);
        parts[1] = halve(s, parameters, depth + 1, m, b, middle, y);
        if (!even || parts[0] == BY_PARTS || parts[1] == BY_PARTS || (parts[0] == BY_BOUNDS && parts[1] == BY_BOUNDS))
            return BY_PARTS;
        s->ends = before;
    }
    s->longest = fmax(longest, b - a);
    s->shortest = known ? fmin(shortest, b - a) : shortest;
    s->end = kmp_arena_room(s->aside, s->end, s->ends, sizeof *s->end);
    if (s->end)
        s->end[s->ends++] = b;
    return known ? BY_BOUNDS : even ? BY_VALUES : BY_PARTS;
}

static void divide(study *s, const double *parameters, double from, double to)
{
    double x[MOST] = {0}, y[MOST] = {0};
    s->ends = s->halvings = 0;
    s->end = NULL;
    s->longest = 0;
    s->shortest = INFINITY;
    values_at(s, parameters, from, x);
    values_at(s, parameters, to, y);
    (void)halve(s, parameters, 0, from, to, x, y);
    s->all_halvings += s->halvings;
}

/* Divides a span, twice where the first division has found values that are much larger than those before it. */
static void divide_twice(study *s, const double *parameters, const double span[2])
{
    double value[MOST], before[MOST];
    bool grown = false;
    for (int k = 0; k <= FIRST; k++)
        values_at(s, parameters, span[0] + k * (span[1] - span[0]) / FIRST, value);
    memcpy(before, s->size, sizeof before);
    divide(s, parameters, span[0], span[1]);
    for (int k = 0; k < s->count; k++)
        grown = grown || s->size[k] > 2 * before[k];
    if (grown)
        divide(s, parameters, span[0], span[1]);
}

/* Adds the intervals of a study to the intervals of others. False: no memory. */
static bool add_ends(const study *s, kmp_arena *arena, kmp_time_scales *found)
{
    double *end = KMP_ARENA_NEW(arena, double, found->count + s->ends);
    if (!end)
        return false;
    if (found->count > 0)
        memcpy(end, found->end, (size_t)found->count * sizeof *end);
    for (int k = 0; k < s->ends; k++)
        end[found->count + k] = s->end[k] + s->late;
    found->end = end;
    found->count += s->ends;
    found->shortest = fmin(found->shortest, s->shortest);
    kmp_order(found->count, end);
    return true;
}

/* Studies the functions of `s`. False: no memory. */
static bool find_together(study *s, const double *parameters, const double span[2], kmp_arena *arena,
                          kmp_time_scales *found)
{
    kmp_arena aside = {0};
    kmp_program *program = program_of(s);
    s->program = program;
    s->bounds = program ? kmp_bounds_new(program, &aside) : NULL;
    for (int k = 0; k < s->count; k++) {
        s->least[k] = INFINITY;
        s->largest[k] = -INFINITY;
    }
    for (int k = 0; program && k < program->input_count; k++)
        found->varies = found->varies || program->input[k].kind != KMP_IN_TIME;
    s->aside = &aside;
    if (s->bounds) {
        for (int coarse = 0; coarse < 2 && (coarse == 0 || ended_early(s)); coarse++) {
            s->coarse = coarse > 0;
            divide_twice(s, parameters, span);
        }
    }
    bool made = s->bounds && !aside.failed;
    if (made && (s->which != KMP_TIMED_SHORT || s->longest >= CONTRAST * s->shortest))
        made = add_ends(s, arena, found);
    found->halvings += s->all_halvings;
    if (ended_early(s)) {
        found->open = s->name[0];
        found->open_count = s->count;
        found->shortest = fmin(found->shortest, s->shortest);
    }
    s->aside = NULL;
    kmp_arena_free(&aside);
    kmp_program_free(program);
    return made;
}

/* Finds the intervals of one function of a signal with a delay, from and to some times. False: no memory. */
static bool find_signal(study s, const kmp_expr *signal, const char *name, const double *parameters,
                        const double times[2], kmp_arena *arena, kmp_time_scales *found)
{
    add(&s, signal, name);
    return s.count == 0 || !(times[1] > times[0]) || find_together(&s, parameters, times, arena, found);
}

/* Finds the intervals of a signal of time with a delay, where it is recorded and where it acts, and of the one before
 * the start, which acts behind it. False: no memory. */
static bool find_delayed(const kempe_model *model, const kmp_state *state, const double *parameters,
                         const double span[2], kmp_arena *arena, kmp_time_scales *found)
{
    const double delay = kmp_number_at(&state->delay, parameters);
    study here = {.model = model, .which = KMP_TIMED_SHORT}, later = here;
    later.late = delay;
    const double before[2] = {span[0] - delay, fmin(span[0], span[1] - delay)}, acting[2] = {span[0], span[1] - delay};
    return find_signal(here, state->delayed, state->name, parameters, span, arena, found) &&
           find_signal(later, state->delayed, state->name, parameters, acting, arena, found) &&
           find_signal(later, state->before, state->name, parameters, before, arena, found);
}

kempe_status kmp_time_scales_find(const kempe_model *model, const double *parameters, double from, double to,
                                  kmp_timed_functions which, kmp_arena *arena, kmp_time_scales *found)
{
    bool made = true;
    *found = (kmp_time_scales){.shortest = INFINITY};
    for (int skipped = 0, count = MOST; made && to > from && count == MOST; skipped += count) {
        study s = {.model = model, .which = which, .skipped = skipped};
        add_all(&s);
        count = s.count;
        made = count == 0 || find_together(&s, parameters, (const double[]){from, to}, arena, found);
    }
    for (int k = 0; k < model->state_count && made && to > from; k++)
        made = find_delayed(model, &model->states[k], parameters, (const double[]){from, to}, arena, found);
    return kmp_made(model->context, made);
}

bool kmp_time_scales_doubt(kempe_context *context, kmp_time_scales *scales, double max_step)
{
    if (!scales->open)
        return false;
    if (max_step > 0) {
        *scales = (kmp_time_scales){.shortest = INFINITY, .varies = scales->varies};
        return false;
    }
    const char *more = scales->open_count > 1 ? ", .." : "";
    if (isinf(scales->shortest))
        kmp_doubt(context,
                  "functions of time ('%s'%s) were not searched to the end for short pulses: give a longest step "
                  "(max_step)",
                  scales->open, more);
    else
        kmp_doubt(context,
                  "functions of time ('%s'%s) change in more intervals of about %.3g s than are watched: give a "
                  "longest step (max_step)",
                  scales->open, more, scales->shortest);
    return true;
}

static bool is_load(const kmp_expr *e, const void *user)
{
    (void)user;
    return e->kind == KMP_EXPR_LAMBDA || e->kind == KMP_EXPR_MEASURE;
}

/* True if loads may end a rest, or the run. */
static bool watches_loads(const kempe_model *model)
{
    bool watches = kmp_model_rests(model);
    for (int k = 0; k < model->run.until_count; k++)
        watches = watches || kmp_expr_find(model->run.until[k], is_load, NULL);
    return watches;
}

double kmp_time_scales_shortest(const kempe_model *model)
{
    kmp_time_scales scales = {.shortest = INFINITY};
    kmp_arena aside = {0};
    double *parameters = KMP_ARENA_NEW(&aside, double, model->parameter_count);
    for (int k = 0; parameters && k < model->parameter_count; k++)
        parameters[k] = model->parameters[k].number.value;
    if (parameters)
        (void)kmp_time_scales_find(model, parameters, 0, model->run.t_end > 0 ? model->run.t_end : 1,
                                   watches_loads(model) ? KMP_TIMED_ALL : KMP_TIMED_SHORT, &aside, &scales);
    kmp_arena_free(&aside);
    return isfinite(scales.shortest) ? scales.shortest : 0;
}

static bool is_parameter(const kmp_expr *e, const void *user)
{
    (void)user;
    return e->kind == KMP_EXPR_PARAMETER;
}

/* A part that may be short, by parameters; a factor of it changes no width. */
static bool is_short_by_parameters(const kmp_expr *e, const void *user)
{
    return may_be_short(e, user) && kmp_expr_find_named(e->kind == KMP_EXPR_DIV ? e->b : e, is_parameter, user);
}

const char *kmp_time_scales_varying(const kempe_model *model)
{
    int count = MOST;
    for (int skipped = 0; count == MOST; skipped += count) {
        study s = {.model = model, .which = KMP_TIMED_SHORT, .skipped = skipped};
        add_all(&s);
        count = s.count;
        for (int k = 0; k < count; k++)
            if (kmp_expr_find_named(s.function[k], is_short_by_parameters, NULL))
                return s.name[k];
    }
    return NULL;
}

double kmp_time_scales_end(const kmp_time_scales *scales, double t)
{
    const int next = kmp_ordered_last(scales->end, -1, scales->count, t) + 1;
    return next < scales->count ? scales->end[next] : INFINITY;
}
