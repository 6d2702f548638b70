/* SPDX-License-Identifier: BSD-3-Clause */
/* From a model to the programs of the formulations. */
#include "dynamics/system.h"
#include "base/arena.h"
#include "base/context.h"
#include "base/memory.h"
#include "base/text.h"
#include "dynamics/choose_algorithm.h"
#include "dynamics/choose_variants.h"
#include "dynamics/closure_row.h"
#include "dynamics/equations.h"
#include "dynamics/goal_equations.h"
#include "dynamics/kinematics/kinematics_conditions.h"
#include "dynamics/kinematics/link_tree.h"
#include "dynamics/kinematics/model_conditions.h"
#include "dynamics/motion.h"
#include "dynamics/program_cache.h"
#include "dynamics/variants.h"
#include "model/data/body.h"
#include "model/data/closure.h"
#include "model/data/closure_table.h"
#include "model/data/model.h"
#include "model/data/rope.h"
#include "model/data/run_settings.h"
#include "model/data/spherical.h"
#include "model/data/state.h"
#include "model/data/variant.h"
#include "model/language/expression.h"
#include "model/language/expression_value.h"
#include "model/read/read_mass.h"
#include "model/write/model_print.h"
#include "platform/platform.h"
#include "symbolic/program.h"
#include "symbolic/table_function.h"
#include <kempe/extend.h>
#include <kempe/kempe.h>
#include <math.h>
#include <pthread.h>
#include <stdatomic.h>
#include <stdbool.h>
#include <stdlib.h>
#include <string.h>

/* The default tolerance of closures that are redundant up to rounding, relative to the characteristic length. Four
 * hundred lamps and as many linkages in space, to four digits, are open by up to 5.2e-4 of it (bench/rounded digits).
 */
#define KMP_CLOSURE_TOLERANCE 6e-4

/* A start value below this part of a radius of gyration is a small displacement, no size of the mechanism. */
#define KMP_START_IS_SMALL 0.1
/* Coordinates of flexible bodies over the length of the model, or over 1 for angles. Linear elasticity with terms of
 * second order holds to a tenth. A smaller scale than the scale of joints makes joints the dependent coordinates of
 * loops, and deflections as accurate as their size needs. */
#define KMP_ELASTIC_SIZE 1e-2

void kmp_pattern_init(kmp_pattern *pattern, kmp_arena *arena, int rows, int cols, const kmp_ref *matrix,
                      kmp_ref *values)
{
    int count = 0;
    for (int i = 0; i < rows * cols; i++)
        count += matrix[i] != KMP_ZERO;
    *pattern = (kmp_pattern){.row = KMP_ARENA_NEW(arena, int, count), .col = KMP_ARENA_NEW(arena, int, count)};
    for (int i = 0; !arena->failed && i < rows * cols; i++)
        if (matrix[i] != KMP_ZERO) {
            pattern->row[pattern->count] = i / cols;
            pattern->col[pattern->count] = i % cols;
            values[pattern->count++] = matrix[i];
        }
}

/* -- scales ------------------------------------------------------------------------------------------ */

static double norm3(const kmp_number v[3])
{
    return sqrt(v[0].value * v[0].value + v[1].value * v[1].value + v[2].value * v[2].value);
}

/* `best` becomes |to - from| if that is longer; from NULL: zero. */
static void offer(kmp_length_scale *best, const kmp_number to[3], const kmp_number *from)
{
    kmp_length_scale distance = {0};
    kmp_number d[3] = {{0}};
    for (int k = 0; k < 3; k++) {
        distance.to[k] = to[k];
        if (from)
            distance.from[k] = from[k];
        d[k].value = distance.to[k].value - distance.from[k].value;
    }
    distance.length = norm3(d);
    if (distance.length > best->length)
        *best = distance;
}

/* Takes the distance of a point from its body's joint, if it is larger. */
static void offer_point(kmp_length_scale *best, const kempe_model *model, int point)
{
    const kmp_point *p = &model->points[point];
    int to = model->bodies[p->body].to;
    offer(best, p->at, to < 0 ? NULL : model->points[to].at);
}

static void offer_number(kmp_length_scale *best, const kmp_number *number)
{
    const kmp_number along[3] = {*number};
    offer(best, along, NULL);
}

