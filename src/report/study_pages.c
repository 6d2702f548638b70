/* SPDX-License-Identifier: BSD-3-Clause */
/* The pages of all results: a function for each kind says what its page has, and a row of the table below is it. */
#include "analyses/equilibrium/balances.h"
#include "analyses/inverse/inverse_study.h"
#include "analyses/kinematics/position_sweep.h"
#include "analyses/limit_cycles/cycle_branch.h"
#include "analyses/limit_cycles/limit_cycles_study.h"
#include "analyses/modes/modes_study.h"
#include "analyses/response/response_study.h"
#include "base/memory.h"
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
#include "model/data/output_table.h"
#include "model/data/signal.h"
#include "model/language/dimension.h"
#include "output/print.h"
#include "output/result_table.h"
#include "picture/motion_picture.h"
#include "pipeline.h"
#include "report/comparison_page.h"
#include "report/modes_page.h"
#include "report/result_page.h"
#include "report/vehicle_drawing.h"
#include "studies/simulate/observed.h"
#include "studies/simulate/reaction_watch.h"
#include <kempe/check.h>
#include <math.h>
#include <stdbool.h>
#include <string.h>

/* -- parts of pages ---------------------------------------------------------------------------------- */

/* As far as there is room. */
static void add_fact(kmp_result_page *page, const char *name, const char *format, ...)
{
    kmp_text value = {0};
    KMP_TEXT_ARGUMENTS(&value, format);
    const char *kept = kmp_text_keep(&value, &page->arena);
    if (page->head.fact_count < KMP_PAGE_FACTS)
        page->head.fact[page->head.fact_count++] = (kmp_page_fact){.name = name, .value = kept};
}

/* Columns that are drawn at first: up to `most` whose names begin with one of the words, or after '*' end with it. */
static void choose_first(kmp_result_page *page, const char *words, int most)
{
    for (size_t length; (length = strcspn(words, " ")) > 0; words += length + strspn(words + length, " "))
        for (int c = 0; c < kempe_table_column_count(page->curves.table) && page->curves.first_count < most; c++) {
            const char *name = kempe_table_column_name(page->curves.table, c);
            size_t rest = strlen(name);
            bool begins = strncmp(name, words, length) == 0, ends = *words == '*' && rest + 1 >= length;
            ends = ends && strncmp(name + rest + 1 - length, words + 1, length - 1) == 0;
            if ((begins || ends) && kempe_table_values(page->curves.table, c) && !kmp_page_is_first(&page->curves, c))
                page->curves.first[page->curves.first_count++] = name;
        }
}

/* -- position analysis ------------------------------------------------------------------------------- */

static kempe_status fill_kinematics(kmp_result_page *page, const void *result)
{
    const kempe_kinematics *k = result;
    kmp_page_set_outcome(page, kmp_outcome_of(k->status), k->reason, k->warnings, "position analysis");
    page->head.answer = kmp_arena_printf(&page->arena, "%d positions, %d dead centre%s", k->count, k->dead_count,
                                         k->dead_count == 1 ? "" : "s");
    KMP_TRY(kempe_kinematics_print(k, KEMPE_TEXT, &page->head.text));
    KMP_TRY(kempe_kinematics_table(k, "rows", &page->curves.table));
    /* A column of the swept value if it ascends all along, otherwise s, which always does. */
    const char *swept =
        k->time >= 0 ? "t" : kmp_arena_printf(&page->arena, "q.%s", kmp_kinematics_name(k, &k->parameter[k->first]));
    int column = swept ? kempe_table_find(page->curves.table, swept) : -1;
    const double *x = column >= 0 ? kempe_table_values(page->curves.table, column) : NULL;
    page->curves.x = x ? swept : "s";
    for (int row = 1; x && row < k->count; row++)
        if (!(x[row] > x[row - 1]))
            page->curves.x = "s";
    page->picture.x = kempe_table_values(page->curves.table, kempe_table_find(page->curves.table, page->curves.x));
    choose_first(page, "q. position. sensor. energy.", KMP_PAGE_FIRST / 2);
    return kmp_page_add_frames(page, k->count, k->q, k->system->n, NULL);
}

/* -- inverse dynamics -------------------------------------------------------------------------------- */

/* The largest size among the columns whose names begin with a word, with its unit and the rest of its name. */
static void add_peak(kmp_result_page *page, const char *fact, const char *word)
{
    size_t length = strlen(word);
    int best = -1;
    double most = -1;
    for (int c = 0; c < kempe_table_column_count(page->curves.table); c++)
        for (int row = 0; row < kempe_table_row_count(page->curves.table); row++) {
            double x = fabs(kempe_table_number(page->curves.table, row, c));
            if (strncmp(kempe_table_column_name(page->curves.table, c), word, length) == 0 && x > most) {
                most = x;
                best = c;
            }
        }
    if (best < 0)
        return;
    const char *name = kempe_table_column_name(page->curves.table, best) + length;
    add_fact(page, kmp_arena_printf(&page->arena, "%s, %s", fact, name), "%.4g %s", most,
             kempe_table_unit(page->curves.table, best));
}

