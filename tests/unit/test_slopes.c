/* SPDX-License-Identifier: BSD-3-Clause */
/* Derivatives by parameters of h, its rate and curve, of M qdd + C - J' lambda and of the outputs, against differences
 * of the numbers that a run works with, of the best step; those of the outputs by the state likewise; what follows from
 * a parameter, what stands for itself. */
#include "analyses/derivatives/parameter_slopes.h"
#include "constraints/evaluation/evaluator.h"
#include "loaded.h"
#include "model/data/parameter.h"
#include "model/data/start.h"
#include "model/data/variant.h"
#include "random.h"
#include "testing.h"

enum { MOST = 64, MOST_NUMBERS = 600 };

typedef struct fixture {
    kempe_context *context;
    kempe_model *model;
    kmp_variant *variant;
    kempe_system *system;
    kmp_evaluator *eval;
    kmp_slopes *slopes;
    kmp_slopes_sum sum;
    int count;
    const char *names[MOST];
    double values[MOST];
} fixture;

static double value_of(const kempe_model *m, const char *name)
{
    for (int k = 0; k < kmp_model_parameter_count(m); k++)
        if (strcmp(kmp_model_parameter(m, k)->name, name) == 0)
            return kmp_model_parameter(m, k)->number.value;
    return 0;
}

/* All parameters that may vary and are plain numbers, and those named. */
static void choose_names(fixture *f, int more, const char *const *names)
{
    for (int k = 0; k < kmp_model_parameter_count(f->model) && f->count < MOST - more; k++)
        if (!kmp_model_parameter(f->model, k)->number.expr && !kmp_model_parameter(f->model, k)->fixed)
            f->names[f->count++] = kmp_model_parameter(f->model, k)->name;
    for (int k = 0; k < more; k++)
        f->names[f->count++] = names[k];
}

static fixture open_fixture(const char *path, const char *text, int more, const char *const *names)
{
    fixture f = {.context = kempe_context_new()};
    char full[1024];
    (void)snprintf(full, sizeof full, "%s/%s", KEMPE_ROOT, path ? path : "");
    kempe_status status = path ? kempe_model_read(f.context, full, &f.model)
                               : kempe_model_read_text(f.context, text, "model.yaml", &f.model);
    CHECK(status == KEMPE_OK);
    if (status != KEMPE_OK) {
        printf("%s\n", kempe_context_message(f.context));
        return f;
    }
    choose_names(&f, more, names);
    CHECK(kmp_variant_new(f.model, f.count, f.names, &f.variant) == KEMPE_OK);
    const kempe_model *m = kmp_variant_model(f.variant);
    for (int k = 0; k < f.count; k++)
        f.values[k] = value_of(m, f.names[k]);
    CHECK(kempe_system_new(m, &f.system) == KEMPE_OK);
    f.eval = kmp_eval_new(f.system, "tape");
    CHECK(kmp_slopes_new(f.system, "tape", f.count, f.names, true, &f.slopes) == KEMPE_OK);
    CHECK(kmp_slopes_sum_init(&f.sum, f.system, kmp_backend_find("tape"), f.count, f.names) == KEMPE_OK);
    return f;
}

static void close_fixture(fixture *f)
{
    kmp_slopes_sum_free(&f->sum);
    kmp_slopes_free(f->slopes);
    kmp_eval_free(f->eval);
    kempe_system_free(f->system);
    kmp_variant_free(f->variant);
    kempe_model_free(f->model);
    kempe_context_free(f->context);
}

typedef struct point {
    double t, q[MOST], qd[MOST], qdd[MOST], lambda[MOST];
} point;

