/* SPDX-License-Identifier: BSD-3-Clause */
/* Equations written in Python and Octave, run at the states of compiled_equations.h beside the tape. */
#ifndef KEMPE_TESTS_INTERPRETED_EQUATIONS_H
#define KEMPE_TESTS_INTERPRETED_EQUATIONS_H

#include "generate/compiled_equations.h"
#include <math.h>
#include <sys/stat.h>

/* -- interpreters ------------------------------------------------------------------------------------ */

/* "[1, 2, 3]" */
static inline void put_list(kmp_text *text, int count, const double *x)
{
    kmp_text_put(text, "[");
    for (int k = 0; k < count; k++)
        kmp_text_printf(text, "%s%.17g", k ? ", " : "", x[k]);
    kmp_text_put(text, "]");
}

/* A literal for each argument of a routine. */
static inline void put_arguments(kmp_text *text, const kmp_code_source *source, const kmp_code_routine *r,
                                 const state *s)
{
    const double *values[KMP_ARGUMENTS] = {[KMP_IN_Q] = s->q,
                                           [KMP_IN_QD] = s->qd,
                                           [KMP_IN_QDD] = s->qdd,
                                           [KMP_IN_LAMBDA] = s->lambda,
                                           [KMP_IN_MODE] = modes_of(source, s),
                                           [KMP_IN_FORCE] = s->force,
                                           [KMP_IN_TORQUE] = s->torque,
                                           [KMP_ARGUMENT_INPUTS] = s->time + 1};
    kmp_text_printf(text, "%s%.17g", source->parameters ? "k, " : "", s->time[0]);
    for (int kind = KMP_IN_Q; kind < KMP_ARGUMENTS; kind++)
        if (r->arguments & 1u << kind) {
            kmp_text_put(text, ", ");
            put_list(text,
                     kind == KMP_ARGUMENT_INPUTS ? KMP_TIME_NUMBERS * source->input_count
                     : kind >= KMP_IN_FORCE      ? 3 * source->body_count
                     : kind == KMP_IN_LAMBDA     ? source->m
                     : kind == KMP_IN_MODE       ? source->mode_entries * source->elements.count
                                                 : source->n,
                     values[kind]);
        }
}

static inline void put_parameter_list(kmp_text *text, const kmp_code_source *source)
{
    double *p = KMP_NEW(double, source->parameter_count);
    for (int k = 0; k < source->parameter_count; k++)
        p[k] = parameter(source, k);
    put_list(text, source->parameter_count, p);
    kmp_free(p);
}

/* An interpreter that runs one driver after another, since its start takes longer than most of them. */
typedef struct interpreter {
    FILE *to, *from;
} interpreter;

static interpreter numpy, octave;

static inline void start(interpreter *i, const char *program)
{
    char path[256], command[512];
    if (i->to)
        return;
    snprintf(path, sizeof path, "%s/answers%d", folder, i == &octave);
    snprintf(command, sizeof command, "cd %s && exec %s >%s", folder, program, path);
    CHECK(mkfifo(path, 0600) == 0);
    i->to = popen(command, "w");
    i->from = fopen(path, "r");
    CHECK(i->to && i->from);
}

static inline void end_interpreters(void)
{
    interpreter *const all[] = {&numpy, &octave};
    for (int k = 0; k < 2; k++)
        if (all[k]->to) {
            CHECK(pclose(all[k]->to) == 0);
            fclose(all[k]->from);
            *all[k] = (interpreter){NULL, NULL};
        }
}

/* Numbers that an interpreter prints after a line, STATES rows of `size` each, before the word "end". */
static inline bool read_numbers(interpreter *i, const char *line, int size)
{
    char word[64] = "";
    int count = 0;
    fputs(line, i->to);
    fflush(i->to);
    while (fscanf(i->from, "%63s", word) == 1 && strcmp(word, "end") != 0 && count < STATES * size) {
        got[count / size][count % size] = strtod(word, NULL);
        count++;
    }
    const bool whole = strcmp(word, "end") == 0 && count == STATES * size;
    CHECK(whole);
    return whole;
}

