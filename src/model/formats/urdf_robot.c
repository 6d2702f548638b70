/* SPDX-License-Identifier: BSD-3-Clause */
/* A robot in URDF, with the loops and couplings of URDF+ (docs/urdf.md): links are bodies, joints are joints, and what
 * a file says in numbers of a rotated frame is turned into body axes here. */
#include "model/formats/formats.h"
#include <math.h>
#include <string.h>

/* An element with the names that Kempe gives to it and to what it connects. */
typedef struct joint {
    const kmp_element *element;
    const char *name, *type, *parent, *child; /* cleaned, but for `type`; NULL after a complaint */
} joint;

typedef struct robot {
    kmp_import *im;
    int count;
    joint *joints;
} robot;

/* -- values -------------------------------------------------------------------------------------------- */

static const char *attribute(kmp_import *im, const kmp_element *e, const char *key)
{
    const char *text = kmp_element_text(e, key);
    if (!text)
        kmp_import_complain(im, e->place, "attribute", key, "is missing here");
    return text;
}

static const char *cleaned(kmp_import *im, const kmp_element *e, const char *key)
{
    const char *text = attribute(im, e, key);
    return text ? kmp_import_clean(im, text) : NULL;
}

/* The link that a child element names: <parent link="a"/>. */
static const char *link_of(kmp_import *im, const kmp_element *e, const char *key)
{
    const kmp_element *inside = kmp_element_find(e, key);
    if (!inside)
        kmp_import_complain(im, e->place, "element", key, "is missing here");
    return inside ? cleaned(im, inside, "link") : NULL;
}

/* Reads a number; returns the text behind it, NULL: it is none. */
static const char *read_number(const char *text, double *value)
{
    text += strspn(text, " \t\r\n");
    bool negative = *text == '-';
    text += *text == '-' || *text == '+';
    size_t length = kmp_text_to_number(text, value);
    *value = negative ? -*value : *value;
    return length > 0 && isfinite(*value) ? text + length : NULL;
}

/* Numbers in a text, which must be all of it. An attribute that is absent leaves them as they are. */
static void read_numbers(kmp_import *im, const kmp_element *e, const char *key, int count, double *values)
{
    const char *text = kmp_element_text(e, key), *at = text;
    double read[4];
    for (int k = 0; at && k < count; k++)
        at = read_number(at, &read[k]);
    if (text && (!at || at[strspn(at, " \t\r\n")]))
        kmp_import_complain(im, e->place, key, text,
                            count == 1   ? "is not one number"
                            : count == 3 ? "are not three numbers"
                                         : "are not four numbers");
    else if (text)
        memcpy(values, read, (size_t)count * sizeof *values);
}

static double number_of(kmp_import *im, const kmp_element *e, const char *key, double absent)
{
    read_numbers(im, e, key, 1, &absent);
    return absent;
}

/* -- frames -------------------------------------------------------------------------------------------- */

typedef struct frame {
    double at[3], r[3][3]; /* r: columns are its axes */
    bool turned;
} frame;

/* Entries of rotations by multiples of a right angle are exact. */
static double without_rounding(double x)
{
    return fabs(x) < 1e-15 ? 0 : fabs(fabs(x) - 1) < 1e-15 ? copysign(1, x) : x;
}

/* R = Rz(yaw) Ry(pitch) Rx(roll). */
static void rotate(const double rpy[3], double r[3][3])
{
    double c[3], s[3];
    for (int k = 0; k < 3; k++) {
        c[k] = without_rounding(cos(rpy[k]));
        s[k] = without_rounding(sin(rpy[k]));
    }
    const double of[3][3] = {{c[2] * c[1], c[2] * s[1] * s[0] - s[2] * c[0], c[2] * s[1] * c[0] + s[2] * s[0]},
                             {s[2] * c[1], s[2] * s[1] * s[0] + c[2] * c[0], s[2] * s[1] * c[0] - c[2] * s[0]},
                             {-s[1], c[1] * s[0], c[1] * c[0]}};
    memcpy(r, of, sizeof of);
}

