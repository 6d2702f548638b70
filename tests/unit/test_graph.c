/* SPDX-License-Identifier: BSD-3-Clause */
/* The expression graph: what is simplified at birth, that simplifying never changes a value, and derivatives against
 * differences. */
#include "base/memory.h"
#include "base/text.h"
#include "random_graph.h"
#include "symbolic/derivative.h"
#include "symbolic/function_table.h"
#include "symbolic/ops.h"
#include "symbolic/program.h"
#include "testing.h"

/* -- simplification ---------------------------------------------------------------------------------- */

typedef struct scene {
    kmp_graph *g;
    kmp_ref x, y, z, w;
} scene;

static scene new_scene(void)
{
    scene s = {.g = kmp_graph_new()};
    s.x = kmp_input(s.g, KMP_IN_Q, 0);
    s.y = kmp_input(s.g, KMP_IN_Q, 1);
    s.z = kmp_input(s.g, KMP_IN_QD, 0);
    s.w = kmp_input(s.g, KMP_IN_PARAMETER, 3);
    return s;
}

static void test_numbers(void)
{
    scene s = new_scene();
    kmp_graph *g = s.g;
    double value = 0;
    CHECK(kmp_const(g, 0) == KMP_ZERO && kmp_const(g, -0.0) == KMP_ZERO && kmp_const(g, 1) == KMP_ONE);
    CHECK(kmp_const(g, -1) == kmp_neg(KMP_ONE) && kmp_neg(KMP_ZERO) == KMP_ZERO);
    CHECK(kmp_const(g, 2.5) == kmp_neg(kmp_const(g, -2.5)));
    CHECK(kmp_is_const(g, kmp_const(g, -2.5), &value) && value == -2.5);
    CHECK(!kmp_is_const(g, s.x, &value));
    CHECK(kmp_add(g, kmp_const(g, 2), kmp_const(g, -5)) == kmp_const(g, -3));
    CHECK(kmp_mul(g, kmp_const(g, 2), kmp_const(g, -5)) == kmp_const(g, -10));
    CHECK(kmp_div(g, kmp_const(g, -1), kmp_const(g, 4)) == kmp_const(g, -0.25));
    CHECK(kmp_sqrt(g, kmp_const(g, 9)) == kmp_const(g, 3));
    CHECK(kmp_sin(g, KMP_ZERO) == KMP_ZERO && kmp_cos(g, KMP_ZERO) == KMP_ONE);
    CHECK(kmp_graph_node(g, kmp_id(s.x))->depends == 1 << KMP_IN_Q);
    CHECK(kmp_graph_node(g, kmp_id(kmp_mul(g, s.x, s.w)))->depends == (1 << KMP_IN_Q | 1 << KMP_IN_PARAMETER));
    kmp_graph_free(g);
}

static void test_neutral(void)
{
    scene s = new_scene();
    kmp_graph *g = s.g;
    CHECK(kmp_add(g, s.x, KMP_ZERO) == s.x && kmp_add(g, KMP_ZERO, kmp_neg(s.x)) == kmp_neg(s.x));
    CHECK(kmp_sub(g, KMP_ZERO, s.x) == kmp_neg(s.x) && kmp_sub(g, s.x, KMP_ZERO) == s.x);
    CHECK(kmp_mul(g, s.x, KMP_ZERO) == KMP_ZERO && kmp_mul(g, KMP_ZERO, kmp_neg(s.x)) == KMP_ZERO);
    CHECK(kmp_mul(g, s.x, KMP_ONE) == s.x && kmp_mul(g, kmp_neg(KMP_ONE), s.x) == kmp_neg(s.x));
    CHECK(kmp_div(g, s.x, KMP_ONE) == s.x && kmp_div(g, KMP_ZERO, s.x) == KMP_ZERO);
    CHECK(kmp_div(g, s.x, s.x) == KMP_ONE && kmp_div(g, s.x, kmp_neg(s.x)) == kmp_neg(KMP_ONE));
    CHECK(kmp_div(g, s.x, kmp_const(g, 4)) == kmp_mul(g, kmp_const(g, 0.25), s.x));
    CHECK(kmp_power(g, s.x, 0) == KMP_ONE && kmp_power(g, s.x, 1) == s.x);
    CHECK(kmp_power(g, s.x, 2) == kmp_mul(g, s.x, s.x) && kmp_power(g, s.x, 0.5) == kmp_sqrt(g, s.x));
    CHECK(kmp_power(g, s.x, -1) == kmp_div(g, KMP_ONE, s.x));
    kmp_graph_free(g);
}

