/* SPDX-License-Identifier: BSD-3-Clause */
/* Output of `response`: undamped poles, peaks, the static response; as JSON every frequency; a picture. */
#include "analyses/parts/study_print.h"
#include "analyses/response/response_study.h"
#include "base/memory.h"
#include "output/plot.h"
#include "output/print.h"
#include <kempe/response.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static const double two_pi = 6.283185307179586476925286766559;

/* -- text -------------------------------------------------------------------------------------------- */

enum { MOST_ROWS = 20, WIDEST_NAME = 40, INDENT = 4 };

/* The name of a response with its unit: "q.body / drive(road), m / m". */
static void put_name(kmp_text *name, const kempe_response *r, int input, int output)
{
    kmp_text_printf(name, "%s / %s", kmp_response_output(r, output), kmp_response_input(r, input));
    kmp_response_put_unit(name, r, input, output, ", ", " / ");
}

/* A frequency with the amplitude there. */
static void put_row(kmp_text *text, double hz, double amplitude)
{
    kmp_text_printf(text, "  %11.6g", hz);
    if (isfinite(amplitude))
        kmp_text_printf(text, "  %12.6g", amplitude);
    else
        kmp_text_printf(text, "  %12s", "unbounded");
}

/* The static response of a pair, and its peaks; long names have a separate line. */
static void show_pair(kmp_text *text, const kempe_response *r, int input, int output, int width, int *room)
{
    const kmp_frequency *f = &r->frequency;
    const double factor = kmp_response_factor(r, input, output), still = f->still[output + input * f->outputs];
    kmp_text name = {0};
    put_name(&name, r, input, output);
    const int length = (int)name.length;
    kmp_text_printf(text, "  %s%*s", name.s ? name.s : "", length <= width ? width - length : 0, "");
    if (length > width)
        kmp_text_printf(text, "\n  %*s", width, "");
    kmp_text_free_part(text, &name);
    put_row(text, 0, factor * still);
    kmp_text_put(text, "\n");
    for (int k = 0; k < f->peak_count; k++) {
        const kmp_peak *p = &f->peak[k];
        if (p->input != input || p->output != output || (*room)-- <= 0)
            continue;
        kmp_text_printf(text, "  %*s", width, "");
        put_row(text, p->frequency, factor * p->amplitude);
        kmp_print_cells(text, "  %10.2f  %10.4g\n", isfinite(p->amplitude) ? p->phase * (360 / two_pi) : NAN, p->gain);
    }
}

/* Modes without a steady response: growing ones, or undamped ones. */
static void list_poles(kmp_text *text, const kempe_response *r, bool unstable)
{
    const kmp_frequency *f = &r->frequency;
    int count = 0;
    kmp_text line = {0};
    for (int k = 0; f->has_spectrum && k < f->poles.count; k++) {
        bool grows = f->poles.re[k] > 0 && !kmp_frequency_undamped(f, k) && f->poles.im[k] >= 0;
        if (unstable ? !grows : !kmp_frequency_undamped(f, k))
            continue;
        if (count++ == 0)
            kmp_text_put(&line, unstable
                                    ? "The state is unstable, so that no steady response is reached; growing modes: "
                                    : "Responses are unbounded at the undamped modes at ");
        else
            kmp_text_put(&line, ", ");
        if (unstable)
            kmp_text_printf(&line, "grows by e in %.4g s at %.6g Hz", 1 / f->poles.re[k], f->poles.im[k] / two_pi);
        else
            kmp_text_printf(&line, "%.6g Hz", f->poles.im[k] / two_pi);
    }
    if (count > 0)
        kmp_print_wrapped(text, "  ", INDENT, line.s ? line.s : "");
    kmp_text_free_part(text, &line);
}