static kempe_status fill_inverse(kmp_result_page *page, const void *result)
{
    const kempe_inverse *r = result;
    kmp_page_set_outcome(page, kempe_inverse_outcome(r), r->reason, r->warnings, "inverse dynamics");
    page->head.answer = kmp_is_complete(r->status)
                            ? kmp_arena_printf(&page->arena, "Forces of %d actuator%s at %d instants",
                                               r->actuators.count, r->actuators.count == 1 ? "" : "s", r->rows)
                            : kmp_arena_printf(&page->arena, "Stopped after %d instants", r->rows);
    KMP_TRY(kempe_inverse_print(r, KEMPE_TEXT, &page->head.text));
    KMP_TRY(kempe_inverse_table(r, "rows", &page->curves.table));
    KMP_TRY(kempe_inverse_table(r, "reactions", &page->loads.reactions));
    KMP_TRY(kmp_picture_forces_of_inverse(&page->picture.arrows, r));
    page->curves.x = "t";
    add_peak(page, "largest force or torque", "tau.");
    add_peak(page, "largest power", "power.");
    choose_first(page, "tau. power.", KMP_PAGE_FIRST);
    return r->rows > 0 ? kmp_page_add_frames(page, r->rows, kmp_inverse_part(r, 0, r->at.q), r->width, r->t) : KEMPE_OK;
}

/* -- frequency response ------------------------------------------------------------------------------ */

static kempe_status fill_response(kmp_result_page *page, const void *result)
{
    const kempe_response *r = result;
    kmp_page_set_outcome(page, kmp_outcome_of(r->channels.status), NULL, r->channels.warnings,
                         r->channels.at->equilibrium ? "at the equilibrium" : "at the start");
    page->head.answer = kmp_arena_printf(&page->arena, "%d resonance%s among %d frequencies", r->frequency.peak_count,
                                         r->frequency.peak_count == 1 ? "" : "s", r->frequency.count);
    KMP_TRY(kempe_response_print(r, KEMPE_TEXT, &page->head.text));
    KMP_TRY(kempe_response_table(r, "rows", &page->curves.table));
    page->curves.x = "frequency";
    page->curves.logarithmic = !r->linear;
    choose_first(page, "*.amplitude *.phase", KMP_PAGE_FIRST);
    return kmp_page_add_frames(page, 1, r->channels.at->q, 0, NULL);
}

/* -- equilibria -------------------------------------------------------------------------------------- */

static kempe_status fill_equilibria(kmp_result_page *page, const void *result)
{
    const kempe_equilibrium *e = result;
    const char *stability = e->count > 0 ? kempe_equilibrium_stability(e, 0) : "none found";
    kmp_page_set_outcome(page, kmp_outcome_of(e->status), NULL, e->warnings,
                         e->rate_count > 0 ? "steady motion" : "static equilibrium");
    page->head.answer = e->count == 1
                            ? kmp_arena_printf(&page->arena, "One equilibrium: %s", stability)
                            : kmp_arena_printf(&page->arena, "%d equilibria, the first %s", e->count, stability);
    KMP_TRY(kempe_equilibrium_print(e, KEMPE_TEXT, &page->head.text));
    KMP_TRY(kempe_equilibrium_table(e, "equilibria", &page->curves.table));
    KMP_TRY(kempe_equilibrium_table(e, "reactions", &page->loads.reactions));
    KMP_TRY(kmp_picture_forces_of_equilibria(&page->picture.arrows, e));
    page->picture.separate = true;
    for (int k = 0; k < e->count; k++)
        KMP_TRY(kmp_page_add_frames(page, 1, e->balance[k].q, 0, (double[]){k + 1}));
    return KEMPE_OK;
}

/* -- ensembles --------------------------------------------------------------------------------------- */

/* The instances in the table of the page, of a model whose own values the picture has. `marked`: the warnings of their
 * run; NULL: the warnings of the table. */
