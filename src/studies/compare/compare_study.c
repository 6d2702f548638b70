/* SPDX-License-Identifier: BSD-3-Clause */
/* Comparison: every chosen method at every tolerance from one assembled start, judged at the reference's times. */
#include "studies/compare/compare_study.h"
#include "base/memory.h"
#include "constraints/closing/assembly.h"
#include "constraints/partition/undetermined_loads.h"
#include "integrators/run/methods.h"
#include "integrators/steppers/solver.h"
#include "integrators/sundials/linear.h"
#include "model/data/closure_table.h"
#include "output/start_balance.h"
#include "platform/platform.h"
#include "studies/compare/compare_advice.h"
#include "studies/compare/compare_runs.h"
#include <float.h>
#include <math.h>
#include <string.h>

/* -- the reference --------------------------------------------------------------------------------------- */

/* Kempe's own reference: runs near rounding on several formulations with several integrators. They share neither the
 * choice of coordinates nor the closing nor the formulas of a step. The run with the smallest own uncertainty is the
 * reference. Its uncertainty combines its distance from the others, its own tolerances and rounding (docs/compare.md).
 */

/* Instants at which errors are judged, one within each of this number of equal parts, at irregular places so that no
 * period of a motion coincides with them. In eight examples eleven even instants found 0.36 to 1 of the largest error,
 * 100 of these instants 0.75, and 400 of them 0.82, mostly above 0.95. An early end of the reference is searched at
 * every STRIDE-th. */
enum { ROWS = 400, STRIDE = ROWS / 10, MOST_CUT = 2 };

static const kmp_source rows[] = {
#define KMP_SOURCE(formulation, form, integrator) {{formulation, form, integrator, false, false, NULL}, 0, 0, 0},
#include "studies/compare/sources.def"
#undef KMP_SOURCE
};

/* The tightest tolerance with a complete run is taken: after many turns rounding by itself may exceed the first. */
static const double tight[] = {1e-13, 1e-12, 1e-11, 1e-10, 1e-9, 1e-8, 1e-7};

enum { TIGHT = sizeof tight / sizeof *tight };

#define GOLDEN 0.6180339887498949 /* (sqrt(5) - 1) / 2 */

/* A method is tried at this tolerance first. With high orders its time grows by at most GROWTH for a tenth of the
 * tolerance: a run whose estimate is too long is not begun. */
#define COARSE 1e-5
#define GROWTH 1.4
/* Parts of the time for the reference: of one run, and of this first one. */
#define RUN_PART    0.125
#define COARSE_PART 0.06
/* An error at a tenfold tolerance is this many times larger, at least. */
#define FALL 5.0
/* The reference may be as inaccurate as the run it is compared with. */
#define BOTH 2.0
/* Errors are judged to the end if the uncertainty of q there is at most LOST; otherwise only while it is below the
 * first of these limits that some rows satisfy. */
#define LOST 1e-5
static const double kept[] = {1e-8, 1e-6, 1e-4};

enum { KEPT = sizeof kept / sizeof *kept };
/* Rounding of a state, relative: some operations make a row from it. */
#define ROUNDING (16 * DBL_EPSILON)
/* Relative change of a start to measure the amplification. */
#define NUDGE 1e-7
/* The part of it that must be left once the loops are closed. */
#define MOVED 1e-2

typedef struct maker_source {
    kmp_source said;
    kmp_samples table, beside; /* its rows, and the rows at a tenfold tolerance: none when that run was not complete */
    double own[KMP_QUANTITIES];
} maker_source;

typedef struct maker {
    kmp_compare_job *job;
    kempe_comparison *comparison;
    const kempe_system *system;
    kmp_times times;
    double at[ROWS + 1];
    double budget_s, least_left_s;
    int count, first; /* sources; the one that is the reference */
    maker_source sources[KMP_MOST_SOURCES];
    kmp_samples moved; /* the rows from a slightly changed start; none when it is impossible */
    char *reason;      /* the reason of the first failed run, lack of time excepted */
} maker;

typedef enum ending { DONE, CUT, FAILED } ending;

/* -- runs -------------------------------------------------------------------------------------------- */

static double allowed(const maker *m, double part)
{
    return fmin(part * m->budget_s, m->job->left_s - m->least_left_s);
}

