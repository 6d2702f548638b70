/* SPDX-License-Identifier: BSD-3-Clause */
/* Text of programs: what is read is written and read again, and run. */
#include "backend/x86/machine.h"
#include "base/context.h"
#include "base/memory.h"
#include "fuzz.h"

enum { MOST_INPUT = 64 };

static kmp_program *read_text(const char *text)
{
    kempe_context *context = fuzz_context_new();
    kmp_program *p = NULL;
    kempe_status status = kmp_program_read(context, "program", text, &p);
    fuzz_check_status(context, status);
    fuzz_promise((status == KEMPE_OK) == (p != NULL), "a program comes with KEMPE_OK, and only then");
    kempe_context_free(context);
    return p;
}

static char *text_of(const kmp_program *p)
{
    kmp_text text = {0};
    kmp_program_print(p, NULL, &text);
    char *s = kmp_text_take(&text);
    fuzz_promise(s, "there is memory");
    return s;
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
    char *text = kmp_calloc(size + 1, 1);
    fuzz_promise(text, "there is memory");
    if (size > 0)
        memcpy(text, data, size);
    kmp_program *p = read_text(text);
    if (p) {
        char *first = text_of(p);
        kmp_program *again = read_text(first);
        fuzz_promise(again, "what is written can be read");
        char *second = text_of(again);
        fuzz_promise(strcmp(first, second) == 0, "what was read is written in the same way");
        if (reads_little(p))
            run(p);
        kmp_program_free(again);
        kmp_free(second);
        kmp_free(first);
    }
    kmp_program_free(p);
    kmp_free(text);
    return 0;
}
