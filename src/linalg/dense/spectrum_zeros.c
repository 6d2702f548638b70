/* SPDX-License-Identifier: BSD-3-Clause */
/* Zeros of pencils and their eigenvectors: stage by stage separation of null spaces by singular values (Kublanovskaya
 * 1966). */
#include "linalg/dense/dense.h"
#include "linalg/dense/lapack.h"
#include "linalg/dense/spectrum_inside.h"
#include <string.h>

/* -- still shapes ------------------------------------------------------------------------------------ */

/* The first of the rows (p x n) that are as long as any. */
static int longest_row(int p, int n, const double *rows, double *row, double *length)
{
    int best = 0;
    *length = 0;
    for (int i = 0; i < p; i++) {
        for (int j = 0; j < n; j++)
            row[j] = rows[i + j * p];
        double size = kmp_norm_of(n, row);
        if (size > *length * (1 + 1e-6)) {
            best = i;
            *length = size;
        }
    }
    return best;
}

/* Chooses as many rows (p x n, lost) as there are columns, ascending: each is the longest after projection on the
 * complement of those before it (Gram, Schmidt). Rotations of the columns change neither lengths and products of rows
 * nor the choice. */
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

int kmp_pencil_put_still(kmp_pencil *w, kmp_spectrum *s, double *basis)
{
    int p = s->p, still = s->still, *chosen = KMP_ARENA_NEW(&w->arena, int, p);
    double *a = w->a, *scaled = w->vector;
    if (!chosen)
        return -1;
    for (int j = 0; j < still; j++)
        for (int i = 0; i < p; i++)
            scaled[i + j * p] = basis[i + j * p] * sqrt(w->mass[i + i * p]);
    choose_rows(p, still, scaled, w->row, chosen);
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
        memcpy(s->x_re + j * p, s->x_re + (j - still) % (still > 0 ? still : 1) * p, kmp_bytes(p));
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
static void turn_rows(kmp_pencil *w, int first, int count, const double *b, int lead)
{
    for (int j = 0; j < w->n; j++) {
        double *h = w->h + first + j * w->n;
        for (int i = 0; i < count; i++) {
            w->row[i] = 0;
            for (int k = 0; k < count; k++)
                w->row[i] += b[k + i * lead] * h[k];
        }
        memcpy(h, w->row, kmp_bytes(count));
    }
}

/* Noise of the rows of the trailing block, of `rest`, as w->a turns them. */
static void turn_noise(kmp_pencil *w, int rest)
{
    double *noise = w->noise + w->n - rest;
    for (int i = 0; i < rest; i++) {
        for (int k = 0; k < rest; k++)
            w->s[k] = w->a[k + i * rest] * noise[k];
        w->row[i] = kmp_norm_of(rest, w->s);
    }
    memcpy(noise, w->row, kmp_bytes(rest));
}

/* The number of zero singular values of the trailing block, whose vectors are rotated so that they come first. -1:
 * failed. A singular value is zero relative to each row's own noise: the friction of a light part is no measure of
 * other rows. */
static int separate(kmp_pencil *w, int done)
{
    int n = w->n, rest = n - done, zeros = 0;
    for (int j = 0; j < rest; j++)
        for (int i = 0; i < rest; i++) {
            double noise = w->noise[done + i], x = w->h[done + i + (done + j) * n];
            w->a[i + j * rest] = noise > 0 ? x / noise : x;
        }
    if (kmp_singular_right(rest, w->a, w->s, w->vector))
        return -1;
    while (zeros < rest && w->s[rest - 1 - zeros] <= kmp_rounding(n))
        zeros++;
    if (zeros == 0)
        return 0;
    for (int j = 0; j < rest; j++) /* the last ones first */
        memcpy(w->a + j * rest, w->vector + (rest - 1 - j) * rest, kmp_bytes(rest));
    times(n, rest, w->t + done * n, w->a, w->row);
    times(n, rest, w->h + done * n, w->a, w->row);
    turn_rows(w, done, rest, w->a, rest);
    turn_noise(w, rest);
    for (int j = done; j < done + zeros; j++)
        memset(w->h + done + j * n, 0, kmp_bytes(rest));
    return zeros;
}

int kmp_pencil_deflate(kmp_pencil *w, kmp_spectrum *s)
{
    int p = w->p, n = w->n, done = 0;
    memset(w->t, 0, kmp_bytes(n * n));
    memset(w->h, 0, kmp_bytes(n * n));
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
        w->noise[i] = kmp_norm_of(n, w->row);
    }
    /* of K alone: its norm is 1, or it is all zero */
    memcpy(w->a, w->k, kmp_bytes(p * p));
    if (kmp_singular_right(p, w->a, w->s, w->vector))
        return -1;
    while (done < p && w->s[p - 1 - done] <= kmp_rounding(p) * w->s[0])
        done++;
    s->still = done;
    if (done == 0)
        return 0;
    double *turn = w->part[0]; /* n x n */
    memset(turn, 0, kmp_bytes(n * n));
    for (int j = 0; j < p; j++) {
        memcpy(turn + j * n, w->vector + (p - 1 - j) * p, kmp_bytes(p));
        turn[p + j + (p + j) * n] = 1;
    }
    times(n, n, w->t, turn, w->row);
    times(n, n, w->h, turn, w->row);
    turn_rows(w, 0, p, turn, n);
    for (int j = 0; j < done; j++)
        memset(w->h + j * n, 0, kmp_bytes(n));
    for (int more = done; more > 0 && done < n; done += more)
        if ((more = separate(w, done)) < 0)
            return -1;
    return done;
}
