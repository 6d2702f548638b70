/* SPDX-License-Identifier: BSD-3-Clause */
/* Blocks of averages: those of a Gaussian in closed form, derivatives of first and second order against differences,
 * what overflows when it is not scaled, the same bits from back ends and a program that was written and read, and what
 * the graph itself gives, up to rounding. Random expressions have the same bits with machine code and without. A block
 * of the same expressions is made once. */
#include "backend/layout.h"
#include "backend/machine.h"
#include "base/memory.h"
#include "rail/places/average.h"
#include "random.h"
#include "read_again.h"
#include "symbolic/derivative.h"
#include "symbolic/function_table.h"
#include "symbolic/graph.h"
#include "symbolic/implicit.h"
#include "symbolic/solving.h"
#include "symbolic/table_function.h"
#include <math.h>

enum { PLACES = 81, VALUES = 4, OUTPUTS = 3 * VALUES, STEEP = 500 };

static const double pi = 3.14159265358979323846;

/* E = p2 - p1 (s - p0)^2 + p3 sin(s), of which p2 + needed is asked; averages of s, s^2, cos(p0 s); 0.25 apart. */
static int block_of(kmp_graph *g, double needed)
{
    kmp_graph *l = kmp_graph_new();
    kmp_ref s = kmp_input(l, KMP_IN_Q, 0), p[4];
    double place[PLACES];
    for (uint32_t k = 0; k < 4; k++)
        p[k] = kmp_input(l, KMP_IN_PARAMETER, k);
    for (int k = 0; k < PLACES; k++)
        place[k] = 0.25 * (k - PLACES / 2);
    kmp_ref way = kmp_sub(l, s, p[0]);
    kmp_ref exponent = kmp_sub(l, p[2], kmp_mul(l, p[1], kmp_mul(l, way, way)));
    exponent = kmp_add(l, exponent, kmp_mul(l, p[3], kmp_sin(l, s)));
    const kmp_ref averaged[] = {s, kmp_mul(l, s, s), kmp_cos(l, kmp_mul(l, p[0], s))};
    return kmp_average_in(g, l, 4, exponent, kmp_add(l, p[2], kmp_const(l, needed)), 3, averaged, PLACES, place);
}

/* The block's components along q with their first and second derivatives. */
typedef struct scene {
    kmp_graph *g;
    kmp_ref out[OUTPUTS];
    kmp_program *program;
} scene;

static scene new_scene(void)
{
    scene c = {.g = kmp_graph_new()};
    kmp_graph *g = c.g;
    kmp_ref q = kmp_input(g, KMP_IN_Q, 0), one = KMP_ONE;
    const kmp_ref argument[] = {kmp_mul(g, q, q), kmp_add(g, KMP_ONE, kmp_mul(g, kmp_const(g, 0.1), q)),
                                kmp_mul(g, kmp_const(g, STEEP), q), kmp_input(g, KMP_IN_PARAMETER, 0)};
    kmp_implicit_at(g, block_of(g, -100), argument, c.out);
    for (int order = 1; order < 3; order++) {
        kmp_derivative *d = kmp_derivative_new(g, 1, &q, &one);
        for (int k = 0; k < VALUES; k++)
            c.out[order * VALUES + k] = kmp_derivative_of(d, c.out[(order - 1) * VALUES + k]);
        kmp_derivative_free(d);
    }
    const int count = OUTPUTS;
    const kmp_ref *outputs = c.out;
    c.program = kmp_program_new(g, 1, &count, &outputs);
    CHECK(c.program != NULL);
    return c;
}

static void free_scene(scene *c)
{
    kmp_program_free(c->program);
    kmp_graph_free(c->g);
}

static void run(const kmp_program *program, const char *backend, double q, double p, double *out)
{
    kmp_machine *m = kmp_machine_new(program, kmp_backend_find(backend));
    kmp_machine_set(m, KMP_IN_PARAMETER, &p);
    (void)kmp_machine_run(m, 0);
    kmp_machine_set(m, KMP_IN_Q, &q);
    memcpy(out, kmp_machine_run(m, 1), OUTPUTS * sizeof *out);
    kmp_machine_free(m);
}

/* Without the sine: mean p0, variance 1/(2 p1), log Z = p2 + log(pi/p1)/2, and <cos(p0 s)> of the normal distribution;
 * log Z is up to 900, where exp is beyond all numbers, and down to -900, where it is 0. */
