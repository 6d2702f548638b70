/* SPDX-License-Identifier: BSD-3-Clause */
#include "linalg/eigen.h"
#include "base/memory.h"
#include "linalg/dense.h"
#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

/* LAPACK, Fortran binding. */
extern void dgeevx_(const char *balanc, const char *jobvl, const char *jobvr, const char *sense, const int *n,
                    double *a, const int *lda, double *wr, double *wi, double *vl, const int *ldvl, double *vr,
                    const int *ldvr, int *ilo, int *ihi, double *scale, double *abnrm, double *rconde, double *rcondv,
                    double *work, const int *lwork, int *iwork, int *info);
extern void dsygv_(const int *itype, const char *jobz, const char *uplo, const int *n, double *a, const int *lda,
                   double *b, const int *ldb, double *w, double *work, const int *lwork, int *info);
extern void dgesvd_(const char *jobu, const char *jobvt, const int *m, const int *n, double *a, const int *lda,
                    double *s, double *u, const int *ldu, double *vt, const int *ldvt, double *work, const int *lwork,
                    int *info);

/* -- LAPACK ------------------------------------------------------------------------------------------ */

/* Columns j, j + 1 of `packed` are the parts of a pair's vector. */
static void unpack(int n, const double *im, const double *packed, double *v_re, double *v_im)
{
    memcpy(v_re, packed, (size_t)n * (size_t)n * sizeof *v_re);
    memset(v_im, 0, (size_t)n * (size_t)n * sizeof *v_im);
    for (int j = 0; j < n; j++)
        if (im[j] > 0 && j + 1 < n) {
            for (int i = 0; i < n; i++) {
                v_re[i + (j + 1) * n] = packed[i + j * n];
                v_im[i + j * n] = packed[i + (j + 1) * n];
                v_im[i + (j + 1) * n] = -packed[i + (j + 1) * n];
            }
            j++;
        }
}

int kmp_eigen_general(int n, double *a, double *re, double *im, double *v_re, double *v_im, double *w_re, double *w_im)
{
    int ilo, ihi, lwork = n * (n + 6) + 1, info = -1;
    double norm, *left = KMP_NEW(double, n *n), *right = KMP_NEW(double, n *n), *work = KMP_NEW(double, lwork),
                 *scale = KMP_NEW(double, n);
    if (left && right && work && scale) {
        info = 0;
        if (n > 0)
            dgeevx_("B", "V", "V", "N", &n, a, &n, re, im, left, &n, right, &n, &ilo, &ihi, scale, &norm, NULL, NULL,
                    work, &lwork, NULL, &info);
        unpack(n, im, right, v_re, v_im);
        unpack(n, im, left, w_re, w_im);
    }
    kmp_free(left);
    kmp_free(right);
    kmp_free(work);
    kmp_free(scale);
    return info == 0 ? 0 : -1;
}

int kmp_eigen_symmetric(int n, double *k, double *m, double *values)
{
    int type = 1, lwork = 3 * n, info = 0;
    double *work = KMP_NEW(double, lwork);
    if (work && n > 0)
        dsygv_(&type, "V", "L", &n, k, &n, m, &n, values, work, &lwork, &info);
    kmp_free(work);
    return !work || info < 0 || (info > 0 && info <= n) ? -1 : info > n ? info - n : 0;
}

/* Right singular vectors of a (n x n, lost) as columns, singular values descending. */
static int singular(int n, double *a, double *values, double *v)
{
    int lwork = 5 * n + 1, one = 1, info = -1;
    double none, *work = KMP_NEW(double, lwork);
    if (work)
        dgesvd_("N", "A", &n, &n, a, &n, values, &none, &one, v, &n, work, &lwork, &info);
    kmp_free(work);
    for (int i = 0; info == 0 && i < n; i++)
        for (int j = 0; j < i; j++) {
            double kept = v[i + j * n];
            v[i + j * n] = v[j + i * n];
            v[j + i * n] = kept;
        }
    return info == 0 ? 0 : -1;
}

