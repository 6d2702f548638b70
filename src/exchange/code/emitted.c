/* SPDX-License-Identifier: BSD-3-Clause */
/* Equations written in a language: all texts are made before the first file is written. */
#include "exchange/code/emitted.h"
#include "base/context.h"
#include "base/file.h"
#include "base/memory.h"
#include "base/temporary_file.h"
#include "exchange/code/language.h"
#include "exchange/code/simulator_pages.h"
#include "exchange/code/start_choice.h"
#include "exchange/code/write.h"
#include "model/data/model.h"
#include "output/print.h"
#include "platform/platform.h"
#include "symbolic/ops.h"
#include <errno.h>
#include <kempe/generate.h>
#include <limits.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

struct kempe_code {
    kempe_context *context;
    kmp_code_source source;
    const kmp_language *language;
    kmp_code_files files;
    const char *folder; /* of the last write; NULL: none yet */
    double cpu_s;
};

static const kmp_language *const languages[] = {
#define KMP_LANGUAGE(name) &kmp_language_##name,
#include "exchange/code/languages.def"
#undef KMP_LANGUAGE
};

enum { LANGUAGES = sizeof languages / sizeof *languages };

/* -- request ----------------------------------------------------------------------------------------- */

static void put_name(kmp_text *text, const char *kinds, int *count, const char *name)
{
    kmp_text_printf(text, "%s'%s'", *count > 0 ? ", " : kinds, name);
    *count += 1;
}

/* Contacts of wheels and algebraic unknowns are solved by iterations, which are generated so. */
static kempe_status refuse_iterations(const kempe_code *code, const char *set, const char *so, const char *advice)
{
    const kempe_model *model = code->source.model;
    kmp_text sentence = {0};
    int wheels = 0, unknowns = 0;
    kmp_text_printf(&sentence, "set '%s' contains values that are found by iterations, which are generated %s: ", set,
                    so);
    for (int k = 0; k < model->wheel_count; k++)
        put_name(&sentence, "contacts of wheels ", &wheels, model->wheels[k].name);
    for (int k = 0; k < model->unknowns_count; k++)
        if (model->unknowns[k].count > 0)
            put_name(&sentence, wheels > 0 ? "; algebraic unknowns " : "algebraic unknowns ", &unknowns,
                     model->unknowns[k].name);
    kmp_text_printf(&sentence, "; request sets without them, such as 'M', by --sets, or %s", advice);
    return kmp_fail_text(code->context, KEMPE_E_ARGUMENT, &sentence);
}

static kempe_status check_iterations(const kempe_code *code, const char *set)
{
    const kmp_code_source *source = &code->source;
    if (!code->language->block)
        return refuse_iterations(code, set, "in other languages", "use --lang c");
    if (source->parameters && !source->simulator)
        return refuse_iterations(code, set, "without numbers kept as parameters", "omit --keep-parameters");
    if (source->vectorised)
        return refuse_iterations(code, set, "as single operations", "omit --vectorised");
    return KEMPE_OK;
}

/* -- construction ------------------------------------------------------------------------------------ */

static kempe_status read_language(kempe_code *code, const kempe_generate_options *g)
{
    const char *name = g->language ? g->language : "c";
    for (int k = 0; k < LANGUAGES; k++)
        if (strcmp(languages[k]->name, name) == 0)
            code->language = languages[k];
    if (!code->language) {
        kmp_text sentence = {0};
        kmp_text_printf(&sentence, "unknown language '%s'; languages are ", name);
        for (int k = 0; k < LANGUAGES; k++)
            kmp_text_printf(&sentence, "%s%s", k ? ", " : "", languages[k]->name);
        return kmp_fail_text(code->context, KEMPE_E_ARGUMENT, &sentence);
    }
    if (g->simulator && strcmp(name, "c") != 0)
        return kmp_fail(code->context, KEMPE_E_ARGUMENT, "simulators are written in C: use --lang c");
    if (g->vectorised && !code->language->arrays.function)
        return kmp_fail(code->context, KEMPE_E_ARGUMENT,
                        "%s has no vectorised form: omit --vectorised, or use an array language", name);
    return KEMPE_OK;
}

