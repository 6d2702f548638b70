/* SPDX-License-Identifier: BSD-3-Clause */
/* Entries of a run between its steps, and the times of contacts, each with its largest value. */
#include "integrators/formulations/run_log.h"
#include "base/memory.h"
#include <math.h>
#include <stdlib.h>

enum { MOST_ENTRIES = 1000, MOST_CONTACTS = 100000 };

void kmp_run_log_add(kmp_run_log *log, const char *kind, double t, double before, double after, const char *format, ...)
{
    kmp_text text = {0};
    if (!log)
        return;
    KMP_TEXT_ARGUMENTS(&text, format);
    char *line = kmp_text_take(&text);
    log->count++;
    if (line && log->context)
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

/* An entry of a part of a run. */
typedef struct placed {
    const kmp_log_entry *entry;
    int part, number;
} placed;

static int compare_places(const void *a, const void *b)
{
    const placed *x = a, *y = b;
    if (x->entry->t != y->entry->t)
        return x->entry->t < y->entry->t ? -1 : 1;
    return x->part != y->part ? x->part - y->part : x->number - y->number;
}

bool kmp_run_log_merge(kmp_run_log *log, kempe_context *context, kmp_run_log *parts, int count, double until)
{
    kmp_run_log own = {.context = context};
    size_t total = 0, at = 0;
    for (int i = 0; i < count; i++)
        total += (size_t)parts[i].kept;
    placed *all = KMP_NEW(placed, total);
    for (int i = 0; all && i < count; i++)
        for (int k = 0; k < parts[i].kept; k++)
            if (!(parts[i].entries[k].t > until))
                all[at++] = (placed){&parts[i].entries[k], i, k};
    if (at > 1)
        qsort(all, at, sizeof *all, compare_places);
    for (size_t k = 0; k < at; k++)
        kmp_run_log_add(log ? log : &own, all[k].entry->kind, all[k].entry->t, all[k].entry->before,
                        all[k].entry->after, "%s", all[k].entry->text);
    for (int i = 0; i < count; i++) {
        if (log)
            log->count += parts[i].count - parts[i].kept;
        kmp_run_log_free(&parts[i]);
    }
    kmp_free(all);
    kmp_run_log_free(&own);
    return all;
}

void kmp_run_log_contact(kmp_run_log *log, int force, double t, bool begins, double most)
{
    kmp_contact_time *contacts = NULL;
    if (!log)
        return;
    for (int k = log->contact_count - 1; k >= 0 && !begins; k--) {
        kmp_contact_time *last = &log->contacts[k];
        if (last->force != force)
            continue;
        if (!isnan(last->until))
            break;
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
