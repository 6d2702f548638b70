/* SPDX-License-Identifier: BSD-3-Clause */
/* Reports of the studies whose results are rows, states, instances or a run: each says what its page has. */
#include "analyses/equilibrium/balances.h"
#include "analyses/inverse/inverse_study.h"
#include "analyses/kinematics/position_sweep.h"
#include "analyses/limit_cycles/cycle_branch.h"
#include "analyses/limit_cycles/limit_cycles_study.h"
#include "analyses/response/response_study.h"
#include "base/arena.h"
#include "base/context.h"
#include "base/memory.h"
#include "base/text.h"
#include "constraints/closing/assemble.h"
#include "constraints/closing/assembly.h"
#include "constraints/inexact/nearest_exact.h"
#include "ensemble/batch.h"
#include "ensemble/fit/fit_study.h"
#include "ensemble/folder_parts.h"
#include "ensemble/optimize/optimize_study.h"
#include "ensemble/result_folder.h"
#include "ensemble/statistics/statistics.h"
#include "model/data/model.h"
#include "model/data/signal.h"
#include "model/read/loads.h"
#include "output/print.h"
#include "output/result_table.h"
#include "pipeline.h"
#include "report/motion_picture.h"
#include "report/result_page.h"
#include "report/vehicle_drawing.h"
#include "studies/simulate/observed.h"
#include "studies/simulate/trajectory_print.h"
#include <kempe/check.h>
#include <kempe/compare.h>
#include <kempe/kempe.h>
#include <math.h>
#include <stdbool.h>
#include <string.h>

/* A page under construction, with all that it refers to. */
typedef struct study_page {
    kmp_result_page page;
    kempe_context *context;
    kmp_arena arena;
    kmp_samples frames;
    double *zero; /* n + m: rates and multipliers of frames, which pictures do not use */
    kempe_table *table;
    char *text;
    kempe_statistics *statistics;
    const char *first[KMP_PAGE_FIRST];
    kmp_record record, start; /* of a run once more; of its start where that has no row */
    kmp_output_program observed;
    kmp_columns own;        /* of the model's own outputs */
    kempe_comfort *comfort; /* of a vehicle; NULL: none */
} study_page;

static kempe_status begin(study_page *s, const kempe_system *system, const char *command, const char *subject)
{
    *s = (study_page){.context = system->context};
    s->page = (kmp_result_page){.system = system, .command = command, .subject = subject, .first = s->first};
    kmp_samples_init(&s->frames, system->n, system->m);
    kmp_model_begin(system->model);
    KMP_TRY(kempe_report_check(system->context));
    s->zero = KMP_ARENA_NEW(&s->arena, double, system->n + system->m);
    return s->zero ? KEMPE_OK : kmp_fail_memory(system->context);
}

/* Frames at x, or by their number (NULL). */
static kempe_status add_frames(study_page *s, int count, const double *q, ptrdiff_t stride, const double *x)
{
    for (int k = 0; k < count; k++)
        if (kmp_samples_add(&s->frames, x ? x[k] : k, q + k * stride, s->zero, s->zero, s->zero, 0))
            return kmp_fail_memory(s->context);
    s->page.frames = &s->frames;
    return KEMPE_OK;
}

/* The end of the study, and a line above the answer. */
static void set_outcome(study_page *s, kempe_status status, const char *reason, const char *warnings, const char *words)
{
    const kempe_system *system = s->page.system;
    s->page.outcome = kmp_outcome_of(status);
    s->page.reason = reason;
    s->page.warnings = warnings;
    s->page.scene = kmp_arena_printf(&s->arena, "%s \xc2\xb7 %d coordinate%s, %d closure row%s", words, system->n,
                                     system->n == 1 ? "" : "s", system->m, system->m == 1 ? "" : "s");
}

/* As far as there is room. */
static void add_fact(study_page *s, const char *name, const char *format, ...)
{
    kmp_text value = {0};
    KMP_TEXT_ARGUMENTS(&value, format);
    const char *kept = kmp_text_keep(&value, &s->arena);
    if (s->page.fact_count < KMP_PAGE_FACTS)
        s->page.fact[s->page.fact_count++] = (kmp_page_fact){name, kept};
}

static bool is_chosen(const study_page *s, const char *name)
{
    for (int k = 0; k < s->page.first_count; k++)
        if (strcmp(s->first[k], name) == 0)
            return true;
    return false;
}

