/* SPDX-License-Identifier: BSD-3-Clause */
/* The paths of a sweep's position outputs as a picture, both axes to one scale, in the plane of the two ground axes
 * with the largest extent. The beginning of the sweep and dead centres are marked. */
#include "analyses/kinematics/position_sweep.h"
#include "model/data/model.h"
#include "output/plot.h"
#include <kempe/kinematics.h>
#include <math.h>

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
