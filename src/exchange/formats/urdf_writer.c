/* SPDX-License-Identifier: BSD-3-Clause */
/* A model as a robot in URDF, with the loops of URDF+ (docs/urdf.md). The ground is the root, a link without mass. */
#include "exchange/formats/foreign_frames.h"
#include "exchange/formats/written_tree.h"
#include "model/data/closure_table.h"
#include "model/data/model.h"
#include "model/read/read_values.h"
#include <string.h>

static void put_origin(kmp_text *text, const char *indent, const kmp_pose *f)
{
    double rpy[3];
    kmp_export_angles(f, rpy);
    kmp_text_printf(text, "%s<origin", indent);
    kmp_export_attribute(text, "xyz", 3, f->p);
    if (kmp_frame_is_turned(f))
        kmp_export_attribute(text, "rpy", 3, rpy);
    kmp_text_put(text, "/>\n");
}

static void put_axis(kmp_text *text, const double axis[3])
{
    kmp_text_put(text, "    <axis");
    kmp_export_attribute(text, "xyz", 3, axis);
    kmp_text_put(text, "/>\n");
}

static void put_picture(kmp_text *text, const kmp_writer_shape *s)
{
    kmp_text_put(text, "    <visual>\n");
    put_origin(text, "      ", &s->at);
    kmp_text_printf(text, "      <geometry>\n        <%s", kmp_shape_words[s->kind]);
    if (s->mesh) {
        kmp_text_put(text, " filename=\"");
        kmp_export_text(text, s->mesh);
        kmp_text_put(text, "\"");
        kmp_export_attribute(text, "scale", 3, s->size);
    } else if (s->kind == KMP_SHAPE_BOX)
        kmp_export_attribute(text, "size", 3, s->size);
    else
        kmp_export_attribute(text, "radius", 1, s->size);
    if (s->kind == KMP_SHAPE_CYLINDER || s->kind == KMP_SHAPE_CAPSULE)
        kmp_export_attribute(text, "length", 1, &s->size[1]);
    kmp_text_put(text, "/>\n      </geometry>\n");
    if (s->coloured) {
        kmp_text_put(text, "      <material name=\"\">\n        <color");
        kmp_export_attribute(text, "rgba", 4, s->rgba);
        kmp_text_put(text, "/>\n      </material>\n");
    }
    kmp_text_put(text, "    </visual>\n");
}

static void put_link(kmp_export *w, int link)
{
    kmp_pose centre = kmp_frame_none();
    kmp_writer_shape shape;
    double mass, inertia[6];
    kmp_text_printf(w->text, "  <link name=\"%s\">\n", w->links[link].name);
    if (kmp_export_mass(w, link, &mass, centre.p, inertia)) {
        kmp_text *text = w->text;
        static const char *const keys[6] = {"ixx", "iyy", "izz", "ixy", "ixz", "iyz"};
        kmp_text_put(text, "    <inertial>\n");
        put_origin(text, "      ", &centre);
        kmp_text_put(text, "      <mass");
        kmp_export_attribute(text, "value", 1, &mass);
        kmp_text_put(text, "/>\n      <inertia");
        for (int k = 0; k < 6; k++)
            kmp_export_attribute(text, keys[k], 1, &inertia[k]);
        kmp_text_put(text, "/>\n    </inertial>\n");
    }
    for (int k = 0; k < w->model->shape_count; k++)
        if (kmp_export_shape(w, k, link, false, &shape))
            put_picture(w->text, &shape);
    kmp_text_put(w->text, "  </link>\n");
}