/* -- small algebra ----------------------------------------------------------------------------------- */

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

/* What is zero but for rounding, of matrices of size n and norm 1. */
static double rounding(int n)
{
    return 64 * n * DBL_EPSILON;
}

/* x <- L^-1 x, L^-T x. */
static void forward(int n, const double *l, double *x)
{
    for (int i = 0; i < n; i++) {
        for (int k = 0; k < i; k++)
            x[i] -= l[i + k * n] * x[k];
        x[i] /= l[i + i * n];
    }
}

static void backward(int n, const double *l, double *x)
{
    for (int i = n - 1; i >= 0; i--) {
        for (int k = i + 1; k < n; k++)
            x[i] -= l[k + i * n] * x[k];
        x[i] /= l[i + i * n];
    }
}

/* out = L^-1 a L^-T; `row` has room for n. */
static void congruence(int n, const double *l, const double *a, double *out, double *row)
{
    memcpy(out, a, bytes(n * n));
    for (int j = 0; j < n; j++)
        forward(n, l, out + j * n);
    for (int i = 0; i < n; i++) {
        for (int j = 0; j < n; j++)
            row[j] = out[i + j * n];
        forward(n, l, row);
        for (int j = 0; j < n; j++)
            out[i + j * n] = row[j];
    }
}

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

/* -- one at work ------------------------------------------------------------------------------------- */

typedef struct pencil {
    int p, n; /* n = 2 p */
    const double *mass, *damping, *stiffness;
    const double *led; /* what stands before s^2 instead of the mass; NULL: the mass itself */
    double *apart;     /* LU of it where the mass is 1 */
    int *pivot;
    double *l;      /* Cholesky factor of the mass */
    double *g, *k;  /* G and K where M is 1 */
    double rate;    /* of the time in which K has norm 1 */
    double *t, *h;  /* n x n: orthogonal, and t' A t */
    double *a, *s;  /* n x n, n: scratch */
    double *vector; /* n x n: of an iteration */
    double *part[6];
    double *row;   /* n */
    double *noise; /* n: what rounding in a row of h is relative to */
} pencil;

static double **rooms(pencil *w, int k)
{
    double **all[] = {&w->l,       &w->g,       &w->k,       &w->t,       &w->h,       &w->a,
                      &w->s,       &w->vector,  &w->part[0], &w->part[1], &w->part[2], &w->part[3],
                      &w->part[4], &w->part[5], &w->row,     &w->noise,   &w->apart};
    return k < (int)(sizeof all / sizeof *all) ? all[k] : NULL;
}

static bool make_rooms(pencil *w)
{
    bool ok = true;
    for (int k = 0; rooms(w, k); k++)
        ok = (*rooms(w, k) = KMP_NEW(double, w->n * w->n + 1)) && ok;
    return (w->pivot = KMP_NEW(int, w->n)) && ok;
}

static void free_rooms(pencil *w)
{
    for (int k = 0; rooms(w, k); k++)
        kmp_free(*rooms(w, k));
    kmp_free(w->pivot);
}

static bool is_symmetric(int n, const double *a, double size)
{
    double difference = 0;
    for (int j = 0; j < n; j++)
        for (int i = 0; i < j; i++)
            difference = fmax(difference, fabs(a[i + j * n] - a[j + i * n]));
    return difference <= rounding(n) * size;
}

/* -- vectors ----------------------------------------------------------------------------------------- */

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

/* As many rows (p x n, lost) as there are columns, ascending: each the longest beside those before it (Gram, Schmidt).
 * Lengths and products of rows are the same however the columns are turned, and so is what is chosen. */
