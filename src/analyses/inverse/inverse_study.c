/* SPDX-License-Identifier: BSD-3-Clause */
/* The inverse dynamics study: reads the prescribed motion, moves the mechanism along it, stores the rows and judges
 * them. */
#include "analyses/inverse/inverse_study.h"
#include "analyses/inverse/inverse_dynamics.h"
#include "analyses/inverse/prescribed_states.h"
#include "analyses/parts/doubted_state.h"
#include "analyses/parts/series_summary.h"
#include "base/arena.h"
#include "base/context.h"
#include "base/memory.h"
#include "base/text.h"
#include "constraints/diagnosis/shared_loads.h"
#include "constraints/evaluation/state_ends.h"
#include "constraints/tolerances.h"
#include "dynamics/load_dependent.h"
#include "integrators/run/methods.h"
#include "integrators/run/run.h"
#include "model/data/closure_table.h"
#include "model/data/coordinates.h"
#include "model/data/model.h"
#include "model/read/loads.h"
#include "output/print.h"
#include "output/reference.h"
#include "output/samples.h"
#include "platform/platform.h"
#include <kempe/check.h>
#include <kempe/inverse.h>
#include <kempe/kempe.h>
#include <math.h>
#include <stdbool.h>
#include <string.h>

enum { FEWEST_ROWS = 9 };
/* Largest relative difference of generalized forces when every other row is left out. The error of a spline's
 * derivatives falls with the fourth power of the distance: with all rows it is a fifteenth of this. */
#define DERIVATIVES_HOLD 0.02

/* The working data of the study. */
typedef struct job {
    kempe_inverse *r;
    const kempe_system *system;
    kempe_context *context;
    const kempe_inverse_options *options;
    kmp_reference reference;
    kmp_prescribed table;
    kmp_times times;
    double t_first; /* added to the times */
    kmp_prescribed_states *states;
    kmp_prescribed_motion prescribed;
    kmp_inverse inverse;
    kmp_all_loads loads;
    double *load;    /* of the last row */
    double instant;  /* at which it has its forces */
    kmp_arena arena; /* of scratch */
} job;

/* -- construction and release ------------------------------------------------------------------------ */

static kempe_inverse *result_new(const kempe_system *s)
{
    kempe_inverse *r = KMP_NEW(kempe_inverse, 1);
    if (!r)
        return NULL;
    *r = (kempe_inverse){.system = s, .off.coordinate = -1, .build_s = s->build_s, .not_unique = ""};
    kmp_arena *a = &r->arena;
    if (!KMP_ARENA_MAKE(a, KMP_ROOM(int, s->model->closure_count, &r->loads.loop),
                        KMP_ROOM(int, s->model->body_count, &r->loads.joint), KMP_ROOM(int, s->n, &r->start_u)) ||
        !kmp_inverse_balance_make(&r->balance, a, s)) {
        kempe_inverse_free(r);
        return NULL;
    }
    for (int c = 0; c < s->model->closure_count; c++)
        if (!kmp_closure_is_drive(&s->model->closures[c]))
            r->loads.loop[r->loads.loops++] = c;
    return r;
}

KMP_FREES(kempe_inverse, inverse, kmp_free(inverse->warnings), kmp_reactions_free(&inverse->reactions),
          kmp_arena_free(&inverse->arena))

static bool has_multiplier(const kempe_inverse *r, int row)
{
    const kempe_system *s = r->system;
    return !kmp_closure_is_drive(&s->model->closures[s->rows[row].closure]);
}

static bool make_rows(kempe_inverse *r, ptrdiff_t rows)
{
    int multipliers = 0;
    for (int k = 0; k < r->system->m; k++)
        multipliers += has_multiplier(r, k);
    const int coordinates = kmp_model_coordinates(r->system->model), loads = kmp_inverse_load_count(r);
    const int size[] = {r->actuators.count, r->actuators.count, coordinates, r->system->n,
                        coordinates,        multipliers,        3 * loads,   3 * loads};
    int *const at[] = {&r->at.tau, &r->at.power,  &r->at.q,     &r->at.qd,
                       &r->at.qdd, &r->at.lambda, &r->at.force, &r->at.moment};
    for (size_t k = 0; k < sizeof at / sizeof *at; k++) {
        *at[k] = r->width;
        r->width += size[k];
    }
    return KMP_ARENA_MAKE(&r->arena, KMP_ROOM(double, rows, &r->t), KMP_ROOM(double, rows * r->width, &r->value));
}