/* The largest radius of gyration; its length is 0 where no body has inertia. */
static kmp_length_scale largest_gyration(const kempe_model *model)
{
    kmp_length_scale found = {0};
    for (int b = 1; b < model->body_count; b++)
        for (int k = 0; k < 3; k++) {
            const kmp_body *body = &model->bodies[b];
            double square = body->mass.value > 0 ? body->inertia[k].value / body->mass.value : 0;
            if (square > found.length * found.length)
                found = (kmp_length_scale){.length = sqrt(square), .body = b, .axis = k};
        }
    return found;
}

kmp_length_scale kmp_system_length_scale(const kempe_model *model)
{
    kmp_length_scale best = {0};
    for (int b = 1; b < model->body_count; b++)
        if (model->bodies[b].at >= 0 && model->bodies[b].parent > 0)
            offer_point(&best, model, model->bodies[b].at);
    for (int c = 0; c < model->closure_count; c++) {
        const kmp_number *length = kmp_closure_length(&model->closures[c]);
        if (length)
            offer_number(&best, length);
        for (int k = 0; k < 2; k++)
            if (model->closures[c].point[k] >= 0 && model->points[model->closures[c].point[k]].body > 0)
                offer_point(&best, model, model->closures[c].point[k]);
    }
    bool found_any = best.length > 0;
    for (int k = 0; !found_any && k < model->motion_count; k++)
        if (!model->motions[k].rotation)
            offer_number(&best, &model->start.q[k]);
    /* A start value that is small against the largest radius of gyration is not a size of the mechanism. */
    const kmp_length_scale gyration = found_any ? (kmp_length_scale){0} : largest_gyration(model);
    if (best.length > 0 && best.length < KMP_START_IS_SMALL * gyration.length)
        best = gyration;
    found_any = best.length > 0;
    for (int b = 1; !found_any && b < model->body_count; b++) {
        offer(&best, model->bodies[b].com, NULL);
        found_any = best.length > 0;
    }
    for (int f = 0; !found_any && f < model->flexible_count; f++)
        offer_number(&best, model->flexibles[f].length);
    bool slides = false;
    for (int k = 0; k < kmp_model_coordinates(model); k++)
        slides = slides || !model->motions[k].rotation;
    return best.length > 0 || slides ? best : gyration;
}

double kmp_system_length(const kempe_model *model)
{
    double length = kmp_system_length_scale(model).length;
    return length > 0 ? length : 1;
}

double kmp_closure_tolerance(const kempe_model *model)
{
    return model->closure_tolerance_given ? model->closure_tolerance.value
                                          : KMP_CLOSURE_TOLERANCE * kmp_system_length(model);
}

bool kmp_system_rescale(kempe_system *s)
{
    s->length = s->kept_length > 0 ? s->kept_length : kmp_system_length(s->model);
    for (int k = 0; k < s->n; k++) {
        /* Scale of a coordinate: 1 for an angle, the length of the model for a displacement, a part of these for a
         * flexible body. The scale of a state is the size of its values, as rates of one second. */
        const kmp_state *state = kmp_state_of(s->model, k);
        s->scale[k] = state ? state->scale : s->model->motions[k].rotation ? 1 : s->length;
        s->scale[k] *= s->model->motions[k].elastic ? KMP_ELASTIC_SIZE : 1;
    }
    for (int r = 0; r < s->m; r++) {
        /* A drive of a deflection has only that: its unit keeps the row as large as others. */
        const kmp_closure *closure = &s->model->closures[s->rows[r].closure];
        const bool small = kmp_closure_is_drive(closure) && s->model->motions[closure->motion].elastic;
        s->row_scale[r] = pow(s->length, s->rows[r].length_power) * (small ? KMP_ELASTIC_SIZE : 1);
    }
    for (int k = 0; k < s->model->parameter_count; k++)
        s->parameters[k] = s->model->parameters[k].number.value;
    s->closure_tolerance = kmp_closure_tolerance(s->model);
    kmp_program_cache_clear(s->kept);
    if (s->rounding)
        atomic_store(&s->rounding->state, KMP_ROUNDING_UNKNOWN); /* the numbers have changed */
    /* Along the chain of bodies to each closed point: offsets of the joints and start values of translations. false: no
     * memory. */
    const kempe_model *model = s->model;
    double *reach = KMP_NEW(double, model->body_count);
    s->reach = 0;
    for (int b = 1; reach && b < model->body_count; b++) {
        const kmp_body *body = &model->bodies[b];
        reach[b] = reach[body->parent] + (body->at >= 0 ? norm3(model->points[body->at].at) : 0);
        for (int k = body->first_motion; k < body->first_motion + body->motion_count; k++)
            reach[b] += model->motions[k].rotation ? 0 : fabs(model->start.q[k].value);
    }
    for (int c = 0; reach && c < model->closure_count; c++)
        for (int k = 0; k < 2; k++)
            if (model->closures[c].point[k] >= 0) {
                const kmp_point *point = &model->points[model->closures[c].point[k]];
                s->reach = fmax(s->reach, reach[point->body] + norm3(point->at));
            }
    /* A rope is a sum over its places. */
    for (int r = 0; reach && r < model->rope_count; r++) {
        double path = 0;
        for (int k = 0; k < model->ropes[r].count; k++) {
            const kmp_rope_place *place = &model->ropes[r].places[k];
            const kmp_point *point = &model->points[place->point];
            path += reach[point->body] + norm3(point->at) + fabs(place->radius.value * place->wrap);
        }
        s->reach = fmax(s->reach, path);
    }
    kmp_free(reach);
    return reach;
}

