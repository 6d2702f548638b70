/* SPDX-License-Identifier: BSD-3-Clause */
/* Quadratic eigenvalue problem: the symmetric solver where there is no damping, otherwise a scaled companion matrix
 * (Tisseur and Meerbergen 2001, section 3). Zeros are deflated first: null spaces are separated stage by stage, by
 * singular values (Kublanovskaya 1966). Coordinates that no matrix connects are separate pencils; what counts as
 * rounding is relative to all of them. */
#include "analyses/derivatives/spectrum.h"
#include "analyses/dense/eigenvalues.h"
#include "analyses/dense/singular_values.h"
#include "linalg/dense/dense.h"
#include "linalg/dense/dense_parts.h"
#include "linalg/dense/dot.h"
#include <float.h>
#include <math.h>
#include <stddef.h>
#include <stdlib.h>
#include <string.h>

#define ONE_SHAPE 1e-4 /* part of an eigenvector across another one that has the same shape */

/* -- one at work ------------------------------------------------------------------------------------- */

typedef struct pencil {
    kmp_arena arena;
    int p, n;         /* n = 2 p */
    int all;          /* the size of all pencils together */
    const int *place; /* p: its coordinates among all */
    kmp_spectrum own; /* its spectrum */
    int *chosen;      /* still: coordinates in which the vectors of its zeros are the identity */
    const double *mass, *damping, *stiffness;
    const double *led; /* the coefficient of s^2 where it is not the mass; NULL: the mass */
    double *apart;     /* LU of `led` in coordinates in which the mass is 1 */
    int *pivot;
    double *l;      /* Cholesky factor of the mass */
    double *g, *k;  /* G and K where M is 1 */
    double rate;    /* of the time in which K has norm 1 */
    double most;    /* its largest eigenvalue, or singular value of K */
    double *t, *h;  /* n x n: orthogonal, and t' A t */
    double *a, *s;  /* n x n, n: scratch */
    double *vector; /* n x n: of an iteration */
    double *part[6];
    double *row, *product; /* n */
    double *noise;         /* n: the magnitude that rounding in a row of h is relative to */
} pencil;

static size_t bytes(int count)
{
    return (size_t)count * sizeof(double);
}

static double norm_of(int count, const double *a)
{
    double sum = 0, largest = 0;
    for (int i = 0; i < count; i++)
        largest = fmax(largest, fabs(a[i]));
    for (int i = 0; largest > 0 && i < count; i++)
        sum += a[i] / largest * (a[i] / largest);
    return largest * sqrt(sum);
}

/* The largest value that counts as rounding, for matrices of size n and norm 1. */
static double rounding(int n)
{
    return 64 * n * DBL_EPSILON;
}

/* out = L^-1 a L^-T of the mass. */
static void divide_by_mass(const pencil *w, const double *a, double *out)
{
    memcpy(out, a, bytes(w->p * w->p));
    kmp_cholesky_congruence(w->p, w->l, out);
}

/* -- still shapes ------------------------------------------------------------------------------------ */

/* The first of the rows (p x n) that are as long as any. */
static int longest_row(int p, int n, const double *rows, double *row, double *length)
{
    int best = 0;
    *length = 0;
    for (int i = 0; i < p; i++) {
        for (int j = 0; j < n; j++)
            row[j] = rows[i + j * p];
        double size = norm_of(n, row);
        if (size > *length * (1 + 1e-6)) {
            best = i;
            *length = size;
        }
    }
    return best;
}

/* Eigenvectors of zeros as columns of `basis` (p x still): the identity in as many coordinates, the ones that move
 * most. The basis is one of many with x' M x = 1. Its rows, each times the root of its mass, have singular values of at
 * least 1/sqrt(p), so that no chosen row is small. 0; -1: no memory. */
