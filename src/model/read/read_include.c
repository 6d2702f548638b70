/* SPDX-License-Identifier: BSD-3-Clause */
/* Files of a model: its messages in their order, and included models. The mappings of an included file are merged with
 * the mappings of the including file before anything is read. Names that its keys define are prefixed here. Names that
 * it refers to are prefixed at look-up (kmp_reader_name), by the file of the referring node. Its ground is a point of
 * the body that it is put on. */
#include "model/read/read_include.h"
#include "base/memory.h"
#include "model/data/model.h"
#include "model/files/document.h"
#include "model/files/element_library.h"
#include "model/files/nodes.h"
#include "model/language/limits.h"
#include "model/read/part_counts.h"
#include "model/read/read_ports.h"
#include "model/read/read_tables.h"
#include "model/read/reader.h"
#include "model/read/reading.h"
#include <stdlib.h>
#include <string.h>

/* -- files and messages ------------------------------------------------------------------------------ */

/* The files of a model, and errors in their order: each message is `label:line:column: sentence`, which is parsed again
 * for sorting. */

int kmp_reader_add_file(kmp_reader *r, const char *label)
{
    kempe_model *model = r->model;
    const char *kept = kmp_arena_strdup(&model->arena, label);
    if (!kept || !KMP_ARENA_GROW(&model->arena, model->source.files, model->source.file_count))
        return -1;
    model->source.files[model->source.file_count] = kept;
    return model->source.file_count++;
}

static char *read_beside(void *user, kmp_place place, int from, const char *name, int *number, size_t *length)
{
    kmp_reader *r = user;
    const char *path = kmp_path_beside(r, from, name);
    *number = path ? kmp_reader_add_file(r, path) : -1;
    return *number < 0 ? NULL
                       : kmp_read_file(r, KMP_FILE_INCLUDED, &(kmp_yaml){.place = place}, "include", path, length);
}

static const char *name_of(void *user, int number)
{
    const kmp_reader *r = user;
    return r->model->source.files[number];
}

static void note(void *user, const char *line, bool altered)
{
    kempe_model *model = ((kmp_reader *)user)->model;
    const char *kept = kmp_arena_strdup(&model->arena, line);
    model->source.altered = model->source.altered || altered;
    if (kept && KMP_ARENA_GROW(&model->arena, model->source.notes, model->source.note_count))
        model->source.notes[model->source.note_count++] = kept;
}

void kmp_reader_warn(kmp_reader *r, kmp_place place, const char *format, ...)
{
    kmp_text words = {0}, line = {0};
    KMP_TEXT_ARGUMENTS(&words, format);
    kmp_text_printf(&line, "%s:%d:%d: %s", r->model->source.files[place.file], place.line, place.column,
                    words.failed ? "" : words.s);
    const char *kept = kmp_text_keep(&line, &r->scratch);
    kmp_text_free(&words);
    if (kept) {
        kmp_log(r->context, KEMPE_LOG_WARNING, "%s", kept);
        note(r, kept, false);
    }
}

kempe_status kmp_reader_load(kmp_reader *r, int number, const char *text, size_t length, kmp_base base,
                             const kmp_yaml **root)
{
    const kmp_include_files beside = {.user = r, .read = read_beside, .name = name_of, .note = note};
    return kmp_document_load(r->context, &r->scratch, r->model->source.files[number], number, text, length, base,
                             &beside, root);
}

static void note_path(kempe_model *model, const char *path)
{
    for (int k = 0; k < model->source.path_count; k++)
        if (strcmp(model->source.paths[k], path) == 0)
            return;
    const char *kept = kmp_arena_strdup(&model->arena, path);
    if (kept && KMP_ARENA_GROW(&model->arena, model->source.paths, model->source.path_count))
        model->source.paths[model->source.path_count++] = kept;
}

void kmp_reader_digest(kmp_reader *r, const char *path, const char *text, size_t length)
{
    const bool element = kmp_is_element(path); /* no file */
    if (!element && kmp_context_note_source(r->context, path) != KEMPE_OK)
        r->model->arena.failed = true;
    if (!r->digests)
        return;
    if (!element)
        note_path(r->model, path);
    kmp_digest_add_text(&r->digest, strrchr(path, '.'));
    kmp_digest_add_part(&r->digest, text, length);
}

