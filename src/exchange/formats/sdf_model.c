/* SPDX-License-Identifier: BSD-3-Clause */
/* Links of SDFormat with their masses and shapes, and the conversion of the file (docs/sdf.md). */
#include "exchange/formats/sdf_model.h"
#include "exchange/formats/drake_tags.h"
#include "exchange/formats/foreign_frames.h"
#include "exchange/formats/foreign_meshes.h"
#include "exchange/formats/importing.h"
#include "exchange/formats/sdf_frames.h"
#include "exchange/formats/sdf_joints.h"
#include "exchange/formats/sdf_parts.h"
#include "model/data/shape.h"
#include <string.h>

/* -- links --------------------------------------------------------------------------------------------- */

enum { SOLIDS = 5, MESH = SOLIDS, NO_SOLID };

/* The geometry of a visual or a collision: its kind, its element, its place in the link, its size. */
static int read_geometry(kmp_sdf *s, const kmp_sdf_frame *link, const kmp_element *of, const kmp_element **found,
                         kmp_pose *at, double size[3])
{
    static const char *const words[] = {"box", "sphere", "cylinder", "capsule", "ellipsoid", "mesh"};
    kmp_import *im = s->im;
    const kmp_element *geometry = kmp_element_find(of, "geometry"), *e = NULL;
    const char *relative = kmp_sdf_relative(of, link->version);
    int solid = 0;
    *at = kmp_sdf_pose(im, of);
    size[0] = size[1] = size[2] = 1;
    while (solid < NO_SOLID && !(e = kmp_element_find(geometry, words[solid])))
        solid++;
    *found = e;
    if (!e)
        return NO_SOLID;
    if (relative) {
        int frame = kmp_sdf_frame_named(s, link->model, relative, of);
        kmp_pose outer = frame == KMP_SDF_NONE ? kmp_frame_none() : kmp_sdf_between(s, (int)(link - s->frames), frame);
        *at = kmp_frame_in(&outer, at);
    }
    if (solid == MESH)
        kmp_import_read_numbers(im, e, "scale", 3, 3, size);
    else if (solid == KMP_SOLID_BOX)
        kmp_import_read_numbers(im, e, "size", 3, 3, size);
    else if (solid == KMP_SOLID_ELLIPSOID)
        kmp_import_read_numbers(im, e, "radii", 3, 3, size);
    else {
        size[0] = kmp_import_read_number(im, e, "radius", solid == KMP_SOLID_CAPSULE ? 0.5 : 1);
        size[1] = kmp_import_read_number(im, e, "length", 1);
    }
    return solid;
}

/* The solid of a collision whose density gives its link a part of its mass. */
static kmp_shape weigh(int solid, const double size[3], const kmp_pose *at, double density)
{
    static const kmp_shape_kind kinds[] = {[KMP_SOLID_BOX] = KMP_SHAPE_BOX,
                                           [KMP_SOLID_SPHERE] = KMP_SHAPE_SPHERE,
                                           [KMP_SOLID_CYLINDER] = KMP_SHAPE_CYLINDER,
                                           [KMP_SOLID_CAPSULE] = KMP_SHAPE_CAPSULE,
                                           [KMP_SOLID_ELLIPSOID] = KMP_SHAPE_ELLIPSOID};
    kmp_shape shape = {.kind = kinds[solid], .heavy = true, .by_density = true, .turned = kmp_frame_is_turned(at)};
    shape.matter.value = density;
    shape.scale.value = 1;
    shape.radius.value = size[0];
    shape.length.value = size[1];
    memcpy(shape.axes, at->r, sizeof shape.axes);
    for (int k = 0; k < 3; k++) {
        shape.edge[k].value = size[k];
        shape.at[k].value = at->p[k];
        shape.along[k].value = at->r[k][2];
    }
    return shape;
}

/* Mass, centre and inertia of a link. */
typedef struct weight {
    double mass, tensor[3][3];
    kmp_pose centre;
} weight;

