/* SPDX-License-Identifier: BSD-3-Clause */
/* SVG plots: axes with ticks at 1, 2 and 5 times powers of ten, linear or logarithmic; curves as paths, with gaps where
 * values are missing. */
#include "output/plot.h"
#include "base/arena.h"
#include "base/context.h"
#include "base/file.h"
#include "base/loaded_library.h"
#include "base/text.h"
#include "output/result_table.h"
#include "platform/platform.h"
#include <kempe/kempe.h>
#include <kempe/table.h>
#include <math.h>
#include <stdbool.h>
#include <string.h>

/* Space around a frame for names and numbers; what curves may reach beyond it, with half their width. */
enum { LEFT = 74, RIGHT = 18, TOP = 34, BOTTOM = 52, EDGE = 3 };

/* Distance of numbers on an axis, about. */
static const double apart[2] = {60, 45};

#define CENTRED "text-anchor=\"middle\""

static const char common[] =
    ".frame{fill:none;stroke:#99a3a9}.grid{stroke:#d4d9db;fill:none}.fine{stroke:#eceeef;fill:none}"
    ".title{font-weight:bold}.curve{fill:none;stroke-width:1.6;stroke-linejoin:round}"
    ".dashed{fill:none;stroke-width:1.2;stroke-dasharray:5 3}.cross{stroke:#111;stroke-width:2;fill:none}";

/* On light ground, and on dark. */
static const char *const colours[][2] = {
#define KMP_PLOT_COLOUR(light, dark) {light, dark},
#include "output/plot_colours.def"
#undef KMP_PLOT_COLOUR
};

enum { COLOURS = sizeof colours / sizeof *colours };

/* -- pictures ---------------------------------------------------------------------------------------- */

void kmp_picture_begin(kmp_text *text, double width, double height, const char *style)
{
    kmp_text_printf(text,
                    "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 %.0f %.0f\" width=\"%.0f\" "
                    "height=\"%.0f\" font-family=\"sans-serif\" font-size=\"12\">\n<style>%s%s</style>\n"
                    "<rect width=\"100%%\" height=\"100%%\" fill=\"#fff\"/>\n",
                    width, height, width, height, common, style);
}

void kmp_picture_end(kmp_text *text)
{
    kmp_text_put(text, "</svg>\n");
}

const char *kmp_plot_colour(int curve)
{
    return colours[curve % COLOURS][0];
}

void kmp_plot_put_colours(kmp_text *text)
{
    for (int k = 0; k < COLOURS; k++)
        kmp_text_printf(text, "%s[\"%s\", \"%s\"]", k > 0 ? ", " : "", colours[k][0], colours[k][1]);
}

/* Frees the words. */
static void put_words(kmp_text *text, double x, double y, const char *attributes, kmp_text *words)
{
    kmp_text_printf(text, "<text x=\"%.1f\" y=\"%.1f\" %s>", x, y, attributes);
    kmp_text_escape(text, words->s ? words->s : "");
    kmp_text_put(text, "</text>\n");
    kmp_text_free_part(text, words);
}

void kmp_picture_words(kmp_text *text, double x, double y, const char *attributes, const char *format, ...)
{
    kmp_text words = {0};
    KMP_TEXT_ARGUMENTS(&words, format);
    put_words(text, x, y, attributes, &words);
}

static void put_dot(kmp_text *text, double x, double y, const char *colour)
{
    kmp_text_printf(text, "<circle cx=\"%.2f\" cy=\"%.2f\" r=\"3.5\" fill=\"%s\"/>\n", x, y, colour);
}

void kmp_picture_entry(kmp_text *text, double x, double y, const char *curve, const char *colour, const char *format,
                       ...)
{
    kmp_text words = {0};
    if (curve)
        kmp_text_printf(text, "<path class=\"%s\" stroke=\"%s\" d=\"M%.1f %.1fh30\"/>\n", curve, colour, x, y);
    else
        put_dot(text, x + 15, y, colour);
    KMP_TEXT_ARGUMENTS(&words, format);
    put_words(text, x + 38, y + 4, "", &words);
}

