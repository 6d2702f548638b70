/* SPDX-License-Identifier: BSD-3-Clause */
/* The two tables of a comparison as text: each ratio of times is split into steps, evaluations a step and time an
 * evaluation. */
#include "studies/compare/compare_study.h"
#include <math.h>
#include <stdio.h>
#include <string.h>

enum { NAME = 28, NUMBER = 16 };

void kmp_compare_put_number(kmp_text *text, int width, double x)
{
    char number[NUMBER];
    (void)snprintf(number, sizeof number, x >= 999.5 && x < 1e6 ? "%.0f" : "%.3g", x);
    kmp_text_printf(text, " %*s", width, number);
}

static void put_factor(kmp_text *text, int width, double x)
{
    char number[NUMBER];
    (void)snprintf(number, sizeof number, x < 9.995 ? "x%.2f" : x < 99.95 ? "x%.1f" : "x%.0f", x);
    kmp_text_printf(text, " %*s", width, number);
}

/* Time, steps, evaluations a step and microseconds an evaluation, of a base; of another method as multiples of it. */
static void put_cost(kmp_text *text, kmp_method_cost cost, const kmp_method_cost *base)
{
    kmp_text_put(text, " |");
    if (isnan(cost.cpu_s)) {
        kmp_text_printf(text, " %7s %24s", "-", "");
        return;
    }
    kmp_compare_put_number(text, 7, 1e3 * cost.cpu_s);
    if (!base) {
        kmp_compare_put_number(text, 5, 1);
        kmp_compare_put_number(text, 6, round(cost.steps));
        kmp_compare_put_number(text, 5, cost.rhs / cost.steps);
        kmp_compare_put_number(text, 5, 1e6 * cost.cpu_s / cost.rhs);
        return;
    }
    put_factor(text, 5, cost.cpu_s / base->cpu_s);
    put_factor(text, 6, cost.steps / base->steps);
    put_factor(text, 5, cost.rhs / cost.steps * base->steps / base->rhs);
    put_factor(text, 5, cost.cpu_s / cost.rhs * base->rhs / base->cpu_s);
}

int kmp_compare_name_width(const kempe_comparison *c)
{
    size_t width = NAME;
    for (int w = 0; w < c->method_count; w++)
        if (c->methods[w].linear && width < NAME + 1 + strlen(c->methods[w].linear))
            width = NAME + 1 + strlen(c->methods[w].linear);
    return (int)width;
}

static void put_name(kmp_text *text, const kempe_comparison *c, const kmp_method *method)
{
    kmp_text name = {0};
    kmp_compare_name(&name, method);
    kmp_text_printf(text, "%-*s", kmp_compare_name_width(c), name.s ? name.s : "");
    kmp_text_free_part(text, &name);
}

void kmp_compare_end_line(kmp_text *text)
{
    while (text->length > 0 && text->s[text->length - 1] == ' ')
        text->s[--text->length] = '\0';
    kmp_text_put(text, "\n");
}

static void put_titles(kmp_text *text, const kempe_comparison *c)
{
    kmp_text_printf(text, "%*s", kmp_compare_name_width(c), "");
    for (int k = 0; k < c->tables.aims.count; k++) {
        char error[2 * NUMBER];
        (void)snprintf(error, sizeof error, "error of q %.0e", c->levels.level[c->tables.aims.level[k]]);
        kmp_text_printf(text, " | %-31s", error);
    }
    kmp_compare_end_line(text);
    kmp_text_printf(text, "%*s", kmp_compare_name_width(c), "");
    for (int k = 0; k < c->tables.aims.count; k++)
        kmp_text_printf(text, " | %7s %5s %6s %5s %5s", "ms", "ratio", "steps", "evals", "us");
    kmp_text_put(text, "\n");
}

/* A line of one of the tables: `same` is that of equal integrators. */
static void put_line(kmp_text *text, const kempe_comparison *c, int method, bool same)
{
    put_name(text, c, &c->methods[method]);
    for (int k = 0; k < c->tables.aims.count; k++) {
        int level = c->tables.aims.level[k],
            base = same ? kmp_compare_base(c, method, level) : kmp_compare_best(c, level);
        kmp_method_cost of_base = base >= 0 ? kmp_compare_cost(c, base, level) : (kmp_method_cost){NAN, NAN, NAN};
        put_cost(text, kmp_compare_cost(c, method, level), base == method ? NULL : &of_base);
    }
    kmp_compare_end_line(text);
}

/* Beside the integration: preparation, first result, memory, residuals and the other errors, of the run for the first
 * aim. */
static void put_beside(kmp_text *text, const kempe_comparison *c, int method)
{
    int k = c->levels.run[method * c->levels.count + c->tables.aims.level[0]];
    const kmp_compared *run = k >= 0 ? &c->runs[k] : NULL;
    if (!run)
        return;
    put_name(text, c, run->method);
    kmp_text_printf(text, " | %6.0e", run->rtol);
    kmp_compare_put_number(text, 8, 1e3 * (c->system->build_s + run->build_s));
    kmp_compare_put_number(text, 8, 1e3 * kmp_compare_first_s(c, run));
    size_t bytes = run->report.heap;
    if (bytes > 0)
        kmp_compare_put_number(text, 9, (double)bytes / 1024);
    else
        kmp_text_printf(text, " %9s", "-");
    kmp_print_cell(text, 8, 0, run->verdict.h_max);
    kmp_print_cell(text, 8, 0, run->verdict.drift_rel);
    kmp_print_cell(text, 9, 1, kmp_compare_error(c, run, KMP_QUANTITY_QD));
    kmp_print_cell(text, 9, 1, kmp_compare_error(c, run, KMP_QUANTITY_LAMBDA));
    kmp_text_put(text, "\n");
}

void kmp_compare_print_tables(kmp_text *text, const kempe_comparison *c)
{
    const kmp_tables *t = &c->tables;
    if (t->aims.count == 0)
        return;
    if (t->same_count > 0) {
        kmp_text_put(text, "\n(a) the same integrator on each formulation: the cost of the formulation\n");
        put_titles(text, c);
    }
    for (int k = 0; k < t->same_count; k++)
        put_line(text, c, t->same[k], true);
    kmp_text_put(text, "\n(b) the best method of each formulation: the choice of a user\n");
    put_titles(text, c);
    for (int k = 0; k < t->best_count; k++)
        put_line(text, c, t->best[k], false);
    kmp_text_put(
        text, "ratio = steps x evaluations a step (evals) x time of an evaluation (us); x: multiple of a first line\n");
    kmp_text_printf(text, "\n%-*s | %6s %8s %8s %9s %7s %7s %8s %8s\n", kmp_compare_name_width(c),
                    "run for the larger error", "rtol", "prep. ms", "first ms", "memory kB", "|h|", "energy",
                    "error qd", "lambda");
    for (int k = 0; k < t->best_count; k++)
        put_beside(text, c, t->best[k]);
}