static void a_gaussian_is_exact(void)
{
    scene c = new_scene();
    double least = 0, most = 0;
    for (double q = -1.9; q < 1.9; q += 0.37) {
        double out[OUTPUTS], p0 = q * q, p1 = 1 + 0.1 * q;
        run(c.program, "tape", q, 0, out);
        least = fmin(least, out[0]);
        most = check_max(most, out[0]);
        CHECK_NEAR(out[0], STEEP * q + 0.5 * log(pi / p1), 1e-14);
        CHECK_NEAR(out[1], p0, 1e-13);
        CHECK_NEAR(out[2], p0 * p0 + 0.5 / p1, 1e-13);
        CHECK_NEAR(out[3], cos(p0 * p0) * exp(-p0 * p0 / (4 * p1)), 1e-13);
        CHECK_NEAR(out[VALUES], STEEP - 0.05 / p1, 1e-13);
        CHECK_NEAR(out[VALUES + 1], 2 * q, 1e-12);
        CHECK_NEAR(out[2 * VALUES + 1], 2, 1e-11);
        CHECK_NEAR(out[2 * VALUES], 0.005 / (p1 * p1), 1e-10);
    }
    CHECK(isinf(exp(most)) && exp(least) == 0);
    free_scene(&c);
}

/* Operations of a flat exponent: 11 groups of eight places, all of which count, after two of the places in their
 * middle. Sines and squares of the places alone stand. */
static void operations_are_counted(void)
{
    kmp_graph *g = kmp_graph_new();
    const double arguments[] = {0.3, 0.01, 2, 0.5};
    const long exponents = 8 * (2 + 11), averages = 8 * 11;
    kmp_solving *s = kmp_solving_new(kmp_implicit_block(kmp_graph_implicit(g, block_of(g, -100))), NULL);
    CHECK(!kmp_solving_is_done(s));
    memcpy(kmp_solving_arguments(s), arguments, sizeof arguments);
    for (int k = 0; k < VALUES; k++) /* computed once */
        CHECK(isfinite(kmp_solving_value(s, k)));
    const kmp_counts c = kmp_solving_count(s);
    CHECK(kmp_solving_is_done(s));
    CHECK(c.add == 3 * exponents + 1 && c.mul == 3 * exponents + averages && c.trig == averages);
    CHECK(c.div == 0 && c.other == 0 && c.paper == c.add + c.mul);
    kmp_solving_free(s);
    kmp_graph_free(g);
}

static void derivatives_agree_with_differences(void)
{
    scene c = new_scene();
    const double h = 2e-5;
    for (double q = -1.5; q <= 1.5; q += 0.41) {
        double at[OUTPUTS], low[OUTPUTS], high[OUTPUTS];
        run(c.program, "tape", q, 0.7, at);
        run(c.program, "tape", q - h, 0.7, low);
        run(c.program, "tape", q + h, 0.7, high);
        for (int k = 0; k < 2 * VALUES; k++)
            CHECK_NEAR(at[VALUES + k], (high[k] - low[k]) / (2 * h), 1e-6);
    }
    free_scene(&c);
}

static void all_back_ends_have_the_same_bits(void)
{
    scene c = new_scene();
    kmp_program *back = read_again(c.program);
    for (double q = -1.5; q <= 1.5 && back; q += 0.41) {
        double tape[OUTPUTS], native[OUTPUTS], read[OUTPUTS], p = 0.7;
        run(c.program, "tape", q, p, tape);
        run(c.program, "native", q, p, native);
        run(back, "tape", q, p, read);
        CHECK(memcmp(tape, native, sizeof tape) == 0);
        CHECK(memcmp(tape, read, sizeof tape) == 0);
        double *value = KMP_NEW(double, kmp_graph_count(c.g));
        const double *inputs[KMP_IN_COUNT] = {[KMP_IN_PARAMETER] = &p, [KMP_IN_Q] = &q};
        kmp_graph_eval(c.g, inputs, value);
        for (int k = 0; k < OUTPUTS; k++) {
            double v = value[kmp_id(c.out[k])];
            CHECK_NEAR(kmp_is_negative(c.out[k]) ? -v : v, tape[k], 1e-15);
        }
        kmp_free(value);
    }
    kmp_program_free(back);
    free_scene(&c);
}

enum { LEAVES = 9, MADE = 90, AVERAGED = 6 };

/* A value of earlier ones that stays in bounds. */
static kmp_ref random_value(kmp_graph *l, int table, const kmp_ref *value, int count)
{
    const kmp_ref x = value[pick(count)], y = value[pick(count)], z = value[count - 1 - pick(count / 2)];
    const kmp_ref above = kmp_add(l, KMP_ONE, kmp_mul(l, y, y));
    switch (pick(12)) {
    case 0:
        return kmp_unary(l, KMP_OP_SQRT, above);
    case 1:
        return kmp_div(l, z, above);
    case 2:
        return kmp_binary(l, KMP_OP_MAX, z, pick(2) ? kmp_neg(y) : kmp_const(l, pick(3) - 1));
    case 3:
        return kmp_select(l, kmp_less(l, x, z), y, kmp_neg(z));
    case 4:
        return kmp_table_at(l, table, kmp_sub(l, z, x));
    case 5:
        return kmp_sin(l, kmp_mul(l, z, y));
    case 6:
    case 7:
    case 8:
        return kmp_div(l, kmp_mul(l, z, x), above);
    default:
        return kmp_mul(l, kmp_const(l, 0.5), pick(2) ? kmp_add(l, z, x) : kmp_sub(l, x, z));
    }
}

