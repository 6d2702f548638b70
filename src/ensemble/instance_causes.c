/* SPDX-License-Identifier: BSD-3-Clause */
#include "ensemble/instance_causes.h"
#include "ensemble/sampling/values.h"
#include "output/print.h"
#include "output/result_table.h"
#include <ctype.h>
#include <string.h>

/* -- causes ------------------------------------------------------------------------------------------ */

/* Characters of a number with its sign; 0: there is none. */
static size_t number_length(const char *s)
{
    double value;
    const size_t sign = *s == '-', digits = kmp_text_to_number(s + sign, &value);
    return digits > 0 ? sign + digits : 0;
}

/* True if two sentences differ only in numbers. Digits within a name, as in 'C.1', are not a number. */
static bool is_same_cause(const char *a, const char *b)
{
    char before = ' ';
    while (*a && *b) {
        const bool in_name = isalnum((unsigned char)before) || strchr("_.'", before);
        const size_t m = in_name ? 0 : number_length(a), n = in_name ? 0 : number_length(b);
        if ((m == 0) != (n == 0) || (m == 0 && *a != *b))
            return false;
        before = m > 0 ? '0' : *a;
        a += m > 0 ? m : 1;
        b += n > 0 ? n : 1;
    }
    return *a == *b;
}

static kmp_instance_cause *find(kmp_instance_causes *causes, kempe_outcome outcome, const char *reason)
{
    for (int k = 0; k < causes->count; k++)
        if (causes->cause[k].outcome == outcome && is_same_cause(causes->cause[k].reason, reason))
            return &causes->cause[k];
    return NULL;
}

/* The values of an instance: the columns before `end`, the first ones of many. */
static const char *keep_values(kmp_instance_causes *causes, const kempe_table *t, int row, int end)
{
    enum { NAMED = 4 };
    kmp_text text = {0};
    kmp_text_put(&text, "");
    for (int c = 0; c < end && c < NAMED; c++) {
        /* ", crank = 0.3 m" */
        const kempe_context *context = kmp_table_context(t);
        kmp_text_printf(&text, ", %s = ", kmp_value_name(kempe_table_column_name(t, c)));
        kmp_print_quantity(&text, context, 6, kempe_table_number(t, row, c),
                           kmp_print_unknown(context, kempe_table_unit(t, c)));
    }
    kmp_text_put(&text, end > NAMED ? ", .." : "");
    return kmp_text_keep(&text, &causes->arena);
}

static void add(kmp_instance_causes *causes, kempe_outcome outcome, const kempe_table *t, int row, long first)
{
    const char *reason = kempe_table_word(t, row, kempe_table_find(t, "reason"));
    kmp_instance_cause *known = find(causes, outcome, reason);
    if (known) {
        known->count++;
    } else if (causes->count == KMP_CAUSES_MOST) {
        causes->others++;
    } else {
        kmp_instance_cause made = {.outcome = outcome, .count = 1, .first = first + row};
        made.reason = kmp_arena_strdup(&causes->arena, reason);
        made.values = keep_values(causes, t, row, kempe_table_find(t, "status"));
        if (made.reason && made.values)
            causes->cause[causes->count++] = made;
    }
}

void kmp_instance_causes_add(kmp_instance_causes *causes, const kempe_table *t, long first)
{
    const int status = kempe_table_find(t, "status"), reason = kempe_table_find(t, "reason");
    for (int row = 0; status >= 0 && reason >= 0 && row < kempe_table_row_count(t); row++) {
        const char *word = kempe_table_word(t, row, status), *why = kempe_table_word(t, row, reason);
        if (word && why && *why)
            add(causes, kmp_outcome_read(word), t, row, first);
    }
}

/* -- text -------------------------------------------------------------------------------------------- */

void kmp_instance_causes_put(kmp_text *text, const kmp_instance_causes *causes)
{
    for (int k = 0; k < causes->count; k++) {
        const kmp_instance_cause *c = &causes->cause[k];
        kmp_text words = {0};
        kmp_text_printf(&words, "%ld %s: %s (first: instance %ld%s)", c->count, kempe_outcome_text(c->outcome),
                        c->reason, c->first + 1, c->values);
        kmp_print_wrapped(text, "  ", 4, words.s ? words.s : "");
        kmp_text_free_part(text, &words);
    }
    if (causes->others > 0)
        kmp_text_printf(text, "  %ld for other reasons, which their rows have\n", causes->others);
    text->failed = text->failed || causes->arena.failed;
}

void kmp_instance_causes_free(kmp_instance_causes *causes)
{
    kmp_arena_free(&causes->arena);
    *causes = (kmp_instance_causes){0};
}
