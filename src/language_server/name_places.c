/* SPDX-License-Identifier: BSD-3-Clause */
/* Definition, references and renaming. A name is distinguished from others by the place of its declaration, so that a
 * file and the files that include it agree. */
#include "base/memory.h"
#include "language_server/session.h"
#include "model/files/element_library.h"
#include "model/language/expression.h"
#include "platform/platform.h"
#include <string.h>

/* The declared name at a byte of a file whose document is the one of its text; NULL: there is none. `names` is filled
 * in any case. */
static const kmp_declared *declared_at(kempe_language_server *s, const kmp_open_file *file, size_t offset,
                                       kmp_model_names *names, const kmp_name_use **use)
{
    *names = (kmp_model_names){0};
    *use = NULL;
    if (!file->is_good)
        return NULL;
    kmp_names_find(names, s->schema, &file->good, kmp_session_beside, s);
    *use = kmp_names_at(names, offset);
    return *use ? &names->declared[(*use)->declared] : NULL;
}

static bool is_same(const kmp_declared *a, const kmp_declared *b)
{
    return strcmp(a->source->path, b->source->path) == 0 && a->place.line == b->place.line &&
           a->place.column == b->place.column;
}

static void put_location(kempe_language_server *s, kmp_json *json, const kmp_text_source *source, size_t begin,
                         size_t end)
{
    kmp_json_object(json, NULL);
    kmp_json_string(json, "uri", kmp_session_uri(s, source->path));
    kmp_put_range(s, json, "range", source->text, begin, end);
    kmp_json_end(json);
}

void kmp_answer_definition(kempe_language_server *s, kmp_open_file *file, size_t offset, kmp_reply *answer)
{
    kmp_model_names names;
    const kmp_name_use *use;
    const kmp_declared *d = declared_at(s, file, offset, &names, &use);
    if (d && !kmp_is_element(d->source->path)) {
        const size_t begin = kmp_offset_of_place(d->source->text, d->place);
        put_location(s, &answer->json, d->source, begin, begin + strlen(d->name) - (size_t)d->prefix);
    }
    kmp_names_free(&names);
}

void kmp_answer_highlight(kempe_language_server *s, kmp_open_file *file, size_t offset, kmp_reply *answer)
{
    kmp_model_names names;
    const kmp_name_use *use;
    const kmp_declared *d = declared_at(s, file, offset, &names, &use);
    kmp_json_array(&answer->json, NULL);
    for (int k = 0; d && k < names.use_count; k++)
        if (is_same(d, &names.declared[names.uses[k].declared])) {
            kmp_json_object(&answer->json, NULL);
            kmp_put_range(s, &answer->json, "range", file->text, names.uses[k].begin, names.uses[k].end);
            kmp_json_end(&answer->json);
        }
    kmp_json_end(&answer->json);
    kmp_names_free(&names);
}

/* -- files that may use a name ------------------------------------------------------------------------ */

enum { MOST_FILES = 500 };

typedef struct file_list {
    int count;
    const kmp_text_source *source[MOST_FILES];
} file_list;

static void add_source(file_list *list, const kmp_text_source *source)
{
    for (int k = 0; k < list->count; k++)
        if (strcmp(list->source[k]->path, source->path) == 0)
            return;
    if (list->count < MOST_FILES && source->root && kmp_yaml_get(source->root, "kempe"))
        list->source[list->count++] = source;
}

/* The open files, and models in the folder of a declaration. */
static void list_files(kempe_language_server *s, const char *path, file_list *list)
{
    const char *slash = strrchr(path, '/');
    const char *folder = slash ? kmp_arena_printf(&s->work, "%.*s", (int)(slash + 1 - path), path) : NULL;
    for (int k = 0; k < s->file_count; k++)
        add_source(list, &s->files[k]->good);
    const kmp_text_source *own = kmp_session_source(s, path);
    if (own)
        add_source(list, own);
    kmp_folder_names *names = folder ? kmp_folder_names_begin(folder) : NULL;
    for (const char *name; names && list->count < MOST_FILES && (name = kmp_folder_names_next(names));) {
        const char *ending = strrchr(name, '.');
        const bool model = ending && (strcmp(ending, ".yaml") == 0 || strcmp(ending, ".yml") == 0);
        const char *one = model ? kmp_arena_printf(&s->work, "%s%s", folder, name) : NULL;
        const kmp_text_source *source = one ? kmp_session_source(s, one) : NULL;
        if (source)
            add_source(list, source);
    }
    if (names)
        kmp_folder_names_end(names);
}