/* -- programs ---------------------------------------------------------------------------------------- */

static bool make_judge(kempe_system *s, kmp_equations *eq)
{
    const int uses = s->use_count = eq->outputs.uses.count;
    const bool links = s->late && (s->late->by_links || s->late->by_products);
    const int count[5] = {1, links ? 2 : 1, 3 * s->model->closure_count, 3 * eq->outputs.position_count,
                          eq->outputs.shown_count + uses};
    kmp_ref *shown = KMP_GRAPH_NEW(eq->graph, kmp_ref, eq->outputs.shown_count + uses + 1);
    const kmp_ref energies[2] = {eq->energy.power, eq->energy.kinetic};
    const kmp_ref *groups[5] = {&eq->energy.potential, energies, eq->closures.reaction, eq->outputs.position, shown};
    s->use = KMP_ARENA_NEW(&s->arena, kmp_table_use, uses + 1);
    if (!shown || !s->use)
        return false;
    for (int k = 0; k < eq->outputs.shown_count; k++)
        shown[k] = eq->outputs.shown[k];
    for (int k = 0; k < uses; k++) {
        s->use[k] = eq->outputs.uses.use[k];
        shown[eq->outputs.shown_count + k] = s->use[k].at;
    }
    s->has_power = eq->energy.power != KMP_ZERO || s->rheonomic || s->switches;
    s->dissipative = s->has_power;
    s->judge = kmp_program_new(eq->graph, 5, count, groups);
    return s->judge;
}

/* -- conditions -------------------------------------------------------------------------------------- */

static bool is_within(const kmp_expr *part, const kmp_expr *whole)
{
    return whole &&
           (part == whole || is_within(part, whole->a) || is_within(part, whole->b) || is_within(part, whole->c));
}

/* " < KNOT"; of an end of a variable " beyond the points FIRST .. LAST". */
static void put_table_event(kmp_text *text, const kmp_named_table *table, int number)
{
    int k = abs(number), end = k - kmp_table_end_number(table, 0);
    if (end < 0 || end == 4 || end == 5)
        kmp_text_printf(text, " < %.6g", end < 0 ? table->table->x[k] : kmp_table_end(table, end - 4));
    else if (end > 5)
        kmp_text_put(text, " at a point of the table");
    else
        kmp_text_printf(text, " beyond the points %.6g .. %.6g", kmp_table_end(table, end - end % 2),
                        kmp_table_end(table, end - end % 2 + 1));
}

double kmp_system_gravity(const kempe_system *s)
{
    double g[3];
    for (int i = 0; i < 3; i++)
        g[i] = kmp_number_at(&s->model->gravity[i], s->parameters);
    return hypot(hypot(g[0], g[1]), g[2]);
}

