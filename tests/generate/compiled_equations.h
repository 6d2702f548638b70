/* SPDX-License-Identifier: BSD-3-Clause */
/* Equations written in C, compiled, and run at random states beside the tape. */
#ifndef KEMPE_TESTS_COMPILED_EQUATIONS_H
#define KEMPE_TESTS_COMPILED_EQUATIONS_H

#include "backend/machine.h"
#include "base/memory.h"
#include "exchange/code/source.h"
#include "testing.h"
#include "unit/random.h"
#include <dlfcn.h>
#include <kempe/generate.h>
#include <stdlib.h>
#include <unistd.h>

enum { STATES = 3, MOST = 512, MOST_OUT = 40000 };

typedef struct state {
    double time[1 + MOST], q[MOST], qd[MOST], qdd[MOST], lambda[MOST], force[MOST], torque[MOST];
    double mode[MOST]; /* inputs of all roles of elements */
} state;

static kempe_context *context;
static char folder[] = "/tmp/kempe-languages-XXXXXX";
static state states[STATES];
static double expected[STATES][MOST_OUT], got[STATES][MOST_OUT];

/* -- states and expected values ---------------------------------------------------------------------- */

static inline void fill(double *x, double size)
{
    for (int k = 0; k < MOST; k++)
        x[k] = between(-size, size);
}

/* Slip in one state, stick in the next, and a regularised one. */
static inline void choose_modes(state *s, int k)
{
    enum { ROLES = KMP_ROLES_OF_ALL };
    static const double sense[STATES] = {-1, 0, 2}, held[STATES] = {0, 1, 0};
    for (int e = 0; ROLES * (e + 1) <= MOST; e++) {
        const double entries[KMP_MODE_ENTRIES_ACROSS] = {sense[(k + e) % STATES], held[(k + e) % STATES],
                                                         between(-1, 1), between(-1, 1), between(-1, 1)};
        memcpy(s->mode + (ptrdiff_t)ROLES * e, entries, sizeof entries);
    }
}

static inline void choose_states(void)
{
    random_seed(7);
    for (int s = 0; s < STATES; s++) {
        states[s].time[0] = between(0, 2);
        fill(states[s].time + 1, 2); /* inputs */
        fill(states[s].q, s == 2 ? 3 : 1);
        fill(states[s].qd, 2);
        fill(states[s].qdd, 5);
        fill(states[s].lambda, 5);
        fill(states[s].force, 5);
        fill(states[s].torque, 5);
        choose_modes(&states[s], s);
    }
}

/* The modes of a state as generated functions take them. */
static inline const double *modes_of(const kmp_code_source *source, const state *s)
{
    enum { ROLES = KMP_ROLES_OF_ALL };
    static double modes[MOST];
    const int entries = source->mode_entries;
    for (int k = 0; k < entries * source->elements.count && k < MOST; k++)
        modes[k] = s->mode[k / entries * ROLES + k % entries];
    return modes;
}

/* Other values than the model's. */
static inline double parameter(const kmp_code_source *source, int place)
{
    return source->value[place] * (1 + 0.01 * (place % 7));
}

static inline int size_of(const kmp_array *a)
{
    return a->rows * (a->cols ? a->cols : 1);
}

/* Whole matrices. */
static inline double *expand(const kmp_array *a, const double *entry, double *out)
{
    if (!a->symmetric) {
        memcpy(out, entry, (size_t)size_of(a) * sizeof *out);
        return out + size_of(a);
    }
    for (int i = 0; i < a->rows; i++)
        for (int k = 0; k <= i; k++)
            out[i * a->cols + k] = out[k * a->cols + i] = *entry++;
    return out + size_of(a);
}

