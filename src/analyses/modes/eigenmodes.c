/* SPDX-License-Identifier: BSD-3-Clause */
/* Modes: the quadratic eigenvalue problem, or its substitutes for sampled states and delays; then shapes in all
 * coordinates, normalised, with the part of each coordinate, and converted to the angles of the user. */
#include "analyses/modes/eigenmodes.h"
#include "analyses/derivatives/delayed_spectrum.h"
#include "analyses/derivatives/sampled_motion.h"
#include "base/memory.h"
#include "constraints/evaluation/charts.h"
#include "constraints/evaluation/evaluator.h"
#include "constraints/tolerances.h"
#include "model/data/model.h"
#include "output/print.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

static bool make_room(kmp_modes *s)
{
    ptrdiff_t size = (ptrdiff_t)s->n * s->count;
    kmp_arena *a = &s->arena;
    s->u = KMP_ARENA_NEW(a, int, s->p);
    (void)KMP_ARENA_MAKE(a, KMP_ROOM(double, size, &s->re, &s->im, &s->kinetic, &s->potential));
    bool charts = s->system->chart_count > 0;
    s->shown_re = charts ? KMP_ARENA_NEW(a, double, size) : s->re;
    s->shown_im = charts ? KMP_ARENA_NEW(a, double, size) : s->im;
    if (kmp_samples_in(s->system->model))
        (void)KMP_ARENA_MAKE(a, KMP_ROOM(double, s->count, &s->z_re, &s->z_im));
    return !a->failed;
}

/* Eigenvalues without vectors, which others than the solver find. */
static bool make_values(kmp_modes *s, int count)
{
    s->count = s->spectrum.count = count;
    s->spectrum.p = s->p;
    return KMP_ARENA_MAKE(&s->spectrum.arena, KMP_ROOM(double, count, &s->spectrum.re, &s->spectrum.im));
}

KMP_CLEARS(kmp_modes, modes, kmp_spectrum_free(&modes->spectrum), kmp_arena_free(&modes->arena))

/* -- shapes ------------------------------------------------------------------------------------------ */

/* Adds a motion of u_k to shape c. */
static void add_motion(kmp_modes *s, const kmp_linear *l, int c, int k, double x_re, double x_im)
{
    double *re = s->re + (ptrdiff_t)c * s->n, *im = s->im + (ptrdiff_t)c * s->n;
    for (int i = 0; i < s->n; i++) {
        re[i] += l->red.x[i + k * s->n] * x_re;
        im[i] += l->red.x[i + k * s->n] * x_im;
    }
}

/* Eigenvector `from` of a spectrum as shape c. */
static void take_shape(kmp_modes *s, const kmp_linear *l, const kmp_spectrum *of, int from, int c)
{
    for (int k = 0; k < s->p; k++)
        add_motion(s, l, c, k, of->x_re[k + from * s->p], of->x_im[k + from * s->p]);
    /* The value of a state in place of its integral. */
    double *re = s->re + (ptrdiff_t)c * s->n, *im = s->im + (ptrdiff_t)c * s->n;
    double a = s->spectrum.re[c], b = s->spectrum.im[c];
    for (int i = kmp_model_coordinates(s->system->model); i < s->n; i++) {
        double x = re[i];
        re[i] = x * a - im[i] * b;
        im[i] = x * b + im[i] * a;
    }
}

/* The first of the largest entries made real and one size of its coordinate. */
static void normalise(kmp_modes *s, int c)
{
    int n = s->n, best = 0;
    const double *scale = s->system->scale;
    double *re = s->re + (ptrdiff_t)c * n, *im = s->im + (ptrdiff_t)c * n, most = 0;
    for (int i = 0; i < n; i++) {
        double size = hypot(re[i], im[i]) / scale[i];
        if (size > most * (1 + 1e-6)) {
            best = i;
            most = size;
        }
    }
    if (most == 0)
        return;
    double a = re[best] / scale[best], b = im[best] / scale[best], square = a * a + b * b;
    for (int i = 0; i < n; i++) {
        double kept = (re[i] * a + im[i] * b) / square;
        im[i] = (im[i] * a - re[i] * b) / square;
        re[i] = kept;
    }
    re[best] = scale[best];
    im[best] = 0;
}

