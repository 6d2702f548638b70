/* SPDX-License-Identifier: BSD-3-Clause */
/* `generate --count`: operation counts of each requested set of equations derived separately, and of all as one
 * program. */
#include "base/memory.h"
#include "exchange/code/source.h"
#include "model/data/model_context.h"
#include "output/print.h"
#include "platform/platform.h"
#include <kempe/generate.h>
#include <string.h>

struct kempe_count {
    kempe_context *context;
    char *model;
    kmp_set_choice choice;
    kmp_tally tally[KMP_MOST_CHOSEN], all;
    double cpu_s;
};

/* -- counting ---------------------------------------------------------------------------------------- */

static kempe_status count(kempe_count *c, const kempe_model *model, const kempe_generate_options *generation)
{
    kmp_set_choice *choice = &c->choice;
    double begin = kmp_cpu_now();
    KMP_TRY(kmp_choice_read(model, generation, choice));
    for (int k = 0; k < choice->count; k++)
        KMP_TRY(kmp_tally_sets(model, &choice->scene, choice->chosen[k].sets, &c->tally[k]));
    KMP_TRY(kmp_tally_sets(model, &choice->scene, choice->all, &c->all));
    c->cpu_s = kmp_cpu_now() - begin;
    return KEMPE_OK;
}

kempe_status kempe_count_new(const kempe_model *model, const kempe_generate_options *generation, kempe_count **out)
{
    KMP_WANTED(NULL, model, "model");
    kempe_context *context = kmp_model_context(model);
    KMP_WANTED(context, out, "count");
    KMP_OPTIONS(context, kempe_generate_options, generation);
    kmp_context_clear(context);
    KMP_TRY(kmp_model_check_finished(model));
    KMP_MAKE(context, kempe_count, c);
    c->context = context;
    c->model = kmp_strdup(kempe_model_name(model));
    kempe_status status = c->model ? count(c, model, generation) : kmp_fail_memory(context);
    return KMP_GIVE_OR_FREE(status, out, c, kempe_count_free);
}

KMP_FREES(kempe_count, c, kmp_choice_free(&c->choice), kmp_free(c->model))

/* -- printing ---------------------------------------------------------------------------------------- */

static void show_entry(kmp_text *text, int width, const char *name, const kmp_tally *t)
{
    const kmp_counts *c = &t->counts;
    kmp_text_printf(text, "  %-*s %7ld %8ld | %6ld %6ld %3ld %4ld %4ld %5ld | %8ld %8ld | %6ld %7ld\n", width, name,
                    c->paper, c->robotran, c->add, c->mul, c->div, c->neg, c->trig, c->other, t->runtime.paper,
                    t->runtime.robotran, t->operations, t->useless);
}

static void show_count(kmp_text *text, const void *result)
{
    const kempe_count *c = result;
    size_t longest = 8;
    for (int k = 0; k < c->choice.count; k++)
        longest = strlen(c->choice.chosen[k].name) > longest ? strlen(c->choice.chosen[k].name) : longest;
    int width = (int)longest;
    kmp_text_printf(text, "%s: %s, %ld operations (+ - * /) for all sets together, %ld with functions\n", c->model,
                    kempe_outcome_text(KEMPE_OUTCOME_COMPLETE), c->all.counts.paper, c->all.counts.robotran);
    kmp_text_printf(text, "  M by the scheme %s, numbers %s%s\n\n", c->choice.scheme,
                    c->choice.scene.keep ? "kept as symbols" : "inserted",
                    c->choice.scene.body_inputs ? ", forces and torques on bodies as inputs" : "");
    kmp_text_printf(text, "  %-*s %7s %8s | %6s %6s %3s %4s %4s %5s | %8s %8s | %6s %7s\n", width, "set", "+ - * /",
                    "with fns", "+ -", "*", "/", "neg", "trig", "other", "run time", "with fns", "needed", "removed");
    for (int k = 0; k < c->choice.count; k++)
        show_entry(text, width, c->choice.chosen[k].name, &c->tally[k]);
    show_entry(text, width, "all", &c->all);
    kmp_text_put(text, "\nwith fns: with unary minus and functions, as ROBOTRAN counts; run time: without terms of "
                       "parameters;\nneeded, removed: operations that the set needs, and operations removed as "
                       "unused\n");
}

static void json_entry(kmp_json *json, const char *name, const kmp_tally *t)
{
    kmp_json_put(json, "%s { paper %ld robotran %ld add %ld mul %ld div %ld", name, t->counts.paper, t->counts.robotran,
                 t->counts.add, t->counts.mul, t->counts.div);
    kmp_json_put(json, "neg %ld trig %ld other %ld kept %ld removed %ld", t->counts.neg, t->counts.trig,
                 t->counts.other, t->operations, t->useless);
    kmp_json_put(json, "serial_steps %ld vsi_steps %ld runtime { paper %ld robotran %ld } }", t->steps.serial,
                 t->steps.vector, t->runtime.paper, t->runtime.robotran);
}

static void json_count(kmp_text *text, const void *result)
{
    const kempe_count *c = result;
    kmp_json json = kmp_json_begin(text);
    kmp_json_put(&json, "{ model %s status %s reason %s build_s %g scheme %s sets {", c->model,
                 kempe_outcome_text(KEMPE_OUTCOME_COMPLETE), "", c->cpu_s, c->choice.scheme);
    for (int k = 0; k < c->choice.count; k++)
        json_entry(&json, c->choice.chosen[k].name, &c->tally[k]);
    json_entry(&json, "all", &c->all);
    kmp_json_put(&json, "} cpu_s %g }", c->cpu_s);
}

kempe_status kempe_count_print(const kempe_count *c, kempe_format format, char **text)
{
    KMP_WANTED(NULL, c, "count");
    return kmp_print_result(c->context, format, format == KEMPE_JSON ? json_count : show_count, c, text);
}
