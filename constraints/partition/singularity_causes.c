/* SPDX-License-Identifier: BSD-3-Clause */
/* Reasons for accelerations that do not exist, in the order in which they are looked for: a singular position of
 * angles, a value that is not finite, a motion without mass. The last is a null vector of the scaled reduced mass,
 * found by complete pivoting. */
#include "constraints/partition/singularity_causes.h"
#include "base/memory.h"
#include "constraints/evaluation/evaluator.h"
#include "constraints/partition/reduction.h"
#include "constraints/tolerances.h"
#include "linalg/dense/dot.h"
#include "model/data/model.h"
#include <float.h>
#include <math.h>
#include <string.h>

#define TAKES_PART 1e-6 /* of the largest change of a coordinate in a motion without mass */

enum { MOST_NAMED = 5 };

/* -- angles at their singular position ----------------------------------------------------------------- */

/* a.(b x R c), where R turns about b by an angle. With the components of a and c across b it is A cos + B sin, A = a.(b
 * x c), B = a.(b x (b x c)). */
static bool is_singular(const double a[3], const double b[3], const double c[3], double angle)
{
    double bc[3], bbc[3];
    kmp_cross3(b, c, bc);
    kmp_cross3(b, bc, bbc);
    double cosine = kmp_dot3(a, bc), sine = kmp_dot3(a, bbc), most = hypot(cosine, sine);
    return fabs(cosine * cos(angle) + sine * sin(angle)) < KMP_AXES_WEAK * most;
}

void kmp_angles_explain(const kempe_model *model, const double *q, kmp_text *text)
{
    for (int k = 1; k + 1 < model->motion_count; k++) {
        const kmp_motion *m = &model->motions[k]; /* the middle one of three */
        bool three = m[-1].rotation && m->rotation && m[1].rotation && m[-1].body == m->body && m->body == m[1].body;
        if (!three || !is_singular(m[-1].axis, m->axis, m[1].axis, q[k]))
            continue;
        kmp_text_printf(text,
                        "; joint '%s' reaches the singular position of its angles, %s = %.6g: choose another axis or "
                        "another order of its rotations, or use none of its angles",
                        model->bodies[m->body].joint, m->name, q[k]);
        return;
    }
}

/* -- values that are not finite ------------------------------------------------------------------------ */

static int first_bad(int count, const double *x)
{
    for (int k = 0; k < count; k++)
        if (!isfinite(x[k]))
            return k;
    return -1;
}

/* Names the force function of the user, which gives no numbers at all where it fails. */
static bool put_effort(kmp_evaluator *eval, double t, const double *q, const double *qd, kmp_text *text)
{
    const kempe_system *s = eval->system;
    const double *effort = kmp_eval_effort(eval, t, q, qd);
    int bad = effort ? first_bad(s->n, effort) : -1;
    bool fails = bad == 0;
    for (int i = 0; fails && i < s->n; i++)
        fails = isnan(effort[i]);
    if (fails)
        kmp_text_printf(text, "the force function that was set for the system failed at t = %.9g s", t);
    else if (bad >= 0)
        kmp_text_printf(text, "the force function that was set for the system gives '%s' no finite force at t = %.9g s",
                        s->model->motions[bad].name, t);
    return bad >= 0;
}

static bool put_not_finite(kmp_evaluator *eval, double t, const double *q, const double *qd, kmp_text *text)
{
    const kempe_system *s = eval->system;
    int bad;
    kmp_eval_closure(eval, t, q);
    if ((bad = first_bad(s->m, eval->h)) >= 0 ||
        ((bad = first_bad(s->jacobian.count, eval->jacobian)) >= 0 && (bad = s->jacobian.row[bad]) >= 0)) {
        kmp_text_printf(text, "constraint equation '%s' is not a finite number at t = %.9g s", s->row_names[bad], t);
        return true;
    }
    kmp_eval_mass(eval);
    if ((bad = first_bad(s->mass.count, eval->mass)) >= 0) {
        kmp_text_printf(text, "the mass that '%s' moves is not a finite number at t = %.9g s",
                        s->model->motions[s->mass.row[bad]].name, t);
        return true;
    }
    kmp_eval_bias(eval, qd);
    if (put_effort(eval, t, q, qd, text))
        return true;
    if ((bad = first_bad(s->n, eval->bias)) < 0)
        return false;
    kmp_text_printf(text, "the forces on '%s' are not a finite number (%s) at t = %.9g s", s->model->motions[bad].name,
                    isnan(eval->bias[bad]) ? "not a number" : "infinite", t);
    /* Names the forces on the joint itself; if there are none, all expressions that may reach it. */
    int named = 0;
    for (int own = 1; own >= 0 && named == 0; own--)
        for (int k = 0; k < s->model->force_count; k++) {
            const kmp_force *f = &s->model->forces[k];
            bool may = own ? f->motion == bad : f->effort || f->vector[0];
            if (may && named++ < MOST_NAMED)
                kmp_text_printf(text, "%s'%s'",
                                named > 1 ? ", "
                                : own     ? "; forces on it: "
                                          : "; possible causes: ",
                                f->name);
        }
    return true;
}

