/* SPDX-License-Identifier: BSD-3-Clause */
/* Joints between two bodies. Once the tree is chosen they are converted to forms that the rest of the reader knows:
 * joints in bodies, and closures. */
#include "model/read/read_linkage.h"
#include "model/data/coordinates.h"
#include "model/data/model.h"
#include "model/files/nodes.h"
#include "model/read/linkage.h"
#include "model/read/read_bodies.h"
#include "model/read/read_include.h"
#include "model/read/read_values.h"
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

static const kmp_key edge_keys[] = {
#define KMP_JOINT(name, chain) {#name, "", ""},
#include "model/data/joints.def"
#undef KMP_JOINT
#define KMP_CUT(...)
#define KMP_ALWAYS_CUT(joint, ...) {#joint, "", ""},
#include "model/data/cuts.def"
#undef KMP_CUT
#define KMP_COUPLING_NUMBER(kind, joint_key, unit, ...) {#joint_key, unit, ""},
#include "model/data/closure_numbers.def"
#include "model/keys/edge_keys.def"
    {0}};

/* -- nodes --------------------------------------------------------------------------------------- */

static const kmp_yaml *word(kmp_reader *r, const char *text, const kmp_yaml *place)
{
    return kmp_yaml_word(&r->scratch, place->place, text);
}

static void put(kmp_reader *r, kmp_yaml *map, const char *key, const kmp_yaml *item)
{
    if (item)
        kmp_yaml_put(&r->scratch, map, item->place, key, item);
}

/* -- bodies -------------------------------------------------------------------------------------- */

static int body_named(kmp_reader *r, kmp_linkage *g, const char *name)
{
    return kmp_index_find(&g->body_index, &r->scratch, KMP_NAMES(g->body_names, g->body_count), -1, 0, name);
}

/* Body of a point BODY.POINT, or of a body's name; -1 after an error. */
static int find_body(kmp_reader *r, kmp_linkage *g, const kmp_yaml *node, const char *what)
{
    const char *said = kmp_reader_say(r, "%.*s", (int)strcspn(node->text, "."), node->text);
    const char *name = kmp_reader_body_name(r, node->place.file, said);
    int found = body_named(r, g, name);
    if (found < 0 && strcmp(said, "ground") != 0) {
        kmp_nearest nearest = kmp_nearest_of(name, KMP_NAMES(g->body_names, g->body_count));
        kmp_reader_complain_unknown(r, node->place, &nearest, "%s: unknown body '%s'", what, said);
    }
    return found;
}

static void set_kind(kmp_edge *edge, int kind)
{
    edge->kind = &kmp_joint_rows[kind];
    edge->cut = kmp_cut_row_of(edge->kind->name);
    edge->freedoms = kmp_joint_motions(edge->kind);
}

/* True if a flexible body cannot be carried at a point of it: it has another station than 0. NULL: its origin. */
static bool is_off_origin(const kmp_linkage *g, int body, const kmp_yaml *node)
{
    if (body <= 0 || !node || node->kind != KMP_YAML_SCALAR || !kmp_yaml_get(g->body_maps[body], "flexible"))
        return false;
    const char *dot = strchr(node->text, '.');
    const kmp_yaml *point = kmp_yaml_get(kmp_yaml_get(g->body_maps[body], "points"), dot ? dot + 1 : node->text);
    const kmp_yaml *station = kmp_yaml_get(point, "station");
    double x;
    return !station || kmp_text_to_number(station->text, &x) == 0 || x != 0;
}

