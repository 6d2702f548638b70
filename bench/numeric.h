/* SPDX-License-Identifier: BSD-3-Clause */
/* A plain numeric program, to compare with: recursive Newton/Euler for c and the inverse dynamics, composite bodies for
 * M (Luh, Walker and Paul 1980; Walker and Orin 1982; Featherstone 2008, chapters 5 and 6). It reads the tree of links
 * once and then knows what any such program may know: one motion a link, about or along one of its axes; constant
 * rotations that are none, offsets that are zero and links without mass are left out; moments are taken about the
 * link's origin; M is made for ancestors alone; what is done at a joint is written out for each of its three axes, so
 * that vectors stay in registers. Nothing is allocated after numeric_init.
 *
 * Rates are those of the link's own axes; a is the acceleration of its origin less gravity, at qdd = 0 or with qdd. */
#ifndef KEMPE_BENCH_NUMERIC_H
#define KEMPE_BENCH_NUMERIC_H

#include "backend/sincos.h"
#include "base/memory.h"
#include "dynamics/kinematics/link_tree.h"
#include <string.h>

typedef struct numeric_link {
    int parent, x, kind; /* x: the axis of the joint; kind: x, and 3 more for a translation */
    bool rotation, turned, offset, heavy, loaded, bends; /* loaded: heavy, or carries what is; bends: beta is needed */
    double sign;                                         /* of q */
    double g[3][3], p[3];                                /* v_parent = g v_link at q = 0; to the joint, parent's axes */
    double mass, first[3], second[3][3];                 /* about the link's origin */
} numeric_link;

typedef struct numeric_state {
    double slide; /* along x; zero of a rotation */
    double sine, cosine;
    double w[3], wd[3], a[3], beta[3][3]; /* beta = wd~ + w~ w~ */
    double moment[3], force[3];           /* of the joint, about the link's origin */
    double mass, first[3], second[3][3];  /* of what the joint carries, as if frozen */
} numeric_state;

typedef struct numeric {
    int n, count; /* motions; links with the ground */
    numeric_link *links;
    numeric_state *states;
    double gravity[3];
    double *angle, *sines; /* of rotations, in order; in groups of eight sines, then eight cosines */
    uint32_t *which;       /* 0, 1, .. */
    int angles;
} numeric;

/* -- the tree, once ---------------------------------------------------------------------------------- */

static inline double numeric_value(const kmp_tree *tree, kmp_ref r)
{
    double value = 0;
    (void)kmp_is_const(tree->graph, r, &value);
    return value;
}

static inline void numeric_read_body(const kmp_tree *tree, const kmp_link *from, numeric_link *to)
{
    double com[3], square = 0;
    to->mass = numeric_value(tree, from->mass);
    for (int k = 0; k < 3; k++) {
        com[k] = numeric_value(tree, from->com.x[k]);
        to->first[k] = to->mass * com[k];
        square += com[k] * com[k];
        to->heavy = to->heavy || to->mass != 0;
    }
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++) {
            double own = numeric_value(tree, from->inertia.x[kmp_tensor_at[i][j]]);
            to->heavy = to->heavy || own != 0;
            to->second[i][j] = own + to->mass * ((i == j ? square : 0) - com[i] * com[j]);
        }
}

static inline void numeric_read_link(numeric *p, const kmp_tree *tree, int i)
{
    const kmp_link *from = &tree->links[i];
    numeric_link *to = &p->links[i];
    *to = (numeric_link){.parent = from->parent,
                         .x = from->axis,
                         .kind = from->axis + (from->rotation ? 0 : 3),
                         .rotation = from->rotation,
                         .turned = from->turned,
                         .sign = from->reversed ? -1 : 1};
    for (int k = 0; k < 3; k++) {
        to->p[k] = numeric_value(tree, from->p.x[k]);
        to->offset = to->offset || to->p[k] != 0;
    }
    memcpy(to->g, from->g, sizeof to->g);
    numeric_read_body(tree, from, to);
    to->bends = to->heavy || !to->rotation;
    if (to->offset && to->parent > 0)
        p->links[to->parent].bends = true;
    p->angles += to->rotation;
}

