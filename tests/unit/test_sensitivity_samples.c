/* SPDX-License-Identifier: BSD-3-Clause */
/* Derivatives of trajectories across samples and events of states: against closed forms of the motion, differentiated
 * in long double numbers; against runs with moved parameters, of a closed loop; what has no derivative. */
#include "analyses/sensitivity/sensitivity_study.h"
#include "four_bar_text.h"
#include "sensitivity_of.h"
#include "testing.h"
#include <kempe/kempe.h>
#include <kempe/sensitivity.h>
#include <kempe/settings.h>
#include <stdbool.h>

typedef long double real;

/* -- closed forms -------------------------------------------------------------------------------------- */

enum { VALUES = 3, PARAMETERS = 3 };

/* x, v and u of x'' = u - a v at the time end, u = -K (x - 1) - D v at each sample of 0.05. */
static void controlled(const real p[PARAMETERS], real end, real out[VALUES])
{
    real x = 0.1L, v = 0, u = 0, t = 0, every = 0.05L;
    for (int k = 0; t < end; k++) {
        real h = fminl(every, end - t), decay = expl(-p[2] * h), drift = (1 - decay) / p[2];
        u = -p[0] * (x - 1) - p[1] * v;
        x += v * drift + u / p[2] * (h - drift);
        v = v * decay + u * drift;
        t = (k + 1) * every;
    }
    out[0] = x, out[1] = v, out[2] = u;
}

/* T, h and n: T' = P h - a T; h is 0 from T = hi on and 1 from T = 3 on; n = 0.9 n + a T + t where T becomes hi. */
static void relay(const real p[PARAMETERS], real end, real out[VALUES])
{
    real T = 4, h = 1, n = 1, t = 0;
    for (;;) {
        real rest = p[1] * h / p[0], to = h > 0 ? p[2] : 3, h_t = logl((T - rest) / (to - rest)) / p[0];
        if (t + h_t > end) {
            T = rest + (T - rest) * expl(-p[0] * (end - t));
            break;
        }
        t += h_t;
        T = to;
        n = h > 0 ? 0.9L * n + p[0] * T + t : n;
        h = 1 - h;
    }
    out[0] = T, out[1] = h, out[2] = n;
}

typedef void motion(const real p[PARAMETERS], real end, real out[VALUES]);

/* Differences of order 4: their error is some 1e-13 of the derivative. */
static void differentiate(motion *of, const double *value, int k, double end, double slope[VALUES])
{
    static const real weight[] = {1, -8, 0, 8, -1};
    real sum[VALUES] = {0}, step = 3e-4L * (real)value[k], p[PARAMETERS], out[VALUES];
    for (int i = 0; i < 5; i++) {
        for (int j = 0; j < PARAMETERS; j++)
            p[j] = (real)value[j] + (j == k ? (i - 2) * step : 0);
        of(p, (real)end, out);
        for (int j = 0; j < VALUES; j++)
            sum[j] += weight[i] * out[j];
    }
    for (int j = 0; j < VALUES; j++)
        slope[j] = (double)(sum[j] / (12 * step));
}

typedef struct closed {
    const char *text, *outputs, *integrator;
    motion *of;
    double value[PARAMETERS], end;
} closed;

static kempe_sensitivity *find(kempe_context *c, const char *text, const char *outputs, const char *integrator,
                               double end, int integral)
{
    return sensitivity_of("forward", c, text, outputs, integrator, end, integral);
}

static void compare_by(const char *method, const closed *x)
{
    kempe_context *c = kempe_context_new();
    kempe_sensitivity *s = sensitivity_of(method, c, x->text, x->outputs, x->integrator, x->end, 0);
    real p[PARAMETERS], value[VALUES];
    for (int k = 0; k < PARAMETERS; k++)
        p[k] = (real)x->value[k];
    x->of(p, (real)x->end, value);
    for (int j = 0; s && j < VALUES; j++)
        CHECK_NEAR(kmp_sensitivity_value(s, s->rows - 1, j), (double)value[j], 1e-10 * (1 + fabs((double)value[j])));
    for (int k = 0; s && k < PARAMETERS; k++) {
        double slope[VALUES];
        differentiate(x->of, x->value, k, x->end, slope);
        for (int j = 0; j < VALUES; j++)
            CHECK_NEAR(kmp_sensitivity_slope(s, s->rows - 1, j, k), slope[j], 1e-9 * (1 + fabs(slope[j])));
    }
    kempe_sensitivity_free(s);
    kempe_context_free(c);
}