/* The frame of the element `origin` inside; without one it is that of the link. */
static frame origin_of(kmp_import *im, const kmp_element *e)
{
    frame f = {.at = {0}};
    double rpy[3] = {0};
    const kmp_element *origin = kmp_element_find(e, "origin");
    if (origin) {
        read_numbers(im, origin, "xyz", 3, f.at);
        read_numbers(im, origin, "rpy", 3, rpy);
    }
    rotate(rpy, f.r);
    for (int i = 0; i < 3; i++)
        f.turned = f.turned || f.r[i][i] != 1;
    return f;
}

static kmp_yaml *axes_of(kmp_import *im, kmp_place place, const frame *f)
{
    kmp_yaml *axes = kmp_import_map(im, place);
    for (int k = 0; k < 2; k++) {
        const double column[3] = {f->r[0][k], f->r[1][k], f->r[2][k]};
        kmp_import_put(im, axes, place, k == 0 ? "x" : "y", kmp_import_numbers(im, place, 3, column));
    }
    return axes;
}

/* The mapping of a link, or of the ground. */
static kmp_yaml *body_of(kmp_import *im, const char *name)
{
    return (kmp_yaml *)kmp_yaml_get(kmp_yaml_get(im->root, "bodies"), name);
}

/* A point of a link at a frame; the name is one that the link does not have yet. Returns LINK.POINT. */
static const char *add_point(kmp_import *im, const kmp_element *from, const char *link, const char *name,
                             const frame *f)
{
    kmp_yaml *body = body_of(im, link);
    if (!body || !name)
        return NULL;
    kmp_yaml *points = kmp_import_part(im, body, "points", KMP_YAML_MAP);
    while (name && kmp_yaml_get(points, name))
        name = kmp_arena_printf(im->arena, "%s_", name);
    if (!name)
        return NULL;
    kmp_yaml *at = kmp_import_numbers(im, from->place, 3, f->at), *point = at;
    if (f->turned) {
        point = kmp_import_map(im, from->place);
        kmp_import_put(im, point, from->place, "at", at);
        kmp_import_put(im, point, from->place, "axes", axes_of(im, from->place, f));
    }
    kmp_import_put(im, points, from->place, name, point);
    return kmp_arena_printf(im->arena, "%s.%s", link, name);
}

/* The axis inside an element, x when absent. */
static kmp_yaml *axis_of(kmp_import *im, const kmp_element *e, const char *name)
{
    double axis[3] = {1, 0, 0};
    const kmp_element *inside = kmp_element_find(e, "axis");
    if (inside)
        read_numbers(im, inside, "xyz", 3, axis);
    double length = hypot(hypot(axis[0], axis[1]), axis[2]);
    if (!(length > 0))
        kmp_import_complain(im, inside ? inside->place : e->place, "the axis of", name,
                            "is zero: it needs a direction");
    return kmp_import_numbers(im, inside ? inside->place : e->place, 3, axis);
}

/* -- links --------------------------------------------------------------------------------------------- */

/* The tensor about the centre of mass, turned into the axes of the link. Published models have tensors that no
 * distribution of mass can have, which are accepted with a warning. */
static void put_inertia(kmp_import *im, kmp_yaml *body, const kmp_element *inertia, const frame *f)
{
    static const char *const keys[3][3] = {{"ixx", "ixy", "ixz"}, {"ixy", "iyy", "iyz"}, {"ixz", "iyz", "izz"}};
    static const char *const names[3][3] = {{"xx", "xy", "xz"}, {"", "yy", "yz"}, {"", "", "zz"}};
    double given[3][3], half[3][3], tensor[3][3];
    kmp_yaml *map = kmp_import_map(im, inertia->place);
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++)
            given[i][j] = number_of(im, inertia, keys[i][j], 0);
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++)
            half[i][j] = f->r[i][0] * given[0][j] + f->r[i][1] * given[1][j] + f->r[i][2] * given[2][j];
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++)
            tensor[i][j] = half[i][0] * f->r[j][0] + half[i][1] * f->r[j][1] + half[i][2] * f->r[j][2];
    for (int i = 0; i < 3; i++)
        for (int j = i; j < 3; j++)
            kmp_import_word(im, map, inertia->place, names[i][j],
                            kmp_import_number(im, f->turned ? tensor[i][j] : given[i][j]));
    kmp_import_word(im, map, inertia->place, "as_given", "yes");
    kmp_import_put(im, body, inertia->place, "inertia", map);
}

