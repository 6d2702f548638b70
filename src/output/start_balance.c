/* SPDX-License-Identifier: BSD-3-Clause */
#include "output/start_balance.h"
#include "output/print.h"
#include <string.h>

void kmp_start_balance_show(kmp_text *text, const kmp_start_balance *balance)
{
    kmp_text lines = {0};
    if (!balance)
        return;
    kmp_text_printf(&lines, "begins %s\n%s", balance->title, balance->remarks);
    kmp_print_below(text, lines.s ? lines.s : "");
    kmp_text_free_part(text, &lines);
}

void kmp_start_balance_json(kmp_json *json, const kmp_start_balance *balance)
{
    if (!balance)
        return;
    kmp_json_put(json, "start { title %s stability %s growing %d rate %g residual %g remarks [", balance->title,
                 balance->stability, balance->growing, balance->rate, balance->residual);
    for (const char *at = balance->remarks; *at; at += strcspn(at, "\n") + 1) {
        kmp_text line = {0};
        kmp_text_printf(&line, "%.*s", (int)strcspn(at, "\n"), at);
        kmp_json_text(json, NULL, &line);
    }
    kmp_json_put(json, "] }");
}

void kmp_starts_show(kmp_text *text, const char *what, const char *at)
{
    if (at)
        kmp_text_printf(text, "  each %s begins at the equilibrium that its own start leads to%s\n", what,
                        strchr(at, ' ') ? ", a steady motion" : "");
}

bool kmp_start_balance_copy(kmp_arena *arena, const kmp_start_balance *from, const kmp_start_balance **to)
{
    kmp_start_balance *copy = from ? KMP_ARENA_NEW(arena, kmp_start_balance, 1) : NULL;
    *to = copy;
    if (!copy)
        return !from;
    *copy = *from;
    copy->title = kmp_arena_strdup(arena, from->title);
    copy->remarks = kmp_arena_strdup(arena, from->remarks);
    copy->idle = NULL;
    copy->idle_count = 0;
    return copy->title && copy->remarks;
}