bool kmp_system_watches_loads(const kempe_system *system)
{
    bool watches = false;
    for (int k = 0; k < system->events.count; k++)
        watches =
            watches || (system->events.condition[k].late && system->events.condition[k].validity != KMP_VALIDITY_TABLE);
    return watches;
}

/* The coordinates that values of a program depend on, and the coordinates in which they are nonlinear: a bit for each
 * of 64 coordinates. */
typedef struct dependences {
    uint64_t *depends, *bent;
} dependences;

/* The union over outputs of a program from output `first` on. */
static uint64_t of_outputs(const kmp_program *p, int first, const uint64_t *mark)
{
    uint64_t any = 0;
    for (int k = first; k < p->outputs[p->stages]; k++)
        any |= mark[p->output[k] >> 1];
    return any;
}

/* The coordinates from one on, a bit each, in which a condition or a closure is nonlinear, or on which masses or forces
 * depend. */
static uint64_t watched_from(const kempe_system *s, int from, const kmp_program *motion, const dependences *x)
{
    uint64_t watched = 0;
    if (s->changes) {
        kmp_program_dependences(s->changes, KMP_IN_Q, (uint32_t)from, x->depends, x->bent);
        watched |= of_outputs(s->changes, 0, x->bent);
    }
    if (s->closing) { /* the derivatives follow h */
        kmp_program_dependences(s->closing, KMP_IN_Q, (uint32_t)from, x->depends, x->bent);
        watched |= of_outputs(s->closing, s->closing->outputs[KMP_STAGE_CLOSURE] + s->m, x->depends);
    }
    if (motion) {
        kmp_program_dependences(motion, KMP_IN_Q, (uint32_t)from, x->depends, x->bent);
        watched |= of_outputs(motion, motion->outputs[KMP_STAGE_MASS], x->depends);
    }
    return watched;
}

kempe_status kmp_system_watched_coordinates(const kempe_system *s, bool *watched)
{
    const bool by_loads = kmp_system_watches_loads(s), all = by_loads && (s->force || s->late);
    const kmp_program *const motion = by_loads ? s->motion : NULL, *const programs[] = {s->changes, s->closing, motion};
    int most = 1;
    for (size_t k = 0; k < sizeof programs / sizeof *programs; k++)
        most = programs[k] && kmp_program_values(programs[k]) > most ? kmp_program_values(programs[k]) : most;
    const dependences x = {KMP_NEW(uint64_t, most), KMP_NEW(uint64_t, most)};
    for (int from = 0; x.depends && x.bent && from < s->n; from += 64) {
        const uint64_t some = all ? UINT64_MAX : watched_from(s, from, motion, &x);
        for (int i = from; i < s->n && i < from + 64; i++)
            watched[i] = some >> (i - from) & 1;
    }
    const bool made = x.depends && x.bent;
    kmp_free(x.depends);
    kmp_free(x.bent);
    return kmp_made(s->context, made);
}

int kmp_system_input_order(const kempe_system *system, int input)
{
    const kmp_program *const programs[] = {system->motion, system->judge, system->closing};
    int order = 0;
    for (size_t k = 0; k < sizeof programs / sizeof *programs; k++)
        if (programs[k]) {
            const int read = kmp_program_time_order(programs[k], input);
            order = read > order ? read : order;
        }
    return order;
}

char *kmp_system_event_text(kempe_system *s, const kmp_condition *condition)
{
    const kempe_model *model = s->model;
    const kmp_expr *e = condition->expr;
    kmp_text text = {0};
    if (!e)
        kmp_text_put(&text, condition->text);
    for (int k = 0; e && k < model->force_count; k++)
        if (is_within(e, model->forces[k].effort)) {
            kmp_text_printf(&text, "'%s': ", model->forces[k].name);
            break;
        }
    if (e) {
        kmp_model_put_expr(&text, model, e->b || condition->ends ? e : e->a);
        if (e->kind == KMP_EXPR_TABLE)
            put_table_event(&text, e->table, condition->number);
        else if (!e->b)
            kmp_text_put(&text, " < 0");
    }
    return kmp_text_keep(&text, &s->arena);
}

/* Makes the program of conditions. All are known once the other programs have been derived; these equations have all
 * laws and rows. */
