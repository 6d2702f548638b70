/* SPDX-License-Identifier: BSD-3-Clause */
/* A trajectory as a report and as one JSON object. */
#include "studies/simulate/trajectory_print.h"
#include "base/memory.h"
#include "base/quantile.h"
#include "integrators/formulations/cost_model.h"
#include "model/data/closure_table.h"
#include "model/data/compliant.h"
#include "model/data/model.h"
#include "model/data/output_table.h"
#include "model/data/tyre.h"
#include "output/print.h"
#include "output/reactions.h"
#include "output/result_table.h"
#include "output/start_balance.h"
#include "studies/simulate/observed.h"
#include "studies/simulate/reaction_watch.h"
#include "studies/simulate/trajectory.h"
#include <math.h>
#include <string.h>

/* Column of the text of a line, after its label. */
enum { TEXT_COLUMN = 10 };

/* The most entries of the log in the text. */
enum { MOST_SHOWN = 12 };

static int last_row(const kempe_trajectory *t)
{
    return t->table.rows - 1;
}

static const double *at_end(const kempe_trajectory *t, kmp_quantity quantity)
{
    return t->table.rows > 0 ? kmp_samples_get(&t->table, quantity, last_row(t)) : NULL;
}

static double end_time(const kempe_trajectory *t)
{
    return t->table.rows > 0 ? kmp_samples_time(&t->table, last_row(t)) : NAN;
}

/* -- compliant contacts ---------------------------------------------------------------------------------- */

#define TURN 6.283185307179586477

double kmp_contact_time_depth(const kempe_trajectory *t, int k)
{
    const kmp_contact_time *contact = &t->log.contacts[k];
    const kempe_model *model = t->system->model;
    return kmp_compliant_depth(model, &model->forces[contact->force], contact->most);
}

kempe_status kmp_contact_times_find(const kempe_trajectory *t, int force, kmp_contact_times *times)
{
    const kmp_run_log *log = &t->log;
    double *depth = KMP_NEW(double, log->contact_count + 1), touching = 0;
    KMP_TRY(kmp_made(t->system->context, depth));
    *times = (kmp_contact_times){.force = force};
    for (int k = 0; k < log->contact_count; k++) {
        const kmp_contact_time *contact = &log->contacts[k];
        if (contact->force != force)
            continue;
        touching += (isnan(contact->until) ? t->report.t : contact->until) -
                    (isnan(contact->from) ? t->spec.t_start : contact->from);
        times->begun += !isnan(contact->from);
        if (!isnan(contact->most))
            depth[times->ended++] = kmp_contact_time_depth(t, k);
    }
    kmp_order(times->ended, depth);
    for (int k = 0; k < KMP_DEPTHS; k++)
        times->depth[k] = kmp_ordered_quantile(times->ended, depth, 0.25 * k);
    times->touching = touching > 0 ? touching / (t->report.t - t->spec.t_start) : 0;
    /* The driven rotation with the largest angle between the first and the last row. */
    const kempe_model *model = t->system->model;
    const kmp_samples *rows = &t->table;
    for (int k = 0; rows->rows > 1 && k < model->closure_count; k++) {
        const kmp_closure *closure = &model->closures[k];
        if (!kmp_closure_is_drive(closure) || !model->motions[closure->motion].rotation)
            continue;
        double turns = fabs(kmp_samples_get(rows, KMP_QUANTITY_Q, rows->rows - 1)[closure->motion] -
                            kmp_samples_get(rows, KMP_QUANTITY_Q, 0)[closure->motion]) /
                       TURN;
        if (turns >= 1 && turns > times->turns) {
            times->turns = turns;
            times->turning = model->motions[closure->motion].name;
        }
    }
    kmp_free(depth);
    return KEMPE_OK;
}

/* -- text -------------------------------------------------------------------------------------------- */

