/* SPDX-License-Identifier: BSD-3-Clause */
/* Derivatives of the inverse dynamics on random trees and loops: by recursion with composite bodies as by
 * differentiation, in axes that turn or stay, and both as two-sided differences say. The power of the forces goes
 * along. */
#include "constraints/evaluation/tangent.h"
#include "derived.h"
#include "dynamics/equations.h"
#include "dynamics/kinematics/link_tree.h"
#include "model/data/body.h"
#include "random_model.h"
#include "testing.h"
#include <kempe/kempe.h>
#include <stdbool.h>

enum {
    MODELS = 96,
    SETS = KMP_SET_MASS | KMP_SET_INVERSE | KMP_SET_INVERSE_Q | KMP_SET_INVERSE_QD | KMP_SET_CLOSED | KMP_SET_CLOSED_Q |
           KMP_SET_POWER | KMP_SET_POWER_SLOPES
};

/* |a - b| in units of the largest of b, at least 1. */
static double distance(int n, const double *a, const double *b)
{
    double off = 0, size = 1;
    for (int k = 0; k < n; k++) {
        off = check_max(off, isfinite(a[k]) ? fabs(a[k] - b[k]) : INFINITY);
        size = check_max(size, fabs(b[k]));
    }
    return off / size;
}

static void check_close(int number, const char *what, double off, double tolerance)
{
    if (!(off <= tolerance)) {
        check_failures++;
        printf("model %d: %s: off by %.3g, allowed %.3g\n", number, what, off, tolerance);
    }
}

/* -- a derivation and its state ------------------------------------------------------------------------ */

/* Bodies are pushed and twisted, and charts are rotations about (1, 2, 2)/3. */
typedef struct inputs {
    double force[STATE_MAX], torque[STATE_MAX], chart[9 * STATE_MAX];
} inputs;

static void choose_inputs(inputs *in)
{
    const double e[3] = {1 / 3.0, 2 / 3.0, 2 / 3.0};
    for (int k = 0; k < STATE_MAX; k++) {
        pose p = {.r = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}};
        in->force[k] = between(-5, 5);
        in->torque[k] = between(-5, 5);
        pose_turn(&p, e, between(-3, 3));
        memcpy(in->chart + 9 * k, p.r, sizeof p.r);
    }
}

static void eval(derived *d, const inputs *in, const state *s)
{
    kmp_machine_set(d->machine, KMP_IN_FORCE, in->force);
    kmp_machine_set(d->machine, KMP_IN_TORQUE, in->torque);
    kmp_machine_set(d->machine, KMP_IN_CHART, in->chart);
    derived_eval(d, s);
}

/* Axes stay, moments are about joints, origins elsewhere and masses with parents wherever, every third model. */
typedef struct choice {
    bool stay[STATE_MAX], about[STATE_MAX];
    uint8_t origin[STATE_MAX], give[STATE_MAX], lump[STATE_MAX];
} choice;

static void choose_methods(choice *c, int number)
{
    for (int k = 0; k < STATE_MAX; k++) {
        c->stay[k] = number % 3 && pick(3);
        c->about[k] = number % 3 == 2 && pick(2);
        c->origin[k] = (uint8_t)(number % 3 == 2 ? pick(KMP_ORIGINS) : 0);
        c->give[k] = (uint8_t)(number % 3 == 2 ? pick(KMP_GIVE_ALL + 1) : 0);
        c->lump[k] = (uint8_t)(number % 3 == 2 ? pick(KMP_GIVE_ALL + 1) : 0);
    }
}

static bool derive(derived *d, const kempe_model *model, choice *c, kmp_tangent_method way, int number)
{
    kmp_savings savings;
    const size_t n = (size_t)kmp_model_motion_count(model);
    CHECK(kmp_savings_init(&savings, model));
    memcpy(savings.stay, c->stay, n);
    memcpy(savings.about, c->about, n);
    memcpy(savings.origin, c->origin, n);
    memcpy(savings.give, c->give, n);
    memcpy(savings.lump, c->lump, n);
    savings.by_q = savings.by_qd = way;
    const kmp_derivation_request scene = {.sets = SETS,
                                          .savings = &savings,
                                          .keep = number % 2 ? KMP_KEEP_PARAMETERS : KMP_KEEP_NOTHING,
                                          .body_inputs = number % 4 < 2,
                                          .charted = number % 5 < 3};
    *d = (derived){0};
    kempe_status status = kmp_equations_derive_once(&d->eq, model, &scene);
    kmp_savings_free(&savings);
    if (status != KEMPE_OK)
        return false;
    derived_finish(d);
    return true;
}