/* Columns that are drawn at first: up to `most` whose names begin with one of the words, or after '*' contain it. */
static void choose_first(study_page *s, const char *const *words, int most)
{
    for (; *words; words++)
        for (int c = 0; c < kempe_table_column_count(s->table) && s->page.first_count < most; c++) {
            const char *name = kempe_table_column_name(s->table, c);
            bool fits = **words == '*' ? strstr(name, *words + 1) != NULL : strncmp(name, *words, strlen(*words)) == 0;
            if (fits && kempe_table_values(s->table, c) && strcmp(name, s->page.x) != 0 && !is_chosen(s, name))
                s->first[s->page.first_count++] = name;
        }
}

/* The page of a result, which `fill` makes. */
static kempe_status write_page(const kempe_system *system, const char *command, const char *subject,
                               kempe_status (*fill)(study_page *s, const void *result), const void *result,
                               const char *path)
{
    study_page s;
    kempe_status status = begin(&s, system, command, subject);
    if (status == KEMPE_OK)
        status = fill(&s, result);
    if (status == KEMPE_OK) {
        s.page.text = s.text;
        s.page.table = s.table;
        status = s.arena.failed ? kmp_fail_memory(s.context) : kmp_result_page_write(&s.page, path);
    }
    kempe_text_free(s.text);
    kempe_statistics_free(s.statistics);
    kempe_table_free(s.table);
    kmp_samples_free(&s.frames);
    kmp_record_free(&s.record);
    kmp_record_free(&s.start);
    kmp_output_program_free(&s.observed);
    kmp_columns_free(&s.own);
    kempe_comfort_free(s.comfort);
    kmp_arena_free(&s.arena);
    return status;
}

/* -- position analysis ------------------------------------------------------------------------------- */

static kempe_status fill_kinematics(study_page *s, const void *result)
{
    const kempe_kinematics *k = result;
    static const char *const first[] = {"q.", "position.", "sensor.", "energy.", NULL};
    set_outcome(s, k->status, k->reason, k->warnings, "position analysis");
    s->page.answer = kmp_arena_printf(&s->arena, "%d positions, %d dead centre%s", k->count, k->dead_count,
                                      k->dead_count == 1 ? "" : "s");
    KMP_TRY(kempe_kinematics_print(k, KEMPE_TEXT, &s->text));
    KMP_TRY(kempe_kinematics_table(k, "rows", &s->table));
    /* A column of the swept value if it ascends all along, otherwise s, which always does. */
    const char *swept =
        k->time >= 0 ? "t" : kmp_arena_printf(&s->arena, "q.%s", kmp_kinematics_name(k, &k->parameter[k->first]));
    int column = swept ? kempe_table_find(s->table, swept) : -1;
    const double *x = column >= 0 ? kempe_table_values(s->table, column) : NULL;
    s->page.x = x ? swept : "s";
    for (int row = 1; x && row < k->count; row++)
        if (!(x[row] > x[row - 1]))
            s->page.x = "s";
    s->page.frame_x = kempe_table_values(s->table, kempe_table_find(s->table, s->page.x));
    choose_first(s, first, KMP_PAGE_FIRST / 2);
    return add_frames(s, k->count, k->q, k->system->n, NULL);
}

/* -- inverse dynamics -------------------------------------------------------------------------------- */

/* The largest size among the columns whose names begin with a word, with its unit and the rest of its name. */
static void add_peak(study_page *s, const char *fact, const char *word)
{
    size_t length = strlen(word);
    int best = -1;
    double most = -1;
    for (int c = 0; c < kempe_table_column_count(s->table); c++)
        for (int row = 0; row < kempe_table_row_count(s->table); row++) {
            double x = fabs(kempe_table_number(s->table, row, c));
            if (strncmp(kempe_table_column_name(s->table, c), word, length) == 0 && x > most) {
                most = x;
                best = c;
            }
        }
    if (best < 0)
        return;
    const char *name = kempe_table_column_name(s->table, best) + length;
    add_fact(s, kmp_arena_printf(&s->arena, "%s, %s", fact, name), "%.4g %s", most, kempe_table_unit(s->table, best));
}

static kempe_status fill_inverse(study_page *s, const void *result)
{
    const kempe_inverse *r = result;
    static const char *const first[] = {"tau.", "power.", NULL};
    set_outcome(s, r->status, r->reason, r->warnings, "inverse dynamics");
    s->page.answer = kmp_is_complete(r->status) ? kmp_arena_printf(&s->arena, "Forces of %d actuator%s at %d instants",
                                                                   r->a, r->a == 1 ? "" : "s", r->rows)
                                                : kmp_arena_printf(&s->arena, "Stopped after %d instants", r->rows);
    KMP_TRY(kempe_inverse_print(r, KEMPE_TEXT, &s->text));
    KMP_TRY(kempe_inverse_table(r, "rows", &s->table));
    s->page.x = "t";
    add_peak(s, "largest force or torque", "tau.");
    add_peak(s, "largest power", "power.");
    choose_first(s, first, KMP_PAGE_FIRST);
    return r->rows > 0 ? add_frames(s, r->rows, kmp_inverse_part(r, 0, r->at.q), r->width, r->t) : KEMPE_OK;
}