static kempe_status fill_instances(kmp_result_page *page, const kempe_model *model, kempe_outcome outcome,
                                   const char *marked)
{
    const kmp_instance_sums sums = kmp_instances_sum(page->curves.table, 0);
    KMP_TRY(kmp_system_new(model, NULL, &page->own));
    KMP_TRY(kmp_page_take(page, page->own));
    kmp_page_set_outcome(page, outcome, NULL, NULL, "ensemble");
    page->head.answer = kmp_arena_printf(&page->arena, "%ld of %ld instances reached the end", sums.ok, sums.count);
    page->curves.x =
        kempe_table_find(page->curves.table, "status") > 0 ? kempe_table_column_name(page->curves.table, 0) : "";
    page->curves.scattered = true;
    /* Quantities are drawn in place of the states, with their statistics. */
    double part, low, high;
    if (kmp_statistics_has_quantities(page->curves.table) && kmp_outcome_is_complete(page->head.outcome)) {
        KMP_TRY(kempe_statistics_new(page->curves.table, 0, &page->statistics));
        for (int c = 0;
             c < kempe_table_column_count(page->curves.table) && page->curves.first_count < KMP_PAGE_FIRST / 2; c++)
            if (kmp_statistics_is_quantity(page->curves.table, c))
                page->curves.first[page->curves.first_count++] = kempe_table_column_name(page->curves.table, c);
        const bool limited = kmp_statistics_yield(page->statistics, &part, &low, &high);
        if (limited && isnan(low))
            add_fact(page, "within the limits", "%.4g %%", 100 * part);
        else if (limited)
            add_fact(page, "within the limits", "%.4g %% (%.4g to %.4g %%)", 100 * part, 100 * low, 100 * high);
    }
    kmp_text text = {0}, warnings = {0};
    kmp_instances_put(&text, model->name, page->curves.table, page->statistics,
                      page->head.outcome == KEMPE_OUTCOME_NOT_TRUSTWORTHY);
    if (marked)
        kmp_text_put(&warnings, marked);
    else
        kmp_instances_put_warnings(&warnings, &sums);
    page->head.warnings = kmp_text_keep(&warnings, &page->arena);
    KMP_TRY(kmp_print_finish(page->context, &text, &page->head.text));
    if (page->curves.first_count == 0)
        choose_first(page, "q.", KMP_PAGE_FIRST / 2);
    kempe_assembly *start = NULL;
    const bool quiet = kmp_context_quiet(page->context, true);
    kempe_status status = kmp_assembly_at_start(page->system, &start);
    (void)kmp_context_quiet(page->context, quiet);
    if (status == KEMPE_E_FAILED &&
        start) { /* instances may have the start that the model itself lacks: as far as it is */
        kmp_context_clear(page->context);
        status = KEMPE_OK;
    }
    if (status == KEMPE_OK)
        status = kmp_page_add_frames(page, 1, start->q, 0, NULL);
    kempe_assembly_free(start);
    return status;
}

static kempe_status fill_batch(kmp_result_page *page, const void *result)
{
    KMP_TRY(kempe_ensemble_result_table(result, "instances", &page->curves.table));
    return fill_instances(page, kmp_batch_model(result), kmp_outcome_of(kmp_batch_status(result)),
                          kmp_batch_warnings(result));
}

/* A folder and the model of its run. */
typedef struct gathered {
    kempe_folder *folder;
    const kempe_model *model;
} gathered;