static int put_still(pencil *w, kmp_spectrum *s, double *basis)
{
    int p = s->p, still = s->still, *chosen = w->chosen = KMP_ARENA_NEW(&w->arena, int, p);
    double *a = w->a, *scaled = w->vector;
    if (!chosen)
        return -1;
    for (int j = 0; j < still; j++)
        for (int i = 0; i < p; i++)
            scaled[i + j * p] = basis[i + j * p] * sqrt(w->mass[i + i * p]);
    /* Chooses as many rows (p x n, lost) as there are columns, ascending: each is the longest after projection on the
     * complement of those before it (Gram, Schmidt). Rotations of the columns change neither lengths and products of
     * rows nor the choice. */
    double *row = w->row;
    for (int k = 0; k < still; k++) {
        double length;
        int best = longest_row(p, still, scaled, row, &length), at = k;
        for (int j = 0; j < still; j++)
            row[j] = scaled[best + j * p] / length;
        for (int i = 0; i < p; i++) {
            double along = 0;
            for (int j = 0; j < still; j++)
                along += scaled[i + j * p] * row[j];
            for (int j = 0; j < still; j++)
                scaled[i + j * p] = i == best ? 0 : scaled[i + j * p] - along * row[j];
        }
        for (; at > 0 && chosen[at - 1] > best; at--)
            chosen[at] = chosen[at - 1];
        chosen[at] = best;
    }
    for (int j = 0; j < still; j++) /* a = chosen rows transposed */
        for (int i = 0; i < still; i++)
            a[j + i * still] = basis[chosen[i] + j * p];
    if (kmp_lu_factor(still, a, w->pivot))
        return -1;
    for (int i = 0; i < p; i++) {
        for (int j = 0; j < still; j++)
            w->row[j] = basis[i + j * p];
        kmp_lu_solve(still, a, w->pivot, 1, w->row);
        for (int j = 0; j < still; j++)
            s->x_re[i + j * p] = w->row[j];
    }
    for (int j = 0; j < still; j++)
        for (int i = 0; i < still; i++)
            s->x_re[chosen[i] + j * p] = i == j;
    for (int j = still; j < s->zeros; j++) /* zeros that repeat them */
        memcpy(s->x_re + j * p, s->x_re + (j - still) % (still > 0 ? still : 1) * p, bytes(p));
    return 0;
}

/* -- chains of zeros --------------------------------------------------------------------------------- */

/* columns (rows x n) <- columns b, b n x n; `row` has room for n. */
static void times(int rows, int n, double *columns, const double *b, double *row)
{
    for (int i = 0; i < rows; i++) {
        for (int j = 0; j < n; j++) {
            row[j] = 0;
            for (int k = 0; k < n; k++)
                row[j] += columns[i + k * rows] * b[k + j * n];
        }
        for (int j = 0; j < n; j++)
            columns[i + j * rows] = row[j];
    }
}

/* Rows from `first` on, `count` of them, of h <- b' times these; b has the leading dimension `lead`. */
static void turn_rows(pencil *w, int first, int count, const double *b, int lead)
{
    for (int j = 0; j < w->n; j++) {
        double *h = w->h + first + j * w->n;
        for (int i = 0; i < count; i++) {
            w->row[i] = 0;
            for (int k = 0; k < count; k++)
                w->row[i] += b[k + i * lead] * h[k];
        }
        memcpy(h, w->row, bytes(count));
    }
}

/* The number of zero singular values of the trailing block, whose vectors are rotated so that they come first. -1:
 * failed. A singular value is zero relative to each row's own noise: the friction of a light part is not a measure
 * of other rows. */
static int separate(pencil *w, int done)
{
    int n = w->n, rest = n - done, zeros = 0;
    for (int j = 0; j < rest; j++)
        for (int i = 0; i < rest; i++) {
            double noise = w->noise[done + i], x = w->h[done + i + (done + j) * n];
            w->a[i + j * rest] = noise > 0 ? x / noise : x;
        }
    if (kmp_singular_right(rest, w->a, w->s, w->vector))
        return -1;
    while (zeros < rest && w->s[rest - 1 - zeros] <= rounding(2 * w->all))
        zeros++;
    if (zeros == 0)
        return 0;
    for (int j = 0; j < rest; j++) /* the last ones first */
        memcpy(w->a + j * rest, w->vector + (rest - 1 - j) * rest, bytes(rest));
    times(n, rest, w->t + done * n, w->a, w->row);
    times(n, rest, w->h + done * n, w->a, w->row);
    turn_rows(w, done, rest, w->a, rest);
    /* Noise of the rows of the trailing block, of `rest`, as w->a turns them. */
    double *noise = w->noise + w->n - rest;
    for (int i = 0; i < rest; i++) {
        for (int k = 0; k < rest; k++)
            w->s[k] = w->a[k + i * rest] * noise[k];
        w->row[i] = norm_of(rest, w->s);
    }
    memcpy(noise, w->row, bytes(rest));
    for (int j = done; j < done + zeros; j++)
        memset(w->h + done + j * n, 0, bytes(rest));
    return zeros;
}

