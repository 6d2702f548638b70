/* SPDX-License-Identifier: BSD-3-Clause */
/* Building a model in code. Every adder writes the nodes that the file would have had, so that all checks are the
 * reader's. Errors show the call in place of the file. */
#include "model/read/model_builder.h"
#include "base/memory.h"
#include "model/data/model.h"
#include "model/data/numbers.h"
#include "model/data/tyre.h"
#include "model/files/nodes.h"
#include "model/read/reader.h"
#include <math.h>
#include <string.h>

/* -- nodes --------------------------------------------------------------------------------------- */

static kmp_place place_of_call(const kmp_builder *b)
{
    return (kmp_place){.file = b->call_count - 1};
}

static kmp_yaml *new_node(kmp_builder *b, kmp_yaml_kind kind)
{
    return kmp_yaml_new(&b->arena, kind, place_of_call(b));
}

static const kmp_yaml *word(kmp_builder *b, const char *text)
{
    return kmp_yaml_word(&b->arena, place_of_call(b), text);
}

/* A number that is not finite becomes an expression that is not, so that the reader reports it. */
static const kmp_yaml *number(kmp_builder *b, kempe_number n)
{
    kmp_text text = {0};
    if (n.text)
        return word(b, n.text);
    if (isfinite(n.value))
        kmp_text_number(&text, n.value);
    else
        kmp_text_put(&text, isnan(n.value) ? "0/0" : n.value > 0 ? "1/0" : "-1/0");
    const char *digits = kmp_text_keep(&text, &b->arena);
    return digits ? word(b, digits) : NULL;
}

static void append(kmp_builder *b, kmp_yaml *list, const kmp_yaml *item)
{
    kmp_yaml_append(&b->arena, list, NULL, item);
}

static void put(kmp_builder *b, kmp_yaml *map, const char *key, const kmp_yaml *item)
{
    kmp_yaml_put(&b->arena, map, place_of_call(b), key, item);
}

static void put_word(kmp_builder *b, kmp_yaml *map, const char *key, const char *text)
{
    kmp_yaml_put_word(&b->arena, map, place_of_call(b), key, text);
}

static const kmp_yaml *vector(kmp_builder *b, const kempe_number *n)
{
    kmp_yaml *list = new_node(b, KMP_YAML_LIST);
    for (int i = 0; i < 3; i++)
        append(b, list, number(b, n[i]));
    return list;
}

static const kmp_yaml *axis_of(kmp_builder *b, const double axis[3])
{
    return vector(b, (const kempe_number[]){kempe_value(axis[0]), kempe_value(axis[1]), kempe_value(axis[2])});
}

static const kmp_yaml *two_words(kmp_builder *b, const char *const words[2])
{
    kmp_yaml *list = new_node(b, KMP_YAML_LIST);
    for (int i = 0; i < 2; i++)
        append(b, list, word(b, words[i]));
    return list;
}

static bool is_given(kempe_number n)
{
    return n.text || n.value != 0;
}

static void put_given(kmp_builder *b, kmp_yaml *map, const char *key, kempe_number n)
{
    if (is_given(n))
        put(b, map, key, number(b, n));
}

/* The mapping (or list) under a key, made when it is not there. Nodes are ours to change until the reading. */
static kmp_yaml *part(kmp_builder *b, kmp_yaml *map, const char *key, kmp_yaml_kind kind)
{
    kmp_yaml *there = (kmp_yaml *)kmp_yaml_get(map, key);
    if (there || !map)
        return there;
    there = new_node(b, kind);
    put(b, map, key, there);
    return there;
}

/* -- calls --------------------------------------------------------------------------------------- */

/* The label of the next call: "WHAT 'NAME'", or WHAT. */
static void begin_call(kmp_builder *b, const char *what, const char *name)
{
    const char *label = kmp_arena_printf(&b->arena, name ? "%s '%s'" : "%s", what, name);
    if (label && KMP_ARENA_GROW(&b->arena, b->calls, b->call_count))
        b->calls[b->call_count++] = label;
}