static void compare(const closed *x)
{
    compare_by("forward", x);
    compare_by("adjoint", x);
}

#define MASS "bodies: {m: {joint: {name: x, prismatic: x, at: ground}, mass: 1}}\n"

static const char sampled[] =
    "kempe: 1\nparameters: {K: 30, D: 4, a: 0.2}\n"
    "states:\n  u: {sample: 50 ms, next: \"-K*(q(x) - 1) - D*qd(x)\"}\n"
    "  way: {rate: q(x)}\n" MASS "forces: {c: {joint: x, force: u - a*qd(x)}}\nstart: {q: {x: 0.1}}\n";

static void samples(void)
{
    static const char *const integrators[] = {"dop853", "radau9"};
    for (int k = 0; k < 2; k++) {
        compare(&(closed){sampled, "q(x),qd(x),u", integrators[k], controlled, {30, 4, 0.2}, 0.52});
        compare(&(closed){sampled, "q(x),qd(x),u", integrators[k], controlled, {30, 4, 0.2}, 2.03});
    }
}

static void events(void)
{
    static const char text[] = "kempe: 1\nparameters: {a: 0.7, P: 10, hi: 5}\nstates:\n"
                               "  T: {start: 4, rate: P*h - a*T}\n"
                               "  h: {start: 1, when: \"(T - hi)*(T - 3) > 0\", next: \"if(T > 4, 0, 1)\"}\n"
                               "  n: {start: 1, when: T > hi, next: n*0.9 + T*a + t}\n" MASS;
    compare(&(closed){text, "state(T),state(h),state(n)", "dop853", relay, {0.7, 10, 5}, 3});
    compare(&(closed){text, "state(T),state(h),state(n)", "radau9", relay, {0.7, 10, 5}, 7.5});
}

/* The integral of a coordinate beside a state that is the same integral. */
static void integrals(void)
{
    kempe_context *c = kempe_context_new();
    kempe_sensitivity *row = find(c, sampled, "state(way)", "dop853", 0.52, 0);
    kempe_sensitivity *sum = find(c, sampled, "q(x)", "dop853", 0.52, 1);
    for (int k = 0; row && sum && k < PARAMETERS; k++)
        CHECK_NEAR(kmp_sensitivity_slope(sum, sum->rows - 1, 0, k), kmp_sensitivity_slope(row, row->rows - 1, 0, k),
                   1e-11);
    kempe_sensitivity_free(row);
    kempe_sensitivity_free(sum);
    kempe_context_free(c);
}

/* -- a closed loop ------------------------------------------------------------------------------------- */

/* A digital controller with a limited output, its sum, and a relay that loads the rocker. */
static const char loop[] =
    "kempe: 1\ngravity: [0, -9.81, 0]\nparameters: {Kp: 8, Ki: 3, crank: 0.3, high: 1.62}\n"
    "states:\n"
    "  u: {pid: 2 - q(A), proportional: Kp, integral: Ki, derivative: 0.4, filter: 20 ms, limits: [-9, 9], sample: 20 "
    "ms}\n"
    "  relay: {hysteresis: q(A), limits: [1.5, high], values: [0, 1]}\n"
    "ground: {points: {D: [0.9, 0, 0]}}\n" CRANKED_FOUR_BAR_TEXT
    "forces: {motor: {joint: A, torque: u + 4}, load: {joint: D, torque: -2*relay - 0.3*qd(D)}}\n";

enum { COORDINATES = 3 };

static bool ends_at(const char *name, double value, double *end)
{
    char number[40];
    (void)snprintf(number, sizeof number, "%.17g", value);
    const kempe_setting set = {name, number};
    kempe_context *c = kempe_context_new();
    kempe_model *model = NULL;
    kempe_system *system = NULL;
    kempe_trajectory *t = NULL;
    kempe_run_options run = {0};
    run.rtol = 1e-13;
    run.t_end = 0.7;
    run.formulation = "projected";
    run.no_convergence_check = 1;
    bool ok = kempe_model_read_text_set(c, loop, "loop.yaml", &set, 1, &model) == KEMPE_OK &&
              kempe_system_new(model, &system) == KEMPE_OK && kempe_simulate(system, &run, &t) == KEMPE_OK;
    for (int i = 0; ok && i < COORDINATES; i++) {
        end[i] = kempe_trajectory_q(t, kempe_trajectory_row_count(t) - 1)[i];
        end[COORDINATES + i] = kempe_trajectory_qd(t, kempe_trajectory_row_count(t) - 1)[i];
    }
    kempe_trajectory_free(t);
    kempe_system_free(system);
    kempe_model_free(model);
    kempe_context_free(c);
    return ok;
}

