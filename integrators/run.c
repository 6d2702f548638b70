/* SPDX-License-Identifier: BSD-3-Clause */
/* One run, step by step: assembles, partitions, makes a road and an integrator, advances, gives rows. */
#include "integrators/run.h"
#include "base/memory.h"
#include "constraints/angles.h"
#include "constraints/margin.h"
#include "constraints/massless.h"
#include "constraints/partition.h"
#include "constraints/plant.h"
#include "integrators/events.h"
#include "integrators/road.h"
#include "integrators/solver.h"
#include <math.h>
#include <string.h>
#include <time.h>

struct kmp_runner {
    const kempe_system *s;
    kmp_run_spec spec;
    kmp_plant *plant;
    kmp_partition part;
    bool has_part;
    kmp_margin margin;
    kmp_road *road;
    const kmp_road_kind *way; /* the road asked for; `road` may be the zone instead */
    bool in_zone;
    double zone_t, zone_margin; /* entered at; least margin seen in it */
    const kmp_solver_kind *kind;
    void *solver;
    kmp_run_report before;  /* work of roads and solvers that are gone */
    double *state;          /* q, qd, qdd, lambda at a change of road */
    kmp_crossing *crossing; /* NULL when the model has no conditions */
    bool at_event;
    double event_t;       /* where the last step ends when at_event */
    double *y, *yp;       /* at a row; yp for a DAE only */
    double *qdd, *lambda; /* at the start */
    double *moved;        /* 3 n + m: a row, where closures that move do work */
    double work;          /* of non-conservative forces on a dae road, by quadrature up to work_t */
    double work_t;
    double rate_scale, build_s, progress;
    unsigned long memory_failures; /* before it was made */
    int rescues;                   /* of an implicit integrator; the last one's time */
    double rescue_t;
    char *reason;
};

/* Rates of the start may violate the closures by this part of their size. */
#define RATE_GAP     1e-6
#define MOST_RESCUES 1000

