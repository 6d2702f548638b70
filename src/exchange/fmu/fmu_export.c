/* SPDX-License-Identifier: BSD-3-Clause */
/* Functional mock-up units: all files are made in memory, then the archive is written at once. */
#include "base/context.h"
#include "base/file.h"
#include "base/memory.h"
#include "constraints/inexact/nearest_exact.h"
#include "exchange/code/emitted.h"
#include "exchange/fmu/unit_binary.h"
#include "exchange/fmu/unit_description.h"
#include "exchange/fmu/unit_files.h"
#include "exchange/fmu/unit_lines.h"
#include "exchange/fmu/unit_parts.h"
#include "exchange/fmu/unit_resources.h"
#include "model/data/model.h"
#include "output/mechanism_picture.h"
#include "output/picture_file.h"
#include "output/print.h"
#include "output/zip_archive.h"
#include <kempe/generate.h>
#include <stdio.h>
#include <string.h>

struct kempe_fmu_export {
    kempe_context *context;
    kempe_code *code;       /* of a unit of sources */
    kmp_code_source *named; /* of a unit on the library */
    kempe_system *system;
    kmp_unit_plan plan;
    kmp_code_files sources; /* beside those of the simulator */
    kmp_code_files files;   /* as they are in the archive; NULL-terminated texts, and the binary */
    kmp_arena arena;
};

/* -- request ----------------------------------------------------------------------------------------- */

static kempe_status read_options(kempe_fmu_export *made, const kempe_fmu_options *o)
{
    const char *kind = o->kind ? o->kind : "me,cs";
    char **words = NULL;
    kmp_unit_plan *plan = &made->plan;
    plan->fmi = o->fmi ? o->fmi : 3;
    if (plan->fmi != 2 && plan->fmi != 3)
        return kmp_fail(made->context, KEMPE_E_ARGUMENT, "the FMI version %d does not exist; versions are 2 and 3",
                        plan->fmi);
    int count = kmp_text_words(&made->arena, kind, &words);
    KMP_TRY(kmp_made(made->context, !made->arena.failed));
    for (int k = 0; k < count; k++)
        if (strcmp(words[k], "me") == 0)
            plan->exchange = true;
        else if (strcmp(words[k], "cs") == 0)
            plan->simulation = true;
        else
            return kmp_fail(made->context, KEMPE_E_ARGUMENT,
                            "unknown kind of unit '%s'; kinds are me (model exchange) and cs (co-simulation)",
                            words[k]);
    if (!plan->exchange && !plan->simulation)
        return kmp_fail(made->context, KEMPE_E_ARGUMENT, "the kind of unit is missing: me, cs or me,cs");
    plan->on_library = o->unit_file; /* co-simulation alone, by a library of units that is there */
    if (plan->on_library && o->kind && plan->exchange)
        return kmp_fail(made->context, KEMPE_E_ARGUMENT,
                        "a unit on the library is of co-simulation: leave out the kind me, or export sources");
    if (plan->on_library && (o->no_binary || o->compiler))
        return kmp_fail(made->context, KEMPE_E_ARGUMENT,
                        "a unit on the library has no sources: leave out the options of a compiler");
    plan->exchange = plan->exchange && !plan->on_library;
    return KEMPE_OK;
}

/* -- files ------------------------------------------------------------------------------------------- */

static bool add_lines(kmp_code_files *files, const char *folder, const char *name, const char *const *lines)
{
    kmp_text *text = kmp_code_add(files, "%s%s", folder, name);
    for (int k = 0; text && lines[k]; k++)
        kmp_text_put(text, lines[k]);
    return text;
}

static bool add_copy(kmp_code_files *files, const char *folder, const char *name, const char *text)
{
    kmp_text *copy = kmp_code_add(files, "%s%s", folder, name);
    if (copy && text)
        kmp_text_put(copy, text);
    return copy && text;
}

