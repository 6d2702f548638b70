/* SPDX-License-Identifier: BSD-3-Clause */
/* Lists of coordinates with constant rates, from text to numbers, and the reasons why one cannot have such a rate. */
#include "analyses/equilibrium/steady.h"
#include "model/data/body.h"
#include "model/data/coordinates.h"
#include "model/data/model_context.h"
#include <string.h>

kempe_status kmp_steady_take(const kempe_model *model, const kmp_ranges *ranges, kmp_arena *arena, int *varies,
                             kmp_steady **rates)
{
    int open = -1;
    *rates = KMP_ARENA_NEW(arena, kmp_steady, kmp_model_motion_count(model));
    kempe_context *context = kmp_model_context(model);
    KMP_TRY(kmp_made(context, *rates));
    for (int k = 0; k < ranges->count; k++) {
        const kmp_range *range = &ranges->range[k];
        int c = -1;
        KMP_TRY(kmp_coordinate_find(model, "rates", range->name, strlen(range->name), &c));
        KMP_TRY(kmp_range_fits_motion(model, "rates", range, c, 1));
        for (int i = 0; i < k; i++)
            if ((*rates)[i].coordinate == c)
                return kmp_fail(context, KEMPE_E_ARGUMENT, "rates: '%s' is given twice", range->name);
        (*rates)[k] = (kmp_steady){.coordinate = c, .rate = range->from};
        if (range->count == 1)
            continue;
        if (!varies)
            KMP_TRY(kmp_range_is_value(context, "rates", range));
        else if (open >= 0)
            return kmp_fail(context, KEMPE_E_ARGUMENT, "rates: only one of them can be swept");
        open = k;
    }
    if (varies)
        *varies = open;
    return KEMPE_OK;
}

kempe_status kmp_steady_read(const kempe_model *model, const char *text, kmp_arena *arena, int *count,
                             kmp_steady **rates)
{
    kmp_ranges list = {0};
    KMP_TRY(text ? kmp_ranges_read(kmp_model_context(model), text, &list) : KEMPE_OK);
    kempe_status status = kmp_steady_take(model, &list, arena, NULL, rates);
    *count = status == KEMPE_OK ? list.count : 0;
    kmp_ranges_free(&list);
    return status;
}

void kmp_steady_list(kmp_text *text, const kempe_model *model, int count, const kmp_steady *rates, const double *qd)
{
    const char *between = "";
    for (int i = 0; i < count; i++) {
        const kmp_motion *motion = kmp_model_motion(model, rates[i].coordinate);
        kmp_shown as = kmp_shown_as(kmp_model_context(model), motion->rotation ? "rad/s" : "m/s");
        double rate = qd[rates[i].coordinate];
        kmp_text_printf(text, "%s'%s' at %.6g %s%s", between, motion->name, as.factor * rate, as.unit,
                        rates[i].how == KMP_RATE_KEPT ? " as at the start" : "");
        if (rates[i].how == KMP_RATE_HELD)
            kmp_text_printf(text,
                            motion->rotation ? " by a torque of %.6g N m (%.6g W)" : " by a force of %.6g N (%.6g W)",
                            rates[i].load, rates[i].load * rate);
        between = ", ";
    }
}

kempe_status kmp_steady_complain(const kempe_model *model, const kmp_steady *steady)
{
    const kmp_motion *motion = kmp_model_motion(model, steady->coordinate);
    kmp_shown as = kmp_shown_as(kmp_model_context(model), motion->rotation ? "rad/s" : "m/s");
    return kmp_fail(kmp_model_context(model), KEMPE_E_FAILED,
                    "no steady motion: the forces change along '%s', which moves at %.6g %s; for the balance at one "
                    "instant hold it (--hold) and solve for a load (--solve-for)",
                    motion->name, as.factor * steady->rate, as.unit);
}
