/* SPDX-License-Identifier: BSD-3-Clause */
/* The model as a summary to read. */
#include "model/print/model_print.h"
#include "model/tables/force_table.h"
#include "model/tables/output_table.h"
#include "symbolic/table.h"

static void show_named(kmp_text *text, const char *name, const kempe_model *model, const kmp_number *number)
{
    kmp_text_printf(text, "%s = ", name);
    kmp_text_number(text, number->value);
    if (number->expr) {
        kmp_text_put(text, "  (");
        kmp_model_put_expr(text, model, number->expr);
        kmp_text_put(text, ")");
    }
    kmp_text_put(text, "\n");
}

static void show_parameters(kmp_text *text, const kempe_model *model)
{
    if (model->parameter_count > 0)
        kmp_text_put(text, "parameters\n");
    for (int i = 0; i < model->parameter_count; i++) {
        kmp_text_put(text, "  ");
        show_named(text, model->parameters[i].name, model, &model->parameters[i].number);
    }
}

static void show_tables(kmp_text *text, const kempe_model *model)
{
    if (model->table_count > 0)
        kmp_text_put(text, "tables\n");
    for (int i = 0; i < model->table_count; i++) {
        const kmp_table *table = model->tables[i].table;
        kmp_text_printf(text, "  %s: %s, %d points, x from %.9g to %.9g\n", model->tables[i].name,
                        table->method == KMP_TABLE_LINEAR ? "linear" : "spline", table->count, table->x[0],
                        table->x[table->count - 1]);
    }
}

static void show_unknowns(kmp_text *text, const kempe_model *model)
{
    if (model->unknowns_count > 0)
        kmp_text_put(text, "unknowns\n");
    for (int i = 0; i < model->unknowns_count; i++) {
        const kmp_unknowns *u = &model->unknowns[i];
        kmp_text_printf(text, "  %s%s", u->name, u->count ? ":" : " = ");
        for (int k = 0; k < u->count; k++)
            kmp_text_printf(text, "%s %s from %.9g", k ? "," : "", u->unknown[k], u->guess[k].value);
        for (int k = 0; k < (u->count ? u->count : 1); k++) {
            kmp_text_put(text, u->count ? "\n    0 = " : "");
            kmp_model_put_expr(text, model, u->zero[k]);
        }
        kmp_text_put(text, "\n");
    }
}

/* R3, -T1, or R[0, 0.6, 0.8] */
static void show_motion(kmp_text *text, const kmp_motion *motion)
{
    const char *letter = motion->rotation ? "R" : "T";
    for (int i = 0; i < 3; i++)
        if (motion->axis[i] == 1 || motion->axis[i] == -1) {
            kmp_text_printf(text, "%s%s%d", motion->axis[i] < 0 ? "-" : "", letter, i + 1);
            return;
        }
    kmp_text_put(text, letter);
    kmp_model_put_axis(text, motion->axis);
}

/* x [..], z [..] */
static void show_axes(kmp_text *text, double m[3][3])
{
    for (int k = 0; k < 3; k += 2) {
        const double axis[3] = {m[0][k], m[1][k], m[2][k]};
        kmp_text_put(text, k ? ", z " : "x ");
        kmp_model_put_axis(text, axis);
    }
}

static void show_points(kmp_text *text, const kempe_model *model, int body)
{
    for (int i = 0; i < model->point_count; i++) {
        if (model->points[i].body != body)
            continue;
        kmp_text_printf(text, "    point %s ", model->points[i].name);
        kmp_model_put_vector(text, model->points[i].at);
        if (model->points[i].turned) {
            kmp_text_put(text, ", axes ");
            show_axes(text, model->points[i].axes);
        }
        kmp_text_put(text, "\n");
    }
}

static void show_inertia(kmp_text *text, const kmp_body *body)
{
    kmp_text_put(text, "    mass ");
    kmp_text_number(text, body->mass.value);
    kmp_text_put(text, ", com ");
    kmp_model_put_vector(text, body->com);
    kmp_text_put(text, ", inertia");
    for (int i = 0; i < 6; i++)
        if (i < 3 || body->inertia[i].value != 0) {
            kmp_text_printf(text, " %s ", kmp_inertia_names[i]);
            kmp_text_number(text, body->inertia[i].value);
        }
    kmp_text_put(text, "\n");
}

static void show_body(kmp_text *text, const kempe_model *model, int i)
{
    kmp_body *body = &model->bodies[i];
    kmp_text_printf(text, "  %d %s: joint %s at ", i, body->name, body->joint);
    if (body->at >= 0)
        kmp_model_put_point(text, model, body->at);
    else
        kmp_text_put(text, model->bodies[body->parent].name);
    if (body->to >= 0)
        kmp_text_printf(text, " to %s", model->points[body->to].name);
    kmp_text_put(text, body->reversed ? ", reversed:" : ":");
    for (int k = 0; k < body->motion_count; k++) {
        kmp_text_put(text, " ");
        show_motion(text, &model->motions[body->first_motion + k]);
    }
    kmp_text_put(text, body->motion_count ? "" : " weld");
    if (body->screw) {
        kmp_text_put(text, ", pitch ");
        kmp_text_number(text, body->pitch.value);
    }
    if (body->turned) {
        kmp_text_put(text, ", frame ");
        show_axes(text, body->frame);
    }
    kmp_text_put(text, "\n");
    show_inertia(text, body);
    show_points(text, model, i);
}