static void test_signs(void)
{
    scene s = new_scene();
    kmp_graph *g = s.g;
    kmp_ref nx = kmp_neg(s.x), ny = kmp_neg(s.y);
    CHECK(kmp_neg(nx) == s.x);
    CHECK(kmp_add(g, nx, ny) == kmp_neg(kmp_add(g, s.x, s.y)));
    CHECK(kmp_sub(g, s.x, s.y) == kmp_neg(kmp_sub(g, s.y, s.x)));
    CHECK(kmp_mul(g, nx, s.y) == kmp_neg(kmp_mul(g, s.x, s.y)) && kmp_mul(g, nx, ny) == kmp_mul(g, s.x, s.y));
    CHECK(kmp_div(g, nx, s.y) == kmp_neg(kmp_div(g, s.x, s.y)) && kmp_div(g, nx, ny) == kmp_div(g, s.x, s.y));
    CHECK(kmp_sin(g, nx) == kmp_neg(kmp_sin(g, s.x)) && kmp_cos(g, nx) == kmp_cos(g, s.x));
    CHECK(kmp_sqrt(g, nx) != kmp_sqrt(g, s.x) && kmp_sqrt(g, nx) != kmp_neg(kmp_sqrt(g, s.x)));
    CHECK(kmp_unary(g, KMP_OP_EXP, nx) != kmp_unary(g, KMP_OP_EXP, s.x));
    kmp_graph_free(g);
}

static void test_terms(void)
{
    scene s = new_scene();
    kmp_graph *g = s.g;
    kmp_ref sum = kmp_add(g, s.x, s.y), two = kmp_const(g, 2), half = kmp_const(g, 0.5);
    CHECK(kmp_sub(g, s.x, s.x) == KMP_ZERO && kmp_sub(g, sum, sum) == KMP_ZERO);
    CHECK(kmp_sub(g, sum, s.x) == s.y && kmp_sub(g, sum, s.y) == s.x && kmp_sub(g, s.x, sum) == kmp_neg(s.y));
    CHECK(kmp_add(g, kmp_sub(g, s.x, s.y), s.y) == s.x && kmp_add(g, s.y, kmp_sub(g, s.x, s.y)) == s.x);
    CHECK(kmp_add(g, s.x, s.x) == kmp_mul(g, two, s.x));
    CHECK(kmp_add(g, kmp_mul(g, two, s.x), kmp_mul(g, half, s.x)) == kmp_mul(g, kmp_const(g, 2.5), s.x));
    CHECK(kmp_sub(g, kmp_mul(g, two, s.x), kmp_mul(g, kmp_const(g, 3), s.x)) == kmp_neg(s.x));
    CHECK(kmp_sub(g, kmp_mul(g, two, s.x), s.x) == s.x);
    CHECK(kmp_mul(g, two, kmp_mul(g, half, s.x)) == s.x);
    CHECK(kmp_add(g, kmp_add(g, two, s.x), half) == kmp_add(g, kmp_const(g, 2.5), s.x));
    CHECK(kmp_sub(g, kmp_add(g, two, s.x), two) == s.x);
    kmp_ref yx = kmp_mul(g, s.y, s.x);
    CHECK(kmp_mul(g, yx, s.x) == kmp_mul(g, s.y, kmp_mul(g, s.x, s.x)));
    kmp_graph_free(g);
}

static void test_pythagoras(void)
{
    scene s = new_scene();
    kmp_graph *g = s.g;
    kmp_ref sx = kmp_sin(g, s.x), cx = kmp_cos(g, s.x), cy = kmp_cos(g, s.y), five = kmp_const(g, -5);
    kmp_ref ss = kmp_mul(g, sx, sx), cc = kmp_mul(g, cx, cx), yy = kmp_mul(g, cy, cy);
    CHECK(kmp_add(g, ss, cc) == KMP_ONE && kmp_add(g, cc, ss) == KMP_ONE);
    CHECK(kmp_add(g, kmp_mul(g, five, ss), kmp_mul(g, five, cc)) == five);
    CHECK(kmp_sub(g, kmp_neg(ss), cc) == kmp_neg(KMP_ONE));
    CHECK(kmp_graph_node(g, kmp_id(kmp_add(g, ss, yy)))->op == KMP_OP_ADD);
    CHECK(kmp_graph_node(g, kmp_id(kmp_sub(g, ss, cc)))->op == KMP_OP_ADD);
    CHECK(kmp_graph_node(g, kmp_id(kmp_add(g, ss, kmp_mul(g, five, cc))))->op == KMP_OP_ADD);
    kmp_graph_free(g);
}

