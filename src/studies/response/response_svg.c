/* SPDX-License-Identifier: BSD-3-Clause */
/* Amplitudes, logarithmic, and phases over the frequency as a picture. Each pair of output and input has a curve
 * through its peaks, which is open at undamped poles. */
#include "base/file.h"
#include "base/memory.h"
#include "output/svg.h"
#include "studies/response/response.h"
#include <kempe/response.h>
#include <math.h>
#include <stdlib.h>

/* Pixels. */
enum { LEFT = 78, WIDE = 640, TOP = 30, HIGH = 300, GAP = 24, PHASE = 150, BELOW = 48, LINE = 17 };

enum { MOST_CURVES = 12 };

static const char *const colours[] = {"#2471a3", "#c0392b", "#1e8449", "#b9770e",
                                      "#7d3c98", "#16a085", "#5d6d7e", "#d35400"};

enum { COLOURS = sizeof colours / sizeof *colours };

static const double two_pi = 6.283185307179586476925286766559;

typedef struct chart {
    const kempe_response *r;
    kmp_text *text;
    double x0, x1; /* of the frequency or its logarithm */
    double y0, y1; /* decades of the amplitude */
} chart;

/* A point of a curve; NaN on a pole. */
typedef struct spot {
    double hz, amplitude, phase;
} spot;

static double across(const chart *c, double hz)
{
    double x = c->r->linear ? hz : log10(hz);
    return LEFT + WIDE * (x - c->x0) / (c->x1 - c->x0);
}

static double up(const chart *c, double amplitude)
{
    double y = (log10(amplitude) - c->y0) / (c->y1 - c->y0);
    return TOP + HIGH * (1 - fmin(1, fmax(0, y)));
}

static double phase_up(double degrees)
{
    return TOP + HIGH + GAP + PHASE * (180 - degrees) / 360;
}

/* -- axes -------------------------------------------------------------------------------------------- */

static void put_line(kmp_text *text, double x0, double y0, double x1, double y1, const char *colour)
{
    kmp_text_printf(text, "<path d=\"M%.1f %.1fL%.1f %.1f\" stroke=\"%s\"/>\n", x0, y0, x1, y1, colour);
}

static void put_mark(kmp_text *text, double x, double y, const char *anchor, double value)
{
    kmp_text_printf(text, "<text x=\"%.1f\" y=\"%.1f\" text-anchor=\"%s\">%g</text>\n", x, y, anchor, value);
}

/* Numbers of a logarithmic axis: at 1, 2 and 5 where there are few decades, otherwise at powers of ten. */
static bool has_number(int digit, double decades)
{
    return digit == 1 || (decades < 3 && (digit == 2 || digit == 5));
}

static void put_frequency(const chart *c, double hz, bool number)
{
    double x = across(c, hz), low = TOP + HIGH + GAP + PHASE;
    if (x < LEFT - 0.01 || x > LEFT + WIDE + 0.01)
        return;
    put_line(c->text, x, TOP, x, TOP + HIGH, number ? "#ccc" : "#eee");
    put_line(c->text, x, TOP + HIGH + GAP, x, low, number ? "#ccc" : "#eee");
    if (number)
        put_mark(c->text, x, low + 16, "middle", hz);
}

static void put_frequencies(const chart *c)
{
    double decades = c->x1 - c->x0, step = pow(10, floor(log10(decades / 3)));
    step *= decades > 12 * step ? 5 : decades > 6 * step ? 2 : 1;
    if (c->r->linear)
        for (int k = 0; k * step <= decades * (1 + 1e-9); k++)
            put_frequency(c, (ceil(c->x0 / step - 1e-9) + k) * step, true);
    for (int k = (int)floor(c->x0); !c->r->linear && k <= (int)ceil(c->x1); k++)
        for (int digit = 1; digit < 10; digit++)
            put_frequency(c, digit * pow(10, k), has_number(digit, decades));
}

