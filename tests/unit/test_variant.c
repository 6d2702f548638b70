/* SPDX-License-Identifier: BSD-3-Clause */
/* A system that keeps parameters open against models read with their values: the numbers of the equations at any state,
 * the scales, the start; values that are zero in the file; what cannot vary, and values that a model cannot have. */
#include "constraints/evaluation/evaluator.h"
#include "loaded.h"
#include "model/data/model.h"
#include "model/data/variant.h"
#include "random.h"
#include <kempe/settings.h>

enum { MOST = 64, TRIALS = 3, STATES = 3 };

static kempe_context *quiet_context(void)
{
    return kempe_context_new();
}

/* Largest difference of two vectors beside the largest number of the second. */
static double difference(int count, const double *a, const double *b)
{
    double worst = 0, size = 1e-300;
    for (int k = 0; k < count; k++) {
        worst = check_max(worst, fabs(a[k] - b[k]));
        size = check_max(size, fabs(b[k]));
    }
    return worst / size;
}

typedef struct numbers {
    double mass[400], jacobian[400], bias[20], h[20], jdqd[20], potential, power;
} numbers;

static void evaluate(kmp_evaluator *eval, double t, const double *q, const double *qd, numbers *x)
{
    memset(x, 0, sizeof *x);
    kmp_eval_closure(eval, t, q);
    kmp_eval_mass(eval);
    kmp_eval_bias(eval, qd);
    kmp_eval_dense_jacobian(eval, x->jacobian);
    kmp_eval_dense_mass(eval, x->mass);
    memcpy(x->bias, eval->bias, (size_t)eval->n * sizeof(double));
    memcpy(x->h, eval->h, (size_t)eval->m * sizeof(double));
    memcpy(x->jdqd, eval->jdqd, (size_t)eval->m * sizeof(double));
    x->potential = kmp_eval_potential(eval, t, q);
    x->power = kmp_eval_power(eval, t, q, qd);
}

static void compare_systems(const kempe_system *open, const kempe_system *closed)
{
    static numbers a, b;
    int n = closed->n, m = closed->m;
    CHECK(open->n == n && open->m == m);
    CHECK(difference(n, open->scale, closed->scale) < 1e-14);
    CHECK(difference(m, open->row_scale, closed->row_scale) < 1e-14);
    CHECK_NEAR(open->reach, closed->reach, 1e-14);
    for (int k = 0; k < n; k++) {
        CHECK(open->model->start.q[k].value == closed->model->start.q[k].value);
        CHECK(open->model->start.qd[k].value == closed->model->start.qd[k].value);
    }
    kmp_evaluator *p = kmp_eval_new(open, "tape"), *c = kmp_eval_new(closed, "tape");
    CHECK(p && c);
    for (int s = 0; p && c && s < STATES && open->m == m; s++) {
        double q[20], qd[20], t = between(0, 1);
        for (int k = 0; k < n; k++) {
            q[k] = between(-1, 1) * closed->scale[k];
            qd[k] = between(-3, 3) * closed->scale[k];
        }
        evaluate(p, t, q, qd, &a);
        evaluate(c, t, q, qd, &b);
        CHECK(difference(n * n, a.mass, b.mass) < 1e-12);
        CHECK(difference(m * n, a.jacobian, b.jacobian) < 1e-12);
        CHECK(difference(n, a.bias, b.bias) < 1e-11);
        CHECK(difference(m, a.h, b.h) < 1e-12);
        CHECK(difference(m, a.jdqd, b.jdqd) < 1e-11);
        CHECK_NEAR(a.potential, b.potential, 1e-11);
        CHECK_NEAR(a.power, b.power, 1e-11);
    }
    kmp_eval_free(p);
    kmp_eval_free(c);
}

static bool reads_set(kempe_context *c, const char *path, const char *text, const kempe_setting *set, int count,
                      kempe_model **model)
{
    kempe_status status = path ? kempe_model_read_set(c, path, set, count, model)
                               : kempe_model_read_text_set(c, text, "model.yaml", set, count, model);
    return status == KEMPE_OK;
}

