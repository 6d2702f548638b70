/* SPDX-License-Identifier: BSD-3-Clause */
/* A sweep as text, JSON, tables and a picture. */
#include "analyses/kinematics/position_sweep.h"
#include "analyses/kinematics/sweep.h"
#include "analyses/parts/study_print.h"
#include "model/data/model.h"
#include "model/data/output_table.h"
#include "model/read/loads.h"
#include "output/plot.h"
#include "output/print.h"
#include "output/result_table.h"
#include <kempe/kinematics.h>
#include <math.h>
#include <string.h>

/* -- parts ------------------------------------------------------------------------------------------- */

static kmp_shown shown_as(const kempe_kinematics *k, const kmp_sweep_parameter *parameter)
{
    return kmp_shown_as(k->system->context, kmp_kinematics_unit(k, parameter));
}

static double value_at(const kempe_kinematics *k, double s)
{
    return kmp_sweep_parameter_value(&k->parameter[k->first], s);
}

/* An output of the model that is in no row, though somebody asks for it: it needs multipliers. */
static bool is_left_out(const kempe_model *model, int output)
{
    return !model->outputs[output].unasked && kmp_output_has_loads(model, &model->outputs[output]);
}

/* A deformation that is in balance with its loads, in place of a value that it keeps. */
static bool is_moved(const kempe_kinematics *k, const kmp_sweep_parameter *parameter)
{
    return k->statics && parameter->coordinate >= 0 && k->moves[parameter->coordinate];
}

/* Least and greatest of entry i of a table, of finite values only. */
typedef struct span {
    double least, most;
} span;

static span span_of(const kempe_kinematics *k, const double *table, int width, int i)
{
    span r = {INFINITY, -INFINITY};
    for (int row = 0; row < k->count; row++) {
        double x = table[(size_t)row * (size_t)width + (size_t)i];
        r.least = x < r.least ? x : r.least;
        r.most = x > r.most ? x : r.most;
    }
    return r.least <= r.most ? r : (span){NAN, NAN};
}

static double largest(span r)
{
    return fmax(fabs(r.least), fabs(r.most));
}

/* The largest of a table of all coordinates, each over its scale. */
static double size_of(const kempe_kinematics *k, const double *table)
{
    double size = 0;
    for (int i = 0; i < kmp_model_coordinates(k->system->model); i++)
        size = fmax(size, largest(span_of(k, table, k->system->n, i)) / k->system->scale[i]);
    return size;
}

/* -- text -------------------------------------------------------------------------------------------- */

static void show_dead(kmp_text *text, const kempe_kinematics *k)
{
    for (int d = 0; d < k->dead_count; d++) {
        const kmp_dead_centre *c = &k->dead[d];
        const kmp_sweep_parameter *parameter = &k->parameter[k->first];
        kmp_text_printf(text, "\ndead centre at %s = %.6g %s, its %s value on this branch\n",
                        kmp_kinematics_name(k, parameter), shown_as(k, parameter).factor * c->value,
                        shown_as(k, parameter).unit, c->largest ? "greatest" : "least");
        for (int i = 0; i < k->parameter_count; i++)
            if (i != k->first && k->parameter[i].from != k->parameter[i].to)
                kmp_text_printf(text, "  with %s = %.6g %s\n", kmp_kinematics_name(k, &k->parameter[i]),
                                shown_as(k, &k->parameter[i]).factor *
                                    kmp_sweep_parameter_value(&k->parameter[i], c->s),
                                shown_as(k, &k->parameter[i]).unit);
        kmp_text_put(
            text,
            "  the mechanism can return on two branches there, and velocities relative to it grow without bound\n");
        if (*c->instead)
            kmp_text_printf(text, "  alternative driving coordinates: %s\n", c->instead);
        if (k->statics)
            kmp_text_put(text, "  it is computed with the deformations of the start\n");
        for (int i = 0; i < kmp_model_coordinates(k->system->model); i++)
            kmp_text_printf(
                text, "    %s = %.6g %s\n", k->system->model->motions[i].name,
                kmp_print_value(k->system, i, kmp_print_clean(c->q[i], KMP_PRINT_NOISE * k->system->scale[i])),
                kmp_print_unit(k->system, i));
    }
}

