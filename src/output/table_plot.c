/* SPDX-License-Identifier: BSD-3-Clause */
/* Columns of a table as curves, or as points where its rows are apart or the column is one of points: a plot for each
 * unit and look, one below the other over the same horizontal axis. */
#include "base/memory.h"
#include "output/picture_file.h"
#include "output/plot.h"
#include "output/result_table.h"
#include <kempe/table.h>
#include <math.h>
#include <string.h>

/* Pixels: the picture's width, the height of a plot, a line of the legend, and its edge. */
enum { WIDTH = 740, HEIGHT = 270, LINE = 17, LEFT = 74, MOST_CURVES = 24 };

typedef struct drawing {
    kempe_context *context;
    const kempe_table *table;
    kmp_arena arena;
    int x, count, curve[MOST_CURVES]; /* columns */
    bool along;                       /* x is the first column, which ascends */
    int plots, unit[MOST_CURVES];     /* of each plot: a column that has its unit and look */
} drawing;

/* -- choice of columns ------------------------------------------------------------------------------- */

/* "position(coupler.C).x" is the column position.coupler.C.x, and blanks are points. */
static const char *column_name(kmp_arena *arena, const char *word)
{
    char *name = kmp_arena_strdup(arena, word), *to = name;
    for (const char *s = name; s && *s; s++)
        if (*s != ')')
            *to++ = (char)(*s == '(' || *s == ' ' ? '.' : *s);
    if (name)
        *to = '\0';
    return name;
}

/* A column is meant by its name, or, unless `whole`, by that of the output whose component, response or derivative it
 * is. */
static bool is_meant(drawing *d, int column, const char *name, bool whole)
{
    size_t length = strlen(name);
    const char *own = column_name(&d->arena, kempe_table_column_name(d->table, column));
    return own && kempe_table_values(d->table, column) && strncmp(own, name, length) == 0 &&
           (!own[length] || (!whole && strchr("./", own[length])));
}

static bool is_drawn(const drawing *d, int column)
{
    int k = 0;
    while (k < d->count && d->curve[k] != column)
        k++;
    return k < d->count;
}

static kempe_status fail_unknown(const drawing *d, const char *word)
{
    kmp_text sentence = {0};
    kmp_text_printf(&sentence, "there is no column '%s' to draw; the columns are ", word);
    for (int c = 0; c < kempe_table_column_count(d->table); c++)
        if (kempe_table_values(d->table, c))
            kmp_text_printf(&sentence, "%s%s", c ? ", " : "", kempe_table_column_name(d->table, c));
    return kmp_fail_text(d->context, KEMPE_E_ARGUMENT, &sentence);
}

static kempe_status choose_x(drawing *d, const char *word)
{
    const char *name = word ? column_name(&d->arena, word) : NULL;
    for (d->x = 0; d->x < kempe_table_column_count(d->table); d->x++)
        if (name ? is_meant(d, d->x, name, false) : kempe_table_values(d->table, d->x) != NULL)
            return KEMPE_OK;
    return fail_unknown(d, word ? word : "of numbers");
}

static kempe_status choose(drawing *d, const char *x, const char *y)
{
    char **words = NULL;
    int count = kmp_text_words(&d->arena, y, &words);
    KMP_TRY(choose_x(d, x));
    d->along = d->x == 0;
    for (int k = 0; k < count; k++) {
        const char *word = words[k];
        const char *name = column_name(&d->arena, word);
        bool found = false;
        for (int whole = 1; whole >= 0 && !found; whole--)
            for (int c = 0; name && c < kempe_table_column_count(d->table); c++) {
                bool meant = is_meant(d, c, name, whole);
                if (meant && !is_drawn(d, c) && d->count < MOST_CURVES)
                    d->curve[d->count++] = c;
                found = found || meant;
            }
        KMP_TRY(kmp_made(d->context, name));
        KMP_TRY(found ? KEMPE_OK : fail_unknown(d, word));
    }
    for (int c = 0; count == 0 && c < kempe_table_column_count(d->table) && d->count < MOST_CURVES; c++)
        if (c != d->x && kempe_table_values(d->table, c))
            d->curve[d->count++] = c;
    KMP_TRY(kmp_made(d->context, !d->arena.failed));
    if (d->count == 0 || kempe_table_row_count(d->table) == 0)
        return kmp_fail(d->context, KEMPE_E_FAILED, "there is nothing to draw: the table has no rows of numbers");
    return KEMPE_OK;
}

/* -- the picture ------------------------------------------------------------------------------------- */

/* Points are in the plot of their curve. */
static kmp_table_look look_of(const drawing *d, int column)
{
    kmp_table_look look = kmp_table_column_look(d->table, column);
    int curve = kmp_table_curve_of(d->table, column);
    return look != KMP_LOOK_POINTS ? look : curve >= 0 ? kmp_table_column_look(d->table, curve) : KMP_LOOK_PLAIN;
}

static bool has_points(const drawing *d, int curve)
{
    return kmp_table_rows_apart(d->table) || kmp_table_has_points(d->table, d->curve[curve]);
}

