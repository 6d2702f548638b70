/* SPDX-License-Identifier: BSD-3-Clause */
#include "analysis/steady.h"
#include "base/memory.h"
#include "model/nearest.h"
#include "model/ranges.h"
#include <string.h>

int kmp_steady_coordinate(const kempe_model *model, const char *name, const char *what)
{
    name += strspn(name, " \t");
    kmp_nearest nearest = kmp_nearest_begin(name);
    for (int k = 0; k < model->motion_count; k++) {
        if (strcmp(model->motions[k].name, name) == 0)
            return k;
        kmp_nearest_offer(&nearest, model->motions[k].name);
    }
    (void)kmp_fail(model->context, KEMPE_E_ARGUMENT, "%s: the model has no coordinate '%s'%s%s%s", what, name,
                   nearest.best ? ", did you mean '" : "", nearest.best ? nearest.best : "", nearest.best ? "'?" : "");
    return -1;
}

static kempe_status take(const kempe_model *model, const kmp_range *range, int count, kmp_steady *rates)
{
    int c = kmp_steady_coordinate(model, range->name, "rates");
    if (c < 0)
        return KEMPE_E_ARGUMENT;
    if (range->count != 1)
        return kmp_fail(model->context, KEMPE_E_ARGUMENT, "rates: '%s' takes one value, not a range", range->name);
    for (int i = 0; i < count; i++)
        if (rates[i].coordinate == c)
            return kmp_fail(model->context, KEMPE_E_ARGUMENT, "rates: '%s' stands twice", range->name);
    rates[count] = (kmp_steady){c, range->from};
    return KEMPE_OK;
}

kempe_status kmp_steady_read(const kempe_model *model, const char *text, int *count, kmp_steady **rates)
{
    kmp_ranges list = {0};
    kempe_status status = text ? kmp_ranges_read(model->context, text, &list) : KEMPE_OK;
    if (status != KEMPE_OK)
        return status;
    kmp_steady *read = KMP_NEW(kmp_steady, list.count);
    if (!read)
        status = kmp_fail_memory(model->context);
    for (int k = 0; status == KEMPE_OK && k < list.count; k++)
        status = take(model, &list.range[k], k, read);
    if (status == KEMPE_OK) {
        *count = list.count;
        *rates = read;
    } else {
        kmp_free(read);
    }
    kmp_ranges_free(&list);
    return status;
}

kempe_status kmp_steady_complain(const kempe_model *model, const kmp_steady *steady)
{
    const kmp_motion *motion = &model->motions[steady->coordinate];
    return kmp_fail(model->context, KEMPE_E_FAILED,
                    "no steady motion: '%s' shall go on at %.6g %s/s, but the forces change as it goes; hold it (fix) "
                    "and let a load be free, to have the balance of one moment",
                    motion->name, steady->rate, motion->rotation ? "rad" : "m");
}
