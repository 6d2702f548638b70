/* SPDX-License-Identifier: BSD-3-Clause */
/* An inverse dynamics as a report and as one JSON object. */
#include "analyses/inverse/inverse_study.h"
#include "analyses/parts/study_print.h"
#include "base/text.h"
#include "model/data/closure_table.h"
#include "model/data/model.h"
#include "output/print.h"
#include "output/result_table.h"
#include <kempe/inverse.h>
#include <kempe/kempe.h>
#include <math.h>
#include <stdio.h>
#include <string.h>

enum { MOST_NAMED = 8 };

static const char *name_of(const kempe_inverse *r, int coordinate)
{
    return r->system->model->motions[coordinate].name;
}

static const char *unit_of(const kempe_inverse *r, int coordinate)
{
    return r->system->model->motions[coordinate].rotation ? "N m" : "N";
}

/* -- text -------------------------------------------------------------------------------------------- */

/* The next force of the model from `from` on that acts along an actuated coordinate; the number of forces: none. */
static int next_force(const kempe_inverse *r, int from)
{
    const kempe_model *model = r->system->model;
    for (int f = from; f < model->force_count; f++)
        for (int k = 0; k < r->actuators.count; k++)
            if (model->forces[f].motion == r->actuators.coordinate[k])
                return f;
    return model->force_count;
}

static void show_actuators(kmp_text *text, const kempe_inverse *r, int width)
{
    const kempe_context *context = r->system->context;
    const kmp_shown power = kmp_shown_as(context, "W"), work = kmp_shown_as(context, "J");
    const int wide = (int)fmax(4, (double)strlen(kmp_shown_as(context, "N m").unit));
    char power_head[24], work_head[24];
    (void)snprintf(power_head, sizeof power_head, "power, %s", power.unit);
    (void)snprintf(work_head, sizeof work_head, "work, %s", work.unit);
    if (r->rows == 1) {
        kmp_text_printf(text, "  %-*s  %-*s  %12s  %12s\n", width, "", wide, "unit", "effort", power_head);
        for (int k = 0; k < r->actuators.count; k++) {
            const kmp_shown as = kmp_shown_as(r->system->context, unit_of(r, r->actuators.coordinate[k]));
            kmp_text_printf(text, "  %-*s  %-*s  %12.6g  %12.6g\n", width, name_of(r, r->actuators.coordinate[k]), wide,
                            as.unit, as.factor * *kmp_inverse_part(r, 0, r->at.tau + k),
                            power.factor * *kmp_inverse_part(r, 0, r->at.power + k));
        }
        return;
    }
    kmp_text_printf(text, "  %-*s  %-*s  %13s  %9s  %13s  %13s  %9s  %13s\n", width, "", wide, "unit", "largest",
                    "at t", "rms", power_head, "at t", work_head);
    for (int k = 0; k < r->actuators.count; k++) {
        kmp_inverse_summary s = kmp_inverse_summarise(r, k);
        const kmp_shown as = kmp_shown_as(r->system->context, unit_of(r, r->actuators.coordinate[k]));
        kmp_text_printf(text, "  %-*s  %-*s  %13.6g  %9.6g  %13.6g  %13.6g  %9.6g  %13.6g\n", width,
                        name_of(r, r->actuators.coordinate[k]), wide, as.unit, as.factor * s.peak, s.peak_t,
                        as.factor * s.rms, power.factor * s.power, s.power_t, work.factor * s.work);
    }
}