typedef struct complaint {
    int file, line, column, order;
    const char *text;
} complaint;

static int compare(const void *a, const void *b)
{
    const complaint *x = a, *y = b;
    if (x->file != y->file)
        return x->file < y->file ? -1 : 1;
    if (x->line != y->line)
        return x->line < y->line ? -1 : 1;
    if (x->column != y->column)
        return x->column < y->column ? -1 : 1;
    return x->order < y->order ? -1 : x->order > y->order;
}

/* The first file whose label and a colon begin `text`: files with equal labels count as one. */
static int find_file(const kempe_model *model, const char *text)
{
    for (int k = 0; k < model->source.file_count; k++) {
        size_t length = strlen(model->source.files[k]);
        if (strncmp(text, model->source.files[k], length) == 0 && text[length] == ':')
            return k;
    }
    return -1;
}

static complaint take_apart(const kempe_model *model, char *text, int order)
{
    complaint c = {.file = find_file(model, text), .order = order, .text = text};
    char *rest = text;
    if (c.file < 0)
        return c;
    rest += strlen(model->source.files[c.file]) + 1;
    if (*rest == ' ') { /* no line: of a model built in code */
        c.text = rest + 1;
        return c;
    }
    c.line = (int)strtol(rest, &rest, 10);
    if (*rest == ':')
        c.column = (int)strtol(rest + 1, &rest, 10);
    c.text = strncmp(rest, ": ", 2) == 0 ? rest + 2 : rest;
    return c;
}

static bool is_repeated(const complaint *list, int i)
{
    for (int k = i - 1; k >= 0 && list[k].file == list[i].file && list[k].line == list[i].line; k--)
        if (list[k].column == list[i].column && strcmp(list[k].text, list[i].text) == 0)
            return true;
    return false;
}

static bool is_of_port(const complaint *c)
{
    return strncmp(c->text, "port '", strlen("port '")) == 0;
}

/* An error that follows from a port that is bound to what is not of its kind, which is reported at the same place, or
 * where the including file binds it. */
static bool follows_from_port(const complaint *list, int count, int i)
{
    const bool inside = strstr(list[i].text, "'port.") && !strstr(list[i].text, "declares no port");
    for (int k = 0; !is_of_port(&list[i]) && k < count; k++)
        if (is_of_port(&list[k]) && (inside || (list[k].file == list[i].file && list[k].line == list[i].line &&
                                                list[k].column == list[i].column)))
            return true;
    return false;
}

/* Reports the number of errors that were not kept, at the last place of those kept. */
static kempe_status say_rest(kmp_reader *r, const complaint *last, int rest)
{
    const char *file = last->file >= 0 ? r->model->source.files[last->file] : r->file;
    kmp_text sentence = {0};
    kmp_text_put(&sentence, file);
    if (last->line > 0)
        kmp_text_printf(&sentence, ":%d:%d", last->line, last->column);
    kmp_text_printf(&sentence, ": at least %d more errors: the first %d are listed", rest, KMP_MOST_COMPLAINTS);
    return kmp_fail_text(r->context, KEMPE_E_INPUT, &sentence);
}