/* -- options ----------------------------------------------------------------------------------------- */

static kempe_status choose_motion(job *j)
{
    kempe_inverse *r = j->r;
    const kempe_model *model = j->system->model;
    bool driven = false;
    for (int c = 0; c < model->closure_count; c++)
        driven = driven || kmp_is_drive_of_user(model, c);
    r->motion = j->options->motion ? KMP_INVERSE_TABLE : driven ? KMP_INVERSE_DRIVES : KMP_INVERSE_START;
    r->source = j->options->motion ? kmp_arena_strdup(&r->arena, j->options->motion) : NULL;
    KMP_TRY(kmp_made(j->context, !r->arena.failed));
    if (r->motion == KMP_INVERSE_START && (j->options->t_end > 0 || j->options->output_step > 0))
        return kmp_fail(j->context, KEMPE_E_ARGUMENT,
                        "%s: without a motion there is only the instant of the start; give a motion as a table "
                        "(--motion), or drives in the model",
                        j->options->t_end > 0 ? "t_end" : "output_step");
    KMP_TRY(kmp_coordinates_read(model, "independent", j->options->independent, r->start_u, &r->start_u_count));
    if (r->start_u_count == 0 && model->run.independent_count > 0) {
        r->start_u_count = model->run.independent_count;
        memcpy(r->start_u, model->run.independent, (size_t)r->start_u_count * sizeof *r->start_u);
    }
    return KEMPE_OK;
}

/* -- the motion -------------------------------------------------------------------------------------- */

static kempe_status read_table(job *j)
{
    kmp_gap_in_table gap;
    KMP_TRY(kmp_reference_read(j->system, j->options->motion, &j->reference));
    kmp_reference *x = &j->reference;
    if (j->options->t_end > 0)
        kmp_samples_limit(x, j->options->t_end);
    if (x->rows == 0)
        return kmp_complain(j->context, j->options->motion, 0, 0, "the file has no rows");
    if (!kmp_prescribed_init(&j->table, x->rows, x->t, j->system->n, x->value[KMP_QUANTITY_Q],
                             x->value[KMP_QUANTITY_QD], x->value[KMP_QUANTITY_QDD], &gap)) {
        KMP_TRY(kmp_made(j->context, gap.coordinate >= 0));
        return kmp_complain(j->context, j->options->motion, 0, 0,
                            "column %s.%s has no value at t = %.9g s: fill the column, or omit it",
                            kmp_quantity_prefix((kmp_quantity)gap.order),
                            j->system->model->motions[gap.coordinate].name, j->reference.t[gap.row]);
    }
    j->table.cut = x->cut;
    if (j->table.count == 0 && x->cut)
        return kmp_complain(j->context, j->options->motion, 0, 0,
                            "only columns of joint '%s' have positions, and it is cut: write 'cut: no' in this joint, "
                            "which keeps its coordinates",
                            x->cut);
    if (j->table.count == 0)
        return kmp_complain(j->context, j->options->motion, 0, 0, "column q.NAME is missing: positions are required");
    return KEMPE_OK;
}

static kempe_status prepare_motion(job *j)
{
    if (j->options->motion) {
        KMP_TRY(read_table(j));
        /* Rows of the table, or evenly from its first to its last. */
        const kmp_reference *x = &j->reference;
        double every = 0, span = x->t[x->rows - 1] - x->t[0];
        j->t_first = x->t[0];
        if (j->options->output_step > 0 && span > 0) {
            KMP_TRY(kmp_times_spacing(j->system, j->options->output_step, span, &every));
            return kmp_times_init(&j->times, every, span, NULL) ? KEMPE_OK : kmp_fail_memory(j->context);
        }
        j->times = (kmp_times){.count = x->rows, .t = KMP_NEW(double, x->rows)};
        KMP_TRY(kmp_made(j->context, j->times.t));
        memcpy(j->times.t, x->t, (size_t)x->rows * sizeof *x->t);
        j->t_first = 0;
        return KEMPE_OK;
    }
    if (j->r->motion == KMP_INVERSE_DRIVES) {
        double every, t_end = j->options->t_end > 0 ? j->options->t_end : j->system->model->run.t_end;
        if (!(t_end > 0))
            return kmp_fail(j->context, KEMPE_E_ARGUMENT, "t_end is missing: give it in the model or as an option");
        KMP_TRY(kmp_times_spacing(j->system, j->options->output_step, t_end, &every));
        return kmp_times_init(&j->times, every, t_end, NULL) ? KEMPE_OK : kmp_fail_memory(j->context);
    }
    j->times = (kmp_times){.count = 1, .t = KMP_NEW(double, 1)};
    return j->times.t ? KEMPE_OK : kmp_fail_memory(j->context);
}