static void show_state(kmp_text *text, const kempe_trajectory *t)
{
    const double *q = at_end(t, KMP_QUANTITY_Q), *qd = at_end(t, KMP_QUANTITY_QD), *qdd = at_end(t, KMP_QUANTITY_QDD);
    const kmp_coordinate_column columns[] = {
        {"position", KMP_QUANTITY_Q, q}, {"velocity", KMP_QUANTITY_QD, qd}, {"acceleration", KMP_QUANTITY_QDD, qdd}};
    if (!q)
        return;
    kmp_text_printf(text, "\nat t = %.9g s%s\n", end_time(t),
                    kmp_is_complete(t->status) ? "" : ", the last row of results");
    kmp_print_coordinates(text, t->system, sizeof columns / sizeof *columns, columns, NULL, NULL);
    kmp_print_states(text, t->system, qd, qdd);
    kmp_print_multipliers(text, t->system, at_end(t, KMP_QUANTITY_LAMBDA));
}

static bool reactions_of(const kempe_trajectory *t, kmp_reactions *reactions)
{
    const bool good = kmp_reactions_of_rows(reactions, t->system, &t->table, t->least_norm) == KEMPE_OK;
    if (good && t->watch)
        kmp_reactions_take_whole(reactions, kmp_reaction_watch_found(t->watch));
    return good;
}

static void show_reactions(kmp_text *text, const kempe_trajectory *t, bool all)
{
    kmp_reactions reactions;
    if (reactions_of(t, &reactions))
        kmp_reactions_show(text, &reactions, all ? NULL : "--all");
    else
        text->failed = true;
    if (!text->failed && t->watch)
        kmp_bearing_loads_show(text, kmp_reaction_watch_bearings(t->watch), &reactions);
    kmp_reactions_free(&reactions);
}

static const char *again_name(const kempe_trajectory *t)
{
    return t->system->n > 0 ? t->system->model->motions[t->again.index].name : NULL;
}

static void show_accuracy(kmp_text *text, const kempe_trajectory *t)
{
    kmp_text error = {0};
    kmp_convergence_put(&error, t->system->context, &t->again, again_name(t), kmp_trajectory_unit(t));
    if (t->again.known)
        kmp_print_wrapped(text, "accuracy  ", TEXT_COLUMN, error.s ? error.s : "");
    kmp_text_put(text, t->again.known ? "          " : "accuracy  ");
    kmp_text_free_part(text, &error);
    kmp_print_cells(text, "energy balance %.2g of the energy exchanged\n", t->verdict.drift_rel);
    if (t->system->m > 0) {
        kmp_text_put(text, "          loops closed to ");
        kmp_print_quantity(text, t->system->context, 2, t->verdict.h_max * t->system->length, "m");
        kmp_text_put(text, "\n");
    }
    if (t->verdict.misfit_row >= 0) {
        kmp_text_put(text, "          equations omitted as redundant have gaps of at most ");
        kmp_print_quantity(text, t->system->context, 2, t->verdict.misfit * t->system->length, "m");
        kmp_text_printf(text, " ('%s' at t = %.6g s)\n", t->system->row_names[t->verdict.misfit_row],
                        t->verdict.misfit_t);
    }
    kmp_print_rounding(text, t->system, "          ");
    if (t->source) {
        kmp_text_put(text, "          error");
        for (int k = 0; k < KMP_QUANTITIES; k++)
            if (isfinite(t->verdict.error[k]))
                kmp_text_printf(text, "  %s %.2e", kmp_quantity_prefix((kmp_quantity)k), t->verdict.error[k]);
        kmp_text_printf(text, "  against %s\n", t->source);
    }
}

/* The formulation, the integrator and their cost. */
static void show_method(kmp_text *text, const kempe_trajectory *t)
{
    const kmp_run_report *r = &t->report;
    kmp_text line = {0}, names = {0};
    kmp_text_printf(&line, "formulation %s", t->spec.formulation);
    if (t->spec.form)
        kmp_text_printf(&line, ", form %s", t->spec.form);
    if (r->continued)
        kmp_text_printf(&line, ", from t = %.4g s on %s", r->continued_t, r->continued);
    kmp_text_printf(&line, ", integrator %s, rtol %g, atol %g%s%s", t->integrator, t->spec.rtol, t->spec.atol,
                    r->by_bodies ? ", articulated-body algorithm" : "",
                    strcmp(t->spec.change_points, kmp_change_points_word(KMP_CHANGE_POINTS_IGNORE)) == 0
                        ? ", change points ignored"
                        : "");
    kmp_backend_print(&line, t->spec.backend);
    kmp_text_printf(&line, "; %ld steps in %.3g ms, after %.3g ms of preparation", r->steps, 1e3 * r->cpu_s,
                    1e3 * (r->build_s + t->system->build_s));
    kmp_print_wrapped(text, "method    ", TEXT_COLUMN, line.s ? line.s : "");
    kmp_print_flexible(text, t->system->model, "flexible  ");
    kmp_print_unused(&names, t->system->model);
    if (names.length > 0)
        kmp_text_printf(text, "unused    parameters without any effect on the model: %s\n", names.s);
    kmp_text_free_part(text, &line);
    kmp_text_free_part(text, &names);
}

