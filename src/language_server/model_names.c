/* SPDX-License-Identifier: BSD-3-Clause */
#include "language_server/model_names.h"
#include "language_server/text_places.h"
#include "model/language/dimension.h"
#include "model/language/expression_parser.h"
#include "model/language/limits.h"
#include <stdlib.h>
#include <string.h>

const kmp_name_row kmp_name_rows[] = {
#define KMP_NAME_KIND(kind, ...) {__VA_ARGS__},
#include "language_server/name_kinds.def"
#undef KMP_NAME_KIND
};

enum {
    MOST_LEVELS = 40,      /* of mappings and lists: a model needs fewer */
    MOST_VISITS = 2000000, /* an alias may be met many times */
    MOST_INCLUDED = 4000,  /* files, copies among them */
    MOST_CALLS = 64
};

/* -- kinds of uses ------------------------------------------------------------------------------------ */

#define IN KMP_NAMES_IN
enum {
    OF_NOTHING = 0,
    OF_POINT = IN(BODY) | IN(POINT) | IN(PORT),
    OF_AXIS = OF_POINT,
    OF_BODY = IN(BODY) | IN(PORT),
    OF_COORDINATE = IN(JOINT) | IN(COORDINATE) | IN(BODY) | IN(PORT),
    OF_LOOP = IN(LOOP) | IN(JOINT) | IN(DRIVE) | IN(GEAR) | IN(ROPE) | IN(WHEEL) | IN(PORT),
    OF_JOINT = IN(JOINT) | IN(LOOP) | IN(DRIVE),
    OF_GEAR = IN(GEAR),
    OF_ROPE = IN(ROPE),
    OF_SHEAVE = IN(ROPE),
    OF_CONTACT = IN(CONTACT),
    OF_BEARING = IN(BEARING),
    OF_FORCE = IN(FORCE) | IN(CONTACT) | IN(TYRE) | IN(WHEEL) | IN(ROPE),
    OF_OUTLINED = IN(CONTACT),
    OF_CUT = IN(JOINT) | IN(COORDINATE),
    OF_SENSOR = IN(SENSOR),
    OF_WHEEL = IN(WHEEL) | IN(TYRE),
    OF_TYRE = IN(TYRE),
    OF_MAYBE_COORDINATE = OF_COORDINATE,
    OF_MAYBE_LOOP = OF_LOOP,
    OF_MAYBE_STATE = IN(STATE),
    OF_MAYBE_BODY = OF_BODY,
    OF_MAYBE_BODY_ABOUT = OF_POINT
};

static const struct {
    const char *word;
    kmp_name_set of;
} calls[] = {
#define KMP_MEASURE(kind, word, argument, ...) {word, OF_##argument},
#include "model/language/measures.def"
#undef KMP_MEASURE
#define KMP_OUTPUT(kind, word, argument, ...) {word, OF_##argument},
#include "model/data/output_kinds.def"
#undef KMP_OUTPUT
};

static const struct {
    const char *kind; /* of the schema */
    kmp_name_set of;
} values[] = {
    {"number", KMP_NAMES_OF_EXPRESSION},
    {"output_name", KMP_NAMES_OF_EXPRESSION},
    {"goal_name", KMP_NAMES_OF_EXPRESSION | OF_COORDINATE},
    {"point_name", OF_POINT},
    {"body_name", OF_BODY},
    {"coordinate_name", OF_COORDINATE},
    {"joint_name", OF_JOINT},
    {"hinge_name", OF_JOINT | IN(PORT)},
    {"wheel_of_gear_name", IN(JOINT) | IN(BODY) | IN(POINT) | IN(PORT)},
    {"own_point_name", IN(POINT)},
    {"table_name", IN(TABLE) | IN(PORT)},
    {"outline_name", IN(OUTLINE)},
    {"profile_name", IN(PROFILE)},
    {"rail_name", IN(TRACK)},
    {"road_name", IN(ROAD)},
    {"state_name", IN(STATE)},
    {"interface_name", IN(INTERFACE)},
    {"included_value_name", IN(PARAMETER) | IN(INPUT)},
    {"included_joint_name", IN(JOINT)},
    {"included_port_name", IN(PORT)},
    {"bound_name", KMP_NAMES_ALL},
};

