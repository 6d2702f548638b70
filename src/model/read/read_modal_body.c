/* SPDX-License-Identifier: BSD-3-Clause */
#include "model/read/read_modal_body.h"
#include "base/memory.h"
#include "linalg/dense/three.h"
#include "model/data/model.h"
#include "model/flexible/modal_file.h"
#include "model/language/number_algebra.h"
#include "model/read/read_include.h"
#include "model/read/read_tables.h"
#include "model/read/read_values.h"
#include <math.h>
#include <string.h>

static const kmp_key unit_keys[] = {
#include "model/keys/file_unit_keys.def"
    {0}};

enum { NODE_MOST = 999999999 }; /* the largest number of a node: nine digits */

typedef struct reading {
    kmp_reader *r;
    const kmp_yaml *map, *node; /* `flexible`; `file` */
    const char *what;           /* "file 'blade.npz' of body 'blade'" */
    kmp_modal_file file;
    kmp_modal_reading *to;
} reading;

/* -- the file ---------------------------------------------------------------------------------------- */

static bool read_units(const reading *s, kmp_modal_units *units)
{
    static const char *const keys[2] = {"length", "mass"};
    const kmp_yaml *map = kmp_yaml_get(s->map, "scale");
    const char *what = kmp_reader_say(s->r, "the scale of %s", s->what);
    double *value[2] = {&units->length, &units->mass};
    *units = (kmp_modal_units){0};
    if (!map)
        return true;
    if (!kmp_read_map(s->r, map, what, unit_keys))
        return false;
    for (int k = 0; k < 2; k++) {
        const kmp_yaml *node = kmp_yaml_get(map, keys[k]);
        const char *of = kmp_reader_say(s->r, "%s of %s", keys[k], what);
        *value[k] = 1;
        if (node && (!kmp_read_fixed(s->r, node, of, kmp_key_dimension(unit_keys, keys[k]), value[k]) ||
                     !kmp_check_rule(s->r, node, of, KMP_FIELD_POSITIVE, *value[k], "")))
            return false;
    }
    return true;
}

/* Places of nodes by their numbers, or the name of a text with them. */
static bool read_nodes(const reading *s, kmp_modal_nodes *nodes, const char **path, char **text)
{
    const kmp_yaml *map = kmp_yaml_get(s->map, "nodes");
    const char *what = kmp_reader_say(s->r, "the nodes of %s", s->what), *word = NULL;
    size_t length;
    int *number;
    double *at;
    *nodes = (kmp_modal_nodes){0};
    if (!map)
        return true;
    if (map->kind == KMP_YAML_SCALAR) {
        if (!(word = kmp_read_word(s->r, map, what)))
            return false;
        *path = kmp_path_beside(s->r, map->place.file, word);
        *text = kmp_read_file(s->r, KMP_FILE_MODES, map, what, *path, &length);
        nodes->text = *text;
        return *text && (!memchr(*text, 0, length) ||
                         kmp_complain_of(s->r, map, what, "'%s' is not a text file: it has bytes of zero", word));
    }
    if (!kmp_read_map(s->r, map, what, NULL) || !KMP_ARENA_MAKE(&s->r->scratch, KMP_ROOM(int, map->count + 1, &number),
                                                                KMP_ROOM(double, 3 * map->count + 1, &at)))
        return false;
    for (int k = 0; k < map->count; k++) {
        const char *of = kmp_reader_say(s->r, "node '%s' of %s", map->keys[k]->text, s->what);
        const char *key = map->keys[k]->text;
        double value;
        if (kmp_text_to_number(key, &value) != strlen(key) || value != floor(value) || value > NODE_MOST)
            return kmp_reader_complain(s->r, map->keys[k]->place, "%s: the number of a node is expected", of);
        number[k] = (int)value;
        if (!kmp_read_list(s->r, map->items[k], of, 3))
            return false;
        for (int i = 0; i < 3; i++)
            if (!kmp_read_fixed(s->r, map->items[k]->items[i], of, KMP_DIM_LENGTH, &at[3 * k + i]))
                return false;
    }
    *nodes = (kmp_modal_nodes){.count = map->count, .number = number, .at = at};
    return true;
}

/* A mistake in a text is at its line. */
static void complain_of(const reading *s, const char *path, const char *words)
{
    const int file = s->file.line > 0 ? kmp_reader_add_file(s->r, path) : -1;
    if (file >= 0)
        kmp_reader_complain(s->r, (kmp_place){.line = s->file.line, .column = s->file.column, .file = file}, "%s: %s",
                            s->what, words);
    else
        KMP_COMPLAIN(s, s->node, "%s", words);
}

