/* SPDX-License-Identifier: BSD-3-Clause */
/* The frequency response study: its computation, results and table. */
#include "analyses/response/response_study.h"
#include "analyses/dense/complex_lu.h"
#include "analyses/derivatives/delayed_spectrum.h"
#include "analyses/derivatives/sampled_motion.h"
#include "analyses/parts/ranges.h"
#include "base/bracket.h"
#include "base/context.h"
#include "base/memory.h"
#include "constraints/tolerances.h"
#include "dynamics/load_dependent.h"
#include "model/data/parameter.h"
#include "model/read/loads.h"
#include "output/print.h"
#include "output/result_table.h"
#include <complex.h>
#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

/* -- responses ---------------------------------------------------------------------------------------------- */

/* One complex solution for each frequency. Peaks are searched between frequencies around the poles and refined by
 * golden section (base/bracket.h); a rounding estimate marks unreliable values. */

static const double two_pi = 6.283185307179586476925286766559;

/* A real part this small relative to the modulus is rounding. */
static const double on_axis = 1e-10;

/* A static response this small relative to the largest one is rounding. */
static const double no_answer = 1e-12;

/* -- construction ------------------------------------------------------------------------------------ */

static kempe_status make_samples(kmp_frequency *f)
{
    const kmp_transfer *t = f->transfer;
    kempe_context *context = t->linear->system->context;
    ptrdiff_t p = t->p, width = f->size;
    KMP_TRY(kmp_made(context, KMP_ARENA_MAKE(&f->arena, KMP_ROOM(double, 4 * p * p, &f->phi),
                                             KMP_ROOM(double, 2 * p * t->columns, &f->gamma),
                                             KMP_ROOM(double, 2 * p * t->outputs, &f->c),
                                             KMP_ROOM(double, (ptrdiff_t)t->outputs * t->columns, &f->d))));
    int failed = kmp_transfer_first_order(t, f->phi, f->gamma, f->c, f->d);
    KMP_TRY(kmp_made(context, failed != -1));
    if (failed)
        return kmp_sampled_complain(context, -3);
    failed = kmp_transfer_sample(t, f->phi, f->gamma, &f->period);
    return failed == 0 || width == 0 ? KEMPE_OK : kmp_sampled_complain(context, failed);
}

/* Makes room for frequencies that the caller fills in. `sampled`: the transfer belongs to an averaged system
 * (analyses/derivatives/averaged.h). KEMPE_E_MEMORY; KEMPE_E_FAILED with a sentence: there is no map between samples.
 */
static kempe_status frequency_init(kmp_frequency *f, const kmp_transfer *transfer, bool sampled, int count)
{
    ptrdiff_t block = (ptrdiff_t)transfer->inputs->count * transfer->outputs, all = block * count;
    *f = (kmp_frequency){
        .transfer = transfer, .inputs = transfer->inputs->count, .outputs = transfer->outputs, .count = count};
    ptrdiff_t size = f->size = sampled ? kmp_transfer_width(transfer) : transfer->p;
    f->pole = KMP_ARENA_NEW(&f->arena, bool, count);
    f->pivot = KMP_ARENA_NEW(&f->arena, int, size);
    KMP_TRY(kmp_made(transfer->linear->system->context,
                     KMP_ARENA_MAKE(&f->arena, KMP_ROOM(double, all, &f->re, &f->im), KMP_ROOM(double, count, &f->at),
                                    KMP_ROOM(double, block, &f->still, &f->h_re, &f->h_im),
                                    KMP_ROOM(double, size *size, &f->terms), KMP_ROOM(double, size, &f->scale),
                                    KMP_ROOM(double complex, size *size, &f->a),
                                    KMP_ROOM(double complex, size, &f->du, &f->off))));
    return sampled ? make_samples(f) : KEMPE_OK;
}

KMP_CLEARS(kmp_frequency, frequency, kmp_arena_free(&frequency->arena), kmp_free(frequency->peak),
           kmp_spectrum_free(&frequency->poles))

/* True if unknown k is the value of a state. */
static bool is_state(const kmp_frequency *f, int k)
{
    const kmp_linear *l = f->transfer->linear;
    return kmp_state_of(l->system->model, l->part.u[k]);
}

