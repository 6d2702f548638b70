/* SPDX-License-Identifier: BSD-3-Clause */
/* Functional mock-up units: all files are made in memory, then the archive is written at once. */
#include "base/context.h"
#include "base/file.h"
#include "base/memory.h"
#include "base/wings.h"
#include "constraints/inexact/nearest_exact.h"
#include "exchange/code/emitted.h"
#include "exchange/fmu/unit_binary.h"
#include "exchange/fmu/unit_description.h"
#include "exchange/fmu/unit_files.h"
#include "exchange/fmu/unit_lines.h"
#include "exchange/simulator/kempe_simulator.h"
#include "model/data/model.h"
#include "model/data/outline.h"
#include "model/data/touch.h"
#include "output/plot.h"
#include "output/print.h"
#include "output/zip_archive.h"
#include "platform/platform.h"
#include <kempe/generate.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

struct kempe_fmu_export {
    kempe_context *context;
    kempe_code *code;       /* of a unit of sources */
    kmp_code_source *named; /* of a unit on the library */
    kempe_system *system;
    kmp_unit_plan plan;
    const kmp_unit_platform *platforms[KMP_UNIT_PLATFORMS]; /* of its binaries */
    int platform_count;
    kmp_code_files sources; /* in addition to the files of the simulator */
    kmp_code_files files;   /* as they are in the archive; NULL-terminated texts, and the binary */
    kmp_arena arena;
    const char *written; /* the file of the last write; NULL: none yet */
    size_t size;         /* of it, bytes */
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
    plan->on_library = o->unit_file; /* only co-simulation, by a library of units that is there */
    if (plan->on_library && o->kind && plan->exchange)
        return kmp_fail(made->context, KEMPE_E_ARGUMENT,
                        "a unit on the library is of co-simulation: leave out the kind me, or export sources");
    if (plan->on_library && (o->no_binary || o->compiler))
        return kmp_fail(made->context, KEMPE_E_ARGUMENT,
                        "a unit on the library has no sources: leave out the options of a compiler");
    if (o->no_binary && o->platforms)
        return kmp_fail(made->context, KEMPE_E_ARGUMENT,
                        "a unit without a binary is for no platform: leave out the platforms, or no-binary");
    plan->exchange = plan->exchange && !plan->on_library;
    if (!o->no_binary)
        KMP_TRY(kmp_unit_platforms_read(made->context, o, made->platforms, &made->platform_count));
    return KEMPE_OK;
}

/* -- files ------------------------------------------------------------------------------------------- */