static void show_verdict(kmp_text *text, const kempe_inverse *r)
{
    kmp_text_printf(text, "\nbalance   %.2e of the largest force term of the equations of motion\n",
                    r->balance.residual);
    kmp_text_printf(text, "transmission  %.3g at t = %.6g s (1: ideal, 0: a degree of freedom without an actuator)\n",
                    r->balance.hold, r->balance.hold_t);
    if (r->balance.rank < r->balance.freedoms)
        kmp_text_printf(text, "unbalanced  %.2e of the required generalized forces\n",
                        kmp_inverse_balance_unmet(&r->balance));
    int redundant = 0, named = 0;
    for (int k = 0; k < r->system->m; k++)
        redundant += r->balance.redundant[k];
    if (redundant > 0) {
        kmp_text_put(text, "closures  redundant: multipliers are not unique, and are set to zero in");
        for (int k = 0; k < r->system->m; k++)
            if (r->balance.redundant[k] && named++ < MOST_NAMED)
                kmp_text_printf(text, " %s", r->system->row_names[k]);
        if (redundant > MOST_NAMED)
            kmp_text_printf(text, " and %d more", redundant - MOST_NAMED);
        kmp_text_put(text, "\n");
    }
    if (r->balance.singular > 0)
        kmp_text_printf(
            text,
            "singular  %d row%s, the first at t = %.6g s: the actuator forces are the least-squares solution there\n",
            r->balance.singular, r->balance.singular == 1 ? "" : "s", r->balance.singular_t);
    if (r->off.coordinate >= 0)
        kmp_text_printf(text, "table     violates the closures by at most %.2e (%s, t = %.6g s)\n", r->off.size,
                        name_of(r, r->off.coordinate), r->off.t);
    if (r->again.known)
        kmp_text_printf(
            text, "repeat    from half the rows an actuator force %s by %.2e of its maximum, '%s' at t = %.6g s\n",
            kmp_convergence_holds(&r->again) ? "differs at most" : "DIFFERS", r->again.difference,
            name_of(r, r->actuators.coordinate[r->again.index]), r->again.t);
    if (r->motion == KMP_INVERSE_START && r->start_u_count > 0) {
        kmp_text_put(text, "start     zero acceleration of");
        for (int k = 0; k < r->start_u_count; k++)
            kmp_text_printf(text, "%s %s", k ? "," : "", name_of(r, r->start_u[k]));
        kmp_text_put(text, "\n");
    }
    kmp_text_printf(text, "cpu       %.4g ms analysis, %.4g ms preparation", 1e3 * r->cpu_s, 1e3 * r->build_s);
    kmp_backend_print(text, r->backend);
    kmp_text_put(text, "\n");
}

static void show(kmp_text *text, const void *result)
{
    const kempe_inverse *r = result;
    int width = 4;
    for (int k = 0; k < r->actuators.count; k++) {
        int length = (int)strlen(name_of(r, r->actuators.coordinate[k]));
        width = length > width ? length : width;
    }
    kmp_print_title(text, r->system->model, kempe_inverse_outcome(r));
    kmp_text_put(text, "inverse dynamics ");
    if (r->motion == KMP_INVERSE_TABLE)
        kmp_text_printf(text, "along %s", r->source);
    else
        kmp_text_put(text, r->motion == KMP_INVERSE_DRIVES ? "along the drives" : "at the start");
    if (r->rows > 1)
        kmp_text_printf(text, ", t = %.9g .. %.9g s, %d rows", r->t[0], r->t[r->rows - 1], r->rows);
    kmp_text_put(text, "\n");
    if (*r->reason)
        kmp_print_wrapped(text, "  ", 4, r->reason);
    kmp_print_doubts(text, kempe_inverse_outcome(r), r->warnings);
    kmp_text_put(text, "\n");
    if (r->rows == 0)
        return;
    kmp_text_printf(text, "%d actuator%s, %d degree%s of freedom", r->actuators.count,
                    r->actuators.count == 1 ? "" : "s", r->balance.freedoms, r->balance.freedoms == 1 ? "" : "s");
    if (r->balance.rank < r->balance.freedoms)
        kmp_text_printf(text, ", %d of them actuated: the actuator forces are the least-squares solution\n",
                        r->balance.rank);
    else if (r->actuators.count > r->balance.freedoms)
        kmp_text_printf(
            text, ": redundant actuation; the actuator forces minimise the sum of %stau^2 (a force times %.6g m)\n",
            r->actuators.weighted ? "weight*" : "", r->system->length);
    else
        kmp_text_put(text, ": the actuator forces are uniquely determined\n");
    /* Forces of the model at the actuators, which remain active. */
    const kempe_model *model = r->system->model;
    int reported = 0;
    for (int f = next_force(r, 0); f < model->force_count; f = next_force(r, f + 1))
        if (reported++ < MOST_NAMED)
            kmp_text_printf(text, "%s'%s' along %s",
                            reported > 1
                                ? ", "
                                : "the actuator forces are in addition to the model's forces along these coordinates: ",
                            model->forces[f].name, name_of(r, model->forces[f].motion));
    if (reported > MOST_NAMED)
        kmp_text_printf(text, " and %d more", reported - MOST_NAMED);
    kmp_text_put(text, reported > 0 ? "\n" : "");
    show_actuators(text, r, width);
    kmp_reactions_show(text, &r->reactions, "--json");
    show_verdict(text, r);
}

