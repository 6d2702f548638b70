/* SPDX-License-Identifier: BSD-3-Clause */
/* A primal active-set method: the minimum over the entries that are inside, as far as the nearest bound; then an entry
 * with a wrong sign of y leaves its bound. Entries are scaled so that D has a unit diagonal. On entries inside D is
 * eliminated with diagonal pivots. If it is singular and a slope remains, the function falls along a null vector, up
 * to a bound. Each minimum over a face is visited once, because the function decreases. When steps of length zero might
 * repeat faces, the entry of least number leaves (Bland's rule), so that the method ends. */
#include "linalg/dense/box_minimum.h"
#include <math.h>
#include <stdbool.h>
#include <string.h>

enum {
    LARGEST_FIRST = 10, /* rounds for each entry in which the largest violation leaves its bound, not the first one */
    MOST_ROUNDS = 100   /* rounds for each entry */
};

/* A pivot of D with a unit diagonal below this is zero: rounding of its elements. */
#define SINGULAR 1e-11
/* y below this part of the largest scaled one is zero. */
#define FLAT 1e-12

typedef struct search {
    const kmp_box *box;
    double *x, *y, *scale, *rest, *step;
    double *work; /* n x n */
    int *side;
    double flat;
    int *order;        /* entries inside, the pivots first */
    int inside, count; /* their number; that of pivots */
} search;

static double slope_in_box(const kmp_box *box, const double *x, int i)
{
    double sum = box->a[i];
    for (int j = 0; j < box->n; j++)
        sum += box->d[i + j * box->n] * x[j];
    return sum;
}

/* The largest remaining diagonal element of an entry inside, by its place among these; -1: none that is not zero. */
static int find_pivot(const search *s)
{
    int n = s->box->n, best = -1;
    double most = SINGULAR;
    for (int k = s->count; k < s->inside; k++) {
        const double own = s->work[s->order[k] * (n + 1)];
        /* Of equal ones the first entry. */
        if (own > most || (own == most && best >= 0 && s->order[k] < s->order[best])) {
            best = k;
            most = own;
        }
    }
    return best;
}

/* Eliminates a pivot from the entries inside that have been none. */
static void eliminate(search *s, int p)
{
    const int n = s->box->n;
    for (int k = s->count; k < s->inside; k++) {
        const int i = s->order[k];
        const double by = s->work[i + p * n] / s->work[p + p * n];
        for (int l = s->count; l < s->inside; l++)
            s->work[i + s->order[l] * n] -= by * s->work[p + s->order[l] * n];
        s->rest[i] -= by * s->rest[p];
    }
}

/* Back substitution: the step of each pivot follows from those of the entries behind it. */
static void substitute_back(search *s, bool whole)
{
    int n = s->box->n;
    for (int k = s->count; k-- > 0;) {
        int p = s->order[k];
        double sum = whole ? s->rest[p] : 0;
        for (int l = k + 1; l < s->inside; l++)
            sum -= s->work[p + s->order[l] * n] * s->step[s->order[l]];
        s->step[p] = sum / s->work[p + p * n];
    }
}

/* The step to the minimum over the entries inside; true: the function falls along it without end. */
static bool find_step(search *s)
{
    int n = s->box->n, p;
    s->count = s->inside = 0;
    for (int i = 0; i < n; i++) {
        s->step[i] = 0;
        if (s->side[i] == 0)
            s->order[s->inside++] = i;
    }
    /* Copies the scaled D of entries inside, and the scaled -y as a right-hand side. */
    for (int k = 0; k < s->inside; k++) {
        const int i = s->order[k];
        s->rest[i] = -slope_in_box(s->box, s->x, i) / s->scale[i];
        for (int l = 0; l < s->inside; l++) {
            const int j = s->order[l];
            s->work[i + j * n] = s->box->d[i + j * n] / (s->scale[i] * s->scale[j]);
        }
    }
    while ((p = find_pivot(s)) >= 0) {
        const int pivot = s->order[p];
        s->order[p] = s->order[s->count];
        s->order[s->count++] = pivot;
        eliminate(s, pivot);
    }
    /* The entry with the largest slope that remains where D is singular; -1: none. */
    int fall = -1;
    for (int k = s->count; k < s->inside; k++) {
        const int i = s->order[k];
        const double slope = fabs(s->rest[i]), most = fall < 0 ? s->flat : fabs(s->rest[fall]);
        if (slope > most || (slope == most && fall >= 0 && i < fall))
            fall = i;
    }
    if (fall >= 0)
        s->step[fall] = s->rest[fall];
    substitute_back(s, fall < 0);
    for (int i = 0; i < n; i++)
        s->step[i] /= s->scale[i];
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
    int n = s->box->n;
    s->flat = 0;
    for (int i = 0; i < n; i++) {
        double own = s->box->d[i + i * n];
        s->scale[i] = own > 0 ? sqrt(own) : 1;
        double most = fabs(s->box->a[i]);
        for (int j = 0; j < n; j++)
            if (isfinite(s->x[j]))
                most = fmax(most, fabs(s->box->d[i + j * n] * s->x[j]));
        s->flat = fmax(s->flat, FLAT * most / s->scale[i]);
    }
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
        /* The entry that leaves its bound: that with the largest violation of the sign of y, or the first one; -1:
         * none. */
        bool largest = round < LARGEST_FIRST * (n + 1);
        const kmp_box *box = s->box;
        int leaving = -1;
        double most = s->flat;
        for (int i = 0; i < box->n && (leaving < 0 || largest); i++) {
            s->y[i] = slope_in_box(box, s->x, i);
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
    for (int i = 0; i < n; i++)
        y[i] = side[i] == 0 && outcome == KMP_BOX_FOUND ? 0 : slope_in_box(box, x, i);
    return outcome;
}