static bool load(reading *s, const char *path)
{
    kmp_modal_units units;
    kmp_modal_nodes nodes;
    kmp_text why = {0};
    kmp_modal_source source = {.arena = &s->r->scratch, .units = &units, .nodes = &nodes, .to = &s->file, .why = &why};
    const char *beside = NULL;
    char *text = NULL, *bytes = NULL;
    bool good = read_units(s, &units) && read_nodes(s, &nodes, &beside, &text) &&
                (bytes = kmp_read_file(s->r, KMP_FILE_MODES, s->node, s->what, path, &source.length));
    source.bytes = bytes;
    good = good && kmp_modal_file_read(path, &source);
    if (bytes && !good && why.length > 0)
        complain_of(s, s->file.beside ? beside : path, why.s);
    s->r->scratch.failed = s->r->scratch.failed || why.failed;
    kmp_text_free(&why);
    kmp_free(text);
    kmp_free(bytes);
    return good;
}

/* -- interfaces -------------------------------------------------------------------------------------- */

static const char *names_of(const reading *s)
{
    kmp_text text = {0};
    for (int k = 0; k < s->file.body.place_count; k++)
        kmp_text_printf(&text, "%s'%s'", k > 0 ? ", " : "", s->file.names[k]);
    if (s->file.body.place_count == 0)
        kmp_text_put(&text, "none");
    return kmp_reader_take(s->r, &text);
}

/* A number of a node; -1 after an error. */
static int read_node(kmp_reader *r, const kmp_modal_body *b, const kmp_yaml *node, const char *what)
{
    double k;
    if (!kmp_read_fixed(r, node, what, KMP_DIM_NUMBER, &k))
        return -1;
    const int found = kmp_modal_find_node(b, k);
    if (found >= 0)
        return found;
    const int last = b->node_count - 1;
    if (b->node_count == 0)
        kmp_reader_complain(r, node->place, "%s is %.6g: the file has no nodes", what, k);
    else
        kmp_reader_complain(r, node->place, "%s is %.6g: the file has %s nodes %.6g to %.6g", what, k,
                            b->number ? "none of this number among its" : "the", b->number ? b->number[0] : 0,
                            b->number ? b->number[last] : last);
    return -1;
}

static int add_nodes(kmp_reader *r, kmp_modal_body *b, const kmp_yaml *node, const char *what, int count,
                     const int *nodes)
{
    const int place = kmp_modal_add_nodes(b, count, nodes);
    if (place < 0 && !b->arena->failed)
        kmp_complain_of(r, node, what,
                        "the nodes are in a line, and do not say how it turns about that line: give three nodes that "
                        "are not, or an interface of the file");
    return place;
}

static int place_by_nodes(const reading *s, kmp_modal_body *b, const kmp_yaml *list, const char *what)
{
    int *nodes = kmp_arena_alloc(&s->r->scratch, (size_t)list->count + 1, sizeof *nodes);
    if (!nodes || !kmp_read_list(s->r, list, what, -1))
        return -1;
    if (list->count == 0) {
        kmp_reader_complain(s->r, list->place, "%s has no nodes: give their numbers", what);
        return -1;
    }
    for (int k = 0; k < list->count; k++)
        if ((nodes[k] = read_node(s->r, b, list->items[k], kmp_reader_say(s->r, "node %d of %s", k + 1, what))) < 0)
            return -1;
    return add_nodes(s->r, b, list, what, list->count, nodes);
}

/* An interface of the file by its name, one by a node or by nodes. -1 after an error. */
static int find_place(const reading *s, kmp_modal_body *b, const kmp_yaml *node, const char *what)
{
    const char *word;
    if (node->kind == KMP_YAML_LIST)
        return place_by_nodes(s, b, node, what);
    if (!(word = kmp_read_word(s->r, node, what)))
        return -1;
    for (int k = 0; k < s->file.body.place_count && k < s->to->named; k++)
        if (strcmp(s->file.names[k], word) == 0)
            return k;
    if (word[strspn(word, "0123456789")] == '\0') {
        const int own = read_node(s->r, b, node, what);
        return own < 0 ? -1 : add_nodes(s->r, b, node, what, 1, &own);
    }
    kmp_complain_of(s->r, node, what, "the file has no interface '%s'; it has: %s", word, names_of(s));
    return -1;
}

