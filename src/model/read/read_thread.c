/* SPDX-License-Identifier: BSD-3-Clause */
/* Friction in the thread of a screw joint. With the axial load F, the mean radius r, tan gamma = pitch/(2 pi r) and tan
 * rho = mu/cos(flank), the torque F r tan(gamma + rho) raises the load and F r tan(rho - gamma) lowers it (Shigley,
 * Mechanical Engineering Design, 2015, sec. 8-2). The part F r tan gamma is of the coupling, the rest of the friction,
 *
 *     against raising F r tan rho (1 + tan^2 gamma)/(1 - c),     against lowering F r tan rho (1 + tan^2 gamma)/(1 + c)
 *
 * with c = tan rho tan gamma. F is the multiplier of the coupling, positive along the axis on the second body: a
 * positive rate raises a positive load, and with a left-handed thread, c < 0, lowers it. Both levels are a (|F| + c F)
 * and a (|F| - c F) with a = r tan rho (1 + tan^2 gamma)/(1 - c^2). */
#include "model/read/read_thread.h"
#include "model/data/model.h"
#include "model/language/expression_value.h"
#include "model/language/number_algebra.h"
#include "model/read/read_values.h"
#include <math.h>

/* A thread being read. */
typedef struct thread {
    kmp_reader *r;
    const kmp_yaml *map;
    const char *what;
    const kmp_expr *load, *lead, *radius, *flank; /* the multiplier; tan gamma; r; cos(flank) */
} thread;

bool kmp_is_thread(const kempe_model *model, const kmp_force *force, const kmp_yaml *map)
{
    const kmp_body *body = force->motion >= 0 ? &model->bodies[model->motions[force->motion].body] : NULL;
    return body && body->coupling && kmp_yaml_get(map, "mu") && !kmp_yaml_get(map, "reaction");
}

static bool read_geometry(thread *t, const kmp_body *body, kmp_force *force)
{
    const kempe_model *model = t->r->model;
    kmp_arena *arena = &t->r->model->arena;
    const double quarter = acos(0);
    const int coupling = kmp_name_find(KMP_NAMED(model, closure), body->joint);
    if (!kmp_read_required(t->r, t->map, t->what, "radius"))
        return false;
    t->radius = kmp_read_ruled_key(t->r, t->map, t->what, "radius", false, KMP_DIM_LENGTH, KMP_FIELD_POSITIVE);
    const kmp_expr *angle =
        kmp_read_ruled_key(t->r, t->map, t->what, "flank", false, KMP_DIM_NUMBER, KMP_FIELD_NOT_NEGATIVE);
    const double flank = angle ? kmp_expr_value(angle, t->r->parameter_values) : 0;
    if (!(flank < quarter))
        kmp_reader_complain(t->r, kmp_yaml_get(t->map, "flank")->place,
                            "the flank of %s is %.6g rad: the angle between a flank and the normal of the axis is less "
                            "than a right angle",
                            t->what, flank);
    const kmp_expr *pitch = kmp_number_expr(arena, body->number);
    if (!t->radius || !pitch || coupling < 0)
        return false;
    const kmp_expr_locals of = {3, {{"p", pitch, false}, {"r", t->radius, false}, {"f", angle, false}}};
    t->lead = kmp_expr_formula(arena, "p/(2*pi*r)", &of);
    t->flank = kmp_expr_formula(arena, angle ? "cos(f)" : "1", &of);
    t->load = kmp_expr_make(arena, (kmp_expr){.kind = KMP_EXPR_LAMBDA, .index = coupling});
    const double radius = kmp_expr_value(t->radius, t->r->parameter_values);
    force->lead_angle = fabs(atan(body->number.value / (4 * quarter * radius)));
    return t->lead && t->flank && t->load;
}

/* The levels by one coefficient; *angle: its angle of friction, NaN unless it is constant. */
static const kmp_expr *read_levels(const thread *t, const char *key, double lead_angle, double *angle)
{
    kmp_reader *r = t->r;
    const kmp_yaml *node = kmp_yaml_get(t->map, key);
    const char *of = kmp_reader_say(r, "the %s of %s", key, t->what);
    kmp_arena *arena = &r->model->arena;
    if (node && node->kind == KMP_YAML_LIST) {
        kmp_reader_complain(r, node->place,
                            "%s: a thread has one coefficient; its levels differ by the direction of the load", of);
        return NULL;
    }
    const kmp_expr *mu = node ? kmp_read_expr(r, node, of, KMP_DIM_NUMBER, KMP_OF_LOADS) : NULL;
    if (!mu)
        return NULL;
    const kmp_expr_locals by_mu = {2, {{"m", mu, false}, {"f", t->flank, false}}};
    const kmp_expr *slope = kmp_expr_formula(arena, "m/f", &by_mu);
    const bool constant = slope && kmp_expr_is_constant(slope);
    const double tangent = constant ? kmp_expr_value(slope, r->parameter_values) : 0;
    *angle = constant ? atan(tangent) : NAN;
    if (!slope || !kmp_check_rule(r, node, of, KMP_FIELD_NOT_NEGATIVE, tangent, ""))
        return NULL;
    if (tangent * tan(lead_angle) >= 1) {
        kmp_reader_complain(r, node->place,
                            "%s: no torque turns this thread against its load: its lead angle, %.4g deg, and the angle "
                            "of friction, %.4g deg, are 90 deg or more together",
                            of, lead_angle * 90 / acos(0), atan(tangent) * 90 / acos(0));
        return NULL;
    }
    const kmp_expr_locals sizes = {3, {{"s", slope, false}, {"g", t->lead, false}, {"r", t->radius, false}}};
    const kmp_expr *size = kmp_expr_formula(arena, "r*s*(1 + g^2)/(1 - (s*g)^2)", &sizes);
    const kmp_expr *c = kmp_expr_formula(arena, "s*g", &sizes);
    if (!size || !c)
        return NULL;
    const kmp_expr_locals loads = {3, {{"a", size, false}, {"c", c, false}, {"x", t->load, false}}};
    const kmp_expr *raises = kmp_expr_formula(arena, "a*(abs(x) + c*x)", &loads);
    const kmp_expr *lowers = kmp_expr_formula(arena, "a*(abs(x) - c*x)", &loads);
    return raises && lowers ? kmp_expr_make(arena, (kmp_expr){.kind = KMP_EXPR_SIDES, .a = raises, .b = lowers}) : NULL;
}

void kmp_read_thread(kmp_reader *r, const kmp_yaml *map, const char *what, kmp_force *force)
{
    const kmp_motion *motion = &r->model->motions[force->motion];
    const kmp_body *body = &r->model->bodies[motion->body];
    thread t = {.r = r, .map = map, .what = what};
    if (!motion->rotation) {
        kmp_complain_of(
            r, map, what,
            "'%s' is the displacement of a screw; the friction of its thread acts on the rotation: joint: %s",
            motion->name, r->model->motions[force->motion + 1].name);
        return;
    }
    if (!read_geometry(&t, body, force))
        return;
    force->effort = read_levels(&t, "mu", force->lead_angle, &force->friction_angle);
    force->has_static = kmp_yaml_get(map, "mu_static");
    if (force->has_static)
        force->holding_effort = read_levels(&t, "mu_static", force->lead_angle, &force->friction_angle);
    force->thread = true;
}
