/* SPDX-License-Identifier: BSD-3-Clause */
/* Remarks on the runs, a line for each method and kind: incomplete runs, and anomalies of complete ones. Then the
 * recommended method, by the rules in docs/compare.md, and the measurements that support it. */
#include "studies/compare/compare_advice.h"
#include "studies/compare/compare_levels.h"
#include "studies/compare/compare_runs.h"
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

/* Incomplete runs, and anomalies of complete ones. */
typedef enum trouble { HAS_FAILED, HAS_STOPPED, IS_LEFT_OUT, IS_APART, IS_ELSEWHERE, IS_OPEN, IS_UNBALANCED } trouble;

/* True if the run has the trouble; *how: the size of an anomaly. */
static bool has(const kempe_comparison *c, const kmp_compared *run, trouble kind, double *how)
{
    const bool done = run->status == KEMPE_OK;
    switch (kind) {
    case HAS_FAILED:
        return run->status == KEMPE_E_FAILED;
    case HAS_STOPPED:
        return run->status == KEMPE_STOPPED && !run->left_out;
    case IS_LEFT_OUT:
        return run->left_out;
    case IS_APART:
        *how = run->apart;
        return done && *how > fmin(LOST * run->rtol, c->has_reference ? INFINITY : ANYWAY);
    case IS_ELSEWHERE: /* its own tolerances agree, but on a different result */
        *how = run->verdict.error[KMP_QUANTITY_Q];
        return done && *how > fmin(LOST * run->rtol, ANYWAY) && *how > 10 * run->apart &&
               !kmp_compared_is_below(c, run, KMP_QUANTITY_Q);
    case IS_OPEN:
        *how = run->verdict.h_max;
        return done && *how > OPEN * run->rtol;
    case IS_UNBALANCED:
        *how = run->verdict.drift_rel;
        return done && *how > LOST * run->rtol;
    }
    return false;
}

/* The runs of one method with a trouble. */
typedef struct group {
    int count;
    const kmp_compared *first, *last; /* by tolerance, coarse first */
    const kmp_compared *worst;
    double how;
} group;

