/* SPDX-License-Identifier: BSD-3-Clause */
/* Bounds of programs over a piece of time: no value and no rate along random motions lies outside, of random
 * expressions with all functions and of tables; where nothing moves they are the values themselves; and they close in
 * as the piece becomes short, the values with it and the width of them with its square beside the rates. */
#include "backend/bounds.h"
#include "backend/machine.h"
#include "random.h"
#include "random_graph.h"
#include "symbolic/function_table.h"
#include "testing.h"
#include <math.h>

enum { GRAPHS = 3000, SAMPLES = 33 };

/* Parabolas in time, from 0 to h. */
typedef struct motion {
    double x[GRAPH_INPUTS], v[GRAPH_INPUTS], a[GRAPH_INPUTS], h;
} motion;

static double place(const motion *m, int k, double t)
{
    return m->x[k] + t * (m->v[k] + t * m->a[k]);
}

static kmp_bound bound_of(const motion *m, int k)
{
    double end = m->v[k] + 2 * m->a[k] * m->h, turn = m->a[k] == 0 ? -1 : -0.5 * m->v[k] / m->a[k];
    double low = fmin(place(m, k, 0), place(m, k, m->h)), high = fmax(place(m, k, 0), place(m, k, m->h));
    if (turn > 0 && turn < m->h) {
        low = fmin(low, place(m, k, turn));
        high = fmax(high, place(m, k, turn));
    }
    return (kmp_bound){low, high, fmin(m->v[k], end), fmax(m->v[k], end)};
}

static void run_bounds(kmp_bounds *b, const kmp_program *p, const motion *m)
{
    for (int k = 0; k < p->input_count; k++)
        kmp_bounds_set(b, k, bound_of(m, (int)p->input[k].index));
    kmp_bounds_run(b, true);
}

static void evaluate(kmp_machine *machine, const motion *m, double t, int count, double *out)
{
    double x[GRAPH_INPUTS];
    for (int k = 0; k < GRAPH_INPUTS; k++)
        x[k] = place(m, k, t);
    kmp_machine_set(machine, KMP_IN_Q, x);
    memcpy(out, kmp_machine_run(machine, 1), (size_t)count * sizeof *out);
}

/* The observed rate of an output between two times is its mean. Returns how many bounds were finite. */
static int check_bounds(const kmp_bounds *b, kmp_machine *machine, const motion *m, int count)
{
    double now[GRAPH_STEPS], before[GRAPH_STEPS] = {0};
    int finite = 0;
    for (int i = 0; i < SAMPLES; i++) {
        evaluate(machine, m, m->h * i / (SAMPLES - 1), count, now);
        for (int k = 0; k < count; k++) {
            kmp_bound r = kmp_bounds_get(b, k);
            double slack = 1e-12 * fmax(1, fabs(now[k])), rate = (now[k] - before[k]) * (SAMPLES - 1) / m->h;
            CHECK(isnan(now[k]) || (now[k] >= r.low - slack && now[k] <= r.high + slack));
            slack = (SAMPLES - 1) / m->h * slack + 1e-9 * fabs(rate);
            CHECK(i == 0 || isnan(rate) || (rate >= r.down - slack && rate <= r.up + slack));
            finite += i == 0 && isfinite(r.low) && isfinite(r.high) && isfinite(r.down) && isfinite(r.up);
        }
        memcpy(before, now, sizeof now);
    }
    return finite;
}

static motion random_motion(const double *x, double far)
{
    motion m = {.h = pow(10, between(-3, 0.3))};
    for (int k = 0; k < GRAPH_INPUTS; k++) {
        m.x[k] = x[k];
        m.v[k] = pick(4) ? between(-far, far) : 0;
        m.a[k] = pick(2) ? between(-far, far) : 0;
    }
    return m;
}

static kmp_program *random_program(const double *x, int *count)
{
    steps s;
    kmp_ref r[GRAPH_STEPS];
    kmp_graph *g = kmp_graph_new();
    random_steps(&s, 10 + pick(GRAPH_STEPS - 10), x);
    steps_build(&s, g, r);
    const kmp_ref *group = r;
    kmp_program *p = kmp_program_new(g, 1, &s.count, &group);
    *count = s.count;
    kmp_graph_free(g);
    return p;
}

static void nothing_lies_outside(void)
{
    long finite = 0, all = 0;
    for (int i = 0; i < GRAPHS; i++) {
        double x[GRAPH_INPUTS];
        int count;
        random_seed((uint64_t)i);
        for (int k = 0; k < GRAPH_INPUTS; k++)
            x[k] = between(-2, 2);
        kmp_program *p = random_program(x, &count);
        kmp_arena arena = {0};
        kmp_bounds *b = kmp_bounds_new(p, &arena);
        kmp_machine *machine = kmp_machine_new(p, kmp_backend_find("tape"));
        (void)kmp_machine_run(machine, 0);
        motion m = random_motion(x, i % 3 ? 0.1 : 3);
        run_bounds(b, p, &m);
        finite += check_bounds(b, machine, &m, count);
        all += count;
        kmp_machine_free(machine);
        kmp_arena_free(&arena);
        kmp_program_free(p);
    }
    printf("  %.0f %% of the bounds are finite\n", 100.0 * (double)finite / (double)all);
    CHECK(finite > all / 2);
}

