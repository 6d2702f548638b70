/* SPDX-License-Identifier: BSD-3-Clause */
/* In the averaged system a sampled state y has the rate (next - y)/T. A sample replaces y by y + T y', and keeps the
 * rest; between samples y is constant. So both the samples and the motion between them follow from one linear system
 * (Chen and Francis 1995, chapter 3; lifting over several sample times). */
#include "analyses/derivatives/sampled_motion.h"
#include "analyses/dense/eigenvalues.h"
#include "analyses/dense/exponential.h"
#include "base/memory.h"
#include "constraints/tolerances.h"
#include "model/data/state.h"
#include <math.h>
#include <string.h>

enum { MOST_REPEATS = 1000 };

bool kmp_state_is_sampled(const kmp_state *state)
{
    return state && state->period > 0 && isfinite(state->period);
}

bool kmp_samples_in(const kempe_model *model)
{
    for (int k = 0; k < kmp_model_state_count(model); k++)
        if (kmp_state_is_sampled(kmp_model_state(model, k)))
            return true;
    return false;
}

static bool is_whole(double x)
{
    return fabs(x - round(x)) <= KMP_SAME_SAMPLE * fmax(fabs(x), 1);
}

/* The least multiple of the longest time that is one of all; 0: there is none among the first. */
static double common_period(int width, const double *every)
{
    double longest = 0;
    for (int i = 0; i < width; i++)
        longest = isfinite(every[i]) ? fmax(longest, every[i]) : longest;
    for (int k = 1; k <= MOST_REPEATS; k++) {
        bool all = longest > 0;
        for (int i = 0; all && i < width; i++)
            all = !isfinite(every[i]) || is_whole(k * longest / every[i]);
        if (all)
            return k * longest;
    }
    return 0;
}

/* Motion of x between samples: a and b of the size of x and w together, [a b; 0 0], the motion so far, room for
 * another. */
typedef struct map {
    int width, size;
    double *averaged, *held, *step, *now, *next;
    double h; /* of the step in `step` */
} map;

static int move(map *m, double h)
{
    if (fabs(h - m->h) > KMP_SAME_SAMPLE * h) {
        if (kmp_exponential(m->size, m->held, h, m->step) != 0)
            return -1;
        m->h = h;
    }
    memset(m->next, 0, (size_t)m->size * (size_t)m->size * sizeof *m->next);
    for (int j = 0; j < m->size; j++)
        for (int k = 0; k < m->size; k++)
            for (int i = 0; i < m->size; i++)
                m->next[i + j * m->size] += m->step[i + k * m->size] * m->now[k + j * m->size];
    double *now = m->now;
    m->now = m->next;
    m->next = now;
    return 0;
}

int kmp_sampled_map(int width, int inputs, const double *a, const double *b, const double *every, double *period,
                    double *phi, double *gamma)
{
    map m = {.width = width, .size = width + inputs};
    ptrdiff_t size = (ptrdiff_t)m.size * m.size;
    double end = common_period(width, every), *room = KMP_NEW(double, 5 * size);
    int failed = !room ? -1 : end > 0 ? 0 : -2;
    m.averaged = room, m.held = room + size, m.step = room + 2 * size, m.now = room + 3 * size,
    m.next = room + 4 * size;
    if (failed == 0) {
        /* The map of the start: nothing has moved. */
        for (int j = 0; j < m.width + inputs; j++) {
            const double *column = j < m.width ? a + (ptrdiff_t)j * m.width : b + (ptrdiff_t)(j - m.width) * m.width;
            for (int i = 0; i < m.width; i++) {
                m.averaged[i + j * m.size] = column[i];
                m.held[i + j * m.size] = isfinite(every[i]) ? 0 : column[i];
            }
            m.now[j + j * m.size] = 1;
        }
    }
    for (double t = 0; failed == 0 && t < end * (1 - KMP_SAME_SAMPLE);) {
        double next = end; /* sample */
        for (int i = 0; i < m.width; i++)
            if (isfinite(every[i]))
                next = fmin(next, every[i] * (floor(t / every[i] * (1 + KMP_SAME_SAMPLE) + KMP_SAME_SAMPLE) + 1));
        memcpy(m.next, m.now, (size_t)m.size * (size_t)m.size * sizeof *m.next);
        for (int i = 0; i < m.width; i++)
            if (isfinite(every[i]) && is_whole(t / every[i]))
                for (int j = 0; j < m.size; j++)
                    for (int k = 0; k < m.size; k++)
                        m.next[i + j * m.size] += every[i] * m.averaged[i + k * m.size] * m.now[k + j * m.size];
        double *now = m.now;
        m.now = m.next;
        m.next = now;
        failed = move(&m, next - t);
        t = next;
    }
    for (int j = 0; failed == 0 && j < width; j++)
        memcpy(phi + (ptrdiff_t)j * width, m.now + (ptrdiff_t)j * m.size, (size_t)width * sizeof *phi);
    for (int j = 0; failed == 0 && width > 0 && j < inputs; j++)
        memcpy(gamma + (ptrdiff_t)j * width, m.now + (ptrdiff_t)(width + j) * m.size, (size_t)width * sizeof *gamma);
    *period = end;
    kmp_free(room);
    return failed;
}