kempe_status kmp_reader_sort_complaints(kmp_reader *r)
{
    kempe_status status = KEMPE_E_INPUT;
    char *text = kmp_arena_strdup(&r->scratch, kempe_context_message(r->context));
    int count = 1, rest = kmp_context_complaints(r->context) - KMP_MOST_COMPLAINTS;
    for (const char *s = text; s && *s; s++)
        count += *s == '\n';
    complaint *list = KMP_ARENA_NEW(&r->scratch, complaint, count);
    if (!text || !list)
        return KEMPE_E_MEMORY;
    for (int i = 0; i < count; i++) {
        char *end = text + strcspn(text, "\n");
        bool last = *end == '\0';
        *end = '\0';
        list[i] = take_apart(r->model, text, i);
        text = last ? end : end + 1;
    }
    qsort(list, (size_t)count, sizeof *list, compare);
    kmp_context_clear(r->context);
    for (int i = 0; i < count && status == KEMPE_E_INPUT; i++) {
        /* In a model built in code a file is one call, without lines; its name is printed once. */
        const complaint *c = &list[i];
        const char *file = c->file >= 0 ? r->model->source.files[c->file] : NULL;
        if (is_repeated(list, i) || follows_from_port(list, count, i))
            continue;
        status = !file || (c->line == 0 && strstr(c->text, file))
                     ? kmp_fail(r->context, KEMPE_E_INPUT, "%s", c->text)
                     : kmp_complain(r->context, file, c->line, c->column, "%s", c->text);
    }
    if (rest > 0 && status == KEMPE_E_INPUT)
        status = say_rest(r, &list[count - 1], rest);
    return status;
}

const kmp_key kmp_include_keys[] = {
#include "model/keys/include_keys.def"
    {0}};

/* Merged parts, and a flag if their keys are new names (the keys of `start` are references). */
static const char *const joined_parts[] = {"parameters", "inputs",   "states", "tables",   "profiles", "tracks",
                                           "algebraic",  "bodies",   "wheels", "roads",    "tyres",    "joints",
                                           "loops",      "gears",    "ropes",  "outlines", "drives",   "forces",
                                           "contacts",   "bearings", "sensors"};

enum { JOINED_PARTS = sizeof joined_parts / sizeof joined_parts[0] };

const kmp_include_instance *kmp_reader_instance(const kmp_reader *r, int file)
{
    for (int k = 0; k < r->instance_count; k++)
        if (r->instances[k].file == file)
            return &r->instances[k];
    return NULL;
}

const char *kmp_reader_name(kmp_reader *r, int file, const char *name)
{
    const char *rest;
    for (const kmp_yaml *port; (port = kmp_port_bound(r, file, name, &rest)); file = port->place.file)
        name = kmp_reader_say(r, "%s%s", port->text, rest);
    const kmp_include_instance *instance = kmp_reader_instance(r, file);
    if (!instance || !instance->prefix[0])
        return name;
    return kmp_reader_say(r, "%s%s", instance->prefix, name);
}

const char *kmp_reader_own_name(const kmp_reader *r, int file, const char *name)
{
    const kmp_include_instance *instance = kmp_reader_instance(r, file);
    return name + (instance ? strlen(instance->prefix) : 0);
}

const char *kmp_reader_body_name(kmp_reader *r, int file, const char *name)
{
    const kmp_include_instance *instance = kmp_reader_instance(r, file);
    if (!instance || strcmp(name, "ground") != 0)
        return kmp_reader_name(r, file, name);
    const char *at = instance->at ? instance->at->text : "ground";
    return kmp_reader_body_name(r, instance->parent, kmp_reader_say(r, "%.*s", (int)strcspn(at, "."), at));
}

static bool includes(const kmp_reader *r, int outer, int file)
{
    const kmp_include_instance *up = kmp_reader_instance(r, file);
    while (up && up->parent != outer)
        up = kmp_reader_instance(r, up->parent);
    return up;
}

bool kmp_reader_said(kmp_reader *r, const char *what, const kmp_yaml *again, kmp_place before)
{
    if (includes(r, before.file, again->place.file))
        return true;
    if (before.file == again->place.file)
        kmp_complain_of(r, again, what, "'%s' is given twice", again->text);
    else
        kmp_complain_of(r, again, what,
                        "'%s' is given twice, also in %s:%d, and neither file includes the other: give it in a file "
                        "that includes both",
                        again->text, r->model->source.files[before.file], before.line);
    return false;
}

/* -- loading ------------------------------------------------------------------------------------- */

/* A file that is being included already, further up. */
static bool goes_in_circle(kmp_reader *r, const kmp_yaml *node, int parent, const char *path)
{
    const kmp_include_instance *up;
    int depth = 0;
    for (int file = parent; file >= 0; file = up ? up->parent : -1, depth++) {
        up = kmp_reader_instance(r, file);
        if (strcmp(r->model->source.files[file], path) == 0 || depth > KMP_MOST_INCLUDE_LEVELS) {
            kmp_reader_complain(r, node->place, "include: '%s' includes itself, directly or through other files", path);
            return true;
        }
    }
    return false;
}

