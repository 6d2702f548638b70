/* SPDX-License-Identifier: BSD-3-Clause */
/* A file in SDFormat (docs/sdf.md): links with their masses and shapes. Joints as a graph, whose tree the reader of the
 * document chooses; their springs, dampers and friction; what couples their coordinates; the attachment of models to
 * the world. */
#include "base/union_find.h"
#include "exchange/formats/drake_tags.h"
#include "exchange/formats/foreign_frames.h"
#include "exchange/formats/importing.h"
#include "exchange/formats/sdf_frames.h"
#include "model/data/shape.h"
#include <math.h>
#include <string.h>

/* -- links --------------------------------------------------------------------------------------------- */

enum { NO_SOLID = KMP_SOLID_MESH + 1 };

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
    if (solid == KMP_SOLID_MESH)
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
        if (solid == KMP_SOLID_MESH)
            kmp_import_complain(im, e->place, "the inertia of link", link->name,
                                "is not computed from a mesh: write mass and inertia instead of 'auto'");
        else if (solid < KMP_SOLID_MESH && density > 0)
            shapes[count++] = kmp_import_heavy((kmp_import_solid)solid, size, &at, density, true);
    }
    if (count == 0) {
        if (im->status == KEMPE_OK)
            kmp_import_complain(im, inertial->place, "the inertia of link", link->name,
                                "is to be computed from its collisions, and it has none with a volume");
        return;
    }
    w->mass = kmp_import_weigh(im, count, shapes, &w->centre, w->tensor);
}

/* Numbers that are absent have the defaults of SDFormat: 1 kg, and 1 kg m^2 about each axis. */
static weight weight_of(kmp_sdf *s, const kmp_sdf_frame *link)
{
    kmp_import *im = s->im;
    const kmp_element *inertial = kmp_element_find(link->element, "inertial"),
                      *inertia = kmp_element_find(inertial, "inertia");
    weight w = {.mass = kmp_import_read_number(im, inertial, "mass", 1), .centre = kmp_sdf_pose(im, inertial)};
    kmp_import_read_tensor(im, inertia, 1, w.tensor);
    if (kmp_element_says(inertial, "auto", true))
        weigh_collisions(s, link, inertial, &w);
    return w;
}

/* A link without gravity has a force against its weight. */
static void lift(kmp_sdf *s, const kmp_sdf_frame *link, const double gravity[3])
{
    kmp_import *im = s->im;
    const kmp_element *e = link->element;
    if (!kmp_element_text(e, "gravity") || kmp_element_says(e, "gravity", true))
        return;
    weight w = weight_of(s, link);
    const double force[3] = {0 - w.mass * gravity[0], 0 - w.mass * gravity[1], 0 - w.mass * gravity[2]};
    if (w.mass == 0)
        return;
    memcpy(w.centre.r, kmp_frame_none().r, sizeof w.centre.r);
    kmp_yaml *map = kmp_import_map(im, e->place);
    kmp_import_word(im, map, e->place, "at", kmp_import_point(im, e->place, link->name, "mass_centre", &w.centre));
    kmp_import_vector(im, map, e->place, "force", force);
    kmp_import_add(im, "forces", e, kmp_arena_printf(im->arena, "%s_lift", link->name), map);
}

static const char *colour_of(kmp_import *im, const kmp_element *visual)
{
    const kmp_element *material = kmp_element_find(visual, "material");
    const char *key = kmp_element_text(material, "diffuse") ? "diffuse" : "ambient";
    double rgba[4] = {0};
    return kmp_import_read_numbers(im, material, key, 3, 4, rgba) ? kmp_import_colour(im, rgba) : NULL;
}