enum { MOST_OUTPUTS = 24 };

/* The unit of column c of the outputs, as it is in the model. */
static const char *unit_of(const kempe_kinematics *k, int c)
{
    const kempe_model *model = k->system->model;
    const kmp_output *output = &model->outputs[k->column[c].output];
    const char *unit = kmp_output_unit(model, output, k->column[c].component);
    return output->kind == KMP_OUTPUT_SENSOR ? kmp_print_unknown(k->system->context, unit) : unit;
}

/* The row with the least or the greatest value of an output; -1: it has none. */
static int row_of(const kempe_kinematics *k, int c, bool greatest)
{
    const span r = span_of(k, k->shown, k->width, c);
    for (int row = 0; row < k->count; row++)
        if (k->shown[(size_t)row * (size_t)k->width + (size_t)c] == (greatest ? r.most : r.least))
            return row;
    return -1;
}

/* Values of an output that are smaller are rounding: a part of the largest of all its components. */
static double noise_of(const kempe_kinematics *k, int c)
{
    double size = 0;
    for (int i = 0; i < k->width; i++)
        if (k->column[i].output == k->column[c].output)
            size = fmax(size, largest(span_of(k, k->shown, k->width, i)));
    return KMP_PRINT_NOISE * size;
}

/* The extreme values of outputs among the rows, and where they are. */
static void show_outputs(kmp_text *text, const kempe_kinematics *k)
{
    const kmp_sweep_parameter *parameter = &k->parameter[k->first];
    const kmp_shown swept = shown_as(k, parameter);
    const int count = k->width < MOST_OUTPUTS ? k->width : MOST_OUTPUTS;
    if (count == 0 || k->count == 0)
        return;
    int width = 10;
    for (int c = 0; c < count; c++)
        width = (int)strlen(k->column[c].name) > width ? (int)strlen(k->column[c].name) : width;
    kmp_text at = {0};
    kmp_text_printf(&at, "at %s%s%s", kmp_kinematics_name(k, parameter), *swept.unit ? ", " : "", swept.unit);
    const int wide = at.length > 13 ? (int)at.length : 13;
    const char *place = at.s ? at.s : "";
    kmp_text_printf(text, "\n%-*s  %-6s  %13s  %*s  %13s  %*s\n", width, "output", "unit", "least", wide, place,
                    "greatest", wide, place);
    kmp_text_free_part(text, &at);
    for (int c = 0; c < count; c++) {
        const kmp_shown as = kmp_shown_as(k->system->context, unit_of(k, c));
        const double noise = noise_of(k, c);
        kmp_text_printf(text, "%-*s  %-6s", width, k->column[c].name, as.unit);
        for (int greatest = 0; greatest < 2; greatest++) {
            const int row = row_of(k, c, greatest);
            const double x = row < 0 ? NAN : k->shown[(size_t)row * (size_t)k->width + (size_t)c];
            kmp_text_printf(text, "  %13.6g  %*.6g", as.factor * kmp_print_clean(x, noise), wide,
                            row < 0 ? NAN : swept.factor * value_at(k, k->s[row]));
        }
        kmp_text_put(text, "\n");
    }
    if (k->width > count)
        kmp_text_printf(text, "and %d more\n", k->width - count);
}