/* At the start states have its values. */
static kempe_status prepare_states(job *j)
{
    if (j->system->model->state_count == 0 || j->r->motion == KMP_INVERSE_START)
        return KEMPE_OK;
    return j->options->motion
               ? kmp_prescribed_states_read(j->states, &j->arena, j->system, &j->reference, j->options->motion)
               : kmp_prescribed_states_run(j->states, &j->arena, j->system, &j->times, j->options->backend);
}

/* The guide along `table` (NULL: the drives, or at rest the start), and inverse dynamics on it. */
static kempe_status prepare_numbers(job *j, const kmp_prescribed *table, bool at_rest)
{
    const kempe_inverse *r = j->r;
    const kmp_backend *backend = kmp_backend_choose(j->context, j->options->backend);
    if (!backend)
        return KEMPE_E_ARGUMENT;
    j->r->backend = backend->name;
    KMP_TRY(kmp_prescribed_motion_init(&j->prescribed, j->system, backend->name, table, at_rest, r->start_u,
                                       r->start_u_count));
    return kmp_inverse_init(&j->inverse, j->prescribed.eval, r->actuators.count, r->actuators.coordinate,
                            r->actuators.weight);
}

static kempe_status prepare(job *j)
{
    kempe_inverse *r = j->r;
    const double numbers[] = {j->options->t_end, j->options->output_step};
    static const char *const names[] = {"t_end", "output_step"};
    for (int k = 0; k < 2; k++)
        if (!(numbers[k] >= 0 && isfinite(numbers[k])))
            return kmp_fail(j->context, KEMPE_E_ARGUMENT, "%s = %g: a positive number is expected", names[k],
                            numbers[k]);
    if (j->system->model->flexible_count > 0)
        return kmp_fail(
            j->context, KEMPE_E_ARGUMENT,
            "inverse dynamics: body '%s' is flexible, and its deformation follows from the motion; simulate the "
            "model with drives, whose multipliers are the actuator forces",
            j->system->model->bodies[j->system->model->flexibles[0].body].name);
    KMP_TRY(choose_motion(j));
    KMP_TRY(kmp_actuators_read(&r->actuators, &r->arena, j->system, j->options));
    KMP_TRY(prepare_motion(j));
    KMP_TRY(prepare_states(j));
    KMP_TRY(prepare_numbers(j, j->options->motion ? &j->table : NULL, r->motion == KMP_INVERSE_START));
    KMP_TRY(kmp_all_loads_init(&j->loads, j->system));
    r->loads.joints = j->loads.joints;
    if (r->loads.joints > 0)
        memcpy(r->loads.joint, j->loads.joint, (size_t)r->loads.joints * sizeof *r->loads.joint);
    KMP_TRY(kmp_load_share_read(j->context, j->options->loads, &r->least_norm));
    KMP_TRY(kmp_reactions_init(&r->reactions, j->system, &j->loads, false));
    r->reactions.least_norm = r->least_norm;
    j->load = KMP_ARENA_NEW(&j->arena, double, kmp_all_loads_count(&j->loads, j->system->model) + 1);
    KMP_TRY(kmp_made(j->context, j->load));
    return make_rows(r, j->times.count) ? KEMPE_OK : kmp_fail_memory(j->context);
}

static void release(job *j)
{
    kmp_all_loads_free(&j->loads);
    kmp_inverse_free(&j->inverse);
    kmp_prescribed_motion_free(&j->prescribed);
    kmp_times_free(&j->times);
    kmp_prescribed_free(&j->table);
    kmp_samples_free(&j->reference);
    kmp_arena_free(&j->arena);
}

/* -- rows -------------------------------------------------------------------------------------------- */

