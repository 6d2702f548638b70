/* SPDX-License-Identifier: BSD-3-Clause */
/* Unknowns of equations in models: beside models that have the solution as a formula, in every set of equations with
 * all derivatives, on all formulations; against differences; and as text. */
#include "derived.h"
#include "dynamics/equations.h"
#include "loaded.h"
#include <kempe/kempe.h>
#include <math.h>
#include <stdbool.h>

static const char head[] = "kempe: 1\n"
                           "name: pair\n"
                           "gravity: [0, -9.81, 0]\n"
                           "parameters: {r: 0.3, l: 0.8, k: 2}\n"
                           "tables: {soft: {x: [-2, -1, 0, 1, 2], y: [-8, -1.2, 0, 1, 8]}}\n";
static const char body[] =
    "bodies:\n"
    "  A: {joint: {name: a, revolute: z, at: ground}, mass: 1, com: [0.1, 0, 0], inertia: {zz: 0.1}}\n"
    "  B: {joint: {name: x, prismatic: x, at: ground}, mass: 2}\n"
    "forces: {f: {joint: x, force: \"-k*soft(b) - b*qd(x)\"}, g: {joint: a, torque: \"-c^2*qd(a)\"}}\n"
    "loops: {rod: {constraint: \"q(x) - r*cos(q(a)) - reach\"}}\n"
    "sensors: {b: b, c: c, load: load}\n"
    "start: {q: {a: 0.4, x: 1}, qd: {a: 3}}\n"
    "run: {t_end: 1, outputs: [q, sensor(b), sensor(load), lambda]}\n";
/* The angle of the rod, and what follows it by a line and a circle. */
static const char solved[] = "algebraic:\n"
                             "  rod: {of: {b: 0.1}, zero: \"l*sin(b) - r*sin(q(a))\"}\n"
                             "  reach: l*cos(b)\n"
                             "  pair: {of: {c: 1, d: 0 m}, zero: [\"c^2 + d^2 - 1 - b^2\", \"d - 0.5*c - 0.1*q(x)\"]}\n"
                             "  load: abs(lambda(rod)) + d\n";
/* c: 1.25 c^2 + 0.1 x c + 0.01 x^2 - 1 - b^2 = 0 */
static const char said[] = "algebraic:\n"
                           "  b: asin(r/l*sin(q(a)))\n"
                           "  reach: l*cos(b)\n"
                           "  c: (-0.1*q(x) + sqrt(0.01*q(x)^2 - 5*(0.01*q(x)^2 - 1 - b^2)))/2.5\n"
                           "  d: 0.5*c + 0.1*q(x)\n"
                           "  load: abs(lambda(rod)) + d\n";

static loaded load_pair(const char *unknowns)
{
    char text[4096];
    (void)snprintf(text, sizeof text, "%s%s%s", head, unknowns, body);
    return load_text(text);
}

static void check_near(int count, const double *a, const double *b)
{
    double size = 1;
    for (int k = 0; k < count; k++)
        size = check_max(size, fabs(b[k]));
    for (int k = 0; k < count; k++)
        CHECK_NEAR(a[k], b[k], 1e-13 * size);
}

/* All sets of both, kept parameters and not. */
static void test_equations(void)
{
    const unsigned sets = 2 * KMP_SET_CLOSED_Q - 1;
    for (int keep = 0; keep < 2; keep++) {
        loaded l[2] = {load_pair(solved), load_pair(said)};
        derived d[2];
        if (!l[0].system || !l[1].system)
            return;
        for (int i = 0; i < 2; i++)
            CHECK(derived_init(&d[i], l[i].model, sets, KMP_SCHEME_NER, keep));
        for (int round = 0; round < 20; round++) {
            state s = random_state_vectors();
            for (int i = 0; i < 2; i++)
                derived_eval(&d[i], &s);
            derived_set a[DERIVED_SETS] = {{0}}, b[DERIVED_SETS] = {{0}};
            int count = derived_list(&d[0], a);
            (void)derived_list(&d[1], b);
            for (int k = 0; k < count; k++)
                check_near(a[k].count, *a[k].to, *b[k].to);
            double h = d[0].h[0], step = 1e-6, jacobian[2] = {d[0].jacobian[0], d[0].jacobian[1]};
            CHECK(isfinite(h));
            for (int j = 0; j < 2; j++) { /* J against differences, too */
                state to[2] = {s, s};
                double at[2];
                for (int i = 0; i < 2; i++) {
                    to[i].q[j] += i ? step : -step;
                    derived_eval(&d[0], &to[i]);
                    at[i] = d[0].h[0];
                }
                CHECK_NEAR(jacobian[j], (at[1] - at[0]) / (2 * step), 1e-8);
            }
        }
        for (int i = 0; i < 2; i++) {
            derived_free(&d[i]);
            unload(&l[i]);
        }
    }
}

typedef struct end {
    double q[2];
} end;