static void test_hash_consing(void)
{
    scene s = new_scene();
    kmp_graph *g = s.g;
    kmp_ref a = kmp_add(g, s.x, s.y), b = kmp_mul(g, s.x, s.y), c = kmp_div(g, s.x, s.y), d = kmp_sin(g, a);
    uint32_t count = kmp_graph_count(g);
    CHECK(kmp_add(g, s.y, s.x) == a && kmp_mul(g, s.y, s.x) == b && kmp_div(g, s.x, s.y) == c && kmp_sin(g, a) == d);
    CHECK(kmp_input(g, KMP_IN_Q, 1) == s.y && kmp_input(g, KMP_IN_QD, 0) == s.z);
    CHECK(kmp_graph_count(g) == count);
    CHECK(kmp_div(g, s.y, s.x) != c && kmp_input(g, KMP_IN_Q, 0) != kmp_input(g, KMP_IN_QD, 0));
    for (uint32_t k = 0; k < 5000; k++) /* many growths of the table */
        (void)kmp_add(g, s.x, kmp_input(g, KMP_IN_MU, k));
    CHECK(kmp_add(g, s.y, s.x) == a && kmp_const(g, 1) == KMP_ONE && !kmp_graph_failed(g));
    bool sorted = true; /* operands precede */
    for (uint32_t id = 2; id < kmp_graph_count(g); id++) {
        const kmp_node *n = kmp_graph_node(g, id);
        for (int k = 0; k < kmp_op_arity((kmp_op)n->op); k++)
            sorted = sorted && kmp_id(kmp_operand(n, k)) < id;
    }
    CHECK(sorted);
    kmp_graph_free(g);
}

/* Nodes are sought near their youngest operand: they are found where one operand has many, and found quickly. */
static void test_many_of_one(void)
{
    enum { MANY = 40000 };
    scene s = new_scene();
    for (uint32_t k = 0; k < MANY; k++)
        (void)kmp_input(s.g, KMP_IN_QD, k);
    kmp_ref young = kmp_sin(s.g, s.x);
    for (uint32_t k = 0; k < MANY; k++)
        (void)kmp_mul(s.g, young, kmp_input(s.g, KMP_IN_QD, k));
    uint32_t count = kmp_graph_count(s.g);
    for (uint32_t k = 0; k < MANY; k++) {
        kmp_ref other = kmp_input(s.g, KMP_IN_QD, k), product = kmp_mul(s.g, other, young);
        const kmp_node *n = kmp_graph_node(s.g, kmp_id(product));
        CHECK(n->op == KMP_OP_MUL && n->a + n->b == young + other);
    }
    CHECK(count == kmp_graph_count(s.g) && count > 2 * MANY);
    kmp_graph_free(s.g);
}

/* -- rotation ---------------------------------------------------------------------------------------- */

static void test_rotation_back(void)
{
    scene s = new_scene();
    kmp_graph *g = s.g;
    kmp_ref a = kmp_input(g, KMP_IN_Q, 7), b = kmp_input(g, KMP_IN_Q, 8), y = s.x, z = s.y;
    kmp_rotate(g, a, &y, &z);
    CHECK(y == kmp_sub(g, kmp_mul(g, s.x, kmp_cos(g, a)), kmp_mul(g, s.y, kmp_sin(g, a))));
    CHECK(z == kmp_add(g, kmp_mul(g, s.x, kmp_sin(g, a)), kmp_mul(g, s.y, kmp_cos(g, a))));
    kmp_rotate(g, kmp_neg(a), &y, &z);
    CHECK(y == s.x && z == s.y);
    y = KMP_ZERO; /* one component only, two angles, back in the order of going */
    z = kmp_const(g, 0.3);
    kmp_rotate(g, a, &y, &z);
    kmp_rotate(g, b, &y, &z);
    kmp_rotate(g, kmp_neg(a), &y, &z);
    kmp_rotate(g, kmp_neg(b), &y, &z);
    CHECK(y == KMP_ZERO && z == kmp_const(g, 0.3));
    y = z = KMP_ZERO;
    kmp_rotate(g, a, &y, &z);
    CHECK(y == KMP_ZERO && z == KMP_ZERO);
    kmp_graph_free(g);
}

static void test_rotation_sum(void)
{
    scene s = new_scene();
    kmp_graph *g = s.g;
    kmp_ref a = kmp_input(g, KMP_IN_Q, 7), b = kmp_input(g, KMP_IN_Q, 8), y = s.x, z = s.y, u = s.x, v = s.y;
    kmp_rotate(g, a, &y, &z);
    kmp_rotate(g, b, &y, &z);
    kmp_rotate(g, kmp_add(g, a, b), &u, &v);
    CHECK(y == u && z == v);
    u = s.x;
    v = s.y;
    kmp_rotate(g, b, &u, &v);
    kmp_rotate(g, a, &u, &v);
    CHECK(y == u && z == v);
    CHECK(kmp_angle_add(g, kmp_sub(g, a, b), kmp_add(g, b, s.x)) == kmp_add(g, s.x, a));
    kmp_graph_free(g);
}

static void test_rotation_quarters(void)
{
    scene s = new_scene();
    kmp_graph *g = s.g;
    kmp_ref a = kmp_input(g, KMP_IN_Q, 7), y = s.x, z = s.y;
    kmp_rotate(g, a, &y, &z);
    kmp_ref turned[4][2] = {{y, z}, {kmp_neg(z), y}, {kmp_neg(y), kmp_neg(z)}, {z, kmp_neg(y)}};
    kmp_ref source[4][2] = {{s.x, s.y}, {kmp_neg(s.y), s.x}, {kmp_neg(s.x), kmp_neg(s.y)}, {s.y, kmp_neg(s.x)}};
    for (int k = 0; k < 4; k++) {
        kmp_rotate(g, kmp_neg(a), &turned[k][0], &turned[k][1]);
        CHECK(turned[k][0] == source[k][0] && turned[k][1] == source[k][1]);
    }
    kmp_graph_free(g);
}

