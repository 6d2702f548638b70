/* SPDX-License-Identifier: BSD-3-Clause */
/* All laws in logarithms: with t = log(along / across), k = sqrt(along across), G* = G / (1 - poisson),
 *
 *     log c = log(N^2 + floor^2)/6 - log(G* k)/3 + T1(t),  c = sqrt(a b),  log(a/b) = T2(t),
 *     K = G* exp(T3(t) - log(k)/2),  log Cij = Tij(log(a/b)),
 *
 * where T are cubic splines through values of src/rail/contact: of Hertz's contact with errors below 1e-8, of Kalker's
 * coefficients as kempe_contact_kalker. Beyond their ends they are straight: powers. Forces are N times a factor
 * that stays finite with N = 0: q = a b / N varies with N^(-1/3). */
#include "rail/wheel/laws.h"
#include "rail/contact/creep.h"
#include "rail/contact/half_space.h"
#include "symbolic/function_table.h"
#include "symbolic/table_function.h"
#include <math.h>
#include <pthread.h>

/* Ratios of curvatures from e^-12 to e^12: ellipses from 1 : 1200 to 1200 : 1. */
enum { HERTZ_SIDE = 100, HERTZ_POINTS = 2 * HERTZ_SIDE + 1 };
static const double hertz_step = 0.12;

static const double creep_floor = 1e-15, force_floor = 1e-12, friction_floor = 1e-12, normal_floor = 1e-14;

/* -- tables ---------------------------------------------------------------------------------------- */

static kmp_ref spline_of(kmp_graph *g, int count, const double *x, const double *y, kmp_ref at)
{
    int found = kmp_graph_find_points(g, KMP_TABLE_CUBIC, count, x, y);
    kmp_table *table = found < 0 ? kmp_table_new(KMP_TABLE_CUBIC, count, x, y) : NULL;
    if (found >= 0)
        return kmp_table_at(g, found, at);
    if (!table) {
        kmp_graph_fail(g);
        return KMP_ZERO;
    }
    int number = kmp_graph_add_table(g, table);
    kmp_table_free(table);
    return number < 0 ? KMP_ZERO : kmp_table_at(g, number, at);
}

typedef enum hertz_value { HERTZ_SIZE, HERTZ_RATIO, HERTZ_STIFFNESS, HERTZ_VALUES } hertz_value;

/* For all models of a process. */
static double hertz_x[HERTZ_POINTS], hertz_y[HERTZ_VALUES][HERTZ_POINTS];
static pthread_once_t hertz_once = PTHREAD_ONCE_INIT;

/* The ratio of the axes is odd in t, the rest is even. */
static void find_hertz(void)
{
    for (int k = 0; k <= HERTZ_SIDE; k++) {
        const kmp_hertz h = kmp_hertz_of(hertz_step * k);
        const double y[HERTZ_VALUES] = {log(h.axis) - 0.5 * h.ratio, h.ratio, log(h.stiffness)};
        hertz_x[HERTZ_SIDE + k] = hertz_step * k;
        hertz_x[HERTZ_SIDE - k] = -hertz_step * k;
        for (int v = 0; v < HERTZ_VALUES; v++) {
            hertz_y[v][HERTZ_SIDE + k] = y[v];
            hertz_y[v][HERTZ_SIDE - k] = v == HERTZ_RATIO ? -y[v] : y[v];
        }
    }
}

static kmp_ref hertz_table(kmp_graph *g, hertz_value value, kmp_ref t)
{
    (void)pthread_once(&hertz_once, find_hertz);
    return spline_of(g, HERTZ_POINTS, hertz_x, hertz_y[value], t);
}

/* -- shapes ---------------------------------------------------------------------------------------- */

static kmp_ref scaled(kmp_graph *g, double by, kmp_ref x)
{
    return kmp_mul(g, kmp_const(g, by), x);
}

static kmp_ref log_of(kmp_graph *g, kmp_ref x)
{
    return kmp_unary(g, KMP_OP_LOG, x);
}

static kmp_ref exp_of(kmp_graph *g, kmp_ref x)
{
    return kmp_unary(g, KMP_OP_EXP, x);
}

static kmp_ref square(kmp_graph *g, kmp_ref x)
{
    return kmp_mul(g, x, x);
}

/* sqrt(x^2 + y^2 + floor^2) */
static kmp_ref size_of(kmp_graph *g, kmp_ref x, kmp_ref y, double floor)
{
    return kmp_sqrt(g, kmp_add(g, kmp_add(g, square(g, x), square(g, y)), kmp_const(g, floor * floor)));
}

typedef struct curvatures {
    kmp_ref modulus;  /* G* */
    kmp_ref t, log_k; /* log(along / across), log(along across) / 2 */
} curvatures;

static curvatures curvatures_of(kmp_graph *g, const kmp_touch *touch)
{
    kmp_ref along = log_of(g, touch->along), across = log_of(g, touch->across);
    return (curvatures){.modulus = kmp_div(g, touch->shear_modulus, kmp_const(g, 1 - touch->poisson)),
                        .t = kmp_sub(g, along, across),
                        .log_k = scaled(g, 0.5, kmp_add(g, along, across))};
}

