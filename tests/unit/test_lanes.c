/* SPDX-License-Identifier: BSD-3-Clause */
/* Lanes of random programs against one machine a lane, to the last bit: each width, as machine code and as loops, every
 * slot filled with NaN before. */
#include "backend/lanes.h"
#include "backend/machine.h"
#include "base/memory.h"
#include "random_graph.h"
#include "symbolic/function_table.h"
#include "testing.h"

enum { OUTPUTS = 12, PARAMETERS = 3 };

static bool same_bits(double a, double b)
{
    return memcmp(&a, &b, sizeof a) == 0 || (isnan(a) && isnan(b));
}

/* Some outputs are of parameters alone; two groups. */
static kmp_program *random_program(kmp_graph *g, const double *x)
{
    static steps s;
    kmp_ref r[GRAPH_STEPS], first[OUTPUTS], second[OUTPUTS], p[PARAMETERS];
    random_steps(&s, GRAPH_STEPS, x);
    steps_build(&s, g, r);
    for (int k = 0; k < PARAMETERS; k++)
        p[k] = kmp_input(g, KMP_IN_PARAMETER, (uint32_t)k);
    for (int k = 0; k < OUTPUTS; k++) {
        kmp_ref a = r[GRAPH_STEPS - 1 - k], by = kmp_sin(g, kmp_mul(g, p[k % PARAMETERS], p[0]));
        first[k] = k % 2 ? kmp_mul(g, a, by) : kmp_neg(a);
        second[k] = k % 3 ? kmp_add(g, kmp_mul(g, a, r[k + 20]), by) : k % 2 ? by : p[k % PARAMETERS];
    }
    const kmp_ref *groups[] = {first, second};
    return kmp_program_new(g, 2, (const int[]){OUTPUTS, OUTPUTS}, groups);
}

static int compare(const kmp_program *p, kmp_lanes *lanes, kmp_machine *machine, int width, const double *q,
                   const double *parameters)
{
    int bad = 0;
    for (int l = 0; l < width; l++) {
        double one[GRAPH_INPUTS];
        for (int k = 0; k < GRAPH_INPUTS; k++)
            one[k] = q[k * width + l];
        kmp_machine_set(machine, KMP_IN_PARAMETER, parameters + l * PARAMETERS);
        kmp_machine_set(machine, KMP_IN_Q, one);
        kmp_lanes_set_one(lanes, KMP_IN_PARAMETER, l, parameters + l * PARAMETERS);
    }
    kmp_lanes_set(lanes, KMP_IN_Q, q);
    for (int stage = 0; stage < p->stages; stage++) {
        const double *out = kmp_lanes_run(lanes, stage);
        for (int l = 0; l < width; l++) { /* a machine has one instance: all its stages, for each lane anew */
            double one[GRAPH_INPUTS];
            for (int k = 0; k < GRAPH_INPUTS; k++)
                one[k] = q[k * width + l];
            kmp_machine_set(machine, KMP_IN_PARAMETER, parameters + l * PARAMETERS);
            kmp_machine_set(machine, KMP_IN_Q, one);
            const double *expected = NULL;
            for (int s = 0; s <= stage; s++)
                expected = kmp_machine_run(machine, s);
            for (int k = 0; k < p->outputs[stage + 1] - p->outputs[stage]; k++)
                bad += !same_bits(out[k * width + l], expected[k]);
        }
    }
    return bad;
}

static int mismatches(const kmp_program *p, const double *x, int width, bool plain)
{
    enum { NANS = (GRAPH_INPUTS + PARAMETERS) * KMP_LANES_MOST };
    double q[GRAPH_INPUTS * KMP_LANES_MOST], parameters[PARAMETERS * KMP_LANES_MOST], nans[NANS];
    kmp_lanes *lanes = kmp_lanes_new(p, width, plain);
    kmp_machine *machine = kmp_machine_new(p, kmp_backend_find("tape"));
    int bad = 0;
    CHECK(lanes && machine);
    for (int k = 0; k < NANS; k++)
        nans[k] = NAN;
    for (int k = 0; k < GRAPH_INPUTS * width; k++)
        q[k] = x[k / width] + between(-0.1, 0.1);
    for (int k = 0; k < PARAMETERS * width; k++)
        parameters[k] = between(-2, 2);
    bad += compare(p, lanes, machine, width, nans, nans);
    bad += compare(p, lanes, machine, width, q, parameters);
    bad += compare(p, lanes, machine, width, q, parameters);
    kmp_lanes_free(lanes);
    kmp_machine_free(machine);
    return bad;
}

