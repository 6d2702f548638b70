/* SPDX-License-Identifier: BSD-3-Clause */
#include "output/times.h"
#include "base/memory.h"
#include "model/data/model.h"
#include <math.h>

enum { DEFAULT_ROWS = 200 };

kempe_status kmp_times_spacing(const kempe_system *system, double requested, double t_end, double *every)
{
    const kempe_model *model = system->model;
    const kmp_run_settings *run = &model->run;
    kmp_text complaint = {0};
    *every = requested > 0 ? requested : run->output_step > 0 ? run->output_step : t_end / DEFAULT_ROWS;
    if (kmp_rows_fit(*every, t_end, &complaint))
        return KEMPE_OK;
    if (requested > 0 || complaint.failed)
        return kmp_fail_text(system->context, KEMPE_E_ARGUMENT, &complaint);
    kempe_status status = kmp_complain(system->context, model->files[run->every_place.file], run->every_place.line,
                                       run->every_place.column, "%s", complaint.s ? complaint.s : "");
    kmp_text_free(&complaint);
    return status;
}

/* k steps of `every`, as a division where 1 / every is whole: 3 / 10 is 0.3, 3 * 0.1 is not. */
static double grid_time(double every, int k)
{
    double inverse = round(1 / every);
    if (inverse >= 1 && fabs(every * inverse - 1) < 1e-15)
        return k / inverse;
    return k * every;
}

static bool near(double a, double b)
{
    return fabs(a - b) <= 1e-12 * fmax(fabs(a), fabs(b));
}

/* Appends t; of two times that are one up to rounding, the firm one stays. */
static void append(kmp_times *times, double t, bool firm)
{
    if (times->count == 0 || !near(times->t[times->count - 1], t))
        times->t[times->count++] = t;
    else if (firm)
        times->t[times->count - 1] = t;
}

/* Two reference times may be as near as they like: they stay apart. */
static void append_reference(kmp_times *times, double t, const double *before)
{
    if (before && times->t[times->count - 1] <= *before && t > *before)
        times->t[times->count++] = t;
    else
        append(times, t, true);
}

bool kmp_times_init(kmp_times *times, double every, double t_end, const kmp_reference *reference)
{
    int rows = reference ? reference->rows : 0, grid = (int)(t_end / every);
    *times = (kmp_times){.t = KMP_NEW(double, grid + rows + 3)};
    if (!times->t)
        return false;
    int r = 0;
    for (int k = 0; k <= grid; k++) {
        double t = grid_time(every, k);
        for (; r < rows && reference->t[r] <= t; r++)
            append_reference(times, reference->t[r], r > 0 ? &reference->t[r - 1] : NULL);
        if (t < t_end && (r == rows || !near(t, reference->t[r])))
            append(times, t, false);
    }
    for (; r < rows; r++)
        append_reference(times, reference->t[r], r > 0 ? &reference->t[r - 1] : NULL);
    if (rows > 0 && near(reference->t[rows - 1], t_end))
        return true;
    append(times, t_end, true);
    return true;
}

KMP_CLEARS(kmp_times, times, kmp_free(times->t))
