/* SPDX-License-Identifier: BSD-3-Clause */
#include "road/tyre/magic_formula.h"
#include "symbolic/function_table.h"

/* Values that all parts share. */
typedef struct magic {
    kmp_graph *g;
    const kmp_tyre *tyre;
    const double *c;
    const kmp_magic_slip *in;
    kmp_ref nominal, dfz; /* F'z0, (Fz - F'z0)/F'z0 */
    kmp_ref angle, pure;  /* alpha; alpha* of the pure lateral force */
    kmp_ref slip;         /* of the other parts: alpha (5.2) or its tangent */
    kmp_ref friction_scales[2];
} magic;

static kmp_ref number(const magic *m, double x)
{
    return kmp_const(m->g, x);
}

static kmp_ref times(const magic *m, double x, kmp_ref a)
{
    return kmp_mul(m->g, number(m, x), a);
}

static kmp_ref squared(const magic *m, kmp_ref a)
{
    return kmp_mul(m->g, a, a);
}

static kmp_ref arctan(const magic *m, kmp_ref a)
{
    return kmp_unary(m->g, KMP_OP_ATAN, a);
}

/* c[first] + c[first + 1] dfz + .. */
static kmp_ref by_load(const magic *m, double c0, double c1, double c2)
{
    return kmp_add(m->g, kmp_add(m->g, number(m, c0), times(m, c1, m->dfz)), times(m, c2, squared(m, m->dfz)));
}

/* B x - E (B x - atan(B x)) */
static kmp_ref curved(const magic *m, kmp_ref b, kmp_ref e, kmp_ref x)
{
    kmp_graph *g = m->g;
    kmp_ref bx = kmp_mul(g, b, x);
    return kmp_sub(g, bx, kmp_mul(g, e, kmp_sub(g, bx, arctan(m, bx))));
}

/* D sin(C atan(..)) */
static kmp_ref sine_of(const magic *m, kmp_ref d, kmp_ref c, kmp_ref b, kmp_ref e, kmp_ref x)
{
    return kmp_mul(m->g, d, kmp_sin(m->g, kmp_mul(m->g, c, arctan(m, curved(m, b, e, x)))));
}

/* cos(C atan(..)) */
static kmp_ref cosine_of(const magic *m, kmp_ref c, kmp_ref b, kmp_ref e, kmp_ref x)
{
    return kmp_cos(m->g, kmp_mul(m->g, c, arctan(m, curved(m, b, e, x))));
}

/* The weight of combined slip, 1 where the other slip is zero. */
static kmp_ref weight(const magic *m, double c, kmp_ref b, kmp_ref e, kmp_ref x, kmp_ref shift)
{
    kmp_ref shape = number(m, c), shifted = kmp_add(m->g, x, shift);
    return kmp_div(m->g, cosine_of(m, shape, b, e, shifted), cosine_of(m, shape, b, e, shift));
}

/* 1 - c sgn(x) */
static kmp_ref with_sign(const magic *m, kmp_ref c, kmp_ref x)
{
    return kmp_sub(m->g, KMP_ONE, kmp_mul(m->g, c, kmp_unary(m->g, KMP_OP_SIGN, x)));
}

/* The camber of an equation: its sine, or the angle times its scale. */
static kmp_ref camber(const magic *m, double scale)
{
    return m->tyre->form == KMP_TYRE_MF61 ? kmp_sin(m->g, m->in->gamma) : times(m, scale, m->in->gamma);
}

/* -- pure slip ------------------------------------------------------------------------------------------ */

typedef struct pure_longitudinal {
    kmp_ref force, friction, stiffness;
} pure_longitudinal;

