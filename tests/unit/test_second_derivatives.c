/* SPDX-License-Identifier: BSD-3-Clause */
/* Second derivatives of the equations along two directions, state and parameters, against differences of the first
 * ones, with a sweep of steps; on examples with loops in the plane and in space, and on a model whose parameters follow
 * from others. */
#include "analyses/derivatives/parameter_slopes.h"
#include "constraints/evaluation/few_tangents.h"
#include "constraints/evaluation/tangent.h"
#include "loaded.h"
#include "model/data/parameter.h"
#include "model/data/variant.h"
#include "random.h"

enum { MOST = 64, MOST_OUT = 4 * MOST };

typedef struct rig {
    loaded m;
    kmp_variant *variant;
    kempe_system *system;
    kmp_tangents tangents;
    kmp_second_derivatives bend;
    int count;
    const char *names[MOST];
    double values[MOST];
} rig;

static void open_rig(rig *r, loaded m)
{
    *r = (rig){.m = m};
    for (int k = 0; k < kmp_model_parameter_count(m.model) && r->count < MOST; k++)
        if (!kmp_model_parameter(m.model, k)->number.expr && !kmp_model_parameter(m.model, k)->fixed) {
            r->names[r->count] = kmp_model_parameter(m.model, k)->name;
            r->values[r->count++] = kmp_model_parameter(m.model, k)->number.value;
        }
    const kmp_backend *backend = kmp_backend_find("tape");
    CHECK(kmp_variant_new(m.model, r->count, r->names, &r->variant) == KEMPE_OK);
    CHECK(kempe_system_new(kmp_variant_model(r->variant), &r->system) == KEMPE_OK);
    CHECK(kmp_tangents_init(&r->tangents, r->system, backend,
                            1u << KMP_VALUE_R | 1u << KMP_VALUE_RATE | 1u << KMP_VALUE_CURVE) == KEMPE_OK);
    CHECK(kmp_second_derivatives_init(&r->bend, r->system, backend, r->count, r->names) == KEMPE_OK);
}

static void close_rig(rig *r)
{
    kmp_second_derivatives_free(&r->bend);
    kmp_tangents_free(&r->tangents);
    kempe_system_free(r->system);
    kmp_variant_free(r->variant);
    unload(&r->m);
}

typedef struct point {
    double q[MOST], qd[MOST], qdd[MOST], lambda[MOST], parameter[MOST], mode[MOST], chart[9 * MOST];
} point;

static void fill(int count, double size, double *x)
{
    for (int k = 0; k < count; k++)
        x[k] = between(-size, size);
}

static kmp_instant instant(const point *x)
{
    return (kmp_instant){0.3, x->q, x->qd, x->qdd, x->lambda, NULL, x->mode, x->chart, 0, NULL};
}

/* The first derivatives along a: of R, h, rate and curve. */
static void first(rig *r, const point *x, const point *a, double *out)
{
    int n = r->tangents.n, m = r->tangents.m;
    kmp_text why = {0};
    CHECK(kmp_variant_set(r->variant, x->parameter, &why) == KEMPE_OK && kmp_system_rescale(r->system));
    kmp_text_free(&why);
    kmp_tangents_renew_parameters(&r->tangents, r->system->parameters);
    kmp_instant at = instant(x);
    const kmp_tangents *t = &r->tangents;
    const double *d = kmp_tangents_derivatives(&r->tangents, &at);
    double *h = out + n, *rate = h + m, *curve = rate + m;
    memset(out, 0, (size_t)(n + 3 * m) * sizeof *out);
    kmp_tangents_add(t, KMP_R_Q, d, 1, a->q, out);
    kmp_tangents_add(t, KMP_R_QD, d, 1, a->qd, out);
    kmp_tangents_add(t, KMP_M, d, 1, a->qdd, out);
    for (int e = t->start[KMP_J]; e < t->start[KMP_J + 1]; e++)
        out[t->entry[e].col] -= d[t->entry[e].source] * a->lambda[t->entry[e].row];
    kmp_tangents_add(t, KMP_J, d, 1, a->q, h);
    kmp_tangents_add(t, KMP_RATE_Q, d, 1, a->q, rate);
    kmp_tangents_add(t, KMP_J, d, 1, a->qd, rate);
    kmp_tangents_add(t, KMP_CURVE_Q, d, 1, a->q, curve);
    kmp_tangents_add(t, KMP_CURVE_QD, d, 1, a->qd, curve);
    kmp_tangents_add(t, KMP_J, d, 1, a->qdd, curve);
}

static point moved(const point *x, const point *b, double step)
{
    point y = *x;
    for (int k = 0; k < MOST; k++) {
        y.q[k] += step * b->q[k];
        y.qd[k] += step * b->qd[k];
        y.qdd[k] += step * b->qdd[k];
        y.lambda[k] += step * b->lambda[k];
        y.parameter[k] += step * b->parameter[k];
    }
    return y;
}