static kempe_status keep_row(job *j)
{
    kempe_inverse *r = j->r;
    const kmp_prescribed_motion *g = &j->prescribed;
    const kmp_inverse *v = &j->inverse;
    const kmp_instant at = {
        .t = j->instant, .q = g->q, .qd = g->qd, .qdd = g->qdd, .lambda = v->lambda, .inputs = &g->eval->inputs};
    double *row = kmp_inverse_part(r, r->rows, 0), *lambda = row + r->at.lambda;
    size_t state = (size_t)kmp_model_coordinates(j->system->model) * sizeof *row,
           rates = (size_t)r->system->n * sizeof *row, vector = 3 * sizeof *row;
    r->t[r->rows] = g->t;
    memcpy(row + r->at.tau, v->tau, (size_t)r->actuators.count * sizeof *row);
    for (int k = 0; k < r->actuators.count; k++)
        row[r->at.power + k] = v->tau[k] * g->qd[r->actuators.coordinate[k]] + 0.0; /* no -0 */
    memcpy(row + r->at.q, g->q, state);
    memcpy(row + r->at.qd, g->qd, rates);
    memcpy(row + r->at.qdd, g->qdd, state);
    for (int k = 0; k < r->system->m; k++)
        if (has_multiplier(r, k))
            *lambda++ = v->lambda[k] + 0.0; /* no -0 */
    const size_t loads = (size_t)kmp_all_loads_count(&j->loads, j->system->model);
    if (loads > 0)
        memcpy(j->load, kmp_all_loads_at(&j->loads, &at), loads * sizeof *row);
    if (r->least_norm)
        KMP_TRY(kmp_least_norm_loads(g->eval, j->instant, g->q, r->loads.joints, r->loads.joint, j->load));
    kmp_reactions_add(&r->reactions, g->t, j->load);
    for (int l = 0; l < kmp_inverse_load_count(r); l++) {
        const double *load = j->load + KMP_LOAD_VALUES * kmp_inverse_load_place(r, l);
        memcpy(row + r->at.force + 3 * l, load, vector);
        memcpy(row + r->at.moment + 3 * l, load + 3, vector);
    }
    kmp_eval_doubt_state(g->eval, g->t, g->q, g->qd, g->qdd, v->lambda, true, true, NULL);
    kmp_inverse_balance_add(&r->balance, v, r->rows, r->t);
    r->rows++;
    return KEMPE_OK;
}

/* Goes to the k-th instant, t, and computes the forces there. */
static kempe_status go_to(job *j, int k, double t)
{
    kmp_prescribed_motion *g = &j->prescribed;
    g->state = kmp_prescribed_states_at(j->states, j->system->model, k, t);
    KMP_TRY(k > 0 ? kmp_prescribed_motion_advance(g, t) : kmp_prescribed_motion_start(g, t));
    j->instant = kmp_eval_row_time(g->eval, g->t, g->q, g->qd);
    return kmp_inverse_at(&j->inverse, j->instant, g->q, g->qd, g->qdd);
}

static kempe_status follow(job *j)
{
    for (int k = 0; k < j->times.count; k++) {
        if (kmp_interrupted(j->context))
            return kmp_fail(j->context, KEMPE_STOPPED, "interrupted at t = %.9g s", j->prescribed.t);
        KMP_TRY(go_to(j, k, j->times.t[k] + j->t_first));
        KMP_TRY(keep_row(j));
        kmp_progress(j->context, KMP_PROGRESS_STUDY, k + 1, j->times.count, "rows");
    }
    return KEMPE_OK;
}

/* -- check of derivatives from the table -------------------------------------------------------------- */

/* The table with every other row of j's. False: no memory. */
static bool thin_out(const job *j, job *thin)
{
    const kmp_reference *x = &j->reference;
    size_t rows = (size_t)(x->rows + 1) / 2, n = (size_t)j->system->n;
    double *t, *value[3];
    kmp_gap_in_table gap;
    if (!KMP_ARENA_MAKE(&thin->arena, KMP_ROOM(double, rows, &t),
                        KMP_ROOM(double, rows *n, &value[0], &value[1], &value[2])))
        return false;
    for (size_t r = 0; r < rows; r++) {
        t[r] = x->t[2 * r];
        for (int v = 0; v < 3; v++)
            memcpy(value[v] + r * n, x->value[KMP_QUANTITY_Q + v] + 2 * r * n, n * sizeof(double));
    }
    return kmp_prescribed_init(&thin->table, (int)rows, t, (int)n, value[0], value[1], value[2], &gap);
}

/* Repeats the rows along the thinned table, as far as possible. */
static kempe_status follow_again(job *j, const double *size, double end)
{
    kempe_inverse *r = j->r;
    kempe_status status = KEMPE_OK;
    for (int k = 0; k < r->rows && r->t[k] <= end && status == KEMPE_OK; k++) {
        status = go_to(j, k, r->t[k]);
        if (status == KEMPE_OK)
            kmp_convergence_row(&r->again, r->t[k], r->actuators.count, kmp_inverse_part(r, k, r->at.tau),
                                j->inverse.tau, size);
    }
    if (status != KEMPE_OK)
        r->again.stopped = j->prescribed.t;
    return status == KEMPE_E_MEMORY ? status : KEMPE_OK;
}