kmp_ref kmp_hertz_stiffness(kmp_graph *g, const kmp_touch *touch)
{
    curvatures c = curvatures_of(g, touch);
    kmp_ref log_K = kmp_sub(g, hertz_table(g, HERTZ_STIFFNESS, c.t), scaled(g, 0.5, c.log_k));
    return kmp_mul(g, c.modulus, exp_of(g, log_K));
}

/* The ellipse under a normal force. */
typedef struct ellipse {
    kmp_ref log_c, log_ratio; /* of sqrt(a b), of a/b */
    kmp_ref log_q;            /* of a b / |N| */
} ellipse;

static ellipse ellipse_of(kmp_graph *g, const kmp_touch *touch, kmp_ref normal)
{
    curvatures c = curvatures_of(g, touch);
    kmp_ref floor = kmp_div(g, scaled(g, normal_floor, c.modulus), square(g, kmp_add(g, touch->along, touch->across)));
    kmp_ref log_N = scaled(g, 0.5, log_of(g, kmp_add(g, square(g, normal), square(g, floor))));
    kmp_ref log_c = scaled(g, 1.0 / 3, kmp_sub(g, kmp_sub(g, log_N, log_of(g, c.modulus)), c.log_k));
    ellipse e = {.log_ratio = hertz_table(g, HERTZ_RATIO, c.t)};
    e.log_c = kmp_add(g, log_c, hertz_table(g, HERTZ_SIZE, c.t));
    e.log_q = kmp_sub(g, scaled(g, 2, e.log_c), log_N);
    return e;
}

void kmp_hertz_axes(kmp_graph *g, const kmp_touch *touch, kmp_ref normal, kmp_ref semi[2])
{
    ellipse e = ellipse_of(g, touch, normal);
    kmp_ref half = scaled(g, 0.5, e.log_ratio);
    semi[0] = exp_of(g, kmp_add(g, e.log_c, half));
    semi[1] = exp_of(g, kmp_sub(g, e.log_c, half));
}

/* -- the laws -------------------------------------------------------------------------------------- */

enum { C11, C22, C23, C33 };

/* Points of the logarithms of Kalker's coefficients. */
typedef struct kalker_points {
    double x[KMP_KALKER_POINTS], y[KMP_KALKER_COEFFICIENTS][KMP_KALKER_POINTS];
} kalker_points;

/* log of Kalker's coefficient number `which`. */
static kmp_ref kalker(kmp_graph *g, const kalker_points *points, const ellipse *e, int which)
{
    return spline_of(g, KMP_KALKER_POINTS, points->x, points->y[which], e->log_ratio);
}

/* Force and moment of the linear theory over the normal force, with G in `modulus`. */
static void linear(kmp_graph *g, const kmp_creep *creep, const ellipse *e, kmp_ref modulus, kmp_creep_force *out)
{
    kalker_points points;
    kmp_ref gain[4]; /* a b / N times C11, C22, c C23, c^2 C33 */
    kmp_kalker_points(creep->touch.poisson, points.x, points.y);
    for (int k = C11; k <= C33; k++) {
        kmp_ref log_gain = kmp_add(g, e->log_q, kalker(g, &points, e, k));
        if (k >= C23)
            log_gain = kmp_add(g, log_gain, scaled(g, k == C33 ? 2 : 1, e->log_c));
        gain[k] = kmp_mul(g, modulus, exp_of(g, log_gain));
    }
    out->force[0] = kmp_neg(kmp_mul(g, gain[C11], creep->slip[0]));
    out->force[1] = kmp_neg(kmp_add(g, kmp_mul(g, gain[C22], creep->slip[1]), kmp_mul(g, gain[C23], creep->spin)));
    out->moment = kmp_sub(g, kmp_mul(g, gain[C23], creep->slip[1]), kmp_mul(g, gain[C33], creep->spin));
}

static void scale(kmp_graph *g, kmp_ref by, kmp_creep_force *f)
{
    f->force[0] = kmp_mul(g, by, f->force[0]);
    f->force[1] = kmp_mul(g, by, f->force[1]);
    f->moment = kmp_mul(g, by, f->moment);
}

/* t - t^2/3 + t^3/27 over t, and 1/t from t = 3 on: derivative and curvature are continuous. */
static void shen(kmp_graph *g, kmp_creep_force *f)
{
    kmp_ref t = size_of(g, f->force[0], f->force[1], force_floor);
    kmp_ref less = kmp_sub(g, scaled(g, 1.0 / 27, t), kmp_const(g, 1.0 / 3));
    kmp_ref part = kmp_add(g, KMP_ONE, kmp_mul(g, t, less));
    scale(g, kmp_select(g, kmp_less(g, t, kmp_const(g, 3)), part, kmp_div(g, KMP_ONE, t)), f);
}

static void by_tanh(kmp_graph *g, kmp_creep_force *f)
{
    kmp_ref t = size_of(g, f->force[0], f->force[1], force_floor);
    f->moment = kmp_mul(g, f->moment, kmp_div(g, kmp_unary(g, KMP_OP_TANH, t), t));
    for (int k = 0; k < 2; k++)
        f->force[k] = kmp_unary(g, KMP_OP_TANH, f->force[k]);
}