/* Singular values of K in w->s, and its right vectors. */
static int split(pencil *w)
{
    memcpy(w->a, w->k, bytes(w->p * w->p));
    if (kmp_singular_right(w->p, w->a, w->s, w->vector))
        return -1;
    w->most = w->s[0];
    return 0;
}

/* Deflates zeros of the companion matrix A of w->g, w->k and w->rate, after `split`: t is orthogonal and h = t' A t has
 * the zeros first. These are the null space of K, then zeros of the chains that begin in it. `most`: the largest
 * singular value of all K. Returns the number of zeros, and sets s->still; -1: no memory or no convergence. */
static int deflate(pencil *w, kmp_spectrum *s, double most)
{
    int p = w->p, n = w->n, done = 0;
    memset(w->t, 0, bytes(n * n));
    memset(w->h, 0, bytes(n * n));
    for (int i = 0; i < n; i++)
        w->t[i + i * n] = 1;
    for (int j = 0; j < p; j++) {
        w->h[j + (p + j) * n] = 1;
        for (int i = 0; i < p; i++) {
            w->h[p + i + j * n] = -w->k[i + j * p] / (w->rate * w->rate);
            w->h[p + i + (p + j) * n] = -w->g[i + j * p] / w->rate;
        }
    }
    for (int i = 0; i < n; i++) {
        for (int j = 0; j < n; j++)
            w->row[j] = w->h[i + j * n];
        w->noise[i] = norm_of(n, w->row);
    }
    /* only of K: its norm is 1, or it is all zero */
    while (done < p && w->s[p - 1 - done] <= rounding(w->all) * most)
        done++;
    s->still = done;
    if (done == 0)
        return 0;
    double *turn = w->part[0]; /* n x n */
    memset(turn, 0, bytes(n * n));
    for (int j = 0; j < p; j++) {
        memcpy(turn + j * n, w->vector + (p - 1 - j) * p, bytes(p));
        turn[p + j + (p + j) * n] = 1;
    }
    times(n, n, w->t, turn, w->row);
    times(n, n, w->h, turn, w->row);
    turn_rows(w, 0, p, turn, n);
    for (int j = 0; j < done; j++)
        memset(w->h + j * n, 0, bytes(n));
    int stages = 1;
    for (int more = done; more > 0 && done < n; done += more) {
        if ((more = separate(w, done)) < 0)
            return -1;
        stages += more > 0;
    }
    s->secular = stages > 2;
    return done;
}

/* -- vectors ----------------------------------------------------------------------------------------- */

/* out += by * x */
static void add_times(int n, double by, const double *restrict x, double *restrict out)
{
    for (int i = 0; i < n && by != 0; i++)
        out[i] += by * x[i];
}

/* out = a^H (z M + G) b with complex z; without G: a^H z M b with the mass in place of M. */
static void form(const pencil *w, const double *a_re, const double *a_im, double z_re, double z_im, bool with_damping,
                 const double *b_re, const double *b_im, double out[2])
{
    const double *mass = with_damping && w->led ? w->led : w->mass;
    const int p = w->p;
    double *re = w->product, *im = w->product + p; /* (z M + G) b */
    memset(w->product, 0, bytes(w->n));
    for (int j = 0; j < p; j++) {
        const double *m = mass + (ptrdiff_t)j * p, *g = w->damping + (ptrdiff_t)j * p;
        add_times(p, z_re * b_re[j] - z_im * b_im[j], m, re);
        add_times(p, z_re * b_im[j] + z_im * b_re[j], m, im);
        add_times(p, with_damping ? b_re[j] : 0, g, re);
        add_times(p, with_damping ? b_im[j] : 0, g, im);
    }
    out[0] = kmp_dot(p, a_re, re) + kmp_dot(p, a_im, im);
    out[1] = kmp_dot(p, a_re, im) - kmp_dot(p, a_im, re);
}

/* (re, im) <- (re, im) / (d_re + i d_im) */
static void divide(int n, double *re, double *im, double d_re, double d_im)
{
    double size = d_re * d_re + d_im * d_im;
    for (int i = 0; i < n; i++) {
        double kept = (re[i] * d_re + im[i] * d_im) / size;
        im[i] = (im[i] * d_re - re[i] * d_im) / size;
        re[i] = kept;
    }
}