static void show_all(kmp_text *text, const void *result)
{
    const kempe_kinematics *k = result;
    kmp_print_title(text, k->system->model, kmp_outcome_of(k->status));
    kmp_text_printf(text, "%d of %d rows\n", k->count, k->requested);
    if (k->reason)
        kmp_print_wrapped(text, "  ", 4, k->reason);
    kmp_print_doubts(text, kmp_outcome_of(k->status), k->warnings);
    for (int i = 0; i < k->parameter_count; i++) {
        const kmp_sweep_parameter *parameter = &k->parameter[i];
        kmp_shown as = shown_as(k, parameter);
        if (kmp_state_of(k->system->model, parameter->coordinate) || is_moved(k, parameter))
            continue;
        if (parameter->from != parameter->to)
            kmp_text_printf(text, "  %s swept from %.6g to %.6g %s", kmp_kinematics_name(k, parameter),
                            as.factor * parameter->from, as.factor * parameter->to, as.unit);
        else
            kmp_text_printf(text, "  %s held at %.9g %s", kmp_kinematics_name(k, parameter),
                            as.factor * parameter->from, as.unit);
        if (i == k->first && isfinite(k->speed))
            kmp_text_printf(text, ", at %.6g %s/s", as.factor * k->speed, as.unit);
        kmp_text_put(text, "\n");
    }
    if (k->statics)
        kmp_text_put(text, "  deformations in balance with their loads at rest\n");
    if (k->system->model->state_count > 0)
        kmp_text_put(text, "  states keep their start values\n");
    for (int c = 0; c < k->system->model->closure_count; c++)
        if (k->released[c])
            kmp_text_printf(text, "  '%s' of the model is deactivated\n", k->system->model->closures[c].name);
    if (k->count > 0) {
        int n = k->system->n, width = kmp_print_width(k->system, KMP_QUANTITY_Q);
        width = width > 10 ? width : 10;
        kmp_text_printf(text, "\n%-*s  %-4s  %13s  %13s  %13s  %13s\n", width, "coordinate", "unit", "least",
                        "greatest", "max |qd|", "max |qdd|");
        const double sizes[] = {size_of(k, k->q), size_of(k, k->q), size_of(k, k->qd), size_of(k, k->qdd)};
        for (int i = 0; i < kmp_model_coordinates(k->system->model); i++) {
            span q = span_of(k, k->q, n, i);
            kmp_text_printf(text, "%-*s  %-4s", width, k->system->model->motions[i].name, kmp_print_unit(k->system, i));
            const double cells[] = {q.least, q.most, largest(span_of(k, k->qd, n, i)),
                                    largest(span_of(k, k->qdd, n, i))};
            for (int c = 0; c < 4; c++) {
                const double noise = KMP_PRINT_NOISE * sizes[c] * k->system->scale[i];
                kmp_text_printf(text, "  %13.6g", kmp_print_value(k->system, i, kmp_print_clean(cells[c], noise)));
            }
            kmp_text_put(text, "\n");
        }
    }
    show_outputs(text, k);
    show_dead(text, k);
    kmp_shown as = shown_as(k, &k->parameter[k->first]);
    for (int c = 0; c < k->change_count; c++)
        kmp_text_printf(text, "\nchange point (bifurcation) at %s = %.8g %s: crossed without changing branch\n",
                        kmp_kinematics_name(k, &k->parameter[k->first]), as.factor * value_at(k, k->change[c].s),
                        as.unit);
    const kempe_model *model = k->system->model;
    int listed = 0;
    for (int o = 0; o < model->output_count; o++)
        if (is_left_out(model, o)) {
            kmp_text_put(text, listed++ ? ", " : "\nomitted, because they need forces: ");
            kmp_output_print(text, model, &model->outputs[o]);
        }
    kmp_text_put(text, listed ? "\n" : "");
    kmp_text_printf(text, "\n%ld steps, %ld repeated, %ld corrections, independent coordinates changed %ld times",
                    k->effort.steps, k->effort.rejected, k->effort.newton, k->effort.exchanges);
    kmp_backend_print(text, k->backend);
    kmp_text_printf(text, ", %.2g s\n", k->cpu_s);
}

/* -- JSON -------------------------------------------------------------------------------------------- */