static inline void numeric_free(numeric *p)
{
    kmp_free(p->links);
    kmp_free(p->states);
    kmp_free(p->angle);
    kmp_free(p->sines);
    kmp_free(p->which);
    *p = (numeric){0};
}

/* The tree's numbers are constants (KMP_KEEP_NOTHING), its axes turn with the joints. false: no memory. */
static inline bool numeric_init(numeric *p, const kmp_tree *tree)
{
    *p = (numeric){.n = tree->count - 1, .count = tree->count};
    p->links = KMP_NEW(numeric_link, tree->count);
    p->states = KMP_NEW(numeric_state, tree->count);
    p->angle = KMP_NEW(double, tree->count);
    p->sines = KMP_NEW(double, 2 * (tree->count + 8));
    p->which = KMP_NEW(uint32_t, tree->count + 8);
    if (!p->links || !p->states || !p->angle || !p->sines || !p->which) {
        numeric_free(p);
        return false;
    }
    for (int i = 1; i < tree->count; i++)
        numeric_read_link(p, tree, i);
    for (int k = 0; k < p->angles; k++) /* the last group is filled up with the first angle */
        p->which[k] = (uint32_t)k;
    for (int i = tree->count - 1; i > 0; i--) {
        numeric_link *l = &p->links[i], *h = &p->links[l->parent];
        l->loaded = l->loaded || l->heavy;
        h->loaded = h->loaded || l->loaded;
    }
    for (int k = 0; k < 3; k++)
        p->gravity[k] = numeric_value(tree, tree->gravity.x[k]);
    return true;
}

/* -- joints ------------------------------------------------------------------------------------------ */

#define NUMERIC_INLINE static inline __attribute__((always_inline))

/* Does what stands in DO with the axis and its kind as constants. */
#define NUMERIC_EACH_KIND(kind, DO)                                                                                    \
    switch (kind) {                                                                                                    \
    case 0:                                                                                                            \
        DO(0, true);                                                                                                   \
        break;                                                                                                         \
    case 1:                                                                                                            \
        DO(1, true);                                                                                                   \
        break;                                                                                                         \
    case 2:                                                                                                            \
        DO(2, true);                                                                                                   \
        break;                                                                                                         \
    case 3:                                                                                                            \
        DO(0, false);                                                                                                  \
        break;                                                                                                         \
    case 4:                                                                                                            \
        DO(1, false);                                                                                                  \
        break;                                                                                                         \
    default:                                                                                                           \
        DO(2, false);                                                                                                  \
    }

/* The axes after x. */
#define NUMERIC_AXES const int y = (x + 1) % 3, z = (x + 2) % 3

/* v turned about x, from child to parent with the sine, back with its negative. */
NUMERIC_INLINE void numeric_about(const int x, double cosine, double sine, double v[3])
{
    NUMERIC_AXES;
    double vy = v[y], vz = v[z];
    v[y] = cosine * vy - sine * vz;
    v[z] = sine * vy + cosine * vz;
}

NUMERIC_INLINE void numeric_by(const double g[3][3], double v[3])
{
    double u[3] = {v[0], v[1], v[2]};
    for (int i = 0; i < 3; i++)
        v[i] = g[i][0] * u[0] + g[i][1] * u[1] + g[i][2] * u[2];
}

NUMERIC_INLINE void numeric_by_transposed(const double g[3][3], double v[3])
{
    double u[3] = {v[0], v[1], v[2]};
    for (int i = 0; i < 3; i++)
        v[i] = g[0][i] * u[0] + g[1][i] * u[1] + g[2][i] * u[2];
}

/* sum += a x b */
NUMERIC_INLINE void numeric_add_cross(double sum[3], const double a[3], const double b[3])
{
    sum[0] += a[1] * b[2] - a[2] * b[1];
    sum[1] += a[2] * b[0] - a[0] * b[2];
    sum[2] += a[0] * b[1] - a[1] * b[0];
}

/* -- forward ----------------------------------------------------------------------------------------- */