/* A block of random expressions of the place, four arguments and numbers, at some places. */
static int random_block(kmp_graph *g, kmp_table *table, int places)
{
    kmp_graph *l = kmp_graph_new();
    kmp_ref value[LEAVES + MADE], averaged[AVERAGED];
    const int number = kmp_graph_add_table(l, table);
    double place[PLACES];
    for (int k = 0; k < places; k++)
        place[k] = 10.0 * k / places - 5;
    value[0] = kmp_input(l, KMP_IN_Q, 0);
    for (int k = 1; k < LEAVES; k++)
        value[k] = k < 5 ? kmp_input(l, KMP_IN_PARAMETER, (uint32_t)k - 1) : kmp_const(l, between(-2, 2));
    for (int k = LEAVES; k < LEAVES + MADE; k++)
        value[k] = random_value(l, number, value, k);
    for (int k = 0; k < AVERAGED; k++)
        averaged[k] = value[LEAVES + MADE - 1 - k];
    kmp_ref away = kmp_sub(l, value[0], value[1]);
    kmp_ref exponent = kmp_sub(l, kmp_sin(l, value[LEAVES + MADE / 2]), kmp_mul(l, away, away));
    return kmp_average_in(g, l, 4, exponent, kmp_const(l, pick(2) ? -50 : 30), AVERAGED, averaged, places, place);
}

/* Gives both the same random arguments. Returns true if each average has the same bits in both, or is NaN in both. */
static bool have_equal_bits(kmp_solving *a, kmp_solving *b)
{
    double *arguments[2] = {kmp_solving_arguments(a), kmp_solving_arguments(b)};
    for (int k = 0; k < 4; k++)
        arguments[0][k] = arguments[1][k] = between(-2, 2);
    for (int k = 0; k <= AVERAGED; k++) {
        double x = kmp_solving_value(a, k), y = kmp_solving_value(b, k);
        if (memcmp(&x, &y, sizeof x) != 0 && !(isnan(x) && isnan(y)))
            return false;
    }
    return true;
}

static void random_expressions_have_the_same_bits(void)
{
    const double knots[] = {-2, -0.5, 0.3, 1, 4}, values[] = {1, -1, 0.5, 2, -0.3};
    const kmp_block_runner runner = kmp_layout_runner(&kmp_backend_native);
    kmp_table *table = kmp_table_new(KMP_TABLE_CUBIC, 5, knots, values);
    random_seed(3);
    for (int round = 0; round < 60; round++) {
        kmp_graph *g = kmp_graph_new();
        const kmp_program_block *block =
            kmp_implicit_block(kmp_graph_implicit(g, random_block(g, table, 8 + pick(PLACES - 8))));
        kmp_solving *interpreted = kmp_solving_new(block, NULL), *native = kmp_solving_new(block, &runner);
        int differ = 0;
        for (int k = 0; k < 20; k++)
            differ += !have_equal_bits(interpreted, native);
        CHECK(differ == 0);
        kmp_solving_free(native);
        kmp_solving_free(interpreted);
        kmp_graph_free(g);
    }
    kmp_table_free(table);
}

/* A program from bytes may leave to the places what depends on arguments alone: a table and its slope there. */
static void arguments_alone_at_all_places(void)
{
    const double knots[] = {0, 1, 4}, values[] = {0, 2, 5};
    kmp_graph *g = kmp_graph_new(), *l = kmp_graph_new();
    kmp_table *table = kmp_table_new(KMP_TABLE_LINEAR, 3, knots, values);
    double place[40];
    for (int k = 0; k < 40; k++)
        place[k] = 0.25 * (k - 20);
    kmp_ref s = kmp_input(l, KMP_IN_Q, 0), p = kmp_input(l, KMP_IN_PARAMETER, 0), argument = kmp_input(g, KMP_IN_Q, 0),
            out[3];
    kmp_ref at = kmp_table_at(l, kmp_graph_add_table(l, table), p), one = KMP_ONE;
    kmp_derivative *d = kmp_derivative_new(l, 1, &p, &one);
    const kmp_ref averaged[] = {at, kmp_derivative_of(d, at)}, *group = out + 1;
    kmp_derivative_free(d);
    kmp_implicit_at(g,
                    kmp_graph_add_implicit(
                        g, kmp_average_new(l, 1, kmp_neg(kmp_mul(l, s, s)), kmp_const(l, -9), 2, averaged, 40, place)),
                    &argument, out);
    kmp_program *program = kmp_program_new(g, 1, &(int){2}, &group);
    kmp_program *inner = program->block[0].program;
    CHECK(inner->code[1] > 0);
    inner->code[1] = 0; /* the table's instructions, from stage 0 to the places */
    kmp_machine *m = program ? kmp_machine_new(program, kmp_backend_find("native")) : NULL;
    CHECK(m);
    for (double q = 0.5; m && q < 4; q += 2) {
        kmp_machine_set(m, KMP_IN_Q, &q);
        const double *got = kmp_machine_run(m, 1);
        CHECK_NEAR(got[0], q < 1 ? 2 * q : 1 + q, 1e-14);
        CHECK_NEAR(got[1], q < 1 ? 2 : 1, 1e-14);
    }
    kmp_machine_free(m);
    kmp_program_free(program);
    kmp_table_free(table);
    kmp_graph_free(g);
}