static void show_bodies(kmp_text *text, const kempe_model *model)
{
    kmp_text_put(text, "bodies\n  0 ground\n");
    show_points(text, model, 0);
    for (int i = 1; i < model->body_count; i++)
        show_body(text, model, i);
}

/* A closure that is not between points. */
static void show_relation(kmp_text *text, const kempe_model *model, const kmp_closure *closure)
{
    for (int k = 0; k < closure->term_count; k++) {
        kmp_text_put(text, k > 0 ? " + " : "");
        kmp_text_number(text, closure->terms[k].factor.value);
        kmp_text_printf(text, " %s", model->motions[closure->terms[k].motion].name);
    }
    if (closure->term_count == 0 && closure->motion >= 0)
        kmp_text_put(text, model->motions[closure->motion].name);
    if (closure->function) {
        kmp_text_put(text, closure->motion >= 0 ? " = " : "0 = ");
        kmp_model_put_expr(text, model, closure->function);
    }
    kmp_text_put(text, "\n");
}

static void show_closures(kmp_text *text, const kempe_model *model)
{
    if (model->closure_count > 0)
        kmp_text_put(text, "loops\n");
    for (int i = 0; i < model->closure_count; i++) {
        const kmp_closure *closure = &model->closures[i];
        kmp_text_printf(text, "  %s: %s ", closure->name, closure->kind);
        if (closure->point[0] < 0) {
            show_relation(text, model, closure);
            continue;
        }
        kmp_model_put_point(text, model, closure->point[0]);
        kmp_text_put(text, " - ");
        kmp_model_put_point(text, model, closure->point[1]);
        if (closure->function) {
            kmp_text_put(text, ", length ");
            kmp_model_put_expr(text, model, closure->function);
        } else if (closure->length.value > 0) {
            kmp_text_put(text, ", length ");
            kmp_text_number(text, closure->length.value);
        }
        if (kmp_closure_has_axes(closure)) {
            kmp_text_put(text, ", axes ");
            kmp_model_put_axis(text, closure->axis[0]);
            kmp_text_put(text, " and ");
            kmp_model_put_axis(text, closure->axis[1]);
        }
        if (closure->table)
            kmp_text_printf(text, ", table %s", closure->table->name);
        for (int k = 0; k < closure->curve_count && !closure->table; k++) {
            kmp_text_printf(text, ", %c = ", "0yz"[closure->curve_side[k]]);
            kmp_model_put_expr(text, model, closure->curve[k]);
        }
        kmp_text_put(text, "\n");
    }
}

void kmp_cut_print(kmp_text *text, const kmp_cut *cut)
{
    kmp_text_printf(text, "joint %s (%s) is cut: closure %s, %d rows, loop %s; %s", cut->joint, cut->kind, cut->closure,
                    cut->rows, cut->loop, cut->why);
    if (cut->start_unused)
        kmp_text_put(text, "; its start value is not used");
}

static void show_cuts(kmp_text *text, const kempe_model *model)
{
    if (model->cut_count > 0)
        kmp_text_put(text, "cuts\n");
    for (int i = 0; i < model->cut_count; i++) {
        kmp_text_put(text, "  ");
        kmp_cut_print(text, &model->cuts[i]);
        kmp_text_put(text, "\n");
    }
}

static void show_fields(kmp_text *text, const kempe_model *model, const kmp_force *force)
{
    for (int k = 0; k < kmp_force_field_count; k++) {
        if (kmp_force_fields[k].kind != force->kind || !kmp_force_has(force, k))
            continue;
        kmp_text_printf(text, ", %s ", kmp_force_key(model, force->motion, kmp_force_fields[k].key));
        if (kmp_force_fields[k].size == 1)
            kmp_text_number(text, kmp_force_get(force, k)->value);
        else
            kmp_model_put_vector(text, kmp_force_get(force, k));
    }
}

static void put_components(kmp_text *text, const kempe_model *model, const kmp_force *force)
{
    for (int k = 0; k < 3; k++) {
        kmp_text_put(text, k > 0 ? ", " : "[");
        kmp_model_put_expr(text, model, force->vector[k]);
    }
    kmp_text_put(text, "]");
}

static void show_force(kmp_text *text, const kempe_model *model, const kmp_force *force)
{
    const char *word = kmp_force_rows[force->kind].word;
    kmp_text_printf(text, "  %s: ", force->name);
    if (force->kind == KMP_FORCE_WHEEL) {
        kmp_text_put(text, "wheel");
    } else if (!word) {
        kmp_text_printf(text, "%s ", kmp_force_rows[force->kind].place);
        kmp_model_put_point(text, model, force->point[0]);
        kmp_text_put(text, " - ");
        kmp_model_put_point(text, model, force->point[1]);
    } else if (force->motion >= 0) {
        kmp_text_printf(text, "%s on %s", kmp_force_key(model, force->motion, word),
                        model->motions[force->motion].name);
    } else if (force->kind == KMP_FORCE_BODY) {
        kmp_text_printf(text, "torque on %s", model->bodies[force->body].name);
    } else {
        kmp_text_put(text, "force at ");
        kmp_model_put_point(text, model, force->point[0]);
    }
    show_fields(text, model, force);
    if (force->effort) {
        kmp_text_put(text, " = ");
        kmp_model_put_expr(text, model, force->effort);
    } else if (force->vector[0]) {
        kmp_text_put(text, " = ");
        put_components(text, model, force);
    }
    kmp_text_put(text, "\n");
}