/* The places of the body become the places that the model names, in its order. */
static bool take_interfaces(reading *s)
{
    const kmp_yaml *map = kmp_yaml_get(s->map, "interfaces");
    kmp_modal_body *b = &s->file.body;
    s->to->names = s->file.names;
    s->to->named = b->place_count;
    if (!map && b->place_count > KMP_MODAL_PLACES_MOST)
        return KMP_COMPLAIN(s, s->node,
                            "it has %d interfaces: name those that the model uses by 'interfaces: "
                            "{A: %s, B: %s}', the one that the joint holds first",
                            b->place_count, s->file.names[0], s->file.names[1]);
    if (!map)
        return b->place_count > 0 ||
               KMP_COMPLAIN(s, s->node,
                            "it has no interfaces: name nodes that joints hold by 'interfaces: {A: [1, 2, 3]}'");
    if (!kmp_read_map(s->r, map, kmp_reader_say(s->r, "the interfaces of %s", s->to->body), NULL))
        return false;
    kmp_modal_place *places = kmp_arena_alloc(&s->r->scratch, (size_t)map->count + 1, sizeof *places);
    const char **names = kmp_arena_alloc(&s->r->scratch, (size_t)map->count + 1, sizeof *names);
    bool good = places && names;
    for (int k = 0; k < map->count && good; k++) {
        names[k] = kmp_read_name(s->r, map->keys[k], kmp_reader_say(s->r, "interface of %s", s->to->body));
        const char *what = kmp_reader_say(s->r, "interface '%s' of %s", names[k] ? names[k] : "", s->to->body);
        const int place = names[k] ? find_place(s, b, map->items[k], what) : -1;
        good = place >= 0;
        if (good)
            places[k] = b->places[place];
    }
    if (good && map->count == 0)
        return kmp_reader_complain(
            s->r, map->place, "the entry does not name an interface of %s; its joint holds the first one", s->to->body);
    s->to->names = names;
    s->to->named = map->count;
    b->places = places;
    b->place_count = map->count;
    return good;
}

/* -- frame ------------------------------------------------------------------------------------------- */

/* True if rigid motions are more than the rounding of the modes' motions. */
static bool is_moved(const kmp_modal_body *b, const double *rigid)
{
    const double rounding = 1e-12;
    const int n = b->count;
    const double size = sqrt((b->second[0] + b->second[4] + b->second[8]) / b->mass);
    bool moved = false;
    for (int k = 0; k < n; k++) {
        const double *t = b->by_field + 9 * (ptrdiff_t)(n + 1) * k, mean = sqrt((t[0] + t[4] + t[8]) / b->mass);
        for (int i = 0; i < 6; i++)
            moved = moved || fabs(rigid[6 * k + i]) * (i < 3 ? 1 : size) > rounding * mean;
    }
    return moved;
}

/* Coordinates of modes without rigid motions keep the names of the file. Otherwise they are the modes of the body in
 * its frame, slowest first, the largest part of each positive. */
static bool split(reading *s, int rigid, const double *elastic)
{
    kmp_modal_body *b = &s->file.body;
    const double equal = 1 + 1e-6;
    const int n = b->count - rigid, before = b->count;
    double *mass, *values, *x, *v;
    if (rigid == 0)
        return true;
    if (n == 0)
        return KMP_COMPLAIN(s, s->node, "all its modes are rigid motions: without others the body is rigid");
    if (!kmp_modal_combine(b, n, elastic) ||
        !KMP_ARENA_MAKE(b->arena, KMP_ROOM(double, n *n, &mass, &x), KMP_ROOM(double, n, &values),
                        KMP_ROOM(double, n *before, &v)))
        return false;
    kmp_modal_mass(b, mass);
    if (!kmp_modal_values(b->arena, n, b->stiffness, mass, values, x))
        return !b->arena->failed &&
               KMP_COMPLAIN(s, s->node, "without rigid motions its modes have no mass: two of them are alike");
    for (int k = 0; k < n; k++) {
        double largest = 0;
        for (int l = 0; l < before; l++) {
            for (int e = 0; e < n; e++)
                v[k * before + l] += x[k * n + e] * elastic[e * before + l];
            if (fabs(v[k * before + l]) > fabs(largest) * equal)
                largest = v[k * before + l];
        }
        for (int e = 0; e < n; e++)
            x[k * n + e] = largest < 0 ? -x[k * n + e] : x[k * n + e];
    }
    return kmp_modal_combine(b, n, x);
}