static kempe_status attempt(maker *m, const kmp_method *method, double rtol, double part, kmp_samples *table,
                            ending *how, double *cpu_s)
{
    kmp_run_report report = {0};
    double limit_s = allowed(m, part);
    *how = CUT;
    if (!(limit_s > 0))
        return KEMPE_OK;
    kmp_log(m->job->context, KEMPE_LOG_PROGRESS, "reference: %s %s %s at rtol %g", method->formulation, method->form,
            method->integrator, rtol);
    kempe_status status = kmp_compare_once(m->job, method, rtol, &m->times, limit_s, table, &report);
    *how = status == KEMPE_OK ? DONE : report.cut ? CUT : FAILED;
    *cpu_s = report.cpu_s;
    if (status == KEMPE_STOPPED || status == KEMPE_E_FAILED) {
        const char *reason = report.reason ? report.reason : kempe_context_message(m->job->context);
        kmp_log(m->job->context, KEMPE_LOG_INFO, "reference: %s %s %s at rtol %g: %s", method->formulation,
                method->form, method->integrator, rtol, reason);
        if (!m->reason && !report.cut)
            m->reason = kmp_strdup(reason);
        status = kmp_interrupted(m->job->context) ? KEMPE_STOPPED : KEMPE_OK;
    }
    kmp_free(report.reason);
    return status;
}

/* The tightest complete run of a method within the time; said.rtol stays 0 when there is none. */
static kempe_status run_tight(maker *m, maker_source *s)
{
    ending how;
    double cpu_s = 0;
    int cut = 0;
    kempe_status status = attempt(m, &s->said.method, COARSE, COARSE_PART, &s->table, &how, &cpu_s);
    if (status != KEMPE_OK || how == CUT)
        return status;
    double coarse_s = how == DONE ? cpu_s : 0;
    for (int k = 0; k < TIGHT && cut < MOST_CUT && !(s->said.rtol > 0) && status == KEMPE_OK; k++) {
        if (coarse_s * pow(GROWTH, log10(COARSE / tight[k])) > allowed(m, RUN_PART))
            continue;
        status = attempt(m, &s->said.method, tight[k], RUN_PART, &s->table, &how, &cpu_s);
        if (status == KEMPE_OK && how == DONE)
            s->said.rtol = tight[k];
        if (how == CUT) {
            cut++;
            k += 2; /* a little more tolerance would not help */
        }
    }
    return status;
}

/* The difference of its rows from another's. */
static void differ(const maker *m, const kmp_samples *table, const kmp_samples *other, double until,
                   double difference[KMP_QUANTITIES])
{
    kmp_reference reference = *other;
    reference.shared = m->comparison->shared;
    kmp_verdict_errors(table, m->system, &reference, until, difference);
}

/* The difference of both runs up to a time; NaN when there is only one. */
static void judge_own(const maker *m, maker_source *s, double until)
{
    differ(m, &s->beside, &s->table, until, s->own);
    s->said.own = s->own[KMP_QUANTITY_Q];
}

static bool exists(const kmp_method *row)
{
    kmp_method method;
    for (int k = 0; kmp_method_get(k, &method); k++)
        if (strcmp(method.formulation, row->formulation) == 0 && strcmp(method.form, row->form) == 0 &&
            strcmp(method.integrator, row->integrator) == 0)
            return true;
    return false;
}

static void release(maker_source *s)
{
    kmp_samples_free(&s->table);
    kmp_samples_free(&s->beside);
}

/* -- amplification of a small change of the start ---------------------------------------------------- */

/* The assembled start with all coordinates moved by NUDGE of their size, with alternating signs, and closed again.
 * NULL: impossible. */
static kempe_status nudge(const maker *m, kempe_assembly **start)
{
    int n = m->system->n;
    double *q = KMP_NEW(double, n);
    bool *hold = KMP_NEW(bool, n);
    kempe_status status = q && hold ? KEMPE_OK : kmp_fail_memory(m->job->context);
    for (int k = 0; k < n && status == KEMPE_OK; k++)
        q[k] = m->job->start->q[k] + (k % 2 ? -NUDGE : NUDGE) * (1 + 0.1 * (k % 7)) * m->system->scale[k];
    kmp_guess guess = {.q = q, .hold = hold};
    if (status == KEMPE_OK)
        status = kmp_assemble_from(m->system, &guess, start);
    if (status == KEMPE_OK && !(*start)->closed) {
        kempe_assembly_free(*start);
        *start = NULL;
    }
    kmp_free(q);
    kmp_free(hold);
    return status;
}

static kempe_status run_nudged(maker *m)
{
    const maker_source *first = &m->sources[m->first];
    kempe_assembly *start = m->job->start, *moved = NULL;
    ending how = FAILED;
    double cpu_s;
    kempe_status status = nudge(m, &moved);
    if (status == KEMPE_OK && moved) {
        m->job->start = moved;
        status = attempt(m, &first->said.method, fmax(first->said.rtol, 1e-10), RUN_PART, &m->moved, &how, &cpu_s);
        m->job->start = start;
    }
    if (how != DONE)
        m->moved.rows = 0;
    kempe_assembly_free(moved);
    return status;
}

/* -- the best source and its uncertainty ------------------------------------------------------------- */

/* The one whose own tolerances agree best up to a time; a later one must be clearly better. */
static void choose_until(maker *m, double until)
{
    m->first = 0;
    for (int k = 0; k < m->count; k++) {
        judge_own(m, &m->sources[k], until);
        double best = m->sources[m->first].said.own, own = m->sources[k].said.own;
        if ((isnan(best) && !isnan(own)) || 3 * own < best)
            m->first = k;
    }
}

