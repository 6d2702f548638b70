/* SPDX-License-Identifier: BSD-3-Clause */
/* A model in MJCF, the format of MuJoCo. A body has all motions of its chain as joints. Loops are equalities between
 * sites, which MuJoCo keeps by soft forces: a hinge is two points of its axis. */
#include "exchange/formats/foreign_frames.h"
#include "exchange/formats/written_tree.h"
#include "model/data/closure_table.h"
#include "model/data/model.h"

static void put_place(kmp_text *text, const kmp_pose *f)
{
    kmp_export_attribute(text, "pos", 3, f->p);
    if (kmp_frame_is_turned(f)) {
        double xyzw[4];
        kmp_pose_quaternion(f, NULL, xyzw);
        const double wxyz[4] = {xyzw[3], xyzw[0], xyzw[1], xyzw[2]};
        kmp_export_attribute(text, "quat", 4, wxyz);
    }
}

static void indent(kmp_text *text, int depth)
{
    kmp_text_printf(text, "%*s", 2 * depth + 4, "");
}

/* Pairs of sites: two along the axis of a hinge; one for a weld, which the format has. */
static int count_pairs(const kmp_closure *c)
{
    const int balls = kmp_closure_row_of(c)->balls;
    return balls == 3 ? 1 : balls;
}

/* -- bodies -------------------------------------------------------------------------------------------- */

static void put_joint(const kmp_export *w, const char *name, bool turns, const double axis[3], const kmp_writer_link *l,
                      int depth)
{
    indent(w->text, depth);
    kmp_text_printf(w->text, "<joint name=\"%s\" type=\"%s\"", name, turns ? "hinge" : "slide");
    kmp_export_attribute(w->text, "axis", 3, axis);
    if (l && l->damping != 0)
        kmp_export_attribute(w->text, "damping", 1, &l->damping);
    if (l && l->stiffness != 0) {
        kmp_export_attribute(w->text, "stiffness", 1, &l->stiffness);
        kmp_export_attribute(w->text, "springref", 1, &l->rest);
    }
    if (l && l->friction != 0)
        kmp_export_attribute(w->text, "frictionloss", 1, &l->friction);
    if (l && l->armature != 0)
        kmp_export_attribute(w->text, "armature", 1, &l->armature);
    kmp_text_put(w->text, "/>\n");
}

static void put_joints(const kmp_export *w, int first, int link, int depth)
{
    const kmp_writer_link *l = &w->links[link];
    for (int k = first; k <= link; k++)
        if (w->links[k].kind == KMP_WRITER_TURNS || w->links[k].kind == KMP_WRITER_SLIDES) {
            put_joint(w, w->links[k].joint, w->links[k].kind == KMP_WRITER_TURNS, w->links[k].axis, &w->links[k],
                      depth);
            w->links[k].armature = 0;
        }
    for (int k = 0; l->kind == KMP_WRITER_FREE && k < 6; k++) {
        const double axis[3] = {k % 3 == 0, k % 3 == 1, k % 3 == 2};
        kmp_text name = {0};
        kmp_export_name(&name, w->model->motions[w->model->bodies[l->body].first_motion + k].name);
        put_joint(w, name.s ? name.s : "", k >= 3, axis, NULL, depth);
        w->text->failed = w->text->failed || name.failed;
        kmp_text_free(&name);
    }
}

static void put_mass(const kmp_export *w, int link, int depth)
{
    double mass, com[3], inertia[6];
    if (!kmp_export_mass(w, link, &mass, com, inertia))
        return;
    indent(w->text, depth);
    kmp_text_put(w->text, "<inertial");
    kmp_export_attribute(w->text, "pos", 3, com);
    kmp_export_attribute(w->text, "mass", 1, &mass);
    bool principal = inertia[3] == 0 && inertia[4] == 0 && inertia[5] == 0;
    kmp_export_attribute(w->text, principal ? "diaginertia" : "fullinertia", principal ? 3 : 6, inertia);
    kmp_text_put(w->text, "/>\n");
}

/* Half lengths; pictures touch nothing. */
static void put_pictures(kmp_export *w, int link, int depth)
{
    kmp_writer_shape s;
    for (int k = 0; k < w->model->shape_count; k++) {
        if (!kmp_export_shape(w, k, link, true, &s))
            continue;
        double half[3] = {s.size[0], s.size[1] / 2, s.size[2]};
        for (int i = 0; i < 3 && s.kind == KMP_SHAPE_BOX; i++)
            half[i] = s.size[i] / 2;
        bool three = s.kind == KMP_SHAPE_BOX || s.kind == KMP_SHAPE_ELLIPSOID;
        indent(w->text, depth);
        kmp_text_printf(w->text, "<geom type=\"%s\" contype=\"0\" conaffinity=\"0\"", kmp_shape_words[s.kind]);
        put_place(w->text, &s.at);
        if (s.mesh)
            kmp_text_printf(w->text, " mesh=\"shape_%d\"", k + 1);
        else
            kmp_export_attribute(w->text, "size",
                                 three                        ? 3
                                 : s.kind == KMP_SHAPE_SPHERE ? 1
                                                              : 2,
                                 s.kind == KMP_SHAPE_ELLIPSOID ? s.size : half);
        if (s.coloured)
            kmp_export_attribute(w->text, "rgba", 4, s.rgba);
        kmp_text_put(w->text, "/>\n");
    }
}