/* h, rate, curve, force, the outputs and the conditions, as the evaluator has them. */
static void numbers_at(fixture *f, const point *x, double *out)
{
    static double jacobian[MOST * MOST], mass[MOST * MOST];
    kmp_evaluator *p = f->eval;
    int n = p->n, m = p->m;
    kmp_eval_closure(p, x->t, x->q);
    kmp_eval_mass(p);
    kmp_eval_bias(p, x->qd);
    kmp_eval_dense_jacobian(p, jacobian);
    kmp_eval_dense_mass(p, mass);
    memcpy(out, p->h, (size_t)m * sizeof *out);
    kmp_eval_rates(p, x->qd, out + m);
    for (int i = 0; i < m; i++) {
        out[2 * m + i] = p->jdqd[i];
        for (int k = 0; k < n; k++)
            out[2 * m + i] += jacobian[i + k * m] * x->qdd[k];
    }
    for (int i = 0; i < n; i++) {
        double sum = p->bias[i];
        for (int k = 0; k < n; k++)
            sum += mass[i + k * n] * x->qdd[k];
        for (int r = 0; r < m; r++)
            sum -= jacobian[r + i * m] * x->lambda[r];
        out[3 * m + i] = sum;
    }
    const double *shown = kmp_eval_shown(p, x->t, x->q, x->qd, x->qdd, x->lambda);
    memcpy(out + 3 * m + n, shown, (size_t)f->slopes->shown * sizeof *out);
    const double *changes = kmp_eval_changes(p, x->t, x->q, x->qd);
    for (int k = 0; k < f->system->events.count; k++)
        out[3 * m + n + f->slopes->shown + k] = changes[k];
}

static bool set_parameters(fixture *f, int k, double change)
{
    double values[MOST];
    kmp_text why = {0};
    memcpy(values, f->values, sizeof values);
    if (k >= 0)
        values[k] += change;
    bool ok = kmp_variant_set(f->variant, values, &why) == KEMPE_OK && kmp_system_rescale(f->system);
    kmp_text_free(&why);
    kmp_eval_renew_parameters(f->eval);
    kmp_slopes_renew_parameters(f->slopes);
    return ok;
}

/* Largest |difference - exact| beside the largest of either. */
static double distance(int count, const double *plus, const double *minus, double step, const double *exact)
{
    double worst = 0, size = 1e-12;
    for (int i = 0; i < count; i++) {
        size = check_max(size, fmax(fabs(exact[i]), 0.01 * fmax(fabs(plus[i]), fabs(minus[i]))));
        worst = check_max(worst, fabs((plus[i] - minus[i]) / (2 * step) - exact[i]));
    }
    return worst / size;
}

static kmp_instant instant_of(const fixture *f, const point *x)
{
    const kmp_evaluator *p = f->eval;
    return (kmp_instant){x->t, x->q, x->qd, x->qdd, x->lambda, NULL, p->conditions.mode, p->chart, p->chart_version,
                         NULL};
}

/* One parameter by differences of best step and exactly. */
static void check_parameter(fixture *f, const point *x, int k)
{
    static double plus[MOST_NUMBERS], minus[MOST_NUMBERS], exact[MOST_NUMBERS];
    int n = f->eval->n, m = f->eval->m, equations = 3 * m + n,
        all = equations + f->slopes->shown + f->system->events.count;
    CHECK(all <= MOST_NUMBERS);
    CHECK(set_parameters(f, -1, 0));
    kmp_instant at = instant_of(f, x);
    kmp_slopes_at(f->slopes, &at);
    (void)kmp_slopes_values(&f->slopes->outputs, &at);
    (void)kmp_slopes_change(f->slopes, k, exact);
    double best = INFINITY, best_shown = INFINITY, size = fmax(fabs(f->values[k]), 0.01);
    kmp_slopes_along(f->slopes, &f->slopes->outputs, &(kmp_direction){0}, k, exact + equations);
    if (f->system->events.count > 0) {
        (void)kmp_slopes_values(&f->slopes->events, &at);
        kmp_slopes_along(f->slopes, &f->slopes->events, &(kmp_direction){0}, k, exact + equations + f->slopes->shown);
    }
    for (double step = 1e-2 * size; step > 1e-8 * size; step /= 10) {
        if (!set_parameters(f, k, step))
            continue;
        numbers_at(f, x, plus);
        if (!set_parameters(f, k, -step))
            continue;
        numbers_at(f, x, minus);
        best = fmin(best, distance(equations, plus, minus, step, exact));
        best_shown =
            fmin(best_shown, distance(all - equations, plus + equations, minus + equations, step, exact + equations));
    }
    if (!(best < 1e-8 && best_shown < 1e-8))
        printf("  %s: %.2g, outputs %.2g\n", f->names[k], best, best_shown);
    CHECK(best < 1e-8);
    CHECK(best_shown < 1e-8);
    CHECK(set_parameters(f, -1, 0));
}

