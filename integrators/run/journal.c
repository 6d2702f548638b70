/* SPDX-License-Identifier: BSD-3-Clause */
#include "integrators/run/journal.h"
#include "base/memory.h"

enum { MOST_NOTES = 1000 };

static bool make_room(kmp_journal *journal)
{
    if (journal->kept < journal->capacity)
        return true;
    int capacity = journal->capacity ? 2 * journal->capacity : 16;
    kmp_note *notes = NULL;
    if (journal->kept < MOST_NOTES)
        notes = kmp_realloc(journal->notes, (size_t)capacity, sizeof *notes);
    if (!notes)
        return false;
    journal->notes = notes;
    journal->capacity = capacity;
    return true;
}

void kmp_journal_note(kmp_journal *journal, const char *kind, double t, double before, double after, const char *format,
                      ...)
{
    kmp_text text = {0};
    va_list arguments;
    if (!journal)
        return;
    va_start(arguments, format);
    kmp_text_vprintf(&text, format, arguments);
    va_end(arguments);
    char *line = kmp_text_take(&text);
    journal->count++;
    if (line)
        kmp_log(journal->context, KEMPE_LOG_NOTE, "t = %.9g: %s", t, line);
    if (line && make_room(journal))
        journal->notes[journal->kept++] = (kmp_note){t, kind, before, after, line};
    else
        kmp_free(line);
}

void kmp_journal_free(kmp_journal *journal)
{
    for (int k = 0; k < journal->kept; k++)
        kmp_free(journal->notes[k].text);
    kmp_free(journal->notes);
    *journal = (kmp_journal){0};
}