/* True if all values are finite, as far as an evaluator without M can decide. */
static bool is_finite_without_mass(kmp_evaluator *eval, double t, const double *q, const double *qd)
{
    const kempe_system *s = eval->system;
    if (!eval->by_products && !(eval->weighs_only && eval->by_bodies))
        return false;
    kmp_eval_closure(eval, t, q);
    kmp_eval_mass(eval);
    kmp_eval_bias(eval, qd);
    const double *values = eval->by_products ? eval->bias : eval->bodies.qdd; /* of M x the bias has all operands */
    return kmp_all_finite(s->m, eval->h) && kmp_all_finite(s->jacobian.count, eval->jacobian) &&
           kmp_all_finite(s->n, values);
}

bool kmp_put_not_finite(kmp_evaluator *eval, double t, const double *q, const double *qd, kmp_text *text)
{
    if (is_finite_without_mass(eval, t, q, qd))
        return false;
    bool by_bodies = eval->by_bodies;
    if (kmp_eval_add_composite(eval) != KEMPE_OK)
        return false;
    kmp_eval_set_by_bodies(eval, false);
    bool found = put_not_finite(eval, t, q, qd, text);
    kmp_eval_set_by_bodies(eval, by_bodies);
    return found;
}

/* -- motions without mass ------------------------------------------------------------------------------ */

/* The reduced mass Mr = X' M X in scaled coordinates, by complete pivoting. If its pivots vanish, back substitution
 * gives a motion s with Mr s = 0, and X s gives the coordinates that take part in it. */

/* The scaled change of coordinate i in the motion s of u. */
static double change_of(const kmp_reduction *red, const double *s, int i)
{
    const double *scale = red->eval->system->scale;
    double x = 0;
    for (int k = 0; k < red->p; k++)
        x += red->x[i + k * red->n] * s[k] * scale[red->part->u[k]];
    return x / scale[i];
}

/* Names the coordinates that move together: each by itself may move a mass, as in a gimbal whose outer axes are
 * parallel. The first body that they move is without mass; further ones may rest. */
static void name_motion(const kmp_reduction *red, const double *s, kmp_text *why)
{
    const kempe_model *model = red->eval->system->model;
    int largest = 0, others = 0, moved = -1;
    for (int i = 1; i < red->n; i++)
        if (fabs(change_of(red, s, i)) > fabs(change_of(red, s, largest)) * (1 + 1e-9))
            largest = i;
    kmp_text_printf(why, "the motion of '%s'", model->motions[largest].name);
    for (int i = 0; i < red->n; i++) {
        const bool takes_part = fabs(change_of(red, s, i)) > TAKES_PART * fabs(change_of(red, s, largest));
        if (takes_part && i != largest)
            kmp_text_printf(why, "%s'%s'", others++ ? ", " : " together with ", model->motions[i].name);
        if (takes_part && (moved < 0 || model->motions[i].body < moved))
            moved = model->motions[i].body;
    }
    const kmp_body *body = &model->bodies[moved < 0 ? model->motions[largest].body : moved];
    const bool beam = body->flexible > 0 && !model->flexibles[body->flexible - 1].file;
    kmp_text_printf(why, " moves no mass; give body '%s', or one that moves with it, a mass or an inertia%s",
                    body->name, beam ? ": the sections of this beam have one with 'rotary: yes'" : "");
}

