/* SPDX-License-Identifier: BSD-3-Clause */
/* The reduced equations linear in the independent coordinates: Mr, Gr and Kr against differences of R, with rates and
 * accelerations that are no equilibrium; what follows of a change against differences of the state; the pencil of one
 * choice of u against that of another. */
#include "analyses/derivatives/linearized.h"
#include "constraints/closing/assemble.h"
#include "loaded.h"
#include "random.h"
#include "testing.h"
#include <kempe/check.h>

enum { MOST = 64 };

/* R at (q + step along its u, ud, udd), and the state there. */
static bool residual_at(kmp_linear *l, const double *q, const double *change, double step, const double *ud,
                        const double *udd)
{
    double moved[MOST], rates[MOST], accelerations[MOST];
    memcpy(moved, q, (size_t)l->n * sizeof *q);
    for (int k = 0; k < l->p; k++) {
        moved[l->part.u[k]] += step * change[k];
        rates[k] = ud[k] + step * change[l->p + k];
        accelerations[k] = udd[k] + step * change[2 * l->p + k];
    }
    return kmp_linear_at(l, 0, moved, rates, accelerations) == KEMPE_OK;
}

typedef struct state {
    double q[MOST], qd[MOST], qdd[MOST], lambda[MOST], residual[MOST];
} state;

static void keep(const kmp_linear *l, state *s)
{
    memcpy(s->q, l->q, (size_t)l->n * sizeof(double));
    memcpy(s->qd, l->qd, (size_t)l->n * sizeof(double));
    memcpy(s->qdd, l->qdd, (size_t)l->n * sizeof(double));
    memcpy(s->lambda, l->lambda, (size_t)l->m * sizeof(double));
    memcpy(s->residual, l->residual, (size_t)l->p * sizeof(double));
}

/* Largest |(plus - minus)/(2 step) - exact| over the size of both. */
static double distance(int count, const double *plus, const double *minus, double step, const double *exact)
{
    double worst = 0, size = 1;
    for (int i = 0; i < count; i++) {
        size = check_max(size, fabs(exact[i]));
        worst = check_max(worst, fabs((plus[i] - minus[i]) / (2 * step) - exact[i]));
    }
    return worst / size;
}

/* One unit change, of all there are 3 p, by differences of best step and exactly. */
static void check_change(kmp_linear *l, const double *q, const double *ud, const double *udd, int k)
{
    double change[3 * MOST] = {0}, best = INFINITY;
    state exact, plus, minus;
    change[k] = 1;
    CHECK(kmp_linear_at(l, 0, q, ud, udd) == KEMPE_OK);
    kmp_linear_follow(l, &(kmp_change){.u = change, .ud = change + l->p, .udd = change + 2 * l->p},
                      &(kmp_response){exact.q, exact.qd, exact.qdd, exact.lambda, exact.residual});
    kmp_linear_matrices(l);
    const double *matrix[] = {l->stiffness, l->damping, l->mass};
    for (int i = 0; i < l->p; i++)
        CHECK(matrix[k / l->p][i + k % l->p * l->p] == exact.residual[i]);
    for (double step = 1e-4; step > 1e-8; step /= 10) {
        bool ok = residual_at(l, q, change, step, ud, udd);
        keep(l, &plus);
        ok = ok && residual_at(l, q, change, -step, ud, udd);
        keep(l, &minus);
        double worst = distance(l->n, plus.q, minus.q, step, exact.q);
        worst = check_max(worst, distance(l->n, plus.qd, minus.qd, step, exact.qd));
        worst = check_max(worst, distance(l->n, plus.qdd, minus.qdd, step, exact.qdd));
        worst = check_max(worst, distance(l->m, plus.lambda, minus.lambda, step, exact.lambda));
        worst = check_max(worst, distance(l->p, plus.residual, minus.residual, step, exact.residual));
        best = ok ? fmin(best, worst) : best;
    }
    CHECK(best < 1e-6);
}