static void take_least(double *least, const double *difference)
{
    for (int k = 0; k < KMP_QUANTITIES; k++)
        least[k] = fmin(least[k], difference[k]); /* fmin of NaN and a number is the number */
}

/* The distances of the nearest run along another formulation, and of the nearest with another integrator. */
static void judge_others(maker *m, double until, double *formulation, double *integrator)
{
    const maker_source *first = &m->sources[m->first];
    for (int k = 0; k < KMP_QUANTITIES; k++)
        formulation[k] = integrator[k] = NAN;
    for (int k = 0; k < m->count; k++) {
        maker_source *s = &m->sources[k];
        double difference[KMP_QUANTITIES] = {NAN, NAN, NAN, NAN};
        if (k != m->first)
            differ(m, &s->table, &first->table, until, difference);
        s->said.distance = k == m->first ? 0 : difference[KMP_QUANTITY_Q];
        if (strcmp(s->said.method.formulation, first->said.method.formulation) != 0)
            take_least(formulation, difference);
        if (strcmp(s->said.method.integrator, first->said.method.integrator) != 0)
            take_least(integrator, difference);
    }
}

/* Uncertainty of the reference's rows up to a time: the largest of the sources' differences, the difference by its own
 * tolerances, and rounding. */
static void judge(maker *m, double until)
{
    maker_source *first = &m->sources[m->first];
    double formulation[KMP_QUANTITIES], integrator[KMP_QUANTITIES], rounding[KMP_QUANTITIES];
    judge_others(m, until, formulation, integrator);
    for (int k = 0; k < m->count; k++)
        judge_own(m, &m->sources[k], until);
    /* The effect of rounding up to a time, from its amplification at the start and at all rows. */
    const kmp_samples *table = &m->sources[m->first].table;
    double at_start[KMP_QUANTITIES] = {0}, all[KMP_QUANTITIES] = {0};
    differ(m, &m->moved, table, 0, at_start);
    differ(m, &m->moved, table, until, all);
    bool moved = at_start[KMP_QUANTITY_Q] > MOVED * NUDGE; /* drives and locks undo it all */
    for (int k = 0; k < KMP_QUANTITIES; k++)
        rounding[k] = ROUNDING * (moved ? fmax(all[k] / at_start[KMP_QUANTITY_Q], 1) : 1);
    m->comparison->amplification = moved ? all[KMP_QUANTITY_Q] / at_start[KMP_QUANTITY_Q] : NAN;
    for (int k = 0; k < KMP_QUANTITIES; k++) {
        double own = first->own[k] / (m->count > 1 ? FALL : 1), others = fmax(formulation[k], integrator[k]);
        bool known = !isnan(own) || !isnan(others);
        m->comparison->uncertainty[k] = known ? BOTH * fmax(fmax(own, rounding[k]), others) : NAN;
    }
}

/* Ends the reference earlier if the motion amplifies all differences, before they become large. */
static void keep_good(maker *m, double *at_end, double *bound)
{
    kempe_comparison *c = m->comparison;
    judge(m, INFINITY);
    *at_end = c->uncertainty[KMP_QUANTITY_Q];
    *bound = LOST;
    if (!(*at_end > LOST)) {
        c->has_reference = !isnan(*at_end);
        return;
    }
    for (int k = 0; k < KEPT && !c->has_reference; k++)
        for (int row = ROWS - STRIDE; row > 0 && !c->has_reference; row -= STRIDE) {
            judge(m, m->at[row]);
            c->has_reference = c->uncertainty[KMP_QUANTITY_Q] <= kept[k];
            c->until = m->at[row];
            *bound = kept[k];
        }
}

/* -- description ------------------------------------------------------------------------------------- */

/* True if the tolerances of both explain the distance of a source from the reference. */
static bool confirms(const maker *m, int k)
{
    const kmp_source *s = &m->sources[k].said;
    double promised = 10 * (s->own + m->sources[m->first].said.own) + m->comparison->uncertainty[KMP_QUANTITY_Q];
    return k != m->first && !(s->distance > promised);
}

static void describe(const maker *m, kmp_text *text)
{
    int count = 0, said = 0;
    kmp_text_put(text, "own: ");
    kmp_compare_name(text, &m->sources[m->first].said.method);
    kmp_text_printf(text, " at rtol %g, ", m->sources[m->first].said.rtol);
    for (int k = 0; k < m->count; k++)
        count += confirms(m, k);
    if (count == 0)
        kmp_text_put(text, "not confirmed by a second one");
    for (int k = 0; k < m->count; k++) {
        if (!confirms(m, k))
            continue;
        kmp_text_put(text, said == 0 ? "confirmed by " : said == count - 1 ? " and " : ", ");
        kmp_compare_name(text, &m->sources[k].said.method);
        said++;
    }
}