static void put_mass(kmp_import *im, kmp_yaml *body, const kmp_element *inertial)
{
    const kmp_element *mass = kmp_element_find(inertial, "mass"), *inertia = kmp_element_find(inertial, "inertia");
    frame f = origin_of(im, inertial);
    if (mass)
        kmp_import_word(im, body, mass->place, "mass", kmp_import_number(im, number_of(im, mass, "value", 0)));
    kmp_import_put(im, body, inertial->place, "com", kmp_import_numbers(im, inertial->place, 3, f.at));
    if (inertia)
        put_inertia(im, body, inertia, &f);
}

/* "#rrggbb" of a material, which may stand outside with its name; NULL: none. */
static const char *colour_of(kmp_import *im, const kmp_element *visual)
{
    const kmp_element *own = kmp_element_find(visual, "material"), *colour = kmp_element_find(own, "color");
    const char *name = kmp_element_text(own, "name");
    const kmp_element *m = kmp_element_find(im->model, "material");
    for (; name && !colour && m; m = kmp_element_again(m)) {
        const char *other = kmp_element_text(m, "name");
        colour = other && strcmp(other, name) == 0 ? kmp_element_find(m, "color") : NULL;
    }
    double rgba[4] = {0.5, 0.5, 0.5, 1};
    if (!colour)
        return NULL;
    read_numbers(im, colour, "rgba", 4, rgba);
    int rgb[3];
    for (int k = 0; k < 3; k++)
        rgb[k] = (int)lround(255 * fmin(1, fmax(0, rgba[k])));
    return kmp_arena_printf(im->arena, "#%02x%02x%02x", (unsigned)rgb[0], (unsigned)rgb[1], (unsigned)rgb[2]);
}

/* A picture without mass; NULL: a mesh, or nothing. Cylinders and capsules have the axis z of their frame. */
static kmp_yaml *shape_of(kmp_import *im, const kmp_element *visual)
{
    const kmp_element *geometry = kmp_element_find(visual, "geometry"), *e = geometry ? geometry->first : NULL;
    bool box = e && strcmp(e->name, "box") == 0, ball = e && strcmp(e->name, "sphere") == 0;
    bool round = e && (strcmp(e->name, "cylinder") == 0 || strcmp(e->name, "capsule") == 0);
    if (!box && !ball && !round)
        return NULL;
    kmp_yaml *map = kmp_import_map(im, e->place);
    frame f = origin_of(im, visual);
    double size[3] = {0};
    if (box) {
        read_numbers(im, e, "size", 3, size);
        kmp_import_put(im, map, e->place, "box", kmp_import_numbers(im, e->place, 3, size));
    } else {
        const char *radius = kmp_import_number(im, number_of(im, e, "radius", 0));
        const char *length = round ? kmp_import_number(im, number_of(im, e, "length", 0)) : radius;
        kmp_import_word(im, map, e->place, e->name, length);
        if (round)
            kmp_import_word(im, map, e->place, "radius", radius);
    }
    kmp_import_put(im, map, e->place, "at", kmp_import_numbers(im, e->place, 3, f.at));
    if (f.turned && box)
        kmp_import_put(im, map, e->place, "axes", axes_of(im, e->place, &f));
    const double axis[3] = {f.r[0][2], f.r[1][2], f.r[2][2]};
    if (f.turned && round)
        kmp_import_put(im, map, e->place, "axis", kmp_import_numbers(im, e->place, 3, axis));
    const char *colour = colour_of(im, visual);
    if (colour)
        kmp_import_word(im, map, e->place, "colour", colour);
    return map;
}

