/* SPDX-License-Identifier: BSD-3-Clause */
/* Data of a generated simulator: routines, slopes for choices of coordinates with their linear algebra written out
 * (constraints/programs/reduced_program.h), the start, conditions and their bounds, elements of friction. */
#include "exchange/code/simulated.h"
#include "backend/bounds.h"
#include "backend/time_scales.h"
#include "base/context.h"
#include "constraints/closing/assemble.h"
#include "constraints/closing/assembly.h"
#include "constraints/diagnosis/shared_loads.h"
#include "constraints/evaluation/charts.h"
#include "constraints/evaluation/evaluator.h"
#include "constraints/evaluation/intended_rank.h"
#include "constraints/partition/partition.h"
#include "constraints/programs/reduced_program.h"
#include "constraints/tolerances.h"
#include "dynamics/choose_variants.h"
#include "dynamics/equations.h"
#include "dynamics/kinematics/kinematics_conditions.h"
#include "dynamics/kinematics/touching.h"
#include "dynamics/motion.h"
#include "exchange/simulator/kempe_simulator.h"
#include "integrators/friction/friction_inside.h"
#include "integrators/run/friction_run.h"
#include "model/data/closure.h"
#include "model/data/model.h"
#include "model/data/output_table.h"
#include "model/read/loads.h"
#include <kempe/stepper.h>
#include <stdio.h>
#include <string.h>

/* -- routines ------------------------------------------------------------------------------------------ */

/* The conditions after all that have some; directions after the conditions, which they differentiate. */
static const kmp_chosen routines[] = {{.name = "closures", .sets = 1u << KMP_EQ_H | 1u << KMP_EQ_J | 1u << KMP_EQ_H_T},
                                      {.name = "motion", .sets = 1u << KMP_EQ_M | 1u << KMP_EQ_C | 1u << KMP_EQ_JDQD},
                                      {.name = "loads", .sets = 1u << KMP_EQ_LOADS},
                                      {.name = "show", .sets = 1u << KMP_EQ_OUTPUTS},
                                      {.name = "changes", .sets = 1u << KMP_EQ_CONDITIONS},
                                      {.name = "along", .sets = 1u << KMP_EQ_ALONG},
                                      {.name = "next", .sets = 1u << KMP_EQ_NEXT, .in_place = true},
                                      {.name = "start", .sets = 1u << KMP_EQ_START}};

void kmp_simulated_choose(const kempe_model *model, kmp_set_choice *choice)
{
    bool expressions = false; /* in start values, which may depend on parameters */
    for (int k = 0; k < model->motion_count; k++)
        expressions = expressions || model->start.q[k].expr || model->start.qd[k].expr;
    const unsigned empty = (kmp_outputs_width(model) > 0 ? 0 : 1u << KMP_EQ_OUTPUTS) |
                           (kmp_model_has_samples(model) ? 0 : 1u << KMP_EQ_NEXT) |
                           (expressions ? 0 : 1u << KMP_EQ_START);
    for (size_t k = 0; k < sizeof routines / sizeof *routines; k++)
        if (!(routines[k].sets & empty)) {
            choice->chosen[choice->count++] = routines[k];
            choice->all |= routines[k].sets;
        }
}

/* -- slopes ---------------------------------------------------------------------------------------------- */

enum {
    LONGER = 4,        /* the code of slopes over the code of the equations, at most: compilers take long */
    TRIAL_STEPS = 2000 /* of the trial run */
};

/* True if all nonzero entries of a matrix are in the pattern of the system, whose numbers may make some of them zero.
 */
static bool is_within(kmp_arena *arena, const kmp_pattern *pattern, int rows, int cols, const kmp_ref *matrix)
{
    bool *listed = KMP_ARENA_NEW(arena, bool, rows *cols);
    bool within = listed;
    for (int k = 0; listed && k < pattern->count; k++) {
        listed[pattern->row[k] * cols + pattern->col[k]] = true;
        if (rows == cols) /* of M the lower triangle */
            listed[pattern->col[k] * cols + pattern->row[k]] = true;
    }
    for (int k = 0; within && k < rows * cols; k++)
        within = listed[k] || matrix[k] == KMP_ZERO;
    return within;
}

/* The motion program with the parameters and conditions of the simulator. *motion is NULL where its zeros differ from
 * the zeros of the system. */
