/* SPDX-License-Identifier: BSD-3-Clause */
/* Tables at equal error; remarks on the runs, a line for each method and kind: incomplete runs, and anomalies of
 * complete ones. Then the recommended method, by the rules in docs/compare.md, and the measurements that support it. */
#include "studies/compare/compare_advice.h"
#include "integrators/steppers/solver.h"
#include "output/print.h"
#include "studies/compare/compare_runs.h"
#include <kempe/compare.h>
#include <math.h>
#include <string.h>

/* -- tables at equal error ------------------------------------------------------------------------------- */

/* The tables at equal error: the cheapest run of each method within a level of error, except accidental ones, and what
 * the method would need for the level itself; one integrator on several formulations, which shows what a formulation
 * costs; the best method of each formulation, which is what a user chooses from. */

static const double levels[] = {1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8, 1e-9, 1e-10, 1e-11};

/* An error of rounding: smaller ones are accidental. */
#define LEAST 1e-16

_Static_assert(sizeof levels / sizeof *levels == KMP_MOST_LEVELS, "a level without a place");

bool kmp_compared_is_below(const kempe_comparison *comparison, const kmp_compared *run, kmp_quantity quantity)
{
    double error = run->verdict.error[quantity], uncertainty = comparison->uncertainty[quantity];
    return uncertainty > 0 && error < 10 * uncertainty;
}

static bool is_within(const kmp_compared *run, double level)
{
    return run->status == KEMPE_OK && run->verdict.error[KMP_QUANTITY_Q] <= level;
}

/* True if no run of the method at a tighter tolerance contradicts this run, which would then be accidental. */
static bool counts(const kempe_comparison *c, int run, double level)
{
    if (!is_within(&c->runs[run], level))
        return false;
    for (int k = 0; k < c->count; k++)
        if (c->runs[k].method == c->runs[run].method && c->runs[k].rtol < c->runs[run].rtol &&
            c->runs[k].status == KEMPE_OK && !is_within(&c->runs[k], level))
            return false;
    return true;
}

static double between(double tight, double coarse, double part)
{
    return exp((1 - part) * log(tight) + part * log(coarse));
}

/* The cost at the level: where the next coarser run is outside it and cheaper, the point of the level on the straight
 * line between both in logarithms of error and cost. An error below ten times the reference's is taken as that. */
static kmp_method_cost cost_of(const kempe_comparison *c, int run, double level)
{
    const kmp_compared *tight = &c->runs[run], *coarse = tight;
    kmp_method_cost cost = {tight->cpu_s, (double)tight->report.steps, (double)tight->report.rhs};
    /* The complete run of the method at the next coarser tolerance. */
    for (const kmp_compared *r = c->runs; r < c->runs + c->count; r++)
        if (r->method == tight->method && r->status == KEMPE_OK && r->rtol > tight->rtol &&
            (coarse == tight || r->rtol < coarse->rtol))
            coarse = r;
    double least = fmax(10 * c->uncertainty[KMP_QUANTITY_Q], LEAST);
    double in = fmax(tight->verdict.error[KMP_QUANTITY_Q], least), out = coarse->verdict.error[KMP_QUANTITY_Q];
    if (!(out > level) || !(in < level) || !(coarse->cpu_s < tight->cpu_s) || coarse->report.steps < 1)
        return cost;
    double part = log(level / in) / log(out / in);
    return (kmp_method_cost){between(cost.cpu_s, coarse->cpu_s, part),
                             between(cost.steps, (double)coarse->report.steps, part),
                             between(cost.rhs, (double)coarse->report.rhs, part)};
}

/* The cheapest run of each method within a level, and the cheapest method there. */
static void find_cheapest(kempe_comparison *c, int l)
{
    c->levels.level[l] = levels[l];
    c->levels.best[l] = -1;
    c->levels.blank[l] = !(levels[l] >= 10 * c->uncertainty[KMP_QUANTITY_Q]);
    for (int k = 0; k < c->count && !c->levels.blank[l]; k++) {
        int *own = &c->levels.run[(int)(c->runs[k].method - c->methods) * KMP_MOST_LEVELS + l];
        if (counts(c, k, levels[l]) && (*own < 0 || c->runs[k].cpu_s < c->runs[*own].cpu_s))
            *own = k;
    }
    double least = INFINITY;
    for (int w = 0; w < c->method_count; w++) {
        int place = w * KMP_MOST_LEVELS + l, run = c->levels.run[place];
        c->levels.cost[place] = run >= 0 ? cost_of(c, run, levels[l]) : (kmp_method_cost){NAN, NAN, NAN};
        if (c->levels.cost[place].cpu_s < least) {
            least = c->levels.cost[place].cpu_s;
            c->levels.best[l] = run;
        }
    }
}