/* A result with a zero component is known by its other one. */
static void test_rotation_onto_axis(void)
{
    scene s = new_scene();
    kmp_graph *g = s.g;
    kmp_ref y = kmp_sin(g, s.x), z = kmp_cos(g, s.x);
    kmp_rotate(g, s.x, &y, &z);
    CHECK(y == KMP_ZERO && z == KMP_ONE);
    kmp_rotate(g, kmp_neg(s.x), &y, &z);
    CHECK(y == kmp_sin(g, s.x) && z == kmp_cos(g, s.x));
    kmp_graph_free(g);
}

/* Sums of more terms than any table of the implementation holds keep them all. */
static void test_long_angles(void)
{
    enum { TERMS = 100 };
    kmp_graph *g = kmp_graph_new();
    kmp_ref sum = KMP_ZERO, one = kmp_input(g, KMP_IN_Q, TERMS);
    double q[TERMS + 1], expected = 0;
    for (uint32_t k = 0; k <= TERMS; k++)
        q[k] = 1 + k;
    for (uint32_t k = 0; k < TERMS; k++) {
        sum = kmp_angle_add(g, sum, kmp_input(g, KMP_IN_Q, k));
        expected += q[k];
    }
    kmp_ref left = kmp_angle_add(g, one, sum), right = kmp_angle_add(g, sum, one);
    double *value = KMP_NEW(double, kmp_graph_count(g));
    kmp_graph_eval(g, (const double *const[KMP_IN_COUNT]){[KMP_IN_Q] = q}, value);
    CHECK_NEAR(value_of(value, sum), expected, 1e-15);
    CHECK_NEAR(value_of(value, left), expected + q[TERMS], 1e-15);
    CHECK_NEAR(value_of(value, right), expected + q[TERMS], 1e-15);
    kmp_free(value);
    kmp_graph_free(g);
}

/* -- values and derivatives -------------------------------------------------------------------------- */

static void random_point(double *x, double *xd)
{
    for (int k = 0; k < GRAPH_INPUTS; k++) {
        x[k] = between(-1.5, 1.5);
        xd[k] = between(-1, 1);
    }
}

/* Central difference along xd of all steps, with two extrapolations; `error` is what the last one changed. */
static void differences(const steps *s, const double *x, const double *xd, double *d, double *error)
{
    double table[3][GRAPH_STEPS], up[GRAPH_STEPS], down[GRAPH_STEPS], moved[GRAPH_INPUTS];
    for (int level = 0; level < 3; level++) {
        double h = ldexp(4e-3, -level);
        for (int k = 0; k < GRAPH_INPUTS; k++)
            moved[k] = x[k] + h * xd[k];
        steps_eval(s, moved, up);
        for (int k = 0; k < GRAPH_INPUTS; k++)
            moved[k] = x[k] - h * xd[k];
        steps_eval(s, moved, down);
        for (int k = 0; k < s->count; k++)
            table[level][k] = (up[k] - down[k]) / (2 * h);
    }
    for (int k = 0; k < s->count; k++) {
        double first = (4 * table[1][k] - table[0][k]) / 3, second = (4 * table[2][k] - table[1][k]) / 3;
        d[k] = (16 * second - first) / 15;
        error[k] = fabs(d[k] - second);
    }
}

static int compared, skipped;

/* One random expression list: values of the graph and of its derivatives. */
static void compare_steps(uint64_t seed)
{
    double x[GRAPH_INPUTS], xd[GRAPH_INPUTS], v[GRAPH_STEPS], d[GRAPH_STEPS], error[GRAPH_STEPS];
    kmp_ref r[GRAPH_STEPS], dr[GRAPH_STEPS], leaf[GRAPH_INPUTS], direction[GRAPH_INPUTS];
    steps s;
    random_seed(seed);
    random_point(x, xd);
    random_steps(&s, GRAPH_STEPS / 2, x);
    steps_eval(&s, x, v);
    differences(&s, x, xd, d, error);
    kmp_graph *g = kmp_graph_new();
    steps_build(&s, g, r);
    for (uint32_t k = 0; k < GRAPH_INPUTS; k++) {
        leaf[k] = kmp_input(g, KMP_IN_Q, k);
        direction[k] = kmp_input(g, KMP_IN_QD, k);
    }
    kmp_derivative *along = kmp_derivative_new(g, GRAPH_INPUTS, leaf, direction);
    for (int k = s.count - 1; k >= 0; k--)
        dr[k] = kmp_derivative_of(along, r[k]);
    double *value = KMP_NEW(double, kmp_graph_count(g));
    kmp_graph_eval(g, (const double *const[KMP_IN_COUNT]){[KMP_IN_Q] = x, [KMP_IN_QD] = xd}, value);
    for (int k = 0; k < s.count; k++) {
        bool smooth = error[k] < 1e-9 * fmax(1, fabs(d[k]));
        CHECK_NEAR(value_of(value, r[k]), v[k], 1e-12 * fmax(1, fabs(d[k])));
        compared += smooth;
        skipped += !smooth;
        if (smooth)
            CHECK_NEAR(value_of(value, dr[k]), d[k], 1e-8);
    }
    kmp_free(value);
    kmp_derivative_free(along);
    kmp_graph_free(g);
}