static void test_each_lane_is_a_machine(void)
{
    static const int widths[] = {1, 2, 3, 4, 5, 8, 16};
    random_seed(11);
    for (int trial = 0; trial < 40; trial++) {
        double x[GRAPH_INPUTS];
        for (int k = 0; k < GRAPH_INPUTS; k++)
            x[k] = between(-1, 1);
        kmp_graph *g = kmp_graph_new();
        kmp_program *p = random_program(g, x);
        CHECK(p != NULL);
        for (size_t w = 0; p && w < sizeof widths / sizeof *widths; w++)
            for (int plain = 0; plain < 2; plain++)
                CHECK(mismatches(p, x, widths[w], plain) == 0);
        kmp_program_free(p);
        kmp_graph_free(g);
    }
}

static void test_best(void)
{
    kmp_graph *g = kmp_graph_new();
    kmp_ref x = kmp_input(g, KMP_IN_Q, 0), out = kmp_mul(g, x, kmp_add(g, x, KMP_ONE));
    const kmp_ref *group = &out;
    kmp_program *p = kmp_program_new(g, 1, (const int[]){1}, &group);
    kmp_lanes *plain = kmp_lanes_new(p, kmp_lanes_best(), true), *best = kmp_lanes_new(p, kmp_lanes_best(), false);
    CHECK(kmp_lanes_best() == 4 || kmp_lanes_best() == KMP_LANES_MOST);
    CHECK(plain && best && !kmp_lanes_native(plain));
#if defined(__AVX512F__)
    CHECK(kmp_lanes_native(best));
#endif
    printf("  %d lanes, %s\n", kmp_lanes_best(), kmp_lanes_native(best) ? "machine code" : "loops");
    kmp_lanes_free(plain);
    kmp_lanes_free(best);
    kmp_program_free(p);
    kmp_graph_free(g);
}

/* Sines and cosines that are none. */
static void mark(void *user, int first, int n, double *v, const uint32_t *x, const uint32_t *s, const uint32_t *c)
{
    (void)user, (void)first, (void)x;
    for (int k = 0; k < n; k++)
        for (int l = 0; l < 8; l++) {
            v[8 * s[k] + (uint32_t)l] = 7;
            v[8 * c[k] + (uint32_t)l] = 9;
        }
}

/* They come from the other program where its angles have the same bits, also from another of its angles, and otherwise
 * from their functions. */
