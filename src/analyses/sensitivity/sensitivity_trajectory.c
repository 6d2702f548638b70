/* SPDX-License-Identifier: BSD-3-Clause */
/* Sensitivities of trajectories: rows over time by forward sensitivities; the end, or integrals up to it, by either
 * method. */
#include "analyses/sensitivity/sensitivity_trajectory.h"
#include "analyses/derivatives/linearized.h"
#include "analyses/derivatives/varied_lanes.h"
#include "analyses/sensitivity/adjoint.h"
#include "analyses/sensitivity/forward.h"
#include "analyses/sensitivity/sensitivity_study.h"
#include "base/memory.h"
#include "constraints/tolerances.h"
#include "dynamics/load_dependent.h"
#include "integrators/steppers/solver.h"
#include "model/data/closure_table.h"
#include "model/data/model.h"
#include "output/reference.h"
#include "pipeline.h"
#include "platform/platform.h"
#include "studies/simulate/trajectory.h"
#include <kempe/output_handles.h>
#include <kempe/sensitivity.h>
#include <math.h>
#include <string.h>

/* An adjoint run of one scalar takes about as long as forward ones with this number of parameters
 * (docs/sensitivity.md). */
enum { WORTH_ADJOINT = 4 };

/* Errors of more tolerances are reported. */
#define PROMISED 100.0

typedef struct work {
    kempe_sensitivity *s;
    kmp_slopes *slopes;
    kmp_slopes_sum sum; /* of the adjoint method */
    kmp_sensitivity_equations varied;
    kmp_varied_lanes lanes; /* of them, for the integrators that use these */
    kmp_run_spec spec;
    kmp_times times;
    kmp_forward options;
    double *w[KMP_QUANTITIES + 1], *gradient; /* weights of one column */
    bool adjoint;
    kmp_forward_report report; /* of the last run */
    kmp_arena arena;           /* of the arrays */
    double *other, *size;      /* a row, and its sizes */
    int row;                   /* to be compared next */
    kmp_convergence *found;    /* of a repeat run relative to the first; NULL: it is the first */
    int (*watch)(void *user, const kmp_sensitivity_equations_row *row);
    void *watcher;
} work;

/* -- options ----------------------------------------------------------------------------------------- */

static bool carries(const kmp_solver_kind *kind)
{
    return kind->corrects && !kind->dae;
}

/* Chooses an integrator. If the model's integrator does not support sensitivities, another of the same kind replaces
 * it. */
static kempe_status choose_integrator(work *w, kempe_run_options *run)
{
    const kempe_sensitivity *s = w->s;
    const char *wished = s->model->run.integrator;
    const kmp_solver_kind *kind = wished ? kmp_solver_find(wished) : NULL;
    if (kind && !carries(kind))
        wished = kind->implicit || kind->dae ? "radau9" : NULL;
    const bool lanes = kmp_varied_lanes_suit(s->system) && !s->options->integral;
    run->integrator = s->run->integrator ? s->run->integrator : wished ? wished : lanes ? "radau" : "dop853";
    kind = kmp_solver_find(run->integrator);
    if (kind && carries(kind))
        return KEMPE_OK;
    kmp_text sentence = {0};
    kmp_text_printf(&sentence, "integrator '%s' does not support sensitivities; available:", run->integrator);
    for (int k = 0, named = 0; kmp_solver_get(k); k++)
        if (carries(kmp_solver_get(k)))
            kmp_text_printf(&sentence, "%s %s", named++ ? "," : "", kmp_solver_get(k)->name);
    return kmp_fail_text(s->context, KEMPE_E_ARGUMENT, &sentence);
}

static kmp_column *source_of(const work *w, int column)
{
    return &w->s->outputs.of[w->s->chosen[column]];
}