/* -- frequency response ------------------------------------------------------------------------------ */

static kempe_status fill_response(study_page *s, const void *result)
{
    const kempe_response *r = result;
    static const char *const first[] = {"*.amplitude", "*.phase", NULL};
    set_outcome(s, KEMPE_OK, NULL, r->channels.warnings,
                r->channels.at->equilibrium ? "at the equilibrium" : "at the start");
    s->page.answer = kmp_arena_printf(&s->arena, "%d resonance%s among %d frequencies", r->frequency.peak_count,
                                      r->frequency.peak_count == 1 ? "" : "s", r->frequency.count);
    KMP_TRY(kempe_response_print(r, KEMPE_TEXT, &s->text));
    KMP_TRY(kempe_response_table(r, "rows", &s->table));
    s->page.x = "frequency";
    s->page.logarithmic = !r->linear;
    choose_first(s, first, KMP_PAGE_FIRST);
    return add_frames(s, 1, r->channels.at->q, 0, NULL);
}

/* -- equilibria -------------------------------------------------------------------------------------- */

static kempe_status fill_equilibria(study_page *s, const void *result)
{
    const kempe_equilibrium *e = result;
    const char *stability = e->count > 0 ? kempe_equilibrium_stability(e, 0) : "none found";
    set_outcome(s, KEMPE_OK, NULL, e->warnings, e->rate_count > 0 ? "steady motion" : "static equilibrium");
    s->page.answer = e->count == 1 ? kmp_arena_printf(&s->arena, "One equilibrium: %s", stability)
                                   : kmp_arena_printf(&s->arena, "%d equilibria, the first %s", e->count, stability);
    KMP_TRY(kempe_equilibrium_print(e, KEMPE_TEXT, &s->text));
    KMP_TRY(kempe_equilibrium_table(e, "equilibria", &s->table));
    s->page.separate = true;
    for (int k = 0; k < e->count; k++)
        KMP_TRY(add_frames(s, 1, e->balance[k].q, 0, (double[]){k + 1}));
    return KEMPE_OK;
}

/* -- ensembles --------------------------------------------------------------------------------------- */

/* The instances of a run, or those gathered from its folder. */
typedef struct instances {
    kempe_table **table; /* which the page takes */
    kempe_status status;
} instances;

static kempe_status fill_instances(study_page *s, const void *result)
{
    const instances *i = result;
    static const char *const first[] = {"q.", NULL};
    s->table = *i->table;
    *i->table = NULL;
    const kmp_instance_sums sums = kmp_instances_sum(s->table, 0);
    set_outcome(s, i->status, NULL, NULL, "ensemble");
    s->page.answer = kmp_arena_printf(&s->arena, "%ld of %ld instances reached the end", sums.ok, sums.count);
    s->page.x = kempe_table_find(s->table, "status") > 0 ? kempe_table_column_name(s->table, 0) : "";
    s->page.scattered = true;
    /* Quantities are drawn in place of the states, with their statistics. */
    double part, low, high;
    if (kmp_statistics_has_quantities(s->table) && kmp_is_complete(i->status)) {
        KMP_TRY(kempe_statistics_new(s->table, 0, &s->statistics));
        s->page.statistics = s->statistics;
        for (int c = 0; c < kempe_table_column_count(s->table) && s->page.first_count < KMP_PAGE_FIRST / 2; c++)
            if (kmp_statistics_is_quantity(s->table, c))
                s->first[s->page.first_count++] = kempe_table_column_name(s->table, c);
        if (kmp_statistics_yield(s->statistics, &part, &low, &high))
            add_fact(s, "within the limits", "%.4g %% (%.4g to %.4g %%)", 100 * part, 100 * low, 100 * high);
    }
    /* Text and warnings are those of the table: a gathered run has no others. */
    kmp_text text = {0}, warnings = {0};
    kmp_instances_put(&text, s->page.system->model->name, s->table, 0, "", s->statistics, i->status == KEMPE_UNTRUSTED);
    kmp_instances_put_warnings(&warnings, &sums);
    s->page.warnings = warnings.s ? kmp_arena_strdup(&s->arena, warnings.s) : "";
    bool failed = warnings.failed;
    kmp_text_free(&warnings);
    KMP_TRY(kmp_print_finish(s->context, &text, &s->text));
    KMP_TRY(kmp_made(s->context, !failed));
    if (s->page.first_count == 0)
        choose_first(s, first, KMP_PAGE_FIRST / 2);
    kempe_assembly *start = NULL;
    kempe_status status = kmp_assemble_start(s->page.system, &start);
    if (status == KEMPE_OK)
        status = add_frames(s, 1, start->q, 0, NULL);
    kempe_assembly_free(start);
    return status;
}

