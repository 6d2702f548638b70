/* SPDX-License-Identifier: BSD-3-Clause */
/* Curves over axes as an SVG picture, which may hold several plots. Sizes are pixels, y downwards. Points of curves are
 * in the units of the axes; a value that is not finite, or not positive on a logarithmic axis, leaves a gap. */
#pragma once

#include "base/context.h"
#include "base/text.h"

/** Begins a white picture. `style`: CSS of the caller's own classes, in addition to the classes of plots: `curve` and
 * `dashed`. */
void kmp_picture_begin(kmp_text *text, double width, double height, const char *style);
void kmp_picture_end(kmp_text *text);

/** A separate colour for each of several curves; they repeat. */
const char *kmp_plot_colour(int curve);

/** All of them as pairs of strings, on light ground and on dark. */
void kmp_plot_put_colours(kmp_text *text);

/** Words, escaped; `attributes` of SVG or "". */
void kmp_picture_words(kmp_text *text, double x, double y, const char *attributes, const char *format, ...)
    __attribute__((format(printf, 5, 6)));

/** An entry of a legend: a short stretch of a curve (NULL: a dot), and words. */
void kmp_picture_entry(kmp_text *text, double x, double y, const char *curve, const char *colour, const char *format,
                       ...) __attribute__((format(printf, 6, 7)));

typedef struct kmp_axis {
    const char *name, *unit; /* `unit`: NULL or "", none */
    double low, high;
    bool logarithmic, reversed;
    bool exact;  /* no space is added at the ends of its range, as it is otherwise, but not below a zero */
    double tick; /* between its numbers; 0: chosen */
} kmp_axis;

/* Points of a curve that are drawn together: the lowest, the highest, the last, with their numbers in the order of the
 * curve. */
enum { KMP_STRIP_PLACES = 3 };

typedef struct kmp_thin_strip {
    double x; /* of the first */
    double at[KMP_STRIP_PLACES][2];
    int number[KMP_STRIP_PLACES], count;
} kmp_thin_strip;

typedef struct kmp_plot {
    kmp_text *text;
    double x, y, width, height; /* the frame, without names and numbers around it */
    kmp_axis axis[2];           /* to the right, upwards */
    bool square;                /* one range is extended until both axes have the same scale */
    bool open;                  /* the curve continues */
    kmp_thin_strip strip;       /* its last points */
} kmp_plot;

/** A plot inside a rectangle of the picture, its axes linear and still without a range. */
kmp_plot kmp_plot_inside(kmp_text *text, double x, double y, double width, double height);

/** Extends the ranges to a point; one that no curve could show changes nothing. */
void kmp_plot_reach(kmp_plot *plot, double x, double y);

/** Settles the ranges, and draws frame, grid, numbers, names and a title. Curves and marks, which are clipped by the
 * frame, come between the two; words there begin at the frame's corner. */
void kmp_plot_begin(kmp_plot *plot, const char *format, ...) __attribute__((format(printf, 2, 3)));
void kmp_plot_end(kmp_plot *plot);

/** The place of a point, from the frame's corner; NaN: it has none. */
double kmp_plot_x(const kmp_plot *plot, double x);
double kmp_plot_y(const kmp_plot *plot, double y);

/** A curve with the style of a class (NULL: the default): it begins, passes through points, and ends. */
void kmp_curve_begin(kmp_plot *plot, const char *class, const char *colour);
void kmp_curve_to(kmp_plot *plot, double x, double y);
void kmp_curve_end(kmp_plot *plot);

void kmp_plot_dot(const kmp_plot *plot, double x, double y, const char *colour);
void kmp_plot_cross(const kmp_plot *plot, double x, double y);

/** Writes a picture and frees it in any case: .png, or SVG for every other ending. KEMPE_E_FAILED: a .png where there
 * is no librsvg. Errors of kmp_file_write. */
kempe_status kmp_picture_write(kempe_context *context, const char *path, kmp_text *svg);

/** Appends the picture as a PNG. False: there is no librsvg, or it refused; `png` is as it was. */
bool kmp_picture_png(const kmp_text *svg, kmp_text *png);