/* A multiplier of an element with modes is its force in every mode, which is among the outputs of the equations. */
static bool is_of_modes(const work *w, int column)
{
    const kempe_system *s = w->s->system;
    const kmp_column *of = source_of(w, column);
    return of->quantity == KMP_QUANTITY_LAMBDA &&
           kmp_closure_is_of_modes(&s->model->closures[s->rows[of->index].closure]);
}

static kempe_status prepare(work *w)
{
    kempe_sensitivity *s = w->s;
    kempe_run_options run = *w->s->run;
    double every;
    run.formulation = "reduced";
    run.form = "newton";
    KMP_TRY(choose_integrator(w, &run));
    KMP_TRY(kmp_spec_of(w->s->system, &run, &w->arena, &w->spec));
    KMP_TRY(kmp_times_spacing(w->s->system, run.output_step, w->spec.t_end, &every));
    KMP_TRY(kmp_times_init(&w->times, every, w->spec.t_end, NULL) ? KEMPE_OK : kmp_fail_memory(w->s->context));
    KMP_TRY(kmp_made(s->context, kmp_sensitivity_choose(s)));
    s->integrator = kmp_solver_find(w->spec.integrator)->name;
    s->backend = w->spec.backend;
    s->rtol = w->spec.rtol;
    s->atol = w->spec.atol;
    s->t_end = w->spec.t_end;
    if (s->differences)
        return KEMPE_OK;
    bool shown = false;
    for (int c = 0; c < s->columns; c++)
        shown = shown || source_of(w, c)->quantity == KMP_QUANTITIES || is_of_modes(w, c);
    KMP_TRY(kmp_slopes_new(s->system, w->spec.backend, s->count, (const char *const *)s->name, shown, &w->slopes));
    for (int c = 0; c < s->columns; c++)
        if (is_of_modes(w, c)) {
            source_of(w, c)->index = kmp_slopes_force_of_modes(w->slopes, source_of(w, c)->index);
            source_of(w, c)->quantity = KMP_QUANTITIES;
        }
    KMP_TRY(kmp_sensitivity_equations_init(&w->varied, s->system, w->spec.backend, w->slopes));
    kmp_linear_derive(&w->varied.linear);
    if (w->adjoint) {
        KMP_TRY(kmp_slopes_sum_init(&w->sum, s->system, kmp_backend_find(w->spec.backend), s->count,
                                    (const char *const *)s->name));
        w->varied.sum = &w->sum;
    }
    bool lanes = kmp_solver_find(w->spec.integrator)->lanes && kmp_varied_lanes_can(&w->varied);
    if (lanes)
        KMP_TRY(kmp_varied_lanes_init(&w->lanes, &w->varied));
    if (lanes)
        KMP_TRY(kmp_varied_lanes_expect(&w->lanes, w->spec.u, w->spec.u_count));
    w->options = (kmp_forward){.spec = &w->spec, .lanes = lanes ? &w->lanes : NULL};
    return kmp_made(s->context, KMP_ARENA_MAKE(&w->arena,
                                               KMP_ROOM(double, s->system->n, &w->w[KMP_QUANTITY_Q],
                                                        &w->w[KMP_QUANTITY_QD], &w->w[KMP_QUANTITY_QDD]),
                                               KMP_ROOM(double, s->system->m, &w->w[KMP_QUANTITY_LAMBDA]),
                                               KMP_ROOM(double, w->slopes->shown, &w->w[KMP_QUANTITIES]),
                                               KMP_ROOM(double, s->count, &w->gradient),
                                               KMP_ROOM(double, kmp_sensitivity_width(s), &w->other, &w->size)));
}

/* -- rows, kept or compared -------------------------------------------------------------------------- */