static bool take_frame(reading *s, kmp_flexible_frame frame)
{
    kmp_modal_body *b = &s->file.body;
    const double origin[3] = {b->places[0].at[0], b->places[0].at[1], b->places[0].at[2]};
    double *rigid, *elastic;
    kmp_text why = {0};
    if (!KMP_ARENA_MAKE(b->arena, KMP_ROOM(double, 6 * b->count, &rigid),
                        KMP_ROOM(double, b->count * b->count, &elastic)))
        return false;
    kmp_modal_move_origin(b, origin);
    if (frame == KMP_FRAME_CHORD && (b->place_count < 2 || !(kmp_dot3(b->places[1].at, b->places[1].at) > 0)))
        return KMP_COMPLAIN(
            s, s->node, "the frame 'chord' is from its first interface to the second one, at another place: name both");
    const int rigids = kmp_modal_rigid(b, elastic, &why);
    if (why.length > 0)
        KMP_COMPLAIN(s, s->node, "%s", why.s);
    s->r->scratch.failed = s->r->scratch.failed || why.failed;
    kmp_text_free(&why);
    if (rigids < 0)
        return false;
    if (!kmp_modal_frame(b, frame, rigid))
        return KMP_COMPLAIN(s, s->node,
                            "the frame 'mean' needs a moment of inertia about each axis, and it has none about one");
    const bool moved = is_moved(b, rigid);
    if (moved && s->to->stiffening == KMP_STIFFENING_FIRST)
        return KMP_COMPLAIN(s, s->node,
                            "its modes move or turn the first interface, and its terms of second order are in their "
                            "frame: write them in the model's frame, or take 'stiffening: none'");
    if (moved)
        kmp_modal_subtract(b, rigid);
    if (!split(s, rigids, elastic))
        return false;
    kmp_modal_average(b);
    return true;
}

static bool take_modes(reading *s)
{
    const kmp_yaml *node = kmp_yaml_get(s->map, "modes");
    kmp_modal_body *b = &s->file.body;
    double count, *v;
    const char *what = kmp_reader_say(s->r, "modes of %s", s->to->body);
    if (!node)
        return true;
    if (!kmp_read_fixed(s->r, node, what, KMP_DIM_NUMBER, &count))
        return false;
    if (!(count >= (s->r->bodies_as ? 0 : 1) && count <= b->count && count == floor(count)))
        return kmp_reader_complain(s->r, node->place,
                                   "%s are %.6g: a whole number from 1 to %d, which the file has, is "
                                   "expected",
                                   what, count, b->count);
    const int kept = (int)count;
    if (!(v = kmp_arena_alloc(b->arena, (size_t)kept * (size_t)b->count, sizeof *v)))
        return false;
    for (int k = 0; k < kept; k++)
        v[k * b->count + k] = 1;
    return kmp_modal_combine(b, kept, v);
}

static bool take_stiffening(reading *s)
{
    const kmp_yaml *node = kmp_yaml_get(s->map, "stiffening");
    const char *what = kmp_reader_say(s->r, "stiffening of %s", s->to->body);
    s->to->stiffening = s->file.first ? KMP_STIFFENING_FIRST : KMP_STIFFENING_NONE;
    if (!node)
        return true;
    const int word = kmp_read_choice(s->r, node, what, KMP_NAMES_OF(kmp_stiffening_words), "the word is");
    if (word == KMP_STIFFENING_FULL)
        return kmp_complain_of(s->r, node, what, "a file has terms of second order up to 'first'");
    if (word == KMP_STIFFENING_FIRST && !s->file.first)
        return kmp_complain_of(s->r, node, what,
                               "'first' needs the arrays 'h', 'Y' and 'interface_H', which the file does not have, or "
                               "Ct, Oe and phi of first order in standard input data: take 'none'");
    if (word == KMP_STIFFENING_NONE && s->file.whole)
        return kmp_complain_of(s->r, node, what,
                               "terms of second order cannot be left out, because the file has the stiffening by "
                               "rotation within its centrifugal terms (Oe): take 'first'");
    if (word >= 0)
        s->to->stiffening = (kmp_stiffening)word;
    return word >= 0;
}

/* `first` at places whose displacements of second order are not known. */
static bool check_second(const reading *s)
{
    for (int k = 0; k < s->file.body.place_count && s->to->stiffening == KMP_STIFFENING_FIRST; k++)
        if (!s->file.body.places[k].more)
            return KMP_COMPLAIN(s, s->node,
                                "the file has no displacements of second order for interface '%s': use "
                                "other interfaces, or 'stiffening: none' where they can be left out",
                                s->to->names[k]);
    return true;
}