kmp_name_set kmp_names_of_call(const char *word, size_t length)
{
    kmp_name_set all = 0;
    for (size_t k = 0; k < sizeof calls / sizeof *calls; k++)
        if (strlen(calls[k].word) == length && strncmp(calls[k].word, word, length) == 0)
            all |= calls[k].of;
    return all ? all : KMP_NAMES_OF_EXPRESSION;
}

kmp_name_set kmp_names_of_value(const char *kind)
{
    for (size_t k = 0; k < sizeof values / sizeof *values; k++)
        if (strcmp(values[k].kind, kind) == 0)
            return values[k].of;
    return 0;
}

/* -- declarations ------------------------------------------------------------------------------------- */

typedef struct name_finder {
    kmp_model_names *names;
    kmp_source_beside *beside;
    void *user;
    int included, visits;
    int include;       /* that is declared, or visited; -1: none */
    const char *owner; /* body that is visited */
    const char *port;  /* of an included file that is bound; NULL: none */
} name_finder;

/* The file that is declared: its prefix, and the body that is its ground. */
typedef struct declared_file {
    const kmp_text_source *source;
    const char *prefix, *ground;
    int level;
} declared_file;

static unsigned slot_of(const char *name)
{
    return kmp_text_hash(name) % 256;
}

static void declare(name_finder *f, const declared_file *file, kmp_name_kind kind, const char *owner,
                    const kmp_yaml *word, const kmp_yaml *node, bool implied)
{
    kmp_model_names *n = f->names;
    if (word->kind != KMP_YAML_SCALAR || !word->text[0] || strcmp(word->text, "~") == 0)
        return;
    const bool prefixed = kind != KMP_NAME_POINT && kind != KMP_NAME_INTERFACE;
    const char *prefix = prefixed || strcmp(owner, file->ground) == 0 ? file->prefix : "",
               *name = kmp_arena_printf(&n->arena, "%s%s", prefix, word->text);
    kmp_declared *all = kmp_arena_room(&n->arena, n->declared, n->count, sizeof *all);
    if (!name || !all)
        return;
    const unsigned slot = slot_of(name);
    n->declared = all;
    all[n->count] = (kmp_declared){.kind = kind,
                                   .name = name,
                                   .owner = owner,
                                   .source = file->source,
                                   .place = word->text_place,
                                   .node = node,
                                   .prefix = (int)strlen(prefix),
                                   .include = f->include,
                                   .implied = implied,
                                   .next = n->heads[slot]};
    n->heads[slot] = n->count++;
}

static const char *prefixed(name_finder *f, const declared_file *file, const char *name)
{
    const char *whole =
        strcmp(name, "ground") == 0 ? file->ground : kmp_arena_printf(&f->names->arena, "%s%s", file->prefix, name);
    return whole ? whole : "";
}

static void declare_keys(name_finder *f, const declared_file *file, kmp_name_kind kind, const char *owner,
                         const kmp_yaml *map)
{
    for (int k = 0; map && map->kind == KMP_YAML_MAP && k < map->count; k++)
        declare(f, file, kind, owner, map->keys[k], map->items[k], false);
}

static void declare_coordinates(name_finder *f, const declared_file *file, const kmp_yaml *joint)
{
    const kmp_yaml *list = kmp_yaml_get(joint, "coordinates");
    for (int k = 0; list && list->kind == KMP_YAML_LIST && k < list->count; k++)
        declare(f, file, KMP_NAME_COORDINATE, "", list->items[k], NULL, false);
}