/* Takes the row in w->other, or compares it with the stored one: the size of a number is its largest value so far. */
static bool take(work *w, double t)
{
    kempe_sensitivity *s = w->s;
    size_t width = kmp_sensitivity_width(s);
    if (!w->found) {
        double *row = kmp_sensitivity_add_row(s, t);
        if (row)
            memcpy(row, w->other, width * sizeof *row);
        return row;
    }
    if (w->row >= s->rows || t > s->at[w->row] || t < s->at[w->row])
        return true; /* where a condition ends it */
    const double *first = s->cell + (size_t)w->row++ * width;
    for (size_t k = 0; k < width; k++)
        w->size[k] = fmax(w->size[k], fabs(first[k]));
    kmp_convergence_row(w->found, t, (int)width, first, w->other, w->size);
    return true;
}

/* -- rows over time ---------------------------------------------------------------------------------- */

static int take_row(void *user, const kmp_sensitivity_equations_row *row)
{
    work *w = user;
    kmp_sensitivity_fill(w->s,
                         &(kmp_sensitivity_source){{row->q, row->qd, row->qdd, row->lambda, row->shown},
                                                   {row->dq, row->dqd, row->dqdd, row->dlambda, row->dshown},
                                                   w->slopes->shown},
                         w->other);
    return !take(w, row->t) || (w->watch && w->watch(w->watcher, row));
}

static kempe_status find_rows(work *w, int count, const double *t)
{
    w->spec.times = t;
    w->spec.time_count = count;
    w->options.watch = (kmp_sensitivity_equations_watch){.user = w, .row = take_row};
    return kmp_forward_run(&w->varied, &w->options, w->s->size, NULL, &w->report);
}

/* -- one row ----------------------------------------------------------------------------------------- */

/* `known`: a target before had the same motion. */
static kempe_status find_adjoint(work *w, const kmp_forward_target *target, bool known, double *value)
{
    kempe_sensitivity *s = w->s;
    kmp_adjoint_report report;
    const bool integral = s->options->integral != 0;
    kempe_status status =
        kmp_adjoint_run(&w->varied, &w->options, target, integral, known && !integral, s->size, w->gradient, &report);
    *value = report.value;
    w->report = report.forward;
    w->report.run.rhs += report.rhs;
    if (!w->found) {
        s->backwards += (double)report.steps;
        s->backwards_s += report.cpu_s;
        s->kept = fmax(s->kept, (double)report.kept);
    }
    return status;
}

static kempe_status find_integral(work *w, const kmp_forward_target *target, double *value)
{
    w->options.integrand = target;
    kempe_status status = kmp_forward_run(&w->varied, &w->options, w->s->size, w->gradient, &w->report);
    w->options.integrand = NULL;
    *value = w->report.integral;
    return status;
}

static void add_work(work *w)
{
    kempe_slope_work *to = &w->s->work;
    const kmp_run_report *report = &w->report.run;
    to->steps += w->found ? 0 : report->steps;
    to->rejected += w->found ? 0 : report->rejected;
    to->refused += w->found ? 0 : report->refused;
    to->rhs += w->found ? 0 : report->rhs;
    to->exchanges += w->found ? 0 : report->exchanges;
}

/* A run a column; into w->other. */
static kempe_status find_scalars(work *w)
{
    kempe_sensitivity *s = w->s;
    kempe_status status = KEMPE_OK;
    double *slopes = w->other + s->columns;
    for (int c = 0; status == KEMPE_OK && c < s->columns; c++) {
        /* The weights of only column c. */
        const kmp_column *of = source_of(w, c);
        const int size[] = {w->varied.n, w->varied.n, w->varied.n, w->varied.m, w->slopes->shown};
        const double *part[KMP_QUANTITIES + 1] = {NULL};
        memset(w->w[of->quantity], 0, (size_t)size[of->quantity] * sizeof(double));
        w->w[of->quantity][of->index] = 1;
        part[of->quantity] = w->w[of->quantity];
        kmp_forward_target target = (kmp_forward_target){part[0], part[1], part[2], part[3], part[4]};
        status = w->adjoint ? find_adjoint(w, &target, c > 0, &w->other[c]) : find_integral(w, &target, &w->other[c]);
        memcpy(slopes + c * s->count, w->gradient, (size_t)s->count * sizeof *slopes);
        if (c + 1 < s->columns && status == KEMPE_OK)
            add_work(w);
    }
    return status == KEMPE_OK && !take(w, s->t_end) ? kmp_fail_memory(s->context) : status;
}

