/* SPDX-License-Identifier: BSD-3-Clause */
/* The list of back ends, and calls through their five functions. */
#include "backend/machine.h"
#include "backend/native.h"
#include "base/memory.h"
#include <string.h>

struct kmp_machine {
    const kmp_backend *backend;
    void *code;
};

static const kmp_backend *const backends[] = {
#define KMP_BACKEND(name) &kmp_backend_##name,
#include "backend/backends.def"
#undef KMP_BACKEND
};

const kmp_backend *kmp_backend_find(const char *name)
{
    for (size_t k = 0; k < sizeof backends / sizeof *backends; k++)
        if (strcmp(backends[k]->name, name) == 0)
            return backends[k];
    return NULL;
}

const kmp_backend *kmp_backend_choose(kempe_context *context, const char *name)
{
    const kmp_backend *found = kmp_backend_find(name ? name : kmp_backend_default());
    if (!found)
        (void)kmp_fail(context, KEMPE_E_ARGUMENT, "unknown back end '%s'; available: %s", name, kmp_backend_names());
    if (!found || !found->native || kmp_native_runs())
        return found;
    if (name)
        kmp_log(context, KEMPE_LOG_WARNING,
                "back end '%s': this processor has no machine code, which needs AVX and FMA on x86-64, or arm64; the "
                "tape runs "
                "instead, with the same numbers in more time",
                name);
    return &kmp_backend_tape;
}

void kmp_backend_print(kmp_text *text, const char *name)
{
    if (strcmp(name, kmp_backend_default()) != 0)
        kmp_text_printf(text, ", back end %s", name);
}

const char *kmp_backend_default(void)
{
    return backends[0]->name;
}

const char *kmp_backend_names(void)
{
    static const char names[] =
#define KMP_BACKEND(name) ", " #name
#include "backend/backends.def"
#undef KMP_BACKEND
        ;
    return names + 2;
}

kmp_machine *kmp_machine_new(const kmp_program *program, const kmp_backend *backend)
{
    kmp_machine *machine = KMP_NEW(kmp_machine, 1);
    if (!machine)
        return NULL;
    machine->backend = backend;
    machine->code =
        backend->share && backend->team ? backend->share(program, backend->team) : backend->prepare(program);
    if (!machine->code) {
        kmp_free(machine);
        return NULL;
    }
    return machine;
}

void kmp_machine_free(kmp_machine *machine)
{
    if (!machine)
        return;
    machine->backend->release(machine->code);
    kmp_free(machine);
}

void kmp_machine_set(kmp_machine *machine, kmp_input_kind kind, const double *values)
{
    machine->backend->set(machine->code, kind, values);
}

kmp_block_counts kmp_machine_count(const kmp_machine *machine)
{
    kmp_block_counts counts = {0};
    machine->backend->count(machine->code, &counts);
    return counts;
}

const double *kmp_machine_run(kmp_machine *machine, int stage)
{
    machine->backend->run(machine->code, stage);
    return machine->backend->outputs(machine->code, stage);
}
