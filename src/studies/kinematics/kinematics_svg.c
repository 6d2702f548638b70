/* SPDX-License-Identifier: BSD-3-Clause */
/* The paths of a sweep's position outputs as a picture, both axes to one scale, in the plane of the two ground axes
 * with the largest extent. The beginning of the sweep and dead centres are marked. */
#include "base/file.h"
#include "model/tables/output_table.h"
#include "output/print.h"
#include "output/svg.h"
#include "studies/kinematics/position_sweep.h"
#include <kempe/kinematics.h>
#include <math.h>

/* Pixels: the drawing's longer side, room for labels, a mark. */
enum { SIDE = 560, MARGIN = 64, DOT = 4 };

static const char *const colours[] = {"#1f77b4", "#d62728", "#2ca02c", "#9467bd", "#ff7f0e", "#17becf", "#8c564b"};

enum { COLOURS = sizeof colours / sizeof *colours };

typedef struct picture {
    const kempe_kinematics *k;
    kmp_text *text;
    int axis[2];              /* of x, y, z: to the right and upwards */
    double least[3], most[3]; /* of all paths */
    double scale, width, height;
} picture;

/* First column of the path that column c begins; false: it begins none. */
static bool begins_path(const kempe_kinematics *k, int c)
{
    return k->system->model->outputs[k->column[c].output].kind == KMP_OUTPUT_POSITION && k->column[c].component == 0;
}

/* Point i of a path: its rows, and the dead centres before and after them. NULL: no more. */
static const double *place(const picture *p, int i, int column)
{
    const kempe_kinematics *k = p->k;
    bool before = k->dead_count > 0 && k->count > 0 && k->dead[0].s < k->s[0];
    int row = i - before;
    if (row < 0)
        return k->dead_shown[0] + column;
    if (row < k->count)
        return k->shown + (size_t)row * (size_t)k->width + column;
    return row == k->count && k->dead_count > before ? k->dead_shown[k->dead_count - 1] + column : NULL;
}

static void measure(picture *p)
{
    const double *x;
    for (int a = 0; a < 3; a++) {
        p->least[a] = INFINITY;
        p->most[a] = -INFINITY;
    }
    for (int c = 0; c < p->k->width; c++)
        for (int i = 0; begins_path(p->k, c) && (x = place(p, i, c)) != NULL; i++)
            for (int a = 0; a < 3; a++) {
                p->least[a] = fmin(p->least[a], x[a]);
                p->most[a] = fmax(p->most[a], x[a]);
            }
}

/* The view is along the axis of the least extent; the others are in right-handed order. */
static void choose_plane(picture *p)
{
    int away = 2;
    for (int a = 1; a >= 0; a--)
        if (p->most[a] - p->least[a] < p->most[away] - p->least[away])
            away = a;
    p->axis[0] = away == 0 ? 1 : 0;
    p->axis[1] = away == 2 ? 1 : 2;
    double wide = p->most[p->axis[0]] - p->least[p->axis[0]], high = p->most[p->axis[1]] - p->least[p->axis[1]];
    double longest = fmax(wide, high);
    p->scale = longest > 0 ? SIDE / longest : 1;
    p->width = 2 * MARGIN + wide * p->scale;
    p->height = 2 * MARGIN + high * p->scale;
    p->width = fmax(p->width, 0.5 * SIDE + 2 * MARGIN); /* room for words */
}

static double right(const picture *p, double x)
{
    return MARGIN + (x - p->least[p->axis[0]]) * p->scale;
}

static double down(const picture *p, double y)
{
    return MARGIN + (p->most[p->axis[1]] - y) * p->scale;
}

static void draw_path(picture *p, int column, const char *colour)
{
    const double *x;
    kmp_text_printf(p->text, "<polyline fill=\"none\" stroke=\"%s\" stroke-width=\"1.5\" points=\"", colour);
    for (int i = 0; (x = place(p, i, column)) != NULL; i++)
        kmp_text_printf(p->text, "%s%.2f,%.2f", i ? " " : "", right(p, x[p->axis[0]]), down(p, x[p->axis[1]]));
    kmp_text_put(p->text, "\"/>\n");
}