/* The points of loops on a link: LOOP_1 and LOOP_2, and further ones along the axis of a hinge, LOOP_3 and LOOP_4. */
static void put_sites(const kmp_export *w, int link, int depth)
{
    for (int k = 0; k < w->model->closure_count; k++) {
        const kmp_closure *c = &w->model->closures[k];
        for (int end = 0; count_pairs(c) > 0 && end < 2; end++) {
            if (w->of_body[w->model->points[c->point[end]].body] != link)
                continue;
            kmp_pose f = kmp_export_point(w, c->point[end]);
            for (int more = 0; more < count_pairs(c); more++) {
                double along[3];
                kmp_frame_vector(&f, c->axis[end], along);
                for (int i = 0; i < 3 && more == 1; i++)
                    f.p[i] += along[i];
                indent(w->text, depth);
                kmp_text_printf(w->text, "<site name=\"%s_%d\"", c->name, 1 + end + 2 * more);
                put_place(w->text, &f);
                kmp_text_put(w->text, "/>\n");
            }
        }
    }
}

/* Points that no joint and no loop ends at. */
static void put_points(kmp_export *w, int link, int depth)
{
    for (int k = 0; k < w->model->point_count; k++) {
        const char *name = w->of_body[w->model->points[k].body] == link ? kmp_export_point_name(w, k) : NULL;
        if (!name)
            continue;
        kmp_pose f = kmp_export_point(w, k);
        indent(w->text, depth);
        kmp_text_printf(w->text, "<site name=\"%s\"", name);
        put_place(w->text, &f);
        kmp_text_put(w->text, "/>\n");
    }
}

static void put_parts(kmp_export *w, int link, int depth)
{
    put_pictures(w, link, depth);
    put_sites(w, link, depth);
    put_points(w, link, depth);
}

/* All bodies, each inside the one that carries it. One has the motions of all links of its chain. */
static void put_bodies(kmp_export *w)
{
    const kempe_model *model = w->model;
    int *next = KMP_ARENA_NEW(&w->arena, int, model->body_count), depth = 0, at = 0;
    for (int b = 0; next && b < model->body_count; b++)
        next[b] = b + 1; /* the bodies before it have been looked at */
    while (next) {
        int child = next[at];
        while (child < model->body_count && model->bodies[child].parent != at)
            child++;
        next[at] = child + 1;
        if (child < model->body_count) {
            int link = w->of_body[child], first = link;
            while (w->links[first].parent != w->of_body[at])
                first = w->links[first].parent;
            indent(w->text, depth);
            kmp_text_printf(w->text, "<body name=\"%s\"", w->links[link].name);
            put_place(w->text, &w->links[first].at);
            kmp_text_put(w->text, ">\n");
            depth++;
            put_joints(w, first, link, depth);
            put_mass(w, link, depth);
            put_parts(w, link, depth);
            at = child;
        } else if (at > 0) {
            indent(w->text, --depth);
            kmp_text_put(w->text, "</body>\n");
            at = model->bodies[at].parent;
        } else
            return;
    }
}

static void put_meshes(const kmp_export *w)
{
    bool any = false;
    for (int k = 0; k < w->model->shape_count; k++) {
        const kmp_shape *s = &w->model->shapes[k];
        if (!s->mesh)
            continue;
        const double scale[3] = {s->scale.value, s->scale.value, s->scale.value};
        kmp_text_printf(w->text, "%s    <mesh name=\"shape_%d\" file=\"", any ? "" : "  <asset>\n", k + 1);
        kmp_export_text(w->text, s->mesh->path);
        kmp_text_put(w->text, "\"");
        kmp_export_attribute(w->text, "scale", 3, scale);
        kmp_text_put(w->text, "/>\n");
        any = true;
    }
    kmp_text_put(w->text, any ? "  </asset>\n" : "");
}

static void put_equalities(kmp_export *w)
{
    for (int k = 0; k < w->model->closure_count; k++) {
        const kmp_closure *c = &w->model->closures[k];
        int link, leader;
        double poly[5] = {0};
        for (int pair = 0; pair < count_pairs(c); pair++)
            kmp_text_printf(w->text, "    <%s site1=\"%s_%d\" site2=\"%s_%d\"/>\n",
                            kmp_closure_row_of(c)->balls == 3 ? "weld" : "connect", c->name, 1 + 2 * pair, c->name,
                            2 + 2 * pair);
        bool follows = kmp_export_follower(w, c, &link, &leader, &poly[1], &poly[0]);
        if (follows) {
            kmp_text_printf(w->text, "    <joint joint1=\"%s\" joint2=\"%s\"", w->links[link].joint,
                            w->links[leader].joint);
            kmp_export_attribute(w->text, "polycoef", 5, poly);
            kmp_text_put(w->text, "/>\n");
        }
        w->said[k] = count_pairs(c) > 0 || follows;
    }
}

void kmp_mjcf_write(kmp_export *w)
{
    double gravity[3];
    for (int k = 0; k < 3; k++)
        gravity[k] = w->model->gravity[k].value;
    kmp_text_put(w->text, "<mujoco model=\"");
    kmp_export_name(w->text, w->model->name);
    kmp_text_put(w->text, "\">\n  <compiler angle=\"radian\" inertiafromgeom=\"false\"/>\n  <option");
    kmp_export_attribute(w->text, "gravity", 3, gravity);
    kmp_text_put(w->text, "/>\n");
    put_meshes(w);
    kmp_text_put(w->text, "  <worldbody>\n");
    put_parts(w, 0, 0);
    put_bodies(w);
    kmp_text_put(w->text, "  </worldbody>\n  <equality>\n");
    put_equalities(w);
    kmp_text_put(w->text, "  </equality>\n</mujoco>\n");
}