static group find(const kempe_comparison *c, int method, trouble kind)
{
    group g = {0};
    for (int k = 0; k < c->rtol_count; k++) {
        const kmp_compared *run = &c->runs[method * c->rtol_count + k];
        double how = 0;
        if (!has(c, run, kind, &how))
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

/* The method and the tolerances of a group. */
static void put_group(kmp_text *text, const kempe_comparison *c, const group *g)
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

void kmp_compare_remark(kempe_comparison *c)
{
    /* Texts around the size of an anomaly and the tolerance. */
    static const struct {
        const char *before, *between, *after;
    } anomaly[] = {
        [IS_APART] = {": q differs by ", " at the tolerance after rtol ",
                      ": the motion amplifies errors or follows another branch"},
        [IS_ELSEWHERE] = {": its tolerances agree with each other, but differ from the reference by ", " at rtol ",
                          ": it follows another branch"},
        [IS_OPEN] = {": the closure residual grows to ", ", at rtol ", ""},
        [IS_UNBALANCED] = {": the energy error grows to ", " (relative), at rtol ", ""},
    };
    /* If all runs end alike with any method and tolerance, the model is the cause. */
    bool alike = c->count > 1;
    for (int k = 0; k < c->count; k++)
        alike =
            alike && c->runs[k].status != KEMPE_OK && c->runs[k].status == c->runs[0].status && !c->runs[k].left_out;
    if (alike) {
        kmp_sentences_add(&c->arena, &c->failures, "every run %s: %s",
                          c->runs[0].status == KEMPE_E_FAILED ? "failed" : "stopped", c->runs[0].reason);
        return;
    }
    for (int w = 0; w < c->method_count; w++)
        for (trouble kind = HAS_FAILED; kind <= IS_UNBALANCED; kind++) {
            group g = find(c, w, kind);
            if (g.count == 0 || (kind == IS_LEFT_OUT && kmp_interrupted(c->system->context)))
                continue;
            kmp_text text = {0};
            put_group(&text, c, &g);
            if (kind >= IS_APART)
                kmp_text_printf(&text, "%s%.1e%s%g%s", anomaly[kind].before, g.how, anomaly[kind].between,
                                g.worst->rtol, anomaly[kind].after);
            else
                kmp_text_printf(&text, "%s: %.*s",
                                kind == HAS_FAILED    ? " failed"
                                : kind == HAS_STOPPED ? " stopped"
                                                      : "",
                                (int)strcspn(g.first->reason, "\n"), g.first->reason);
            kmp_sentences_take(&c->arena, kind >= IS_APART ? &c->warnings : &c->failures, &text);
        }
}

/* Without a reference: a difference of q between tolerances that users accept. */
#define USUAL 1e-6

/* Largest cost of a method without failures relative to the cheapest with failures. */
#define ROBUST 2.0

/* A first result that is earlier by less than this factor is no reason for another choice: noise of times. */
#define SOONER 1.25

/* -- the choice -------------------------------------------------------------------------------------- */

static int run_at(const kempe_comparison *c, int method, int level)
{
    return c->levels.run[method * c->levels.count + level];
}

static int failed_of(const kempe_comparison *c, int method)
{
    int failed = 0;
    for (int k = 0; k < c->rtol_count; k++)
        failed += c->runs[method * c->rtol_count + k].status == KEMPE_E_FAILED;
    return failed;
}

/* The method with the least of the worst ratios, if `robust` among those without failures; -1: none reaches all aims.
 */
static int cheapest(const kempe_comparison *c, const kmp_error_levels *a, bool robust, int but)
{
    int found = -1;
    for (int w = 0; w < c->method_count; w++)
        if (w != but && isfinite(kmp_compare_worst(c, a, w)) && (!robust || failed_of(c, w) == 0) &&
            (found < 0 || kmp_compare_worst(c, a, w) < kmp_compare_worst(c, a, found)))
            found = w;
    return found;
}

/* The recommended method; if no method reaches all aims, the coarser one alone counts. */
static int choose_method(const kempe_comparison *c, kmp_error_levels *a)
{
    int method = cheapest(c, a, false, -1);
    while (method < 0 && a->count > 1) {
        a->count--;
        method = cheapest(c, a, false, -1);
    }
    int robust = cheapest(c, a, true, -1);
    if (robust >= 0 && kmp_compare_worst(c, a, robust) <= ROBUST * kmp_compare_worst(c, a, method))
        method = robust;
    return method;
}

/* -- reason ------------------------------------------------------------------------------------------ */

/* "4.3", with "and 4.5" where there are two aims. */
static void ratios(kmp_text *text, const kempe_comparison *c, const kmp_error_levels *a, int method)
{
    for (int k = 0; k < a->count; k++)
        kmp_text_printf(text, kmp_compare_ratio(c, method, a->level[k]) < 9.95 ? "%s%.1f" : "%s%.0f",
                        k > 0 ? " and " : "", kmp_compare_ratio(c, method, a->level[k]));
}

static void report_cost(kmp_text *text, const kempe_comparison *c, const kmp_error_levels *a, int method)
{
    int next = cheapest(c, a, false, method);
    bool best = kmp_compare_worst(c, a, method) <= 1;
    if (!best)
        ratios(text, c, a, method);
    kmp_text_printf(text, "%s at error %g", best ? "the cheapest" : " times the cheapest",
                    c->levels.level[a->level[0]]);
    if (a->count > 1)
        kmp_text_printf(text, " and at %g", c->levels.level[a->level[1]]);
    if (next < 0)
        return;
    kmp_text_put(text, "; the next is ");
    kmp_compare_name(text, &c->methods[next]);
    kmp_text_put(text, ", ");
    ratios(text, c, a, next);
    kmp_text_put(text, best ? " times as long" : " times");
}

static void report_ends(kmp_text *text, const kempe_comparison *c, int method)
{
    int failed = failed_of(c, method), done = 0;
    double open = NAN;
    for (int k = 0; k < c->rtol_count; k++) {
        const kmp_compared *run = &c->runs[method * c->rtol_count + k];
        if (run->status != KEMPE_OK)
            continue;
        done++;
        open = fmax(open, run->verdict.h_max);
    }
    if (failed > 0)
        kmp_text_printf(text, "%d of its %d runs failed", failed, done + failed);
    else if (done > 1)
        kmp_text_printf(text, "all %d of its runs reached their end", done);
    else
        kmp_text_put(text, "its run reached its end");
    if (c->system->m > 0)
        kmp_text_printf(text, "; loops closed to %.0e", open);
}

static void report_stiffness(kmp_text *text, const kempe_comparison *c, const kmp_stiffness *s)
{
    if (s->implicit < 0)
        return;
    const kmp_compared *implicit = &c->runs[s->implicit];
    if (s->loose < 0) {
        kmp_text_printf(text, "stiff: no explicit run reached its end; %s takes %ld steps at rtol %g",
                        implicit->method->integrator, implicit->report.steps, implicit->rtol);
        return;
    }
    const kmp_compared *loose = &c->runs[s->loose], *tight = &c->runs[s->tight];
    kmp_text_printf(text, "%s: %s takes %ld steps at rtol %g and %ld at %g", s->stiff ? "stiff" : "not stiff",
                    loose->method->integrator, loose->report.steps, loose->rtol, tight->report.steps, tight->rtol);
    if (s->stiff)
        kmp_text_printf(text, ", limited by stability, not by accuracy; %s takes %ld", implicit->method->integrator,
                        implicit->report.steps);
    else
        kmp_text_put(text, ", as limited by accuracy");
}

/* The best method of the dae formulation at the aims, and its use. */
static void report_dae(kmp_text *text, const kempe_comparison *c, const kmp_error_levels *a, int advised)
{
    int dae = -1, tried = -1;
    for (int w = 0; w < c->method_count; w++) {
        if (strcmp(c->methods[w].formulation, "dae") != 0)
            continue;
        tried = w;
        if (isfinite(kmp_compare_worst(c, a, w)) &&
            (dae < 0 || kmp_compare_worst(c, a, w) < kmp_compare_worst(c, a, dae)))
            dae = w;
    }
    if (tried < 0 || dae == advised)
        return;
    if (dae < 0) {
        kmp_text_printf(text, "the formulation dae does not attain the error %g at these tolerances",
                        c->levels.level[a->level[a->count - 1]]);
        return;
    }
    kmp_compare_name(text, &c->methods[dae]);
    kmp_text_put(text, " needs ");
    ratios(text, c, a, dae);
    kmp_text_put(text, " times as long");
    if (c->system->m > 0)
        kmp_text_printf(text, ", its closure residual is %.0e", c->runs[run_at(c, dae, a->level[0])].verdict.h_max);
    kmp_text_put(text, kmp_compare_worst(c, a, dae) < ROBUST
                           ? ": an alternative, which needs no choice of coordinates"
                           : ": slower here; useful as an independent check because it uses no coordinate reduction");
}

/* The share of preparation in a first result, and whether it changes the choice. */
static void report_preparation(kmp_text *text, const kempe_comparison *c, const kmp_error_levels *a, int method)
{
    const kmp_compared *run = &c->runs[run_at(c, method, a->level[0])], *first = run;
    double total = kmp_compare_first_s(c, run), prepared = total - run->cpu_s, least = INFINITY;
    if (!(prepared > run->cpu_s))
        return;
    kmp_text_printf(text, "preparation decides for a single run: %.3g of %.3g ms", 1e3 * prepared, 1e3 * total);
    /* The best method of the formulation whose first result is there first, by its run for the aim. */
    for (int k = 0; k < c->tables.best_count; k++) {
        int other = run_at(c, c->tables.best[k], a->level[0]);
        if (other >= 0 && kmp_compare_first_s(c, &c->runs[other]) < least) {
            first = &c->runs[other];
            least = kmp_compare_first_s(c, first);
        }
    }
    if (SOONER * least < total) {
        kmp_text_put(text, "; ");
        kmp_compare_name(text, first->method);
        kmp_text_printf(text, " has the first result after %.3g ms", 1e3 * least);
    }
}

static bool is_prescribed(const kempe_comparison *c)
{
    return c->count > 0 && c->runs[0].report.prescribed;
}

/* The reason why there is no advice. */
static void refrain(kempe_comparison *c)
{
    kmp_text text = {0};
    int steady = -1; /* the cheapest run that agrees with the next tolerance of its method as usual */
    for (int k = 0; k < c->count && !c->has_reference && !is_prescribed(c); k++)
        if (c->runs[k].status == KEMPE_OK && c->runs[k].apart <= USUAL &&
            (steady < 0 || c->runs[k].cpu_s < c->runs[steady].cpu_s))
            steady = k;
    if (is_prescribed(c))
        kmp_text_put(&text,
                     "all motion is prescribed: coordinates follow from the closures at every instant, and a tolerance "
                     "affects the work of the drives alone; 'kempe kinematics' and 'kempe inverse' analyse it");
    else if (!c->has_reference)
        kmp_text_put(&text, "without a reference the errors are unknown, and there is no recommendation");
    if (steady >= 0) {
        kmp_text_printf(&text, "; the cheapest run that agrees with its next tolerance to %g in q is ", USUAL);
        kmp_compare_name(&text, c->runs[steady].method);
        kmp_text_printf(&text, " at rtol %g: %.3g ms", c->runs[steady].rtol, 1e3 * c->runs[steady].cpu_s);
    }
    if (c->has_reference && !is_prescribed(c))
        kmp_text_printf(&text, "no run attains an error of %g: there is no recommendation",
                        c->levels.count > 0 ? c->levels.level[0] : NAN);
    kmp_sentences_take(&c->arena, &c->advice.because, &text);
}

void kmp_compare_advise(kempe_comparison *c)
{
    kmp_stiffness stiffness = kmp_compare_stiffness(c);
    kmp_error_levels a = c->tables.aims;
    int method = a.count > 0 && !is_prescribed(c) ? choose_method(c, &a) : -1;
    c->advice = (kmp_advice){.run = -1, .level = NAN, .stiff = stiffness.stiff};
    if (method < 0) {
        refrain(c);
        return;
    }
    c->advice.run = run_at(c, method, a.level[0]);
    c->advice.level = c->levels.level[a.level[0]];
    kmp_text lines[6] = {{0}};
    report_cost(&lines[0], c, &a, method);
    /* The method at the smallest error. */
    kmp_text *text = &lines[1];
    int finest = a.level[a.count - 1];
    const kmp_compared *run = &c->runs[run_at(c, method, finest)];
    if (a.count > 1)
        kmp_text_printf(text, "for an error of %g use rtol %g: %.3g ms", c->levels.level[finest], run->rtol,
                        1e3 * run->cpu_s);
    report_ends(&lines[2], c, method);
    report_stiffness(&lines[3], c, &stiffness);
    report_dae(&lines[4], c, &a, method);
    report_preparation(&lines[5], c, &a, method);
    for (int k = 0; k < 6; k++)
        kmp_sentences_take(&c->arena, &c->advice.because, &lines[k]);
}
