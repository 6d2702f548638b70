/* SPDX-License-Identifier: BSD-3-Clause */
/* Errors and nodes: functions for every part of the reader. */
#include "model/read/reading.h"
#include "model/data/model.h"
#include "model/files/nodes.h"
#include "model/read/read_include.h"
#include <ctype.h>
#include <string.h>

/* -- errors -------------------------------------------------------------------------------------- */

static void say(kmp_reader *r, kmp_place place, kmp_text *sentence)
{
    r->wrong = true;
    if (sentence->failed || kmp_complain(r->context, r->model->source.files[place.file], place.line, place.column, "%s",
                                         sentence->s) == KEMPE_E_MEMORY)
        r->scratch.failed = true;
    kmp_text_free(sentence);
}

bool kmp_reader_complain(kmp_reader *r, kmp_place place, const char *format, ...)
{
    kmp_text sentence = {0};
    KMP_TEXT_ARGUMENTS(&sentence, format);
    say(r, place, &sentence);
    return false;
}

bool kmp_complain_of(kmp_reader *r, const kmp_yaml *at, const char *what, const char *format, ...)
{
    kmp_text sentence = {0};
    kmp_text_printf(&sentence, "%s: ", what);
    KMP_TEXT_ARGUMENTS(&sentence, format);
    say(r, at->place, &sentence);
    return false;
}

void kmp_reader_complain_near(kmp_reader *r, kmp_place place, const kmp_nearest *nearest, const char *format, ...)
{
    kmp_text sentence = {0};
    KMP_TEXT_ARGUMENTS(&sentence, format);
    kmp_nearest_suggest(nearest, &sentence);
    say(r, place, &sentence);
}

void kmp_reader_complain_unknown(kmp_reader *r, kmp_place place, const kmp_nearest *nearest, const char *format, ...)
{
    kmp_text sentence = {0};
    if (r->unread)
        return;
    KMP_TEXT_ARGUMENTS(&sentence, format);
    kmp_nearest_suggest(nearest, &sentence);
    say(r, place, &sentence);
}

const char *kmp_reader_take(kmp_reader *r, kmp_text *text)
{
    const char *kept = kmp_text_keep(text, &r->scratch);
    return kept ? kept : "";
}

const char *kmp_reader_say(kmp_reader *r, const char *format, ...)
{
    kmp_text text = {0};
    KMP_TEXT_ARGUMENTS(&text, format);
    return kmp_reader_take(r, &text);
}

const char *kmp_reader_cycle(kmp_reader *r, kmp_name_list names, int (*next)(const void *user, int k), const void *user,
                             int on, int *first)
{
    kmp_text chain = {0};
    *first = on;
    for (int k = next(user, on); k != on; k = next(user, k))
        *first = k < *first ? k : *first;
    int k = *first;
    do {
        kmp_text_printf(&chain, "%s -> ", kmp_name_at(names, k));
        k = next(user, k);
    } while (k != *first);
    kmp_text_put(&chain, kmp_name_at(names, *first));
    return kmp_reader_take(r, &chain);
}

static const char *kind_name(const kmp_yaml *node)
{
    if (node->empty)
        return "nothing";
    return node->kind == KMP_YAML_LIST ? "a list" : node->kind == KMP_YAML_MAP ? "a mapping" : "a word";
}

static void complain_key(kmp_reader *r, const kmp_yaml *key, const char *what, kmp_name_list keys)
{
    kmp_text sentence = {0};
    kmp_nearest nearest = kmp_nearest_of(key->text, keys);
    const bool decimals = isdigit((unsigned char)key->text[0]); /* as of "mass: 2,5" within {..} */
    kmp_text_printf(&sentence, "unknown key '%s' in %s%s", key->text, what,
                    nearest.best || decimals ? "" : "; its keys are ");
    kmp_nearest_suggest(&nearest, &sentence);
    if (decimals)
        kmp_text_put(&sentence, KMP_DECIMAL_POINT);
    else if (!nearest.best)
        kmp_name_list_print(&sentence, keys, ", ", ", ");
    say(r, key->place, &sentence);
}

/* -- nodes --------------------------------------------------------------------------------------- */

kmp_name_list kmp_key_names(const kmp_key *keys)
{
    kmp_name_list names = KMP_NAMES(keys, 0);
    while (keys && keys[names.count].name)
        names.count++;
    return names;
}