static end run(const char *unknowns, const char *formulation, const char *integrator)
{
    end e = {{0}};
    loaded l = load_pair(unknowns);
    kempe_trajectory *t = NULL;
    kempe_run_options settings = {0};
    settings.formulation = formulation;
    settings.integrator = integrator;
    settings.rtol = 1e-11;
    kempe_status status = l.system ? kempe_simulate(l.system, &settings, &t) : KEMPE_E_INPUT;
    CHECK(status == KEMPE_OK);
    if (status == KEMPE_OK) {
        memcpy(e.q, kempe_trajectory_q(t, kempe_trajectory_row_count(t) - 1), sizeof e.q);
    } else {
        printf("%s\n", kempe_context_message(l.context));
    }
    kempe_trajectory_free(t);
    unload(&l);
    return e;
}

static void test_formulations(void)
{
    static const char *const ways[][2] = {{"reduced", "dop853"}, {"projected", "dop853"}, {"projected", "radau"},
                                          {"reduced", "radau"},  {"reduced", "radau5"},   {"dae", "ida"}};
    end reference = run(said, "reduced", "dop853");
    for (size_t k = 0; k < sizeof ways / sizeof *ways; k++) {
        end e = run(solved, ways[k][0], ways[k][1]);
        double near = k < 4 ? 1e-10 : 1e-6;
        CHECK_NEAR(e.q[0], reference.q[0], near);
        CHECK_NEAR(e.q[1], reference.q[1], near);
    }
}

/* Unknowns of one group by a factor of 1e12 apart, each to its own rounding; one that is zero but for the rounding of a
 * large one ends too. */
static void test_scales(void)
{
    loaded l = load_text("kempe: 1\n"
                         "bodies: {m: {joint: {name: S, prismatic: z, at: ground}, mass: 1}}\n"
                         "algebraic:\n"
                         "  far: {of: {a: 1e6, b: 1e-3}, zero: [\"a*a - 4e12*(1 + q(S))\", \"b + 0.5e6*b*b - "
                         "1.5e-6*(1 + q(S))\"]}\n"
                         "  none: {of: {c: 1e6, d: 0}, zero: [\"c^3 - 7e18*(1 + q(S))\", \"d + d^3 + c^3/7e18 - 1 - "
                         "q(S)\"]}\n"
                         "sensors: {a: a, b: b, c: c, d: d}\n"
                         "run: {t_end: 1, outputs: [sensor(a), sensor(b), sensor(c), sensor(d)]}\n");
    derived d;
    bool ok = l.model && derived_init(&d, l.model, KMP_SET_OUTPUT, KMP_SCHEME_COMPOSITE, false);
    CHECK(ok);
    if (ok) {
        const state s = {.q = {0}};
        derived_eval(&d, &s);
        CHECK_NEAR(d.shown[0] / 2e6, 1, 1e-15);
        CHECK_NEAR(d.shown[1] / 1e-6, 1, 1e-13);
        CHECK_NEAR(d.shown[2] / cbrt(7e18), 1, 1e-15);
        CHECK(fabs(d.shown[3]) < 1e-15);
        derived_free(&d);
    }
    unload(&l);
}

/* Runs until they fail, with words that name these unknowns or (NULL) none. */
static void fails(const char *text, const char *formulation, const char *when, const char *named)
{
    loaded l = load_text(text);
    kempe_trajectory *t = NULL;
    kempe_run_options settings = {0};
    settings.formulation = formulation;
    settings.integrator = independent_integrator(formulation);
    CHECK(l.system && kempe_simulate(l.system, &settings, &t) < 0);
    const char *why = kempe_context_message(l.context), *names = strstr(why, "have no solution there: ");
    CHECK(strstr(why, when));
    CHECK(named ? names && strstr(names, named) && !strchr(why, '\n') : !names);
    kempe_trajectory_free(t);
    unload(&l);
}

/* If there is no solution, the values are NaN, and the run says so, once. */
static void test_no_solution(void)
{
    static const char text[] = "kempe: 1\n"
                               "algebraic: {u: {of: {y: 1}, zero: \"y^2 + q(x) - 1\"}}\n"
                               "bodies: {B: {joint: {name: x, prismatic: x, at: ground}, mass: 1}}\n"
                               "forces: {f: {joint: x, force: 1 + y}}\n"
                               "run: {t_end: 3}\n";
    fails(text, "reduced", "at t = 1.02", "'u'"); /* x = 1, where y^2 becomes negative */
    fails(text, "dae", "at t = 1.02", "'u'");
}

/* A run that ends for another reason does not blame them. */
static void test_not_to_blame(void)
{
    fails("kempe: 1\n"
          "algebraic: {u: {of: {y: 0.1}, zero: \"y + sin(y) - q(x)/(1 m)\"}}\n"
          "bodies: {B: {joint: {name: x, prismatic: x, at: ground}, mass: 1}}\n"
          "forces: {f: {joint: x, force: \"1 N - 2 N*sign(qd(x)) + 0 N*y\"}}\n"
          "start: {qd: {x: 1}}\n"
          "run: {t_end: 3}\n",
          NULL, "changes back and forth at t = 1", NULL);
}

int main(void)
{
    TEST(test_equations);
    TEST(test_formulations);
    TEST(test_scales);
    TEST(test_no_solution);
    TEST(test_not_to_blame);
    return check_report();
}