/* -- both ways ----------------------------------------------------------------------------------------- */

static void check_both(int number, const kempe_model *model, int *charted)
{
    derived composite, forward;
    choice c;
    inputs in;
    choose_methods(&c, number);
    choose_inputs(&in);
    if (!derive(&composite, model, &c, KMP_TANGENT_COMPOSITE, number))
        return;
    CHECK(derive(&forward, model, &c, KMP_TANGENT_FORWARD, number));
    CHECK(composite.eq.savings.by_q == KMP_TANGENT_COMPOSITE && forward.eq.savings.by_qd == KMP_TANGENT_FORWARD);
    state s = random_state_vectors();
    eval(&composite, &in, &s);
    eval(&forward, &in, &s);
    int n = composite.n;
    check_close(number, "by q", distance(n * n, composite.inverse_q, forward.inverse_q), 1e-12);
    check_close(number, "by qd", distance(n * n, composite.inverse_qd, forward.inverse_qd), 1e-12);
    check_close(number, "closed, by q", distance(n * n, composite.closed_q, forward.closed_q), 1e-12);
    for (int i = 1; i < composite.eq.tree.count; i++)
        *charted += composite.eq.tree.links[i].before >= 0 || composite.eq.tree.links[i].after >= 0;
    derived_free(&composite);
    derived_free(&forward);
}

static random_model model_number(int k)
{
    return random_model_new((uint64_t)(1000 + k), 1 + k % 6, (unsigned)k % 16);
}

static void composite_as_forward(void)
{
    int charted = 0;
    for (int number = 0; number < MODELS; number++) {
        random_model r = model_number(number);
        CHECK(r.model != NULL);
        if (r.model)
            check_both(number, r.model, &charted);
        random_model_free(&r);
    }
    CHECK(charted > 2);
}

/* -- differences --------------------------------------------------------------------------------------- */

typedef struct varied {
    derived *d;
    const inputs *in;
    const state *at;
    bool rates, closed;
} varied;

static void efforts_field(void *user, const double *x, double *out)
{
    const varied *v = user;
    state s = *v->at;
    memcpy(v->rates ? s.qd : s.q, x, (size_t)v->d->n * sizeof *x);
    eval(v->d, v->in, &s);
    memcpy(out, v->closed ? v->d->closed : v->d->inverse, (size_t)v->d->n * sizeof *out);
}

static void check_columns(int number, const char *what, varied v, const double *matrix, double tolerance)
{
    int n = v.d->n;
    const double *at = v.rates ? v.at->qd : v.at->q;
    double *wanted = KMP_NEW(double, n *n), column[STATE_MAX];
    for (int k = 0; k < n; k++) {
        double along[STATE_MAX] = {0};
        along[k] = 1;
        difference(efforts_field, &v, n, at, along, n, column);
        for (int i = 0; i < n; i++)
            wanted[i * n + k] = column[i];
    }
    check_close(number, what, distance(n * n, matrix, wanted), tolerance);
    kmp_free(wanted);
}

static void power_field(void *user, const double *x, double *out)
{
    const varied *v = user;
    state s = *v->at;
    memcpy(v->rates ? s.qd : s.q, x, (size_t)v->d->n * sizeof *x);
    eval(v->d, v->in, &s);
    *out = *v->d->power;
}