/* -- JSON -------------------------------------------------------------------------------------------- */

/* The values at a place of each row, `count` of them as an array each. */
static void json_column(kmp_json *json, const char *key, const kempe_inverse *r, int at, int count)
{
    kmp_json_array(json, key);
    for (int row = 0; row < r->rows; row++)
        kmp_json_numbers(json, NULL, count, kmp_inverse_part(r, row, at));
    kmp_json_end(json);
}

static void json_actuated(kmp_json *json, const char *key, const kempe_inverse *r, int at)
{
    kmp_json_object(json, key);
    for (int k = 0; k < r->actuators.count; k++) {
        kmp_json_array(json, name_of(r, r->actuators.coordinate[k]));
        for (int row = 0; row < r->rows; row++)
            kmp_json_number(json, NULL, *kmp_inverse_part(r, row, at + k));
        kmp_json_end(json);
    }
    kmp_json_end(json);
}

static void json_vectors(kmp_json *json, const char *key, const kempe_inverse *r, int at)
{
    kmp_json_object(json, key);
    for (int l = 0; l < kmp_inverse_load_count(r); l++)
        json_column(json, kmp_inverse_load_name(r, l), r, at + 3 * l, 3);
    kmp_json_end(json);
}

static void json(kmp_text *text, const void *result)
{
    const kempe_inverse *r = result;
    kmp_json j = kmp_print_head(text, r->system, kempe_inverse_outcome(r), r->reason, r->build_s, r->warnings);
    static const char *const words[] = {"drives", "table", "start"};
    const char *efforts = r->balance.rank < r->balance.freedoms      ? "least squares"
                          : r->actuators.count > r->balance.freedoms ? "least norm"
                                                                     : "definite";
    kmp_json_put(&j, "motion %s source %s rows %d", words[r->motion], r->source, r->rows);
    if (r->off.coordinate >= 0)
        kmp_json_put(&j, "off { largest %g coordinate %s t %g }", r->off.size, name_of(r, r->off.coordinate), r->off.t);
    if (r->motion == KMP_INVERSE_START)
        kmp_print_names(&j, "u", r->system, kmp_name_of_coordinate, r->start_u_count, r->start_u);
    kmp_json_put(&j, "dof %d rank %d efforts %s norm %s length %g transmission %g", r->balance.freedoms,
                 r->balance.rank, r->rows ? efforts : NULL, "sum of weight*tau^2, a force times length",
                 r->system->length, r->rows ? r->balance.hold : NAN);
    kmp_json_put(&j, "transmission_t %g residual %g residual_t %g singular %d left { largest %g t %g efforts {",
                 r->rows ? r->balance.hold_t : NAN, r->rows ? r->balance.residual : NAN,
                 r->rows ? r->balance.residual_t : NAN, r->balance.singular,
                 r->rows ? kmp_inverse_balance_unmet(&r->balance) : NAN, r->rows ? r->balance.unmet_t : NAN);
    for (int k = 0; k < r->balance.left_count; k++)
        kmp_json_number(&j, name_of(r, r->balance.left_u[k]), r->balance.left[k]);
    kmp_json_put(&j, "} } redundant [");
    for (int k = 0; k < r->system->m; k++)
        if (r->balance.redundant[k])
            kmp_json_string(&j, NULL, r->system->row_names[k]);
    kmp_json_put(&j, "] actuators {");
    for (int k = 0; k < r->actuators.count; k++) {
        kmp_inverse_summary s = kmp_inverse_summarise(r, k);
        kmp_json_put(&j, "%s { unit %s weight %g largest %g largest_t %g", name_of(r, r->actuators.coordinate[k]),
                     unit_of(r, r->actuators.coordinate[k]), r->actuators.weight[k], r->rows ? s.peak : NAN,
                     r->rows ? s.peak_t : NAN);
        kmp_json_put(&j, "rms %g power %g power_t %g work %g }", r->rows ? s.rms : NAN, r->rows ? s.power : NAN,
                     r->rows ? s.power_t : NAN, r->rows ? s.work : NAN);
    }
    kmp_json_end(&j);
    const kempe_model *model = r->system->model;
    kmp_json_array(&j, "model_forces");
    for (int f = next_force(r, 0); f < model->force_count; f = next_force(r, f + 1))
        kmp_json_string(&j, NULL, model->forces[f].name);
    kmp_json_end(&j);
    kmp_json_numbers(&j, "t", r->rows, r->t);
    json_actuated(&j, "tau", r, r->at.tau);
    json_actuated(&j, "power", r, r->at.power);
    const kempe_system *s = r->system;
    kmp_json_object(&j, "lambda");
    for (int l = 0, at = r->at.lambda; l < r->loads.loops; l++) {
        int count = 0;
        for (int k = 0; k < s->m; k++)
            count += s->rows[k].closure == r->loads.loop[l];
        json_column(&j, s->model->closures[r->loads.loop[l]].name, r, at, count);
        at += count;
    }
    kmp_json_end(&j);
    json_vectors(&j, "reaction", r, r->at.force);
    json_vectors(&j, "moment", r, r->at.moment);
    kmp_reactions_json(&j, &r->reactions);
    kmp_json_put(&j, "loads_not_unique %s load_share %s", r->not_unique, r->least_norm ? "least-norm" : NULL);
    kmp_convergence_json(&j, &r->again,
                         r->actuators.count > 0 ? name_of(r, r->actuators.coordinate[r->again.index]) : NULL);
    kmp_json_put(&j, "backend %s cpu_s %g }", r->backend, r->cpu_s);
}