/* The integrator, where the user chose none. */
static void show_choice(kmp_text *text, const kempe_trajectory *t)
{
    const double ratio = t->report.chosen_ratio;
    const kmp_integrator_reason *reason = &t->spec.reason;
    if (reason->integrator)
        kmp_text_printf(text, "choice    integrator %s: %s%s%s\n", reason->integrator, reason->because,
                        reason->obstacle ? ": " : "", reason->obstacle ? reason->obstacle : "");
    if (!(ratio > 0))
        return;
    kmp_text line = {0};
    kmp_text_printf(
        &line,
        "integrator %s at the start: radau was expected to take %.2f times as long as dop853, which is right "
        "within a factor of 1.5 for most models",
        ratio < KMP_RATIO_WORTH ? "radau" : "dop853", ratio);
    kmp_print_wrapped(text, "choice    ", TEXT_COLUMN, line.s ? line.s : "");
    kmp_text_free_part(text, &line);
}

static void show_work(kmp_text *text, const kempe_trajectory *t)
{
    const kmp_run_report *r = &t->report;
    kmp_text line = {0};
    if (t->system->m > 0)
        kmp_print_cells(text, "loops     rates closed to %.2g m/s\n", t->verdict.hdot_max * t->system->length);
    kmp_text_printf(&line,
                    "steps %ld, rejected %ld, failed %ld, right-hand sides %ld, Newton iterations %ld, factorizations "
                    "%ld, changes of the independent coordinates %ld, ",
                    r->steps, r->rejected, r->refused, r->rhs, r->newton, r->factorizations, r->exchanges);
    if (t->system->chart_count > 0)
        kmp_text_printf(&line, "changes of the angles of joints %ld, ", r->centrings);
    kmp_text_printf(&line, "events %ld", r->events);
    if (r->impacts >= 0)
        kmp_text_printf(&line, ", impacts %ld", r->impacts);
    if (r->changes >= 0)
        kmp_text_printf(&line, ", changes of modes %ld", r->changes);
    kmp_print_wrapped(text, "work      ", TEXT_COLUMN, line.s ? line.s : "");
    kmp_text_free_part(text, &line);
    kmp_text_printf(text, "cpu       %.4g ms integration", 1e3 * r->cpu_s);
    if (r->wall_s > 0)
        kmp_text_printf(text, " of all threads, %.4g ms wall-clock time", 1e3 * r->wall_s);
    kmp_text_printf(text, ", %.4g ms preparation\n", 1e3 * (r->build_s + t->system->build_s));
}

/* Compliant contacts. */
static void show_contacts(kmp_text *text, const kempe_trajectory *t)
{
    const kempe_model *model = t->system->model;
    kmp_contact_times times;
    for (int k = 0; k < model->force_count; k++) {
        const kmp_force *force = &model->forces[k];
        const kmp_shown as = kmp_shown_as(model->context, force->turns ? "rad" : "m");
        if (force->kind != KMP_FORCE_COMPLIANT || kmp_contact_times_find(t, k, &times) != KEMPE_OK)
            continue;
        kmp_text_printf(text, "contact   '%s' began %d time%s%s", force->name, times.begun, times.begun == 1 ? "" : "s",
                        t->log.contacts_cut ? " in the recorded part of the run" : "");
        if (times.ended > 0)
            kmp_text_printf(text, ", largest depth %.4g %s", as.factor * times.depth[KMP_DEPTHS - 1], as.unit);
        kmp_text_put(text, "\n");
        if (times.ended > 1) {
            /* Of several contacts. */
            const double *depth = times.depth;
            kmp_text_printf(text, "          depths of the %d that ended: median %.4g, quartiles %.4g and %.4g %s\n",
                            times.ended, as.factor * depth[2], as.factor * depth[1], as.factor * depth[3], as.unit);
            kmp_text_printf(text, "          closed for %.1f %% of the time", 100 * times.touching);
            if (times.turning)
                kmp_text_printf(text, ", %.1f contacts per turn of '%s'", times.begun / times.turns, times.turning);
            kmp_text_put(text, "\n");
        }
    }
}

