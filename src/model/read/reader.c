/* SPDX-License-Identifier: BSD-3-Clause */
/* Reading a model: the parts of the file in the order in which they refer to each other. No error ends the reading;
 * parts that depend on a faulty one are skipped, and the messages are sorted by place at the end. The language:
 * docs/model. */
#include "model/read/reader.h"
#include "base/file.h"
#include "base/memory.h"
#include "base/wings.h"
#include "model/data/cam.h"
#include "model/data/model.h"
#include "model/data/variant.h"
#include "model/files/document.h"
#include "model/files/element_library.h"
#include "model/read/body_models.h"
#include "model/read/clearance.h"
#include "model/read/model_builder.h"
#include "model/read/outline_pairs.h"
#include "model/read/part_counts.h"
#include "model/read/read_algebraic.h"
#include "model/read/read_bearings.h"
#include "model/read/read_bodies.h"
#include "model/read/read_closures.h"
#include "model/read/read_flexible.h"
#include "model/read/read_forces.h"
#include "model/read/read_gears.h"
#include "model/read/read_include.h"
#include "model/read/read_mass.h"
#include "model/read/read_outlines.h"
#include "model/read/read_outputs.h"
#include "model/read/read_parameters.h"
#include "model/read/read_ports.h"
#include "model/read/read_reaction.h"
#include "model/read/read_ropes.h"
#include "model/read/read_run.h"
#include "model/read/read_states.h"
#include "model/read/read_tables.h"
#include "model/read/read_values.h"
#include "model/read/reading.h"
#include "model/read/rope_elements.h"
#include "model/read/segments.h"
#include "platform/platform.h"
#include "symbolic/table_function.h"
#include <kempe/settings.h>
#include <math.h>
#include <string.h>

const kmp_key kmp_model_keys[] = {
#include "model/keys/model_keys.def"
    {0}};

/* -- the file's own keys --------------------------------------------------------------------------- */

bool kmp_read_version(kmp_reader *r, const kmp_yaml *root, const char *what)
{
    const kmp_yaml *version = kmp_read_required(r, root, what, "kempe");
    if (!version || strcmp(version->text, "1") == 0)
        return true;
    return kmp_reader_complain(r, version->place, "kempe: this program reads version 1 of the model format, not '%s'",
                               version->text);
}

/* The file's name without folders and ending. */
static const char *name_of_file(kmp_reader *r)
{
    const char *base = kmp_path_name(r->file);
    const char *dot = strrchr(base, '.');
    size_t length = dot && dot != base ? (size_t)(dot - base) : strlen(base);
    char *name = kmp_arena_printf(&r->scratch, "%.*s", (int)length, base);
    if (name)
        kmp_text_clean(name, '_');
    return name;
}

static void read_head(kmp_reader *r)
{
    const kmp_yaml *name = kmp_yaml_get(r->root, "name");
    const kmp_yaml *gravity = kmp_yaml_get(r->root, "gravity");
    const char *given = name ? kmp_read_word(r, name, "name") : name_of_file(r);
    r->model->name = given ? kmp_arena_strdup(&r->model->arena, given) : "";
    if (gravity)
        kmp_read_vector(r, gravity, "gravity", kmp_key_dimension(kmp_model_keys, "gravity"), r->model->gravity);
}

static void read_closure_tolerance(kmp_reader *r)
{
    const kmp_yaml *node = kmp_yaml_get(r->root, "closure_tolerance");
    kmp_number *tolerance = &r->model->closure_tolerance;
    if (!node || !kmp_read_number(r, node, "closure_tolerance", kmp_key_dimension(kmp_model_keys, "closure_tolerance"),
                                  tolerance))
        return;
    r->model->closure_tolerance_given = tolerance->value >= 0;
    if (!r->model->closure_tolerance_given)
        kmp_reader_complain(r, node->place, "closure_tolerance: %g m is negative; 0 means that no gap is accepted",
                            tolerance->value);
}

/* -- sections of wings ------------------------------------------------------------------------------ */

static bool has_reader(const char *section)
{
    for (const kmp_wing *const *wing = kmp_wings; *wing; wing++)
        for (int k = 0; (*wing)->reader && (*wing)->reader->sections[k]; k++)
            if (strcmp((*wing)->reader->sections[k], section) == 0)
                return true;
    return false;
}

