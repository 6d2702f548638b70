/* SPDX-License-Identifier: BSD-3-Clause */
/* The growth of levels with friction: the largest row sum of |dF_i/df_j|, with levels F that depend on multipliers,
 * which depend on the friction f. Below 1 the iteration for levels contracts, so that there is one solution. */
#include "constraints/evaluation/load_multipliers.h"
#include "constraints/tolerances.h"
#include "integrators/friction/friction_inside.h"
#include <math.h>

static double level_of(const kmp_friction_run *x, int i)
{
    return kmp_friction_at(x, &x->element[i], KMP_ROLE_LEVEL);
}

static kempe_status add_column(kmp_runner *run, int j, double t, const double *q, const double *qd)
{
    kmp_friction_run *x = run->friction;
    double unit = KMP_FRICTION_UNIT * (x->tried[j] > 0 ? x->tried[j] : 1); /* the sizes of reactions have kinks */
    kmp_friction_set_given(run, &x->element[j], unit, 0);
    KMP_TRY(kmp_friction_measure(run, t, q, qd));
    for (int i = 0; i < x->count; i++)
        x->aside[i] += fabs(level_of(x, i) - x->tried[i]) / unit;
    kmp_friction_set_given(run, &x->element[j], 0, 0);
    return KEMPE_OK;
}

kempe_status kmp_friction_grow(kmp_runner *run, double t, const double *q, const double *qd, double *growth, int *most)
{
    kmp_friction_run *x = run->friction;
    *growth = 0;
    *most = 0;
    for (int i = 0; i < x->count; i++)
        kmp_friction_set_given(run, &x->element[i], 0, 0);
    KMP_TRY(kmp_friction_choose(run, t, q));
    KMP_TRY(kmp_friction_measure(run, t, q, qd));
    for (int i = 0; i < x->count; i++) {
        x->tried[i] = level_of(x, i);
        x->aside[i] = 0;
    }
    for (int j = 0; j < x->count; j++)
        if (!x->element[j].contact) /* the force of a contact is no friction */
            KMP_TRY(add_column(run, j, t, q, qd));
    for (int i = 0; i < x->count; i++) {
        *most = x->aside[i] > *growth ? i : *most;
        *growth = fmax(*growth, x->aside[i]);
    }
    kmp_load_forget(run->eval);
    return KEMPE_OK;
}

static void put_names(const kmp_friction_run *x, kmp_text *text)
{
    int count = 0;
    for (int i = 0; i < x->count; i++)
        if (!x->element[i].contact && (x->rest == 0 || x->element[i].tries))
            kmp_text_printf(text, "%s'%s'", count++ ? ", " : "", x->element[i].name);
}

kempe_status kmp_friction_complain(kmp_runner *run, double t, const double *q, const double *qd)
{
    kmp_friction_run *x = run->friction;
    kmp_text text = {0};
    double growth = 0;
    int most = 0;
    for (int k = 0; k < x->rest; k++)
        x->element[x->which[k]].tries = true;
    put_names(x, &text);
    kmp_text_printf(&text, " can neither slip nor stick at t = %.9g", t);
    if (kmp_friction_grow(run, t, q, qd, &growth, &most) == KEMPE_OK && growth >= 1)
        kmp_text_printf(
            &text,
            ": the level of '%s' grows by %.4g for each unit of friction, where less than 1 is sure to have "
            "a solution; reduce it",
            x->element[most].name, growth);
    else
        kmp_text_put(&text, ": the level depends too much on the friction itself; reduce it");
    if (x->rest > 0)
        kmp_text_put(&text, ", or regularise it with a 'speed'");
    kmp_context_clear(run->s->context);
    return kmp_fail_text(run->s->context, KEMPE_E_FAILED, &text);
}