/* Names loads that are shared at the first row and the last. */
static kempe_status report_shared_loads(const job *j)
{
    kempe_inverse *r = j->r;
    kmp_shared_loads found;
    if (r->rows == 0 || r->system->model->closure_count == 0)
        return KEMPE_OK;
    const double t[2] = {r->t[0], r->t[r->rows - 1]};
    const double *const q[2] = {kmp_inverse_part(r, 0, r->at.q), kmp_inverse_part(r, r->rows - 1, r->at.q)};
    KMP_TRY(kmp_shared_loads_between(j->prescribed.eval, t, q, r->loads.joints, r->loads.joint, r->reactions.last,
                                     &r->arena, &found));
    KMP_TRY(kmp_reactions_mark(&r->reactions, &found));
    return kmp_report_shared_loads(r->system, &found, r->least_norm, &r->arena, &r->not_unique);
}

/* Repeats the study with every other row, where rates or accelerations are derivatives of splines through the rows. */
static kempe_status repeat(const job *j, job *again)
{
    kempe_inverse *r = j->r;
    double *size = KMP_ARENA_NEW(&again->arena, double, r->actuators.count);
    KMP_TRY(kmp_made(j->context, size && thin_out(j, again)));
    for (int k = 0; k < r->actuators.count; k++)
        size[k] = fmax(fabs(kmp_inverse_summarise(r, k).peak), KMP_EFFORTS_LEFT * r->balance.size);
    r->again = (kmp_convergence){.known = true, .rtol = NAN, .limit = DERIVATIVES_HOLD, .stopped = NAN};
    KMP_TRY(prepare_numbers(again, &again->table, false));
    const bool quiet = kmp_context_quiet(j->context, true);
    kempe_status status = follow_again(again, size, again->table.t[again->table.rows - 1]);
    (void)kmp_context_quiet(j->context, quiet);
    return status;
}

/* Warns where closures that depend on time, other than drives, prescribe all motion: they carry its loads. */
static void warn_of_guides(const job *j)
{
    const kempe_system *s = j->system;
    const kempe_inverse *r = j->r;
    const double *h_t = j->prescribed.eval ? j->prescribed.eval->h_t : NULL;
    for (int k = 0; h_t && r->balance.freedoms == 0 && r->actuators.count > 0 && k < s->m; k++)
        if (h_t[k] != 0 && has_multiplier(r, k)) {
            kmp_doubt(s->context,
                      "closure '%s' depends on time: it prescribes the motion and carries its loads, so that nothing "
                      "is left to the actuators; prescribe the motion by drives or a table",
                      s->model->closures[s->rows[k].closure].name);
            return;
        }
}

static kempe_status check_again(job *j)
{
    job again = {.r = j->r, .system = j->system, .context = j->context, .options = j->options, .states = j->states};
    kempe_status status = repeat(j, &again);
    release(&again);
    if (status == KEMPE_OK) {
        kmp_context_clear(j->context);
        const kempe_inverse *r = j->r;
        if (!kmp_convergence_holds(&r->again))
            kmp_doubt(r->system->context,
                      "do not trust these actuator forces: from half the rows '%s' differs by %.2g of its maximum at t "
                      "= %.6g s; add velocities and accelerations, or more rows",
                      r->system->model->motions[r->actuators.coordinate[r->again.index]].name, r->again.difference,
                      r->again.t);
    }
    return status;
}

/* -- summary ----------------------------------------------------------------------------------------- */

static kempe_status run(job *j)
{
    kempe_inverse *r = j->r;
    double begin = kmp_cpu_now();
    r->status = follow(j);
    r->cpu_s = kmp_cpu_now() - begin;
    if (r->status == KEMPE_OK)
        r->status = kmp_inverse_balance_judge(&r->balance, r->system);
    if (!kmp_has_result(r->status))
        return r->status;
    r->off = j->prescribed.off;
    if (r->motion == KMP_INVERSE_START && j->prescribed.red.eval) {
        r->start_u_count = 0;
        for (int k = 0; k < j->prescribed.part.p; k++)
            if (j->prescribed.part.u[k] < kmp_model_coordinates(j->system->model))
                r->start_u[r->start_u_count++] = j->prescribed.part.u[k];
    }
    r->reason = kmp_arena_strdup(&r->arena, r->status == KEMPE_OK ? "" : kempe_context_message(r->system->context));
    KMP_TRY(r->reason ? r->status : kmp_fail_memory(r->system->context));
    warn_of_guides(j);
    KMP_TRY(report_shared_loads(j));
    bool differentiated = false;
    for (int k = 0; k < j->table.count && j->table.rows >= FEWEST_ROWS; k++)
        differentiated = differentiated || !j->table.given[1][k] || !j->table.given[2][k];
    r->unchecked = j->options->no_convergence_check && differentiated;
    return differentiated && !r->unchecked ? check_again(j) : KEMPE_OK;
}