/* 4.E9 to 4.E18 */
static pure_longitudinal find_longitudinal(const magic *m)
{
    kmp_graph *g = m->g;
    const double *c = m->c;
    kmp_ref load = m->in->load, gamma = camber(m, c[KMP_TIR_LGAX]);
    kmp_ref x = kmp_add(g, m->in->kappa, times(m, c[KMP_TIR_LHX], by_load(m, c[KMP_TIR_PHX1], c[KMP_TIR_PHX2], 0)));
    kmp_ref friction = kmp_mul(g, by_load(m, c[KMP_TIR_PDX1], c[KMP_TIR_PDX2], 0),
                               kmp_sub(g, KMP_ONE, times(m, c[KMP_TIR_PDX3], squared(m, gamma))));
    friction = kmp_mul(g, friction, m->friction_scales[0]);
    kmp_ref e = kmp_mul(g, by_load(m, c[KMP_TIR_PEX1], c[KMP_TIR_PEX2], c[KMP_TIR_PEX3]),
                        with_sign(m, number(m, c[KMP_TIR_PEX4]), x));
    kmp_ref stiffness = kmp_mul(g, kmp_mul(g, load, by_load(m, c[KMP_TIR_PKX1], c[KMP_TIR_PKX2], 0)),
                                kmp_unary(g, KMP_OP_EXP, times(m, c[KMP_TIR_PKX3], m->dfz)));
    stiffness = times(m, c[KMP_TIR_LKX], stiffness);
    kmp_ref d = kmp_mul(g, friction, load), shape = number(m, c[KMP_TIR_PCX1] * c[KMP_TIR_LCX]);
    kmp_ref up = kmp_mul(g, kmp_mul(g, load, m->friction_scales[0]), by_load(m, c[KMP_TIR_PVX1], c[KMP_TIR_PVX2], 0));
    kmp_ref b = kmp_div(g, stiffness, kmp_mul(g, shape, d));
    e = times(m, c[KMP_TIR_LEX], e);
    kmp_ref force = sine_of(m, d, shape, b, e, x);
    return (pure_longitudinal){kmp_add(g, force, times(m, c[KMP_TIR_LVX], up)), friction, stiffness};
}

typedef struct pure_lateral {
    kmp_ref force, friction, stiffness;
    kmp_ref across, up; /* shifts S_H and S_V */
    kmp_ref b;
    double shape;
} pure_lateral;

/* 4.E19 to 4.E30, at a camber. */
static pure_lateral find_lateral(const magic *m, kmp_ref gamma)
{
    kmp_graph *g = m->g;
    const double *c = m->c;
    const bool sixth = m->tyre->form == KMP_TYRE_MF61;
    kmp_ref load = m->in->load, square = squared(m, gamma), size = kmp_unary(g, KMP_OP_ABS, gamma);
    pure_lateral y = {.shape = c[KMP_TIR_PCY1] * c[KMP_TIR_LCY]};
    y.friction = kmp_mul(g, by_load(m, c[KMP_TIR_PDY1], c[KMP_TIR_PDY2], 0),
                         kmp_sub(g, KMP_ONE, times(m, c[KMP_TIR_PDY3], square)));
    y.friction = kmp_mul(g, y.friction, m->friction_scales[1]);
    kmp_ref at = kmp_add(g, number(m, c[KMP_TIR_PKY2]), times(m, c[KMP_TIR_PKY5], square));
    kmp_ref bent = kmp_sin(g, times(m, c[KMP_TIR_PKY4], arctan(m, kmp_div(g, load, kmp_mul(g, at, m->nominal)))));
    y.stiffness = kmp_mul(g, times(m, c[KMP_TIR_PKY1] * c[KMP_TIR_LKY], m->nominal),
                          kmp_mul(g, bent, kmp_sub(g, KMP_ONE, times(m, c[KMP_TIR_PKY3], size))));
    kmp_ref leans = kmp_mul(g, kmp_mul(g, load, by_load(m, c[KMP_TIR_PVY3], c[KMP_TIR_PVY4], 0)),
                            kmp_mul(g, gamma, m->friction_scales[1]));
    leans = sixth ? times(m, c[KMP_TIR_LKYC], leans) : leans;
    y.up = kmp_mul(g, kmp_mul(g, load, m->friction_scales[1]), by_load(m, c[KMP_TIR_PVY1], c[KMP_TIR_PVY2], 0));
    y.up = kmp_add(g, times(m, c[KMP_TIR_LVY], y.up), leans);
    y.across = times(m, c[KMP_TIR_LHY], by_load(m, c[KMP_TIR_PHY1], c[KMP_TIR_PHY2], 0));
    kmp_ref tilted = kmp_mul(g, times(m, c[KMP_TIR_LKYC], load), by_load(m, c[KMP_TIR_PKY6], c[KMP_TIR_PKY7], 0));
    kmp_ref by_camber = sixth ? kmp_div(g, kmp_sub(g, kmp_mul(g, tilted, gamma), leans), y.stiffness)
                              : times(m, c[KMP_TIR_PHY3], gamma);
    y.across = kmp_add(g, y.across, by_camber);
    kmp_ref x = kmp_add(g, m->pure, y.across);
    kmp_ref sided = kmp_add(g, number(m, c[KMP_TIR_PEY3]), times(m, c[KMP_TIR_PEY4], gamma));
    kmp_ref e = kmp_add(g, with_sign(m, sided, x), times(m, c[KMP_TIR_PEY5], square));
    e = kmp_mul(g, times(m, c[KMP_TIR_LEY], by_load(m, c[KMP_TIR_PEY1], c[KMP_TIR_PEY2], 0)), e);
    kmp_ref d = kmp_mul(g, y.friction, load);
    y.b = kmp_div(g, y.stiffness, times(m, y.shape, d));
    y.force = kmp_add(g, sine_of(m, d, number(m, y.shape), y.b, e, x), y.up);
    return y;
}