/* found: also of a regular reduced mass. `before` begins the sentence. false: no memory. */
static bool find_massless(kmp_reduction *red, bool found, const char *before, kmp_text *why)
{
    int p = red->p, rank = 0, *row, *col;
    double *mx = KMP_ARENA_NEW(&red->arena, double, red->n), *mr = KMP_ARENA_NEW(&red->arena, double, p *p), *pivot, *s;
    KMP_ARENA_EACH(&red->arena, int, p, &row, &col);
    if (!KMP_ARENA_EACH(&red->arena, double, p, &pivot, &s))
        return false;
    kmp_reduction_tangent(red);
    /* Mr, unfactored, in scales of u. */
    const double *scale = red->eval->system->scale;
    for (int k = 0; k < p; k++) {
        memset(mx, 0, (size_t)red->n * sizeof *mx);
        kmp_eval_add_mass_times(red->eval, red->x + k * red->n, mx);
        for (int i = 0; i < p; i++)
            mr[i + k * p] = kmp_dot(red->n, red->x + i * red->n, mx) * scale[red->part->u[i]] * scale[red->part->u[k]];
    }
    kmp_lu_complete(p, p, mr, NULL, row, col, pivot);
    while (rank < p && pivot[rank] > 4 * p * DBL_EPSILON * pivot[0])
        rank++;
    found = found || rank < p;
    rank = rank < p ? rank : p - 1;
    kmp_lu_null_vector(p, p, mr, col, rank, rank, s);
    if (found) {
        kmp_text_put(why, before);
        name_motion(red, s, why);
    }
    return !why->failed;
}

static kempe_status look_for_massless(kmp_evaluator *eval, const kmp_partition *part, double t, const double *q,
                                      bool found, const char *before, kmp_text *why)
{
    kmp_reduction red = {0};
    const bool by_bodies = eval->by_bodies;
    if (by_bodies)
        KMP_TRY(kmp_eval_add_composite(eval));
    kmp_eval_set_by_bodies(eval, false);
    kempe_status status = kmp_reduction_init(&red, eval, part);
    kmp_eval_closure(eval, t, q);
    kmp_eval_mass(eval);
    if (status == KEMPE_OK && !kmp_reduction_factor(&red) && !find_massless(&red, found, before, why))
        status = kmp_fail_memory(eval->system->context);
    kmp_reduction_free(&red);
    kmp_eval_set_by_bodies(eval, by_bodies);
    return status;
}

static const char undetermined[] = "the accelerations are not determined: ";

kempe_status kmp_put_massless(kmp_evaluator *eval, const kmp_partition *part, double t, const double *q,
                              const char *before, kmp_text *text)
{
    return part->p > 0 ? look_for_massless(eval, part, t, q, false, before, text) : KEMPE_OK;
}

kempe_status kmp_explain_massless(kmp_evaluator *eval, const kmp_partition *part, double t, const double *q)
{
    kmp_text why = {0};
    /* Angles at a singular position may be the cause. */
    kmp_angles_explain(eval->system->model, q, &why);
    if (why.failed)
        (void)kmp_fail_memory(eval->system->context);
    else if (why.s)
        (void)kmp_fail(eval->system->context, KEMPE_E_FAILED, "the accelerations are not determined%s", why.s);
    bool angles = why.failed || why.s;
    kmp_text_free(&why);
    if (angles)
        return KEMPE_E_FAILED;
    if (part->p == 0)
        return kmp_fail(eval->system->context, KEMPE_E_FAILED, "the constraints do not determine the accelerations");
    kempe_status status = look_for_massless(eval, part, t, q, true, undetermined, &why);
    if (status == KEMPE_OK)
        status = kmp_fail(eval->system->context, KEMPE_E_FAILED, "%s",
                          why.s ? why.s : "the constraints do not determine the accelerations");
    kmp_text_free(&why);
    return status;
}

/* True if a large tree has moderate accelerations at rest by articulated bodies: then each motion moves a mass. */
static bool accelerates(kmp_evaluator *eval, double t, const double *q)
{
    const int n = eval->n;
    double *still = kmp_eval_goes_by_links(eval) && eval->by_bodies ? KMP_NEW(double, n) : NULL;
    bool found = false;
    if (still) {
        kmp_eval_closure(eval, t, q);
        kmp_eval_mass(eval);
        kmp_eval_bias(eval, still);
        found = kmp_all_finite(n, eval->bodies.qdd) && kmp_eval_size(eval, eval->bodies.qdd) < KMP_ARTICULATED_DOUBTFUL;
    }
    kmp_free(still);
    return found;
}

kempe_status kmp_foresee_massless(kmp_evaluator *eval, const kmp_partition *part, double t, const double *q,
                                  kmp_text *why)
{
    if (accelerates(eval, t, q))
        return KEMPE_OK;
    if (eval->weighs_only) {
        KMP_TRY(kmp_eval_add_composite(eval));
        kmp_eval_set_by_bodies(eval, false);
    }
    return kmp_put_massless(eval, part, t, q, undetermined, why);
}