static void draw_marks(picture *p, int column, const char *colour)
{
    const kempe_kinematics *k = p->k;
    const double *first = place(p, 0, column);
    if (first)
        kmp_svg_dot(p->text, right(p, first[p->axis[0]]), down(p, first[p->axis[1]]), DOT, colour);
    for (int d = 0; d < k->dead_count; d++) {
        const double *x = k->dead_shown[d] + column;
        kmp_text_printf(p->text,
                        "<path class=\"dead\" d=\"M%.2f,%.2f m-6,-6 l12,12 m0,-12 l-12,12\" fill=\"none\" "
                        "stroke=\"#000\" stroke-width=\"2\"/>\n",
                        right(p, x[p->axis[0]]), down(p, x[p->axis[1]]));
    }
}

/* The first column's name without its axis, in the upper left. */
static void draw_name(picture *p, int column, int line, const char *colour)
{
    const kempe_model *model = p->k->system->model;
    const kmp_output *output = &model->outputs[p->k->column[column].output];
    const kmp_point *point = &model->points[output->index];
    kmp_text_printf(p->text, "<text x=\"%d\" y=\"%d\" fill=\"%s\">%s.%s</text>\n", 8, 16 + 15 * line, colour,
                    model->bodies[point->body].name, point->name);
}

/* A line of 1, 2 or 5 times a power of ten, with its length. */
static void draw_measure(picture *p)
{
    double room = 0.25 * SIDE / p->scale, length = pow(10, floor(log10(room)));
    length *= room >= 5 * length ? 5 : room >= 2 * length ? 2 : 1;
    double y = p->height - MARGIN / 3.0, x = MARGIN;
    kmp_text_printf(p->text,
                    "<path d=\"M%.2f,%.2f v-5 v5 h%.2f v-5\" fill=\"none\" stroke=\"#444\"/>\n"
                    "<text x=\"%.2f\" y=\"%.2f\" fill=\"#444\">%g m, %c to the right, %c upwards</text>\n",
                    x, y, length * p->scale, x + length * p->scale + 8, y, length, "xyz"[p->axis[0]],
                    "xyz"[p->axis[1]]);
}

static void draw(picture *p)
{
    const kempe_kinematics *k = p->k;
    int line = 0;
    measure(p);
    choose_plane(p);
    kmp_svg_begin(p->text, p->width, p->height, NULL);
    for (int c = 0; c < k->width; c++) {
        if (!begins_path(k, c))
            continue;
        const char *colour = colours[line % COLOURS];
        draw_path(p, c, colour);
        draw_marks(p, c, colour);
        draw_name(p, c, line++, colour);
    }
    if (k->dead_count > 0)
        kmp_text_printf(p->text, "<text x=\"8\" y=\"%d\">\xc3\x97 dead centre of %s</text>\n", 16 + 15 * line,
                        k->dead[0].coordinate);
    draw_measure(p);
    kmp_svg_end(p->text);
}

kempe_status kempe_kinematics_write_svg(const kempe_kinematics *k, const char *path)
{
    KMP_WANTED(NULL, k, "kinematics");
    KMP_WANTED(k->system->context, path, "path");
    kempe_context *context = k->system->context;
    kmp_text text = {0};
    picture p = {.k = k, .text = &text};
    bool any = false;
    kmp_context_clear(context);
    for (int c = 0; c < k->width; c++)
        any = any || begins_path(k, c);
    if (!any || k->count == 0)
        return kmp_fail(context, KEMPE_E_FAILED,
                        any ? "there is no row to draw a path of"
                            : "there is no path to draw: the model has no position outputs, as 'run: outputs: "
                              "[position(BODY.POINT)]' asks for");
    draw(&p);
    return kmp_file_write(context, path, &text);
}
