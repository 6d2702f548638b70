/* SPDX-License-Identifier: BSD-3-Clause */
/* Radau IIA with its stages in lanes: coefficients, accuracy and dense output on motions with known solutions, the same
 * bits with lanes and one by one, stiff motions, events. */
#include "backend/encoders.h"
#include "base/memory.h"
#include "integrators/run/methods.h"
#include "integrators/run/runner.h"
#include "integrators/steppers/collocation_table.h"
#include "integrators/steppers/solver.h"
#include "loaded.h"
#include "testing.h"
#include <kempe/kempe.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

enum { LEAST = 2, MOST = KMP_COLLOCATION_STAGES };

/* -- coefficients -------------------------------------------------------------------------------------- */

/* A integrates powers below s exactly, its last row those below 2 s - 1 (order 2 s - 1); b A = b (1 - c), so that the
 * order holds for positions as well. */
static void check_order(const kmp_collocation_table *t)
{
    int s = t->stages;
    for (int k = 0; k < 2 * s - 1; k++)
        for (int i = k < s ? 0 : s - 1; i < s; i++) {
            double sum = 0;
            for (int j = 0; j < s; j++)
                sum += t->a[i][j] * pow(t->node[j + 1], k);
            CHECK_NEAR(sum, pow(t->node[i + 1], k + 1) / (k + 1), 1e-15);
        }
    for (int j = 0; j < s; j++) {
        CHECK_NEAR(t->end[j][KMP_END_TWICE], t->end[j][KMP_END_ONCE] * (1 - t->node[j + 1]), 1e-15);
        CHECK(t->end[j][KMP_END_ONCE] > 0);
    }
    CHECK(t->node[0] == 0 && t->node[s] == 1);
}

/* Integrals of the polynomial through 0 and the nodes are exact for powers up to s. */
static void check_integrals(const kmp_collocation_table *t)
{
    double once[MOST + 1], twice[MOST + 1], at[MOST + 1];
    for (double x = 0; x < 1.3; x += 0.17) {
        kmp_collocation_integrals(t, x, once, twice);
        kmp_collocation_weights(t, 1, &x, at);
        for (int k = 0; k <= t->stages; k++) {
            double first = 0, second = 0, value = 0;
            for (int j = 0; j <= t->stages; j++) {
                double power = pow(t->node[j], k);
                first += once[j] * power;
                second += twice[j] * power;
                value += at[j] * power;
            }
            CHECK_NEAR(first, pow(x, k + 1) / (k + 1), 1e-13);
            CHECK_NEAR(second, pow(x, k + 2) / ((k + 1) * (k + 2)), 1e-13);
            CHECK_NEAR(value, pow(x, k), 1e-12);
        }
    }
}

/* Eigenvectors and eigenvalues give A again; for odd s the first eigenvalue is the filter. */
static void check_eigenvalues(kmp_collocation_table *t)
{
    kmp_collocation_add_eigenvalues(t);
    CHECK(t->eigenvalues == (t->stages + 2) / 2 && t->re[0] == t->filter && t->im[0] == 0);
    for (int i = 0; i < t->stages; i++)
        for (int j = 0; j < t->stages; j++) {
            double sum = 0, one = 0;
            for (int e = 0; e < t->eigenvalues; e++) {
                double re = t->into_re[e][j], im = t->into_im[e][j];
                one += t->outof_re[i][e] * re - t->outof_im[i][e] * im;
                sum += t->outof_re[i][e] * (re * t->re[e] - im * t->im[e]) -
                       t->outof_im[i][e] * (re * t->im[e] + im * t->re[e]);
            }
            CHECK_NEAR(one, i == j, 1e-12);
            CHECK_NEAR(sum, t->a[i][j], 1e-12);
        }
}

/* Numbers that stand in the table: the filter of even s has the product of all eigenvalues as its power, the gap is the
 * largest of a fine grid. */
static void check_numbers(const kmp_collocation_table *t)
{
    double product = 1, gap = 0;
    for (int e = 1; e < t->eigenvalues; e++)
        product *= t->re[e] * t->re[e] + t->im[e] * t->im[e];
    for (int k = 1; k < 400; k++) {
        double value = 1;
        for (int i = 0; i <= t->stages; i++)
            value *= k / 400. - t->node[i];
        gap = fmax(gap, fabs(value));
    }
    CHECK(t->stages % 2 == 1 || fabs(pow(t->filter, t->stages) / product - 1) < 1e-14);
    CHECK_NEAR(t->gap, gap, 1e-15 * gap);
}

