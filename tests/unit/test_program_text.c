/* SPDX-License-Identifier: BSD-3-Clause */
/* Programs as text and as bytes: read from bytes they have the same text and results; no bytes crash the reader. */
#include "backend/machine.h"
#include "base/memory.h"
#include "random_graph.h"
#include "symbolic/contraction.h"
#include "symbolic/function_table.h"
#include "symbolic/program_bytes.h"
#include "symbolic/table_function.h"
#include "testing.h"

static char *text_of(const kmp_program *p)
{
    kmp_text text = {0};
    kmp_program_print(p, NULL, &text);
    return kmp_text_take(&text);
}

static kmp_bytes bytes_of(const kmp_program *p)
{
    kmp_bytes bytes = {0};
    kmp_table_pool pool = {0};
    kmp_program_put(&bytes, &pool, p);
    kmp_table_pool_free(&pool);
    CHECK(!bytes.failed);
    return bytes;
}

static kmp_program *read_bytes(const kmp_bytes *bytes, size_t size)
{
    kmp_byte_source source = kmp_byte_source_of(bytes->at, size);
    kmp_table_pool pool = {0};
    kmp_program *p = kmp_program_get(&source, &pool);
    kmp_table_pool_free(&pool);
    CHECK(p ? !source.failed : source.failed);
    return p;
}

/* Random steps and a table of one of them, in two groups. One in three contracts. */
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
    CHECK(p && (seed % 3 > 0 || kmp_program_contract(p, 0, 1)));
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
        kmp_bytes bytes = bytes_of(p);
        kmp_program *q = read_bytes(&bytes, bytes.size);
        CHECK(q != NULL);
        if (q) {
            char *first = text_of(p), *second = text_of(q);
            kmp_bytes again = bytes_of(q);
            CHECK_TEXT(second, first);
            CHECK(kmp_program_equal(p, q));
            CHECK(again.size == bytes.size && memcmp(again.at, bytes.at, bytes.size) == 0);
            compare_runs(p, q, x);
            kmp_bytes_free(&again);
            kmp_free(first);
            kmp_free(second);
        }
        kmp_bytes_free(&bytes);
        kmp_program_free(p);
        kmp_program_free(q);
    }
}

/* The lines of docs/program_format.md: a table, signs, an operation, a function, an input and a number. */
static void test_text(void)
{
    const double knots[] = {-1, 0.1, 4}, values[] = {2, 0, 1e-300};
    kmp_graph *g = kmp_graph_new();
    kmp_table *table = kmp_table_new(KMP_TABLE_LINEAR, 3, knots, values);
    kmp_ref q = kmp_input(g, KMP_IN_Q, 2), t = kmp_input(g, KMP_IN_TIME, 0), r[4];
    r[0] = kmp_sub(g, kmp_input(g, KMP_IN_PARAMETER, 0), KMP_ONE);
    r[1] = kmp_table_at(g, kmp_graph_add_table(g, table), kmp_neg(q));
    r[2] = kmp_neg(kmp_mul(g, kmp_sin(g, t), r[0]));
    r[3] = q;
    const kmp_ref *group = r;
    kmp_program *p = kmp_program_new(g, 1, &(int){4}, &group);
    char *text = text_of(p);
    CHECK_TEXT(text, "program 1\ntable 0 linear\n    -1 2\n    0.1 0\n    4 1e-300\n"
                     "stage 0\n    v0 = 1 - p[0]\n"
                     "stage 1\n    v1 = table[0, 0](-q[2])\n    v2 = sin(t)\n    v3 = v0 * v2\n"
                     "    out[0] = -v0\n    out[1] = v1\n    out[2] = v3\n    out[3] = q[2]\nend\n");
    kmp_free(text);
    kmp_program_free(p);
    kmp_table_free(table);
    kmp_graph_free(g);
}

static void test_broken_bytes(void)
{
    double x[GRAPH_INPUTS];
    kmp_program *p = random_program(12, x);
    kmp_bytes bytes = bytes_of(p);
    for (size_t size = 0; size < bytes.size; size++) {
        kmp_program *cut = read_bytes(&bytes, size);
        CHECK(!cut);
        kmp_program_free(cut);
    }
    random_seed(5);
    for (int k = 0; k < 5000; k++) {
        unsigned char *at = &bytes.at[pick((int)bytes.size)], before = *at;
        *at = (unsigned char)pick(256);
        kmp_program *changed = read_bytes(&bytes, bytes.size);
        if (changed)
            kmp_free(text_of(changed));
        kmp_program_free(changed);
        *at = before;
    }
    kmp_bytes_free(&bytes);
    kmp_program_free(p);
}

int main(void)
{
    TEST(test_round_trip);
    TEST(test_text);
    TEST(test_broken_bytes);
    return check_report();
}