/* Frees the table. The picture is that of the model's own values. */
static kempe_status write_instances(const kempe_model *model, kempe_table *table, kempe_status ended, const char *path)
{
    const instances shown = {&table, ended};
    kempe_system *system = NULL;
    kempe_status status = kmp_system_new(model, NULL, &system);
    if (status == KEMPE_OK)
        status = write_page(system, "ensemble", "ensemble", fill_instances, &shown, path);
    kempe_table_free(table);
    kempe_system_free(system);
    return status;
}

kempe_status kempe_ensemble_result_write_report(kempe_ensemble_result *batch, const char *path)
{
    KMP_WANTED(NULL, batch, "batch");
    KMP_WANTED(kmp_batch_model(batch)->context, path, "path");
    kempe_table *table = NULL;
    KMP_TRY(kempe_ensemble_result_table(batch, "instances", &table));
    return write_instances(kmp_batch_model(batch), table, kmp_batch_status(batch), path);
}

/* A folder whose instances have all failed is the result of a run that has failed. */
kempe_status kempe_folder_write_report(kempe_folder *folder, const kempe_model *model, const char *path)
{
    KMP_WANTED_BOTH(folder, model);
    KMP_WANTED(folder->context, path, "path");
    kempe_table *table = NULL;
    kmp_context_clear(folder->context);
    KMP_TRY(kmp_folder_check_model(folder, model));
    kempe_status status = kmp_folder_table(folder, &table);
    if (status != KEMPE_OK)
        return status == KEMPE_E_INPUT || status == KEMPE_E_IO ? KEMPE_E_FAILED : status;
    kempe_status verdict = kmp_folder_judge(folder, KEMPE_OK);
    bool failed = folder->rows.failed == folder->instances;
    status = write_instances(model, table, failed ? KEMPE_E_FAILED : verdict, path);
    return status == KEMPE_OK ? verdict : status;
}

/* -- fits -------------------------------------------------------------------------------------------- */

enum { FRAMES = 300, MOST_APART = 1000 };

/* The table's columns that the motion has, at the times of frames between its rows, unless these are close. `rows` and
 * the made table are in the units that the context shows. */
static void merge_rows(kempe_table *made, const kempe_table *rows, const kempe_table *motion)
{
    const double *t = kempe_table_values(rows, 0), *between = kempe_table_values(motion, 0);
    int count = kempe_table_row_count(rows), frames = kempe_table_row_count(motion), k = 0;
    for (int c = 0; c < kempe_table_column_count(rows); c++) {
        kmp_tabulate_column(made, kempe_table_unit(rows, c), "%s", kempe_table_column_name(rows, c));
        kmp_tabulate_look(made, kmp_table_column_look(rows, c));
    }
    for (int row = 0; row <= count; row++) {
        for (; k < frames && (row == count || between[k] <= t[row]); k++) {
            if (row < count && between[k] == t[row])
                continue;
            kmp_tabulate_row(made);
            for (int c = 0; c < kempe_table_column_count(rows); c++)
                kmp_tabulate_number(
                    made, kempe_table_number(motion, k, kempe_table_find(motion, kempe_table_column_name(rows, c))));
        }
        if (row == count)
            continue;
        kmp_tabulate_row(made);
        for (int c = 0; c < kempe_table_column_count(rows); c++)
            kmp_tabulate_number(made, kempe_table_number(rows, row, c));
    }
}

/* Rows of measurements become points of curves that go on between them. `words`: the outputs that are measured. */
static kempe_status add_curves_between(study_page *s, const kempe_trajectory *motion, const char *words)
{
    kempe_table *outputs = NULL, *made = kmp_tabulate(s->context, kempe_table_name(s->table));
    kempe_status status = kempe_trajectory_outputs(motion, words, &outputs);
    if (status == KEMPE_OK)
        merge_rows(made, s->table, outputs);
    kempe_table_free(outputs);
    if (status != KEMPE_OK) {
        kempe_table_free(made);
        return status;
    }
    kempe_table_free(s->table);
    s->table = NULL;
    return kmp_tabulate_finish(s->context, made, &s->table);
}