static void json_all(kmp_text *text, const void *result)
{
    const kempe_kinematics *k = result;
    kmp_json j = kmp_print_head(text, k->system, kmp_outcome_of(k->status), k->reason, k->system->build_s, k->warnings);
    kmp_json_array(&j, "driven");
    for (int i = 0; i < k->parameter_count; i++) {
        const kmp_sweep_parameter *parameter = &k->parameter[i];
        if (kmp_state_of(k->system->model, parameter->coordinate) || is_moved(k, parameter))
            continue;
        kmp_json_put(&j, "{ name %s unit %s from %g to %g held %d }", kmp_kinematics_name(k, parameter),
                     kmp_kinematics_unit(k, parameter), parameter->from, parameter->to, i >= k->driven);
    }
    kmp_json_put(&j, "] elastic %s speed %g released [", k->statics ? "static" : "held", k->speed);
    for (int c = 0; c < k->system->model->closure_count; c++)
        if (k->released[c])
            kmp_json_string(&j, NULL, k->system->model->closures[c].name);
    kmp_json_put(&j, "] rows %d rows_asked %d", k->count, k->requested);
    int n = k->system->n;
    kmp_json_object(&j, "coordinates");
    for (int i = 0; i < kmp_model_coordinates(k->system->model); i++) {
        span q = span_of(k, k->q, n, i);
        kmp_json_put(&j, "%s { least %g greatest %g qd_max %g qdd_max %g }", k->system->model->motions[i].name, q.least,
                     q.most, largest(span_of(k, k->qd, n, i)), largest(span_of(k, k->qdd, n, i)));
    }
    kmp_json_put(&j, "} outputs {");
    for (int c = 0; c < k->width; c++) {
        span x = span_of(k, k->shown, k->width, c);
        kmp_json_put(&j, "%s { least %g greatest %g }", k->column[c].name, x.least, x.most);
    }
    kmp_json_put(&j, "} dead_centres [");
    for (int d = 0; d < k->dead_count; d++) {
        const kmp_dead_centre *c = &k->dead[d];
        kmp_json_put(&j, "{ s %g coordinate %s value %g extreme %s determined %g margin %g instead %s", c->s,
                     kmp_kinematics_name(k, &k->parameter[k->first]), c->value, c->largest ? "greatest" : "least",
                     c->determined, c->margin, c->instead);
        kmp_print_entries(&j, "q", k->system, KMP_QUANTITY_Q, c->q);
        kmp_json_end(&j);
    }
    kmp_json_put(&j, "] change_points [");
    for (int c = 0; c < k->change_count; c++) {
        kmp_json_put(&j, "{ s %g value %g margin %g", k->change[c].s, value_at(k, k->change[c].s), k->change[c].margin);
        kmp_print_entries(&j, "q", k->system, KMP_QUANTITY_Q, k->change[c].q);
        kmp_json_end(&j);
    }
    kmp_json_end(&j);
    const kempe_model *model = k->system->model;
    kmp_json_array(&j, "left_out");
    for (int o = 0; o < model->output_count; o++) {
        kmp_text name = {0};
        if (!is_left_out(model, o))
            continue;
        kmp_output_print(&name, model, &model->outputs[o]);
        kmp_json_text(&j, NULL, &name);
    }
    kmp_json_put(&j, "] work { backend %s steps %ld rejected %ld newton %ld exchanges %ld cpu_s %g } }", k->backend,
                 k->effort.steps, k->effort.rejected, k->effort.newton, k->effort.exchanges, k->cpu_s);
}

KMP_PRINT(kempe_kinematics, kinematics, kinematics->system->context, json_all, show_all)

/* -- tables ------------------------------------------------------------------------------------------- */

