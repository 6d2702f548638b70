/* SPDX-License-Identifier: BSD-3-Clause */
/* Comma-separated lists of roads, forms, integrators and tolerances, against the table of ways. */
#include "base/memory.h"
#include "results/compare.h"
#include <math.h>
#include <string.h>

static const char default_rtols[] = "1e-4,1e-6,1e-8,1e-10,1e-12";

typedef enum part { PART_ROAD, PART_FORM, PART_INTEGRATOR, PARTS } part;

static const char *const part_name[PARTS] = {"road", "form", "integrator"};

static const char *part_of(const kmp_way *way, part p)
{
    const char *name = p == PART_ROAD ? way->road : p == PART_FORM ? way->form : way->integrator;
    return name ? name : "";
}

const kmp_way *kmp_way_find(const char *road, const char *form)
{
    const kmp_way *way;
    for (int k = 0; (way = kmp_way_get(k)); k++)
        if (strcmp(way->road, road) == 0 && (!form || strcmp(part_of(way, PART_FORM), form) == 0))
            return way;
    return NULL;
}

/* -- names ------------------------------------------------------------------------------------------- */

static bool word_is(const char *s, size_t length, const char *name)
{
    return strlen(name) == length && memcmp(s, name, length) == 0;
}

/* An absent list holds everything. */
static bool list_has(const char *list, const char *name)
{
    if (!list)
        return true;
    for (const char *s = list;; s++) {
        size_t length = strcspn(s, ",");
        if (word_is(s, length, name))
            return true;
        s += length;
        if (!*s)
            return false;
    }
}

static bool is_known(const char *s, size_t length, part p)
{
    const kmp_way *way;
    for (int k = 0; (way = kmp_way_get(k)); k++)
        if (length > 0 && word_is(s, length, part_of(way, p)))
            return true;
    return false;
}

/* Each name of the table once. */
static void list_known(kmp_text *text, part p)
{
    const kmp_way *way;
    for (int k = 0, said = 0; (way = kmp_way_get(k)); k++) {
        const char *name = part_of(way, p);
        bool again = !*name;
        for (int i = 0; i < k; i++)
            again = again || strcmp(part_of(kmp_way_get(i), p), name) == 0;
        if (!again)
            kmp_text_printf(text, "%s%s", said++ ? ", " : "", name);
    }
}

static kempe_status check_names(kempe_context *context, const char *list, part p)
{
    for (const char *s = list; s;) {
        size_t length = strcspn(s, ",");
        if (!is_known(s, length, p)) {
            kmp_text known = {0};
            list_known(&known, p);
            kempe_status status = kmp_fail(context, KEMPE_E_ARGUMENT, "there is no %s '%.*s'; there are %s",
                                           part_name[p], (int)length, s, known.failed || !known.s ? "none" : known.s);
            kmp_text_free(&known);
            return status;
        }
        s = s[length] ? s + length + 1 : NULL;
    }
    return KEMPE_OK;
}

/* -- ways and tolerances ----------------------------------------------------------------------------- */

static kempe_status choose_ways(kmp_choice *choice, kempe_context *context, const char *const list[PARTS])
{
    const kmp_way *way;
    int count = 0;
    while (kmp_way_get(count))
        count++;
    choice->ways = KMP_NEW(const kmp_way *, count);
    if (!choice->ways)
        return kmp_fail_memory(context);
    for (int k = 0; (way = kmp_way_get(k)); k++)
        if (list_has(list[PART_ROAD], part_of(way, PART_ROAD)) && list_has(list[PART_FORM], part_of(way, PART_FORM)) &&
            list_has(list[PART_INTEGRATOR], part_of(way, PART_INTEGRATOR)))
            choice->ways[choice->way_count++] = way;
    if (choice->way_count > 0)
        return KEMPE_OK;
    return kmp_fail(context, KEMPE_E_ARGUMENT, "no road, form and integrator of those asked for go together");
}

static kempe_status choose_rtols(kmp_choice *choice, kempe_context *context, const char *list)
{
    size_t commas = 0;
    for (const char *s = list; *s; s++)
        commas += *s == ',';
    choice->rtols = KMP_NEW(double, commas + 1);
    if (!choice->rtols)
        return kmp_fail_memory(context);
    for (const char *s = list; s;) {
        double *rtol = &choice->rtols[choice->rtol_count++];
        size_t length = strcspn(s, ","), blank = strspn(s, " "), read = kmp_text_to_number(s + blank, rtol);
        size_t tail = strspn(s + blank + read, " ");
        if (read == 0 || blank + read + tail != length || !(*rtol > 0) || !(*rtol < 1))
            return kmp_fail(context, KEMPE_E_ARGUMENT, "rtol '%.*s': numbers between 0 and 1, separated by commas",
                            (int)length, s);
        s = s[length] ? s + length + 1 : NULL;
    }
    return KEMPE_OK;
}

kempe_status kmp_choice_init(kmp_choice *choice, kempe_context *context, const kempe_compare_run *options)
{
    const char *const list[PARTS] = {options->roads, options->forms, options->integrators};
    kempe_status status = KEMPE_OK;
    *choice = (kmp_choice){0};
    for (part p = PART_ROAD; p < PARTS && status == KEMPE_OK; p++)
        status = check_names(context, list[p], p);
    if (status == KEMPE_OK)
        status = choose_ways(choice, context, list);
    if (status == KEMPE_OK)
        status = choose_rtols(choice, context, options->rtols ? options->rtols : default_rtols);
    if (status != KEMPE_OK)
        kmp_choice_free(choice);
    return status;
}

void kmp_choice_free(kmp_choice *choice)
{
    kmp_free(choice->ways);
    kmp_free(choice->rtols);
    *choice = (kmp_choice){0};
}
