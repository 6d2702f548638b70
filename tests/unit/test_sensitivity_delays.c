/* SPDX-License-Identifier: BSD-3-Clause */
/* ctest: slow once 14 */
/* Derivatives of trajectories with continuous delays, by the delays too: against the polynomials of the method of steps
 * and a closed form with jumps; against runs with moved parameters, of a closed loop, with events and samples that
 * delayed signals cause, and with kinks; refusals. */
#include "analyses/sensitivity/sensitivity_study.h"
#include "four_bar_text.h"
#include "loaded.h"
#include <kempe/sensitivity.h>
#include <stdbool.h>

enum { MOST = 16 };

#define MASS "bodies: {m: {joint: {name: x, prismatic: x, at: ground}, mass: 1}}\n"

static kempe_sensitivity *find_with(loaded *l, const char *text, const char *outputs, const char *integrator,
                                    double end, int integral, int unchecked)
{
    kempe_sensitivity *s = NULL;
    kempe_run_options run = {0};
    const kempe_sensitivity_options options = {
        .outputs = outputs, .method = integral ? "forward" : NULL, .integral = integral, .run = &run};
    run.rtol = run.atol = 1e-11;
    run.t_end = end;
    run.output_step = end;
    run.integrator = integrator;
    run.no_convergence_check = unchecked;
    *l = load_text(text);
    if (!l->model || kempe_sensitivity_new(l->model, &options, &s) != KEMPE_OK)
        printf("%s\n", kempe_context_message(l->context));
    CHECK(s && s->columns <= MOST);
    return s;
}

static kempe_sensitivity *find(loaded *l, const char *text, const char *outputs, const char *integrator, double end,
                               int integral)
{
    return find_with(l, text, outputs, integrator, end, integral, 0);
}

static double last(const kempe_sensitivity *s, int column, int k)
{
    return s ? kmp_sensitivity_slope(s, s->rows - 1, column, k) : NAN;
}

/* -- closed forms -------------------------------------------------------------------------------------- */

/* y of y' = -c y(t - T), y = y0 before t = 0: the sum of (-c)^k (t - (k - 1) T)^k/k! while t > (k - 1) T; and its
 * derivatives by T and c, for y0 = 1. */
static double steps(double t, double T, double c, double *by_T, double *by_c)
{
    double y = 1, factor = 1;
    *by_T = *by_c = 0;
    for (int k = 1; t > (k - 1) * T; k++) {
        const double x = t - (k - 1) * T;
        factor *= -c / k;
        y += factor * pow(x, k);
        *by_T -= factor * k * (k - 1) * pow(x, k - 1);
        *by_c += factor * k / c * pow(x, k);
    }
    return y;
}

static void method_of_steps(void)
{
    static const char *const integrators[] = {"dop853", "dopri5", "radau9"};
    for (int i = 0; i < 3; i++) {
        loaded l;
        kempe_sensitivity *s = find(&l,
                                    "kempe: 1\nparameters: {T: 0.8, c: 1.1, y0: 1}\nstates:\n"
                                    "  y: {start: y0, rate: -c*late}\n  late: {delay: y, time: T}\n" MASS,
                                    "state", integrators[i], 3.7, 0);
        double y_T, y_c, late_T, late_c;
        const double y = steps(3.7, 0.8, 1.1, &y_T, &y_c), late = steps(3.7 - 0.8, 0.8, 1.1, &late_T, &late_c);
        CHECK_NEAR(last(s, 0, 0), y_T, 1e-9);
        CHECK_NEAR(last(s, 0, 1), y_c, 1e-9);
        CHECK_NEAR(last(s, 0, 2), y, 1e-9);
        CHECK_NEAR(last(s, 1, 0), late_T + 1.1 * steps(3.7 - 1.6, 0.8, 1.1, &y_T, &y_c), 1e-9); /* less y' there */
        CHECK_NEAR(last(s, 1, 1), late_c, 1e-9);
        CHECK_NEAR(last(s, 1, 2), late, 1e-9);
        kempe_sensitivity_free(s);
        unload(&l);
    }
}

/* x = v t passes w at w/v, `late` jumps from -1 to 1 later by T, `later` later by D again: their integrals, and
 * those of x times them. The mean of `early`, cos(f t) until T, is that of its expression. */