/* The first change of the assembly mode. */
static void show_mode(kmp_text *text, const kempe_trajectory *t)
{
    kmp_text_printf(text, "mode      '%s' reaches another assembly mode at the same ",
                    t->system->model->motions[t->mode_coordinate].name);
    /* The coordinates that the start holds, "'A', 'B'". */
    const kempe_model *model = t->system->model;
    const char *before = "";
    for (int k = 0; k < model->motion_count; k++)
        if (model->start.hold[k] && !model->motions[k].elastic) {
            kmp_text_printf(text, "%s'%s'", before, model->motions[k].name);
            before = ", ";
        }
    kmp_text_printf(text, " between t = %.6g and %.6g s", t->mode_t[0], t->mode_t[1]);
    if (t->mode_changes > 1)
        kmp_text_printf(text, ", the first of %d changes", t->mode_changes);
    kmp_text_put(text, "\n");
}

#define NUMBER "0123456789.+-"

/* Behind a number with its exponent. */
static const char *after_number(const char *s)
{
    s += strspn(s, NUMBER);
    return *s == 'e' && s[1] && strchr(NUMBER, s[1]) ? s + 1 + strspn(s + 1, NUMBER) : s;
}

/* True if two texts have the same words and 'names', and differ only in their numbers. */
static bool has_words_of(const char *a, const char *b)
{
    for (bool named = false; *a && *b;) {
        named = named != (*a == '\'');
        if (!named && strchr(NUMBER, *a) && strchr(NUMBER, *b)) {
            a = after_number(a);
            b = after_number(b);
        } else if (*a++ != *b++) {
            return false;
        }
    }
    return *a == *b;
}

/* Entries of the same words are one line, at the time of the first one. */
static void show_log(kmp_text *text, const kmp_run_log *log)
{
    const char *label = "log       ";
    int lines = 0, shown = 0;
    for (int k = 0; k < log->kept && lines < MOST_SHOWN; k++) {
        const kmp_log_entry *entry = &log->entries[k], *last = entry;
        int count = 0, before = 0;
        double lost = 0; /* energy in impacts */
        for (int i = 0; i < k && !before; i++)
            before = has_words_of(log->entries[i].text, entry->text);
        for (int i = k; i < log->kept && !before; i++)
            if (has_words_of(log->entries[i].text, entry->text)) {
                last = &log->entries[i];
                lost += strcmp(last->kind, "impact") == 0 ? last->before - last->after : NAN;
                count++;
            }
        if (before)
            continue;
        kmp_text line = {0};
        kmp_text_printf(&line, "t = %.6g s: %s", entry->t, entry->text);
        if (count > 1) {
            kmp_text_printf(&line, "; %d such events", count);
            if (isfinite(lost) && log->count == log->kept)
                kmp_text_printf(&line, ", together by %.4g J", fabs(lost));
            kmp_text_printf(&line, ", the last at t = %.6g s", last->t);
        }
        kmp_print_wrapped(text, label, TEXT_COLUMN + 2, line.s ? line.s : "");
        kmp_text_free_part(text, &line);
        label = "          ";
        shown += count;
        lines++;
    }
    if (log->count > shown)
        kmp_text_printf(text, "           and %ld more%s\n", log->count - shown,
                        log->count > log->kept ? "" : " (--json)");
}

/* The equations of tyres by files. */
static void show_tyres(kmp_text *text, const kempe_model *model)
{
    for (int next = 0;;) {
        kmp_text form = {0};
        const bool found = kmp_tyres_put_forms(&form, model, &next);
        if (found)
            kmp_print_wrapped(text, "  ", 4, form.s ? form.s : "");
        kmp_text_free_part(text, &form);
        if (!found)
            return;
    }
}

