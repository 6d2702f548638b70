/* SPDX-License-Identifier: BSD-3-Clause */
/* A model in SDFormat (docs/sdf.md): a joint is given in the frame of its parent, its child in the frame of the joint.
 * Loops are joints of the graph whose frames on both links coincide where all coordinates are zero, or constraints of
 * Drake between two points. */
#include "exchange/formats/foreign_frames.h"
#include "exchange/formats/written_tree.h"
#include "model/data/closure_table.h"
#include "model/data/model.h"
#include <math.h>
#include <string.h>

/* Frames of a loop that differ by more, over the size of their places, do not coincide. */
#define COINCIDENT 1e-12

static const char *const frame_of_root = "__model__";

static void put_pose(kmp_text *text, const char *relative, const kmp_pose *f)
{
    double value[6];
    memcpy(value, f->p, sizeof f->p);
    kmp_export_angles(f, value + 3);
    kmp_text_printf(text, "      <pose relative_to=\"%s\">", relative);
    kmp_export_numbers(text, 6, value);
    kmp_text_put(text, "</pose>\n");
}

static void put_number(kmp_text *text, const char *key, double value)
{
    kmp_text_printf(text, "<%s>", key);
    kmp_text_number(text, value);
    kmp_text_printf(text, "</%s>", key);
}

static void put_axis(kmp_text *text, const double axis[3])
{
    kmp_text_put(text, "      <axis>\n        <xyz>");
    kmp_export_numbers(text, 3, axis);
    kmp_text_put(text, "</xyz>\n");
}

/* -- links and joints ---------------------------------------------------------------------------------- */

static void put_picture(kmp_text *text, int number, const kmp_writer_shape *s)
{
    double place[6];
    memcpy(place, s->at.p, sizeof s->at.p);
    kmp_export_angles(&s->at, place + 3);
    kmp_text_printf(text, "      <visual name=\"shape_%d\">\n        <pose>", number);
    kmp_export_numbers(text, 6, place);
    kmp_text_printf(text, "</pose>\n        <geometry><%s>", kmp_shape_words[s->kind]);
    bool three = s->kind == KMP_SHAPE_BOX || s->kind == KMP_SHAPE_ELLIPSOID;
    if (s->mesh) {
        kmp_text_put(text, "<uri>");
        kmp_export_text(text, s->mesh);
        kmp_text_put(text, "</uri><scale>");
        kmp_export_numbers(text, 3, s->size);
        kmp_text_put(text, "</scale>");
    } else if (three) {
        const char *key = s->kind == KMP_SHAPE_BOX ? "size" : "radii";
        kmp_text_printf(text, "<%s>", key);
        kmp_export_numbers(text, 3, s->size);
        kmp_text_printf(text, "</%s>", key);
    } else
        put_number(text, "radius", s->size[0]);
    if (s->kind == KMP_SHAPE_CYLINDER || s->kind == KMP_SHAPE_CAPSULE)
        put_number(text, "length", s->size[1]);
    kmp_text_printf(text, "</%s></geometry>\n", kmp_shape_words[s->kind]);
    if (s->coloured) {
        kmp_text_put(text, "        <material><diffuse>");
        kmp_export_numbers(text, 4, s->rgba);
        kmp_text_put(text, "</diffuse></material>\n");
    }
    kmp_text_put(text, "      </visual>\n");
}

static void put_link(kmp_export *w, int link)
{
    static const char *const keys[6] = {"ixx", "iyy", "izz", "ixy", "ixz", "iyz"};
    const kmp_writer_link *l = &w->links[link];
    double mass = 0, com[6] = {0}, inertia[6] = {0};
    bool free = l->kind == KMP_WRITER_FREE;
    const kmp_pose none = kmp_frame_none();
    if (!kmp_export_mass(w, link, &mass, com, inertia))
        kmp_log(w->model->context, KEMPE_LOG_INFO, "%s: link '%s' has no mass, which some readers of SDFormat refuse",
                w->model->source.file, l->name);
    kmp_text_printf(w->text, "    <link name=\"%s\">\n", l->name);
    put_pose(w->text, free ? frame_of_root : l->joint, free ? &l->at : &none);
    kmp_text_put(w->text, "      <inertial>\n        <pose>");
    kmp_export_numbers(w->text, 6, com);
    kmp_text_put(w->text, "</pose>\n        ");
    put_number(w->text, "mass", mass);
    kmp_text_put(w->text, "\n        <inertia>");
    for (int k = 0; k < 6; k++)
        put_number(w->text, keys[k], inertia[k]);
    kmp_text_put(w->text, "</inertia>\n      </inertial>\n");
    kmp_writer_shape shape;
    for (int k = 0; k < w->model->shape_count; k++)
        if (kmp_export_shape(w, k, link, true, &shape))
            put_picture(w->text, k + 1, &shape);
    kmp_text_put(w->text, "    </link>\n");
}