/* A list of names as one text, behind names that hold anyway. */
static const char *names_of(kmp_reader *r, const kmp_yaml *list, const char *others)
{
    kmp_text names = {0};
    kmp_text_printf(&names, "%s,", others ? others : "");
    for (int k = 0; kmp_read_list(r, list, "leave_out of an include", -1) && k < list->count; k++) {
        const char *name = kmp_read_word(r, list->items[k], "leave_out of an include");
        kmp_text_printf(&names, "%s,", name ? name : "");
    }
    return kmp_reader_take(r, &names);
}

/* Loads the file of an instance, once only if it is read for another prefix, too. */
static void load(kmp_reader *r, const kmp_yaml *node, const kmp_yaml *file, const char *path, kmp_include_instance *x)
{
    size_t length;
    const kmp_yaml *names = kmp_yaml_get(node, "leave_out");
    for (int k = 0; k < r->instance_count && !names; k++) {
        const kmp_include_instance *other = &r->instances[k];
        if (other->source->nodes > 0 && other->base == x->base && other->limits == x->limits && !other->leaves_out &&
            strcmp(r->model->source.files[other->file], path) == 0) {
            x->root = x->source = kmp_yaml_again(&r->scratch, other->source, x->file);
            x->foreign = other->foreign;
            return;
        }
    }
    char *text = kmp_read_file(r, KMP_FILE_INCLUDED, file, "include", path, &length);
    bool before = kmp_context_use_limits(r->context, x->limits), altered = r->model->source.altered;
    const char *left_out = kmp_context_use_left_out(r->context, NULL);
    (void)kmp_context_use_left_out(r->context, names ? names_of(r, names, left_out) : left_out);
    x->leaves_out = names;
    x->foreign = text && kmp_document_is_foreign(path, text, length);
    if (text && kmp_reader_load(r, x->file, text, length, x->base, &x->root) != KEMPE_OK)
        r->wrong = true;
    x->source = x->root;
    (void)kmp_context_use_limits(r->context, before);
    (void)kmp_context_use_left_out(r->context, left_out);
    if (names) /* the model requests it: it is the machine */
        r->model->source.altered = altered;
    kmp_free(text);
}

static bool check_root(kmp_reader *r, const kmp_yaml *root)
{
    if (root->kind != KMP_YAML_MAP)
        return kmp_reader_complain(r, root->place, "a model is a mapping that begins with 'kempe: 1'");
    (void)kmp_read_version(r, root, "the included model");
    return kmp_read_map(r, root, "the included model", kmp_model_keys);
}

/* -- joining ------------------------------------------------------------------------------------- */

/* Of two sections to be joined the one that replaces both: the other is missing or empty, or this one is not of the
 * kind, which the reader of the section reports; NULL: they can be joined. */
static const kmp_yaml *only_one(const kmp_yaml *one, const kmp_yaml *other, kmp_yaml_kind kind)
{
    if (!one || !other || one->empty || other->empty)
        return one && !one->empty ? one : other ? other : one;
    return one->kind != kind ? one : other->kind != kind ? other : NULL;
}

static const kmp_yaml *find_key(const kmp_yaml *map, const char *text)
{
    int found = map && map->kind == KMP_YAML_MAP ? kmp_yaml_find(map, text) : -1;
    return found < 0 ? NULL : map->keys[found];
}

static const kmp_yaml *rename_key(kmp_reader *r, const kmp_yaml *key, int file)
{
    kmp_yaml *copy = KMP_ARENA_NEW(&r->scratch, kmp_yaml, 1);
    if (!copy)
        return key;
    *copy = *key;
    copy->text = kmp_reader_name(r, file, key->text);
    return copy;
}