/* -- one frequency ----------------------------------------------------------------------------------- */

/* An entry of -w^2 Mr + i w Gr + Kr; of the column of a state, whose unknown is its value, of i w Mr + Gr. With sampled
 * states of z - phi. */
typedef struct entry {
    double re, im, size;
} entry;

static entry entry_of(const kmp_frequency *f, double w, int row, int column)
{
    const kmp_linear *l = f->transfer->linear;
    if (f->phi) {
        double phi = f->phi[row + (ptrdiff_t)column * f->size];
        double complex z = row == column ? cexp(I * w * f->period) : 0;
        return (entry){creal(z) - phi, cimag(z), fabs(phi) + cabs(z)};
    }
    int e = row + column * f->transfer->p;
    double m = l->mass[e], g = l->damping[e], k = l->stiffness[e];
    double delay = kmp_delay_of(l, column);
    if (delay > 0) {
        double complex y = m * (cexp(I * w * delay) - 1) / delay;
        return (entry){g + creal(y), cimag(y), fabs(g) + fabs(m) / delay};
    }
    if (is_state(f, column))
        return (entry){g, w * m, fabs(g) + w * fabs(m)};
    return (entry){k - w * w * m, w * g, fabs(k) + w * fabs(g) + w * w * fabs(m)};
}

/* The larger of its terms. */
static double size_of_diagonal(const kmp_frequency *f, double w, int k)
{
    const kmp_linear *l = f->transfer->linear;
    if (f->phi)
        return fmax(1, fabs(f->phi[k + (ptrdiff_t)k * f->size]));
    int e = k + k * f->transfer->p;
    double m = fabs(l->mass[e]), g = fabs(l->damping[e]);
    if (kmp_delay_of(l, k) > 0)
        return fmax(g, m / kmp_delay_of(l, k));
    return is_state(f, k) ? fmax(g, w * m) : fmax(fmax(fabs(l->stiffness[e]), w * g), w * w * m);
}

/* S (-w^2 Mr + i w Gr + Kr) S, or S (z - phi) S, its diagonal of the size of one, in factors. false: singular. */
static bool factor(kmp_frequency *f, double w)
{
    int p = f->size;
    for (int k = 0; k < p; k++) {
        double size = size_of_diagonal(f, w, k);
        f->scale[k] = size > 0 ? 1 / sqrt(size) : 1;
    }
    for (int k = 0; k < p; k++)
        for (int i = 0; i < p; i++) {
            int e = i + k * p;
            double s = f->scale[i] * f->scale[k];
            entry x = entry_of(f, w, i, k);
            f->a[e] = KMP_COMPLEX(s * x.re, s * x.im);
            f->terms[e] = s * x.size;
        }
    if (kmp_lu_complex_factor(p, f->a, f->pivot) != 0)
        return false;
    for (int k = 0; k < p; k++) { /* pivots are kept as reciprocals: of singular matrices they are rounding */
        if (kmp_complex_size(f->a[k + k * p]) * p * 32 * DBL_EPSILON > 1)
            return false;
    }
    return true;
}

/* (i w)^order */
static double complex power(double w, int order)
{
    return order == 0 ? 1 : order == 1 ? w * I : -w * w;
}

static double largest(int count, const double complex *x)
{
    double most = 0;
    for (int i = 0; i < count; i++)
        most = fmax(most, cabs(x[i]));
    return most;
}

static void solve(kmp_frequency *f, double w, int input)
{
    int p = f->size;
    /* The loads of an input on the right side: -L, or gamma. */
    const kmp_transfer *t = f->transfer;
    memset(f->du, 0, (size_t)p * sizeof *f->du);
    for (int c = 0; c < t->columns; c++) {
        const double *load = f->phi ? f->gamma + (ptrdiff_t)c * p : t->loads + (ptrdiff_t)c * p;
        double complex swing = f->phi ? -1 : power(w, t->load[c].order);
        for (int i = 0; t->load[c].input == input && i < p; i++)
            f->du[i] -= KMP_COMPLEX(f->scale[i] * creal(swing) * load[i], f->scale[i] * cimag(swing) * load[i]);
    }
    kmp_lu_complex_solve(p, f->a, f->pivot, f->du);
    /* The effect of rounding in the equations' terms on du. */
    memset(f->off, 0, (size_t)p * sizeof *f->off);
    for (int k = 0; k < p; k++) {
        const double modulus = cabs(f->du[k]);
        for (int i = 0; i < p; i++)
            f->off[i] += DBL_EPSILON * f->terms[i + k * p] * modulus;
    }
    kmp_lu_complex_solve(p, f->a, f->pivot, f->off);
    double size = largest(p, f->du), off = largest(p, f->off);
    f->rounding = size > 0 ? fmax(f->rounding, off / size) : f->rounding;
    for (int i = 0; i < p; i++)
        f->du[i] *= f->scale[i];
}