static void test_random_graphs(void)
{
    for (uint64_t seed = 1; seed <= 200; seed++)
        compare_steps(seed);
    printf("  %d derivatives compared, %d too steep for differences\n", compared, skipped);
    CHECK(compared > 20 * skipped);
}

/* Value of a function at point + h direction. */
static double function_at(kmp_op op, const double point[3], double h)
{
    static const double direction[3] = {1, -0.7, 0.4};
    double x[3];
    for (int k = 0; k < 3; k++)
        x[k] = point[k] + h * direction[k];
    return kmp_op_value(op, x[0], x[1], x[2]);
}

/* A function at one point; whether it is defined there. */
static bool compare_function(kmp_op op, const double point[3])
{
    kmp_graph *g = kmp_graph_new();
    kmp_ref x[3], dx[3] = {KMP_ONE};
    for (uint32_t k = 0; k < 3; k++)
        x[k] = kmp_input(g, KMP_IN_Q, k);
    dx[1] = kmp_const(g, -0.7);
    dx[2] = kmp_const(g, 0.4);
    kmp_derivative *d = kmp_derivative_new(g, 3, x, dx);
    kmp_ref f = kmp_operate(g, op, x), df = kmp_derivative_of(d, f);
    double *value = KMP_NEW(double, kmp_graph_count(g)), h = 1e-3;
    double near = (function_at(op, point, h) - function_at(op, point, -h)) / (2 * h);
    double far = (function_at(op, point, 2 * h) - function_at(op, point, -2 * h)) / (4 * h);
    bool defined = !isnan(far);
    kmp_graph_eval(g, (const double *const[KMP_IN_COUNT]){[KMP_IN_Q] = point}, value);
    if (defined) {
        CHECK_NEAR(value_of(value, f), kmp_op_value(op, point[0], point[1], point[2]), 0);
        CHECK_NEAR(value_of(value, df), (4 * near - far) / 3, 1e-8);
    }
    kmp_free(value);
    kmp_derivative_free(d);
    kmp_graph_free(g);
    return defined;
}

/* Every function where it is defined, away from kinks and jumps. */
static void test_function_derivatives(void)
{
    static const double points[][3] = {
        {0.3, 0.8, -0.5}, {1.1, 0.4, 2.0}, {2.7, -1.3, 0.6}, {-0.4, 1.2, 0.9}, {-1.6, -0.9, 0.3}};
    for (int op = 0; op < KMP_OP_COUNT; op++) {
        int defined = 0;
        if (kmp_op_form_of((kmp_op)op) != KMP_FORM_FUNCTION)
            continue;
        for (int k = 0; k < 5; k++)
            defined += compare_function((kmp_op)op, points[k]);
        CHECK(defined >= 2);
    }
}

/* Known values: what the rows compute is what their names say. */
static void test_function_values(void)
{
    static const struct {
        kmp_op op;
        double x, y, z, value;
    } rows[] = {{KMP_OP_SINH, 1, 0, 0, 1.1752011936438014},
                {KMP_OP_COSH, 1, 0, 0, 1.5430806348152437},
                {KMP_OP_TANH, 0.5, 0, 0, 0.46211715726000975},
                {KMP_OP_ASIN, 0.5, 0, 0, 0.52359877559829887},
                {KMP_OP_ACOS, 0.5, 0, 0, 1.0471975511965977},
                {KMP_OP_ATAN, 1, 0, 0, 0.78539816339744831},
                {KMP_OP_ABS, -2, 0, 0, 2},
                {KMP_OP_SIGN, -2, 0, 0, -1},
                {KMP_OP_SIGN, 0, 0, 0, 0},
                {KMP_OP_POW, 2, 10, 0, 1024},
                {KMP_OP_ATAN2, 1, -1, 0, 2.3561944901923449},
                {KMP_OP_MIN, 2, -1, 0, -1},
                {KMP_OP_MAX, 2, -1, 0, 2},
                {KMP_OP_LESS, 1, 2, 0, 1},
                {KMP_OP_LESS, 2, 2, 0, 0},
                {KMP_OP_SELECT, 1, 5, NAN, 5},
                {KMP_OP_SELECT, 0, INFINITY, 6, 6}};
    for (size_t k = 0; k < sizeof rows / sizeof *rows; k++)
        CHECK_NEAR(kmp_op_value(rows[k].op, rows[k].x, rows[k].y, rows[k].z), rows[k].value, 1e-15);
    CHECK(isnan(kmp_op_value(KMP_OP_MIN, NAN, 1, 0)) && isnan(kmp_op_value(KMP_OP_MIN, 1, NAN, 0)));
    CHECK(isnan(kmp_op_value(KMP_OP_MAX, NAN, 1, 0)) && isnan(kmp_op_value(KMP_OP_MAX, 1, NAN, 0)));
    CHECK(isnan(kmp_op_value(KMP_OP_SIGN, NAN, 0, 0)));
}