/* The joint in a body; its errors are reported when it is read. */
static void take_own_joint(kmp_reader *r, kmp_linkage *g, int body)
{
    const kmp_yaml *joint = kmp_yaml_get(g->body_maps[body], "joint");
    const kmp_yaml *at = kmp_yaml_get(joint, "at"), *name = kmp_yaml_get(joint, "name");
    if (!joint)
        return;
    kmp_edge *edge = &g->edges[g->edge_count++];
    *edge =
        (kmp_edge){.name = g->body_names[body], .key = g->body_keys[body], .map = joint, .own = true, .made = joint};
    edge->body[1] = body;
    edge->point[0] = at;
    edge->point[1] = kmp_yaml_get(joint, "to");
    if (name && name->kind == KMP_YAML_SCALAR)
        edge->name = kmp_reader_name(r, name->place.file, name->text);
    const char *said = at && at->kind == KMP_YAML_SCALAR ? at->text : "ground";
    said = kmp_reader_body_name(r, joint->place.file, kmp_reader_say(r, "%.*s", (int)strcspn(said, "."), said));
    int parent = body_named(r, g, said), kind;
    edge->body[0] = parent < 0 ? 0 : parent;
    edge->faulty = edge->body[0] == body;
    edge->off[0] = at && strchr(at->text, '.') && is_off_origin(g, edge->body[0], at);
    edge->off[1] = is_off_origin(g, body, edge->point[1]);
    const kmp_yaml *motions = kmp_yaml_get(joint, "motions");
    edge->freedoms = motions ? motions->count : 0;
    if (kmp_count_keys(joint, kmp_joint_names, &kind) > 0)
        set_kind(edge, kind);
}

/* -- joints -------------------------------------------------------------------------------------- */

/* Every kind but `free`. */
static bool read_kind(kmp_reader *r, kmp_edge *edge, const char *what)
{
    int kind = -1, count = kmp_count_keys(edge->map, kmp_joint_names, &kind);
    const char *names = NULL;
    if (count > 0)
        set_kind(edge, kind);
    if (count == 1 && strcmp(edge->kind->name, "free") != 0)
        return true;
    for (int k = 0; k < kmp_joint_names.count; k++)
        if (strcmp(kmp_joint_rows[k].name, "free") != 0)
            names = names ? kmp_reader_say(r, "%s, %s", names, kmp_joint_rows[k].name) : kmp_joint_rows[k].name;
    if (count == 1)
        kmp_complain_of(r, edge->key, what,
                        "a free joint connects nothing: remove it, or attach a body without other joints by it: joint: "
                        "{free: x, at: ground}");
    else
        kmp_complain_of(r, edge->map, what, "exactly one of the keys %s is expected, not %d", names, count);
    return false;
}

static void read_wish(kmp_reader *r, kmp_edge *edge, const char *what)
{
    const kmp_yaml *cut = kmp_yaml_get(edge->map, "cut");
    if (!cut)
        return;
    edge->wish = strcmp(cut->text, "yes") == 0  ? KMP_CUT_YES
                 : strcmp(cut->text, "no") == 0 ? KMP_CUT_NO
                                                : KMP_CUT_CHOICE;
    if (edge->wish == KMP_CUT_CHOICE)
        kmp_complain_of(r, cut, what, "cut is 'yes', 'no' or absent");
}

static bool read_ends(kmp_reader *r, kmp_linkage *g, kmp_edge *edge, const char *what)
{
    const kmp_yaml *points = kmp_yaml_get(edge->map, edge->kind->name);
    bool good = kmp_read_list(r, points, what, 2);
    for (int k = 0; k < 2 && good; k++) {
        edge->point[k] = points->items[k];
        const char *text = kmp_read_word(r, edge->point[k], what);
        if (text && !strchr(text, '.'))
            kmp_complain_of(r, edge->point[k], what, "a point is written BODY.POINT, not '%s'", text);
        edge->body[k] = text && strchr(text, '.') ? find_body(r, g, edge->point[k], what) : -1;
        edge->off[k] = is_off_origin(g, edge->body[k], edge->point[k]);
    }
    if (!good || edge->body[0] < 0 || edge->body[1] < 0)
        return false;
    if (edge->body[0] != edge->body[1])
        return true;
    return kmp_complain_of(r, points, what, "both points are on body '%s'", g->body_names[edge->body[0]]);
}

/* Checks that no loop, drive or other joint has the name of a joint, which may be cut. */
static void check_name(kmp_reader *r, kmp_linkage *g, const kmp_edge *edge)
{
    static const char *const sections[][2] = {
        {"loops", "loop"}, {"gears", "gear"}, {"ropes", "rope"}, {"drives", "drive"}};
    kmp_read_name(r, edge->key, "a joint");
    for (int k = 0; k < 4; k++)
        if (kmp_yaml_get(kmp_yaml_get(r->root, sections[k][0]), edge->name))
            kmp_reader_complain(
                r, edge->key->place,
                "a joint cannot have the name '%s' of a %s: if it is cut, lambda(%s) would be ambiguous", edge->name,
                sections[k][1], edge->name);
    int other = kmp_index_find(&g->own_index, &r->scratch, KMP_NAMES(g->edges, g->own_count), -1, 0, edge->name);
    if (other >= 0)
        kmp_reader_complain(r, edge->key->place, "duplicate joint '%s': it is also the joint of body '%s'", edge->name,
                            g->edges[other].key->text);
}