static void normalise(const pencil *w, kmp_spectrum *s, int c)
{
    int p = s->p;
    double *x_re = s->x_re + c * p, *x_im = s->x_im + c * p, *y_re = s->y_re + c * p, *y_im = s->y_im + c * p, f[2];
    form(w, x_re, x_im, 1, 0, false, x_re, x_im, f);
    /* The first component whose modulus is largest. */
    int i = 0;
    double most = 0;
    for (int j = 0; j < w->p; j++) {
        double size = hypot(x_re[j], x_im[j]) * sqrt(w->mass[j + j * w->p]);
        if (size > most * (1 + 1e-6)) {
            i = j;
            most = size;
        }
    }
    double size = sqrt(fmax(f[0], DBL_MIN)), turn = hypot(x_re[i], x_im[i]);
    divide(p, x_re, x_im, size * x_re[i] / turn, size * x_im[i] / turn);
    x_im[i] = 0;
    double length = hypot(norm_of(p, y_re), norm_of(p, y_im));
    divide(p, y_re, y_im, length, 0);
    form(w, y_re, y_im, 2 * s->re[c], 2 * s->im[c], true, x_re, x_im, f);
    if (hypot(f[0], f[1]) > rounding(2 * w->all) * w->rate)
        divide(p, y_re, y_im, f[0], -f[1]);
}

/* -- order ------------------------------------------------------------------------------------------- */

typedef struct place {
    double re, im, size;
    int from;
} place;

static int compare(const void *a, const void *b)
{
    const place *x = a, *y = b;
    if (x->size != y->size)
        return x->size < y->size ? -1 : 1;
    if (x->re != y->re)
        return x->re > y->re ? -1 : 1;
    return (x->from > y->from) - (x->from < y->from);
}

/* Normalises eigenvalue `at` and, if it is the upper one of a pair, puts the other behind it; returns the next place.
 */
static int complete(const pencil *w, kmp_spectrum *s, int at, bool upper)
{
    normalise(w, s, at);
    if (upper) {
        /* The conjugate pair. */
        int to = at + 1;
        int p = s->p;
        s->re[to] = s->re[at];
        s->im[to] = -s->im[at];
        for (int i = 0; i < p; i++) {
            s->x_re[i + to * p] = s->x_re[i + at * p];
            s->x_im[i + to * p] = -s->x_im[i + at * p];
            s->y_re[i + to * p] = s->y_re[i + at * p];
            s->y_im[i + to * p] = -s->y_im[i + at * p];
        }
    }
    return at + 1 + upper;
}

/* Orders the nonzero eigenvalues, of each pair the upper one, by modulus; returns their number. */
static int order(int count, const double *re, const double *im, place *out)
{
    int kept = 0;
    for (int k = 0; k < count; k++)
        if (im[k] >= 0)
            out[kept++] = (place){re[k], im[k], hypot(re[k], im[k]), k};
    if (kept > 0)
        qsort(out, (size_t)kept, sizeof *out, compare);
    return kept;
}

/* -- the symmetric solver ---------------------------------------------------------------------------- */

/* Eigenvalues in w->s, and their vectors. */
static int find_symmetric(pencil *w)
{
    const int p = w->p;
    for (int j = 0; j < p; j++)
        for (int i = 0; i < p; i++)
            w->vector[i + j * p] = (w->stiffness[i + j * p] + w->stiffness[j + i * p]) / 2;
    memcpy(w->a, w->mass, bytes(p * p));
    const int info = kmp_eigen_symmetric(p, w->vector, w->a, w->s);
    for (int i = 0; info == 0 && i < p; i++)
        w->most = fmax(w->most, fabs(w->s[i]));
    return info;
}