/* An operation that a language does not have is reported before anything is written. */
static kempe_status check_operations(const kempe_code *code)
{
    for (int k = 0; k < code->source.count; k++) {
        const kmp_code_routine *r = &code->source.routines[k];
        for (int i = 0; i < r->program->code[r->program->stages]; i++) {
            kmp_op op = (kmp_op)r->program->instruction[i].op;
            if (op == KMP_OP_LIST)
                continue;
            if (op == KMP_OP_IMPLICIT)
                KMP_TRY(check_iterations(code, r->name));
            else if (!kmp_language_has(code->language, op))
                return kmp_fail(code->context, KEMPE_E_ARGUMENT,
                                "set '%s' needs the function '%s', which %s does not have; omit the set with --sets",
                                r->name, kmp_op_text(op), code->language->name);
        }
    }
    return KEMPE_OK;
}

static kempe_status make(kempe_code *code, const kempe_model *model, const kempe_generate_options *g)
{
    KMP_TRY(read_language(code, g));
    KMP_TRY(kmp_source_init(&code->source, model, g));
    KMP_TRY(check_operations(code));
    if (code->language->forward)
        KMP_TRY(kmp_start_choose(&code->source));
    bool ok = kmp_language_write(code->language, &code->source, &code->files);
    if (ok && g->simulator)
        ok = kmp_simulator_pages(&code->source, &code->files);
    for (int k = 0; k < code->files.count; k++)
        ok = ok && !code->files.file[k].text.failed && code->files.file[k].text.s;
    return ok ? KEMPE_OK : kmp_fail_memory(code->context);
}

kempe_status kempe_code_new(const kempe_model *model, const kempe_generate_options *generation, kempe_code **out)
{
    KMP_WANTED(NULL, model, "model");
    KMP_WANTED(model->context, out, "code");
    KMP_OPTIONS(model->context, kempe_generate_options, generation);
    double begin = kmp_cpu_now();
    kmp_context_clear(model->context);
    KMP_TRY(kmp_model_check_finished(model));
    KMP_MAKE(model->context, kempe_code, code);
    code->context = model->context;
    kempe_status status = make(code, model, generation);
    code->cpu_s = kmp_cpu_now() - begin;
    return KMP_GIVE_OR_FREE(status, out, code, kempe_code_free);
}

KMP_FREES(kempe_code, code, kmp_code_files_free(&code->files), kmp_source_free(&code->source))

KMP_GETTER(int kempe_code_file_count(const kempe_code *code), code, code->files.count, 0)
KMP_GETTER_AT(const char *kempe_code_file_name(const kempe_code *code, int k), code, k, code->files.count,
              code->files.file[k].name, "")
KMP_GETTER_AT(const char *kempe_code_file_text(const kempe_code *code, int k), code, k, code->files.count,
              code->files.file[k].text.s, "")

const kmp_code_source *kmp_code_source_of(const kempe_code *code)
{
    return &code->source;
}

/* -- files ------------------------------------------------------------------------------------------- */

/* The place of a file and what it replaces: the target of a symbolic link. */
static int stage(const char *folder, const kmp_code_file *file, kmp_text *path, kmp_text *temporary)
{
    char target[KMP_PATH_MOST];
    kmp_path_state old;
    kmp_text_printf(path, "%s/%s", folder, file->name);
    const bool exists = !path->failed && kmp_path_look(path->s, &old);
    if (exists && old.kind != KMP_PATH_FILE)
        return old.kind == KMP_PATH_FOLDER ? EISDIR : EINVAL;
    if (exists && kmp_path_real(path->s, target)) {
        kmp_text_free(path);
        kmp_text_put(path, target);
    }
    return path->failed
               ? ENOMEM
               : kmp_temporary_write(path->s, exists ? &old : NULL, file->text.s, file->text.length, temporary);
}

/* All files, or none if one of them cannot be written. */
static kempe_status write_files(kempe_context *context, const char *folder, const kmp_code_files *files)
{
    const int count = files->count;
    kmp_text *path = KMP_NEW(kmp_text, count), *temporary = KMP_NEW(kmp_text, count);
    int error = path && temporary ? 0 : ENOMEM, staged = 0, named = 0;
    while (!error && staged < count) {
        error = stage(folder, &files->file[staged], &path[staged], &temporary[staged]);
        staged += !error;
    }
    while (!error && named < count) {
        error = kmp_path_rename(temporary[named].s, path[named].s);
        named += !error;
    }
    const char *wrong = error && error != ENOMEM ? path[staged < count ? staged : named].s : folder;
    kempe_status status = kmp_temporary_report(context, wrong, error);
    for (int k = named; k < staged; k++)
        (void)kmp_path_remove(temporary[k].s);
    for (int k = 0; path && temporary && k < count; k++) {
        kmp_text_free(&path[k]);
        kmp_text_free(&temporary[k]);
    }
    kmp_free(path);
    kmp_free(temporary);
    return status;
}