static kempe_status find_once(work *w)
{
    kempe_status status =
        w->adjoint || w->s->options->integral ? find_scalars(w) : find_rows(w, w->times.count, w->times.t);
    add_work(w);
    return status;
}

/* -- another time ------------------------------------------------------------------------------------ */

static kempe_status find_again(void *user, double rtol, int count, const int *which, kmp_convergence *found)
{
    work *w = user;
    kmp_run_spec first = w->spec;
    (void)count, (void)which;
    w->spec.rtol = rtol;
    w->spec.atol *= rtol / first.rtol;
    w->found = found;
    w->row = 0;
    kempe_status status = find_once(w);
    w->found = NULL;
    w->spec = first;
    kmp_free(w->report.run.reason);
    w->report.run.reason = NULL;
    if (status == KEMPE_E_MEMORY || (status == KEMPE_STOPPED && !w->report.run.ended))
        return status;
    if (status != KEMPE_OK)
        found->stopped = w->report.run.t;
    return KEMPE_OK;
}

/* True if the number depends on the choice among redundant rows. */
static bool is_ambiguous(const work *w, int column)
{
    kmp_output_kind kind = w->s->system->model->outputs[source_of(w, column)->output].kind;
    return w->report.redundant > 0 &&
           (kind == KMP_OUTPUT_LAMBDA || kind == KMP_OUTPUT_REACTION || kind == KMP_OUTPUT_MOMENT ||
            kind == KMP_OUTPUT_CAM_FORCE || kind == KMP_OUTPUT_JOINT_REACTION || kind == KMP_OUTPUT_JOINT_MOMENT ||
            kind == KMP_OUTPUT_BEARING);
}

/* The characteristic size of a unit in this run, where the equations have one; otherwise the largest number with it. */
static double size_of_unit(const work *w, int column)
{
    const kempe_sensitivity *s = w->s;
    const char *unit = s->unit[column];
    double rate = w->report.run.rate_scale, length = s->system->length, most = 0;
    const struct {
        const char *unit;
        double size;
    } known[] = {{"rad", 1},    {"rad/s", rate},        {"rad/s^2", rate * rate},
                 {"m", length}, {"m/s", length * rate}, {"m/s^2", length * rate * rate}};
    for (size_t k = 0; k < sizeof known / sizeof *known; k++)
        if (strcmp(unit, known[k].unit) == 0)
            return known[k].size;
    for (int c = 0; c < s->columns; c++)
        for (int row = 0; strcmp(unit, s->unit[c]) == 0 && row < s->rows; row++)
            most = fmax(most, fabs(kmp_sensitivity_value(s, row, c)));
    return most > 0 ? most : 1;
}

static kempe_status check_again(work *w)
{
    kempe_sensitivity *s = w->s;
    double begin = kmp_cpu_now();
    /* The size of a small derivative is a value's size over the parameter's, as in its error control. */
    double integrated = s->options->integral ? s->t_end : 1;
    for (int c = 0; c < s->columns; c++) {
        w->size[c] = is_ambiguous(w, c) ? INFINITY : integrated * size_of_unit(w, c);
        for (int k = 0; k < s->count; k++)
            w->size[s->columns + c * s->count + k] = w->size[c] / s->size[k];
    }
    const kmp_repeat repeat = {
        .context = s->context, .rtol = w->spec.rtol, .promised = PROMISED, .user = w, .run = find_again};
    kempe_status status = kmp_convergence_of(&repeat, 1, &s->again);
    if (status == KEMPE_OK) {
        /* "q.rocker", or "q.rocker/crank" as in the table. */
        int index = s->again.index, slope = index - s->columns;
        s->again_name = kmp_arena_printf(&s->arena, "%s%s%s", s->column[slope < 0 ? index : slope / s->count],
                                         slope < 0 ? "" : "/", slope < 0 ? "" : s->name[slope % s->count]);
        status = kmp_made(s->context, s->again_name);
    }
    if (status == KEMPE_OK)
        kmp_convergence_warn(s->context, &s->again, s->again_name, NULL, kmp_accuracy_remedy(w->spec.rtol));
    s->again_s = kmp_cpu_now() - begin;
    return status;
}

