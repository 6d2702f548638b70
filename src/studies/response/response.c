/* SPDX-License-Identifier: BSD-3-Clause */
/* The frequency response study: its computation, results and table. */
#include "studies/response/response.h"
#include "base/file.h"
#include "base/memory.h"
#include "model/expressions/ranges.h"
#include <kempe/response.h>
#include <math.h>
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

/* True if no unit but Hz follows the numbers: other units of inverse time do not mean cycles. */
static bool in_hertz(const char *text)
{
    for (const char *s = text; *s;) {
        double x;
        size_t digits = kmp_text_to_number(s, &x);
        if (digits > 0)
            s += digits;
        else if (strncmp(s, "Hz", 2) == 0)
            s += 2;
        else if (!strchr(" :+-", *s++))
            return false;
    }
    return true;
}

static kempe_status check_range(kempe_context *context, const kmp_range *range, const char *text, bool linear)
{
    if (range->count == 1 || !(range->to > range->from) || range->from < 0 || !in_hertz(text))
        return kmp_fail(context, KEMPE_E_ARGUMENT,
                        "frequencies are written A:B or A:B:N in Hz with A below B, not '%s'", text);
    if (range->from == 0 && !linear)
        return kmp_fail(
            context, KEMPE_E_ARGUMENT,
            "logarithmic frequencies cannot begin at 0: use a positive frequency, or linear spacing (--linear)");
    return KEMPE_OK;
}

static kempe_status read_range(const kmp_channels *c, const kempe_response_options *ask, kmp_range *range)
{
    kempe_context *context = c->system->context;
    kmp_ranges ranges = {0};
    kmp_text text = {0};
    if (!ask->frequencies)
        return usual_range(c, range);
    kmp_text_printf(&text, "frequencies=%s", ask->frequencies);
    kempe_status status = text.failed ? kmp_fail_memory(context) : kmp_ranges_read(context, text.s, &ranges);
    kmp_text_free(&text);
    if (status != KEMPE_OK)
        return status;
    if (ranges.count == 1 && ranges.range) /* another one: not understood */
        *range = ranges.range[0];
    range->name = NULL;
    kmp_ranges_free(&ranges);
    status = check_range(context, range, ask->frequencies, ask->linear);
    range->count = range->count > 1 ? range->count : DEFAULT_COUNT;
    return status;
}

static void fill_range(const kmp_range *range, bool linear, double *hz)
{
    kmp_range logarithms = {.from = log(range->from), .to = log(range->to), .count = range->count};
    for (int k = 0; k < range->count; k++)
        hz[k] = linear                  ? kmp_range_value(range, k, range->count)
                : k == 0                ? range->from
                : k == range->count - 1 ? range->to
                                        : exp(kmp_range_value(&logarithms, k, range->count));
}

/* -- construction ------------------------------------------------------------------------------------ */

static kempe_status check_state(const kmp_channels *c)
{
    if (c->rests)
        return KEMPE_OK;
    return kmp_fail(c->system->context, KEMPE_E_FAILED,
                    "%s: the start is not an equilibrium (%.1e of the forces is not balanced, or the forces change "
                    "with the motion), and small oscillations need one; use an equilibrium (--at equilibrium) or a "
                    "steady motion (--at 'equilibrium NAME=RATE')",
                    c->system->model->name, c->residual);
}

/* Rejects varying dimensions: their rates would act, which equations of rigid parts do not contain. */
static kempe_status check_inputs(const kmp_channels *c)
{
    for (int k = 0; k < c->inputs.count; k++)
        if (kmp_transfer_moves_closures(&c->transfer, k))
            return kmp_fail(c->system->context, KEMPE_E_ARGUMENT,
                            "inputs: parameter '%s' moves closures, and its rates are undefined; use a drive in the "
                            "model and the input drive(NAME)",
                            c->inputs.input[k].name);
    return KEMPE_OK;
}

static kempe_status make(kempe_response *r, const kempe_system *system, const kempe_response_options *ask)
{
    const kmp_channels_ask asked = {ask->at, ask->inputs, ask->outputs, ask->independent, ask->backend};
    kmp_range range = {.count = 1};
    if (!ask->inputs || !ask->inputs[0])
        return kmp_fail(
            system->context, KEMPE_E_ARGUMENT,
            "a frequency response needs inputs: effort(JOINT), force(BODY.POINT.x), drive(DRIVE), or parameters");
    kempe_status status = kmp_channels_init(&r->channels, system, &asked);
    if (status == KEMPE_OK)
        status = check_state(&r->channels);
    if (status == KEMPE_OK)
        status = check_inputs(&r->channels);
    if (status == KEMPE_OK)
        status = read_range(&r->channels, ask, &range);
    if (status == KEMPE_OK)
        status = kmp_frequency_init(&r->frequency, &r->channels.transfer, range.count);
    if (status != KEMPE_OK)
        return status;
    r->linear = ask->linear;
    fill_range(&range, r->linear, r->frequency.at);
    status = kmp_frequency_run(&r->frequency);
    if (status == KEMPE_OK && r->frequency.worst > KMP_RESPONSE_HOLDS)
        kmp_log(system->context, KEMPE_LOG_WARNING,
                "do not trust the response at %.9g Hz: rounding of the equations changes it by %.2g of its size; an "
                "almost undamped pole is close to this frequency",
                r->frequency.worst_at, r->frequency.worst);
    return status;
}