/* Re of conj(shape_i) (A shape)_i over their sum. */
static void shares(int n, const double *re, const double *im, const double *a_re, const double *a_im, double *out)
{
    double sum = 0, size = 0;
    for (int i = 0; i < n; i++) {
        out[i] = re[i] * a_re[i] + im[i] * a_im[i];
        sum += out[i];
        size += fabs(out[i]);
    }
    bool some = fabs(sum) > 1e-9 * size; /* smaller sums, by cancellation, have no shares */
    for (int i = 0; i < n; i++)
        out[i] = some ? out[i] / sum : 0;
}

/* Converts shapes: rates of a chart are linear in those of another. */
static void show_shapes(kmp_modes *s, const kmp_linear *l, double *q)
{
    const size_t n = (size_t)s->n;
    for (int c = 0; s->shown_re != s->re && c < s->count; c++)
        for (int part = 0; part < 2; part++) {
            const double *from = (part ? s->im : s->re) + (size_t)c * n;
            double *to = (part ? s->shown_im : s->shown_re) + (size_t)c * n;
            memcpy(q, l->q, n * sizeof *q);
            memcpy(to, from, n * sizeof *to);
            kmp_charts_show(s->system, l->eval->chart, q, q, to);
        }
}

static void measure(kmp_modes *s, kmp_linear *l, double *mass, double *work)
{
    kmp_eval_dense_mass(l->eval, mass);
    for (int c = 0; c < s->count; c++)
        normalise(s, c);
    /* The energies of each eigenvalue; its conjugate has the same. */
    int n = s->n, bodies = kmp_model_coordinates(s->system->model); /* states have no energy */
    double *m_re = work, *m_im = work + n, *k_re = work + 2 * (ptrdiff_t)n, *k_im = work + 3 * (ptrdiff_t)n;
    for (int c = 0; c < s->count; c++) {
        const double *re = s->re + (ptrdiff_t)c * n, *im = s->im + (ptrdiff_t)c * n;
        memset(work, 0, 4 * (size_t)n * sizeof *work);
        for (int j = 0; j < n; j++)
            for (int i = 0; i < n; i++) {
                m_re[i] += mass[i + j * n] * re[j];
                m_im[i] += mass[i + j * n] * im[j];
            }
        kmp_tangents_add(&l->tangents, KMP_R_Q, l->d, 1, re, k_re);
        kmp_tangents_add(&l->tangents, KMP_R_Q, l->d, 1, im, k_im);
        shares(bodies, re, im, m_re, m_im, s->kinetic + (ptrdiff_t)c * n);
        if (c >= s->spectrum.zeros)
            shares(bodies, re, im, k_re, k_im, s->potential + (ptrdiff_t)c * n);
    }
    show_shapes(s, l, work);
}

/* -- spectra ----------------------------------------------------------------------------------------- */

/* An eigenvalue of the map, with s for the order. */
typedef struct sampled_mode {
    double s_re, s_im, from_one;
    int k;
} sampled_mode;

static int by_nearness(const void *a, const void *b)
{
    const sampled_mode *x = a, *y = b;
    return x->from_one != y->from_one ? (x->from_one < y->from_one ? -1 : 1) : x->k - y->k;
}

/* By modulus; the members of a pair, whose moduli are equal, stay together. */
static int by_modulus(const void *a, const void *b)
{
    const sampled_mode *x = a, *y = b;
    double first = hypot(x->s_re, x->s_im), second = hypot(y->s_re, y->s_im);
    return first != second ? (first < second ? -1 : 1) : x->k - y->k;
}