/* If E does not come near `needed`, the values are those of one place near its largest. */
static void far_below_one_place_will_do(void)
{
    kmp_graph *g = kmp_graph_new();
    const kmp_ref argument[] = {kmp_const(g, 1.3), KMP_ONE, KMP_ZERO, KMP_ZERO};
    const double *inputs[KMP_IN_COUNT] = {NULL};
    kmp_ref near[VALUES], away[VALUES];
    kmp_implicit_at(g, block_of(g, -100), argument, near);
    kmp_implicit_at(g, block_of(g, 100), argument, away);
    double *value = KMP_NEW(double, kmp_graph_count(g));
    kmp_graph_eval(g, inputs, value);
    double s = value[kmp_id(away[1])];
    CHECK_NEAR(value[kmp_id(near[1])], 1.3, 1e-13);
    CHECK(fabs(s - 1.3) <= 1 && fabs(s - 1.3) > 1e-6);
    CHECK_NEAR(value[kmp_id(away[2])], s * s, 1e-14);
    CHECK(value[kmp_id(away[0])] < value[kmp_id(near[0])]);
    kmp_free(value);
    kmp_graph_free(g);
}

/* Allocations of a block, those of its expressions included. */
static unsigned long allocations_of(kmp_graph *g, double needed, int *block)
{
    unsigned long before = kmp_memory_count();
    *block = block_of(g, needed);
    return kmp_memory_count() - before;
}

/* An equal block has the same number, and after a return to a mark that of a new one, without being made again. */
static void equal_blocks_are_made_once(void)
{
    kmp_graph *g = kmp_graph_new();
    kmp_graph_mark mark;
    int block[5];
    kmp_ref argument[4] = {KMP_ONE, KMP_ONE, KMP_ZERO, KMP_ZERO}, out[VALUES] = {0}, slope;
    CHECK(kmp_graph_mark_init(&mark, g));
    unsigned long first = allocations_of(g, 3, &block[0]), second = allocations_of(g, 3, &block[1]);
    (void)allocations_of(g, 4, &block[2]);
    CHECK(block[0] == 0 && block[1] == 0 && block[2] == 1);
    CHECK(second < first);
    argument[0] = kmp_input(g, KMP_IN_Q, 0);
    kmp_implicit_at(g, block[0], argument, out);
    kmp_derivatives_by(g, argument[0], 1, &out[1], &slope); /* makes the block of derivatives */
    CHECK(kmp_graph_implicit(g, 2) && !kmp_graph_implicit(g, 3));
    kmp_graph_return(g, &mark);
    CHECK(!kmp_graph_implicit(g, 0));
    CHECK(allocations_of(g, 4, &block[3]) < first && block[3] == 0);
    CHECK(allocations_of(g, 3, &block[4]) < first && block[4] == 1);
    argument[0] = kmp_input(g, KMP_IN_Q, 0);
    kmp_implicit_at(g, block[4], argument, out);
    kmp_derivatives_by(g, argument[0], 1, &out[1], &slope);
    CHECK(slope != KMP_ZERO && kmp_graph_implicit(g, 2) && !kmp_graph_failed(g));
    kmp_graph_mark_free(&mark);
    kmp_graph_free(g);
}

int main(void)
{
    TEST(equal_blocks_are_made_once);
    TEST(far_below_one_place_will_do);
    TEST(arguments_alone_at_all_places);
    TEST(a_gaussian_is_exact);
    TEST(operations_are_counted);
    TEST(derivatives_agree_with_differences);
    TEST(all_back_ends_have_the_same_bits);
    TEST(random_expressions_have_the_same_bits);
    return check_report();
}
