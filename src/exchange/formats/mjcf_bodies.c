/* SPDX-License-Identifier: BSD-3-Clause */
/* Bodies of MJCF. Several joints of a body act one after the other: each but the last one moves a body without mass.
 * Geoms are pictures, and masses: if a mesh gives a body a part of its mass, the masses of all its geoms are added
 * here; otherwise they follow from the shapes in the document. */
#include "exchange/formats/mjcf_bodies.h"
#include "base/arena.h"
#include "base/text.h"
#include "exchange/formats/foreign_frames.h"
#include "exchange/formats/importing.h"
#include "exchange/formats/mjcf.h"
#include "model/data/mesh.h"
#include "model/data/place.h"
#include "model/data/shape.h"
#include "model/language/nearest.h"
#include "platform/platform.h"
#include <math.h>
#include <stdbool.h>
#include <string.h>

/* An element of a body, or of a frame inside, with what applies to it. */
typedef struct part {
    const kmp_element *element;
    kmp_pose frame; /* around it, in the body */
    const kmp_mjcf_class *around;
    struct part *next, *last; /* of the first one of a list: its last one */
} part;

typedef struct parts {
    part *joints, *geoms, *sites, *bodies;
    const kmp_element *inertial;
} parts;

/* -- names --------------------------------------------------------------------------------------------- */

bool kmp_mjcf_is_taken(kmp_mjcf_names *names, kmp_arena *arena, const char *name)
{
    return kmp_index_find(&names->index, arena, KMP_NAMES(names->list, names->count), -1, 0, name) >= 0;
}

void kmp_mjcf_take_name(kmp_mjcf_names *names, kmp_arena *arena, const char *name)
{
    const char **list = name ? kmp_arena_room(arena, names->list, names->count, sizeof *list) : NULL;
    if (!list)
        return;
    names->list = list;
    list[names->count++] = name;
}

/* A name that no other part has: with `_` at its end while it is taken. */
static const char *new_name(kmp_mjcf *m, kmp_mjcf_names *taken, const char *name)
{
    while (name && kmp_mjcf_is_taken(taken, m->im->arena, name))
        name = kmp_arena_printf(m->im->arena, "%s_", name);
    kmp_mjcf_take_name(taken, m->im->arena, name);
    return name;
}

/* Names that the file gives come before names that are made here. */
static void take_names(kmp_mjcf *m, const kmp_element *in)
{
    for (const kmp_element *e = in->first; e; e = e->next) {
        const char *name = kmp_element_text(e, "name");
        if (name && strcmp(e->name, "body") == 0)
            kmp_mjcf_take_name(&m->body_names, m->im->arena, kmp_import_clean(m->im, name));
        if (name && (strcmp(e->name, "joint") == 0 || strcmp(e->name, "freejoint") == 0))
            kmp_mjcf_take_name(&m->joint_names, m->im->arena, kmp_import_clean(m->im, name));
        take_names(m, e);
    }
}

const kmp_mjcf_body *kmp_mjcf_body_of(kmp_mjcf *m, const kmp_element *from, const char *name)
{
    const kmp_mjcf_body *b = m->bodies;
    if (strcmp(name, "world") == 0)
        return &m->world;
    while (b && (!b->name || strcmp(b->name, name) != 0))
        b = b->next;
    if (!b)
        kmp_import_complain(m->im, from->place, "the body", name, "does not exist");
    return b;
}

const kmp_mjcf_joint *kmp_mjcf_joint_of(kmp_mjcf *m, const kmp_element *from, const char *name)
{
    const kmp_mjcf_joint *j = m->joints;
    while (j && (!j->name || strcmp(j->name, name) != 0))
        j = j->next;
    if (!j)
        kmp_import_complain(m->im, from->place, "the joint", name, "does not exist");
    else if (!j->single)
        kmp_import_complain(m->im, from->place, "the joint", name, "has several coordinates: one is needed here");
    return j && j->single ? j : NULL;
}

/* -- joints -------------------------------------------------------------------------------------------- */

enum { HINGE, SLIDE, BALL, FREE, TYPES };

static const struct {
    const char *type, *joint;
} types[TYPES] = {{"hinge", "revolute"}, {"slide", "prismatic"}, {"ball", "spherical"}, {"free", "free"}};

static int type_of(kmp_mjcf *m, const kmp_mjcf_item *item)
{
    const char *word = kmp_mjcf_text(item, "type");
    int type = strcmp(item->own->name, "freejoint") == 0 ? FREE : HINGE;
    if (!word || type == FREE)
        return type;
    while (type < TYPES && strcmp(types[type].type, word) != 0)
        type++;
    if (type == TYPES)
        kmp_import_complain(m->im, item->own->place, "joint type", word,
                            "is unknown; available: hinge, slide, ball, free");
    return type;
}