/* The eigenvector of the map as shape c: positions, and values of states, before the samples. */
static void take_sampled_shape(kmp_modes *s, const kmp_linear *l, const kmp_sampled_spectrum *of, int from, int c)
{
    for (int i = 0; i < of->count; i++) {
        int k = of->place[i] % s->p;
        if (of->place[i] < s->p || kmp_state_of(s->system->model, l->part.u[k]))
            add_motion(s, l, c, k, of->x_re[i + from * of->count], of->x_im[i + from * of->count]);
    }
}

/* The eigenvalues of the map in `mode` (count), sorted, and their shapes. */
static void put_sampled(kmp_modes *s, const kmp_linear *l, const kmp_spectrum *averaged,
                        const kmp_sampled_spectrum *map, sampled_mode *mode)
{
    for (int k = 0; k < map->count; k++) {
        mode[k] = (sampled_mode){.from_one = hypot(map->re[k] - 1, map->im[k]), .k = k};
        kmp_sampled_rate(map, k, &mode[k].s_re, &mode[k].s_im);
    }
    /* Free motions of the averaged equations are free from sample to sample, too: as many z are 1, the nearest ones.
     * They come first, exactly; 0: the others are all that there is. */
    int zeros = averaged->zeros < map->count ? averaged->zeros : 0;
    qsort(mode, (size_t)map->count, sizeof *mode, by_nearness);
    if (zeros > 0 && !(mode[zeros - 1].from_one <= KMP_SAMPLED_ONE))
        zeros = 0;
    qsort(mode + zeros, (size_t)(map->count - zeros), sizeof *mode, by_modulus);
    kmp_spectrum *out = &s->spectrum;
    out->zeros = zeros;
    out->still = zeros > 0 ? averaged->still : 0;
    for (int c = 0; c < s->count; c++) {
        int k = mode[c].k;
        bool zero = c < zeros;
        out->re[c] = zero ? 0 : mode[c].s_re;
        out->im[c] = zero ? 0 : mode[c].s_im;
        s->z_re[c] = zero ? 1 : map->re[k];
        s->z_im[c] = zero ? 0 : map->im[k];
        if (zero)
            take_shape(s, l, averaged, c, c);
        else
            take_sampled_shape(s, l, map, k, c);
    }
}

static kempe_status solve_sampled(kmp_modes *s, const kmp_linear *l)
{
    kmp_sampled_spectrum map = {0};
    kmp_spectrum averaged;
    sampled_mode *mode = NULL;
    KMP_TRY(kmp_linear_spectrum(l, &averaged));
    kempe_status status = kmp_sampled_spectrum_init(&map, l);
    if (status == KEMPE_OK) {
        mode = KMP_NEW(sampled_mode, map.count);
        status = kmp_made(s->system->context, mode && make_values(s, map.count));
        s->period = map.period;
    }
    if (status == KEMPE_OK)
        put_sampled(s, l, &averaged, &map, mode);
    kmp_free(mode);
    kmp_sampled_spectrum_free(&map);
    kmp_spectrum_free(&averaged);
    return status;
}

/* -- delays ------------------------------------------------------------------------------------------ */

static kempe_status solve_delayed(kmp_modes *s, const kmp_linear *l, bool brief)
{
    kmp_spectrum averaged;
    s->endless = true;
    KMP_TRY(kmp_linear_spectrum(l, &averaged));
    const int zeros = averaged.zeros;
    kmp_spectrum_free(&averaged);
    kmp_delayed_spectrum roots;
    kempe_status status = kmp_delayed_spectrum_init(&roots, l, zeros, brief);
    s->shown = roots.shown;
    s->bound = roots.bound;
    if (status == KEMPE_OK)
        status = kmp_made(s->system->context, make_values(s, roots.count) && make_room(s));
    if (status == KEMPE_OK) {
        kmp_spectrum *out = &s->spectrum;
        out->zeros = roots.zeros;
        out->still = roots.still;
        memcpy(out->re, roots.re, (size_t)s->count * sizeof *out->re);
        memcpy(out->im, roots.im, (size_t)s->count * sizeof *out->im);
        for (int c = 0; c < s->count; c++)
            for (int k = 0; k < s->p; k++)
                add_motion(s, l, c, k, roots.x_re[k + (ptrdiff_t)c * s->p], roots.x_im[k + (ptrdiff_t)c * s->p]);
    }
    kmp_delayed_spectrum_free(&roots);
    return status;
}

