/* SPDX-License-Identifier: BSD-3-Clause */
/* Bodies, their order and their points. The tree comes from the joints' `at`; parents are put before their
 * children, the file's order kept otherwise. */
#include "model/read/read_bodies.h"
#include "model/data/model.h"
#include "model/language/number_algebra.h"
#include "model/read/read_axes.h"
#include "model/read/read_include.h"
#include "model/read/read_joints.h"
#include "model/read/read_linkage.h"
#include "model/read/read_mass.h"
#include "model/read/read_shapes.h"
#include "model/read/read_values.h"
#include "model/read/reading.h"
#include <string.h>

/* A body in its order of the file. */
typedef struct source {
    const char *name;
    const kmp_yaml *key, *map, *joint, *at, *to;
    int parent; /* source, -1 the ground */
    bool placed;
} source;

typedef struct sources {
    kmp_reader *r;
    source *list;
    int count;
    int *order; /* of the sources in the model, parents first */
    int placed;
    kmp_name_index names;
} sources;

static const kmp_key ground_keys[] = {
#include "model/keys/ground_keys.def"
    {0}};
const kmp_key kmp_body_keys[] = {
#include "model/keys/body_keys.def"
    {0}};

static void complain_body_key(kmp_reader *r, const kmp_yaml *key)
{
    const char *name = kmp_read_name(r, key, "a body");
    if (name && strcmp(name, "ground") == 0)
        kmp_reader_complain(r, key->place, "'ground' exists already: its points are under the key 'ground'");
}

static bool take_sources(sources *s, const kmp_yaml *map)
{
    kmp_reader *r = s->r;
    s->list = KMP_ARENA_NEW(&r->scratch, source, map->count);
    s->order = KMP_ARENA_NEW(&r->scratch, int, map->count);
    if (!s->list || !s->order)
        return false;
    for (int i = 0; i < map->count; i++) {
        const char *what = kmp_reader_say(r, "body '%s'", map->keys[i]->text);
        source *to = &s->list[i];
        to->name = map->keys[i]->text;
        to->key = map->keys[i];
        to->map = map->items[i];
        to->parent = -1;
        complain_body_key(r, to->key);
        if (!kmp_read_map(r, to->map, what, kmp_body_keys))
            continue;
        to->joint = r->linkage ? kmp_linkage_joint(r->linkage, i + 1) : kmp_read_required(r, to->map, what, "joint");
        if (to->joint && to->joint->kind == KMP_YAML_MAP)
            to->at = kmp_read_required(r, to->joint, kmp_reader_say(r, "the joint of %s", what), "at");
        to->to = kmp_yaml_get(to->joint, "to");
    }
    s->count = map->count;
    return true;
}

/* -- order --------------------------------------------------------------------------------------- */

/* Names an end of a joint in messages. */
static const char *what_of(kmp_reader *r, const kmp_yaml *joint, const char *end, const char *body)
{
    const char *linked = kmp_linkage_name(r, joint) ? kmp_linkage_what(r, joint) : NULL;
    return linked ? linked : kmp_reader_say(r, "'%s' of body '%s'", end, body);
}

static void find_parent(sources *s, source *child)
{
    kmp_reader *r = s->r;
    const char *what = what_of(r, child->joint, "at", child->name);
    const char *text = child->at ? kmp_read_word(r, child->at, what) : NULL;
    if (!text)
        return;
    const char *said = kmp_reader_say(r, "%.*s", (int)strcspn(text, "."), text);
    const char *name = kmp_reader_body_name(r, child->at->place.file, said);
    if (strcmp(name, "ground") == 0)
        return;
    child->parent = kmp_index_find(&s->names, &r->scratch, KMP_NAMES(s->list, s->count), -1, 0, name);
    if (child->parent >= 0)
        return;
    kmp_nearest nearest = kmp_nearest_begin(name);
    kmp_nearest_offer(&nearest, "ground");
    kmp_nearest_offer_all(&nearest, KMP_NAMES(s->list, s->count));
    if (strcmp(said, "ground") != 0) /* otherwise the include is in error, which puts it on no body */
        kmp_reader_complain_near(r, child->at->place, &nearest, "%s: unknown body '%s'", what, said);
    child->at = NULL;
}