/* -- the whole --------------------------------------------------------------------------------------- */

static void free_work(work *w)
{
    kmp_times_free(&w->times);
    kmp_varied_lanes_free(&w->lanes);
    kmp_sensitivity_equations_free(&w->varied);
    kmp_slopes_sum_free(&w->sum);
    kmp_slopes_free(w->slopes);
    kmp_arena_free(&w->arena);
}

static kempe_status find(kempe_sensitivity *s)
{
    const char *method = s->options->method;
    const bool many = s->options->integral && s->count >= WORTH_ADJOINT && s->system->load_row_count == 0 &&
                      !kmp_model_has_samples(s->model) && s->model->delay_count == 0 && !s->system->switches;
    work w = {.s = s, .adjoint = method ? strcmp(method, "adjoint") == 0 : many};
    const double begin = kmp_cpu_now();
    kempe_status status = prepare(&w);
    s->build_s += kmp_cpu_now() - begin;
    s->method = w.adjoint ? "adjoint" : "forward";
    if (status == KEMPE_OK && w.adjoint)
        status = kmp_refuse_delays(s->model, "the adjoint method", "use the forward method");
    if (status == KEMPE_OK) {
        /* The report's reason is the reason of the result; the context's message is the same. */
        status = find_once(&w);
        if (status == KEMPE_E_FAILED && w.report.run.reason &&
            !strstr(kempe_context_message(s->context), w.report.run.reason))
            (void)kmp_fail(s->context, status, "%s", w.report.run.reason);
        s->reason = w.report.run.reason;
        w.report.run.reason = NULL;
    }
    if (status == KEMPE_OK && s->rows > 0 && s->columns > 0 && !s->run->no_convergence_check)
        status = check_again(&w);
    free_work(&w);
    return status;
}

/* -- runs with other values -------------------------------------------------------------------------- */

struct kmp_slope_runs {
    kempe_sensitivity *s;
    work w;
    int count;
    double *t;
    bool differences;
    const char *words, *independent; /* of differences: outputs, and independent coordinates */
};

static kempe_status prepare_runs(kmp_slope_runs *r, const kempe_model *model, const kempe_sensitivity_options *options,
                                 const double *t)
{
    const kempe_run_options *given = options->run;
    KMP_OPTIONS(model->context, kempe_run_options, given);
    kempe_run_options run = *given;
    run.t_end = t[r->count - 1];
    KMP_TRY(kmp_sensitivity_begin(model, options, &run, r->differences, &r->s));
    r->w.s = r->s;
    kempe_status status = prepare(&r->w);
    r->s->options = NULL;
    r->s->run = NULL;
    r->independent = given->independent;
    r->s->method = "forward";
    return status;
}

kempe_status kmp_slope_runs_new(const kempe_model *model, const kempe_sensitivity_options *options, int count,
                                const double *t, bool differences, kmp_slope_runs **runs)
{
    double begin = kmp_cpu_now();
    KMP_MAKE(model->context, kmp_slope_runs, r);
    r->count = count;
    r->differences = differences;
    r->words = options->outputs;
    r->t = KMP_NEW(double, count);
    kempe_status status = kmp_made(model->context, r->t);
    if (status == KEMPE_OK)
        memcpy(r->t, t, (size_t)count * sizeof *t);
    if (status == KEMPE_OK)
        status = prepare_runs(r, model, options, t);
    if (status == KEMPE_OK)
        r->s->build_s = kmp_cpu_now() - begin;
    return KMP_GIVE_OR_FREE(status, runs, r, kmp_slope_runs_free);
}