/* The motion of a system by its own equations; as the table too, where there is none, or between its rows where there
 * are `measured` outputs. */
static kempe_status add_motion(study_page *s, double rtol, double t_end, const char *measured)
{
    const kempe_run_options run = {
        .rtol = rtol, .t_end = t_end, .output_step = t_end / FRAMES, .no_convergence_check = 1};
    kempe_trajectory *motion = NULL;
    kempe_status status = kmp_simulate(s->page.system, &run, &motion);
    int count = kempe_trajectory_row_count(motion);
    for (int k = 0; k < count && status == KEMPE_OK; k++) {
        const double t = kempe_trajectory_time(motion, k);
        status = add_frames(s, 1, kempe_trajectory_q(motion, k), 0, &t);
    }
    if (status == KEMPE_OK && !s->table)
        status = kempe_trajectory_table(motion, "rows", &s->table);
    if (status == KEMPE_OK && measured && kempe_table_row_count(s->table) < MOST_APART)
        status = add_curves_between(s, motion, measured);
    kempe_trajectory_free(motion);
    return status;
}

static kempe_status fill_fit(study_page *s, const void *result)
{
    const kempe_fit *f = result;
    static const char *const first[] = {"q", "position", "velocity", "sensor", "", NULL};
    set_outcome(s, f->status, f->reason, f->warnings,
                f->run_count > 1
                    ? kmp_arena_printf(&s->arena, "motion of the estimates, data file 1 of %d", f->run_count)
                    : "motion of the estimates");
    s->page.answer = kmp_arena_printf(&s->arena, "%d parameter%s from %d measurements", f->count,
                                      f->count == 1 ? "" : "s", f->residuals);
    for (int k = 0; k < f->count; k++)
        add_fact(s,
                 isfinite(f->error[k])
                     ? kmp_arena_printf(&s->arena, "%s \xc2\xb1 %.2g", f->name[k], f->factor[k] * f->error[k])
                     : f->name[k],
                 "%.4g", f->value[k]);
    KMP_TRY(kempe_fit_print(f, KEMPE_TEXT, &s->text));
    KMP_TRY(kempe_fit_table(f, "first", &s->table));
    s->page.x = "t";
    const kempe_sensitivity *rows = kmp_fit_rows(f, 0);
    KMP_TRY(add_motion(s, rows->rtol, rows->t_end, f->run[0].measured.outputs));
    choose_first(s, first, KMP_PAGE_FIRST);
    return KEMPE_OK;
}

/* -- optima ------------------------------------------------------------------------------------------ */

static kempe_status fill_optimum(study_page *s, const void *result)
{
    const kempe_optimum *o = result;
    static const char *const first[] = {"q.", "position.", "state.", "sensor.", NULL};
    const kempe_run_options *run = &o->objective.run;
    set_outcome(s, o->status, o->reason, o->warnings, "motion at the optimum");
    s->page.answer = kmp_arena_printf(&s->arena, "%s of %s: %.6g %s", o->most_wanted ? "Largest value" : "Least value",
                                      o->quantity, o->at_best[0], o->objective.list->unit[0]);
    for (int k = 0; k < o->count; k++)
        add_fact(s, o->bounded.name[k], "%.4g", o->value[k]);
    KMP_TRY(kempe_optimum_print(o, KEMPE_TEXT, &s->text));
    s->page.x = "t";
    KMP_TRY(add_motion(s, run->rtol, run->t_end > 0 ? run->t_end : s->page.system->model->run.t_end, NULL));
    choose_first(s, first, KMP_PAGE_FIRST / 2);
    return KEMPE_OK;
}

kempe_status kempe_optimum_write_report(kempe_optimum *optimum, const char *path)
{
    KMP_WANTED(NULL, optimum, "optimum");
    KMP_WANTED(optimum->context, path, "path");
    kempe_system *system = NULL;
    KMP_TRY(kmp_system_of_variant(optimum->variant, &system));
    kempe_status status = write_page(system, "optimize", "optimum", fill_optimum, optimum, path);
    kempe_system_free(system);
    return status;
}

/* -- limit cycles ------------------------------------------------------------------------------------ */

/* The cycles of a branch are joined as in its picture; the rows are in their order. */
static const kmp_page_join *joins_of(study_page *s, const kempe_limit_cycles *c, int rows)
{
    kmp_page_join *joins = KMP_ARENA_NEW(&s->arena, kmp_page_join, rows);
    for (int b = 0, row = 0; joins && b < c->branches; b++)
        for (int k = 0; k < c->branch[b].count && row < rows; k++, row++)
            if (k > 0)
                joins[row] = kmp_cycles_stable_between(c->branch[b].cycle[k - 1], c->branch[b].cycle[k])
                                 ? KMP_JOIN_SOLID
                                 : KMP_JOIN_DASHED;
    return joins;
}