static inline double *run_tape(const kmp_code_source *source, const kmp_code_routine *r, const state *s, double *out)
{
    double *symbols = KMP_NEW(double, source->symbol_count + 1);
    kmp_machine *machine = kmp_machine_new(r->program, kmp_backend_find("tape"));
    for (int k = 0; k < source->symbol_count; k++)
        symbols[k] = source->place[k] < 0 ? NAN : parameter(source, source->place[k]);
    kmp_machine_set(machine, KMP_IN_PARAMETER, symbols);
    kmp_machine_set(machine, KMP_IN_TIME, s->time);
    kmp_machine_set(machine, KMP_IN_Q, s->q);
    kmp_machine_set(machine, KMP_IN_QD, s->qd);
    kmp_machine_set(machine, KMP_IN_QDD, s->qdd);
    kmp_machine_set(machine, KMP_IN_LAMBDA, s->lambda);
    kmp_machine_set(machine, KMP_IN_FORCE, s->force);
    kmp_machine_set(machine, KMP_IN_TORQUE, s->torque);
    kmp_machine_set(machine, KMP_IN_MODE, s->mode);
    (void)kmp_machine_run(machine, 0);
    const double *entry = kmp_machine_run(machine, 1);
    for (int a = 0; a < r->array_count; a++)
        out = expand(&r->arrays[a], entry + r->arrays[a].first, out);
    kmp_machine_free(machine);
    kmp_free(symbols);
    return out;
}

static inline int run_tapes(const kmp_code_source *source)
{
    double *end = NULL;
    for (int s = 0; s < STATES; s++) {
        end = expected[s];
        for (int k = 0; k < source->count; k++)
            end = run_tape(source, &source->routines[k], &states[s], end);
    }
    return (int)(end - expected[STATES - 1]);
}

/* -- tools ------------------------------------------------------------------------------------------- */

static inline void write_text(const char *name, const char *text)
{
    char path[256];
    snprintf(path, sizeof path, "%s/%s", folder, name);
    CHECK(kempe_write_file(context, path, text) == KEMPE_OK);
}

static inline bool runs(const char *command)
{
    return system(command) == 0;
}

/* A Python with NumPy; NULL: none. It is looked for once. */
static inline const char *python(void)
{
    static const char *const choices[] = {"python3", "/usr/bin/python3", NULL};
    static int found = -1;
    for (int k = 0; found < 0; k++) {
        char command[128];
        snprintf(command, sizeof command, "%s -c 'import numpy' >/dev/null 2>&1", choices[k] ? choices[k] : "");
        if (!choices[k] || runs(command))
            found = k;
    }
    return choices[found];
}

static inline bool has_octave(void)
{
    static int found = -1;
    if (found < 0)
        found = runs("octave-cli --version >/dev/null 2>&1");
    return found;
}

/* -- C ----------------------------------------------------------------------------------------------- */

typedef void shim_function(const double *p, double t, const double *q, const double *qd, const double *qdd,
                           const double *lambda_, const double *modes, const double *force, const double *torque,
                           const double *u, double *out);