static kempe_status derive_motion(kmp_code_source *source, const kmp_set_choice *choice, const kempe_system *system,
                                  kmp_program **motion)
{
    kmp_equations eq;
    kmp_derivation_request scene = choice->scene;
    scene.sets = KMP_MOTION_SETS;
    KMP_TRY(kmp_equations_derive(&eq, source->model, &scene));
    bool moves = false;
    for (int r = 0; r < eq.m; r++)
        moves = moves || eq.closures.h_t[r] != KMP_ZERO;
    const bool same = eq.m == system->m && moves == system->rheonomic &&
                      is_within(&source->arena, &system->mass, eq.n, eq.n, eq.dynamics.mass) &&
                      is_within(&source->arena, &system->jacobian, eq.m, eq.n, eq.closures.jacobian);
    *motion = same ? kmp_motion_make_again(system, &eq) : NULL;
    kmp_equations_free(&eq);
    return kmp_made(source->context, !source->arena.failed && (*motion || !same));
}

/* Adds a routine with its choice. */
static kempe_status take(kmp_code_source *source, kmp_program *program, const kmp_partition *part)
{
    struct kmp_simulated *x = source->simulated;
    kmp_code_routine *routine = &source->routines[source->count++];
    const int p = part->p, r = part->r;
    const kmp_array arrays[] = {
        {.name = "udd", .meaning = "accelerations of the independent coordinates", .rows = p, .count = p},
        {.name = "vd", .meaning = "rates of the dependent coordinates", .rows = r, .first = p, .count = r},
        {.name = "checks",
         .meaning = "least relative pivot of the reduced mass matrix; excess of the elimination, at most 1",
         .rows = 2,
         .first = p + r,
         .count = 2}};
    routine->program = program;
    routine->arguments = KMP_SIMULATOR_ARGUMENTS;
    routine->array_count = sizeof arrays / sizeof *arrays;
    memcpy(routine->arrays, arrays, sizeof arrays);
    snprintf(routine->name, sizeof routine->name, "slopes%d", x->slopes_count + 1);
    x->slopes[x->slopes_count++] =
        (struct kmp_slopes_choice){.independent = kmp_arena_copy(&source->arena, part->u, p, sizeof *part->u),
                                   .dependent = kmp_arena_copy(&source->arena, part->v, r, sizeof *part->v),
                                   .rows = kmp_arena_copy(&source->arena, part->rows, r, sizeof *part->rows)};
    return kmp_made(source->context, kmp_code_take_program(source, routine));
}

/* Writes slopes for the partition at the evaluator's last closure; *written: whether there are any. */
static kempe_status write(kmp_code_source *source, const kmp_program *motion, kmp_evaluator *eval,
                          const kmp_partition *part, bool *written)
{
    kmp_reduction red;
    int *order = KMP_ARENA_NEW(&source->arena, int, part->r);
    KMP_TRY(kmp_made(source->context, order));
    KMP_TRY(kmp_reduction_init(&red, eval, part));
    kmp_program *program = NULL;
    bool fits = kmp_writer_blocks_fit(&red) && kmp_reduction_factor(&red) == 0;
    if (fits) {
        kmp_writer_order(&red, order);
        const kmp_reduced_program_plan plan = {.order = order, .motion = motion};
        program = kmp_reduced_program_write_slopes(&red, &plan);
    }
    kmp_reduction_free(&red);
    bool others = program && program->block_count > 0;
    for (int k = 0; program && k < program->input_count; k++)
        others = others || program->input[k].kind == KMP_IN_LAMBDA;
    *written = program && !others && program->code[2] <= LONGER * motion->code[motion->stages];
    if (*written)
        return take(source, program, part);
    kmp_program_free(program);
    return kmp_made(source->context, program || !fits);
}

/* -- choices ------------------------------------------------------------------------------------------- */

static bool equal_lists(int count, const int *a, const int *b)
{
    return count == 0 || memcmp(a, b, (size_t)count * sizeof *a) == 0;
}

static bool is_known(const struct kmp_simulated *x, const kmp_partition *part)
{
    for (int k = 0; k < x->slopes_count; k++)
        if (equal_lists(part->r, part->v, x->slopes[k].dependent) &&
            equal_lists(part->r, part->rows, x->slopes[k].rows))
            return true;
    return false;
}