static kempe_status make_changes(kempe_system *s, kmp_equations *eq)
{
    int count = s->events.count, counts[2] = {count, 0};
    s->left = KMP_ARENA_NEW(&s->arena, atomic_bool, count + 2 * s->use_count + 1);
    if (count == 0)
        return kmp_made(s->context, s->left);
    kmp_ref *out = KMP_GRAPH_NEW(eq->graph, kmp_ref, 2 * count);
    s->event_text = KMP_ARENA_NEW(&s->arena, char *, count);
    for (int k = 0; out && s->event_text && k < count; k++) {
        kmp_condition *condition = &s->events.condition[k];
        if (!kmp_tree_event(&eq->tree, k, &out[k]))
            return kmp_fail(s->context, KEMPE_E_BUG, "a condition of an element is missing in its law");
        condition->late =
            (condition->ends || condition->validity != KMP_VALIDITY_NONE || condition->role != KMP_ROLE_NONE) &&
            kmp_is_late(eq->graph, out[k]);
        condition->by_rates = kmp_depends_on(eq->graph, out[k], KMP_IN_QD);
        s->changes_by_rates =
            s->changes_by_rates || condition->late ||
            ((condition->validity == KMP_VALIDITY_NONE || condition->validity == KMP_VALIDITY_LEVEL) &&
             condition->by_rates);
        if (condition->late) {
            out[count + counts[1]++] = out[k];
            out[k] = KMP_ZERO;
        }
        s->event_text[k] = kmp_system_event_text(s, condition);
    }
    const kmp_ref *all = out && !s->arena.failed ? kmp_conditions_with_solved(eq->graph, out, counts) : NULL;
    const kmp_ref *group[2] = {all, all ? all + counts[0] : NULL};
    s->changes = all ? kmp_program_new(eq->graph, 2, counts, group) : NULL;
    return s->changes ? KEMPE_OK : kmp_fail_memory(s->context);
}

/* -- the system -------------------------------------------------------------------------------------- */

bool kmp_system_set_rows(kempe_system *s, int n, int m, const kmp_row *rows, const double *misfit)
{
    s->n = n;
    s->m = m;
    if (!KMP_ARENA_MAKE(&s->arena, KMP_ROOM(kmp_row, s->m, &s->rows), KMP_ROOM(char *, s->m, &s->row_names),
                        KMP_ROOM(double, s->n, &s->scale), KMP_ROOM(double, s->m, &s->row_scale),
                        KMP_ROOM(double, s->model->parameter_count, &s->parameters),
                        KMP_ROOM(kmp_rounding, 1, &s->rounding), KMP_ROOM(double, s->model->closure_count, &s->misfit),
                        KMP_ROOM(int, s->n, &s->chart_first), KMP_ROOM(bool, s->n, &s->chart_before)))
        return false;
    memcpy(s->rows, rows, (size_t)m * sizeof *rows);
    memcpy(s->misfit, misfit, (size_t)s->model->closure_count * sizeof *misfit);
    for (int r = 0; r < s->m; r++)
        s->row_names[r] =
            kmp_arena_printf(&s->arena, "%s.%d", s->model->closures[s->rows[r].closure].name, s->rows[r].number + 1);
    s->chart_count = kmp_spherical_find(s->model, s->chart_first);
    s->arena.failed = s->arena.failed || s->chart_count < 0;
    for (int c = 0; c < s->chart_count; c++)
        s->chart_before[c] = kmp_tree_chart_before(s->model, s->chart_first[c]);
    return kmp_system_rescale(s) && !s->arena.failed;
}

/* The sets for energies and outputs. */
enum { JUDGE_SETS = KMP_SET_ENERGY | KMP_SET_REACTION | KMP_SET_OUTPUT };

/* For programs that integrate: with conditions and the charts of spherical joints as inputs. */
static kempe_status derive_sets(kempe_system *s, unsigned sets, kmp_savings *found, kmp_equations *eq)
{
    const kmp_derivation_request request = {.sets = sets,
                                            .scheme =
                                                s->dynamics == KMP_DYNAMICS_NER ? KMP_SCHEME_NER : KMP_SCHEME_COMPOSITE,
                                            .plain = s->dynamics == KMP_DYNAMICS_PLAIN || s->brief,
                                            .quick = true,
                                            .found = found,
                                            .events = &s->events,
                                            .frictionless = s->frictionless,
                                            .charted = true};
    return kmp_equations_derive(eq, s->model, &request);
}

