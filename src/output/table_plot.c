/* SPDX-License-Identifier: BSD-3-Clause */
/* Columns of a table as curves: a plot for each unit, one below the other over the same horizontal axis. */
#include "base/file.h"
#include "base/memory.h"
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
    int plots, unit[MOST_CURVES];     /* of each plot: a column that has its unit */
} drawing;

/* -- choice of columns ------------------------------------------------------------------------------- */

/* "position(coupler.C).x" is the column position.coupler.C.x. */
static const char *column_name(kmp_arena *arena, const char *word)
{
    char *name = kmp_arena_strdup(arena, word), *to = name;
    for (const char *s = name; s && *s; s++)
        if (*s != ')')
            *to++ = (char)(*s == '(' ? '.' : *s);
    if (name)
        *to = '\0';
    return name;
}

/* A column is meant by its name, or by that of the output whose component it is. */
static bool is_meant(const kempe_table *table, int column, const char *name)
{
    size_t length = strlen(name);
    const char *own = kempe_table_column_name(table, column);
    return kempe_table_values(table, column) && strncmp(own, name, length) == 0 && (!own[length] || own[length] == '.');
}

static kempe_status fail_unknown(const drawing *d, const char *word)
{
    kmp_text names = {0};
    for (int c = 0; c < kempe_table_column_count(d->table); c++)
        if (kempe_table_values(d->table, c))
            kmp_text_printf(&names, "%s%s", c ? ", " : "", kempe_table_column_name(d->table, c));
    kempe_status status = kmp_fail(d->context, KEMPE_E_ARGUMENT, "there is no column '%s' to draw; the columns are %s",
                                   word, names.s ? names.s : "");
    kmp_text_free(&names);
    return status;
}

static kempe_status add_curves(drawing *d, const char *word)
{
    const char *name = column_name(&d->arena, word);
    int before = d->count;
    for (int c = 0; name && c < kempe_table_column_count(d->table) && d->count < MOST_CURVES; c++)
        if (is_meant(d->table, c, name))
            d->curve[d->count++] = c;
    if (!name)
        return kmp_fail_memory(d->context);
    return d->count > before || d->count == MOST_CURVES ? KEMPE_OK : fail_unknown(d, word);
}

static kempe_status choose_x(drawing *d, const char *word)
{
    const char *name = word ? column_name(&d->arena, word) : NULL;
    for (d->x = 0; d->x < kempe_table_column_count(d->table); d->x++)
        if (name ? is_meant(d->table, d->x, name) : kempe_table_values(d->table, d->x) != NULL)
            return KEMPE_OK;
    return fail_unknown(d, word ? word : "of numbers");
}

static kempe_status choose(drawing *d, const char *x, const char *y)
{
    char **words = NULL;
    int count = kmp_text_words(&d->arena, y, &words);
    KMP_TRY(choose_x(d, x));
    d->along = d->x == 0;
    for (int k = 0; k < count; k++)
        KMP_TRY(add_curves(d, words[k]));
    for (int c = 0; count == 0 && c < kempe_table_column_count(d->table) && d->count < MOST_CURVES; c++)
        if (c != d->x && kempe_table_values(d->table, c))
            d->curve[d->count++] = c;
    if (d->arena.failed)
        return kmp_fail_memory(d->context);
    if (d->count == 0 || kempe_table_row_count(d->table) == 0)
        return kmp_fail(d->context, KEMPE_E_FAILED, "there is nothing to draw: the table has no rows of numbers");
    return KEMPE_OK;
}

/* -- the picture ------------------------------------------------------------------------------------- */

static bool has_unit(const drawing *d, int curve, int plot)
{
    return strcmp(kempe_table_unit(d->table, d->curve[curve]), kempe_table_unit(d->table, d->unit[plot])) == 0;
}

static void sort_by_unit(drawing *d)
{
    for (int k = 0; k < d->count; k++) {
        int plot = 0;
        while (plot < d->plots && !has_unit(d, k, plot))
            plot++;
        if (plot == d->plots)
            d->unit[d->plots++] = d->curve[k];
    }
}

static void draw_plot(const drawing *d, kmp_text *text, int plot, double top)
{
    kmp_plot p = kmp_plot_inside(text, 0, top, WIDTH, HEIGHT);
    const double *x = kempe_table_values(d->table, d->x);
    int rows = kempe_table_row_count(d->table);
    for (int k = 0; k < d->count; k++)
        for (int row = 0; has_unit(d, k, plot) && row < rows; row++)
            kmp_plot_reach(&p, x[row], kempe_table_values(d->table, d->curve[k])[row]);
    p.axis[0].name = kempe_table_column_name(d->table, d->x);
    p.axis[0].unit = kempe_table_unit(d->table, d->x);
    p.axis[0].exact = d->along;
    p.square = strcmp(p.axis[0].unit, "m") == 0 && strcmp(kempe_table_unit(d->table, d->unit[plot]), "m") == 0;
    p.axis[1].name = kempe_table_unit(d->table, d->unit[plot]);
    kmp_plot_begin(&p, "%s", "");
    for (int k = 0; k < d->count; k++) {
        if (!has_unit(d, k, plot))
            continue;
        kmp_curve_begin(&p, "curve", kmp_plot_colour(k));
        for (int row = 0; row < rows; row++)
            kmp_curve_to(&p, x[row], kempe_table_values(d->table, d->curve[k])[row]);
        kmp_curve_end(&p);
    }
    kmp_plot_end(&p);
}

static void draw(drawing *d, kmp_text *text)
{
    sort_by_unit(d);
    double height = HEIGHT * d->plots;
    kmp_picture_begin(text, WIDTH, height + LINE * (d->count + 1), "");
    for (int plot = 0; plot < d->plots; plot++)
        draw_plot(d, text, plot, HEIGHT * plot);
    for (int k = 0; k < d->count; k++)
        kmp_picture_entry(text, LEFT, height + LINE * (k + 0.5), "curve", kmp_plot_colour(k), "%s",
                          kempe_table_column_name(d->table, d->curve[k]));
    kmp_picture_end(text);
}

kempe_status kempe_table_write_svg(const kempe_table *table, const char *x, const char *y, const char *path)
{
    KMP_WANTED(NULL, table, "table");
    drawing d = {.context = kmp_table_context(table), .table = table};
    KMP_WANTED(d.context, path, "path");
    kmp_text text = {0};
    kmp_context_clear(d.context);
    kempe_status status = choose(&d, x, y);
    if (status == KEMPE_OK) {
        draw(&d, &text);
        status = kmp_file_write(d.context, path, &text);
    }
    kmp_arena_free(&d.arena);
    return status;
}