static void describe_nothing(const maker *m, double at_end, kmp_text *text)
{
    kmp_text_put(text, "none: ");
    if (m->count > 1)
        kmp_text_printf(text,
                        "the runs at the tightest tolerances differ by %.1g in q from the beginning; use a shorter "
                        "time or --reference CSV",
                        at_end);
    else if (m->count == 1)
        kmp_text_put(text, "only one run at the tightest tolerances reached its end, and no other run confirms it; use "
                           "--reference CSV");
    else if (m->reason)
        kmp_text_printf(text, "no run at a tight tolerance reached its end: %s", m->reason);
    else
        kmp_text_printf(text,
                        "no run at a tight tolerance reached its end within %.3g s of processor time; use a larger "
                        "--budget or --reference CSV",
                        m->budget_s);
}

static void settle(maker *m, double at_end, double bound)
{
    kempe_comparison *c = m->comparison;
    kmp_text text = {0};
    for (int k = 0; k < m->count; k++)
        c->sources[k] = m->sources[k].said;
    c->source_count = m->count;
    if (c->has_reference)
        describe(m, &text);
    else
        describe_nothing(m, at_end, &text);
    c->source = kmp_text_keep(&text, &c->arena);
    if (!c->has_reference)
        return;
    if (c->until < c->t_end)
        kmp_sentences_add(&c->arena, &c->warnings,
                          "the reference runs differ by %.1g in q at the end, and by less than %.0g only up to t "
                          "= %g s: errors are evaluated up to that time",
                          at_end, bound, c->until);
    for (int k = 0; k < m->count; k++) {
        const maker_source *s = &m->sources[k];
        kmp_text warning = {0};
        if (k == m->first || confirms(m, k))
            continue;
        kmp_compare_name(&warning, &s->said.method);
        kmp_text_printf(&warning,
                        " at rtol %g differs by %.1g in q from the reference, although its own tolerances agree to "
                        "%.1g: one of the two follows another branch",
                        s->said.rtol, s->said.distance, s->said.own);
        kmp_sentences_take(&c->arena, &c->warnings, &warning);
    }
    m->job->reference = m->sources[m->first].table;
    m->sources[m->first].table = (kmp_samples){0};
    m->job->reference.shared = c->shared;
    kmp_samples_limit(&m->job->reference, c->until);
}

static kempe_status make_reference(maker *m)
{
    double at_end = NAN, bound = NAN;
    kempe_status status = KEMPE_OK;
    for (size_t k = 0; k < sizeof rows / sizeof *rows && m->count < KMP_MOST_SOURCES && status == KEMPE_OK; k++) {
        if (!exists(&rows[k].method))
            continue;
        maker_source *s = &m->sources[m->count];
        *s = (maker_source){.said = rows[k]};
        kmp_samples_init(&s->table, m->system->n, m->system->m);
        kmp_samples_init(&s->beside, m->system->n, m->system->m);
        status = run_tight(m, s);
        if (status == KEMPE_OK && s->said.rtol > 0) { /* again, at a tenfold tolerance */
            ending how;
            double cpu_s;
            status = attempt(m, &s->said.method, 10 * s->said.rtol, RUN_PART, &s->beside, &how, &cpu_s);
            s->beside.rows = how == DONE ? s->beside.rows : 0;
        }
        if (status == KEMPE_OK && s->said.rtol > 0)
            m->count++;
        else
            release(s);
    }
    KMP_TRY(status);
    if (m->count > 0) {
        /* Chooses the reference. If all differ at the end, the beginning decides. */
        choose_until(m, INFINITY);
        if (m->sources[m->first].said.own > LOST)
            choose_until(m, m->at[STRIDE]);
        KMP_TRY(run_nudged(m));
        keep_good(m, &at_end, &bound);
    }
    settle(m, at_end, bound);
    return KEMPE_OK;
}

/* The own instants and the times of a given reference, ascending; of two that are one up to rounding the given one. */
static bool merge_times(maker *m, const kmp_reference *given)
{
    int count = given ? given->rows : 0, r = 0;
    m->times = (kmp_times){0, KMP_NEW(double, ROWS + 1 + count)};
    for (int k = 0; m->times.t && k <= ROWS; k++) {
        for (; r < count && (given->t[r] <= m->at[k] || kmp_times_are_one(given->t[r], m->at[k])); r++)
            m->times.t[m->times.count++] = given->t[r];
        if (m->times.count == 0 || !kmp_times_are_one(m->times.t[m->times.count - 1], m->at[k]))
            m->times.t[m->times.count++] = m->at[k];
    }
    return m->times.t;
}

/* Makes the comparison's own reference from several formulations and integrators, in at most `budget_s` of the
 * remaining time, at its own instants and at the times of a given reference (NULL: none). Without one, has_reference
 * stays false and `source` gives the reason. */