/* The derivative of an output by unknown k. */
static double complex seen_of(const kmp_frequency *f, double w, int output, int k)
{
    const kmp_transfer *t = f->transfer;
    int at = output + k * t->outputs;
    if (f->phi)
        return f->c[at];
    return is_state(f, k) ? t->by_ud[at] + w * t->by_udd[at] * I
                          : t->by_u[at] - w * w * t->by_udd[at] + w * t->by_ud[at] * I;
}

/* Output sums that cancel to rounding are zero, and have no peaks. */
static void put_output(kmp_frequency *f, double w, int output, int input)
{
    const kmp_transfer *t = f->transfer;
    int e = output + input * f->outputs;
    double complex sum = 0;
    double size = 0; /* of its terms */
    for (int k = 0; k < f->size; k++) {
        double complex by = seen_of(f, w, output, k);
        double complex du = f->du[k];
        sum += by * du;
        size += kmp_complex_size(by) * kmp_complex_size(du);
    }
    for (int c = 0; c < t->columns; c++)
        if (t->load[c].input == input) {
            double complex direct = f->phi ? f->d[output + c * t->outputs] : t->direct[output + c * t->outputs];
            double complex term = direct * power(w, t->load[c].order);
            sum += term;
            size += kmp_complex_size(term);
        }
    bool nothing = kmp_complex_size(sum) <= 16 * (f->size + 1) * DBL_EPSILON * size;
    f->h_re[e] = nothing ? 0 : creal(sum);
    f->h_im[e] = nothing ? 0 : cimag(sum);
}

/* Evaluates h_re and h_im at a frequency. False: on an undamped pole. */
static bool evaluate(kmp_frequency *f, double hz)
{
    double w = two_pi * hz;
    f->rounding = 0;
    if (!factor(f, w))
        return false;
    for (int i = 0; i < f->inputs; i++) {
        solve(f, w, i);
        for (int o = 0; o < f->outputs; o++)
            put_output(f, w, o, i);
    }
    return true;
}

/* -- peaks ------------------------------------------------------------------------------------------- */

bool kmp_frequency_undamped(const kmp_frequency *frequency, int k)
{
    const kmp_spectrum *s = &frequency->poles;
    return s->im[k] > 0 && fabs(s->re[k]) <= on_axis * hypot(s->re[k], s->im[k]);
}

static double amplitude(const kmp_frequency *f, int e)
{
    return hypot(f->h_re[e], f->h_im[e]);
}

/* Of only one pair, of which h_re and h_im are evaluated. NaN on a pole. */
static double amplitude_at(kmp_frequency *f, double hz, int e)
{
    double w = two_pi * hz;
    int input = e / f->outputs;
    if (!factor(f, w))
        return NAN;
    solve(f, w, input);
    put_output(f, w, e % f->outputs, input);
    return amplitude(f, e);
}

static int ascending(const void *a, const void *b)
{
    double x = *(const double *)a, y = *(const double *)b;
    return x < y ? -1 : x > y;
}

/* Frequencies to evaluate: the requested ones, and others around each pole; without the ones on undamped poles. NULL:
 * no memory. */
