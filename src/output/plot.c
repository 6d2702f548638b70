/* SPDX-License-Identifier: BSD-3-Clause */
/* SVG plots: axes with ticks at 1, 2 and 5 times powers of ten, linear or logarithmic; curves as paths, with gaps where
 * values are missing. */
#include "output/plot.h"
#include <math.h>

/* Space around a frame for names and numbers; what curves may reach beyond it, with half their width. */
enum { LEFT = 74, RIGHT = 18, TOP = 34, BOTTOM = 52, EDGE = 3 };

/* Distance of numbers on an axis, about. */
static const double apart[2] = {60, 45};

#define CENTRED "text-anchor=\"middle\""

static const char common[] =
    ".frame{fill:none;stroke:#99a3a9}.grid{stroke:#d4d9db;fill:none}.fine{stroke:#eceeef;fill:none}"
    ".title{font-weight:bold}.curve{fill:none;stroke-width:1.6;stroke-linejoin:round}"
    ".dashed{fill:none;stroke-width:1.2;stroke-dasharray:5 3}.cross{stroke:#111;stroke-width:2;fill:none}";

static const char *const colours[] = {"#2471a3", "#c0392b", "#1e8449", "#b9770e",
                                      "#7d3c98", "#117a65", "#5d6d7e", "#d35400"};

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
    return colours[curve % COLOURS];
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

/* 1, 2 or 5 times a power of ten: about `count` of them in a range. */
static double choose_tick(double range, double count)
{
    double raw = range / count, power = pow(10, floor(log10(raw))), part = raw / power;
    return power * (part < 1.5 ? 1 : part < 3.5 ? 2 : part < 7.5 ? 5 : 10);
}

static void put_even_ticks(const kmp_plot *p, int axis)
{
    const kmp_axis *a = &p->axis[axis];
    double each = a->tick > 0 ? a->tick : choose_tick(range_of(a), length_of(p, axis) / apart[axis]);
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
    return (kmp_plot){text,           x + LEFT, y + TOP, width - LEFT - RIGHT, height - TOP - BOTTOM,
                      {empty, empty}, false,    false};
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
}

void kmp_curve_to(kmp_plot *plot, double x, double y)
{
    double at[2] = {kmp_plot_x(plot, x), kmp_plot_y(plot, y)};
    bool there = isfinite(at[0]) && isfinite(at[1]);
    if (there)
        kmp_text_printf(plot->text, "%c%.2f %.2f", plot->open ? 'L' : 'M', at[0], at[1]);
    plot->open = there;
}

void kmp_curve_end(kmp_plot *plot)
{
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