/* Planes are not pictures. */
static void add_shape(kmp_sdf *s, const kmp_sdf_frame *link, kmp_yaml *body, const kmp_element *visual)
{
    kmp_import *im = s->im;
    const kmp_element *e;
    kmp_pose at;
    double size[3];
    int solid = read_geometry(s, link, visual, &e, &at, size);
    const char *uri = solid == KMP_SOLID_MESH ? kmp_import_attribute(im, e, "uri") : NULL;
    if (uri)
        kmp_import_mesh(im, body, e->place, uri, size, &at, colour_of(im, visual));
    if (solid < KMP_SOLID_MESH)
        kmp_import_shape(im, body, e->place, (kmp_import_solid)solid, size, &at, colour_of(im, visual));
}

#define UNLIMITED 1e16 /* rad or m */

typedef struct joint {
    const kmp_sdf_frame *frame;
    int kind;          /* of `kinds` */
    int link[2];       /* of its parent and its child; KMP_SDF_WORLD */
    double axis[2][3]; /* in its own frame */
    bool needed;       /* something depends on its coordinate */
    bool two;          /* with two axes that are not perpendicular: two hinges */
} joint;

typedef struct graph {
    kmp_sdf *s;
    int count;
    joint *joints;
    int *of;    /* the joint of a frame, -1 */
    int *group; /* of links, by their frames, and of the world, the last: connected by joints */
    int *held;  /* the same by joints whose coordinate is needed */
} graph;

static const struct {
    const char *type, *joint; /* NULL: it connects nothing */
    int axes;                 /* that it has in the file */
    bool slides;
    int coordinates;
} kinds[] = {{"revolute", "revolute", 1, false, 1},   {"continuous", "revolute", 1, false, 1},
             {"prismatic", "prismatic", 1, true, 1},  {"ball", "spherical", 0, false, 3},
             {"universal", "universal", 2, false, 2}, {"revolute2", "universal", 2, false, 2},
             {"screw", "screw", 1, false, 2},         {"fixed", "weld", 0, false, 0},
             {"planar", "planar", 0, true, 3},        {"gearbox", NULL, 2, false, 0}};

enum { KINDS = sizeof kinds / sizeof *kinds, PLANAR = 8, GEARBOX = 9, SCREW = 6, BALL = 3 };

static const char *axis_name(int k)
{
    return k == 0 ? "axis" : "axis2";
}

static bool is_drake(const joint *j)
{
    return strcmp(j->frame->element->name, "joint") != 0;
}

static const kmp_element *axis_element(const joint *j, int k)
{
    return kmp_element_find(j->frame->element, axis_name(k));
}

/* -- reading ------------------------------------------------------------------------------------------- */

/* An axis in the frame of the joint. Before 1.5 it is given in the frame of the model, before 1.7 where the file
 * requests it. */
static void read_axis(kmp_sdf *s, joint *j, int k)
{
    const kmp_element *e = axis_element(j, k), *xyz = kmp_element_find(e, "xyz");
    const char *in = kmp_element_text(xyz, "expressed_in");
    const kmp_sdf_frame *f = j->frame;
    int own = (int)(f - s->frames), frame = own;
    double *axis = j->axis[k];
    axis[0] = axis[1] = 0;
    axis[2] = 1;
    if (!e) {
        kmp_import_complain(s->im, f->element->place, "element", axis_name(k), "is missing here");
        return;
    }
    kmp_import_read_numbers(s->im, e, "xyz", 3, 3, axis);
    if (f->version < 105 || (f->version < 107 && kmp_element_says(e, "use_parent_model_frame", true)))
        frame = f->model;
    else if (in)
        frame = kmp_sdf_frame_named(s, f->model, in, xyz);
    if (f->version >= 107 && kmp_element_says(e, "use_parent_model_frame", true))
        kmp_import_leave_out(s->im, e->place, KMP_PART_AT_TIMES, "use_parent_model_frame",
                             "'use_parent_model_frame' of joint '%s' is not used since version 1.7: write <xyz "
                             "expressed_in=\"__model__\">",
                             f->name);
    if (frame == KMP_SDF_NONE)
        return;
    kmp_pose turned = kmp_sdf_between(s, own, frame);
    kmp_frame_vector(&turned, axis, axis);
    double length = hypot(hypot(axis[0], axis[1]), axis[2]);
    if (!(length > 0))
        kmp_import_complain(s->im, e->place, "the axis of", f->name, "is zero: it needs a direction");
}