static double *places(const kmp_frequency *f, int *count)
{
    static const double aside[] = {-3, -1, -0.3, 0, 0.3, 1, 3};
    enum { ASIDE = sizeof aside / sizeof *aside };
    int poles = f->has_spectrum ? f->poles.count : 0, many = 0, kept = 0;
    double *list = KMP_NEW(double, f->count + ASIDE * poles), first = f->at[0], last = f->at[f->count - 1];
    if (!list)
        return NULL;
    for (int k = 0; k < f->count; k++)
        if (!f->pole[k])
            list[many++] = f->at[k];
    for (int k = 0; k < poles; k++) {
        double re = fabs(f->poles.re[k]), im = f->poles.im[k];
        for (int j = 0; j < ASIDE && im > re && !kmp_frequency_undamped(f, k); j++) {
            double hz = (sqrt((im - re) * (im + re)) + aside[j] * re) / two_pi;
            if (hz > first && hz < last)
                list[many++] = hz;
        }
    }
    qsort(list, (size_t)many, sizeof *list, ascending);
    for (int k = 0; k < many; k++)
        if (k == 0 || list[k] > list[kept - 1])
            list[kept++] = list[k];
    *count = kept;
    return list;
}

static bool add_peak(kmp_frequency *f, kmp_peak peak)
{
    kmp_peak *grown = kmp_realloc(f->peak, (size_t)f->peak_count + 1, sizeof *grown);
    if (!grown)
        return false;
    f->peak = grown;
    double still = f->still[peak.output + peak.input * f->outputs];
    peak.gain = still > 0 ? peak.amplitude / still : NAN;
    f->peak[f->peak_count++] = peak;
    return true;
}

typedef struct pair {
    kmp_frequency *f;
    int e;
} pair;

static double less_at(void *self, double hz)
{
    const pair *x = self;
    return -amplitude_at(x->f, hz, x->e);
}

/* True if there is an undamped pole between the places low and high. */
static bool parted(const kmp_frequency *f, double low, double high)
{
    for (int k = 0; f->has_spectrum && k < f->poles.count; k++) {
        double hz = f->poles.im[k] / two_pi;
        if (kmp_frequency_undamped(f, k) && hz > low && hz < high)
            return true;
    }
    return false;
}

/* Relative accuracy of the frequency of a maximum, limited by the accuracy of the values. */
static const double as_near = 1e-9;

/* A maximum counts that rises and falls by more than rounding. */
static const double risen = 1e-9;

/* values: amplitudes of all pairs at all places, none of them on a pole. */
static bool find_maxima(kmp_frequency *f, int count, const double *place, const double *values, int input, int output)
{
    size_t block = (size_t)f->inputs * (size_t)f->outputs;
    const double *v = values + output + input * f->outputs;
    double low = INFINITY;
    int best = -1; /* the highest place so far while the amplitude rises */
    bool ok = true;
    for (int k = 0; ok && k < count; k++) {
        double now = v[(size_t)k * block], most = best >= 0 ? v[(size_t)best * block] : 0;
        if (k > 0 && parted(f, place[k - 1], place[k])) { /* it decreased from infinity */
            best = -1;
            low = now;
        } else if (best < 0) {
            best = now > low * (1 + risen) ? k : -1;
            low = fmin(low, now);
        } else if (now > most) {
            best = k;
        } else if (now < most * (1 - risen)) {
            int e = output + input * f->outputs;
            pair x = {f, e};
            double hz = kmp_bracket_least(less_at, &x, place[best - 1], place[best + 1], as_near * place[best + 1]);
            (void)amplitude_at(f, hz, e);
            ok = add_peak(f, (kmp_peak){input, output, hz, amplitude(f, e), atan2(f->h_im[e], f->h_re[e]), 0});
            best = -1;
            low = now;
        }
    }
    return ok;
}

static bool find_poles(kmp_frequency *f, int input, int output)
{
    bool ok = true;
    for (int k = 0; ok && f->has_spectrum && k < f->poles.count; k++) {
        double hz = f->poles.im[k] / two_pi;
        if (!kmp_frequency_undamped(f, k) || hz < f->at[0] || hz > f->at[f->count - 1])
            continue;
        /* The pole is in this response where the amplitude near it varies with the inverse of the distance. */
        int e = output + input * f->outputs;
        double near = amplitude_at(f, hz * (1 + 1e-9), e), far = amplitude_at(f, hz * (1 + 1e-3), e);
        if (isnan(near) || near > 100 * far)
            ok = add_peak(f, (kmp_peak){input, output, hz, INFINITY, NAN, 0});
    }
    return ok;
}