/* True of a section of the document, and of a body or joint, which has further names. */
static bool may_define_names(const kmp_yaml *root, const kmp_yaml *node)
{
    for (int i = 0; i < root->count; i++) {
        const kmp_yaml *section = root->items[i];
        const char *name = root->keys[i]->text;
        bool defines = section == node;
        if (section->kind == KMP_YAML_MAP && (strcmp(name, "bodies") == 0 || strcmp(name, "joints") == 0))
            for (int k = 0; k < section->count; k++)
                defines = defines || section->items[k] == node;
        if (defines)
            return true;
    }
    return false;
}

bool kmp_read_map(kmp_reader *r, const kmp_yaml *node, const char *what, const kmp_key *keys)
{
    if (node->empty)
        return true;
    if (node->kind != KMP_YAML_MAP) {
        r->unread = r->unread || may_define_names(r->root, node);
        return kmp_reader_complain(r, node->place, "%s must be a mapping (key: value), not %s", what, kind_name(node));
    }
    const kmp_name_list known = kmp_key_names(keys);
    for (int i = 0; keys && i < node->count; i++)
        if (kmp_name_find(known, node->keys[i]->text) < 0)
            complain_key(r, node->keys[i], what, known);
    return true;
}

static const kmp_key *find_key(const kmp_key *keys, const char *name)
{
    while (strcmp(keys->name, name) != 0)
        keys++;
    return keys;
}

kmp_dimension kmp_key_dimension(const kmp_key *keys, const char *name)
{
    return kmp_dimension_of(find_key(keys, name)->unit);
}

bool kmp_key_default(const kmp_key *keys, const char *name, int count, double *values)
{
    const char *s = find_key(keys, name)->absent;
    kmp_unit unit;
    s += strspn(s, "`[");
    for (int k = 0; k < count; k++) {
        size_t length = kmp_text_to_number(s, &values[k]);
        if (length == 0)
            return false;
        s += length;
        s += strspn(s, ", ");
    }
    for (int k = 0; k < count && kmp_unit_read(s, strlen(s), &unit); k++)
        values[k] = values[k] * unit.factor / unit.divisor;
    return true;
}

bool kmp_read_list(kmp_reader *r, const kmp_yaml *node, const char *what, int count)
{
    if (node->kind != KMP_YAML_LIST)
        kmp_reader_complain(r, node->place, "%s must be a list [..], not %s", what, kind_name(node));
    else if (count >= 0 && node->count != count)
        kmp_reader_complain(r, node->place, "%s must be a list of %d items, not %d", what, count, node->count);
    else
        return true;
    return false;
}

const char *kmp_read_word(kmp_reader *r, const kmp_yaml *node, const char *what)
{
    if (node->kind == KMP_YAML_SCALAR && node->text[0]) {
        int length;
        unsigned code;
        if (!kmp_text_unfit(node->text, &length, &code))
            return node->text;
        kmp_reader_complain(r, node->place,
                            "%s '%s' has the character U+%04X: a name has no control characters, none that turn the "
                            "direction of text, and no line breaks",
                            what, node->text, code);
        return NULL;
    }
    kmp_reader_complain(r, node->place, "%s must be a word, not %s", what,
                        node->kind == KMP_YAML_SCALAR ? "an empty one" : kind_name(node));
    return NULL;
}

static bool is_letter(char c)
{
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '_' || (c & 0x80);
}

const char *kmp_read_name(kmp_reader *r, const kmp_yaml *node, const char *what)
{
    const char *name = kmp_read_word(r, node, what);
    bool good = name && is_letter(name[0]);
    for (const char *s = name; good && *s; s++)
        good = is_letter(*s) || (*s >= '0' && *s <= '9');
    if (name && !good)
        kmp_reader_complain(
            r, node->place,
            "%s cannot be '%s': a name consists of letters, digits and _ and does not begin with a digit", what, name);
    return good ? name : NULL;
}

const kmp_yaml *kmp_read_required(kmp_reader *r, const kmp_yaml *map, const char *what, const char *key)
{
    const kmp_yaml *value = kmp_yaml_get(map, key);
    if (!value)
        kmp_reader_complain(r, map->place, "%s has no key '%s'", what, key);
    return value;
}

int kmp_count_keys(const kmp_yaml *map, kmp_name_list keys, int *first)
{
    int count = 0;
    for (int k = 0; k < keys.count; k++)
        if (kmp_yaml_get(map, kmp_name_at(keys, k)) && count++ == 0)
            *first = k;
    return count;
}

void kmp_complain_keys(kmp_reader *r, kmp_place place, const char *what, kmp_name_list keys, int count)
{
    kmp_text names = {0};
    kmp_name_list_print(&names, keys, ", ", ", ");
    kmp_reader_complain(r, place, "%s: exactly one of the keys %s is expected, not %d", what,
                        kmp_reader_take(r, &names), count);
}

