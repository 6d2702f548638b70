/* SPDX-License-Identifier: BSD-3-Clause */
#include "analyses/parts/study_print.h"
#include "constraints/tolerances.h"
#include "ensemble/batch.h"
#include "ensemble/optimize/optimize_study.h"
#include "model/data/start.h"
#include "output/print.h"
#include "output/result_table.h"
#include "output/start_balance.h"
#include <math.h>
#include <string.h>

static const char *const outcomes[] = {"converged", "not converged", "interrupted", "no start"};

/* The part of its range within which a parameter is at its bound: twice the tolerance of the search. */
static const char *state_of(const kempe_optimum *o, int k)
{
    double near = 2 * o->tolerance * (o->bounded.upper[k] - o->bounded.lower[k]);
    return o->value[k] - o->bounded.lower[k] <= near   ? "lower"
           : o->bounded.upper[k] - o->value[k] <= near ? "upper"
                                                       : "";
}

static double limit_value(const kempe_optimum *o, int k)
{
    return o->at_best[o->objective.list->limit[k].value];
}

static bool is_kept(const kempe_optimum *o, int k)
{
    return kmp_limit_excess(&o->objective.list->limit[k], limit_value(o, k)) <= KMP_OPTIMUM_KEPT;
}

/* -- text -------------------------------------------------------------------------------------------- */

/* The reason of the last trial that failed, by the order of the searches; NULL: there is none. */
static const char *last_refusal(const kempe_optimum *o)
{
    int k = o->searches - 1;
    while (k >= 0 && !o->search[k].refusal)
        k--;
    return k >= 0 ? o->search[k].refusal : NULL;
}

static const kempe_system *system_of(const kempe_optimum *o)
{
    return kmp_ensemble_equations(o->objective.ensemble);
}

/* The first limit that is not kept, -1: all are. */
static int broken_limit(const kempe_optimum *o)
{
    for (int k = 0; k < o->objective.list->limit_count; k++)
        if (!is_kept(o, k))
            return k;
    return -1;
}

/* Value k of the quantities, the first of which is the objective, in its unit. */
static void put_quantity(kmp_text *text, const kempe_optimum *o, int digits, double value, int k)
{
    const kempe_context *context = o->context;
    kmp_print_quantity(text, context, digits, value, kmp_print_unknown(context, o->objective.list->unit[k]));
}

static kmp_shown parameter_shown(const kempe_optimum *o, int k)
{
    return kmp_shown_of(system_of(o), o->bounded.name[k]);
}

/* "base = 0.85 m (on its lower bound)", of all parameters, or of many their number. */
static void put_place(kmp_text *text, const kempe_optimum *o)
{
    enum { NAMED = 2 };
    if (o->count > NAMED)
        kmp_text_printf(text, "the values of %d parameters below", o->count);
    for (int k = 0; o->count <= NAMED && k < o->count; k++) {
        kmp_text_printf(text, "%s%s = ", k ? ", " : "", o->bounded.name[k]);
        kmp_print_value_of(text, system_of(o), o->bounded.name[k], o->value[k]);
        if (*state_of(o, k))
            kmp_text_printf(text, " (on its %s bound)", state_of(o, k));
    }
}

/* The result in words; where no values satisfy all limits, these first. */
static void put_answer(kmp_text *text, const kempe_optimum *o)
{
    const int broken = broken_limit(o);
    kmp_text title = {0}, words = {0};
    kmp_print_title(&title, o->model, kmp_outcome_of(o->status));
    if (broken >= 0) {
        const kmp_quantity_limit *limit = &o->objective.list->limit[broken];
        kmp_text_printf(&words, "no values satisfy %s, nearest ", limit->text);
        put_quantity(&words, o, 6, limit_value(o, broken), limit->value);
        kmp_print_wrapped(text, title.s ? title.s : "", 2, words.s ? words.s : "");
        kmp_text_free_part(text, &words);
    }
    kmp_text_printf(&words, "%s%s = ",
                    broken >= 0      ? "there "
                    : o->most_wanted ? "maximum of "
                                     : "minimum of ",
                    o->quantity);
    put_quantity(&words, o, 6, o->at_best[0], 0);
    kmp_text_put(&words, " at ");
    put_place(&words, o);
    kmp_print_wrapped(text, broken >= 0 ? "  " : title.s ? title.s : "", 2, words.s ? words.s : "");
    kmp_text_free_part(text, &title);
    kmp_text_free_part(text, &words);
}

