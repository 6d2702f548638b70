/* SPDX-License-Identifier: BSD-3-Clause */
/* Parts of a ROBOTRAN model that Kempe does not read: listed by name in the log. */
#include "model/files/document.h"
#include <string.h>

enum { MOST_NAMES = 12 };

/* The elements that are read or contain nothing of the mechanics, by their enclosing element. */
static const struct {
    const char *in, *known;
} grammar[] = {
    {"mbsDescR7", " mbsname mbsyspad_version base bodytree cuts links user_models user_variables "},
    {"base", " gravity baseBodyName point "},
    {"gravity", " coordinates "},
    {"coordinates", " x y z "},
    {"bodytree", " body "},
    {"body", " bodyname parent joint mass com inertia point sensor extforce "},
    {"parent", " bodyname pointname "},
    {"joint", " jointname type nature initialvalue actuated symbols sensor extforce "},
    {"initialvalue", " q qd qdd "},
    {"com", " coordinates "},
    {"inertia", " Ixx Ixy Ixz Iyy Iyz Izz "},
    {"point", " pointname coordinates sensor extforce "},
    {"cuts", " ball rod solid "},
    {"ball", " name endpoint1 endpoint2 ignore "},
    {"solid", " name endpoint1 endpoint2 ignore "},
    {"rod", " name endpoint1 endpoint2 length "},
    {"endpoint1", " bodyname pointname "},
    {"endpoint2", " bodyname pointname "},
    {"links", " link link3D "},
    {"link", " name endpoint1 endpoint2 "},
    {"link3D", " name endpoint1 endpoint2 "},
};

/* Names with commas between, the first ones of many. */
typedef struct list {
    kmp_text text;
    int count;
} list;

/* True if there is room for another name. */
static bool begin(list *l)
{
    if (++l->count > MOST_NAMES)
        return false;
    kmp_text_put(&l->text, l->count > 1 ? ", " : "");
    return true;
}

/* Writes the list to the log and frees it; false: no memory. */
static bool say(list *l, kempe_context *context, const char *file, kempe_level level, const char *sentence)
{
    int more = l->count - MOST_NAMES;
    bool ok = !l->text.failed;
    if (ok && more > 0)
        kmp_text_printf(&l->text, " and %d more", more);
    if (ok && l->count > 0)
        kmp_log(context, level, "%s: %s: %s", file, sentence, l->text.s ? l->text.s : "");
    kmp_text_free(&l->text);
    return ok;
}

/* -- unknown elements ------------------------------------------------------------------------------ */

static bool is_word_of(const char *words, const char *name)
{
    size_t length = strlen(name);
    for (const char *at = strstr(words, name); at; at = strstr(at + 1, name))
        if (at > words && at[-1] == ' ' && at[length] == ' ')
            return true;
    return false;
}

static void list_unknown(list *l, const kmp_element *element)
{
    const char *known = NULL;
    for (size_t k = 0; k < sizeof grammar / sizeof *grammar; k++)
        if (strcmp(grammar[k].in, element->name) == 0)
            known = grammar[k].known;
    for (const kmp_element *e = element->first; known && e; e = e->next) {
        if (is_word_of(known, e->name))
            list_unknown(l, e);
        else if (begin(l))
            kmp_text_printf(&l->text, "%s in %s (line %d)", e->name, element->name, e->place.line);
    }
}

/* -- forces without a law -------------------------------------------------------------------------- */

static void add_forceless(list *l, const char *what, const kmp_element *e)
{
    const char *name = kmp_element_text(e, "name");
    if (begin(l))
        kmp_text_printf(&l->text, "%s '%s'", what, name ? name : "");
}

static void list_force_points(list *l, const kmp_element *inside)
{
    for (const kmp_element *e = inside->first; e; e = e->next) {
        if (strcmp(e->name, "extforce") == 0)
            add_forceless(l, "force point", e);
        else if (strcmp(e->name, "point") == 0 || strcmp(e->name, "joint") == 0)
            list_force_points(l, e);
    }
}

static void list_forceless(list *l, const kmp_element *model)
{
    const kmp_element *body = kmp_element_find(kmp_element_find(model, "bodytree"), "body");
    const kmp_element *links = kmp_element_find(model, "links");
    for (; body; body = kmp_element_again(body))
        list_force_points(l, body);
    for (const kmp_element *e = links ? links->first : NULL; e; e = e->next)
        if (strcmp(e->name, "link") == 0 || strcmp(e->name, "link3D") == 0)
            add_forceless(l, "link", e);
}

bool kmp_mbs_note(kempe_context *context, const char *file, const kmp_element *model)
{
    list unknown = {.count = 0}, forceless = {.count = 0};
    list_unknown(&unknown, model);
    list_forceless(&forceless, model);
    bool ok = say(&unknown, context, file, KEMPE_LOG_INFO, "unknown elements are ignored");
    return say(&forceless, context, file, KEMPE_LOG_WARNING, "forces whose law is in user code are omitted") && ok;
}