static void add_link(kmp_import *im, const kmp_element *link)
{
    const char *name = cleaned(im, link, "name");
    const kmp_element *inertial = kmp_element_find(link, "inertial");
    kmp_yaml *body = kmp_import_map(im, link->place), *shapes = kmp_yaml_new(im->arena, KMP_YAML_LIST, link->place);
    if (!name || !body || !shapes)
        return;
    static const double zero[3] = {0};
    kmp_import_put(im, kmp_import_part(im, body, "points", KMP_YAML_MAP), link->place, "origin",
                   kmp_import_numbers(im, link->place, 3, zero));
    if (inertial)
        put_mass(im, body, inertial);
    for (const kmp_element *v = kmp_element_find(link, "visual"); v; v = kmp_element_again(v))
        kmp_yaml_append(im->arena, shapes, NULL, shape_of(im, v));
    if (shapes->count > 0)
        kmp_import_put(im, body, link->place, "shape", shapes);
    kmp_import_add(im, "bodies", link, name, body);
}

/* -- joints -------------------------------------------------------------------------------------------- */

static const struct {
    const char *type, *joint, *closure; /* NULL: there is no such loop */
    bool has_axis, single;              /* with one coordinate */
} kinds[] = {{"revolute", "revolute", "revolute", true, true},
             {"continuous", "revolute", "revolute", true, true},
             {"prismatic", "prismatic", "prismatic", true, true},
             {"fixed", "weld", "weld", false, false},
             {"planar", "planar", "planar", true, false},
             {"spherical", "spherical", "ball", false, false},
             {"floating", "free", NULL, false, false}};

enum { KINDS = sizeof kinds / sizeof *kinds };

static int kind_of(const char *type)
{
    int k = 0;
    while (k < KINDS && strcmp(kinds[k].type, type) != 0)
        k++;
    return k;
}

static void read_joints(robot *r)
{
    kmp_import *im = r->im;
    const kmp_element *first = kmp_element_find(im->model, "joint");
    for (const kmp_element *e = first; e; e = kmp_element_again(e))
        r->count++;
    r->joints = KMP_ARENA_NEW(im->arena, joint, r->count);
    int k = 0;
    for (const kmp_element *e = r->joints ? first : NULL; e; e = kmp_element_again(e))
        r->joints[k++] = (joint){.element = e,
                                 .name = cleaned(im, e, "name"),
                                 .type = attribute(im, e, "type"),
                                 .parent = link_of(im, e, "parent"),
                                 .child = link_of(im, e, "child")};
}

static joint *joint_to(const robot *r, const char *link)
{
    for (int k = 0; k < r->count; k++)
        if (r->joints[k].child && strcmp(r->joints[k].child, link) == 0)
            return &r->joints[k];
    return NULL;
}

/* The joint of this name in the file, which is not cleaned yet. */
static joint *joint_named(const robot *r, const char *name)
{
    const char *clean = kmp_import_clean(r->im, name);
    for (int k = 0; clean && k < r->count; k++)
        if (r->joints[k].name && strcmp(r->joints[k].name, clean) == 0)
            return &r->joints[k];
    return NULL;
}

static bool is_single(const joint *j)
{
    int k = j->type ? kind_of(j->type) : KINDS;
    return k < KINDS && kinds[k].single;
}

static void attach(kmp_import *im, kmp_yaml *body, kmp_place place, const char *name, const char *at, const char *kind,
                   kmp_yaml *axis)
{
    kmp_yaml *map = kmp_import_map(im, place);
    kmp_import_word(im, map, place, "name", name);
    kmp_import_word(im, map, place, "at", at);
    if (axis)
        kmp_import_put(im, map, place, kind, axis);
    else
        kmp_import_word(im, map, place, kind, strcmp(kind, "weld") == 0 ? "yes" : "x");
    kmp_import_put(im, body, place, "joint", map);
}

