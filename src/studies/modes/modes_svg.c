/* SPDX-License-Identifier: BSD-3-Clause */
/* A locus as a picture: eigenvalues in the plane on the left, frequencies over the value on the right (Campbell). */
#include "base/file.h"
#include "output/svg.h"
#include "studies/modes/modes.h"
#include <kempe/modes.h>
#include <math.h>

enum { WIDTH = 520, HEIGHT = 400, LEFT = 74, RIGHT = 18, TOP = 34, BOTTOM = 52, GAP = 8, COLOURS = 8 };

/* Extent of the plane to the left, relative to its height. */
#define FAR 3

static const char *const colours[COLOURS] = {"#2471a3", "#c0392b", "#1e8449", "#b9770e",
                                             "#7d3c98", "#117a65", "#5d6d7e", "#a04000"};

/* A frame with its two axes. */
typedef struct frame {
    kmp_text *text;
    double x0; /* of its left edge in the picture */
    double low[2], high[2];
} frame;

static double at_x(const frame *f, double x)
{
    return f->x0 + LEFT + (WIDTH - LEFT - RIGHT) * (x - f->low[0]) / (f->high[0] - f->low[0]);
}

static double at_y(const frame *f, double y)
{
    return HEIGHT - BOTTOM - (HEIGHT - TOP - BOTTOM) * (y - f->low[1]) / (f->high[1] - f->low[1]);
}

static void reach(frame *f, double x, double y)
{
    const double p[2] = {x, y};
    for (int k = 0; k < 2; k++) {
        f->low[k] = fmin(f->low[k], p[k]);
        f->high[k] = fmax(f->high[k], p[k]);
    }
}

/* Adds a margin; none below a zero that is an end of the axis. */
static void widen(frame *f)
{
    for (int k = 0; k < 2; k++) {
        double size = f->high[k] - f->low[k];
        double room = size > 0 ? 0.05 * size : fmax(fabs(f->high[k]), 1) / 2;
        f->low[k] = f->low[k] == 0 && k == 1 ? 0 : f->low[k] - room;
        f->high[k] += room;
    }
}

static void put_ticks(const frame *f, int axis, int count)
{
    double each = kmp_svg_tick(f->high[axis] - f->low[axis], count);
    for (double k = ceil(f->low[axis] / each); k * each <= f->high[axis]; k++) {
        double v = k * each, x = at_x(f, v), y = at_y(f, v);
        if (axis == 0)
            kmp_text_printf(f->text,
                            "<path class=\"grid\" d=\"M%.1f %d V%d\"/><text x=\"%.1f\" y=\"%d\" "
                            "text-anchor=\"middle\">%.6g</text>\n",
                            x, TOP, HEIGHT - BOTTOM, x, HEIGHT - BOTTOM + 17, v == 0 ? 0 : v);
        else
            kmp_text_printf(f->text,
                            "<path class=\"grid\" d=\"M%.1f %.1f H%.1f\"/><text x=\"%.1f\" y=\"%.1f\" "
                            "text-anchor=\"end\">%.6g</text>\n",
                            f->x0 + LEFT, y, f->x0 + WIDTH - RIGHT, f->x0 + LEFT - 7, y + 4, v == 0 ? 0 : v);
    }
}

static void put_frame(const frame *f, const char *title, const char *across, const char *up)
{
    double middle = f->x0 + (LEFT + WIDTH - RIGHT) / 2.0;
    kmp_text_printf(f->text, "<rect x=\"%.1f\" y=\"%d\" width=\"%d\" height=\"%d\" class=\"frame\"/>\n", f->x0 + LEFT,
                    TOP, WIDTH - LEFT - RIGHT, HEIGHT - TOP - BOTTOM);
    put_ticks(f, 0, 6);
    put_ticks(f, 1, 6);
    kmp_text_printf(f->text, "<text class=\"title\" x=\"%.1f\" y=\"20\" text-anchor=\"middle\">", middle);
    kmp_text_escape(f->text, title);
    kmp_text_printf(f->text, "</text>\n<text x=\"%.1f\" y=\"%d\" text-anchor=\"middle\">", middle, HEIGHT - 12);
    kmp_text_escape(f->text, across);
    kmp_text_printf(f->text, "</text>\n<text transform=\"translate(%.1f %.1f) rotate(-90)\" text-anchor=\"middle\">",
                    f->x0 + 16, (TOP + HEIGHT - BOTTOM) / 2.0);
    kmp_text_escape(f->text, up);
    kmp_text_put(f->text, "</text>\n");
}