static void put_joint(kmp_export *w, int link)
{
    static const char *const types[] = {[KMP_WRITER_FIXED] = "fixed",
                                        [KMP_WRITER_TURNS] = "continuous",
                                        [KMP_WRITER_SLIDES] = "prismatic",
                                        [KMP_WRITER_FREE] = "floating"};
    const kmp_writer_link *l = &w->links[link];
    kmp_text_printf(w->text, "  <joint name=\"%s\" type=\"%s\">\n    <parent link=\"%s\"/>\n    <child link=\"%s\"/>\n",
                    l->joint, types[l->kind], w->links[l->parent].name, l->name);
    put_origin(w->text, "    ", &l->at);
    if (l->kind == KMP_WRITER_TURNS || l->kind == KMP_WRITER_SLIDES)
        put_axis(w->text, l->axis);
    if (l->damping != 0 || l->friction != 0) {
        kmp_text_put(w->text, "    <dynamics");
        kmp_export_attribute(w->text, "damping", 1, &l->damping);
        kmp_export_attribute(w->text, "friction", 1, &l->friction);
        kmp_text_put(w->text, "/>\n");
    }
    if (l->stiffness != 0)
        kmp_export_leave_out(w, "the spring of joint '%s' is not written: URDF+ has no springs", l->joint);
    int leader;
    double multiplier, offset;
    if (kmp_export_mimic(w, link, &leader, &multiplier, &offset)) {
        kmp_text_printf(w->text, "    <mimic joint=\"%s\"", w->links[leader].joint);
        kmp_export_attribute(w->text, "multiplier", 1, &multiplier);
        kmp_export_attribute(w->text, "offset", 1, &offset);
        kmp_text_put(w->text, "/>\n");
    }
    kmp_text_put(w->text, "  </joint>\n");
}

static void put_loop(kmp_export *w, int k)
{
    static const char *const sides[2] = {"predecessor", "successor"};
    const kmp_closure *c = &w->model->closures[k];
    const kmp_closure_row *row = kmp_closure_row_of(c);
    const bool turns = row->needs == KMP_NEEDS_SAME_AXIS; /* its frames may turn about the axis */
    if (!row->urdf)
        return;
    const double *axis = c->axis[0], z[3] = {0, 0, 1};
    bool same = memcmp(c->axis[0], c->axis[1], sizeof c->axis[0]) == 0 || !turns;
    kmp_text_printf(w->text, "  <loop name=\"%s\" type=\"%s\">\n", c->name, row->urdf);
    for (int end = 0; end < 2; end++) {
        kmp_pose f = kmp_export_point(w, c->point[end]), own = kmp_frame_none();
        if (!same) {
            kmp_complete_axes(2, c->axis[end], own.r);
            f = kmp_frame_in(&f, &own);
        }
        kmp_text_printf(w->text, "    <%s link=\"%s\">\n", sides[end],
                        w->links[w->of_body[w->model->points[c->point[end]].body]].name);
        put_origin(w->text, "      ", &f);
        kmp_text_printf(w->text, "    </%s>\n", sides[end]);
    }
    if (turns || row->needs == KMP_NEEDS_AXIS)
        put_axis(w->text, same ? axis : z);
    kmp_text_put(w->text, "  </loop>\n");
    w->said[k] = true;
}

void kmp_urdf_write(kmp_export *w)
{
    const double usual[3] = {0, 0, -9.81};
    const kmp_number *g = w->model->gravity;
    kmp_text_put(w->text, "<?xml version=\"1.0\"?>\n<robot name=\"");
    kmp_export_name(w->text, w->model->name);
    kmp_text_put(w->text, "\">\n");
    for (int k = 0; k < w->count; k++)
        put_link(w, k);
    for (int k = 1; k < w->count; k++)
        put_joint(w, k);
    for (int k = 0; k < w->model->closure_count; k++)
        put_loop(w, k);
    kmp_text_put(w->text, "</robot>\n");
    if (g[0].value != usual[0] || g[1].value != usual[1] || g[2].value != usual[2])
        kmp_export_leave_out(w, "gravity [%g, %g, %g] is not written: readers of URDF+ take [0, 0, -9.81]", g[0].value,
                             g[1].value, g[2].value);
}