static int parent_of(const void *user, int i)
{
    return ((const source *)user)[i].parent;
}

/* Reports that `on` is its own ancestor. The cycle is cut at its first body in the file, so that it is reported once.
 */
static void complain_circle(sources *s, int on)
{
    int first;
    const char *chain = kmp_reader_cycle(s->r, KMP_NAMES(s->list, s->count), parent_of, s->list, on, &first);
    kmp_reader_complain(s->r, s->list[first].at->place, "bodies are attached to each other in a cycle: %s", chain);
    s->list[first].parent = -1;
    s->list[first].at = NULL;
}

static void cut_circle(sources *s, int i)
{
    int steps = 0;
    while (i >= 0 && !s->list[i].placed && steps <= s->count) {
        i = s->list[i].parent;
        steps++;
    }
    if (steps > s->count)
        complain_circle(s, i);
}

/* Places body i after its ancestors: the path to the root is written from the end of the free part of `order`. */
static void place(sources *s, int i)
{
    int top = s->count;
    cut_circle(s, i);
    for (; i >= 0 && !s->list[i].placed; i = s->list[i].parent) {
        s->list[i].placed = true;
        s->order[--top] = i;
    }
    memmove(s->order + s->placed, s->order + top, (size_t)(s->count - top) * sizeof *s->order);
    s->placed += s->count - top;
}

/* -- bodies -------------------------------------------------------------------------------------- */

static bool make_bodies(sources *s)
{
    kempe_model *model = s->r->model;
    for (int k = 0; k < s->count; k++) {
        const source *from = &s->list[s->order[k]];
        kmp_body *body = &model->bodies[k + 1];
        body->name = kmp_arena_strdup(&model->arena, from->name);
        body->joint = body->name;
        body->place = from->key->place;
        body->at = body->to = -1;
        if (!body->name)
            return false;
    }
    model->body_count = s->count + 1;
    int *place = KMP_ARENA_NEW(&s->r->scratch, int, s->count); /* of a source among the bodies */
    for (int k = 0; place && k < s->count; k++)
        place[s->order[k]] = k + 1;
    for (int k = 0; place && k < s->count; k++) {
        int parent = s->list[s->order[k]].parent;
        model->bodies[k + 1].parent = parent >= 0 ? place[parent] : 0;
    }
    return place;
}

/* BODY.POINT, or -1 for a body's origin. */
static int resolve_end(kmp_reader *r, const kmp_yaml *node, const char *what)
{
    const kmp_include_instance *instance = node ? kmp_reader_instance(r, node->place.file) : NULL;
    if (instance && strcmp(node->text, "ground") == 0)
        return instance->ground;
    return node && strchr(node->text, '.') ? kmp_read_point_text(r, node->place, node->text, what) : -1;
}

/* The body's own end: one of its points, or BODY.POINT. */
static int resolve_own_end(kmp_reader *r, const kmp_yaml *node, int body, const char *what)
{
    if (!node || !kmp_read_word(r, node, what))
        return -1;
    bool full = strchr(node->text, '.') || strcmp(node->text, "ground") == 0;
    int point = full ? resolve_end(r, node, what) : kmp_read_point_of(r, node->place, body, node->text, what);
    if (point < 0 || r->model->points[point].body == body)
        return point;
    kmp_reader_complain(r, node->place, "%s: point '%s' is on body '%s'", what, node->text,
                        r->model->bodies[r->model->points[point].body].name);
    return -1;
}

static void resolve_ends(sources *s, int k)
{
    const source *from = &s->list[s->order[k]];
    kmp_body *body = &s->r->model->bodies[k + 1];
    body->at = resolve_end(s->r, from->at, what_of(s->r, from->joint, "at", body->name));
    body->to = resolve_own_end(s->r, from->to, k + 1, what_of(s->r, from->joint, "to", body->name));
}

/* -- points -------------------------------------------------------------------------------------- */

static const kmp_key point_keys[] = {
#include "model/keys/point_keys.def"
    {0}};

