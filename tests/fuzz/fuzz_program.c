/* SPDX-License-Identifier: BSD-3-Clause */
/* Programs as bytes: what is read is printed, written again as the same bytes, and run. */
#include "backend/machine.h"
#include "fuzz.h"
#include "symbolic/program_bytes.h"

enum { MOST_INPUT = 64 };

static void print(const kmp_program *p)
{
    kmp_text text = {0};
    kmp_program_print(p, NULL, &text);
    fuzz_promise(!text.failed, "there is memory");
    kmp_text_free(&text);
}

/* The bytes of the program, which are those that it was read from. */
static void write_again(const kmp_program *p, const uint8_t *data, size_t size)
{
    kmp_bytes bytes = {0};
    kmp_table_pool pool = {0};
    kmp_program_put(&bytes, &pool, p);
    fuzz_promise(!bytes.failed, "there is memory");
    fuzz_promise(bytes.size == size && memcmp(bytes.at, data, size) == 0, "what was read is written in the same way");
    kmp_table_pool_free(&pool);
    kmp_bytes_free(&bytes);
}

static bool reads_little(const kmp_program *p)
{
    bool little = p->block_count <= 8;
    for (int k = 0; k < p->input_count; k++)
        little = little && p->input[k].index < MOST_INPUT;
    return little;
}

static kmp_machine *prepare(const kmp_program *p, const char *backend)
{
    double inputs[MOST_INPUT];
    kmp_machine *machine = kmp_machine_new(p, kmp_backend_find(backend));
    fuzz_promise(machine, "there is memory");
    for (int k = 0; k < MOST_INPUT; k++)
        inputs[k] = 0.3 + 0.1 * k;
    for (int kind = 0; kind < KMP_IN_COUNT; kind++)
        kmp_machine_set(machine, (kmp_input_kind)kind, inputs);
    return machine;
}

static bool same(double x, double y)
{
    return memcmp(&x, &y, sizeof x) == 0 || (x != x && y != y);
}

/* On every back end: one gives the bits of the other. */
static void run(const kmp_program *p)
{
    static const char *const names[] = {
#define KMP_BACKEND(name) #name,
#include "backend/backends.def"
#undef KMP_BACKEND
    };
    enum { COUNT = sizeof names / sizeof *names };
    kmp_machine *machines[COUNT];
    for (int k = 0; k < COUNT; k++)
        machines[k] = prepare(p, names[k]);
    for (int stage = 0; stage < p->stages; stage++) {
        const double *first = kmp_machine_run(machines[0], stage);
        for (int k = 1; k < COUNT; k++) {
            const double *other = kmp_machine_run(machines[k], stage);
            for (int i = 0; i < p->outputs[stage + 1] - p->outputs[stage]; i++)
                fuzz_promise(same(first[i], other[i]), "every back end gives the same bits");
        }
    }
    for (int k = 0; k < COUNT; k++)
        kmp_machine_free(machines[k]);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    kmp_byte_source source = kmp_byte_source_of(data, size);
    kmp_table_pool pool = {0};
    kmp_program *p = kmp_program_get(&source, &pool);
    fuzz_promise(!p || !source.failed, "a program is read as a whole");
    if (p) {
        print(p);
        write_again(p, data, (size_t)(source.at - data));
        if (reads_little(p))
            run(p);
    }
    kmp_program_free(p);
    kmp_table_pool_free(&pool);
    return 0;
}
