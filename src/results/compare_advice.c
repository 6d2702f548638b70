/* SPDX-License-Identifier: BSD-3-Clause */
/* Which way to take: sentences from the measurements. */
#include "base/memory.h"
#include "results/compare.h"
#include <math.h>

/* -- sentences --------------------------------------------------------------------------------------- */

bool kmp_sentences_add(kmp_sentences *list, const char *format, ...)
{
    kmp_text text = {0};
    va_list arguments;
    va_start(arguments, format);
    kmp_text_vprintf(&text, format, arguments);
    va_end(arguments);
    char *sentence = kmp_text_take(&text);
    char **grown = sentence ? kmp_realloc(list->s, (size_t)list->count + 1, sizeof *list->s) : NULL;
    if (!grown) {
        kmp_free(sentence);
        return false;
    }
    list->s = grown;
    list->s[list->count++] = sentence;
    return true;
}

void kmp_sentences_free(kmp_sentences *list)
{
    for (int k = 0; k < list->count; k++)
        kmp_free(list->s[k]);
    kmp_free(list->s);
    *list = (kmp_sentences){0};
}

void kmp_compare_name(kmp_text *text, const kmp_way *way)
{
    kmp_text_printf(text, "%s %s%s%s", way->road, way->form ? way->form : "", way->form ? " " : "", way->integrator);
}

/* -- the advice -------------------------------------------------------------------------------------- */

/* The level that most users mean; where nothing reaches it, the finest that is reached. */
#define USUAL 1e-6

static int chosen_level(const kempe_comparison *c)
{
    int chosen = -1;
    for (int l = 0; l < c->levels.count; l++)
        if (c->levels.best[l] >= 0 && (chosen < 0 || c->levels.level[l] >= 0.5 * USUAL))
            chosen = l;
    return chosen;
}

kempe_status kmp_compare_advise(kempe_comparison *c)
{
    int level = chosen_level(c);
    c->advice = (kmp_advice){.run = -1, .level = NAN};
    if (level < 0)
        return KEMPE_OK;
    const kmp_compared *run = &c->runs[c->levels.best[level]];
    c->advice.run = c->levels.best[level];
    c->advice.level = c->levels.level[level];
    if (kmp_sentences_add(&c->advice.because, "at error q <= %.0e it is the cheapest, %.3g ms", c->advice.level,
                          1e3 * run->cpu_s))
        return KEMPE_OK;
    return kmp_fail_memory(c->system->context);
}