static void against_differences(const char *path)
{
    loaded m = load(path);
    kempe_assembly *a = NULL;
    kmp_linear l;
    double ud[MOST], udd[MOST];
    CHECK(kempe_assembly_new(m.system, &a) == KEMPE_OK);
    CHECK(kmp_linear_init(&l, m.system, "tape") == KEMPE_OK);
    CHECK(kmp_linear_choose(&l, 0, a->q, NULL, 0) == KEMPE_OK);
    for (int k = 0; k < l.p; k++) {
        ud[k] = 0.3 - 0.2 * k;
        udd[k] = 0.7 + 0.1 * k;
    }
    for (int k = 0; k < 3 * l.p; k++)
        check_change(&l, a->q, ud, udd, k);
    kmp_linear_free(&l);
    kempe_assembly_free(a);
    unload(&m);
}

static void matrices_are_differences_of_the_residual(void)
{
    const char *const examples[] = {"four_bar", "stephenson", "andrews", "governor", "stewart", "suspension"};
    for (size_t k = 0; k < sizeof examples / sizeof *examples; k++) {
        char path[128];
        (void)snprintf(path, sizeof path, "examples/%s/%s.yaml", examples[k], examples[k]);
        against_differences(path);
    }
    against_differences("tests/models/bushings.yaml");
    against_differences("tests/models/measures.yaml");
    against_differences("tests/models/lines.yaml");
}

/* Forces that go with the load of their joints: C is a function of lambda, and lambda of C. */
static void so_they_are_where_forces_depend_on_multipliers(void)
{
    against_differences("tests/models/guide_friction.yaml");
    against_differences("tests/models/guide_friction_carrier.yaml");
}

/* det Mr = det (N' M N) changes with u by det^2 of what leads from one to the other, and so does det Kr where R = 0:
 * their ratio for one freedom does not. */
static void the_choice_of_u_does_not_matter(void)
{
    loaded m = load_text("kempe: 1\ngravity: [0, -9.81, 0]\n"
                         "ground: {points: {O: [0, 0, 0], D: [0.9, 0, 0]}}\n"
                         "bodies:\n"
                         "  a: {joint: {revolute: z, at: ground.O}, mass: 1, com: [0.15, 0, 0], inertia: {zz: 0.01}, "
                         "points: {B: [0.3, 0, 0]}}\n"
                         "  b: {joint: {revolute: z, at: a.B}, mass: 1, com: [0.4, 0, 0], inertia: {zz: 0.05}, "
                         "points: {C: [0.8, 0, 0]}}\n"
                         "  c: {joint: {revolute: z, at: ground.D}, mass: 1, com: [0.35, 0, 0], inertia: {zz: 0.04}, "
                         "points: {C: [0.7, 0, 0]}}\n"
                         "loops: {C: {ball: [b.C, c.C]}}\n"
                         "forces: {k: {joint: a, spring: {stiffness: 3, rest: 1}}, t: {joint: c, torque: -2}}\n"
                         "start: {q: {a: 90 deg, b: -62 deg, c: 106 deg}, hold: [a]}\n");
    kempe_assembly *a = NULL;
    kmp_linear l;
    double first[2] = {0};
    CHECK(kempe_assembly_new(m.system, &a) == KEMPE_OK);
    CHECK(kmp_linear_init(&l, m.system, "native") == KEMPE_OK);
    /* an equilibrium: Newton on the first choice */
    CHECK(kmp_linear_choose(&l, 0, a->q, NULL, 0) == KEMPE_OK);
    double q[MOST];
    memcpy(q, a->q, 3 * sizeof *q);
    for (int k = 0; k < 30; k++) {
        CHECK(kmp_linear_at(&l, 0, q, NULL, NULL) == KEMPE_OK);
        kmp_linear_matrices(&l);
        memcpy(q, l.q, 3 * sizeof *q);
        q[l.part.u[0]] -= fmax(-0.1, fmin(0.1, l.residual[0] / fabs(l.stiffness[0])));
    }
    CHECK(fabs(l.residual[0]) < 1e-13);
    memcpy(q, l.q, 3 * sizeof *q);
    for (int u = 0; u < 3; u++) {
        CHECK(kmp_linear_choose(&l, 0, q, &u, 1) == KEMPE_OK && l.part.u[0] == u);
        CHECK(kmp_linear_at(&l, 0, q, NULL, NULL) == KEMPE_OK);
        kmp_linear_matrices(&l);
        double ratio = l.stiffness[0] / l.mass[0];
        first[0] = u == 0 ? ratio : first[0];
        CHECK_NEAR(ratio / first[0], 1, 1e-11);
        CHECK(fabs(l.damping[0]) <= 1e-14 * l.mass[0]);
    }
    kmp_linear_free(&l);
    kempe_assembly_free(a);
    unload(&m);
}