/* The outputs along a direction of the state. */
static void check_state(fixture *f, const point *x)
{
    static double plus[MOST_NUMBERS], minus[MOST_NUMBERS], exact[MOST_NUMBERS];
    point d = {.t = 1};
    int n = f->eval->n, m = f->eval->m, equations = 3 * m + n;
    for (int i = 0; i < n; i++) {
        d.q[i] = between(-1, 1);
        d.qd[i] = between(-1, 1);
        d.qdd[i] = between(-1, 1);
    }
    for (int i = 0; i < m; i++)
        d.lambda[i] = between(-1, 1);
    kmp_instant at = instant_of(f, x);
    (void)kmp_slopes_values(&f->slopes->outputs, &at);
    int shown = f->slopes->shown, events = f->system->events.count;
    kmp_slopes_along(f->slopes, &f->slopes->outputs, &(kmp_direction){&d.t, d.q, d.qd, d.qdd, d.lambda, NULL}, -1,
                     exact);
    if (events > 0) {
        (void)kmp_slopes_values(&f->slopes->events, &at);
        kmp_slopes_along(f->slopes, &f->slopes->events, &(kmp_direction){&d.t, d.q, d.qd, NULL, NULL, NULL}, -1,
                         exact + shown);
    }
    double best = INFINITY;
    for (double step = 1e-3; step > 1e-8; step /= 10) {
        for (int side = -1; side < 2; side += 2) {
            point moved = *x;
            moved.t += side * step;
            for (int i = 0; i < n; i++) {
                moved.q[i] += side * step * d.q[i];
                moved.qd[i] += side * step * d.qd[i];
                moved.qdd[i] += side * step * d.qdd[i];
            }
            for (int i = 0; i < m; i++)
                moved.lambda[i] += side * step * d.lambda[i];
            numbers_at(f, &moved, side < 0 ? minus : plus);
        }
        best = fmin(best, distance(shown + events, plus + equations, minus + equations, step, exact));
    }
    CHECK(best < 1e-8);
}

/* w' (what follows along d) = (what w asks of each part)' d. */
static void check_gradients(fixture *f, const point *x)
{
    int n = f->eval->n, m = f->eval->m, shown = f->slopes->shown, count = f->count;
    static double w[MOST_NUMBERS], along[MOST_NUMBERS], by[MOST_NUMBERS], h[4 * MOST], sums[MOST], back[MOST];
    point d = {.t = between(-1, 1)}, g = {0};
    double change[MOST], gradient[MOST] = {0}, left = 0, right = 0;
    for (int i = 0; i < n; i++)
        d.q[i] = between(-1, 1), d.qd[i] = between(-1, 1), d.qdd[i] = between(-1, 1);
    for (int i = 0; i < m; i++)
        d.lambda[i] = between(-1, 1);
    for (int i = 0; i < count; i++)
        change[i] = between(-1, 1);
    for (int i = 0; i < MOST_NUMBERS; i++)
        w[i] = between(-1, 1);
    kmp_instant at = instant_of(f, x);
    (void)kmp_slopes_values(&f->slopes->outputs, &at);
    kmp_slopes_along(f->slopes, &f->slopes->outputs, &(kmp_direction){&d.t, d.q, d.qd, d.qdd, d.lambda, NULL}, -1,
                     along);
    for (int k = 0; k < count; k++) {
        kmp_slopes_along(f->slopes, &f->slopes->outputs, &(kmp_direction){0}, k, by);
        for (int i = 0; i < shown; i++)
            along[i] += change[k] * by[i];
    }
    kmp_slopes_gradient(f->slopes, &f->slopes->outputs, w,
                        &(kmp_direction){&g.t, g.q, g.qd, g.qdd, g.lambda, gradient});
    for (int i = 0; i < shown; i++)
        left += w[i] * along[i];
    right = g.t * d.t;
    for (int i = 0; i < n; i++)
        right += g.q[i] * d.q[i] + g.qd[i] * d.qd[i] + g.qdd[i] * d.qdd[i];
    for (int i = 0; i < m; i++)
        right += g.lambda[i] * d.lambda[i];
    for (int i = 0; i < count; i++)
        right += gradient[i] * change[i];
    CHECK_NEAR(left, right, 1e-11);
    kmp_slopes_at(f->slopes, &at);
    memset(sums, 0, sizeof sums);
    kmp_slopes_weighted(f->slopes, w, w + m, w + 2 * m, w + 3 * m, sums);
    for (int k = 0; k < count; k++) {
        (void)kmp_slopes_change(f->slopes, k, h);
        double sum = 0;
        for (int i = 0; i < 3 * m + n; i++)
            sum += w[i] * h[i];
        CHECK_NEAR(sums[k], sum, 1e-12);
    }
    kmp_formulas_renew(&f->sum.formulas, f->system->parameters);
    memcpy(f->sum.weight, w, (size_t)(3 * m + n) * sizeof *w);
    const double *of_sum = kmp_slopes_sum_at(&f->sum, &at);
    memset(back, 0, sizeof back);
    for (int k = 0; k < f->sum.count; k++)
        back[f->sum.parameter[k]] = of_sum[k];
    for (int k = 0; k < count; k++) { /* terms of other sizes may cancel */
        (void)kmp_slopes_change(f->slopes, k, h);
        double size = 1;
        for (int i = 0; i < 3 * m + n; i++)
            size += fabs(w[i] * h[i]);
        CHECK_NEAR(back[k] / size, sums[k] / size, 1e-12);
    }
}