static void test_choices(void)
{
    scene s = new_scene();
    kmp_graph *g = s.g;
    kmp_ref less = kmp_less(g, s.x, s.y), nx = kmp_neg(s.x), ny = kmp_neg(s.y), two = kmp_const(g, 2);
    CHECK(kmp_less(g, KMP_ONE, two) == KMP_ONE && kmp_less(g, two, KMP_ONE) == KMP_ZERO);
    CHECK(kmp_less(g, s.x, s.x) == KMP_ZERO && kmp_less(g, ny, nx) == less);
    CHECK(kmp_less(g, nx, KMP_ZERO) == kmp_less(g, KMP_ZERO, s.x) && kmp_less(g, s.x, KMP_ZERO) != less);
    CHECK(kmp_less(g, KMP_ZERO, nx) == kmp_less(g, s.x, KMP_ZERO));
    CHECK(kmp_select(g, KMP_ONE, s.x, s.y) == s.x && kmp_select(g, KMP_ZERO, s.x, s.y) == s.y);
    CHECK(kmp_select(g, less, s.x, s.x) == s.x &&
          kmp_select(g, less, nx, ny) == kmp_neg(kmp_select(g, less, s.x, s.y)));
    CHECK(kmp_binary(g, KMP_OP_MIN, s.x, s.x) == s.x && kmp_unary(g, KMP_OP_ABS, nx) == kmp_unary(g, KMP_OP_ABS, s.x));
    CHECK(kmp_unary(g, KMP_OP_ATAN, nx) == kmp_neg(kmp_unary(g, KMP_OP_ATAN, s.x)));
    CHECK(kmp_binary(g, KMP_OP_POW, s.x, two) == kmp_mul(g, s.x, s.x));
    CHECK(kmp_binary(g, KMP_OP_POW, two, s.x) != kmp_binary(g, KMP_OP_POW, s.x, s.y));
    kmp_ref one = KMP_ONE, root = kmp_select(g, less, kmp_sqrt(g, s.x), KMP_ZERO);
    kmp_derivative *d = kmp_derivative_new(g, 1, &s.x, &one);
    CHECK(kmp_derivative_of(d, less) == KMP_ZERO); /* and the branch not taken never meets the other */
    CHECK(kmp_graph_node(g, kmp_id(kmp_derivative_of(d, root)))->op == KMP_OP_SELECT);
    kmp_derivative_free(d);
    kmp_graph_free(g);
}

/* The derivative of a rotated pair is found in the pair: no new products but those with the rate. */
static void test_pair_derivative(void)
{
    scene s = new_scene();
    kmp_graph *g = s.g;
    kmp_ref y = kmp_const(g, 0.3), z = kmp_const(g, -0.7), one = KMP_ONE;
    kmp_rotate(g, s.x, &y, &z);
    kmp_derivative *d = kmp_derivative_new(g, 1, &s.x, &one);
    CHECK(kmp_derivative_of(d, y) == kmp_neg(z) && kmp_derivative_of(d, z) == y);
    CHECK(kmp_derivative_of(d, s.y) == KMP_ZERO && kmp_derivative_of(d, kmp_neg(s.x)) == kmp_neg(KMP_ONE));
    kmp_derivative_free(d);
    kmp_graph_free(g);
}

/* -- determinism ------------------------------------------------------------------------------------- */

static char *program_text(uint64_t seed)
{
    double x[GRAPH_INPUTS], xd[GRAPH_INPUTS];
    steps s;
    kmp_ref r[GRAPH_STEPS];
    kmp_text text = {0};
    random_seed(seed);
    random_point(x, xd);
    random_steps(&s, GRAPH_STEPS, x);
    kmp_graph *g = kmp_graph_new();
    steps_build(&s, g, r);
    const kmp_ref *group = r;
    kmp_program *p = kmp_program_new(g, 1, &s.count, &group);
    kmp_program_print(p, NULL, &text);
    kmp_program_free(p);
    kmp_graph_free(g);
    return kmp_text_take(&text);
}

static void test_determinism(void)
{
    for (uint64_t seed = 1; seed <= 20; seed++) {
        char *first = program_text(seed), *other = program_text(seed + 1000), *again = program_text(seed);
        CHECK(first && again && strlen(first) > 100);
        CHECK_TEXT(again, first);
        CHECK(strcmp(first, other) != 0);
        kmp_free(first);
        kmp_free(other);
        kmp_free(again);
    }
}

