/* SPDX-License-Identifier: BSD-3-Clause */
/* wings: rail */
/* Tangents number by number against derived ones: of random mechanisms, of every function of the language, of loops
 * with functions of time; and that few evaluations and many give the same. */
#include "analyses/derivatives/linearized.h"
#include "base/text.h"
#include "constraints/evaluation/evaluator.h"
#include "constraints/evaluation/few_tangents.h"
#include "constraints/evaluation/tangent.h"
#include "loaded.h"
#include "model/data/start.h"
#include "random_model.h"
#include "testing.h"
#include <kempe/kempe.h>
#include <kempe/settings.h>

enum { MODELS = 64, SIZE = 96 };

typedef struct place {
    double q[SIZE], qd[SIZE], qdd[SIZE], lambda[SIZE];
} place;

static place random_place(void)
{
    place p;
    for (int k = 0; k < SIZE; k++) {
        p.q[k] = between(-2, 2);
        p.qd[k] = between(-2, 2);
        p.qdd[k] = between(-5, 5);
        p.lambda[k] = between(-5, 5);
    }
    return p;
}

/* A block of one of both, rows x columns. */
static void spread(const kmp_tangents *t, const double *d, int block, double *out)
{
    memset(out, 0, SIZE * SIZE * sizeof *out);
    for (int k = t->start[block]; k < t->start[block + 1]; k++) {
        CHECK(t->entry[k].block == block);
        CHECK(k == t->start[block] || t->entry[k].col > t->entry[k - 1].col ||
              (t->entry[k].col == t->entry[k - 1].col && t->entry[k].row > t->entry[k - 1].row));
        out[t->entry[k].row * SIZE + t->entry[k].col] = d[t->entry[k].source];
    }
}

/* Their largest difference over the largest entry. */
static double block_distance(kmp_tangents *a, kmp_tangents *b, const kmp_instant *at, int block)
{
    static double x[SIZE * SIZE], y[SIZE * SIZE];
    double size = 1, worst = 0;
    spread(a, kmp_tangents_derivatives(a, at), block, x);
    spread(b, kmp_tangents_derivatives(b, at), block, y);
    for (int k = 0; k < SIZE * SIZE; k++) {
        size = check_max(size, fabs(y[k]));
        worst = fabs(x[k] - y[k]) <= worst ? worst : fabs(x[k] - y[k]);
    }
    return worst / size;
}

/* At four places, by the evaluator's conditions and charts, one of them without accelerations. */
static void compare(const kempe_system *system, const char *name)
{
    kmp_tangents few, many;
    kmp_evaluator *eval = kmp_eval_new(system, "tape");
    const kmp_backend *tape = kmp_backend_find("tape");
    CHECK(kmp_tangents_init_few(&few, system, tape) == KEMPE_OK && few.numbers);
    CHECK(kmp_tangents_init(&many, system, tape, KMP_TANGENTS_NEAR) == KEMPE_OK && !many.numbers);
    for (int k = 0; k < 4; k++) {
        place p = random_place();
        if (k == 1)
            memset(p.qdd, 0, sizeof p.qdd);
        kmp_eval_freeze(eval, 0.7, p.q, p.qd);
        kmp_instant at = {
            0.7, p.q, p.qd, p.qdd, p.lambda, NULL, eval->conditions.mode, eval->chart, eval->chart_version, NULL};
        for (int block = 0; block < KMP_TANGENT_BLOCKS; block++) {
            double worst = block_distance(&few, &many, &at, block);
            if (!(worst < 1e-11))
                printf("%s: block %d differs by %.3g\n", name, block, worst);
            CHECK(worst < 1e-11);
        }
    }
    kmp_tangents_free(&few);
    kmp_tangents_free(&many);
    kmp_eval_free(eval);
}

