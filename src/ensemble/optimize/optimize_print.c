/* SPDX-License-Identifier: BSD-3-Clause */
#include "analyses/parts/study_print.h"
#include "constraints/tolerances.h"
#include "ensemble/batch.h"
#include "ensemble/optimize/optimize_study.h"
#include "output/print.h"
#include "output/result_table.h"
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
    const kmp_quantity_limit *limit = &o->objective.list->limit[k];
    double size = limit->bound != 0 ? fabs(limit->bound) : 1;
    return limit->sign * (limit_value(o, k) - limit->bound) / size <= KMP_OPTIMUM_KEPT;
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

static void put_text(kmp_text *text, const void *result)
{
    const kempe_optimum *o = result;
    const kmp_quantity_list *list = o->objective.list;
    int width = kmp_print_widest(o->count, o->bounded.name, 9);
    const kmp_searched *best = &o->search[o->best];
    const char *unit = o->objective.list->unit[0];
    kmp_print_title(text, o->model, kmp_outcome_of(o->status));
    kmp_text_printf(text, "%s of %s over %d parameter%s\n\n", o->most_wanted ? "largest value" : "least value",
                    o->quantity, o->count, o->count == 1 ? "" : "s");
    if (o->reason[0])
        kmp_text_printf(text, "reason    %s\n", o->reason);
    kmp_text_printf(text, "result    %.6g%s%s, %s\n", o->at_best[0], *unit ? " " : "", unit, outcomes[best->outcome]);
    if (isfinite(o->coarser))
        kmp_text_printf(text, "accuracy  a hundredfold tolerance changes it by %.2g\n", o->coarser);
    if (o->objective.obstacle)
        kmp_text_printf(text, "method    without derivatives (COBYLA): %s\n", o->objective.obstacle);
    else
        kmp_text_printf(text, "method    %s\n",
                        strcmp(o->method, "slopes") == 0 ? "exact derivatives (SLSQP)"
                                                         : "without derivatives (COBYLA), as requested");
    kmp_text_printf(text,
                    "searches  %d of %d, %d evaluations, %ld runs of the model, %d trials where it does not run\n",
                    o->searches, o->starts, o->evaluations, o->objective.simulations, o->refused);
    if (last_refusal(o))
        kmp_text_printf(text, "shortened the last trial failed because: %s\n", last_refusal(o));
    kmp_text_printf(text, "cpu       %.3f s\n", o->seconds);
    kmp_text_printf(text, "\n  %-*s  %16s  %14s  %14s  %14s\n", width, "parameter", "value", "start", "lower", "upper");
    for (int k = 0; k < o->count; k++)
        kmp_text_printf(text, "  %-*s  %16.10g  %14.8g  %14.8g  %14.8g%s%s\n", width, o->bounded.name[k], o->value[k],
                        o->start[k], o->bounded.lower[k], o->bounded.upper[k], *state_of(o, k) ? "  at the bound " : "",
                        state_of(o, k));
    for (int k = 0; k < list->limit_count; k++)
        kmp_text_printf(text, "%s  %s: %.8g %s%s\n", k ? "" : "\n", list->limit[k].text, limit_value(o, k),
                        list->unit[list->limit[k].value], is_kept(o, k) ? "" : ", not kept");
    kmp_text_printf(text, "\n  %6s  %16s  %10s  %11s  %s\n", "search", "quantity", "broken", "evaluations", "outcome");
    for (int k = 0; k < o->searches; k++) {
        const kmp_searched *s = &o->search[k];
        bool ran = s->outcome != KMP_SQUARES_NO_START;
        kmp_text_printf(text, "  %6d  %16.10g  %10.2g  %11d  %s%s\n", s->number + 1,
                        ran && o->most_wanted ? -s->value
                        : ran                 ? s->value
                                              : NAN,
                        ran ? s->broken : NAN, s->evaluations, outcomes[s->outcome], k == o->best ? ", the best" : "");
    }
}

/* -- JSON -------------------------------------------------------------------------------------------- */

static void put_json(kmp_text *text, const void *result)
{
    const kempe_optimum *o = result;
    const kmp_quantity_list *list = o->objective.list;
    kmp_json json = kmp_json_begin(text);
    kmp_print_head(&json, kmp_ensemble_equations(o->objective.ensemble), kmp_outcome_of(o->status), o->reason, 0,
                   o->warnings);
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
    kmp_tabulate_columns(table, "parameter[words] value start lower upper state[words]");
    for (int k = 0; k < o->count; k++)
        KMP_TABULATE(table, "%s %g %g %g %g %s", o->bounded.name[k], o->value[k], o->start[k], o->bounded.lower[k],
                     o->bounded.upper[k], state_of(o, k));
}

static void fill_limits(kempe_table *table, const void *result)
{
    const kempe_optimum *o = result;
    kmp_tabulate_columns(table, "limit[words] value bound state[words]");
    for (int k = 0; k < o->limits; k++) {
        const kmp_quantity_limit *limit = &o->objective.list->limit[k];
        KMP_TABULATE(table, "%s %g %g %s", limit->text, limit_value(o, k), limit->bound, is_kept(o, k) ? "" : "broken");
    }
}

static void fill_starts(kempe_table *table, const void *result)
{
    const kempe_optimum *o = result;
    kmp_tabulate_columns(table, "search");
    kmp_tabulate_column(table, o->objective.list->unit[0], "quantity");
    kmp_tabulate_columns(table, "broken evaluations refused outcome[words]");
    for (int k = 0; k < o->count; k++)
        kmp_tabulate_column(table, "", "%s", o->bounded.name[k]);
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
    const char *unit = o->objective.list->unit[0];
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
