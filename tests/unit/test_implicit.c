/* SPDX-License-Identifier: BSD-3-Clause */
/* Implicit blocks: solutions, first and second derivatives against differences, the same bits from graph, tape and a
 * program that was written and read, and NaN where there is no solution. */
#include "backend/machine.h"
#include "base/memory.h"
#include "linalg/newton.h"
#include "read_again.h"
#include "symbolic/derivative.h"
#include "symbolic/function_table.h"
#include "symbolic/graph.h"
#include "symbolic/implicit.h"
#include "symbolic/interpreter.h"
#include "symbolic/solving.h"
#include <math.h>

/* y^3 + y = p */
static int cubic_block(kmp_graph *g)
{
    kmp_graph *local = kmp_graph_new();
    kmp_ref y = kmp_input(local, KMP_IN_Q, 0), p = kmp_input(local, KMP_IN_PARAMETER, 0);
    kmp_ref residual = kmp_sub(local, kmp_add(local, kmp_power(local, y, 3), y), p);
    return kmp_graph_add_implicit(g, kmp_implicit_new(local, 1, 1, &residual, &p));
}

/* Circle x^2 + y^2 = p0 and line y = p1 x + p2, on the side of positive x. */
static int circle_block(kmp_graph *g)
{
    kmp_graph *l = kmp_graph_new();
    kmp_ref x = kmp_input(l, KMP_IN_Q, 0), y = kmp_input(l, KMP_IN_Q, 1), p[3], residual[2], guess[2];
    for (uint32_t k = 0; k < 3; k++)
        p[k] = kmp_input(l, KMP_IN_PARAMETER, k);
    residual[0] = kmp_sub(l, kmp_add(l, kmp_mul(l, x, x), kmp_mul(l, y, y)), p[0]);
    residual[1] = kmp_sub(l, kmp_add(l, kmp_mul(l, p[1], x), p[2]), y);
    guess[0] = kmp_sqrt(l, p[0]);
    guess[1] = p[2];
    return kmp_graph_add_implicit(g, kmp_implicit_new(l, 2, 3, residual, guess));
}

static double circle_x(double radius2, double slope, double offset)
{
    double a = 1 + slope * slope, b = slope * offset, c = offset * offset - radius2;
    return (-b + sqrt(b * b - a * c)) / a;
}

/* Scene: f and its derivatives of order 1 and 2 along q = base + s direction; s is the input. */
typedef struct scene {
    kmp_graph *g;
    kmp_ref s, out[6]; /* two functions, each with two derivatives */
    kmp_program *program;
} scene;

static scene new_scene(void)
{
    scene c = {.g = kmp_graph_new()};
    kmp_graph *g = c.g;
    c.s = kmp_input(g, KMP_IN_Q, 0);
    int cubic = cubic_block(g), circle = circle_block(g);
    kmp_ref one = KMP_ONE, y, xy[2], arguments[3];
    kmp_ref p = kmp_add(g, kmp_sin(g, c.s), kmp_mul(g, kmp_const(g, 2), c.s));
    kmp_implicit_at(g, cubic, &p, &y);
    arguments[0] = kmp_add(g, kmp_const(g, 4), kmp_mul(g, c.s, c.s));
    arguments[1] = kmp_neg(c.s);
    arguments[2] = kmp_const(g, 0.3);
    kmp_implicit_at(g, circle, arguments, xy);
    c.out[0] = y;
    c.out[3] = kmp_mul(g, xy[0], xy[1]);
    kmp_derivative *d = kmp_derivative_new(g, 1, &c.s, &one);
    for (int k = 0; k < 6; k += 3)
        for (int i = 1; i < 3; i++)
            c.out[k + i] = kmp_derivative_of(d, c.out[k + i - 1]);
    kmp_derivative_free(d);
    const kmp_ref *group = c.out;
    c.program = kmp_program_new(g, 1, &(int){6}, &group);
    return c;
}

static void free_scene(scene *c)
{
    kmp_program_free(c->program);
    kmp_graph_free(c->g);
}