/* True if two uses are of the same name there; the declaration itself, where it is asked for. */
static bool counts(const kmp_model_names *names, const kmp_name_use *use, const kmp_declared *wanted,
                   bool with_declaration)
{
    const kmp_declared *d = &names->declared[use->declared];
    return is_same(d, wanted) &&
           (with_declaration || d->include >= 0 || use->begin != kmp_offset_of_place(d->source->text, d->place));
}

void kmp_answer_references(kempe_language_server *s, kmp_open_file *file, size_t offset, bool with_declaration,
                           kmp_reply *answer)
{
    kmp_model_names names;
    const kmp_name_use *use;
    const kmp_declared *d = declared_at(s, file, offset, &names, &use);
    file_list list = {0};
    kmp_json_array(&answer->json, NULL);
    if (d)
        list_files(s, d->source->path, &list);
    for (int k = 0; k < list.count; k++) {
        kmp_model_names there;
        kmp_names_find(&there, s->schema, list.source[k], kmp_session_beside, s);
        for (int i = 0; i < there.use_count; i++)
            if (counts(&there, &there.uses[i], d, with_declaration))
                put_location(s, &answer->json, list.source[k], there.uses[i].begin, there.uses[i].end);
        kmp_names_free(&there);
    }
    kmp_json_end(&answer->json);
    kmp_names_free(&names);
}

/* -- renaming ----------------------------------------------------------------------------------------- */

/* The name that can be renamed at a byte; NULL after an error. */
static const kmp_declared *renamed_at(kempe_language_server *s, const kmp_open_file *file, size_t offset,
                                      kmp_model_names *names, const kmp_name_use **use, kmp_reply *answer)
{
    const kmp_declared *d = declared_at(s, file, offset, names, use);
    if (!file->is_good)
        kmp_answer_refuse(answer, KMP_RPC_FAILED,
                          "the file has an error of YAML: names are renamed where it can be read");
    else if (!d)
        kmp_answer_refuse(answer, KMP_RPC_FAILED, "there is no name of the model here");
    else if (kmp_is_element(d->source->path))
        kmp_answer_refuse(answer, KMP_RPC_FAILED, "'%s' is a name of %s, which belongs to the library", d->name,
                          d->source->path);
    else
        return d;
    return NULL;
}

void kmp_answer_prepare_rename(kempe_language_server *s, kmp_open_file *file, size_t offset, kmp_reply *answer)
{
    kmp_model_names names;
    const kmp_name_use *use;
    const kmp_declared *d = renamed_at(s, file, offset, &names, &use, answer);
    if (d) {
        const size_t prefix = use->end - use->begin == strlen(d->name) ? (size_t)d->prefix : 0;
        kmp_json_object(&answer->json, NULL);
        kmp_put_range(s, &answer->json, "range", file->text, use->begin + prefix, use->end);
        kmp_json_string(&answer->json, "placeholder", d->name + d->prefix);
        kmp_json_end(&answer->json);
    }
    kmp_names_free(&names);
}

static bool is_name(const char *name)
{
    return *name && kmp_parse_word_length(name) == strlen(name);
}

/* Appends the source with another name in place of `wanted`. With `json` the edits are written, too. The number of
 * them. */
