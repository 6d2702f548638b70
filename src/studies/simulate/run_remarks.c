/* SPDX-License-Identifier: BSD-3-Clause */
#include "studies/simulate/run_remarks.h"
#include "base/context.h"
#include "base/memory.h"
#include "model/data/force.h"
#include <math.h>
#include <string.h>

#define ROUNDING 1e-9 /* of the largest level so far */

/* The first entry of a condition: at the start, or where it begins to hold. NULL: it never holds. */
static const kmp_log_entry *first_of(const kmp_run_log *log, const char *text)
{
    const size_t length = strlen(text);
    for (int k = 0; k < log->kept; k++)
        if (log->entries[k].text && strncmp(log->entries[k].text, text, length) == 0 &&
            log->entries[k].text[length] == ',')
            return &log->entries[k];
    return NULL;
}

void kmp_remark_conditions(const kempe_system *system, const kmp_run_log *log, kmp_text *remarks)
{
    for (int k = 0; k < system->events.count; k++) {
        const kmp_log_entry *first = system->events.condition[k].at_start ? first_of(log, system->event_text[k]) : NULL;
        if (!first)
            continue;
        kmp_text line = {0};
        kmp_text_printf(&line, "%s, at t = %.6g s", system->event_text[k], first->t);
        kmp_log(system->context, KEMPE_LOG_WARNING, "%s", line.s ? line.s : "");
        kmp_text_printf(remarks, "%s\n", line.s ? line.s : "");
        kmp_text_free_part(remarks, &line);
    }
}

/* The place of a level of friction, in slip or in stick, among the conditions from k on; the number of these: none. */
static int next_level(const kmp_events *events, int k)
{
    for (; k < events->count; k++) {
        const kmp_condition *c = &events->condition[k];
        const bool level = c->role == KMP_ROLE_LEVEL || c->role == KMP_ROLE_STATIC || c->role == KMP_ROLE_LEVEL_BACK ||
                           c->role == KMP_ROLE_STATIC_BACK;
        if (level && kmp_force_sticks(c->of))
            break;
    }
    return k;
}

bool kmp_doubt_levels(const kmp_samples *table, kmp_evaluator *eval)
{
    const kmp_events *events = &eval->system->events;
    if (next_level(events, 0) == events->count)
        return true;
    double *change = KMP_NEW(double, events->count), *most = KMP_NEW(double, events->count);
    bool *told = KMP_NEW(bool, events->count);
    const bool made = change && most && told;
    for (int row = 0; made && row < table->rows; row++) {
        const double t = kmp_samples_time(table, row);
        kmp_eval_all_changes(
            eval, t, kmp_samples_get(table, KMP_QUANTITY_Q, row), kmp_samples_get(table, KMP_QUANTITY_QD, row),
            kmp_samples_get(table, KMP_QUANTITY_QDD, row), kmp_samples_get(table, KMP_QUANTITY_LAMBDA, row), change);
        for (int k = next_level(events, 0); k < events->count; k = next_level(events, k + 1)) {
            most[k] = fmax(most[k], fabs(change[k]));
            if (told[k] || !(change[k] < -ROUNDING * most[k]))
                continue;
            told[k] = true;
            kmp_doubt(eval->system->context,
                      "friction '%s' has the level %.4g at t = %.6g s, which must not be negative: it would push",
                      ((const kmp_force *)events->condition[k].of)->name, change[k], t);
        }
    }
    kmp_free(change);
    kmp_free(most);
    kmp_free(told);
    return made;
}