static void test_table(void)
{
    for (int s = LEAST; s <= MOST; s++) {
        kmp_collocation_table t;
        kmp_collocation_make(&t, s);
        check_order(&t);
        check_integrals(&t);
        check_eigenvalues(&t);
        check_numbers(&t);
    }
}

/* -- motions ------------------------------------------------------------------------------------------- */

/* Two bodies on a circle: q'' = -q / |q|^3, q = (cos t, sin t); z' = q1 is a further unknown, w' = |q'|^2 a
 * quadrature. */
enum { UNKNOWNS = 6, POSITIONS = 2 };

typedef struct motion {
    long calls[3]; /* by one; by lanes; improved at places nearby */
    int width;
    bool improves;
    double leaves; /* part of the error that is left then */
} motion;

static void slopes(const double *y, size_t stride, double *dy)
{
    double x = y[0], z = y[stride], r = sqrt(x * x + z * z), cube = r * r * r;
    dy[2 * stride] = -x / cube;
    dy[3 * stride] = -z / cube;
    dy[4 * stride] = x;
    dy[5 * stride] = y[2 * stride] * y[2 * stride] + y[3 * stride] * y[3 * stride];
}

static int circle(void *self, double t, const double *y, double *dy)
{
    motion *m = self;
    (void)t;
    m->calls[0]++;
    dy[0] = y[2];
    dy[1] = y[3];
    slopes(y, 1, dy);
    return KMP_GO;
}

static int circle_of_stages(void *self, const double *t, const double *y, double *dy)
{
    motion *m = self;
    m->calls[1]++;
    for (int l = 0; l < m->width; l++) {
        CHECK(isfinite(t[l]));
        slopes(y + l, (size_t)m->width, dy + l);
    }
    return KMP_GO;
}

static int circle_nearby(void *self, const double *t, const double *y, double *dy)
{
    motion *m = self;
    size_t w = (size_t)m->width;
    double *f = KMP_NEW(double, UNKNOWNS *w);
    (void)t;
    m->calls[2]++;
    for (size_t l = 0; l < w; l++)
        slopes(y + l, w, f + l);
    for (size_t k = 2 * w; k < UNKNOWNS * w; k++)
        dy[k] = f[k] + (k < 5 * w ? m->leaves * (dy[k] - f[k]) : 0);
    kmp_free(f);
    return KMP_GO;
}

/* The largest error of q, dq and z anywhere on 0 .. 6, at four places a step. */
static double run(motion *m, double rtol, kmp_solver_work *work, double *end)
{
    const kmp_solver_kind *kind = kmp_solver_find("radau");
    kempe_context *context = kempe_context_new();
    double atol[UNKNOWNS], y[UNKNOWNS] = {1, 0, 0, 1, 0, 0}, worst = 0;
    for (int k = 0; k < UNKNOWNS; k++)
        atol[k] = rtol;
    const double cycles = 1;
    const kmp_ode ode = {.n = UNKNOWNS,
                         .improve = m->improves ? circle_nearby : NULL,
                         .cycles_of_improve = &cycles,
                         .self = m,
                         .rhs = circle,
                         .lanes = m->width ? circle_of_stages : NULL,
                         .width = m->width,
                         .positions = POSITIONS,
                         .quadratures = 1};
    kmp_solver_setup setup = {.context = context, .ode = &ode, .tolerance = {rtol, atol}};
    kmp_solver *s = kind->create(kind, &setup);
    CHECK(s && kind->start(s, 0, y, NULL, 6, 0) == KEMPE_OK);
    while (s->t < 6 && kind->step(s) == KEMPE_OK)
        for (int k = 1; k <= 4; k++) {
            double t = k == 4 ? s->t : s->t_old + k * (s->t - s->t_old) / 4;
            CHECK(kind->dense(s, t, y, NULL) == KEMPE_OK);
            worst = check_max(worst, fabs(y[0] - cos(t)) + fabs(y[1] - sin(t)));
            worst = check_max(worst, fabs(y[2] + sin(t)) + fabs(y[3] - cos(t)) + fabs(y[4] - sin(t)));
            worst = check_max(worst, fabs(y[5] - t));
        }
    CHECK(s->t == 6);
    memcpy(end, y, sizeof y);
    *work = s->work;
    kind->release(s);
    kempe_context_free(context);
    return worst;
}