/* Reports keys that do not belong to the kind. */
static void check_edge_keys(kmp_reader *r, const kmp_edge *edge, const char *what)
{
    const kmp_yaml *axis = kmp_yaml_get(edge->map, "axis"), *axes = kmp_yaml_get(edge->map, "axes");
    const kmp_yaml *plunging = kmp_yaml_get(edge->map, "plunging");
    const char *chain = edge->kind->chain;
    if (plunging)
        kmp_complain_of(r, plunging, what, "a %s has no plunging", edge->kind->name);
    if (axis && axes)
        kmp_complain_of(r, edge->map, what, "'axis' and 'axes' exclude each other");
    else if (axis && !chain[0])
        kmp_complain_of(r, axis, what, "a %s has no axis", edge->kind->name);
    else if (axes && !strchr(chain, 'b'))
        kmp_complain_of(r, axes, what, "a %s cannot have two axes: rotate the axes of one of the points instead",
                        edge->kind->name);
    else if (axes)
        kmp_read_list(r, axes, kmp_reader_say(r, "%s: axes", what), 2);
    kmp_check_joint_keys(r, edge->kind, edge->map, what);
}

/* The kind of a joint that is a closure at all times; false: it is of another kind, or there is an error. */
static bool take_closure(kmp_reader *r, kmp_edge *edge, const char *what)
{
    static const char *const keys[] = {"axis", "axes", "plunging", "cut"};
    const kmp_yaml *map = edge->map;
    int kind, other;
    if (kmp_count_keys(map, kmp_always_cut_names, &kind) == 0)
        return false;
    if (kmp_count_keys(map, kmp_joint_names, &other) > 0)
        kmp_complain_of(r, map, what, "it is either a %s or a %s", kmp_always_cut_row(kind)->name,
                        kmp_joint_rows[other].name);
    edge->kind = kmp_always_cut_row(kind);
    edge->cut = kmp_cut_row_of(edge->kind->name);
    if (edge->wish == KMP_CUT_NO)
        kmp_complain_of(r, kmp_yaml_get(map, "cut"), what, "a %s has no coordinates, and is cut at all times",
                        edge->kind->name);
    edge->wish = KMP_CUT_YES;
    for (int k = 0; k < map->count; k++)
        if (kmp_name_find(KMP_NAMES_OF(keys), map->keys[k]->text) < 0 &&
            strcmp(map->keys[k]->text, edge->kind->name) != 0 &&
            kmp_name_find(kmp_key_names(edge_keys), map->keys[k]->text) >= 0)
            kmp_complain_of(r, map->items[k], what, "a %s has no %s", edge->kind->name, map->keys[k]->text);
    return true;
}

static void take_edge(kmp_reader *r, kmp_linkage *g, const kmp_yaml *key, const kmp_yaml *map)
{
    kmp_edge *edge = &g->edges[g->edge_count++];
    *edge = (kmp_edge){.name = kmp_arena_strdup(&r->model->arena, key->text), .key = key, .map = map, .faulty = true};
    edge->body[0] = edge->body[1] = -1;
    if (!edge->name)
        edge->name = "";
    const char *what = kmp_edge_what(r, edge);
    check_name(r, g, edge);
    bool good = map->kind == KMP_YAML_MAP;
    if (!good)
        kmp_reader_complain(r, map->place, "%s must be a mapping such as {revolute: [ground.O, crank.O]}", what);
    if (good) {
        kmp_read_map(r, map, what, edge_keys);
        read_wish(r, edge, what);
    }
    bool closure = good && take_closure(r, edge, what);
    if (good && (closure || read_kind(r, edge, what))) {
        if (!closure)
            check_edge_keys(r, edge, what);
        edge->faulty = !read_ends(r, g, edge, what);
    }
    g->broken = g->broken || edge->faulty;
}

/* -- conversion ------------------------------------------------------------------------------------ */