static void eval(const scene *c, double s, double *out)
{
    double *value = KMP_NEW(double, kmp_graph_count(c->g));
    kmp_graph_eval(c->g, (const double *const[KMP_IN_COUNT]){[KMP_IN_Q] = &s}, value);
    for (int k = 0; k < 6; k++)
        out[k] = kmp_is_negative(c->out[k]) ? -value[kmp_id(c->out[k])] : value[kmp_id(c->out[k])];
    kmp_free(value);
}

static void test_solutions(void)
{
    scene c = new_scene();
    for (double s = -1.2; s < 1.3; s += 0.1) {
        double out[6], p = sin(s) + 2 * s, x = circle_x(4 + s * s, -s, 0.3);
        eval(&c, s, out);
        CHECK_NEAR(out[0] * out[0] * out[0] + out[0], p, 4e-16);
        CHECK_NEAR(out[3], x * (-s * x + 0.3), 1e-15);
    }
    free_scene(&c);
}

static void test_derivatives(void)
{
    scene c = new_scene();
    const double h = 1e-3;
    for (double s = -1; s < 1.1; s += 0.2) {
        double at[6], value[5][6];
        eval(&c, s, at);
        for (int i = -2; i <= 2; i++)
            eval(&c, s + i * h, value[i + 2]);
        for (int k = 0; k < 6; k++)
            if (k % 3 < 2) { /* the next output is the derivative of this one */
                double d = (8 * (value[3][k] - value[1][k]) - (value[4][k] - value[0][k])) / (12 * h);
                CHECK_NEAR(at[k + 1], d, 1e-9);
            }
    }
    free_scene(&c);
}

/* Derivatives from the solutions down to the input are those from the input up. */
static void test_derivatives_backward(void)
{
    scene c = new_scene();
    kmp_ref down[4];
    static const int of[] = {0, 1, 3, 4};
    for (int k = 0; k < 4; k++)
        kmp_gradient_backward(c.g, c.out[of[k]], 1, &c.s, &down[k]);
    for (int k = 0; k < 4; k++) {
        const kmp_ref kept = c.out[of[k] + 1];
        for (double s = -1; s < 1.1; s += 0.5) {
            double up[6], other[6];
            eval(&c, s, up);
            c.out[of[k] + 1] = down[k];
            eval(&c, s, other);
            c.out[of[k] + 1] = kept;
            CHECK_NEAR(other[of[k] + 1], up[of[k] + 1], 1e-12 * fmax(1, fabs(up[of[k] + 1])));
        }
    }
    free_scene(&c);
}

static bool same_bits(double a, double b)
{
    return memcmp(&a, &b, sizeof a) == 0 || (isnan(a) && isnan(b));
}

static void compare_bits(const scene *c, const kmp_program *p)
{
    kmp_machine *machine = kmp_machine_new(p, kmp_backend_find("tape"));
    unsigned long before = kmp_memory_count();
    double s, all[32][6];
    int count = 0;
    for (s = -1.55; s < 1.6; s += 0.1) {
        kmp_machine_set(machine, KMP_IN_Q, &s);
        memcpy(all[count++], kmp_machine_run(machine, 1), sizeof all[0]);
    }
    CHECK(kmp_memory_count() == before);
    for (s = -1.55, count = 0; s < 1.6; s += 0.1, count++) {
        double expected[6];
        eval(c, s, expected);
        for (int k = 0; k < 6; k++)
            CHECK(same_bits(all[count][k], expected[k]));
    }
    kmp_machine_free(machine);
}

static void test_bits(void)
{
    scene c = new_scene();
    kmp_program *read = read_again(c.program);
    compare_bits(&c, c.program);
    if (read)
        compare_bits(&c, read);
    kmp_program_free(read);
    free_scene(&c);
}

