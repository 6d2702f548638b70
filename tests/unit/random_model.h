/* SPDX-License-Identifier: BSD-3-Clause */
/* Random spatial mechanisms with loops and forces, read by the reader; and their kinematics and energies once
 * more, plainly: rotation matrices by Rodrigues' formula, one motion after the other, rates by differences. */
#ifndef KEMPE_TESTS_RANDOM_MODEL_H
#define KEMPE_TESTS_RANDOM_MODEL_H

#include "base/memory.h"
#include "base/text.h"
#include "model/data/body.h"
#include "random_text.h"
#include <math.h>

#include <stdio.h>
#include <string.h>

/* -- the model --------------------------------------------------------------------------------------- */

/* a - rate qd(motion) - slope q(other), the first times cos 3 t when the model is not conservative. */
typedef struct effort {
    int motion, other;
    double a, rate, slope;
    bool conservative;
} effort;

typedef struct random_model {
    kempe_context *context;
    kempe_model *model;
    effort efforts[2];
    int effort_count;
} random_model;

static inline double effort_value(const effort *e, double t, const double *q, const double *qd)
{
    return e->conservative ? e->a : e->a * cos(3 * t) - e->rate * qd[e->motion] - e->slope * q[e->other];
}

static inline void put_efforts(kmp_text *text, random_model *r, unsigned flags)
{
    const kempe_model *model = r->model;
    for (int k = 0; k < 2; k++) {
        effort e = {pick(kmp_model_motion_count(model)),
                    pick(kmp_model_motion_count(model)),
                    between(-3, 3),
                    between(0, 1),
                    between(0, 1),
                    !(flags & MODEL_DAMPING)};
        const kmp_motion *motion = kmp_model_motion(model, e.motion);
        kmp_text_printf(text, "  e%d: {joint: %s, %s: \"%.17g", k, motion->name, motion->rotation ? "torque" : "force",
                        e.a);
        if (!e.conservative)
            kmp_text_printf(text, "*cos(3*t) - %.17g*qd(%s) - %.17g*q(%s)", e.rate, motion->name, e.slope,
                            kmp_model_motion(model, e.other)->name);
        kmp_text_put(text, "\"}\n");
        r->efforts[r->effort_count++] = e;
    }
}

/* Their squares are written down in test_equations.c. */
static const char *const random_curves[] = {"table: f", "y: 0.4*x^2 - sin(x)", "y: 0.4*x^2 - sin(x), z: cos(x)*x",
                                            "curve: x^2/4 + y^2 - z*x - 1, power: 2",
                                            "curve: [x*y - z^2 + 0.3, sin(x) + y*z], power: 0"};

/* Values that a kind takes beside its name. */
static inline void put_needs(kmp_text *text, const kempe_model *model, const char *name, const char *needs,
                             unsigned flags)
{
    if (strcmp(needs, "TERMS") == 0 || strcmp(needs, "EXPRESSION") == 0) {
        const char *a = kmp_model_motion(model, pick(kmp_model_motion_count(model)))->name;
        const char *b = kmp_model_motion(model, pick(kmp_model_motion_count(model)))->name;
        bool different = strcmp(a, b) != 0;
        if (needs[0] == 'T' && different)
            kmp_text_printf(text, "%s: {%s: 1.5, %s: -0.7}, equals: 0.3", name, a, b);
        else
            kmp_text_printf(text, "constraint: \"sin(q(%s))*q(%s) + cos(q(%s)) - 0.3\"", a, b, b);
    }
    if (strcmp(needs, "NUMBER") == 0) {
        kmp_text_put(text, ", length: ");
        put_number(text, between(0.3, 2), flags);
    }
    if (strcmp(needs, "AXIS") == 0)
        kmp_text_printf(text, ", axis: %s", random_axes[pick(8)]);
    if (strcmp(needs, "SAME_AXIS") == 0 || strcmp(needs, "TWO_AXES") == 0 || strcmp(needs, "SHAFTS") == 0)
        kmp_text_printf(text, ", axes: [%s, %s]", random_axes[pick(8)], random_axes[pick(8)]);
    if (strcmp(needs, "CURVE") == 0)
        kmp_text_printf(text, ", %s", random_curves[pick(5)]);
}