/* All parameters that are plain numbers and may vary do, to values by up to a tenth from theirs, and from 0. */
static void compare_model(const char *path, const char *text)
{
    kempe_context *c = quiet_context();
    kempe_model *model = NULL;
    kmp_variant *v = NULL;
    kempe_system *open = NULL;
    const char *names[MOST];
    int count = 0;
    CHECK(reads_set(c, path, text, NULL, 0, &model));
    if (!model) {
        printf("%s\n", kempe_context_message(c));
        kempe_context_free(c);
        return;
    }
    for (int k = 0; model && k < model->parameter_count && count < MOST; k++)
        if (!model->parameters[k].number.expr && !model->parameters[k].fixed)
            names[count++] = model->parameters[k].name;
    CHECK(count > 0);
    CHECK(kmp_variant_new(model, count, names, &v) == KEMPE_OK);
    CHECK(kempe_system_new(kmp_variant_model(v), &open) == KEMPE_OK);
    for (int trial = 0; open && trial < TRIALS; trial++) {
        double values[MOST];
        char text_of[MOST][32];
        kempe_setting set[MOST];
        kmp_text why = {0};
        for (int k = 0, at = 0; k < model->parameter_count && at < count; k++)
            if (strcmp(model->parameters[k].name, names[at]) == 0) {
                double x = model->parameters[k].number.value;
                values[at] = x != 0 ? x * between(0.95, 1.05) : between(0.01, 0.1);
                (void)snprintf(text_of[at], sizeof text_of[at], "%.17g", values[at]);
                set[at] = (kempe_setting){names[at], text_of[at]};
                at++;
            }
        CHECK(kmp_variant_set(v, values, &why) == KEMPE_OK);
        CHECK(kmp_system_rescale(open));
        kempe_model *with = NULL;
        kempe_system *closed = NULL;
        CHECK(reads_set(c, path, text, set, count, &with));
        CHECK(with && kempe_system_new(with, &closed) == KEMPE_OK);
        if (closed)
            compare_systems(open, closed);
        kempe_system_free(closed);
        kempe_model_free(with);
        kmp_text_free(&why);
    }
    kempe_system_free(open);
    kmp_variant_free(v);
    kempe_model_free(model);
    kempe_context_free(c);
}

static void test_examples(void)
{
    static const char *const examples[] = {"four_bar/four_bar",      "slider_crank/slider_crank",
                                           "bennett/bennett",        "stephenson/stephenson",
                                           "governor/governor",      "spatial_slider_crank/spatial_slider_crank",
                                           "bricard/bricard",        "driven_slider_crank/driven_slider_crank",
                                           "jansen_leg/jansen_leg",  "parallel_robot/parallel_robot",
                                           "peaucellier/peaucellier"};
    random_seed(5);
    for (size_t k = 0; k < sizeof examples / sizeof *examples; k++) {
        char path[1024];
        (void)snprintf(path, sizeof path, "%s/examples/%s.yaml", KEMPE_ROOT, examples[k]);
        int before = check_failures;
        compare_model(path, NULL);
        if (check_failures > before)
            printf("  in %s\n", examples[k]);
    }
}