static int by_place(const void *a, const void *b)
{
    const kmp_peak *x = a, *y = b;
    if (x->input != y->input)
        return x->input - y->input;
    if (x->output != y->output)
        return x->output - y->output;
    return ascending(&x->frequency, &y->frequency);
}

static kempe_status look_for_peaks(kmp_frequency *f)
{
    kempe_context *context = f->transfer->linear->system->context;
    size_t block = (size_t)f->inputs * (size_t)f->outputs;
    int count = 0;
    double *place = places(f, &count), *values = place ? KMP_NEW(double, (size_t)count *block) : NULL;
    bool ok = values;
    for (int k = 0; ok && k < count; k++) {
        bool there = evaluate(f, place[k]);
        for (size_t e = 0; e < block; e++)
            values[(size_t)k * block + e] = there ? amplitude(f, (int)e) : 0;
    }
    for (int i = 0; i < f->inputs; i++)
        for (int o = 0; ok && o < f->outputs && !kmp_interrupted(context); o++)
            ok = find_maxima(f, count, place, values, i, o) && find_poles(f, i, o);
    if (f->peak_count > 0)
        qsort(f->peak, (size_t)f->peak_count, sizeof *f->peak, by_place);
    kmp_free(place);
    kmp_free(values);
    if (kmp_interrupted(context))
        return KEMPE_STOPPED;
    return ok ? KEMPE_OK : kmp_fail_memory(context);
}

/* -- all frequencies --------------------------------------------------------------------------------- */

/* Poles as ln(z)/T of the map. */
static kempe_status find_sampled_poles(kmp_frequency *f)
{
    kmp_sampled_spectrum map;
    kmp_spectrum *s = &f->poles;
    kempe_status status = kmp_sampled_spectrum_init(&map, f->transfer->linear);
    if (status == KEMPE_OK)
        status = kmp_made(f->transfer->linear->system->context,
                          KMP_ARENA_MAKE(&s->arena, KMP_ROOM(double, map.count, &s->re, &s->im)));
    s->count = status == KEMPE_OK ? map.count : 0;
    for (int k = 0; k < s->count; k++)
        kmp_sampled_rate(&map, k, &s->re[k], &s->im[k]);
    kmp_sampled_spectrum_free(&map);
    return status;
}

/* Computes the responses at all frequencies, the poles, and the peaks: between the given frequencies, too, which are
 * searched near the poles. KEMPE_E_MEMORY; KEMPE_STOPPED when interrupted. */
static kempe_status run_over_frequencies(kmp_frequency *f)
{
    const kmp_linear *l = f->transfer->linear;
    kempe_context *context = l->system->context;
    for (int k = 0; k < f->count; k++) {
        size_t block = (size_t)f->inputs * (size_t)f->outputs, first = (size_t)k * block;
        f->pole[k] = !evaluate(f, f->at[k]);
        if (!f->pole[k] && f->rounding > f->worst) {
            f->worst = f->rounding;
            f->worst_at = f->at[k];
        }
        for (size_t e = 0; e < block; e++) {
            f->re[first + e] = f->pole[k] ? NAN : f->h_re[e];
            f->im[first + e] = f->pole[k] ? NAN : f->h_im[e];
        }
        kmp_progress(context, KMP_PROGRESS_STUDY, k + 1, f->count, "frequencies");
        if (kmp_interrupted(context))
            return KEMPE_STOPPED;
    }
    bool endless = kmp_model_delay_count(l->system->model) > 0; /* the poles of delays are */
    kempe_status status = endless ? KEMPE_OK : f->phi ? find_sampled_poles(f) : kmp_linear_spectrum(l, &f->poles);
    f->has_spectrum = status == KEMPE_OK && !endless;
    if (status == KEMPE_E_MEMORY)
        return status;
    kmp_context_clear(context);
    if (endless) {
        int zeros;
        status = kmp_delayed_growing(f->transfer->linear, &f->growing, &zeros);
        if (status ==
            KEMPE_E_FAILED) /* a root too close to the axis: the response is not attained in a time that matters */
            f->growing = -1;
        else
            KMP_TRY(status);
    }
    /* The response at rest, zero where it is rounding of the largest one. */
    bool rests = evaluate(f, 0);
    size_t block = (size_t)f->inputs * (size_t)f->outputs, all = block * (size_t)f->count;
    for (size_t e = 0; e < block; e++) {
        double most = 0, still = rests ? amplitude(f, (int)e) : NAN;
        for (size_t k = e; k < all; k += block)
            most = fmax(most, hypot(f->re[k], f->im[k])); /* of a pole: NaN, which fmax ignores */
        f->still[e] = still <= no_answer * most ? 0 : still;
    }
    return look_for_peaks(f);
}