static void random_mechanisms(void)
{
    int used = 0;
    for (unsigned number = 0; number < MODELS; number++) {
        unsigned flags = number * 7 % 16 | (number % 4 == 2 ? MODEL_FORCES | MODEL_BUSHINGS : 0);
        random_model r = random_model_new(number + 1, 1 + (int)number % 4, flags);
        kempe_system *system = NULL;
        char name[32];
        (void)snprintf(name, sizeof name, "model %u", number);
        if (r.model &&
            kempe_system_new_with_algorithm(r.model, number % 2 ? "plain" : "composite", &system) == KEMPE_OK) {
            random_seed(number + 99);
            compare(system, name);
            used++;
        }
        kempe_system_free(system);
        random_model_free(&r);
    }
    CHECK(2 * used >= MODELS);
}

#define ARM                                                                                                            \
    "kempe: 1\nbodies: {a: {joint: {revolute: z, at: ground}, mass: 1, com: [1, 0, 0]}, b: {joint: {prismatic: x, "    \
    "at: a}, mass: 2}}\n"

/* Each at three places, on both sides of what has a kink. */
static void every_function(void)
{
    static const char *const forces[] = {"sin(q(a))*cos(q(b))",
                                         "tan(q(a)/3)",
                                         "asin(q(a)/3)*acos(q(b)/3)",
                                         "atan(q(a)*q(b))",
                                         "atan2(q(a), q(b) + 3)",
                                         "sinh(q(a))*cosh(q(b))",
                                         "tanh(q(a)*qd(b))",
                                         "exp(q(a))",
                                         "log(q(a) + 3)",
                                         "sqrt(q(b) + 3)",
                                         "pow(q(a) + 3, q(b))",
                                         "pow(q(a) + 3, 2.5)",
                                         "q(a)^3/(q(b) + 4)",
                                         "(q(a) + 3)^0.3",
                                         "abs(q(a))*q(b)",
                                         "min(q(a), -q(b)^2)",
                                         "max(-q(a), q(b))",
                                         "max(q(a), 1)",
                                         "sign(q(a))*q(b)",
                                         "if(q(a) < q(b), sin(q(a)), -q(b)^2)",
                                         "if(q(a) < 0, 1, sqrt(q(a)))",
                                         "f(q(a))*f(-q(b))",
                                         "g(-q(a))"};
    for (size_t k = 0; k < sizeof forces / sizeof *forces; k++) {
        char text[1024];
        (void)snprintf(text, sizeof text,
                       ARM "tables: {f: {x: [-9, -1, 0, 2, 9], y: [1, 0, 3, 1, 2]}, g: {x: [-9, 0, 9], y: [1, 0, 3], "
                           "method: linear}}\nforces: {e: {joint: b, force: \"(1 N)*(%s)\"}, f: {joint: a, torque: "
                           "\"(1 N*m)*(%s)*q(b)\"}}\n",
                       forces[k], forces[k]);
        loaded m = load_text(text);
        random_seed(k + 1);
        if (m.system)
            compare(m.system, forces[k]);
        unload(&m);
    }
}

static void loops_that_follow_time(void)
{
    loaded m = load_text("kempe: 1\nground: {points: {D: [3, 0, 0]}}\n"
                         "bodies: {a: {joint: {revolute: z, at: ground}, mass: 1, points: {P: [1, 0, 0]}},\n"
                         "  b: {joint: {revolute: z, at: a.P}, mass: 1, com: [1, 0, 0], points: {P: [2, 0, 0]}}}\n"
                         "loops: {r: {rod: [ground.D, b.P], length: \"2 + 0.1*sin(3*t)\"}, "
                         "c: {point_on_curve: [ground.D, b.P], y: \"0.1*x^2*sin(t)\"}}\n"
                         "drives: {d: {joint: a, angle: \"0.2*t^2\"}}\n");
    if (m.system)
        compare(m.system, "time");
    unload(&m);
}