/* Damping and dry friction of a joint with one coordinate. */
static void add_losses(kmp_import *im, const joint *j)
{
    const kmp_element *dynamics = kmp_element_find(j->element, "dynamics");
    double damping = number_of(im, dynamics, "damping", 0), friction = number_of(im, dynamics, "friction", 0);
    bool slides = strcmp(j->type, "prismatic") == 0;
    if ((damping != 0 || friction != 0) && !is_single(j)) {
        kmp_import_complain(im, dynamics->place, "the dynamics of", j->name,
                            "are those of a joint with several coordinates, for which URDF does not define them");
        return;
    }
    if (damping != 0) {
        kmp_yaml *map = kmp_import_map(im, dynamics->place), *spring = kmp_import_map(im, dynamics->place);
        kmp_import_word(im, map, dynamics->place, "joint", j->name);
        kmp_import_word(im, spring, dynamics->place, "stiffness", "0");
        kmp_import_word(im, spring, dynamics->place, "damping", kmp_import_number(im, damping));
        kmp_import_put(im, map, dynamics->place, "spring", spring);
        kmp_import_add(im, "forces", dynamics, kmp_arena_printf(im->arena, "%s_damping", j->name), map);
    }
    if (friction != 0) {
        kmp_yaml *map = kmp_import_map(im, dynamics->place), *law = kmp_import_map(im, dynamics->place);
        kmp_import_word(im, map, dynamics->place, "joint", j->name);
        kmp_import_word(im, law, dynamics->place, slides ? "force" : "torque", kmp_import_number(im, friction));
        kmp_import_put(im, map, dynamics->place, "friction", law);
        kmp_import_add(im, "forces", dynamics, kmp_arena_printf(im->arena, "%s_friction", j->name), map);
    }
}

/* q = multiplier q(other) + offset. */
static void add_mimic(const robot *r, const joint *j)
{
    kmp_import *im = r->im;
    const kmp_element *mimic = kmp_element_find(j->element, "mimic");
    const char *name = mimic ? attribute(im, mimic, "joint") : NULL;
    const joint *other = name ? joint_named(r, name) : NULL;
    if (!name)
        return;
    if (!other || !is_single(other) || !is_single(j)) {
        kmp_import_complain(im, mimic->place, "the joint", name,
                            other ? "and the one that mimics it need one coordinate each" : "does not exist");
        return;
    }
    kmp_yaml *map = kmp_import_map(im, mimic->place), *factors = kmp_import_map(im, mimic->place);
    kmp_import_word(im, factors, mimic->place, j->name, "1");
    kmp_import_word(im, factors, mimic->place, other->name,
                    kmp_import_number(im, -number_of(im, mimic, "multiplier", 1)));
    kmp_import_put(im, map, mimic->place, "coupler", factors);
    kmp_import_word(im, map, mimic->place, "equals", kmp_import_number(im, number_of(im, mimic, "offset", 0)));
    kmp_import_add(im, "loops", mimic, kmp_arena_printf(im->arena, "%s_mimic", j->name), map);
}