static void declare_body(name_finder *f, const declared_file *file, const kmp_yaml *key, const kmp_yaml *body)
{
    const char *owner = prefixed(f, file, key->text);
    const kmp_yaml *joint = kmp_yaml_get(body, "joint"), *name = kmp_yaml_get(joint, "name");
    if (joint)
        declare(f, file, KMP_NAME_JOINT, "", name ? name : key, joint, !name);
    declare_coordinates(f, file, joint);
    declare_keys(f, file, KMP_NAME_POINT, owner, kmp_yaml_get(body, "points"));
    declare_keys(f, file, KMP_NAME_INTERFACE, owner, kmp_yaml_get(kmp_yaml_get(body, "flexible"), "interfaces"));
}

/* The names of a section and of what its entries have. */
static void declare_section(name_finder *f, const declared_file *file, kmp_name_kind kind)
{
    const kmp_yaml *map = kmp_yaml_get(file->source->root, kmp_name_rows[kind].section);
    declare_keys(f, file, kind, "", map);
    for (int k = 0; map && map->kind == KMP_YAML_MAP && k < map->count; k++)
        if (kind == KMP_NAME_BODY)
            declare_body(f, file, map->keys[k], map->items[k]);
        else if (kind == KMP_NAME_JOINT)
            declare_coordinates(f, file, map->items[k]);
        else if (kind == KMP_NAME_UNKNOWN)
            declare_keys(f, file, kind, "", kmp_yaml_get(map->items[k], "of"));
}

static void declare_file(name_finder *f, const declared_file *file);

static void declare_included(name_finder *f, const declared_file *file, const kmp_yaml *item)
{
    const kmp_yaml *name = kmp_yaml_get(item, "file"), *prefix = kmp_yaml_get(item, "prefix"),
                   *at = kmp_yaml_get(item, "at");
    if (!name || name->kind != KMP_YAML_SCALAR || file->level >= KMP_MOST_INCLUDE_LEVELS)
        return;
    /* The copies of an include: a number, or a parameter that is one; 0: it is not repeated. */
    const kmp_yaml *repeat = kmp_yaml_get(item, "repeat");
    const kmp_yaml *by = repeat ? kmp_yaml_get(kmp_yaml_get(file->source->root, "parameters"), repeat->text) : NULL;
    const long count = repeat ? strtol((by ? by : repeat)->text, NULL, 10) : 0;
    const int copies = !repeat ? 0 : count < 1 ? 1 : count > MOST_INCLUDED ? MOST_INCLUDED : (int)count;
    const char *own = prefix ? prefix->text : "";
    const kmp_text_source *source = f->beside(f->user, file->source, name->text);
    char *body = kmp_arena_strdup(&f->names->arena, at ? at->text : "ground");
    if (!source || !source->root || !body)
        return;
    body[strcspn(body, ".")] = '\0';
    for (int k = copies > 0; k <= copies && f->included++ < MOST_INCLUDED; k++) {
        const char *copy = copies > 0 ? kmp_arena_printf(&f->names->arena, "%s%s%d_", file->prefix, own, k)
                                      : kmp_arena_printf(&f->names->arena, "%s%s", file->prefix, own);
        if (copy)
            declare_file(f, &(declared_file){source, copy, prefixed(f, file, body), file->level + 1});
    }
}

static void declare_file(name_finder *f, const declared_file *file)
{
    const kmp_yaml *include = kmp_yaml_get(file->source->root, "include");
    for (int kind = 0; kind < KMP_NAME_KINDS; kind++)
        if (kmp_name_rows[kind].section[0])
            declare_section(f, file, (kmp_name_kind)kind);
    declare_keys(f, file, KMP_NAME_POINT, file->ground,
                 kmp_yaml_get(kmp_yaml_get(file->source->root, "ground"), "points"));
    for (int k = 0; include && include->kind == KMP_YAML_LIST && k < include->count; k++) {
        if (file->level == 0)
            f->include = k;
        declare_included(f, file, include->items[k]);
    }
    if (file->level == 0)
        f->include = -1;
}

/* -- look-up ------------------------------------------------------------------------------------------ */

/* A declared name of one of the kinds, the first kind before the others; of a point, of the owner; -1: there is none.
 */