static double along(const double a[3], const double b[3])
{
    double length = hypot(hypot(a[0], a[1]), a[2]) * hypot(hypot(b[0], b[1]), b[2]);
    return length > 0 ? (a[0] * b[0] + a[1] * b[1] + a[2] * b[2]) / length : 0;
}

static void read_joint(kmp_sdf *s, joint *j)
{
    kmp_import *im = s->im;
    const kmp_element *e = j->frame->element;
    const char *type = kmp_import_attribute(im, e, "type");
    for (j->kind = 0; type && j->kind < KINDS && strcmp(kinds[j->kind].type, type) != 0;)
        j->kind++;
    if (!type || j->kind == KINDS || is_drake(j) != (j->kind == PLANAR)) {
        kmp_import_complain(im, e->place, "joint type", type,
                            is_drake(j) ? "is unknown; available: planar"
                                        : "is unknown; available: revolute, continuous, prismatic, ball, universal, "
                                          "revolute2, screw, fixed, gearbox");
        return;
    }
    for (int end = 0; end < 2; end++)
        j->link[end] = kmp_sdf_link_of(s, j->frame->end[end]);
    for (int k = 0; k < kinds[j->kind].axes; k++)
        read_axis(s, j, k);
    j->two = kinds[j->kind].axes == 2 && j->kind != GEARBOX && fabs(along(j->axis[0], j->axis[1])) > 1e-12;
    j->needed = j->kind == SCREW;
}

/* -- forces and couplers ------------------------------------------------------------------------------- */

/* The coordinate of an axis of a joint: JOINT, or JOINT.1 and JOINT.2; names of two hinges are JOINT_1 and JOINT_2. */
static const char *coordinate_of(kmp_sdf *s, joint *j, int k)
{
    j->needed = true;
    return j->two                           ? kmp_arena_printf(s->im->arena, "%s_%d", j->frame->name, k + 1)
           : kinds[j->kind].coordinates > 1 ? kmp_arena_printf(s->im->arena, "%s.%d", j->frame->name, k + 1)
                                            : j->frame->name;
}

/* The turn of a screw is its second motion. */
static int motion_of(const joint *j, int k)
{
    return j->kind == SCREW ? 1 : k;
}

static void add_dynamics(kmp_sdf *s, joint *j, int k)
{
    kmp_import *im = s->im;
    const kmp_element *dynamics = kmp_element_find(axis_element(j, k), "dynamics");
    double damping = kmp_import_read_number(im, dynamics, "damping", 0),
           friction = kmp_import_read_number(im, dynamics, "friction", 0),
           stiffness = kmp_import_read_number(im, dynamics, "spring_stiffness", 0),
           rest = kmp_import_read_number(im, dynamics, "spring_reference", 0);
    if (damping == 0 && friction == 0 && stiffness == 0)
        return;
    if (kinds[j->kind].axes <= k) {
        kmp_import_leave_out(im, dynamics->place, KMP_PART_AT_TIMES, "dynamics",
                             "the dynamics of joint '%s' are not used: it has no such axis", j->frame->name);
        return;
    }
    const char *coordinate = coordinate_of(s, j, motion_of(j, k));
    kmp_import_spring(im, dynamics, coordinate, stiffness != 0 ? "spring" : "damping", stiffness, rest, damping);
    kmp_import_friction(im, dynamics, coordinate, kinds[j->kind].slides, friction);
}