static void choose_rows(int p, int n, double *rows, double *row, int *chosen)
{
    for (int k = 0; k < n; k++) {
        double length;
        int best = longest_row(p, n, rows, row, &length), at = k;
        for (int j = 0; j < n; j++)
            row[j] = rows[best + j * p] / length;
        for (int i = 0; i < p; i++) {
            double along = 0;
            for (int j = 0; j < n; j++)
                along += rows[i + j * p] * row[j];
            for (int j = 0; j < n; j++)
                rows[i + j * p] = i == best ? 0 : rows[i + j * p] - along * row[j];
        }
        for (; at > 0 && chosen[at - 1] > best; at--)
            chosen[at] = chosen[at - 1];
        chosen[at] = best;
    }
}

/* Still vectors as columns of `basis` (p x still): the identity in as many coordinates, those that move most. The basis
 * is one of very many, x' M x = 1; its rows, each times the root of its mass, have singular values of 1/sqrt(p) and
 * more, so that no row chosen is a small one. */
static void put_still(const pencil *w, kmp_spectrum *s, double *basis)
{
    int p = s->p, still = s->still, *chosen = KMP_NEW(int, p), *pivot = KMP_NEW(int, p);
    double *a = w->a, *scaled = w->vector;
    bool ok = chosen && pivot;
    for (int j = 0; ok && j < still; j++)
        for (int i = 0; i < p; i++)
            scaled[i + j * p] = basis[i + j * p] * sqrt(w->mass[i + i * p]);
    if (ok)
        choose_rows(p, still, scaled, w->row, chosen);
    for (int j = 0; ok && j < still; j++) /* a = chosen rows transposed */
        for (int i = 0; i < still; i++)
            a[j + i * still] = basis[chosen[i] + j * p];
    ok = ok && kmp_lu_factor(still, a, pivot) == 0;
    for (int i = 0; ok && i < p; i++) {
        for (int j = 0; j < still; j++)
            w->row[j] = basis[i + j * p];
        kmp_lu_solve(still, a, pivot, 1, w->row);
        for (int j = 0; j < still; j++)
            s->x_re[i + j * p] = w->row[j];
    }
    for (int j = 0; ok && j < still; j++)
        for (int i = 0; i < still; i++)
            s->x_re[chosen[i] + j * p] = i == j;
    for (int j = still; j < s->zeros; j++) /* what repeats them */
        memcpy(s->x_re + j * p, s->x_re + (j - still) % (still > 0 ? still : 1) * p, bytes(p));
    kmp_free(chosen);
    kmp_free(pivot);
}