/* `most`: the largest eigenvalue of all. */
static int by_symmetry(pencil *w, kmp_spectrum *s, double most)
{
    int p = s->p, still = 0, at = 0;
    double *mu = w->s, *basis = w->h;
    place *places = KMP_ARENA_NEW(&w->arena, place, 2 * p);
    if (!places)
        return -1;
    double *re = w->part[0], *im = w->part[1]; /* two an eigenvalue, the ones with a vector first */
    for (int i = 0; i < p; i++) {
        bool zero = fabs(mu[i]) <= rounding(w->all) * most;
        if (zero)
            memcpy(basis + still++ * p, w->vector + i * p, bytes(p));
        double root = zero ? 0 : sqrt(fabs(mu[i]));
        re[i] = mu[i] < 0 ? root : 0;
        im[i] = mu[i] < 0 ? 0 : root;
        re[p + i] = -re[i];
        im[p + i] = root == 0 ? -1 : -im[i]; /* a zero is put elsewhere */
        if (root == 0)
            im[i] = -1;
    }
    s->still = still;
    s->zeros = 2 * still;
    int count = order(2 * p, re, im, places);
    at = s->zeros;
    for (int k = 0; k < count; k++) {
        int from = places[k].from % p;
        s->re[at] = places[k].re;
        s->im[at] = places[k].im;
        memcpy(s->x_re + at * p, w->vector + from * p, bytes(p));
        memcpy(s->y_re + at * p, w->vector + from * p, bytes(p));
        at = complete(w, s, at, places[k].im > 0);
    }
    return put_still(w, s, basis);
}

/* -- the companion ----------------------------------------------------------------------------------- */

/* Vectors of eigenvalue k of the trailing block, in the pencil's coordinates. */
static void lift(pencil *w, kmp_spectrum *s, int done, int k, double re, double im, int to)
{
    int p = w->p, n = w->n, rest = n - done;
    double *c_re = w->a, *c_im = w->a + n, *x[2] = {s->x_re + to * p, s->x_im + to * p};
    double *y[2] = {s->y_re + to * p, s->y_im + to * p};
    memcpy(c_re + done, w->part[2] + k * rest, bytes(rest));
    memcpy(c_im + done, w->part[3] + k * rest, bytes(rest));
    for (int i = done - 1; i >= 0; i--) { /* s c = N c + B y, N above its diagonal */
        c_re[i] = c_im[i] = 0;
        for (int j = i + 1; j < n; j++) {
            c_re[i] += w->h[i + j * n] * c_re[j];
            c_im[i] += w->h[i + j * n] * c_im[j];
        }
        divide(1, c_re + i, c_im + i, re, im);
    }
    for (int part = 0; part < 2; part++)
        for (int i = 0; i < p; i++) {
            const double *c = part ? c_im : c_re, *left = w->part[4 + part] + k * rest;
            x[part][i] = y[part][i] = 0;
            for (int j = 0; j < n; j++)
                x[part][i] += w->t[i + j * n] * c[j];
            for (int j = 0; j < rest; j++)
                y[part][i] += w->t[p + i + (done + j) * n] * left[j];
        }
    for (int part = 0; part < 2; part++) {
        if (w->led)
            kmp_lu_solve_transposed(p, w->apart, w->pivot, y[part]);
        kmp_cholesky_backward(p, w->l, x[part]);
        kmp_cholesky_backward(p, w->l, y[part]);
    }
}

/* The part of eigenvector b across eigenvector a, both of length 1 by the mass. */
static double across(const pencil *w, const kmp_spectrum *s, int a, int b)
{
    int p = s->p;
    double along[2], f[2];
    double *r_re = w->a, *r_im = w->a + p;
    form(w, s->x_re + a * p, s->x_im + a * p, 1, 0, false, s->x_re + b * p, s->x_im + b * p, along);
    for (int i = 0; i < p; i++) {
        double re = s->x_re[i + a * p], im = s->x_im[i + a * p];
        r_re[i] = s->x_re[i + b * p] - (along[0] * re - along[1] * im);
        r_im[i] = s->x_im[i + b * p] - (along[0] * im + along[1] * re);
    }
    form(w, r_re, r_im, 1, 0, false, r_re, r_im, f);
    return sqrt(fmax(f[0], 0));
}

