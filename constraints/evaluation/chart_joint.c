/* SPDX-License-Identifier: BSD-3-Clause */
/* With w the angular velocity in the axes before the joint, R1 = R_a(q1) and R12 = R_a(q1) R_b(q2),
 *
 *     w = a q1' + R1 b q2' + R12 c q3'
 *     w' = a q1'' + R1 b q2'' + R12 c q3'' + (a q1') x R1 b q2' + (a q1' + R1 b q2') x R12 c q3'
 *
 * turned by C when C comes first (Davenport's angles: Shuster and Markley, J. Astronautical Sci. 51 (2003) 123, for
 * axes across each other). The angles of a rotation R: v = R c makes the angle psi with a, and q2 = phi +- psi where
 * R_b(phi) c = a; then q1 turns R_b(q2) c onto v about a, and q3 is what is left about c. */
#include "constraints/evaluation/chart_joint.h"
#include "constraints/tolerances.h"
#include "linalg/dense/factors.h"
#include "linalg/dense/rotations.h"
#include "linalg/dense/three.h"
#include <math.h>
#include <string.h>

#define TWO_PI 6.283185307179586
/* Least square of the angular velocity across an axis for which its direction there counts. */
#define LEAST_TURN 1e-12

typedef double matrix[3][3];

/* Angular velocity and acceleration before the joint. */
typedef struct spin {
    double w[3], wd[3];
} spin;

/* -- three numbers ----------------------------------------------------------------------------------- */

static void add_scaled(double *x, double factor, const double y[3])
{
    for (int i = 0; i < 3; i++)
        x[i] += factor * y[i];
}

static void apply(matrix m, bool transposed, const double v[3], double out[3])
{
    double r[3];
    for (int i = 0; i < 3; i++)
        r[i] = transposed ? m[0][i] * v[0] + m[1][i] * v[1] + m[2][i] * v[2] : kmp_dot3(m[i], v);
    memcpy(out, r, sizeof r);
}

/* Rodrigues: v turned about the unit axis e. */
static void turn(const double e[3], double angle, const double v[3], double out[3])
{
    double ev[3], s = sin(angle), c = cos(angle), along = kmp_dot3(e, v), r[3];
    kmp_cross3(e, v, ev);
    for (int i = 0; i < 3; i++)
        r[i] = c * v[i] + s * ev[i] + (1 - c) * along * e[i];
    memcpy(out, r, sizeof r);
}

