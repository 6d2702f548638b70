/* SPDX-License-Identifier: BSD-3-Clause */
/* Text of programs: written, read, written again; run with the same bits; and no text that crashes the reader. */
#include "backend/x86/machine.h"
#include "base/context.h"
#include "base/memory.h"
#include "random_graph.h"
#include "symbolic/program/program.h"
#include "symbolic/table_function.h"
#include "testing.h"

static kempe_context *context;

static char *text_of(const kmp_program *p)
{
    kmp_text text = {0};
    kmp_program_print(p, NULL, &text);
    return kmp_text_take(&text);
}

static kmp_program *read_text(const char *text)
{
    kmp_program *p = NULL;
    kmp_context_clear(context);
    kempe_status status = kmp_program_read(context, "f", text, &p);
    CHECK((status == KEMPE_OK) == (p != NULL));
    CHECK((p == NULL) == (kempe_context_message(context)[0] != '\0'));
    return p;
}

/* Random steps and a table of one of them, in two groups. */
static kmp_program *random_program(uint64_t seed, double *x)
{
    const double knots[] = {-4, -1.5, 0, 1, 1 / 3.0 + 1, 4}, values[] = {0.1, -1, 2, 0.7, -0.0, 3};
    steps s;
    kmp_ref r[GRAPH_STEPS + 2];
    random_seed(seed);
    for (int k = 0; k < GRAPH_INPUTS; k++)
        x[k] = between(-1.5, 1.5);
    random_steps(&s, 10 + pick(GRAPH_STEPS - 10), x);
    kmp_graph *g = kmp_graph_new();
    steps_build(&s, g, r);
    kmp_table *table = kmp_table_new(seed % 2 ? KMP_TABLE_CUBIC : KMP_TABLE_LINEAR, 6, knots, values);
    kmp_ref parameter = kmp_input(g, KMP_IN_PARAMETER, 3), t = kmp_input(g, KMP_IN_TIME, 0);
    r[s.count] = kmp_table_at(g, kmp_graph_add_table(g, table), kmp_neg(r[s.count - 1]));
    r[s.count + 1] = kmp_mul(g, kmp_sqrt(g, parameter), kmp_sub(g, t, kmp_const(g, 1e-300 / 3)));
    int first = pick(s.count), count[2] = {first, s.count + 2 - first};
    const kmp_ref *group[2] = {r, r + first};
    kmp_program *p = kmp_program_new(g, 2, count, group);
    kmp_table_free(table);
    kmp_graph_free(g);
    return p;
}

static const double *run(kmp_machine *machine, const double *x, int stage)
{
    const double t = 0.3, parameters[] = {0, 0, 0, 7};
    kmp_machine_set(machine, KMP_IN_Q, x);
    kmp_machine_set(machine, KMP_IN_TIME, &t);
    kmp_machine_set(machine, KMP_IN_PARAMETER, parameters);
    return kmp_machine_run(machine, stage);
}

static void compare_runs(const kmp_program *p, const kmp_program *q, const double *x)
{
    kmp_machine *a = kmp_machine_new(p, kmp_backend_find("tape")), *b = kmp_machine_new(q, kmp_backend_find("tape"));
    for (int s = 0; s < p->stages; s++) {
        size_t size = (size_t)(p->outputs[s + 1] - p->outputs[s]) * sizeof(double);
        CHECK(memcmp(run(a, x, s), run(b, x, s), size) == 0);
    }
    kmp_machine_free(a);
    kmp_machine_free(b);
}

static void test_round_trip(void)
{
    for (uint64_t seed = 1; seed <= 200; seed++) {
        double x[GRAPH_INPUTS];
        kmp_program *p = random_program(seed, x);
        char *first = text_of(p);
        kmp_program *q = read_text(first);
        CHECK(q != NULL);
        if (!q) {
            printf("%s\n%s\n", kempe_context_message(context), first);
        } else {
            char *second = text_of(q);
            CHECK_TEXT(second, first);
            CHECK(p->stages == q->stages && p->code[p->stages] == q->code[q->stages]);
            CHECK(p->input_count == q->input_count && p->constant_count == q->constant_count);
            compare_runs(p, q, x);
            kmp_free(second);
        }
        kmp_free(first);
        kmp_program_free(p);
        kmp_program_free(q);
    }
}

static void complains(const char *text, const char *message)
{
    kmp_program *p = read_text(text);
    CHECK(p == NULL);
    CHECK_TEXT(kempe_context_message(context), message);
    kmp_program_free(p);
}