/* -- axes -------------------------------------------------------------------------------------------- */

/* The place of a value on an evenly divided axis: the value itself, or its logarithm. */
static double even(const kmp_axis *axis, double value)
{
    return axis->logarithmic ? (value > 0 ? log10(value) : NAN) : value;
}

static double range_of(const kmp_axis *axis)
{
    return even(axis, axis->high) - even(axis, axis->low);
}

static double length_of(const kmp_plot *p, int axis)
{
    return axis ? p->height : p->width;
}

/* The place of a value on its axis, in pixels from the left or from below. */
static double place(const kmp_plot *p, int axis, double value)
{
    const kmp_axis *a = &p->axis[axis];
    double part = (even(a, value) - even(a, a->low)) / range_of(a);
    return length_of(p, axis) * (a->reversed ? 1 - part : part);
}

/* A line of the grid; `number`: with its value. */
static void put_tick(const kmp_plot *p, int axis, double value, bool number)
{
    double at = place(p, axis, value);
    const char *class = number ? "grid" : "fine";
    if (axis == 0)
        kmp_text_printf(p->text, "<path class=\"%s\" d=\"M%.1f 0V%.1f\"/>\n", class, at, p->height);
    else
        kmp_text_printf(p->text, "<path class=\"%s\" d=\"M0 %.1fH%.1f\"/>\n", class, p->height - at, p->width);
    if (number && axis == 0)
        kmp_picture_words(p->text, at, p->height + 17, CENTRED, "%.6g", value);
    else if (number)
        kmp_picture_words(p->text, -7, p->height - at + 4, "text-anchor=\"end\"", "%.6g", value);
}

static void put_even_ticks(const kmp_plot *p, int axis)
{
    const kmp_axis *a = &p->axis[axis];
    /* 1, 2 or 5 times a power of ten. */
    double raw = range_of(a) / (length_of(p, axis) / apart[axis]), power = pow(10, floor(log10(raw)));
    double part = raw / power, whole = part < 1.5 ? 1 : part < 3.5 ? 2 : part < 7.5 ? 5 : 10;
    double each = a->tick > 0 ? a->tick : power * whole;
    for (double k = ceil(a->low / each - 1e-9); k * each <= a->high + 1e-9 * each; k++)
        put_tick(p, axis, k == 0 ? 0 : k * each, true);
}

/* Numbers at 1, 2 and 5 where there are few decades, otherwise at powers of ten, of which some are left out where there
 * are many. */
static void put_decades(const kmp_plot *p, int axis)
{
    const kmp_axis *a = &p->axis[axis];
    double decades = range_of(a), low = even(a, a->low), high = even(a, a->high);
    int every = decades <= 8 ? 1 : (int)ceil(decades / 8);
    for (int k = (int)floor(low); k <= (int)ceil(high); k++)
        for (int digit = 1; digit < 10; digit++) {
            double value = digit * pow(10, k), at = log10(value);
            bool number = k % every == 0 && (digit == 1 || (decades < 3 && (digit == 2 || digit == 5)));
            if (at >= low - 1e-9 && at <= high + 1e-9 && (number || decades <= 5))
                put_tick(p, axis, value, number);
        }
}

/* -- plots ------------------------------------------------------------------------------------------- */

kmp_plot kmp_plot_inside(kmp_text *text, double x, double y, double width, double height)
{
    const kmp_axis empty = {.name = "", .low = INFINITY, .high = -INFINITY};
    return (kmp_plot){.text = text,
                      .x = x + LEFT,
                      .y = y + TOP,
                      .width = width - LEFT - RIGHT,
                      .height = height - TOP - BOTTOM,
                      .axis = {empty, empty}};
}