/* A folder whose instances have all failed is the result of a run that has failed. */
static kempe_status fill_gathered(kmp_result_page *page, const void *result)
{
    const gathered *g = result;
    KMP_TRY(kmp_folder_check_model(g->folder, g->model));
    kempe_status status = kmp_folder_table(g->folder, &page->curves.table);
    if (status != KEMPE_OK)
        return status == KEMPE_E_INPUT || status == KEMPE_E_IO ? KEMPE_E_FAILED : status;
    page->verdict = kmp_folder_judge(g->folder, KEMPE_OK);
    const bool none = g->folder->rows.failed == g->folder->instances;
    return fill_instances(page, g->model, kmp_outcome_of(none ? KEMPE_E_FAILED : page->verdict), NULL);
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

/* Rows of measurements become points of curves that continue between them. `words`: the outputs that are measured. */
static kempe_status add_curves_between(kmp_result_page *page, const kempe_trajectory *motion, const char *words)
{
    kempe_table *outputs = NULL, *made = kmp_tabulate(page->context, kempe_table_name(page->curves.table));
    kempe_status status = kempe_trajectory_outputs(motion, words, &outputs);
    if (status == KEMPE_OK)
        merge_rows(made, page->curves.table, outputs);
    kempe_table_free(outputs);
    if (status != KEMPE_OK) {
        kempe_table_free(made);
        return status;
    }
    kempe_table_free(page->curves.table);
    page->curves.table = NULL;
    return kmp_tabulate_finish(page->context, made, &page->curves.table);
}

/* The motion of a system by its own equations; as the table too, where there is none, or between its rows where there
 * are `measured` outputs. */
static kempe_status add_motion(kmp_result_page *page, double rtol, double t_end, const char *measured)
{
    const kempe_run_options run = {
        .rtol = rtol, .t_end = t_end, .output_step = t_end / FRAMES, .no_convergence_check = 1};
    kempe_trajectory *motion = NULL;
    kempe_status status = kmp_simulate(page->system, &run, &motion);
    int count = kempe_trajectory_row_count(motion);
    for (int k = 0; k < count && status == KEMPE_OK; k++) {
        const double t = kempe_trajectory_time(motion, k);
        status = kmp_page_add_frames(page, 1, kempe_trajectory_q(motion, k), 0, &t);
    }
    if (status == KEMPE_OK && !page->curves.table)
        status = kempe_trajectory_table(motion, "rows", &page->curves.table);
    if (status == KEMPE_OK && measured && kempe_table_row_count(page->curves.table) < MOST_APART)
        status = add_curves_between(page, motion, measured);
    kempe_trajectory_free(motion);
    return status;
}

static kempe_status fill_fit(kmp_result_page *page, const void *result)
{
    const kempe_fit *f = result;
    kmp_page_set_outcome(
        page, kmp_outcome_of(f->status), f->reason, f->warnings,
        f->run_count > 1 ? kmp_arena_printf(&page->arena, "motion of the estimates, data file 1 of %d", f->run_count)
                         : "motion of the estimates");
    page->head.answer = kmp_arena_printf(&page->arena, "%d parameter%s from %d measurements", f->count,
                                         f->count == 1 ? "" : "s", f->residuals);
    for (int k = 0; k < f->count; k++) {
        const kmp_shown as = kmp_shown_of(page->system, f->name[k]);
        add_fact(page,
                 isfinite(f->error[k]) ? kmp_arena_printf(&page->arena, "%s \xc2\xb1 %.2g", f->name[k],
                                                          as.factor * f->factor[k] * f->error[k])
                                       : f->name[k],
                 "%.4g%s%s", as.factor * f->value[k], *as.unit ? " " : "", as.unit);
    }
    KMP_TRY(kempe_fit_print(f, KEMPE_TEXT, &page->head.text));
    KMP_TRY(kempe_fit_table(f, "first", &page->curves.table));
    page->curves.x = "t";
    const kempe_sensitivity *rows = kmp_fit_rows(f, 0);
    KMP_TRY(add_motion(page, rows->rtol, rows->t_end, f->run[0].measured.outputs));
    choose_first(page, "q position velocity sensor *", KMP_PAGE_FIRST);
    return KEMPE_OK;
}

/* -- optima ------------------------------------------------------------------------------------------ */

static kempe_status fill_optimum(kmp_result_page *page, const void *result)
{
    const kempe_optimum *o = result;
    const kempe_run_options *run = &o->objective.run;
    KMP_TRY(kmp_system_of_variant(o->variant, &page->own));
    KMP_TRY(kmp_page_take(page, page->own));
    kmp_page_set_outcome(page, kmp_outcome_of(o->status), o->reason, o->warnings, "motion at the optimum");
    const kmp_shown as = kmp_shown_as(page->context, kmp_print_unknown(page->context, o->objective.list->unit[0]));
    page->head.answer = kmp_arena_printf(&page->arena, "%s of %s = %.6g %s", o->most_wanted ? "maximum" : "minimum",
                                         o->quantity, as.factor * o->at_best[0], as.unit);
    for (int k = 0; k < o->count; k++) {
        const kmp_shown value = kmp_shown_of(page->system, o->bounded.name[k]);
        add_fact(page, o->bounded.name[k], "%.4g%s%s", value.factor * o->value[k], *value.unit ? " " : "", value.unit);
    }
    KMP_TRY(kempe_optimum_print(o, KEMPE_TEXT, &page->head.text));
    page->curves.x = "t";
    KMP_TRY(add_motion(page, run->rtol, run->t_end > 0 ? run->t_end : page->system->model->run.t_end, NULL));
    choose_first(page, "q. position. state. sensor.", KMP_PAGE_FIRST / 2);
    return KEMPE_OK;
}

/* -- limit cycles ------------------------------------------------------------------------------------ */

/* The cycles of a branch are joined as in its picture; the rows are in their order. */
static const kmp_page_join *joins_of(kmp_result_page *page, const kempe_limit_cycles *c, int rows)
{
    kmp_page_join *joins = KMP_ARENA_NEW(&page->arena, kmp_page_join, rows);
    for (int b = 0, row = 0; joins && b < c->branches; b++)
        for (int k = 0; k < c->branch[b].count && row < rows; k++, row++)
            if (k > 0)
                joins[row] = kmp_cycles_stable_between(c->branch[b].cycle[k - 1], c->branch[b].cycle[k])
                                 ? KMP_JOIN_SOLID
                                 : KMP_JOIN_DASHED;
    return joins;
}

static kempe_status fill_limit_cycles(kmp_result_page *page, const void *result)
{
    const kempe_limit_cycles *c = result;
    int count = 0;
    for (int b = 0; b < c->branches; b++) {
        count += c->branch[b].count;
        /* The first special cycles of a branch as facts. */
        const kmp_cycle_branch *branch = &c->branch[b];
        kmp_shown as = kmp_limit_cycles_shown(c);
        for (int k = 0; k < branch->count; k++)
            if (branch->cycle[k]->word != KMP_CYCLE_REGULAR)
                add_fact(page, kmp_arena_printf(&page->arena, "%s at %s", kmp_cycle_text(branch->cycle[k]), c->name),
                         "%.6g%s%s", as.factor * branch->cycle[k]->value, as.unit[0] ? " " : "", as.unit);
    }
    kmp_page_set_outcome(page, kmp_outcome_of(c->status), c->reason, c->warnings, "limit cycles");
    page->head.answer = kmp_arena_printf(&page->arena, "%d limit cycle%s on %d branch%s", count, count == 1 ? "" : "s",
                                         c->branches, c->branches == 1 ? "" : "es");
    KMP_TRY(kempe_limit_cycles_print(c, KEMPE_TEXT, &page->head.text));
    KMP_TRY(kempe_limit_cycles_table(c, "rows", &page->curves.table));
    page->curves.x = c->name;
    page->curves.scattered = true;
    page->curves.joins = joins_of(page, c, count);
    KMP_TRY(kmp_made(c->system->context, page->curves.joins));
    choose_first(page, "*.amplitude", KMP_PAGE_FIRST);
    return c->locus.reached > 0 ? kmp_page_add_frames(page, 1, c->locus.q, 0, NULL) : KEMPE_OK;
}

/* -- the assembled start ----------------------------------------------------------------------------- */

static kempe_status fill_assembly(kmp_result_page *page, const void *result)
{
    const kempe_assembly *a = result;
    kmp_page_set_outcome(page, a->closed ? KEMPE_OUTCOME_COMPLETE : KEMPE_OUTCOME_FAILED, NULL, NULL, "start");
    page->head.answer = a->closed ? "Assembled" : "The loops cannot be closed";
    kmp_text open = {0};
    for (int k = 0; !a->closed && k < a->culprit_count; k++) {
        kmp_text_put(&open, k ? ", " : "loops stay open: ");
        kmp_assembly_put_open(&open, a, a->culprits[k]);
    }
    page->head.reason = a->closed || a->culprit_count == 0 ? NULL : kmp_text_keep(&open, &page->arena);
    KMP_TRY(kempe_assembly_print(a, KEMPE_TEXT, &page->head.text));
    return kmp_page_add_frames(page, 1, a->q, 0, NULL);
}

/* -- simulations: the run once more with monitoring, and all its outputs --------------------------------- */

/* Rows of the page: the least number, the number with the path of a journal, the most where the table has more;
 * the multiple with which the run is repeated; columns of all outputs. */
enum { FEWEST_ROWS = 1000, PATH_ROWS = 6000, MOST_ROWS = 4000, MOST_DENSER = 1000, MOST_COLUMNS = 300 };

/* A multiple of the rows of the table, so that its times are among the times of the page. */
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
    double followed = kmp_motion_picture_end(model, row);
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

/* All outputs at the rows of the record. */
static kempe_status tabulate_outputs(kmp_result_page *page, kmp_output_program *observed)
{
    const kmp_columns *columns = &observed->columns;
    const kmp_samples *rows = &page->motion.records->row;
    const kempe_model *model = page->system->model;
    kempe_table *table = kmp_tabulate(page->context, "outputs");
    double *values = KMP_NEW(double, columns->count);
    for (int k = 0; k < columns->count; k++)
        kmp_tabulate_column(table, kmp_print_unknown(page->context, columns->unit[k]), "%s", columns->name[k]);
    kmp_tabulate_column(table, "J", "energy.work");
    for (int k = 0; k < kmp_model_given_inputs(model); k++)
        kmp_tabulate_column(table, model->inputs[k].unit, "input.%s", model->inputs[k].name);
    for (int row = 0; values && row < rows->rows; row++) {
        kmp_output_program_fill(observed, rows, row, values);
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
    return kmp_tabulate_finish(page->context, table, &page->curves.table);
}

static kempe_status add_outputs(kmp_result_page *page)
{
    kmp_output_program observed = {0};
    kempe_status status = kmp_output_program_init(&observed, page->system, NULL, MOST_COLUMNS, NULL);
    page->curves.left_out = observed.left_out;
    if (status == KEMPE_OK)
        status = tabulate_outputs(page, &observed);
    kmp_output_program_free(&observed);
    return status;
}

/* Of many outputs rates, accelerations and multipliers are left to the reader's choice. */
static bool is_secondary(const char *name)
{
    return strncmp(name, "qd.", 3) == 0 || strncmp(name, "qdd.", 4) == 0 || strncmp(name, "lambda.", 7) == 0;
}

/* True for a column of an output that the model requests by name, as a number or a vector: not of all of a kind. */
static bool is_named(const kempe_model *model, const kmp_column *column)
{
    const kmp_output *output = &model->outputs[column->output];
    return output->index >= 0 && kmp_output_width(model, output) <= 3;
}

/* The outputs that the model requests, as far as they are few. Of many, named ones come before all of a kind. */
static kempe_status choose_requested(kmp_result_page *page)
{
    const kempe_model *model = page->system->model;
    kmp_columns own = {0};
    bool made = kmp_columns_init(&own, page->system, model, NULL);
    const bool few = own.count - 1 <= KMP_PAGE_FIRST;
    bool *taken = KMP_ARENA_NEW(&page->arena, bool, own.count + 1);
    made = made && taken;
    page->curves.requested = own.count - 1;
    for (int pass = few; made && pass < 2; pass++)
        for (int k = 1; k < own.count && page->curves.first_count < KMP_PAGE_FIRST / (2 - pass); k++)
            if (!taken[k] && (few || (pass == 0 ? is_named(model, &own.of[k]) : !is_secondary(own.name[k])))) {
                taken[k] = true;
                page->curves.first[page->curves.first_count++] = kmp_arena_strdup(&page->arena, own.name[k]);
            }
    if (made && own.count > 1 && page->curves.first_count == 0)
        page->curves.first[page->curves.first_count++] = kmp_arena_strdup(&page->arena, own.name[1]);
    kmp_columns_free(&own);
    return kmp_made(page->context, made);
}

/* The last fact has a limit. */
static void limit_fact(kmp_result_page *page, bool beyond, const char *format, ...)
{
    kmp_text limit = {0};
    KMP_TEXT_ARGUMENTS(&limit, format);
    page->head.fact[page->head.fact_count - 1].limit = kmp_text_keep(&limit, &page->arena);
    page->head.fact[page->head.fact_count - 1].beyond = beyond;
}

/* The difference of the second run in the coordinate where it is seen most, and what is seen there. */
static void add_estimated_error(kmp_result_page *page, const kempe_trajectory *t)
{
    const kmp_convergence *again = &t->again;
    const char *unit = kmp_trajectory_unit(t);
    const bool beyond = !kmp_convergence_holds(again), named = t->system->n > 0 && again->difference > 0;
    const char *name = named ? kmp_arena_printf(&page->arena, "estimated error, %s at t = %.4g s",
                                                t->system->model->motions[again->index].name, again->t)
                             : "estimated error";
    if (again->parts > 0) {
        add_fact(page, "estimated error, relative, of all steps", "%.2g", again->total);
        limit_fact(page, beyond, "%.2g", again->limit);
        return;
    }
    if (!again->known || !unit) {
        add_fact(page, name, again->known ? "%.2g" : "not checked", again->difference);
        if (again->known)
            limit_fact(page, beyond, "%.2g", again->limit);
        return;
    }
    const kmp_shown as = kmp_shown_as(t->system->context, unit);
    add_fact(page, name, "%.2g %s", as.factor * again->apart, as.unit);
    if (again->seen > 0)
        limit_fact(page, beyond, "%.2g %s", as.factor * again->apart / again->seen, as.unit);
}

static void add_accuracy(kmp_result_page *page, const kempe_trajectory *t)
{
    const kmp_verdict *verdict = &t->verdict;
    const double gap = kmp_trajectory_trusted_gap(t);
    add_estimated_error(page, t);
    if (isfinite(verdict->drift_rel)) {
        const bool lost = kmp_trajectory_loses_energy(t);
        add_fact(page, "energy error", "%.2g %%", 100 * verdict->drift_rel);
        if (lost ? !t->report.prescribed : verdict->drift_rel <= KMP_VISIBLE)
            limit_fact(page, lost, "%g %%", 100 * KMP_VISIBLE);
    }
    if (t->system->m > 0 && isfinite(verdict->h_max)) {
        const kmp_shown as = kmp_shown_as(t->system->context, "m");
        const double metres = as.factor * t->system->length;
        add_fact(page, "loop gap", "%.2g %s", metres * verdict->h_max, as.unit);
        limit_fact(page, verdict->h_max > gap, "%.2g %s", metres * gap, as.unit);
    }
}

static kempe_status fill_simulation(kmp_result_page *page, const void *result)
{
    const kempe_trajectory *t = result;
    page->motion.run = t;
    page->motion.records = KMP_ARENA_NEW(&page->arena, kmp_record, 1);
    KMP_TRY(kmp_made(page->context, page->motion.records));
    page->motion.record_count = 1;
    KMP_TRY(kmp_vehicle_comfort(t, &page->motion.comfort));
    KMP_TRY(record_run(t, page->motion.records));
    KMP_TRY(add_outputs(page));
    KMP_TRY(choose_requested(page));
    page->picture.frames = &page->motion.records->row;
    if (page->picture.frames->rows == 0) {
        KMP_TRY(kmp_record_start(t->system, &page->picture.start));
        page->picture.frames = &page->picture.start.row;
    }
    kmp_context_clear(page->context); /* a run that fails has failed again */
    KMP_TRY(kempe_trajectory_print(t, KEMPE_TEXT, &page->head.text));
    KMP_TRY(kempe_trajectory_table(t, "reactions", &page->loads.reactions));
    KMP_TRY(kempe_trajectory_table(t, "bearings", &page->loads.bearings));
    if (t->watch) {
        page->loads.peaks[0] = kmp_reaction_watch_found(t->watch)->from;
        page->loads.peaks[1] = kmp_reaction_watch_found(t->watch)->until;
    }
    kmp_page_set_outcome(page, kempe_trajectory_outcome(t), t->reason, t->warnings,
                         kmp_arena_printf(&page->arena, "%s%s%s %s, rtol %g", t->spec.formulation,
                                          t->spec.form ? " " : "", t->spec.form ? t->spec.form : "", t->integrator,
                                          t->spec.rtol));
    if (!kmp_is_complete(t->status))
        page->head.answer = kmp_arena_printf(&page->arena, "at t = %.6g s", t->report.t);
    else if (t->report.requested)
        page->head.answer = kmp_arena_printf(&page->arena, "ended as requested at t = %.6g s", t->report.t);
    else
        page->head.answer = kmp_arena_printf(&page->arena, "%.6g to %.6g s", t->spec.t_start, t->spec.t_end);
    page->curves.locked = !kmp_is_complete(t->status) && !t->interrupted;
    KMP_TRY(kmp_picture_forces_of_run(&page->picture.arrows, t->system, &page->motion.records->row, t->least_norm,
                                      page->curves.locked));
    page->curves.x = "t";
    add_accuracy(page, t);
    return KEMPE_OK;
}

/* A run and a table of an earlier one. */
typedef struct beside {
    const kempe_trajectory *run;
    const kempe_table *earlier;
    double own[2], other[2]; /* their first and last times, s */
} beside;

/* A sentence about two runs with different times; NULL: they are the same, but for the rounding of a file. */
static char *words_of_ranges(const beside *both, kmp_arena *arena)
{
    const double *own = both->own, *other = both->other, near = 1e-6 * (own[1] - own[0]);
    if (fabs(own[0] - other[0]) <= near && fabs(own[1] - other[1]) <= near)
        return NULL;
    return kmp_arena_printf(arena,
                            "'%s' has times from %.6g to %.6g s, this run from %.6g to %.6g s: its dotted curves are "
                            "drawn from %.6g to %.6g s",
                            kempe_table_name(both->earlier), other[0], other[1], own[0], own[1], fmax(own[0], other[0]),
                            fmin(own[1], other[1]));
}

static kempe_status fill_beside(kmp_result_page *page, const void *result)
{
    const beside *both = result;
    page->curves.earlier = both->earlier;
    KMP_TRY(fill_simulation(page, both->run));
    const char *marked = words_of_ranges(both, &page->arena), *others = page->head.warnings ? page->head.warnings : "";
    if (marked) {
        kmp_log(page->context, KEMPE_LOG_WARNING, "%s", marked);
        page->head.warnings = kmp_arena_printf(&page->arena, "%s%s%s", marked, *others ? "\n" : "", others);
    }
    return KEMPE_OK;
}

/* -- the table --------------------------------------------------------------------------------------- */

/* A row for each page: the type of the result and the name of its pointer; its context, and its system, NULL where the
 * page makes one; the words of the command and of the title, the view, what fills it. */
#define PAGE(type, result, context, system, ...)                                                                       \
    kempe_status type##_write_report(const type *result, const char *path)                                             \
    {                                                                                                                  \
        static const kmp_page_kind kind = {__VA_ARGS__};                                                               \
        KMP_WANTED(NULL, result, #result);                                                                             \
        return kmp_page_write(&kind, context, system, result, path);                                                   \
    }

PAGE(kempe_assembly, assembly, assembly->system->context, assembly->system, "assemble", "assembly", &kmp_result_view,
     fill_assembly)
PAGE(kempe_trajectory, trajectory, trajectory->system->context, trajectory->system, "simulate", "simulation",
     &kmp_result_view, fill_simulation)
PAGE(kempe_kinematics, kinematics, kinematics->system->context, kinematics->system, "kinematics", "position analysis",
     &kmp_result_view, fill_kinematics)
PAGE(kempe_inverse, inverse, inverse->system->context, inverse->system, "inverse", "inverse dynamics", &kmp_result_view,
     fill_inverse)
PAGE(kempe_equilibrium, equilibrium, equilibrium->requested->context, equilibrium->system, "equilibrium", "equilibrium",
     &kmp_result_view, fill_equilibria)
PAGE(kempe_response, response, response->channels.given->context, response->channels.given, "response",
     "frequency response", &kmp_result_view, fill_response)
PAGE(kempe_limit_cycles, cycles, cycles->system->context, cycles->system, "cycles", "limit cycles", &kmp_result_view,
     fill_limit_cycles)
PAGE(kempe_fit, fit, fit->context, kmp_fit_rows(fit, 0)->system, "fit", "fit", &kmp_result_view, fill_fit)
PAGE(kempe_optimum, optimum, optimum->context, NULL, "optimize", "optimum", &kmp_result_view, fill_optimum)
PAGE(kempe_ensemble_result, batch, kmp_batch_model(batch)->context, NULL, "ensemble", "ensemble", &kmp_result_view,
     fill_batch)
PAGE(kempe_modes, modes, modes->system->context, modes->system, "modes", "modes", &kmp_modes_view, kmp_modes_fill)
PAGE(kempe_comparison, comparison, comparison->system->context, comparison->system, "compare", "comparison",
     &kmp_comparison_view, kmp_comparison_fill)

/* The row whose function has an argument more. */
kempe_status kempe_folder_write_report(kempe_folder *folder, const kempe_model *model, const char *path)
{
    static const kmp_page_kind kind = {"ensemble", "ensemble", &kmp_result_view, fill_gathered};
    KMP_WANTED_BOTH(folder, model);
    return kmp_page_write(&kind, folder->context, NULL, &(gathered){folder, model}, path);
}

/* The first and the last time of a table, s; infinite in a table without any. */
static void find_times(const kempe_table *table, double range[2])
{
    const int column = kempe_table_find(table, "t");
    range[0] = INFINITY;
    range[1] = -INFINITY;
    for (int row = 0; column >= 0 && row < kempe_table_row_count(table); row++) {
        const double t = kmp_table_in_si(table, row, column);
        range[0] = isfinite(t) ? fmin(range[0], t) : range[0];
        range[1] = isfinite(t) ? fmax(range[1], t) : range[1];
    }
}

/* The times of both runs meet in more than one time, unless one of them has no other. */
static kempe_status check_times(kempe_context *context, const beside *both)
{
    const double *own = both->own, *other = both->other;
    const double from = fmax(own[0], other[0]), to = fmin(own[1], other[1]);
    if (from < to || (from == to && (own[0] == own[1] || other[0] == other[1])))
        return KEMPE_OK;
    return kmp_fail(context, KEMPE_E_INPUT,
                    "the table '%s' has times from %.6g to %.6g s, this run from %.6g to %.6g s: they do not meet, and "
                    "nothing can be compared",
                    kempe_table_name(both->earlier), other[0], other[1], own[0], own[1]);
}

/* An earlier run has rows over t at times of this run, and columns of this run in units of their kind. */
static kempe_status check_earlier(kempe_context *context, beside *both)
{
    const kempe_table *earlier = both->earlier;
    const char *wrong = "no column of an output that this run has";
    kempe_table *rows = NULL;
    kempe_status status = kempe_trajectory_table(both->run, "rows", &rows);
    if (status == KEMPE_OK)
        find_times(rows, both->own);
    find_times(earlier, both->other);
    for (int c = 0; status == KEMPE_OK && c < kempe_table_column_count(rows); c++) {
        const char *name = kempe_table_column_name(rows, c), *unit = kempe_table_unit(rows, c);
        const int own = kempe_table_find(earlier, name);
        if (own >= 0 && !kmp_table_is_comparable(rows, c, earlier, own))
            status = kmp_fail(context, KEMPE_E_INPUT, "the table '%s' has '%s' in %s, this run in %s",
                              kempe_table_name(earlier), name, kempe_table_unit(earlier, own), unit);
        if (own >= 0 && strcmp(name, "t") != 0)
            wrong = NULL;
    }
    kempe_table_free(rows);
    KMP_TRY(status);
    if (!wrong && kempe_table_find(earlier, "t") < 0)
        wrong = "no column t";
    if (!wrong && kempe_table_row_count(earlier) == 0)
        wrong = "no rows";
    return wrong ? kmp_fail(context, KEMPE_E_INPUT, "the table '%s' has %s: nothing can be compared with this run",
                            kempe_table_name(earlier), wrong)
                 : check_times(context, both);
}

kempe_status kempe_trajectory_write_report_against(const kempe_trajectory *trajectory, const kempe_table *earlier,
                                                   const char *path)
{
    static const kmp_page_kind kind = {"simulate", "simulation", &kmp_result_view, fill_beside};
    KMP_WANTED(NULL, trajectory, "trajectory");
    kempe_context *context = trajectory->system->context;
    KMP_WANTED(context, earlier, "earlier");
    beside both = {.run = trajectory, .earlier = earlier};
    KMP_TRY(check_earlier(context, &both));
    return kmp_page_write(&kind, context, trajectory->system, &both, path);
}