static double deviation(rig *r, const point *x, const point *a, const point *b, const double *exact)
{
    static double plus[MOST_OUT], minus[MOST_OUT];
    int count = r->tangents.n + 3 * r->tangents.m;
    double best = INFINITY;
    for (double step = 1e-3; step > 1e-7; step /= 10) {
        double worst = 0, size = 1e-300;
        point up = moved(x, b, step), down = moved(x, b, -step);
        first(r, &up, a, plus);
        first(r, &down, a, minus);
        for (int i = 0; i < count; i++) {
            size = check_max(size, fabs(exact[i]));
            worst = check_max(worst, fabs((plus[i] - minus[i]) / (2 * step) - exact[i]));
        }
        best = fmin(best, worst / size);
    }
    return best;
}

static void check_rig(rig *r)
{
    static point x, a, b;
    double exact[MOST_OUT];
    int n = r->system->n, m = r->system->m;
    point *direction[] = {&a, &b};
    for (int c = 0; c < r->system->chart_count; c++)
        for (int i = 0; i < 3; i++)
            x.chart[9 * c + 4 * i] = 1;
    fill(n, 0.7, x.q);
    fill(n, 2, x.qd);
    fill(n, 3, x.qdd);
    fill(m, 4, x.lambda);
    memcpy(x.parameter, r->values, sizeof r->values);
    for (int k = 0; k < 2; k++) {
        fill(n, 1, direction[k]->q);
        fill(n, 1, direction[k]->qd);
        fill(n, 1, direction[k]->qdd);
        fill(m, 1, direction[k]->lambda);
    }
    for (int k = 0; k < r->count; k++)
        b.parameter[k] = r->values[k] * between(0.1, 1);
    kmp_formulas_renew(&r->bend.bent, r->system->parameters);
    kmp_instant at = instant(&x);
    kmp_formulas_place(&r->bend.bent, &at);
    kmp_second_values bent = kmp_second_derivatives_along(&r->bend, &(kmp_variation){a.q, a.qd, a.qdd, a.lambda},
                                                          &(kmp_variation){b.q, b.qd, b.qdd, b.lambda}, b.parameter);
    memcpy(exact, bent.force, (size_t)n * sizeof *exact);
    memcpy(exact + n, bent.h, (size_t)m * sizeof *exact);
    memcpy(exact + n + m, bent.rate, (size_t)m * sizeof *exact);
    memcpy(exact + n + 2 * m, bent.curve, (size_t)m * sizeof *exact);
    double off = deviation(r, &x, &a, &b, exact);
    CHECK(off < 1e-8);
    if (!(off < 1e-8))
        printf("off by %.3g\n", off);
}

static void of_examples(void)
{
    const char *const names[] = {"four_bar", "stephenson", "andrews", "governor", "stewart", "suspension"};
    for (size_t k = 0; k < sizeof names / sizeof *names; k++) {
        char path[128];
        (void)snprintf(path, sizeof path, "examples/%s/%s.yaml", names[k], names[k]);
        rig r;
        open_rig(&r, load(path));
        check_rig(&r);
        close_rig(&r);
    }
    rig r;
    open_rig(&r, load("tests/models/lines.yaml"));
    check_rig(&r);
    close_rig(&r);
}

static void of_parameters_that_follow(void)
{
    rig r;
    open_rig(&r, load_text("kempe: 1\nparameters: {a: 0.3, rho: 4, m: rho*a, third: m*a^2/12, k: 3*sqrt(a)}\n"
                           "bodies:\n"
                           "  A: {joint: {revolute: y, at: ground}, mass: m, com: [a/2, 0, 0], inertia: {yy: third}, "
                           "points: {P: [a, 0, 0]}}\n"
                           "  B: {joint: {revolute: y, at: A.P}, mass: 1, com: [a, 0, a^2], inertia: {yy: 0.1}}\n"
                           "forces: {k: {joint: B, spring: {stiffness: k, rest: a}}, "
                           "t: {joint: A, torque: 'a^3*sin(q(A))*qd(B)'}}\n"
                           "start: {q: {A: 0.1}}\n"));
    CHECK(r.count == 2);
    check_rig(&r);
    close_rig(&r);
}

static void what_is_refused(void)
{
    loaded m = load("examples/four_bar/four_bar.yaml");
    kmp_second_derivatives bend;
    const char *name = "nothing";
    CHECK(kmp_second_derivatives_init(&bend, m.system, kmp_backend_find("tape"), 1, &name) == KEMPE_E_ARGUMENT);
    CHECK(strstr(kempe_context_message(m.context), "'nothing'"));
    unload(&m);
}

int main(void)
{
    TEST(of_examples);
    TEST(of_parameters_that_follow);
    TEST(what_is_refused);
    return check_report();
}