/* Follows a run of the model, with exchanges as the runtime makes them, and writes slopes for the choices of u. */
static kempe_status follow(kmp_code_source *source, const kmp_program *motion, kmp_evaluator *eval, kmp_partition *part,
                           kempe_stepper *stepper)
{
    const kempe_system *system = eval->system;
    bool written = true;
    for (int step = 0; written && step < TRIAL_STEPS && source->simulated->slopes_count < KMP_SLOPES_MOST; step++) {
        if (kempe_stepper_step(stepper) != KEMPE_OK)
            break;
        kmp_eval_closure(eval, kempe_stepper_time(stepper), kempe_stepper_q(stepper));
        if (kmp_partition_exchange(part, system, eval->jacobian, KMP_EXCHANGE_GROWTH) != KEMPE_OK)
            break;
        kmp_partition_sort(part);
        if (!is_known(source->simulated, part))
            KMP_TRY(write(source, motion, eval, part, &written));
    }
    return KEMPE_OK;
}

static kempe_status write_others(kmp_code_source *source, const kmp_program *motion, kmp_evaluator *eval,
                                 const kmp_partition *first)
{
    const kempe_run_options run = {.size = sizeof run,
                                   .formulation = "reduced",
                                   .integrator = "dop853",
                                   .rtol = KMP_TRIAL_TOLERANCE,
                                   .atol = KMP_TRIAL_TOLERANCE};
    kempe_stepper *stepper;
    kmp_partition part;
    if (kempe_stepper_new(eval->system, &run, &stepper) != KEMPE_OK)
        return KEMPE_OK; /* the routine of the start is all */
    bool copied = kmp_partition_copy(&part, first);
    kempe_status status = kmp_made(source->context, copied);
    if (copied)
        status = follow(source, motion, eval, &part, stepper);
    if (copied)
        kmp_partition_free(&part);
    kempe_stepper_free(stepper);
    return status;
}

/* Adds routines of slopes to the source: for the partition at the evaluator's last closure, and for the choices that a
 * trial run of the model exchanges it for. There is none for forces that depend on multipliers, implicit blocks, large
 * blocks of loops, too many degrees of freedom, and where it is much longer than the equations. For other choices the
 * runtime solves the linear systems. */
static kempe_status add_slopes(kmp_code_source *source, const kmp_set_choice *choice, kmp_evaluator *eval,
                               const kmp_partition *part)
{
    const kempe_system *system = eval->system;
    kmp_program *motion;
    bool written = false;
    source->simulated->slopes = KMP_ARENA_NEW(&source->arena, struct kmp_slopes_choice, KMP_SLOPES_MOST);
    KMP_TRY(kmp_made(source->context, source->simulated->slopes));
    if (part->p == 0 || part->p > KMP_REDUCED_PROGRAM_MOST || system->load_row_count > 0)
        return KEMPE_OK;
    KMP_TRY(kmp_motion_need(system));
    if (system->motion->block_count > 0)
        return KEMPE_OK;
    KMP_TRY(derive_motion(source, choice, system, &motion));
    kempe_status status = motion ? write(source, motion, eval, part, &written) : KEMPE_OK;
    if (status == KEMPE_OK && written && part->r > 0)
        status = write_others(source, motion, eval, part);
    kmp_program_free(motion);
    return status;
}

/* -- the start ----------------------------------------------------------------------------------------- */

static void take_inputs(struct kmp_simulated *x, kmp_arena *arena, kmp_evaluator *eval)
{
    x->inputs = kmp_arena_copy(arena, kmp_present_inputs_at(&eval->inputs, 0) + 1,
                               KMP_TIME_NUMBERS * kmp_model_given_inputs(eval->system->model), sizeof *x->inputs);
}

static kempe_status choose_coordinates(kmp_code_source *source, const kmp_set_choice *choice, kmp_evaluator *eval)
{
    struct kmp_simulated *x = source->simulated;
    kmp_arena *arena = &source->arena;
    const kempe_system *system = eval->system;
    kmp_partition part;
    kmp_eval_closure(eval, 0, x->q);
    KMP_TRY(kmp_partition_init(&part, system, eval->jacobian, NULL, 0));
    x->freedom = part.p;
    x->independent = kmp_arena_copy(arena, part.u, part.p, sizeof *part.u);
    take_inputs(x, arena, eval);
    kempe_status status = kmp_made(system->context, !arena->failed);
    if (status == KEMPE_OK)
        status = add_slopes(source, choice, eval, &part);
    kmp_partition_free(&part);
    return status;
}

/* Why a simulator cannot move the deformations of the model's start into balance with other loads; NULL: it can, and
 * the coordinates of its Newton's method are marked. */