/* Derives the programs that follow the programs of motion, from equations that have all conditions and goals. */
static kempe_status derive_rest(kempe_system *s, kmp_equations *eq)
{
    KMP_TRY(kmp_made(s->context, make_judge(s, eq)));
    KMP_TRY(make_changes(s, eq));
    return kmp_goals_program(eq, &s->goals) ? KEMPE_OK : kmp_fail_memory(s->context);
}

/* Derives closures, M and the programs that follow the programs of motion. The variants of M and C are found on the
 * way. By links and by products there is no M, and variants are found where a program needs them. */
static kempe_status derive_late(kempe_system *s)
{
    enum { OF_PRODUCTS = KMP_SET_PRODUCT | KMP_SET_BIAS | KMP_SET_JDQD | KMP_SET_POWER };
    const bool weighs = !s->late->by_links && !s->late->by_products;
    const unsigned products = s->late->by_products ? OF_PRODUCTS : 0;
    const unsigned sets = KMP_SET_CLOSURE | JUDGE_SETS | products | (weighs ? KMP_SET_MASS : KMP_SET_KINETIC);
    const kmp_derivation_request request = {.sets = weighs ? KMP_MOTION_SETS | KMP_SET_REACTION : sets,
                                            .then = weighs ? sets : 0,
                                            .plain = s->brief,
                                            .quick = true,
                                            .found = weighs ? &s->bodies->first : NULL,
                                            .chosen = weighs ? &s->late->chosen : NULL,
                                            .events = &s->events,
                                            .charted = true};
    kmp_equations eq;
    KMP_TRY(kmp_equations_derive(&eq, s->model, &request));
    bool made =
        kmp_system_set_rows(s, eq.n, eq.m, eq.closures.rows, eq.closures.misfit) && kmp_motion_make_weighing(s, &eq);
    s->closing = made ? kmp_program_first(s->late->weighing, KMP_STAGE_MASS) : NULL;
    kempe_status status = kmp_made(s->context, s->closing);
    if (status == KEMPE_OK)
        status = derive_rest(s, &eq);
    kmp_equations_free(&eq);
    return status;
}

static kempe_status derive_motion(kempe_system *s, kmp_equations *eq, bool closures)
{
    bool made = kmp_system_set_rows(s, eq->n, eq->m, eq->closures.rows, eq->closures.misfit) && kmp_motion_make(s, eq);
    s->closing = made ? kmp_program_first(s->motion, KMP_STAGE_MASS) : NULL;
    KMP_TRY(kmp_made(s->context, s->closing));
    return closures ? derive_rest(s, eq) : KEMPE_OK;
}

/* Derives only the closures, for their rows: rows of a kind that hold by themselves do not count. */
static kempe_status look_at_rows(const kempe_system *s, bool *by_products)
{
    kmp_events events = {0};
    const kmp_derivation_request request = {.sets = KMP_SET_CLOSURE, .quick = true, .events = &events, .charted = true};
    kmp_equations eq;
    kempe_status status = kmp_equations_derive(&eq, s->model, &request);
    if (status == KEMPE_OK) {
        *by_products = kmp_motion_goes_by_products(s, eq.m);
        kmp_equations_free(&eq);
    }
    kmp_events_free(&events);
    return status;
}

static kempe_status derive_system(kempe_system *s, bool closures)
{
    kmp_equations eq;
    bool by_products = false;
    if (!closures && kmp_motion_may_go_by_products(s))
        KMP_TRY(look_at_rows(s, &by_products));
    if (by_products || (!closures && kmp_motion_may_wait(s))) {
        s->late = kmp_lazy_equations_new(s);
        KMP_TRY(kmp_made(s->context, s->late));
        s->late->by_products = by_products;
        KMP_TRY(derive_late(s));
        return s->dynamics == KMP_DYNAMICS_ARTICULATED ? kmp_motion_need_bodies(s) : KEMPE_OK;
    }
    kempe_status status = derive_sets(s, closures ? KMP_SET_CLOSURE : KMP_MOTION_SETS, &s->bodies->first, &eq);
    if (status == KEMPE_OK) {
        status = derive_motion(s, &eq, closures);
        kmp_equations_free(&eq);
    }
    if (status == KEMPE_OK && s->dynamics == KMP_DYNAMICS_ARTICULATED)
        status = kmp_motion_need_bodies(s); /* where they are impossible, the system is */
    if (status != KEMPE_OK || closures)
        return status;
    KMP_TRY(derive_sets(s, JUDGE_SETS, NULL, &eq));
    status = derive_rest(s, &eq);
    kmp_equations_free(&eq);
    return status;
}