kempe_status kempe_inverse_new(const kempe_system *system, const kempe_inverse_options *options,
                               kempe_inverse **inverse)
{
    KMP_WANTED_BOTH(system, inverse);
    KMP_OPTIONS(system->context, kempe_inverse_options, options);
    double begin = kmp_cpu_now();
    kmp_model_begin_forces(system->model);
    KMP_TRY(kmp_refuse_contacts(system->model, "inverse dynamics"));
    kmp_prescribed_states states = {0};
    job j = {
        .system = system, .context = system->context, .options = options, .states = &states, .r = result_new(system)};
    KMP_TRY(kmp_made(system->context, j.r));
    kempe_status status = prepare(&j);
    j.r->build_s += kmp_cpu_now() - begin;
    bool ready = status == KEMPE_OK;
    if (ready)
        status = run(&j);
    release(&j);
    kmp_prescribed_states_free(&states);
    j.r->warnings = kmp_context_warnings(j.context);
    status = kmp_context_verdict(j.context, status);
    j.r->status = status == KEMPE_UNTRUSTED ? status : j.r->status;
    return KMP_GIVE_IF(ready && kmp_has_result(status), status, inverse, j.r, kempe_inverse_free);
}

/* -- queries ------------------------------------------------------------------------------------------ */

kmp_inverse_summary kmp_inverse_summarise(const kempe_inverse *inverse, int k)
{
    const kempe_inverse *r = inverse;
    kmp_inverse_summary s = {0};
    for (int row = 0; row < r->rows; row++) {
        double tau = *kmp_inverse_part(r, row, r->at.tau + k), power = *kmp_inverse_part(r, row, r->at.power + k);
        if (row == 0 || fabs(tau) > fabs(s.peak)) {
            s.peak = tau;
            s.peak_t = r->t[row];
        }
        if (row == 0 || fabs(power) > fabs(s.power)) {
            s.power = power;
            s.power_t = r->t[row];
        }
        if (row > 0) {
            double h = r->t[row] - r->t[row - 1];
            s.work += h / 2 * (power + *kmp_inverse_part(r, row - 1, r->at.power + k));
        }
    }
    s.rms = kmp_series_summarise(r->rows, r->t, r->value + r->at.tau + k, r->width).rms;
    return s;
}

KMP_GETTER(kempe_outcome kempe_inverse_outcome(const kempe_inverse *inverse), inverse,
           kmp_outcome_checked(inverse->status, !inverse->unchecked), KEMPE_OUTCOME_NONE)
KMP_GETTER(const char *kempe_inverse_reason(const kempe_inverse *inverse), inverse, inverse->reason, "")
KMP_GETTER(const char *kempe_inverse_loads_not_unique(const kempe_inverse *inverse), inverse, inverse->not_unique, "")
KMP_GETTER(int kempe_inverse_dof(const kempe_inverse *inverse), inverse, inverse->balance.freedoms, 0)
KMP_GETTER(int kempe_inverse_rank(const kempe_inverse *inverse), inverse, inverse->balance.rank, 0)
KMP_GETTER(double kempe_inverse_residual(const kempe_inverse *inverse), inverse, inverse->balance.residual, NAN)

int kmp_inverse_load_count(const kempe_inverse *inverse)
{
    return inverse->loads.loops + inverse->loads.joints;
}

const char *kmp_inverse_load_name(const kempe_inverse *inverse, int load)
{
    const kempe_model *model = inverse->system->model;
    const kmp_inverse_loads *of = &inverse->loads;
    return load < of->loops ? model->closures[of->loop[load]].name : model->bodies[of->joint[load - of->loops]].joint;
}

int kmp_inverse_load_place(const kempe_inverse *inverse, int load)
{
    const kmp_inverse_loads *of = &inverse->loads;
    return load < of->loops ? of->loop[load] : inverse->system->model->closure_count + load - of->loops;
}