static int find_name(const kmp_model_names *n, const char *name, kmp_name_set of, const char *owner)
{
    int best = -1;
    for (int k = n->heads[slot_of(name)]; k >= 0; k = n->declared[k].next) {
        const kmp_declared *d = &n->declared[k];
        const bool owned = d->kind == KMP_NAME_POINT || d->kind == KMP_NAME_INTERFACE;
        const bool fits = owned ? owner && strcmp(owner, d->owner) == 0 : !owner;
        if ((of & 1U << d->kind) && fits && !(d->kind == KMP_NAME_PORT && d->include >= 0) &&
            strcmp(d->name, name) == 0 && (best < 0 || d->kind <= n->declared[best].kind))
            best = k;
    }
    return best;
}

/* A name of an included file, as that has it. */
static int find_included(const kmp_model_names *n, const char *name, kmp_name_set of, int include)
{
    for (int k = 0; k < n->count; k++) {
        const kmp_declared *d = &n->declared[k];
        if (d->include == include && (of & 1U << d->kind) && strcmp(d->name + d->prefix, name) == 0)
            return k;
    }
    return -1;
}

/* The object whose name is the beginning of one that the reader makes, as `floor_friction` of the contact `floor`:
 * *length: of its name. */
static int find_maker(const kmp_model_names *n, const char *name, size_t *length)
{
    const kmp_name_set of =
        KMP_NAMES_IN(CONTACT) | KMP_NAMES_IN(LOOP) | KMP_NAMES_IN(JOINT) | KMP_NAMES_IN(GEAR) | KMP_NAMES_IN(ROPE);
    char own[256];
    *length = strlen(name);
    if (*length >= sizeof own)
        return -1;
    memcpy(own, name, *length + 1);
    for (char *last; (last = strrchr(own, '_')) && last > own;) {
        *last = '\0';
        *length = (size_t)(last - own);
        const int found = find_name(n, own, of, NULL);
        if (found >= 0)
            return found;
    }
    return -1;
}

static void use(name_finder *f, size_t begin, size_t end, int declared)
{
    kmp_model_names *n = f->names;
    if (declared < 0)
        return;
    kmp_name_use *all = kmp_arena_room(&n->arena, n->uses, n->use_count, sizeof *all);
    if (!all)
        return;
    n->uses = all;
    all[n->use_count++] = (kmp_name_use){begin, end, declared};
}

/* -- words of scalars --------------------------------------------------------------------------------- */

/* The bytes of the text of a scalar in its source: `at[k]` of the k-th byte, at[length] of its end. NULL: there are
 * escapes, or no memory. */
static const size_t *bytes_of(kmp_arena *arena, const kmp_text_source *source, const kmp_yaml *node)
{
    const char *text = node->text, *from = source->text;
    const size_t length = strlen(text), whole = strlen(from);
    size_t *at = KMP_ARENA_NEW(arena, size_t, length + 1), s = kmp_offset_of_place(from, node->text_place);
    const char quote = s > 0 && node->text_place.column > node->place.column ? from[s - 1] : '\0';
    for (size_t k = 0; at && k < length; k++) {
        while (s < whole && from[s] != text[k] && strchr(" \t\r\n", from[s]) && !strchr(" \t\n", text[k]))
            s++;
        if (s >= whole || (quote == '"' && from[s] == '\\'))
            return NULL;
        at[k] = s;
        if (strchr(" \t\n", text[k])) { /* a break of the text within a line of the source, or the other way round */
            if (!strchr(" \t\r\n", from[s]))
                return NULL;
            s++;
        } else if (from[s] == text[k]) {
            s += quote == '\'' && text[k] == '\'' ? 2 : 1;
        } else {
            return NULL;
        }
        at[k + 1] = s;
    }
    if (at && length == 0)
        at[0] = s;
    return at;
}

/* A word with what follows behind dots: `B.P.x`, `J.2`, `port.NAME`. */
typedef struct dotted {
    const char *part[2]; /* "": none */
    size_t begin[2], length[2], end;
} dotted;

