/* SPDX-License-Identifier: BSD-3-Clause */
#include "studies/equilibrium/stability.h"
#include "base/context.h"
#include "base/memory.h"
#include "derivatives/sampled_motion.h"
#include "linalg/dense/spectrum.h"
#include <math.h>

#define ROUNDING 1e-10 /* of a real part, relative to the largest modulus */
#define SAMPLED  1e-9  /* the same of ln(z)/T, whose z have passed an exponential */

const char *kmp_stability_text(kmp_stability_word word)
{
    static const char *const words[] = {
        [KMP_STABLE] = "stable", [KMP_NEUTRAL] = "neutral", [KMP_UNSTABLE] = "unstable", [KMP_UNDECIDED] = "undecided"};
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

static void judge(const kmp_linear *l, const kmp_spectrum *s, kmp_stability *out)
{
    double largest = 0;
    for (int k = s->zeros; k < s->count; k++)
        largest = fmax(largest, hypot(s->re[k], s->im[k]));
    for (int k = s->zeros; k < s->count; k++) {
        out->growing += s->re[k] > ROUNDING * largest;
        if (!(s->re[k] <= out->re)) {
            out->re = s->re[k];
            out->im = s->im[k];
        }
    }
    out->still = s->still;
    for (int k = 0; k < s->still; k++)
        out->along[k] = l->part.u[own_place(s, k)];
    out->word = out->growing > 0 ? KMP_UNSTABLE : s->zeros > 0 ? KMP_NEUTRAL : KMP_STABLE;
}

/* A model with sampled states has the eigenvalues z of its map over one period T; of each, ln(z)/T grows as it does. */
static kempe_status judge_samples(const kmp_linear *l, kmp_stability *out)
{
    double period, *values = KMP_NEW(double, 4 * (ptrdiff_t)l->p), largest = 0;
    int count = 0;
    KMP_TRY(kmp_made(l->system->context, values));
    double *re = values, *im = values + 2 * (ptrdiff_t)l->p;
    int failed = kmp_sampled_eigenvalues(l, &period, &count, re, im);
    for (int k = 0; k < count && failed == 0; k++) {
        double grows = log(hypot(re[k], im[k])) / period, turns = atan2(im[k], re[k]) / period;
        re[k] = grows;
        im[k] = turns;
        largest = isfinite(grows) ? fmax(largest, hypot(grows, turns)) : largest;
    }
    bool neutral = false;
    for (int k = 0; k < count && failed == 0; k++) {
        out->growing += re[k] > SAMPLED * largest;
        neutral = neutral || fabs(re[k]) <= SAMPLED * largest;
        if (!(re[k] <= out->re)) {
            out->re = re[k];
            out->im = im[k];
        }
    }
    if (failed == 0)
        out->word = out->growing > 0 ? KMP_UNSTABLE : neutral ? KMP_NEUTRAL : KMP_STABLE;
    kmp_free(values);
    return KEMPE_OK;
}

kempe_status kmp_stability_judge(const kmp_linear *linear, kmp_stability *stability)
{
    kmp_spectrum s;
    *stability = (kmp_stability){.word = KMP_UNDECIDED, .re = NAN, .im = NAN, .along = stability->along};
    if (linear->p == 0) {
        stability->word = KMP_STABLE;
        return KEMPE_OK;
    }
    for (int k = 0; k < linear->system->model->state_count; k++)
        if (kmp_state_is_sampled(&linear->system->model->states[k]))
            return judge_samples(linear, stability);
    kempe_status status = kmp_linear_spectrum(linear, &s);
    if (status == KEMPE_E_FAILED)
        kmp_context_clear(linear->system->context);
    if (status != KEMPE_OK)
        return status == KEMPE_E_FAILED ? KEMPE_OK : status;
    judge(linear, &s, stability);
    kmp_spectrum_free(&s);
    return KEMPE_OK;
}
