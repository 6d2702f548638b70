/* SPDX-License-Identifier: BSD-3-Clause */
#include "constraints/fused.h"
#include "base/memory.h"
#include "constraints/fused_inside.h"
#include <math.h>

/* A multiplier of the elimination, rows scaled, beyond which its order is no longer good. */
#define MOST_MULTIPLIER 10.0

struct kmp_fused {
    const kmp_reduction *red;
    kmp_program *program;
    kmp_machine *machine;
    double *factor; /* of each multiplier: what scaling rows makes of it */
    int multipliers;
    long chart_version; /* of the constants */
    double *effort;     /* n, NULL: there are none */
};

/* Whether all numbers come from the program, and the linear algebra is small. */
static bool can_be(const kmp_reduction *red)
{
    const kempe_system *s = red->plant->system;
    bool can = red->p <= KMP_FUSED_FREEDOMS && s->motion->block_count == 0;
    for (int b = red->r > 0 ? kmp_block_count(red->block) : 0; can && b-- > 0;) {
        int size;
        (void)kmp_block_columns(red->block, b, &size);
        can = size <= KMP_FUSED_BLOCK;
    }
    return can;
}

static void run_constants(kmp_fused *f)
{
    kmp_machine_set(f->machine, KMP_IN_CHART, f->red->plant->chart);
    (void)kmp_machine_run(f->machine, KMP_STAGE_PARAMETERS);
    f->chart_version = f->red->plant->chart_version;
}

kempe_status kmp_fused_new(kmp_fused **out, const kmp_reduction *red)
{
    *out = NULL;
    if (!can_be(red))
        return KEMPE_OK;
    kmp_fused *f = KMP_NEW(kmp_fused, 1);
    if (f) {
        *f = (kmp_fused){.red = red};
        f->program = kmp_fused_write(red, &f->factor, &f->multipliers);
        f->machine = f->program ? kmp_machine_new(f->program, red->plant->backend) : NULL;
    }
    if (f && red->plant->system->force)
        f->effort = KMP_NEW(double, red->n);
    if (!f || !f->machine || (red->plant->system->force && !f->effort)) {
        kmp_fused_free(f);
        return kmp_fail_memory(red->plant->system->context);
    }
    kmp_machine_set(f->machine, KMP_IN_PARAMETER, red->plant->system->parameters);
    run_constants(f);
    *out = f;
    return KEMPE_OK;
}

void kmp_fused_free(kmp_fused *f)
{
    if (!f)
        return;
    kmp_machine_free(f->machine);
    kmp_program_free(f->program);
    kmp_free(f->effort);
    kmp_free(f->factor);
    kmp_free(f);
}

/* -- running ----------------------------------------------------------------------------------------- */

static void set_place(kmp_fused *f, double t, const double *q)
{
    if (f->chart_version != f->red->plant->chart_version)
        run_constants(f);
    kmp_machine_set(f->machine, KMP_IN_MODE, f->red->plant->mode);
    kmp_machine_set(f->machine, KMP_IN_TIME, &t);
    kmp_machine_set(f->machine, KMP_IN_Q, q);
}

bool kmp_fused_run(kmp_fused *f, double t, const double *q, const double *ud, double *qd, double *udd)
{
    const kmp_partition *part = f->red->part;
    bool positive = true;
    for (int c = 0; c < part->p; c++)
        qd[part->u[c]] = ud[c];
    set_place(f, t, q);
    kmp_machine_set(f->machine, KMP_IN_QD, qd);
    const double *rate = kmp_machine_run(f->machine, KMP_FUSED_RATES);
    for (int i = 0; i < part->r; i++)
        qd[part->v[i]] = rate[i];
    kmp_machine_set(f->machine, KMP_IN_QD, qd);
    if (f->effort) {
        kmp_system_effort(f->red->plant->system, t, q, qd, f->effort);
        kmp_machine_set(f->machine, KMP_IN_EFFORT, f->effort);
    }
    const double *end = kmp_machine_run(f->machine, KMP_FUSED_ACCELERATIONS);
    for (int c = 0; c < part->p; c++) {
        udd[c] = end[c];
        positive = positive && end[part->p + c] > 0;
    }
    return positive;
}

bool kmp_fused_applies(const kmp_fused *f)
{
    return f->red->plant->frozen || f->red->plant->system->events.count == 0;
}

bool kmp_fused_is_good(kmp_fused *f, double t, const double *q)
{
    if (f->multipliers == 0)
        return true;
    set_place(f, t, q);
    (void)kmp_machine_run(f->machine, KMP_FUSED_RATES);
    const double *multiplier = kmp_machine_run(f->machine, KMP_FUSED_MULTIPLIERS);
    for (int k = 0; k < f->multipliers; k++)
        if (!(fabs(multiplier[k] * f->factor[k]) <= MOST_MULTIPLIER))
            return false;
    return true;
}

kmp_counts kmp_fused_count(const kmp_fused *f)
{
    return kmp_program_count(f->program, KMP_FUSED_RATES, KMP_FUSED_ACCELERATIONS);
}