static void begin_joint(kmp_export *w, const char *name, const char *type, int parent, const char *child)
{
    kmp_text_printf(w->text,
                    "    <joint name=\"%s\" type=\"%s\">\n      <parent>%s</parent>\n      <child>%s</child>\n", name,
                    type, parent > 0 ? w->links[parent].name : "world", child);
}

static void put_joint(kmp_export *w, int link)
{
    static const char *const types[] = {
        [KMP_WRITER_FIXED] = "fixed", [KMP_WRITER_TURNS] = "revolute", [KMP_WRITER_SLIDES] = "prismatic"};
    const kmp_writer_link *l = &w->links[link];
    if (l->kind == KMP_WRITER_FREE)
        return;
    begin_joint(w, l->joint, types[l->kind], l->parent, l->name);
    put_pose(w->text, l->parent > 0 ? w->links[l->parent].name : frame_of_root, &l->at);
    if (l->kind != KMP_WRITER_FIXED) {
        put_axis(w->text, l->axis);
        if (l->damping != 0 || l->friction != 0 || l->stiffness != 0) {
            kmp_text_put(w->text, "        <dynamics>");
            put_number(w->text, "damping", l->damping);
            put_number(w->text, "friction", l->friction);
            put_number(w->text, "spring_stiffness", l->stiffness);
            put_number(w->text, "spring_reference", l->rest);
            kmp_text_put(w->text, "</dynamics>\n");
        }
        int leader;
        double multiplier, offset;
        if (kmp_export_mimic(w, link, &leader, &multiplier, &offset)) {
            kmp_text_printf(w->text, "        <mimic joint=\"%s\" axis=\"axis\">", w->links[leader].joint);
            put_number(w->text, "multiplier", multiplier);
            put_number(w->text, "offset", offset);
            put_number(w->text, "reference", 0);
            kmp_text_put(w->text, "</mimic>\n");
        }
        kmp_text_put(w->text, "      </axis>\n");
    }
    kmp_text_put(w->text, "    </joint>\n");
}

/* -- loops --------------------------------------------------------------------------------------------- */

static int link_of(const kmp_export *w, const kmp_closure *c, int end)
{
    return w->of_body[w->model->points[c->point[end]].body];
}

/* A point's frame in the frame of the root, all coordinates zero. */
static kmp_pose at_zero(const kmp_export *w, const kmp_closure *c, int end)
{
    kmp_pose f = kmp_export_point(w, c->point[end]);
    for (int link = link_of(w, c, end); link > 0; link = w->links[link].parent)
        f = kmp_frame_in(&w->links[link].at, &f);
    return f;
}

static double distance(const double a[3], const double b[3])
{
    return hypot(hypot(a[0] - b[0], a[1] - b[1]), a[2] - b[2]);
}

/* True if a joint whose frame is the frame of the second point is this loop. */
static bool coincide(const kmp_export *w, const kmp_closure *c, bool places_alone, bool axis_alone)
{
    const double zero[3] = {0};
    kmp_pose f[2] = {at_zero(w, c, 0), at_zero(w, c, 1)};
    double size = 1 + distance(f[0].p, zero), apart = distance(f[0].p, f[1].p) / size, axis[2][3];
    if (places_alone)
        return apart <= COINCIDENT;
    if (axis_alone) {
        for (int end = 0; end < 2; end++)
            kmp_frame_vector(&f[end], c->axis[end], axis[end]);
        return apart + distance(axis[0], axis[1]) <= COINCIDENT;
    }
    for (int i = 0; i < 3; i++)
        apart += distance(f[0].r[i], f[1].r[i]);
    return apart <= 4 * COINCIDENT;
}

/* A constraint of the points that are `along` from the points of the closure, in the frame of each. */
static void put_drake(kmp_export *w, const kmp_closure *c, const char *tag, double along[2][3])
{
    static const char *const words[2][2] = {{"body_A", "p_AP"}, {"body_B", "p_BQ"}};
    kmp_text_printf(w->text, "    <drake:%s>\n", tag);
    for (int end = 0; end < 2; end++) {
        int link = link_of(w, c, end);
        kmp_pose f = kmp_export_point(w, c->point[end]);
        double shift[3];
        kmp_frame_vector(&f, along[end], shift);
        for (int i = 0; i < 3; i++)
            f.p[i] += shift[i];
        kmp_text_printf(w->text, "      <drake:%s_%s>%s</drake:%s_%s>\n      <drake:%s_%s>", tag, words[end][0],
                        link > 0 ? w->links[link].name : "world", tag, words[end][0], tag, words[end][1]);
        kmp_export_numbers(w->text, 3, f.p);
        kmp_text_printf(w->text, "</drake:%s_%s>\n", tag, words[end][1]);
    }
    if (kmp_closure_row_of(c)->needs == KMP_NEEDS_NUMBER) {
        kmp_text_printf(w->text, "      <drake:%s_distance>", tag);
        kmp_text_number(w->text, c->number.value);
        kmp_text_printf(w->text, "</drake:%s_distance>\n", tag);
    }
    kmp_text_printf(w->text, "    </drake:%s>\n", tag);
}