static void four_bar_by(const char *method)
{
    kempe_context *c = kempe_context_new();
    kempe_sensitivity *s = sensitivity_of(method, c, loop, "q(A),q(B),q(D),qd(A),qd(B),qd(D)", NULL, 0.7, 0);
    for (int p = 0; s && p < s->count; p++) {
        const double step = 2e-5 * s->parameter[p];
        double value[4][2 * COORDINATES];
        bool ok = true;
        for (int k = 0; k < 4; k++)
            ok = ends_at(s->name[p], s->parameter[p] + step * (k < 2 ? k - 2 : k - 1), value[k]) && ok;
        CHECK(ok);
        for (int i = 0; ok && i < 2 * COORDINATES; i++) {
            double slope = (8 * (value[2][i] - value[1][i]) - (value[3][i] - value[0][i])) / (12 * step);
            CHECK_NEAR(kmp_sensitivity_slope(s, s->rows - 1, i, p), slope, 2e-7 * (1 + fabs(slope)));
        }
    }
    CHECK(s && s->count == 4);
    kempe_sensitivity_free(s);
    kempe_context_free(c);
}

static void a_four_bar(void)
{
    four_bar_by("forward");
    four_bar_by("adjoint");
}

/* Forward and adjoint: the integral of the multiplier, whose jumps at events and samples count. */
static void both_methods(void)
{
    static const char *const outputs = "reaction(C).x,q(D),relay";
    kempe_context *c = kempe_context_new();
    kempe_sensitivity *forward = sensitivity_of("forward", c, loop, outputs, NULL, 0.7, 1);
    kempe_sensitivity *adjoint = sensitivity_of("adjoint", c, loop, outputs, NULL, 0.7, 1);
    CHECK(forward && adjoint && forward->columns == 3);
    for (int j = 0; forward && adjoint && j < forward->columns; j++)
        for (int p = 0; p < forward->count; p++)
            CHECK_NEAR(kmp_sensitivity_slope(adjoint, 0, j, p), kmp_sensitivity_slope(forward, 0, j, p), 1e-8);
    CHECK(forward && fabs(kmp_sensitivity_slope(forward, 0, 2, 3)) > 0.01); /* the relay by its limit */
    kempe_sensitivity_free(forward);
    kempe_sensitivity_free(adjoint);
    kempe_context_free(c);
}

/* -- what has no derivative ------------------------------------------------------------------------------ */

static void refuse(const char *text, const char *method, const char *sentence)
{
    kempe_context *c = kempe_context_new();
    kempe_model *model = NULL;
    kempe_sensitivity *s = NULL;
    kempe_run_options run = {0};
    const kempe_sensitivity_options options = {.outputs = "q(x)", .method = method, .run = &run};
    run.t_end = 2;
    CHECK(kempe_model_read_text(c, text, "model.yaml", &model) == KEMPE_OK);
    CHECK(model && kempe_sensitivity_new(model, &options, &s) != KEMPE_OK);
    const char *said = s ? s->reason : kempe_context_message(c);
    if (!strstr(said, sentence))
        printf("%s\n", said);
    CHECK(strstr(said, sentence) != NULL);
    kempe_sensitivity_free(s);
    kempe_model_free(model);
    kempe_context_free(c);
}

/* At t = 1 the mass passes x = 1 and so changes n, when m is sampled too. */
static void refusals(void)
{
    static const char *const methods[] = {"forward", "adjoint"};
    for (int k = 0; k < 2; k++)
        refuse("kempe: 1\nparameters: {v: 1}\nstates:\n  n: {when: q(x) > 1, next: n + qd(x)}\n"
               "  m: {sample: 0.5, next: n + q(x)}\n" MASS "forces: {f: {joint: x, force: n + m - n - m}}\n"
               "start: {qd: {x: v}}\n",
               methods[k], "together with an event whose time depends on parameters");
}

int main(void)
{
    TEST(samples);
    TEST(events);
    TEST(integrals);
    TEST(a_four_bar);
    TEST(both_methods);
    TEST(refusals);
    return check_report();
}