static void test_accuracy(void)
{
    for (int width = 0; width <= 8; width += 4)
        for (int e = -3; e >= -12; e -= 3) {
            motion m = {.width = width}, again = m;
            kmp_solver_work work, work_again;
            double end[UNKNOWNS], end_again[UNKNOWNS], rtol = pow(10, e), off = run(&m, rtol, &work, end);
            CHECK(off < 100 * rtol + 3e-11);
            CHECK(run(&again, rtol, &work_again, end_again) == off && memcmp(end, end_again, sizeof end) == 0);
            CHECK(width == 0 ? m.calls[1] == 0 : m.calls[0] <= work.steps + work.refused + 3);
            printf("  width %d, rtol %.0e: %3ld steps, %3ld rejected, %4ld iterations, off %.1e\n", width, rtol,
                   work.steps, work.rejected, work.newton, off);
        }
}

/* Sweeps at places nearby reach the same accuracy, also where they do not converge: then f is evaluated again. */
static void test_nearby(void)
{
    static const double leaves[] = {0.02, -4};
    for (int e = -3; e >= -12; e -= 3)
        for (size_t k = 0; k < sizeof leaves / sizeof *leaves; k++) {
            motion m = {.width = 8, .improves = true, .leaves = leaves[k]}, whole = {.width = 8};
            kmp_solver_work work, work_whole;
            double end[UNKNOWNS], rtol = pow(10, e), off = run(&m, rtol, &work, end);
            (void)run(&whole, rtol, &work_whole, end);
            CHECK(off < 100 * rtol + 3e-11);
            CHECK(m.calls[2] > 0);
            bool converges = fabs(leaves[k]) < 1;
            CHECK(!converges || (e == -3 || (m.calls[1] < whole.calls[1] / 2 && m.calls[2] <= whole.calls[1])));
            CHECK(converges || m.calls[1] + m.calls[2] < 3 * whole.calls[1]);
            printf("  rtol %.0e: %ld evaluations in lanes and %ld nearby, otherwise %ld; off %.1e\n", rtol, m.calls[1],
                   m.calls[2], whole.calls[1], off);
        }
}

/* Eight lanes and one by one are the same method. */
static void test_same_bits(void)
{
    double lanes[UNKNOWNS], each[UNKNOWNS];
    kmp_solver_work work;
    motion eight = {.width = 8}, one = {.width = 0};
    (void)run(&eight, 1e-9, &work, lanes);
    (void)run(&one, 1e-9, &work, each);
    CHECK(memcmp(lanes, each, sizeof lanes) == 0);
}

/* -- stiff motions ------------------------------------------------------------------------------------- */

/* A mass on a stiff spring with a strong damper that turns about the origin: the circle again. */
typedef struct whirl {
    double stiffness, damping;
} whirl;

static int pull(void *self, double t, const double *y, double *dy)
{
    const whirl *w = self;
    double r = sqrt(y[0] * y[0] + y[1] * y[1]), outwards = (y[0] * y[2] + y[1] * y[3]) / r;
    double force = (w->stiffness * (r - 1) + w->damping * outwards) / r;
    (void)t;
    for (int k = 0; k < 2; k++) {
        dy[k] = y[2 + k];
        dy[2 + k] = -y[k] * (1 + force);
    }
    return KMP_GO;
}

static int pull_jacobian(void *self, double t, const double *y, double *j)
{
    double at[4], high[4], low[4];
    for (int c = 0; c < 4; c++) {
        memcpy(at, y, sizeof at);
        at[c] = y[c] + 1e-6;
        (void)pull(self, t, at, high);
        at[c] = y[c] - 1e-6;
        (void)pull(self, t, at, low);
        for (int k = 0; k < 4; k++)
            j[k + 4 * c] = (high[k] - low[k]) / 2e-6;
    }
    return KMP_GO;
}

