/* SPDX-License-Identifier: BSD-3-Clause */
/* Equations written in C by Kempe, compiled by the C compiler and loaded: one routine of one choice of sets. Of its
 * program another one may be put in the place, whose outputs are of the same shape. */
#ifndef KEMPE_BENCH_LOADED_EQUATIONS_H
#define KEMPE_BENCH_LOADED_EQUATIONS_H

#include "base/file.h"
#include "exchange/code/write.h"
#include "model/data/force.h"
#include "model/data/model_context.h"
#include <dlfcn.h>
#include <kempe/generate.h>
#include <stdio.h>
#include <stdlib.h>
#include <unistd.h>

#ifndef KEMPE_CC
#define KEMPE_CC "cc"
#endif
#define EMITTED_FLAGS "-std=c99 -O2 -ffp-contract=off -fPIC -shared"

typedef struct emitted {
    void *library;
    union {
        void *symbol;
        void (*motion)(double t, const double *q, const double *qd, double *m, double *c);
        void (*accelerations)(double t, const double *q, const double *qd, double *qdd);
        void (*inverse)(double t, const double *q, const double *qd, const double *qdd, double *effort);
        void (*closed)(double t, const double *q, const double *qd, double *m, double *c, double *h, double *j,
                       double *jdqd);
    } function;
} emitted;

static inline void emitted_free(emitted *e)
{
    if (e->library)
        (void)dlclose(e->library);
    *e = (emitted){0};
}

static inline bool emitted_write(kempe_context *context, const char *folder, const kmp_code_files *files)
{
    char path[512];
    for (int k = 0; k < files->count; k++) {
        snprintf(path, sizeof path, "%s/%s", folder, files->file[k].name);
        if (kempe_write_file(context, path, files->file[k].text.s) != KEMPE_OK)
            return false;
    }
    return true;
}

static inline bool emitted_compile(emitted *e, const char *folder, const kmp_code_source *source)
{
    char command[512], name[256];
    snprintf(command, sizeof command, "cd %s && %s " EMITTED_FLAGS " -o code.so %s.c -lm", folder, KEMPE_CC,
             source->name);
    snprintf(name, sizeof name, "%s/code.so", folder);
    if (system(command) != 0)
        return false;
    e->library = dlopen(name, RTLD_NOW);
    snprintf(name, sizeof name, "%s_%s", source->name, source->routines[0].name);
    e->function.symbol = e->library ? dlsym(e->library, name) : NULL;
    return e->function.symbol;
}

/* The sets' own program, or `instead` of it, which is then owned. false: something failed, the context may say what. */
static inline bool emitted_init(emitted *e, const kempe_model *model, const char *sets, kmp_program *instead)
{
    char folder[] = "/tmp/kempe-bench-XXXXXX", command[64];
    kmp_code_source source;
    kmp_code_files files = {0};
    *e = (emitted){0};
    if (kmp_source_init(&source, model, &(kempe_generate_options){.sets = sets, .form = "compact"}) != KEMPE_OK) {
        kmp_program_free(instead);
        return false;
    }
    if (instead) {
        kmp_code_routine *r = &source.routines[0];
        kmp_program_free(r->program);
        r->program = instead;
        r->kept = KMP_ARENA_NEW(&source.arena, int,
                                instead->constant_count + instead->input_count + instead->code[instead->stages]);
    }
    bool ok = mkdtemp(folder) && kmp_language_write(&kmp_language_c, &source, &files) &&
              emitted_write(kmp_model_context(model), folder, &files) && emitted_compile(e, folder, &source);
    kmp_code_files_free(&files);
    kmp_source_free(&source);
    snprintf(command, sizeof command, "rm -r %s", folder);
    ok = system(command) == 0 && ok;
    if (!ok)
        emitted_free(e);
    return ok;
}

#endif