/* Two rows of closure_kinds.def, by the seed, so that all have their turn; plain ones are the first two: ball and rod.
 */
static inline void put_loops(kmp_text *text, const kempe_model *model, uint64_t seed, int bodies, unsigned flags)
{
    static const struct {
        const char *name, *needs;
    } kinds[] = {
#define KMP_CLOSURE(name, needs, ...) {#name, #needs},
#include "model/data/closure_kinds.def"
#undef KMP_CLOSURE
    };
    kmp_text_put(text, "loops:\n");
    for (unsigned k = 0; k < 2; k++) {
        /* The last kind, a follower, needs an outline: test_cams.c has those. */
        size_t kind = flags & MODEL_PLAIN ? (size_t)pick(2) : (seed + 5 * k) % (sizeof kinds / sizeof *kinds - 1);
        kmp_text_printf(text, "  L%u: {", k);
        if (strcmp(kinds[kind].needs, "TERMS") != 0 && strcmp(kinds[kind].needs, "EXPRESSION") != 0) {
            kmp_text_printf(text, "%s: ", kinds[kind].name);
            put_pair(text, bodies);
        }
        put_needs(text, model, kinds[kind].name, kinds[kind].needs, flags);
        kmp_text_put(text, "}\n");
    }
    if (flags & MODEL_DRIVES) { /* h_t of it changes with q */
        const char *a = kmp_model_motion(model, pick(kmp_model_motion_count(model)))->name;
        const char *b = kmp_model_motion(model, pick(kmp_model_motion_count(model)))->name;
        kmp_text_printf(text, "  T: {constraint: \"sin(q(%s) + q(%s) + 2*t + 0.2) + 0.3*t*q(%s)^2\"}\n", a, b, a);
    }
}

static inline void put_drive(kmp_text *text, const kempe_model *model, unsigned flags)
{
    const kmp_motion *motion = kmp_model_motion(model, pick(kmp_model_motion_count(model)));
    kmp_text_printf(text, "drives: {d: {joint: %s, %s: \"%s\"}}\n", motion->name,
                    motion->rotation ? "angle" : "displacement",
                    flags & MODEL_SYMBOLS ? "0.3*a*sin(2*t) + b*t^2 - 0.1*a*b" : "0.3*sin(2*t) + t^2 - 0.1");
}

/* Read twice: loops and efforts need the names of the coordinates. */
static inline random_model random_model_new(uint64_t seed, int bodies, unsigned flags)
{
    random_model r = {.context = kempe_context_new()};
    kmp_text text = {0};
    put_frame(&text, seed, bodies, flags);
    kempe_model *bare = NULL;
    if (kempe_model_read_text(r.context, text.s, "random", &bare) == KEMPE_OK) {
        r.model = bare;
        if (flags & MODEL_LOOPS)
            put_loops(&text, bare, seed / 2, bodies, flags);
        if (flags & MODEL_FORCES) {
            kmp_text_put(&text, "forces:\n");
            put_springs(&text, bodies, flags);
            put_efforts(&text, &r, flags);
            if (flags & MODEL_BUSHINGS)
                put_bushings(&text, bodies, flags);
        }
        if (flags & MODEL_DRIVES)
            put_drive(&text, bare, flags);
        put_run(&text, bodies, flags & MODEL_LOOPS);
        r.model = NULL;
        (void)kempe_model_read_text(r.context, text.s, "random", &r.model);

        kempe_model_free(bare);
    }
    if (!r.model)
        printf("seed %d: %s\n%s\n", (int)seed, kempe_context_message(r.context), text.s);
    kmp_text_free(&text);
    return r;
}

static inline void random_model_free(random_model *r)
{
    kempe_model_free(r->model);
    kempe_context_free(r->context);
}