/* Every power of ten where there are few of them, otherwise every second, third or so. */
static void put_amplitudes(const chart *c)
{
    double decades = c->y1 - c->y0;
    int every = decades <= 8 ? 1 : (int)ceil(decades / 8);
    for (int k = (int)floor(c->y0); k <= (int)ceil(c->y1); k++)
        for (int digit = 1; digit < 10; digit++) {
            double value = digit * pow(10, k), y = log10(value);
            bool number = has_number(digit, decades) && k % every == 0;
            if (y < c->y0 - 1e-9 || y > c->y1 + 1e-9 || (!number && decades > 5))
                continue;
            put_line(c->text, LEFT, up(c, value), LEFT + WIDE, up(c, value), number ? "#ccc" : "#eee");
            if (number)
                put_mark(c->text, LEFT - 6, up(c, value) + 4, "end", value);
        }
    for (int degrees = -180; degrees <= 180; degrees += 90) {
        put_line(c->text, LEFT, phase_up(degrees), LEFT + WIDE, phase_up(degrees), "#ccc");
        put_mark(c->text, LEFT - 6, phase_up(degrees) + 4, "end", degrees);
    }
}

static void put_frames(const chart *c)
{
    static const char *const frame = "<rect x=\"%d\" y=\"%d\" width=\"%d\" height=\"%d\" fill=\"none\" "
                                     "stroke=\"#444\"/>\n";
    kmp_text_printf(c->text, frame, LEFT, TOP, WIDE, HIGH);
    kmp_text_printf(c->text, frame, LEFT, TOP + HIGH + GAP, WIDE, PHASE);
    kmp_text_printf(c->text, "<text x=\"%d\" y=\"%d\" text-anchor=\"middle\">frequency, Hz</text>\n", LEFT + WIDE / 2,
                    TOP + HIGH + GAP + PHASE + 36);
    kmp_text_printf(c->text,
                    "<text x=\"16\" y=\"%d\" text-anchor=\"middle\" transform=\"rotate(-90 16 %d)\">"
                    "amplitude, SI units</text>\n",
                    TOP + HIGH / 2, TOP + HIGH / 2);
    int middle = TOP + HIGH + GAP + PHASE / 2;
    kmp_text_printf(c->text,
                    "<text x=\"16\" y=\"%d\" text-anchor=\"middle\" transform=\"rotate(-90 16 %d)\">"
                    "phase, degrees</text>\n",
                    middle, middle);
}

/* -- curves ------------------------------------------------------------------------------------------ */

static int ascending(const void *a, const void *b)
{
    double x = ((const spot *)a)->hz, y = ((const spot *)b)->hz;
    return x < y ? -1 : x > y;
}

/* All frequencies and the peaks of a pair, in order; returns their number. */
static int collect(const kempe_response *r, int input, int output, spot *list)
{
    const kmp_frequency *f = &r->frequency;
    int count = 0;
    for (int k = 0; k < f->count; k++) {
        double re = NAN, im = NAN;
        (void)kempe_response_at(r, k, input, output, &re, &im);
        list[count++] = (spot){f->at[k], hypot(re, im), atan2(im, re)};
    }
    for (int k = 0; k < f->peak_count; k++) {
        const kmp_peak *p = &f->peak[k];
        if (p->input == input && p->output == output)
            list[count++] = (spot){p->frequency, isfinite(p->amplitude) ? p->amplitude : NAN, p->phase};
    }
    qsort(list, (size_t)count, sizeof *list, ascending);
    return count;
}

/* A curve of the amplitudes, or of the phases: where these wrap from one edge to the other, the line is open. */
static void draw_curve(const chart *c, int count, const spot *list, bool phases, const char *colour)
{
    bool open = true;
    double last = 0;
    kmp_text_printf(c->text, "<path fill=\"none\" stroke=\"%s\" stroke-width=\"%s\" d=\"", colour,
                    phases ? "1.3" : "1.6");
    for (int k = 0; k < count; k++) {
        double degrees = list[k].phase * 360 / two_pi;
        if (!(list[k].amplitude > 0)) {
            open = true;
            continue;
        }
        open = open || (phases && fabs(degrees - last) > 180);
        kmp_text_printf(c->text, "%c%.2f %.2f", open ? 'M' : 'L', across(c, list[k].hz),
                        phases ? phase_up(degrees) : up(c, list[k].amplitude));
        last = degrees;
        open = false;
    }
    kmp_text_put(c->text, "\"/>\n");
}

