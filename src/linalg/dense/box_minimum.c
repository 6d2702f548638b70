/* SPDX-License-Identifier: BSD-3-Clause */
/* A primal active-set method: the minimum over the entries that are inside, as far as the nearest bound; then an entry
 * with a wrong sign of y leaves its bound. Entries are scaled so that D has a unit diagonal. On entries inside D is
 * eliminated with diagonal pivots. If it is singular and a slope remains, the function falls along a null vector, up
 * to a bound. Each minimum over a face is visited once, because the function decreases. When steps of length zero might
 * repeat faces, the entry of least number leaves (Bland's rule), so that the method ends. */
#include "linalg/dense/box_minimum.h"
#include <math.h>
#include <stdbool.h>
#include <stddef.h>
#include <string.h>

enum {
    LARGEST_FIRST = 10, /* rounds for each entry in which the largest violation leaves its bound, not the first one */
    MOST_ROUNDS = 100   /* rounds for each entry */
};

/* A pivot of D with a unit diagonal below this is zero: rounding of its elements. */
#define SINGULAR 1e-11
/* y below this part of the largest scaled one is zero. Slopes on entries without a pivot have the errors of pivots that
 * are neglected: where these errors lead from face to face without an end, they are zero below a larger part. */
#define FLAT      1e-12
#define FLAT_LEFT 1e-11

typedef struct search {
    const kmp_box *box;
    double *x, *y, *scale, *rest, *step;
    double *work; /* n x n: rows and columns of entries inside, in their order */
    int *side;
    double flat, flat_left;
    int *order;        /* entries inside, the pivots first */
    int inside, count; /* their number; the room of pivots */
} search;

/* y = D x + a, column by column: compilers do several entries at once, and each sum has one order. */
static void find_slopes(const kmp_box *box, const double *x, double *y)
{
    const int n = box->n;
    memcpy(y, box->a, (size_t)n * sizeof *y);
    for (int j = 0; j < n; j++) {
        const double *column = box->d + (ptrdiff_t)j * n, by = x[j];
        if (by == 0)
            continue;
        for (int i = 0; i < n; i++)
            y[i] += column[i] * by;
    }
}

/* The largest remaining diagonal element of an entry inside, by its place among these; -1: none that is not zero. */
static int find_pivot(const search *s)
{
    int best = -1;
    double most = SINGULAR;
    for (int k = s->count; k < s->inside; k++) {
        const double own = s->work[k * (s->inside + 1)];
        /* Of equal ones the first entry. */
        if (own > most || (own == most && best >= 0 && s->order[k] < s->order[best])) {
            best = k;
            most = own;
        }
    }
    return best;
}

static void swap_numbers(double *a, double *b)
{
    const double kept = *a;
    *a = *b;
    *b = kept;
}

/* Exchanges the places k and l of entries inside. */
static void swap_places(search *s, int k, int l)
{
    const int size = s->inside, kept = s->order[k];
    if (k == l)
        return;
    s->order[k] = s->order[l];
    s->order[l] = kept;
    swap_numbers(&s->rest[k], &s->rest[l]);
    for (int i = 0; i < size; i++)
        swap_numbers(&s->work[k * size + i], &s->work[l * size + i]);
    for (int i = 0; i < size; i++)
        swap_numbers(&s->work[i * size + k], &s->work[i * size + l]);
}

/* Eliminates the last pivot from the entries inside that have been none. */
static void eliminate(search *s)
{
    const int size = s->inside, p = s->count - 1;
    const double *row = s->work + p * size;
    for (int k = s->count; k < size; k++) {
        double *own = s->work + k * size;
        const double by = own[p] / row[p];
        if (by == 0) /* D is often sparse, as for a chain */
            continue;
        for (int l = s->count; l < size; l++)
            own[l] -= by * row[l];
        s->rest[k] -= by * s->rest[p];
    }
}

/* The scaled D of entries inside, row by row, and the scaled -y as a right-hand side. */
static void take_inside(search *s)
{
    const kmp_box *box = s->box;
    const int n = box->n;
    s->count = s->inside = 0;
    for (int i = 0; i < n; i++)
        if (s->side[i] == 0)
            s->order[s->inside++] = i;
    find_slopes(box, s->x, s->y);
    for (int k = 0; k < s->inside; k++) {
        const int i = s->order[k];
        double *row = s->work + k * s->inside;
        s->rest[k] = -s->y[i] / s->scale[i];
        for (int l = 0; l <= k; l++) {
            const int j = s->order[l];
            row[l] = s->work[l * s->inside + k] = box->d[i + j * n] / (s->scale[i] * s->scale[j]);
        }
    }
}