/* The derivatives of the power: `slope` is the machine's. */
static void check_power(int number, const char *what, varied v, const double *slope, double tolerance)
{
    double own[STATE_MAX], wanted[STATE_MAX];
    const double *at = v.rates ? v.at->qd : v.at->q;
    memcpy(own, slope, (size_t)v.d->n * sizeof *own);
    for (int k = 0; k < v.d->n; k++) {
        double along[STATE_MAX] = {0};
        along[k] = 1;
        difference(power_field, &v, v.d->n, at, along, 1, &wanted[k]);
    }
    check_close(number, what, distance(v.d->n, own, wanted), tolerance);
}

/* A copy of n x n numbers of the machine, which another evaluation overwrites. */
static double *copy(int n, const double *matrix)
{
    double *own = KMP_NEW(double, n *n);
    memcpy(own, matrix, (size_t)(n * n) * sizeof *own);
    return own;
}

static void check_differences(int number, const kempe_model *model, double tolerance)
{
    derived d;
    choice c;
    inputs in;
    choose_methods(&c, number);
    choose_inputs(&in);
    if (!derive(&d, model, &c, KMP_TANGENT_COMPOSITE, number))
        return;
    state s = random_state_vectors();
    eval(&d, &in, &s);
    double *by_q = copy(d.n, d.inverse_q), *by_qd = copy(d.n, d.inverse_qd), *closed = copy(d.n, d.closed_q);
    check_columns(number, "by q", (varied){&d, &in, &s, false, false}, by_q, tolerance);
    check_columns(number, "by qd", (varied){&d, &in, &s, true, false}, by_qd, tolerance);
    check_columns(number, "closed, by q", (varied){&d, &in, &s, false, true}, closed, tolerance);
    eval(&d, &in, &s);
    check_power(number, "power, by q", (varied){&d, &in, &s, false, false}, d.power_q, tolerance);
    eval(&d, &in, &s);
    check_power(number, "power, by qd", (varied){&d, &in, &s, true, false}, d.power_qd, tolerance);
    kmp_free(by_q);
    kmp_free(by_qd);
    kmp_free(closed);
    derived_free(&d);
}

static void as_differences(void)
{
    for (int number = 0; number < MODELS; number += 5) {
        random_model r = model_number(number);
        if (r.model)
            check_differences(number, r.model, 1e-7);
        random_model_free(&r);
    }
}

/* Every kind of force, on a chain about parallel axes and beyond it. */
static const char forces[] =
    "kempe: 1\nname: forces\ngravity: [0, 1, -9.81]\nground: {points: {P: [1, 2, 0.5]}}\nbodies:\n"
    "  a: {joint: {revolute: z, at: ground}, mass: 1, com: [1, 2, 0.1], inertia: {xx: 1.5, yy: 2, zz: 2}, "
    "points: {P: [3, 1, 0.2]}}\n"
    "  b: {joint: {revolute: -z, at: a.P, armature: 0.4}, mass: 1, com: [1, 2, 0], inertia: {xx: 1.5, yy: 1, zz: 2}, "
    "points: {P: [3, 2, 0.3]}}\n"
    "  w: {joint: {weld: yes, at: b.P, frame: {x: y}}, mass: 1, com: [1, 0, 0], points: {P: [1, 0, 1]}}\n"
    "  c: {joint: {revolute: z, at: w.P}, mass: 1, com: [0, 2, 0], inertia: {xx: 2, yy: 1.5, zz: 2}, "
    "points: {P: [3, 2, 1]}}\n"
    "  d: {joint: {prismatic: [1, 1, 0], at: c.P}, mass: 1, com: [3, 2, 0], inertia: {zz: 2, xx: 2, yy: 1}, "
    "points: {P: [0.5, 0, 1]}}\n"
    "  e: {joint: {spherical: x, at: d.P}, mass: 2, com: [0, 1, 0.5], inertia: {xx: 1, yy: 1, zz: 1}, "
    "points: {P: [0.5, 0.1, 1]}}\n"
    "forces:\n"
    "  s: {spring: [ground.P, c.P], stiffness: 30, damping: 2, free_length: 0.5}\n"
    "  t: {spring: [a.P, e.P], stiffness: 20, damping: 1, free_length: 0.2}\n"
    "  k: {spring: [b.P, ground.P], stiffness: 10, damping: 1, free_length: 0.4}\n"
    "  j: {joint: b, spring: {stiffness: 3, damping: 0.2, rest: 0.4}}\n"
    "  l: {joint: d, stops: {lower: -0.1, upper: 0.2, stiffness: 50, damping: 2, width: 0.3}}\n"
    "  r: {joint: a, friction: {torque: 2, speed: 0.5}}\n"
    "  m: {joint: c, torque: \"sin(q(a))*qd(b)^2 - q(d)\"}\n"
    "  p: {at: c.P, force: [\"3 + q(a)*q(b)\", \"qd(a)*q(d)\", \"cos(t)*q(c)\"]}\n"
    "  q: {at: e.P, force: [\"3 + q(a)*q(b)\", \"qd(a)*q(d)\", \"cos(t)*q(c)\"]}\n"
    "  u: {on: b, torque: [\"q(a)\", \"qd(b)\", 2]}\n"
    "  v: {on: e, torque: [\"q(a)\", \"qd(b)\", 2]}\n";

