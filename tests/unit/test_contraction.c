/* SPDX-License-Identifier: BSD-3-Clause */
/* Products that are computed with the sum that reads them: which ones they are, and that the result is rounded once on
 * both back ends, if the program contracts. */
#include "backend/machine.h"
#include "plain.h"
#include "symbolic/function_table.h"
#include "symbolic/graph.h"
#include "testing.h"

enum { INPUTS = 6 };

static kmp_graph *g;
static kmp_ref q[INPUTS], qd;

static void begin(void)
{
    g = kmp_graph_new();
    for (uint32_t k = 0; k < INPUTS; k++)
        q[k] = kmp_input(g, KMP_IN_Q, k);
    qd = kmp_input(g, KMP_IN_QD, 0);
}

static kmp_ref times(int i, int k)
{
    return kmp_mul(g, q[i], q[k]);
}

/* The number of products that are part of a sum, of outputs in two groups, of which the first ones are exact. */
static int contracted_beside(int exact, int first, int second, const kmp_ref *outputs)
{
    const int count[2] = {first, second};
    const kmp_ref *const groups[2] = {outputs, outputs + first};
    kmp_program *p = kmp_program_new(g, 2, count, groups);
    kmp_arena arena = {0};
    const uint8_t *all = kmp_program_contraction(p, 0, exact, &arena);
    int found = 0;
    for (int i = 0; all && i < p->code[p->stages]; i++)
        found += all[i] == KMP_CONTRACTED;
    kmp_arena_free(&arena);
    kmp_program_free(p);
    kmp_graph_free(g);
    return found;
}

static int contracted(int first, int second, const kmp_ref *outputs)
{
    return contracted_beside(0, first, second, outputs);
}

static void single_readers(void)
{
    begin();
    CHECK(contracted(1, 0, (kmp_ref[]){kmp_add(g, times(0, 1), q[2])}) == 1);
    begin();
    CHECK(contracted(1, 0, (kmp_ref[]){kmp_sub(g, q[2], times(0, 1))}) == 1);
    begin(); /* a longer path: each further product of a sum */
    kmp_ref sum = kmp_add(g, kmp_add(g, times(0, 1), times(2, 3)), times(4, 5));
    CHECK(contracted(2, 0, (kmp_ref[]){kmp_sin(g, kmp_sin(g, q[0])), sum}) == 2);
    begin(); /* the longest path, which waits for the other operand */
    sum = kmp_add(g, kmp_add(g, times(0, 1), times(2, 3)), times(4, 5));
    CHECK(contracted(1, 0, &sum) == 0);
    begin();
    CHECK(contracted(1, 0, (kmp_ref[]){kmp_mul(g, times(0, 1), q[2])}) == 0);
}

static void others(void)
{
    begin(); /* an output */
    CHECK(contracted(2, 0, (kmp_ref[]){times(0, 1), kmp_add(g, times(0, 1), q[2])}) == 0);
    begin(); /* two sums */
    CHECK(contracted(2, 0, (kmp_ref[]){kmp_add(g, times(0, 1), q[2]), kmp_add(g, times(0, 1), q[3])}) == 0);
    begin(); /* a sum of the next stage: the product is not computed with every run of that one */
    CHECK(contracted(1, 1, (kmp_ref[]){kmp_sin(g, times(0, 1)), kmp_add(g, times(0, 1), qd)}) == 0);
}

static void exact_outputs(void)
{
    begin();
    kmp_ref sum = kmp_add(g, times(0, 1), q[2]), path = kmp_sin(g, kmp_sin(g, q[0]));
    CHECK(contracted_beside(1, 3, 0, (kmp_ref[]){kmp_sin(g, sum), kmp_add(g, times(3, 4), q[2]), path}) == 1);
}

/* q0 q1 - 1 = -2^-60 exactly, with one rounding; 0 with two. */
static void check_rounding(kmp_ref output, bool once, double expected)
{
    const double values[INPUTS] = {1 + 0x1p-30, 1 - 0x1p-30, 1};
    const kmp_ref *group = &output;
    const int count = 1;
    kmp_program *p = kmp_program_new(g, 1, &count, &group);
    CHECK(!once || kmp_program_contract(p, 0, 0));
    for (int b = 0; b < 2; b++) {
        kmp_machine *machine = kmp_machine_new(p, kmp_backend_find(b ? "native" : "tape"));
        kmp_machine_set(machine, KMP_IN_Q, values);
        (void)kmp_machine_run(machine, 0);
        CHECK(*kmp_machine_run(machine, 1) == expected);
        kmp_machine_free(machine);
    }
    kmp_program_free(p);
}

static void roundings(void)
{
    begin();
    kmp_ref outputs[2] = {kmp_sub(g, times(0, 1), q[2]), kmp_sub(g, q[2], times(1, 0))};
    for (int k = 0; k < 2; k++) {
        check_rounding(outputs[k], true, k ? 0x1p-60 : -0x1p-60);
        check_rounding(outputs[k], false, 0);
    }
    kmp_graph_free(g);
}

int main(void)
{
    TEST(single_readers);
    TEST(others);
    TEST(exact_outputs);
    TEST(roundings);
    return check_report();
}