/* The value of the joint's kind as written in a body. */
static const kmp_yaml *axis_of(kmp_reader *r, const kmp_edge *edge)
{
    const kmp_yaml *axis = kmp_yaml_get(edge->map, "axis"), *axes = kmp_yaml_get(edge->map, "axes");
    if (!edge->kind->chain[0])
        return word(r, "yes", edge->key);
    return axes ? axes : axis ? axis : word(r, "z", edge->key);
}

static const kmp_yaml *make_joint(kmp_reader *r, const kmp_edge *edge)
{
    kmp_yaml *joint = kmp_yaml_new(&r->scratch, KMP_YAML_MAP, edge->map->place);
    const char *key = kmp_joint_key(edge->kind);
    put(r, joint, edge->kind->name, axis_of(r, edge));
    put(r, joint, "at", edge->point[edge->reversed ? 1 : 0]);
    put(r, joint, "to", edge->point[edge->reversed ? 0 : 1]);
    put(r, joint, "coordinates", kmp_yaml_get(edge->map, "coordinates"));
    if (key)
        put(r, joint, key, kmp_yaml_get(edge->map, key));
    if (edge->reversed)
        put(r, joint, "reversed", word(r, "yes", edge->key));
    return joint;
}

/* A body's own joint, by which the body now carries its former parent. */
static const kmp_yaml *turn_own_joint(kmp_reader *r, const kmp_linkage *g, const kmp_edge *edge)
{
    static const char *const ends[] = {"at", "to", "reversed"};
    kmp_yaml *joint = kmp_yaml_new(&r->scratch, KMP_YAML_MAP, edge->map->place);
    const int body = edge->body[1];
    const kmp_include_instance *instance = body > 0 ? kmp_reader_instance(r, g->body_keys[body]->place.file) : NULL;
    const char *name = body == 0 ? "ground" : g->body_names[body] + (instance ? strlen(instance->prefix) : 0);
    const kmp_yaml *to = edge->point[1], *at = edge->point[0];
    for (int k = 0; k < edge->map->count; k++)
        if (kmp_name_find(KMP_NAMES_OF(ends), edge->map->keys[k]->text) < 0)
            put(r, joint, edge->map->keys[k]->text, edge->map->items[k]);
    if (to)
        name = strchr(to->text, '.') ? to->text : kmp_reader_say(r, "%s.%s", name, to->text);
    put(r, joint, "at", word(r, name, to ? to : edge->key));
    if (at && (strchr(at->text, '.') || strcmp(at->text, "ground") == 0))
        put(r, joint, "to", at);
    if (!kmp_yaml_get(edge->map, "reversed"))
        put(r, joint, "reversed", word(r, "yes", edge->key));
    return joint;
}

/* Both axes of a joint with two: of the first point, and of the second. */
static const kmp_yaml *both_axes(kmp_reader *r, const kmp_edge *edge)
{
    double m[3][3] = {{0, 1, 0}, {0, 0, 1}, {1, 0, 0}};
    const kmp_yaml *axes = kmp_yaml_get(edge->map, "axes"), *axis = axis_of(r, edge);
    if (axes || !axis)
        return axes;
    kmp_read_chain_axes(r, edge->kind->chain, axis, kmp_edge_what(r, edge), m);
    kmp_yaml *both = kmp_yaml_new(&r->scratch, KMP_YAML_LIST, axis->place);
    kmp_yaml *second = kmp_yaml_new(&r->scratch, KMP_YAML_LIST, axis->place);
    for (int k = 0; k < 3; k++) {
        kmp_text text = {0};
        kmp_text_number(&text, m[k][1]);
        kmp_yaml_append(&r->scratch, second, NULL, word(r, kmp_reader_take(r, &text), axis));
    }
    kmp_yaml_append(&r->scratch, both, NULL, axis);
    kmp_yaml_append(&r->scratch, both, NULL, second);
    return both;
}