/* At a word; *end: of all its parts. */
static dotted read_dotted(kmp_arena *arena, const char *text, size_t k)
{
    dotted d = {.part = {"", ""}, .end = k};
    for (int part = 0; part < 3; part++) {
        const size_t length = kmp_parse_word_length(text + d.end);
        if (part < 2 && length > 0) {
            const char *copy = kmp_arena_printf(arena, "%.*s", (int)length, text + d.end);
            d.part[part] = copy ? copy : "";
            d.begin[part] = d.end;
            d.length[part] = length;
        }
        d.end += length > 0 ? length : strspn(text + d.end, "0123456789");
        if (text[d.end] != '.' || part == 2)
            break;
        const bool more = kmp_parse_word_length(text + d.end + 1) > 0 || strspn(text + d.end + 1, "0123456789") > 0;
        if (!more)
            break;
        d.end++;
    }
    return d;
}

static void use_part(name_finder *f, const size_t *at, const dotted *d, int part, int declared)
{
    use(f, at[d->begin[part]], at[d->begin[part] + d->length[part]], declared);
}

static void use_dotted(name_finder *f, const size_t *at, const dotted *d, kmp_name_set of)
{
    kmp_model_names *n = f->names;
    if (strcmp(d->part[0], "port") == 0 && d->part[1][0]) {
        use_part(f, at, d, 1, find_name(n, d->part[1], KMP_NAMES_IN(PORT), NULL));
        return;
    }
    if (of & KMP_NAMES_IN(POINT) && d->part[1][0]) {
        use_part(f, at, d, 0, find_name(n, d->part[0], KMP_NAMES_IN(BODY), NULL));
        use_part(f, at, d, 1, find_name(n, d->part[1], KMP_NAMES_IN(POINT), d->part[0]));
        return;
    }
    int found = find_name(n, d->part[0], of & ~KMP_NAMES_IN(PORT), f->owner);
    if (found < 0)
        found = find_name(n, d->part[0], of & ~KMP_NAMES_IN(PORT), NULL);
    if (found < 0 && !(of & KMP_NAMES_OF_EXPRESSION))
        found = find_name(n, d->part[0], KMP_NAMES_ALL & ~KMP_NAMES_IN(PORT), NULL);
    size_t length = d->length[0];
    if (found < 0)
        found = find_maker(n, d->part[0], &length);
    use(f, at[d->begin[0]], at[d->begin[0] + length], found);
}

size_t kmp_units_end(const char *text, size_t k)
{
    size_t end = k;
    for (k += strspn(text + k, " ");;) {
        kmp_unit unit;
        const size_t length = kmp_parse_word_length(text + k);
        if (length == 0 || !kmp_unit_find(text + k, length, &unit))
            return end;
        end = k + length;
        if (text[end] == '^')
            end += 1 + strspn(text + end + 1, "-0123456789");
        k = end + strspn(text + end, " ");
        if (text[k] != '*' && text[k] != '/')
            return end;
        k += 1 + strspn(text + k + 1, " ");
    }
}

/* A word outside of calls of measures. */
static void use_value(name_finder *f, const size_t *at, const dotted *d, kmp_name_set of)
{
    const bool port = strcmp(d->part[0], "port") == 0 && d->part[1][0];
    const int found = find_name(f->names, d->part[port], port ? KMP_NAMES_IN(PORT) : KMP_NAMES_OF_VALUES, NULL);
    use_part(f, at, d, port, found < 0 && of ? find_name(f->names, d->part[0], of, NULL) : found);
}