/* Of more than 40 coordinates, R by composite bodies is not compared with its differentiation. */
static void a_large_mechanism(void)
{
    kmp_text text = {0};
    kmp_text_put(&text, "kempe: 1\nname: chain\ngravity: [0, 0, -9.81]\nground: {points: {O: [1, 2, 3]}}\nbodies:\n");
    for (int b = 1; b <= 48; b++) {
        static const char *const joints[] = {"revolute: x", "revolute: y", "prismatic: z", "revolute: z"};
        kmp_text_printf(&text, "  b%d: {joint: {%s, at: ", b, joints[b % 4]);
        kmp_text_printf(&text, b % 12 == 1 ? "ground" : "b%d.P", b - 1);
        kmp_text_put(&text, "}, mass: 1.5, com: [0.1, 0.05, 0.15], inertia: {xx: 0.04, yy: 0.05, zz: 0.06}, "
                            "points: {P: [0.2, 0.1, 0.3]}}\n");
    }
    kmp_text_put(&text, "loops: {l: {rod: [ground.O, b12.P], length: 5}, m: {rod: [b24.P, b36.P], length: 4}}\n"
                        "forces:\n");
    for (int b = 1; b <= 48; b++)
        kmp_text_printf(&text, "  f%d: {spring: [ground.O, b%d.P], stiffness: 20, free_length: 1, damping: 3}\n", b, b);
    loaded m = load_text(text.s);
    random_seed(5);
    if (m.system)
        compare(m.system, "chain");
    unload(&m);
    kmp_text_free(&text);
}

/* After many states the tangents are derived. */
static void many_states_are_as_few(void)
{
    loaded m = load("examples/stewart/stewart.yaml");
    kmp_linear l;
    double first[SIZE * SIZE], q[SIZE] = {0}, ud[SIZE], size = 0, worst = 0;
    CHECK(kmp_linear_init(&l, m.system, "tape") == KEMPE_OK && l.tangents.numbers);
    for (int k = 0; k < m.system->n; k++)
        q[k] = m.model ? kmp_model_start(m.system->model)->q[k].value : 0;
    CHECK(kmp_linear_choose(&l, 0, q, NULL, 0) == KEMPE_OK);
    for (int k = 0; k < l.p; k++)
        ud[k] = 0.1 * k;
    for (int k = 0; k < 400; k++) {
        CHECK(kmp_linear_at(&l, 0, q, ud, NULL) == KEMPE_OK);
        memcpy(q, l.q, (size_t)l.n * sizeof *q);
        if (k == 0) {
            kmp_linear_matrices(&l);
            memcpy(first, l.stiffness, (size_t)(l.p * l.p) * sizeof *first);
        }
    }
    CHECK(!l.tangents.numbers);
    kmp_linear_matrices(&l);
    for (int k = 0; k < l.p * l.p; k++) {
        size = check_max(size, fabs(first[k]));
        worst = check_max(worst, fabs(first[k] - l.stiffness[k]));
    }
    CHECK(size > 0 && worst < 1e-10 * size);
    kmp_linear_free(&l);
    unload(&m);
}

/* The programs of a linearisation before a run are those of the run: they are derived once. */
static void derived_once(void)
{
    loaded l = load("examples/tram/tram.yaml");
    const kmp_backend *tape = kmp_backend_find("tape");
    kmp_tangents few, runs;
    CHECK(kmp_tangents_init_few(&few, l.system, tape) == KEMPE_OK && !few.numbers);
    CHECK(kmp_tangents_init(&runs, l.system, tape, kmp_tangents_of_runs(l.system)) == KEMPE_OK);
    CHECK(runs.at[KMP_VALUE_POWER] >= 0 && runs.tangent.program == few.tangent.program);
    kmp_tangents_free(&few);
    kmp_tangents_free(&runs);
    unload(&l);
}

int main(void)
{
    TEST(random_mechanisms);
    TEST(every_function);
    TEST(loops_that_follow_time);
    TEST(a_large_mechanism);
    TEST(many_states_are_as_few);
    TEST(derived_once);
    return check_report();
}