/* -- combined slip -------------------------------------------------------------------------------------- */

/* G_x alpha, 4.E50 to 4.E57. */
static kmp_ref longitudinal_weight(const magic *m)
{
    kmp_graph *g = m->g;
    const double *c = m->c;
    kmp_ref square = squared(m, camber(m, c[KMP_TIR_LGAX]));
    kmp_ref b = kmp_add(g, number(m, c[KMP_TIR_RBX1]), times(m, c[KMP_TIR_RBX3], square));
    b = kmp_mul(g, b, kmp_cos(g, arctan(m, times(m, c[KMP_TIR_RBX2], m->in->kappa))));
    kmp_ref e = by_load(m, c[KMP_TIR_REX1], c[KMP_TIR_REX2], 0), shift = number(m, c[KMP_TIR_RHX1]);
    b = times(m, c[KMP_TIR_LXAL], b);
    return weight(m, c[KMP_TIR_RCX1], b, e, m->slip, shift);
}

/* G_y kappa, 4.E58 to 4.E65, at a camber. */
static kmp_ref lateral_weight(const magic *m, kmp_ref gamma)
{
    kmp_graph *g = m->g;
    const double *c = m->c;
    kmp_ref b = kmp_add(g, number(m, c[KMP_TIR_RBY1]), times(m, c[KMP_TIR_RBY4], squared(m, gamma)));
    kmp_ref off = times(m, c[KMP_TIR_RBY2], kmp_sub(g, m->slip, number(m, c[KMP_TIR_RBY3])));
    b = kmp_mul(g, times(m, c[KMP_TIR_LYKA], b), kmp_cos(g, arctan(m, off)));
    kmp_ref e = by_load(m, c[KMP_TIR_REY1], c[KMP_TIR_REY2], 0);
    kmp_ref shift = by_load(m, c[KMP_TIR_RHY1], c[KMP_TIR_RHY2], 0);
    return weight(m, c[KMP_TIR_RCY1], b, e, m->in->kappa, shift);
}

/* S_V y kappa, 4.E66 and 4.E67: the lateral force by the longitudinal slip. */
static kmp_ref ply_steer(const magic *m, kmp_ref gamma, const pure_lateral *y)
{
    kmp_graph *g = m->g;
    const double *c = m->c;
    kmp_ref d = kmp_add(g, by_load(m, c[KMP_TIR_RVY1], c[KMP_TIR_RVY2], 0), times(m, c[KMP_TIR_RVY3], gamma));
    d = kmp_mul(g, kmp_mul(g, y->friction, m->in->load), d);
    d = kmp_mul(g, d, kmp_cos(g, arctan(m, times(m, c[KMP_TIR_RVY4], m->slip))));
    kmp_ref turned = kmp_sin(g, times(m, c[KMP_TIR_RVY5], arctan(m, times(m, c[KMP_TIR_RVY6], m->in->kappa))));
    return times(m, c[KMP_TIR_LVYKA], kmp_mul(g, d, turned));
}