/* Merges two maps; either may be NULL. `file`: of `more`, whose keys are new names; -1: they are references. */
static const kmp_yaml *join_maps(kmp_reader *r, const kmp_yaml *map, const kmp_yaml *more, int file)
{
    const kmp_yaml *one = only_one(map, more, KMP_YAML_MAP);
    if (!more)
        return map;
    if (one && (one != more || more->kind != KMP_YAML_MAP))
        return one;
    kmp_yaml *joined =
        one ? kmp_yaml_new(&r->scratch, KMP_YAML_MAP, (map ? map : more)->place) : kmp_yaml_copy(&r->scratch, map);
    for (int i = 0; i < more->count; i++) {
        const kmp_yaml *key = file < 0 ? more->keys[i] : rename_key(r, more->keys[i], file);
        const kmp_yaml *there = file < 0 ? NULL : find_key(map, key->text);
        if (there)
            kmp_reader_complain(r, key->place, "the name '%s' exists already in %s:%d: use another prefix", key->text,
                                r->model->source.files[there->place.file], there->place.line);
        else
            kmp_yaml_append(&r->scratch, joined, key, more->items[i]);
    }
    return joined ? joined : map;
}

static const kmp_yaml *join_lists(kmp_reader *r, const kmp_yaml *list, const kmp_yaml *more)
{
    const kmp_yaml *one = only_one(list, more, KMP_YAML_LIST);
    if (one || !more)
        return one;
    kmp_yaml *joined = kmp_yaml_copy(&r->scratch, list);
    for (int i = 0; i < more->count; i++)
        kmp_yaml_append(&r->scratch, joined, NULL, more->items[i]);
    return joined ? joined : list;
}

static const kmp_yaml *with_item(kmp_reader *r, const kmp_yaml *map, const char *key, const kmp_yaml *item)
{
    return kmp_yaml_with(&r->scratch, map, key, item);
}

/* A section of a file; NULL: it has none, or what is not a mapping, which is reported where it is read. */
static const kmp_yaml *map_of(const kmp_yaml *root, const char *section)
{
    const kmp_yaml *found = kmp_yaml_get(root, section);
    return found && found->kind == KMP_YAML_MAP ? found : NULL;
}

/* -- values that the including file sets -------------------------------------------------------------- */

/* An input with another value: a number is its default, and a mapping replaces its samples. */
static const kmp_yaml *set_input(kmp_reader *r, const kmp_yaml *input, const kmp_yaml *value)
{
    static const char *const kept[] = {"unit", "default"};
    kmp_yaml *set = value->kind == KMP_YAML_MAP ? kmp_yaml_copy(&r->scratch, value)
                                                : kmp_yaml_new(&r->scratch, KMP_YAML_MAP, value->place);
    if (value->kind != KMP_YAML_MAP)
        kmp_yaml_put(&r->scratch, set, value->place, "default", value);
    for (size_t k = 0; set && k < sizeof kept / sizeof *kept; k++)
        if (!kmp_yaml_get(set, kept[k]))
            kmp_yaml_put(&r->scratch, set, value->place, kept[k], kmp_yaml_get(input, kept[k]));
    return set ? set : input;
}

static bool note_set(kmp_reader *r, const kmp_yaml *value)
{
    if (!KMP_ARENA_GROW(&r->scratch, r->set_values, r->set_count))
        return false;
    r->set_values[r->set_count++] = value;
    return true;
}

/* Values that files above set, of names that begin with the prefix of this one, which is left out here; then the file's
 * own ones, which give way to them. NULL: there are none. */
static const kmp_yaml *values_for(kmp_reader *r, const kmp_yaml *above, const char *prefix, const kmp_yaml *own)
{
    const size_t length = strlen(prefix);
    kmp_yaml *all = above ? kmp_yaml_new(&r->scratch, KMP_YAML_MAP, above->place) : NULL;
    for (int k = 0; all && k < above->count; k++) {
        kmp_yaml *key =
            strncmp(above->keys[k]->text, prefix, length) == 0 ? KMP_ARENA_NEW(&r->scratch, kmp_yaml, 1) : NULL;
        if (!key)
            continue;
        *key = *above->keys[k];
        key->text += length;
        kmp_yaml_append(&r->scratch, all, key, above->items[k]);
    }
    for (int k = 0; all && own && k < own->count; k++)
        if (!find_key(all, own->keys[k]->text))
            kmp_yaml_append(&r->scratch, all, own->keys[k], own->items[k]);
        else if (!note_set(r, own->items[k]))
            return own;
    return all ? all : own;
}