/* A line that misses the circle. */
static void test_no_solution(void)
{
    kmp_graph *g = kmp_graph_new();
    int circle = circle_block(g);
    kmp_ref s = kmp_input(g, KMP_IN_Q, 0), xy[2], arguments[3] = {KMP_ONE, KMP_ONE, s};
    kmp_implicit_at(g, circle, arguments, xy);
    const kmp_ref *group = xy;
    kmp_program *p = kmp_program_new(g, 1, &(int){2}, &group);
    kmp_machine *machine = kmp_machine_new(p, kmp_backend_find("tape"));
    for (int pass = 0; pass < 2; pass++) {
        double far = 5, near = 0.5;
        kmp_machine_set(machine, KMP_IN_Q, &far);
        CHECK(isnan(kmp_machine_run(machine, 1)[0]));
        kmp_machine_set(machine, KMP_IN_Q, &near);
        CHECK_NEAR(kmp_machine_run(machine, 1)[0], circle_x(1, 1, 0.5), 1e-15);
    }
    kmp_machine_free(machine);
    kmp_program_free(p);
    kmp_graph_free(g);
}

/* Blocks within blocks are refused. */
static void test_nesting(void)
{
    kmp_graph *local = kmp_graph_new();
    kmp_ref y = kmp_input(local, KMP_IN_Q, 0), inner;
    int block = cubic_block(local);
    kmp_implicit_at(local, block, &y, &inner);
    CHECK(kmp_implicit_new(local, 1, 0, &inner, &inner) == NULL);
}

/* A runner that counts the stages that it runs. */
static long stage_runs[4];

static void *counted_prepare(const kmp_program *program)
{
    return kmp_interpreter_new(program);
}

static void counted_release(void *code)
{
    kmp_interpreter_free(code);
}

static void counted_set(void *code, kmp_input_kind kind, const double *values)
{
    kmp_interpreter_set(code, kind, values);
}

static void counted_run(void *code, int stage)
{
    stage_runs[stage]++;
    kmp_interpreter_run(code, stage);
}

static const double *counted_outputs(const void *code, int stage)
{
    return kmp_interpreter_outputs(code, stage);
}

/* The operations of a solution are those of the stages that ran; a kept solution adds none. */
static void test_operations_are_counted(void)
{
    static const kmp_block_runner runner = {counted_prepare, counted_release, counted_set,
                                            counted_run,     counted_outputs, false};
    kmp_graph *g = kmp_graph_new();
    const kmp_program_block *block = kmp_implicit_block(kmp_graph_implicit(g, cubic_block(g)));
    kmp_solving *s = kmp_solving_new(block, &runner);
    kmp_counts expected = {0};
    *kmp_solving_arguments(s) = 2;
    CHECK_NEAR(kmp_solving_value(s, 0), 1, 1e-14); /* y^3 + y = 2 */
    CHECK(kmp_solving_value(s, 0) == kmp_solving_value(s, 0) && stage_runs[0] == 1 && stage_runs[2] > 2);
    for (int stage = 0; stage < block->program->stages; stage++)
        for (int i = block->program->code[stage]; i < block->program->code[stage + 1]; i++)
            for (long k = 0; k < stage_runs[stage]; k++)
                expected.paper += block->program->instruction[i].op == KMP_OP_ADD ||
                                  block->program->instruction[i].op == KMP_OP_MUL ||
                                  block->program->instruction[i].op == KMP_OP_DIV;
    CHECK(expected.paper > 0 && kmp_solving_count(s).paper == expected.paper);
    kmp_solving_free(s);
    kmp_graph_free(g);
}

/* x - p = 0, from one candidate at `begin`; 0: none. */
static int shifted_block(kmp_graph *g, double factor, double begin)
{
    kmp_graph *l = kmp_graph_new();
    kmp_ref x = kmp_input(l, KMP_IN_Q, 0), p = kmp_input(l, KMP_IN_PARAMETER, 0), guess = KMP_ZERO;
    kmp_ref residual = kmp_sub(l, kmp_mul(l, kmp_const(l, factor), x), p);
    kmp_ref merit = kmp_mul(l, residual, residual);
    return kmp_graph_add_implicit(g, begin != 0 ? kmp_implicit_new_among(l, 1, 1, &residual, &guess, 1, &begin, merit)
                                                : kmp_implicit_new(l, 1, 1, &residual, &guess));
}

