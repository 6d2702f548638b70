/* SPDX-License-Identifier: BSD-3-Clause */
#include "studies/simulate/run_remarks.h"
#include "base/context.h"
#include <string.h>

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