static void add_losses(kmp_mjcf *m, const kmp_mjcf_item *item, const char *name, const char *const points[2], int type)
{
    double stiffness = m->has_springs ? kmp_mjcf_number(m, item, "stiffness", 0) : 0,
           damping = m->has_dampers ? kmp_mjcf_number(m, item, "damping", 0) : 0,
           friction = m->has_friction ? kmp_mjcf_number(m, item, "frictionloss", 0) : 0,
           rest = kmp_mjcf_number(m, item, "springref", 0);
    if (type == HINGE || type == SLIDE) {
        kmp_import_spring(m->im, item->own, name, "spring", stiffness, type == HINGE ? rest * m->angle : rest, damping);
        kmp_import_friction(m->im, item->own, name, type == SLIDE, friction);
        return;
    }
    if (damping != 0) { /* against all motions of a ball or free joint: of the body's origin, and of its turning */
        kmp_yaml *map = kmp_import_between(m->im, item->own, "forces",
                                           kmp_arena_printf(m->im->arena, "%s_damping", name), "bushing", points);
        if (type == FREE)
            kmp_import_value(m->im, map, item->own->place, "damping", damping);
        kmp_import_value(m->im, map, item->own->place, "rotational_damping", damping);
    }
    if (stiffness != 0)
        kmp_import_leave_out(m->im, item->own->place, KMP_PART_MECHANICS, "stiffness",
                             "the stiffness of joint '%s' with several coordinates is not used", name);
    if (friction != 0)
        kmp_import_leave_out(m->im, item->own->place, KMP_PART_MECHANICS, "frictionloss",
                             "the frictionloss of joint '%s' with several coordinates is not used", name);
}

static kmp_pose shifted(const double by[3])
{
    kmp_pose f = kmp_frame_none();
    memcpy(f.p, by, sizeof f.p);
    return f;
}

/* The frame of the parent's point: at the joint, where its coordinate is zero. The bodies are as the file places them
 * where it is the reference. */
static kmp_pose start_of(const kmp_pose *at, int type, const double pos[3], const double axis[3], double reference)
{
    kmp_pose f = shifted(pos), back = kmp_frame_none();
    if (type == HINGE)
        (void)kmp_frame_about(axis, -reference, back.r);
    if (type == SLIDE) {
        double length = hypot(hypot(axis[0], axis[1]), axis[2]);
        for (int k = 0; k < 3; k++)
            back.p[k] = length > 0 ? 0 - reference * axis[k] / length : 0;
    }
    f = kmp_frame_in(at, &f);
    return kmp_frame_in(&f, &back);
}

static void add_range(kmp_mjcf *m, const kmp_mjcf_item *item, const kmp_mjcf_joint *j)
{
    const char *limited = kmp_mjcf_text(item, "limited");
    double range[2] = {0}, unit = j->slides ? 1 : m->angle;
    bool given = kmp_mjcf_numbers(m, item, "range", 2, 2, range) > 0;
    bool counts = limited && strcmp(limited, "auto") != 0 ? kmp_mjcf_flag(m, item, "limited", false) : m->ranges_count;
    if (j->single && given && counts && m->has_limits)
        kmp_import_limits(m->im, item->own, j->own, NULL, unit * range[0], unit * range[1]);
}

static void put_start(kmp_import *im, kmp_place place, const char *joint, double reference)
{
    kmp_yaml *start = kmp_import_part(im, im->root, "start", KMP_YAML_MAP);
    if (reference != 0)
        kmp_import_value(im, kmp_import_part(im, start, "q", KMP_YAML_MAP), place, joint, reference);
}

