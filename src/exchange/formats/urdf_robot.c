/* SPDX-License-Identifier: BSD-3-Clause */
/* A robot in URDF, with the loops and couplings of URDF+ (docs/urdf.md): links are bodies, joints are joints, and what
 * a file says in numbers of a rotated frame is turned into body axes here. */
#include "base/arena.h"
#include "base/context.h"
#include "base/text.h"
#include "exchange/formats/drake_tags.h"
#include "exchange/formats/foreign_frames.h"
#include "exchange/formats/importing.h"
#include <kempe/kempe.h>
#include <stdbool.h>
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
    kmp_import_index by_child, by_name;
} robot;

/* -- elements ------------------------------------------------------------------------------------------ */

/* The link that a child element names: <parent link="a"/>. */
static const char *link_of(kmp_import *im, const kmp_element *e, const char *key)
{
    const kmp_element *inside = kmp_element_find(e, key);
    if (!inside)
        kmp_import_complain(im, e->place, "element", key, "is missing here");
    return inside ? kmp_import_name(im, inside, "link") : NULL;
}

/* The frame of the numbers xyz and rpy of an element; NULL: none. */
static kmp_pose frame_in(kmp_import *im, const kmp_element *e)
{
    kmp_pose f = kmp_frame_none();
    double rpy[3] = {0};
    if (e) {
        kmp_import_read_numbers(im, e, "xyz", 3, 3, f.p);
        kmp_import_read_numbers(im, e, "rpy", 3, 3, rpy);
    }
    kmp_frame_rotate(rpy, f.r);
    return f;
}

/* The frame of the element `origin` inside; without one it is the origin of the link. */
static kmp_pose origin_of(kmp_import *im, const kmp_element *e)
{
    return frame_in(im, kmp_element_find(e, "origin"));
}

/* The axis inside an element, x when absent. */
static kmp_yaml *axis_of(kmp_import *im, const kmp_element *e, const char *name)
{
    double axis[3] = {1, 0, 0};
    const kmp_element *inside = kmp_element_find(e, "axis");
    if (inside)
        kmp_import_read_numbers(im, inside, "xyz", 3, 3, axis);
    return kmp_import_direction(im, inside ? inside->place : e->place, name, axis);
}

/* -- links --------------------------------------------------------------------------------------------- */

/* The colour of a material, which may be outside with its name; NULL: none. */
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
    kmp_import_read_numbers(im, colour, "rgba", 4, 4, rgba);
    return kmp_import_colour(im, rgba);
}

static void add_shape(kmp_import *im, kmp_yaml *body, const kmp_element *visual)
{
    static const char *const words[] = {"box", "sphere", "cylinder", "capsule"};
    const kmp_element *geometry = kmp_element_find(visual, "geometry"), *e = geometry ? geometry->first : NULL;
    kmp_pose at = origin_of(im, visual);
    double size[3] = {0};
    int solid = 0;
    while (e && solid < 4 && strcmp(e->name, words[solid]) != 0)
        solid++;
    if (e && strcmp(e->name, "mesh") == 0) {
        const char *uri = kmp_import_attribute(im, e, "filename");
        double scale[3] = {1, 1, 1};
        kmp_import_read_numbers(im, e, "scale", 3, 3, scale);
        if (uri)
            kmp_import_mesh(im, body, e->place, uri, scale, &at, colour_of(im, visual));
    }
    if (!e || solid == 4)
        return;
    if (solid == KMP_SOLID_BOX)
        kmp_import_read_numbers(im, e, "size", 3, 3, size);
    else {
        size[0] = kmp_import_read_number(im, e, "radius", 0);
        size[1] = kmp_import_read_number(im, e, "length", 0);
    }
    kmp_import_shape(im, body, e->place, (kmp_import_solid)solid, size, &at, colour_of(im, visual));
}

