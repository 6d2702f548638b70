/* SPDX-License-Identifier: BSD-3-Clause */
/* The study of limit cycles: options, equilibria with their Hopf points, branches. */
#include "studies/limit_cycles/limit_cycles_study.h"
#include "base/clock.h"
#include "base/memory.h"
#include "constraints/tolerances.h"
#include "dynamics/load_dependent.h"
#include "model/expressions/ranges.h"
#include <math.h>
#include <string.h>

enum { USUAL_VALUES = 31, MOST_VALUES = 10000, USUAL_CYCLES = 1000 };

/* A Hopf point is the end of another branch: relative to the range. */
#define SAME_HOPF 1e-3

/* -- options ----------------------------------------------------------------------------------------------- */

static kempe_status take_range(kempe_limit_cycles *c, const kmp_range *range)
{
    kempe_context *context = c->system->context;
    kmp_text why = {0};
    c->name = kmp_arena_strdup(&c->arena, range->name);
    c->from = range->from;
    c->to = range->to;
    c->values = range->count > 0 ? range->count : USUAL_VALUES;
    KMP_TRY(kmp_made(context, c->name));
    if (kmp_parameter_find(c->system->model, c->name) < 0 || !kmp_variant_may(c->system->model, c->name, &why)) {
        if (why.length == 0)
            kmp_text_printf(&why, "limit cycles are followed over a parameter of the model, which '%s' is not",
                            c->name);
        return kmp_fail_text(context, KEMPE_E_ARGUMENT, &why);
    }
    if (c->values < 2 || c->values > MOST_VALUES || c->from == c->to)
        return kmp_fail(context, KEMPE_E_ARGUMENT, "a sweep needs two ends and 2 to %d values, as in '%s=1:2:31'",
                        MOST_VALUES, c->name);
    return KEMPE_OK;
}

/* -- equilibria -------------------------------------------------------------------------------------------- */

static kempe_status find_equilibria(kempe_limit_cycles *c)
{
    const kmp_operating_family_options options = {.name = c->name};
    double *values = KMP_ARENA_NEW(&c->arena, double, c->values);
    const kmp_range range = {.from = c->from, .to = c->to};
    KMP_TRY(kmp_made(c->system->context, values));
    for (int k = 0; k < c->values; k++)
        values[k] = kmp_range_value(&range, k, c->values);
    KMP_TRY(kmp_cycles_hold_speed(c));
    KMP_TRY(kmp_operating_family_new(kmp_cycles_equations(c), &options, &c->family));
    kempe_status status = kmp_locus_make(c->family, c->values, values, &c->locus);
    if (status == KEMPE_STOPPED && !kmp_interrupted(c->system->context)) {
        kmp_doubt(c->system->context, "equilibria are known from %g to %g alone: %s", c->from,
                  c->locus.value[c->locus.reached > 0 ? c->locus.reached - 1 : 0],
                  kempe_context_message(c->system->context));
        kmp_context_clear(c->system->context);
        status = KEMPE_OK;
    }
    return status;
}

double kmp_limit_cycles_growth(const kempe_limit_cycles *cycles, int k)
{
    const kmp_locus *l = &cycles->locus;
    double most = -INFINITY;
    for (int b = 0; b < l->count; b++)
        most = fmax(most, l->re[b + (ptrdiff_t)k * l->count]);
    return most;
}

/* -- branches ----------------------------------------------------------------------------------------------- */

/* True if a branch that was followed before ends there. */
static bool is_reached(const kempe_limit_cycles *c, const kmp_critical *at, int *branch)
{
    for (int b = 0; b < c->branches; b++) {
        const kmp_cycle_branch *x = &c->branch[b];
        double away = x->ends_at_hopf ? fabs(x->cycle[x->count - 1]->value - at->value) : INFINITY;
        if (away <= SAME_HOPF * fabs(c->to - c->from)) {
            *branch = b + 1;
            return true;
        }
    }
    return false;
}

static kempe_status follow_from(kempe_limit_cycles *c, int critical, const kmp_branch_options *ask)
{
    const kmp_critical *at = &c->locus.critical[critical];
    kmp_cycle *hopf, *first;
    kempe_context *context = c->system->context;
    kempe_status status = kmp_hopf_cycles(c, at, &hopf, &first);
    if (status == KEMPE_E_FAILED) {
        kmp_doubt(context, "no limit cycle is found near the Hopf point at %s = %.9g: %s", c->name, at->value,
                  kempe_context_message(context));
        kmp_context_clear(context);
        return KEMPE_OK;
    }
    KMP_TRY(status);
    kmp_cycle_branch *branch = &c->branch[c->branches++];
    c->branch_of[critical] = c->branches;
    KMP_TRY(kmp_branch_add(context, branch, hopf));
    return kmp_branch_follow(&c->shooting, ask, first, branch);
}