/* Compilers evaluate arguments in different orders. Of two nodes made in a call the last one has the lower number. */
static void test_order_of_arguments(void)
{
    kmp_graph *g = kmp_graph_new();
    kmp_ref x[32];
    for (uint32_t k = 0; k < 32; k++)
        x[k] = kmp_input(g, KMP_IN_Q, k);
    (void)kmp_add(g, kmp_sin(g, x[0]), kmp_sin(g, x[1]));
    (void)kmp_sub(g, kmp_sin(g, x[2]), kmp_sin(g, x[3]));
    (void)kmp_mul(g, kmp_sin(g, x[4]), kmp_sin(g, x[5]));
    (void)kmp_div(g, kmp_sin(g, x[6]), kmp_sin(g, x[7]));
    (void)kmp_less(g, kmp_sin(g, x[8]), kmp_sin(g, x[9]));
    (void)kmp_binary(g, KMP_OP_ATAN2, kmp_sin(g, x[10]), kmp_sin(g, x[11]));
    (void)kmp_select(g, x[31], kmp_sin(g, x[12]), kmp_sin(g, x[13]));
    (void)kmp_mul(g, kmp_add(g, x[31], kmp_sin(g, x[14])), kmp_add(g, x[31], kmp_sin(g, x[15])));
    for (int k = 0; k < 16; k += 2)
        CHECK(kmp_sin(g, x[k]) > kmp_sin(g, x[k + 1]));
    kmp_graph_free(g);
}

/* The gradient of an expression is its row of the matrix of partial derivatives, node by node; again after others. */
static void gradient_of_one(void)
{
    for (int i = 0; i < 50; i++) {
        steps s;
        kmp_ref r[GRAPH_STEPS], all[GRAPH_INPUTS], *slope;
        double x[GRAPH_INPUTS];
        int *index;
        random_seed((uint64_t)i);
        for (int k = 0; k < GRAPH_INPUTS; k++)
            x[k] = between(-2, 2);
        kmp_graph *g = kmp_graph_new();
        random_steps(&s, GRAPH_STEPS / 2, x);
        steps_build(&s, g, r);
        for (int of = 0; of < s.count; of += 7) {
            kmp_partials_all(g, 1, &r[of], KMP_IN_Q, GRAPH_INPUTS, all);
            const int count = kmp_gradient(g, r[of], KMP_IN_Q, GRAPH_INPUTS, &index, &slope);
            for (int k = 0; k < count; k++) {
                CHECK(k == 0 || index[k] > index[k - 1]);
                CHECK(slope[k] == all[index[k]]);
                all[index[k]] = KMP_ZERO;
            }
            for (int k = 0; k < GRAPH_INPUTS; k++)
                CHECK(all[k] == KMP_ZERO);
        }
        CHECK(!kmp_graph_failed(g));
        kmp_graph_free(g);
    }
}

/* The gradient by one pass from an expression down to the inputs is the one by passes from each input, in values; also
 * of an expression and its derivative, whose rotated pairs are others. */
static void gradient_backward(void)
{
    for (int i = 0; i < 200; i++) {
        steps s;
        kmp_ref r[GRAPH_STEPS], leaf[GRAPH_INPUTS], all[2][GRAPH_INPUTS], down[2][GRAPH_INPUTS];
        double x[GRAPH_INPUTS], xd[GRAPH_INPUTS];
        random_seed((uint64_t)i + 1);
        random_point(x, xd);
        random_steps(&s, GRAPH_STEPS / 2, x);
        kmp_graph *g = kmp_graph_new();
        steps_build(&s, g, r);
        for (uint32_t k = 0; k < GRAPH_INPUTS; k++)
            leaf[k] = kmp_input(g, KMP_IN_Q, k);
        kmp_ref of[2] = {KMP_ZERO, KMP_ZERO};
        for (int k = 0; k < s.count; k++)
            of[0] = kmp_add(g, of[0], kmp_mul(g, kmp_const(g, 0.3 + k % 5), r[k]));
        kmp_derivatives_by(g, leaf[i % GRAPH_INPUTS], 1, &of[0], &of[1]);
        for (int k = 0; k < 2; k++) {
            kmp_gradient_backward(g, kmp_neg(of[k]), GRAPH_INPUTS, leaf, down[k]);
            kmp_partials_all(g, 1, &of[k], KMP_IN_Q, GRAPH_INPUTS, all[k]);
        }
        double *value = KMP_NEW(double, kmp_graph_count(g));
        kmp_graph_eval(g, (const double *const[KMP_IN_COUNT]){[KMP_IN_Q] = x}, value);
        for (int k = 0; k < 2 * GRAPH_INPUTS; k++) {
            const double expected = value_of(value, all[k / GRAPH_INPUTS][k % GRAPH_INPUTS]);
            const double found = value_of(value, down[k / GRAPH_INPUTS][k % GRAPH_INPUTS]);
            CHECK_NEAR(-found, expected, 1e-9 * fmax(1, fabs(expected)));
        }
        CHECK(!kmp_graph_failed(g));
        kmp_free(value);
        kmp_graph_free(g);
    }
    kmp_graph *g = kmp_graph_new();
    kmp_ref q = kmp_input(g, KMP_IN_Q, 0), other = kmp_input(g, KMP_IN_Q, 1), by[2], slope[2];
    const kmp_ref push = kmp_binary(g, KMP_OP_MAX, q, KMP_ZERO),
                  power = kmp_mul(g, kmp_sqrt(g, push), kmp_mul(g, push, other));
    kmp_gradient_backward(g, power, 2, (const kmp_ref[]){q, other}, by);
    kmp_gradient_backward(g, KMP_ONE, 2, (const kmp_ref[]){q, other}, slope);
    CHECK(slope[0] == KMP_ZERO && slope[1] == KMP_ZERO);
    for (int k = 0; k < 2; k++) { /* max(q, 0)^1.5 times another one, also where it begins */
        const double x[] = {k ? 0.49 : 0, 2};
        double *value = KMP_NEW(double, kmp_graph_count(g));
        kmp_graph_eval(g, (const double *const[KMP_IN_COUNT]){[KMP_IN_Q] = x}, value);
        CHECK_NEAR(value_of(value, by[0]), k ? 2.1 : 0, 1e-15);
        CHECK_NEAR(value_of(value, by[1]), k ? 0.343 : 0, 1e-15);
        kmp_free(value);
    }
    kmp_graph_free(g);
}

