/* SPDX-License-Identifier: BSD-3-Clause */
/* Modes: the quadratic eigenvalue problem, or its substitutes for sampled states and delays; then shapes in all
 * coordinates, normalised, with the part of each coordinate, and converted to the angles of the user. */
#include "analyses/modes/eigenmodes.h"
#include "analyses/dense/complex_lu.h"
#include "analyses/dense/eigenvalues.h"
#include "analyses/derivatives/delayed_spectrum.h"
#include "analyses/derivatives/sampled_motion.h"
#include "base/memory.h"
#include "constraints/evaluation/charts.h"
#include "constraints/evaluation/evaluator.h"
#include "constraints/tolerances.h"
#include "model/data/parameter.h"
#include <complex.h>
#include <float.h>
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

/* Converts shapes: rates of a chart are linear in the rates of another. */
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
            for (int i = 0; (re[j] != 0 || im[j] != 0) && i < n; i++) {
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
    if (kmp_model_delay_count(l->system->model) > 0)
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

/* -- derivatives by parameters ------------------------------------------------------------------------------ */

/* Of simple ones by left and right vectors, of equal ones by a small
 * eigenvalue problem in their eigenspace (Lancaster 1964; Mills-Curran 1988). */

/* Eigenvalues nearer than this, relative to the largest modulus, count as equal: the matrices' rounding separates an
 * equal pair with a single vector by its root. */
#define NEAR 1e-7

typedef double complex number;

/* A mode's real or imaginary part as a motion of the whole system. */
typedef struct part {
    double *u, *ud, *udd, *q, *qd, *qdd, *lambda;
} part;

typedef struct work {
    kmp_linear *linear;
    kmp_second_derivatives *second;
    const kmp_state_sensitivity *shift;
    const kmp_spectrum *spectrum;
    kmp_mode_slopes *out;
    int p, n, m;
    kmp_arena arena;
    part part[2];
    double *rest[2];          /* p: dP x */
    double *unit;             /* a parameter each */
    number *left, *moved, *s; /* of a group of equal ones: Y^H (2 s M + G) X, Y^H dP X; values */
    int *group;
    number *room; /* factors of the small matrix */
    int *pivot;
    bool *done; /* of the spectrum */
} work;

static number value_of(const kmp_spectrum *s, int i)
{
    return s->re[i] + s->im[i] * I;
}

/* -- room -------------------------------------------------------------------------------------------- */

static bool make_work(work *w)
{
    kmp_arena *a = &w->arena;
    int n = w->n, count = w->spectrum->count;
    KMP_ARENA_MAKE(a, KMP_ROOM(number, count * count, &w->left, &w->moved), KMP_ROOM(number, count, &w->s),
                   KMP_ROOM(int, count, &w->group, &w->pivot), KMP_ROOM(bool, count, &w->done));
    part *x = w->part;
    return KMP_ARENA_MAKE(a,
                          KMP_ROOM(double, n, &x[0].u, &x[0].ud, &x[0].udd, &x[0].q, &x[0].qd, &x[0].qdd, &w->rest[0],
                                   &x[1].u, &x[1].ud, &x[1].udd, &x[1].q, &x[1].qd, &x[1].qdd, &w->rest[1]),
                          KMP_ROOM(double, w->m, &x[0].lambda, &x[1].lambda), KMP_ROOM(double, w->out->count, &w->unit),
                          KMP_ROOM(number, count * count, &w->room));
}

/* -- one mode ---------------------------------------------------------------------------------------- */

/* The mode of vector i at the value s as a motion. */
static void lay_out(work *w, int i, number s)
{
    const kmp_spectrum *sp = w->spectrum;
    for (int k = 0; k < w->p; k++) {
        number x = sp->x_re[k + i * w->p] + sp->x_im[k + i * w->p] * I;
        w->part[0].u[k] = creal(x), w->part[1].u[k] = cimag(x);
        w->part[0].ud[k] = creal(s * x), w->part[1].ud[k] = cimag(s * x);
        w->part[0].udd[k] = creal(s * s * x), w->part[1].udd[k] = cimag(s * s * x);
    }
    for (int k = 0; k < 2; k++) {
        const part *x = &w->part[k];
        kmp_linear_follow(w->linear, &(kmp_change){.u = x->u, .ud = x->ud, .udd = x->udd},
                          &(kmp_response){x->q, x->qd, x->qdd, x->lambda, NULL});
    }
}

/* dP x of that mode by parameter k. */
static void disturb(work *w, int k)
{
    const kmp_state_sensitivity *sh = w->shift;
    kmp_variation state = {sh->q + k * w->n, sh->qd + k * w->n, sh->qdd + k * w->n, sh->lambda + k * w->m};
    for (int i = 0; i < 2; i++) {
        const part *x = &w->part[i];
        w->unit[k] = 1;
        kmp_second_values bent =
            kmp_second_derivatives_along(w->second, &(kmp_variation){x->q, x->qd, x->qdd, x->lambda}, &state, w->unit);
        w->unit[k] = 0;
        kmp_linear_follow(w->linear,
                          &(kmp_change){.h = bent.h, .rate = bent.rate, .curve = bent.curve, .force = bent.force},
                          &(kmp_response){.residual = w->rest[i]});
    }
}

/* y^H of vector i times the array `rest`. */
static number weigh(const work *w, int i)
{
    const kmp_spectrum *sp = w->spectrum;
    number sum = 0;
    for (int k = 0; k < w->p; k++)
        sum += (sp->y_re[k + i * w->p] - sp->y_im[k + i * w->p] * I) * (w->rest[0][k] + w->rest[1][k] * I);
    return sum;
}

/* y^H (2 s M + G) x. */
static number product(const work *w, int i, int j, number s)
{
    const kmp_spectrum *sp = w->spectrum;
    const kmp_linear *l = w->linear;
    number sum = 0;
    for (int a = 0; a < w->p; a++)
        for (int b = 0; b < w->p; b++) {
            number x = sp->x_re[b + j * w->p] + sp->x_im[b + j * w->p] * I;
            number y = sp->y_re[a + i * w->p] - sp->y_im[a + i * w->p] * I;
            sum += y * (2 * s * l->mass[a + b * w->p] + l->damping[a + b * w->p]) * x;
        }
    return sum;
}

/* -- equal ones -------------------------------------------------------------------------------------- */

static void set(kmp_mode_slopes *out, int i, int k, number x)
{
    out->re[i * out->count + k] = creal(x);
    out->im[i * out->count + k] = cimag(x);
}

/* Compares by real part, then by imaginary part. */
static int compare(const void *a, const void *b)
{
    number x = *(const number *)a, y = *(const number *)b;
    if (creal(x) != creal(y))
        return creal(x) < creal(y) ? -1 : 1;
    return (cimag(x) > cimag(y)) - (cimag(x) < cimag(y));
}

/* v^H M v of vector i of a list. */
static double size_of(const work *w, const double *re, const double *im, int i)
{
    const double *mass = w->linear->mass;
    double sum = 0;
    for (int a = 0; a < w->p; a++)
        for (int b = 0; b < w->p; b++)
            sum += mass[a + b * w->p] * (re[a + i * w->p] * re[b + i * w->p] + im[a + i * w->p] * im[b + i * w->p]);
    return sqrt(sum);
}

/* -left^-1 moved, in `moved`, both g x g by columns, with vectors normalised by the mass. False: left is singular up to
 * rounding, relative to 2 s. */
static bool divide(int g, const number *left, number *moved, double size, int *pivot, number *room)
{
    double most = 0;
    memcpy(room, left, (size_t)(g * g) * sizeof *room);
    if (kmp_lu_complex_factor(g, room, pivot))
        return false;
    for (int k = 0; k < g; k++)
        most = fmax(most, cabs(room[k + k * g])); /* the factors have the entries divided by the pivots */
    for (int j = 0; j < g; j++) {
        for (int i = 0; i < g; i++)
            moved[i + j * g] = -moved[i + j * g];
        kmp_lu_complex_solve(g, room, pivot, moved + j * g);
    }
    return most * NEAR * size < 1;
}

/* The derivatives of a group by parameter k, into w->s. KEMPE_STOPPED: there are none. */
static kempe_status move_group(work *w, int g, number s, int k)
{
    const kmp_spectrum *sp = w->spectrum;
    for (int j = 0; j < g; j++) {
        double x = size_of(w, sp->x_re, sp->x_im, w->group[j]);
        lay_out(w, w->group[j], s);
        disturb(w, k);
        for (int i = 0; i < g; i++) {
            double y = size_of(w, sp->y_re, sp->y_im, w->group[i]);
            w->moved[i + j * g] = weigh(w, w->group[i]) / (x * y);
            w->left[i + j * g] = product(w, w->group[i], w->group[j], s) / (x * y);
        }
    }
    if (!divide(g, w->left, w->moved, 2 * cabs(s), w->pivot, w->room))
        return KEMPE_STOPPED;
    return kmp_eigen_complex(g, (double *)w->moved, (double *)w->s) ? KEMPE_E_MEMORY : KEMPE_OK;
}

/* The derivatives of a group, and of their conjugates. */
static void share(work *w, int g, int k, kempe_status status)
{
    kmp_mode_slopes *out = w->out;
    if (status == KEMPE_OK)
        qsort(w->s, (size_t)g, sizeof *w->s, compare);
    for (int j = 0; j < g; j++) {
        int i = w->group[j], other = kmp_spectrum_conjugate(w->spectrum, i);
        number x = status == KEMPE_OK ? w->s[j] : NAN + NAN * I;
        kmp_mode_kind kind = status != KEMPE_OK ? KMP_MODE_DEFECTIVE : g > 1 ? KMP_MODE_REPEATED : KMP_MODE_SIMPLE;
        out->kind[i] = out->kind[other] = kind;
        set(out, other, k, conj(x));
        set(out, i, k, w->spectrum->im[i] == 0 && g == 1 ? creal(x) : x);
    }
}

static kempe_status follow_all(work *w)
{
    const kmp_spectrum *sp = w->spectrum;
    for (int i = sp->zeros; i < sp->count; i++) {
        if (w->done[i] || sp->im[i] < 0)
            continue;
        /* Collects in `group` eigenvalue i and those equal to it up to the rounding of the solver. */
        double largest = 0;
        int g = 0;
        for (int k = 0; k < sp->count; k++)
            largest = fmax(largest, cabs(value_of(sp, k)));
        double near = NEAR * cabs(value_of(sp, i)) + 64 * sp->count * DBL_EPSILON * largest;
        for (int k = sp->zeros; k < sp->count; k++)
            if (cabs(value_of(sp, k) - value_of(sp, i)) <= near)
                w->group[g++] = k;
        number mean = 0;
        for (int j = 0; j < g; j++) {
            mean += value_of(sp, w->group[j]) / g;
            w->done[w->group[j]] = true;
        }
        for (int k = 0; k < w->out->count; k++) {
            kempe_status moved = move_group(w, g, mean, k);
            if (moved < 0)
                return moved;
            share(w, g, k, moved);
        }
    }
    return KEMPE_OK;
}

/* -- all eigenvalues --------------------------------------------------------------------------------- */

kempe_status kmp_mode_slopes_init(kmp_mode_slopes *slopes, kmp_linear *linear, kmp_second_derivatives *second,
                                  const kmp_state_sensitivity *shift, const kmp_spectrum *spectrum)
{
    int modes = spectrum->count, count = shift->count;
    *slopes = (kmp_mode_slopes){.modes = modes, .count = count};
    work w = {.linear = linear,
              .second = second,
              .shift = shift,
              .spectrum = spectrum,
              .out = slopes,
              .p = linear->p,
              .n = linear->n,
              .m = linear->m};
    bool ok = KMP_ARENA_MAKE(&slopes->arena, KMP_ROOM(double, modes *count, &slopes->re, &slopes->im),
                             KMP_ROOM(kmp_mode_kind, modes, &slopes->kind)) &&
              make_work(&w);
    for (int i = 0; ok && i < spectrum->zeros; i++) {
        slopes->kind[i] = KMP_MODE_ZERO;
        for (int k = 0; k < count; k++)
            set(slopes, i, k, NAN + NAN * I);
    }
    if (ok) {
        kmp_instant at = kmp_linear_instant(linear);
        kmp_formulas_place(&second->bent, &at);
        ok = follow_all(&w) == KEMPE_OK;
    }
    kmp_arena_free(&w.arena);
    if (ok)
        return KEMPE_OK;
    kmp_mode_slopes_free(slopes);
    return kmp_fail_memory(linear->system->context);
}

KMP_CLEARS(kmp_mode_slopes, slopes, kmp_arena_free(&slopes->arena))