/* Every place of the language that takes a number; offsets, a centre of mass and a factor that are zero. */
static const char everywhere[] =
    "kempe: 1\nname: everywhere\ngravity: [0, -g, gx]\n"
    "parameters: {g: 9.81, gx: 0, l: 0.5, w: 0, m: 2, j: 0.1, k: 30, d: 0.3, s: 0.4, e: 3, f: 0, p: 0.01, q0: 0.3,\n"
    "             u0: 0.7, r: 0.45, half: l/2, twice: half*4, lo: -1, hi: 1}\n"
    "ground: {points: {O: [0, w, 0], S: [2*l, 0, w]}}\n"
    "bodies:\n"
    "  a: {joint: {name: a, revolute: z, at: ground.O}, mass: m, com: [half, w, 0], inertia: {zz: j*l^2, xx: j},\n"
    "      points: {E: [l, w, 0]}}\n"
    "  b: {joint: {name: b, revolute: z, at: a.E}, mass: m/2, com: [twice/4, 0, 0], inertia: {zz: j},\n"
    "      points: {E: [l, 0, 0]}}\n"
    "  c: {joint: {name: c, prismatic: x, at: ground.S}, mass: 1, points: {P: [0, 0, f]}}\n"
    "  d: {joint: {name: d, screw: z, pitch: p, at: ground.O}, mass: 1, inertia: {zz: j}}\n"
    "loops:\n  r: {rod: [b.E, c.P], length: r}\n  t: {coupler: {d.1: 1, a: s/2}, equals: q0/9}\n"
    "forces:\n"
    "  k: {spring: [a.E, c.P], stiffness: k, damping: d, free_length: s}\n"
    "  j: {joint: c, spring: {stiffness: k*2, damping: f, rest: w}}\n"
    "  s: {joint: b, stops: {lower: lo, upper: hi, stiffness: k, damping: d, width: s}}\n"
    "  e: {joint: a, torque: k*(q(a)*q(a) + s)^e + d*qd(a)*f}\n"
    "start: {q: {a: q0, b: 0.1}, qd: {a: u0}}\n";

static void test_every_place(void)
{
    random_seed(6);
    compare_model(NULL, everywhere);
}

/* Masses, centres and inertias that follow from shapes: turned, between points, several together, with a hole. */
static const char shaped[] =
    "kempe: 1\nname: shaped\ngravity: [0, -9.81, 0]\n"
    "parameters: {a: 0.4, b: 0.1, r: 0.02, rho: 7850, m: 2, w: 0.05, f: 0}\n"
    "bodies:\n"
    "  box: {joint: {name: A, revolute: z, at: ground}, points: {E: [a, f, w]},\n"
    "        shape: {box: [a, b, w], at: [a/2, 0, f], axes: {x: [1, 2, 2]}, density: rho}}\n"
    "  sum: {joint: {name: B, universal: [z, y], at: box.E}, points: {P: [0, 0, f], Q: [a, w, b]},\n"
    "        shape: [{cylinder: [P, Q], radius: r, density: rho}, {sphere: r*2, at: Q, mass: m},\n"
    "                {capsule: b, radius: r, axis: y, density: rho}, {box: [r, r, r], at: P, density: rho, hole: "
    "yes},\n"
    "                {line: [P, [0, a, 0], Q], mass: m/3}]}\n"
    "start: {q: {A: 0.3, B.1: 0.1}}\n";

static void test_shapes(void)
{
    random_seed(7);
    compare_model(NULL, shaped);
}

static void expect_refusal(const char *text, int count, const char *const *names, const char *sentence)
{
    kempe_context *c = quiet_context();
    kempe_model *model = NULL;
    kmp_variant *v = NULL;
    CHECK(kempe_model_read_text(c, text, "model.yaml", &model) == KEMPE_OK);
    if (model) {
        CHECK(kmp_variant_new(model, count, names, &v) == KEMPE_E_ARGUMENT && !v);
        if (!strstr(kempe_context_message(c), sentence))
            CHECK_TEXT(kempe_context_message(c), sentence);
    }
    kempe_model_free(model);
    kempe_context_free(c);
}

#define PENDULUM(parameters, axis)                                                                                     \
    "kempe: 1\nname: pendulum\nparameters: {" parameters "}\nground: {points: {O: [0, 0, 0]}}\nbodies:\n"              \
    "  a: {joint: {name: a, revolute: " axis ", at: ground.O}, mass: m, com: [l, 0, 0], inertia: {zz: 0.1}}\n"         \
    "run: {t_end: T}\n"