/* -- moments --------------------------------------------------------------------------------------------- */

/* Slip of the trail: sqrt(x^2 + (K_x/K_y kappa)^2). It occurs in even functions only, so that it needs no sign. */
static kmp_ref equivalent(const magic *m, kmp_ref x, kmp_ref kappa)
{
    const double floor = 1e-30; /* of the square, so that the root has a derivative */
    return kmp_sqrt(m->g, kmp_add(m->g, kmp_add(m->g, squared(m, x), squared(m, kappa)), number(m, floor)));
}

/* 4.E31 to 4.E49 and 4.E71 to 4.E78; `pressed`: the lateral force at the pneumatic trail. */
static kmp_ref aligning(const magic *m, const pure_lateral *y, kmp_ref longitudinal, kmp_ref pressed,
                        const kmp_magic_force *force)
{
    kmp_graph *g = m->g;
    const double *c = m->c;
    const bool sixth = m->tyre->form == KMP_TYRE_MF61;
    kmp_ref gamma = camber(m, c[KMP_TIR_LGAZ]), size = kmp_unary(g, KMP_OP_ABS, gamma), square = squared(m, gamma);
    kmp_ref load = m->in->load, radius = m->in->radius, upright = kmp_cos(g, m->angle);
    kmp_ref kappa = m->tyre->combined ? kmp_mul(g, kmp_div(g, longitudinal, y->stiffness), m->in->kappa) : KMP_ZERO;
    kmp_ref shift = kmp_add(g, by_load(m, c[KMP_TIR_QHZ1], c[KMP_TIR_QHZ2], 0),
                            kmp_mul(g, by_load(m, c[KMP_TIR_QHZ3], c[KMP_TIR_QHZ4], 0), gamma));
    kmp_ref at = kmp_add(g, m->slip, shift);
    kmp_ref residual = kmp_add(g, m->slip, kmp_add(g, y->across, kmp_div(g, y->up, y->stiffness)));
    kmp_ref soft = kmp_div(g, number(m, c[KMP_TIR_LKY]), m->friction_scales[1]);
    kmp_ref b = kmp_add(g, kmp_add(g, KMP_ONE, times(m, c[KMP_TIR_QBZ4], gamma)),
                        kmp_add(g, times(m, c[KMP_TIR_QBZ5], size), times(m, c[KMP_TIR_QBZ6], square)));
    b = kmp_mul(g, kmp_mul(g, by_load(m, c[KMP_TIR_QBZ1], c[KMP_TIR_QBZ2], c[KMP_TIR_QBZ3]), b), soft);
    kmp_ref arm = kmp_div(g, kmp_mul(g, load, radius), m->nominal);
    kmp_ref d = kmp_add(g, kmp_add(g, KMP_ONE, times(m, c[KMP_TIR_QDZ3], sixth ? size : gamma)),
                        times(m, c[KMP_TIR_QDZ4], square));
    d = kmp_mul(g, kmp_mul(g, arm, by_load(m, c[KMP_TIR_QDZ1], c[KMP_TIR_QDZ2], 0)), times(m, c[KMP_TIR_LTR], d));
    kmp_ref e = kmp_add(g, number(m, c[KMP_TIR_QEZ4]), times(m, c[KMP_TIR_QEZ5], gamma));
    e = kmp_mul(g, times(m, 2 / 3.14159265358979323846, e), arctan(m, kmp_mul(g, times(m, c[KMP_TIR_QCZ1], b), at)));
    e = kmp_mul(g, by_load(m, c[KMP_TIR_QEZ1], c[KMP_TIR_QEZ2], c[KMP_TIR_QEZ3]), kmp_add(g, KMP_ONE, e));
    kmp_ref shape = number(m, c[KMP_TIR_QCZ1]), reached = equivalent(m, at, kappa);
    kmp_ref trail = cosine_of(m, shape, b, e, reached);
    trail = kmp_mul(g, kmp_mul(g, d, trail), upright);
    kmp_ref rb = kmp_add(g, times(m, c[KMP_TIR_QBZ9], soft), times(m, c[KMP_TIR_QBZ10] * y->shape, y->b));
    kmp_ref tilted = kmp_add(g, by_load(m, c[KMP_TIR_QDZ8], c[KMP_TIR_QDZ9], 0),
                             kmp_mul(g, by_load(m, c[KMP_TIR_QDZ10], c[KMP_TIR_QDZ11], 0), size));
    kmp_ref rd = kmp_add(g, times(m, c[KMP_TIR_LRES], by_load(m, c[KMP_TIR_QDZ6], c[KMP_TIR_QDZ7], 0)),
                         kmp_mul(g, times(m, sixth ? c[KMP_TIR_LKZC] : 1, tilted), gamma));
    rd = kmp_mul(g, kmp_mul(g, kmp_mul(g, load, radius), rd), kmp_mul(g, m->friction_scales[1], upright));
    rd = kmp_mul(g, rd, kmp_cos(g, arctan(m, kmp_mul(g, rb, equivalent(m, residual, kappa)))));
    kmp_ref side =
        kmp_add(g, number(m, c[KMP_TIR_SSZ1]), times(m, c[KMP_TIR_SSZ2], kmp_div(g, force->across, m->nominal)));
    side = kmp_add(g, side, kmp_mul(g, by_load(m, c[KMP_TIR_SSZ3], c[KMP_TIR_SSZ4], 0), gamma));
    side = m->tyre->combined ? kmp_mul(g, times(m, c[KMP_TIR_LS], radius), side) : KMP_ZERO;
    return kmp_add(g, kmp_sub(g, rd, kmp_mul(g, trail, pressed)), kmp_mul(g, side, force->along));
}

