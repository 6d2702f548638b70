/* SPDX-License-Identifier: BSD-3-Clause */
/* Ports. A scalar `port.NAME` becomes the node that the port is bound to, so that it is looked up, and reported, where
 * the including file has it. Within expressions the names are looked up by kmp_port_bound. */
#include "model/read/read_ports.h"
#include "model/data/coordinates.h"
#include "model/data/model.h"
#include "model/read/read_include.h"
#include "model/read/read_values.h"
#include <string.h>

#define PORT "port."
enum { PORT_LENGTH = sizeof PORT - 1 };

typedef enum port_kind {
#define KMP_PORT_KIND(word, ...) PORT_##word,
#include "model/read/port_kinds.def"
#undef KMP_PORT_KIND
    PORT_KINDS
} port_kind;

static const struct {
    const char *word, *meaning;
} kinds[] = {
#define KMP_PORT_KIND(word, meaning) {#word, meaning},
#include "model/read/port_kinds.def"
#undef KMP_PORT_KIND
};

static bool is_of_word(char c)
{
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_' || (c & 0x80);
}

static size_t word_length(const char *s)
{
    size_t n = 0;
    while (is_of_word(s[n]))
        n++;
    return n;
}

static const char *label_of(const kmp_reader *r, const kmp_include_instance *x)
{
    return r->model->source.files[x->file];
}

/* -- names ------------------------------------------------------------------------------------------- */

const kmp_yaml *kmp_port_bound(const kmp_reader *r, int file, const char *name, const char **rest)
{
    if (strncmp(name, PORT, PORT_LENGTH) != 0)
        return NULL;
    const kmp_include_instance *x = kmp_reader_instance(r, file);
    const size_t length = word_length(name + PORT_LENGTH);
    for (int k = 0; x && x->ports && k < x->ports->count; k++) {
        const char *port = x->ports->keys[k]->text;
        if (strncmp(port, name + PORT_LENGTH, length) != 0 || port[length])
            continue;
        *rest = name + PORT_LENGTH + length;
        return x->bound[k];
    }
    return NULL;
}

/* -- the file ---------------------------------------------------------------------------------------- */

typedef struct binding {
    kmp_reader *r;
    const kmp_include_instance *instance;
} binding;

/* Returns what a port is bound to, for a scalar that is `port.NAME` and nothing more. */
static const kmp_yaml *bound_to(void *user, const kmp_yaml *node)
{
    const binding *b = user;
    const char *rest;
    const kmp_yaml *found = kmp_port_bound(b->r, b->instance->file, node->text, &rest);
    return found && !*rest ? found : node;
}

static kmp_nearest nearest_port(const kmp_include_instance *x, const char *name)
{
    kmp_nearest nearest = kmp_nearest_begin(name);
    for (int k = 0; k < x->ports->count; k++)
        kmp_nearest_offer(&nearest, x->ports->keys[k]->text);
    return nearest;
}

/* Names `port.NAME` in the texts of a file that it does not declare. */
static bool check_names(kmp_reader *r, const kmp_include_instance *x)
{
    bool good = true;
    for (int k = 0; k < x->source->nodes; k++) {
        const kmp_yaml *node = &x->source[k];
        for (const char *at = strstr(node->text, PORT); at; at = strstr(at + 1, PORT)) {
            const char *rest, *name = at + PORT_LENGTH;
            const size_t length = word_length(name);
            const bool begins = at == node->text || !(is_of_word(at[-1]) || at[-1] == '.');
            if (!begins || length == 0 || kmp_port_bound(r, x->file, at, &rest))
                continue;
            const char *word = kmp_reader_say(r, "%.*s", (int)length, name);
            const kmp_nearest nearest = nearest_port(x, word);
            kmp_reader_complain_near(r, node->place, &nearest, "'port.%s': the file declares no port '%s'", word, word);
            good = false;
        }
    }
    return good;
}

/* The names and kinds of the ports. */
static bool check_declared(kmp_reader *r, const kmp_yaml *ports)
{
    bool good = kmp_read_map(r, ports, "ports", NULL);
    for (int k = 0; good && k < ports->count; k++)
        good = kmp_read_name(r, ports->keys[k], "a port") &&
               kmp_read_choice(r, ports->items[k], kmp_reader_say(r, "port '%s'", ports->keys[k]->text),
                               KMP_NAMES_OF(kinds), "its kind is") >= 0;
    return good;
}

/* Finds the name that a port is bound to: of copies one for all, or one each. */
static const kmp_yaml *one_of(kmp_reader *r, const char *what, const kmp_yaml *node, int copy, int copies)
{
    if (node->kind == KMP_YAML_LIST && copies > 0) {
        if (!kmp_read_list(r, node, kmp_reader_say(r, "%s of %d copies", what, copies), copies))
            return NULL;
        node = node->items[copy - 1];
    }
    return kmp_read_word(r, node, what) ? node : NULL;
}