static const char *mark_balance(struct kmp_simulated *x, const kempe_system *system, const kempe_assembly *assembly)
{
    const kmp_start *start = &system->model->start;
    for (int k = 0; k < system->events.count; k++)
        if (system->events.condition[k].validity <
            KMP_VALIDITY_DEFLECTION) /* which changes nothing, nor does a fast rotation */
            return "the model has conditions";
    if (system->load_row_count > 0)
        return "forces depend on multipliers";
    for (int k = 0; k < system->n; k++)
        if (system->m > 0 && assembly->stays[k] && !start->hold[k] && !kmp_state_of(system->model, k))
            return "its start holds too few coordinates (start: hold)";
    for (int k = 0; k < system->n; k++)
        x->keeps[k] = start->undeformed[k] ? KEMPE_START_BALANCES : assembly->stays[k] ? KEMPE_START_STAYS : 0;
    return NULL;
}

static kempe_status take_start_values(struct kmp_simulated *x, kmp_arena *arena, const kempe_system *system,
                                      const kempe_assembly *assembly)
{
    const kmp_start *start = &system->model->start;
    x->q = kmp_arena_copy(arena, assembly->q, system->n, sizeof *x->q);
    x->qd = kmp_arena_copy(arena, assembly->qd, system->n, sizeof *x->qd);
    if (!KMP_ARENA_MAKE(arena, KMP_ROOM(double, 2 * system->n, &x->given), KMP_ROOM(int, system->n, &x->keeps)))
        return kmp_fail_memory(system->context);
    const char *obstacle = assembly->held_q ? mark_balance(x, system, assembly) : NULL;
    if (obstacle && system->model->parameter_count > 0)
        kmp_log(system->context, KEMPE_LOG_WARNING,
                "start: the deformations of 'elastic: static' belong to the nominal parameters, because %s: with other "
                "values the motion begins out of balance",
                obstacle);
    if (assembly->balance && system->model->parameter_count > 0)
        kmp_log(system->context, KEMPE_LOG_WARNING,
                "start: the equilibrium belongs to the nominal parameters: with other values the motion begins out of "
                "balance");
    for (int k = 0; k < system->n; k++) {
        x->given[2 * k] = assembly->balance ? assembly->q[k] : start->q[k].value;
        x->given[2 * k + 1] = assembly->balance ? assembly->qd[k] : start->qd[k].value;
        x->keeps[k] |= (start->hold[k] ? KEMPE_START_KEEPS_PLACE : 0) |
                       (start->qd_given[k] || assembly->balance ? KEMPE_START_KEEPS_RATE : 0);
    }
    return kmp_made(system->context, !arena->failed);
}

static kempe_status take_assembly(struct kmp_simulated *x, kmp_arena *arena, const kempe_system *system)
{
    kempe_assembly *assembly = NULL;
    kempe_status status = kmp_assembly_at_start(system, &assembly); /* given also where the loops do not close */
    if (status == KEMPE_OK)
        status = take_start_values(x, arena, system, assembly);
    if (status == KEMPE_OK)
        (void)kmp_doubt_shared_friction(system, 0, assembly->q);
    kempe_assembly_free(assembly);
    return status;
}

static void take_kinds(kmp_code_source *source)
{
    for (int k = 0; k < source->n; k++)
        source->simulated->coordinate_kind[k] = kmp_state_of(source->model, k)       ? KEMPE_COORDINATE_STATE
                                                : source->model->motions[k].rotation ? KEMPE_COORDINATE_ROTATION
                                                                                     : KEMPE_COORDINATE_TRANSLATION;
}

kempe_status kmp_simulated_start(kmp_code_source *source, const kempe_system *system)
{
    struct kmp_simulated *x = source->simulated;
    KMP_TRY(take_assembly(x, &source->arena, system));
    take_kinds(source);
    kmp_evaluator *eval = kmp_eval_new_of_closures(system);
    if (eval)
        take_inputs(x, &source->arena, eval);
    kmp_eval_free(eval);
    return kmp_made(source->context, eval && !source->arena.failed);
}