/* Any weights on what follows of any change, and what they are as weights on the change. */
static void backwards_is_the_transpose(void)
{
    static const char *const examples[] = {"four_bar", "andrews", "stewart", "suspension", "double_wishbone"};
    random_seed(3);
    for (size_t e = 0; e < sizeof examples / sizeof *examples; e++) {
        char path[128];
        (void)snprintf(path, sizeof path, "examples/%s/%s.yaml", examples[e], examples[e]);
        loaded m = load(path);
        kempe_assembly *a = NULL;
        kmp_linear l;
        double x[7][MOST], y[5][MOST], w[5][MOST], back[7][MOST], left = 0, right = 0;
        CHECK(kempe_assembly_new(m.system, &a) == KEMPE_OK);
        CHECK(kmp_linear_init(&l, m.system, "tape") == KEMPE_OK);
        CHECK(kmp_linear_choose(&l, 0, a->q, NULL, 0) == KEMPE_OK);
        for (int i = 0; i < 7 * MOST; i++)
            x[i / MOST][i % MOST] = between(-1, 1);
        for (int i = 0; i < 5 * MOST; i++)
            w[i / MOST][i % MOST] = between(-1, 1);
        CHECK(kmp_linear_at_motion(&l, 0, a->q, x[0]) == KEMPE_OK);
        kmp_linear_follow(&l, &(kmp_change){x[0], x[1], x[2], x[3], x[4], x[5], x[6]},
                          &(kmp_response){y[0], y[1], y[2], y[3], y[4]});
        kmp_linear_back(&l, &(kmp_weights){w[0], w[1], w[2], w[3], w[4]},
                        &(kmp_changes_weight){back[0], back[1], back[2], back[3], back[4], back[5], back[6]});
        const int rows[] = {l.n, l.n, l.n, l.m, l.p}, size[] = {l.p, l.p, l.p, l.m, l.m, l.m, l.n};
        for (int k = 0; k < 5; k++)
            for (int i = 0; i < rows[k]; i++)
                left += w[k][i] * y[k][i];
        for (int k = 0; k < 7; k++)
            for (int i = 0; i < size[k]; i++)
                right += back[k][i] * x[k][i];
        CHECK_NEAR(left / right, 1, 1e-11);
        double udd[MOST];
        kmp_linear_accelerate(&l, y[4], udd);
        kmp_linear_follow(&l, &(kmp_change){.udd = udd}, &(kmp_response){.residual = w[0]});
        for (int i = 0; i < l.p; i++)
            CHECK_NEAR(w[0][i], -y[4][i], 1e-9 * fmax(1, fabs(y[4][i])));
        kmp_linear_free(&l);
        kempe_assembly_free(a);
        unload(&m);
    }
}

int main(void)
{
    TEST(matrices_are_differences_of_the_residual);
    TEST(so_they_are_where_forces_depend_on_multipliers);
    TEST(the_choice_of_u_does_not_matter);
    TEST(backwards_is_the_transpose);
    return check_report();
}