static kmp_solver_work follow_whirl(whirl w, bool exact, double *off)
{
    const kmp_solver_kind *kind = kmp_solver_find("radau");
    kempe_context *context = kempe_context_new();
    double atol[4] = {1e-8, 1e-8, 1e-8, 1e-8}, y[4] = {1, 0, 0, 1};
    const kmp_ode ode = {.n = 4, .self = &w, .rhs = pull, .jacobian = exact ? pull_jacobian : NULL, .positions = 2};
    kmp_solver_setup setup = {.context = context, .ode = &ode, .tolerance = {1e-8, atol}};
    kmp_solver *s = kind->create(kind, &setup);
    *off = 0;
    CHECK(s && kind->start(s, 0, y, NULL, 6, 0) == KEMPE_OK);
    while (s->t < 6 && kind->step(s) == KEMPE_OK) {
        CHECK(kind->dense(s, s->t_old + 0.4 * (s->t - s->t_old), y, NULL) == KEMPE_OK);
        double t = s->t_old + 0.4 * (s->t - s->t_old);
        *off = check_max(*off, fabs(y[0] - cos(t)) + fabs(y[1] - sin(t)));
    }
    CHECK(s->t == 6);
    kmp_solver_work work = s->work;
    kind->release(s);
    kempe_context_free(context);
    return work;
}

/* Explicit methods and Picard's iteration would need a step for each period of the spring, or time of the damper. */
static void test_stiff(void)
{
    static const whirl stiff[] = {{1e3, 10}, {1e6, 1e3}, {1e8, 1e6}, {1e10, 1e8}};
    for (size_t k = 0; k < sizeof stiff / sizeof *stiff; k++)
        for (int exact = 0; exact < 2; exact++) {
            double off;
            kmp_solver_work w = follow_whirl(stiff[k], exact, &off);
            printf("  stiffness %.0e%s: %ld steps, %ld refused, %ld iterations, %ld Jacobians, off %.1e\n",
                   stiff[k].stiffness, exact ? ", exact" : "", w.steps, w.refused, w.newton, w.matrices, off);
            CHECK(off < 1e-6);
            CHECK(w.steps < 400 && w.matrices > 0 && w.factorizations > 0);
        }
}

/* Prothero and Robinson's problem: all of the solution is smooth, all of the problem stiff. The filtered estimate sees
 * nothing of it; ends and middles of steps are nevertheless as good as the tolerance. */
static int follow_cosine(void *self, double t, const double *y, double *dy)
{
    dy[0] = -*(const double *)self * (y[0] - cos(t)) - sin(t);
    return KMP_GO;
}

static void test_all_stiff(void)
{
    for (double rate = 1e2; rate < 1e9; rate *= 1e2) {
        const kmp_solver_kind *kind = kmp_solver_find("radau");
        kempe_context *context = kempe_context_new();
        double atol = 1e-9, y = 1, off = 0;
        const kmp_ode ode = {.n = 1, .self = &rate, .rhs = follow_cosine};
        kmp_solver_setup setup = {.context = context, .ode = &ode, .tolerance = {1e-9, &atol}};
        kmp_solver *s = kind->create(kind, &setup);
        CHECK(s && kind->start(s, 0, &y, NULL, 20, 0) == KEMPE_OK);
        while (s->t < 20 && kind->step(s) == KEMPE_OK)
            for (int k = 1; k <= 4; k++) {
                double t = s->t_old + k * (s->t - s->t_old) / 4;
                CHECK(kind->dense(s, k == 4 ? s->t : t, &y, NULL) == KEMPE_OK);
                off = check_max(off, fabs(y - cos(k == 4 ? s->t : t)));
            }
        printf("  rate %.0e: %ld steps, off %.1e\n", rate, s->work.steps, off);
        CHECK(s->t == 20 && off < 1e-6 && s->work.steps < 100);
        kind->release(s);
        kempe_context_free(context);
    }
}

/* -- events -------------------------------------------------------------------------------------------- */

static int take_angle(void *user, double t, const double *q, const double *qd, const double *qdd, const double *lambda,
                      double work)
{
    (void)t, (void)qd, (void)qdd, (void)lambda, (void)work;
    *(double *)user = q[0];
    return 0;
}

/* A pendulum between two stops: conditions change within steps, which are several times as long as those of DOP853. */
static void test_events(void)
{
    static const char *const ways[][2] = {
        {"reduced", "dop853"}, {"reduced", "radau"}, {"projected", "radau"}, {"dae", "radau"}};
    loaded l = load("tests/models/pendulum_stops.yaml");
    double end = 5, angle[4];
    long events[4];
    for (int k = 0; k < 4; k++) {
        kmp_run_report report = {0};
        kmp_run_spec spec = {.formulation = ways[k][0],
                             .integrator = ways[k][1],
                             .rtol = 1e-11,
                             .t_end = end,
                             .time_count = 1,
                             .times = &end};
        CHECK(kmp_run_resolve(l.system, &spec) == KEMPE_OK);
        CHECK(kmp_run(l.system, &spec, NULL, take_angle, &angle[k], &report) == KEMPE_OK);
        events[k] = report.events;
        kmp_free(report.reason);
        CHECK(events[k] > 10 && events[k] == events[0]);
        CHECK_NEAR(angle[k], angle[0], 1e-8);
    }
    unload(&l);
}