/* By the collisions and their densities, of water where none is given: `inertial auto`. */
static void weigh_collisions(kmp_sdf *s, const kmp_sdf_frame *link, const kmp_element *inertial, weight *w)
{
    kmp_import *im = s->im;
    const kmp_element *first = kmp_element_find(link->element, "collision");
    int count = 0, most = 0;
    for (const kmp_element *c = first; c; c = kmp_element_again(c))
        most++;
    kmp_shape *shapes = KMP_ARENA_NEW(im->arena, kmp_shape, most);
    for (const kmp_element *c = shapes ? first : NULL, *e; c; c = kmp_element_again(c)) {
        double size[3],
            density = kmp_import_read_number(im, c, "density", kmp_import_read_number(im, inertial, "density", 1000));
        kmp_pose at;
        int solid = read_geometry(s, link, c, &e, &at, size);
        if (solid == MESH)
            kmp_import_complain(im, e->place, "the inertia of link", link->name,
                                "is not computed from a mesh: write mass and inertia instead of 'auto'");
        else if (solid < SOLIDS && density > 0)
            shapes[count++] = weigh(solid, size, &at, density);
    }
    kmp_mass_part sum = {.mass.value = 0};
    if (count == 0) {
        if (im->status == KEMPE_OK)
            kmp_import_complain(im, inertial->place, "the inertia of link", link->name,
                                "is to be computed from its collisions, and it has none with a volume");
        return;
    }
    kmp_shapes_mass(im->arena, count, shapes, &sum);
    const kmp_number *i = sum.inertia;
    const double tensor[3][3] = {{i[0].value, i[3].value, i[4].value},
                                 {i[3].value, i[1].value, i[5].value},
                                 {i[4].value, i[5].value, i[2].value}};
    w->mass = sum.mass.value;
    memcpy(w->tensor, tensor, sizeof tensor);
    w->centre = kmp_frame_none();
    for (int k = 0; k < 3; k++)
        w->centre.p[k] = sum.com[k].value;
}

/* Numbers that are absent have the defaults of SDFormat: 1 kg, and 1 kg m^2 about each axis. */
static weight weight_of(kmp_sdf *s, const kmp_sdf_frame *link)
{
    static const char *const keys[3][3] = {{"ixx", "ixy", "ixz"}, {"ixy", "iyy", "iyz"}, {"ixz", "iyz", "izz"}};
    kmp_import *im = s->im;
    const kmp_element *inertial = kmp_element_find(link->element, "inertial"),
                      *inertia = kmp_element_find(inertial, "inertia");
    weight w = {.mass = kmp_import_read_number(im, inertial, "mass", 1), .centre = kmp_sdf_pose(im, inertial)};
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++)
            w.tensor[i][j] = kmp_import_read_number(im, inertia, keys[i][j], i == j);
    if (kmp_sdf_yes(inertial, "auto"))
        weigh_collisions(s, link, inertial, &w);
    return w;
}

static void put_mass(kmp_sdf *s, kmp_yaml *body, const kmp_sdf_frame *link)
{
    const kmp_element *inertial = kmp_element_find(link->element, "inertial");
    const weight w = weight_of(s, link);
    kmp_import_mass(s->im, body, (inertial ? inertial : link->element)->place, w.mass, &w.centre, w.tensor);
}

/* A link without gravity has a force against its weight. */
static void lift(kmp_sdf *s, const kmp_sdf_frame *link, const double gravity[3])
{
    kmp_import *im = s->im;
    const kmp_element *e = link->element;
    if (!kmp_element_text(e, "gravity") || kmp_sdf_yes(e, "gravity"))
        return;
    weight w = weight_of(s, link);
    const double force[3] = {0 - w.mass * gravity[0], 0 - w.mass * gravity[1], 0 - w.mass * gravity[2]};
    if (w.mass == 0)
        return;
    memcpy(w.centre.r, kmp_frame_none().r, sizeof w.centre.r);
    kmp_yaml *map = kmp_import_map(im, e->place);
    kmp_import_word(im, map, e->place, "at", kmp_import_point(im, e->place, link->name, "mass_centre", &w.centre));
    kmp_import_put(im, map, e->place, "force", kmp_import_numbers(im, e->place, 3, force));
    kmp_import_add(im, "forces", e, kmp_arena_printf(im->arena, "%s_lift", link->name), map);
}