int kmp_read_one_key(kmp_reader *r, const kmp_yaml *map, const char *what, kmp_name_list keys)
{
    int first = -1, count = kmp_count_keys(map, keys, &first);
    if (count == 1)
        return first;
    kmp_complain_keys(r, map->place, what, keys, count);
    return -1;
}

static const char *const answers[] = {"no", "yes"}, *const letters[] = {"x", "y", "z"};
const kmp_name_list kmp_yes = {answers + 1, sizeof *answers, 1}, kmp_no_or_yes = {answers, sizeof *answers, 2},
                    kmp_axis_letters = {letters, sizeof *letters, 3};

bool kmp_is_word(const kmp_yaml *node, const char *word)
{
    return node && node->kind == KMP_YAML_SCALAR && strcmp(node->text, word) == 0;
}

int kmp_read_choice(kmp_reader *r, const kmp_yaml *node, const char *what, kmp_name_list words, const char *is)
{
    int found = kmp_name_find(words, node->text);
    if (found >= 0)
        return found;
    kmp_text all = {0};
    kmp_nearest nearest = kmp_nearest_of(node->text, words);
    kmp_name_list_print(&all, words, ", ", " or ");
    const bool word = node->kind == KMP_YAML_SCALAR && !node->empty;
    kmp_reader_complain_near(r, node->place, &nearest, "%s: %s %s, not %s%s%s", what, is, kmp_reader_take(r, &all),
                             word ? "'" : "", word ? node->text : kind_name(node), word ? "'" : "");
    return -1;
}

int kmp_read_choice_of(kmp_reader *r, const kmp_yaml *map, const char *key, const char *what, kmp_name_list words,
                       const char *is, int absent)
{
    const kmp_yaml *node = kmp_yaml_get(map, key);
    return node ? kmp_read_choice(r, node, what, words, is) : absent;
}

bool kmp_read_word_of(kmp_reader *r, const kmp_yaml *map, const char *what, const char *key, kmp_name_list words,
                      int *found)
{
    const kmp_yaml *node = kmp_yaml_get(map, key);
    if (node && !kmp_read_word(r, node, kmp_reader_say(r, "%s of %s", key, what)))
        return false;
    const int word = kmp_read_choice_of(r, map, key, what, words, kmp_reader_say(r, "%s is", key), *found);
    *found = word < 0 ? *found : word;
    return word >= 0;
}

void kmp_add_own_entry(const kmp_entry_owner *owner, const char *part, const char *section, const char *name,
                       kmp_place place, const kmp_yaml *entry)
{
    kmp_arena *arena = &owner->r->scratch;
    const kmp_yaml *there = kmp_yaml_get(owner->root, section);
    if (there && there->kind != KMP_YAML_MAP && !there->empty)
        return;
    kmp_yaml *map = kmp_yaml_open(arena, owner->root, section);
    if (map && kmp_yaml_get(map, name))
        kmp_reader_complain(owner->r, owner->key->place,
                            "%s '%s': the section %s has '%s', the name of its %s, already", owner->kind,
                            owner->key->text, section, name, part);
    else if (map)
        kmp_yaml_put(arena, map, place, name, entry);
}

int kmp_read_reference(kmp_reader *r, const kmp_yaml *node, const char *what, const char *kind, kmp_name_list names)
{
    const char *word = kmp_read_word(r, node, what);
    if (!word)
        return -1;
    const char *name = kmp_reader_name(r, node->place.file, word);
    int found = kmp_name_find(names, name);
    if (found >= 0)
        return found;
    kmp_nearest nearest = kmp_nearest_of(name, names);
    kmp_reader_complain_unknown(r, node->place, &nearest, "%s: unknown %s '%s'", what, kind, word);
    return -1;
}

/* -- sections ------------------------------------------------------------------------------------ */

kmp_section kmp_read_section(kmp_reader *r, const char *key, const char *kind)
{
    const kmp_yaml *map = kmp_yaml_get(r->root, key);
    bool good = map && kmp_read_map(r, map, key, NULL);
    return (kmp_section){.r = r, .kind = kind, .map = map, .count = good ? map->count : 0};
}

bool kmp_section_next(kmp_section *s)
{
    if (s->next == s->count)
        return false;
    s->key = s->map->keys[s->next];
    s->node = s->map->items[s->next++];
    s->name = kmp_arena_strdup(&s->r->model->arena, s->key->text);
    s->what = kmp_reader_say(s->r, "%s '%s'", s->kind, s->key->text);
    (void)kmp_read_name(s->r, s->key, kmp_reader_say(s->r, "a %s", s->kind));
    return s->name;
}