/* a^H (z M + G) b of parts, z complex; without G: a^H z M b with the mass in place of M. */
static void form(const pencil *w, const double *a_re, const double *a_im, double z_re, double z_im, bool with_damping,
                 const double *b_re, const double *b_im, double out[2])
{
    const double *mass = with_damping && w->led ? w->led : w->mass;
    out[0] = out[1] = 0;
    for (int j = 0; j < w->p; j++)
        for (int i = 0; i < w->p; i++) {
            double m = mass[i + j * w->p], g = with_damping ? w->damping[i + j * w->p] : 0;
            double re = z_re * m + g, im = z_im * m;
            double c_re = re * b_re[j] - im * b_im[j], c_im = re * b_im[j] + im * b_re[j];
            out[0] += a_re[i] * c_re + a_im[i] * c_im;
            out[1] += a_re[i] * c_im - a_im[i] * c_re;
        }
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

/* The first of those that are as large as any. */
static int largest_part(const pencil *w, const double *re, const double *im)
{
    int best = 0;
    double most = 0;
    for (int i = 0; i < w->p; i++) {
        double size = hypot(re[i], im[i]) * sqrt(w->mass[i + i * w->p]);
        if (size > most * (1 + 1e-6)) {
            best = i;
            most = size;
        }
    }
    return best;
}

static void normalise(const pencil *w, kmp_spectrum *s, int c)
{
    int p = s->p;
    double *x_re = s->x_re + c * p, *x_im = s->x_im + c * p, *y_re = s->y_re + c * p, *y_im = s->y_im + c * p, f[2];
    form(w, x_re, x_im, 1, 0, false, x_re, x_im, f);
    int i = largest_part(w, x_re, x_im);
    double size = sqrt(fmax(f[0], DBL_MIN)), turn = hypot(x_re[i], x_im[i]);
    divide(p, x_re, x_im, size * x_re[i] / turn, size * x_im[i] / turn);
    x_im[i] = 0;
    double length = hypot(norm_of(p, y_re), norm_of(p, y_im));
    divide(p, y_re, y_im, length, 0);
    form(w, y_re, y_im, 2 * s->re[c], 2 * s->im[c], true, x_re, x_im, f);
    if (hypot(f[0], f[1]) > rounding(w->n) * w->rate)
        divide(p, y_re, y_im, f[0], -f[1]);
}

static void conjugate(kmp_spectrum *s, int from, int to)
{
    int p = s->p;
    s->re[to] = s->re[from];
    s->im[to] = -s->im[from];
    for (int i = 0; i < p; i++) {
        s->x_re[i + to * p] = s->x_re[i + from * p];
        s->x_im[i + to * p] = -s->x_im[i + from * p];
        s->y_re[i + to * p] = s->y_re[i + from * p];
        s->y_im[i + to * p] = -s->y_im[i + from * p];
    }
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

/* Those that are no zeros, of each pair the upper one, by modulus; count of them. */
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

/* -- the symmetric way ------------------------------------------------------------------------------- */

static int by_symmetry(pencil *w, kmp_spectrum *s)
{
    int p = s->p, still = 0, at = 0;
    double *mu = w->s, most = 0, *basis = w->h;
    for (int j = 0; j < p; j++)
        for (int i = 0; i < p; i++)
            w->vector[i + j * p] = (w->stiffness[i + j * p] + w->stiffness[j + i * p]) / 2;
    memcpy(w->a, w->mass, bytes(p * p));
    int info = kmp_eigen_symmetric(p, w->vector, w->a, mu);
    place *places = KMP_NEW(place, 2 * p);
    if (info || !places) {
        kmp_free(places);
        return info ? info : -1;
    }
    for (int i = 0; i < p; i++)
        most = fmax(most, fabs(mu[i]));
    double *re = w->part[0], *im = w->part[1]; /* two an eigenvalue, those with a vector first */
    for (int i = 0; i < p; i++) {
        bool zero = fabs(mu[i]) <= rounding(p) * most;
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
        normalise(w, s, at++);
        if (places[k].im > 0) {
            conjugate(s, at - 1, at);
            at++;
        }
    }
    kmp_free(places);
    put_still(w, s, basis);
    return 0;
}

/* -- the companion ----------------------------------------------------------------------------------- */

/* Noise of the rows of the trailing block, of `rest`, as w->a turns them. */
static void turn_noise(pencil *w, int rest)
{
    double *noise = w->noise + w->n - rest;
    for (int i = 0; i < rest; i++) {
        for (int k = 0; k < rest; k++)
            w->s[k] = w->a[k + i * rest] * noise[k];
        w->row[i] = norm_of(rest, w->s);
    }
    memcpy(noise, w->row, bytes(rest));
}

/* How many of the trailing block's singular values are zero, its vectors turned so that they come first. -1: failed.
 * Zero is what is so in each row, beside the row: the friction of a light part is no measure of what the others do. */
static int separate(pencil *w, int done)
{
    int n = w->n, rest = n - done, zeros = 0;
    for (int j = 0; j < rest; j++)
        for (int i = 0; i < rest; i++) {
            double noise = w->noise[done + i], x = w->h[done + i + (done + j) * n];
            w->a[i + j * rest] = noise > 0 ? x / noise : x;
        }
    if (singular(rest, w->a, w->s, w->vector))
        return -1;
    while (zeros < rest && w->s[rest - 1 - zeros] <= rounding(n))
        zeros++;
    if (zeros == 0)
        return 0;
    for (int j = 0; j < rest; j++) /* the last ones first */
        memcpy(w->a + j * rest, w->vector + (rest - 1 - j) * rest, bytes(rest));
    times(n, rest, w->t + done * n, w->a, w->row);
    times(n, rest, w->h + done * n, w->a, w->row);
    for (int j = 0; j < n; j++) { /* rows of h */
        for (int i = 0; i < rest; i++) {
            w->row[i] = 0;
            for (int k = 0; k < rest; k++)
                w->row[i] += w->a[k + i * rest] * w->h[done + k + j * n];
        }
        memcpy(w->h + done + j * n, w->row, bytes(rest));
    }
    turn_noise(w, rest);
    for (int j = done; j < done + zeros; j++)
        memset(w->h + done + j * n, 0, bytes(rest));
    return zeros;
}

/* t, h: first the null space of K, then what of its chains is zero as well. Zeros in all, -1: failed. */
static int deflate(pencil *w, kmp_spectrum *s)
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
    /* of K alone: its size is 1, or it is all zero */
    memcpy(w->a, w->k, bytes(p * p));
    if (singular(p, w->a, w->s, w->vector))
        return -1;
    while (done < p && w->s[p - 1 - done] <= rounding(p) * w->s[0])
        done++;
    s->still = done;
    if (done == 0)
        return 0;
    memcpy(w->part[0], w->vector, bytes(p * p));
    double *turn = w->part[1]; /* n x n */
    memset(turn, 0, bytes(n * n));
    for (int j = 0; j < p; j++) {
        memcpy(turn + j * n, w->part[0] + (p - 1 - j) * p, bytes(p));
        turn[p + j + (p + j) * n] = 1;
    }
    times(n, n, w->t, turn, w->row);
    times(n, n, w->h, turn, w->row);
    for (int j = 0; j < n; j++) {
        for (int i = 0; i < p; i++) {
            w->row[i] = 0;
            for (int k = 0; k < p; k++)
                w->row[i] += turn[k + i * n] * w->h[k + j * n];
        }
        memcpy(w->h + j * n, w->row, bytes(p));
    }
    for (int j = 0; j < done; j++)
        memset(w->h + j * n, 0, bytes(n));
    for (int more = done; more > 0 && done < n; done += more)
        if ((more = separate(w, done)) < 0)
            return -1;
    return done;
}

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
            kmp_lu_solve_transposed(p, w->apart, w->pivot, 1, y[part]);
        backward(p, w->l, x[part]);
        backward(p, w->l, y[part]);
    }
}