static const char *colour_of(kmp_import *im, const kmp_element *visual)
{
    const kmp_element *material = kmp_element_find(visual, "material");
    const char *key = kmp_element_text(material, "diffuse") ? "diffuse" : "ambient";
    double rgba[4] = {0};
    return kmp_import_read_numbers(im, material, key, 3, 4, rgba) ? kmp_import_colour(im, rgba) : NULL;
}

/* Planes are no pictures. */
static void add_shape(kmp_sdf *s, const kmp_sdf_frame *link, kmp_yaml *body, const kmp_element *visual)
{
    kmp_import *im = s->im;
    const kmp_element *e;
    kmp_pose at;
    double size[3];
    int solid = read_geometry(s, link, visual, &e, &at, size);
    const char *uri = solid == MESH ? kmp_import_attribute(im, e, "uri") : NULL;
    if (uri)
        kmp_import_mesh(im, body, e->place, uri, size, &at, colour_of(im, visual));
    if (solid < SOLIDS)
        kmp_import_shape(im, body, e->place, (kmp_import_solid)solid, size, &at, colour_of(im, visual));
}

/* -- constraints of Drake ------------------------------------------------------------------------------ */

typedef struct scope {
    kmp_sdf *s;
    int model;
} scope;

static const char *point_of(void *reader, const kmp_element *e, const char *name, const double at[3], const char *shown)
{
    const scope *in = reader;
    int frame = kmp_sdf_frame_named(in->s, in->model, name, e),
        link = frame == KMP_SDF_NONE ? frame : kmp_sdf_link_of(in->s, frame);
    if (link == KMP_SDF_NONE)
        return NULL;
    kmp_pose offset = kmp_frame_none(), outer = kmp_sdf_between(in->s, link, frame);
    memcpy(offset.p, at, sizeof offset.p);
    offset = kmp_frame_in(&outer, &offset);
    return kmp_import_point(in->s->im, e->place, link >= 0 ? in->s->frames[link].name : "ground", shown, &offset);
}

static void add_drake(kmp_sdf *s)
{
    for (int k = 0; k < s->count; k++) {
        const kmp_sdf_frame *f = &s->frames[k];
        bool bare = strlen(f->scoped) + 2 <= s->hidden;
        if (f->kind == KMP_SDF_MODEL)
            kmp_drake_add(s->im, f->element, bare ? "" : kmp_arena_printf(s->im->arena, "%s__", f->name), point_of,
                          &(scope){s, k});
    }
}

/* -- files --------------------------------------------------------------------------------------------- */

void kmp_sdf_convert(kmp_import *im)
{
    double gravity[3] = {0, 0, -9.8};
    kmp_sdf s = {.im = im};
    const kmp_element *world = kmp_sdf_world(im->model);
    const char *name = kmp_element_text(world != im->model ? world : kmp_element_find(world, "model"), "name");
    kmp_place place = world->place;
    if (world != im->model) { /* before 1.6 it is among the settings of the solver */
        kmp_import_read_numbers(im, kmp_element_find(world, "physics"), "gravity", 3, 3, gravity);
        kmp_import_read_numbers(im, world, "gravity", 3, 3, gravity);
    }
    if (name)
        kmp_import_word(im, im->root, place, "name", name);
    kmp_import_put(im, im->root, place, "gravity", kmp_import_numbers(im, place, 3, gravity));
    kmp_sdf_find_frames(&s);
    for (int k = 0; k < s.count && im->status == KEMPE_OK; k++) {
        const kmp_sdf_frame *f = &s.frames[k];
        kmp_yaml *body = f->kind == KMP_SDF_LINK ? kmp_import_add_body(im, f->element, f->name) : NULL;
        if (!body)
            continue;
        put_mass(&s, body, f);
        for (const kmp_element *v = kmp_element_find(f->element, "visual"); v; v = kmp_element_again(v))
            add_shape(&s, f, body, v);
    }
    for (int k = 0; k < s.count && im->status == KEMPE_OK; k++) {
        if (s.frames[k].kind == KMP_SDF_FRAME)
            kmp_sdf_point(&s, s.frames[k].element, k, s.frames[k].name);
        if (s.frames[k].kind == KMP_SDF_LINK)
            lift(&s, &s.frames[k], gravity);
    }
    if (im->status == KEMPE_OK)
        add_drake(&s);
    if (im->status == KEMPE_OK)
        kmp_sdf_add_joints(&s);
}
