/* SPDX-License-Identifier: BSD-3-Clause */
#include "integrators/run.h"
#include "base/memory.h"
#include "constraints/partition.h"
#include "constraints/plant.h"
#include "integrators/dop853.h"
#include "integrators/ida.h"
#include "integrators/road.h"
#include <math.h>
#include <string.h>
#include <time.h>

static const kmp_road_kind *const roads[] = {
#define KMP_ROAD(id) &kmp_road_##id,
#include "integrators/roads.def"
#undef KMP_ROAD
};

enum { ROADS = sizeof roads / sizeof *roads };

/* -- names ------------------------------------------------------------------------------------------- */

const kmp_way *kmp_way_get(int k)
{
    static kmp_way ways[ROADS];
    if (k < 0 || k >= (int)ROADS)
        return NULL;
    ways[k] = (kmp_way){roads[k]->road, roads[k]->form, roads[k]->dae ? "ida" : "dop853"};
    return &ways[k];
}

static const kmp_road_kind *find_road(const char *road, const char *form)
{
    for (int k = 0; k < (int)ROADS; k++)
        if (strcmp(roads[k]->road, road) == 0 && (!form || strcmp(roads[k]->form, form) == 0))
            return roads[k];
    return NULL;
}

static kempe_status unknown(const kempe_system *system, const char *what, const char *name, const char *known)
{
    return kmp_fail(system->context, KEMPE_E_ARGUMENT, "%s '%s' is unknown here; there is: %s", what, name, known);
}

static const char *or_default(const char *asked, const char *model, const char *otherwise)
{
    return asked ? asked : model ? model : otherwise;
}

/* The forms of one road, for a complaint. */
static kempe_status unknown_form(const kempe_system *system, const kmp_run_spec *spec)
{
    kmp_text forms = {0};
    for (int k = 0; k < (int)ROADS; k++)
        if (strcmp(roads[k]->road, spec->road) == 0)
            kmp_text_printf(&forms, "%s%s", forms.length ? ", " : "", roads[k]->form);
    kempe_status status = unknown(system, "form", spec->form, forms.s ? forms.s : "");
    kmp_text_free(&forms);
    return status;
}

static kempe_status resolve_names(const kempe_system *system, kmp_run_spec *spec)
{
    const kmp_run_settings *model = &system->model->run;
    bool own_road = !spec->road || (model->road && strcmp(spec->road, model->road) == 0);
    spec->road = or_default(spec->road, model->road, "reduced");
    if (!find_road(spec->road, NULL))
        return unknown(system, "road", spec->road, "reduced, projected, dae");
    if (!spec->form && own_road)
        spec->form = model->form;
    const kmp_road_kind *kind = find_road(spec->road, spec->form);
    if (!kind)
        return unknown_form(system, spec);
    spec->form = kind->form;
    const char *fits = kind->dae ? "ida" : "dop853";
    if (!spec->integrator && own_road)
        spec->integrator = model->integrator;
    spec->integrator = or_default(spec->integrator, NULL, fits);
    if (strcmp(spec->integrator, fits) != 0)
        return unknown(system, "integrator", spec->integrator, fits);
    spec->linear = or_default(spec->linear, NULL, "umfpack");
    if (strcmp(spec->linear, "auto") == 0)
        spec->linear = "umfpack";
    if (strcmp(spec->linear, "umfpack") != 0)
        return unknown(system, "linear solver", spec->linear, "umfpack");
    spec->backend = or_default(spec->backend, NULL, "tape");
    if (!kmp_backend_find(spec->backend))
        return unknown(system, "back end", spec->backend, "tape");
    return KEMPE_OK;
}

static double first_positive(double a, double b, double c)
{
    return a > 0 ? a : b > 0 ? b : c;
}

kempe_status kmp_run_resolve(const kempe_system *system, kmp_run_spec *spec)
{
    const kmp_run_settings *model = &system->model->run;
    kempe_status status = resolve_names(system, spec);
    if (status != KEMPE_OK)
        return status;
    if (spec->rtol < 0 || spec->atol < 0 || spec->t_end < 0 || isnan(spec->rtol + spec->atol + spec->t_end))
        return kmp_fail(system->context, KEMPE_E_ARGUMENT, "tolerances and t_end must be positive");
    double asked = spec->rtol;
    spec->rtol = first_positive(spec->rtol, model->rtol, 1e-8);
    if (spec->rtol < 1e-15 || spec->rtol > 0.1)
        return kmp_fail(system->context, KEMPE_E_ARGUMENT, "rtol = %g is outside 1e-15 .. 0.1", spec->rtol);
    spec->atol = first_positive(spec->atol, asked > 0 ? 0 : model->atol, spec->rtol);
    spec->t_end = first_positive(spec->t_end, model->t_end, 1);
    if (spec->u_count == 0) {
        spec->u = model->u;
        spec->u_count = model->u_count;
    }
    return KEMPE_OK;
}