/* -- programs of mechanisms ---------------------------------------------------------------------------- */

static void check_default(const char *path, const char *formulation, bool lanes)
{
    bool machine = kmp_code_form_of(8) != 0;
    loaded l = load(path);
    kmp_run_spec spec = {.formulation = formulation};
    CHECK(kmp_run_resolve(l.system, &spec) == KEMPE_OK);
    CHECK(strcmp(spec.integrator, lanes && machine ? "radau" : "dop853") == 0);
    unload(&l);
}

/* q at the end of a run by radau on `projected`, with sweeps at places nearby once they pay, or without. Returns the
 * counted cycles. */
static double follow_stewart(const kempe_system *s, bool near, double *q)
{
    kmp_run_spec spec = {.formulation = "projected", .integrator = "radau", .rtol = 1e-11, .t_end = 30};
    kmp_runner *run = NULL;
    double *row = KMP_NEW(double, 3 * s->n + s->m), work;
    CHECK(kmp_run_resolve(s, &spec) == KEMPE_OK && kmp_runner_new(s, &spec, NULL, &run) == KEMPE_OK);
    const double *cycles_near = run->solver->ode.cycles_of_improve;
    if (!near)
        run->solver->ode.improve = NULL;
    CHECK(*cycles_near == 0);
    while (kmp_runner_t(run) < spec.t_end && kmp_runner_step(run) == KEMPE_OK)
        continue;
    CHECK(kmp_runner_t(run) == spec.t_end && kmp_runner_row(run, spec.t_end, row, &work) == KEMPE_OK);
    CHECK(*cycles_near > 0 && *cycles_near < 0.7 * run->solver->ode.cycles_of_lanes);
    memcpy(q, row, (size_t)s->n * sizeof *q);
    double cycles = run->solver->cycles;
    kmp_runner_free(run);
    kmp_free(row);
    return cycles;
}

static void test_nearby_mechanism(void)
{
    loaded l = load("examples/stewart/stewart.yaml");
    if (!kmp_code_form_of(4) || !l.system)
        return;
    int n = l.system->n;
    double *q = KMP_NEW(double, 2 * n), off = 0;
    double near = follow_stewart(l.system, true, q), whole = follow_stewart(l.system, false, q + n);
    for (int k = 0; k < n; k++)
        off = check_max(off, fabs(q[k] - q[n + k]));
    CHECK(off < 1e-10 && near < 0.97 * whole);
    printf("  counted cycles nearby over whole: %.2f, q apart by %.1e\n", near / whole, off);
    kmp_free(q);
    unload(&l);
}

/* On the projected formulation radau is the default where the stages have lanes. */
static void test_default(void)
{
    check_default("examples/andrews/andrews.yaml", "projected", true);
    check_default("examples/andrews/andrews.yaml", "reduced", false);
    check_default("tests/models/guide_friction.yaml", "projected", true); /* forces depend on multipliers */
}

/* A run in two parts, the second from a checkpoint. */
static void test_checkpoint(void)
{
    static const char *const formulations[] = {"reduced", "projected"};
    char path[] = "/tmp/kempe_collocation_XXXXXX";
    int file = mkstemp(path);
    loaded l = load("examples/four_bar/four_bar.yaml");
    CHECK(file >= 0 && close(file) == 0);
    for (int k = 0; k < 2; k++) {
        kempe_trajectory *t[3] = {NULL};
        kempe_run_options run = {.formulation = formulations[k],
                                 .integrator = "radau",
                                 .rtol = 1e-10,
                                 .no_convergence_check = 1,
                                 .output_step = 0.1};
        for (int part = 0; part < 3; part++) {
            run.t_end = part == 1 ? 0.5 : 1;
            run.checkpoint = part == 1 ? path : NULL;
            run.resume = part == 2 ? path : NULL;
            CHECK(kempe_simulate(l.system, &run, &t[part]) == KEMPE_OK);
        }
        for (int i = 0; i < l.system->n && t[0] && t[2]; i++)
            CHECK_NEAR(kempe_trajectory_q(t[2], kempe_trajectory_row_count(t[2]) - 1)[i],
                       kempe_trajectory_q(t[0], kempe_trajectory_row_count(t[0]) - 1)[i], 1e-8);
        for (int part = 0; part < 3; part++)
            kempe_trajectory_free(t[part]);
    }
    unload(&l);
    (void)unlink(path);
}