/* The limits of SDFormat are infinite unless they are given; some programs write 1e16 for that. */
static void add_limits(kmp_sdf *s, joint *j, int k)
{
    const kmp_element *limit = kmp_element_find(axis_element(j, k), "limit");
    double bound[2] = {-INFINITY, INFINITY};
    if (!limit || k >= kinds[j->kind].coordinates)
        return;
    for (int side = 0; side < 2; side++) {
        const char *key = side == 0 ? "lower" : "upper", *text = kmp_element_text(limit, key);
        if (text && !strstr(text, "inf"))
            kmp_import_read_numbers(s->im, limit, key, 1, 1, &bound[side]);
        if (fabs(bound[side]) >= UNLIMITED)
            bound[side] = side == 0 ? -INFINITY : INFINITY;
    }
    bool needed = j->needed || kmp_context_has_limits(s->im->context); /* then it is not cut */
    kmp_import_limits(s->im, limit, coordinate_of(s, j, motion_of(j, k)), NULL, bound[0], bound[1]);
    j->needed = needed;
}

static void add_planar_damping(kmp_sdf *s, joint *j)
{
    double damping[3] = {0};
    kmp_import_read_numbers(s->im, j->frame->element, "drake:damping", 3, 3, damping);
    for (int k = 0; k < 3; k++)
        if (damping[k] != 0)
            kmp_import_spring(s->im, j->frame->element, coordinate_of(s, j, k), "damping", 0, 0, damping[k]);
}

static void add_start(kmp_sdf *s, joint *j)
{
    const kmp_element *e = axis_element(j, 0);
    kmp_import *im = s->im;
    if (!kmp_element_text(e, "initial_position") || kinds[j->kind].coordinates != 1)
        return;
    kmp_yaml *start = kmp_import_part(im, im->root, "start", KMP_YAML_MAP);
    kmp_import_value(im, kmp_import_part(im, start, "q", KMP_YAML_MAP), e->place, j->frame->name,
                     kmp_import_read_number(im, e, "initial_position", 0));
}

/* q = multiplier (q(leader) - reference) + offset */
static void add_mimic(graph *g, joint *j, int k)
{
    kmp_sdf *s = g->s;
    kmp_import *im = s->im;
    const kmp_element *own = k == 0 ? kmp_element_find(j->frame->element, "drake:mimic") : NULL,
                      *mimic = own ? own : kmp_element_find(axis_element(j, k), "mimic");
    int frame = mimic ? kmp_sdf_frame_of(s, j->frame->model, mimic, "joint") : KMP_SDF_NONE;
    joint *leader = frame >= 0 && g->of[frame] >= 0 ? &g->joints[g->of[frame]] : NULL;
    const char *word = kmp_element_text(mimic, "axis");
    int axis = word && strcmp(word, axis_name(1)) == 0;
    if (!mimic || frame == KMP_SDF_NONE)
        return;
    if (!leader || kinds[leader->kind].axes <= axis || kinds[j->kind].axes <= k || leader->kind == GEARBOX) {
        kmp_import_complain(im, mimic->place, "the joint", kmp_element_text(mimic, "joint"),
                            "and the joint that mimics it need these axes each");
        return;
    }
    double multiplier = kmp_import_read_number(im, mimic, "multiplier", 1);
    const char *const joints[2] = {coordinate_of(s, j, motion_of(j, k)),
                                   coordinate_of(s, leader, motion_of(leader, axis))};
    const double factors[2] = {1, -multiplier};
    kmp_import_coupler(im, mimic, kmp_arena_printf(im->arena, k ? "%s_mimic2" : "%s_mimic", j->frame->name), 2, joints,
                       factors,
                       kmp_import_read_number(im, mimic, "offset", 0) -
                           multiplier * kmp_import_read_number(im, mimic, "reference", 0));
}

/* The hinge between two links, and the sign of its angle as one of the second link relative to the first about an axis
 * of the gear; NULL: there is none. */
static joint *hinge_between(graph *g, int first, int second, const joint *gear, int k, double *sign)
{
    kmp_sdf *s = g->s;
    for (int i = 0; i < g->count; i++) {
        joint *j = &g->joints[i];
        bool forward = j->link[0] == first && j->link[1] == second;
        if (kinds[j->kind].coordinates != 1 || kinds[j->kind].slides ||
            (!forward && (j->link[1] != first || j->link[0] != second)))
            continue;
        kmp_pose turned = kmp_sdf_between(s, (int)(j->frame - s->frames), (int)(gear->frame - s->frames));
        double axis[3];
        kmp_frame_vector(&turned, gear->axis[k], axis);
        double cosine = along(axis, j->axis[0]);
        *sign = (cosine > 0) == forward ? 1 : -1;
        if (fabs(cosine) > 1 - 1e-9)
            return j;
    }
    return NULL;
}