KMP_FREES(kmp_slope_runs, runs, free_work(&runs->w), kempe_sensitivity_free(runs->s), kmp_free(runs->t))

void kmp_slope_runs_set_times(kmp_slope_runs *runs, int count, const double *t)
{
    runs->count = count;
    memcpy(runs->t, t, (size_t)count * sizeof *t);
    runs->w.spec.t_end = t[count - 1];
}

void kmp_slope_runs_watch(kmp_slope_runs *runs, int (*row)(void *user, const kmp_sensitivity_equations_row *row),
                          void *user)
{
    runs->w.watch = row;
    runs->w.watcher = user;
}

void kmp_slope_runs_keep_length(kmp_slope_runs *runs, double length)
{
    runs->s->system->kept_length = length;
}

void kmp_slope_runs_weigh(kmp_slope_runs *runs, double atol, const double *sizes)
{
    runs->w.spec.atol = atol;
    memcpy(runs->s->size, sizes, (size_t)runs->s->count * sizeof *sizes);
}

void kmp_slope_runs_bound(kmp_slope_runs *runs, long times, long least)
{
    const kmp_run_report *last = &runs->w.report.run;
    const long most = times * (last->steps + last->rejected);
    if (runs->w.spec.max_steps == 0)
        runs->w.spec.max_steps = most > least ? most : least;
}

long kmp_slope_runs_most(const kmp_slope_runs *runs)
{
    return runs->w.spec.max_steps;
}

void kmp_slope_runs_set_most(kmp_slope_runs *runs, long most)
{
    runs->w.spec.max_steps = most;
}

const kempe_sensitivity *kmp_slope_runs_rows(const kmp_slope_runs *runs)
{
    return runs->s;
}

/* -- derivatives by differences of whole runs -------------------------------------------------------- */

/* Of models whose motion has no exact ones here: friction that sticks. The motion is continuous in the parameters, with
 * derivatives between the changes of modes. */

/* Places of a parameter: two on each side. */
enum { PLACES = 4 };

static const double place[PLACES] = {-2, -1, 1, 2};

typedef struct differences {
    kempe_sensitivity *s;
    kempe_run_options run;
    const char *words;
    int count;
    const double *t;
    double *values, *row;         /* of a run; of all outputs */
    double *cells, *cell[PLACES]; /* count x columns: at the values, and near them */
    bool known[PLACES];
    kmp_run_report report; /* of the run at the values */
    kmp_arena arena;
} differences;

static kempe_status fill_cells(differences *d, kempe_trajectory *motion, double *cells)
{
    const kempe_sensitivity *s = d->s;
    kempe_outputs *outputs = NULL;
    const bool quiet = kmp_context_quiet(s->context, true); /* outputs have no separate warnings */
    kempe_status status = kempe_outputs_new(s->system, d->words, &outputs);
    for (int row = 0; row < d->count && status == KEMPE_OK; row++) {
        status = kempe_outputs_at_time(outputs, motion, d->t[row], d->row);
        for (int c = 0; c < s->columns && status == KEMPE_OK; c++)
            cells[(ptrdiff_t)row * s->columns + c] = d->row[kempe_outputs_find(outputs, s->column[c])];
    }
    kempe_outputs_free(outputs);
    (void)kmp_context_quiet(s->context, quiet);
    return status;
}