static kempe_status fill_limit_cycles(study_page *s, const void *result)
{
    const kempe_limit_cycles *c = result;
    static const char *const first[] = {"*.amplitude", NULL};
    int count = 0;
    for (int b = 0; b < c->branches; b++) {
        count += c->branch[b].count;
        /* The first special cycles of a branch as facts. */
        const kmp_cycle_branch *branch = &c->branch[b];
        kmp_shown as = kmp_limit_cycles_shown(c);
        for (int k = 0; k < branch->count; k++)
            if (branch->cycle[k]->word != KMP_CYCLE_REGULAR)
                add_fact(s, kmp_arena_printf(&s->arena, "%s at %s", kmp_cycle_text(branch->cycle[k]), c->name),
                         "%.6g%s%s", as.factor * branch->cycle[k]->value, as.unit[0] ? " " : "", as.unit);
    }
    set_outcome(s, c->status, c->reason, c->warnings, "limit cycles");
    s->page.answer = kmp_arena_printf(&s->arena, "%d limit cycle%s on %d branch%s", count, count == 1 ? "" : "s",
                                      c->branches, c->branches == 1 ? "" : "es");
    KMP_TRY(kempe_limit_cycles_print(c, KEMPE_TEXT, &s->text));
    KMP_TRY(kempe_limit_cycles_table(c, "rows", &s->table));
    s->page.x = c->name;
    s->page.scattered = true;
    s->page.joins = joins_of(s, c, count);
    KMP_TRY(kmp_made(c->system->context, s->page.joins));
    choose_first(s, first, KMP_PAGE_FIRST);
    return c->locus.reached > 0 ? add_frames(s, 1, c->locus.q, 0, NULL) : KEMPE_OK;
}

/* -- the assembled start ----------------------------------------------------------------------------- */

static kempe_status fill_assembly(study_page *s, const void *result)
{
    const kempe_assembly *a = result;
    set_outcome(s, a->closed ? KEMPE_OK : KEMPE_E_FAILED, NULL, NULL, "start");
    s->page.answer = a->closed ? "Assembled" : "The loops cannot be closed";
    kmp_text open = {0};
    for (int k = 0; !a->closed && k < a->culprit_count; k++) {
        kmp_text_put(&open, k ? ", " : "loops stay open: ");
        kmp_assembly_put_open(&open, a, a->culprits[k]);
    }
    s->page.reason = a->closed || a->culprit_count == 0 ? NULL : kmp_text_keep(&open, &s->arena);
    KMP_TRY(kempe_assembly_print(a, KEMPE_TEXT, &s->text));
    return add_frames(s, 1, a->q, 0, NULL);
}

/* -- simulations: the run once more with monitoring, and all its outputs --------------------------------- */

/* Rows of the page: at least so many, with the path of a journal so many, at most so many where the table has more; how
 * many times as many the run is repeated with; columns of all outputs. */
enum { FEWEST_ROWS = 1000, PATH_ROWS = 6000, MOST_ROWS = 4000, MOST_DENSER = 1000, MOST_COLUMNS = 300 };

/* A multiple of the rows of the table, so that its times are among those of the page. */
static int choose_rows(const kempe_trajectory *t)
{
    int rows = kmp_is_complete(t->status) ? t->table.rows - 1 : 0;
    bool path = kmp_contact_drawing_has_paths(t->system->model);
    int fewest = path ? PATH_ROWS : FEWEST_ROWS, most = path ? PATH_ROWS : MOST_ROWS;
    if (rows < 1)
        return fewest;
    return rows >= most ? most : rows * ((fewest + rows - 1) / rows);
}

/* The state that a run continued from, as a start; without one the model is assembled. */
static bool take_start(const kempe_trajectory *t, double *room, kempe_assembly *start)
{
    int n = t->system->n, row = 0;
    if (!(t->spec.t_start > 0))
        return false;
    while (row + 1 < t->table.rows && kmp_samples_time(&t->table, row) < t->spec.t_start)
        row++;
    memcpy(room, kmp_samples_get(&t->table, KMP_QUANTITY_Q, row), (size_t)n * sizeof *room);
    memcpy(room + n, kmp_samples_get(&t->table, KMP_QUANTITY_QD, row), (size_t)n * sizeof *room);
    *start = (kempe_assembly){.system = t->system, .q = room, .qd = room + n, .closed = true};
    return true;
}