/* The words of an expression, or of an output; `of`: kinds that a word by itself may be, too. */
static void use_expression(name_finder *f, const char *text, const size_t *at, kmp_name_set of)
{
    kmp_name_set call[MOST_CALLS + 1] = {KMP_NAMES_OF_EXPRESSION};
    int level = 0;
    for (size_t k = 0; text[k];) {
        double value;
        const size_t number = kmp_text_to_number(text + k, &value);
        const bool component = k > 0 && text[k - 1] == ')' && text[k] == '.';
        if (number > 0 && !component) {
            k = kmp_units_end(text, k + number);
        } else if (kmp_parse_word_length(text + k) > 0) {
            const dotted d = read_dotted(&f->names->arena, text, k);
            const size_t behind = d.end + strspn(text + d.end, " ");
            const bool called = text[behind] == '(';
            if (called || call[level] == KMP_NAMES_OF_EXPRESSION)
                use_value(f, at, &d, of);
            else
                use_dotted(f, at, &d, call[level]);
            k = d.end;
            if (called && level < MOST_CALLS) {
                call[++level] = kmp_names_of_call(d.part[0], d.length[0]);
                k = behind + 1;
            }
        } else {
            if (text[k] == '(' && level < MOST_CALLS) {
                level++;
                call[level] = call[level - 1];
            } else if (text[k] == ')' && level > 0) {
                level--;
            }
            k++;
            while (component &&
                   (text[k] == '.' || kmp_parse_word_length(text + k) > 0 || strspn(text + k, "0123456789")))
                k += text[k] == '.' ? 1 : kmp_parse_word_length(text + k) + strspn(text + k, "0123456789");
        }
    }
}

/* The kinds of names that a port of an included file may be bound to. */
static kmp_name_set bound_by(const kmp_model_names *n, const char *port, int include)
{
    static const struct {
        const char *word;
        kmp_name_set of;
    } kinds[] = {
#define OF_coordinate            OF_COORDINATE
#define OF_point                 OF_POINT
#define OF_body                  OF_BODY
#define OF_table                 (IN(TABLE) | IN(PORT))
#define OF_input                 (KMP_NAMES_OF_VALUES | IN(PORT))
#define OF_loop                  OF_LOOP
#define KMP_PORT_KIND(word, ...) {#word, OF_##word},
#include "model/read/port_kinds.def"
#undef KMP_PORT_KIND
    };
    const int found = port ? find_included(n, port, KMP_NAMES_IN(PORT), include) : -1;
    const char *word = found >= 0 && n->declared[found].node ? n->declared[found].node->text : "";
    for (size_t k = 0; k < sizeof kinds / sizeof *kinds; k++)
        if (strcmp(kinds[k].word, word) == 0)
            return kinds[k].of;
    return KMP_NAMES_ALL;
}

static void use_scalar(name_finder *f, const kmp_yaml *node, kmp_name_set of, const char *kind)
{
    kmp_model_names *n = f->names;
    const size_t *at = of ? bytes_of(&n->arena, n->source, node) : NULL;
    if (!at || !node->text[0])
        return;
    if (strncmp(kind, "included_", 9) == 0) {
        use(f, at[0], at[strlen(node->text)], find_included(n, node->text, of, f->include));
        return;
    }
    if (of & KMP_NAMES_OF_EXPRESSION) {
        use_expression(f, node->text, at, of & ~KMP_NAMES_OF_EXPRESSION);
        return;
    }
    if (strcmp(kind, "bound_name") == 0)
        of = bound_by(n, f->port, f->include);
    const size_t k = strspn(node->text, " ");
    if (kmp_parse_word_length(node->text + k) > 0) {
        const dotted d = read_dotted(&n->arena, node->text, k);
        use_dotted(f, at, &d, of);
    }
}

/* -- the document ------------------------------------------------------------------------------------- */