static kempe_status take_start(kmp_code_source *source, const kmp_set_choice *choice, const kempe_system *system)
{
    struct kmp_simulated *x = source->simulated;
    kmp_arena *arena = &source->arena;
    bool equal = system->m == source->m;
    for (int r = 0; equal && r < source->m; r++)
        equal = strcmp(system->row_names[r], source->row_names[r]) == 0;
    if (!equal)
        return kmp_fail(source->context, KEMPE_E_BUG, "the closures have other equations than the system");
    KMP_TRY(take_assembly(x, arena, system));
    x->scale = kmp_arena_copy(arena, system->scale, system->n, sizeof *x->scale);
    x->row_scale = kmp_arena_copy(arena, system->row_scale, system->m, sizeof *x->row_scale);
    x->rank_tolerance = kmp_rounding_zero(system, KMP_RANK);
    kmp_evaluator *eval = kmp_eval_new_of_closures(system);
    kempe_status status = kmp_made(system->context, eval);
    if (status == KEMPE_OK)
        status = choose_coordinates(source, choice, eval);
    kmp_eval_free(eval);
    return status;
}

/* -- conditions and parameters ------------------------------------------------------------------------- */

static int kind_of(const kmp_condition *c)
{
    if (c->validity != KMP_VALIDITY_NONE)
        return KEMPE_CONDITION_VALIDITY;
    if (c->role != KMP_ROLE_NONE)
        return c->role == KMP_ROLE_SENSE || c->role == KMP_ROLE_HELD ? KEMPE_CONDITION_PASSES : KEMPE_CONDITION_NUMBER;
    return c->ends ? KEMPE_CONDITION_ENDS : c->kink ? KEMPE_CONDITION_KINK : KEMPE_CONDITION_SWITCHES;
}

/* The consequence of a condition of validity. */
static const char *consequence_of(const kmp_condition *c)
{
    static const char *const words[KMP_VALIDITY_END] = {[KMP_VALIDITY_TABLE] = "the table goes straight on there",
                                                        [KMP_VALIDITY_LEVEL] = "it would push",
                                                        [KMP_VALIDITY_DEFLECTION] = "its shapes are right up to there",
                                                        [KMP_VALIDITY_ROTATION] =
                                                            "without terms of second order it is right up to there"};
    return words[c->validity];
}

/* The event of an element of friction or of a contact. */
static const char *event_of(const kmp_condition *c)
{
    if (c->validity == KMP_VALIDITY_LEVEL)
        return ": its level is negative";
    if (c->role != KMP_ROLE_SENSE && c->role != KMP_ROLE_HELD)
        return "";
    if (((const kmp_force *)c->of)->kind == KMP_FORCE_TOUCH)
        return c->role == KMP_ROLE_SENSE ? ": its surfaces meet" : ": its surfaces part";
    return c->role == KMP_ROLE_SENSE ? ": its slip ends" : ": its static level is reached";
}

static kempe_status take_conditions(kmp_code_source *source, kempe_system *system, const kmp_events *events)
{
    struct kmp_simulated *x = source->simulated;
    const int count = x->condition_count = events->count;
    if (!KMP_ARENA_MAKE(&source->arena, KMP_ROOM(char *, count, &x->condition_name, &x->advice),
                        KMP_ROOM(int, count, &x->condition_kind, &x->watch_traits)))
        return kmp_fail_memory(source->context);
    for (int k = 0; k < count; k++) {
        const kmp_condition *c = &events->condition[k];
        const char *text = kmp_system_event_text(system, c);
        x->condition_name[k] = kmp_arena_printf(&source->arena, "%s%s", text ? text : "", event_of(c));
        const char *advice = c->validity != KMP_VALIDITY_NONE ? consequence_of(c) : c->advice;
        x->advice[k] = kmp_arena_strdup(&source->arena, advice ? advice : "");
        x->condition_kind[k] = kind_of(c);
        x->watch_traits[k] = (c->measured ? KEMPE_WATCH_PRESSES : 0) | (c->rough ? KEMPE_WATCH_ROUGH : 0);
    }
    /* Sensors are evaluated where they are asked for, by laws without conditions. */
    for (int k = 0; k < system->use_count; k++)
        if (k == 0 || system->use[k].table != system->use[k - 1].table)
            kmp_log(
                system->context, KEMPE_LOG_WARNING,
                "table '%s': a generated simulator does not say when a sensor uses it beyond its points, where it goes "
                "straight on",
                system->model->tables[system->use[k].table].name);
    for (int k = 0; k < kmp_model_given_inputs(system->model); k++)
        if (system->model->inputs[k].signal.count > 1)
            kmp_log(system->context, KEMPE_LOG_WARNING,
                    "input '%s': a generated simulator does not have its samples; it keeps the value and derivatives "
                    "of t = 0 until its caller sets others",
                    system->model->inputs[k].name);
    const char *pulse = kmp_time_scales_varying(system->model);
    if (pulse)
        kmp_log(
            system->context, KEMPE_LOG_WARNING,
            "'%s': a generated simulator finds pulses in functions of time by its longest step, which belongs to the "
            "present parameters; narrower pulses need a shorter one",
            pulse);
    return kmp_made(source->context, !source->arena.failed);
}