static void add_link(kmp_import *im, const kmp_element *link)
{
    const char *name = kmp_import_name(im, link, "name");
    const kmp_element *inertial = kmp_element_find(link, "inertial");
    kmp_yaml *body = name ? kmp_import_add_body(im, link, name) : NULL;
    if (!body)
        return;
    if (inertial) {
        const kmp_element *mass = kmp_element_find(inertial, "mass"), *inertia = kmp_element_find(inertial, "inertia");
        kmp_pose centre = origin_of(im, inertial);
        double tensor[3][3];
        if (inertia)
            kmp_import_read_tensor(im, inertia, 0, tensor);
        kmp_import_mass(im, body, inertial->place, mass ? kmp_import_read_number(im, mass, "value", 0) : 0, &centre,
                        inertia ? (const double(*)[3])tensor : NULL);
    }
    for (const kmp_element *v = kmp_element_find(link, "visual"); v; v = kmp_element_again(v))
        add_shape(im, body, v);
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

static const char *child_of(const void *joints, int k)
{
    return ((const joint *)joints)[k].child;
}

static const char *name_of(const void *joints, int k)
{
    return ((const joint *)joints)[k].name;
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
                                 .name = kmp_import_name(im, e, "name"),
                                 .type = kmp_import_attribute(im, e, "type"),
                                 .parent = link_of(im, e, "parent"),
                                 .child = link_of(im, e, "child")};
    r->count = k;
    r->by_child = kmp_import_index_of(im, r->count, child_of, r->joints);
    r->by_name = kmp_import_index_of(im, r->count, name_of, r->joints);
}

/* The first joint of the file to a link; NULL: none. */
static const joint *joint_to(const robot *r, const char *link)
{
    int k = kmp_import_index_find(&r->by_child, link);
    return k >= 0 ? &r->joints[k] : NULL;
}

/* The joint of this name in the file, which is not cleaned yet. */
static const joint *joint_named(const robot *r, const char *name)
{
    const char *clean = kmp_import_clean(r->im, name);
    int k = clean ? kmp_import_index_find(&r->by_name, clean) : -1;
    return k >= 0 ? &r->joints[k] : NULL;
}

static bool is_single(const joint *j)
{
    int k = j->type ? kind_of(j->type) : KINDS;
    return k < KINDS && kinds[k].single;
}

/* Damping and dry friction of a joint with one coordinate. */
static void add_losses(kmp_import *im, const joint *j)
{
    const kmp_element *dynamics = kmp_element_find(j->element, "dynamics");
    double damping = kmp_import_read_number(im, dynamics, "damping", 0),
           friction = kmp_import_read_number(im, dynamics, "friction", 0);
    if ((damping != 0 || friction != 0) && !is_single(j)) {
        kmp_import_complain(im, dynamics->place, "the dynamics of", j->name,
                            "belong to a joint with several coordinates, for which URDF does not define them");
        return;
    }
    kmp_import_spring(im, dynamics, j->name, "damping", 0, 0, damping);
    kmp_import_friction(im, dynamics, j->name, strcmp(j->type, "prismatic") == 0, friction);
}

/* q = multiplier q(other) + offset. */
static void add_mimic(const robot *r, const joint *j)
{
    kmp_import *im = r->im;
    const kmp_element *mimic = kmp_element_find(j->element, "mimic");
    const char *name = mimic ? kmp_import_attribute(im, mimic, "joint") : NULL;
    const joint *other = name ? joint_named(r, name) : NULL;
    if (!name)
        return;
    if (!other || !is_single(other) || !is_single(j)) {
        kmp_import_complain(im, mimic->place, "the joint", name,
                            other ? "and the joint that mimics it need one coordinate each" : "does not exist");
        return;
    }
    const char *const joints[2] = {j->name, other->name};
    const double factors[2] = {1, -kmp_import_read_number(im, mimic, "multiplier", 1)};
    kmp_import_coupler(im, mimic, kmp_arena_printf(im->arena, "%s_mimic", j->name), 2, joints, factors,
                       kmp_import_read_number(im, mimic, "offset", 0));
}

/* The range of a joint with one coordinate, but for continuous ones. Limits of effort and rate belong to a drive. */
static void add_limits(kmp_import *im, const joint *j)
{
    const kmp_element *limit = kmp_element_find(j->element, "limit");
    if (limit && is_single(j) && strcmp(j->type, "continuous") != 0)
        kmp_import_limits(im, limit, j->name, NULL, kmp_import_read_number(im, limit, "lower", 0),
                          kmp_import_read_number(im, limit, "upper", 0));
}