/* The columns at all times. KEMPE_E_FAILED: the motion does not reach the last one. */
static kempe_status run_beside(differences *d, const double *values, double *cells)
{
    kempe_sensitivity *s = d->s;
    kmp_linear none = {0};
    kempe_trajectory *motion = NULL;
    KMP_TRY(kmp_linear_vary(&none, s->system, s->variant, values));
    kempe_status status = kmp_simulate(s->system, &d->run, &motion);
    if (motion && (motion->report.requested || (status == KEMPE_STOPPED && !motion->interrupted)))
        status = kmp_fail(s->context, KEMPE_E_FAILED, "%s", motion->reason);
    if (status == KEMPE_OK)
        status = fill_cells(d, motion, cells);
    if (motion)
        d->report = motion->report;
    d->report.reason = NULL;
    kempe_trajectory_free(motion);
    return status;
}

/* The derivative from values at the places, and the one at twice the step. Of only one side: from two places there, and
 * from the farther one. */
static void slope_of(const differences *d, ptrdiff_t i, double step, double *slope, double *rough)
{
    const double x = d->cells[i];
    if (d->known[0] && d->known[1] && d->known[2] && d->known[3]) {
        double far = (d->cell[3][i] - d->cell[0][i]) / (4 * step), near = (d->cell[2][i] - d->cell[1][i]) / (2 * step);
        *slope = (4 * near - far) / 3;
        *rough = far;
        return;
    }
    const bool after = d->known[2] && d->known[3];
    const double near = after ? (d->cell[2][i] - x) / step : (x - d->cell[1][i]) / step,
                 far = (after ? d->cell[3][i] - x : x - d->cell[0][i]) / (2 * step);
    *slope = 2 * near - far;
    *rough = near;
}

static kempe_status differ_by(differences *d, const double *values, int k)
{
    const double step = KMP_RUN_STEP * d->s->size[k];
    kempe_status status = KEMPE_OK;
    for (int i = 0; i < PLACES; i++) {
        memcpy(d->values, values, (size_t)d->s->count * sizeof *values);
        d->values[k] += place[i] * step;
        status = run_beside(d, d->values, d->cell[i]);
        if (status != KEMPE_OK && status != KEMPE_E_FAILED)
            return status;
        d->known[i] = status == KEMPE_OK;
    }
    if ((d->known[0] && d->known[1]) || (d->known[2] && d->known[3])) {
        kmp_context_clear(d->s->context);
        return KEMPE_OK;
    }
    return status == KEMPE_E_FAILED ? status
                                    : kmp_fail(d->s->context, KEMPE_E_FAILED,
                                               "the model cannot be run at a slightly different '%s'", d->s->name[k]);
}

/* Derivatives by parameter k in the rows; the largest change of one over the largest derivative of its column. */
static double take_slopes(const differences *d, int k)
{
    const kempe_sensitivity *s = d->s;
    const double step = KMP_RUN_STEP * s->size[k];
    double error = 0;
    for (int c = 0; c < s->columns; c++) {
        double change = 0, most = 0;
        for (int row = 0; row < d->count; row++) {
            double rough, *slope = s->cell + (size_t)row * kmp_sensitivity_width(s) + s->columns + c * s->count + k;
            slope_of(d, (ptrdiff_t)row * s->columns + c, step, slope, &rough);
            change = fmax(change, fabs(*slope - rough));
            most = fmax(most, fabs(*slope));
        }
        error = most > 0 ? fmax(error, change / most) : error;
    }
    return error;
}

static kempe_status differ_all(differences *d, const double *values, double *error)
{
    kempe_sensitivity *s = d->s;
    KMP_TRY(run_beside(d, values, d->cells));
    const kmp_run_report first = d->report;
    for (int row = 0; row < d->count; row++) {
        double *to = kmp_sensitivity_add_row(s, d->t[row]);
        KMP_TRY(kmp_made(s->context, to));
        memcpy(to, d->cells + (ptrdiff_t)row * s->columns, (size_t)s->columns * sizeof *to);
    }
    *error = 0;
    for (int k = 0; k < s->count; k++) {
        KMP_TRY(differ_by(d, values, k));
        *error = fmax(*error, take_slopes(d, k));
    }
    d->report = first;
    kmp_linear none = {0};
    return kmp_linear_vary(&none, s->system, s->variant, values);
}