static double cpu_now(void)
{
    struct timespec t;
    (void)clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

/* -- the start --------------------------------------------------------------------------------------- */

/* 1/s: the largest of the initial rates, the roots of the initial accelerations, and 1 / t_end, all scaled. */
static double rate_scale_of(const kmp_runner *run, const double *qd)
{
    double scale = 1 / run->spec.t_end;
    for (int i = 0; i < run->s->n; i++) {
        scale = fmax(scale, fabs(qd[i]) / run->s->scale[i]);
        scale = fmax(scale, sqrt(fabs(run->qdd[i]) / run->s->scale[i]));
    }
    return scale;
}

/* rank < 0: as the pivots say. */
static kempe_status choose_partition(kmp_runner *run, double t, const double *q, int rank, const int *wish,
                                     int wish_count)
{
    const kempe_system *s = run->s;
    double *jacobian = KMP_NEW(double, s->m * s->n);
    if (!jacobian)
        return kmp_fail_memory(s->context);
    kmp_plant_closure(run->plant, t, q);
    kmp_plant_dense_jacobian(run->plant, jacobian);
    kempe_status status = kmp_partition_of_rank(&run->part, s, jacobian, rank, wish, wish_count);
    kmp_free(jacobian);
    run->has_part = status == KEMPE_OK;
    return status;
}

/* The coordinate that a row alone prescribes, NULL when it has several. */
static const char *driven_by(const kempe_system *s, int row)
{
    const char *name = NULL;
    int count = 0;
    for (int e = 0; e < s->jacobian.count; e++)
        if (s->jacobian.row[e] == row && ++count)
            name = s->model->motions[s->jacobian.col[e]].name;
    return count == 1 ? name : NULL;
}

/* J qd + h_t at the plant's last closure. */
static void rate_violation(const kmp_runner *run, const double *qd, double *violation)
{
    const kmp_pattern *p = &run->s->jacobian;
    for (int r = 0; r < run->s->m; r++)
        violation[r] = run->plant->h_t ? run->plant->h_t[r] : 0;
    for (int k = 0; k < p->count; k++)
        violation[p->row[k]] += run->plant->jacobian[k] * qd[p->col[k]];
}

/* Brings q and qd onto the rows that are now independent: those before closed their own alone, and what that left of
 * the others a DAE integrator would take for a jump. */
static kempe_status project(kmp_runner *run, double t, double *q, double *qd)
{
    kmp_saddle saddle = {0};
    double *dx = run->moved;
    kempe_status status =
        kmp_saddle_init(&saddle, run->plant, &run->part) ? KEMPE_OK : kmp_fail_memory(run->s->context);
    for (int pass = 0; status == KEMPE_OK && pass < 3; pass++) {
        kmp_plant_closure(run->plant, t, q);
        kmp_plant_mass(run->plant);
        if (kmp_saddle_factor(&saddle)) {
            status = kmp_fail(run->s->context, KEMPE_E_FAILED, "the closures are singular at t = %.9g", t);
            break;
        }
        rate_violation(run, qd, run->lambda);
        kmp_saddle_correction(&saddle, run->lambda, dx);
        for (int i = 0; i < run->s->n; i++)
            qd[i] += dx[i];
        kmp_saddle_correction(&saddle, run->plant->h, dx);
        for (int i = 0; pass < 2 && i < run->s->n; i++)
            q[i] += dx[i];
    }
    kmp_saddle_free(&saddle);
    return status;
}

/* The closures must allow the rates that they ask for: a coordinate cannot be driven at its dead centre. */
static kempe_status check_rates(kmp_runner *run, const kempe_assembly *start)
{
    const kempe_system *s = run->s;
    double *rate = run->lambda, size = 1 / run->spec.t_end, worst = 0;
    int row = 0;
    if (!s->rheonomic)
        return KEMPE_OK; /* the assembly has seen to it */
    for (int r = 0; r < s->m; r++) {
        rate[r] = run->plant->h_t ? run->plant->h_t[r] : 0;
        size = fmax(size, fabs(rate[r]) / s->row_scale[r]);
        row = fabs(rate[r]) > 0 ? r : row; /* what moves is to blame */
    }
    for (int i = 0; i < s->n; i++)
        size = fmax(size, fabs(start->qd[i]) / s->scale[i]);
    rate_violation(run, start->qd, rate);
    for (int r = 0; r < s->m; r++)
        worst = fmax(worst, fabs(rate[r]) / s->row_scale[r]);
    if (worst <= RATE_GAP * size)
        return KEMPE_OK;
    const char *name = driven_by(s, row);
    return kmp_fail(
        s->context, KEMPE_E_FAILED,
        "the rate asked for by closure row '%s'%s%s%s cannot be had at the start: %.3g of it is left over; the "
        "mechanism is at a dead centre there",
        s->row_names[row], name ? ", of coordinate '" : "", name ? name : "", name ? "'," : "", worst);
}

/* Consistent accelerations and multipliers of the chosen rows at the plant's last closure. */
static kempe_status accelerate(kmp_runner *run, double t, const double *q, const double *qd)
{
    kmp_saddle saddle = {0};
    kempe_status status = KEMPE_OK;
    kmp_plant_mass(run->plant);
    kmp_plant_bias(run->plant, qd);
    if (!kmp_saddle_init(&saddle, run->plant, &run->part))
        status = kmp_fail_memory(run->s->context);
    else if (kmp_saddle_factor(&saddle))
        status = kmp_explain_massless(run->plant, &run->part, t, q);
    else
        kmp_saddle_accelerations(&saddle, run->qdd, run->lambda);
    kmp_saddle_free(&saddle);
    return status;
}

static kempe_status make_road(kmp_runner *run, const kmp_road_kind *way, double t, const double *q, const double *qd,
                              double work)
{
    kmp_road_start given = {.system = run->s,
                            .plant = run->plant,
                            .part = &run->part,
                            .t = t,
                            .q = q,
                            .qd = qd,
                            .qdd = run->qdd,
                            .lambda = run->lambda,
                            .work = work,
                            .rtol = run->spec.rtol,
                            .atol = run->spec.atol,
                            .rate_scale = run->rate_scale,
                            .t_end = run->spec.t_end,
                            .fixed = run->spec.fixed_u,
                            .implicit = kmp_solver_find(run->spec.integrator)->implicit};
    run->road = way->create(&given);
    return run->road ? KEMPE_OK : KEMPE_E_FAILED;
}

/* The zone has its own. A mechanism without a freedom is followed along its closures, which corrects every step. */
static const char *integrator_of(const kmp_runner *run)
{
    const kmp_solver_kind *asked = kmp_solver_find(run->spec.integrator);
    bool cannot = !asked->dae && !asked->corrects && run->part.p == 0;
    return run->in_zone || cannot ? "dop853" : asked->name;
}

static kempe_status make_solver(kmp_runner *run)
{
    kmp_road *road = run->road;
    kmp_solver_setup setup = {.context = run->s->context,
                              .ode = &road->ode,
                              .dae = &road->dae,
                              .tolerance = {road->rtol > 0 ? road->rtol : run->spec.rtol, road->atol},
                              .linear = run->spec.linear};
    run->kind = kmp_solver_find(integrator_of(run));
    run->y = KMP_NEW(double, road->size);
    run->yp = road->yp ? KMP_NEW(double, road->size) : NULL;
    if (!run->y || (road->yp && !run->yp))
        return kmp_fail_memory(run->s->context);
    run->solver = run->kind->create(&setup);
    if (!run->solver || !run->s->changes)
        return run->solver ? KEMPE_OK : KEMPE_E_FAILED;
    run->crossing = kmp_crossing_new(run->s, run->plant, road, run->kind, run->solver);
    return run->crossing ? KEMPE_OK : kmp_fail_memory(run->s->context);
}

/* -- failures ---------------------------------------------------------------------------------------- */

/* Whatever was complained of on the way. */
static kempe_status fail_memory(const kmp_runner *run)
{
    kmp_context_clear(run->s->context);
    return kmp_fail_memory(run->s->context);
}

/* Says when the angles of a joint are the trouble at the last step. */
static void explain_angles(const kmp_runner *run, kmp_text *text)
{
    double t = run->solver ? run->kind->t(run->solver) : 0;
    if (!run->solver || !(t > run->spec.t_start) || run->kind->dense(run->solver, t, run->y, run->yp) != KEMPE_OK)
        return;
    run->road->position(run->road, t, run->y, run->state);
    kmp_angles_explain(run->s->model, run->state, text);
}

/* A drive that asks for more than the mechanism can do; false when that is not the trouble. */
static bool explain_lock(kmp_runner *run, kmp_text *text, double t)
{
    if (!run->road || !run->solver || !run->s->rheonomic ||
        run->kind->dense(run->solver, t, run->y, run->yp) != KEMPE_OK)
        return false;
    run->road->position(run->road, t, run->y, run->state);
    kmp_plant_closure(run->plant, t, run->state);
    int row = kmp_margin_lock(&run->margin, run->plant);
    if (row < 0)
        return false;
    const char *name = driven_by(run->s, row);
    kmp_text_printf(text, "the mechanism locks at t = %.9g: it is at a dead centre, beyond which ", t);
    if (name)
        kmp_text_printf(text, "the driven coordinate '%s' (row '%s') cannot move on", name, run->s->row_names[row]);
    else
        kmp_text_printf(text, "closure row '%s' cannot follow its prescribed motion", run->s->row_names[row]);
    return true;
}

/* The sentence of a failure: a lock's, the road's, the integrator's, or `otherwise`. */
static kempe_status give_up(kmp_runner *run, kempe_status status, const char *otherwise, double t)
{
    const char *said = kempe_context_message(run->s->context);
    kmp_text text = {0};
    if (status != KEMPE_E_FAILED || run->reason)
        return status;
    if (kmp_memory_failures() != run->memory_failures)
        return fail_memory(run);
    if (run->road && run->road->explain && run->road->reason.length == 0 && !*said)
        run->road->explain(run->road);
    if (!explain_lock(run, &text, t)) {
        if (run->road && run->road->reason.length)
            kmp_text_put(&text, run->road->reason.s);
        else if (*said)
            kmp_text_put(&text, said);
        else
            kmp_text_printf(&text, "%s at t = %.9g", otherwise, t);
    }
    explain_angles(run, &text);
    run->reason = kmp_text_take(&text);
    return run->reason ? KEMPE_E_FAILED : kmp_fail_memory(run->s->context);
}

/* Progress once a second of CPU time, and the interrupt. */
static kempe_status attend(kmp_runner *run)
{
    double now = cpu_now(), t = kmp_runner_t(run);
    if (run->progress == 0)
        run->progress = now;
    if (now - run->progress >= 1) {
        run->progress = now;
        kmp_log(run->s->context, KEMPE_LOG_PROGRESS, "t = %.6g of %.6g s (%.0f %%)", t, run->spec.t_end,
                100 * t / run->spec.t_end);
    }
    if (!kmp_interrupted(run->s->context))
        return KEMPE_OK;
    run->reason = kmp_strdup("interrupted");
    return KEMPE_STOPPED;
}

/* -- work of non-conservative forces on a dae road --------------------------------------------------- */

/* At the dense state in run->y; closures that move do work too. */
static double power_at(kmp_runner *run, double t)
{
    int n = run->s->n;
    double *q = run->moved, *lambda = run->moved + 3 * n, work;
    double power = kmp_plant_power(run->plant, t, run->y, run->y + n);
    if (!run->s->rheonomic ||
        run->road->row(run->road, t, run->y, run->yp, q, q + n, q + 2 * n, lambda, &work) != KMP_GO)
        return power;
    kmp_plant_closure(run->plant, t, run->y);
    return power + kmp_plant_drive_power(run->plant, lambda);
}

/* Gauss's three points on the integrator's polynomial, from work_t to t within the last step. */
static kempe_status add_work(kmp_runner *run, double t)
{
    static const double node[3] = {-0.7745966692414834, 0, 0.7745966692414834};
    static const double weight[3] = {5.0 / 9, 8.0 / 9, 5.0 / 9};
    double a = run->work_t, h = t - a;
    if (!run->yp || !run->s->dissipative || !(h > 0))
        return KEMPE_OK;
    for (int k = 0; k < 3; k++) {
        double at = a + 0.5 * h * (1 + node[k]);
        kempe_status status = run->kind->dense(run->solver, at, run->y, run->yp);
        if (status != KEMPE_OK)
            return status;
        run->work += 0.5 * h * weight[k] * power_at(run, at);
    }
    run->work_t = t;
    return KEMPE_OK;
}

/* -- a runner ---------------------------------------------------------------------------------------- */

/* The first step of an implicit method is of order 1; its error is of the order of the tolerance for this length. */
static double first_step(const kmp_runner *run)
{
    return run->kind->corrects ? 0 : fmin(0.1 * sqrt(run->spec.rtol) / run->rate_scale, 1e-3 * run->spec.t_end);
}

static kempe_status prepare(kmp_runner *run, const kempe_assembly *start)
{
    run->plant = kmp_plant_new(run->s, run->spec.backend);
    run->qdd = KMP_NEW(double, run->s->n);
    run->lambda = KMP_NEW(double, run->s->m);
    run->moved = KMP_NEW(double, 3 * run->s->n + run->s->m);
    run->state = KMP_NEW(double, 3 * run->s->n + run->s->m);
    if (!run->plant || !run->qdd || !run->lambda || !run->moved || !run->state)
        return kmp_fail_memory(run->s->context);
    kmp_plant_freeze(run->plant, run->spec.t_start, start->q, start->qd);
    kempe_status status = choose_partition(run, run->spec.t_start, start->q, -1, run->spec.u, run->spec.u_count);
    if (status == KEMPE_OK)
        status = check_rates(run, start);
    if (status == KEMPE_OK)
        status = accelerate(run, run->spec.t_start, start->q, start->qd);
    if (status == KEMPE_OK && !kmp_margin_init(&run->margin, run->s, &run->part))
        status = kmp_fail_memory(run->s->context);
    if (status != KEMPE_OK)
        return status;
    if (run->margin.near)
        kmp_log(
            run->s->context, KEMPE_LOG_WARNING,
            "the start is near a change point, where branches of the mechanism meet: which one it takes may hang on "
            "the last digits");
    run->rate_scale = rate_scale_of(run, start->qd);
    run->way = kmp_road_find(run->spec.road, run->spec.form);
    status = make_road(run, run->way, run->spec.t_start, start->q, start->qd, run->spec.work_start);
    return status == KEMPE_OK ? make_solver(run) : status;
}

static kempe_status begin(kmp_runner *run)
{
    kempe_status status =
        run->kind->start(run->solver, run->spec.t_start, run->road->y, run->road->yp, run->spec.t_end, first_step(run));
    return give_up(run, status, "the right-hand side cannot be evaluated", run->spec.t_start);
}

kempe_status kmp_runner_new(const kempe_system *system, const kmp_run_spec *spec, const kempe_assembly *start,
                            kmp_runner **runner)
{
    double begin_s = cpu_now();
    kempe_assembly *own = NULL;
    kempe_status status = KEMPE_OK;
    unsigned long memory_failures = kmp_memory_failures();
    kmp_runner *run = KMP_NEW(kmp_runner, 1);
    if (!run)
        return kmp_fail_memory(system->context);
    run->memory_failures = memory_failures;
    run->s = system;
    run->spec = *spec;
    run->work = spec->work_start;
    run->work_t = spec->t_start;
    if (!start) {
        status = kempe_assemble(system, &own);
        start = own;
    }
    if (status == KEMPE_OK)
        status = prepare(run, start);
    kempe_assembly_free(own);
    run->build_s = cpu_now() - begin_s;
    status = status == KEMPE_OK ? begin(run) : give_up(run, status, "the run could not be prepared", 0);
    if (status == KEMPE_OK || status == KEMPE_E_FAILED)
        *runner = run;
    else
        kmp_runner_free(run);
    return status;
}

void kmp_runner_free(kmp_runner *run)
{
    if (!run)
        return;
    kmp_crossing_free(run->crossing);
    if (run->solver)
        run->kind->release(run->solver);
    if (run->road)
        run->road->release(run->road);
    if (run->has_part)
        kmp_partition_free(&run->part);
    kmp_plant_free(run->plant);
    kmp_free(run->y);
    kmp_free(run->yp);
    kmp_margin_free(&run->margin);
    kmp_free(run->state);
    kmp_free(run->qdd);
    kmp_free(run->lambda);
    kmp_free(run->moved);
    kmp_free(run->reason);
    kmp_free(run);
}

double kmp_runner_t(const kmp_runner *run)
{
    if (run->at_event)
        return run->event_t;
    return run->solver ? run->kind->t(run->solver) : run->work_t;
}

double kmp_runner_t_old(const kmp_runner *run)
{
    return run->solver ? run->kind->t_old(run->solver) : run->work_t;
}

/* Adds the work of the road and integrator at hand. */
static void add_report(const kmp_runner *run, kmp_run_report *report)
{
    if (!run->solver)
        return;
    kmp_solver_work w = run->kind->work(run->solver);
    report->steps += w.steps;
    report->rejected += w.rejected;
    report->refused += w.refused;
    report->rhs += w.rhs;
    report->newton += w.newton + run->road->newton;
    report->factorizations += w.factorizations + run->road->factorizations;
    report->exchanges += run->road->exchanges;
}

/* -- change points ----------------------------------------------------------------------------------- */

/* Margins, of the start's, at which a run enters the zone and leaves it. */
#define ZONE_IN  0.15
#define ZONE_OUT 0.2
/* Last pivot of the independent rows over that of all rows at which others are taken. */
#define ROWS_OUT 0.2

static void release_road(kmp_runner *run)
{
    add_report(run, &run->before);
    run->kind->release(run->solver);
    run->road->release(run->road);
    kmp_free(run->y);
    kmp_free(run->yp);
    run->solver = NULL;
    run->road = NULL;
    run->y = run->yp = NULL;
}

/* Rows and coordinates anew at q, as many as at the start; a fixed u stays. */
static kempe_status choose_again(kmp_runner *run, double t, const double *q)
{
    kmp_partition before = run->part;
    run->has_part = false;
    kempe_status status = choose_partition(run, t, q, run->margin.r, before.u, run->spec.fixed_u ? before.p : 0);
    kmp_partition_free(&before);
    return status;
}

/* Goes on at t with another road, from the state that the old one completes. */
static kempe_status change_road(kmp_runner *run, double t, bool to_zone)
{
    int n = run->s->n;
    double *q = run->state, *qd = q + n, work;
    kempe_status status = kmp_runner_row(run, t, q, qd, run->qdd, run->lambda, &work);
    if (status != KEMPE_OK)
        return status;
    release_road(run);
    run->in_zone = to_zone;
    status = choose_again(run, t, q);
    if (status == KEMPE_OK && run->way->dae && !to_zone)
        status = project(run, t, q, qd);
    if (status == KEMPE_OK && run->way->dae && !to_zone)
        status = accelerate(run, t, q, qd);
    if (status == KEMPE_OK)
        status = make_road(run, to_zone ? &kmp_road_zone : run->way, t, q, qd, work);
    if (status == KEMPE_OK)
        status = make_solver(run);
    run->work = work;
    run->work_t = t;
    return status == KEMPE_OK
               ? run->kind->start(run->solver, t, run->road->y, run->road->yp, run->spec.t_end, first_step(run))
               : status;
}

/* Where J comes near to losing a row the zone takes over, and hands back behind it. Where the independent rows go bad
 * while all rows together do not, others are taken. */
static kempe_status watch_margin(kmp_runner *run, double t)
{
    if (run->margin.r == 0 || !(t > kmp_runner_t_old(run)))
        return KEMPE_OK;
    kempe_status status = run->kind->dense(run->solver, t, run->y, run->yp);
    if (status != KEMPE_OK)
        return status;
    run->road->position(run->road, t, run->y, run->state);
    kmp_plant_closure(run->plant, t, run->state);
    double margin = kmp_margin_at(&run->margin, run->plant);
    if (run->in_zone)
        run->zone_margin = fmin(run->zone_margin, margin);
    if (!run->in_zone && margin < ZONE_IN) {
        run->zone_t = t;
        run->zone_margin = margin;
        return change_road(run, t, true);
    }
    if (run->in_zone && margin > ZONE_OUT) {
        kmp_log(run->s->context, KEMPE_LOG_NOTE,
                "t = %.9g to %.9g: passed a change point, where the closures come within %.2g of losing a row",
                run->zone_t, t, run->zone_margin);
        return change_road(run, t, false);
    }
    if (kmp_margin_of_rows(&run->margin, run->plant, &run->part) < ROWS_OUT) {
        kmp_log(run->s->context, KEMPE_LOG_NOTE, "t = %.9g: other closure rows are taken as the independent ones", t);
        return change_road(run, t, run->in_zone);
    }
    return KEMPE_OK;
}

/* Lets the road re-arrange its unknowns at the end of the last step; an integrator is then started anew, a one-step
 * method with the step it had. */
static kempe_status renew(kmp_runner *run, double t)
{
    double h = t - kmp_runner_t_old(run);
    if (!run->road->renew || !(h > 0))
        return KEMPE_OK;
    kempe_status status = run->kind->dense(run->solver, t, run->y, run->yp);
    if (status != KEMPE_OK)
        return status;
    switch (run->road->renew(run->road, t, run->y, run->yp)) {
    case KMP_GO:
        return KEMPE_OK;
    case KMP_CHANGED:
        return run->kind->start(run->solver, t, run->y, run->yp, run->spec.t_end,
                                run->kind->corrects ? h : first_step(run));
    default:
        return KEMPE_E_FAILED;
    }
}

/* Conditions change, and the integrator starts anew, a one-step method with the step it had. */
static kempe_status pass_event(kmp_runner *run, double t)
{
    double h = run->kind->t(run->solver) - run->kind->t_old(run->solver);
    if (!run->at_event)
        return KEMPE_OK;
    kempe_status status = kmp_crossing_pass(run->crossing, t, run->y, run->yp);
    if (status == KEMPE_OK)
        status = run->kind->start(run->solver, t, run->y, run->yp, run->spec.t_end,
                                  run->kind->corrects ? fmin(h, run->spec.t_end - t) : first_step(run));
    run->at_event = false;
    return status;
}

/* An implicit integrator that stopped goes on once from the same place, projected and with rows chosen anew: what its
 * past steps left may be all that was wrong. */
static kempe_status rescue(kmp_runner *run, double t)
{
    if (!run->yp || run->rescues == MOST_RESCUES || (run->rescues > 0 && !(t > run->rescue_t)))
        return KEMPE_E_FAILED;
    run->rescues++;
    run->rescue_t = t;
    kempe_status status = change_road(run, t, false);
    if (status == KEMPE_OK)
        status = run->kind->step(run->solver);
    if (status == KEMPE_OK)
        kmp_log(run->s->context, KEMPE_LOG_NOTE, "t = %.9g: the integrator stopped and went on from the same state", t);
    return status;
}

kempe_status kmp_runner_step(kmp_runner *run)
{
    double t = kmp_runner_t(run);
    kempe_status status = run->work_t < t ? add_work(run, t) : KEMPE_OK;
    if (status == KEMPE_OK)
        status = pass_event(run, t);
    if (status == KEMPE_OK)
        status = watch_margin(run, t);
    if (status == KEMPE_OK)
        status = renew(run, t);
    if (status == KEMPE_OK) {
        status = run->kind->step(run->solver);
        if (status == KEMPE_E_FAILED && !run->in_zone)
            status = rescue(run, t);
    }
    if (status == KEMPE_OK && run->crossing)
        status = kmp_crossing_find(run->crossing, &run->event_t, &run->at_event);
    if (status != KEMPE_OK)
        return give_up(run, status, "the step size became too small: the motion is singular", t);
    return attend(run);
}

kempe_status kmp_runner_row(kmp_runner *run, double t, double *q, double *qd, double *qdd, double *lambda, double *work)
{
    kempe_status status = add_work(run, t);
    *work = 0;
    if (status == KEMPE_OK)
        status = run->kind->dense(run->solver, t, run->y, run->yp);
    if (status != KEMPE_OK)
        return give_up(run, status, "the state cannot be interpolated", t);
    if (run->road->row(run->road, t, run->y, run->yp, q, qd, qdd, lambda, work) != KMP_GO)
        return give_up(run, KEMPE_E_FAILED, "the state cannot be completed", t);
    if (run->yp)
        *work = run->work;
    return KEMPE_OK;
}

void kmp_runner_report(const kmp_runner *run, kmp_run_report *report)
{
    *report = run->before;
    report->rate_scale = run->rate_scale;
    report->build_s = run->build_s;
    report->reason = run->reason ? kmp_strdup(run->reason) : NULL;
    report->t = run->solver ? kmp_runner_t(run) : 0;
    add_report(run, report);
    report->events = run->crossing ? kmp_crossing_count(run->crossing) : 0;
}

/* -- a whole run ------------------------------------------------------------------------------------- */

/* Rows due within the last step. */
static kempe_status deliver(kmp_runner *run, int *next, double *row, kmp_row_fn *take, void *user)
{
    int n = run->s->n;
    double t = kmp_runner_t(run), work;
    for (; *next < run->spec.time_count && run->spec.times[*next] <= t; ++*next) {
        double at = run->spec.times[*next];
        kempe_status status = kmp_runner_row(run, at, row, row + n, row + 2 * n, row + 3 * n, &work);
        if (status != KEMPE_OK)
            return status;
        if (take(user, at, row, row + n, row + 2 * n, row + 3 * n, work))
            return kmp_fail_memory(run->s->context);
    }
    return KEMPE_OK;
}

static kempe_status advance(kmp_runner *run, kmp_row_fn *take, void *user)
{
    int next = 0;
    double *row = KMP_NEW(double, 3 * run->s->n + run->s->m);
    if (!row)
        return kmp_fail_memory(run->s->context);
    kempe_status status = deliver(run, &next, row, take, user);
    while (status == KEMPE_OK && kmp_runner_t(run) < run->spec.t_end) {
        status = kmp_runner_step(run);
        if (status == KEMPE_OK || status == KEMPE_STOPPED) {
            kempe_status delivered = deliver(run, &next, row, take, user);
            status = delivered == KEMPE_OK ? status : delivered;
        }
    }
    kmp_free(row);
    return status;
}

kempe_status kmp_run(const kempe_system *system, const kmp_run_spec *spec, const kempe_assembly *start, kmp_row_fn *row,
                     void *user, kmp_run_report *report)
{
    kmp_runner *run = NULL;
    *report = (kmp_run_report){0};
    kempe_status status = kmp_runner_new(system, spec, start, &run);
    double begin_s = cpu_now();
    if (status == KEMPE_OK && run)
        status = advance(run, row, user);
    double cpu_s = cpu_now() - begin_s;
    if (run)
        kmp_runner_report(run, report);
    report->cpu_s = cpu_s;
    kmp_runner_free(run);
    return status;
}