static inline void numeric_angles(numeric *p, const double *q)
{
    int angle = 0;
    for (int i = 1; i < p->count; i++)
        if (p->links[i].rotation)
            p->angle[angle++] = p->links[i].sign * q[i - 1];
    kmp_sincos_slots((uint32_t)p->angles, p->which, p->angle, p->sines);
    angle = 0;
    for (int i = 1; i < p->count; i++) {
        numeric_state *s = &p->states[i];
        if (p->links[i].rotation) {
            const double *sine = p->sines + 16 * (angle / 8) + angle % 8;
            s->sine = sine[0];
            s->cosine = sine[8];
            angle++;
        } else {
            s->slide = p->links[i].sign * q[i - 1];
        }
    }
}

NUMERIC_INLINE void numeric_set_beta(double beta[3][3], const double w[3], const double wd[3])
{
    double xx = w[0] * w[0], yy = w[1] * w[1], zz = w[2] * w[2];
    double xy = w[0] * w[1], yz = w[1] * w[2], zx = w[2] * w[0];
    beta[0][0] = -(yy + zz);
    beta[1][1] = -(zz + xx);
    beta[2][2] = -(xx + yy);
    beta[0][1] = xy - wd[2];
    beta[1][0] = xy + wd[2];
    beta[1][2] = yz - wd[0];
    beta[2][1] = yz + wd[0];
    beta[2][0] = zx - wd[1];
    beta[0][2] = zx + wd[1];
}

/* Past the joint: rates and accelerations in the link's axes. */
NUMERIC_INLINE void numeric_pass(const int x, const bool rotation, numeric_state *s, double rate, double acceleration,
                                 double w[3], double wd[3], double a[3])
{
    NUMERIC_AXES;
    if (rotation) {
        numeric_about(x, s->cosine, -s->sine, w);
        numeric_about(x, s->cosine, -s->sine, wd);
        numeric_about(x, s->cosine, -s->sine, a);
        wd[x] += acceleration;
        wd[y] += w[z] * rate;
        wd[z] -= w[y] * rate;
        w[x] += rate;
    } else { /* with the column x of beta */
        a[x] += acceleration - (w[y] * w[y] + w[z] * w[z]) * s->slide;
        a[y] += (w[x] * w[y] + wd[z]) * s->slide + 2 * w[z] * rate;
        a[z] += (w[z] * w[x] - wd[y]) * s->slide - 2 * w[y] * rate;
    }
}

static inline void numeric_forward(numeric *p, int i, double rate, double acceleration)
{
    const numeric_link *l = &p->links[i];
    numeric_state *s = &p->states[i];
    const numeric_state *h = &p->states[l->parent];
    double w[3], wd[3], a[3];
    memcpy(w, h->w, sizeof w);
    memcpy(wd, h->wd, sizeof wd);
    memcpy(a, h->a, sizeof a);
    if (l->offset && l->parent > 0)
        for (int k = 0; k < 3; k++)
            a[k] += h->beta[k][0] * l->p[0] + h->beta[k][1] * l->p[1] + h->beta[k][2] * l->p[2];
    if (l->turned) {
        numeric_by_transposed(l->g, w);
        numeric_by_transposed(l->g, wd);
        numeric_by_transposed(l->g, a);
    }
#define PASS(x, rotation) numeric_pass(x, rotation, s, rate, acceleration, w, wd, a)
    NUMERIC_EACH_KIND(l->kind, PASS)
#undef PASS
    if (l->bends)
        numeric_set_beta(s->beta, w, wd);
    memcpy(s->w, w, sizeof w);
    memcpy(s->wd, wd, sizeof wd);
    memcpy(s->a, a, sizeof a);
}

/* Its own share: f = m a + beta b, n = b x a + I wd + w x (I w). */
static inline void numeric_body(const numeric_link *l, numeric_state *s)
{
    if (!l->heavy) {
        memset(s->force, 0, sizeof s->force);
        memset(s->moment, 0, sizeof s->moment);
        return;
    }
    double force[3], moment[3], turning[3];
    for (int k = 0; k < 3; k++) {
        const double *in = l->second[k], *beta = s->beta[k];
        force[k] = l->mass * s->a[k] + beta[0] * l->first[0] + beta[1] * l->first[1] + beta[2] * l->first[2];
        moment[k] = in[0] * s->wd[0] + in[1] * s->wd[1] + in[2] * s->wd[2];
        turning[k] = in[0] * s->w[0] + in[1] * s->w[1] + in[2] * s->w[2];
    }
    numeric_add_cross(moment, s->w, turning);
    numeric_add_cross(moment, l->first, s->a);
    memcpy(s->force, force, sizeof force);
    memcpy(s->moment, moment, sizeof moment);
}

