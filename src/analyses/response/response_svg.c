/* SPDX-License-Identifier: BSD-3-Clause */
/* Amplitudes, logarithmic, and phases over the frequency as a picture. Each pair of output and input has a curve
 * through its peaks, which is open at undamped poles. */
#include "analyses/response/response_study.h"
#include "base/memory.h"
#include "model/data/model.h"
#include "output/plot.h"
#include <kempe/response.h>
#include <math.h>
#include <stdlib.h>

/* Pixels: the picture's width, the two plots one below the other, a line of the legend. */
enum { WIDTH = 740, AMPLITUDE = 370, PHASE = 230, LINE = 17, LEFT = 74 };

enum { MOST_CURVES = 12 };

/* A point of a curve; NaN on a pole. */
typedef struct spot {
    double hz, amplitude, phase;
} spot;

/* -- curves ------------------------------------------------------------------------------------------ */

static int ascending(const void *a, const void *b)
{
    double x = ((const spot *)a)->hz, y = ((const spot *)b)->hz;
    return x < y ? -1 : x > y;
}

/* All frequencies and the peaks of a pair, in order; returns their number. */
static int collect(const kempe_response *r, int pair, spot *list)
{
    const kmp_frequency *f = &r->frequency;
    int count = 0, input = pair / f->outputs, output = pair % f->outputs;
    double factor = kmp_response_shown(r, output).factor;
    for (int k = 0; k < f->count; k++) {
        kmp_response_point at = kmp_response_at(r, k, pair);
        list[count++] = (spot){f->at[k], factor * at.amplitude, at.phase};
    }
    for (int k = 0; k < f->peak_count; k++) {
        const kmp_peak *p = &f->peak[k];
        if (p->input == input && p->output == output)
            list[count++] = (spot){p->frequency, isfinite(p->amplitude) ? factor * p->amplitude : NAN, p->phase};
    }
    qsort(list, (size_t)count, sizeof *list, ascending);
    return count;
}

/* The curves of all drawn pairs, amplitudes or phases: where these wrap from one edge to the other, the line is open.
 */
static void draw_curves(kmp_plot *p, const kempe_response *r, int drawn, bool phases, spot *room)
{
    for (int pair = 0; pair < drawn; pair++) {
        int count = collect(r, pair, room);
        double last = 0;
        kmp_curve_begin(p, "curve", kmp_plot_colour(pair));
        for (int k = 0; k < count; k++) {
            double degrees = room[k].amplitude > 0 ? room[k].phase * 180 / acos(-1) : NAN;
            if (phases && fabs(degrees - last) > 180)
                kmp_curve_to(p, NAN, NAN);
            kmp_curve_to(p, room[k].hz, phases ? degrees : room[k].amplitude);
            last = degrees;
        }
        kmp_curve_end(p);
    }
}

/* -- the picture ------------------------------------------------------------------------------------- */

static void draw(kmp_text *text, const kempe_response *r, spot *room)
{
    int all = r->frequency.inputs * r->frequency.outputs, drawn = all < MOST_CURVES ? all : MOST_CURVES, line = 0;
    double below = AMPLITUDE + PHASE + LINE;
    kmp_plot amplitude = kmp_plot_inside(text, 0, 0, WIDTH, AMPLITUDE);
    kmp_plot phase = kmp_plot_inside(text, 0, AMPLITUDE - LINE, WIDTH, PHASE);
    /* The ranges of the axes; amplitudes not more than ten decades below the highest. */
    const kmp_frequency *f = &r->frequency;
    kmp_axis *a = &amplitude.axis[1];
    a->logarithmic = true;
    amplitude.axis[0].logarithmic = !r->linear;
    for (int k = 0; k < f->count; k++)
        for (int pair = 0; pair < f->inputs * f->outputs; pair++)
            kmp_plot_reach(&amplitude, f->at[k],
                           kmp_response_shown(r, pair % f->outputs).factor * kmp_response_at(r, k, pair).amplitude);
    for (int k = 0; k < f->peak_count; k++)
        kmp_plot_reach(&amplitude, f->peak[k].frequency,
                       kmp_response_shown(r, f->peak[k].output).factor * f->peak[k].amplitude);
    a->low = fmax(a->low, a->high * 1e-10);
    amplitude.axis[0] =
        (kmp_axis){.name = "", .low = f->at[0], .high = f->at[f->count - 1], .logarithmic = !r->linear, .exact = true};
    a->name = kmp_shown_as(r->channels.system->context, "rad").factor == 1 ? "amplitude, SI units"
                                                                           : "amplitude, degrees and SI units";
    phase.axis[0] = amplitude.axis[0];
    phase.axis[0].name = "frequency, Hz";
    phase.axis[1] = (kmp_axis){.name = "phase, degrees", .low = -180, .high = 180, .exact = true, .tick = 90};
    kmp_picture_begin(text, WIDTH, below + LINE * (drawn + (all > drawn)), "");
    kmp_plot_begin(&amplitude, "%s", r->channels.system->model->name);
    draw_curves(&amplitude, r, drawn, false, room);
    kmp_plot_end(&amplitude);
    kmp_plot_begin(&phase, "%s", "");
    draw_curves(&phase, r, drawn, true, room);
    kmp_plot_end(&phase);
    for (; line < drawn; line++) {
        double y = below + LINE * line;
        int count = collect(r, line, room);
        bool zero = true;
        for (int k = 0; k < count; k++)
            zero = zero && !(room[k].amplitude > 0);
        int input = line / r->frequency.outputs, output = line % r->frequency.outputs;
        kmp_text unit = {0};
        kmp_response_put_unit(&unit, r, input, kmp_response_shown(r, output).unit, ", ", " / ");
        kmp_picture_entry(text, LEFT, y, "curve", kmp_plot_colour(line), "%s / %s%s%s", kmp_response_output(r, output),
                          kmp_response_input(r, input), unit.s ? unit.s : "", zero ? ": zero" : "");
        kmp_text_free_part(text, &unit);
    }
    if (all > drawn)
        kmp_picture_words(text, LEFT, below + LINE * line, "", "%d more are not drawn", all - drawn);
    kmp_picture_end(text);
}

kempe_status kempe_response_write_picture(const kempe_response *r, const char *path)
{
    KMP_WANTED(NULL, r, "response");
    KMP_WANTED(r->channels.linear.system->context, path, "path");
    kempe_context *context = r->channels.system->context;
    kmp_text text = {0};
    kmp_context_clear(context);
    spot *room = KMP_NEW(spot, r->frequency.count + r->frequency.peak_count);
    KMP_TRY(kmp_made(context, room));
    draw(&text, r, room);
    kmp_free(room);
    return kmp_picture_write(context, path, &text);
}