static kempe_status take_friction(kmp_code_source *source, const kempe_system *system, const kmp_events *events)
{
    struct kmp_simulated *x = source->simulated;
    struct kmp_simulated_friction *f = &x->friction;
    const int count = x->friction_count = kmp_friction_elements(events);
    kmp_friction_element *element = KMP_ARENA_NEW(&source->arena, kmp_friction_element, count);
    if (!element || !KMP_ARENA_MAKE(&source->arena,
                                    KMP_ROOM(int, count, &f->slot, &f->row, &f->base, &f->across, &f->twin, &f->loaded,
                                             &f->sides, &f->unlimited, &f->contact),
                                    KMP_ROOM(double, count, &f->size, &f->regularise)))
        return kmp_fail_memory(source->context);
    kmp_friction_list(system, events, element);
    for (int i = 0; i < count; i++) {
        f->slot[i] = element[i].slot;
        f->row[i] = element[i].row;
        f->base[i] = element[i].base;
        f->across[i] = element[i].across;
        f->twin[i] = element[i].twin;
        f->loaded[i] = element[i].loaded;
        f->sides[i] = element[i].sides;
        f->unlimited[i] = element[i].unlimited;
        f->contact[i] = element[i].contact;
        f->contacts += element[i].contact;
        f->size[i] = element[i].size;
        f->regularise[i] = element[i].regularise;
    }
    f->loads = kmp_friction_is_loaded(source->model);
    f->driven = system->rheonomic;
    for (int r = 0; r < system->m; r++) /* only of friction: constraints/kinds/mode_rows.c */
        f->rolls += system->rows[r].of_rates;
    /* A speed that depends on parameters of the simulator would be another one after their change. */
    const kempe_model *model = source->model;
    for (int k = 0; k < model->force_count; k++)
        if (kmp_force_sticks(&model->forces[k]) && model->forces[k].has_regularise && model->forces[k].regularise.expr)
            return kmp_fail(model->context, KEMPE_E_ARGUMENT,
                            "generated simulators: the speed by which friction '%s' may be regularised is an "
                            "expression, which is not supported there; give a number",
                            model->forces[k].name);
    return KEMPE_OK;
}

static kempe_status take_charts(kmp_code_source *source, const kempe_system *system)
{
    struct kmp_simulated *x = source->simulated;
    const int count = x->chart_count = kmp_charts_count(system);
    if (!KMP_ARENA_MAKE(&source->arena, KMP_ROOM(int, count, &x->chart_first, &x->chart_before),
                        KMP_ROOM(double, 9 * count, &x->chart_axes)))
        return kmp_fail_memory(source->context);
    for (int c = 0; c < count; c++) {
        x->chart_first[c] = system->chart_first[c];
        x->chart_before[c] = system->chart_before[c];
        for (int k = 0; k < 3; k++)
            memcpy(x->chart_axes + 9 * (ptrdiff_t)c + 3 * (ptrdiff_t)k,
                   system->model->motions[system->chart_first[c] + k].axis, 3 * sizeof(double));
    }
    return KEMPE_OK;
}

/* The condition whose change is the event of a state: the comparison of its rate, or the contact that changes it. */
static kempe_status take_discrete(kmp_code_source *source, const kmp_events *events)
{
    struct kmp_simulated *x = source->simulated;
    const kempe_model *model = source->model;
    if (!KMP_ARENA_MAKE(&source->arena, KMP_ROOM(int, source->discrete_count, &x->event, &x->sense, &x->settles)))
        return kmp_fail_memory(source->context);
    for (int k = 0; k < source->discrete_count; k++) {
        const int place = source->discrete_place[k] - kmp_model_coordinates(model);
        const kmp_state *state = &model->states[place];
        const kmp_expr *comparison = kmp_state_rate(model, place)->a;
        x->event[k] =
            state->contact > 0 ? kmp_events_find(events, &model->forces[state->contact - 1], KMP_PRESSING) : -1;
        for (int i = 0; comparison && i < events->count; i++)
            if (events->condition[i].expr == comparison)
                x->event[k] = i;
        x->sense[k] = !comparison || (comparison->kind != KMP_EXPR_AT_MOST && comparison->kind != KMP_EXPR_AT_LEAST);
        x->settles[k] = state->settles;
    }
    return KEMPE_OK;
}

