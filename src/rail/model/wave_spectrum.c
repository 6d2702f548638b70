/* SPDX-License-Identifier: BSD-3-Clause */
/* Shinozuka and Jan, Digital simulation of random processes and its applications, J. Sound Vib. 25 (1972): each narrow
 * band becomes one harmonic, of the band's variance and with a random phase. */
#include "rail/model/wave_spectrum.h"
#include "base/memory.h"
#include "symbolic/table_function.h"
#include <math.h>
#include <stdint.h>

typedef struct level {
    double alignment, level;
} level;

static const level levels[] = {
#define KMP_SPECTRUM(word, alignment, level) {alignment, level},
#include "model/data/spectra.def"
#undef KMP_SPECTRUM
};

enum { KNOTS_A_WAVE = 16, FLAT_KNOTS = 8 };

static const double pi = 3.14159265358979323846;
static const double rise = 10; /* m over which irregularities begin and end */

/* ERRI B176: S = A wc^2 / ((w^2 + wr^2) (w^2 + wc^2)). For the angle between the rails, with half their distance b, A /
 * b^2 wc^2 w^2 / ((w^2 + wr^2) (w^2 + wc^2) (w^2 + ws^2)); for the height over 2 b this has the factor 4. */
double kmp_wave_spectrum_density(int kind, kmp_irregularity what, double frequency)
{
    static const double wc = 0.8246, wr = 0.0206, ws = 0.4380;
    double w2 = frequency * frequency, form = wc * wc / ((w2 + wr * wr) * (w2 + wc * wc));
    switch (what) {
    case KMP_IRREGULARITY_ALIGNMENT:
        return levels[kind].alignment * form;
    case KMP_IRREGULARITY_LEVEL:
        return levels[kind].level * form;
    case KMP_IRREGULARITY_CROSS:
        return 4 * levels[kind].level * form * w2 / (w2 + ws * ws);
    default:
        return 0;
    }
}

/* -- phases -------------------------------------------------------------------------------------- */

/* SplitMix64 (Steele, Lea and Flood 2014). */
static uint64_t next_random(uint64_t *state)
{
    uint64_t z = *state += 0x9e3779b97f4a7c15u;
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9u;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebu;
    return z ^ (z >> 31);
}

/* -- harmonics ----------------------------------------------------------------------------------- */

typedef struct waves {
    int count;
    double *frequency, *size, *phase;
} waves;

/* The number of waves: large enough that nothing repeats over the length, and that each band is narrow against the
 * lowest frequency. */
static int count_waves(const kmp_wave_spectrum *s)
{
    double low = 2 * pi / s->longest, high = 2 * pi / s->shortest;
    double step = fmin(low / 4, 2 * pi / (s->to - s->from));
    return (int)ceil((high - low) / step);
}

static double height_at(const waves *w, double s)
{
    double sum = 0;
    for (int k = 0; k < w->count; k++)
        sum += w->size[k] * cos(w->frequency[k] * s + w->phase[k]);
    return sum;
}

/* 0 at 0 and less, 1 at 1 and more, with two continuous derivatives. */
static double ease(double u)
{
    u = fmin(fmax(u, 0), 1);
    return u * u * u * (10 + u * (6 * u - 15));
}

double kmp_wave_spectrum_knots(const kmp_wave_spectrum *s)
{
    return ceil(KNOTS_A_WAVE * (s->to - s->from) / s->shortest) + 1;
}

/* More knots beyond either end keep the spline flat there. */
static kmp_table *sample(const kmp_wave_spectrum *s, const waves *w, int knots, double *x, double *y)
{
    double length = s->to - s->from, step = length / (knots - 1), over = fmin(rise, length / 4);
    for (int k = 0; k < knots + 2 * FLAT_KNOTS; k++) {
        double at = (k - FLAT_KNOTS) * step;
        bool inside = at > 0 && at < length;
        x[k] = s->from + at;
        y[k] = inside ? height_at(w, at) * ease(at / over) * ease((length - at) / over) : 0;
    }
    return kmp_table_new(KMP_TABLE_CUBIC, knots + 2 * FLAT_KNOTS, x, y);
}

kmp_table *kmp_wave_spectrum_make(const kmp_wave_spectrum *s, kmp_irregularity what)
{
    int knots = (int)kmp_wave_spectrum_knots(s), all = knots + 2 * FLAT_KNOTS;
    waves w = {.count = count_waves(s)};
    double *room = KMP_NEW(double, 3 * w.count + 2 * all);
    if (!room)
        return NULL;
    w.frequency = room;
    w.size = room + w.count;
    w.phase = w.size + w.count;
    uint64_t state = (uint64_t)s->seed * KMP_IRREGULARITIES + (uint64_t)what;
    double low = 2 * pi / s->longest, step = (2 * pi / s->shortest - low) / w.count;
    for (int k = 0; k < w.count; k++) {
        w.frequency[k] = low + (k + 0.5) * step;
        w.size[k] = s->scale * sqrt(2 * step * kmp_wave_spectrum_density(s->kind, what, w.frequency[k]));
        w.phase[k] = 2 * pi * (double)(next_random(&state) >> 11) / 9007199254740992.0;
    }
    kmp_table *table = sample(s, &w, knots, w.phase + w.count, w.phase + w.count + all);
    kmp_free(room);
    return table;
}