void kmp_plot_reach(kmp_plot *plot, double x, double y)
{
    const double point[2] = {x, y};
    if (!isfinite(even(&plot->axis[0], x)) || !isfinite(even(&plot->axis[1], y)))
        return;
    for (int k = 0; k < 2; k++) {
        plot->axis[k].low = fmin(plot->axis[k].low, point[k]);
        plot->axis[k].high = fmax(plot->axis[k].high, point[k]);
    }
}

/* Space at both ends of a range, none below a zero; an empty one becomes any. */
static void widen(kmp_axis *axis)
{
    if (!(axis->low <= axis->high))
        axis->low = axis->high = axis->logarithmic;
    double range = range_of(axis), room = 0.05 * range;
    if (axis->logarithmic) {
        double factor = pow(10, fmax(room, 0.1));
        axis->low /= factor;
        axis->high *= factor;
        return;
    }
    room = range > 0 ? room : fmax(fabs(axis->high), 1) / 2;
    axis->low -= axis->low == 0 && range > 0 ? 0 : room;
    axis->high += room;
}

static void put_axis_name(const kmp_plot *p, int axis, double x, double y, const char *attributes)
{
    const kmp_axis *a = &p->axis[axis];
    bool unit = a->unit && a->unit[0];
    kmp_picture_words(p->text, x, y, attributes, "%s%s%s", a->name, unit ? ", " : "", unit ? a->unit : "");
}

void kmp_plot_begin(kmp_plot *plot, const char *format, ...)
{
    double width = plot->width, height = plot->height;
    kmp_text title = {0};
    for (int k = 0; k < 2; k++)
        if (!plot->axis[k].exact || !(range_of(&plot->axis[k]) > 0))
            widen(&plot->axis[k]);
    if (plot->square) {
        double each = fmax(range_of(&plot->axis[0]) / plot->width, range_of(&plot->axis[1]) / plot->height);
        for (int k = 0; k < 2; k++) {
            kmp_axis *a = &plot->axis[k];
            double middle = (a->low + a->high) / 2, half = each * length_of(plot, k) / 2;
            a->low = middle - half;
            a->high = middle + half;
        }
    }
    kmp_text_printf(plot->text, "<g transform=\"translate(%.1f %.1f)\">\n", plot->x, plot->y);
    for (int k = 0; k < 2; k++)
        if (plot->axis[k].logarithmic)
            put_decades(plot, k);
        else
            put_even_ticks(plot, k);
    kmp_text_printf(plot->text, "<rect width=\"%.1f\" height=\"%.1f\" class=\"frame\"/>\n", width, height);
    KMP_TEXT_ARGUMENTS(&title, format);
    put_words(plot->text, width / 2, -12, "class=\"title\" " CENTRED, &title);
    put_axis_name(plot, 0, width / 2, height + 36, CENTRED);
    put_axis_name(plot, 1, -height / 2, -56, CENTRED " transform=\"rotate(-90)\"");
    kmp_text_printf(plot->text, "<svg x=\"%d\" y=\"%d\" width=\"%.1f\" height=\"%.1f\" viewBox=\"%d %d %.1f %.1f\">\n",
                    -EDGE, -EDGE, width + 2 * EDGE, height + 2 * EDGE, -EDGE, -EDGE, width + 2 * EDGE,
                    height + 2 * EDGE);
}

void kmp_plot_end(kmp_plot *plot)
{
    kmp_text_put(plot->text, "</svg>\n</g>\n");
}

/* -- curves ------------------------------------------------------------------------------------------ */

double kmp_plot_x(const kmp_plot *plot, double x)
{
    return place(plot, 0, x);
}

double kmp_plot_y(const kmp_plot *plot, double y)
{
    return plot->height - place(plot, 1, y);
}