static void add_joint(const robot *r, const joint *j)
{
    kmp_import *im = r->im;
    if (!j->name || !j->type || !j->parent || !j->child)
        return;
    int k = kind_of(j->type);
    kmp_yaml *body = body_of(im, j->child);
    if (k == KINDS)
        kmp_import_complain(
            im, j->element->place, "joint type", j->type,
            "is unknown; available: revolute, continuous, prismatic, fixed, planar, floating, spherical");
    else if (!body)
        kmp_import_complain(im, j->element->place, "link", j->child, "does not exist");
    else if (!body_of(im, j->parent))
        kmp_import_complain(im, j->element->place, "link", j->parent, "does not exist");
    else if (joint_to(r, j->child) != j)
        kmp_import_complain(im, j->element->place, "link", j->child,
                            "has two joints to parents: URDF has trees alone; write one of them as a <loop> of URDF+");
    else {
        frame f = origin_of(im, j->element);
        const char *at = add_point(im, j->element, j->parent, j->name, &f),
                   *hold = kmp_element_text(j->element, "independent");
        attach(im, body, j->element->place, j->name, at, kinds[k].joint,
               kinds[k].has_axis ? axis_of(im, j->element, j->name) : NULL);
        add_losses(im, j);
        add_mimic(r, j);
        if (hold && strcmp(hold, "true") == 0 && kinds[k].single)
            kmp_yaml_append(
                im->arena,
                kmp_import_part(im, kmp_import_part(im, im->root, "start", KMP_YAML_MAP), "hold", KMP_YAML_LIST), NULL,
                kmp_yaml_word(im->arena, j->element->place, j->name));
    }
}

/* The links without a joint to a parent are fixed to the ground. */
static void add_roots(const robot *r)
{
    kmp_import *im = r->im;
    int roots = 0;
    for (const kmp_element *e = kmp_element_find(im->model, "link"); e; e = kmp_element_again(e)) {
        const char *name = cleaned(im, e, "name");
        kmp_yaml *body = name && !joint_to(r, name) ? body_of(im, name) : NULL;
        if (!body)
            continue;
        const char *own = joint_named(r, name) ? kmp_arena_printf(im->arena, "%s_base", name) : name;
        attach(im, body, e->place, own, "ground", "weld", NULL);
        if (++roots == 1)
            kmp_log(im->context, KEMPE_LOG_INFO, "%s: link '%s' has no parent: it is fixed to the ground", im->file,
                    name);
        else
            kmp_import_complain(im, e->place, "link", name, "is a second one without a joint to a parent");
    }
    if (roots == 0 && im->status == KEMPE_OK)
        kmp_import_complain(im, im->model->place, "robot", kmp_element_text(im->model, "name"),
                            "has no link without a joint to a parent, to begin with");
}

/* -- loops --------------------------------------------------------------------------------------------- */

static void add_loop(kmp_import *im, const kmp_element *loop)
{
    static const char *const ends[2] = {"predecessor", "successor"};
    const char *name = cleaned(im, loop, "name"), *type = attribute(im, loop, "type");
    int k = type ? kind_of(type) : KINDS;
    kmp_yaml *map = kmp_import_map(im, loop->place), *points = kmp_yaml_new(im->arena, KMP_YAML_LIST, loop->place);
    if (!name || !type || !map)
        return;
    if (k == KINDS || !kinds[k].closure) {
        kmp_import_complain(im, loop->place, "loop type", type,
                            "is unknown; available: revolute, continuous, prismatic, fixed, planar, spherical");
        return;
    }
    for (int end = 0; end < 2; end++) {
        const char *link = link_of(im, loop, ends[end]);
        if (link && !body_of(im, link))
            kmp_import_complain(im, loop->place, "link", link, "does not exist");
        if (!link || !body_of(im, link))
            return;
        const kmp_element *side = kmp_element_find(loop, ends[end]);
        frame f = origin_of(im, side);
        const char *point = add_point(im, side, link, name, &f);
        kmp_yaml_append(im->arena, points, NULL, kmp_yaml_word(im->arena, side->place, point ? point : ""));
    }
    kmp_import_put(im, map, loop->place, kinds[k].closure, points);
    if (kinds[k].has_axis)
        kmp_import_put(im, map, loop->place, "axis", axis_of(im, loop, name));
    kmp_import_add(im, "loops", loop, name, map);
}

/* The number of joints from a link to the root. */
static int depth_of(const robot *r, const char *link)
{
    int depth = 0;
    for (const joint *j = joint_to(r, link); j && j->parent && depth <= r->count; j = joint_to(r, j->parent))
        depth++;
    return depth;
}