/* A section that this build of the library cannot read is an error: nothing of a model is left out in silence. */
static void refuse_sections_without_wing(kmp_reader *r)
{
    static const struct {
        const char *name, *lacks, *option;
    } sections[] = {{"profiles", "wheels on rails", "RAIL"},
                    {"tracks", "wheels on rails", "RAIL"},
                    {"wheels", "wheels on rails", "RAIL"},
                    {"roads", "tyres on roads", "ROAD"},
                    {"tyres", "tyres on roads", "ROAD"}};
    for (size_t k = 0; k < sizeof sections / sizeof *sections; k++) {
        const kmp_yaml *section = kmp_yaml_get(r->root, sections[k].name);
        if (!section || has_reader(sections[k].name))
            continue;
        r->unread = true;
        kmp_reader_complain(r, section->place, "%s: this build of Kempe has no %s; configure it with -DKEMPE_%s=ON",
                            sections[k].name, sections[k].lacks, sections[k].option);
    }
}

void kmp_read_wings(kmp_reader *r, kmp_reader_stage stage)
{
    for (const kmp_wing *const *wing = kmp_wings; *wing; wing++)
        if ((*wing)->reader)
            (*wing)->reader->read(r, stage);
}

static void read_parts(kmp_reader *r)
{
    if (r->root->kind != KMP_YAML_MAP) {
        kmp_reader_complain(r, r->root->place, "a model is a mapping that begins with 'kempe: 1'");
        return;
    }
    if (!kmp_read_version(r, r->root, "the model"))
        return;
    kmp_read_map(r, r->root, "the model", kmp_model_keys);
    if (kmp_refuse_ports(r))
        return;
    refuse_sections_without_wing(r);
    kmp_read_includes(r);
    kmp_read_clearances(r);
    kmp_read_gear_losses(r);
    kmp_read_rope_elements(r);
    kmp_read_parameters(r);
    kmp_fix_part_counts(r);
    kmp_read_inputs(r);
    kmp_read_tables(r);
    kmp_read_wings(r, KMP_READ_AFTER_TABLES);
    kmp_read_body_models(r);
    kmp_read_segments(r);
    read_head(r);
    kmp_read_bodies(r);
    kmp_segments_set_masses(r);
    kmp_read_pressed(r);
    kmp_read_flexibles(r);
    kmp_read_ropes(r);
    kmp_read_outlines(r);
    kmp_read_states(r);
    kmp_read_wings(r, KMP_READ_AFTER_STATES);
    kmp_read_unknowns(r);
    kmp_read_closures(r);
    read_closure_tolerance(r);
    kmp_read_late_unknowns(r);
    kmp_read_forces(r);
    kmp_segments_stiffen(r);
    kmp_read_bearings(r);
    kmp_read_start(r);
    kmp_settle_ropes(r);
    kmp_settle_outlines(r);
    kmp_read_sensors(r);
    kmp_read_run(r);
    kmp_check_ports(r);
    kmp_settle_parameters(r);
    kmp_settle_inputs(r);
    kmp_warn_of_turns(r);
    kmp_warn_of_sizes(r);
}

/* -- reading ------------------------------------------------------------------------------------- */

static kempe_model *new_model(kempe_context *context, const char *label)
{
    kempe_model *model = KMP_NEW(kempe_model, 1);
    if (!model)
        return NULL;
    model->context = context;
    model->source.file = kmp_arena_strdup(&model->arena, label);
    if (model->source.file)
        return model;
    kempe_model_free(model);
    return NULL;
}

/* `status`: of loading the document. */
static kempe_status read_document(kmp_reader *r, kempe_status status)
{
    if (r->root && status != KEMPE_E_MEMORY)
        read_parts(r);
    if (r->root && status == KEMPE_OK && !r->wrong)
        kmp_note_moments(r);
    bool memory = status != KEMPE_E_MEMORY && !r->scratch.failed && !r->model->arena.failed;
    if (memory && (status != KEMPE_OK || r->wrong)) {
        status = kmp_reader_sort_complaints(r);
        memory = status != KEMPE_E_MEMORY;
    }
    if (memory)
        return status;
    kmp_context_clear(r->context);
    return kmp_fail_memory(r->context);
}