static int by_companion(pencil *w, kmp_spectrum *s, double most)
{
    int p = s->p, n = w->n, done = deflate(w, s, most);
    if (done < 0)
        return -1;
    int rest = n - done, at = s->zeros = done;
    for (int j = 0; j < rest; j++)
        memcpy(w->a + j * rest, w->h + done + (done + j) * n, bytes(rest));
    double *re = w->part[0], *im = w->part[1];
    place *places = KMP_ARENA_NEW(&w->arena, place, n);
    if (!places || kmp_eigen_general(rest, w->a, re, im, w->part[2], w->part[3], w->part[4], w->part[5]))
        return -1;
    int count = order(rest, re, im, places);
    for (int k = 0; k < count; k++) {
        s->re[at] = places[k].re * w->rate;
        s->im[at] = places[k].im * w->rate;
        lift(w, s, done, places[k].from, places[k].re, places[k].im, at);
        at = complete(w, s, at, places[k].im > 0);
    }
    for (int j = 0; j < s->still; j++) {
        memcpy(w->h + j * p, w->t + j * n, bytes(p)); /* h is no longer needed */
        kmp_cholesky_backward(p, w->l, w->h + j * p);
    }
    return put_still(w, s, w->h);
}

/* Rounding of size e splits a multiple eigenvalue with one eigenvector into several at distances of the root of e,
 * whose eigenvectors differ as much; vectors of a multiple eigenvalue with as many eigenvectors point anywhere. `size`:
 * the largest modulus of all eigenvalues. */
static void find_growth(const pencil *w, kmp_spectrum *s, double size)
{
    for (int a = s->zeros; a < s->count && !s->secular; a++)
        for (int b = a + 1; b < s->count && !s->secular; b++) {
            bool equal = hypot(s->re[a] - s->re[b], s->im[a] - s->im[b]) <= KMP_SPECTRUM_EQUAL * size;
            bool lasting = fmax(fabs(s->re[a]), fabs(s->re[b])) <= KMP_SPECTRUM_EQUAL * size;
            if (s->im[a] >= 0 && equal && lasting && across(w, s, a, b) <= ONE_SHAPE) {
                s->secular = true;
                s->secular_at = a;
            }
        }
}

/* -- the whole --------------------------------------------------------------------------------------- */

/* Replaces M by 1 where `led` is not the mass, with E = `led` in coordinates in which the mass is 1. (s^2 E + s g + k)
 * x = 0 becomes (s^2 + s E^-1 g + E^-1 k) x = 0; its left vectors are E' times the vectors of the original pencil. */
static int divide_led(pencil *w)
{
    int p = w->p;
    double off = 0;
    divide_by_mass(w, w->led, w->apart);
    for (int i = 0; i < p; i++)
        for (int j = 0; j < p; j++)
            off = fmax(off, fabs(w->apart[i + j * p] - (i == j)));
    if (off <= rounding(w->all)) {
        w->led = NULL;
        return 0;
    }
    if (kmp_lu_factor(p, w->apart, w->pivot))
        return -2;
    kmp_lu_solve(p, w->apart, w->pivot, p, w->g);
    kmp_lu_solve(p, w->apart, w->pivot, p, w->k);
    return 0;
}

/* All pencils. */
typedef struct pencils {
    kmp_arena arena;
    int p, count;
    kmp_dense_groups groups; /* their coordinates */
    pencil *of;              /* count */
} pencils;

/* The entries of a matrix that belong to a pencil. */
static const double *take_entries(pencil *w, const double *from)
{
    double *to = from && w->p < w->all ? KMP_ARENA_NEW(&w->arena, double, (ptrdiff_t)w->p * w->p) : NULL;
    for (int j = 0; to && j < w->p; j++)
        for (int i = 0; i < w->p; i++)
            to[i + j * w->p] = from[w->place[i] + (ptrdiff_t)w->place[j] * w->all];
    return w->p < w->all ? to : from;
}

/* Makes the room of a pencil and takes its matrices. False: no memory. */
static bool pencil_init(pencil *w, int all, int p, const int *of_all, const double *const of[4])
{
    *w = (pencil){.p = p, .n = 2 * p, .all = all, .place = of_all, .own = {.p = p, .count = 2 * p}};
    kmp_spectrum *s = &w->own;
    double **part = w->part;
    w->mass = take_entries(w, of[0]);
    w->led = take_entries(w, of[1]);
    w->damping = take_entries(w, of[2]);
    w->stiffness = take_entries(w, of[3]);
    return KMP_ARENA_EACH(&s->arena, double, s->count, &s->re, &s->im) &&
           KMP_ARENA_EACH(&s->arena, double, (ptrdiff_t)p * s->count, &s->x_re, &s->x_im, &s->y_re, &s->y_im) &&
           KMP_ARENA_MAKE(&w->arena, KMP_ROOM(int, w->n, &w->pivot),
                          KMP_ROOM(double, w->n, &w->s, &w->row, &w->product, &w->noise),
                          KMP_ROOM(double, (ptrdiff_t)w->n * w->n, &w->l, &w->g, &w->k, &w->t, &w->h, &w->a, &w->vector,
                                   &w->apart, &part[0], &part[1], &part[2], &part[3], &part[4], &part[5]));
}