static void every_force(void)
{
    kempe_context *context = kempe_context_new();
    kempe_model *model = NULL;
    CHECK(kempe_model_read_text(context, forces, "forces.yaml", &model) == KEMPE_OK);
    printf("%s", model ? "" : kempe_context_message(context));
    for (int number = 0; model && number < 12; number++) {
        int charted = 0;
        check_both(number, model, &charted);
        check_differences(number, model, 1e-6);
    }
    kempe_model_free(model);
    kempe_context_free(context);
}

/* -- formulations --------------------------------------------------------------------------------------------- */

/* A block of the formulation's tangents as a matrix. */
static void spread(const kmp_tangents *t, kmp_tangent_block block, const double *d, double *matrix)
{
    for (int k = 0; k < t->n * t->n; k++)
        matrix[k] = 0;
    for (int k = t->start[block]; k < t->start[block + 1]; k++)
        matrix[t->entry[k].row * t->n + t->entry[k].col] += d[t->entry[k].source];
}

static void check_formulation(int number, const kempe_system *system, int *composite)
{
    kmp_tangents t;
    derived d = {0};
    inputs in;
    const kmp_derivation_request scene = {.sets = SETS, .charted = true, .tangents = KMP_TANGENT_FORWARD};
    CHECK(kmp_equations_derive_once(&d.eq, system->model, &scene) == KEMPE_OK);
    derived_finish(&d);
    CHECK(kmp_tangents_init(&t, system, kmp_backend_find("tape"), 1u << KMP_VALUE_R) == KEMPE_OK);
    state s = random_state_vectors();
    choose_inputs(&in);
    eval(&d, &in, &s);
    const kmp_instant at = {s.t, s.q, s.qd, s.qdd, s.lambda, NULL, NULL, in.chart, 1, NULL};
    const double *out = kmp_tangents_derivatives(&t, &at);
    double *matrix = KMP_NEW(double, d.n *d.n);
    spread(&t, KMP_R_Q, out, matrix);
    check_close(number, "formulation, by q", distance(d.n * d.n, matrix, d.closed_q), 1e-12);
    spread(&t, KMP_R_QD, out, matrix);
    check_close(number, "formulation, by qd", distance(d.n * d.n, matrix, d.inverse_qd), 1e-12);
    *composite += t.choice.by_q == 0 && t.choice.by_qd == 0;
    kmp_free(matrix);
    kmp_tangents_free(&t);
    derived_free(&d);
}

static void formulations(void)
{
    int used = 0, composite = 0;
    for (int number = 0; number < MODELS; number += 3) {
        random_model r = model_number(number);
        kempe_system *system = NULL;
        if (r.model && kempe_system_new(r.model, &system) == KEMPE_OK) {
            check_formulation(number, system, &composite);
            used++;
        }
        kempe_system_free(system);
        random_model_free(&r);
    }
    printf("   %d of %d by composite bodies\n", composite, used);
    CHECK(4 * composite > used && composite < used);
}

int main(void)
{
    TEST(composite_as_forward);
    TEST(as_differences);
    TEST(every_force);
    TEST(formulations);
    return check_report();
}