/* -- all --------------------------------------------------------------------------------------------- */

static kempe_status solve_all(kmp_modes *s, const kmp_linear *l, bool brief)
{
    if (l->system->model->delay_count > 0)
        return solve_delayed(s, l, brief);
    KMP_TRY(kmp_made(s->system->context, make_room(s)));
    if (s->z_re) {
        KMP_TRY(solve_sampled(s, l));
    } else {
        KMP_TRY(kmp_linear_spectrum(l, &s->spectrum));
        s->count = s->spectrum.count;
        for (int c = 0; c < s->count; c++)
            take_shape(s, l, &s->spectrum, c, c);
    }
    s->shown = s->count;
    return KEMPE_OK;
}

kempe_status kmp_modes_init(kmp_modes *modes, kmp_linear *linear, bool brief)
{
    const kempe_system *system = linear->system;
    kmp_modes s = {.system = system, .n = linear->n, .p = linear->p, .count = 2 * linear->p, .bound = NAN};
    kmp_arena scratch = {0};
    double *mass = NULL, *work = NULL;
    bool room = KMP_ARENA_MAKE(&scratch, KMP_ROOM(double, (ptrdiff_t)s.n *s.n, &mass),
                               KMP_ROOM(double, 4 * (ptrdiff_t)s.n, &work)) &&
                mass && work;
    kempe_status status = room ? solve_all(&s, linear, brief) : kmp_fail_memory(system->context);
    if (status == KEMPE_OK) {
        s.moving = kmp_linear_moving(linear, s.u);
        for (int k = 0; k < s.moving; k++)
            s.u[k] = linear->part.u[s.u[k]];
        measure(&s, linear, mass, work);
        *modes = s;
    } else {
        kmp_modes_free(&s);
    }
    kmp_arena_free(&scratch);
    return status;
}

/* -- comparing --------------------------------------------------------------------------------------- */

bool kmp_modes_is_over(const kmp_modes *modes, int c)
{
    return modes->z_re && hypot(modes->z_re[c], modes->z_im[c]) <= KMP_SAMPLED_OVER;
}

double kmp_modes_size(const kmp_modes *modes)
{
    double most = 0;
    for (int c = 0; c < modes->count; c++)
        if (!kmp_modes_is_over(modes, c))
            most = fmax(most, hypot(modes->spectrum.re[c], modes->spectrum.im[c]));
    return most;
}

double kmp_modes_noise(const kmp_modes *modes)
{
    return (modes->z_re ? KMP_SAMPLED_STILL : 1e-11) * kmp_modes_size(modes);
}

double kmp_modes_likeness(const kmp_modes *first, int a, const kmp_modes *second, int b)
{
    int n = first->n;
    const double *x_re = first->re + (ptrdiff_t)a * n, *x_im = first->im + (ptrdiff_t)a * n;
    const double *y_re = second->re + (ptrdiff_t)b * n, *y_im = second->im + (ptrdiff_t)b * n;
    double re = 0, im = 0, x = 0, y = 0;
    for (int i = 0; i < n; i++) {
        double weight = 1 / (first->system->scale[i] * first->system->scale[i]);
        re += weight * (x_re[i] * y_re[i] + x_im[i] * y_im[i]);
        im += weight * (x_re[i] * y_im[i] - x_im[i] * y_re[i]);
        x += weight * (x_re[i] * x_re[i] + x_im[i] * x_im[i]);
        y += weight * (y_re[i] * y_re[i] + y_im[i] * y_im[i]);
    }
    return x > 0 && y > 0 ? (re * re + im * im) / (x * y) : 0;
}