/* The parameters and inputs of an included file, some of them set. `*rest`: values that it does not have itself. */
static const kmp_yaml *set_values(kmp_reader *r, const kmp_yaml *root, const kmp_yaml *set, const kmp_yaml **rest)
{
    const kmp_yaml *parameters = map_of(root, "parameters"), *inputs = map_of(root, "inputs");
    kmp_yaml *others = NULL;
    for (int i = 0; set && i < set->count; i++) {
        const char *name = set->keys[i]->text;
        const kmp_yaml *value = set->items[i];
        if (find_key(parameters, name) && note_set(r, value)) {
            parameters = with_item(r, parameters, name, value);
        } else if (find_key(inputs, name) && note_set(r, value)) {
            inputs = with_item(r, inputs, name, set_input(r, kmp_yaml_get(inputs, name), value));
        } else {
            others = others ? others : kmp_yaml_new(&r->scratch, KMP_YAML_MAP, set->place);
            if (others)
                kmp_yaml_append(&r->scratch, others, set->keys[i], value);
        }
    }
    *rest = others;
    return with_item(r, with_item(r, root, "parameters", parameters), "inputs", inputs);
}

/* Reports values that neither the file nor one that it includes has. */
static void check_set(kmp_reader *r, const kmp_yaml *root, const kmp_yaml *set)
{
    const kmp_yaml *parameters = map_of(root, "parameters"), *inputs = map_of(root, "inputs");
    for (int i = 0; set && i < set->count; i++) {
        bool found = find_key(parameters, set->keys[i]->text) || find_key(inputs, set->keys[i]->text);
        for (int k = 0; k < r->set_count && !found; k++)
            found = r->set_values[k] == set->items[i];
        if (found)
            continue;
        kmp_nearest nearest = kmp_nearest_begin(set->keys[i]->text);
        for (int k = 0; parameters && k < parameters->count; k++)
            kmp_nearest_offer(&nearest, parameters->keys[k]->text);
        kmp_reader_complain_near(r, set->keys[i]->place, &nearest, "include set: '%s' has no parameter '%s'",
                                 r->model->source.files[root->place.file], set->keys[i]->text);
    }
}

/* The joint of a body: its name, and its place. */
static const kmp_yaml *other_kind(kmp_reader *r, const kmp_yaml *joint, const kmp_yaml *kind)
{
    static const char *const kept[] = {"name", "at", "to", "frame"};
    kmp_yaml *other = kmp_yaml_copy(&r->scratch, kind);
    for (size_t k = 0; k < sizeof kept / sizeof *kept; k++)
        kmp_yaml_put(&r->scratch, other, joint->place, kept[k], kmp_yaml_get(joint, kept[k]));
    return other;
}

/* The bodies of an included file, some joints of which the including file makes joints of another kind. */
static const kmp_yaml *set_joints(kmp_reader *r, const kmp_yaml *root, const kmp_yaml *set)
{
    const kmp_yaml *bodies = map_of(root, "bodies");
    if (!set || !kmp_read_map(r, set, "include joints", NULL))
        return root;
    for (int k = 0; k < set->count; k++) {
        kmp_nearest nearest = kmp_nearest_begin(set->keys[k]->text);
        int of = -1;
        for (int i = 0; bodies && i < bodies->count; i++) {
            const kmp_yaml *joint = kmp_yaml_get(bodies->items[i], "joint"), *given = kmp_yaml_get(joint, "name");
            const char *name = given ? given->text : joint ? bodies->keys[i]->text : "";
            kmp_nearest_offer(&nearest, name);
            of = strcmp(name, set->keys[k]->text) == 0 ? i : of;
        }
        if (of < 0)
            kmp_reader_complain_near(r, set->keys[k]->place, &nearest,
                                     "include joints: no body of '%s' has a joint '%s'",
                                     r->model->source.files[root->place.file], set->keys[k]->text);
        else if (kmp_read_map(r, set->items[k], "include joints", NULL)) {
            const kmp_yaml *body = bodies->items[of],
                           *joint = other_kind(r, kmp_yaml_get(body, "joint"), set->items[k]);
            bodies = with_item(r, bodies, bodies->keys[of]->text, with_item(r, body, "joint", joint));
        }
    }
    return with_item(r, root, "bodies", bodies);
}

