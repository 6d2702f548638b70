/* SPDX-License-Identifier: BSD-3-Clause */
#include "studies/simulate/contact_times.h"
#include "base/memory.h"
#include "model/compliant/compliant.h"
#include "output/vibration/weighting.h"
#include <math.h>

#define TURN 6.283185307179586477

double kmp_contact_time_depth(const kempe_trajectory *t, int k)
{
    const kmp_contact_time *contact = &t->log.contacts[k];
    const kempe_model *model = t->system->model;
    return kmp_compliant_depth(model, &model->forces[contact->force], contact->most);
}

kempe_status kmp_contact_times_find(const kempe_trajectory *t, int force, kmp_contact_times *times)
{
    const kmp_run_log *log = &t->log;
    double *depth = KMP_NEW(double, log->contact_count + 1), touching = 0;
    KMP_TRY(kmp_made(t->system->context, depth));
    *times = (kmp_contact_times){.force = force};
    for (int k = 0; k < log->contact_count; k++) {
        const kmp_contact_time *contact = &log->contacts[k];
        if (contact->force != force)
            continue;
        touching += (isnan(contact->until) ? t->report.t : contact->until) -
                    (isnan(contact->from) ? t->spec.t_start : contact->from);
        times->begun += !isnan(contact->from);
        if (!isnan(contact->most))
            depth[times->ended++] = kmp_contact_time_depth(t, k);
    }
    kmp_order(times->ended, depth);
    for (int k = 0; k < KMP_DEPTHS; k++)
        times->depth[k] = kmp_ordered_quantile(times->ended, depth, 0.25 * k);
    times->touching = touching > 0 ? touching / (t->report.t - t->spec.t_start) : 0;
    /* The driven rotation with the largest angle between the first and the last row. */
    const kempe_model *model = t->system->model;
    const kmp_samples *rows = &t->table;
    for (int k = 0; rows->rows > 1 && k < model->closure_count; k++) {
        const kmp_closure *closure = &model->closures[k];
        if (!kmp_closure_is_drive(closure) || !model->motions[closure->motion].rotation)
            continue;
        double turns = fabs(kmp_samples_get(rows, KMP_QUANTITY_Q, rows->rows - 1)[closure->motion] -
                            kmp_samples_get(rows, KMP_QUANTITY_Q, 0)[closure->motion]) /
                       TURN;
        if (turns >= 1 && turns > times->turns) {
            times->turns = turns;
            times->turning = model->motions[closure->motion].name;
        }
    }
    kmp_free(depth);
    return KEMPE_OK;
}
