/* SPDX-License-Identifier: BSD-3-Clause */
/* Joints that must have a coordinate, or multipliers, because the machine and its start use them. Outputs, sensors and
 * `until` change no tree. Expressions are only searched for `q(JOINT)` and similar text here; they are read when there
 * are coordinates. */
#include "model/read/linkage_uses.h"
#include "model/read/linkage.h"
#include "model/read/read_include.h"
#include <ctype.h>
#include <string.h>

typedef struct search {
    kmp_reader *r;
    kmp_linkage *g;
    const char *reason; /* of the use found */
    bool stops;         /* it is one of contacts */
} search;

/* The joint that a coordinate `JOINT` or `JOINT.k` of a file belongs to; NULL: none of `joints`. */
static kmp_edge *find_edge(const search *s, int file, const char *text, size_t length)
{
    const char *dot = memchr(text, '.', length);
    const char *said = kmp_reader_say(s->r, "%.*s", (int)(dot ? dot - text : (ptrdiff_t)length), text);
    return kmp_linkage_joint_named(s->r, s->g, kmp_reader_name(s->r, file, said));
}

static void need(const search *s, int file, const char *text, size_t length)
{
    kmp_edge *edge = find_edge(s, file, text, length);
    if (edge && (!edge->need || (edge->stopped && !s->stops))) {
        edge->need = s->reason;
        edge->stopped = s->stops;
    }
}

static void need_node(const search *s, const kmp_yaml *node)
{
    if (node && node->kind == KMP_YAML_SCALAR)
        need(s, node->place.file, node->text, strlen(node->text));
}

/* -- expressions ----------------------------------------------------------------------------------- */

static bool in_name(char c)
{
    return isalnum((unsigned char)c) || c == '_' || c == '.' || (c & 0x80);
}

static bool is_word(const char *text, size_t length, const char *const *words)
{
    for (int k = 0; words[k]; k++)
        if (strlen(words[k]) == length && strncmp(words[k], text, length) == 0)
            return true;
    return false;
}

static const char *skip_spaces(const char *s)
{
    return s + strspn(s, " \t");
}

const char *const kmp_words_of_loads[] = {"lambda", "reaction", "moment", NULL};

/* Every WORD(NAME) of a text. */
static void look_through(const search *s, const kmp_yaml *node)
{
    static const char *const coordinates[] = {"q", "qd", "qdd", "angle", NULL};
    for (const char *at = node->text; *at;) {
        if (!in_name(*at)) {
            at++;
            continue;
        }
        const char *word = at;
        while (in_name(*at))
            at++;
        size_t length = (size_t)(at - word), count = 0;
        const char *name = skip_spaces(at);
        if (*name != '(')
            continue;
        name = skip_spaces(name + 1);
        while (in_name(name[count]))
            count++;
        if (count == 0)
            continue;
        if (is_word(word, length, coordinates))
            need(s, node->text_place.file, name, count);
        kmp_edge *edge =
            is_word(word, length, kmp_words_of_loads) ? find_edge(s, node->text_place.file, name, count) : NULL;
        if (edge && !edge->requested)
            edge->requested = kmp_reader_say(s->r, "the expression %s", node->text);
    }
}

static void look_into(const search *s, const kmp_yaml *node)
{
    if (node->kind == KMP_YAML_SCALAR)
        look_through(s, node);
    for (int k = 0; k < node->count; k++)
        look_into(s, node->items[k]);
}

/* -- sections -------------------------------------------------------------------------------------- */

/* Searches entries whose `joint` is a coordinate, and which may contain expressions. */
static void search_entries(search *s, const char *section, const char *acts, const char *depends)
{
    const kmp_yaml *map = kmp_yaml_get(s->r->root, section);
    for (int k = 0; map && map->kind == KMP_YAML_MAP && k < map->count; k++) {
        s->reason = kmp_reader_say(s->r, acts, map->keys[k]->text);
        need_node(s, kmp_yaml_get(map->items[k], "joint"));
        s->reason = kmp_reader_say(s->r, depends, map->keys[k]->text);
        look_into(s, map->items[k]);
        const kmp_yaml *coupler = kmp_yaml_get(map->items[k], "coupler");
        for (int i = 0; coupler && coupler->kind == KMP_YAML_MAP && i < coupler->count; i++)
            need_node(s, coupler->keys[i]);
    }
}

static void search_list(search *s, const char *section, const char *key, const char *reason)
{
    const kmp_yaml *list = kmp_yaml_get(kmp_yaml_get(s->r->root, section), key);
    s->reason = reason;
    for (int k = 0; list && list->kind == KMP_YAML_LIST && k < list->count; k++)
        need_node(s, list->items[k]);
}

static void search_keys(search *s, const char *section, const char *key, const char *reason)
{
    const kmp_yaml *map = kmp_yaml_get(kmp_yaml_get(s->r->root, section), key);
    s->reason = reason;
    for (int k = 0; map && map->kind == KMP_YAML_MAP && k < map->count; k++)
        need_node(s, map->keys[k]);
}

static void find_start(const search *s, const char *key)
{
    const kmp_yaml *map = kmp_yaml_get(kmp_yaml_get(s->r->root, "start"), key);
    for (int k = 0; map && map->kind == KMP_YAML_MAP && k < map->count; k++) {
        const kmp_yaml *name = map->keys[k];
        kmp_edge *edge = find_edge(s, name->place.file, name->text, strlen(name->text));
        if (edge && !edge->start)
            edge->start = name;
    }
}

void kmp_linkage_find_uses(kmp_reader *r, kmp_linkage *g)
{
    search s = {r, g, "", false};
    search_list(&s, "start", "hold", "the start holds it");
    search_keys(&s, "start", "goals", "the start has a goal for it");
    search_list(&s, "run", "independent", "it is given as independent");
    search_entries(&s, "drives", "drive '%s' moves it", "drive '%s' depends on it");
    search_entries(&s, "forces", "force '%s' acts on it", "force '%s' depends on it");
    search_entries(&s, "loops", "loop '%s' depends on it", "loop '%s' depends on it");
    s.stops = true;
    search_entries(&s, "contacts", "contact '%s' acts on it", "contact '%s' depends on it");
    s.stops = false;
    search_entries(&s, "states", "state '%s' depends on it", "state '%s' depends on it");
    search_entries(&s, "algebraic", "variable '%s' depends on it", "variable '%s' depends on it");
    find_start(&s, "q");
    find_start(&s, "qd");
}