static void add_joint(const robot *r, const joint *j)
{
    kmp_import *im = r->im;
    if (!j->name || !j->type || !j->parent || !j->child)
        return;
    int k = kind_of(j->type);
    kmp_yaml *body = kmp_import_body(im, j->child);
    if (k == KINDS)
        kmp_import_complain(
            im, j->element->place, "joint type", j->type,
            "is unknown; available: revolute, continuous, prismatic, fixed, planar, floating, spherical");
    else if (!body)
        kmp_import_complain(im, j->element->place, "link", j->child, "does not exist");
    else if (!kmp_import_body(im, j->parent))
        kmp_import_complain(im, j->element->place, "link", j->parent, "does not exist");
    else if (joint_to(r, j->child) != j)
        kmp_import_complain(
            im, j->element->place, "link", j->child,
            "has two joints to parents, but URDF has only trees: write one of them as a <loop> of URDF+");
    else {
        kmp_pose f = origin_of(im, j->element);
        const char *at = kmp_import_point(im, j->element->place, j->parent, j->name, &f),
                   *hold = kmp_element_text(j->element, "independent");
        kmp_import_joint(im, body, j->element->place, j->name, at, kinds[k].joint,
                         kinds[k].has_axis ? axis_of(im, j->element, j->name) : NULL);
        add_losses(im, j);
        add_limits(im, j);
        add_mimic(r, j);
        if (hold && strcmp(hold, "true") == 0 && kinds[k].single)
            kmp_import_hold(im, j->element->place, j->name);
    }
}

/* The link without a joint to a parent is fixed to the ground, or free. */
static void add_roots(const robot *r)
{
    kmp_import *im = r->im;
    int roots = 0;
    for (const kmp_element *e = kmp_element_find(im->model, "link"); e; e = kmp_element_again(e)) {
        const char *name = kmp_import_name(im, e, "name");
        kmp_yaml *body = name && !joint_to(r, name) ? kmp_import_body(im, name) : NULL;
        if (!body)
            continue;
        const char *own = joint_named(r, name) ? kmp_arena_printf(im->arena, "%s_base", name) : name;
        bool is_free = im->base == KMP_BASE_FREE;
        kmp_import_joint(im, body, e->place, own, "ground", is_free ? "free" : "weld", NULL);
        if (++roots == 1)
            kmp_log(im->context, KEMPE_LOG_INFO, "%s: link '%s' has no parent: it is %s", im->file, name,
                    is_free ? "free to move" : "fixed to the ground");
        else
            kmp_import_complain(im, e->place, "link", name, "is a second one without a joint to a parent");
    }
    if (roots == 0 && im->status == KEMPE_OK)
        kmp_import_complain(im, im->model->place, "robot", kmp_element_text(im->model, "name"),
                            "has no link without a joint to a parent, to begin with");
}

/* -- loops --------------------------------------------------------------------------------------------- */

/* The row of a loop's type; KINDS after a complaint. Gazebo calls a spherical joint a ball. */
static int loop_kind(kmp_import *im, const kmp_element *loop, const char *type)
{
    int k = kind_of(strcmp(type, "ball") == 0 ? "spherical" : type);
    if (k < KINDS && kinds[k].closure)
        return k;
    kmp_import_complain(im, loop->place, "loop type", type,
                        "is unknown; available: revolute, continuous, prismatic, fixed, planar, spherical");
    return KINDS;
}

/* A loop of URDF+, <loop>, whose ends have separate frames, or of Isaac Sim, <loop_joint>, whose ends are frames.
 */
static void add_loop(kmp_import *im, const kmp_element *loop)
{
    bool plus = strcmp(loop->name, "loop") == 0;
    const char *const ends[2] = {plus ? "predecessor" : "link1", plus ? "successor" : "link2"};
    const char *name = kmp_import_name(im, loop, "name"), *type = kmp_import_attribute(im, loop, "type");
    int k = type ? loop_kind(im, loop, type) : KINDS;
    const char *points[2];
    if (!name || k == KINDS)
        return;
    for (int end = 0; end < 2; end++) {
        const char *link = link_of(im, loop, ends[end]);
        if (link && !kmp_import_body(im, link))
            kmp_import_complain(im, loop->place, "link", link, "does not exist");
        if (!link || !kmp_import_body(im, link))
            return;
        const kmp_element *side = kmp_element_find(loop, ends[end]);
        kmp_pose f = plus ? origin_of(im, side) : frame_in(im, side);
        points[end] = kmp_import_point(im, side->place, link, name, &f);
    }
    kmp_import_loop(im, loop, name, kinds[k].closure, points, kinds[k].has_axis ? axis_of(im, loop, name) : NULL);
}

/* -- Gazebo's additions -------------------------------------------------------------------------------- */