/* -- construction -------------------------------------------------------------------------------------------- */

static kempe_status make(kempe_limit_cycles *c, const kempe_limit_cycles_options *options)
{
    kempe_context *context = c->system->context;
    const kempe_model *model = c->system->model;
    const char *outputs = options->outputs ? options->outputs : model->state_count > 0 ? "q,state" : "q";
    kmp_ranges ranges;
    if (!options->sweep)
        return kmp_fail(context, KEMPE_E_ARGUMENT,
                        "limit cycles need a parameter and its range, as in --sweep NAME=A:B:N");
    KMP_TRY(kmp_ranges_read(context, options->sweep, &ranges));
    kempe_status status = ranges.count == 1
                              ? take_range(c, &ranges.range[0])
                              : kmp_fail(context, KEMPE_E_ARGUMENT,
                                         "only one parameter can be swept, as in '%s=1:2:31'", ranges.range[0].name);
    kmp_ranges_free(&ranges);
    KMP_TRY(status);
    c->settle = options->settle;
    if (c->settle > 0)
        return kmp_settled_cycles(c, outputs, options->run);
    KMP_TRY(kmp_refuse_samples(model, "limit cycles", true));
    KMP_TRY(kmp_refuse_delays(model, "limit cycles", "simulate it, and read the amplitudes of its last periods"));
    KMP_TRY(find_equilibria(c));
    /* A branch from each Hopf point that no other branch reaches. */
    const kmp_branch_options ask = {c->from, c->to, c->values, options->most > 0 ? options->most : USUAL_CYCLES};
    int count = c->locus.critical_count;
    c->branch = KMP_ARENA_NEW(&c->arena, kmp_cycle_branch, count);
    c->branch_of = KMP_ARENA_NEW(&c->arena, int, count);
    KMP_TRY(kmp_made(c->system->context, !c->arena.failed));
    for (int k = 0; k < count; k++) {
        const kmp_critical *at = &c->locus.critical[k];
        if (!(at->im > 0) || is_reached(c, at, &c->branch_of[k]))
            continue;
        if (!c->flow) {
            kmp_modes modes;
            KMP_TRY(kmp_operating_family_go(c->family, at->value, &modes));
            kmp_modes_free(&modes);
            /* The equations of the cycles, at the state of the family. */
            kmp_flow_entry *entry = KMP_ARENA_NEW(&c->arena, kmp_flow_entry, 2 * c->system->n);
            const kempe_run_options none = {0};
            int entries;
            KMP_TRY(kmp_made(context, entry));
            KMP_TRY(kmp_moving_entries(&c->family->linear, -1, &entries, entry));
            KMP_TRY(kmp_cycles_flow(c, outputs, options->run ? options->run : &none, entries, entry));
        }
        KMP_TRY(follow_from(c, k, &ask));
    }
    return KEMPE_OK;
}

kempe_status kempe_limit_cycles_new(const kempe_system *system, const kempe_limit_cycles_options *options,
                                    kempe_limit_cycles **cycles)
{
    KMP_WANTED_BOTH(system, cycles);
    KMP_OPTIONS(system->context, kempe_limit_cycles_options, options);
    double begin = kmp_cpu_now();
    kmp_model_begin_forces(system->model);
    KMP_MAKE(system->context, kempe_limit_cycles, c);
    c->system = system;
    kempe_status status = make(c, options);
    if (status == KEMPE_STOPPED)
        c->reason = kmp_arena_strdup(&c->arena, "interrupted");
    c->status = status = kmp_context_verdict(system->context, status);
    c->warnings = kmp_context_warnings(system->context);
    c->cpu_s = kmp_cpu_now() - begin;
    if (kmp_is_complete(status) || (status == KEMPE_STOPPED && c->name))
        *cycles = c;
    else
        kempe_limit_cycles_free(c);
    return status;
}

void kempe_limit_cycles_free(kempe_limit_cycles *cycles)
{
    if (!cycles)
        return;
    for (int b = 0; b < cycles->branches; b++)
        kmp_free(cycles->branch[b].cycle);
    kmp_shooting_free(&cycles->shooting);
    kmp_flow_free(cycles->flow);
    kmp_locus_free(&cycles->locus);
    kmp_operating_family_free(cycles->family);
    kempe_system_free(cycles->driven);
    kempe_model_free(cycles->copy);
    kmp_free(cycles->warnings);
    kmp_arena_free(&cycles->arena);
    kmp_free(cycles);
}

/* -- queries -------------------------------------------------------------------------------------------------- */

KMP_GETTER(int kempe_limit_cycles_branch_count(const kempe_limit_cycles *cycles), cycles, cycles->branches, 0)
KMP_GETTER_AT(int kempe_limit_cycles_count(const kempe_limit_cycles *cycles, int branch), cycles, branch,
              cycles->branches, cycles->branch[branch].count, 0)