static bool is_zero(int count, const spot *list)
{
    for (int k = 0; k < count; k++)
        if (list[k].amplitude > 0)
            return false;
    return true;
}

static void draw_name(const chart *c, int input, int output, int line, const char *colour, bool zero)
{
    const kempe_response *r = c->r;
    int y = TOP + HIGH + GAP + PHASE + BELOW + LINE * line;
    kmp_text_printf(c->text, "<text x=\"%d\" y=\"%d\" fill=\"%s\">", LEFT, y + 12, colour);
    kmp_text_escape(c->text, kempe_response_output_name(r, output));
    kmp_text_put(c->text, " / ");
    kmp_text_escape(c->text, kempe_response_input_name(r, input));
    kmp_response_put_unit(c->text, r, input, output, ", ", " / ");
    kmp_text_put(c->text, zero ? ": zero</text>\n" : "</text>\n");
}

/* -- the picture ------------------------------------------------------------------------------------- */

/* The ranges of the axes; amplitudes not more than ten decades below the highest. */
static void measure(chart *c)
{
    const kmp_frequency *f = &c->r->frequency;
    double least = INFINITY, most = 0;
    for (size_t k = 0; k < (size_t)f->count * (size_t)f->inputs * (size_t)f->outputs; k++) {
        double a = hypot(f->re[k], f->im[k]);
        least = a > 0 ? fmin(least, a) : least;
        most = isfinite(a) ? fmax(most, a) : most;
    }
    for (int k = 0; k < f->peak_count; k++)
        most = isfinite(f->peak[k].amplitude) ? fmax(most, f->peak[k].amplitude) : most;
    bool any = most > 0;
    c->y1 = any ? log10(most) : 1;
    c->y0 = any ? fmax(log10(least), c->y1 - 10) : 0;
    double room = fmax(0.05 * (c->y1 - c->y0), 0.1);
    c->y0 -= room;
    c->y1 += room;
    c->x0 = c->r->linear ? f->at[0] : log10(f->at[0]);
    c->x1 = c->r->linear ? f->at[f->count - 1] : log10(f->at[f->count - 1]);
}

static int curves(const kempe_response *r)
{
    int all = r->frequency.inputs * r->frequency.outputs;
    return all < MOST_CURVES ? all : MOST_CURVES;
}

static void draw(chart *c, spot *room)
{
    const kmp_frequency *f = &c->r->frequency;
    int all = f->inputs * f->outputs, drawn = curves(c->r), more = all > drawn;
    measure(c);
    kmp_svg_begin(c->text, LEFT + WIDE + 24, TOP + HIGH + GAP + PHASE + BELOW + LINE * (drawn + more) + 8, NULL);
    kmp_text_printf(c->text, "<text x=\"%d\" y=\"18\" font-weight=\"bold\">", LEFT);
    kmp_text_escape(c->text, c->r->channels.system->model->name);
    kmp_text_put(c->text, "</text>\n");
    put_frequencies(c);
    put_amplitudes(c);
    for (int k = 0; k < drawn; k++) {
        int input = k / f->outputs, output = k % f->outputs;
        int count = collect(c->r, input, output, room);
        draw_curve(c, count, room, false, colours[k % COLOURS]);
        draw_curve(c, count, room, true, colours[k % COLOURS]);
        draw_name(c, input, output, k, colours[k % COLOURS], is_zero(count, room));
    }
    if (more)
        kmp_text_printf(c->text, "<text x=\"%d\" y=\"%d\">%d more are not drawn</text>\n", LEFT,
                        TOP + HIGH + GAP + PHASE + BELOW + LINE * drawn + 12, all - drawn);
    put_frames(c);
    kmp_svg_end(c->text);
}

kempe_status kempe_response_write_svg(const kempe_response *r, const char *path)
{
    KMP_WANTED(NULL, r, "response");
    KMP_WANTED(r->channels.linear.system->context, path, "path");
    kempe_context *context = r->channels.system->context;
    kmp_text text = {0};
    chart c = {.r = r, .text = &text};
    kmp_context_clear(context);
    spot *room = KMP_NEW(spot, r->frequency.count + r->frequency.peak_count);
    if (!room)
        return kmp_fail_memory(context);
    draw(&c, room);
    kmp_free(room);
    return kmp_file_write(context, path, &text);
}