/* G and K of all pencils in coordinates in which the mass is 1. */
static int prepare(pencils *x)
{
    int least = 0;
    for (int b = 0; b < x->count; b++) {
        pencil *w = &x->of[b];
        memcpy(w->l, w->mass, bytes(w->p * w->p));
        const int info = kmp_cholesky_factor(w->p, w->l);
        const int minor = info > 0 ? 1 + w->place[info - 1] : 0;
        if (info < 0)
            return info;
        least = minor > 0 && (least == 0 || minor < least) ? minor : least;
    }
    for (int b = 0; least == 0 && b < x->count; b++) {
        pencil *w = &x->of[b];
        divide_by_mass(w, w->damping, w->g);
        divide_by_mass(w, w->stiffness, w->k);
        const int info = w->led ? divide_led(w) : 0;
        if (info)
            return info;
    }
    return least;
}

/* True if there is no damping, and K is symmetric. Sets the rates. */
static bool is_conservative(pencils *x)
{
    double k_norm = 0, g_norm = 0, difference = 0; /* from a symmetric K */
    bool led = false;
    for (int b = 0; b < x->count; b++) {
        const pencil *w = &x->of[b];
        k_norm = hypot(k_norm, norm_of(w->p * w->p, w->k));
        g_norm = hypot(g_norm, norm_of(w->p * w->p, w->g));
        led = led || w->led;
        for (int j = 0; j < w->p; j++)
            for (int i = 0; i < j; i++)
                difference = fmax(difference, fabs(w->k[i + j * w->p] - w->k[j + i * w->p]));
    }
    const double rate = k_norm > 0 ? sqrt(k_norm) : g_norm > 0 ? g_norm : 1;
    for (int b = 0; b < x->count; b++)
        x->of[b].rate = rate;
    return !led && g_norm <= rounding(x->p) * rate && difference <= rounding(x->p) * k_norm;
}

static int solve(pencils *x, bool symmetric)
{
    double most = 0, size = 0;
    int info = 0;
    for (int b = 0; info == 0 && b < x->count; b++) {
        info = symmetric ? find_symmetric(&x->of[b]) : split(&x->of[b]);
        most = fmax(most, x->of[b].most);
    }
    for (int b = 0; info == 0 && b < x->count; b++) {
        pencil *w = &x->of[b];
        info = symmetric ? by_symmetry(w, &w->own, most) : by_companion(w, &w->own, most);
        for (int k = w->own.zeros; info == 0 && k < w->own.count; k++)
            size = fmax(size, hypot(w->own.re[k], w->own.im[k]));
    }
    bool secular = symmetric; /* no chain is longer than the chain of a free motion */
    for (int b = 0; info == 0 && b < x->count; b++)
        secular = secular || x->of[b].own.secular;
    for (int b = 0; info == 0 && !secular && b < x->count; b++)
        find_growth(&x->of[b], &x->of[b].own, size);
    return info;
}

/* -- together ---------------------------------------------------------------------------------------- */

/* Column c of a pencil as column `to` of all. */
static void put_column(const pencil *w, int c, kmp_spectrum *s, int to)
{
    const double *from[] = {w->own.x_re, w->own.x_im, w->own.y_re, w->own.y_im};
    double *into[] = {s->x_re, s->x_im, s->y_re, s->y_im};
    s->re[to] = w->own.re[c];
    s->im[to] = w->own.im[c];
    for (int v = 0; v < 4; v++)
        for (int i = 0; i < w->p; i++)
            into[v][w->place[i] + (ptrdiff_t)to * s->p] = from[v][i + (ptrdiff_t)c * w->p];
}