KMP_PRINT(kempe_inverse, inverse, inverse->system->context, json, show)

/* -- tables ------------------------------------------------------------------------------------------- */

static void fill_rows(kempe_table *table, const void *result)
{
    const kempe_inverse *r = result;
    const kempe_model *model = r->system->model;
    kmp_tabulate_outcome(table, kempe_inverse_outcome(r));
    kmp_tabulate_columns(table, "t[s]");
    for (int k = 0; k < r->actuators.count; k++)
        kmp_tabulate_column(table, model->motions[r->actuators.coordinate[k]].rotation ? "N m" : "N", "tau.%s",
                            model->motions[r->actuators.coordinate[k]].name);
    for (int k = 0; k < r->actuators.count; k++)
        kmp_tabulate_column(table, "W", "power.%s", model->motions[r->actuators.coordinate[k]].name);
    for (kmp_quantity quantity = KMP_QUANTITY_Q; quantity <= KMP_QUANTITY_QDD; quantity++)
        kmp_tabulate_quantity(table, r->system, quantity);
    for (int k = 0; k < r->system->m; k++) /* drives have no multipliers */
        if (!kmp_closure_is_drive(&model->closures[r->system->rows[k].closure]))
            kmp_tabulate_column(table, kmp_quantity_unit(r->system, KMP_QUANTITY_LAMBDA, k), "lambda.%s",
                                r->system->row_names[k]);
    for (int moment = 0; moment < 2; moment++)
        for (int k = 0; k < 3 * (kmp_inverse_load_count(r)); k++)
            kmp_tabulate_column(table, moment ? "N m" : "N", "%s.%s.%c", moment ? "moment" : "reaction",
                                kmp_inverse_load_name(r, k / 3), "xyz"[k % 3]);
    for (int row = 0; row < r->rows; row++) {
        kmp_tabulate_row(table);
        kmp_tabulate_number(table, r->t[row]);
        kmp_tabulate_numbers(table, r->width, kmp_inverse_part(r, row, 0));
    }
}

static void fill_reactions(kempe_table *table, const void *result)
{
    kmp_reactions_columns(table);
    kmp_reactions_tabulate(table, &((const kempe_inverse *)result)->reactions, -1);
}

KMP_TABLES(kempe_inverse, inverse, inverse->system->context, {"rows", fill_rows}, {"reactions", fill_reactions})