static kempe_status finish_reading(kmp_reader *r, kempe_status loaded, kempe_model **model)
{
    const kmp_yaml *document = r->root; /* before other files and parts of it are joined */
    kempe_status status = read_document(r, loaded);
    if (status == KEMPE_OK && document && document->nodes == 0) { /* that no file in YAML has */
        kmp_text text = {0};
        kmp_yaml_print(&text, document);
        r->model->source.document = kmp_text_keep(&text, &r->model->arena);
        status = kmp_made(r->context, r->model->source.document);
    }
    r->model->source.has_digest = r->digests;
    if (r->digests)
        kmp_digest_end(&r->digest, r->model->source.digest);
    kmp_arena_free(&r->scratch);
    return KMP_GIVE_OR_FREE(status, model, r->model, kempe_model_free);
}

static bool keep_settings(kempe_model *model, const kempe_setting *list, int count)
{
    kempe_setting *kept = KMP_ARENA_NEW(&model->arena, kempe_setting, count);
    for (int k = 0; kept && k < count; k++)
        kept[k] = (kempe_setting){kmp_arena_strdup(&model->arena, list[k].name),
                                  kmp_arena_strdup(&model->arena, list[k].value)};
    model->source.settings = kept;
    model->source.setting_count = count;
    return !model->arena.failed;
}

static kempe_status read_model(kempe_context *context, const char *text, size_t length, const char *label,
                               const kempe_setting *list, int count, const char *bodies_as, kempe_model **model)
{
    kmp_reader r = {.context = context,
                    .model = new_model(context, label),
                    .settings = list,
                    .setting_count = count,
                    .bodies_as = bodies_as,
                    .foreign = kmp_document_is_foreign(label, text, length)};
    if (!r.model || kmp_reader_add_file(&r, label) < 0 || !keep_settings(r.model, list, count)) {
        kempe_model_free(r.model);
        return kmp_fail_memory(context);
    }
    kmp_base base = kmp_context_base(context);
    r.file = r.model->source.file;
    r.digests = true;
    kmp_digest_begin(&r.digest);
    kmp_reader_digest(&r, r.file, text, length);
    if (kmp_context_has_limits(r.context))
        kmp_digest_add_text(&r.digest, "limits");
    if (kmp_context_base(r.context) != KMP_BASE_OF_FORMAT)
        kmp_digest_add_text(&r.digest, kmp_context_base(r.context) == KMP_BASE_FREE ? "free" : "fixed");
    if (r.bodies_as)
        kmp_digest_add_text(&r.digest, r.bodies_as);
    for (int k = 0; k < r.setting_count; k++) {
        kmp_digest_add_text(&r.digest, r.settings[k].name);
        kmp_digest_add_text(&r.digest, r.settings[k].value);
    }
    return finish_reading(&r, kmp_reader_load(&r, 0, text, length, base, &r.root), model);
}

kempe_status kmp_builder_read(kempe_context *context, const kmp_builder *builder, const char *label,
                              kempe_model **model)
{
    kmp_reader r = {.context = context, .model = new_model(context, label), .root = builder->root};
    KMP_TRY(kmp_made(context, r.model));
    r.model->source.files = builder->calls;
    r.model->source.file_count = builder->call_count;
    r.file = r.model->source.file;
    return finish_reading(&r, KEMPE_OK, model);
}

static bool are_settings(const kempe_setting *list, int count)
{
    bool all = list || count <= 0;
    for (int k = 0; all && k < count; k++)
        all = list[k].name && list[k].value;
    return all;
}

/* Adds the model of that name, with its own ending, to the message of a file that does not exist. */
static kempe_status suggest_file(kempe_context *context, const char *path)
{
    static const char *const endings[] = {".yaml", ".urdf", ".mjcf", ".sdf", ".mbs"};
    const char *dot = strrchr(kmp_path_name(path), '.');
    const int stem = dot ? (int)(dot - path) : (int)strlen(path);
    char near[KMP_PATH_MOST], why[KMP_PATH_MOST];
    for (size_t k = 0; k < 2 * (sizeof endings / sizeof *endings); k++) {
        const int length =
            snprintf(near, sizeof near, "%.*s%s", k % 2 == 0 ? (int)strlen(path) : stem, path, endings[k / 2]);
        if (length < 0 || length >= (int)sizeof near || !kmp_path_exists(near))
            continue;
        (void)snprintf(why, sizeof why, "%s", kempe_context_message(context));
        kmp_context_clear(context);
        return kmp_fail(context, KEMPE_E_IO, "%s; did you mean '%s'?", why, near);
    }
    return KEMPE_E_IO;
}