static int by_companion(pencil *w, kmp_spectrum *s)
{
    int p = s->p, n = w->n, done = deflate(w, s);
    if (done < 0)
        return -1;
    int rest = n - done, at = s->zeros = done;
    for (int j = 0; j < rest; j++)
        memcpy(w->a + j * rest, w->h + done + (done + j) * n, bytes(rest));
    double *re = w->part[0], *im = w->part[1];
    place *places = KMP_NEW(place, n);
    if (!places || kmp_eigen_general(rest, w->a, re, im, w->part[2], w->part[3], w->part[4], w->part[5])) {
        kmp_free(places);
        return -1;
    }
    int count = order(rest, re, im, places);
    for (int k = 0; k < count; k++) {
        s->re[at] = places[k].re * w->rate;
        s->im[at] = places[k].im * w->rate;
        lift(w, s, done, places[k].from, places[k].re, places[k].im, at);
        normalise(w, s, at++);
        if (places[k].im > 0) {
            conjugate(s, at - 1, at);
            at++;
        }
    }
    kmp_free(places);
    for (int j = 0; j < s->still; j++) {
        memcpy(w->h + j * p, w->t + j * n, bytes(p)); /* h is no longer needed */
        backward(p, w->l, w->h + j * p);
    }
    put_still(w, s, w->h);
    return 0;
}