/* The equations, and a function of one signature that calls all routines. */
static inline void put_shim(kmp_text *text, const kmp_code_source *source, int number)
{
    static const char *const names[KMP_ARGUMENTS] = {
        [KMP_IN_TIME] = "t",         [KMP_IN_Q] = "q",        [KMP_IN_QD] = "qd",       [KMP_IN_QDD] = "qdd",
        [KMP_IN_LAMBDA] = "lambda_", [KMP_IN_MODE] = "modes", [KMP_IN_FORCE] = "force", [KMP_IN_TORQUE] = "torque",
        [KMP_ARGUMENT_INPUTS] = "u"};
    static const char arguments[] =
        "(const double *p, double t, const double *q, const double *qd, const double *qdd, const double *lambda_,\n"
        "    const double *modes, const double *force, const double *torque, const double *u, double *out)";
    int at = 0;
    kmp_text_printf(text, "#include \"%s.c\"\nvoid shim%d%s;\nvoid shim%d%s\n{\n", source->name, number, arguments,
                    number, arguments);
    kmp_text_put(text,
                 "(void)p; (void)u; (void)qd; (void)qdd; (void)lambda_; (void)modes; (void)force; (void)torque;\n");
    for (int k = 0; k < source->count; k++) {
        const kmp_code_routine *r = &source->routines[k];
        if (source->parameters)
            kmp_text_printf(text, "{ double k[%s_%s_k]; %s_%s_prepare(p, k);\n", source->name, r->name, source->name,
                            r->name);
        kmp_text_printf(text, "%s_%s(%s", source->name, r->name, source->parameters ? "k, " : "");
        for (int kind = 0; kind < KMP_ARGUMENTS; kind++)
            if (r->arguments & 1u << kind && names[kind])
                kmp_text_printf(text, "%s, ", names[kind]);
        for (int a = 0; a < r->array_count; at += size_of(&r->arrays[a]), a++)
            kmp_text_printf(text, "out + %d%s", at, a + 1 < r->array_count ? ", " : ");");
        kmp_text_put(text, source->parameters ? "}\n" : "\n");
    }
    kmp_text_put(text, "}\n");
}

/* Shims in a library. NULL: they cannot be compiled. `optimised`: with warnings as errors, some of which only the
 * optimiser finds; else in half the time. */
static inline void *compile(const kmp_text *shims, bool optimised)
{
    static int number;
    char command[1024], library[256];
    write_text("shim.c", shims->s);
    snprintf(library, sizeof library, "%s/shim%d.so", folder, number++);
    snprintf(command, sizeof command,
             "cd %s && %s -std=c99 %s -ffp-contract=off -Wall -Wextra -Wpedantic -Wshadow -Wconversion -Werror -fPIC "
             "-shared -o %s shim.c -lm",
             folder, KEMPE_CC, optimised ? "-O1" : "-O0", library);
    CHECK(runs(command));
    void *handle = dlopen(library, RTLD_NOW);
    CHECK(handle != NULL);
    return handle;
}

static inline void run_shim(void *handle, const kmp_code_source *source, int number)
{
    char name[32];
    double p[MOST * 16];
    shim_function *shim;
    snprintf(name, sizeof name, "shim%d", number);
    void *symbol = dlsym(handle, name);
    memcpy(&shim, &symbol, sizeof shim);
    for (int k = 0; k < source->parameter_count; k++)
        p[k] = parameter(source, k);
    for (int s = 0; s < STATES; s++)
        shim(p, states[s].time[0], states[s].q, states[s].qd, states[s].qdd, states[s].lambda,
             modes_of(source, &states[s]), states[s].force, states[s].torque, states[s].time + 1, got[s]);
}

static inline bool run_c(const kmp_code_source *source, bool optimised)
{
    kmp_text text = {0};
    put_shim(&text, source, 0);
    void *handle = compile(&text, optimised);
    kmp_text_free(&text);
    if (!handle)
        return false;
    run_shim(handle, source, 0);
    dlclose(handle);
    return true;
}

/* -- comparing --------------------------------------------------------------------------------------- */

static inline bool same_bits(double a, double b)
{
    return memcmp(&a, &b, sizeof a) == 0 || (isnan(a) && isnan(b));
}

static inline int count_wrong_bits(int size)
{
    int wrong = 0;
    for (int s = 0; s < STATES; s++)
        for (int k = 0; k < size; k++)
            wrong += !same_bits(got[s][k], expected[s][k]);
    return wrong;
}

/* -- writing ----------------------------------------------------------------------------------------- */

static inline bool emit(const kempe_model *model, const kempe_generate_options *g)
{
    kempe_code *code = NULL;
    CHECK(kempe_code_new(model, g, &code) == KEMPE_OK);
    if (!code) {
        printf("%s\n", kempe_context_message(context));
        return false;
    }
    CHECK(kempe_code_write(code, folder) == KEMPE_OK);
    kempe_code_free(code);
    return true;
}

#endif