static const kmp_yaml *join_start(kmp_reader *r, const kmp_yaml *start, const kmp_yaml *more)
{
    static const char *const maps[] = {"q", "qd", "states", "goals"};
    const kmp_yaml *one = only_one(start, more, KMP_YAML_MAP);
    if (one || !more)
        return one;
    for (size_t k = 0; k < sizeof maps / sizeof *maps; k++)
        start =
            with_item(r, start, maps[k], join_maps(r, kmp_yaml_get(start, maps[k]), kmp_yaml_get(more, maps[k]), -1));
    return with_item(r, start, "hold", join_lists(r, kmp_yaml_get(start, "hold"), kmp_yaml_get(more, "hold")));
}

/* -- includes ------------------------------------------------------------------------------------ */

static void include_all(kmp_reader *r, const kmp_yaml *root, int parent, const kmp_yaml *above);

static kmp_base base_of(kmp_reader *r, const kmp_yaml *node)
{
    static const char *const words[] = {"fixed", "free"};
    int word = kmp_read_choice_of(r, node, "base", "an include", KMP_NAMES_OF(words), "the base is", -1);
    return word < 0 ? kmp_context_base(r->context) : word == 0 ? KMP_BASE_FIXED : KMP_BASE_FREE;
}

static bool are_stops(kmp_reader *r, const kmp_yaml *node)
{
    int word = kmp_read_choice_of(r, node, "joint_limits", "an include", kmp_no_or_yes, "joint_limits is", -1);
    return word < 0 ? kmp_context_has_limits(r->context) : word == 1;
}

/* The parameters of a copy, with its number. */
static const kmp_yaml *with_number(kmp_reader *r, const kmp_yaml *root, int copy)
{
    if (copy == 0)
        return root;
    const kmp_yaml *parameters = map_of(root, "parameters"), *key = find_key(parameters, "index");
    const kmp_place place = (key ? key : root)->place;
    const kmp_yaml *number = kmp_yaml_word(&r->scratch, place, kmp_reader_say(r, "%d", copy));
    parameters = parameters ? parameters : kmp_yaml_new(&r->scratch, KMP_YAML_MAP, place);
    return number && parameters ? with_item(r, root, "parameters", with_item(r, parameters, "index", number)) : root;
}