/* angle of the child = -ratio times angle of the parent, both from the reference body */
static void add_gearbox(graph *g, joint *gear)
{
    kmp_sdf *s = g->s;
    kmp_import *im = s->im;
    const kmp_element *e = gear->frame->element;
    int frame = kmp_sdf_frame_of(s, gear->frame->model, e, "gearbox_reference_body"),
        body = frame == KMP_SDF_NONE ? frame : kmp_sdf_link_of(s, frame);
    double sign[2];
    if (body == KMP_SDF_NONE)
        return;
    joint *hinge[2];
    for (int k = 0; k < 2; k++) {
        hinge[k] = hinge_between(g, body, gear->link[k], gear, k, &sign[k]);
        if (!hinge[k]) {
            kmp_import_complain(im, e->place, "gearbox", gear->frame->name,
                                k ? "needs a hinge about 'axis2' between its child and the reference body"
                                  : "needs a hinge about 'axis' between its parent and the reference body");
            return;
        }
    }
    const char *const joints[2] = {coordinate_of(s, hinge[0], 0), coordinate_of(s, hinge[1], 0)};
    const double factors[2] = {sign[0] * kmp_import_read_number(im, e, "gearbox_ratio", 1), sign[1]};
    kmp_import_coupler(im, e, gear->frame->name, 2, joints, factors, 0);
}

/* The file wants it to be cut, and nothing depends on its coordinate. */
static bool is_cut(const joint *j)
{
    const kmp_element *physics = kmp_element_find(j->frame->element, "physics");
    return kmp_element_says(kmp_element_find(physics, "simbody"), "must_be_loop_joint", true) && !j->needed && !j->two;
}

/* -- the graph ----------------------------------------------------------------------------------------- */

static int place_of(const graph *g, int link)
{
    return link >= 0 ? link : g->s->count;
}

/* True if the links were not connected yet. */
static bool connect(int *group, int a, int b)
{
    int x = kmp_root_of(group, a), y = kmp_root_of(group, b);
    group[x > y ? x : y] = x > y ? y : x;
    return x != y;
}

static kmp_yaml *add_edge(kmp_sdf *s, const joint *j, const char *name, const char *kind, const char *const points[2])
{
    return kmp_import_between(s->im, j->frame->element, "joints", name, kind, points);
}

static void put_axes(kmp_sdf *s, const joint *j, kmp_yaml *edge, int first, int count)
{
    kmp_import *im = s->im;
    kmp_place place = j->frame->element->place;
    kmp_yaml *axes = kmp_yaml_new(im->arena, KMP_YAML_LIST, place);
    for (int k = first; k < first + count; k++)
        kmp_yaml_append(im->arena, axes, NULL, kmp_import_numbers(im, place, 3, j->axis[k]));
    if (count == 1)
        kmp_import_put(im, edge, place, "axis", axes ? axes->items[0] : NULL);
    else
        kmp_import_put(im, edge, place, "axes", axes);
}

/* The advance per turn of a screw; positive: a right-handed thread. */
static double pitch_of(kmp_sdf *s, const joint *j)
{
    const kmp_element *e = j->frame->element;
    double old = kmp_import_read_number(s->im, e, "thread_pitch", -2 * acos(-1)); /* rad/m, left-handed */
    if (!(fabs(old) > 0))
        kmp_import_complain(s->im, e->place, "thread pitch", "0", "is not a thread: give the advance per turn");
    return kmp_import_read_number(s->im, e, "screw_thread_pitch", -2 * acos(-1) / old);
}