/* KEMPE_OK if a call may continue: the model is under construction and the name is present. */
static kempe_status check_call(kempe_model *model, const char *what, const char *name)
{
    kmp_context_clear(model->context);
    if (!model->builder)
        return kmp_fail(model->context, KEMPE_E_ARGUMENT, "%s '%s': the model '%s' is finished and cannot be changed",
                        what, name ? name : "", model->name);
    if (!name || !name[0])
        return kmp_fail(model->context, KEMPE_E_ARGUMENT, "a %s needs a name", what);
    return KEMPE_OK;
}

/* The singular of a section's name: "forces" has forces, "bodies" bodies. */
static const char *kind_of(const char *section)
{
    static const char *const words[][2] = {{"bodies", "body"},  {"joints", "joint"}, {"loops", "loop"},
                                           {"forces", "force"}, {"drives", "drive"}, {"parameters", "parameter"},
                                           {"wheels", "wheel"}};
    for (size_t k = 0; k < sizeof words / sizeof *words; k++)
        if (strcmp(words[k][0], section) == 0)
            return words[k][1];
    return section;
}

/* Begins the call that adds an entry to a section. */
static kempe_status begin_entry(kempe_model *model, const char *section, const char *name)
{
    const char *what = kind_of(section);
    KMP_TRY(check_call(model, what, name));
    if (kmp_yaml_get(kmp_yaml_get(model->builder->root, section), name))
        return kmp_fail(model->context, KEMPE_E_ARGUMENT, "%s '%s' exists already in the model", what, name);
    begin_call(model->builder, what, name);
    return KEMPE_OK;
}

static kempe_status end_call(kempe_model *model)
{
    return model->builder->arena.failed ? kmp_fail_memory(model->context) : KEMPE_OK;
}

/* A new entry of a section that the file would have had. */
static kempe_status add(kempe_model *model, const char *section, const char *name, const kmp_yaml *entry)
{
    kmp_builder *b = model->builder;
    if (!b->arena.failed)
        put(b, part(b, b->root, section, KMP_YAML_MAP), name, entry);
    return end_call(model);
}

/* Model file text of the present call; *node is NULL for an empty one. */
static kempe_status load_text(kempe_model *model, const char *text, const kmp_yaml **node)
{
    kmp_builder *b = model->builder;
    int call = b->call_count - 1;
    return kmp_yaml_load(model->context, &b->arena, b->calls[call], call, text, strlen(text), node);
}

/* -- beginning ----------------------------------------------------------------------------------- */

kempe_status kempe_model_new(kempe_context *context, const char *name, kempe_model **model)
{
    KMP_WANTED(NULL, context, "context");
    KMP_WANTED(context, model, "model");
    kmp_context_clear(context);
    KMP_MAKE(context, kempe_model, m);
    m->context = context;
    m->name = m->source.file = kmp_arena_strdup(&m->arena, name && name[0] ? name : "model");
    m->builder = KMP_NEW(kmp_builder, 1);
    if (m->builder && m->name) {
        begin_call(m->builder, m->name, NULL);
        m->builder->root = new_node(m->builder, KMP_YAML_MAP);
        put_word(m->builder, m->builder->root, "kempe", "1");
        put_word(m->builder, m->builder->root, "name", m->name);
    }
    if (!m->name || !m->builder || m->builder->arena.failed) {
        kempe_model_free(m);
        return kmp_fail_memory(context);
    }
    *model = m;
    return KEMPE_OK;
}

KMP_FREES(kmp_builder, builder, kmp_arena_free(&builder->arena))

kempe_status kempe_model_set_gravity(kempe_model *model, kempe_number x, kempe_number y, kempe_number z)
{
    KMP_WANTED(NULL, model, "model");
    const kempe_number n[3] = {x, y, z};
    kmp_builder *b = model->builder;
    KMP_TRY(check_call(model, "model", "gravity"));
    if (kmp_yaml_get(b->root, "gravity"))
        return kmp_fail(model->context, KEMPE_E_ARGUMENT, "gravity is already set");
    begin_call(b, "gravity", NULL);
    put(b, b->root, "gravity", vector(b, n));
    return end_call(model);
}

kempe_status kempe_model_add_parameter(kempe_model *model, const char *name, kempe_number value)
{
    KMP_WANTED(NULL, model, "model");
    KMP_TRY(begin_entry(model, "parameters", name));
    return add(model, "parameters", name, number(model->builder, value));
}

