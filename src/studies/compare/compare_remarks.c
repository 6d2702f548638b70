/* SPDX-License-Identifier: BSD-3-Clause */
/* Failures and suspicious results, a line for each method and kind: incomplete runs, and anomalies of complete ones. */
#include "studies/compare/compare_study.h"
#include <kempe/compare.h>
#include <math.h>
#include <string.h>

/* LOST: larger differences, in units of the tolerance, are no errors of steps. ANYWAY: an absolute limit of
 * differences; between two tolerances it is used only without a reference. */
#define LOST   1e4
#define ANYWAY 0.1
/* Closures open by more than this many tolerances drift. */
#define OPEN 1e2

/* -- sentences --------------------------------------------------------------------------------------- */

void kmp_sentences_take(kmp_arena *arena, kmp_sentences *list, kmp_text *text)
{
    const char *sentence = text->length > 0 || text->failed ? kmp_text_keep(text, arena) : NULL;
    const char **grown = sentence ? kmp_arena_room(arena, list->s, list->count, sizeof *grown) : NULL;
    if (!grown)
        return;
    list->s = grown;
    list->s[list->count++] = sentence;
}

void kmp_sentences_add(kmp_arena *arena, kmp_sentences *list, const char *format, ...)
{
    kmp_text text = {0};
    KMP_TEXT_ARGUMENTS(&text, format);
    kmp_sentences_take(arena, list, &text);
}

void kmp_compare_name(kmp_text *text, const kmp_method *method)
{
    bool formless = !method->form || strcmp(method->form, "none") == 0;
    kmp_text_printf(text, "%s %s%s%s%s%s", method->formulation, formless ? "" : method->form, formless ? "" : " ",
                    method->integrator, method->linear ? " " : "", method->linear ? method->linear : "");
}

/* -- groups ------------------------------------------------------------------------------------------ */

/* True if the run has the anomaly; *how: its size, where it has one. */
typedef bool trouble_fn(const kempe_comparison *c, const kmp_compared *run, double *how);

/* The runs of one method with the anomaly. */
typedef struct group {
    int count;
    const kmp_compared *first, *last; /* by tolerance, coarse first */
    const kmp_compared *worst;
    double how;
} group;

static group find(const kempe_comparison *c, int method, trouble_fn *has)
{
    group g = {0};
    for (int k = 0; k < c->rtol_count; k++) {
        const kmp_compared *run = &c->runs[method * c->rtol_count + k];
        double how = 0;
        if (!has(c, run, &how))
            continue;
        g.count++;
        g.first = !g.first || run->rtol > g.first->rtol ? run : g.first;
        g.last = !g.last || run->rtol < g.last->rtol ? run : g.last;
        if (!g.worst || how > g.how) {
            g.worst = run;
            g.how = how;
        }
    }
    return g;
}

static void begin(kmp_text *text, const kempe_comparison *c, const group *g)
{
    kmp_compare_name(text, g->first->method);
    if (g->count == c->rtol_count && g->count > 1)
        kmp_text_put(text, " at every rtol");
    else if (g->count == 1)
        kmp_text_printf(text, " at rtol %g", g->first->rtol);
    else
        kmp_text_printf(text, " %s rtol %g %s %g", g->count == 2 ? "at" : "from", g->first->rtol,
                        g->count == 2 ? "and" : "to", g->last->rtol);
}

/* -- incomplete runs --------------------------------------------------------------------------------- */

static bool has_failed(const kempe_comparison *c, const kmp_compared *run, double *how)
{
    (void)c, (void)how;
    return run->status == KEMPE_E_FAILED;
}

static bool has_stopped(const kempe_comparison *c, const kmp_compared *run, double *how)
{
    (void)c, (void)how;
    return run->status == KEMPE_STOPPED && !run->left_out;
}

static bool is_left_out(const kempe_comparison *c, const kmp_compared *run, double *how)
{
    (void)c, (void)how;
    return run->left_out;
}