static void jumps(void)
{
    const double v = 1.3, w = 0.5, T = 0.6, D = 0.35, f = 2, end = 2, at = w / v + T, then = at + D;
    loaded l;
    kempe_sensitivity *s =
        find(&l,
             "kempe: 1\nparameters: {v: 1.3, w: 0.5, T: 0.6, D: 0.35, f: 2}\nstates:\n"
             "  late: {delay: \"if(q(x) > w, 1, -1)\", time: T}\n"
             "  later: {delay: late, time: D}\n"
             "  early: {delay: q(x), time: T, before: 3 + cos(f*t)}\n"
             "  i: {rate: late}\n  j: {rate: later*q(x)}\n  k: {rate: early}\n" MASS "start: {qd: {x: v}}\n",
             "i,j,k,early", NULL, end, 0);
    const double by_i[] = {2 * w / (v * v), -2 / v, -2, 0, 0};
    const double e = end, c = end - T;
    const double jump = -2 * v * then;
    const double by_j[] = {0.5 * e * e - then * then + jump * -w / (v * v), jump / v, jump, jump, 0};
    const double by_k[] = {0.5 * c * c, 0, -v * c + 3 + cos(f * T), 0, cos(f * T) * T / f - sin(f * T) / (f * f)};
    for (int p = 0; p < 5; p++) {
        CHECK_NEAR(last(s, 0, p), by_i[p], 1e-9);
        CHECK_NEAR(last(s, 1, p), by_j[p], 1e-9);
        CHECK_NEAR(last(s, 2, p), by_k[p], 1e-9);
        CHECK_NEAR(last(s, 3, p), p == 0 ? c : p == 2 ? -v : 0, 1e-9);
    }
    CHECK(s && s->count == 5);
    kempe_sensitivity_free(s);
    unload(&l);
}

/* -- beside differences -------------------------------------------------------------------------------- */

static bool ends_at(const char *text, const char *name, double value, double end, const kempe_sensitivity *s,
                    double *out)
{
    char number[40];
    (void)snprintf(number, sizeof number, "%.17g", value);
    const kempe_setting set = {name, number};
    loaded l = {.context = kempe_context_new()};
    kempe_trajectory *t = NULL;
    kempe_table *table = NULL;
    kempe_run_options run = {0};
    run.rtol = run.atol = 1e-12;
    run.t_end = end;
    run.output_step = end;
    run.formulation = "projected";
    run.no_convergence_check = 1;
    bool ok = kempe_model_read_text_set(l.context, text, "model.yaml", &set, 1, &l.model) == KEMPE_OK &&
              kempe_system_new(l.model, &l.system) == KEMPE_OK && kempe_simulate(l.system, &run, &t) == KEMPE_OK &&
              kempe_trajectory_table(t, "rows", &table) == KEMPE_OK;
    for (int c = 0; ok && c < s->columns; c++)
        out[c] = kempe_table_number(table, kempe_table_row_count(table) - 1, kempe_table_find(table, s->column[c]));
    kempe_table_free(table);
    kempe_trajectory_free(t);
    unload(&l);
    return ok;
}

static void against_differences(const char *text, const char *outputs, const char *integrator, double end,
                                double within)
{
    loaded l;
    kempe_sensitivity *s = find_with(&l, text, outputs, integrator, end, 0, 1); /* the differences are the check */
    double worst = 0;
    for (int p = 0; s && p < s->count; p++) {
        const double step = 1e-3 * s->parameter[p];
        double value[4][MOST];
        bool ok = true;
        for (int k = 0; k < 4; k++)
            ok = ends_at(text, s->name[p], s->parameter[p] + step * (k < 2 ? k - 2 : k - 1), end, s, value[k]) && ok;
        CHECK(ok);
        for (int i = 0; ok && i < s->columns; i++) {
            double slope = (8 * (value[2][i] - value[1][i]) - (value[3][i] - value[0][i])) / (12 * step);
            worst = check_max(worst, fabs(last(s, i, p) - slope) / (1 + fabs(slope)));
        }
    }
    CHECK(worst < within);
    printf("   off by %.1e\n", worst);
    kempe_sensitivity_free(s);
    unload(&l);
}

/* A four-bar whose controller sees angle and rate late; delays of delays, lengths in a delay, a signal before. */
static const char loop[] =
    "kempe: 1\ngravity: [0, -9.81, 0]\n"
    "parameters: {T: 0.07, T2: 0.031, Kp: 8, Kd: 3, crank: 0.3, base: 0.9, f: 3}\nground: {points: {D: [base, 0, 0]}}\n"
    "states:\n"
    "  seen: {delay: q(A), time: T}\n"
    "  v: {delay: qd(A) + 0.2*sin(3*t), time: T2}\n"
    "  again: {delay: seen^2, time: T + T2}\n"
    "  bef: {delay: q(D), time: T*crank*5, before: cos(f*t)*base}\n" CRANKED_FOUR_BAR_TEXT
    "forces: {motor: {joint: A, torque: 4 + Kp*(2 - seen) - Kd*v - 0.5*again}, load: {joint: D, torque: -2*bef - "
    "0.3*qd(D)}}\n"
    "run: {outputs: [q, qd, state]}\n";

static void a_four_bar(void)
{
    against_differences(loop, "q,qd,state", NULL, 0.7, 1e-8);
    loaded l, m;
    kempe_sensitivity *one = find(&l, loop, "q,qd,state", NULL, 0.7, 0);
    kempe_sensitivity *other = find(&m, loop, "q,qd,state", "radau9", 0.7, 0);
    for (int i = 0; one && other && i < one->columns; i++)
        for (int p = 0; p < one->count; p++)
            CHECK_NEAR(last(other, i, p), last(one, i, p), 1e-8);
    kempe_sensitivity_free(one);
    kempe_sensitivity_free(other);
    unload(&l);
    unload(&m);
}