/* -- eigenvalues ------------------------------------------------------------------------------------- */

kempe_status kmp_sampled_complain(kempe_context *context, int failed)
{
    if (failed == -2)
        return kmp_fail(
            context, KEMPE_E_FAILED,
            "the sample times of the states have no common multiple: there is no map from one sample to the "
            "next");
    if (failed == -3)
        return kmp_fail(context, KEMPE_E_FAILED,
                        "the reduced mass is singular: the state does not determine the accelerations");
    return kmp_fail(context, KEMPE_E_FAILED, "the map from one sample to the next is not finite");
}

kempe_status kmp_sampled_spectrum_init(kmp_sampled_spectrum *s, const kmp_linear *linear)
{
    int failed;
    ptrdiff_t n = 2 * (ptrdiff_t)linear->p;
    double *a = NULL, *left = NULL, *every = NULL;
    *s = (kmp_sampled_spectrum){0};
    KMP_TRY(kmp_made(linear->system->context,
                     KMP_ARENA_MAKE(&s->arena, KMP_ROOM(double, n *n, &a, &left, &s->x_re, &s->x_im),
                                    KMP_ROOM(double, n, &every, &s->re, &s->im), KMP_ROOM(int, n, &s->place)) &&
                         a && every));
    s->count = kmp_linear_entries(linear, s->place);
    for (int i = 0; i < s->count; i++) {
        const kmp_state *state = s->place[i] < linear->p
                                     ? NULL
                                     : kmp_state_of(linear->system->model, linear->part.u[s->place[i] - linear->p]);
        every[i] = kmp_state_is_sampled(state) ? state->period : INFINITY;
    }
    failed = kmp_linear_first_order(linear, s->count, s->place, a);
    KMP_TRY(kmp_made(linear->system->context, failed != -1));
    if (failed == 0)
        failed = kmp_sampled_map(s->count, 0, a, NULL, every, &s->period, a, NULL);
    if (failed == 0)
        failed = kmp_eigen_general(s->count, a, s->re, s->im, s->x_re, s->x_im, left, left);
    return failed == 0 ? KEMPE_OK : kmp_sampled_complain(linear->system->context, failed);
}

KMP_CLEARS(kmp_sampled_spectrum, spectrum, kmp_arena_free(&spectrum->arena))

void kmp_sampled_rate(const kmp_sampled_spectrum *spectrum, int k, double *re, double *im)
{
    double x = spectrum->re[k], y = spectrum->im[k], size = hypot(x, y);
    bool over = size <= KMP_SAMPLED_OVER;
    *re = log(over ? KMP_SAMPLED_OVER : size) / spectrum->period;
    *im = over ? 0 : atan2(y, x) / spectrum->period;
}