static void check_all(fixture *f)
{
    point x = {.t = 0.3};
    const kempe_model *m = kmp_variant_model(f->variant);
    for (int i = 0; i < f->eval->n; i++) {
        x.q[i] = kmp_model_start(m)->q[i].value + 0.1 * between(-1, 1);
        x.qd[i] = between(-1, 1);
        x.qdd[i] = between(-1, 1);
    }
    for (int i = 0; i < f->eval->m; i++)
        x.lambda[i] = between(-1, 1);
    kmp_eval_freeze(f->eval, x.t, x.q, x.qd);
    for (int k = 0; k < f->count; k++)
        check_parameter(f, &x, k);
    check_state(f, &x);
    check_gradients(f, &x);
}

static void test_examples(void)
{
    static const char *const examples[] = {"four_bar", "slider_crank", "stephenson", "governor",           "bennett",
                                           "stewart",  "suspension",   "jansen_leg", "driven_slider_crank"};
    random_seed(11);
    for (size_t k = 0; k < sizeof examples / sizeof *examples; k++) {
        char path[128];
        int before = check_failures;
        (void)snprintf(path, sizeof path, "examples/%s/%s.yaml", examples[k], examples[k]);
        fixture f = open_fixture(path, NULL, 0, NULL);
        CHECK(f.count > 0);
        check_all(&f);
        close_fixture(&f);
        if (check_failures > before)
            printf("  in %s\n", examples[k]);
    }
}

/* Every place that takes a number, conditions, a lock and a coupler at start values, all outputs; of the parameters
 * `twice` and `area` follow from others, and `half`, named, stands for itself. */
static const char everywhere[] =
    "kempe: 1\nname: everywhere\ngravity: [0, -g, gx]\n"
    "parameters: {g: 9.81, gx: 0, l: 0.5, w: 0, m: 2, j: 0.1, k: 30, d: 0.3, s: 0.4, e: 3, f: 0, p: 0.01, q0: 0.3,\n"
    "             u0: 0.7, r: 0.45, area: twice^2, half: l/2, twice: half*4 + l, lo: -1, hi: 1, rho: 3}\n"
    "ground: {points: {O: [0, w, 0], S: [2*l, 0, w]}}\n"
    "bodies:\n"
    "  a: {joint: {name: a, revolute: z, at: ground.O}, mass: m + area*rho, com: [half, w, 0],\n"
    "      inertia: {zz: j*l^2, xx: j}, points: {E: [l, w, 0]}}\n"
    "  b: {joint: {name: b, revolute: z, at: a.E}, mass: m/2, com: [twice/4, 0, 0], inertia: {zz: j},\n"
    "      points: {E: [l, 0, 0]}}\n"
    "  c: {joint: {name: c, prismatic: x, at: ground.S}, mass: 1, points: {P: [0, 0, f]}}\n"
    "  d: {joint: {name: d, screw: z, pitch: p, at: ground.O}, mass: 1, inertia: {zz: j}}\n"
    "  s: {joint: {name: s, spherical: x, at: b.E}, mass: m, com: [w, l, 0.1], inertia: {xx: j, yy: 2*j, zz: j},\n"
    "      points: {P: [l, w, half]}}\n"
    "  u: {joint: {name: u, prismatic: y, at: ground.O}, mass: j}\n"
    "loops:\n  r: {rod: [b.E, c.P], length: r}\n  t: {coupler: {d.1: 1, a: s/2}, equals: q0/9}\n"
    "  v: {coupler: {u: 1, c: s}}\n"
    "drives: {b: {joint: b, locked: yes}}\n"
    "tables: {law: {x: [0, 1, 2, 4], y: [0, 2, 1, 3]}}\n"
    "sensors: {mix: q(a)*k + law(q(c)*s) - qd(b)*t*l}\n"
    "forces:\n"
    "  k: {spring: [a.E, c.P], stiffness: k, damping: d, free_length: s}\n"
    "  j: {joint: c, spring: {stiffness: k*2, damping: f, rest: w}}\n"
    "  s: {joint: b, stops: {lower: lo, upper: hi, stiffness: k, damping: d, width: s}}\n"
    "  e: {joint: a, torque: \"k*(q(a)*q(a) + s)^e + if(qd(a) < d, d*qd(a)*f + law(s*q(c)), m)\"}\n"
    "start: {q: {a: q0 + rho*w, b: 0.1}, qd: {a: u0}}\n"
    "run: {t_end: 1, outputs: [energy, reaction(r), position(s.P), velocity(s.P), acceleration(s.P), sensor(mix),\n"
    "      force(k), force(e), q]}\n";