static bool add_lines(kmp_code_files *files, const char *name, const char *const *lines)
{
    kmp_text *text = kmp_code_add(files, "%s", name);
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

/* The C files: the files of the simulator, the layers of this version, the table of the unit. */
static bool add_sources(kempe_fmu_export *made)
{
    static const struct {
        int fmi; /* 0: of both versions */
        const char *name, *const *lines;
    } layers[] = {{0, "kempe_fmu.h", kmp_kempe_fmu_h},
                  {0, "kempe_fmu.c", kmp_kempe_fmu_c},
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
            ok = add_lines(files, layers[k].name, layers[k].lines);
    kmp_text *text = ok ? kmp_code_add(files, "%s_fmu.c", plan->source->name) : NULL;
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

/* The mechanism at its start: icon.svg and icon.png, or model.png in version 2. A .png needs librsvg, and a picture the
 * wing that draws; without them the unit has none. */
static bool add_picture(kempe_fmu_export *made)
{
    const kmp_wing *const *wing = kmp_wings;
    while (*wing && !(*wing)->picture)
        wing++;
    if (!*wing)
        return true;
    const kmp_code_source *source = made->plan.source;
    const bool second = made->plan.fmi == 2;
    kmp_text svg = {0}, png = {0};
    bool ok = (*wing)->picture(&svg, source->model, source->simulated->q, KMP_UNIT_ICON);
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
    return text && add_lines(files, "documentation/licenses/license.txt", kmp_license_lines);
}

/* -- binaries -------------------------------------------------------------------------------------------- */

/* The file of a platform's binary, empty. */
static kmp_text *add_place(kempe_fmu_export *made, const kmp_unit_platform *platform)
{
    return kmp_code_add(&made->files, "binaries/%s/%s%s", kmp_unit_folder(platform, made->plan.fmi),
                        made->plan.source->name, platform->ending);
}

static kempe_status add_binaries(kempe_fmu_export *made, const kempe_fmu_options *o)
{
    const kmp_unit_platform *const *list = made->platforms;
    for (int k = 0; k < made->platform_count; k++) {
        kmp_text *bytes = add_place(made, list[k]);
        KMP_TRY(kmp_made(made->context, bytes));
        KMP_TRY(kmp_unit_compile(made->context, &made->sources, &made->plan, list[k], o->compiler, bytes));
    }
    return KEMPE_OK;
}

/* The library of units of each platform. */
static kempe_status add_libraries(kempe_fmu_export *made, const kempe_fmu_options *o)
{
    const kmp_unit_platform *const *list = made->platforms;
    for (int k = 0; k < made->platform_count; k++) {
        char *bytes = NULL;
        size_t length = 0;
        const char *file = kmp_unit_library_of(&made->arena, o->unit_file, list[k]);
        KMP_TRY(kmp_made(made->context, file));
        if (!kmp_unit_is_own(list[k]) && !kmp_path_readable(file))
            return kmp_fail(
                made->context, KEMPE_E_FAILED,
                "the library of units for %s is not there: '%s'; a build of Kempe for that platform makes it",
                list[k]->name, file);
        KMP_TRY(kmp_file_read(made->context, KMP_FILE_BINARY, file, &bytes, &length));
        kmp_text *binary = add_place(made, list[k]);
        if (binary)
            kmp_text_append(binary, bytes, length);
        kmp_free(bytes);
        KMP_TRY(kmp_made(made->context, binary && !binary->failed));
    }
    return KEMPE_OK;
}

/* -- resources of a unit on the library ------------------------------------------------------------------ */

static kempe_status add_bytes(kempe_context *context, kmp_code_files *files, const char *name, const char *bytes,
                              size_t length)
{
    kmp_text *text = kmp_code_add(files, "resources/%s", name);
    if (text)
        kmp_text_append(text, bytes, length);
    return kmp_made(context, text && !text->failed);
}

/* Whole paths of the files, and the length of the folder that all are in. */
static kempe_status find_files(const kempe_model *model, kmp_arena *arena, char **whole, size_t *common)
{
    for (int k = 0; k < model->source.path_count; k++) {
        char path[KMP_PATH_MOST];
        whole[k] = kmp_path_real(model->source.paths[k], path) ? kmp_arena_strdup(arena, path) : NULL;
        if (!whole[k])
            return kmp_fail(model->context, KEMPE_E_INPUT,
                            "the file '%s' of the model is not there: a unit on the library contains the model's files",
                            model->source.paths[k]);
        size_t same = 0;
        while (whole[0][same] && whole[0][same] == whole[k][same])
            same++;
        *common = k == 0 || same < *common ? same : *common;
    }
    while (*common > 0 && whole[0][*common - 1] != '/')
        --*common;
    return KEMPE_OK;
}

static kempe_status add_files(kmp_code_files *files, kmp_arena *arena, const kempe_model *model, const char **main_file)
{
    char **whole = KMP_ARENA_NEW(arena, char *, model->source.path_count);
    size_t common = 0, length = 0;
    KMP_TRY(kmp_made(model->context, whole));
    KMP_TRY(find_files(model, arena, whole, &common));
    for (int k = 0; k < model->source.path_count; k++) {
        char *text = NULL;
        const char *name = kmp_arena_printf(arena, "model/%s", whole[k] + common);
        KMP_TRY(kmp_made(model->context, name));
        KMP_TRY(kmp_file_read(model->context, KMP_FILE_INCLUDED, whole[k], &text, &length));
        kempe_status status = add_bytes(model->context, files, name, text, length);
        kmp_free(text);
        KMP_TRY(status);
    }
    *main_file = kmp_arena_printf(arena, "model/%s", whole[0] + common);
    return kmp_made(model->context, *main_file);
}

/* -- construction ------------------------------------------------------------------------------------ */

/* Adds the files of the model to the archive, below resources/. */
static kempe_status add_resources(kmp_code_files *files, kmp_arena *arena, const kempe_model *model)
{
    const char *main_file = "model/model.yaml";
    kmp_text list = {0};
    const bool has_file = model->source.path_count > 0 && kmp_path_readable(model->source.paths[0]);
    if (model->source.document && !has_file) /* built in code, or read from a text */
        KMP_TRY(add_bytes(model->context, files, main_file, model->source.document, strlen(model->source.document)));
    else
        KMP_TRY(add_files(files, arena, model, &main_file));
    kmp_text_printf(&list, "%s\n", main_file);
    for (int k = 0; k < model->source.setting_count; k++)
        if (!strchr(model->source.settings[k].value, ':')) /* samples come from the importer */
            kmp_text_printf(&list, "%s=%s\n", model->source.settings[k].name, model->source.settings[k].value);
    kempe_status status = kmp_made(model->context, !list.failed);
    if (status == KEMPE_OK)
        status = add_bytes(model->context, files, KMP_UNIT_LIST, list.s, list.length);
    kmp_text_free(&list);
    return status;
}

static kempe_status make_on_library(kempe_fmu_export *made, const kempe_model *model, const kempe_fmu_options *o)
{
    kmp_unit_plan *plan = &made->plan;
    KMP_TRY(kmp_system_new(model, NULL, &made->system));
    made->named = KMP_ARENA_NEW(&made->arena, kmp_code_source, 1);
    KMP_TRY(kmp_made(made->context, made->named));
    KMP_TRY(kmp_source_describe(made->named, model, made->system));
    plan->source = made->named;
    kmp_unit_token(plan->token, plan);
    KMP_TRY(kmp_made(made->context, add_texts(made)));
    KMP_TRY(add_resources(&made->files, &made->arena, model));
    return add_libraries(made, o);
}

/* True if a circle that stays on the outline passes from one contact to another: at the end of a copy, or of a run that
 * continues smoothly. */
static bool hands_over(const kmp_outline *outline)
{
    bool over = outline->copies > 1;
    for (int k = 0; k < outline->piece_count; k++) {
        const kmp_piece *piece = &outline->pieces[k], *next = &outline->pieces[(k + 1) % outline->piece_count];
        over = over || (next->run != piece->run && piece->joint != KMP_OUTLINE_CONCAVE &&
                        (outline->closed || k + 1 < outline->piece_count));
    }
    return over;
}

/* An importer that integrates the equations does not pass from one contact to the next while it stays closed. */
static kempe_status refuse_outlines(const kempe_model *model)
{
    for (int c = 0; c < model->outline_contact_count; c++) {
        const kmp_outline_contact *contact = &model->outline_contacts[c];
        const bool law = model->forces[contact->first].kind == KMP_FORCE_COMPLIANT;
        for (int k = 0; k < 2; k++)
            if (contact->outline[k] && (law || hands_over(contact->outline[k])))
                return kmp_fail(
                    model->context, KEMPE_E_ARGUMENT,
                    "units with equations: the contact '%s' passes along the outline '%s', which is not supported "
                    "in model exchange; a unit with the library simulates it: --binary",
                    contact->name, contact->outline[k]->name);
    }
    return KEMPE_OK;
}

static kempe_status make(kempe_fmu_export *made, const kempe_model *model, const kempe_fmu_options *o)
{
    const kempe_generate_options generation = {.size = sizeof generation, .language = "c", .simulator = 1};
    kmp_unit_plan *plan = &made->plan;
    KMP_TRY(read_options(made, o));
    if (plan->on_library)
        return make_on_library(made, model, o);
    KMP_TRY(refuse_outlines(model));
    KMP_TRY(kempe_code_new(model, &generation, &made->code));
    plan->source = kmp_code_source_of(made->code);
    kmp_unit_token(plan->token, plan);
    KMP_TRY(kmp_made(made->context, add_sources(made) && add_texts(made)));
    for (int k = 0; k < made->files.count; k++)
        KMP_TRY(kmp_made(made->context, made->files.file[k].text.s && !made->files.file[k].text.failed));
    return o->no_binary ? KEMPE_OK : add_binaries(made, o);
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

kempe_status kempe_fmu_export_write(kempe_fmu_export *made, const char *path)
{
    KMP_WANTED_BOTH(made, path);
    kmp_context_clear(made->context);
    kmp_zip zip = {0};
    for (int k = 0; k < made->files.count; k++)
        kmp_zip_add(&zip, made->files.file[k].name, made->files.file[k].text.s, made->files.file[k].text.length);
    kmp_text text = kmp_zip_end(&zip);
    const size_t size = text.length;
    KMP_TRY(kmp_file_write(made->context, path, &text));
    made->written = kmp_arena_strdup(&made->arena, path);
    made->size = size;
    return kmp_made(made->context, made->written);
}

/* -- printing ---------------------------------------------------------------------------------------- */

/* The folders of the binaries inside, which have the names of their platforms. */
static void put_platforms(kmp_text *text, const kempe_fmu_export *made)
{
    static const char folder[] = "binaries/";
    bool any = false;
    for (int k = 0; k < made->files.count; k++) {
        const char *name = made->files.file[k].name;
        if (strncmp(name, folder, strlen(folder)) == 0) {
            name += strlen(folder);
            kmp_text_printf(text, ", %.*s", (int)strcspn(name, "/"), name);
            any = true;
        }
    }
    if (!any)
        kmp_text_put(text, ", sources only");
}

static void put_count(kmp_text *text, const char *before, int count, const char *word)
{
    kmp_text_printf(text, "%s%d %s%s", before, count, word, count == 1 ? "" : "s");
}

static void show(kmp_text *text, const void *result)
{
    const kempe_fmu_export *made = result;
    const kmp_code_source *s = made->plan.source;
    kmp_text_printf(text, "%s: %s, %s%sFMI %d.0, %s%s%s", s->title, kempe_outcome_text(KEMPE_OUTCOME_COMPLETE),
                    made->written ? made->written : "", made->written ? ": " : "", made->plan.fmi,
                    made->plan.exchange ? "model exchange" : "",
                    made->plan.exchange && made->plan.simulation ? " and " : "",
                    made->plan.simulation ? "co-simulation" : "");
    if (made->plan.on_library)
        kmp_text_put(text, ", on the library");
    put_platforms(text, made);
    kmp_text_printf(text, made->written ? ", %.0f kB\n" : "\n", 1e-3 * (double)made->size);
    put_count(text, "  ", 2 * s->simulated->freedom, "state");
    put_count(text, ", ", s->input_count, "input");
    put_count(text, ", ", s->output_count, "output");
    put_count(text, ", ", s->parameter_count, "parameter");
    int events = 0;
    for (int k = 0; k < s->simulated->condition_count; k++)
        events += KEMPE_CONDITION_IS_EVENT(s->simulated->condition_kind[k]);
    put_count(text, ", ", events, "event");
    put_count(text, "; ", made->files.count, "file");
    kmp_text_put(text, " inside\n");
}

static void write_json(kmp_text *text, const void *result)
{
    const kempe_fmu_export *made = result;
    const kmp_code_source *s = made->plan.source;
    kmp_json json = kmp_json_begin(text);
    kmp_json_put(&json, "{ model %s status %s reason %s file %s fmi %d token %s states %d inputs %d outputs %d",
                 s->title, kempe_outcome_text(KEMPE_OUTCOME_COMPLETE), "", made->written, made->plan.fmi,
                 made->plan.token, 2 * s->simulated->freedom, s->input_count, s->output_count);
    kmp_json_put(&json, "parameters %d conditions %d files [", s->parameter_count, s->simulated->condition_count);
    for (int k = 0; k < made->files.count; k++)
        kmp_json_string(&json, NULL, made->files.file[k].name);
    kmp_json_put(&json, "] }");
}

kempe_status kempe_fmu_export_print(const kempe_fmu_export *made, kempe_format format, char **text)
{
    KMP_WANTED_BOTH(made, text);
    return kmp_print_result(made->context, format, format == KEMPE_JSON ? write_json : show, made, text);
}