static void put_parameters(kmp_text *text, const kempe_optimum *o)
{
    const int width = kmp_print_widest(o->count, o->bounded.name, 9);
    kmp_text_printf(text, "\n  %-*s  %12s  %12s  %12s  %12s\n", width, "parameter", "value", "start", "lower bound",
                    "upper bound");
    for (int k = 0; k < o->count; k++) {
        const kmp_shown as = parameter_shown(o, k);
        kmp_text_printf(text, "  %-*s  %12.6g  %12.6g  %12.6g  %12.6g%s%s", width, o->bounded.name[k],
                        as.factor * o->value[k], as.factor * o->start[k], as.factor * o->bounded.lower[k],
                        as.factor * o->bounded.upper[k], *as.unit ? "  " : "", as.unit);
        kmp_text_printf(text, *state_of(o, k) ? "  on its %s bound\n" : "%s\n", state_of(o, k));
    }
}

/* Several searches, each with its end. */
static void put_searches(kmp_text *text, const kempe_optimum *o)
{
    if (o->searches < 2)
        return;
    const kmp_shown as = kmp_shown_as(o->context, kmp_print_unknown(o->context, o->objective.list->unit[0]));
    kmp_text_printf(text, "\n  %6s  %12s  %10s  %11s\n", "search", "result", "violation", "evaluations");
    for (int k = 0; k < o->searches; k++) {
        const kmp_searched *s = &o->search[k];
        const bool ran = s->outcome != KMP_SQUARES_NO_START;
        const double value = ran ? as.factor * s->value : NAN;
        kmp_print_cells(text, "  %6d  %12.6g  %10.2g  %11d  %s%s\n", s->number + 1, o->most_wanted ? -value : value,
                        ran ? s->broken : NAN, s->evaluations, outcomes[s->outcome], k == o->best ? ", the best" : "");
    }
}

static void put_method(kmp_text *text, const kempe_optimum *o)
{
    kmp_text words = {0};
    if (isfinite(o->coarser)) {
        kmp_text_printf(&words, "a hundredfold tolerance changes %s by ", o->quantity);
        put_quantity(&words, o, 2, o->coarser, 0);
        kmp_print_wrapped(text, "accuracy  ", 10, words.s ? words.s : "");
        kmp_text_free_part(text, &words);
    }
    if (o->objective.obstacle)
        kmp_text_printf(&words, "without derivatives (COBYLA): %s", o->objective.obstacle);
    else
        kmp_text_put(&words, strcmp(o->method, "slopes") == 0 ? "exact derivatives (SLSQP)"
                                                              : "without derivatives (COBYLA), as requested");
    kmp_text_printf(&words, "; %d search%s, %s; %d evaluation%s, %ld runs of the model", o->searches,
                    o->searches == 1 ? "" : "es", outcomes[o->search[o->best].outcome], o->evaluations,
                    o->evaluations == 1 ? "" : "s", o->objective.simulations);
    kmp_print_wrapped(text, "method    ", 10, words.s ? words.s : "");
    kmp_text_free_part(text, &words);
    if (!last_refusal(o))
        return;
    kmp_text_printf(&words, "%d trials do not run, the last one because: %s", o->refused, last_refusal(o));
    kmp_print_wrapped(text, "failures  ", 10, words.s ? words.s : "");
    kmp_text_free_part(text, &words);
}

static void put_text(kmp_text *text, const void *result)
{
    const kempe_optimum *o = result;
    put_answer(text, o);
    kmp_starts_show(text, "run", kmp_model_start(o->model)->at);
    if (o->reason[0])
        kmp_print_wrapped(text, "  ", 4, o->reason);
    kmp_print_doubts(text, kmp_outcome_of(o->status), o->warnings);
    put_parameters(text, o);
    const kmp_quantity_list *list = o->objective.list;
    for (int k = 0; k < list->limit_count; k++) {
        kmp_text_printf(text, "%s  limit %s: ", k ? "" : "\n", list->limit[k].text);
        put_quantity(text, o, 6, limit_value(o, k), list->limit[k].value);
        kmp_text_put(text, is_kept(o, k) ? ", satisfied\n" : ", not satisfied\n");
    }
    put_searches(text, o);
    kmp_text_put(text, "\n");
    put_method(text, o);
}

/* -- JSON -------------------------------------------------------------------------------------------- */