static void test_complaints(void)
{
    complains("", "f:1:1: 'program 1' is expected here");
    complains("program 1\n", "f:2:1: 'table', 'implicit' or 'stage' is expected here");
    complains("program 1\nend\n", "f:2:4: a program needs at least stage 0");
    complains("program 1\nstage 1\nend\n", "f:2:8: stage 0 is expected next, not 1");
    complains("program 1\nstage 0\n  v1 = t + t\nend\n", "f:3:4: v0 is expected next, not v1");
    complains("program 1\nstage 0\n  v0 = t + v0\nend\n", "f:3:14: v0 is not defined yet");
    complains("program 1\nstage 0\n  v0 = t ^ t\nend\n", "f:3:10: '+', '-', '*' or '/' is expected here");
    complains("program 1\nstage 0\n  v0 = -t + t\nend\n", "f:3:8: a sign is not allowed here");
    complains("program 1\nstage 0\n  v0 = sin(t, t)\nend\n", "f:3:13: ')' is expected here");
    complains("program 1\nstage 0\n  v0 = table[0, 0](t)\nend\n", "f:3:15: unknown table 0");
    complains("program 1\nstage 0\n  v0 = foo(t)\nend\n",
              "f:3:8: an operand is expected here: a number, an input or a value v..");
    complains("program 1\nstage 0\n  out[1] = 1\nend\n", "f:3:11: out[0] is expected next, not out[1]");
    complains("program 1\nstage 0\n  out[0] = q[99999999]\nend\n",
              "f:3:21: a number of at most 10000000 is expected here");
    complains("program 1\nstage 0\n  out[0] = 1\n",
              "f:4:1: a value 'v0', an output, 'stage' or 'end' is expected here");
    complains("program 1\nstage 0\nend\nmore", "f:4:1: nothing may follow 'end'");
    complains("program 1\ntable 0 square\n", "f:2:9: 'linear' or 'cubic' is expected here");
    complains("program 1\ntable 0 cubic\n 1 2\n 0 3\nstage 0\nend\n",
              "f:5:1: a table has at least two finite points, with x increasing");
}

/* Some that a table does not spread evenly. */
static int number(int k)
{
    return 31 * k * k;
}

/* Inputs of the same number in several vectors, each of them twice; blocks that need less room than what follows. */
static void test_many_inputs(void)
{
    enum { INPUTS = 500, BLOCKS = 20 };
    static const char block[] = " unknowns 1 arguments 1\nprogram 1\nstage 0\nstage 1\n    out[0] = p[0]\nstage 2\n"
                                "    out[0] = q[0]\n    out[1] = 1\nend\n";
    kmp_text text = {0};
    kmp_text_put(&text, "program 1\n");
    for (int k = 0; k < BLOCKS; k++)
        kmp_text_printf(&text, "implicit %d%s", k, block);
    kmp_text_put(&text, "stage 0\nstage 1\n");
    for (int k = 0; k < 2 * INPUTS; k++)
        kmp_text_printf(&text, "    v%d = q[%d] + qd[%d]\n", k, number(k % INPUTS), number(k % INPUTS));
    kmp_text_put(&text, "end\n");
    kmp_program *p = text.failed ? NULL : read_text(text.s);
    CHECK(p && p->input_count == 2 * INPUTS && p->block_count == BLOCKS);
    char *again = p ? text_of(p) : NULL;
    CHECK_TEXT(again ? again : "", text.s);
    kmp_free(again);
    kmp_text_free(&text);
    kmp_program_free(p);
}

/* Text that can still be read can be written. */
static void try_text(const char *text)
{
    kmp_program *p = read_text(text);
    if (p)
        kmp_free(text_of(p));
    kmp_program_free(p);
}

static void test_broken_texts(void)
{
    static const char letters[] = "0123456789.-+*/()[], \nvqtse=nix\xff";
    double x[GRAPH_INPUTS];
    kmp_program *p = random_program(12, x);
    char *text = text_of(p);
    size_t length = strlen(text);
    for (size_t n = length; n-- > 0;) { /* every truncation but that of the last line's end */
        char *cut = kmp_strdup(text);
        cut[n] = '\0';
        kmp_program *q = read_text(cut);
        CHECK((q != NULL) == (n == length - 1));
        kmp_program_free(q);
        kmp_free(cut);
    }
    random_seed(5);
    for (int k = 0; k < 5000; k++) {
        char *changed = kmp_strdup(text);
        changed[pick((int)length)] = letters[pick((int)sizeof letters - 1)];
        try_text(changed);
        kmp_free(changed);
    }
    kmp_free(text);
    kmp_program_free(p);
}

int main(void)
{
    context = kempe_context_new();
    TEST(test_round_trip);
    TEST(test_complaints);
    TEST(test_many_inputs);
    TEST(test_broken_texts);
    kempe_context_free(context);
    return check_report();
}