void kmp_compare_levels(kempe_comparison *c)
{
    c->levels.run = KMP_ARENA_NEW(&c->arena, int, KMP_MOST_LEVELS * c->method_count);
    c->levels.cost = KMP_ARENA_NEW(&c->arena, kmp_method_cost, KMP_MOST_LEVELS * c->method_count);
    if (!c->has_reference || c->arena.failed)
        return;
    for (int k = 0; k < KMP_MOST_LEVELS * c->method_count; k++)
        c->levels.run[k] = -1;
    c->levels.count = KMP_MOST_LEVELS;
    for (int l = 0; l < KMP_MOST_LEVELS; l++)
        find_cheapest(c, l);
}

/* The errors of q that most users mean. */
static const double usual[KMP_MOST_AIMS] = {1e-6, 1e-8};

/* -- aims -------------------------------------------------------------------------------------------- */

/* The usual error levels for which statements are possible; if there are none, the finest possible one. */
static kmp_error_levels choose_aims(const kempe_comparison *c)
{
    kmp_error_levels a = {0};
    int finest = -1;
    for (int l = 0; l < c->levels.count; l++) {
        if (c->levels.blank[l] || c->levels.best[l] < 0)
            continue;
        finest = l;
        for (int k = 0; k < KMP_MOST_AIMS; k++)
            if (fabs(log10(c->levels.level[l] / usual[k])) < 0.01)
                a.level[a.count++] = l;
    }
    if (a.count == 0 && finest >= 0)
        a = (kmp_error_levels){1, {finest}};
    return a;
}

/* -- costs ------------------------------------------------------------------------------------------- */

kmp_method_cost kmp_compare_cost(const kempe_comparison *c, int method, int level)
{
    return c->levels.cost[method * c->levels.count + level];
}

double kmp_compare_ratio(const kempe_comparison *c, int method, int level)
{
    double cpu_s = kmp_compare_cost(c, method, level).cpu_s;
    int best = c->levels.best[level];
    return isnan(cpu_s) ? INFINITY : cpu_s / kmp_compare_cost(c, (int)(c->runs[best].method - c->methods), level).cpu_s;
}

/* The largest kmp_compare_ratio over the aims. */
static double compare_worst(const kempe_comparison *c, const kmp_error_levels *aims, int method)
{
    double worst = 0;
    for (int k = 0; k < aims->count; k++)
        worst = fmax(worst, kmp_compare_ratio(c, method, aims->level[k]));
    return worst;
}

double kmp_compare_first_s(const kempe_comparison *c, const kmp_compared *run)
{
    return c->system->build_s + run->build_s + run->cpu_s;
}

/* -- the same integrator ----------------------------------------------------------------------------- */

static bool same_family(const kempe_comparison *c, int a, int b)
{
    return strcmp(kmp_solver_family(c->methods[a].integrator), kmp_solver_family(c->methods[b].integrator)) == 0;
}

static bool same_formulation(const kempe_comparison *c, int a, int b)
{
    return strcmp(c->methods[a].formulation, c->methods[b].formulation) == 0;
}

int kmp_compare_base(const kempe_comparison *c, int method, int level)
{
    for (int w = 0; w < c->method_count; w++)
        if (same_family(c, w, method) && !isnan(kmp_compare_cost(c, w, level).cpu_s))
            return w;
    return -1;
}

int kmp_compare_best(const kempe_comparison *c, int level)
{
    for (int k = 0; k < c->tables.best_count; k++)
        if (!isnan(kmp_compare_cost(c, c->tables.best[k], level).cpu_s))
            return c->tables.best[k];
    return -1;
}

/* -- the best of each formulation -------------------------------------------------------------------- */

/* True if a method attains more aims than another, or as many at a smaller worst ratio. */
static bool is_better(const kempe_comparison *c, int method, int than)
{
    for (kmp_error_levels a = c->tables.aims; a.count > 0; a.count--) {
        double own = compare_worst(c, &a, method), other = compare_worst(c, &a, than);
        if (isfinite(own) || isfinite(other))
            return own < other;
    }
    return false;
}