/* -- backward ---------------------------------------------------------------------------------------- */

/* The component of a wrench that works along the joint's motion, and the wrench past the joint. */
NUMERIC_INLINE double numeric_joint(const int x, const bool rotation, const numeric_state *s, double moment[3],
                                    double force[3])
{
    NUMERIC_AXES;
    double along = rotation ? moment[x] : force[x];
    if (rotation) {
        numeric_about(x, s->cosine, s->sine, force);
        numeric_about(x, s->cosine, s->sine, moment);
    } else {
        moment[y] -= s->slide * force[z];
        moment[z] += s->slide * force[y];
    }
    return along;
}

/* The wrench past the joint, moved to the parent's origin. */
NUMERIC_INLINE double numeric_to_parent(const numeric_link *l, const numeric_state *s, double moment[3],
                                        double force[3])
{
    double along;
#define JOINT(x, rotation) along = numeric_joint(x, rotation, s, moment, force)
    NUMERIC_EACH_KIND(l->kind, JOINT)
#undef JOINT
    if (l->turned) {
        numeric_by(l->g, force);
        numeric_by(l->g, moment);
    }
    if (l->offset)
        numeric_add_cross(moment, l->p, force);
    return l->sign * along;
}

/* The joints' forces: those that give qdd, or c without it. */
static inline void numeric_inverse(numeric *p, const double *q, const double *qd, const double *qdd, double *effort)
{
    numeric_angles(p, q);
    for (int k = 0; k < 3; k++)
        p->states[0].a[k] = -p->gravity[k];
    for (int i = 1; i < p->count; i++) {
        double sign = p->links[i].sign;
        numeric_forward(p, i, sign * qd[i - 1], qdd ? sign * qdd[i - 1] : 0);
        numeric_body(&p->links[i], &p->states[i]);
    }
    for (int i = p->count - 1; i > 0; i--) {
        const numeric_link *l = &p->links[i];
        const numeric_state *s = &p->states[i];
        numeric_state *h = &p->states[l->parent];
        double moment[3] = {s->moment[0], s->moment[1], s->moment[2]};
        double force[3] = {s->force[0], s->force[1], s->force[2]};
        effort[i - 1] = numeric_to_parent(l, s, moment, force);
        for (int k = 0; k < 3; k++) {
            h->moment[k] += moment[k];
            h->force[k] += force[k];
        }
    }
}

/* -- M ----------------------------------------------------------------------------------------------- */

/* A composite past the joint: about a point `slide` before its origin along x, or R I R' about x. */
NUMERIC_INLINE void numeric_carry(const int x, const bool rotation, const numeric_state *s, double first[3],
                                  double in[3][3])
{
    NUMERIC_AXES;
    if (rotation) {
        double c = s->cosine, t = s->sine, xy = in[x][y], xz = in[x][z], yz = in[y][z];
        double u = t * (in[y][y] - in[z][z]) + 2 * c * yz, d = t * u;
        numeric_about(x, c, t, first);
        in[y][y] -= d;
        in[z][z] += d;
        in[y][z] = in[z][y] = c * u - yz;
        in[x][y] = in[y][x] = c * xy - t * xz;
        in[x][z] = in[z][x] = t * xy + c * xz;
    } else {
        double before = first[x], sum;
        first[x] += s->mass * s->slide;
        sum = s->slide * (before + first[x]);
        in[y][y] += sum;
        in[z][z] += sum;
        in[x][y] = in[y][x] -= s->slide * first[y];
        in[x][z] = in[z][x] -= s->slide * first[z];
    }
}