/* -- bodies -------------------------------------------------------------------------------------- */

kempe_body_def kempe_body_default(const char *name)
{
    return (kempe_body_def){.name = name, .at = "ground", .kind = "revolute", .axis = {0, 0, 1}};
}

static const kmp_yaml *motions(kmp_builder *b, const char *text)
{
    kmp_yaml *list = new_node(b, KMP_YAML_LIST);
    while (list && *text) {
        size_t length = strcspn(text, " ,");
        const char *code = length ? kmp_arena_printf(&b->arena, "%.*s", (int)length, text) : NULL;
        append(b, list, code ? word(b, code) : NULL);
        text += length + (text[length] != '\0');
    }
    return list;
}

static const kmp_yaml *joint(kmp_builder *b, const kempe_body_def *def)
{
    kmp_yaml *map = new_node(b, KMP_YAML_MAP);
    put_word(b, map, "name", def->joint);
    put_word(b, map, "at", def->at);
    if (def->kind)
        put(b, map, def->kind, strcmp(def->kind, "weld") == 0 ? word(b, "yes") : axis_of(b, def->axis));
    if (def->motions)
        put(b, map, "motions", motions(b, def->motions));
    return map;
}

static const kmp_yaml *inertia(kmp_builder *b, const kempe_number inertia[6])
{
    kmp_yaml *map = new_node(b, KMP_YAML_MAP);
    for (int i = 0; i < 6; i++)
        put_given(b, map, kmp_inertia_names[i], inertia[i]);
    return map;
}

static void put_given_vector(kmp_builder *b, kmp_yaml *map, const char *key, const kempe_number n[3])
{
    if (is_given(n[0]) || is_given(n[1]) || is_given(n[2]))
        put(b, map, key, vector(b, n));
}

kempe_status kempe_model_add_body(kempe_model *model, const kempe_body_def *def)
{
    KMP_WANTED_BOTH(model, def);
    kmp_builder *b = model->builder;
    KMP_TRY(begin_entry(model, "bodies", def->name));
    kmp_yaml *map = new_node(b, KMP_YAML_MAP);
    if (def->at)
        put(b, map, "joint", joint(b, def));
    put_given(b, map, "mass", def->mass);
    put_given_vector(b, map, "com", def->com);
    const kmp_yaml *entries = inertia(b, def->inertia);
    if (entries && entries->count > 0)
        put(b, map, "inertia", entries);
    return add(model, "bodies", def->name, map);
}

/* The node of the ground, or of a body that exists already. KEMPE_E_ARGUMENT: it does not; `what` and `name` are of the
 * call. */
static kempe_status find_owner(kempe_model *model, const char *what, const char *name, const char *body,
                               kmp_yaml **owner)
{
    kmp_builder *b = model->builder;
    bool ground = body && strcmp(body, "ground") == 0;
    const kmp_yaml *bodies = kmp_yaml_get(b->root, "bodies");
    *owner = ground ? part(b, b->root, "ground", KMP_YAML_MAP) : (kmp_yaml *)kmp_yaml_get(bodies, body ? body : "");
    return *owner || ground ? KEMPE_OK
                            : kmp_fail(model->context, KEMPE_E_ARGUMENT, "%s '%s': body '%s' does not exist yet", what,
                                       name, body ? body : "");
}

kempe_status kempe_model_add_point(kempe_model *model, const char *body, const char *name, kempe_number x,
                                   kempe_number y, kempe_number z)
{
    KMP_WANTED(NULL, model, "model");
    const kempe_number n[3] = {x, y, z};
    kmp_builder *b = model->builder;
    KMP_TRY(check_call(model, "point", name));
    kmp_yaml *owner;
    KMP_TRY(find_owner(model, "point", name, body, &owner));
    if (kmp_yaml_get(kmp_yaml_get(owner, "points"), name))
        return kmp_fail(model->context, KEMPE_E_ARGUMENT, "point '%s.%s' exists already in the model", body, name);
    const char *full = kmp_arena_printf(&b->arena, "%s.%s", body, name);
    begin_call(b, "point", full ? full : name);
    put(b, part(b, owner, "points", KMP_YAML_MAP), name, vector(b, n));
    return end_call(model);
}