kempe_system *kmp_system_start(const kempe_model *model)
{
    kempe_system *s = KMP_NEW(kempe_system, 1);
    if (!s)
        return NULL;
    s->model = model;
    s->context = model->context;
    s->kept = kmp_program_cache_new();
    s->bodies = kmp_bodies_new();
    if (s->kept && s->bodies)
        return s;
    kempe_system_free(s);
    return NULL;
}

static kempe_status new_system(const kempe_model *model, kmp_dynamics dynamics, bool closures, bool brief,
                               kempe_system **system)
{
    double begin = kmp_cpu_now();
    kempe_system *s = kmp_system_start(model);
    KMP_TRY(kmp_made(model->context, s));
    s->dynamics = dynamics;
    s->frictionless = closures;
    s->brief = brief;
    kempe_status status = derive_system(s, closures);
    s->build_s = kmp_cpu_now() - begin;
    return KMP_GIVE_OR_FREE(status, system, s, kempe_system_free);
}

kempe_status kmp_system_new_by(const kempe_model *model, const char *word, kempe_system **system)
{
    kmp_context_clear(model->context);
    KMP_TRY(kmp_model_check_finished(model));
    /* The algorithm requested by the call or the model. */
    kmp_text complaint = {0};
    const kmp_dynamics dynamics = word ? kmp_dynamics_find(word, &complaint) : model->run.dynamics;
    if (dynamics == KMP_DYNAMICS_COUNT)
        return kmp_fail_text(model->context, KEMPE_E_ARGUMENT, &complaint);
    KMP_TRY(kmp_check_masses(model));
    return new_system(model, dynamics, false, false, system);
}

kempe_status kmp_system_new_brief(const kempe_model *model, kmp_dynamics dynamics, kempe_system **system)
{
    KMP_TRY(kmp_model_check_finished(model));
    return new_system(model, dynamics, false, true, system);
}

kempe_status kmp_system_of_closures(const kempe_model *model, kempe_system **system)
{
    KMP_TRY(kmp_model_check_finished(model));
    return new_system(model, KMP_DYNAMICS_PLAIN, true, false, system);
}

void kempe_system_free(kempe_system *s)
{
    if (!s)
        return;
    kmp_program_free(s->motion);
    kmp_lazy_equations_free(s->late);
    kmp_program_free(s->closing);
    kmp_bodies_free(s->bodies);
    kmp_program_free(s->judge);
    kmp_program_free(s->changes);
    kmp_program_free(s->goals);
    kmp_events_free(&s->events);
    kmp_program_cache_free(s->kept);
    kmp_variant_free(s->own);
    kmp_arena_free(&s->arena);
    kmp_free(s);
}

/* The work of the user's force counts like the work of every force without a potential. */
void kempe_system_set_force(kempe_system *system, kempe_force_fn *force, void *user)
{
    KMP_GIVEN(system, );
    system->force = force;
    system->force_user = user;
    system->dissipative = force || system->has_power;
}

void kmp_system_effort(const kempe_system *system, double t, const double *q, const double *qd, double *effort)
{
    for (int i = 0; i < system->n; i++)
        effort[i] = 0;
    if (system->force(system->force_user, t, q, qd, effort) != 0)
        for (int i = 0; i < system->n; i++)
            effort[i] = NAN;
}

KMP_GETTER(int kempe_system_row_count(const kempe_system *system), system, system->m, 0)
KMP_GETTER_AT(const char *kempe_system_row_name(const kempe_system *system, int k), system, k, system->m,
              system->row_names[k], "")