/* -- the study ---------------------------------------------------------------------------------------------- */

enum { DEFAULT_COUNT = 200 };

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

/* Frequencies are cycles per time: an angle per time, such as rad/s and rpm, is divided by the angle of a cycle. */
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
                        "frequencies must be below half the sampling frequency, %.9g Hz, because samples cannot "
                        "distinguish higher ones; %.9g Hz is above it",
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
    const kmp_channels_options requested = {options->at,          options->inputs,  options->outputs,
                                            options->independent, options->backend, options->slide};
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
        return kmp_fail(
            c->system->context, KEMPE_E_FAILED,
            "%s: the start is not an equilibrium (%.1e of the forces unbalanced, or changing with the motion); use an "
            "equilibrium (--at equilibrium) or a steady motion (--at 'equilibrium NAME=RATE')",
            kempe_model_name(c->system->model), c->residual);
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
                            "inputs: '%s' acts by its rate, and an input that is held between samples has none; use "
                            "a force, an effort or a parameter",
                            c->inputs.input[c->transfer.load[k].input].name);
    KMP_TRY(read_range(&r->channels, options, &range));
    KMP_TRY(frequency_init(&r->frequency, &r->channels.transfer, samples, range.count));
    KMP_TRY(check_samples(r, options, &range));
    r->linear = options->linear;
    kmp_range logarithms = {.from = log(range.from), .to = log(range.to), .count = range.count};
    for (int k = 0; k < range.count; k++)
        r->frequency.at[k] = r->linear              ? kmp_range_value(&range, k, range.count)
                             : k == 0               ? range.from
                             : k == range.count - 1 ? range.to
                                                    : exp(kmp_range_value(&logarithms, k, range.count));
    KMP_TRY(run_over_frequencies(&r->frequency));
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

static kmp_shown output_shown(const kempe_response *r, int output)
{
    const kempe_context *context = r->channels.system->context;
    return kmp_shown_as(context, kmp_print_unknown(context, r->channels.outputs.unit[output]));
}

static kmp_shown input_shown(const kempe_response *r, int input)
{
    const kempe_context *context = r->channels.system->context;
    return kmp_shown_as(context, kmp_print_unknown(context, kmp_response_input_unit(r, input)));
}

double kmp_response_factor(const kempe_response *r, int input, int output)
{
    return output_shown(r, output).factor / input_shown(r, input).factor;
}

void kmp_response_put_unit(kmp_text *text, const kempe_response *r, int input, int output, const char *before,
                           const char *over)
{
    const char *of = output_shown(r, output).unit, *by = input_shown(r, input).unit;
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
        kmp_response_put_unit(&unit, r, i, o, "", "/");
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
            kmp_tabulate_cells(table, "%g %g", kmp_response_factor(r, p / f->outputs, p % f->outputs) * at.amplitude,
                               at.phase * (360 / two_pi));
        }
    }
}

static void fill_peaks(kempe_table *table, const void *result)
{
    const kempe_response *r = result;
    kmp_tabulate_columns(table, "input[words] output[words] frequency[Hz] amplitude phase[deg] gain unit[words]");
    for (const kmp_peak *p = r->frequency.peak; p < r->frequency.peak + r->frequency.peak_count; p++) {
        kmp_text unit = {0};
        kmp_text_put(&unit, "");
        kmp_response_put_unit(&unit, r, p->input, p->output, "", "/");
        KMP_TABULATE(table, "%s %s %g %g %g %g %s", kmp_response_input(r, p->input), kmp_response_output(r, p->output),
                     p->frequency, kmp_response_factor(r, p->input, p->output) * p->amplitude,
                     p->phase * (360 / two_pi), p->gain, unit.s ? unit.s : "");
        kmp_text_free(&unit);
    }
}

KMP_TABLES(kempe_response, response, response->channels.system->context, {"rows", fill_rows}, {"peaks", fill_peaks})