/* -- shapes --------------------------------------------------------------------------------------- */

kempe_shape_def kempe_shape_default(const char *body)
{
    return (kempe_shape_def){.body = body, .kind = "box", .opacity = 1};
}

/* The value of the key that is the kind. */
static const kmp_yaml *shape_size(kmp_builder *b, const kempe_shape_def *def)
{
    if (def->file)
        return word(b, def->file);
    if (def->between[0] || def->between[1])
        return two_words(b, def->between);
    bool three = strcmp(def->kind, "box") == 0 || strcmp(def->kind, "ellipsoid") == 0;
    return three ? vector(b, def->dimensions) : number(b, def->dimensions[0]);
}

static const kmp_yaml *shape(kmp_builder *b, const kempe_shape_def *def)
{
    kmp_yaml *map = new_node(b, KMP_YAML_MAP);
    put(b, map, def->kind, shape_size(b, def));
    put_given(b, map, "scale", def->scale);
    put_given(b, map, "radius", def->radius);
    put_word(b, map, "at", def->point);
    if (!def->point)
        put_given_vector(b, map, "at", def->at);
    if (def->axis[0] != 0 || def->axis[1] != 0 || def->axis[2] != 0)
        put(b, map, "axis", axis_of(b, def->axis));
    put_given(b, map, "density", def->density);
    put_given(b, map, "mass", def->mass);
    put_word(b, map, "hole", def->hole ? "yes" : NULL);
    put_word(b, map, "colour", def->colour);
    if (def->opacity != 1)
        put(b, map, "opacity", number(b, kempe_value(def->opacity)));
    return map;
}

kempe_status kempe_model_add_shape(kempe_model *model, const kempe_shape_def *def)
{
    KMP_WANTED_BOTH(model, def);
    kmp_builder *b = model->builder;
    kmp_yaml *owner;
    const kmp_yaml *node = NULL;
    const char *what = def->text ? "text" : def->kind;
    KMP_TRY(check_call(model, "shape", what));
    KMP_TRY(find_owner(model, "shape", what, def->body, &owner));
    begin_call(b, "shape of", def->body);
    KMP_TRY(end_call(model));
    if (def->text)
        KMP_TRY(load_text(model, def->text, &node));
    else
        node = shape(b, def);
    if (node)
        append(b, part(b, owner, "shape", KMP_YAML_LIST), node);
    return end_call(model);
}

/* -- joints between bodies ------------------------------------------------------------------------ */

kempe_joint_def kempe_joint_default(const char *name)
{
    return (kempe_joint_def){.name = name, .kind = "revolute", .axis = {0, 0, 1}};
}

kempe_status kempe_model_add_joint(kempe_model *model, const kempe_joint_def *def)
{
    KMP_WANTED_BOTH(model, def);
    kmp_builder *b = model->builder;
    KMP_TRY(begin_entry(model, "joints", def->name));
    kmp_yaml *map = new_node(b, KMP_YAML_MAP);
    put(b, map, def->kind ? def->kind : "", two_words(b, def->point));
    if (def->kind && strcmp(def->kind, "weld") != 0)
        put(b, map, "axis", axis_of(b, def->axis));
    put_given(b, map, "pitch", def->pitch);
    put_word(b, map, "cut", def->cut > 0 ? "yes" : def->cut < 0 ? "no" : NULL);
    return add(model, "joints", def->name, map);
}

/* -- closures and forces ------------------------------------------------------------------------- */

kempe_closure_def kempe_closure_default(const char *name)
{
    return (kempe_closure_def){.name = name, .kind = "ball"};
}

kempe_status kempe_model_add_closure(kempe_model *model, const kempe_closure_def *def)
{
    KMP_WANTED_BOTH(model, def);
    kmp_builder *b = model->builder;
    KMP_TRY(begin_entry(model, "loops", def->name));
    kmp_yaml *map = new_node(b, KMP_YAML_MAP);
    put(b, map, def->kind ? def->kind : "", two_words(b, def->point));
    put_given(b, map, "length", def->length);
    return add(model, "loops", def->name, map);
}