/* The name of a loop that no link and no joint has. */
static const char *loop_name(kmp_export *w, const char *name)
{
    for (int i = 1; name && i < w->count; i++)
        if (strcmp(name, w->links[i].name) == 0 || strcmp(name, w->links[i].joint) == 0) {
            name = kmp_arena_printf(&w->arena, "%s_loop", name);
            i = 0;
        }
    return name ? name : "";
}

/* A hinge is two ball constraints at its axis, a weld is three of them. */
static void put_balls(kmp_export *w, const kmp_closure *c)
{
    const int balls = kmp_closure_row_of(c)->balls;
    const bool weld = balls == 3;
    for (int k = 0; k < balls; k++) {
        double along[2][3] = {{0}};
        for (int end = 0; end < 2 && k > 0; end++)
            for (int i = 0; i < 3; i++)
                along[end][i] = weld ? i == k : c->axis[end][i];
        put_drake(w, c, "ball_constraint", along);
    }
}

static void put_loop(kmp_export *w, int k)
{
    const kmp_closure *c = &w->model->closures[k];
    const kmp_closure_row *row = kmp_closure_row_of(c);
    const bool turns = row->needs == KMP_NEEDS_SAME_AXIS, rod = row->needs == KMP_NEEDS_NUMBER && !c->function;
    if (row->sdf && link_of(w, c, 1) > 0 && coincide(w, c, row->balls == 1, turns)) {
        kmp_pose f = kmp_export_point(w, c->point[1]);
        const char *child = w->links[link_of(w, c, 1)].name;
        begin_joint(w, loop_name(w, c->name), row->sdf, link_of(w, c, 0), child);
        put_pose(w->text, child, &f);
        if (turns || row->needs == KMP_NEEDS_AXIS) {
            put_axis(w->text, c->axis[turns]);
            kmp_text_put(w->text, "      </axis>\n");
        }
        kmp_text_put(w->text,
                     "      <physics><simbody><must_be_loop_joint>true</must_be_loop_joint></simbody></physics>\n"
                     "    </joint>\n");
        w->said[k] = true;
    } else if (row->balls == 1 || rod) {
        double none[2][3] = {{0}};
        put_drake(w, c, rod ? "distance_constraint" : "ball_constraint", none);
        w->said[k] = true;
    } else if (row->balls > 1) {
        put_balls(w, c);
        w->said[k] = true;
    }
}

/* Links, joints and loops share their names: a joint with the name of a link gets another one. */
static void rename_joints(kmp_export *w)
{
    for (int k = 1; k < w->count; k++)
        for (int i = 1; i < w->count; i++)
            if (w->links[k].kind != KMP_WRITER_FREE && strcmp(w->links[k].joint, w->links[i].name) == 0) {
                const char *other = kmp_arena_printf(&w->arena, "%s_joint", w->links[k].joint);
                w->links[k].joint = other ? other : "";
                i = 0;
            }
}

/* Points that have a separate link. */
static void put_points(kmp_export *w)
{
    for (int k = 0; k < w->model->point_count; k++) {
        int link = w->of_body[w->model->points[k].body];
        const char *name = link > 0 ? kmp_export_point_name(w, k) : NULL;
        if (!name)
            continue;
        kmp_pose f = kmp_export_point(w, k);
        kmp_text_printf(w->text, "    <frame name=\"%s\" attached_to=\"%s\">\n", name, w->links[link].name);
        put_pose(w->text, w->links[link].name, &f);
        kmp_text_put(w->text, "    </frame>\n");
    }
}

void kmp_sdf_write(kmp_export *w)
{
    double gravity[3];
    rename_joints(w);
    for (int k = 0; k < 3; k++)
        gravity[k] = w->model->gravity[k].value;
    kmp_text_put(
        w->text,
        "<?xml version=\"1.0\"?>\n<sdf version=\"1.11\" xmlns:drake=\"http://drake.mit.edu\">\n <world name=\"");
    kmp_export_name(w->text, w->model->name);
    kmp_text_put(w->text, "\">\n  <gravity>");
    kmp_export_numbers(w->text, 3, gravity);
    kmp_text_put(w->text, "</gravity>\n  <model name=\"model\">\n");
    for (int k = 1; k < w->count; k++)
        put_link(w, k);
    for (int k = 1; k < w->count; k++)
        put_joint(w, k);
    for (int k = 0; k < w->model->closure_count; k++)
        put_loop(w, k);
    put_points(w);
    kmp_text_put(w->text, "  </model>\n </world>\n</sdf>\n");
}