static void test_borrowed_sines(void)
{
    enum { W = 8 };
    kmp_graph *g = kmp_graph_new();
    const kmp_ref x = kmp_input(g, KMP_IN_Q, 0), y = kmp_input(g, KMP_IN_Q, 1), sum = kmp_add(g, x, y);
    const kmp_ref lent[] = {kmp_sin(g, x), kmp_cos(g, sum)}, borrowed[] = {kmp_sin(g, sum), kmp_cos(g, x)},
                  beyond[] = {kmp_sin(g, sum), kmp_sin(g, y)};
    const kmp_ref *const all[] = {lent, borrowed, beyond};
    kmp_program *p[3];
    kmp_lanes *lanes[3];
    double q[2 * W], swapped[2 * W];
    for (int k = 0; k < 3; k++) {
        p[k] = kmp_program_new(g, 1, (const int[]){2}, &all[k]);
        lanes[k] = kmp_lanes_new(p[k], W, false);
        CHECK(lanes[k] && (k == 0 || kmp_lanes_borrow_sines(lanes[k], lanes[0])));
    }
    for (int k = 0; k < 2 * W; k++) {
        q[k] = 0.1 + 0.2 * k;
        swapped[(k + W) % (2 * W)] = q[k];
    }
    kmp_lanes_set_sincos(lanes[0], mark, NULL);
    for (int turn = 0; turn < 3; turn++) { /* at one place, again, and at another with the same sums */
        const double *at = turn < 2 ? q : swapped;
        for (int k = 0; k < 3; k++)
            kmp_lanes_set(lanes[k], KMP_IN_Q, at);
        (void)kmp_lanes_run(lanes[0], 1);
        const double *here = kmp_lanes_run(lanes[1], 1), *there = kmp_lanes_run(lanes[2], 1);
        for (int l = 0; l < W; l++) {
            CHECK(here[l] == 7 && here[W + l] == 9);
            CHECK_NEAR(there[l], sin(at[l] + at[W + l]), 1e-15);
            CHECK_NEAR(there[W + l], sin(at[W + l]), 1e-15);
        }
    }
    kmp_lanes_set(lanes[1], KMP_IN_Q, q); /* the lender is elsewhere */
    const double *here = kmp_lanes_run(lanes[1], 1);
    for (int l = 0; l < W; l++) {
        CHECK_NEAR(here[l], sin(q[l] + q[W + l]), 1e-15);
        CHECK_NEAR(here[W + l], cos(q[l]), 1e-15);
    }
    for (int k = 0; k < 3; k++) {
        kmp_lanes_free(lanes[k]);
        kmp_program_free(p[k]);
    }
    kmp_graph_free(g);
}

/* Values of parameters alone are found before the other program has run: its angles and sines are zeros then. */
static void test_sines_of_parameters(void)
{
    enum { W = 8 };
    kmp_graph *g = kmp_graph_new();
    const kmp_ref x = kmp_input(g, KMP_IN_Q, 0), of = kmp_input(g, KMP_IN_PARAMETER, 0);
    const kmp_ref lent = kmp_cos(g, x), own = kmp_mul(g, kmp_cos(g, of), x);
    const kmp_ref *const groups[] = {&lent, &own};
    kmp_program *p[2];
    kmp_lanes *lanes[2];
    const double q[W] = {2, 2, 2, 2, 2, 2, 2, 2}, zero[1] = {0};
    for (int k = 0; k < 2; k++) {
        p[k] = kmp_program_new(g, 1, (const int[]){1}, &groups[k]);
        lanes[k] = kmp_lanes_new(p[k], W, false);
    }
    CHECK(lanes[0] && lanes[1] && kmp_lanes_borrow_sines(lanes[1], lanes[0]));
    for (int l = 0; l < W; l++)
        kmp_lanes_set_one(lanes[1], KMP_IN_PARAMETER, l, zero);
    (void)kmp_lanes_run(lanes[1], 0);
    for (int k = 0; k < 2; k++)
        kmp_lanes_set(lanes[k], KMP_IN_Q, q);
    (void)kmp_lanes_run(lanes[0], 1);
    const double *out = kmp_lanes_run(lanes[1], 1);
    for (int l = 0; l < W; l++)
        CHECK_NEAR(out[l], 2, 1e-15);
    for (int k = 0; k < 2; k++) {
        kmp_lanes_free(lanes[k]);
        kmp_program_free(p[k]);
    }
    kmp_graph_free(g);
}

static void test_no_memory(void)
{
    kmp_graph *g = kmp_graph_new();
    kmp_ref x = kmp_input(g, KMP_IN_Q, 0), out = kmp_mul(g, kmp_sin(g, x), kmp_add(g, x, KMP_ONE));
    const kmp_ref *group = &out;
    kmp_program *p = kmp_program_new(g, 1, (const int[]){1}, &group);
    for (unsigned long n = 1;; n++) {
        kmp_memory_fail_at(n);
        kmp_lanes *lanes = kmp_lanes_new(p, 8, false);
        kmp_memory_fail_at(0);
        kmp_lanes_free(lanes);
        if (lanes) {
            CHECK(n > 5);
            break;
        }
    }
    kmp_program_free(p);
    kmp_graph_free(g);
}

int main(void)
{
    TEST(test_each_lane_is_a_machine);
    TEST(test_best);
    TEST(test_borrowed_sines);
    TEST(test_sines_of_parameters);
    TEST(test_no_memory);
    return check_report();
}