static void rotation(const kmp_chart_joint *j, const double q[3], matrix r)
{
    static const double unit[3][3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
    for (int k = 0; k < 3; k++) {
        double v[3];
        turn(j->c, q[2], unit[k], v);
        turn(j->b, q[1], v, v);
        turn(j->a, q[0], v, v);
        for (int i = 0; i < 3; i++)
            r[i][k] = v[i];
    }
}

/* Makes the rows orthonormal again. */
static void clean(matrix m)
{
    for (int pass = 0; pass < 2; pass++)
        for (int i = 0; i < 3; i++) {
            for (int k = 0; k < i; k++)
                add_scaled(m[i], -kmp_dot3(m[i], m[k]), m[k]);
            double size = sqrt(kmp_dot3(m[i], m[i]));
            for (int k = 0; k < 3; k++)
                m[i][k] /= size;
        }
}

/* -- axes and rates ---------------------------------------------------------------------------------- */

/* Columns a, R1 b, R12 c. */
static void axes_at(const kmp_chart_joint *j, const double q[3], matrix e)
{
    memcpy(e[0], j->a, sizeof e[0]);
    turn(j->a, q[0], j->b, e[1]);
    turn(j->b, q[1], j->c, e[2]);
    turn(j->a, q[0], e[2], e[2]);
}

/* Terms of wd in addition to the axes times qdd. */
static void bias(matrix e, const double qd[3], double out[3])
{
    double w[3] = {0}, x[3];
    memset(out, 0, 3 * sizeof *out);
    for (int k = 0; k < 3; k++) {
        kmp_cross3(w, e[k], x);
        add_scaled(out, qd[k], x);
        add_scaled(w, qd[k], e[k]);
    }
}

static spin spin_of(const kmp_chart_joint *j, const double q[3], const double *qd, const double *qdd)
{
    spin s = {{0}, {0}};
    matrix e;
    axes_at(j, q, e);
    if (qd)
        bias(e, qd, s.wd);
    for (int k = 0; k < 3; k++) {
        if (qd)
            add_scaled(s.w, qd[k], e[k]);
        if (qdd)
            add_scaled(s.wd, qdd[k], e[k]);
    }
    return s;
}

/* Solves e' x = right by complete pivoting; for dependent axes the least x that fits best. */
static void solve(matrix e, const double right[3], double x[3])
{
    double lu[9], pivots[3], y[3], null[3] = {0};
    int row[3], col[3], rank;
    memcpy(lu, e, sizeof lu); /* columns of e' */
    kmp_lu_complete(3, 3, lu, NULL, row, col, pivots);
    rank = pivots[2] > KMP_AXES_DEPENDENT * pivots[0] ? 3 : 2;
    for (int i = 0; i < 3; i++) {
        y[i] = right[row[i]];
        for (int k = 0; k < i; k++)
            y[i] -= lu[i + 3 * k] * y[k];
    }
    for (int i = 2; i >= 0; i--) {
        for (int k = i + 1; k < rank; k++)
            y[i] -= lu[i + 3 * k] * x[col[k]];
        x[col[i]] = i < rank ? y[i] / lu[4 * i] : 0;
    }
    if (rank == 3)
        return;
    kmp_lu_null_vector(3, 3, lu, col, 2, 2, null);
    add_scaled(x, -kmp_dot3(null, x) / kmp_dot3(null, null), null);
}

/* qd and qdd at the angles q for a given spin. */
static void rates_of(const kmp_chart_joint *j, const double q[3], const spin *s, double *qd, double *qdd)
{
    matrix e;
    double rate[3], left[3], carried[3];
    axes_at(j, q, e);
    solve(e, s->w, rate);
    bias(e, rate, carried);
    for (int i = 0; i < 3; i++)
        left[i] = s->wd[i] - carried[i];
    if (qd)
        memcpy(qd, rate, sizeof rate);
    if (qdd)
        solve(e, left, qdd);
}

/* -- charts ------------------------------------------------------------------------------------------ */

/* Rotation and spin of the whole joint, at coordinates of all joints; qd and qdd may be NULL. */
static void whole(const kmp_chart_joint *j, const double *c, const double *q, const double *qd, const double *qdd,
                  matrix r, spin *s)
{
    matrix chart;
    memcpy(chart, c, sizeof chart);
    rotation(j, q + j->first, r);
    *s = spin_of(j, q + j->first, qd ? qd + j->first : NULL, qdd ? qdd + j->first : NULL);
    if (!j->before) {
        kmp_product3(r, false, chart, r);
        return;
    }
    kmp_product3(chart, false, r, r);
    apply(chart, false, s->w, s->w);
    apply(chart, false, s->wd, s->wd);
}

KMP_LOCAL bool kmp_chart_joint_is_own(const double *chart)
{
    for (int k = 0; k < KMP_CHART_SIZE; k++)
        if (chart[k] != (k % 4 == 0))
            return false;
    return true;
}

/* Angle of b that turns c onto a. */
static double fold(const kmp_chart_joint *j)
{
    double ca[3];
    kmp_cross3(j->c, j->a, ca);
    return atan2(kmp_dot3(j->b, ca), kmp_dot3(j->c, j->a));
}

KMP_LOCAL double kmp_chart_joint_regular(const kmp_chart_joint *j, const double *q)
{
    return fabs(sin(q[j->first + 1] - fold(j)));
}

KMP_LOCAL double kmp_chart_joint_apart(const kmp_chart_joint *j, const double *a, const double *b)
{
    matrix one, two;
    double most = 0;
    rotation(j, a + j->first, one);
    rotation(j, b + j->first, two);
    for (int i = 0; i < 3; i++)
        for (int k = 0; k < 3; k++)
            most = fmax(most, fabs(one[i][k] - two[i][k]));
    return most;
}

/* The middle of the second angle's range: the one nearer to zero, and of two at equal distance the positive one. */
static double middle(const kmp_chart_joint *j)
{
    double up = remainder(fold(j) + TWO_PI / 4, TWO_PI), down = remainder(fold(j) - TWO_PI / 4, TWO_PI);
    if (fabs(fabs(up) - fabs(down)) < 1e-9)
        return fmax(up, down);
    double best = fabs(up) < fabs(down) ? up : down;
    return fabs(best) < 1e-15 ? 0 : best;
}

/* Turn about the unit axis e that takes x to y, in the plane across e. */
static double angle_about(const double e[3], const double x[3], const double y[3])
{
    double xy[3];
    kmp_cross3(x, y, xy);
    return atan2(kmp_dot3(e, xy), kmp_dot3(x, y) - kmp_dot3(e, x) * kmp_dot3(e, y));
}

/* Initial angles in a new chart. The second is in its middle. C absorbs one of the outer angles, chosen such that the
 * body now turns only about a and c: the second angle then leaves its middle late. w: angular velocity in the axes on
 * C's far side, which are the body's when C comes first. */
static void begin_angles(const kmp_chart_joint *j, const double w[3], double q[3])
{
    double level[3], along = 0;
    const double *axis = j->before ? j->c : j->a;
    kmp_cross3(axis, j->b, level);
    if (kmp_dot3(w, w) - kmp_dot3(axis, w) * kmp_dot3(axis, w) > LEAST_TURN * kmp_dot3(w, w))
        along = remainder(angle_about(axis, w, level), TWO_PI / 2);
    q[0] = j->before ? 0 : -along;
    q[1] = middle(j);
    q[2] = j->before ? along : 0;
}

KMP_LOCAL void kmp_chart_joint_center(const kmp_chart_joint *j, double *chart, double *q, double *qd, double *qdd)
{
    double center[3], w[3];
    matrix own, total, r, inverse;
    spin s;
    whole(j, chart, q, qd, qdd, total, &s);
    memcpy(w, s.w, sizeof w);
    if (j->before)
        apply(total, true, w, w);
    begin_angles(j, w, center);
    rotation(j, center, r);
    for (int i = 0; i < 3; i++)
        for (int k = 0; k < 3; k++)
            inverse[i][k] = r[k][i];
    if (j->before)
        kmp_product3(total, false, inverse, own);
    else
        kmp_product3(inverse, false, total, own);
    clean(own);
    memcpy(chart, own, sizeof own);
    memcpy(q + j->first, center, sizeof center);
    if (j->before) {
        apply(own, true, s.w, s.w);
        apply(own, true, s.wd, s.wd);
    }
    rates_of(j, center, &s, qd ? qd + j->first : NULL, qdd ? qdd + j->first : NULL);
}

KMP_LOCAL void kmp_chart_joint_enter(const kmp_chart_joint *j, const double *chart, const double angles[3],
                                     const double rates[3], const double *q, double *qd)
{
    spin s = spin_of(j, angles, rates, NULL);
    matrix own;
    memcpy(own, chart, sizeof own);
    if (j->before)
        apply(own, true, s.w, s.w);
    rates_of(j, q + j->first, &s, qd + j->first, NULL);
}

/* -- small changes ----------------------------------------------------------------------------------- */

/* Rotation of the body before the joint, and the changes of its angular velocity and acceleration. */
typedef struct change {
    double turn[3], w[3], wd[3];
} change;

static void add_cross(double *x, double factor, const double y[3], const double z[3])
{
    double yz[3];
    kmp_cross3(y, z, yz);
    add_scaled(x, factor, yz);
}

/* Change of the motion by dq, dqd and dqdd, with axes e_k, each turned by the rotations before it; qdd NULL: without
 * d.wd. */
static change change_of(const kmp_chart_joint *j, const kmp_chart_motion *m, const double dq[3], const double dqd[3],
                        const double dqdd[3])
{
    change d = {{0}, {0}, {0}};
    double led[3] = {0};
    matrix e;
    axes_at(j, m->q + j->first, e);
    for (int k = 0; k < 3; k++) {
        double moved[3] = {0}, rate = m->qd[j->first + k], part[3] = {0};
        add_cross(moved, 1, d.turn, e[k]);
        add_scaled(part, rate, moved);
        add_scaled(part, dqd[k], e[k]);
        if (m->qdd) {
            add_scaled(d.wd, m->qdd[j->first + k], moved);
            add_scaled(d.wd, dqdd[k], e[k]);
            add_cross(d.wd, rate, d.w, e[k]);
            add_cross(d.wd, 1, led, part);
        }
        add_scaled(led, rate, e[k]);
        add_scaled(d.w, 1, part);
        add_scaled(d.turn, dq[k], e[k]);
    }
    return d;
}

/* Converts a change into the axes on the other side of C, or back. */
static void turn_change(const kmp_chart_joint *j, const double *chart, bool back, change *d)
{
    matrix own;
    memcpy(own, chart, sizeof own);
    if (!j->before)
        return;
    apply(own, back, d->turn, d->turn);
    apply(own, back, d->w, d->w);
    apply(own, back, d->wd, d->wd);
}

/* Solves e' x = whole - part. */
static void solve_rest(matrix e, const double whole[3], const double part[3], double x[3])
{
    double rest[3];
    for (int i = 0; i < 3; i++)
        rest[i] = whole[i] - part[i];
    solve(e, rest, x);
}

KMP_LOCAL void kmp_chart_joint_carry(const kmp_chart_joint *j, const kmp_chart_motion *from, const kmp_chart_motion *to,
                                     double *dq, double *dqd, double *dqdd)
{
    static const double none[3] = {0};
    bool whole_motion = from->qdd && to->qdd && dqdd;
    const kmp_chart_motion before = {NULL, from->q, from->qd, whole_motion ? from->qdd : NULL};
    const kmp_chart_motion behind = {NULL, to->q, to->qd, whole_motion ? to->qdd : NULL};
    change d = change_of(j, &before, dq + j->first, dqd + j->first, whole_motion ? dqdd + j->first : none);
    matrix e;
    turn_change(j, from->chart, false, &d);
    turn_change(j, to->chart, true, &d);
    axes_at(j, to->q + j->first, e);
    solve(e, d.turn, dq + j->first);
    change part = change_of(j, &behind, dq + j->first, none, none);
    solve_rest(e, d.w, part.w, dqd + j->first);
    part = change_of(j, &behind, dq + j->first, dqd + j->first, none);
    if (whole_motion)
        solve_rest(e, d.wd, part.wd, dqdd + j->first);
}

/* -- angles of the user -------------------------------------------------------------------------------- */

/* The angle plus the number of full turns that brings it nearest to `near`. */
static double nearest(double angle, double near)
{
    return angle + TWO_PI * nearbyint((near - angle) / TWO_PI);
}

/* The angles of r on one side of the fold, nearest to `near`; returns their largest distance from it. If the sine of
 * the angle to the fold is below `least`, the first angle is unchanged. */
static double angles_on(const kmp_chart_joint *j, matrix r, const double near[3], double side, double least,
                        double out[3])
{
    double v[3], av[3], w[3], left[3], far = 0;
    apply(r, false, j->c, v);
    kmp_cross3(j->a, v, av);
    double sine = sqrt(kmp_dot3(av, av)), psi = atan2(sine, kmp_dot3(j->a, v));
    out[1] = nearest(fold(j) + side * psi, near[1]);
    turn(j->b, out[1], j->c, w);
    out[0] = sine > least ? nearest(angle_about(j->a, w, v), near[0]) : near[0];
    apply(r, false, j->b, left); /* R b, then R12' R b */
    turn(j->a, -out[0], left, left);
    turn(j->b, -out[1], left, left);
    out[2] = nearest(angle_about(j->c, j->b, left), near[2]);
    for (int k = 0; k < 3; k++)
        far = fmax(far, fabs(out[k] - near[k]));
    return far;
}

/* The angles of r on the side of the fold of `near`, or on the nearer side; returns their distance as angles_on. */
static double angles_near(const kmp_chart_joint *j, matrix r, const double near[3], bool sided, double least,
                          double out[3])
{
    double side = sin(near[1] - fold(j)) < 0 ? -1 : 1, other[3];
    double far = angles_on(j, r, near, side, least, out);
    double otherwise = sided ? INFINITY : angles_on(j, r, near, -side, least, other);
    if (!(otherwise < far))
        return far;
    memcpy(out, other, sizeof other);
    return otherwise;
}

KMP_LOCAL double kmp_chart_joint_follow(const kmp_chart_joint *j, const double *chart, const double *before,
                                        const double near[3], bool sided, const double *q, double angles[3])
{
    matrix total;
    spin s;
    double far = 0;
    bool touches = fabs(sin(near[1] - fold(j))) < KMP_AXES_TOUCH;
    whole(j, chart, q, NULL, NULL, total, &s);
    for (int k = j->first; k < j->first + 3; k++)
        far = fmax(far, fabs(q[k] - before[k]));
    return fmax(far, angles_near(j, total, near, sided && !touches, KMP_AXES_TOUCH, angles));
}

KMP_LOCAL double kmp_chart_joint_show(const kmp_chart_joint *j, const double *chart, const double near[3], double *q,
                                      double *qd, double *qdd)
{
    matrix total;
    spin s;
    double angles[3];
    whole(j, chart, q, qd, qdd, total, &s);
    double far = angles_near(j, total, near, false, KMP_AXES_NO_ANGLE, angles);
    memcpy(q + j->first, angles, sizeof angles);
    if (qd)
        rates_of(j, angles, &s, qd + j->first, qdd ? qdd + j->first : NULL);
    return far;
}