static void add_cut(kmp_reader *r, kmp_linkage *g, kmp_edge *edge)
{
    kempe_model *model = r->model;
    kmp_cut *cut = &model->cuts[model->cut_count];
    const char *why = r->wrong ? "" : kmp_linkage_why(r, g, edge);
    const char *bodies =
        kmp_linkage_bodies(r, g, edge->body[0], r->wrong ? 0 : kmp_linkage_path(g, edge->body[0], edge->body[1]));
    *cut = (kmp_cut){
        .joint = edge->name, .kind = edge->kind->name, .closure = edge->cut->closure, .rows = edge->cut->rows};
    cut->loop = kmp_arena_strdup(&model->arena, bodies);
    cut->why = kmp_arena_strdup(&model->arena, why);
    cut->start_given = edge->start != NULL;
    if (!cut->loop || !cut->why)
        return;
    model->cut_count++;
    kmp_yaml *closure = kmp_yaml_new(&r->scratch, KMP_YAML_MAP, edge->map->place);
    const kmp_yaml *axes = kmp_yaml_get(edge->map, "axes"), *plunging = kmp_yaml_get(edge->map, "plunging");
    put(r, closure, edge->cut->closure, kmp_yaml_get(edge->map, edge->kind->name));
    if (edge->kind->closure) {
        put(r, closure, "axis", kmp_yaml_get(edge->map, "axis"));
        put(r, closure, "axes", axes);
        put(r, closure, "plunging", plunging);
        cut->rows -= !plunging ? 0 : strcmp(plunging->text, "free") == 0 ? 3 : 1;
    }
    if (edge->cut->axes == KMP_CUT_BOTH)
        put(r, closure, "axes", both_axes(r, edge));
    if (edge->cut->axes == KMP_CUT_SAME)
        put(r, closure, "axis", axes && axes->count > 0 ? axes->items[0] : axis_of(r, edge));
    edge->made = closure;
    kmp_yaml_append(&r->scratch, &g->cuts, edge->key, edge->made);
}

static int by_address(const void *a, const void *b)
{
    uintptr_t x = (uintptr_t)(*(const kmp_edge *const *)a)->made, y = (uintptr_t)(*(const kmp_edge *const *)b)->made;
    return x < y ? -1 : x > y;
}

static void make_all(kmp_reader *r, kmp_linkage *g)
{
    r->model->cuts = KMP_ARENA_NEW(&r->model->arena, kmp_cut, g->edge_count);
    g->cuts = (kmp_yaml){.kind = KMP_YAML_MAP, .text = ""};
    if (!r->model->cuts)
        return;
    for (int e = 0; e < g->edge_count; e++) {
        kmp_edge *edge = &g->edges[e];
        if (edge->tree && edge->own)
            edge->made = edge->reversed ? turn_own_joint(r, g, edge) : edge->map;
        else if (edge->tree)
            edge->made = make_joint(r, edge);
        else if (!edge->faulty && !edge->own)
            add_cut(r, g, edge);
        if (edge->made)
            g->made[g->made_count++] = edge;
    }
    qsort(g->made, (size_t)g->made_count, sizeof *g->made, by_address);
}

/* -- the whole ----------------------------------------------------------------------------------- */

static kmp_linkage *new_linkage(kmp_reader *r, int bodies, int joints)
{
    kmp_linkage *g = KMP_ARENA_NEW(&r->scratch, kmp_linkage, 1);
    int n = bodies + 1, edges = bodies + joints;
    if (!g)
        return NULL;
    KMP_ARENA_MAKE(&r->scratch, KMP_ROOM(kmp_edge, edges, &g->edges), KMP_ROOM(int, 2 * n, &g->path),
                   KMP_ROOM(const kmp_edge *, edges, &g->made), KMP_ROOM(int, 2 * edges, &g->next),
                   KMP_ROOM(int, edges, &g->waiting, &g->reach), KMP_ROOM(const char *, n, &g->body_names),
                   KMP_ROOM(const kmp_yaml *, n, &g->body_keys, &g->body_maps),
                   KMP_ROOM(int, n, &g->by, &g->depth, &g->order, &g->group, &g->first));
    return r->scratch.failed ? NULL : g;
}

void kmp_read_linkage(kmp_reader *r, const kmp_yaml *bodies)
{
    const kmp_yaml *map = kmp_yaml_get(r->root, "joints");
    if (!map || !kmp_read_map(r, map, "joints", NULL) || map->count == 0)
        return;
    kmp_linkage *g = new_linkage(r, bodies->count, map->count);
    if (!g)
        return;
    g->body_count = bodies->count + 1;
    g->body_names[0] = "ground";
    for (int b = 1; b < g->body_count; b++) {
        g->body_keys[b] = bodies->keys[b - 1];
        g->body_maps[b] = bodies->items[b - 1];
        g->body_names[b] = g->body_keys[b]->text;
    }
    for (int b = 1; b < g->body_count; b++)
        take_own_joint(r, g, b);
    g->own_count = g->edge_count;
    for (int k = 0; k < map->count; k++)
        take_edge(r, g, map->keys[k], map->items[k]);
    kmp_linkage_find_uses(r, g);
    kmp_linkage_choose(r, g);
    make_all(r, g);
    r->linkage = g;
}