static void show_title(kmp_text *text, const kempe_response *r)
{
    const kmp_frequency *f = &r->frequency;
    const kmp_channels *c = &r->channels;
    kmp_text title = {0};
    kmp_print_title(&title, c->system->model, kmp_outcome_of(c->status));
    kmp_text_printf(&title, "%d frequencies from %.6g to %.6g Hz about %s%s: ", f->count, f->at[0], f->at[f->count - 1],
                    c->at->equilibrium ? (c->goes_on ? "the steady motion" : "the equilibrium")
                    : c->goes_on       ? "the start, which is a steady motion"
                                       : "the start, which is an equilibrium",
                    kmp_model_has_time(c->system->model) ? " (t = 0)" : "");
    if (f->peak_count > 0)
        kmp_text_printf(&title, "%d peak%s", f->peak_count, f->peak_count == 1 ? "" : "s");
    else
        kmp_text_put(&title, "no peaks");
    kmp_print_answer(text, &title, kmp_outcome_of(c->status), c->warnings, "", NULL);
}

static void show_parts(kmp_text *text, const kempe_response *r, bool all)
{
    const kmp_frequency *f = &r->frequency;
    int width = (int)strlen("response"), room = all ? f->peak_count : MOST_ROWS;
    for (int i = 0; i < f->inputs; i++)
        for (int o = 0; o < f->outputs; o++) {
            kmp_text name = {0};
            put_name(&name, r, i, o);
            width = (int)name.length > width ? (int)name.length : width;
            kmp_text_free_part(text, &name);
        }
    width = width > WIDEST_NAME ? WIDEST_NAME : width;
    show_title(text, r);
    kmp_averaged_put(text, "  Tracks: ", r->channels.averaged);
    kmp_print_held(text, "  Held: ", r->channels.system, r->channels.at->qd);
    if (f->growing > 0)
        kmp_text_printf(text,
                        "  The state is unstable, so that no steady response is reached; %d roots of its delays grow\n",
                        f->growing);
    else if (f->growing < 0)
        kmp_text_put(text, "  The stability with delays is undecided\n");
    list_poles(text, r, true);
    list_poles(text, r, false);
    if (f->phi) {
        kmp_shown as = kmp_shown_as(r->channels.system->context, "s");
        kmp_text_printf(text, "  Inputs are held for T = %.6g %s; outputs are those before each sample\n",
                        as.factor * f->period, as.unit);
    }
    kmp_text_printf(text, "\n  %-*s  %11s  %12s  %10s  %10s\n", width, "response", "Hz", "amplitude", "phase, deg",
                    "gain");
    for (int i = 0; i < f->inputs; i++)
        for (int o = 0; o < f->outputs; o++)
            show_pair(text, r, i, o, width, &room);
    if (room < 0)
        kmp_text_printf(text, "  %d more peaks: --all, --json\n", -room);
    kmp_text_put(text, "  0 Hz: static response; all frequencies: -o FILE.csv, --svg FILE\n");
    kmp_text_printf(text, "  Rounding changes the response by at most %.1e of it\n", f->worst);
}

/* -- JSON -------------------------------------------------------------------------------------------- */

/* Amplitude and phase of one pair over all frequencies; null on poles. */
static void json_pair(kmp_json *j, const kempe_response *r, int input, int output, double *amplitude, double *phase)
{
    int pair = input * r->frequency.outputs + output, count = r->frequency.count;
    for (int k = 0; k < count; k++) {
        kmp_response_point at = kmp_response_at(r, k, pair);
        amplitude[k] = at.amplitude;
        phase[k] = at.phase * (360 / two_pi);
    }
    kmp_json_put(j, "{ input %s output %s still %g", kmp_response_input(r, input), kmp_response_output(r, output),
                 r->frequency.still[output + input * r->frequency.outputs]);
    kmp_json_numbers(j, "amplitude", count, amplitude);
    kmp_json_numbers(j, "phase_deg", count, phase);
    kmp_json_end(j);
}