/* -- plain kinematics -------------------------------------------------------------------------------- */

typedef struct pose {
    double r[3][3], x[3]; /* body axes to ground axes; the origin */
} pose;

static inline void pose_apply(const pose *p, const double v[3], double out[3])
{
    for (int i = 0; i < 3; i++)
        out[i] = p->x[i] + p->r[i][0] * v[0] + p->r[i][1] * v[1] + p->r[i][2] * v[2];
}

/* r <- r m, with m by rows */
static inline void pose_multiply(pose *p, const double *m)
{
    double r[3][3];
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++) {
            r[i][j] = 0;
            for (int k = 0; k < 3; k++)
                r[i][j] += p->r[i][k] * m[3 * k + j];
        }
    memcpy(p->r, r, sizeof r);
}

/* r <- r (1 + sin e~ + (1 - cos) e~ e~) */
static inline void pose_turn(pose *p, const double e[3], double angle)
{
    double cross[3][3] = {{0, -e[2], e[1]}, {e[2], 0, -e[0]}, {-e[1], e[0], 0}}, turn[3][3];
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++) {
            double square = 0;
            for (int k = 0; k < 3; k++)
                square += cross[i][k] * cross[k][j];
            turn[i][j] = (i == j) + sin(angle) * cross[i][j] + (1 - cos(angle)) * square;
        }
    pose_multiply(p, &turn[0][0]);
}

/* r <- r m', likewise */
static inline void pose_turn_back(pose *p, const double *m)
{
    double back[3][3];
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++)
            back[i][j] = m[3 * j + i];
    pose_multiply(p, &back[0][0]);
}

static inline void number_values(const kmp_number *number, double *value)
{
    for (int k = 0; k < 3; k++)
        value[k] = number[k].value;
}