static bool reads(const kmp_code_routine *r, kmp_input_kind kind, int index)
{
    for (int k = 0; k < r->program->input_count; k++)
        if (r->program->input[k].kind == kind && (index < 0 || (int)r->program->input[k].index == index))
            return true;
    return false;
}

const kmp_code_routine *kmp_simulated_routine(const kmp_code_source *source, const char *name)
{
    for (int k = 0; source->routines && k < source->count; k++)
        if (strcmp(source->routines[k].name, name) == 0)
            return &source->routines[k];
    return NULL;
}

/* Rows of a matrix of a routine: '0' where an entry is zero, otherwise 'x'. */
static char **zeros_of(kmp_arena *arena, const kmp_code_routine *r, const char *name, int rows, int cols)
{
    char **zeros = KMP_ARENA_NEW(arena, char *, rows);
    for (int i = 0; zeros && i < rows; i++) {
        zeros[i] = KMP_ARENA_NEW(arena, char, cols + 1);
        for (int j = 0; zeros[i] && j < cols; j++)
            zeros[i][j] = '0';
    }
    for (int a = 0; !arena->failed && a < r->array_count; a++) {
        const kmp_array *array = &r->arrays[a];
        const uint32_t *output = r->program->output + r->program->outputs[1] + array->first;
        for (int i = 0; strcmp(array->name, name) == 0 && i < rows; i++)
            for (int j = 0; j < (array->symmetric ? i + 1 : cols); j++) {
                int value = (int)(*output++ >> 1);
                if (value < r->program->constant_count && r->program->constant[value] == 0)
                    continue;
                zeros[i][j] = 'x';
                if (array->symmetric)
                    zeros[j][i] = 'x';
            }
    }
    return zeros;
}

/* True if only the start depends on a parameter. */
static bool is_of_start(const kmp_code_source *source, int symbol)
{
    bool alone = true;
    for (int k = 0; k < source->count; k++)
        if (strcmp(source->routines[k].name, "start") != 0)
            alone = alone && !reads(&source->routines[k], KMP_IN_PARAMETER, symbol);
    return alone;
}

/* Bounds of the conditions, by which the simulator finds their changes: kempe_watch. KEMPE_E_ARGUMENT with the name of
 * a condition that has no bounds. */
static kempe_status find_watch(kmp_code_source *source)
{
    /* The arguments of a simulator that inputs are. */
    static const int kinds[KMP_IN_COUNT] = {
        [KMP_IN_TIME] = KEMPE_WATCH_TIME,     [KMP_IN_Q] = KEMPE_WATCH_Q,
        [KMP_IN_QD] = KEMPE_WATCH_QD,         [KMP_IN_QDD] = KEMPE_WATCH_QDD,
        [KMP_IN_LAMBDA] = KEMPE_WATCH_LAMBDA, [KMP_IN_MODE] = KEMPE_WATCH_STILL,
        [KMP_IN_CHART] = KEMPE_WATCH_CHART,   [KMP_IN_PARAMETER] = KEMPE_WATCH_PARAMETER};
    struct kmp_simulated *x = source->simulated;
    const kmp_code_routine *changes = kmp_simulated_routine(source, "changes");
    if (!changes || x->condition_count == 0)
        return KEMPE_OK;
    const kmp_program *p = changes->program;
    kmp_bounds *bounds = kmp_bounds_new(p, &source->arena);
    bool *late = KMP_ARENA_NEW(&source->arena, bool, p->constant_count + p->input_count + p->code[p->stages]);
    if (!bounds || !late || !KMP_ARENA_MAKE(&source->arena, KMP_ROOM(int, 2 * p->input_count, &x->watch_input)))
        return kmp_fail_memory(source->context);
    x->watch = bounds;
    x->watch_first = p->outputs[1];
    x->watch_solved = p->outputs[p->stages] - p->outputs[1] - x->condition_count;
    for (int k = 0; k < p->input_count; k++) {
        const kmp_program_input *in = &p->input[k];
        x->watch_input[2 * k] = in->kind == KMP_IN_TIME && in->index > 0 ? KEMPE_WATCH_INPUT : kinds[in->kind];
        x->watch_input[2 * k + 1] = in->kind == KMP_IN_TIME && in->index == 0 ? 0
                                    : in->kind == KMP_IN_PARAMETER            ? source->place[in->index]
                                                                              : kmp_place_in_argument(source, in);
    }
    /* Marks values that depend on accelerations or multipliers. */
    const int first = bounds->code.constants + bounds->code.inputs;
    for (int k = 0; k < bounds->code.inputs; k++)
        late[bounds->code.constants + k] =
            x->watch_input[2 * k] == KEMPE_WATCH_QDD || x->watch_input[2 * k] == KEMPE_WATCH_LAMBDA;
    for (int k = 0; k < bounds->code.steps; k++) {
        const kmp_bound_step *in = &bounds->code.step[k];
        const int count = in->op == KMP_OP_IMPLICIT ? 0 : in->op == KMP_OP_TABLE ? 1 : kmp_op_arity((kmp_op)in->op);
        const unsigned operand[] = {in->a, in->b, in->c};
        for (int i = 0; i < count; i++)
            late[first + k] = late[first + k] || late[operand[i] >> 1];
    }
    for (int k = 0; k < x->condition_count; k++) {
        const int output = x->watch_first + k;
        if (!bounds->known[output])
            return kmp_fail(source->context, KEMPE_E_ARGUMENT,
                            "generated simulators: %s has a value that cannot be bounded within a step, so that its "
                            "change could be missed; use a unit on the library instead (fmu --binary)",
                            x->condition_name[k]);
        const bool third = late[bounds->output[output] >> 1] || bounds->given[output];
        x->watch_traits[k] |= third ? KEMPE_WATCH_MIDDLE : 0;
    }
    return kmp_made(source->context, !source->arena.failed);
}