/* The drawn point of an eigenvalue: in the plane, or a frequency over the value. False: none. */
typedef bool point_fn(const kempe_modes *m, int k, int branch, double *x, double *y);

static bool in_plane(const kempe_modes *m, int k, int branch, double *x, double *y)
{
    *x = kempe_modes_locus_re(m, k, branch);
    *y = kempe_modes_locus_im(m, k, branch);
    *y = fabs(*y);
    return isfinite(*y);
}

static bool over_value(const kempe_modes *m, int k, int branch, double *x, double *y)
{
    *x = kempe_modes_value(m, k);
    *y = fabs(kempe_modes_locus_im(m, k, branch)) / (2 * acos(-1));
    return *y > 0;
}

static void put_branches(const frame *f, const kempe_modes *m, point_fn *point)
{
    for (int b = 0; b < m->locus.count; b++) {
        bool open = false;
        double x, y;
        const char *colour = colours[(b / 2) % COLOURS];
        for (int k = 0; k < m->locus.reached; k++) {
            bool there = point(m, k, b, &x, &y);
            if (there && !open)
                kmp_text_printf(f->text, "<path class=\"branch\" stroke=\"%s\" d=\"M", colour);
            if (there)
                kmp_text_printf(f->text, "%s%.2f %.2f", open ? " L" : "", at_x(f, x), at_y(f, y));
            if (!there && open)
                kmp_text_put(f->text, "\"/>\n");
            open = there;
        }
        if (open)
            kmp_text_put(f->text, "\"/>\n");
        if (point(m, 0, b, &x, &y))
            kmp_svg_dot(f->text, at_x(f, x), at_y(f, y), 3.5, colour);
    }
}

static void put_mark(const frame *f, double x, double y)
{
    kmp_text_printf(f->text, "<path class=\"mark\" d=\"M%.2f %.2f l10 10 m0 -10 l-10 10\"/>\n", at_x(f, x) - 5,
                    at_y(f, y) - 5);
}

/* Distant real eigenvalues are cut off, with a note, so that the others remain visible. */
static void put_plane(kmp_text *text, const kempe_modes *m)
{
    frame f = {text, 0, {0, 0}, {0, 0}};
    kmp_text title = {0};
    double x, y, left = 0;
    for (int k = 0; k < m->locus.reached; k++)
        for (int b = 0; b < m->locus.count; b++)
            if (in_plane(m, k, b, &x, &y)) {
                reach(&f, x, y);
                left = y > 0 ? fmin(left, x) : left;
            }
    double least = f.low[0], bound = fmin(left, -FAR * f.high[1]);
    bool cut = f.high[1] > 0 && least < bound;
    if (cut)
        f.low[0] = bound;
    widen(&f);
    kmp_text_printf(&title, "Eigenvalues, %s from %.6g (dots) to %.6g", m->name, m->locus.value[0],
                    m->locus.value[m->locus.reached - 1]);
    put_frame(&f, title.s ? title.s : "", "real part, 1/s", "imaginary part, rad/s");
    text->failed = text->failed || title.failed;
    kmp_text_free(&title);
    if (f.low[0] < 0 && f.high[0] > 0)
        kmp_text_printf(text, "<path class=\"axis\" d=\"M%.1f %d V%d\"/>\n", at_x(&f, 0), TOP, HEIGHT - BOTTOM);
    kmp_text_printf(text,
                    "<clipPath id=\"plane\"><rect x=\"%d\" y=\"%d\" width=\"%d\" height=\"%d\"/></clipPath>\n"
                    "<g clip-path=\"url(#plane)\">\n",
                    LEFT, TOP, WIDTH - LEFT - RIGHT, HEIGHT - TOP - BOTTOM + 4);
    put_branches(&f, m, in_plane);
    kmp_text_put(text, "</g>\n");
    if (cut)
        kmp_text_printf(text, "<text x=\"%d\" y=\"%d\">&#8592; real ones as far as %.4g</text>\n", LEFT + 8, TOP + 18,
                        least);
    for (int k = 0; k < m->locus.critical_count; k++)
        put_mark(&f, m->locus.critical[k].re, m->locus.critical[k].im);
}