/* One that the user interrupted goes as far as it came. */
static kempe_status record_rows(const kempe_trajectory *t, int rows, kmp_record *record)
{
    kmp_run_spec spec = t->spec;
    kempe_assembly start = {0};
    double *room = KMP_NEW(double, 2 * t->system->n);
    KMP_TRY(kmp_made(t->system->context, room));
    if (t->interrupted)
        spec.t_end = t->report.t;
    bool given = take_start(t, room, &start);
    kmp_log(t->system->context, KEMPE_LOG_PROGRESS, "report: the run is repeated");
    const bool quiet = kmp_context_quiet(t->system->context, true);
    kempe_status status = kmp_record_run(t->system, &spec, given ? &start : NULL, rows, record);
    (void)kmp_context_quiet(t->system->context, quiet);
    kmp_free(room);
    return kmp_has_result(status) ? KEMPE_OK : status;
}

/* More rows where a joint turns too far between two of them to be followed, or where the run ends early. */
static kempe_status record_run(const kempe_trajectory *t, kmp_record *record)
{
    const kempe_model *model = t->system->model;
    int rows = choose_rows(t), most = kmp_motion_picture_frames(model);
    KMP_TRY(record_rows(t, rows, record));
    const kmp_samples *row = &record->row;
    if (row->rows == 0)
        return KEMPE_OK;
    double followed = kmp_motion_picture_end(model, record);
    double last = kmp_samples_time(row, row->rows - 1);
    double span = t->spec.t_end - t->spec.t_start, lasted = last - t->spec.t_start;
    double early = row->rows < FEWEST_ROWS && lasted > 0 ? ceil(span / lasted) : 1;
    int factor = (int)fmin(fmax(early, followed > 0 ? ceil(last / followed) : 1), MOST_DENSER);
    factor = (long)factor * row->rows < most ? factor : most / row->rows;
    if (factor < 2)
        return KEMPE_OK;
    kmp_record_free(record);
    return record_rows(t, factor * rows, record);
}

static kempe_status fill_all_outputs(study_page *s)
{
    const kmp_columns *columns = &s->observed.columns;
    const kmp_samples *rows = &s->record.row;
    const kempe_model *model = s->page.system->model;
    kempe_table *table = kmp_tabulate(s->context, "outputs");
    double *values = KMP_NEW(double, columns->count);
    for (int k = 0; k < columns->count; k++)
        kmp_tabulate_column(table, columns->unit[k], "%s", columns->name[k]);
    kmp_tabulate_column(table, "J", "energy.work");
    for (int k = 0; k < kmp_model_given_inputs(model); k++)
        kmp_tabulate_column(table, model->inputs[k].unit, "input.%s", model->inputs[k].name);
    for (int row = 0; values && row < rows->rows; row++) {
        kmp_output_program_fill(&s->observed, rows, row, values);
        kmp_tabulate_row(table);
        kmp_tabulate_numbers(table, columns->count, values);
        kmp_tabulate_number(table, kmp_samples_work(rows, row));
        for (int k = 0; k < kmp_model_given_inputs(model); k++)
            kmp_tabulate_number(table, kmp_signal_value(&model->inputs[k].signal, kmp_samples_time(rows, row)) /
                                           model->inputs[k].si);
    }
    if (!values)
        kmp_tabulate_fail(table);
    kmp_free(values);
    return kmp_tabulate_finish(s->context, table, &s->table);
}

/* Of many outputs rates, accelerations and multipliers are left to the reader's choice. */
static bool is_secondary(const char *name)
{
    return strncmp(name, "qd.", 3) == 0 || strncmp(name, "qdd.", 4) == 0 || strncmp(name, "lambda.", 7) == 0;
}

static const char *answer_of(const kempe_trajectory *t, kmp_arena *arena)
{
    if (kmp_is_complete(t->status))
        return t->report.requested ? kmp_arena_printf(arena, "ended as requested at t = %.6g s", t->report.t)
                                   : kmp_arena_printf(arena, "%.6g to %.6g s", t->spec.t_start, t->spec.t_end);
    return kmp_arena_printf(arena, "at t = %.6g s", t->report.t);
}

/* The convergence check without its label. */
static const char *sentences_of(const kempe_trajectory *t, kmp_arena *arena)
{
    kmp_text text = {0};
    const char *name = t->system->n > 0 ? t->system->model->motions[t->again.index].name : NULL;
    kmp_convergence_show(&text, t->system->context, &t->again, "the state", name, kmp_trajectory_unit(t));
    const char *words = kmp_text_keep(&text, arena);
    if (!words)
        return NULL;
    size_t label = strcspn(words, " ");
    return *words ? kmp_arena_printf(arena, "Repeated%s", words + label + strspn(words + label, " ") - 1) : "";
}