static void put_json(kmp_text *text, const void *result)
{
    const kempe_optimum *o = result;
    const kmp_quantity_list *list = o->objective.list;
    kmp_json json = kmp_print_head(text, kmp_ensemble_equations(o->objective.ensemble), kmp_outcome_of(o->status),
                                   o->reason, 0, o->warnings);
    kmp_json_put(&json, "goal %s quantity %s value %g unit %s method %s obstacle %s search %s",
                 o->most_wanted ? "maximize" : "minimize", o->quantity, o->at_best[0], list->unit[0], o->method,
                 o->objective.obstacle, outcomes[o->search[o->best].outcome]);
    kmp_json_put(&json, "difference %g evaluations %d runs %ld shortened %d refusal %s cpu_s %g parameters {",
                 o->coarser, o->evaluations, o->objective.simulations, o->refused, last_refusal(o), o->seconds);
    for (int k = 0; k < o->count; k++)
        kmp_json_put(&json, "%s { value %g start %g lower %g upper %g state %s }", o->bounded.name[k], o->value[k],
                     o->start[k], o->bounded.lower[k], o->bounded.upper[k], state_of(o, k));
    kmp_json_put(&json, "} limits [");
    for (int k = 0; k < list->limit_count; k++)
        kmp_json_put(&json, "{ limit %s value %g bound %g kept %i }", list->limit[k].text, limit_value(o, k),
                     list->limit[k].bound, is_kept(o, k));
    kmp_json_put(&json, "] searches [");
    for (int k = 0; k < o->searches; k++) {
        const kmp_searched *s = &o->search[k];
        kmp_json_put(&json, "{ quantity %g broken %g evaluations %d outcome %s }",
                     o->most_wanted ? -s->value : s->value, s->broken, s->evaluations, outcomes[s->outcome]);
    }
    kmp_json_put(&json, "] }");
}

KMP_PRINT(kempe_optimum, optimum, optimum->context, put_json, put_text)

/* -- tables ------------------------------------------------------------------------------------------ */

static void fill_parameters(kempe_table *table, const void *result)
{
    const kempe_optimum *o = result;
    kmp_tabulate_columns(table, "parameter[words] value start lower upper state[words] unit[words]");
    for (int k = 0; k < o->count; k++) {
        const kmp_shown as = parameter_shown(o, k);
        KMP_TABULATE(table, "%s %g %g %g %g %s %s", o->bounded.name[k], as.factor * o->value[k],
                     as.factor * o->start[k], as.factor * o->bounded.lower[k], as.factor * o->bounded.upper[k],
                     state_of(o, k), as.unit);
    }
}

static void fill_limits(kempe_table *table, const void *result)
{
    const kempe_optimum *o = result;
    kmp_tabulate_columns(table, "limit[words] value bound state[words] unit[words]");
    for (int k = 0; k < o->limits; k++) {
        const kmp_quantity_limit *limit = &o->objective.list->limit[k];
        const kmp_shown as =
            kmp_shown_as(o->context, kmp_print_unknown(o->context, o->objective.list->unit[limit->value]));
        KMP_TABULATE(table, "%s %g %g %s %s", limit->text, as.factor * limit_value(o, k), as.factor * limit->bound,
                     is_kept(o, k) ? "" : "broken", as.unit);
    }
}

static void fill_starts(kempe_table *table, const void *result)
{
    const kempe_optimum *o = result;
    kmp_tabulate_columns(table, "search");
    kmp_tabulate_column(table, kmp_print_unknown(o->context, o->objective.list->unit[0]), "quantity");
    kmp_tabulate_columns(table, "broken evaluations refused outcome[words]");
    for (int k = 0; k < o->count; k++)
        kmp_tabulate_value(table, system_of(o), "", o->bounded.name[k]);
    for (int row = 0; row < o->searches; row++) {
        const kmp_searched *s = &o->search[row];
        bool ran = s->outcome != KMP_SQUARES_NO_START;
        KMP_TABULATE(table, "%d %g %g %d %d %s", s->number + 1,
                     ran && o->most_wanted ? -s->value
                     : ran                 ? s->value
                                           : NAN,
                     ran ? s->broken : NAN, s->evaluations, s->refused, outcomes[s->outcome]);
        kmp_tabulate_numbers(table, o->count, s->x);
    }
}

static void fill_history(kempe_table *table, const void *result)
{
    const kempe_optimum *o = result;
    const char *unit = kmp_print_unknown(o->context, o->objective.list->unit[0]);
    double best = NAN, sign = o->most_wanted ? -1 : 1;
    kmp_tabulate_columns(table, "evaluation search");
    kmp_tabulate_column(table, unit, "quantity");
    kmp_tabulate_columns(table, "broken");
    kmp_tabulate_column(table, unit, "best");
    int evaluation = 0;
    for (int k = 0; k < o->searches; k++)
        for (int i = 0; i < o->search[k].tried_count; i++) {
            const kmp_trial *tried = &o->search[k].tried[i];
            bool counts = tried->broken <= KMP_OPTIMUM_KEPT && !isnan(tried->value);
            best = counts && !(sign * best <= sign * tried->value) ? tried->value : best;
            KMP_TABULATE(table, "%d %d %g %g %g", ++evaluation, o->search[k].number + 1, tried->value, tried->broken,
                         best);
        }
}

KMP_TABLES(kempe_optimum, optimum, optimum->context, {"parameters", fill_parameters}, {"limits", fill_limits},
           {"starts", fill_starts}, {"history", fill_history})