/* [x, y, z], or {at: [x, y, z], axes: {..}}. */
static void read_point(kmp_reader *r, const kmp_yaml *node, const char *what, kmp_point *point)
{
    if (node->kind == KMP_YAML_MAP) {
        kmp_read_map(r, node, what, point_keys);
        const kmp_yaml *axes = kmp_yaml_get(node, "axes");
        point->turned = axes && kmp_read_axes(r, axes, what, point->axes);
        node = kmp_read_required(r, node, what, "at");
    }
    if (node)
        kmp_read_vector(r, node, what, kmp_key_dimension(point_keys, "at"), point->at);
}

static void read_points(kmp_reader *r, const kmp_yaml *owner, int body)
{
    kempe_model *model = r->model;
    const char *what = kmp_reader_say(r, "the points of body '%s'", model->bodies[body].name);
    const kmp_yaml *map = kmp_yaml_get(owner, "points");
    if (!map || !kmp_read_map(r, map, what, NULL))
        return;
    for (int i = 0; i < map->count; i++) {
        kmp_point *point = &model->points[model->point_count];
        kmp_read_name(r, map->keys[i], "a point");
        point->name = kmp_arena_strdup(&model->arena, map->keys[i]->text);
        if (!point->name)
            return;
        point->body = body;
        model->point_count++;
        read_point(r, map->items[i], kmp_reader_say(r, "point '%s.%s'", model->bodies[body].name, map->keys[i]->text),
                   point);
    }
}

static int count_points(const kmp_yaml *owner)
{
    const kmp_yaml *points = kmp_yaml_get(owner, "points");
    return points && points->kind == KMP_YAML_MAP ? points->count : 0;
}

/* -- the ground of included files ---------------------------------------------------------------- */

static void add_vectors(kmp_reader *r, kmp_number to[3], const kmp_number by[3])
{
    for (int k = 0; k < 3; k++) {
        int symbol = to[k].symbol ? to[k].symbol : by[k].symbol;
        to[k] = kmp_number_add(&r->model->arena, to[k], by[k]);
        to[k].symbol = symbol;
    }
}

/* The origin of an included file's ground: a point named by its prefix and `ground`, on the body that it is put on. */
static int place_ground(kmp_reader *r, const kmp_include_instance *instance)
{
    kempe_model *model = r->model;
    kmp_point *point = &model->points[model->point_count];
    const char *name = kmp_reader_body_name(r, instance->file, "ground");
    kmp_number offset[3] = {{.value = 0}};
    int body = kmp_name_find(KMP_BODY_NAMES(model), name), base = -1;
    const kmp_include_instance *outer = kmp_reader_instance(r, instance->parent);
    if (instance->at && strchr(instance->at->text, '.'))
        base = kmp_read_point_text(r, instance->at->place, instance->at->text, "'at' of an include");
    else if (body < 0 && instance->at) /* otherwise, the ground: not found for want of memory */
        (void)kmp_read_body(r, instance->at, "'at' of an include");
    else if (outer && (!instance->at || strcmp(instance->at->text, "ground") == 0))
        base = outer->ground;
    if (instance->at && base >= 0 && model->points[base].turned)
        kmp_reader_complain(
            r, instance->at->place,
            "'at' of an include: the axes of point '%s' are rotated: a file is included in the axes of a body",
            instance->at->text);
    if (instance->offset)
        kmp_read_vector(r, instance->offset, "the offset of an include", kmp_key_dimension(kmp_include_keys, "offset"),
                        offset);
    *point = (kmp_point){.name = kmp_arena_strdup(&model->arena, kmp_reader_say(r, "%sground", instance->prefix)),
                         .body = body < 0 ? 0 : body};
    if (!point->name)
        return -1;
    for (int k = 0; base >= 0 && k < 3; k++)
        point->at[k] = model->points[base].at[k];
    add_vectors(r, point->at, offset);
    return model->point_count++;
}

static void read_included_ground(kmp_reader *r, kmp_include_instance *instance)
{
    kempe_model *model = r->model;
    const kmp_yaml *ground = kmp_yaml_get(instance->root, "ground");
    instance->ground = place_ground(r, instance);
    if (instance->ground < 0 || !ground || !kmp_read_map(r, ground, "ground", ground_keys))
        return;
    int first = model->point_count;
    read_points(r, ground, model->points[instance->ground].body);
    for (int k = first; k < model->point_count; k++) {
        model->points[k].name =
            kmp_arena_strdup(&model->arena, kmp_reader_name(r, instance->file, model->points[k].name));
        if (!model->points[k].name)
            model->points[k].name = "";
        add_vectors(r, model->points[k].at, model->points[instance->ground].at);
    }
}