static void show_run(kmp_text *text, const kempe_trajectory *t, bool all)
{
    kmp_text title = {0};
    kmp_print_title(&title, t->system->model, kempe_trajectory_outcome(t));
    if (*t->reason)
        kmp_text_printf(&title, "t = %.9g s: %s", t->report.t, t->reason);
    else
        kmp_text_printf(&title, "%.9g to %.9g s, %d rows", t->spec.t_start, t->spec.t_end, t->table.rows);
    if (!*t->reason && t->again.known && kmp_convergence_holds(&t->again)) {
        kmp_text_put(&title, ", estimated error ");
        kmp_convergence_put_error(&title, t->system->context, &t->again, kmp_trajectory_unit(t));
    }
    kmp_print_answer(text, &title, kempe_trajectory_outcome(t), t->warnings, "", NULL);
    if (kempe_trajectory_outcome(t) != KEMPE_OUTCOME_NOT_TRUSTWORTHY && t->remarks.s)
        kmp_print_below(text, t->remarks.s);
    kmp_start_balance_show(text, t->balance);
    show_tyres(text, t->system->model);
    if (t->table.rows > 0) {
        show_state(text, t);
        if (t->table.rows > 0)
            kmp_print_outputs(text, t->system->model, t->shown);
        show_reactions(text, t, all);
        kmp_text_put(text, "\n");
        show_accuracy(text, t);
        show_method(text, t);
        if (all) {
            show_choice(text, t);
            show_work(text, t);
        }
    }
    if (t->mode_changes > 0)
        show_mode(text, t);
    show_contacts(text, t);
    if (t->judged)
        kmp_run_judge_find()->show(text, t->system->model, t->judged);
    show_log(text, &t->log);
}

/* -- JSON -------------------------------------------------------------------------------------------- */

/* The algorithm of the run itself, not of the request. */
static const char *dynamics_of(const kempe_trajectory *t)
{
    kmp_dynamics requested = t->system->dynamics;
    kmp_dynamics by_mass =
        requested == KMP_DYNAMICS_NER || requested == KMP_DYNAMICS_PLAIN ? requested : KMP_DYNAMICS_COMPOSITE;
    return kmp_dynamics_word(t->report.by_bodies ? KMP_DYNAMICS_ARTICULATED : by_mass);
}

static void json_reactions(kmp_json *json, const kempe_trajectory *t)
{
    kmp_reactions reactions;
    if (reactions_of(t, &reactions))
        kmp_reactions_json(json, &reactions);
    else
        json->text->failed = true;
    if (!json->text->failed && t->watch)
        kmp_bearing_loads_json(json, kmp_reaction_watch_bearings(t->watch), &reactions);
    kmp_reactions_free(&reactions);
}

static void json_state(kmp_json *json, const kempe_trajectory *t)
{
    kmp_json_number(json, "t", end_time(t));
    for (int k = KMP_QUANTITY_Q; k <= KMP_QUANTITY_QDD; k++)
        kmp_print_entries(json, kmp_quantity_prefix((kmp_quantity)k), t->system, (kmp_quantity)k,
                          at_end(t, (kmp_quantity)k));
    /* The kept rows of each closure. */
    const kempe_system *s = t->system;
    const double *lambda = at_end(t, KMP_QUANTITY_LAMBDA);
    kmp_json_object(json, "lambda");
    for (int c = 0; c < s->model->closure_count; c++) {
        kmp_json_array(json, s->model->closures[c].name);
        for (int r = 0; r < s->m; r++)
            if (s->rows[r].closure == c)
                kmp_json_number(json, NULL, lambda ? lambda[r] : NAN);
        kmp_json_end(json);
    }
    kmp_json_put(json, "} reaction {");
    for (int c = 0; c < s->model->closure_count; c++)
        kmp_json_numbers(json, s->model->closures[c].name, 3, t->reaction + 3 * c);
    kmp_json_end(json);
    json_reactions(json, t);
    kmp_print_outputs_json(json, t->system->model, t->shown, true);
    kmp_print_outputs_json(json, t->system->model, t->shown, false);
}