/* Points have the colour of their curve where it is drawn. */
static const char *colour_of(const drawing *d, int curve)
{
    int of = kmp_table_curve_of(d->table, d->curve[curve]);
    for (int k = 0; k < d->count; k++)
        if (d->curve[k] == of)
            return kmp_plot_colour(k);
    return kmp_plot_colour(curve);
}

static bool has_unit(const drawing *d, int curve, int plot)
{
    int column = d->curve[curve], other = d->unit[plot];
    return strcmp(kempe_table_unit(d->table, column), kempe_table_unit(d->table, other)) == 0 &&
           look_of(d, column) == look_of(d, other);
}

/* A curve through all rows, open where a periodic value goes on at the other edge. */
static void draw_curve(const drawing *d, kmp_plot *p, int curve)
{
    const double *x = kempe_table_values(d->table, d->x), *y = kempe_table_values(d->table, d->curve[curve]);
    bool periodic = kmp_table_column_look(d->table, d->curve[curve]) == KMP_LOOK_PERIODIC;
    kmp_curve_begin(p, "curve", kmp_plot_colour(curve));
    for (int row = 0; row < kempe_table_row_count(d->table); row++) {
        if (periodic && row > 0 && fabs(y[row] - y[row - 1]) > 180)
            kmp_curve_to(p, NAN, NAN);
        kmp_curve_to(p, x[row], y[row]);
    }
    kmp_curve_end(p);
}

static void draw_points(const drawing *d, kmp_plot *p, int curve)
{
    for (int row = 0; row < kempe_table_row_count(d->table); row++)
        kmp_plot_dot(p, kempe_table_values(d->table, d->x)[row], kempe_table_values(d->table, d->curve[curve])[row],
                     colour_of(d, curve));
}

static void draw_plot(const drawing *d, kmp_text *text, int plot, double top)
{
    kmp_plot p = kmp_plot_inside(text, 0, top, WIDTH, HEIGHT);
    /* The ranges of a plot; a logarithmic one ends ten decades below its top. */
    kmp_axis *x = &p.axis[0], *y = &p.axis[1];
    kmp_table_look look = look_of(d, d->unit[plot]);
    x->logarithmic = kmp_table_column_look(d->table, d->x) == KMP_LOOK_LOGARITHMIC;
    y->logarithmic = look == KMP_LOOK_LOGARITHMIC;
    for (int k = 0; k < d->count; k++)
        for (int row = 0; has_unit(d, k, plot) && row < kempe_table_row_count(d->table); row++)
            kmp_plot_reach(&p, kempe_table_values(d->table, d->x)[row], kempe_table_values(d->table, d->curve[k])[row]);
    if (y->logarithmic)
        y->low = fmax(y->low, 1e-10 * y->high);
    if (look == KMP_LOOK_PERIODIC) {
        y->low = -180;
        y->high = 180;
        y->tick = 90;
        y->exact = true;
    }
    x->name = kempe_table_column_name(d->table, d->x);
    x->unit = kempe_table_unit(d->table, d->x);
    x->exact = d->along && !kmp_table_rows_apart(d->table);
    y->name = kempe_table_unit(d->table, d->unit[plot]);
    p.square = strcmp(x->unit, "m") == 0 && strcmp(y->name, "m") == 0;
    kmp_plot_begin(&p, "%s", "");
    for (int k = 0; k < d->count; k++)
        if (has_unit(d, k, plot) && has_points(d, k))
            draw_points(d, &p, k);
        else if (has_unit(d, k, plot))
            draw_curve(d, &p, k);
    kmp_plot_end(&p);
}

kempe_status kempe_table_write_picture(const kempe_table *table, const char *x, const char *y, const char *path)
{
    KMP_WANTED(NULL, table, "table");
    drawing d = {.context = kmp_table_context(table), .table = table};
    KMP_WANTED(d.context, path, "path");
    kmp_text text = {0};
    kmp_context_clear(d.context);
    kempe_status status = choose(&d, x, y);
    if (status == KEMPE_OK) {
        /* A plot for each unit. */
        for (int k = 0; k < d.count; k++) {
            int plot = 0;
            while (plot < d.plots && !has_unit(&d, k, plot))
                plot++;
            if (plot == d.plots)
                d.unit[d.plots++] = d.curve[k];
        }
        double height = HEIGHT * d.plots;
        kmp_picture_begin(&text, WIDTH, height + LINE * (d.count + 1), "");
        for (int plot = 0; plot < d.plots; plot++)
            draw_plot(&d, &text, plot, HEIGHT * plot);
        for (int k = 0; k < d.count; k++)
            kmp_picture_entry(&text, LEFT, height + LINE * (k + 0.5), has_points(&d, k) ? NULL : "curve",
                              colour_of(&d, k), "%s", kempe_table_column_name(d.table, d.curve[k]));
        kmp_picture_end(&text);
        status = kmp_picture_write(d.context, path, &text);
    }
    kmp_arena_free(&d.arena);
    return status;
}