/* The C files: those of the simulator, the layers of this version, the table of the unit. */
static bool add_sources(kempe_fmu_export *made)
{
    static const struct {
        int fmi; /* 0: of both versions */
        const char *name, *const *lines;
    } layers[] = {{0, "kempe_fmu.h", kmp_kempe_fmu_h},   {0, "kempe_fmu.c", kmp_kempe_fmu_c},
                  {0, "kempe_fmi.h", kmp_kempe_fmi_h},
                  {2, "kempe_fmi2.c", kmp_kempe_fmi2_c},
                  {2, "fmi2Functions.h", kmp_fmi2Functions_h},
                  {2, "fmi2FunctionTypes.h", kmp_fmi2FunctionTypes_h},
                  {2, "fmi2TypesPlatform.h", kmp_fmi2TypesPlatform_h},
                  {3, "kempe_fmi3.c", kmp_kempe_fmi3_c},
                  {3, "fmi3Functions.h", kmp_fmi3Functions_h},
                  {3, "fmi3FunctionTypes.h", kmp_fmi3FunctionTypes_h},
                  {3, "fmi3PlatformTypes.h", kmp_fmi3PlatformTypes_h}};
    kmp_unit_plan *plan = &made->plan;
    kmp_code_files *files = &made->sources;
    bool ok = true;
    for (int k = 0; ok && k < kempe_code_file_count(made->code); k++)
        ok = add_copy(files, "", kempe_code_file_name(made->code, k), kempe_code_file_text(made->code, k));
    for (size_t k = 0; ok && k < sizeof layers / sizeof *layers; k++)
        if (layers[k].fmi == 0 || layers[k].fmi == plan->fmi)
            ok = add_lines(files, "", layers[k].name, layers[k].lines);
    char *table = ok ? kmp_arena_printf(&made->arena, "%s_fmu.c", plan->source->name) : NULL;
    kmp_text *text = table ? kmp_code_add(files, "%s", table) : NULL;
    if (text)
        kmp_unit_table(text, plan);
    plan->sources = text ? KMP_ARENA_NEW(&made->arena, char *, files->count) : NULL;
    for (int k = 0; plan->sources && k < files->count; k++) {
        const char *ending = strrchr(files->file[k].name, '.');
        if (ending && strcmp(ending, ".c") == 0)
            plan->sources[plan->source_count++] = files->file[k].name;
    }
    return plan->sources;
}

/* The mechanism at its start: icon.svg and icon.png, or model.png in version 2. A .png needs librsvg; without it the
 * unit has none. */
static bool add_picture(kempe_fmu_export *made)
{
    const kmp_code_source *source = made->plan.source;
    const bool second = made->plan.fmi == 2;
    kmp_text svg = {0}, png = {0};
    bool ok = kmp_mechanism_picture(&svg, source->model, source->simulated->q, KMP_UNIT_ICON);
    kmp_text *text = ok && !second ? kmp_code_add(&made->files, "terminalsAndIcons/icon.svg") : NULL;
    if (text)
        kmp_text_append(text, svg.s, svg.length);
    ok = ok && (second || text);
    if (ok && kmp_picture_png(&svg, &png)) {
        text = kmp_code_add(&made->files, "%s", second ? "model.png" : "terminalsAndIcons/icon.png");
        ok = text;
        if (text)
            kmp_text_append(text, png.s, png.length);
    }
    kmp_text_free(&svg);
    kmp_text_free(&png);
    return ok;
}

static bool add_description(kempe_fmu_export *made)
{
    kmp_text xml = {0}, terminals = {0};
    bool ok = kmp_unit_describe(&xml, &terminals, &made->plan);
    kmp_text *text = ok ? kmp_code_add(&made->files, "modelDescription.xml") : NULL;
    if (text)
        kmp_text_append(text, xml.s, xml.length);
    if (text && made->plan.fmi == 3) {
        text = kmp_code_add(&made->files, "terminalsAndIcons/terminalsAndIcons.xml");
        if (text)
            kmp_text_append(text, terminals.s, terminals.length);
    }
    kmp_text_free(&xml);
    kmp_text_free(&terminals);
    return text && add_picture(made);
}

