/* SPDX-License-Identifier: BSD-3-Clause */
#include "constraints/closing/not_finite.h"
#include <math.h>

enum { MOST_NAMED = 5 };

static int first_bad(int count, const double *x)
{
    for (int k = 0; k < count; k++)
        if (!isfinite(x[k]))
            return k;
    return -1;
}

/* Names the forces on the joint itself; if there are none, all expressions that may reach it. */
static void put_forces(const kempe_model *model, int motion, kmp_text *text)
{
    int named = 0;
    for (int own = 1; own >= 0 && named == 0; own--)
        for (int k = 0; k < model->force_count; k++) {
            const kmp_force *f = &model->forces[k];
            bool may = own ? f->motion == motion : f->effort || f->vector[0];
            if (may && named++ < MOST_NAMED)
                kmp_text_printf(text, "%s'%s'",
                                named > 1 ? ", "
                                : own     ? "; forces on it: "
                                          : "; possible causes: ",
                                f->name);
        }
}

static bool put_not_finite(kmp_evaluator *eval, double t, const double *q, const double *qd, kmp_text *text)
{
    const kempe_system *s = eval->system;
    int bad;
    kmp_eval_closure(eval, t, q);
    if ((bad = first_bad(s->m, eval->h)) >= 0 ||
        ((bad = first_bad(s->jacobian.count, eval->jacobian)) >= 0 && (bad = s->jacobian.row[bad]) >= 0)) {
        kmp_text_printf(text, "closure row '%s' is not a finite number at t = %.9g", s->row_names[bad], t);
        return true;
    }
    kmp_eval_mass(eval);
    if ((bad = first_bad(s->mass.count, eval->mass)) >= 0) {
        kmp_text_printf(text, "the mass that '%s' moves is not a finite number at t = %.9g",
                        s->model->motions[s->mass.row[bad]].name, t);
        return true;
    }
    kmp_eval_bias(eval, qd);
    if ((bad = first_bad(s->n, eval->bias)) < 0)
        return false;
    kmp_text_printf(text, "the forces on '%s' are not a finite number (%s) at t = %.9g", s->model->motions[bad].name,
                    isnan(eval->bias[bad]) ? "not a number" : "infinite", t);
    put_forces(s->model, bad, text);
    return true;
}

bool kmp_put_not_finite(kmp_evaluator *eval, double t, const double *q, const double *qd, kmp_text *text)
{
    bool by_bodies = eval->by_bodies;
    kmp_eval_take(eval, false);
    bool found = put_not_finite(eval, t, q, qd, text);
    kmp_eval_take(eval, by_bodies);
    return found;
}