static void visit(name_finder *f, const kmp_yaml *node, const kmp_schemas *schemas, int level)
{
    if (level > MOST_LEVELS || f->visits++ > MOST_VISITS)
        return;
    if (node->kind == KMP_YAML_SCALAR) {
        kmp_name_set of = 0;
        const char *kind = "";
        for (int k = 0; k < schemas->count; k++) {
            const kmp_name_set one = kmp_names_of_value(schemas->one[k].kind);
            kind = one ? schemas->one[k].kind : kind;
            of |= one;
        }
        if (of != KMP_NAMES_OF_EXPRESSION)
            of &= ~KMP_NAMES_OF_EXPRESSION;
        use_scalar(f, node, of, kind);
        return;
    }
    const char *kind = node->kind == KMP_YAML_MAP ? kmp_schema_key_kind(schemas) : "";
    for (int k = 0; k < node->count; k++) {
        const kmp_schemas inner =
            node->kind == KMP_YAML_MAP ? kmp_schema_of_key(schemas, node->keys[k]->text) : kmp_schema_of_item(schemas);
        if (*kind)
            use_scalar(f, node->keys[k], kmp_names_of_value(kind), kind);
        if (strcmp(kind, "included_port_name") == 0)
            f->port = node->keys[k]->text;
        visit(f, node->items[k], &inner, level + 1);
    }
}

/* A section of the model; of bodies and included files it is known in which entry a node is. */
static void visit_section(name_finder *f, const kmp_schemas *schemas, const kmp_yaml *key, const kmp_yaml *section)
{
    const kmp_schemas inner = kmp_schema_of_key(schemas, key->text);
    const bool bodies = strcmp(key->text, "bodies") == 0 && section->kind == KMP_YAML_MAP,
               include = strcmp(key->text, "include") == 0 && section->kind == KMP_YAML_LIST;
    if (strcmp(key->text, "ground") == 0)
        f->owner = "ground";
    for (int k = 0; (bodies || include) && k < section->count; k++) {
        const kmp_schemas entry =
            include ? kmp_schema_of_item(&inner) : kmp_schema_of_key(&inner, section->keys[k]->text);
        f->owner = bodies ? section->keys[k]->text : NULL;
        f->include = include ? k : -1;
        visit(f, section->items[k], &entry, 2);
    }
    if (!bodies && !include)
        visit(f, section, &inner, 1);
    f->owner = NULL;
    f->include = -1;
}

static int by_place(const void *a, const void *b)
{
    const kmp_name_use *x = a, *y = b;
    return x->begin < y->begin ? -1 : x->begin > y->begin ? 1 : x->declared - y->declared;
}

void kmp_names_find(kmp_model_names *names, const kmp_json_value *schema, const kmp_text_source *source,
                    kmp_source_beside *beside, void *user)
{
    name_finder f = {.names = names, .beside = beside, .user = user, .include = -1};
    const kmp_yaml *root = source->root;
    *names = (kmp_model_names){.source = source};
    for (int k = 0; k < 256; k++)
        names->heads[k] = -1;
    if (!root || root->kind != KMP_YAML_MAP)
        return;
    declare_file(&f, &(declared_file){source, "", "ground", 0});
    for (int k = 0; k < names->count; k++) {
        const kmp_declared *d = &names->declared[k];
        if (d->include < 0 && !d->implied) {
            const size_t begin = kmp_offset_of_place(source->text, d->place);
            use(&f, begin, begin + strlen(d->name), k);
        }
    }
    const kmp_schemas schemas = kmp_schema_of_model(schema);
    for (int k = 0; k < root->count; k++)
        visit_section(&f, &schemas, root->keys[k], root->items[k]);
    /* Orders the uses; an alias gives the same one again. */
    int kept = 0;
    if (names->use_count > 0)
        qsort(names->uses, (size_t)names->use_count, sizeof *names->uses, by_place);
    for (int k = 0; k < names->use_count; k++)
        if (kept == 0 || names->uses[kept - 1].begin != names->uses[k].begin)
            names->uses[kept++] = names->uses[k];
    names->use_count = kept;
}

void kmp_names_free(kmp_model_names *names)
{
    kmp_arena_free(&names->arena);
    *names = (kmp_model_names){0};
}

const kmp_name_use *kmp_names_at(const kmp_model_names *names, size_t offset)
{
    const kmp_name_use *found = NULL;
    for (int k = 0; k < names->use_count; k++)
        if (names->uses[k].begin <= offset && offset <= names->uses[k].end)
            found = &names->uses[k];
    return found;
}