/* A link in the frame of the root where all coordinates are zero. */
static kmp_pose zero_pose(const robot *r, const char *link)
{
    kmp_pose f = kmp_frame_none();
    int steps = 0;
    for (const joint *j = joint_to(r, link); j && j->parent && steps++ <= r->count; j = joint_to(r, j->parent)) {
        const kmp_pose at = origin_of(r->im, j->element);
        f = kmp_frame_in(&at, &f);
    }
    return f;
}

/* The body that the text of an element names; NULL after a complaint. */
static const char *link_named(kmp_import *im, const kmp_element *e, const char *key, const char *text)
{
    const char *link = text ? kmp_import_clean(im, text) : NULL;
    if (text && link && kmp_import_body(im, link))
        return link;
    kmp_import_complain(im, e->place, text ? "link" : "element", text ? text : key,
                        text ? "does not exist" : "is missing here");
    return NULL;
}

/* The direction of a joint of Gazebo in its own frame, which has a place `at` in the root's. */
static kmp_yaml *gazebo_axis(kmp_import *im, const kmp_element *axis, const char *name, const kmp_pose *at)
{
    double xyz[3] = {0, 0, 1};
    const kmp_pose back = kmp_frame_inverse(at);
    kmp_import_read_numbers(im, axis, "xyz", 3, 3, xyz);
    if (kmp_element_says(axis, "use_parent_model_frame", true))
        kmp_frame_vector(&back, xyz, xyz);
    return kmp_import_direction(im, axis->place, name, xyz);
}

/* Names the losses and limits of a joint that closes a loop. */
static void note_axis(kmp_import *im, const kmp_element *axis, const char *name)
{
    const kmp_element *dynamics = kmp_element_find(axis, "dynamics"), *limit = kmp_element_find(axis, "limit");
    if (dynamics && (kmp_import_read_number(im, dynamics, "damping", 0) != 0 ||
                     kmp_import_read_number(im, dynamics, "friction", 0) != 0))
        kmp_import_leave_out(im, dynamics->place, KMP_PART_MECHANICS, "dynamics",
                             "the dynamics of joint '%s', which closes a loop, are not used", name);
    if (limit)
        kmp_import_leave_out(im, limit->place, KMP_PART_AT_TIMES, "limit",
                             "the limits of joint '%s', which closes a loop, are not used", name);
}

/* A joint in the words of SDFormat, between two links of the tree: it closes a loop. Its frame is given in the frame of
 * the child, and is where the parent has it while all coordinates are zero. */
static void add_gazebo_joint(const robot *r, const kmp_element *e)
{
    kmp_import *im = r->im;
    const char *name = kmp_import_name(im, e, "name"), *type = kmp_import_attribute(im, e, "type"), *points[2];
    const char *parent = link_named(im, e, "parent", kmp_element_text(e, "parent")),
               *child = link_named(im, e, "child", kmp_element_text(e, "child"));
    const kmp_element *pose = kmp_element_find(e, "pose"), *axis = kmp_element_find(e, "axis");
    int k = type ? loop_kind(im, e, type) : KINDS;
    if (!name || !parent || !child || k == KINDS)
        return;
    const char *in = kmp_element_text(pose, "relative_to");
    double value[6] = {0};
    if (pose)
        kmp_import_read_numbers(im, e, "pose", 6, 6, value);
    in = in ? link_named(im, pose, "relative_to", in) : child;
    kmp_pose own = kmp_frame_none();
    memcpy(own.p, value, sizeof own.p);
    kmp_frame_rotate(value + 3, own.r);
    if (!in || (kinds[k].has_axis && !axis)) {
        if (in)
            kmp_import_complain(im, e->place, "element", "axis", "is missing here");
        return;
    }
    const kmp_pose base = zero_pose(r, in), at = kmp_frame_in(&base, &own);
    for (int end = 0; end < 2; end++) {
        const kmp_pose link = zero_pose(r, end ? child : parent), back = kmp_frame_inverse(&link),
                       f = kmp_frame_in(&back, &at);
        points[end] = kmp_import_point(im, e->place, end ? child : parent, name, &f);
    }
    if (axis)
        note_axis(im, axis, name);
    kmp_import_loop(im, e, name, kinds[k].closure, points, kinds[k].has_axis ? gazebo_axis(im, axis, name, &at) : NULL);
}

