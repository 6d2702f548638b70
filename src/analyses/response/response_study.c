/* SPDX-License-Identifier: BSD-3-Clause */
/* The frequency response study: its computation, results and table. */
#include "analyses/response/response_study.h"
#include "analyses/derivatives/sampled_motion.h"
#include "base/memory.h"
#include "constraints/tolerances.h"
#include "dynamics/load_dependent.h"
#include "model/data/model.h"
#include "model/language/ranges.h"
#include "model/read/loads.h"
#include "output/print.h"
#include "output/result_table.h"
#include <string.h>

enum { DEFAULT_COUNT = 200 };

static const double two_pi = 6.283185307179586476925286766559;

/* -- frequencies ------------------------------------------------------------------------------------- */

/* Whole decades around the natural frequencies; 0.1 to 100 Hz where there are none. */
static kempe_status usual_range(const kmp_channels *c, kmp_range *range)
{
    const kmp_linear *l = &c->linear;
    kmp_spectrum s;
    double least = INFINITY, most = 0;
    kempe_status status = kmp_linear_spectrum(l, &s);
    if (status == KEMPE_E_MEMORY)
        return status;
    for (int k = 0; status == KEMPE_OK && k < s.count; k++) {
        double hz = hypot(s.re[k], s.im[k]) / two_pi;
        if (s.im[k] > 0) {
            least = fmin(least, hz);
            most = fmax(most, hz);
        }
    }
    if (status == KEMPE_OK)
        kmp_spectrum_free(&s);
    else
        kmp_context_clear(c->system->context);
    *range = (kmp_range){.from = 0.1, .to = 100, .count = DEFAULT_COUNT};
    if (most > 0) {
        range->from = pow(10, floor(log10(least) - 0.5));
        range->to = pow(10, ceil(log10(most) + 0.5));
    }
    return KEMPE_OK;
}

/* Frequencies are cycles per time: an angle per time, such as rad/s and rpm, is divided by that of a cycle. */
static double in_cycles(double rate, int angle)
{
    return angle == 1 ? rate / two_pi : rate;
}

static kempe_status check_range(kempe_context *context, const kmp_range *range, const char *text, bool linear)
{
    if (range->count == 1 || !(range->to > range->from) || range->from < 0)
        return kmp_fail(context, KEMPE_E_ARGUMENT,
                        "frequencies are written A:B or A:B:N with A below B, in Hz, rad/s or rpm, not '%s'", text);
    if (range->from == 0 && !linear)
        return kmp_fail(
            context, KEMPE_E_ARGUMENT,
            "logarithmic frequencies cannot begin at 0: use a positive frequency, or linear spacing (--linear)");
    return KEMPE_OK;
}

/* The end of the usual range is at most half the frequency of the samples; a requested one must be. */
static kempe_status check_samples(const kempe_response *r, const kempe_response_options *options, kmp_range *range)
{
    double most = r->frequency.phi ? 0.5 / r->frequency.period : INFINITY;
    if (range->to <= most * (1 + KMP_SAME_SAMPLE))
        return KEMPE_OK;
    if (options->frequencies)
        return kmp_fail(r->channels.system->context, KEMPE_E_ARGUMENT,
                        "frequencies end at half of that of the samples, %.9g Hz, beyond which a sampled input is one "
                        "of a lower frequency; %.9g Hz is above it",
                        most, range->to);
    range->to = most;
    range->from = fmin(range->from, most / 100);
    return KEMPE_OK;
}

static kempe_status read_range(const kmp_channels *c, const kempe_response_options *options, kmp_range *range)
{
    kempe_context *context = c->system->context;
    kmp_ranges ranges = {0};
    kmp_text text = {0};
    if (!options->frequencies)
        return usual_range(c, range);
    kmp_text_printf(&text, "frequencies=%s", options->frequencies);
    kempe_status status = text.failed ? kmp_fail_memory(context) : kmp_ranges_read(context, text.s, &ranges);
    kmp_text_free(&text);
    if (status != KEMPE_OK)
        return status;
    if (ranges.count == 1 && ranges.range) { /* another one: not understood */
        status = kmp_range_fits(context, "the response", &ranges.range[0], KMP_DIM(0, 0, -1));
        *range = ranges.range[0];
        range->from = in_cycles(range->from, range->angle[0]);
        range->to = in_cycles(range->to, range->angle[1]);
    }
    range->name = NULL;
    kmp_ranges_free(&ranges);
    if (status == KEMPE_OK)
        status = check_range(context, range, options->frequencies, options->linear);
    range->count = range->count > 1 ? range->count : DEFAULT_COUNT;
    return status;
}

/* -- construction ------------------------------------------------------------------------------------ */

