/* SPDX-License-Identifier: BSD-3-Clause */
/* A model in MJCF, the format of MuJoCo. A body has all motions of its chain as joints. Loops are equalities between
 * sites, which MuJoCo keeps by soft forces: a hinge is two points of its axis. */
#include "exchange/formats/foreign_frames.h"
#include "exchange/formats/mjcf.h"
#include "exchange/formats/written_tree.h"
#include "linalg/dense/dot.h"
#include "linalg/dense/three.h"
#include "model/data/closure_table.h"
#include "model/data/model.h"
#include "model/data/rope.h"
#include "model/language/expression_value.h"

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

/* -- tendons ------------------------------------------------------------------------------------------- */

/* True for a rope that only pulls, or is a path, over points, spheres and smooth cylinders: MuJoCo's tendon. */
static bool has_tendon(const kmp_rope *rope)
{
    bool has = !rope->closed && rope->kind != KMP_ROPE_TAUT && !rope->damped &&
               (!rope->length || kmp_expr_is_constant(rope->length));
    for (int k = 0; k < rope->count; k++)
        has = has && (rope->places[k].turn == 0 || rope->places[k].ball || rope->places[k].helix);
    return has;
}

/* The side of a cylinder on which the rope lies at the start: to the right of a way that turns left; in the link. */
static void find_side(kmp_export *w, const kmp_rope *rope, int k, double side[3])
{
    const kempe_model *model = w->model;
    kmp_pose pose[3], *poses = KMP_ARENA_NEW(&w->arena, kmp_pose, model->body_count);
    double *q = KMP_ARENA_NEW(&w->arena, double, model->motion_count + 1), along[3], own[3], left[3];
    if (!poses || !q)
        return;
    for (int i = 0; i < model->motion_count; i++)
        q[i] = model->start.q[i].value;
    kmp_pose_all(model, q, poses);
    for (int i = 0; i < 3; i++)
        kmp_pose_of_point(model, poses, q, rope->places[k + i - 1].point, &pose[i]);
    for (int i = 0; i < 3; i++)
        along[i] = pose[2].p[i] - pose[0].p[i];
    for (int i = 0; i < 3; i++)
        own[i] = pose[1].r[0][i] * along[0] + pose[1].r[1][i] * along[1] + pose[1].r[2][i] * along[2];
    const double axis[3] = {rope->places[k].axis == 0, rope->places[k].axis == 1, rope->places[k].axis == 2};
    kmp_cross3(axis, own, left);
    const kmp_pose f = kmp_export_point(w, rope->places[k].point);
    const double far = -2 * rope->places[k].turn * rope->places[k].radius.value / sqrt(kmp_dot(3, left, left));
    kmp_frame_vector(&f, left, side);
    for (int i = 0; i < 3; i++)
        side[i] = f.p[i] + far * side[i];
}

static void put_tendon_name(kmp_text *text, const kmp_rope *rope, int k, const char *end)
{
    kmp_text_put(text, "\"tendon_");
    kmp_export_name(text, rope->name);
    kmp_text_printf(text, "_%d%s\"", k + 1, end);
}

/* Sites and geoms of a rope on a link. */
static void put_tendon_places(kmp_export *w, const kmp_rope *rope, int link, int depth)
{
    for (int k = 0; k < rope->count; k++) {
        const kmp_rope_place *place = &rope->places[k];
        kmp_pose f = kmp_export_point(w, place->point);
        const double axis[3] = {place->axis == 0, place->axis == 1, place->axis == 2};
        double size[2] = {place->radius.value, place->radius.value}, z[3];
        if (w->of_body[w->model->points[place->point].body] != link)
            continue;
        if (place->helix && place->axis != 2) {
            kmp_frame_vector(&f, axis, z);
            (void)kmp_mjcf_along(z, f.r);
        }
        indent(w->text, depth);
        kmp_text_put(w->text, place->turn == 0 ? "<site name=" : "<geom contype=\"0\" conaffinity=\"0\" name=");
        put_tendon_name(w->text, rope, k, "");
        put_place(w->text, &f);
        if (place->turn != 0) {
            kmp_text_printf(w->text, " type=\"%s\"", place->ball ? "sphere" : "cylinder");
            kmp_export_attribute(w->text, "size", place->ball ? 1 : 2, size);
        }
        kmp_text_put(w->text, "/>\n");
        if (!place->helix)
            continue;
        find_side(w, rope, k, z);
        indent(w->text, depth);
        kmp_text_put(w->text, "<site name=");
        put_tendon_name(w->text, rope, k, "_side");
        kmp_export_attribute(w->text, "pos", 3, z);
        kmp_text_put(w->text, "/>\n");
    }
}

/* An inextensible rope has a limit, an elastic one a spring that only pulls. */
static void put_tendon(kmp_export *w, const kmp_rope *rope)
{
    double law[2] = {0, rope->at_start}, stiffness = rope->stiffness.value;
    const double preload = rope->preload.value / (rope->kind == KMP_ROPE_ELASTIC ? stiffness : 1);
    const int force = kmp_name_find(KMP_NAMED(w->model, force), rope->name);
    kmp_text_put(w->text, "    <spatial name=\"");
    kmp_export_name(w->text, rope->name);
    kmp_text_put(w->text, "\"");
    if (rope->kind == KMP_ROPE_ELASTIC) {
        law[1] = rope->length ? law[1] : rope->axial ? law[1] / (1 + preload) : law[1] - preload;
        stiffness /= rope->axial ? law[1] : 1;
        kmp_export_attribute(w->text, "stiffness", 1, &stiffness);
        kmp_export_attribute(w->text, "springlength", 2, law);
    } else if (rope->kind == KMP_ROPE_PULLS) {
        kmp_export_attribute(w->text, "range", 2, law);
        kmp_text_put(w->text, " limited=\"true\"");
    }
    kmp_text_put(w->text, ">\n");
    for (int k = 0; k < rope->count; k++) {
        const bool round = rope->places[k].turn != 0;
        kmp_text_put(w->text, round ? "      <geom geom=" : "      <site site=");
        put_tendon_name(w->text, rope, k, "");
        if (rope->places[k].helix) {
            kmp_text_put(w->text, " sidesite=");
            put_tendon_name(w->text, rope, k, "_side");
        }
        kmp_text_put(w->text, "/>\n");
    }
    kmp_text_put(w->text, "    </spatial>\n");
    if (force >= 0 && rope->kind != KMP_ROPE_LAW)
        w->said_force[force] = true;
}

static void put_tendons(kmp_export *w)
{
    bool any = false;
    for (int k = 0; k < w->model->rope_count; k++) {
        w->said_rope[k] = has_tendon(&w->model->ropes[k]);
        if (!w->said_rope[k])
            continue;
        kmp_text_put(w->text, any ? "" : "  <tendon>\n");
        put_tendon(w, &w->model->ropes[k]);
        any = true;
    }
    kmp_text_put(w->text, any ? "  </tendon>\n" : "");
}

/* -- the whole ----------------------------------------------------------------------------------------- */

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
    for (int k = 0; k < w->model->rope_count; k++)
        if (has_tendon(&w->model->ropes[k]))
            put_tendon_places(w, &w->model->ropes[k], link, depth);
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
    kmp_text_put(w->text, "  </equality>\n");
    put_tendons(w);
    kmp_text_put(w->text, "</mujoco>\n");
}