/* From the parent, whose frame `at` has the joint's body at the reference, to `body`. Returns its type. */
static int add_joint(kmp_mjcf *m, const part *p, const char *parent, const kmp_pose *at, const char *name,
                     const char *body, kmp_yaml *map)
{
    kmp_import *im = m->im;
    const kmp_element *e = p->element;
    kmp_mjcf_item item =
        strcmp(e->name, "freejoint") == 0 ? kmp_mjcf_plain(e) : kmp_mjcf_take(m, e, "joint", p->around);
    int type = type_of(m, &item);
    double pos[3] = {0}, given[3] = {0, 0, 1}, axis[3];
    kmp_mjcf_joint *j = KMP_ARENA_NEW(im->arena, kmp_mjcf_joint, 1);
    if (type == TYPES || !j || !name || !body)
        return type;
    if (type == HINGE || type == BALL) {
        kmp_mjcf_numbers(m, &item, "pos", 3, 3, pos);
        const kmp_pose there = shifted(pos), in = kmp_frame_in(&p->frame, &there);
        memcpy(pos, in.p, sizeof pos);
    }
    kmp_mjcf_numbers(m, &item, "axis", 3, 3, given);
    kmp_frame_vector(&p->frame, given, axis);
    *j = (kmp_mjcf_joint){.name = kmp_element_text(e, "name"),
                          .own = name,
                          .single = type == HINGE || type == SLIDE,
                          .slides = type == SLIDE};
    if (j->single)
        j->reference = kmp_mjcf_number(m, &item, "ref", 0) * (type == HINGE ? m->angle : 1);
    if (j->single)
        j->rest = kmp_mjcf_number(m, &item, "springref", 0) * (type == HINGE ? m->angle : 1);
    *(m->last_joint ? &m->last_joint->next : &m->joints) = j;
    m->last_joint = j;
    const kmp_pose start = start_of(at, type, pos, axis, j->reference), there = shifted(pos);
    const char *point = kmp_import_point(im, e->place, parent, name, &start),
               *to = pos[0] != 0 || pos[1] != 0 || pos[2] != 0 ? kmp_import_point(im, e->place, body, name, &there)
                                                               : kmp_arena_printf(im->arena, "%s.origin", body);
    kmp_import_joint(im, map, e->place, name, point, types[type].joint,
                     j->single ? kmp_import_direction(im, e->place, name, axis) : NULL);
    const char *dot = to ? strchr(to, '.') : NULL;
    if (dot && strcmp(dot, ".origin") != 0)
        kmp_import_word(im, (kmp_yaml *)kmp_yaml_get(map, "joint"), e->place, "to", dot + 1);
    double armature = kmp_mjcf_number(m, &item, "armature", 0);
    if (armature != 0 && (type == BALL || type == FREE))
        kmp_import_leave_out(m->im, item.own->place, KMP_PART_MECHANICS, "armature",
                             "the armature of joint '%s' with several coordinates is not used", name);
    else if (armature != 0)
        kmp_import_value(m->im, (kmp_yaml *)kmp_yaml_get(map, "joint"), item.own->place, "armature", armature);
    add_range(m, &item, j);
    put_start(im, e->place, name, j->reference);
    const char *const points[2] = {point, to};
    add_losses(m, &item, name, points, type);
    return type;
}

/* The chain of joints from the parent to the body; `at`: the body's frame in the parent. */
static void add_joints(kmp_mjcf *m, const kmp_mjcf_body *parent, kmp_mjcf_body *body, const kmp_element *e,
                       const part *joints, kmp_pose at)
{
    kmp_import *im = m->im;
    const char *from = parent->own;
    int number = 0;
    for (const part *p = joints; p && body->own; p = p->next) {
        const char *name = kmp_element_text(p->element, "name"), *moved = body->own;
        number++;
        name = name ? kmp_import_clean(im, name)
                    : new_name(m, &m->joint_names,
                               number == 1 && !p->next ? body->own
                                                       : kmp_arena_printf(im->arena, "%s_joint%d", body->own, number));
        if (p->next && name)
            moved = new_name(m, &m->body_names, kmp_arena_printf(im->arena, "%s_%s", body->own, name));
        kmp_yaml *map = moved ? kmp_import_add_body(im, p->element, moved) : NULL;
        if (!map)
            return;
        body->map = map;
        int type = add_joint(m, p, from, &at, name, moved, map);
        if (type == FREE && (p->next || number > 1 || parent != &m->world))
            kmp_import_complain(im, p->element->place, "the free joint of", body->own,
                                "must be the only joint of a body of the world");
        from = moved;
        at = kmp_frame_none();
    }
    if (joints || !body->own)
        return;
    const char *name = new_name(m, &m->joint_names, body->own);
    body->map = kmp_import_add_body(im, e, body->own);
    if (body->map && name)
        kmp_import_joint(im, body->map, e->place, name, kmp_import_point(im, e->place, from, name, &at), "weld", NULL);
}

/* -- kinds --------------------------------------------------------------------------------------------- */

static const struct {
    const char *type;
    int solid, sizes; /* -1: no mass, and no picture; -2: mass that is not computed here */
} geoms[] = {{"sphere", KMP_SOLID_SPHERE, 1},
             {"capsule", KMP_SOLID_CAPSULE, 2},
             {"cylinder", KMP_SOLID_CYLINDER, 2},
             {"box", KMP_SOLID_BOX, 3},
             {"ellipsoid", KMP_SOLID_ELLIPSOID, 3},
             {"plane", -1, 0},
             {"hfield", -1, 0},
             {"mesh", -2, 0},
             {"sdf", -2, 0}};