static kempe_status make(kempe_response *r, const kempe_system *system, const kempe_response_options *options)
{
    const kmp_channels_options requested = {options->at, options->inputs, options->outputs, options->independent,
                                            options->backend};
    const bool samples = kmp_samples_in(system->model);
    kmp_range range = {.count = 1};
    if (!options->inputs || !options->inputs[0])
        return kmp_fail(
            system->context, KEMPE_E_ARGUMENT,
            "a frequency response needs inputs: effort(JOINT), force(BODY.POINT.x), drive(DRIVE), or parameters");
    if (samples)
        KMP_TRY(kmp_refuse_delays(system->model, "frequency responses of models with samples", KMP_INSTEAD_OF_DELAY));
    KMP_TRY(kmp_channels_init(&r->channels, system, &requested));
    const kmp_channels *c = &r->channels;
    if (!c->rests)
        return kmp_fail(c->system->context, KEMPE_E_FAILED,
                        "%s: the start is not an equilibrium (%.1e of the forces is not balanced, or the forces change "
                        "with the motion), and small oscillations need one; use an equilibrium (--at equilibrium) or a "
                        "steady motion (--at 'equilibrium NAME=RATE')",
                        c->system->model->name, c->residual);
    /* Rejects varying dimensions: their rates would act, which equations of rigid parts do not contain. */
    for (int k = 0; k < c->inputs.count; k++)
        if (kmp_transfer_moves_closures(&c->transfer, k))
            return kmp_fail(c->system->context, KEMPE_E_ARGUMENT,
                            "inputs: parameter '%s' moves closures, and its rates are undefined; use a drive in the "
                            "model and the input drive(NAME)",
                            c->inputs.input[k].name);
    for (int k = 0; kmp_samples_in(c->system->model) && k < c->transfer.columns; k++)
        if (c->transfer.load[k].order > 0)
            return kmp_fail(c->system->context, KEMPE_E_ARGUMENT,
                            "inputs: '%s' moves closures, and an input that is held between samples has no rates; use "
                            "a force, an effort or a parameter",
                            c->inputs.input[c->transfer.load[k].input].name);
    KMP_TRY(read_range(&r->channels, options, &range));
    KMP_TRY(kmp_frequency_init(&r->frequency, &r->channels.transfer, samples, range.count));
    KMP_TRY(check_samples(r, options, &range));
    r->linear = options->linear;
    kmp_range logarithms = {.from = log(range.from), .to = log(range.to), .count = range.count};
    for (int k = 0; k < range.count; k++)
        r->frequency.at[k] = r->linear              ? kmp_range_value(&range, k, range.count)
                             : k == 0               ? range.from
                             : k == range.count - 1 ? range.to
                                                    : exp(kmp_range_value(&logarithms, k, range.count));
    KMP_TRY(kmp_frequency_run(&r->frequency));
    if (r->frequency.worst > KMP_RESPONSE_HOLDS)
        kmp_doubt(system->context,
                  "do not trust the response at %.9g Hz: rounding of the equations changes it by %.2g of its size; an "
                  "almost undamped pole is close to this frequency",
                  r->frequency.worst_at, r->frequency.worst);
    return KEMPE_OK;
}

kempe_status kempe_response_new(const kempe_system *system, const kempe_response_options *options,
                                kempe_response **response)
{
    KMP_WANTED_BOTH(system, response);
    KMP_OPTIONS(system->context, kempe_response_options, options);
    kmp_model_begin_forces(system->model);
    KMP_MAKE(system->context, kempe_response, r);
    kempe_status status = make(r, system, options);
    r->channels.warnings = kmp_context_warnings(system->context);
    r->channels.status = status = kmp_context_verdict(system->context, status);
    return KMP_GIVE_OR_FREE(status, response, r, kempe_response_free);
}

KMP_FREES(kempe_response, r, kmp_frequency_free(&r->frequency), kmp_channels_free(&r->channels))

void kmp_response_put_unit(kmp_text *text, const kempe_response *r, int input, const char *of, const char *before,
                           const char *over)
{
    const char *by = kmp_response_input_unit(r, input);
    if (of[0] && by[0])
        kmp_text_printf(text, strpbrk(by, " *") ? "%s%s%s(%s)" : "%s%s%s%s", before, of, over, by);
}

/* -- tables -------------------------------------------------------------------------------------- */

static void fill_rows(kempe_table *table, const void *result)
{
    const kempe_response *r = result;
    const kmp_frequency *f = &r->frequency;
    int pairs = f->inputs * f->outputs;
    kmp_tabulate_columns(table, "frequency[Hz]");
    kmp_tabulate_look(table, r->linear ? KMP_LOOK_PLAIN : KMP_LOOK_LOGARITHMIC);
    for (int k = 0; k < pairs; k++) {
        int i = k / f->outputs, o = k % f->outputs;
        const char *output = kmp_response_output(r, o), *input = kmp_response_input(r, i);
        kmp_text unit = {0};
        kmp_response_put_unit(&unit, r, i, kmp_response_shown(r, o).unit, "", "/");
        kmp_tabulate_column(table, unit.s ? unit.s : "", "%s/%s.amplitude", output, input);
        kmp_tabulate_look(table, KMP_LOOK_LOGARITHMIC);
        kmp_tabulate_column(table, "deg", "%s/%s.phase", output, input);
        kmp_tabulate_look(table, KMP_LOOK_PERIODIC);
        kmp_text_free(&unit);
    }
    for (int k = 0; k < f->count; k++) {
        KMP_TABULATE(table, "%g", f->at[k]);
        for (int p = 0; p < pairs; p++) {
            kmp_response_point at = kmp_response_at(r, k, p);
            kmp_tabulate_cells(table, "%g %g", kmp_response_shown(r, p % f->outputs).factor * at.amplitude,
                               at.phase * (360 / two_pi));
        }
    }
}

static void fill_peaks(kempe_table *table, const void *result)
{
    const kempe_response *r = result;
    kmp_tabulate_columns(table, "input[words] output[words] frequency[Hz] amplitude phase[deg] gain");
    for (const kmp_peak *p = r->frequency.peak; p < r->frequency.peak + r->frequency.peak_count; p++)
        KMP_TABULATE(table, "%s %s %g %g %g %g", kmp_response_input(r, p->input), kmp_response_output(r, p->output),
                     p->frequency, kmp_response_shown(r, p->output).factor * p->amplitude, p->phase * (360 / two_pi),
                     p->gain);
}

KMP_TABLES(kempe_response, response, response->channels.system->context, {"rows", fill_rows}, {"peaks", fill_peaks})