NUMERIC_INLINE void numeric_turn_by(const double g[3][3], double in[3][3])
{
    double half[3][3];
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++)
            half[i][j] = g[i][0] * in[0][j] + g[i][1] * in[1][j] + g[i][2] * in[2][j];
    for (int i = 0; i < 3; i++)
        for (int j = 0; j <= i; j++)
            in[i][j] = in[j][i] = half[i][0] * g[j][0] + half[i][1] * g[j][1] + half[i][2] * g[j][2];
}

/* About a point d before its origin: with b' = b + m d the tensor grows by d.(b + b') 1 - (d b' + b d'). */
NUMERIC_INLINE void numeric_shift(double mass, const double d[3], double first[3], double in[3][3])
{
    double b[3], sum[3];
    for (int k = 0; k < 3; k++) {
        b[k] = first[k];
        first[k] += mass * d[k];
        sum[k] = d[k] * (b[k] + first[k]);
    }
    for (int i = 0; i < 3; i++) {
        int j = (i + 1) % 3;
        in[i][i] += sum[j] + sum[(i + 2) % 3];
        in[i][j] = in[j][i] -= d[i] * first[j] + b[i] * d[j];
    }
}

static inline void numeric_composite_to_parent(const numeric_link *l, const numeric_state *s, numeric_state *h)
{
    double first[3], in[3][3];
    memcpy(first, s->first, sizeof first);
    memcpy(in, s->second, sizeof in);
#define CARRY(x, rotation) numeric_carry(x, rotation, s, first, in)
    NUMERIC_EACH_KIND(l->kind, CARRY)
#undef CARRY
    if (l->turned) {
        numeric_by(l->g, first);
        numeric_turn_by(l->g, in);
    }
    if (l->offset)
        numeric_shift(s->mass, l->p, first, in);
    h->mass += s->mass;
    for (int i = 0; i < 3; i++) {
        h->first[i] += first[i];
        for (int j = 0; j < 3; j++)
            h->second[i][j] += in[i][j];
    }
}

/* The wrench that a unit acceleration of the joint asks for. */
NUMERIC_INLINE void numeric_unit(const int x, const bool rotation, const numeric_state *s, double sign,
                                 double moment[3], double force[3])
{
    NUMERIC_AXES;
    force[x] = rotation ? 0 : sign * s->mass;
    force[y] = rotation ? -sign * s->first[z] : 0;
    force[z] = rotation ? sign * s->first[y] : 0;
    moment[x] = rotation ? sign * s->second[x][x] : 0;
    moment[y] = sign * (rotation ? s->second[x][y] : s->first[z]);
    moment[z] = sign * (rotation ? s->second[x][z] : -s->first[y]);
}

/* Row i of M: that wrench of motion i, on to the ancestors. */
static inline void numeric_row(const numeric *p, int i, double *row)
{
    double moment[3], force[3];
#define UNIT(x, rotation) numeric_unit(x, rotation, &p->states[i], p->links[i].sign, moment, force)
    NUMERIC_EACH_KIND(p->links[i].kind, UNIT)
#undef UNIT
    for (; i > 0; i = p->links[i].parent)
        row[i - 1] = numeric_to_parent(&p->links[i], &p->states[i], moment, force);
}

/* M (lower triangle, m[i * n + k] of ancestors alone: the rest stays as it is) at the q of the last inverse. */
static inline void numeric_mass(numeric *p, double *m)
{
    for (int i = 1; i < p->count; i++) {
        const numeric_link *l = &p->links[i];
        numeric_state *s = &p->states[i];
        s->mass = l->mass;
        memcpy(s->first, l->first, sizeof s->first);
        memcpy(s->second, l->second, sizeof s->second);
    }
    for (int i = p->count - 1; i > 0; i--) {
        const numeric_link *l = &p->links[i];
        if (!l->loaded)
            continue;
        numeric_row(p, i, m + (i - 1) * p->n);
        if (l->parent > 0)
            numeric_composite_to_parent(l, &p->states[i], &p->states[l->parent]);
    }
}

static inline void numeric_motion(numeric *p, const double *q, const double *qd, double *m, double *c)
{
    numeric_inverse(p, q, qd, NULL, c);
    numeric_mass(p, m);
}

#endif