/* An element `gazebo`: joints that close loops, the spring of the joint to which it refers. */
static void add_gazebo(const robot *r, const kmp_element *e)
{
    kmp_import *im = r->im;
    const char *reference = kmp_element_text(e, "reference");
    double stiffness = kmp_import_read_number(im, e, "springStiffness", 0);
    const joint *j = reference && stiffness != 0 ? joint_named(r, reference) : NULL;
    for (const kmp_element *inside = kmp_element_find(e, "joint"); inside; inside = kmp_element_again(inside))
        add_gazebo_joint(r, inside);
    if (j && is_single(j))
        kmp_import_spring(im, e, j->name, "spring", stiffness, kmp_import_read_number(im, e, "springReference", 0), 0);
    else if (stiffness != 0)
        kmp_import_complain(im, e->place, "the joint", reference, "of springStiffness is none with one coordinate");
    if (kmp_element_says(e, "gravity", false) || kmp_element_says(e, "turnGravityOff", true))
        kmp_import_leave_out(im, e->place, KMP_PART_MECHANICS, "gravity", "link '%s' without gravity is not read",
                             reference ? reference : "");
    if (kmp_element_says(e, "static", true))
        kmp_import_leave_out(im, e->place, KMP_PART_MECHANICS, "static", "a robot that is static is not read");
}

/* The number of joints from a link to the root. */
static int depth_of(const robot *r, const char *link)
{
    int depth = 0;
    for (const joint *j = joint_to(r, link); j && j->parent && depth <= r->count; j = joint_to(r, j->parent))
        depth++;
    return depth;
}

/* ratio q of all joints from the common ancestor to the predecessor equals q of the joints to the successor, summed up.
 */
static void add_coupling(const robot *r, const kmp_element *coupling)
{
    kmp_import *im = r->im;
    const char *name = kmp_import_name(im, coupling, "name"),
               *link[2] = {link_of(im, coupling, "predecessor"), link_of(im, coupling, "successor")};
    const kmp_element *ratio = kmp_element_find(coupling, "ratio");
    const char **joints = KMP_ARENA_NEW(im->arena, const char *, r->count + 1);
    double *factors = KMP_ARENA_NEW(im->arena, double, r->count + 1);
    int count = 0;
    const double factor[2] = {kmp_import_read_number(im, ratio, "value", 1), -1};
    if (!name || !link[0] || !link[1] || !joints || !factors)
        return;
    for (int steps = r->count; strcmp(link[0], link[1]) != 0 && steps > 0; steps--) {
        int side = depth_of(r, link[0]) >= depth_of(r, link[1]) ? 0 : 1;
        const joint *j = joint_to(r, link[side]);
        if (!j || !j->name || !j->parent || !j->type)
            break;
        if (is_single(j)) {
            joints[count] = j->name;
            factors[count++] = factor[side];
        } else if (strcmp(j->type, "fixed") != 0)
            kmp_import_complain(im, coupling->place, "coupling", name, "passes a joint with several coordinates");
        link[side] = j->parent;
    }
    if (strcmp(link[0], link[1]) != 0)
        kmp_import_complain(im, coupling->place, "coupling", name, "has links without a common ancestor");
    kmp_import_coupler(im, coupling, name, count, joints, factors, 0);
}

/* -- transmissions ------------------------------------------------------------------------------------- */

/* The reduction of a transmission, which different versions of ROS write at different places. */
static double reduction_of(kmp_import *im, const kmp_element *transmission, const kmp_element *actuator)
{
    static const char *const keys[2] = {"mechanicalReduction", "mechanical_reduction"};
    const kmp_element *const places[3] = {actuator, kmp_element_find(transmission, "joint"), transmission};
    for (int k = 0; k < 6; k++)
        if (kmp_element_text(places[k / 2], keys[k % 2]))
            return kmp_import_read_number(im, places[k / 2], keys[k % 2], 1);
    return 1;
}

/* Why a transmission is not a reduction between one motor and one joint; NULL: it is. */
static const char *unlike_reduction(const kmp_element *transmission, const joint *j)
{
    const kmp_element *own = kmp_element_find(transmission, "joint"),
                      *motor = kmp_element_find(transmission, "actuator");
    const char *type = kmp_element_text(transmission, "type");
    type = type ? type : kmp_element_text(transmission, "plugin");
    if (!own)
        return "it has no joint";
    if (type && !strstr(type, "SimpleTransmission"))
        return "it is not a reduction between one motor and one joint";
    if (kmp_element_again(own) || (motor && kmp_element_again(motor)))
        return "it has several joints or motors";
    return j && is_single(j) && j->name ? NULL : "it moves no joint with one coordinate";
}