static kempe_status compare_own_reference(kmp_compare_job *job, double budget_s, const kmp_reference *given)
{
    kempe_comparison *c = job->comparison;
    maker m = {.job = job, .comparison = c, .system = c->system, .budget_s = budget_s};
    m.least_left_s = job->left_s - budget_s;
    for (int k = 0; k <= ROWS; k++)
        m.at[k] = k == ROWS ? c->t_end : c->t_end * (k + fmod(k * GOLDEN, 1)) / ROWS;
    for (int k = 0; k < KMP_QUANTITIES; k++)
        c->uncertainty[k] = NAN;
    kmp_samples_init(&m.moved, c->system->n, c->system->m);
    kempe_status status = merge_times(&m, given) ? make_reference(&m) : kmp_fail_memory(job->context);
    kmp_times_free(&m.times);
    for (int k = 0; k < m.count; k++)
        release(&m.sources[k]);
    kmp_samples_free(&m.moved);
    kmp_free(m.reason);
    return status == KEMPE_STOPPED ? KEMPE_OK : status; /* interrupted: the runs report it */
}

/* The default processor time of all runs, s, and the part of it available for the reference. */
#define BUDGET         60.0
#define REFERENCE_PART 0.4
/* Rows of runs whose time counts, less one. */
#define FEW 10

/* A given table of fewer rows is extended by the own reference if both differ in q by at most AGREED. */
#define MANY_ROWS 200
#define AGREED    1e-5

/* -- the choice of methods and tolerances ---------------------------------------------------------------- */

/* Comma-separated lists of formulations, forms, integrators and tolerances, compared with the table of methods. */

static const char default_rtols[] = "1e-3,1e-4,1e-5,1e-6,1e-7,1e-8,1e-9,1e-10,1e-11,1e-12,1e-13";

typedef enum part { PART_FORMULATION, PART_FORM, PART_INTEGRATOR, PARTS } part;

static const char *const part_name[PARTS] = {"formulation", "form", "integrator"};

static const char *part_of(const kmp_method *method, part p)
{
    const char *name = p == PART_FORMULATION ? method->formulation : p == PART_FORM ? method->form : method->integrator;
    return name ? name : "";
}

/* -- names ------------------------------------------------------------------------------------------- */

static bool word_is(const char *s, size_t length, const char *name)
{
    return strlen(name) == length && memcmp(s, name, length) == 0;
}

/* True if the list contains the name; an absent list contains all. */
static bool list_has(const char *list, const char *name)
{
    for (const char *s = list; s; s = s[strcspn(s, ",")] ? s + strcspn(s, ",") + 1 : NULL)
        if (word_is(s, strcspn(s, ","), name))
            return true;
    return !list;
}

static kempe_status check_names(kempe_context *context, const char *list, part p)
{
    for (const char *s = list; s;) {
        size_t length = strcspn(s, ",");
        kmp_method method, before;
        bool known = false;
        for (int k = 0; kmp_method_get(k, &method); k++)
            known = known || (length > 0 && word_is(s, length, part_of(&method, p)));
        if (!known) {
            kmp_text sentence = {0};
            kmp_text_printf(&sentence, "unknown %s '%.*s'; available: ", part_name[p], (int)length, s);
            /* Each name of the table once. */
            for (int k = 0, said = 0; kmp_method_get(k, &method); k++) {
                const char *name = part_of(&method, p);
                bool again = !*name;
                for (int i = 0; i < k && kmp_method_get(i, &before); i++)
                    again = again || strcmp(part_of(&before, p), name) == 0;
                if (!again)
                    kmp_text_printf(&sentence, "%s%s", said++ ? ", " : "", name);
            }
            return kmp_fail_text(context, KEMPE_E_ARGUMENT, &sentence);
        }
        s = s[length] ? s + length + 1 : NULL;
    }
    return KEMPE_OK;
}

/* -- methods and tolerances -------------------------------------------------------------------------- */

/* A method run in addition to the standard ones when neither a form nor an integrator is given. */
static const char *const beside[PARTS] = {"reduced", "integrated", "dopri5"};

/* True if the method is selected. Forms and integrators that are not given by name must be standard ones. */
static bool is_chosen(const kmp_method *method, const char *const list[PARTS])
{
    bool chosen = true, is_beside = !list[PART_FORM] && !list[PART_INTEGRATOR];
    for (part p = PART_FORMULATION; p < PARTS; p++) {
        chosen = chosen && list_has(list[p], part_of(method, p));
        is_beside = is_beside && strcmp(part_of(method, p), beside[p]) == 0;
    }
    return chosen && (list[PART_FORM] || method->standard_form) &&
           (list[PART_INTEGRATOR] || method->standard_integrator || is_beside);
}