static bool add_texts(kempe_fmu_export *made)
{
    const kmp_unit_plan *plan = &made->plan;
    kmp_code_files *files = &made->files;
    kmp_text *text = NULL;
    bool ok = add_description(made);
    for (int k = 0; ok && k < made->sources.count; k++)
        ok = add_copy(files, "sources/", made->sources.file[k].name, made->sources.file[k].text.s);
    if (ok && plan->fmi == 3 && !plan->on_library) {
        text = kmp_code_add(files, "sources/buildDescription.xml");
        ok = text;
        if (ok)
            kmp_unit_build_description(text, plan);
    }
    text = ok ? kmp_code_add(files, "documentation/index.html") : NULL;
    if (text)
        kmp_unit_page(text, plan);
    return text && add_lines(files, "", "documentation/licenses/license.txt", kmp_license_lines);
}

static kempe_status add_binary(kempe_fmu_export *made, const kempe_fmu_options *o)
{
    const char *folder = kmp_unit_binary_folder(made->plan.fmi);
    if (!*folder)
        return kmp_fail(made->context, KEMPE_E_ARGUMENT,
                        "binaries of units are not made on this platform: use --no-binary");
    char *name = kmp_arena_printf(&made->arena, "binaries/%s/%s.so", folder, made->plan.source->name);
    kmp_text *bytes = name ? kmp_code_add(&made->files, "%s", name) : NULL;
    return bytes ? kmp_unit_compile(made->context, &made->sources, &made->plan, o->compiler ? o->compiler : "cc", bytes)
                 : kmp_fail_memory(made->context);
}

/* -- construction ------------------------------------------------------------------------------------ */

static kempe_status make_on_library(kempe_fmu_export *made, const kempe_model *model, const kempe_fmu_options *o)
{
    kmp_unit_plan *plan = &made->plan;
    const char *folder = kmp_unit_binary_folder(plan->fmi);
    char *bytes = NULL;
    size_t length = 0;
    KMP_TRY(kmp_system_new(model, NULL, &made->system));
    made->named = KMP_ARENA_NEW(&made->arena, kmp_code_source, 1);
    KMP_TRY(kmp_made(made->context, made->named));
    KMP_TRY(kmp_source_describe(made->named, model, made->system));
    plan->source = made->named;
    kmp_unit_token(plan->token, plan);
    KMP_TRY(kmp_made(made->context, add_texts(made)));
    KMP_TRY(kmp_unit_add_resources(&made->files, &made->arena, model));
    KMP_TRY(kmp_file_read(made->context, KMP_FILE_BINARY, o->unit_file, &bytes, &length));
    char *name = kmp_arena_printf(&made->arena, "binaries/%s/%s.so", folder, plan->source->name);
    kmp_text *binary = name ? kmp_code_add(&made->files, "%s", name) : NULL;
    if (binary)
        kmp_text_append(binary, bytes, length);
    kmp_free(bytes);
    return kmp_made(made->context, binary && !binary->failed);
}

static kempe_status make(kempe_fmu_export *made, const kempe_model *model, const kempe_fmu_options *o)
{
    const kempe_generate_options generation = {.size = sizeof generation, .language = "c", .simulator = 1};
    kmp_unit_plan *plan = &made->plan;
    KMP_TRY(read_options(made, o));
    if (plan->on_library)
        return make_on_library(made, model, o);
    KMP_TRY(kempe_code_new(model, &generation, &made->code));
    plan->source = kmp_code_source_of(made->code);
    kmp_unit_token(plan->token, plan);
    KMP_TRY(kmp_made(made->context, add_sources(made) && add_texts(made)));
    for (int k = 0; k < made->files.count; k++)
        KMP_TRY(kmp_made(made->context, made->files.file[k].text.s && !made->files.file[k].text.failed));
    return o->no_binary ? KEMPE_OK : add_binary(made, o);
}