static void json(kmp_text *text, const void *result)
{
    const kempe_response *r = result;
    const kmp_channels *c = &r->channels;
    const kmp_frequency *f = &r->frequency;
    kmp_json j = kmp_print_head(text, c->system, kmp_outcome_of(c->status), "", c->build_s, c->warnings);
    kmp_json_string(&j, "at", c->at->equilibrium ? "equilibrium" : "start");
    kmp_print_names(&j, "u", c->system, kmp_name_of_coordinate, c->linear.p, c->linear.part.u);
    kmp_print_entries(&j, "q", c->system, KMP_QUANTITY_Q, c->at->q);
    kmp_print_held_json(&j, c->system, c->at->qd);
    kmp_json_array(&j, "inputs");
    for (int i = 0; i < f->inputs; i++)
        kmp_json_put(&j, "{ name %s unit %s }", kmp_response_input(r, i), kmp_response_input_unit(r, i));
    kmp_json_put(&j, "] outputs [");
    for (int o = 0; o < f->outputs; o++)
        kmp_json_put(&j, "{ name %s unit %s }", kmp_response_output(r, o), c->outputs.unit[o]);
    kmp_json_end(&j);
    if (f->phi)
        kmp_json_put(&j, "sample_time %g", f->period);
    kmp_print_pairs(&j, "eigenvalues", f->has_spectrum ? f->poles.count : 0, f->poles.re, f->poles.im);
    kmp_json_array(&j, "peaks");
    for (int k = 0; k < f->peak_count; k++) {
        const kmp_peak *p = &f->peak[k];
        kmp_json_put(&j, "{ input %s output %s frequency %g amplitude %g phase_deg %g gain %g }",
                     kmp_response_input(r, p->input), kmp_response_output(r, p->output), p->frequency, p->amplitude,
                     p->phase * (360 / two_pi), p->gain);
    }
    kmp_json_end(&j);
    kmp_json_put(&j, "rounding { difference %g limit %g frequency %g result %s }", f->worst, KMP_RESPONSE_HOLDS,
                 f->worst_at, f->worst > KMP_RESPONSE_HOLDS ? "not converged" : "converged");
    kmp_json_numbers(&j, "frequency", f->count, f->at);
    kmp_json_array(&j, "responses");
    double *room = KMP_NEW(double, 2 * f->count);
    text->failed = text->failed || !room;
    for (int i = 0; room && i < f->inputs; i++)
        for (int o = 0; o < f->outputs; o++)
            json_pair(&j, r, i, o, room, room + f->count);
    kmp_free(room);
    kmp_json_put(&j, "] }");
}

KMP_PRINT_FULL(kempe_response, response, response->channels.system->context, json, show_parts)

/* -- picture ------------------------------------------------------------------------------------------------ */

/* Amplitudes, logarithmic, and phases over the frequency. Each pair of output and input has a curve through its peaks,
 * which is open at undamped poles. */

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
    double factor = kmp_response_factor(r, input, output);
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
                           kmp_response_factor(r, pair / f->outputs, pair % f->outputs) *
                               kmp_response_at(r, k, pair).amplitude);
    for (int k = 0; k < f->peak_count; k++)
        kmp_plot_reach(&amplitude, f->peak[k].frequency,
                       kmp_response_factor(r, f->peak[k].input, f->peak[k].output) * f->peak[k].amplitude);
    a->low = fmax(a->low, a->high * 1e-10);
    amplitude.axis[0] =
        (kmp_axis){.name = "", .low = f->at[0], .high = f->at[f->count - 1], .logarithmic = !r->linear, .exact = true};
    const kempe_context *context = r->channels.system->context;
    a->name = kmp_context_system(context)                ? "amplitude, units below"
              : kmp_shown_as(context, "rad").factor == 1 ? "amplitude, SI units"
                                                         : "amplitude, degrees and SI units";
    phase.axis[0] = amplitude.axis[0];
    phase.axis[0].name = "frequency, Hz";
    phase.axis[1] = (kmp_axis){.name = "phase, degrees", .low = -180, .high = 180, .exact = true, .tick = 90};
    kmp_picture_begin(text, WIDTH, below + LINE * (drawn + (all > drawn)), "");
    kmp_plot_begin(&amplitude, "%s", kempe_model_name(r->channels.system->model));
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
        kmp_response_put_unit(&unit, r, input, output, ", ", " / ");
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