bool kmp_is_implicit(const kmp_method *method)
{
    const kmp_solver_kind *solver = kmp_solver_find(method->integrator);
    return solver->dae || solver->implicit || solver->lanes;
}

/* Adds a method: once, or with each linear solver of the list if its integrator takes one. */
static void add_method(kempe_comparison *c, kmp_method method, const char *linear)
{
    bool each = linear && kmp_solver_find(method.integrator)->sparse;
    if (each)
        method.linear = "auto";
    if (!each || list_has(linear, method.linear))
        c->methods[c->method_count++] = method;
    for (int k = 0; each && kmp_linear_name(k); k++) {
        method.linear = kmp_linear_name(k);
        if (list_has(linear, method.linear))
            c->methods[c->method_count++] = method;
    }
}

static kempe_status check_linear(kempe_context *context, const char *list)
{
    for (const char *s = list; s; s = s[strcspn(s, ",")] ? s + strcspn(s, ",") + 1 : NULL) {
        size_t length = strcspn(s, ",");
        bool known = word_is(s, length, "auto");
        for (int k = 0; kmp_linear_name(k); k++)
            known = known || word_is(s, length, kmp_linear_name(k));
        if (!known)
            return kmp_fail(context, KEMPE_E_ARGUMENT, "unknown linear solver '%.*s'; available: %s", (int)length, s,
                            kmp_linear_names());
    }
    return KEMPE_OK;
}

/* Chooses methods from the lists of the options, whose names are checked; lists that are not given contain the standard
 * ones. `implicit`: integrators that use the Jacobian count as standard. KEMPE_E_ARGUMENT: the unknown name, and the
 * valid ones. */
static kempe_status choose_methods(kempe_comparison *c, const kempe_compare_options *options, bool implicit)
{
    const char *const list[PARTS] = {options->formulations, options->forms, options->integrators};
    for (part p = PART_FORMULATION; p < PARTS; p++)
        KMP_TRY(check_names(c->system->context, list[p], p));
    KMP_TRY(check_linear(c->system->context, options->linear));
    kmp_method method;
    int count = 0, solvers = 1;
    while (kmp_method_get(count, &method))
        count++;
    while (kmp_linear_name(solvers - 1))
        solvers++;
    c->method_count = 0;
    c->methods = KMP_ARENA_NEW(&c->arena, kmp_method, count * solvers);
    KMP_TRY(kmp_made(c->system->context, c->methods));
    for (int k = 0; kmp_method_get(k, &method); k++) {
        method.standard_integrator =
            method.standard_integrator || (implicit && kmp_solver_find(method.integrator)->implicit);
        if (is_chosen(&method, list))
            add_method(c, method, options->linear);
    }
    if (c->method_count > 0)
        return KEMPE_OK;
    return kmp_fail(c->system->context, KEMPE_E_ARGUMENT,
                    "the requested formulations, forms and integrators cannot be combined");
}

static kempe_status choose_rtols(kempe_comparison *c, const char *list)
{
    c->rtols = KMP_ARENA_NEW(&c->arena, double, strlen(list) + 1);
    KMP_TRY(kmp_made(c->system->context, c->rtols));
    for (const char *s = list; s;) {
        double *rtol = &c->rtols[c->rtol_count++];
        size_t length = strcspn(s, ","), blank = strspn(s, " "), read = kmp_text_to_number(s + blank, rtol);
        size_t tail = strspn(s + blank + read, " ");
        if (read == 0 || blank + read + tail != length || !(*rtol > 0) || !(*rtol < 1))
            return kmp_fail(c->system->context, KEMPE_E_ARGUMENT,
                            "rtol '%.*s': numbers between 0 and 1 are expected, separated by commas", (int)length, s);
        s = s[length] ? s + length + 1 : NULL;
    }
    return KEMPE_OK;
}

/* One successful run makes a comparison; without one, the first failure gives its reason. */
static kempe_status conclude(kmp_compare_job *j)
{
    kempe_comparison *c = j->comparison;
    const kmp_compared *first = NULL;
    c->status = kmp_interrupted(j->context) ? KEMPE_STOPPED : KEMPE_E_FAILED;
    for (int k = 0; k < c->count; k++) {
        if (c->runs[k].status == KEMPE_OK && c->status != KEMPE_STOPPED)
            c->status = KEMPE_OK;
        else if (c->runs[k].status != KEMPE_OK && !first)
            first = &c->runs[k];
    }
    if (c->status == KEMPE_E_FAILED && first && first->status == KEMPE_STOPPED)
        c->status = KEMPE_STOPPED;
    const char *reason = c->status == KEMPE_OK ? "" : kmp_interrupted(j->context) ? "interrupted" : "no run was made";
    if (c->status != KEMPE_OK && !kmp_interrupted(j->context) && first)
        reason = first->reason;
    c->reason = reason;
    return c->status == KEMPE_E_FAILED ? kmp_fail(j->context, c->status, "%s", c->reason) : c->status;
}