/* Derivatives of start value and rate of one coordinate by a parameter. */
static void check_start(fixture *f, const char *name, int motion, double by_q, double by_qd)
{
    double q[MOST], qd[MOST];
    point x = {0};
    kmp_instant at = instant_of(f, &x);
    kmp_slopes_at(f->slopes, &at);
    for (int k = 0; k < f->count; k++)
        if (strcmp(f->names[k], name) == 0) {
            kmp_slopes_of_start(f->slopes, k, q, qd);
            CHECK(q[motion] == by_q && qd[motion] == by_qd);
        }
}

static void test_every_place(void)
{
    random_seed(12);
    fixture f = open_fixture(NULL, everywhere, 4, (const char *const[]){"half", "q.b", "q.u", "qd.c"});
    CHECK(f.slopes && f.slopes->shown == 3 + 3 + 9 + 3);
    check_start(&f, "q0", 0, 1, 0);
    check_start(&f, "u0", 0, 0, 1);
    check_start(&f, "q.b", 1, 1, 0);
    check_start(&f, "qd.c", 2, 0, 1);
    if (f.slopes)
        check_all(&f);
    close_fixture(&f);
}

static void test_refusals(void)
{
    loaded l = load_text("kempe: 1\nname: pendulum\nparameters: {m: 1}\nbodies:\n"
                         "  a: {joint: {revolute: z, at: ground}, mass: m, com: [1, 0, 0], inertia: {zz: 0.1}}\n"
                         "run: {t_end: 1, outputs: [energy]}\n");
    kmp_slopes *s = NULL;
    CHECK(kmp_slopes_new(l.system, "tape", 1, (const char *const[]){"m"}, true, &s) == KEMPE_E_ARGUMENT && !s);
    CHECK_TEXT(kempe_context_message(l.context), "parameter 'm' is not a variable parameter of the equations");
    CHECK(kmp_slopes_new(l.system, "none", 0, NULL, true, &s) == KEMPE_E_ARGUMENT && !s);
    CHECK(kmp_slopes_new(l.system, "native", 0, NULL, true, &s) == KEMPE_OK && s && s->shown == 3);
    double q = 0.5, qd = 2, qdd = 0, along[3], one = 1;
    kmp_instant at = {.q = &q, .qd = &qd, .qdd = &qdd};
    CHECK_NEAR(kmp_slopes_values(&s->outputs, &at)[0], 0.5 * 1.1 * 4, 1e-15);
    kmp_slopes_along(s, &s->outputs, &(kmp_direction){.qd = &one}, -1, along);
    CHECK_NEAR(along[0], 1.1 * 2, 1e-15);
    kmp_slopes_free(s);
    unload(&l);
}

int main(void)
{
    TEST(test_examples);
    TEST(test_every_place);
    TEST(test_refusals);
    return check_report();
}