/* Copy `copy` of `copies`, from 1; 0 of 0: the only one. */
static void include_copy(kmp_reader *r, const kmp_yaml *node, int parent, const kmp_yaml *above, int copy, int copies)
{
    const kmp_yaml *name = kmp_read_required(r, node, "an include", "file"), *prefix = kmp_yaml_get(node, "prefix");
    const char *word = name ? kmp_read_word(r, name, "file of an include") : NULL;
    const char *own = prefix ? kmp_read_name(r, prefix, "the prefix of an include") : "";
    const char *path = !word || kmp_is_element(word) ? word : kmp_path_beside(r, parent, word);
    if (!path || !own || goes_in_circle(r, name, parent, path))
        return;
    if (copy > 0)
        own = kmp_reader_say(r, "%s%d_", own, copy);
    kmp_include_instance x = {.file = kmp_reader_add_file(r, path),
                              .parent = parent,
                              .prefix = kmp_reader_name(r, parent, own),
                              .at = kmp_yaml_get(node, "at"),
                              .offset = kmp_yaml_get(node, "offset"),
                              .base = base_of(r, node),
                              .limits = are_stops(r, node),
                              .ground = -1};
    if (x.file >= 0)
        load(r, node, name, path, &x);
    if (!x.root || !check_root(r, x.root))
        return;
    if (!KMP_ARENA_GROW(&r->scratch, r->instances, r->instance_count))
        return;
    r->instances[r->instance_count++] = x;
    if (!kmp_bind_ports(r, node, &r->instances[r->instance_count - 1], copy, copies)) {
        r->instance_count--; /* nothing of the file is read */
        return;
    }
    x = r->instances[r->instance_count - 1];
    const kmp_yaml *set = kmp_yaml_get(node, "set"), *rest = NULL;
    set = set && kmp_read_map(r, set, "include set", NULL) ? set : NULL;
    const kmp_yaml *root = set_values(r, with_number(r, x.root, copy), values_for(r, above, own, set), &rest);
    root = set_joints(r, root, kmp_yaml_get(node, "joints"));
    for (int k = 0; k < JOINED_PARTS; k++)
        r->root = with_item(
            r, r->root, joined_parts[k],
            join_maps(r, kmp_yaml_get(r->root, joined_parts[k]), kmp_yaml_get(root, joined_parts[k]), x.file));
    r->root =
        with_item(r, r->root, "start", join_start(r, kmp_yaml_get(r->root, "start"), kmp_yaml_get(root, "start")));
    const kmp_yaml *gravity = kmp_yaml_get(r->root, "gravity") ? NULL : kmp_yaml_get(root, "gravity");
    if (gravity && x.foreign) /* robots have it without writing it */
        r->root = with_item(r, r->root, "gravity", gravity);
    else if (gravity && copy <= 1)
        kmp_reader_warn(r, gravity->place,
                        "this gravity is ignored: the file is included by a model without gravity; write `gravity` in "
                        "that model, [0, 0, 0] where there is none");
    include_all(r, x.root, x.file, rest);
    check_set(r, x.root, set);
}

/* False: there are as many as may be. */
static bool has_room(kmp_reader *r, const kmp_yaml *node)
{
    return r->instance_count < KMP_MOST_INCLUDES ||
           kmp_reader_complain(r, node->place, "include: more than %d files are included", KMP_MOST_INCLUDES);
}

/* An entry of `include`; false: it is the last one that is read. */
static bool include_one(kmp_reader *r, const kmp_yaml *node, int parent, const kmp_yaml *above)
{
    if (!has_room(r, node))
        return false;
    if (node->kind != KMP_YAML_MAP) {
        r->unread = true;
        kmp_reader_complain(r, node->place, "an include is a mapping such as {file: leg.yaml, prefix: left_}");
        return true;
    }
    kmp_read_map(r, node, "an include", kmp_include_keys);
    const kmp_yaml *repeat = kmp_yaml_get(node, "repeat");
    if (!kmp_is_present(r, kmp_yaml_get(node, "when")))
        return true;
    const int copies = repeat ? kmp_read_repeat(r, repeat) : 0;
    const int before = r->instance_count;
    if (!repeat)
        include_copy(r, node, parent, above, 0, 0);
    for (int copy = 1; copy <= copies; copy++) {
        if (!has_room(r, node))
            return false;
        include_copy(r, node, parent, above, copy, copies);
    }
    r->unread = r->unread || (r->wrong && r->instance_count == before);
    return true;
}

/* `above`: values that files above set, by their names in the file `parent`. */
static void include_all(kmp_reader *r, const kmp_yaml *root, int parent, const kmp_yaml *above)
{
    const kmp_yaml *list = kmp_yaml_get(root, "include");
    bool all = !list || kmp_read_list(r, list, "include", -1);
    for (int i = 0; list && all && i < list->count; i++)
        all = include_one(r, list->items[i], parent, above);
    r->unread = r->unread || !all;
}

void kmp_read_includes(kmp_reader *r)
{
    include_all(r, r->root, 0, NULL);
    for (int k = 0; k < JOINED_PARTS; k++) {
        const kmp_yaml *part = kmp_yaml_get(r->root, joined_parts[k]),
                       *present = kmp_present_entries(r, joined_parts[k], part);
        if (present != part)
            r->root = with_item(r, r->root, joined_parts[k], present);
    }
}
