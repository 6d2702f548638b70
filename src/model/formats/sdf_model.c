/* SPDX-License-Identifier: BSD-3-Clause */
/* Links of SDFormat with their masses and shapes, and the conversion of the file (docs/sdf.md). */
#include "model/formats/drake_tags.h"
#include "model/formats/sdf_parts.h"
#include <string.h>

/* -- links --------------------------------------------------------------------------------------------- */

/* Numbers that are absent have the defaults of SDFormat: 1 kg, and 1 kg m^2 about each axis. */
static void put_mass(kmp_import *im, kmp_yaml *body, const kmp_element *link)
{
    static const char *const keys[3][3] = {{"ixx", "ixy", "ixz"}, {"ixy", "iyy", "iyz"}, {"ixz", "iyz", "izz"}};
    const kmp_element *inertial = kmp_element_find(link, "inertial"), *inertia = kmp_element_find(inertial, "inertia");
    kmp_pose centre = kmp_sdf_pose(im, inertial);
    double tensor[3][3];
    if (kmp_sdf_yes(inertial, "auto"))
        kmp_import_complain(im, inertial->place, "the inertia of link", kmp_element_text(link, "name"),
                            "is not computed from its collisions: write mass and inertia instead of 'auto'");
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++)
            tensor[i][j] = kmp_import_read_number(im, inertia, keys[i][j], i == j);
    kmp_import_mass(im, body, (inertial ? inertial : link)->place, kmp_import_read_number(im, inertial, "mass", 1),
                    &centre, (const double(*)[3])tensor);
}

/* A link without gravity has a force against its weight. */
static void lift(kmp_import *im, const kmp_sdf_frame *link, const double gravity[3])
{
    const kmp_element *e = link->element, *inertial = kmp_element_find(e, "inertial");
    double mass = kmp_import_read_number(im, inertial, "mass", 1);
    const double force[3] = {0 - mass * gravity[0], 0 - mass * gravity[1], 0 - mass * gravity[2]};
    if (!kmp_element_text(e, "gravity") || kmp_sdf_yes(e, "gravity") || mass == 0)
        return;
    kmp_pose centre = kmp_sdf_pose(im, inertial);
    memcpy(centre.r, kmp_frame_none().r, sizeof centre.r);
    kmp_yaml *map = kmp_import_map(im, e->place);
    kmp_import_word(im, map, e->place, "at", kmp_import_point(im, e->place, link->name, "mass_centre", &centre));
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
    static const char *const words[] = {"box", "sphere", "cylinder", "capsule", "ellipsoid"};
    enum { WORDS = sizeof words / sizeof *words };
    kmp_import *im = s->im;
    const kmp_element *geometry = kmp_element_find(visual, "geometry"), *mesh = kmp_element_find(geometry, "mesh"),
                      *e = NULL;
    const char *relative = kmp_sdf_relative(visual, link->version);
    kmp_pose at = kmp_sdf_pose(im, visual);
    double size[3] = {1, 1, 1};
    int solid = 0;
    for (; solid < WORDS && !(e = kmp_element_find(geometry, words[solid]));)
        solid++;
    if (!e && !mesh)
        return;
    if (relative) {
        int frame = kmp_sdf_frame_named(s, link->model, relative, visual);
        kmp_pose outer = frame == KMP_SDF_NONE ? kmp_frame_none() : kmp_sdf_between(s, (int)(link - s->frames), frame);
        at = kmp_frame_in(&outer, &at);
    }
    if (!e) {
        double scale[3] = {1, 1, 1};
        const char *uri = kmp_import_attribute(im, mesh, "uri");
        kmp_import_read_numbers(im, mesh, "scale", 3, 3, scale);
        if (uri)
            kmp_import_mesh(im, body, mesh->place, uri, scale, &at, colour_of(im, visual));
        return;
    }
    if (solid == KMP_SOLID_BOX)
        kmp_import_read_numbers(im, e, "size", 3, 3, size);
    else if (solid == KMP_SOLID_ELLIPSOID)
        kmp_import_read_numbers(im, e, "radii", 3, 3, size);
    else {
        size[0] = kmp_import_read_number(im, e, "radius", solid == KMP_SOLID_CAPSULE ? 0.5 : 1);
        size[1] = kmp_import_read_number(im, e, "length", 1);
    }
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
        put_mass(im, body, f->element);
        for (const kmp_element *v = kmp_element_find(f->element, "visual"); v; v = kmp_element_again(v))
            add_shape(&s, f, body, v);
    }
    for (int k = 0; k < s.count && im->status == KEMPE_OK; k++) {
        if (s.frames[k].kind == KMP_SDF_FRAME)
            kmp_sdf_point(&s, s.frames[k].element, k, s.frames[k].name);
        if (s.frames[k].kind == KMP_SDF_LINK)
            lift(im, &s.frames[k], gravity);
    }
    if (im->status == KEMPE_OK)
        add_drake(&s);
    if (im->status == KEMPE_OK)
        kmp_sdf_add_joints(&s);
}