enum { GEOMS = sizeof geoms / sizeof *geoms, GROUPS_DRAWN = 3 /* MuJoCo shows the first ones */ };

/* Between two places, `fromto`: the centre, the axis z, and half the length as the second size, of a box or ellipsoid
 * the third one. */
static void put_between(kmp_mjcf *m, const kmp_mjcf_item *item, int solid, kmp_pose *f, double size[3])
{
    double ends[6], z[3], half = 0;
    if (kmp_mjcf_numbers(m, item, "fromto", 6, 6, ends) == 0)
        return;
    for (int k = 0; k < 3; k++) {
        z[k] = ends[k] - ends[k + 3];
        f->p[k] = (ends[k] + ends[k + 3]) / 2;
        half = hypot(half, z[k] / 2);
    }
    if (!kmp_mjcf_along(z, f->r))
        kmp_import_complain(m->im, item->own->place, "fromto", kmp_mjcf_text(item, "fromto"), "has two equal ends");
    if (solid == KMP_SOLID_BOX || solid == KMP_SOLID_ELLIPSOID) {
        size[1] = size[0];
        size[2] = half;
    } else
        size[1] = half;
}

static bool has_mass(kmp_mjcf *m, const kmp_mjcf_item *item)
{
    double group = kmp_mjcf_number(m, item, "group", 0);
    double matter = kmp_mjcf_number(m, item, kmp_mjcf_text(item, "mass") ? "mass" : "density", 1000);
    return group >= m->groups[0] && group <= m->groups[1] && matter != 0;
}

/* The element of `asset` with a word and a name, which a mesh may have from its file; NULL: none. */
static const kmp_element *asset_of(kmp_mjcf *m, const char *word, const char *name)
{
    const kmp_element *asset = name ? kmp_element_find(m->im->model, "asset") : NULL;
    for (; asset; asset = kmp_element_again(asset))
        for (const kmp_element *e = kmp_element_find(asset, word); e; e = kmp_element_again(e)) {
            const char *own = kmp_element_text(e, "name"), *file = kmp_element_text(e, "file");
            const char *last = file ? kmp_path_name(file) : NULL;
            size_t length = strlen(name);
            if (own ? strcmp(own, name) == 0 : last && strncmp(last, name, length) == 0 && last[length] == '.')
                return e;
        }
    return NULL;
}

/* The colour of a geom or of its material; NULL: none. */
static const char *colour_of(kmp_mjcf *m, const kmp_mjcf_item *item)
{
    double rgba[4] = {0.5, 0.5, 0.5, 1};
    const kmp_element *e = asset_of(m, "material", kmp_mjcf_text(item, "material"));
    const kmp_mjcf_item material = e ? kmp_mjcf_take(m, e, "material", NULL) : (kmp_mjcf_item){.own = NULL};
    bool given = kmp_mjcf_numbers(m, item, "rgba", 4, 4, rgba) > 0;
    if (!given && e)
        given = kmp_mjcf_numbers(m, &material, "rgba", 4, 4, rgba) > 0;
    return given ? kmp_import_colour(m->im, rgba) : NULL;
}

/* -- meshes -------------------------------------------------------------------------------------------- */

/* A mesh of the assets: its places v are S R' (v - p), of the scale S and of R and p in `reference`. */
typedef struct asset {
    const char *path;
    double scale[3];
    kmp_pose reference;
    const char *inertia;
} asset;

/* False: it has no file. */
static bool find_asset(kmp_mjcf *m, const kmp_mjcf_item *item, asset *a)
{
    const kmp_element *e = asset_of(m, "mesh", kmp_mjcf_text(item, "mesh"));
    const char *file = e ? kmp_element_text(e, "file") : NULL;
    if (!file)
        return false;
    const kmp_mjcf_item mesh = kmp_mjcf_take(m, e, "mesh", NULL);
    double turn[4] = {1, 0, 0, 0};
    *a = (asset){.scale = {1, 1, 1}, .reference = kmp_frame_none(), .inertia = kmp_mjcf_text(&mesh, "inertia")};
    kmp_mjcf_numbers(m, &mesh, "scale", 3, 3, a->scale);
    kmp_mjcf_numbers(m, &mesh, "refpos", 3, 3, a->reference.p);
    if (kmp_mjcf_numbers(m, &mesh, "refquat", 4, 4, turn) > 0 && !kmp_frame_turn(turn, a->reference.r))
        kmp_import_complain(m->im, e->place, "refquat", kmp_mjcf_text(&mesh, "refquat"), "has no length");
    a->path = m->meshes && !kmp_path_is_whole(file) ? kmp_arena_printf(m->im->arena, "%s/%s", m->meshes, file) : file;
    return a->path;
}