kempe_status kempe_response_new(const kempe_system *system, const kempe_response_options *ask,
                                kempe_response **response)
{
    KMP_WANTED(NULL, system, "system");
    ask = ask ? ask : &(const kempe_response_options){0};
    KMP_WANTED(system->context, response, "response");
    kmp_context_begin(system->context);
    kempe_response *r = KMP_NEW(kempe_response, 1);
    if (!r)
        return kmp_fail_memory(system->context);
    kempe_status status = make(r, system, ask);
    r->channels.warnings = kmp_context_warnings(system->context);
    if (status == KEMPE_OK)
        *response = r;
    else
        kempe_response_free(r);
    return status;
}

void kempe_response_free(kempe_response *r)
{
    if (!r)
        return;
    kmp_frequency_free(&r->frequency);
    kmp_channels_free(&r->channels);
    kmp_free(r);
}

/* -- results ----------------------------------------------------------------------------------------- */

int kempe_response_count(const kempe_response *r)
{
    KMP_GIVEN(r, 0);
    return r->frequency.count;
}

double kempe_response_frequency(const kempe_response *r, int k)
{
    KMP_GIVEN(r && k >= 0 && k < r->frequency.count, NAN);
    return r->frequency.at[k];
}

int kempe_response_input_count(const kempe_response *r)
{
    KMP_GIVEN(r, 0);
    return r->channels.inputs.count;
}

int kempe_response_output_count(const kempe_response *r)
{
    KMP_GIVEN(r, 0);
    return r->channels.outputs.count;
}

const char *kempe_response_input_name(const kempe_response *r, int input)
{
    KMP_GIVEN(r && input >= 0 && input < r->channels.inputs.count, "");
    return r->channels.inputs.input[input].name;
}

const char *kempe_response_output_name(const kempe_response *r, int output)
{
    KMP_GIVEN(r && output >= 0 && output < r->channels.outputs.count, "");
    return r->channels.outputs.name[output];
}

const char *kempe_response_input_unit(const kempe_response *r, int input)
{
    KMP_GIVEN(r && input >= 0 && input < r->channels.inputs.count, "");
    return kmp_response_input_unit(r, input);
}

const char *kempe_response_output_unit(const kempe_response *r, int output)
{
    KMP_GIVEN(r && output >= 0 && output < r->channels.outputs.count, "");
    return r->channels.outputs.unit[output];
}

int kempe_response_at(const kempe_response *r, int k, int input, int output, double *re, double *im)
{
    KMP_GIVEN(r && k >= 0 && k < r->frequency.count && input >= 0 && input < r->frequency.inputs && output >= 0 &&
                  output < r->frequency.outputs,
              0);
    const kmp_frequency *f = &r->frequency;
    size_t e = ((size_t)k * (size_t)f->inputs + (size_t)input) * (size_t)f->outputs + (size_t)output;
    if (f->pole[k])
        return 0;
    if (re)
        *re = f->re[e];
    if (im)
        *im = f->im[e];
    return 1;
}

int kempe_response_peak_count(const kempe_response *r)
{
    KMP_GIVEN(r, 0);
    return r->frequency.peak_count;
}

kempe_peak kempe_response_peak(const kempe_response *r, int k)
{
    KMP_GIVEN(r && k >= 0 && k < r->frequency.peak_count,
              ((kempe_peak){.input = -1, .output = -1, .frequency = NAN, .amplitude = NAN, .phase = NAN, .gain = NAN}));
    const kmp_peak *p = &r->frequency.peak[k];
    return (kempe_peak){p->input, p->output, p->frequency, p->amplitude, p->phase, p->gain};
}

void kmp_response_put_unit(kmp_text *text, const kempe_response *r, int input, int output, const char *before,
                           const char *over)
{
    const char *of = kempe_response_output_unit(r, output), *by = kempe_response_input_unit(r, input);
    if (of[0] && by[0])
        kmp_text_printf(text, strchr(by, ' ') ? "%s%s%s(%s)" : "%s%s%s%s", before, of, over, by);
}

/* -- the table --------------------------------------------------------------------------------------- */

static void write_number(kmp_text *text, double x)
{
    kmp_text_put(text, ",");
    if (isfinite(x))
        kmp_text_number(text, x);
}

/* A cell for each pair: of the heads and, k from 0 on, of a frequency's row. */
static void write_pairs(kmp_text *text, const kempe_response *r, int k, bool units)
{
    for (int i = 0; i < r->frequency.inputs; i++)
        for (int o = 0; o < r->frequency.outputs; o++) {
            const char *output = kempe_response_output_name(r, o), *input = kempe_response_input_name(r, i);
            double re = NAN, im = NAN;
            if (k >= 0) {
                (void)kempe_response_at(r, k, i, o, &re, &im);
                write_number(text, hypot(re, im));
                write_number(text, atan2(im, re) * (360 / two_pi));
            } else if (units) {
                kmp_text_put(text, ",");
                kmp_response_put_unit(text, r, i, o, "", "/");
                kmp_text_put(text, ",deg");
            } else {
                kmp_text_printf(text, ",%s/%s.amplitude,%s/%s.phase", output, input, output, input);
            }
        }
    kmp_text_put(text, "\n");
}

kempe_status kempe_response_write_csv(const kempe_response *r, const char *path)
{
    KMP_WANTED(NULL, r, "response");
    KMP_WANTED(r->channels.system->context, path, "path");
    kempe_context *context = r->channels.system->context;
    kmp_text text = {0};
    kmp_context_clear(context);
    kmp_text_put(&text, "# units: Hz");
    write_pairs(&text, r, -1, true);
    kmp_text_put(&text, "frequency");
    write_pairs(&text, r, -1, false);
    for (int k = 0; k < r->frequency.count; k++) {
        kmp_text_number(&text, r->frequency.at[k]);
        write_pairs(&text, r, k, false);
    }
    return kmp_file_write(context, path, &text);
}