/* -- one run ----------------------------------------------------------------------------------------- */

typedef struct runner {
    const kempe_system *s;
    const kmp_run_spec *spec;
    kmp_run_report *report;
    kmp_row_fn *deliver;
    void *user;
    kmp_plant *plant;
    kmp_partition part;
    bool has_part;
    kmp_road *road;
    double *q, *qd, *qdd, *lambda; /* of a row */
    double *y, *yp;
    double work; /* of non-conservative forces on the dae road, by quadrature */
    int next;    /* row to deliver */
    double rate_scale, progress;
} runner;

static double cpu_now(void)
{
    struct timespec t;
    (void)clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

/* 1/s: the larger of the initial rates, the root of the initial accelerations, 1 / t_end, all scaled. */
static double rate_scale_of(const runner *run, const double *qd, const double *qdd)
{
    double scale = 1 / run->spec->t_end;
    for (int i = 0; i < run->s->n; i++) {
        scale = fmax(scale, fabs(qd[i]) / run->s->scale[i]);
        scale = fmax(scale, sqrt(fabs(qdd[i]) / run->s->scale[i]));
    }
    return scale;
}

/* Partition and consistent accelerations at the assembled state. */
static kempe_status begin(runner *run, const kempe_assembly *start)
{
    const kempe_system *s = run->s;
    kmp_saddle saddle = {0};
    double *jacobian = KMP_NEW(double, s->m * s->n);
    if (!jacobian)
        return kmp_fail_memory(s->context);
    kmp_plant_closure(run->plant, 0, start->q);
    kmp_plant_dense_jacobian(run->plant, jacobian);
    kempe_status status = kmp_partition_init(&run->part, s, jacobian, run->spec->u, run->spec->u_count);
    kmp_free(jacobian);
    if (status != KEMPE_OK)
        return status;
    run->has_part = true;
    kmp_plant_mass(run->plant);
    kmp_plant_bias(run->plant, start->qd);
    if (!kmp_saddle_init(&saddle, run->plant, &run->part))
        status = kmp_fail_memory(s->context);
    else if (kmp_saddle_factor(&saddle))
        status = kmp_fail(s->context, KEMPE_E_FAILED,
                          "the start accelerations are not determined: some motion carries no mass");
    else
        kmp_saddle_accelerations(&saddle, run->qdd, run->lambda);
    kmp_saddle_free(&saddle);
    run->rate_scale = rate_scale_of(run, start->qd, run->qdd);
    return status;
}

static kempe_status make_road(runner *run, const kempe_assembly *start)
{
    const kmp_road_kind *kind = find_road(run->spec->road, run->spec->form);
    kempe_status status = begin(run, start);
    if (status != KEMPE_OK)
        return status;
    kmp_road_start given = {.system = run->s,
                            .plant = run->plant,
                            .part = &run->part,
                            .q = start->q,
                            .qd = start->qd,
                            .qdd = run->qdd,
                            .lambda = run->lambda,
                            .rtol = run->spec->rtol,
                            .atol = run->spec->atol,
                            .rate_scale = run->rate_scale,
                            .t_end = run->spec->t_end};
    run->road = kind->create(&given);
    return run->road ? KEMPE_OK : KEMPE_E_FAILED;
}

static kempe_status give_up(runner *run, const char *format, double t)
{
    if (run->road->reason.length == 0)
        kmp_text_printf(&run->road->reason, format, t);
    return KEMPE_E_FAILED;
}

static kempe_status deliver(runner *run, double t, const double *y, const double *yp)
{
    double work = 0;
    if (run->road->row(run->road, t, y, yp, run->q, run->qd, run->qdd, run->lambda, &work) != KMP_GO)
        return give_up(run, "the state at the output time t = %.9g cannot be completed", t);
    if (run->yp)
        work = run->work;
    run->next++;
    return run->deliver(run->user, t, run->q, run->qd, run->qdd, run->lambda, work) ? kmp_fail_memory(run->s->context)
                                                                                    : KEMPE_OK;
}

/* Progress once a second of integration, and the interrupt. */
static bool interrupted(runner *run, double t)
{
    double now = cpu_now();
    if (run->progress == 0)
        run->progress = now;
    if (now - run->progress >= 1) {
        run->progress = now;
        kmp_log(run->s->context, KEMPE_LOG_PROGRESS, "t = %.6g of %.6g s (%.0f %%)", t, run->spec->t_end,
                100 * t / run->spec->t_end);
    }
    return kmp_interrupted(run->s->context);
}

static bool due(const runner *run, double t)
{
    return run->next < run->spec->time_count && run->spec->times[run->next] <= t;
}

/* -- an ODE road ------------------------------------------------------------------------------------- */

static kempe_status deliver_ode_rows(runner *run, kmp_dop853 *solver)
{
    kempe_status status = KEMPE_OK;
    double t = kmp_dop853_t(solver);
    while (status == KEMPE_OK && due(run, t)) {
        double at = run->spec->times[run->next];
        if (at == t)
            memcpy(run->y, kmp_dop853_y(solver), (size_t)run->road->size * sizeof *run->y);
        else if (kmp_dop853_dense(solver, at, run->y) != KMP_GO)
            return give_up(run, "the state at the output time t = %.9g cannot be interpolated", at);
        status = deliver(run, at, run->y, NULL);
    }
    return status;
}

static void report_ode(runner *run, kmp_dop853 *solver)
{
    kmp_ode_work w = kmp_dop853_work(solver);
    run->report->steps = w.steps;
    run->report->rejected = w.rejected;
    run->report->refused = w.refused;
    run->report->rhs = w.rhs;
    run->report->newton = run->road->newton;
    run->report->factorizations = run->road->factorizations;
    run->report->exchanges = run->road->exchanges;
    run->report->t = kmp_dop853_t(solver);
}

static kempe_status advance_ode(runner *run, kmp_dop853 *solver)
{
    kempe_status status = KEMPE_OK;
    if (kmp_dop853_start(solver, 0, run->road->y, run->spec->t_end, 0) != KMP_GO)
        return give_up(run, "the right-hand side cannot be evaluated at the start (t = %g)", 0);
    status = deliver_ode_rows(run, solver);
    while (status == KEMPE_OK && kmp_dop853_t(solver) < run->spec->t_end) {
        double t = kmp_dop853_t(solver);
        if (kmp_dop853_step(solver) != KMP_GO) {
            if (run->road->explain && run->road->reason.length == 0)
                run->road->explain(run->road);
            return give_up(run, "the step size became too small at t = %.9g: the motion is singular there", t);
        }
        status = deliver_ode_rows(run, solver);
        if (status == KEMPE_OK && interrupted(run, kmp_dop853_t(solver)))
            return KEMPE_STOPPED;
    }
    return status;
}

static kempe_status run_ode(runner *run)
{
    kmp_tolerance tolerance = {run->spec->rtol, run->road->atol};
    kmp_dop853 *solver = kmp_dop853_new(&run->road->ode, tolerance);
    if (!solver)
        return kmp_fail_memory(run->s->context);
    double begin_s = cpu_now();
    kempe_status status = advance_ode(run, solver);
    run->report->cpu_s = cpu_now() - begin_s;
    report_ode(run, solver);
    kmp_dop853_free(solver);
    return status;
}

/* -- a DAE road -------------------------------------------------------------------------------------- */

/* Work of non-conservative forces over [a, b] by Gauss's three points on the integrator's polynomial. */
static kempe_status add_work(runner *run, kmp_ida *solver, double a, double b)
{
    static const double node[3] = {-0.7745966692414834, 0, 0.7745966692414834};
    static const double weight[3] = {5.0 / 9, 8.0 / 9, 5.0 / 9};
    if (!run->s->dissipative || !(b > a))
        return KEMPE_OK;
    for (int k = 0; k < 3; k++) {
        double t = 0.5 * (a + b) + 0.5 * (b - a) * node[k];
        kempe_status status = kmp_ida_dense(solver, t, run->y, run->yp);
        if (status != KEMPE_OK)
            return status;
        run->work += 0.5 * (b - a) * weight[k] * kmp_plant_power(run->plant, t, run->y, run->y + run->s->n);
    }
    return KEMPE_OK;
}

/* Rows of the last step, and the work up to each. */
static kempe_status deliver_dae_rows(runner *run, kmp_ida *solver)
{
    kempe_status status = KEMPE_OK;
    double t = kmp_ida_t(solver), from = kmp_ida_t_old(solver);
    while (status == KEMPE_OK && due(run, t)) {
        double at = run->spec->times[run->next];
        status = add_work(run, solver, from, at);
        from = at;
        if (status == KEMPE_OK)
            status = kmp_ida_dense(solver, at, run->y, run->yp);
        if (status == KEMPE_OK)
            status = deliver(run, at, run->y, run->yp);
    }
    return status == KEMPE_OK ? add_work(run, solver, from, t) : status;
}

static void report_dae(runner *run, kmp_ida *solver)
{
    kmp_dae_work w = kmp_ida_work(solver);
    run->report->steps = w.steps;
    run->report->rejected = w.rejected;
    run->report->refused = w.failures;
    run->report->rhs = w.residuals;
    run->report->newton = w.newton;
    run->report->factorizations = w.factorizations;
    run->report->t = kmp_ida_t(solver);
}

static kempe_status advance_dae(runner *run, kmp_ida *solver)
{
    /* The first step is of order 1; its error is of the order of the tolerance for this length. */
    double h0 = fmin(0.1 * sqrt(run->spec->rtol) / run->rate_scale, 1e-3 * run->spec->t_end);
    kempe_status status = kmp_ida_start(solver, 0, run->road->y, run->road->yp, run->spec->t_end, h0);
    while (status == KEMPE_OK && due(run, 0))
        status = deliver(run, 0, run->road->y, run->road->yp);
    while (status == KEMPE_OK && kmp_ida_t(solver) < run->spec->t_end) {
        status = kmp_ida_step(solver);
        if (status == KEMPE_OK)
            status = deliver_dae_rows(run, solver);
        if (status == KEMPE_OK && interrupted(run, kmp_ida_t(solver)))
            return KEMPE_STOPPED;
    }
    return status;
}

static kempe_status run_dae(runner *run)
{
    kmp_tolerance tolerance = {run->spec->rtol, run->road->atol};
    kmp_ida *solver = kmp_ida_new(run->s->context, &run->road->dae, tolerance, run->spec->linear);
    if (!solver)
        return KEMPE_E_FAILED;
    double begin_s = cpu_now();
    kempe_status status = advance_dae(run, solver);
    run->report->cpu_s = cpu_now() - begin_s;
    report_dae(run, solver);
    kmp_ida_free(solver);
    return status;
}

/* -- all together ------------------------------------------------------------------------------------ */

static bool allocate(runner *run)
{
    run->q = KMP_NEW(double, run->s->n);
    run->qd = KMP_NEW(double, run->s->n);
    run->qdd = KMP_NEW(double, run->s->n);
    run->lambda = KMP_NEW(double, run->s->m);
    return run->q && run->qd && run->qdd && run->lambda;
}

static bool allocate_state(runner *run)
{
    run->y = KMP_NEW(double, run->road->size);
    run->yp = run->road->yp ? KMP_NEW(double, run->road->size) : NULL;
    return run->y && (run->yp || !run->road->yp);
}

static kempe_status run_from(runner *run, const kempe_assembly *start)
{
    double begin_s = cpu_now();
    run->plant = kmp_plant_new(run->s, run->spec->backend);
    if (!run->plant)
        return KEMPE_E_MEMORY;
    if (!allocate(run))
        return kmp_fail_memory(run->s->context);
    kempe_status status = make_road(run, start);
    run->report->build_s = cpu_now() - begin_s;
    run->report->rate_scale = run->rate_scale;
    if (status != KEMPE_OK)
        return status;
    if (!allocate_state(run))
        return kmp_fail_memory(run->s->context);
    return run->road->yp ? run_dae(run) : run_ode(run);
}

/* A failure's sentence is the road's, or what was last complained of. */
static void take_reason(runner *run, kempe_status status)
{
    const char *reason =
        run->road && run->road->reason.length ? run->road->reason.s : kempe_context_message(run->s->context);
    if (status == KEMPE_STOPPED)
        reason = "interrupted";
    if (status != KEMPE_OK)
        run->report->reason = kmp_strdup(reason);
}

static void runner_free(runner *run)
{
    if (run->road)
        run->road->release(run->road);
    if (run->has_part)
        kmp_partition_free(&run->part);
    kmp_plant_free(run->plant);
    kmp_free(run->q);
    kmp_free(run->qd);
    kmp_free(run->qdd);
    kmp_free(run->lambda);
    kmp_free(run->y);
    kmp_free(run->yp);
}

kempe_status kmp_run(const kempe_system *system, const kmp_run_spec *spec, const kempe_assembly *start, kmp_row_fn *row,
                     void *user, kmp_run_report *report)
{
    runner run = {.s = system, .spec = spec, .report = report, .deliver = row, .user = user};
    kempe_assembly *own = NULL;
    kempe_status status = KEMPE_OK;
    *report = (kmp_run_report){0};
    if (!start) {
        status = kempe_assemble(system, &own);
        start = own;
    }
    if (status == KEMPE_OK)
        status = run_from(&run, start);
    take_reason(&run, status);
    runner_free(&run);
    kempe_assembly_free(own);
    return status;
}