/* Reads the mesh at its places; false: `why` has the reason. */
static bool weigh_asset(kmp_mjcf *m, const asset *a, kmp_mesh_volume *volume, kmp_text *why)
{
    static const char *const kinds[] = {
        [KMP_MESH_SOLID] = "exact", [KMP_MESH_SURFACE] = "shell", [KMP_MESH_PYRAMIDS] = "legacy"};
    const kmp_pose back = kmp_frame_inverse(&a->reference);
    kmp_mesh mesh;
    int kind = KMP_MESH_SOLID;
    while (a->inertia && kind <= KMP_MESH_PYRAMIDS && strcmp(kinds[kind], a->inertia) != 0)
        kind++;
    kind = a->inertia ? kind : KMP_MESH_PYRAMIDS;
    if (kind > KMP_MESH_PYRAMIDS)
        kmp_text_printf(why, "its inertia '%s' is not computed; available: exact, legacy, shell", a->inertia);
    if (why->length > 0 || !kmp_import_read_mesh(m->im, a->path, &mesh, why))
        return false;
    for (int v = 0; v < mesh.vertex_count; v++) {
        double place[3];
        kmp_frame_vector(&back, mesh.vertex[v], place);
        for (int k = 0; k < 3; k++)
            mesh.vertex[v][k] = a->scale[k] * (place[k] + back.p[k]);
    }
    return kmp_mesh_weigh(&mesh, (kmp_mesh_matter)kind, volume, why);
}

/* -- masses -------------------------------------------------------------------------------------------- */

/* The geoms that give a body its mass, if a mesh is among them. */
typedef struct weights {
    kmp_shape *shape; /* NULL: the shapes in the document do */
    int count;
} weights;

static kmp_shape *add_weight(kmp_mjcf *m, const kmp_mjcf_item *item, weights *w, int solid, const kmp_pose *at,
                             const double size[3])
{
    bool massive = kmp_mjcf_text(item, "mass");
    kmp_shape *s = &w->shape[w->count++];
    *s = kmp_import_heavy((kmp_import_solid)solid, size, at,
                          kmp_mjcf_number(m, item, massive ? "mass" : "density", 1000), !massive);
    return s;
}

static void weigh_mesh(kmp_mjcf *m, const kmp_mjcf_body *body, const kmp_mjcf_item *item, weights *w, const asset *a,
                       const kmp_pose *at)
{
    static const double none[3] = {0};
    kmp_mesh_volume volume;
    kmp_text why = {0};
    if (!a)
        kmp_text_put(&why, "it has no file");
    if (a && weigh_asset(m, a, &volume, &why))
        add_weight(m, item, w, KMP_SOLID_MESH, at, none)->enclosed = volume;
    else if (why.length > 0)
        kmp_import_complain(
            m->im, item->own->place, "the body", body->own,
            kmp_arena_printf(m->im->arena, "has its mass from a mesh, and %s: give it an element 'inertial'", why.s));
    m->im->arena->failed = m->im->arena->failed || why.failed;
    kmp_text_free(&why);
}

/* -- geoms --------------------------------------------------------------------------------------------- */

static bool is_mesh(const kmp_mjcf_item *item)
{
    const char *type = kmp_mjcf_text(item, "type");
    return type && strcmp(type, "mesh") == 0;
}

/* True if the geom gives its body a mass; what cannot is named. */
static bool gives_mass(kmp_mjcf *m, const kmp_mjcf_body *body, const kmp_mjcf_item *item, int kind)
{
    kmp_import *im = m->im;
    if (geoms[kind].solid == -1 || !has_mass(m, item))
        return false;
    bool shell = kmp_mjcf_flag(m, item, "shellinertia", false), mesh = is_mesh(item);
    bool fitted = !mesh && (geoms[kind].solid == -2 || kmp_mjcf_text(item, "mesh"));
    const char *what = shell ? "shell" : "mesh";
    if (body->fixed && (shell || mesh || fitted))
        kmp_import_leave_out(im, item->own->place, KMP_PART_REMARK, "geom",
                             "the mass of a %s of body '%s' is not used: the body is fixed", what, body->own);
    else if (shell || fitted)
        kmp_import_complain(im, item->own->place, "the body", body->own,
                            kmp_arena_printf(im->arena, "has its mass from a %s: give it an element 'inertial'",
                                             shell ? what : "solid that is fitted to a mesh"));
    else
        return true;
    return false;
}

/* The row of `geoms`; GEOMS after a complaint. */
static int kind_of(kmp_mjcf *m, const kmp_mjcf_item *item)
{
    const char *type = kmp_mjcf_text(item, "type");
    int k = 0;
    while (type && k < GEOMS && strcmp(geoms[k].type, type) != 0)
        k++;
    if (k == GEOMS)
        kmp_import_complain(
            m->im, item->own->place, "geom type", type,
            "is unknown; available: plane, hfield, sphere, capsule, ellipsoid, cylinder, box, mesh, sdf");
    return k;
}