/* -- preparing --------------------------------------------------------------------------------------- */

/* Takes only the given table: errors are judged at its rows only. */
static void take_given(kmp_compare_job *j, kmp_reference *given, const char *name)
{
    kempe_comparison *c = j->comparison;
    kmp_samples_free(&j->reference);
    j->reference = *given;
    *given = (kmp_reference){0};
    c->has_reference = true;
    c->until = c->t_end;
    c->source = kmp_arena_strdup(&c->arena, name);
    for (int k = 0; k < KMP_QUANTITIES; k++)
        c->uncertainty[k] = 0;
}

/* A table with few rows says nothing of the time between them: there the own reference counts, if it agrees with the
 * table. */
static kempe_status extend_given(kmp_compare_job *j, kmp_reference *given, const char *name)
{
    kempe_comparison *c = j->comparison;
    double off[KMP_QUANTITIES];
    int reported = c->warnings.count;
    KMP_TRY(compare_own_reference(j, REFERENCE_PART * j->left_s, given));
    given->shared = c->shared;
    kmp_verdict_errors(&j->reference, c->system, given, INFINITY, off);
    if (c->has_reference && c->until >= c->t_end && off[KMP_QUANTITY_Q] <= AGREED) {
        c->source = kmp_arena_printf(&c->arena, "%s, which agrees to %.0e in q with the one between its rows, %s", name,
                                     off[KMP_QUANTITY_Q], c->source);
        /* Values of a given table replace the values of the own reference at the same times. */
        kmp_reference *own = &j->reference;
        for (int row = 0, r = 0; row < own->rows && r < given->rows; row++) {
            if (own->t[row] < given->t[r])
                continue;
            for (int k = 0; k < KMP_QUANTITIES; k++) {
                size_t width = (size_t)(k == KMP_QUANTITY_LAMBDA ? own->m : own->n);
                for (size_t i = 0; i < width; i++) {
                    double x = given->value[k][(size_t)r * width + i], *place = &own->value[k][(size_t)row * width + i];
                    *place = isnan(x) ? *place : x;
                }
            }
            r++;
        }
        return KEMPE_OK;
    }
    c->warnings.count = reported;
    if (c->has_reference && off[KMP_QUANTITY_Q] > AGREED)
        kmp_sentences_add(&c->arena, &c->warnings, "Kempe's own reference differs by %.1g in q from %s",
                          off[KMP_QUANTITY_Q], name);
    kmp_sentences_add(&c->arena, &c->warnings,
                      "errors are evaluated only at the rows of %s: between them they may be larger", name);
    take_given(j, given, name);
    return KEMPE_OK;
}

static kempe_status use_reference(kmp_compare_job *j, const char *path)
{
    kempe_comparison *c = j->comparison;
    kmp_reference given = {0};
    kempe_status status = KEMPE_OK;
    if (!path)
        return compare_own_reference(j, REFERENCE_PART * j->left_s, NULL);
    KMP_TRY(kmp_reference_read(c->system, path, &given));
    kmp_samples_limit(&given, c->t_end);
    if (given.rows < MANY_ROWS)
        status = extend_given(j, &given, kmp_path_name(path));
    else
        take_given(j, &given, kmp_path_name(path));
    kmp_samples_free(&given);
    j->reference.shared = c->shared;
    return status == KEMPE_OK && !c->source ? kmp_fail_memory(j->context) : status;
}