static void add_number(study_page *s, const char *name, const char *format, double x)
{
    add_fact(s, name, isfinite(x) ? format : "-", x);
}

static kempe_status fill_simulation(study_page *s, const void *result)
{
    const kempe_trajectory *t = result;
    const kempe_system *system = t->system;
    KMP_TRY(kmp_vehicle_comfort(t, &s->comfort));
    KMP_TRY(record_run(t, &s->record));
    KMP_TRY(kmp_output_program_init(&s->observed, system, NULL, MOST_COLUMNS, NULL));
    KMP_TRY(fill_all_outputs(s));
    /* The outputs that the model requests, as far as they are few. */
    KMP_TRY(kmp_made(s->context, kmp_columns_init(&s->own, system, system->model, NULL)));
    const bool few = s->own.count - 1 <= KMP_PAGE_FIRST;
    const int most = few ? KMP_PAGE_FIRST : KMP_PAGE_FIRST / 2;
    for (int k = 1; k < s->own.count && s->page.first_count < most; k++)
        if (few || !is_secondary(s->own.name[k]))
            s->first[s->page.first_count++] = s->own.name[k];
    for (int k = 1; k < s->own.count && s->page.first_count == 0; k++)
        s->first[s->page.first_count++] = s->own.name[k];
    if (s->record.row.rows == 0)
        KMP_TRY(kmp_record_start(system, &s->start));
    kmp_context_clear(s->context); /* a run that fails has failed again */
    KMP_TRY(kempe_trajectory_print(t, KEMPE_TEXT, &s->text));
    set_outcome(s, t->status, t->reason, t->warnings,
                kmp_arena_printf(&s->arena, "%s%s%s %s, rtol %g", t->spec.formulation, t->spec.form ? " " : "",
                                 t->spec.form ? t->spec.form : "", t->integrator, t->spec.rtol));
    s->page.answer = answer_of(t, &s->arena);
    s->page.outcome = kempe_trajectory_outcome(t);
    s->page.locked = !kmp_is_complete(t->status) && !t->interrupted;
    s->page.sentences = sentences_of(t, &s->arena);
    s->page.x = "t";
    s->page.left_out = s->observed.left_out;
    s->page.frames = s->record.row.rows > 0 ? &s->record.row : &s->start.row;
    s->page.record = &s->record;
    s->page.comfort = s->comfort;
    s->page.contacts = t;
    add_number(s, "energy balance", "%.1e", t->verdict.drift_rel);
    add_number(s, "closure residual", "%.1e", t->verdict.h_max);
    add_number(s, t->again.known ? "repeated run differs by" : "steps", t->again.known ? "%.1e" : "%.0f",
               t->again.known ? t->again.difference : (double)t->report.steps);
    return KEMPE_OK;
}

/* -- the reports ------------------------------------------------------------------------------------- */

/* A row for each result that has its system: the type, the name of its pointer, context and system, the words of the
 * command and of the title, what fills the page. */
#define PAGE(type, result, context, system, command, subject, fill)                                                    \
    kempe_status type##_write_report(type *result, const char *path)                                                   \
    {                                                                                                                  \
        KMP_WANTED(NULL, result, #result);                                                                             \
        KMP_WANTED(context, path, "path");                                                                             \
        return write_page(system, command, subject, fill, result, path);                                               \
    }

PAGE(kempe_kinematics, kinematics, kinematics->system->context, kinematics->system, "kinematics", "position analysis",
     fill_kinematics)
PAGE(kempe_inverse, inverse, inverse->system->context, inverse->system, "inverse", "inverse dynamics", fill_inverse)
PAGE(kempe_response, response, response->channels.given->context, response->channels.given, "response",
     "frequency response", fill_response)
PAGE(kempe_equilibrium, equilibrium, equilibrium->requested->context, equilibrium->system, "equilibrium", "equilibrium",
     fill_equilibria)
PAGE(kempe_fit, fit, fit->context, kmp_fit_rows(fit, 0)->system, "fit", "fit", fill_fit)
PAGE(kempe_limit_cycles, cycles, cycles->system->context, cycles->system, "cycles", "limit cycles", fill_limit_cycles)
PAGE(kempe_trajectory, trajectory, trajectory->system->context, trajectory->system, "simulate", "simulation",
     fill_simulation)
PAGE(kempe_assembly, assembly, assembly->system->context, assembly->system, "assemble", "assembly", fill_assembly)