kmp_modal_reading *kmp_read_modal_body(kmp_reader *r, const kmp_yaml *map, const char *body, kmp_flexible_frame frame)
{
    reading s = {.r = r, .map = map, .node = kmp_yaml_get(map, "file")};
    const char *word = kmp_read_word(r, s.node, kmp_reader_say(r, "file of %s", body));
    s.to = kmp_arena_alloc(&r->scratch, 1, sizeof *s.to);
    if (!word || !s.to)
        return NULL;
    s.what = kmp_reader_say(r, "file '%s' of %s", word, body);
    s.to->path = kmp_arena_strdup(&r->model->arena, word);
    s.to->body = body;
    if (!load(&s, kmp_path_beside(r, s.node->place.file, word)) || !take_stiffening(&s) || !take_interfaces(&s) ||
        !check_second(&s) || !take_frame(&s, frame) || !take_modes(&s))
        return NULL;
    s.to->modal = s.file.body;
    s.to->doubt = s.file.doubt ? kmp_arena_strdup(&r->model->arena, s.file.doubt) : NULL;
    if (s.to->doubt)
        kmp_reader_warn(r, s.node->place, "%s: %s", s.what, s.to->doubt);
    return s.to;
}

/* -- points ------------------------------------------------------------------------------------------ */

/* The place of a node, which is added once. */
static int place_of_node(kmp_reader *r, kmp_modal_reading *m, const kmp_yaml *node, const char *what)
{
    const int own = read_node(r, &m->modal, node, what);
    for (int k = m->named; k < m->modal.place_count && own >= 0; k++)
        if (m->node[k - m->named] == own)
            return k;
    if (own >= 0 && m->stiffening == KMP_STIFFENING_FIRST) {
        kmp_complain_of(
            r, node, what,
            "the displacement of second order of a node is not in the file: use an interface, or 'stiffening: none'");
        return -1;
    }
    const int place = own < 0 ? -1 : add_nodes(r, &m->modal, node, what, 1, &own);
    if (place < 0 || !KMP_ARENA_GROW(&r->scratch, m->node, place - m->named))
        return -1;
    m->node[place - m->named] = own;
    return place;
}

void kmp_read_modal_point(kmp_reader *r, kmp_modal_reading *m, const kmp_yaml *map, const char *what, kmp_point *point)
{
    const kmp_yaml *name = kmp_yaml_get(map, "interface"), *node = kmp_yaml_get(map, "node");
    const kmp_yaml *offset = kmp_yaml_get(map, "offset"), *given = name ? name : node;
    int place = -1;
    if (!given || (name && node)) {
        kmp_complain_of(
            r, map, what,
            "a point of %s is at an interface or a node of its file: {interface: %s, offset: [0, 0, 0]} or {node: 0}",
            m->body, m->names[0]);
        return;
    }
    const char *of = kmp_reader_say(r, "%s of %s", name ? "the interface" : "the node", what);
    if (node)
        place = place_of_node(r, m, node, of);
    else {
        place = kmp_read_choice(r, name, of, KMP_NAMES(m->names, m->named), "it is");
    }
    if (offset &&
        kmp_read_vector(r, offset, kmp_reader_say(r, "the offset of %s", what), KMP_DIM_LENGTH, point->offset))
        for (int k = 0; k < 3; k++)
            point->offset[k].symbol = 0;
    if (place < 0)
        return;
    point->station = place + 1;
    for (int k = 0; k < 3; k++)
        point->at[k] =
            kmp_number_add(&r->model->arena, (kmp_number){.value = m->modal.places[place].at[k]}, point->offset[k]);
}

void kmp_check_modal_mass(kmp_reader *r, const kmp_modal_reading *m, const kmp_yaml *mass)
{
    const double rounded = 1e-2; /* a mass that is written with two digits */
    const char *what = kmp_reader_say(r, "mass of %s", m->body);
    kmp_number number;
    if (!kmp_read_number(r, mass, what, KMP_DIM(0, 1, 0), &number))
        return;
    if (!(fabs(number.value - m->modal.mass) <= rounded * m->modal.mass))
        kmp_reader_complain(
            r, mass->place,
            "%s is %.6g kg, and in its file '%s' it is %.6g kg: one of them is in other units, or of another "
            "body",
            what, number.value, m->path, m->modal.mass);
}