/* Frequency = order * value / (2 pi), as far as it is in the frame. */
static void put_orders(const frame *f, const kempe_modes *m)
{
    for (int k = 0; k < m->order_count; k++) {
        double slope = m->order[k] / (2 * acos(-1)), x = f->high[0], y;
        double from = fmax(f->low[0], f->low[1] / slope);
        if (slope * x > f->high[1])
            x = f->high[1] / slope;
        y = slope * x;
        if (x <= from)
            continue;
        kmp_text_printf(f->text, "<path class=\"order\" d=\"M%.2f %.2f L%.2f %.2f\"/>\n", at_x(f, from),
                        at_y(f, slope * from), at_x(f, x), at_y(f, y));
        kmp_text_printf(f->text, "<text class=\"order-name\" x=\"%.2f\" y=\"%.2f\" text-anchor=\"end\">%.4g</text>\n",
                        at_x(f, x) - 5, at_y(f, y) + 13, m->order[k]);
    }
}

static void put_campbell(kmp_text *text, const kempe_modes *m)
{
    frame f = {text, WIDTH + GAP, {m->locus.value[0], 0}, {m->locus.value[0], 0}};
    double x, y;
    for (int k = 0; k < m->locus.reached; k++) {
        reach(&f, m->locus.value[k], 0);
        for (int b = 0; b < m->locus.count; b++)
            if (over_value(m, k, b, &x, &y))
                reach(&f, x, y);
    }
    widen(&f);
    put_frame(&f, m->order_count ? "Frequencies, and orders of what varies" : "Frequencies", m->name, "frequency, Hz");
    put_orders(&f, m);
    put_branches(&f, m, over_value);
    for (int k = 0; k < m->locus.critical_count; k++) {
        const kmp_critical *c = &m->locus.critical[k];
        kmp_text_printf(text, "<path class=\"critical\" d=\"M%.2f %d V%d\"/>\n", at_x(&f, c->value), TOP,
                        HEIGHT - BOTTOM);
        put_mark(&f, c->value, kmp_mode_frequency(c->re, c->im));
    }
}

void kmp_modes_put_svg(kmp_text *text, const kempe_modes *m)
{
    kmp_svg_begin(text, 2 * WIDTH + GAP, HEIGHT,
                  ".frame{fill:#fff;stroke:#99a3a9}.grid{stroke:#e3e7e9;fill:none}.axis{stroke:#4a545a;"
                  "fill:none}.branch{fill:none;stroke-width:2;stroke-linejoin:round}.title{font-weight:bold}"
                  ".mark{stroke:#111;stroke-width:2;fill:none}.critical{stroke:#111;stroke-dasharray:2 3;fill:none}"
                  ".order{stroke:#8a949a;stroke-dasharray:7 4;fill:none}.order-name{fill:#6a747a}");
    put_plane(text, m);
    put_campbell(text, m);
    kmp_svg_end(text);
}

kempe_status kempe_modes_write_svg(const kempe_modes *modes, const char *path)
{
    KMP_WANTED(NULL, modes, "modes");
    KMP_WANTED(modes->system->context, path, "path");
    kmp_text text = {0};
    kmp_context_clear(modes->system->context);
    if (!modes->name || modes->locus.reached == 0)
        return kmp_fail(modes->system->context, KEMPE_E_ARGUMENT, "a picture shows what varies, and nothing does");
    kmp_modes_put_svg(&text, modes);
    return kmp_file_write(modes->system->context, path, &text);
}