kempe_force_def kempe_force_default(const char *name)
{
    return (kempe_force_def){.name = name};
}

kempe_status kempe_model_add_force(kempe_model *model, const kempe_force_def *def)
{
    KMP_WANTED_BOTH(model, def);
    kmp_builder *b = model->builder;
    KMP_TRY(begin_entry(model, "forces", def->name));
    kmp_yaml *map = new_node(b, KMP_YAML_MAP);
    put_word(b, map, "joint", def->joint);
    put_word(b, map, "torque", def->torque);
    put_word(b, map, "force", def->force);
    if (def->spring[0] || def->spring[1]) {
        put(b, map, "spring", two_words(b, def->spring));
        put(b, map, "stiffness", number(b, def->stiffness));
    }
    put_given(b, map, "damping", def->damping);
    put_given(b, map, "free_length", def->free_length);
    return add(model, "forces", def->name, map);
}

/* -- other parts of the language ------------------------------------------------------------------- */

kempe_status kempe_model_add_text(kempe_model *model, const char *section, const char *name, const char *text)
{
    KMP_WANTED_BOTH(model, section);
    KMP_WANTED(model->context, text, "text");
    const kmp_yaml *node = NULL;
    KMP_TRY(begin_entry(model, section, name));
    KMP_TRY(end_call(model));
    KMP_TRY(load_text(model, text, &node));
    return node ? add(model, section, name, node) : KEMPE_OK;
}

/* -- start --------------------------------------------------------------------------------------- */

static kempe_status set_start(kempe_model *model, const char *coordinate, const char *key, kempe_number value,
                              bool hold)
{
    kmp_builder *b = model->builder;
    KMP_TRY(check_call(model, "start value", coordinate));
    if (kmp_yaml_get(kmp_yaml_get(kmp_yaml_get(b->root, "start"), key), coordinate))
        return kmp_fail(model->context, KEMPE_E_ARGUMENT, "the start %s of '%s' is already set", key, coordinate);
    begin_call(b, "start of", coordinate);
    kmp_yaml *start = part(b, b->root, "start", KMP_YAML_MAP);
    put(b, part(b, start, key, KMP_YAML_MAP), coordinate, number(b, value));
    kmp_yaml *held = hold ? part(b, start, "hold", KMP_YAML_LIST) : NULL;
    append(b, held, held ? word(b, coordinate) : NULL);
    return end_call(model);
}

kempe_status kempe_model_set_q(kempe_model *model, const char *coordinate, kempe_number value, int hold)
{
    KMP_WANTED(NULL, model, "model");
    return set_start(model, coordinate, "q", value, hold != 0);
}

kempe_status kempe_model_set_qd(kempe_model *model, const char *coordinate, kempe_number value)
{
    KMP_WANTED(NULL, model, "model");
    return set_start(model, coordinate, "qd", value, false);
}

/* -- finishing ----------------------------------------------------------------------------------- */

kempe_status kempe_model_finish(kempe_model *model)
{
    KMP_WANTED(NULL, model, "model");
    kempe_model *read = NULL;
    kempe_status status = check_call(model, "model", model->name);
    if (status == KEMPE_OK)
        status = end_call(model); /* an adder may have failed unheard */
    if (status == KEMPE_OK)
        status = kmp_builder_read(model->context, model->builder, model->name, &read);
    if (status != KEMPE_OK)
        return status;
    kmp_builder_free(model->builder);
    kmp_arena_free(&model->arena);
    *model = *read;
    kmp_free(read);
    /* Later messages about a built object contain its name: they begin with the model's label instead of the calls.
     */
    model->source.files = &model->source.file;
    model->source.file_count = 1;
    for (int i = 0; i < model->body_count; i++)
        model->bodies[i].place = (kmp_place){0};
    for (int i = 0; i < model->closure_count; i++)
        model->closures[i].place = (kmp_place){0};
    for (int i = 0; i < model->force_count; i++)
        model->forces[i].place = (kmp_place){0};
    for (int i = 0; i < model->wheel_count; i++)
        model->wheels[i].place = (kmp_place){0};
    for (int i = 0; i < model->tyre_count; i++)
        model->tyres[i].place = (kmp_place){0};
    return KEMPE_OK;
}