/* Polach's law as in src/rail/contact/creep.c, over friction times normal force; `modulus` is G over friction. */
static void polach(kmp_graph *g, const kmp_creep *creep, const ellipse *e, kmp_ref modulus, kmp_creep_force *out)
{
    const double pi = 3.14159265358979323846;
    kalker_points points;
    kmp_kalker_points(creep->touch.poisson, points.x, points.y);
    kmp_ref half = scaled(g, 0.5, e->log_ratio), a = exp_of(g, kmp_add(g, e->log_c, half));
    kmp_ref x = creep->slip[0], y = creep->slip[1], turned = kmp_add(g, y, kmp_mul(g, a, creep->spin));
    kmp_ref reach_2 = kmp_binary(g, KMP_OP_MAX, square(g, y), square(g, turned));
    kmp_ref tiny_2 = kmp_const(g, creep_floor * creep_floor);
    kmp_ref reach = kmp_sqrt(g, kmp_add(g, reach_2, tiny_2)), s = size_of(g, x, reach, 0);
    kmp_ref c11 = kalker(g, &points, e, C11), c22 = kalker(g, &points, e, C22), c23 = kalker(g, &points, e, C23);
    kmp_ref y_2 = square(g, y), x_2 = square(g, x), near_2 = kmp_const(g, KMP_POLACH_NEAR * KMP_POLACH_NEAR);
    kmp_ref c11_2 = exp_of(g, scaled(g, 2, c11)), c22_2 = exp_of(g, scaled(g, 2, c22));
    kmp_ref weighted = kmp_add(g, kmp_mul(g, c11_2, x_2), kmp_mul(g, c22_2, y_2));
    kmp_ref of_x = kmp_add(g, weighted, kmp_mul(g, c11_2, near_2)),
            of_y = kmp_add(g, weighted, kmp_mul(g, c22_2, near_2));
    kmp_ref slope = kmp_sqrt(g, kmp_div(g, of_y, kmp_add(g, kmp_add(g, x_2, y_2), near_2)));
    kmp_ref gain = kmp_mul(g, modulus, exp_of(g, e->log_q));
    kmp_ref ep = kmp_mul(g, scaled(g, 0.25 * pi, gain), kmp_mul(g, slope, s));
    kmp_ref part = kmp_add(g, kmp_div(g, ep, kmp_add(g, KMP_ONE, square(g, ep))), kmp_unary(g, KMP_OP_ATAN, ep));
    kmp_ref along = kmp_div(g, scaled(g, 2 / pi, part), s);
    kmp_ref ratio = exp_of(g, e->log_ratio);
    kmp_ref far = kmp_sub(g, kmp_const(g, 7.3), scaled(g, 6.3, exp_of(g, kmp_neg(ratio))));
    kmp_ref reach_gain =
        kmp_mul(g, scaled(g, 8.0 / 3, modulus), exp_of(g, kmp_add(g, kmp_sub(g, e->log_q, half), c23)));
    kmp_ref d = kmp_div(g, kmp_mul(g, reach_gain, reach), far);
    kmp_ref fall = square(g, kmp_add(g, KMP_ONE, square(g, d)));
    kmp_ref spin = kmp_div(g, kmp_mul(g, scaled(g, 3.0 / 8, kmp_mul(g, a, far)), d), kmp_mul(g, fall, s));
    out->force[0] = kmp_neg(kmp_mul(g, kmp_mul(g, along, kmp_sqrt(g, kmp_div(g, of_x, of_y))), x));
    out->force[1] = kmp_neg(kmp_add(g, kmp_mul(g, along, y), kmp_mul(g, spin, creep->spin)));
    out->moment = KMP_ZERO;
}

void kmp_creep_law_force(kmp_graph *g, kmp_creep_law law, const kmp_creep *creep, kmp_creep_force *out)
{
    *out = (kmp_creep_force){.force = {KMP_ZERO, KMP_ZERO}, .moment = KMP_ZERO};
    if (law == KMP_CREEP_NONE || (law != KMP_CREEP_LINEAR && creep->friction == KMP_ZERO))
        return;
    ellipse e = ellipse_of(g, &creep->touch, creep->normal);
    kmp_ref modulus = creep->touch.shear_modulus, bound = creep->normal;
    if (law != KMP_CREEP_LINEAR) {
        double value;
        kmp_ref friction = creep->friction; /* to divide by */
        if (!kmp_is_const(g, friction, &value))
            friction = size_of(g, friction, KMP_ZERO, friction_floor);
        modulus = kmp_div(g, modulus, friction);
        bound = kmp_mul(g, bound, creep->friction);
    }
    if (law == KMP_CREEP_POLACH)
        polach(g, creep, &e, modulus, out);
    else
        linear(g, creep, &e, modulus, out);
    if (law == KMP_CREEP_SHEN)
        shen(g, out);
    else if (law == KMP_CREEP_TANH)
        by_tanh(g, out);
    scale(g, bound, out);
}