/* A body without mass at the frame of a joint, and its point. */
static const char *add_between(kmp_sdf *s, const joint *j, const char *word)
{
    const char *name = kmp_arena_printf(s->im->arena, "%s_%s", j->frame->name, word);
    return name && kmp_import_add_body(s->im, j->frame->element, name)
               ? kmp_arena_printf(s->im->arena, "%s.origin", name)
               : NULL;
}

/* The damper of a ball acts against the angular velocity, in the manner of a bushing. */
static void add_ball_damping(kmp_sdf *s, const joint *j, const char *const points[2])
{
    const kmp_element *dynamics = kmp_element_find(axis_element(j, 0), "dynamics");
    double damping = kmp_import_read_number(s->im, dynamics, "damping", 0);
    if (damping != 0)
        kmp_import_value(s->im,
                         kmp_import_between(s->im, dynamics, "forces",
                                            kmp_arena_printf(s->im->arena, "%s_damping", j->frame->name), "bushing",
                                            points),
                         dynamics->place, "rotational_damping", damping);
}

/* In a loop of joints whose coordinates are all needed, a weld to a body without mass is what can be cut. */
static void add_joint(graph *g, joint *j)
{
    kmp_sdf *s = g->s;
    kmp_import *im = s->im;
    const kmp_element *e = j->frame->element;
    int own = (int)(j->frame - s->frames);
    const char *name = j->frame->name, *points[2];
    for (int end = 0; end < 2; end++) {
        kmp_pose at = kmp_sdf_between(s, j->link[end], is_drake(j) ? j->frame->end[end] : own);
        points[end] =
            kmp_import_point(im, e->place, j->link[end] >= 0 ? s->frames[j->link[end]].name : "ground", name, &at);
    }
    if (!points[0] || !points[1])
        return;
    if (j->kind == BALL)
        add_ball_damping(s, j, points);
    if (j->needed && !connect(g->held, place_of(g, j->link[0]), place_of(g, j->link[1]))) {
        const char *end = add_between(s, j, "end");
        add_edge(s, j, kmp_arena_printf(im->arena, "%s_weld", name), "weld", (const char *const[]){end, points[1]});
        points[1] = end;
    }
    if (j->two) {
        const char *middle = add_between(s, j, "middle"), *const halves[2][2] = {{points[0], middle},
                                                                                 {middle, points[1]}};
        for (int k = 0; k < 2; k++)
            put_axes(s, j, add_edge(s, j, kmp_arena_printf(im->arena, "%s_%d", name, k + 1), "revolute", halves[k]), k,
                     1);
        return;
    }
    kmp_yaml *edge = add_edge(s, j, name, kinds[j->kind].joint, points);
    if (kinds[j->kind].axes > 0)
        put_axes(s, j, edge, 0, kinds[j->kind].axes);
    if (j->kind == BALL)
        kmp_import_word(im, edge, e->place, "axis", "x");
    if (j->kind == SCREW)
        kmp_import_value(im, edge, e->place, "pitch", pitch_of(s, j));
    if (is_cut(j))
        kmp_import_word(im, edge, e->place, "cut", "yes");
}

/* -- roots --------------------------------------------------------------------------------------------- */

static void attach(graph *g, int link, const char *kind)
{
    kmp_sdf *s = g->s;
    kmp_import *im = s->im;
    const kmp_sdf_frame *f = &s->frames[link];
    kmp_pose at = kmp_sdf_between(s, KMP_SDF_WORLD, link);
    const char *point = kmp_import_point(im, f->element->place, "ground", f->name, &at), *name = f->name;
    bool taken = kmp_yaml_get(kmp_yaml_get(im->root, "joints"), name);
    kmp_yaml *body = kmp_import_body(im, name);
    if (body && point)
        kmp_import_joint(im, body, f->element->place, taken ? kmp_arena_printf(im->arena, "%s_base", name) : name,
                         point, kind, NULL);
    (void)connect(g->group, link, s->count);
}

/* Links of static models are fixed to the world. Of links that no joint connects to it, one that is not a child, or
 * else the first one, is free to move, or fixed as the base is. */