/* -- forces that are not smooth ---------------------------------------------------------------------------- */

/* q'' = |t - c|^1.5: the second derivative of the force is infinite at c. */
static int push(void *self, double t, const double *y, double *dy)
{
    dy[0] = y[1];
    dy[1] = pow(fabs(t - *(double *)self), 1.5);
    return KMP_GO;
}

/* |error| of q' at t = 1, from 1 at 0: its integral is ((1 - c)^2.5 + c^2.5)/2.5. */
static double follow_push(double c, double rtol)
{
    const kmp_solver_kind *kind = kmp_solver_find("radau");
    const double atol[2] = {0}, begin[2] = {1, 1};
    double y[2] = {0};
    kempe_context *context = kempe_context_new();
    const kmp_ode ode = {.n = 2, .positions = 1, .self = &c, .rhs = push};
    const kmp_solver_setup setup = {.context = context, .ode = &ode, .tolerance = {rtol, atol}};
    kmp_solver *s = kind->create(kind, &setup);
    CHECK(s && kind->start(s, 0, begin, NULL, 1, 0) == KEMPE_OK);
    while (s->t < 1 && kind->step(s) == KEMPE_OK)
        ;
    CHECK(s->t == 1 && kind->dense(s, 1, y, NULL) == KEMPE_OK);
    kind->release(s);
    kempe_context_free(context);
    return fabs(y[1] - 1 - (pow(1 - c, 2.5) + pow(c, 2.5)) / 2.5);
}

/* The estimate alone, which allows more than rtol as smooth forces do, lets errors of 4400 rtol pass here, 120 in the
 * mean. */
static void test_not_smooth(void)
{
    enum { PLACES = 100 };
    double most = 0, sum = 0, rtol = 1e-10;
    for (int k = 0; k < PLACES; k++) {
        double off = follow_push((double)k / PLACES, rtol);
        most = check_max(most, off);
        sum += off;
    }
    printf("  errors of a force that is not smooth: %.1f rtol at most, %.1f in the mean\n", most / rtol,
           sum / PLACES / rtol);
    CHECK(most < 200 * rtol && sum / PLACES < 20 * rtol);
}

/* A step that is taken back leaves nothing: the next ones are those from the same start. */
static void test_undo(void)
{
    const kmp_solver_kind *kind = kmp_solver_find("radau");
    const double atol[2] = {1e-12, 1e-12}, begin[2] = {1, 1}, h = 0.125;
    double c = -1, y[2][2] = {{0}};
    for (int undone = 0; undone < 2; undone++) {
        kempe_context *context = kempe_context_new();
        const kmp_ode ode = {.n = 2, .positions = 1, .self = &c, .rhs = push};
        const kmp_solver_setup setup = {.context = context, .ode = &ode, .tolerance = {1e-9, atol}};
        kmp_solver *s = kind->create(kind, &setup);
        CHECK(s && kind->start(s, 0, begin, NULL, 1, undone ? 2 * h : h) == KEMPE_OK);
        if (undone) {
            CHECK(kind->step(s) == KEMPE_OK && s->t == 2 * h);
            kind->undo(s, h);
            CHECK(s->t == 0 && s->work.steps == 0);
        }
        CHECK(kind->step(s) == KEMPE_OK && s->t == h && s->work.steps == 1);
        CHECK(kind->dense(s, h / 3, y[undone], NULL) == KEMPE_OK);
        kind->release(s);
        kempe_context_free(context);
    }
    CHECK(y[0][0] == y[1][0] && y[0][1] == y[1][1]);
}

int main(void)
{
    TEST(test_default);
    TEST(test_checkpoint);
    TEST(test_nearby_mechanism);
    TEST(test_table);
    TEST(test_accuracy);
    TEST(test_nearby);
    TEST(test_same_bits);
    TEST(test_stiff);
    TEST(test_all_stiff);
    TEST(test_events);
    TEST(test_not_smooth);
    TEST(test_undo);
    return check_report();
}