kempe_status kmp_model_read_as(kempe_context *context, const char *path, const kempe_setting *list, int count,
                               const char *bodies_as, kempe_model **model)
{
    char *text;
    size_t length;
    kempe_status status = kmp_is_element(path) ? kmp_element_read(context, path, &text, &length)
                                               : kmp_file_read(context, KMP_FILE_MODEL, path, &text, &length);
    if (status == KEMPE_E_IO && !kmp_is_element(path) && !kmp_path_exists(path))
        return suggest_file(context, path);
    KMP_TRY(status);
    status = read_model(context, text, length, path, list, count, bodies_as, model);
    if (status == KEMPE_OK)
        (*model)->source.from_file = true;
    kmp_free(text);
    return status;
}

kempe_status kmp_model_read_file(kempe_context *context, const char *path, const kempe_setting *list, int count,
                                 kempe_model **model)
{
    return kmp_model_read_as(context, path, list, count, NULL, model);
}

kempe_status kempe_model_read_set(kempe_context *context, const char *path, const kempe_setting *list, int count,
                                  kempe_model **model)
{
    KMP_WANTED(NULL, context, "context");
    KMP_WANTED(context, path, "path");
    KMP_WANTED(context, model, "model");
    KMP_WANTED(context, are_settings(list, count), "a setting");
    kmp_context_begin(context);
    return kmp_model_read_file(context, path, list, count, model);
}

kempe_status kempe_model_read_text_set(kempe_context *context, const char *text, const char *label,
                                       const kempe_setting *list, int count, kempe_model **model)
{
    KMP_WANTED(NULL, context, "context");
    KMP_WANTED(context, text, "text");
    KMP_WANTED(context, label, "label");
    KMP_WANTED(context, model, "model");
    KMP_WANTED(context, are_settings(list, count), "a setting");
    kmp_context_begin(context);
    return read_model(context, text, strlen(text), label, list, count, NULL, model);
}

kempe_status kempe_model_read_text(kempe_context *context, const char *text, const char *label, kempe_model **model)
{
    return kempe_model_read_text_set(context, text, label, NULL, 0, model);
}

/* -- the frozen model ---------------------------------------------------------------------------- */

void kempe_model_free(kempe_model *model)
{
    if (model && model->variant) {
        kmp_variant_free(model->variant); /* it shares the rest with the model that it was made of */
        return;
    }
    if (!model)
        return;
    for (int k = 0; k < model->table_count; k++)
        kmp_table_free(model->tables[k].table), kmp_surface_free(model->tables[k].surface);
    for (int k = 0; k < model->profile_count; k++)
        kmp_profile_free(&model->profiles[k]);
    for (int k = 0; k < model->track_count; k++)
        kmp_track_free(&model->tracks[k]);
    for (int k = 0; k < model->outline_count; k++)
        kmp_cam_free(model->outlines[k].cam);
    kmp_builder_free(model->builder);
    kmp_arena_free(&model->arena);
    kmp_free(model);
}

kempe_status kempe_model_set_closure_tolerance(kempe_model *model, double metres)
{
    KMP_GIVEN(model, KEMPE_E_ARGUMENT);
    kmp_context_clear(model->context);
    if (!(metres >= 0) || !isfinite(metres))
        return kmp_fail(model->context, KEMPE_E_ARGUMENT, "the closure tolerance is a length, 0 or more, not %g",
                        metres);
    model->closure_tolerance = (kmp_number){.value = metres};
    model->closure_tolerance_given = true;
    return KEMPE_OK;
}

KMP_GETTER(const char *kempe_model_name(const kempe_model *model), model, model->name, "")
KMP_GETTER(int kempe_model_coordinate_count(const kempe_model *model), model, model->motion_count, 0)
KMP_GETTER_AT(const char *kempe_model_coordinate_name(const kempe_model *model, int k), model, k, model->motion_count,
              model->motions[k].name, "")