kempe_status kempe_code_write(kempe_code *code, const char *folder)
{
    KMP_WANTED_BOTH(code, folder);
    kmp_context_clear(code->context);
    KMP_TRY(kmp_folder_make(code->context, folder));
    KMP_TRY(write_files(code->context, folder, &code->files));
    code->folder = kmp_arena_strdup(&code->source.arena, folder);
    return kmp_made(code->context, code->folder);
}

/* -- printing ---------------------------------------------------------------------------------------- */

/* Appends what a routine computes: the first words of the meanings of its arrays, as many as the line has room for. */
static void put_meanings(kmp_text *text, const kmp_code_routine *routine, size_t begin)
{
    for (int k = 0; k < routine->array_count; k++) {
        const char *meaning = routine->arrays[k].meaning;
        const size_t length = strcspn(meaning, ":;,"), last = k + 1 < routine->array_count ? strlen("; ..") : 0;
        if (k > 0 && text->length - begin + strlen("; ") + length + last > KMP_PRINT_LINE) {
            kmp_text_put(text, "; ..");
            return;
        }
        kmp_text_printf(text, "%s%.*s", k > 0 ? "; " : "", (int)length, meaning);
    }
}

static void show_routines(kmp_text *text, const kmp_code_source *source)
{
    int width = (int)strlen("routine");
    for (int k = 0; k < source->count; k++)
        width = (int)strlen(source->routines[k].name) > width ? (int)strlen(source->routines[k].name) : width;
    kmp_text_printf(text, "  %-*s  %8s  %8s  %10s  computes\n", width, "routine", "+ - * /", "with fns", "in prepare");
    for (int k = 0; k < source->count; k++) {
        const kmp_tally *t = &source->routines[k].tally;
        const size_t begin = text->length;
        kmp_text_printf(text, "  %-*s  %8ld  %8ld  %10ld  ", width, source->routines[k].name, t->counts.paper,
                        t->counts.robotran, t->counts.robotran - t->runtime.robotran);
        put_meanings(text, &source->routines[k], begin);
        kmp_text_put(text, "\n");
    }
}

static void show(kmp_text *text, const void *result)
{
    const kempe_code *code = result;
    const kmp_code_source *source = &code->source;
    kmp_text_printf(text, "%s: %s, %d routine%s in %s", source->title, kempe_outcome_text(KEMPE_OUTCOME_COMPLETE),
                    source->count, source->count == 1 ? "" : "s", code->language->title);
    if (code->folder && strcmp(code->folder, ".") == 0)
        kmp_text_put(text, ", written to the current folder");
    else if (code->folder)
        kmp_text_printf(text, ", written to the folder %s", code->folder);
    kmp_text_put(text, "\n\n");
    show_routines(text, source);
    kmp_text_put(text, "\n");
    kmp_text words = {0};
    for (int k = 0; k < code->files.count; k++)
        kmp_text_printf(&words, "%s%s", k > 0 ? ", " : "", code->files.file[k].name);
    if (words.s)
        kmp_print_wrapped(text, "files     ", 10, words.s);
    kmp_text_free_part(text, &words);
    kmp_text_put(text, "with fns: operations with functions such as sin and cos; in prepare: of these, the operations "
                       "on\nparameters only, which the function 'prepare' does once\n");
}

static void write_json(kmp_text *text, const void *result)
{
    const kempe_code *code = result;
    const kmp_code_source *source = &code->source;
    kmp_json json = kmp_json_begin(text);
    kmp_json_put(&json, "{ model %s status %s reason %s build_s %g language %s hash %s routines {", source->title,
                 kempe_outcome_text(KEMPE_OUTCOME_COMPLETE), "", code->cpu_s, code->language->name, source->hash);
    for (int k = 0; k < source->count; k++) {
        const kmp_tally *t = &source->routines[k].tally;
        kmp_json_put(&json, "%s { paper %ld robotran %ld prepare %ld }", source->routines[k].name, t->counts.paper,
                     t->counts.robotran, t->counts.robotran - t->runtime.robotran);
    }
    kmp_json_put(&json, "} files [");
    for (int k = 0; k < code->files.count; k++)
        kmp_json_string(&json, NULL, code->files.file[k].name);
    kmp_json_put(&json, "} cpu_s %g }", code->cpu_s);
}

kempe_status kempe_code_print(const kempe_code *code, kempe_format format, char **text)
{
    KMP_WANTED_BOTH(code, text);
    return kmp_print_result(code->context, format, format == KEMPE_JSON ? write_json : show, code, text);
}