kempe_status kempe_fmu_export_new(const kempe_model *model, const kempe_fmu_options *options, kempe_fmu_export **out)
{
    KMP_WANTED(NULL, model, "model");
    KMP_WANTED(model->context, out, "made");
    KMP_OPTIONS(model->context, kempe_fmu_options, options);
    kmp_context_clear(model->context);
    KMP_TRY(kmp_model_check_finished(model));
    KMP_MAKE(model->context, kempe_fmu_export, made);
    made->context = model->context;
    kempe_status status = make(made, model, options);
    return KMP_GIVE_OR_FREE(status, out, made, kempe_fmu_export_free);
}

void kempe_fmu_export_free(kempe_fmu_export *made)
{
    if (!made)
        return;
    kmp_code_files_free(&made->files);
    kmp_code_files_free(&made->sources);
    kempe_code_free(made->code);
    if (made->named)
        kmp_source_free(made->named);
    kempe_system_free(made->system);
    kmp_arena_free(&made->arena);
    kmp_free(made);
}

KMP_GETTER(int kempe_fmu_export_file_count(const kempe_fmu_export *made), made, made->files.count, 0)
KMP_GETTER_AT(const char *kempe_fmu_export_file_name(const kempe_fmu_export *made, int k), made, k, made->files.count,
              made->files.file[k].name, "")

kempe_status kempe_fmu_export_write(const kempe_fmu_export *made, const char *path)
{
    KMP_WANTED_BOTH(made, path);
    kmp_context_clear(made->context);
    kmp_zip zip = {0};
    for (int k = 0; k < made->files.count; k++)
        kmp_zip_add(&zip, made->files.file[k].name, made->files.file[k].text.s, made->files.file[k].text.length);
    kmp_text text = kmp_zip_end(&zip);
    return kmp_file_write(made->context, path, &text);
}

/* -- printing ---------------------------------------------------------------------------------------- */

static void show(kmp_text *text, const void *result)
{
    const kempe_fmu_export *made = result;
    const kmp_code_source *s = made->plan.source;
    kmp_text_printf(
        text,
        "%s as a functional mock-up unit, FMI %d.0%s%s%s\n\n  token       %s\n  states      %d\n  inputs      "
        "%d\n  outputs     %d\n  parameters  %d\n  conditions  %d\n\n",
        s->title, made->plan.fmi, made->plan.exchange ? ", model exchange" : "",
        made->plan.simulation ? ", co-simulation" : "", made->plan.on_library ? ", on the library" : "",
        made->plan.token, 2 * s->simulated->freedom, s->input_count, s->output_count, s->parameter_count,
        s->simulated->condition_count);
    for (int k = 0; k < made->files.count; k++)
        kmp_text_printf(text, "  %-36s %8zu bytes\n", made->files.file[k].name, made->files.file[k].text.length);
}

static void write_json(kmp_text *text, const void *result)
{
    const kempe_fmu_export *made = result;
    const kmp_code_source *s = made->plan.source;
    kmp_json json = kmp_json_begin(text);
    kmp_json_put(&json, "{ model %s status %s reason %s fmi %d token %s states %d inputs %d outputs %d", s->title,
                 kmp_status_word(KEMPE_OK), "", made->plan.fmi, made->plan.token, 2 * s->simulated->freedom,
                 s->input_count, s->output_count);
    kmp_json_put(&json, "parameters %d conditions %d files [", s->parameter_count, s->simulated->condition_count);
    for (int k = 0; k < made->files.count; k++)
        kmp_json_string(&json, NULL, made->files.file[k].name);
    kmp_json_put(&json, "] }");
}

kempe_status kempe_fmu_export_print(const kempe_fmu_export *made, kempe_format format, char **text)
{
    KMP_WANTED_BOTH(made, text);
    return kmp_print_result(made->context, format == KEMPE_JSON ? write_json : show, made, text);
}