/* ratio q of all joints from the common ancestor to the predecessor equals q of those to the successor, summed up. */
static void add_coupling(const robot *r, const kmp_element *coupling)
{
    kmp_import *im = r->im;
    const char *name = cleaned(im, coupling, "name"),
               *link[2] = {link_of(im, coupling, "predecessor"), link_of(im, coupling, "successor")};
    const kmp_element *ratio = kmp_element_find(coupling, "ratio");
    kmp_yaml *map = kmp_import_map(im, coupling->place), *factors = kmp_import_map(im, coupling->place);
    const double factor[2] = {number_of(im, ratio, "value", 1), -1};
    if (!name || !link[0] || !link[1] || !factors)
        return;
    for (int steps = 2 * r->count; strcmp(link[0], link[1]) != 0 && steps > 0; steps--) {
        int side = depth_of(r, link[0]) >= depth_of(r, link[1]) ? 0 : 1;
        const joint *j = joint_to(r, link[side]);
        if (!j || !j->name || !j->parent || !j->type)
            break;
        if (is_single(j))
            kmp_import_word(im, factors, coupling->place, j->name, kmp_import_number(im, factor[side]));
        else if (strcmp(j->type, "fixed") != 0)
            kmp_import_complain(im, coupling->place, "coupling", name, "passes a joint with several coordinates");
        link[side] = j->parent;
    }
    if (strcmp(link[0], link[1]) != 0)
        kmp_import_complain(im, coupling->place, "coupling", name, "has links without a common ancestor");
    kmp_import_put(im, map, coupling->place, "coupler", factors);
    kmp_import_word(im, map, coupling->place, "equals", "0");
    kmp_import_add(im, "loops", coupling, name, map);
}

/* -- models -------------------------------------------------------------------------------------------- */

static const kmp_grammar grammar[] = {
    {"robot", " name version xmlns:xacro link joint loop coupling material "},
    {"link", " name inertial visual "},
    {"inertial", " origin mass inertia "},
    {"mass", " value "},
    {"inertia", " ixx ixy ixz iyy iyz izz "},
    {"origin", " xyz rpy "},
    {"visual", " name origin geometry material "},
    {"geometry", " box cylinder sphere capsule "},
    {"box", " size "},
    {"cylinder", " radius length "},
    {"capsule", " radius length "},
    {"sphere", " radius "},
    {"material", " name color "},
    {"color", " rgba "},
    {"joint", " name type origin parent child axis dynamics mimic independent "},
    {"parent", " link "},
    {"child", " link "},
    {"axis", " xyz "},
    {"dynamics", " damping friction "},
    {"mimic", " joint multiplier offset "},
    {"loop", " name type predecessor successor axis "},
    {"coupling", " name type predecessor successor ratio "},
    {"predecessor", " link origin "},
    {"successor", " link origin "},
    {"ratio", " value "},
};

void kmp_urdf_convert(kmp_import *im)
{
    static const double gravity[3] = {0, 0, -9.81};
    robot r = {.im = im};
    const char *name = kmp_element_text(im->model, "name");
    if (name)
        kmp_import_word(im, im->root, im->model->place, "name", name);
    kmp_import_put(im, im->root, im->model->place, "gravity", kmp_import_numbers(im, im->model->place, 3, gravity));
    for (const kmp_element *e = kmp_element_find(im->model, "link"); e; e = kmp_element_again(e))
        add_link(im, e);
    read_joints(&r);
    for (int k = 0; r.joints && k < r.count; k++)
        add_joint(&r, &r.joints[k]);
    add_roots(&r);
    for (const kmp_element *e = kmp_element_find(im->model, "loop"); e; e = kmp_element_again(e))
        add_loop(im, e);
    for (const kmp_element *e = kmp_element_find(im->model, "coupling"); e; e = kmp_element_again(e))
        add_coupling(&r, e);
    kmp_import_note_unknown(im, grammar, sizeof grammar / sizeof *grammar, KEMPE_LOG_WARNING,
                            "parts that are not used");
}