/* The step to the minimum over the entries inside; true: the function falls along it without end. */
static bool find_step(search *s)
{
    int p;
    take_inside(s);
    while ((p = find_pivot(s)) >= 0) {
        swap_places(s, p, s->count++);
        eliminate(s);
    }
    /* The entry with the largest slope that remains where D is singular; -1: none. */
    int fall = -1;
    for (int k = s->count; k < s->inside; k++) {
        const double slope = fabs(s->rest[k]), most = fall < 0 ? s->flat_left : fabs(s->rest[fall]);
        if (slope > most || (slope == most && fall >= 0 && s->order[k] < s->order[fall]))
            fall = k;
    }
    double *by_place = s->y; /* its slopes have been taken */
    for (int k = s->count; k < s->inside; k++)
        by_place[k] = k == fall ? s->rest[k] : 0;
    /* Back substitution, by places: the step of each pivot follows from the steps of the entries behind it. */
    for (int k = s->count; k-- > 0;) {
        const double *row = s->work + k * s->inside;
        double sum = fall < 0 ? s->rest[k] : 0;
        for (int l = k + 1; l < s->inside; l++)
            sum -= row[l] * by_place[l];
        by_place[k] = sum / row[k];
    }
    memset(s->step, 0, (size_t)s->box->n * sizeof *s->step);
    for (int k = 0; k < s->inside; k++)
        s->step[s->order[k]] = by_place[k] / s->scale[s->order[k]];
    return fall >= 0;
}

/* Makes the step up to the nearest bound; the entry there, -1: none. *done: the step was finite. */
static int advance(search *s, bool endless, bool *done)
{
    const kmp_box *box = s->box;
    double most = endless ? INFINITY : 1;
    int stop = -1;
    for (int i = 0; i < box->n; i++) {
        double to = s->step[i] < 0 ? box->lower[i] : box->upper[i];
        double length = s->side[i] != 0 || s->step[i] == 0 ? INFINITY : fmax((to - s->x[i]) / s->step[i], 0);
        if (length < most) {
            most = length;
            stop = i;
        }
    }
    *done = most < INFINITY;
    for (int i = 0; *done && i < box->n; i++)
        s->x[i] = fmin(fmax(s->x[i] + most * s->step[i], box->lower[i]), box->upper[i]);
    if (stop >= 0) {
        s->side[stop] = s->step[stop] < 0 ? -1 : 1;
        s->x[stop] = s->side[stop] < 0 ? box->lower[stop] : box->upper[stop];
    }
    return stop;
}

static void set_scales(search *s)
{
    const int n = s->box->n;
    double *most = s->y;
    s->flat = 0;
    for (int i = 0; i < n; i++)
        most[i] = fabs(s->box->a[i]);
    for (int j = 0; j < n; j++)
        for (int i = 0; s->x[j] != 0 && isfinite(s->x[j]) && i < n; i++)
            most[i] = fmax(most[i], fabs(s->box->d[i + j * n] * s->x[j]));
    for (int i = 0; i < n; i++) {
        const double own = s->box->d[i + i * n];
        s->scale[i] = own > 0 ? sqrt(own) : 1;
        s->flat = fmax(s->flat, FLAT * most[i] / s->scale[i]);
    }
    s->flat_left = s->flat;
}

static kmp_box_outcome visit_faces(search *s)
{
    int n = s->box->n;
    bool finite = true;
    for (int round = 0; round < MOST_ROUNDS * (n + 1); round++) {
        int stop = advance(s, find_step(s), &finite);
        if (!finite)
            return KMP_BOX_UNBOUNDED;
        if (stop >= 0)
            continue;
        /* The entry that leaves its bound: the one with the largest violation of the sign of y, or the first one; -1:
         * none. */
        bool largest = round < LARGEST_FIRST * (n + 1);
        s->flat_left = largest ? s->flat : FLAT_LEFT / FLAT * s->flat;
        const kmp_box *box = s->box;
        int leaving = -1;
        double most = s->flat;
        find_slopes(box, s->x, s->y);
        for (int i = 0; i < box->n && (leaving < 0 || largest); i++) {
            double off = s->side[i] * s->y[i] / s->scale[i];
            if (box->lower[i] < box->upper[i] && off > most) {
                leaving = i;
                most = off;
            }
        }
        if (leaving < 0)
            return KMP_BOX_FOUND;
        s->side[leaving] = 0;
    }
    return KMP_BOX_UNSETTLED;
}

KMP_LOCAL kmp_box_outcome kmp_box_minimum(const kmp_box *box, double *x, double *y, int *side, double *room)
{
    int n = box->n;
    search s = {.box = box,
                .x = x,
                .y = y,
                .side = side,
                .work = room,
                .scale = room + n * n,
                .rest = room + n * n + n,
                .step = room + n * n + 2 * n,
                .order = (int *)(void *)(room + n * n + 3 * n)};
    for (int i = 0; i < box->n; i++) {
        x[i] = fmin(fmax(x[i], box->lower[i]), box->upper[i]);
        side[i] = x[i] <= box->lower[i] ? -1 : x[i] >= box->upper[i] ? 1 : 0;
    }
    set_scales(&s);
    kmp_box_outcome outcome = visit_faces(&s);
    find_slopes(box, x, y);
    for (int i = 0; i < n; i++)
        y[i] = side[i] == 0 && outcome == KMP_BOX_FOUND ? 0 : y[i];
    return outcome;
}