/* A value that is not chosen may be NaN, with its slopes; also of min and max, and where a chosen value shares a part
 * of it. The change of the gradient along a direction is as finite. */
static void gradient_of_choices(void)
{
    kmp_graph *g = kmp_graph_new();
    const kmp_ref x = kmp_input(g, KMP_IN_Q, 0), y = kmp_input(g, KMP_IN_Q, 1), leaf[] = {x, y};
    const kmp_ref root = kmp_sqrt(g, x), inside = kmp_mul(g, kmp_unary(g, KMP_OP_LOG, x), kmp_mul(g, y, root));
    const kmp_ref one_of = kmp_select(g, kmp_less(g, KMP_ZERO, x), inside, kmp_mul(g, y, y));
    const kmp_ref cut =
        kmp_binary(g, KMP_OP_MIN, kmp_div(g, y, kmp_binary(g, KMP_OP_MAX, x, KMP_ZERO)), kmp_mul(g, x, y));
    const kmp_ref of = kmp_add(g, one_of, kmp_mul(g, kmp_const(g, 2), cut));
    kmp_ref down[2], bent[4];
    kmp_gradient_backward(g, of, 2, leaf, down);
    for (int k = 0; k < 2; k++)
        kmp_derivatives_by(g, leaf[k], 2, down, bent + 2 * k);
    for (int k = 0; k < 2; k++) {
        const double at[] = {k ? 4 : -1, 3}, s = log(4.0); /* log(x) y sqrt(x) + 2 y / x; y^2 + 2 x y */
        const double slope[2][2] = {{6, 4}, {3 * (2.0 / 4 + s / 4) - 6.0 / 16, 2 * s + 0.5}};
        const double curve[2][4] = {{0, 2, 2, 2},
                                    {-3 * s / 32 + 12.0 / 64, 0.5 + s / 4 - 2.0 / 16, 0.5 + s / 4 - 2.0 / 16, 0}};
        double *value = KMP_NEW(double, kmp_graph_count(g));
        kmp_graph_eval(g, (const double *const[KMP_IN_COUNT]){[KMP_IN_Q] = at}, value);
        for (int i = 0; i < 2; i++)
            CHECK_NEAR(value_of(value, down[i]), slope[k][i], 1e-14);
        for (int i = 0; i < 4; i++)
            CHECK_NEAR(value_of(value, bent[i]), curve[k][i], 1e-14);
        kmp_free(value);
    }
    kmp_graph_free(g);
}

int main(void)
{
    TEST(test_numbers);
    TEST(test_neutral);
    TEST(test_signs);
    TEST(test_terms);
    TEST(test_pythagoras);
    TEST(test_hash_consing);
    TEST(test_many_of_one);
    TEST(test_rotation_back);
    TEST(test_rotation_sum);
    TEST(test_rotation_quarters);
    TEST(test_rotation_onto_axis);
    TEST(test_long_angles);
    TEST(test_random_graphs);
    TEST(test_function_derivatives);
    TEST(test_function_values);
    TEST(test_choices);
    TEST(test_pair_derivative);
    TEST(test_determinism);
    TEST(test_order_of_arguments);
    TEST(gradient_of_one);
    TEST(gradient_backward);
    TEST(gradient_of_choices);
    return check_report();
}