void kmp_curve_begin(kmp_plot *plot, const char *class, const char *colour)
{
    kmp_text_printf(plot->text, "<path class=\"%s\"", class);
    if (colour)
        kmp_text_printf(plot->text, " stroke=\"%s\"", colour);
    kmp_text_put(plot->text, " d=\"");
    plot->open = false;
    plot->strip.count = 0;
}

/* Many points within a strip of half a pixel are drawn as four of them: the first, the lowest, the highest, the last.
 */
static const double STRIP = 0.5;

static void put_point(kmp_plot *plot, const double at[2])
{
    kmp_text_printf(plot->text, "%c%.2f %.2f", plot->open ? 'L' : 'M', at[0], at[1]);
    plot->open = true;
}

static void widen_strip(kmp_thin_strip *s, const double at[2])
{
    const bool taken[KMP_STRIP_PLACES] = {at[1]<s->at[0][1], at[1]> s->at[1][1], true};
    for (int k = 0; k < KMP_STRIP_PLACES; k++)
        if (taken[k]) {
            memcpy(s->at[k], at, sizeof s->at[k]);
            s->number[k] = s->count;
        }
    s->count++;
}

/* The points of the strip behind its first one, in their order. */
static void end_strip(kmp_plot *plot)
{
    kmp_thin_strip *s = &plot->strip;
    const int early = s->number[0] < s->number[1] ? 0 : 1, order[] = {early, 1 - early, 2};
    for (int k = 0, before = 0; k < KMP_STRIP_PLACES; before = s->number[order[k++]])
        if (s->number[order[k]] > before)
            put_point(plot, s->at[order[k]]);
    s->count = 0;
}

void kmp_curve_to(kmp_plot *plot, double x, double y)
{
    const double at[2] = {kmp_plot_x(plot, x), kmp_plot_y(plot, y)};
    const bool there = isfinite(at[0]) && isfinite(at[1]);
    if (there && plot->strip.count > 0 && fabs(at[0] - plot->strip.x) < STRIP) {
        widen_strip(&plot->strip, at);
        return;
    }
    if (plot->strip.count > 0)
        end_strip(plot);
    if (there) {
        put_point(plot, at);
        plot->strip = (kmp_thin_strip){.x = at[0], .count = 1};
        for (int k = 0; k < KMP_STRIP_PLACES; k++)
            memcpy(plot->strip.at[k], at, sizeof plot->strip.at[k]);
    }
    plot->open = there;
}

void kmp_curve_end(kmp_plot *plot)
{
    if (plot->strip.count > 0)
        end_strip(plot);
    kmp_text_put(plot->text, "\"/>\n");
}

void kmp_plot_dot(const kmp_plot *plot, double x, double y, const char *colour)
{
    if (isfinite(kmp_plot_x(plot, x)) && isfinite(kmp_plot_y(plot, y)))
        put_dot(plot->text, kmp_plot_x(plot, x), kmp_plot_y(plot, y), colour);
}

void kmp_plot_cross(const kmp_plot *plot, double x, double y)
{
    kmp_text_printf(plot->text, "<path class=\"cross\" d=\"M%.2f %.2fm-5 -5l10 10m0 -10l-10 10\"/>\n",
                    kmp_plot_x(plot, x), kmp_plot_y(plot, y));
}

/* -- files ----------------------------------------------------------------------------------------------- */

/* librsvg draws the same SVG as a bitmap. It is loaded when a first .png is asked for: linked with it every command
 * would take 8 ms longer to start, and a machine without it could not run Kempe. */

/* Pixels of the bitmap for one of the picture. */
#define SCALE 2.0

/* Functions of librsvg 2.52, glib and cairo 1.16 by their own names; their types are opaque here. */
typedef struct rectangle {
    double x, y, width, height;
} rectangle;

typedef int put_fn(void *user, const unsigned char *bytes, unsigned int length);