static void what_stands_still_is_known(void)
{
    for (int i = 0; i < 200; i++) {
        double x[GRAPH_INPUTS], value[GRAPH_STEPS];
        int count;
        random_seed((uint64_t)(i + GRAPHS));
        for (int k = 0; k < GRAPH_INPUTS; k++)
            x[k] = between(-2, 2);
        kmp_program *p = random_program(x, &count);
        kmp_arena arena = {0};
        kmp_bounds *b = kmp_bounds_new(p, &arena);
        kmp_machine *machine = kmp_machine_new(p, kmp_backend_find("tape"));
        (void)kmp_machine_run(machine, 0);
        const motion m = {.x = {x[0], x[1], x[2], x[3], x[4]}, .h = 1};
        run_bounds(b, p, &m);
        evaluate(machine, &m, 0, count, value);
        for (int k = 0; k < count; k++) {
            kmp_bound r = kmp_bounds_get(b, k);
            if (r.low == -INFINITY) /* made from a list, which belongs to implicit blocks */
                continue;
            CHECK_NEAR(r.low, value[k], 1e-11 * fmax(1, fabs(value[k])));
            CHECK_NEAR(r.high, value[k], 1e-11 * fmax(1, fabs(value[k])));
        }
        kmp_machine_free(machine);
        kmp_arena_free(&arena);
        kmp_program_free(p);
    }
}

/* Bounds of one output alone are those of a run of all, to the last bit, also after those of another motion. */
static void wanted_ones_are_those_of_all(void)
{
    static int output[GRAPH_STEPS];
    static bool wanted[GRAPH_STEPS];
    for (int i = 0; i < 200; i++) {
        double x[GRAPH_INPUTS];
        int count;
        random_seed((uint64_t)(i + 2 * GRAPHS));
        for (int k = 0; k < GRAPH_INPUTS; k++)
            x[k] = between(-2, 2);
        kmp_program *p = random_program(x, &count);
        kmp_arena arena = {0};
        kmp_bounds *all = kmp_bounds_new(p, &arena), *few = kmp_bounds_new(p, &arena);
        const motion before = random_motion(x, 3), m = random_motion(x, 0.1);
        run_bounds(few, p, &before);
        run_bounds(all, p, &m);
        for (int k = 0; k < p->input_count; k++)
            kmp_bounds_set(few, k, bound_of(&m, (int)p->input[k].index));
        for (int k = 0; k < count; k++) {
            output[k] = k;
            wanted[k] = k == i % count;
        }
        kmp_bounds_want(few, count, output, wanted);
        kmp_bounds_run_wanted(few);
        const kmp_bound a = kmp_bounds_get(all, i % count), b = kmp_bounds_get(few, i % count);
        CHECK(memcmp(&a, &b, sizeof a) == 0);
        kmp_arena_free(&arena);
        kmp_program_free(p);
    }
}

/* |x| - 1/4 through its kink, a window (x - c)^2 < w^2, and a bump that points would miss. */
static void kinks_and_bumps(void)
{
    kmp_graph *g = kmp_graph_new();
    kmp_ref x = kmp_input(g, KMP_IN_Q, 0), off = kmp_sub(g, x, kmp_const(g, 0.1));
    kmp_ref bump = kmp_unary(g, KMP_OP_EXP, kmp_neg(kmp_mul(g, kmp_const(g, 1e6), kmp_mul(g, off, off))));
    kmp_ref out[2] = {kmp_sub(g, kmp_unary(g, KMP_OP_ABS, x), kmp_const(g, 0.25)), kmp_sub(g, kmp_const(g, 0.5), bump)};
    const kmp_ref *group = out;
    const int count = 2;
    kmp_program *p = kmp_program_new(g, 1, &count, &group);
    kmp_arena arena = {0};
    kmp_bounds *b = kmp_bounds_new(p, &arena);
    run_bounds(b, p, &(motion){.x = {-1}, .v = {2}, .h = 1});
    kmp_bound kink = kmp_bounds_get(b, 0), hidden = kmp_bounds_get(b, 1);
    CHECK_NEAR(kink.low, -0.25, 1e-15);
    CHECK_NEAR(kink.high, 0.75, 1e-15);
    CHECK(kink.down == -2 && kink.up == 2);
    CHECK(hidden.low <= -0.5 && hidden.high >= 0.5);
    kmp_arena_free(&arena);
    kmp_program_free(p);
    kmp_graph_free(g);
}

int main(void)
{
    TEST(nothing_lies_outside);
    TEST(what_stands_still_is_known);
    TEST(wanted_ones_are_those_of_all);
    TEST(kinks_and_bumps);
    return check_report();
}