/* A mesh whose reference is turned can be drawn if it has one scale. */
static void draw_mesh(kmp_mjcf *m, const kmp_mjcf_body *body, const kmp_mjcf_item *item, const asset *a,
                      const kmp_pose *at)
{
    kmp_pose back = kmp_frame_inverse(&a->reference);
    for (int k = 0; k < 3; k++)
        back.p[k] *= a->scale[k];
    const kmp_pose whole = kmp_frame_in(at, &back);
    kmp_import_mesh(m->im, body->map, item->own->place, a->path, a->scale, &whole, colour_of(m, item));
}

static void add_solid(kmp_mjcf *m, const kmp_mjcf_body *body, const part *p, const kmp_mjcf_item *item, int k,
                      bool heavy, weights *w)
{
    kmp_import *im = m->im;
    double size[3] = {0};
    kmp_pose f = kmp_mjcf_pose(m, item);
    int sizes = kmp_mjcf_numbers(m, item, "size", 1, 3, size);
    if (kmp_mjcf_text(item, "fromto"))
        put_between(m, item, geoms[k].solid, &f, size);
    else if (sizes < geoms[k].sizes)
        kmp_import_complain(im, p->element->place, "geom type", geoms[k].type, "needs more numbers in its size");
    f = kmp_frame_in(&p->frame, &f);
    bool three = geoms[k].sizes == 3;
    for (int i = 0; i < 3; i++)
        size[i] *= geoms[k].solid == KMP_SOLID_BOX || (!three && i == 1) ? 2 : 1;
    kmp_yaml *shape = kmp_import_shape(im, body->map, p->element->place, (kmp_import_solid)geoms[k].solid, size, &f,
                                       colour_of(m, item));
    const char *key = kmp_mjcf_text(item, "mass") ? "mass" : "density";
    const double matter = heavy && !w->shape ? kmp_mjcf_number(m, item, key, 1000) : 0;
    if (heavy && w->shape)
        (void)add_weight(m, item, w, geoms[k].solid, &f, size);
    else if (matter != 0)
        kmp_import_value(im, shape, item->own->place, key, matter);
}

/* A geom that a tendon may name. */
static void keep_geom(kmp_mjcf *m, const kmp_mjcf_body *body, const part *p, const kmp_mjcf_item *item, int kind)
{
    const char *name = kmp_element_text(p->element, "name");
    kmp_mjcf_geom *g = name ? KMP_ARENA_NEW(m->im->arena, kmp_mjcf_geom, 1) : NULL;
    double size[3] = {0};
    if (!g)
        return;
    const bool solid = !kmp_mjcf_text(item, "mesh");
    *g = (kmp_mjcf_geom){.name = name,
                         .body = body->own,
                         .ball = solid && geoms[kind].solid == KMP_SOLID_SPHERE,
                         .cylinder = solid && geoms[kind].solid == KMP_SOLID_CYLINDER,
                         .next = m->geoms};
    kmp_pose f = kmp_mjcf_pose(m, item);
    kmp_mjcf_numbers(m, item, "size", 1, 3, size);
    if (g->cylinder)
        put_between(m, item, geoms[kind].solid, &f, size);
    g->radius = size[0];
    g->frame = kmp_frame_in(&p->frame, &f);
    g->world = kmp_frame_in(&body->world, &g->frame);
    m->geoms = g;
}

static void add_geom(kmp_mjcf *m, const kmp_mjcf_body *body, bool heavy, const part *p, weights *w)
{
    const kmp_mjcf_item item = kmp_mjcf_take(m, p->element, "geom", p->around);
    int k = kind_of(m, &item);
    if (k == GEOMS)
        return;
    keep_geom(m, body, p, &item, k);
    heavy = heavy && gives_mass(m, body, &item, k);
    bool drawn = kmp_mjcf_number(m, &item, "group", 0) < GROUPS_DRAWN;
    if (is_mesh(&item)) {
        asset a;
        const kmp_pose own = kmp_mjcf_pose(m, &item), f = kmp_frame_in(&p->frame, &own);
        bool known = find_asset(m, &item, &a);
        if (drawn && known)
            draw_mesh(m, body, &item, &a, &f);
        if (heavy)
            weigh_mesh(m, body, &item, w, known ? &a : NULL, &f);
    } else if (geoms[k].solid >= 0 && !kmp_mjcf_text(&item, "mesh") && (drawn || heavy))
        add_solid(m, body, p, &item, k, heavy, w);
}