static bool read_all_points(sources *s, const kmp_yaml *ground)
{
    kempe_model *model = s->r->model;
    int count = count_points(ground);
    for (int i = 0; i < s->count; i++)
        count += count_points(s->list[i].map);
    for (int i = 0; i < s->r->instance_count; i++)
        count += 1 + count_points(kmp_yaml_get(s->r->instances[i].root, "ground"));
    model->points = KMP_ARENA_NEW(&model->arena, kmp_point, count);
    if (!model->points)
        return false;
    if (ground && kmp_read_map(s->r, ground, "ground", ground_keys))
        read_points(s->r, ground, 0);
    for (int k = 0; k < s->count; k++)
        read_points(s->r, s->list[s->order[k]].map, k + 1);
    for (int i = 0; i < s->r->instance_count; i++)
        read_included_ground(s->r, &s->r->instances[i]);
    return true;
}

/* -- shapes of grounds --------------------------------------------------------------------------- */

static void read_ground_shapes(kmp_reader *r)
{
    static const kmp_number none[3] = {{.value = 0}};
    const kmp_shape_owner own = {.body = 0, .name = "the ground", .origin = none};
    const kmp_yaml *ground = kmp_yaml_get(r->root, "ground");
    if (ground)
        kmp_read_shapes(r, ground, &own);
    for (int i = 0; i < r->instance_count; i++) {
        const kmp_include_instance *instance = &r->instances[i];
        const kmp_yaml *map = kmp_yaml_get(instance->root, "ground");
        if (!map || instance->ground < 0)
            continue;
        const kmp_point *origin = &r->model->points[instance->ground];
        kmp_read_shapes(r, map, &(kmp_shape_owner){origin->body, "the ground", origin->at});
    }
}

/* -- the whole ----------------------------------------------------------------------------------- */

/* The ground exists also without bodies, so that references to it can be read. */
static bool make_ground(kempe_model *model, int bodies)
{
    model->bodies = KMP_ARENA_NEW(&model->arena, kmp_body, bodies + 1);
    if (!model->bodies)
        return false;
    model->body_count = 1;
    model->bodies[0] = (kmp_body){.name = "ground",
                                  .joint = "",
                                  .place = {.line = 1, .column = 1},
                                  .parent = -1,
                                  .at = -1,
                                  .to = -1,
                                  .motion_count = 0};
    return true;
}

static void read_joints(sources *s)
{
    const kmp_yaml **joints = KMP_ARENA_NEW(&s->r->scratch, const kmp_yaml *, s->count);
    for (int k = 0; joints && k < s->count; k++) {
        resolve_ends(s, k);
        joints[k] = s->list[s->order[k]].joint;
    }
    if (joints)
        kmp_read_motions(s->r, joints);
}

void kmp_read_bodies(kmp_reader *r)
{
    sources s = {.r = r};
    const kmp_yaml *map = kmp_read_required(r, r->root, "the model", "bodies");
    bool good = map && kmp_read_map(r, map, "bodies", NULL);
    if (good && map->count == 0)
        kmp_reader_complain(r, map->place, "bodies: a model needs at least one body");
    if (good && map->kind == KMP_YAML_MAP)
        kmp_read_linkage(r, map);
    if (!make_ground(r->model, good ? map->count : 0) || (good && map->count > 0 && !take_sources(&s, map)))
        return;
    for (int i = 0; i < s.count; i++)
        find_parent(&s, &s.list[i]);
    for (int i = 0; i < s.count; i++)
        place(&s, i);
    if (!make_bodies(&s) || !read_all_points(&s, kmp_yaml_get(r->root, "ground")))
        return;
    read_joints(&s);
    for (int k = 0; k < s.count; k++)
        kmp_read_mass(r, s.list[s.order[k]].map, k + 1);
    read_ground_shapes(r);
}