static inline void plain_poses(const kempe_model *model, const double *q, pose *p)
{
    p[0] = (pose){{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, {0, 0, 0}};
    for (int b = 1; b < kmp_model_body_count(model); b++) {
        const kmp_body *body = kmp_model_body(model, b);
        double at[3] = {0}, slide[3];
        if (body->at >= 0)
            number_values(kmp_model_point(model, body->at)->at, at);
        p[b] = p[body->parent];
        pose_apply(&p[body->parent], at, p[b].x);
        if (body->at >= 0 && kmp_model_point(model, body->at)->turned)
            pose_multiply(&p[b], &kmp_model_point(model, body->at)->axes[0][0]);
        if (body->turned && !body->reversed)
            pose_multiply(&p[b], &body->frame[0][0]);
        for (int k = body->first_motion; k < body->first_motion + body->motion_count; k++) {
            const kmp_motion *motion = kmp_model_motion(model, k);
            for (int i = 0; i < 3; i++)
                slide[i] = q[k] * motion->axis[i];
            if (motion->rotation)
                pose_turn(&p[b], motion->axis, q[k]);
            else
                pose_apply(&p[b], slide, p[b].x);
        }
        if (body->turned && body->reversed)
            pose_turn_back(&p[b], &body->frame[0][0]);
        if (body->to < 0)
            continue;
        if (kmp_model_point(model, body->to)->turned)
            pose_turn_back(&p[b], &kmp_model_point(model, body->to)->axes[0][0]);
        for (int i = 0; i < 3; i++)
            at[i] = -kmp_model_point(model, body->to)->at[i].value;
        pose_apply(&p[b], at, p[b].x);
    }
}

static inline void plain_point(const kempe_model *model, const pose *p, int point, double x[3])
{
    double at[3];
    number_values(kmp_model_point(model, point)->at, at);
    pose_apply(&p[kmp_model_point(model, point)->body], at, x);
}

/* v of a point's own axes, in ground axes. */
static inline void plain_direction(const kempe_model *model, const pose *p, int point, const double v[3], double out[3])
{
    pose axes = p[kmp_model_point(model, point)->body];
    if (kmp_model_point(model, point)->turned)
        pose_multiply(&axes, &kmp_model_point(model, point)->axes[0][0]);
    for (int i = 0; i < 3; i++)
        out[i] = axes.r[i][0] * v[0] + axes.r[i][1] * v[1] + axes.r[i][2] * v[2];
}

static inline double plain_distance(const kempe_model *model, const double *q, const int point[2])
{
    pose p[MODEL_MAX_BODIES];
    double a[3], b[3], square = 0;
    plain_poses(model, q, p);
    plain_point(model, p, point[0], a);
    plain_point(model, p, point[1], b);
    for (int k = 0; k < 3; k++)
        square += (a[k] - b[k]) * (a[k] - b[k]);
    return sqrt(square);
}

/* -- differences ------------------------------------------------------------------------------------- */

typedef void field(void *user, const double *x, double *out);

/* Derivative of `count` values along a direction at x (n), central with two extrapolations. */
static inline void difference(field *f, void *user, int n, const double *x, const double *direction, int count,
                              double *out)
{
    enum { MOST = 4096 };
    static double table[3][MOST], up[MOST], down[MOST];
    double moved[MODEL_MAX_N];
    for (int level = 0; level < 3; level++) {
        double h = ldexp(1e-2, -level);
        for (int k = 0; k < n; k++)
            moved[k] = x[k] + h * direction[k];
        f(user, moved, up);
        for (int k = 0; k < n; k++)
            moved[k] = x[k] - h * direction[k];
        f(user, moved, down);
        for (int k = 0; k < count; k++)
            table[level][k] = (up[k] - down[k]) / (2 * h);
    }
    for (int k = 0; k < count; k++) {
        double first = (4 * table[1][k] - table[0][k]) / 3, second = (4 * table[2][k] - table[1][k]) / 3;
        out[k] = (16 * second - first) / 15;
    }
}

/* Poses and points as one row of numbers. */
typedef struct posed {
    const kempe_model *model;
} posed;

static inline void pose_field(void *user, const double *q, double *out)
{
    const kempe_model *model = ((posed *)user)->model;
    pose p[MODEL_MAX_BODIES];
    plain_poses(model, q, p);
    memcpy(out, p, (size_t)kmp_model_body_count(model) * sizeof *p);
}

/* w of w~ = dr r', in body axes: r' w. */
static inline void spin_in_body(const pose *p, const pose *rate, double w[3])
{
    double s[3][3] = {{0}}; /* r' dr */
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++)
            for (int k = 0; k < 3; k++)
                s[i][j] += p->r[k][i] * rate->r[k][j];
    w[0] = (s[2][1] - s[1][2]) / 2;
    w[1] = (s[0][2] - s[2][0]) / 2;
    w[2] = (s[1][0] - s[0][1]) / 2;
}

/* sum of m v v / 2 + w I w / 2, poses differentiated numerically. */
static inline double plain_kinetic(const kempe_model *model, const double *q, const double *qd)
{
    static const int entry[3][3] = {{0, 3, 4}, {3, 1, 5}, {4, 5, 2}};
    posed user = {model};
    pose p[MODEL_MAX_BODIES], rate[MODEL_MAX_BODIES];
    double energy = 0, com[3], v[3], w[3];
    plain_poses(model, q, p);
    difference(pose_field, &user, kmp_model_motion_count(model), q, qd, 12 * kmp_model_body_count(model),
               &rate[0].r[0][0]);
    for (int b = 1; b < kmp_model_body_count(model); b++) {
        const kmp_body *body = kmp_model_body(model, b);
        number_values(body->com, com);
        pose_apply(&rate[b], com, v);
        spin_in_body(&p[b], &rate[b], w);
        for (int i = 0; i < 3; i++) {
            energy += body->mass.value * v[i] * v[i] / 2;
            for (int j = 0; j < 3; j++)
                energy += w[i] * body->inertia[entry[i][j]].value * w[j] / 2;
        }
    }
    return energy;
}

#endif