void kmp_compare_tables(kempe_comparison *c)
{
    c->tables = (kmp_tables){.aims = choose_aims(c),
                             .same = KMP_ARENA_NEW(&c->arena, int, c->method_count),
                             .best = KMP_ARENA_NEW(&c->arena, int, c->method_count)};
    if (c->arena.failed || c->tables.aims.count == 0)
        return;
    /* Methods of families that run in several formulations. */
    kmp_tables *t = &c->tables;
    for (int first = 0; first < c->method_count; first++) {
        bool is_first = true, spans = false;
        for (int w = 0; w < c->method_count; w++) {
            is_first = is_first && (w >= first || !same_family(c, w, first));
            spans = spans || (same_family(c, w, first) && !same_formulation(c, w, first));
        }
        for (int w = first; w < c->method_count && is_first && spans; w++)
            if (same_family(c, w, first))
                t->same[t->same_count++] = w;
    }
    /* The best method of each formulation. */
    for (int w = 0; w < c->method_count; w++) {
        int k = 0;
        while (k < t->best_count && !same_formulation(c, t->best[k], w))
            k++;
        if (k == t->best_count)
            t->best[t->best_count++] = w;
        else if (is_better(c, w, t->best[k]))
            t->best[k] = w;
    }
    /* Best of all first. */
    int *best = c->tables.best;
    for (int i = 1; i < c->tables.best_count; i++)
        for (int k = i; k > 0 && is_better(c, best[k], best[k - 1]); k--) {
            int swap = best[k];
            best[k] = best[k - 1];
            best[k - 1] = swap;
        }
}

/* LOST: larger differences, in units of the tolerance, are not errors of steps. ANYWAY: an absolute limit of
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
                          kempe_outcome_text(kmp_outcome_of(c->runs[0].status)), c->runs[0].reason);
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

/* A first result that is earlier by less than this factor is not a reason for another choice: noise of times. */
#define SOONER 1.25

/* Methods whose times differ by less than this factor are equally fast. */
#define EQUAL 1.05

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

/* The method with the least of the worst ratios, if `robust` among the methods without failures; -1: none reaches all
 * aims.
 */
static int cheapest(const kempe_comparison *c, const kmp_error_levels *a, bool robust, int but)
{
    int found = -1;
    for (int w = 0; w < c->method_count; w++)
        if (w != but && isfinite(compare_worst(c, a, w)) && (!robust || failed_of(c, w) == 0) &&
            (found < 0 || compare_worst(c, a, w) < compare_worst(c, a, found)))
            found = w;
    return found;
}