/* -- bodies -------------------------------------------------------------------------------------------- */

static void append(kmp_mjcf *m, part **list, const kmp_element *e, const kmp_pose *frame, const kmp_mjcf_class *around)
{
    part *p = KMP_ARENA_NEW(m->im->arena, part, 1);
    if (!p)
        return;
    *p = (part){.element = e, .frame = *frame, .around = around};
    if (*list)
        (*list)->last->next = p;
    else
        *list = p;
    (*list)->last = p;
}

static const kmp_mjcf_class *class_inside(kmp_mjcf *m, const kmp_element *e, const kmp_mjcf_class *around)
{
    const char *name = kmp_element_text(e, "childclass");
    return name ? kmp_mjcf_class_of(m, e, name) : around;
}

/* Collects the parts of a body or of a frame inside; `frame` in the body. */
static void collect(kmp_mjcf *m, const kmp_element *in, const kmp_pose *frame, const kmp_mjcf_class *around, parts *to)
{
    static const char *const refused[] = {"replicate", "attach", "composite", "flexcomp"};
    for (const kmp_element *e = in->first; e; e = e->next) {
        if (strcmp(e->name, "joint") == 0 || strcmp(e->name, "freejoint") == 0)
            append(m, &to->joints, e, frame, around);
        else if (strcmp(e->name, "geom") == 0)
            append(m, &to->geoms, e, frame, around);
        else if (strcmp(e->name, "site") == 0)
            append(m, &to->sites, e, frame, around);
        else if (strcmp(e->name, "body") == 0)
            append(m, &to->bodies, e, frame, around);
        else if (strcmp(e->name, "inertial") == 0)
            to->inertial = e;
        if (strcmp(e->name, "frame") == 0) {
            kmp_mjcf_item item = kmp_mjcf_plain(e);
            const kmp_pose own = kmp_mjcf_pose(m, &item), whole = kmp_frame_in(frame, &own);
            collect(m, e, &whole, class_inside(m, e, around), to);
        }
        for (size_t k = 0; k < sizeof refused / sizeof *refused; k++)
            if (strcmp(e->name, refused[k]) == 0)
                kmp_import_complain(m->im, e->place, "the element", e->name,
                                    "adds bodies and is not read: write them out (MuJoCo saves such a file)");
    }
}

/* `full`: xx yy zz xy xz yz */
static void put_mass(kmp_mjcf *m, const kmp_mjcf_body *body, const kmp_element *inertial)
{
    kmp_mjcf_item item = kmp_mjcf_plain(inertial);
    const kmp_pose centre = kmp_mjcf_pose(m, &item);
    double full[6] = {0};
    int count =
        kmp_mjcf_numbers(m, &item, "diaginertia", 3, 3, full) + kmp_mjcf_numbers(m, &item, "fullinertia", 6, 6, full);
    const double tensor[3][3] = {{full[0], full[3], full[4]}, {full[3], full[1], full[5]}, {full[4], full[5], full[2]}};
    if (kmp_import_attribute(m->im, inertial, "mass"))
        kmp_import_mass(m->im, body->map, inertial->place, kmp_mjcf_number(m, &item, "mass", 0), &centre,
                        count ? tensor : NULL);
}

/* `heavy`: they give the body its mass. */
static void add_geoms(kmp_mjcf *m, const kmp_mjcf_body *body, bool heavy, const part *list)
{
    weights w = {.count = 0};
    int count = 0;
    bool meshes = false;
    for (const part *p = list; p; p = p->next, count++) {
        const kmp_mjcf_item item = kmp_mjcf_take(m, p->element, "geom", p->around);
        meshes = meshes || (heavy && !body->fixed && is_mesh(&item) && has_mass(m, &item));
    }
    if (meshes)
        w.shape = KMP_ARENA_NEW(m->im->arena, kmp_shape, count);
    if (m->im->arena->failed)
        return;
    for (const part *p = list; p; p = p->next)
        add_geom(m, body, heavy, p, &w);
    if (w.count > 0) {
        double tensor[3][3];
        kmp_pose centre;
        double mass = kmp_import_weigh(m->im, w.count, w.shape, &centre, tensor);
        kmp_import_mass(m->im, body->map, list->element->place, mass, &centre, (const double(*)[3])tensor);
    }
}