static struct {
    void *(*new_from_data)(const unsigned char *data, size_t length, void **error);
    int (*get_size)(void *handle, double *width, double *height);
    int (*render)(void *handle, void *cairo, const rectangle *viewport, void **error);
    void (*unref)(void *object);
    void *(*surface)(int format, int width, int height);
    void *(*create)(void *surface);
    int (*write)(void *surface, put_fn *put, void *user);
    void (*destroy)(void *cairo);
    void (*surface_destroy)(void *surface);
} library;

/* Dependencies of librsvg are found through it. */
static bool is_there(void)
{
    static const char *const names[] = {"rsvg_handle_new_from_data",
                                        "rsvg_handle_get_intrinsic_size_in_pixels",
                                        "rsvg_handle_render_document",
                                        "g_object_unref",
                                        "cairo_image_surface_create",
                                        "cairo_create",
                                        "cairo_surface_write_to_png_stream",
                                        "cairo_destroy",
                                        "cairo_surface_destroy"};
    _Static_assert(sizeof names == sizeof library, "a name for each function");
    static kmp_loaded_library loaded = KMP_LOADED_LIBRARY(KMP_LIBRARY_FILE("rsvg-2", "2"), names, &library);
    return !kmp_library_missing(&loaded);
}

static int put(void *user, const unsigned char *bytes, unsigned int length)
{
    kmp_text *png = user;
    kmp_text_append(png, (const char *)bytes, length);
    return png->failed; /* CAIRO_STATUS_SUCCESS is 0, CAIRO_STATUS_NO_MEMORY 1 */
}

/* The bitmap of a picture; false: librsvg refused. */
static bool draw(const kmp_text *svg, kmp_text *png)
{
    double width = 0, height = 0;
    void *handle = library.new_from_data((const unsigned char *)svg->s, svg->length, NULL);
    if (!handle)
        return false;
    bool ok = library.get_size(handle, &width, &height);
    const rectangle all = {0, 0, SCALE * width, SCALE * height};
    void *surface = library.surface(0, (int)all.width, (int)all.height), *cairo = library.create(surface);
    ok = ok && library.render(handle, cairo, &all, NULL) && library.write(surface, put, png) == 0;
    library.destroy(cairo);
    library.surface_destroy(surface);
    library.unref(handle);
    return ok;
}

static kempe_status write_png(kempe_context *context, const char *path, const kmp_text *svg)
{
    kmp_text png = {0};
    KMP_TRY(kmp_made(context, !svg->failed));
    if (!is_there())
        return kmp_fail(context, KEMPE_E_FAILED,
                        "%s: a .png needs librsvg, which is not here (Debian package librsvg2-2); a .svg needs nothing",
                        path);
    if (draw(svg, &png))
        return kmp_file_write(context, path, &png);
    kmp_text_free(&png);
    return kmp_fail(context, KEMPE_E_FAILED, "%s: librsvg could not draw the picture; write it as .svg", path);
}

bool kmp_picture_png(const kmp_text *svg, kmp_text *png)
{
    kmp_text drawn = {0};
    bool ok = !svg->failed && is_there() && draw(svg, &drawn) && !drawn.failed;
    if (ok)
        kmp_text_append(png, drawn.s, drawn.length);
    kmp_text_free(&drawn);
    return ok && !png->failed;
}

kempe_status kmp_picture_write(kempe_context *context, const char *path, kmp_text *svg)
{
    if (strcmp(kmp_file_ending(path), ".png") != 0)
        return kmp_file_write(context, path, svg);
    kempe_status status = write_png(context, path, svg);
    kmp_text_free(svg);
    return status;
}

/* -- tables ---------------------------------------------------------------------------------------------- */

/* Columns of a table as curves, or as points where its rows are apart or the column is one of points: a plot for each
 * unit and look, one below the other over the same horizontal axis. */

/* Pixels: the picture's width, the height of a plot, a line of the legend, and its edge. */
enum { WIDTH = 740, HEIGHT = 270, LINE = 17, LEFT_MARGIN = 74, MOST_CURVES = 24 };

