/* SPDX-License-Identifier: BSD-3-Clause */
#include "integrators/run/run_log.h"
#include "base/memory.h"

enum { MOST_ENTRIES = 1000 };

void kmp_run_log_add(kmp_run_log *log, const char *kind, double t, double before, double after, const char *format, ...)
{
    kmp_text text = {0};
    if (!log)
        return;
    KMP_TEXT_ARGUMENTS(&text, format);
    char *line = kmp_text_take(&text);
    log->count++;
    if (line)
        kmp_log(log->context, KEMPE_LOG_INFO, "t = %.9g: %s", t, line);
    kmp_log_entry *entries = NULL;
    if (line && log->kept < MOST_ENTRIES)
        entries = kmp_list_room(log->entries, (size_t)log->kept, sizeof *entries);
    log->entries = entries ? entries : log->entries;
    if (entries)
        log->entries[log->kept++] = (kmp_log_entry){t, kind, before, after, line};
    else
        kmp_free(line);
}

void kmp_run_log_free(kmp_run_log *log)
{
    for (int k = 0; k < log->kept; k++)
        kmp_free(log->entries[k].text);
    kmp_free(log->entries);
    *log = (kmp_run_log){0};
}