/* 4.E69, without its terms of higher order. */
static kmp_ref overturning(const magic *m, const kmp_magic_force *force)
{
    kmp_graph *g = m->g;
    const double *c = m->c;
    kmp_ref sum =
        kmp_sub(g, number(m, c[KMP_TIR_QSX1] * c[KMP_TIR_LVMX]), times(m, c[KMP_TIR_QSX2], camber(m, c[KMP_TIR_LGAX])));
    sum = kmp_add(g, sum, times(m, c[KMP_TIR_QSX3], kmp_div(g, force->across, m->nominal)));
    return kmp_mul(g, kmp_mul(g, times(m, c[KMP_TIR_LMX], m->in->load), m->in->radius), sum);
}

/* 4.E70, against the rolling; its sign is V_x over the velocity of the slips. */
static kmp_ref resistance(const magic *m, const kmp_magic_force *force)
{
    kmp_graph *g = m->g;
    const double *c = m->c, reference = c[KMP_TIR_LONGVL] > 0 ? c[KMP_TIR_LONGVL] : 1;
    kmp_ref speed = kmp_sqrt(g, kmp_add(g, squared(m, m->in->forwards), squared(m, m->in->low_speed)));
    kmp_ref over = times(m, 1 / reference, speed), fast = squared(m, squared(m, over));
    kmp_ref sum =
        kmp_add(g, number(m, c[KMP_TIR_QSY1]), times(m, c[KMP_TIR_QSY2], kmp_div(g, force->along, m->nominal)));
    sum = kmp_add(g, sum, kmp_add(g, times(m, c[KMP_TIR_QSY3], over), times(m, c[KMP_TIR_QSY4], fast)));
    sum = kmp_mul(g, kmp_mul(g, times(m, c[KMP_TIR_LMY], m->in->load), m->in->radius), sum);
    return kmp_neg(kmp_mul(g, sum, kmp_div(g, m->in->forwards, speed)));
}

/* -- all of it ------------------------------------------------------------------------------------------- */