typedef struct drawing {
    kempe_context *context;
    const kempe_table *table, *earlier; /* of another computation, whose curves are dashed; NULL: none */
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

/* A word means a column by its name, by the name of the output whose component, response or derivative it is, or by the
 * name of a sensor or a state. */
enum { BY_NAME, BY_OUTPUT, BY_QUANTITY, WAYS_TO_MEAN };

static bool is_meant(drawing *d, int column, const char *name, int way)
{
    size_t length = strlen(name);
    const char *own = column_name(&d->arena, kempe_table_column_name(d->table, column));
    if (!own || !kempe_table_values(d->table, column))
        return false;
    if (way == BY_QUANTITY)
        own = strncmp(own, "sensor.", 7) == 0 ? own + 7 : strncmp(own, "state.", 6) == 0 ? own + 6 : "";
    return strncmp(own, name, length) == 0 && (!own[length] || (way != BY_NAME && strchr("./", own[length])));
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

static kempe_status fail_empty(const drawing *d)
{
    return kmp_fail(d->context, KEMPE_E_FAILED, "there is nothing to draw: the table has no rows of numbers");
}

static kempe_status choose_x(drawing *d, const char *word)
{
    const char *name = word ? column_name(&d->arena, word) : NULL;
    for (int way = name ? BY_OUTPUT : BY_NAME; way < WAYS_TO_MEAN; way++)
        for (d->x = 0; d->x < kempe_table_column_count(d->table); d->x++)
            if (name ? is_meant(d, d->x, name, way) : kempe_table_values(d->table, d->x) != NULL)
                return KEMPE_OK;
    return fail_unknown(d, word ? word : "of numbers");
}

static kempe_status choose(drawing *d, const char *x, const char *y)
{
    char **words = NULL;
    int count = kmp_text_words(&d->arena, y, &words);
    KMP_TRY(kempe_table_row_count(d->table) == 0 ? fail_empty(d) : choose_x(d, x));
    d->along = d->x == 0;
    for (int k = 0; k < count; k++) {
        const char *word = words[k];
        const char *name = column_name(&d->arena, word);
        bool found = false;
        for (int way = 0; way < WAYS_TO_MEAN && !found; way++)
            for (int c = 0; name && c < kempe_table_column_count(d->table); c++) {
                bool meant = is_meant(d, c, name, way);
                int drawn = 0;
                while (drawn < d->count && d->curve[drawn] != c)
                    drawn++;
                if (meant && drawn == d->count && d->count < MOST_CURVES)
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
    return d->count == 0 ? fail_empty(d) : KEMPE_OK;
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

/* A curve through all rows, open where a periodic value continues at the other edge. */
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

/* The column of the earlier table for a column of the table; -1: none. */
static int earlier_of(const drawing *d, int column)
{
    return d->earlier ? kempe_table_find(d->earlier, kempe_table_column_name(d->table, column)) : -1;
}

/* Calls `visit` with the points of the curve of the earlier table. */
static void walk_earlier(const drawing *d, kmp_plot *p, int curve, void (*visit)(kmp_plot *plot, double x, double y))
{
    const int x = earlier_of(d, d->x), y = earlier_of(d, d->curve[curve]);
    for (int row = 0; x >= 0 && y >= 0 && row < kempe_table_row_count(d->earlier); row++)
        visit(p, kmp_table_in_unit_of(d->table, d->x, d->earlier, row, x),
              kmp_table_in_unit_of(d->table, d->curve[curve], d->earlier, row, y));
}

/* The earlier table has the column of the horizontal axis and another one, in units of the same dimensions. */
static kempe_status check_earlier(const drawing *d)
{
    bool any = false;
    if (!d->earlier)
        return KEMPE_OK;
    const char *file = kempe_table_name(d->earlier);
    for (int k = -1; k < d->count; k++) {
        const int own = k < 0 ? d->x : d->curve[k], other = earlier_of(d, own);
        if (other >= 0 && !kmp_table_is_comparable(d->table, own, d->earlier, other))
            return kmp_fail(d->context, KEMPE_E_INPUT, "the table '%s' has '%s' in %s, this one in %s", file,
                            kempe_table_column_name(d->table, own), kempe_table_unit(d->earlier, other),
                            kempe_table_unit(d->table, own));
        any = any || (k >= 0 && other >= 0);
    }
    if (earlier_of(d, d->x) < 0)
        return kmp_fail(d->context, KEMPE_E_INPUT, "the table '%s' has no column '%s': nothing can be compared", file,
                        kempe_table_column_name(d->table, d->x));
    return any ? KEMPE_OK
               : kmp_fail(d->context, KEMPE_E_INPUT,
                          "the table '%s' has none of the columns of the picture: nothing can be compared", file);
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
    for (int k = 0; k < d->count; k++)
        if (has_unit(d, k, plot))
            walk_earlier(d, &p, k, kmp_plot_reach);
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
    p.square = strcmp(x->unit, kmp_shown_as(d->context, "m").unit) == 0 && strcmp(y->name, x->unit) == 0;
    kmp_plot_begin(&p, "%s", "");
    for (int k = 0; k < d->count; k++)
        if (has_unit(d, k, plot) && earlier_of(d, d->curve[k]) >= 0) {
            kmp_curve_begin(&p, "dashed", colour_of(d, k));
            walk_earlier(d, &p, k, kmp_curve_to);
            kmp_curve_end(&p);
        }
    for (int k = 0; k < d->count; k++)
        if (has_unit(d, k, plot) && !has_points(d, k))
            draw_curve(d, &p, k);
        else
            for (int row = 0; has_unit(d, k, plot) && row < kempe_table_row_count(d->table); row++)
                kmp_plot_dot(&p, kempe_table_values(d->table, d->x)[row],
                             kempe_table_values(d->table, d->curve[k])[row], colour_of(d, k));
    kmp_plot_end(&p);
}

static kempe_status write_picture(const kempe_table *table, const kempe_table *earlier, const char *x, const char *y,
                                  const char *path)
{
    drawing d = {.context = kmp_table_context(table), .table = table, .earlier = earlier};
    KMP_WANTED(d.context, path, "path");
    kmp_text text = {0};
    kmp_context_clear(d.context);
    kempe_status status = choose(&d, x, y);
    if (status == KEMPE_OK)
        status = check_earlier(&d);
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
        kmp_picture_begin(&text, WIDTH, height + LINE * (d.count + (earlier ? 2 : 1)), "");
        for (int plot = 0; plot < d.plots; plot++)
            draw_plot(&d, &text, plot, HEIGHT * plot);
        for (int k = 0; k < d.count; k++)
            kmp_picture_entry(&text, LEFT_MARGIN, height + LINE * (k + 0.5), has_points(&d, k) ? NULL : "curve",
                              colour_of(&d, k), "%s", kempe_table_column_name(d.table, d.curve[k]));
        if (earlier)
            kmp_picture_entry(&text, LEFT_MARGIN, height + LINE * (d.count + 0.5), "dashed", "#111", "%s",
                              kempe_table_name(earlier));
        kmp_picture_end(&text);
        status = kmp_picture_write(d.context, path, &text);
    }
    kmp_arena_free(&d.arena);
    return status;
}

kempe_status kempe_table_write_picture(const kempe_table *table, const char *x, const char *y, const char *path)
{
    KMP_WANTED(NULL, table, "table");
    return write_picture(table, NULL, x, y, path);
}

kempe_status kempe_table_write_picture_against(const kempe_table *table, const kempe_table *earlier, const char *x,
                                               const char *y, const char *path)
{
    KMP_WANTED(NULL, table, "table");
    KMP_WANTED(kmp_table_context(table), earlier, "earlier");
    return write_picture(table, earlier, x, y, path);
}
