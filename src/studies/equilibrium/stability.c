/* SPDX-License-Identifier: BSD-3-Clause */
#include "studies/equilibrium/stability.h"
#include "base/context.h"
#include "constraints/tolerances.h"
#include "derivatives/delayed_motion.h"
#include "derivatives/sampled_motion.h"
#include "linalg/dense/spectrum.h"
#include <math.h>

#define ROUNDING 1e-10 /* of a real part, relative to the largest modulus */

const char *kmp_stability_text(kmp_stability_word word)
{
    static const char *const words[] = {[KMP_STABLE] = "stable",
                                        [KMP_NEUTRAL] = "neutral",
                                        [KMP_UNSTABLE] = "unstable",
                                        [KMP_NOT_HELD] = "not held",
                                        [KMP_UNDECIDED] = "undecided"};
    return words[word];
}

/* The index of the 1 that only this eigenvector of a zero has. */
static int own_place(const kmp_spectrum *s, int vector)
{
    int best = 0;
    for (int i = 0; i < s->p; i++) {
        bool own = s->x_re[i + vector * s->p] == 1;
        for (int j = 0; own && j < s->still; j++)
            own = j == vector || s->x_re[i + j * s->p] == 0;
        if (own)
            return i;
        if (fabs(s->x_re[i + vector * s->p]) > fabs(s->x_re[best + vector * s->p]))
            best = i;
    }
    return best;
}

static kempe_status judge_samples(const kmp_linear *l, kmp_stability *out)
{
    kmp_sampled_spectrum s;
    kempe_status status = kmp_sampled_spectrum_init(&s, l);
    if (status == KEMPE_E_FAILED)
        kmp_context_clear(l->system->context);
    if (status == KEMPE_OK) {
        double largest = 0, re, im;
        bool neutral = false;
        for (int k = 0; k < s.count; k++) {
            kmp_sampled_rate(&s, k, &re, &im);
            largest = fmax(largest, hypot(re, im));
        }
        for (int k = 0; k < s.count; k++) {
            kmp_sampled_rate(&s, k, &re, &im);
            out->growing += re > KMP_SAMPLED_STILL * largest;
            neutral = neutral || fabs(re) <= KMP_SAMPLED_STILL * largest;
            if (!(re <= out->re)) {
                out->re = re;
                out->im = im;
            }
        }
        out->word = out->growing > 0 ? KMP_UNSTABLE : neutral ? KMP_NEUTRAL : KMP_STABLE;
    }
    kmp_sampled_spectrum_free(&s);
    return status == KEMPE_E_FAILED ? KEMPE_OK : status;
}

kempe_status kmp_stability_judge(const kmp_linear *linear, kmp_stability *stability)
{
    kmp_spectrum s;
    *stability = (kmp_stability){.word = KMP_UNDECIDED, .re = NAN, .im = NAN, .along = stability->along};
    if (linear->p == 0) {
        stability->word = KMP_STABLE;
        return KEMPE_OK;
    }
    if (linear->system->model->delay_count > 0) {
        /* A model with delays has roots without end, of which few are on the right: these are counted. */
        int zeros;
        if (kmp_model_has_samples(linear->system->model) || kmp_samples_in(linear->system->model))
            return KEMPE_OK;
        kempe_status status = kmp_delayed_growing(linear, &stability->growing, &zeros);
        if (status == KEMPE_OK)
            stability->word = stability->growing > 0 ? KMP_UNSTABLE : zeros > 0 ? KMP_NEUTRAL : KMP_STABLE;
        else
            stability->growing = 0;
        return status == KEMPE_E_FAILED ? KEMPE_OK : status;
    }
    if (kmp_samples_in(linear->system->model))
        return judge_samples(linear, stability);
    kempe_status status = kmp_linear_spectrum(linear, &s);
    if (status == KEMPE_E_FAILED)
        kmp_context_clear(linear->system->context);
    if (status != KEMPE_OK)
        return status == KEMPE_E_FAILED ? KEMPE_OK : status;
    double largest = 0;
    for (int k = s.zeros; k < s.count; k++)
        largest = fmax(largest, hypot(s.re[k], s.im[k]));
    for (int k = s.zeros; k < s.count; k++) {
        stability->growing += s.re[k] > ROUNDING * largest;
        if (!(s.re[k] <= stability->re)) {
            stability->re = s.re[k];
            stability->im = s.im[k];
        }
    }
    stability->still = s.still;
    for (int k = 0; k < s.still; k++)
        stability->along[k] = linear->part.u[own_place(&s, k)];
    stability->secular = s.secular;
    if (s.secular) { /* rounding may have split it */
        stability->growing -=
            stability->growing > 0 && stability->re <= KMP_SPECTRUM_EQUAL * largest ? stability->growing : 0;
        stability->re = 0;
        stability->im = s.secular_at < s.zeros ? 0 : s.im[s.secular_at];
    }
    stability->word = stability->growing > 0 || stability->secular ? KMP_UNSTABLE
                      : s.zeros > 0                                ? KMP_NEUTRAL
                                                                   : KMP_STABLE;
    kmp_spectrum_free(&s);
    return KEMPE_OK;
}