static void show_forces(kmp_text *text, const kempe_model *model)
{
    if (model->force_count > 0)
        kmp_text_put(text, "forces\n");
    for (int i = 0; i < model->force_count; i++)
        show_force(text, model, &model->forces[i]);
}

static void show_sensors(kmp_text *text, const kempe_model *model)
{
    if (model->sensor_count > 0)
        kmp_text_put(text, "sensors\n");
    for (int i = 0; i < model->sensor_count; i++) {
        kmp_text_printf(text, "  %s = ", model->sensors[i].name);
        kmp_model_put_expr(text, model, model->sensors[i].expr);
        kmp_text_put(text, "\n");
    }
}

static void show_goal(kmp_text *text, const kempe_model *model, const kmp_goal *goal)
{
    kmp_text_put(text, "  ");
    kmp_model_put_goal(text, model, goal);
    kmp_text_put(text, ": ");
    if (goal->width == 3) {
        kmp_model_put_vector(text, goal->value);
        kmp_text_put(text, ", ");
        kmp_model_put_vector(text, goal->weight);
    } else {
        kmp_text_number(text, goal->value[0].value);
        kmp_text_put(text, ", ");
        kmp_text_number(text, goal->weight[0].value);
    }
    kmp_text_put(text, "\n");
}

static void show_start(kmp_text *text, const kempe_model *model)
{
    const kmp_start *start = &model->start;
    kmp_text_printf(text, "coordinates (%d): start q, qd\n", model->motion_count);
    for (int i = 0; i < model->motion_count; i++) {
        kmp_text_printf(text, "  %s: ", model->motions[i].name);
        kmp_text_number(text, start->q[i].value);
        kmp_text_put(text, ", ");
        kmp_text_number(text, start->qd[i].value);
        kmp_text_put(text, start->hold[i] ? ", held\n" : "\n");
    }
    if (start->goal_count > 0)
        kmp_text_put(text, "goals: value, weight\n");
    for (int i = 0; i < start->goal_count; i++)
        show_goal(text, model, &start->goals[i]);
}

static void show_setting(kmp_text *text, const char *name, double value)
{
    if (value > 0) {
        kmp_text_printf(text, " %s ", name);
        kmp_text_number(text, value);
    }
}

static void show_run(kmp_text *text, const kempe_model *model)
{
    const kmp_run_settings *run = &model->run;
    kmp_text_put(text, "run:");
    show_setting(text, "t_end", run->t_end);
    show_setting(text, "output_step", run->output_step);
    show_setting(text, "rtol", run->rtol);
    show_setting(text, "atol", run->atol);
    show_setting(text, "max_steps", (double)run->max_steps);
    if (run->formulation)
        kmp_text_printf(text, " formulation %s", run->formulation);
    if (run->form)
        kmp_text_printf(text, " form %s", run->form);
    if (run->integrator)
        kmp_text_printf(text, " integrator %s", run->integrator);
    if (run->dynamics != KMP_DYNAMICS_AUTO)
        kmp_text_printf(text, " dynamics %s", kmp_dynamics_word(run->dynamics));
    if (run->change_points != KMP_CHANGE_POINTS_CROSS)
        kmp_text_printf(text, " change_points %s", kmp_change_points_word(run->change_points));
    for (int i = 0; i < run->independent_count; i++)
        kmp_text_printf(text, "%s%s", i == 0 ? " u " : ", ", model->motions[run->independent[i]].name);
    for (int i = 0; i < run->until_count; i++) {
        kmp_text_put(text, i == 0 ? " until " : ", ");
        kmp_model_put_expr(text, model, run->until[i]);
    }
    kmp_text_put(text, "\noutputs:");
    for (int i = 0; i < model->output_count; i++) {
        kmp_text_put(text, " ");
        kmp_output_print(text, model, &model->outputs[i]);
    }
    kmp_text_put(text, "\n");
}

void kmp_model_show(kmp_text *text, const kempe_model *model)
{
    kmp_text_printf(text, "%s\ngravity ", model->name);
    kmp_model_put_vector(text, model->gravity);
    kmp_text_put(text, "\n");
    show_parameters(text, model);
    show_tables(text, model);
    kmp_model_show_tracks(text, model);
    show_unknowns(text, model);
    show_bodies(text, model);
    kmp_model_show_wheels(text, model);
    show_closures(text, model);
    show_cuts(text, model);
    show_forces(text, model);
    show_sensors(text, model);
    show_start(text, model);
    show_run(text, model);
}