static void add_roots(graph *g, const bool *child)
{
    kmp_sdf *s = g->s;
    bool fixed = s->im->base == KMP_BASE_FIXED;
    for (int pass = 0; pass < 2; pass++)
        for (int k = 0; k < s->count; k++) {
            bool free = s->frames[k].kind == KMP_SDF_LINK && !kmp_sdf_is_fixed(s, k) && (pass == 1 || !child[k]) &&
                        kmp_root_of(g->group, k) != kmp_root_of(g->group, s->count);
            if (!free)
                continue;
            attach(g, k, fixed ? "weld" : "free");
            kmp_log(s->im->context, KEMPE_LOG_INFO, "%s: link '%s' has no joint to the world: it is %s", s->im->file,
                    s->frames[k].name, fixed ? "fixed to the ground" : "free to move");
        }
}

/* Writes all joints, and attaches the models that no joint connects to the world. */
static void add_joints(kmp_sdf *s)
{
    kmp_import *im = s->im;
    graph g = {.s = s};
    bool *child = KMP_ARENA_NEW(im->arena, bool, s->count);
    if (!child || !KMP_ARENA_MAKE(im->arena, KMP_ROOM(joint, s->count, &g.joints), KMP_ROOM(int, s->count, &g.of),
                                  KMP_ROOM(int, s->count + 1, &g.group, &g.held)))
        return;
    for (int k = 0; k <= s->count; k++)
        g.group[k] = g.held[k] = k;
    for (int k = 0; k < s->count; k++) {
        g.of[k] = -1;
        if (s->frames[k].kind != KMP_SDF_JOINT || kmp_sdf_is_fixed(s, k))
            continue;
        g.of[k] = g.count;
        g.joints[g.count] = (joint){.frame = &s->frames[k]};
        read_joint(s, &g.joints[g.count++]);
    }
    if (im->status != KEMPE_OK)
        return;
    for (int i = 0; i < g.count; i++)
        for (int k = 0; k < 2; k++) {
            if (g.joints[i].kind != BALL) {
                add_dynamics(s, &g.joints[i], k);
                add_limits(s, &g.joints[i], k);
            }
            add_mimic(&g, &g.joints[i], k);
        }
    for (int i = 0; i < g.count; i++) {
        add_start(s, &g.joints[i]);
        if (g.joints[i].kind == GEARBOX)
            add_gearbox(&g, &g.joints[i]);
        if (g.joints[i].kind == PLANAR)
            add_planar_damping(s, &g.joints[i]);
    }
    for (int k = 0; k < s->count && im->status == KEMPE_OK; k++)
        if (s->frames[k].kind == KMP_SDF_LINK && kmp_sdf_is_fixed(s, k)) {
            attach(&g, k, "weld");
            (void)connect(g.held, k, s->count);
        }
    for (int i = 0; i < g.count && im->status == KEMPE_OK; i++) {
        const joint *j = &g.joints[i];
        if (!kinds[j->kind].joint)
            continue;
        add_joint(&g, &g.joints[i]);
        if (is_cut(j))
            continue;
        (void)connect(g.group, place_of(&g, j->link[0]), place_of(&g, j->link[1]));
        if (j->link[1] >= 0)
            child[j->link[1]] = true;
    }
    if (im->status == KEMPE_OK)
        add_roots(&g, child);
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

/* -- files --------------------------------------------------------------------------------------------- */

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
    kmp_import_vector(im, im->root, place, "gravity", gravity);
    kmp_sdf_find_frames(&s);
    for (int k = 0; k < s.count && im->status == KEMPE_OK; k++) {
        const kmp_sdf_frame *f = &s.frames[k];
        kmp_yaml *body = f->kind == KMP_SDF_LINK ? kmp_import_add_body(im, f->element, f->name) : NULL;
        if (!body)
            continue;
        const kmp_element *inertial = kmp_element_find(f->element, "inertial");
        const weight w = weight_of(&s, f);
        kmp_import_mass(s.im, body, (inertial ? inertial : f->element)->place, w.mass, &w.centre, w.tensor);
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
        add_joints(&s);
}