static void test_refusals(void)
{
    static const char plain[] = PENDULUM("m: 1, l: 0.5, T: 2*l, ax: 0, ay: ax", "[ay, 0, 1]");
    expect_refusal(plain, 1, (const char *const[]){"mm"}, "the model has no parameter 'mm'; did you mean 'm'?");
    expect_refusal(plain, 2, (const char *const[]){"m", "m"}, "'m' is given twice");
    expect_refusal(plain, 1, (const char *const[]){"ax"},
                   "parameter 'ax' cannot be a variable of the equations: an axis");
    expect_refusal(plain, 1, (const char *const[]){"l"}, "parameter 'l' cannot be a variable of the equations");
    expect_refusal(plain, 1, (const char *const[]){"T"}, "parameter 'T' cannot be a variable of the equations");
    expect_refusal(plain, 1, (const char *const[]){"q.b"}, "the model has no coordinate 'b'");
}

/* A parameter between one that varies and an axis is fixed with it, whichever is read first. */
static void test_start_values(void)
{
    static const char text[] = PENDULUM("m: 1, l: 0.5, T: 2", "z");
    static const char *const names[] = {"qd.a", "m", "q.a"};
    kempe_context *c = quiet_context();
    kempe_model *model = NULL;
    kmp_variant *v = NULL;
    kmp_text why = {0};
    CHECK(kempe_model_read_text(c, text, "model.yaml", &model) == KEMPE_OK);
    CHECK(kmp_variant_new(model, 3, names, &v) == KEMPE_OK);
    CHECK(kmp_variant_set(v, (const double[]){3, 2, 0.25}, &why) == KEMPE_OK);
    const kempe_model *m = kmp_variant_model(v);
    CHECK(m->start.q[0].value == 0.25 && m->start.qd[0].value == 3 && m->bodies[1].mass.value == 2);
    CHECK(m->start.q_given[0] && m->start.qd_given[0] && !model->start.q_given[0]);
    CHECK(model->start.q[0].value == 0 && model->bodies[1].mass.value == 1);
    CHECK(kmp_variant_set(v, (const double[]){3, -2, 0.25}, &why) == KEMPE_E_INPUT);
    CHECK_TEXT(why.s, "the mass of body 'a' is negative: -2");
    kmp_text_free(&why);
    CHECK(kmp_variant_set(v, (const double[]){3, NAN, 0.25}, &why) == KEMPE_E_INPUT);
    CHECK_TEXT(why.s, "parameter 'm' is not a number: a finite number is expected");
    kmp_text_free(&why);
    CHECK(kmp_variant_set(v, (const double[]){1, 4, 0.5}, &why) == KEMPE_OK && m->bodies[1].mass.value == 4);
    kmp_variant_free(v);
    kempe_model_free(model);
    kempe_context_free(c);
}

/* A row of numbers that vary alone is no equation: it would be there for some instances and not for others. */
static void test_row_of_parameters(void)
{
    static const char text[] =
        "kempe: 1\nname: plane\nparameters: {l: 0.3, z: 0}\nground: {points: {O: [0, 0, 0], D: [0.3, 0, 0]}}\n"
        "bodies:\n"
        "  a: {joint: {name: a, revolute: z, at: ground.O}, mass: 1, inertia: {zz: 1}, points: {E: [l, 0, z]}}\n"
        "  b: {joint: {name: b, revolute: z, at: ground.D}, mass: 1, inertia: {zz: 1}, points: {E: [0, 0, 0]}}\n"
        "loops: {E: {ball: [a.E, b.E]}}\n";
    kempe_context *c = quiet_context();
    kempe_model *model = NULL;
    kmp_variant *v = NULL;
    kempe_system *system = NULL;
    CHECK(kempe_model_read_text(c, text, "model.yaml", &model) == KEMPE_OK);
    CHECK(kmp_variant_new(model, 1, (const char *const[]){"z"}, &v) == KEMPE_OK);
    CHECK(kempe_system_new(kmp_variant_model(v), &system) == KEMPE_E_INPUT && !system);
    CHECK(strstr(kempe_context_message(c), "closure 'E' cannot have variable parameters") != NULL);
    kmp_variant_free(v);
    kempe_model_free(model);
    kempe_context_free(c);
}

int main(void)
{
    TEST(test_examples);
    TEST(test_every_place);
    TEST(test_shapes);
    TEST(test_refusals);
    TEST(test_start_values);
    TEST(test_row_of_parameters);
    return check_report();
}