static void fill_rows(kempe_table *table, const void *result)
{
    const kempe_kinematics *k = result;
    const kempe_system *s = k->system;
    kmp_tabulate_outcome(table, kmp_outcome_of(k->status));
    kmp_tabulate_columns(table, "s t[s]");
    for (kmp_quantity quantity = KMP_QUANTITY_Q; quantity <= KMP_QUANTITY_QDD; quantity++)
        kmp_tabulate_quantity(table, s, quantity);
    for (int c = 0; c < k->width; c++) {
        kmp_tabulate_column(table, unit_of(k, c), "%s", k->column[c].name);
    }
    for (int row = 0; row < k->count; row++) {
        ptrdiff_t at = (ptrdiff_t)row * s->n;
        KMP_TABULATE(table, "%g %g", k->s[row],
                     k->time < 0 ? k->s[row] / k->rate : kmp_sweep_parameter_value(&k->parameter[k->time], k->s[row]));
        kmp_tabulate_values(table, s, KMP_QUANTITY_Q, k->q + at);
        kmp_tabulate_values(table, s, KMP_QUANTITY_QD, k->qd + at);
        kmp_tabulate_values(table, s, KMP_QUANTITY_QDD, k->qdd + at);
        kmp_tabulate_numbers(table, k->width, k->shown + (ptrdiff_t)row * k->width);
    }
}

static void fill_dead_centres(kempe_table *table, const void *result)
{
    const kempe_kinematics *k = result;
    const kmp_sweep_parameter *parameter = &k->parameter[k->first];
    kmp_tabulate_columns(table, "s coordinate[words]");
    kmp_tabulate_column(table, kmp_kinematics_unit(k, parameter), "value");
    kmp_tabulate_columns(table, "extreme[words] determined margin instead[words]");
    kmp_tabulate_quantity(table, k->system, KMP_QUANTITY_Q);
    for (const kmp_dead_centre *dead = k->dead; dead < k->dead + k->dead_count; dead++) {
        KMP_TABULATE(table, "%g %s %g %s %g %g %s", dead->s, kmp_kinematics_name(k, parameter), dead->value,
                     dead->largest ? "greatest" : "least", dead->determined, dead->margin, dead->instead);
        kmp_tabulate_values(table, k->system, KMP_QUANTITY_Q, dead->q);
    }
}

static void fill_change_points(kempe_table *table, const void *result)
{
    const kempe_kinematics *k = result;
    const kmp_sweep_parameter *parameter = &k->parameter[k->first];
    kmp_tabulate_columns(table, "s");
    kmp_tabulate_column(table, kmp_kinematics_unit(k, parameter), "value");
    kmp_tabulate_columns(table, "margin");
    kmp_tabulate_quantity(table, k->system, KMP_QUANTITY_Q);
    for (const kmp_change_point *change = k->change; change < k->change + k->change_count; change++) {
        KMP_TABULATE(table, "%g %g %g", change->s, kmp_sweep_parameter_value(parameter, change->s), change->margin);
        kmp_tabulate_values(table, k->system, KMP_QUANTITY_Q, change->q);
    }
}

KMP_TABLES(kempe_kinematics, kinematics, kinematics->system->context, {"rows", fill_rows},
           {"dead_centres", fill_dead_centres}, {"change_points", fill_change_points})

/* -- picture ------------------------------------------------------------------------------------------------ */

/* The paths of position outputs, both axes to one scale, in the plane of the two ground axes with the largest extent.
 * The beginning of the sweep and dead centres are marked. */

/* Pixels: the longer side of the paths, the least of a side, the space around them, a line of the legend, its left. */
enum { SIDE = 560, LEAST = 160, AROUND = 100, LINE = 18, EDGE = 16 };

/* Column c begins a path. */
static bool begins_path(const kempe_kinematics *k, int c)
{
    return k->system->model->outputs[k->column[c].output].kind == KMP_OUTPUT_POSITION && k->column[c].component == 0;
}

/* Point i of a path: its rows, and the dead centres before and after them. NULL: no more. */
static const double *place(const kempe_kinematics *k, int i, int column)
{
    bool before = k->dead_count > 0 && k->count > 0 && k->dead[0].s < k->s[0];
    int row = i - before;
    if (row < 0)
        return k->dead[0].shown + column;
    if (row < k->count)
        return k->shown + (size_t)row * (size_t)k->width + column;
    return row == k->count && k->dead_count > before ? k->dead[k->dead_count - 1].shown + column : NULL;
}

static double extent(const kmp_axis *axis)
{
    return axis->high - axis->low;
}