/* Zeros: the vectors of all still shapes, in the order of their coordinates, then as often as they are repeated. */
static void join_zeros(const pencils *x, kmp_spectrum *s, int *column)
{
    const size_t one = bytes(s->p);
    for (int b = 0; b < x->count; b++)
        for (int j = 0; j < x->of[b].own.still; j++)
            column[x->of[b].place[x->of[b].chosen[j]]] = 1 + j;
    for (int i = 0, to = 0; i < s->p; i++)
        if (column[i] > 0)
            put_column(&x->of[x->groups.of[i]], column[i] - 1, s, to++);
    for (int j = s->still; j < s->zeros && s->still > 0; j++)
        memcpy(s->x_re + (ptrdiff_t)j * s->p, s->x_re + (ptrdiff_t)((j - s->still) % s->still) * s->p, one);
}

/* All eigenvalues by modulus. */
static bool join(pencils *x, kmp_spectrum *s)
{
    int *column, *pencil_of, *from, count = 0;
    place *places;
    *s = (kmp_spectrum){.p = x->p, .count = 2 * x->p};
    if (!KMP_ARENA_EACH(&s->arena, double, s->count, &s->re, &s->im) ||
        !KMP_ARENA_EACH(&s->arena, double, (ptrdiff_t)s->p * s->count, &s->x_re, &s->x_im, &s->y_re, &s->y_im) ||
        !KMP_ARENA_MAKE(&x->arena, KMP_ROOM(int, s->count, &column, &pencil_of, &from),
                        KMP_ROOM(place, s->count, &places)))
        return false;
    bool chain = false; /* of zeros */
    for (int b = 0; b < x->count; b++) {
        const kmp_spectrum *own = &x->of[b].own;
        s->still += own->still;
        s->zeros += own->zeros;
        s->secular = s->secular || own->secular;
        chain = chain || (own->secular && own->secular_at < own->zeros);
        for (int k = own->zeros; k < own->count; k++)
            if (own->im[k] >= 0) {
                pencil_of[count] = b;
                from[count] = k;
                places[count] = (place){own->re[k], own->im[k], hypot(own->re[k], own->im[k]), count};
                count++;
            }
    }
    join_zeros(x, s, column);
    if (count > 0)
        qsort(places, (size_t)count, sizeof *places, compare);
    int to = s->zeros;
    s->secular_at = s->secular && !chain ? s->count : 0;
    for (int k = 0; k < count; k++) {
        const pencil *w = &x->of[pencil_of[places[k].from]];
        const int c = from[places[k].from];
        if (w->own.secular && w->own.secular_at == c && to < s->secular_at)
            s->secular_at = to;
        put_column(w, c, s, to++);
        if (w->own.im[c] > 0)
            put_column(w, c + 1, s, to++);
    }
    return true;
}

int kmp_spectrum_init(kmp_spectrum *spectrum, int p, const double *mass, const double *led, const double *damping,
                      const double *stiffness, bool companion)
{
    const double *const of[] = {mass, led, damping, stiffness};
    pencils x = {.p = p};
    int info = kmp_dense_groups_init(&x.groups, &x.arena, p, 4, of) ? 0 : -1;
    x.of = KMP_ARENA_NEW(&x.arena, pencil, x.groups.count);
    for (; info == 0 && x.count < x.groups.count; x.count++) {
        const int *start = x.groups.start + x.count;
        if (!x.of || !pencil_init(&x.of[x.count], p, start[1] - start[0], x.groups.order + start[0], of))
            info = -1;
    }
    if (info == 0)
        info = prepare(&x);
    const bool conservative = info == 0 && p > 0 && is_conservative(&x);
    if (info == 0)
        info = solve(&x, conservative && !companion);
    kmp_spectrum s = {.p = p, .count = 2 * p};
    if (info == 0 && x.count == 1) {
        s = x.of[0].own;
        x.of[0].own = (kmp_spectrum){0};
    } else if (info == 0 && !join(&x, &s)) {
        info = -1;
    }
    s.conservative = conservative;
    for (int b = 0; x.of && b < x.count; b++) {
        kmp_spectrum_free(&x.of[b].own);
        kmp_arena_free(&x.of[b].arena);
    }
    kmp_arena_free(&x.arena);
    if (info)
        kmp_spectrum_free(&s);
    else
        *spectrum = s;
    return info;
}

void kmp_spectrum_free(kmp_spectrum *spectrum)
{
    kmp_arena_free(&spectrum->arena);
    *spectrum = (kmp_spectrum){0};
}

int kmp_spectrum_conjugate(const kmp_spectrum *spectrum, int k)
{
    return spectrum->im[k] > 0 ? k + 1 : spectrum->im[k] < 0 ? k - 1 : k;
}