/* Makes the rows, values and derivatives, and their slope_error: the largest change of a derivative at twice the step,
 * over the largest derivative of its column. */
static kempe_status differ(kmp_slope_runs *r, const double *values)
{
    kempe_sensitivity *s = r->s;
    const kmp_run_spec *spec = &r->w.spec;
    differences d = {.s = s, .words = r->words, .count = r->count, .t = r->t};
    size_t cells = (size_t)d.count * (size_t)s->columns;
    d.run = (kempe_run_options){.size = sizeof d.run,
                                .formulation = spec->formulation,
                                .form = spec->form,
                                .backend = spec->backend,
                                .independent = r->independent,
                                .output_step = spec->t_end,
                                .no_convergence_check = 1,
                                .keep_dense = 1};
    kmp_spec_numbers(spec, &d.run);
    bool made =
        KMP_ARENA_MAKE(&d.arena, KMP_ROOM(double, cells, &d.cells, &d.cell[0], &d.cell[1], &d.cell[2], &d.cell[3]),
                       KMP_ROOM(double, s->count, &d.values), KMP_ROOM(double, s->outputs.count, &d.row));
    kempe_status status = kmp_made(s->context, made);
    if (status == KEMPE_OK)
        status = differ_all(&d, values, &s->slope_error);
    r->w.report.run = d.report;
    add_work(&r->w);
    kmp_arena_free(&d.arena);
    return status;
}

/* -- at given values --------------------------------------------------------------------------------- */

static kempe_status run_once(kmp_slope_runs *r)
{
    kmp_slopes_renew_parameters(r->w.slopes);
    kempe_status status = find_rows(&r->w, r->count, r->t);
    add_work(&r->w);
    /* The last time is missing where a condition of the model, or a lock, ends the run; an interrupt is not a failure.
     */
    kmp_run_report *report = &r->w.report.run;
    bool ended = status == KEMPE_STOPPED && !kmp_interrupted(r->s->context);
    if (status == KEMPE_E_FAILED || ended || (status == KEMPE_OK && r->s->rows < r->count)) {
        kmp_text reason = {0};
        kmp_text_put(&reason, report->reason ? report->reason : "the run ends before the last requested time");
        kmp_context_clear(r->s->context);
        status = kmp_fail_text(r->s->context, KEMPE_E_FAILED, &reason);
    }
    kmp_free(report->reason);
    report->reason = NULL;
    return status;
}

kempe_status kmp_slope_runs_at(kmp_slope_runs *runs, const double *values)
{
    kempe_sensitivity *s = runs->s;
    work *w = &runs->w;
    double begin = kmp_cpu_now();
    s->rows = 0;
    kmp_context_clear(s->context);
    w->report = (kmp_forward_report){0};
    kempe_status status = kmp_linear_vary(&w->varied.linear, s->system, s->variant, values);
    if (status == KEMPE_OK) {
        memcpy(s->parameter, values, (size_t)s->count * sizeof *values);
        status = s->differences ? differ(runs, values) : run_once(runs);
    }
    s->cpu_s += kmp_cpu_now() - begin;
    return status;
}

kempe_status kmp_slope_runs_coarser(kmp_slope_runs *runs, double factor, const double *values)
{
    kmp_run_spec *spec = &runs->w.spec;
    const double rtol = spec->rtol, atol = spec->atol;
    spec->rtol *= factor;
    spec->atol *= factor;
    kempe_status status = kmp_slope_runs_at(runs, values);
    spec->rtol = rtol;
    spec->atol = atol;
    return status;
}

const kmp_sensitivity_kind kmp_sensitivity_trajectory = {
    .name = "trajectory", .row = "t", .integrals = true, .find = find};