/* A motor that moves a joint by a reduction: the input ctrl_NAME, the effort of the motor, and the force NAME. */
static void add_transmission(const robot *r, const kmp_element *e)
{
    kmp_import *im = r->im;
    const kmp_element *motor = kmp_element_find(e, "actuator");
    const char *own = kmp_element_text(e, "name"), *moved = kmp_element_text(kmp_element_find(e, "joint"), "name"),
               *named = kmp_element_text(motor, "name");
    const joint *j = moved ? joint_named(r, moved) : NULL;
    const char *wrong = unlike_reduction(e, j), *name = kmp_import_clean(im, named ? named : own ? own : "motor");
    if (!wrong && name && kmp_yaml_get(kmp_import_part(im, im->root, "forces", KMP_YAML_MAP), name))
        wrong = "its motor has the name of another force";
    if (wrong || !name) {
        kmp_import_leave_out(im, e->place, KMP_PART_AT_TIMES, "transmission", "transmission '%s' is not used: %s",
                             own ? own : "", wrong ? wrong : "");
        return;
    }
    const bool slides = strcmp(j->type, "prismatic") == 0;
    const double reduction = reduction_of(im, e, motor);
    const char *input = kmp_arena_printf(im->arena, "ctrl_%s", name);
    kmp_yaml *inputs = kmp_import_map(im, e->place), *force = kmp_import_map(im, e->place);
    kmp_import_word(im, inputs, e->place, "unit", slides ? "N" : "N*m");
    kmp_import_add(im, "inputs", e, input, inputs);
    kmp_import_word(im, force, e->place, "joint", j->name);
    kmp_import_word(im, force, e->place, slides ? "force" : "torque",
                    reduction == 1 ? input : kmp_arena_printf(im->arena, "%.17g*%s", reduction, input));
    kmp_import_add(im, "forces", e, name, force);
}

/* -- constraints of Drake ------------------------------------------------------------------------------ */

/* A point of a link, of a frame, or of the world. */
static const char *point_of(void *reader, const kmp_element *e, const char *name, const double at[3], const char *shown)
{
    kmp_import *im = reader;
    const kmp_element *frame = kmp_element_named(im->model, "frame", "name", name);
    const char *link = frame ? kmp_import_name(im, frame, "link") : kmp_import_clean(im, name);
    const kmp_pose f = frame_in(im, frame);
    if (link && !kmp_import_body(im, link))
        link = strcmp(link, "world") == 0 ? "ground" : NULL;
    if (!link) {
        kmp_import_complain(im, e->place, "link", name, "does not exist");
        return NULL;
    }
    kmp_pose offset = kmp_frame_none();
    memcpy(offset.p, at, sizeof offset.p);
    offset = kmp_frame_in(&f, &offset);
    return kmp_import_point(im, e->place, link, shown, &offset);
}

/* -- models -------------------------------------------------------------------------------------------- */

void kmp_urdf_convert(kmp_import *im)
{
    static const double gravity[3] = {0, 0, -9.81};
    robot r = {.im = im};
    const char *name = kmp_element_text(im->model, "name");
    if (name)
        kmp_import_word(im, im->root, im->model->place, "name", name);
    kmp_import_vector(im, im->root, im->model->place, "gravity", gravity);
    for (const kmp_element *e = kmp_element_find(im->model, "link"); e; e = kmp_element_again(e))
        add_link(im, e);
    read_joints(&r);
    for (int k = 0; r.joints && k < r.count; k++)
        add_joint(&r, &r.joints[k]);
    add_roots(&r);
    for (const kmp_element *e = kmp_element_find(im->model, "loop"); e; e = kmp_element_again(e))
        add_loop(im, e);
    for (const kmp_element *e = kmp_element_find(im->model, "loop_joint"); e; e = kmp_element_again(e))
        add_loop(im, e);
    for (const kmp_element *e = kmp_element_find(im->model, "gazebo"); e; e = kmp_element_again(e))
        add_gazebo(&r, e);
    for (const kmp_element *e = kmp_element_find(im->model, "coupling"); e; e = kmp_element_again(e))
        add_coupling(&r, e);
    for (const kmp_element *e = kmp_element_find(im->model, "transmission"); e; e = kmp_element_again(e))
        add_transmission(&r, e);
    kmp_drake_add(im, im->model, "", point_of, im);
}