/* The recommended method; if no method reaches all aims, only the coarser one counts. */
static int choose_method(const kempe_comparison *c, kmp_error_levels *a)
{
    int method = cheapest(c, a, false, -1);
    while (method < 0 && a->count > 1) {
        a->count--;
        method = cheapest(c, a, false, -1);
    }
    int robust = cheapest(c, a, true, -1);
    if (robust >= 0 && compare_worst(c, a, robust) <= ROBUST * compare_worst(c, a, method))
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

/* "1.2 times as long", with both ratios where they differ. */
static void put_times(kmp_text *text, const kempe_comparison *c, const kmp_error_levels *a, int method)
{
    kmp_text first = {0}, both = {0};
    kmp_error_levels one = {1, {a->level[0]}};
    ratios(&first, c, &one, method);
    ratios(&both, c, a, method);
    bool same = a->count > 1 && both.s && first.s && strcmp(both.s + first.length + strlen(" and "), first.s) == 0;
    kmp_text_printf(text, "%s times as long", same ? first.s : both.s ? both.s : "");
    kmp_text_free_part(text, &first);
    kmp_text_free_part(text, &both);
}

/* The error and the time of the recommended run, and of the run of its method for the smaller error. */
static void report_cost(kmp_text *text, const kempe_comparison *c, const kmp_error_levels *a, int method)
{
    const kmp_compared *run = &c->runs[run_at(c, method, a->level[0])];
    kmp_text_printf(text, "Error of q at most %g, in %.3g ms of processor time", c->levels.level[a->level[0]],
                    1e3 * run->cpu_s);
    if (a->count < 2)
        return;
    run = &c->runs[run_at(c, method, a->level[1])];
    kmp_text_printf(text, "; for %g use --rtol %g: %.3g ms", c->levels.level[a->level[1]], run->rtol, 1e3 * run->cpu_s);
}

/* The next method, and what the advised one takes where another one is faster. */
static void report_next(kmp_text *text, const kempe_comparison *c, const kmp_error_levels *a, int method)
{
    const int next = cheapest(c, a, false, method);
    const bool best = compare_worst(c, a, method) < EQUAL;
    if (!best) {
        kmp_text_put(text, "It takes ");
        ratios(text, c, a, method);
        kmp_text_put(text, " times as long as the fastest at these errors");
    }
    if (next < 0)
        return;
    const bool equal = best && compare_worst(c, a, next) < EQUAL;
    kmp_text_put(text, !best ? "; next: " : equal ? "Equally fast: " : "Next: ");
    kmp_compare_name(text, &c->methods[next]);
    if (!equal) {
        kmp_text_put(text, ", ");
        put_times(text, c, a, next);
    }
    if (failed_of(c, next) > 0)
        kmp_text_printf(text, ", but %d of its runs failed", failed_of(c, next));
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
        kmp_text_printf(text, "All %d runs of it reached the end", done);
    else
        kmp_text_put(text, "Its run reached the end");
    if (c->system->m > 0)
        kmp_text_printf(text, "; loops are closed to %.0e of the size of the mechanism", open);
}

static void report_stiffness(kmp_text *text, const kempe_comparison *c, const kmp_stiffness *s)
{
    if (s->implicit < 0)
        return;
    const kmp_compared *implicit = &c->runs[s->implicit];
    if (s->loose < 0) {
        kmp_text_printf(text, "Stiff: no explicit run reached its end; %s takes %ld steps at rtol %g",
                        implicit->method->integrator, implicit->report.steps, implicit->rtol);
        return;
    }
    const kmp_compared *loose = &c->runs[s->loose], *tight = &c->runs[s->tight];
    kmp_text_printf(text, "%s: %s takes %ld steps at rtol %g and %ld at %g", s->stiff ? "Stiff" : "Not stiff",
                    loose->method->integrator, loose->report.steps, loose->rtol, tight->report.steps, tight->rtol);
    if (s->stiff)
        kmp_text_printf(text, ", limited by stability, not by accuracy; %s takes %ld", implicit->method->integrator,
                        implicit->report.steps);
    else
        kmp_text_put(text, ", limited by accuracy");
}

/* The best method of the dae formulation at the aims, unless it is the advised or the next one. */
static void report_dae(kmp_text *text, const kempe_comparison *c, const kmp_error_levels *a, int advised)
{
    int dae = -1, tried = -1;
    for (int w = 0; w < c->method_count; w++) {
        if (strcmp(c->methods[w].formulation, "dae") != 0)
            continue;
        tried = w;
        if (isfinite(compare_worst(c, a, w)) && (dae < 0 || compare_worst(c, a, w) < compare_worst(c, a, dae)))
            dae = w;
    }
    if (tried < 0 || dae == advised || (dae >= 0 && dae == cheapest(c, a, false, advised)))
        return;
    if (dae < 0) {
        kmp_text_printf(text, "The formulation dae does not attain the error %g at these tolerances",
                        c->levels.level[a->level[a->count - 1]]);
        return;
    }
    kmp_text_put(text, "An independent check, without a choice of coordinates: ");
    kmp_compare_name(text, &c->methods[dae]);
    kmp_text_put(text, ", ");
    put_times(text, c, a, dae);
}

/* The share of preparation in a first result, and whether it changes the choice. */
static void report_preparation(kmp_text *text, const kempe_comparison *c, const kmp_error_levels *a, int method)
{
    const kmp_compared *run = &c->runs[run_at(c, method, a->level[0])], *first = run;
    double total = kmp_compare_first_s(c, run), prepared = total - run->cpu_s, least = INFINITY;
    if (!(prepared > run->cpu_s))
        return;
    kmp_text_printf(text, "A first run takes %.3g ms, of which %.3g ms prepare the equations", 1e3 * total,
                    1e3 * prepared);
    /* The best method of the formulation whose first result is there first, by its run for the aim. */
    for (int k = 0; k < c->tables.best_count; k++) {
        int other = run_at(c, c->tables.best[k], a->level[0]);
        if (other >= 0 && kmp_compare_first_s(c, &c->runs[other]) < least) {
            first = &c->runs[other];
            least = kmp_compare_first_s(c, first);
        }
    }
    if (SOONER * least < total) {
        kmp_text_put(text, "; with ");
        kmp_compare_name(text, first->method);
        kmp_text_printf(text, " it takes %.3g ms", 1e3 * least);
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
                     "All motion is prescribed: coordinates follow from the drives and closures at every instant, and "
                     "the tolerance affects only the work of the drives; use kempe kinematics or kempe inverse");
    else if (!c->has_reference)
        kmp_text_put(&text, "Without a reference the errors are unknown");
    if (steady >= 0) {
        kmp_text_printf(&text, "; the fastest run that agrees to %g in q with the run at the next tolerance is ",
                        USUAL);
        kmp_compare_name(&text, c->runs[steady].method);
        kmp_text_printf(&text, " at rtol %g: %.3g ms", c->runs[steady].rtol, 1e3 * c->runs[steady].cpu_s);
    }
    if (c->has_reference && !is_prescribed(c))
        kmp_text_printf(&text, "No run attains an error of q of %g", c->levels.count > 0 ? c->levels.level[0] : NAN);
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
    report_next(&lines[1], c, &a, method);
    report_ends(&lines[2], c, method);
    report_stiffness(&lines[3], c, &stiffness);
    report_dae(&lines[4], c, &a, method);
    report_preparation(&lines[5], c, &a, method);
    for (int k = 0; k < 6; k++)
        kmp_sentences_take(&c->arena, &c->advice.because, &lines[k]);
}