static bool take_bound(kmp_reader *r, const kmp_yaml *node, kmp_include_instance *x, int copy, int copies)
{
    const kmp_yaml *given = kmp_yaml_get(node, "ports");
    bool good = !given || kmp_read_map(r, given, "ports of an include", NULL);
    x->bound = KMP_ARENA_NEW(&r->scratch, const kmp_yaml *, x->ports->count);
    if (!x->bound)
        return false;
    for (int k = 0; given && good && k < given->count; k++)
        if (!kmp_yaml_get(x->ports, given->keys[k]->text)) {
            const kmp_nearest nearest = nearest_port(x, given->keys[k]->text);
            kmp_reader_complain_near(r, given->keys[k]->place, &nearest, "'%s' has no port '%s'", label_of(r, x),
                                     given->keys[k]->text);
            good = false;
        }
    for (int k = 0; k < x->ports->count; k++) {
        const char *name = x->ports->keys[k]->text,
                   *what = kmp_reader_say(r, "port '%s' of '%s'", name, label_of(r, x));
        const kmp_yaml *to = kmp_yaml_get(given, name);
        if (!to)
            good = kmp_reader_complain(r, (given ? given : node)->place, "%s is not given: it is %s", what,
                                       kinds[kmp_name_find(KMP_NAMES_OF(kinds), x->ports->items[k]->text)].meaning);
        x->bound[k] = to ? one_of(r, what, to, copy, copies) : NULL;
        good = x->bound[k] && good;
    }
    return good;
}

bool kmp_bind_ports(kmp_reader *r, const kmp_yaml *node, kmp_include_instance *x, int copy, int copies)
{
    const kmp_yaml *given = kmp_yaml_get(node, "ports"), *ports = kmp_yaml_get(x->source, "ports");
    if (!ports)
        return !given || kmp_reader_complain(r, given->place, "'%s' has no ports", label_of(r, x));
    if (!check_declared(r, ports))
        return false;
    x->ports = ports;
    if (!take_bound(r, node, x, copy, copies) || !check_names(r, x))
        return false;
    x->root = kmp_yaml_replace(&r->scratch, x->source, x->file, bound_to, &(binding){r, x});
    return x->root; /* NULL: no memory */
}

/* -- kinds ------------------------------------------------------------------------------------------- */

static bool is_variable(kmp_reader *r, const kmp_yaml *node)
{
    const kempe_model *model = r->model;
    const char *name = kmp_reader_name(r, node->place.file, node->text);
    bool found = kmp_name_find(KMP_NAMES(model->inputs, kmp_model_given_inputs(model)), name) >= 0 ||
                 kmp_name_find(KMP_NAMED(model, state), name) >= 0 ||
                 kmp_name_find(KMP_NAMED(model, parameter), name) >= 0;
    for (int i = 0; !found && i < model->unknowns_count; i++)
        found = kmp_name_find(kmp_unknown_names(&model->unknowns[i]), name) >= 0;
    return found;
}

static void check_port(kmp_reader *r, port_kind kind, const kmp_yaml *to, const char *what)
{
    switch (kind) {
    case PORT_point:
        (void)kmp_read_point(r, to, what);
        break;
    case PORT_body:
        (void)kmp_read_body(r, to, what);
        break;
    case PORT_coordinate:
        if (kmp_cut_coordinate_find(r->model, kmp_reader_name(r, to->place.file, to->text)) < 0)
            (void)kmp_read_motion(r, to, what);
        break;
    case PORT_table:
        (void)kmp_read_reference(r, to, what, "table", KMP_NAMED(r->model, table));
        break;
    case PORT_loop:
        (void)kmp_read_reference(r, to, what, "loop", KMP_NAMED(r->model, closure));
        break;
    case PORT_input:
    case PORT_KINDS:
    default:
        if (!is_variable(r, to) && !r->unread)
            kmp_complain_of(r, to, what,
                            "'%s' is not an input, a state, a named expression or a parameter: give a name of one",
                            to->text);
    }
}

void kmp_check_ports(kmp_reader *r)
{
    for (int i = 0; i < r->instance_count; i++) {
        const kmp_include_instance *x = &r->instances[i];
        for (int k = 0; x->ports && k < x->ports->count; k++) {
            const int kind = kmp_name_find(KMP_NAMES_OF(kinds), x->ports->items[k]->text);
            check_port(r, (port_kind)kind, x->bound[k],
                       kmp_reader_say(r, "port '%s' of '%s'", x->ports->keys[k]->text, label_of(r, x)));
        }
    }
}

bool kmp_refuse_ports(kmp_reader *r)
{
    const kmp_yaml *ports = kmp_yaml_get(r->root, "ports");
    kmp_text list = {0};
    if (!ports)
        return false;
    for (int k = 0; ports->kind == KMP_YAML_MAP && k < ports->count; k++)
        kmp_text_printf(&list, "%s%s: ..", k > 0 ? ", " : "", ports->keys[k]->text);
    return !kmp_reader_complain(
        r, ports->place, "ports: a file with ports is a part of other models: include it there, with 'ports: {%s}'",
        kmp_reader_take(r, &list));
}
