/* SPDX-License-Identifier: BSD-3-Clause */
/* Entries of a run between its steps, and the times of contacts, each with its largest value. */
#include "integrators/formulations/run_log.h"
#include "base/memory.h"
#include <math.h>

enum { MOST_ENTRIES = 1000, MOST_CONTACTS = 100000 };

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

/* The last contact of the element that has not ended; NULL: none. */
static kmp_contact_time *open_contact(const kmp_run_log *log, int force)
{
    for (int k = log->contact_count - 1; k >= 0; k--)
        if (log->contacts[k].force == force)
            return isnan(log->contacts[k].until) ? &log->contacts[k] : NULL;
    return NULL;
}

void kmp_run_log_contact(kmp_run_log *log, int force, double t, bool begins, double most)
{
    kmp_contact_time *last = log && !begins ? open_contact(log, force) : NULL, *contacts = NULL;
    if (!log)
        return;
    if (last) {
        last->until = t;
        last->most = most;
        return;
    }
    if (log->contact_count < MOST_CONTACTS)
        contacts = kmp_list_room(log->contacts, (size_t)log->contact_count, sizeof *contacts);
    log->contacts = contacts ? contacts : log->contacts;
    if (contacts)
        contacts[log->contact_count++] =
            begins ? (kmp_contact_time){force, t, NAN, NAN} : (kmp_contact_time){force, NAN, t, most};
    else
        log->contacts_cut = true;
}

void kmp_run_log_free(kmp_run_log *log)
{
    for (int k = 0; k < log->kept; k++)
        kmp_free(log->entries[k].text);
    kmp_free(log->entries);
    kmp_free(log->contacts);
    *log = (kmp_run_log){0};
}