static void add_site(kmp_mjcf *m, const kmp_mjcf_body *body, const part *p)
{
    const char *name = kmp_element_text(p->element, "name");
    kmp_mjcf_site *s = name ? KMP_ARENA_NEW(m->im->arena, kmp_mjcf_site, 1) : NULL;
    if (!s)
        return;
    kmp_mjcf_item item = kmp_mjcf_take(m, p->element, "site", p->around);
    double size[3];
    kmp_pose f = kmp_mjcf_pose(m, &item);
    if (kmp_mjcf_text(&item, "fromto"))
        put_between(m, &item, KMP_SOLID_CAPSULE, &f, size);
    f = kmp_frame_in(&p->frame, &f);
    const kmp_pose world = kmp_frame_in(&body->world, &f);
    *s = (kmp_mjcf_site){.name = name,
                         .point =
                             kmp_import_point(m->im, p->element->place, body->own, kmp_import_clean(m->im, name), &f),
                         .next = m->sites};
    memcpy(s->world, world.p, sizeof s->world);
    m->sites = s;
}

/* Geoms give the mass where there is no element `inertial`, or always. */
static void put_contents(kmp_mjcf *m, const kmp_mjcf_body *body, const parts *in)
{
    bool given = in->inertial && (m->inertia_from_geoms != KMP_MJCF_ALWAYS || !in->geoms);
    bool heavy = body != &m->world && !given && m->inertia_from_geoms != KMP_MJCF_NEVER;
    if (given)
        put_mass(m, body, in->inertial);
    add_geoms(m, body, heavy, in->geoms);
    for (const part *p = in->sites; p; p = p->next)
        add_site(m, body, p);
}

/* A body with its joints and contents; `in`: all its parts. NULL: there is none to carry others. */
static const kmp_mjcf_body *add_body(kmp_mjcf *m, const kmp_mjcf_body *parent, const part *p, parts *in)
{
    kmp_import *im = m->im;
    kmp_mjcf_body *body = KMP_ARENA_NEW(im->arena, kmp_mjcf_body, 1);
    kmp_mjcf_item item = kmp_mjcf_plain(p->element);
    const kmp_pose own = kmp_mjcf_pose(m, &item), at = kmp_frame_in(&p->frame, &own), none = kmp_frame_none();
    if (!body)
        return NULL;
    m->body_count++;
    body->name = kmp_element_text(p->element, "name");
    body->own = body->name ? kmp_import_clean(im, body->name)
                           : new_name(m, &m->body_names, kmp_arena_printf(im->arena, "body_%d", m->body_count));
    body->world = kmp_frame_in(&parent->world, &at);
    *(m->last_body ? &m->last_body->next : &m->bodies) = body;
    m->last_body = body;
    collect(m, p->element, &none, class_inside(m, p->element, p->around), in);
    body->fixed = parent->fixed && !in->joints;
    add_joints(m, parent, body, p->element, in->joints, at);
    if (!body->map || im->arena->failed)
        return NULL;
    put_contents(m, body, in);
    return body;
}

/* Bodies on one parent that wait for those inside of earlier ones. */
typedef struct waiting {
    const kmp_mjcf_body *parent;
    const part *next;
    struct waiting *below;
} waiting;

static waiting *wait_for(kmp_mjcf *m, const kmp_mjcf_body *parent, const parts *in, waiting *below)
{
    waiting *w = in->bodies ? KMP_ARENA_NEW(m->im->arena, waiting, 1) : NULL;
    if (!w)
        return below;
    *w = (waiting){parent, in->bodies, below};
    return w;
}

/* All bodies inside of one, each before the bodies that it carries. */
static void add_children(kmp_mjcf *m, const kmp_mjcf_body *body, const parts *in)
{
    for (waiting *w = wait_for(m, body, in, NULL); w;) {
        parts inside = {.joints = NULL};
        const part *p = w->next;
        waiting *rest = p->next ? w : w->below;
        w->next = p->next;
        const kmp_mjcf_body *made = add_body(m, w->parent, p, &inside);
        w = made ? wait_for(m, made, &inside, rest) : rest;
    }
}

void kmp_mjcf_add_bodies(kmp_mjcf *m)
{
    const kmp_element *first = kmp_element_find(m->im->model, "worldbody");
    const kmp_pose none = kmp_frame_none();
    m->world = (kmp_mjcf_body){.name = "world", .own = "ground", .world = none, .fixed = true};
    m->world.map = kmp_import_part(m->im, m->im->root, "ground", KMP_YAML_MAP);
    for (const kmp_element *e = first; e; e = kmp_element_again(e))
        take_names(m, e);
    for (const kmp_element *e = first; e; e = kmp_element_again(e)) {
        parts in = {.joints = NULL};
        collect(m, e, &none, NULL, &in);
        if (in.joints)
            kmp_import_complain(m->im, in.joints->element->place, "the joint",
                                kmp_element_text(in.joints->element, "name"), "is in the world, which does not move");
        put_contents(m, &m->world, &in);
        add_children(m, &m->world, &in);
    }
}