/* Compliant contacts. */
static void json_contacts(kmp_json *json, const kempe_trajectory *t)
{
    const kempe_model *model = t->system->model;
    kmp_contact_times times;
    kmp_json_array(json, "contacts");
    for (int k = 0; k < model->force_count; k++) {
        if (model->forces[k].kind != KMP_FORCE_COMPLIANT || kmp_contact_times_find(t, k, &times) != KEMPE_OK)
            continue;
        kmp_json_put(json, "{ name %s began %d ended %d cut %i touching %g", model->forces[k].name, times.begun,
                     times.ended, t->log.contacts_cut, times.touching);
        kmp_json_numbers(json, "depths", KMP_DEPTHS, times.depth);
        /* Each contact with its beginning, its end and its largest depth. */
        kmp_json_put(json, "turning %s turns %g contacts [", times.turning, times.turns);
        for (int i = 0; i < t->log.contact_count; i++) {
            const kmp_contact_time *contact = &t->log.contacts[i];
            const double numbers[] = {contact->from, contact->until, kmp_contact_time_depth(t, i)};
            if (contact->force == k)
                kmp_json_numbers(json, NULL, 3, numbers);
        }
        kmp_json_put(json, "] }");
    }
    kmp_json_end(json);
}

static void json(kmp_text *text, const void *result)
{
    const kempe_trajectory *t = result;
    kmp_json j = kmp_print_head(text, t->system, kempe_trajectory_outcome(t), t->reason,
                                t->system->build_s + t->report.build_s, t->warnings);
    kmp_json_put(&j, "formulation %s form %s integrator %s backend %s", t->spec.formulation, t->spec.form,
                 t->integrator, t->spec.backend);
    const kmp_integrator_reason *reason = &t->spec.reason;
    if (t->report.chosen_ratio > 0 || t->report.continued) {
        kmp_json_put(&j, "integrator_choice { radau_over_dop853 %g", t->report.chosen_ratio);
        if (t->report.continued)
            kmp_json_put(&j, "continued_on %s continued_t %g", t->report.continued, t->report.continued_t);
        kmp_json_end(&j);
    }
    if (reason->integrator && !reason->obstacle)
        kmp_json_put(&j, "integrator_choice { because %s }", reason->because);
    if (reason->integrator && reason->obstacle)
        kmp_json_put(&j, "integrator_choice { because %s obstacle %s }", reason->because, reason->obstacle);
    kmp_json_put(&j, "algorithm %s change_points %s rtol %g atol %g length %g rate_scale %g tolerances %s",
                 dynamics_of(t), t->spec.change_points, t->spec.rtol, t->spec.atol, t->system->length,
                 t->report.rate_scale,
                 "absolute tolerance of an angle: atol; of a translation: atol * length; of their rates: that times "
                 "rate_scale");
    kmp_start_balance_json(&j, t->balance);
    json_state(&j, t);
    kmp_print_verdict(&j, &t->verdict);
    kmp_json_string(&j, "reference", t->source);
    kmp_print_errors(&j, &t->verdict);
    kmp_convergence_json(&j, &t->again, again_name(t));
    kmp_print_work(&j, &t->report);
    kmp_print_unused_json(&j, t->system->model);
    const kmp_run_log *log = &t->log;
    kmp_json_put(&j, "log_count %ld log [", log->count);
    for (int k = 0; k < log->kept; k++) {
        const kmp_log_entry *entry = &log->entries[k];
        kmp_json_put(&j, "{ t %g kind %s text %s before %g after %g }", entry->t, entry->kind, entry->text,
                     entry->before, entry->after);
    }
    kmp_json_end(&j);
    if (t->log.contact_count > 0)
        json_contacts(&j, t);
    if (t->judged)
        kmp_run_judge_find()->json(&j, t->system->model, t->judged);
    kmp_json_put(&j, "mode_changes %g cpu_s %g", t->watches_modes ? (double)t->mode_changes : NAN, t->report.cpu_s);
    if (t->report.wall_s > 0)
        kmp_json_number(&j, "wall_s", t->report.wall_s);
    kmp_json_end(&j);
}

KMP_PRINT_FULL(kempe_trajectory, trajectory, trajectory->system->context, json, show_run)