/* A delayed signal switches a force, starts a counter and a sum; another one is the value of a condition, and its own
 * delays jump with it; a sampled state sees them. */
static void events(void)
{
    against_differences(
        "kempe: 1\nparameters: {T: 0.47, k: 0.33, a: 1.1, w: 0.41}\nstates:\n"
        "  late: {delay: q(x), time: T}\n"
        "  s: {delay: \"if(q(x) > w, 1, -1)\", time: 0.3*T}\n"
        "  s2: {delay: s*qd(x), time: 0.2}\n"
        "  z: {rate: s*q(x) + s2}\n"
        "  n: {start: 0.2, when: late < 0.3, next: n + a*late + 0.3*q(x)}\n"
        "  nl: {delay: n, time: 0.17}\n"
        "  m: {sample: 0.25, next: nl + qd(x)}\n"
        "  c: {start: 0, when: s < 0, next: c + z*a}\n" MASS
        "forces: {f: {joint: x, force: \"if(late > 0, -a, 1) - k*qd(x) + 0.2*s + 0.3*nl + 0.1*m + 0.2*s2 + 0.1*c\"}}\n"
        "start: {q: {x: 1}}\nrun: {outputs: [q, qd, state]}\n",
        "q,qd,state", NULL, 3.9, 1e-8);
}

/* Signals that are kinks themselves: rates of the delayed ones jump at times that depend on parameters. */
static void kinks(void)
{
    against_differences("kempe: 1\nparameters: {T: 0.47, k: 0.33, a: 1.1, w: 0.41}\nstates:\n"
                        "  bent: {delay: abs(q(x) - w), time: T}\n"
                        "  lim: {delay: \"max(qd(x), -a)\", time: 0.3*T}\n"
                        "  z: {rate: bent*lim}\n" MASS
                        "forces: {f: {joint: x, force: -k*qd(x) - 2*bent + lim - 3*q(x)}}\n"
                        "start: {q: {x: 1}}\nrun: {outputs: [q, qd, state]}\n",
                        "q,qd,state", NULL, 3.9, 1e-7);
}

/* The integral of a delayed signal beside a state that is the same integral. */
static void integrals(void)
{
    static const char text[] = "kempe: 1\nparameters: {w: 0.4, T: 0.3, k: 3}\nstates:\n"
                               "  late: {delay: \"if(q(x) > w, q(x), -1)\", time: T}\n  sum: {rate: late}\n" MASS
                               "forces: {f: {joint: x, force: -k*late}}\nstart: {q: {x: 0.3}, qd: {x: 1}}\n";
    loaded l, m;
    kempe_sensitivity *row = find(&l, text, "sum", NULL, 1.1, 0), *sum = find(&m, text, "late", NULL, 1.1, 1);
    for (int k = 0; k < 3; k++)
        CHECK_NEAR(last(sum, 0, k), last(row, 0, k), 1e-9);
    CHECK(fabs(last(row, 0, 1)) > 0.1);
    kempe_sensitivity_free(row);
    kempe_sensitivity_free(sum);
    unload(&l);
    unload(&m);
}

/* -- refusals ------------------------------------------------------------------------------------------ */

static void refuse(const char *text, const kempe_sensitivity_options *options, const char *sentence)
{
    loaded l = load_text(text);
    kempe_sensitivity *s = NULL;
    CHECK(l.model && kempe_sensitivity_new(l.model, options, &s) != KEMPE_OK);
    const char *said = s ? s->reason : kempe_context_message(l.context);
    CHECK(strstr(said, sentence) != NULL);
    if (!strstr(said, sentence))
        printf("%s\n", said);
    kempe_sensitivity_free(s);
    unload(&l);
}

/* A held value jumps later by T, together with another sample unless T changes. */
static void refusals(void)
{
    static const char text[] = "kempe: 1\nparameters: {T: 0.5, k: 1.3}\n"
                               "states:\n  n: {sample: 0.25, next: k*q(x)}\n  late: {delay: n, time: T}\n" MASS
                               "forces: {f: {joint: x, force: 1 - late}}\nrun: {t_end: 1.9, outputs: [q]}\n";
    loaded l = load_text(text);
    kempe_sensitivity *s = NULL;
    refuse(text, &(kempe_sensitivity_options){.method = "adjoint"},
           "the adjoint method: the state 'late' is a delayed");
    refuse(text, &(kempe_sensitivity_options){.of = "modes"}, "the state 'late' is a delayed signal");
    refuse(text, &(kempe_sensitivity_options){.parameters = "T"}, "the state 'n' changes at t = 0.75 together with");
    CHECK(l.model && kempe_sensitivity_new(l.model, &(kempe_sensitivity_options){.parameters = "k"}, &s) == KEMPE_OK);
    kempe_sensitivity_free(s);
    unload(&l);
}

int main(void)
{
    TEST(method_of_steps);
    TEST(jumps);
    TEST(a_four_bar);
    TEST(events);
    TEST(kinks);
    TEST(integrals);
    TEST(refusals);
    return check_report();
}