static int rename_uses(kempe_language_server *s, const kmp_text_source *source, const kmp_declared *wanted,
                       const char *name, kmp_text *changed, kmp_json *json)
{
    kmp_model_names names;
    size_t at = 0;
    int count = 0;
    kmp_names_find(&names, s->schema, source, kmp_session_beside, s);
    for (int k = 0; k < names.use_count; k++) {
        const kmp_name_use *use = &names.uses[k];
        const kmp_declared *d = &names.declared[use->declared];
        if (!is_same(d, wanted) || use->begin < at)
            continue;
        const size_t length = strlen(d->name), prefix = use->end - use->begin == length ? (size_t)d->prefix : 0;
        if (count++ == 0 && json)
            kmp_json_array(json, kmp_session_uri(s, source->path));
        if (json) {
            kmp_json_object(json, NULL);
            kmp_put_range(s, json, "range", source->text, use->begin + prefix, use->end);
            kmp_json_string(json, "newText", name);
            kmp_json_end(json);
        }
        kmp_text_append(changed, source->text + at, use->begin + prefix - at);
        kmp_text_put(changed, name);
        at = use->end;
    }
    if (count > 0 && json)
        kmp_json_end(json);
    kmp_text_put(changed, source->text + at);
    kmp_names_free(&names);
    return count;
}

static bool is_listed(const char *path, int count, const char *const *paths)
{
    for (int k = 0; k < count; k++)
        if (strcmp(paths[k], path) == 0)
            return true;
    return false;
}

/* The message of the first file that can be read now and could not be with the changed texts, among the files that
 * change or include others; the caller frees it. NULL: there is none. */
static char *find_objection(kempe_language_server *s, const file_list *list, int count, const char *const *paths,
                            char *const *texts)
{
    char *found = NULL;
    for (int k = 0; k < list->count && !found; k++) {
        const kmp_text_source *source = list->source[k];
        if (!is_listed(source->path, count, paths) && !kmp_yaml_get(source->root, "include"))
            continue;
        char *before = kmp_file_objection(s, source->path, 0, NULL, NULL);
        found = before ? NULL : kmp_file_objection(s, source->path, count, paths, texts);
        kmp_free(before);
    }
    return found;
}

/* Edits of all files; refused if a file could not be read any more. */
static void rename_all(kempe_language_server *s, const kmp_declared *d, const char *name, kmp_reply *answer)
{
    file_list list = {0};
    const char *paths[MOST_FILES];
    char *texts[MOST_FILES];
    int count = 0;
    list_files(s, d->source->path, &list);
    if (list.count == MOST_FILES) {
        kmp_answer_refuse(answer, KMP_RPC_FAILED,
                          "the folder has %d models or more, and not all of them were read: move the models that use "
                          "'%s' to a folder of their own",
                          MOST_FILES, d->name);
        return;
    }
    kmp_json_put(&answer->json, "{ changes {");
    for (int k = 0; k < list.count; k++) {
        kmp_text changed = {0};
        const bool any = rename_uses(s, list.source[k], d, name, &changed, &answer->json) > 0;
        const kmp_open_file *open = any ? kmp_file_of_path(s, list.source[k]->path) : NULL;
        if (open && !open->is_good)
            kmp_answer_refuse(answer, KMP_RPC_FAILED,
                              "'%s' uses the name and has an error of YAML: names are renamed where it can be read",
                              open->path);
        texts[count] = any ? kmp_text_take(&changed) : NULL;
        paths[count] = list.source[k]->path;
        count += texts[count] != NULL;
        kmp_text_free(&changed);
    }
    kmp_json_put(&answer->json, "} }");
    char *objection = answer->code ? NULL : find_objection(s, &list, count, paths, texts);
    if (objection)
        kmp_answer_refuse(answer, KMP_RPC_FAILED, "'%s' cannot be the name here: %.*s", name,
                          (int)strcspn(objection, "\n"), objection);
    kmp_free(objection);
    for (int k = 0; k < count; k++)
        kmp_free(texts[k]);
}

void kmp_answer_rename(kempe_language_server *s, kmp_open_file *file, size_t offset, const char *name,
                       kmp_reply *answer)
{
    kmp_model_names names;
    const kmp_name_use *use;
    const kmp_declared *d = renamed_at(s, file, offset, &names, &use, answer);
    if (d && !is_name(name))
        kmp_answer_refuse(answer, KMP_RPC_FAILED,
                          "'%s' is not a name: it consists of letters, digits and _ and does not begin with a digit",
                          name);
    else if (d)
        rename_all(s, d, name, answer);
    kmp_names_free(&names);
}