/* The options are judged before anything is computed. */
static kempe_status prepare(kmp_compare_job *j, const kempe_compare_options *options)
{
    kempe_comparison *c = j->comparison;
    KMP_TRY(choose_methods(c, options, false));
    KMP_TRY(choose_rtols(c, options->rtols ? options->rtols : default_rtols));
    KMP_TRY(kmp_compare_bodies_begin(c->system->model, options->bodies, &c->arena, &c->bodies));
    double budget_s = options->budget_s;
    if (!(budget_s >= 0) || isinf(budget_s))
        return kmp_fail(j->context, KEMPE_E_ARGUMENT, "budget_s = %g: a positive number is expected", budget_s);
    j->comparison->budget_s = j->left_s = budget_s > 0 ? budget_s : BUDGET;
    const kmp_method *method = &j->comparison->methods[0];
    kmp_run_spec spec = {.formulation = method->formulation,
                         .form = method->form,
                         .integrator = method->integrator,
                         .t_end = options->t_end};
    if (!(options->t_end >= 0) || isinf(options->t_end))
        return kmp_fail(j->context, KEMPE_E_ARGUMENT, "t_end = %g: a positive number is expected", options->t_end);
    KMP_TRY(kmp_run_resolve(j->comparison->system, &spec));
    if (!(spec.t_end > 0))
        return kmp_fail(j->context, KEMPE_E_ARGUMENT, "t_end is missing: give it in the model or as an option");
    j->comparison->t_end = j->comparison->until = spec.t_end;
    j->eval = kmp_eval_new(j->comparison->system, spec.backend);
    KMP_TRY(j->eval ? KEMPE_OK : KEMPE_E_MEMORY);
    KMP_TRY(kmp_assembly_at_start(c->system, &j->start));
    KMP_TRY(kmp_made(j->context, kmp_start_balance_copy(&c->arena, j->start->balance, &c->balance)));
    /* A stiff model is also run with implicit integrators, unless the user chose others. */
    bool stiff = false;
    if (!options->integrators) {
        KMP_TRY(kmp_compare_probe(j, &stiff));
        KMP_TRY(stiff ? choose_methods(c, options, true) : KEMPE_OK);
    }
    /* Finds multipliers that redundant rows leave undetermined: their errors are undefined, which the report states. */
    const double *q = j->start->inner_q ? j->start->inner_q : j->start->q;
    int count = 0;
    c->shared = KMP_ARENA_NEW(&c->arena, bool, c->system->m);
    KMP_TRY(kmp_made(j->context, c->shared));
    if (j->start->chart)
        kmp_eval_set_charts(j->eval, j->start->chart);
    KMP_TRY(kmp_find_shared(j->eval, 0, q, c->shared, &count));
    for (int r = 0; r < c->system->m; r++) /* rows of friction that slips and of open contacts have given forces */
        count -=
            c->shared[r] && kmp_closure_is_of_modes(kmp_model_closure(c->system->model, c->system->rows[r].closure));
    if (count > 0)
        kmp_sentences_add(
            &c->arena, &c->warnings,
            "%d of %d multipliers are not unique because of redundant constraints: their errors are omitted "
            "('kempe check' lists them)",
            count, c->system->m);
    KMP_TRY(use_reference(j, options->reference));
    kmp_context_clear(j->context);
    if (!kmp_times_init(&j->times, c->t_end, c->t_end, c->has_reference ? &j->reference : NULL) ||
        !kmp_times_init(&j->few, c->t_end / FEW, c->t_end, NULL))
        return kmp_fail_memory(j->context);
    if (c->has_reference)
        c->scales = kmp_verdict_scales(c->system, &j->reference);
    for (int k = 0; c->has_reference && k < j->reference.rows; k++)
        c->instants += j->reference.t[k] <= c->until;
    return KEMPE_OK;
}

/* -- the comparison ---------------------------------------------------------------------------------- */

static kempe_status compare(kmp_compare_job *j, const kempe_compare_options *options)
{
    kempe_comparison *c = j->comparison;
    KMP_TRY(prepare(j, options));
    /* Repeats the warnings of the start. */
    char *lines = kmp_context_warnings(j->context);
    for (const char *at = lines; at && *at; at += strcspn(at, "\n") + 1)
        kmp_sentences_add(&c->arena, &c->warnings, "%.*s", (int)strcspn(at, "\n"), at);
    kmp_free(lines);
    KMP_TRY(lines ? KEMPE_OK : kmp_fail_memory(j->context));
    KMP_TRY(kmp_compare_run_all(j));
    KMP_TRY(kmp_compare_bodies(c->system->model, c->t_end, &c->arena, &c->bodies));
    kmp_compare_levels(c);
    if (!c->arena.failed) {
        kmp_compare_tables(c);
        kmp_compare_remark(c);
        kmp_compare_advise(c);
    }
    return c->arena.failed ? kmp_fail_memory(j->context) : conclude(j);
}

kempe_status kmp_compare(const kempe_system *system, const kempe_compare_options *options,
                         kempe_comparison **comparison)
{
    KMP_OPTIONS(system->context, kempe_compare_options, options);
    kempe_comparison *c = KMP_NEW(kempe_comparison, 1);
    kmp_compare_job j = {.comparison = c, .context = system->context};
    KMP_TRY(kmp_made(j.context, c));
    *c = (kempe_comparison){
        .system = system, .source = "none", .amplification = NAN, .advice = {.run = -1, .level = NAN}};
    kempe_status status = compare(&j, options);
    if (status == KEMPE_E_FAILED && !c->reason) { /* it cannot be assembled: message and result give the reason */
        c->status = status;
        c->reason = kmp_arena_strdup(&c->arena, kempe_context_message(j.context));
    }
    if (c->arena.failed)
        status = kmp_fail_memory(j.context);
    kempe_assembly_free(j.start);
    kmp_eval_free(j.eval);
    kmp_samples_free(&j.reference);
    kmp_times_free(&j.times);
    kmp_times_free(&j.few);
    status = kmp_context_verdict(j.context, status);
    c->status = status == KEMPE_UNTRUSTED ? status : c->status;
    return KMP_GIVE_IF(kmp_has_result(status), status, comparison, c, kempe_comparison_free);
}

KMP_FREES(kempe_comparison, comparison, kmp_arena_free(&comparison->arena))