static inline bool run_python(const kmp_code_source *source, int size)
{
    kmp_text text = {0};
    char command[512];
    kmp_text_printf(&text,
                    "import importlib.util as util\nimport numpy as np\n"
                    "spec = util.spec_from_file_location('emitted', '%s.py')\nm = util.module_from_spec(spec)\n"
                    "spec.loader.exec_module(m)\nassert m.model_hash == \"%s\"\n",
                    source->name, source->hash); /* a model may be called like a module of Python's */
    for (int s = 0; s < STATES; s++)
        for (int k = 0; k < source->count; k++) {
            const kmp_code_routine *r = &source->routines[k];
            if (source->parameters) {
                kmp_text_printf(&text, "k = m.%s_prepare(", r->name);
                put_parameter_list(&text, source);
                kmp_text_put(&text, ")\n");
            }
            kmp_text_printf(&text, "out = m.%s(", r->name);
            put_arguments(&text, source, r, &states[s]);
            kmp_text_put(&text, ")\nfor x in out if isinstance(out, tuple) else [out]:\n"
                                "    print(*(repr(float(y)) for y in x.flat))\n");
        }
    kmp_text_put(&text, "print('end', flush=True)\n");
    write_text("driver.py", text.s);
    kmp_text_free(&text);
    write_text(
        "drive.py",
        "import pathlib\nimport sys\nsys.path[0:1] = []\nsys.dont_write_bytecode = True\nfor line in sys.stdin:\n"
        "    exec(compile(pathlib.Path('driver.py').read_text(), 'driver.py', 'exec'), {})\n");
    snprintf(command, sizeof command, "%s -W error drive.py", python());
    start(&numpy, command);
    return read_numbers(&numpy, "\n", size);
}

static inline bool run_octave(const kmp_code_source *source, int size)
{
    kmp_text text = {0};
    kmp_text_printf(&text, "m = %s_model();\nassert(strcmp(m.hash, '%s'));\n", source->name, source->hash);
    for (int s = 0; s < STATES; s++)
        for (int k = 0; k < source->count; k++) {
            const kmp_code_routine *r = &source->routines[k];
            if (source->parameters) {
                kmp_text_printf(&text, "k = %s_%s_prepare(", source->name, r->name);
                put_parameter_list(&text, source);
                kmp_text_put(&text, ");\n");
            }
            kmp_text_put(&text, "out = cell(1, ");
            kmp_text_printf(&text, "%d);\n[out{:}] = %s_%s(", r->array_count, source->name, r->name);
            put_arguments(&text, source, r, &states[s]);
            kmp_text_put(&text, ");\nfor x = out\n    assert(isreal(x{1}));\n    printf('%.17g ', x{1}.');\nend\n");
        }
    kmp_text_put(&text, "printf('end\\n');\nfflush(stdout);\n");
    write_text("driver.m", text.s);
    kmp_text_free(&text);
    start(&octave, "octave-cli --norc --no-history --quiet");
    return read_numbers(&octave, "clear all; rehash(); source('driver.m');\n", size);
}

/* -- comparing --------------------------------------------------------------------------------------- */

/* Entries that are further off than rounding allows, beside the largest one of the state. */
static inline int count_wrong(int size)
{
    int wrong = 0;
    for (int s = 0; s < STATES; s++) {
        double largest = 1;
        for (int k = 0; k < size; k++)
            largest = fmax(largest, isfinite(expected[s][k]) ? fabs(expected[s][k]) : 0);
        for (int k = 0; k < size; k++)
            wrong += !same_bits(got[s][k], expected[s][k]) &&
                     !(fabs(got[s][k] - expected[s][k]) <= 1e-12 * (largest + fabs(expected[s][k])));
    }
    return wrong;
}

#endif