/* True if all runs end alike with any method and tolerance: the model is the cause. */
static bool all_end_alike(const kempe_comparison *c)
{
    for (int k = 0; k < c->count; k++)
        if (c->runs[k].status == KEMPE_OK || c->runs[k].status != c->runs[0].status || c->runs[k].left_out)
            return false;
    return true;
}

/* -- runs that did ----------------------------------------------------------------------------------- */

static bool is_apart(const kempe_comparison *c, const kmp_compared *run, double *how)
{
    *how = run->apart;
    return run->status == KEMPE_OK && run->apart > fmin(LOST * run->rtol, c->has_reference ? INFINITY : ANYWAY);
}

/* True if its own tolerances agree, but on a different result. */
static bool is_elsewhere(const kempe_comparison *c, const kmp_compared *run, double *how)
{
    *how = run->verdict.error[KMP_QUANTITY_Q];
    return run->status == KEMPE_OK && *how > fmin(LOST * run->rtol, ANYWAY) && *how > 10 * run->apart &&
           !kmp_compared_is_below(c, run, KMP_QUANTITY_Q);
}

static bool is_open(const kempe_comparison *c, const kmp_compared *run, double *how)
{
    (void)c;
    *how = run->verdict.h_max;
    return run->status == KEMPE_OK && *how > OPEN * run->rtol;
}

static bool is_unbalanced(const kempe_comparison *c, const kmp_compared *run, double *how)
{
    (void)c;
    *how = run->verdict.drift_rel;
    return run->status == KEMPE_OK && *how > LOST * run->rtol;
}

typedef struct warning {
    trouble_fn *has;
    const char *before, *between, *after; /* texts around the size and the tolerance */
} warning;

static const warning warnings[] = {{is_apart, ": q differs by ", " at the tolerance after rtol ",
                                    ": the motion amplifies errors or follows another branch"},
                                   {is_elsewhere,
                                    ": its tolerances agree with each other, but differ from the reference by ",
                                    " at rtol ", ": it follows another branch"},
                                   {is_open, ": the closure residual grows to ", ", at rtol ", ""},
                                   {is_unbalanced, ": the energy error grows to ", " (relative), at rtol ", ""}};

static void add_warning(kempe_comparison *c, const group *g, const warning *w)
{
    kmp_text text = {0};
    begin(&text, c, g);
    kmp_text_printf(&text, "%s%.1e%s%g%s", w->before, g->how, w->between, g->worst->rtol, w->after);
    kmp_sentences_take(&c->arena, &c->warnings, &text);
}

void kmp_compare_remark(kempe_comparison *c)
{
    static trouble_fn *const ends[] = {has_failed, has_stopped, is_left_out};
    if (c->count > 1 && all_end_alike(c)) {
        kmp_sentences_add(&c->arena, &c->failures, "every run %s: %s",
                          c->runs[0].status == KEMPE_E_FAILED ? "failed" : "stopped", c->runs[0].reason);
        return;
    }
    for (int w = 0; w < c->method_count; w++) {
        for (size_t k = 0; k < sizeof ends / sizeof *ends; k++) {
            group g = find(c, w, ends[k]);
            if (g.count > 0 && !(ends[k] == is_left_out && kmp_interrupted(c->system->context))) {
                const char *reason = g.first->reason;
                kmp_text text = {0};
                begin(&text, c, &g);
                if (!g.first->left_out)
                    kmp_text_printf(&text, " %s", g.first->status == KEMPE_E_FAILED ? "failed" : "stopped");
                kmp_text_printf(&text, ": %.*s", (int)strcspn(reason, "\n"), reason);
                kmp_sentences_take(&c->arena, &c->failures, &text);
            }
        }
        for (size_t k = 0; k < sizeof warnings / sizeof *warnings; k++) {
            group g = find(c, w, warnings[k].has);
            if (g.count > 0)
                add_warning(c, &g, &warnings[k]);
        }
    }
}