/* Equal blocks are one; what differs in anything is another. */
static void test_sharing(void)
{
    kmp_graph *g = kmp_graph_new();
    CHECK(cubic_block(g) == 0 && circle_block(g) == 1 && cubic_block(g) == 0 && circle_block(g) == 1);
    CHECK(shifted_block(g, 2, 0) == 2 && shifted_block(g, 3, 0) == 3 && shifted_block(g, 2, 1) == 4);
    CHECK(shifted_block(g, 2, 1.5) == 5 && shifted_block(g, 2, 1) == 4 && shifted_block(g, 2, 0) == 2);
    CHECK(kmp_graph_implicit(g, 6) == NULL);
    kmp_ref s = kmp_input(g, KMP_IN_Q, 0), once, again;
    kmp_implicit_at(g, 0, &s, &once);
    kmp_implicit_at(g, cubic_block(g), &s, &again);
    CHECK(once == again);
    kmp_graph_free(g);
}

/* One block for several lists in one program: each has its own solution. */
static void test_lists(void)
{
    kmp_graph *g = kmp_graph_new();
    kmp_ref x = kmp_input(g, KMP_IN_Q, 0), out[4], p[2][3];
    int circle = circle_block(g);
    for (int k = 0; k < 2; k++) {
        p[k][0] = kmp_add(g, kmp_const(g, 4 + k), x);
        p[k][1] = x;
        p[k][2] = kmp_const(g, 0.3);
    }
    kmp_implicit_at(g, circle, p[0], out);
    kmp_implicit_at(g, circle, p[1], out + 2);
    kmp_ref a = out[1];
    out[1] = out[2];
    out[2] = a; /* x of both, then y of both */
    const kmp_ref *group = out;
    kmp_program *program = kmp_program_new(g, 1, &(int){4}, &group);
    static const char *const backends[] = {"tape", "native"};
    for (int i = 0; i < 2; i++) {
        kmp_machine *m = kmp_machine_new(program, kmp_backend_find(backends[i]));
        for (double s = -0.5; s < 0.6; s += 0.1) {
            kmp_machine_set(m, KMP_IN_Q, &s);
            const double *value = kmp_machine_run(m, 1);
            for (int k = 0; k < 2; k++) {
                CHECK_NEAR(value[k], circle_x(4 + k + s, s, 0.3), 1e-15);
                CHECK_NEAR(value[2 + k], s * circle_x(4 + k + s, s, 0.3) + 0.3, 1e-15);
            }
        }
        kmp_machine_free(m);
    }
    CHECK(program->block_count == 1);
    kmp_program_free(program);
    kmp_graph_free(g);
}

/* y1 = 5 y0 - 0.2 as a sum of larger terms, and y0 = p. */
static const double *pair_at(void *self, const double *y, double *merit)
{
    static double f[6];
    const double *p = self;
    (void)merit;
    f[0] = y[1] - (-8 + 34. / 9 * (y[0] + 2) + 11. / 9 * (y[0] + 0.2));
    f[1] = y[0] - *p;
    f[2] = -5;
    f[3] = f[4] = 1;
    f[5] = 0;
    return f;
}

/* From any start within roundings of a solution the iteration ends: residuals may be roundings that no step makes
 * smaller. */
static void test_roundings(void)
{
    enum { COUNT = 20000, NEAR = 2 };
    int lost = 0;
    for (int k = 0; k < COUNT; k++)
        for (int i = -NEAR; i <= NEAR; i++)
            for (int j = -NEAR; j <= NEAR; j++) {
                double p = -0.1 + 0.2 * (k + 0.5) / COUNT;
                kmp_newton s = {.unknowns = 2, .self = &p, .equations = pair_at};
                s.y[0] = p * (1 + i * DBL_EPSILON);
                s.y[1] = (5 * p - 0.2) * (1 + j * DBL_EPSILON);
                lost += !kmp_newton_descend(&s) || fabs(s.y[0] - p) > 1e-16 || fabs(s.y[1] - 5 * p + 0.2) > 1e-14;
            }
    CHECK(lost == 0);
}

int main(void)
{
    TEST(test_solutions);
    TEST(test_derivatives);
    TEST(test_derivatives_backward);
    TEST(test_bits);
    TEST(test_no_solution);
    TEST(test_roundings);
    TEST(test_nesting);
    TEST(test_operations_are_counted);
    TEST(test_sharing);
    TEST(test_lists);
    return check_report();
}