/* -- the whole --------------------------------------------------------------------------------------- */

/* What is led before s^2, where the mass is 1: E. (s^2 E + s g + k) x = 0 is (s^2 + s E^-1 g + E^-1 k) x = 0, in which
 * the mass is 1 again; its left vectors are E' times those of the former. */
static int divide_led(pencil *w)
{
    int p = w->p;
    double off = 0;
    congruence(p, w->l, w->led, w->apart, w->row);
    for (int i = 0; i < p; i++)
        for (int j = 0; j < p; j++)
            off = fmax(off, fabs(w->apart[i + j * p] - (i == j)));
    if (off <= rounding(p)) {
        w->led = NULL;
        return 0;
    }
    if (kmp_lu_factor(p, w->apart, w->pivot))
        return -2;
    kmp_lu_solve(p, w->apart, w->pivot, p, w->g);
    kmp_lu_solve(p, w->apart, w->pivot, p, w->k);
    return 0;
}

static int solve(pencil *w, kmp_spectrum *s, bool companion)
{
    int p = w->p;
    memcpy(w->l, w->mass, bytes(p * p));
    int info = kmp_cholesky_factor(p, w->l);
    if (info)
        return info;
    congruence(p, w->l, w->damping, w->g, w->row);
    congruence(p, w->l, w->stiffness, w->k, w->row);
    if (w->led && (info = divide_led(w)) != 0)
        return info;
    double k_norm = norm_of(p * p, w->k), g_norm = norm_of(p * p, w->g);
    w->rate = k_norm > 0 ? sqrt(k_norm) : g_norm > 0 ? g_norm : 1;
    s->conservative = !w->led && g_norm <= rounding(p) * w->rate && is_symmetric(p, w->k, k_norm);
    return s->conservative && !companion ? by_symmetry(w, s) : by_companion(w, s);
}

static int init(kmp_spectrum *spectrum, pencil *w, bool companion)
{
    int p = w->p;
    kmp_spectrum s = {.p = p, .count = 2 * p};
    s.re = KMP_NEW(double, s.count);
    s.im = KMP_NEW(double, s.count);
    s.x_re = KMP_NEW(double, p *s.count);
    s.x_im = KMP_NEW(double, p *s.count);
    s.y_re = KMP_NEW(double, p *s.count);
    s.y_im = KMP_NEW(double, p *s.count);
    bool ok = make_rooms(w) && s.re && s.im && s.x_re && s.x_im && s.y_re && s.y_im;
    int info = ok ? p > 0 ? solve(w, &s, companion) : 0 : -1;
    free_rooms(w);
    if (info)
        kmp_spectrum_free(&s);
    else
        *spectrum = s;
    return info;
}

int kmp_spectrum_init(kmp_spectrum *spectrum, int p, const double *mass, const double *damping, const double *stiffness,
                      bool companion)
{
    pencil w = {.p = p, .n = 2 * p, .mass = mass, .damping = damping, .stiffness = stiffness};
    return init(spectrum, &w, companion);
}

int kmp_spectrum_init_led(kmp_spectrum *spectrum, int p, const double *mass, const double *led, const double *damping,
                          const double *stiffness)
{
    pencil w = {.p = p, .n = 2 * p, .mass = mass, .led = led, .damping = damping, .stiffness = stiffness};
    return init(spectrum, &w, false);
}

void kmp_spectrum_free(kmp_spectrum *spectrum)
{
    double *all[] = {spectrum->re, spectrum->im, spectrum->x_re, spectrum->x_im, spectrum->y_re, spectrum->y_im};
    for (size_t k = 0; k < sizeof all / sizeof *all; k++)
        kmp_free(all[k]);
    *spectrum = (kmp_spectrum){0};
}

int kmp_spectrum_conjugate(const kmp_spectrum *spectrum, int k)
{
    return spectrum->im[k] > 0 ? k + 1 : spectrum->im[k] < 0 ? k - 1 : k;
}