static magic begin(kmp_graph *g, const kmp_tyre *tyre, const kmp_magic_slip *slip)
{
    const double nominal = tyre->tir[KMP_TIR_FNOMIN] * tyre->tir[KMP_TIR_LFZO];
    magic m = {.g = g, .tyre = tyre, .c = tyre->tir, .in = slip, .nominal = kmp_const(g, nominal)};
    m.dfz = kmp_div(g, kmp_sub(g, slip->load, m.nominal), m.nominal);
    m.angle = arctan(&m, slip->tangent);
    m.pure = tyre->tangent ? slip->tangent : m.angle;
    m.slip = tyre->form == KMP_TYRE_MF61 ? slip->tangent : m.angle;
    m.friction_scales[0] = times(&m, m.c[KMP_TIR_LMUX], slip->friction);
    m.friction_scales[1] = times(&m, m.c[KMP_TIR_LMUY], slip->friction);
    return m;
}

void kmp_magic_formula(kmp_graph *g, const kmp_tyre *tyre, const kmp_magic_slip *slip, kmp_magic_force *force)
{
    const magic m = begin(g, tyre, slip);
    const bool sixth = tyre->form == KMP_TYRE_MF61, combined = tyre->combined;
    const kmp_ref gamma = camber(&m, m.c[KMP_TIR_LGAY]);
    const pure_longitudinal x = find_longitudinal(&m);
    const pure_lateral y = find_lateral(&m, gamma);
    *force = (kmp_magic_force){.friction = x.friction, .stiffness = {x.stiffness, y.stiffness}};
    if (tyre->along)
        force->along = combined ? kmp_mul(g, longitudinal_weight(&m), x.force) : x.force;
    if (tyre->across) {
        kmp_ref by_slip = combined ? ply_steer(&m, gamma, &y) : KMP_ZERO, pressed;
        force->across = y.force;
        if (combined)
            force->across = kmp_add(g, kmp_mul(g, lateral_weight(&m, gamma), y.force), by_slip);
        /* The trail has the force without camber in MF 6.1, and with it in MF 5.2. */
        if (sixth)
            pressed = kmp_mul(g, combined ? lateral_weight(&m, KMP_ZERO) : KMP_ONE, find_lateral(&m, KMP_ZERO).force);
        else
            pressed = kmp_sub(g, force->across, by_slip);
        force->moment[2] = aligning(&m, &y, x.stiffness, pressed, force);
        force->moment[0] = overturning(&m, force);
    }
    force->moment[1] = tyre->along ? resistance(&m, force) : KMP_ZERO;
}

/* MF 5.2; PTX3 has the sign of its manual. */
void kmp_magic_relaxation(kmp_graph *g, const kmp_tyre *tyre, const kmp_magic_slip *slip, kmp_ref length[2])
{
    const magic m = begin(g, tyre, slip);
    const double *c = m.c;
    kmp_ref over = kmp_div(g, kmp_mul(g, slip->load, slip->radius), number(&m, c[KMP_TIR_FNOMIN]));
    kmp_ref size = kmp_unary(g, KMP_OP_ABS, camber(&m, c[KMP_TIR_LGAY]));
    length[0] = kmp_mul(g, by_load(&m, c[KMP_TIR_PTX1], c[KMP_TIR_PTX2], 0),
                        kmp_unary(g, KMP_OP_EXP, times(&m, -c[KMP_TIR_PTX3], m.dfz)));
    length[0] = kmp_mul(g, times(&m, c[KMP_TIR_LSGKP], over), length[0]);
    const double at = c[KMP_TIR_PTY2] != 0 ? c[KMP_TIR_PTY2] : 1;
    length[1] = kmp_sin(g, times(&m, 2, arctan(&m, kmp_div(g, slip->load, times(&m, at, m.nominal)))));
    length[1] = kmp_mul(g, times(&m, c[KMP_TIR_PTY1] * c[KMP_TIR_LFZO] * c[KMP_TIR_LSGAL], slip->radius), length[1]);
    length[1] = kmp_mul(g, length[1], kmp_sub(g, KMP_ONE, times(&m, c[KMP_TIR_PKY3], size)));
}