kempe_status kmp_simulated_place(kmp_code_source *source)
{
    struct kmp_simulated *x = source->simulated;
    const kmp_code_routine *closures = kmp_simulated_routine(source, "closures"),
                           *motion = kmp_simulated_routine(source, "motion");
    const kmp_code_routine *changes = kmp_simulated_routine(source, "changes");
    const kmp_code_routine *start = kmp_simulated_routine(source, "start");
    if (!KMP_ARENA_MAKE(&source->arena, KMP_ROOM(int, source->parameter_count, &x->symbol, &x->fixed),
                        KMP_ROOM(int, source->n, &x->coordinate_kind),
                        KMP_ROOM(char *, source->input_count, &x->moved)))
        return kmp_fail_memory(source->context);
    for (int k = 0; k < source->input_count; k++) {
        const kmp_closure *closure = kmp_model_moved_by(source->model, k);
        x->moved[k] = kmp_arena_strdup(&source->arena, closure ? closure->name : "");
        if (closure)
            kmp_log(source->context, KEMPE_LOG_WARNING,
                    "input '%s' moves closure '%s': steps of a generated simulator refuse its changes, which an "
                    "integrator of the caller follows (model exchange)",
                    source->input_names[k], closure->name);
    }
    x->starts = start && reads(start, KMP_IN_PARAMETER, -1);
    for (int k = 0; k < source->symbol_count; k++)
        if (source->place[k] >= 0) {
            x->symbol[source->place[k]] = k;
            x->fixed[source->place[k]] = reads(closures, KMP_IN_PARAMETER, k) || is_of_start(source, k);
        }
    take_kinds(source);
    x->switches = reads(closures, KMP_IN_MODE, -1);
    x->loaded = reads(motion, KMP_IN_LAMBDA, -1);
    x->early = !reads(changes, KMP_IN_LAMBDA, -1) && !reads(changes, KMP_IN_QDD, -1);
    x->jacobian_zeros = zeros_of(&source->arena, closures, "J", source->m, source->n);
    x->mass_zeros = zeros_of(&source->arena, motion, "M", source->n, source->n);
    KMP_TRY(kmp_made(source->context, !source->arena.failed));
    return find_watch(source);
}

kempe_status kmp_simulated_find(kmp_code_source *source, const kmp_set_choice *choice)
{
    kempe_system *system = NULL;
    source->simulated = KMP_ARENA_NEW(&source->arena, struct kmp_simulated, 1);
    KMP_TRY(kmp_made(source->context, source->simulated));
    KMP_TRY(kmp_system_new_by(source->model, NULL, &system));
    kempe_status status = take_start(source, choice, system);
    if (status == KEMPE_OK)
        status = take_conditions(source, system, &choice->modes);
    if (status == KEMPE_OK)
        status = take_discrete(source, &choice->modes);
    if (status == KEMPE_OK)
        status = take_friction(source, system, &choice->modes);
    if (status == KEMPE_OK)
        status = take_charts(source, system);
    kempe_system_free(system);
    return status;
}