const kmp_yaml *kmp_linkage_joint(const kmp_linkage *g, int body)
{
    return g->by[body] < 0 ? NULL : g->edges[g->by[body]].made;
}

const kmp_yaml *kmp_linkage_cuts(const kmp_reader *r)
{
    return r->linkage ? &r->linkage->cuts : NULL;
}

static const kmp_edge *edge_of(const kmp_reader *r, const kmp_yaml *made)
{
    const kmp_linkage *g = r->linkage;
    const kmp_edge key = {.made = made}, *sought = &key;
    const kmp_edge *const *found =
        g && made ? bsearch(&sought, g->made, (size_t)g->made_count, sizeof *g->made, by_address) : NULL;
    return found ? *found : NULL;
}

/* The name of coordinate k of a cut joint, as it would have it in the tree. */
static const char *cut_name(kmp_reader *r, const kmp_edge *edge, int k)
{
    const kmp_yaml *names = kmp_yaml_get(edge->map, "coordinates");
    const kmp_yaml *node = names && names->kind == KMP_YAML_LIST && k < names->count ? names->items[k] : NULL;
    const char *name = node && strcmp(node->text, "~") != 0 ? kmp_reader_name(r, node->place.file, node->text)
                       : edge->freedoms == 1                ? edge->name
                                                            : kmp_reader_say(r, "%s.%d", edge->name, k + 1);
    return kmp_arena_strdup(&r->model->arena, name);
}

void kmp_linkage_read_coordinates(kmp_reader *r, const kmp_yaml *made, const kmp_closure *closure)
{
    kempe_model *model = r->model;
    const kmp_edge *edge = edge_of(r, made);
    double m[3][3] = {{0, 1, 0}, {0, 0, 1}, {1, 0, 0}};
    kmp_measure_argument end[2];
    if (!edge || edge->freedoms == 0 || !kmp_reader_measure_argument(r, closure->point[0], -1, &end[0]) ||
        !kmp_reader_measure_argument(r, closure->point[1], -1, &end[1]))
        return;
    kmp_read_chain_axes(r, edge->kind->chain, axis_of(r, edge), kmp_edge_what(r, edge), m);
    for (int k = 0; k < edge->freedoms; k++) {
        const char *name = cut_name(r, edge, k);
        const kmp_expr *value = name ? kmp_cut_coordinate_of(&model->arena, name, edge->kind->chain, k, m, end) : NULL;
        if (!value || !KMP_ARENA_GROW(&model->arena, model->cut_coordinates, model->cut_coordinate_count))
            return;
        const bool rotation = edge->kind->chain[2 * k] == 'R';
        model->cut_coordinates[model->cut_coordinate_count++] = (kmp_cut_coordinate){
            .name = name, .joint = edge->name, .number = k + 1, .rotation = rotation, .value = value};
    }
}

const char *kmp_linkage_name(const kmp_reader *r, const kmp_yaml *made)
{
    const kmp_edge *edge = edge_of(r, made);
    return edge ? edge->name : NULL;
}

bool kmp_linkage_loads_parent(const kmp_reader *r, const kmp_yaml *made)
{
    const kmp_edge *edge = edge_of(r, made);
    return edge && edge->reversed;
}

const char *kmp_linkage_what(kmp_reader *r, const kmp_yaml *made)
{
    const kmp_edge *edge = edge_of(r, made);
    return edge ? kmp_edge_what(r, edge) : NULL;
}

kmp_linked kmp_linkage_find(kmp_reader *r, const char *coordinate)
{
    const char *dot = strchr(coordinate, '.');
    if (!r->linkage)
        return KMP_LINKED_NOT;
    if (dot)
        coordinate = kmp_reader_say(r, "%.*s", (int)(dot - coordinate), coordinate);
    const kmp_edge *edge = kmp_linkage_joint_named(r, r->linkage, coordinate);
    return !edge ? KMP_LINKED_NOT : edge->tree ? KMP_LINKED_TREE : KMP_LINKED_CUT;
}