static void draw_path(kmp_plot *p, const kempe_kinematics *k, int column, const int *plane, const char *colour)
{
    const double *x;
    kmp_curve_begin(p, "curve", colour);
    for (int i = 0; (x = place(k, i, column)) != NULL; i++)
        kmp_curve_to(p, x[plane[0]], x[plane[1]]);
    kmp_curve_end(p);
    x = place(k, 0, column);
    if (x)
        kmp_plot_dot(p, x[plane[0]], x[plane[1]], colour);
    for (int d = 0; d < k->dead_count; d++)
        kmp_plot_cross(p, k->dead[d].shown[column + plane[0]], k->dead[d].shown[column + plane[1]]);
}

static void draw(const kempe_kinematics *k, kmp_text *text, int paths)
{
    kmp_axis axis[3];
    int plane[2], line = 0;
    double side[2], top = LINE * (paths + 1);
    /* Extends the range of each ground axis to all paths. */
    const double *x;
    for (int a = 0; a < 3; a++)
        axis[a] = (kmp_axis){.name = (const char *[]){"x, m", "y, m", "z, m"}[a], .low = INFINITY, .high = -INFINITY};
    for (int c = 0; c < k->width; c++)
        for (int i = 0; begins_path(k, c) && (x = place(k, i, c)) != NULL; i++)
            for (int a = 0; a < 3; a++) {
                axis[a].low = fmin(axis[a].low, x[a]);
                axis[a].high = fmax(axis[a].high, x[a]);
            }
    /* The view is along the axis of the least extent; the others are in right-handed order. */
    int away = 2;
    for (int a = 1; a >= 0; a--)
        if (extent(&axis[a]) < extent(&axis[away]))
            away = a;
    plane[0] = away == 0 ? 1 : 0;
    plane[1] = away == 2 ? 1 : 2;
    double longest = fmax(extent(&axis[plane[0]]), extent(&axis[plane[1]]));
    for (int i = 0; i < 2; i++)
        side[i] = AROUND + fmax(LEAST, longest > 0 ? SIDE * extent(&axis[plane[i]]) / longest : SIDE);
    kmp_picture_begin(text, side[0], top + side[1], "");
    const kempe_model *model = k->system->model;
    for (int c = 0; c < k->width; c++)
        if (begins_path(k, c)) {
            const kmp_point *point = &model->points[model->outputs[k->column[c].output].index];
            kmp_picture_entry(text, EDGE, LINE * (line + 1), "curve", kmp_plot_colour(line), "%s.%s",
                              model->bodies[point->body].name, point->name);
            line++;
        }
    if (k->dead_count > 0)
        kmp_picture_words(text, EDGE, LINE * (line + 1) + 4, "", "\xc3\x97 dead centre of %s",
                          kmp_kinematics_name(k, &k->parameter[k->first]));
    kmp_plot p = kmp_plot_inside(text, 0, top, side[0], side[1]);
    for (int i = 0; i < 2; i++)
        p.axis[i] = axis[plane[i]];
    p.square = true;
    kmp_plot_begin(&p, "%s", "");
    line = 0;
    for (int c = 0; c < k->width; c++)
        if (begins_path(k, c))
            draw_path(&p, k, c, plane, kmp_plot_colour(line++));
    kmp_plot_end(&p);
    kmp_picture_end(text);
}

kempe_status kempe_kinematics_write_picture(const kempe_kinematics *k, const char *path)
{
    KMP_WANTED(NULL, k, "kinematics");
    KMP_WANTED(k->system->context, path, "path");
    kempe_context *context = k->system->context;
    kmp_text text = {0};
    int paths = 0;
    kmp_context_clear(context);
    for (int c = 0; c < k->width; c++)
        paths += begins_path(k, c);
    if (paths == 0 || k->count == 0)
        return kmp_fail(context, KEMPE_E_FAILED,
                        paths > 0
                            ? "there is no row to draw a path of"
                            : "there is no path to draw: the model has no position outputs, such as 'run: outputs: "
                              "[position(BODY.POINT)]'");
    draw(k, &text, paths);
    return kmp_picture_write(context, path, &text);
}