static void fill_rows(kempe_table *table, const void *result)
{
    const kempe_trajectory *t = result;
    kmp_evaluator *eval = kmp_eval_new_for(t->system, t->spec.backend, NULL, KMP_EVAL_WEIGHS);
    kmp_columns columns = {0};
    double *values =
        eval && kmp_columns_init(&columns, t->system, t->system->model, NULL) ? KMP_NEW(double, columns.count) : NULL;
    if (values) {
        kmp_tabulate_outcome(table, kempe_trajectory_outcome(t));
        for (int k = 0; k < columns.count; k++)
            kmp_tabulate_column(table, columns.unit[k], "%s", columns.name[k]);
        for (int row = 0; row < t->table.rows; row++) {
            kmp_columns_fill(&t->table, &columns, eval, row, values);
            kmp_tabulate_row(table);
            kmp_tabulate_numbers(table, columns.count, values);
        }
    } else
        kmp_tabulate_fail(table);
    kmp_columns_free(&columns);
    kmp_eval_free(eval);
    kmp_free(values);
}

static void fill_log(kempe_table *table, const void *result)
{
    const kmp_run_log *log = &((const kempe_trajectory *)result)->log;
    kmp_tabulate_columns(table, "t[s] kind[words] text[words] before after");
    for (int k = 0; k < log->kept; k++) {
        const kmp_log_entry *entry = &log->entries[k];
        KMP_TABULATE(table, "%g %s %s %g %g", entry->t, entry->kind, entry->text, entry->before, entry->after);
    }
}

static void fill_contacts(kempe_table *table, const void *result)
{
    const kempe_trajectory *t = result;
    kmp_tabulate_columns(table, "contact[words] from[s] until[s] depth");
    for (int k = 0; k < t->log.contact_count; k++) {
        const kmp_contact_time *contact = &t->log.contacts[k];
        KMP_TABULATE(table, "%s %g %g %g", t->system->model->forces[contact->force].name, contact->from, contact->until,
                     kmp_contact_time_depth(t, k));
    }
}

static void fill_reactions(kempe_table *table, const void *result)
{
    const kempe_trajectory *t = result;
    kmp_reactions reactions;
    kmp_reactions_columns(table);
    if (reactions_of(t, &reactions))
        kmp_reactions_tabulate(table, &reactions, -1);
    else
        kmp_tabulate_fail(table);
    kmp_reactions_free(&reactions);
}

static void fill_bearings(kempe_table *table, const void *result)
{
    const kempe_trajectory *t = result;
    kmp_reactions reactions;
    kmp_bearing_loads_columns(table);
    if (!t->watch)
        return;
    if (reactions_of(t, &reactions))
        kmp_bearing_loads_tabulate(table, kmp_reaction_watch_bearings(t->watch), &reactions);
    else
        kmp_tabulate_fail(table);
    kmp_reactions_free(&reactions);
}

KMP_TABLES(kempe_trajectory, trajectory, trajectory->system->context, {"rows", fill_rows}, {"log", fill_log},
           {"contacts", fill_contacts}, {"reactions", fill_reactions}, {"bearings", fill_bearings})

/* -- outputs by name --------------------------------------------------------------------------------- */

kempe_status kempe_trajectory_outputs(const kempe_trajectory *trajectory, const char *names, kempe_table **table)
{
    KMP_WANTED(NULL, trajectory, "trajectory");
    kempe_context *context = trajectory->system->context;
    KMP_WANTED(context, names, "names");
    KMP_WANTED(context, table, "table");
    kmp_output_program o;
    kmp_context_clear(context);
    KMP_TRY(kmp_output_program_init(&o, trajectory->system, names, 0, NULL));
    kempe_table *made = kmp_tabulate(context, "outputs");
    double *values = KMP_NEW(double, o.columns.count);
    for (int c = 0; c < o.columns.count; c++)
        kmp_tabulate_column(made, o.columns.unit[c], "%s", o.columns.name[c]);
    for (int row = 0; values && row < trajectory->table.rows; row++) {
        kmp_output_program_fill(&o, &trajectory->table, row, values);
        kmp_tabulate_row(made);
        kmp_tabulate_numbers(made, o.columns.count, values);
    }
    if (!values)
        kmp_tabulate_fail(made);
    kmp_free(values);
    kmp_output_program_free(&o);
    return kmp_tabulate_finish(context, made, table);
}
