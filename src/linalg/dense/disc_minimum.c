/* SPDX-License-Identifier: BSD-3-Clause */
/* Each disc has a multiplier s >= 0 of |x|^2/2: the minimum in a box with s on the diagonal of D is the minimum in the
 * disc if |x| is its radius, or s = 0 and |x| is less. The reciprocal of |x| is nearly linear in s, and found by false
 * position (as the secular equation of More and Sorensen 1983). One disc after the other is treated so, until none
 * changes: the ascent of the dual function, which is concave. If discs push each other this takes many rounds:
 * Newton's method then finds all multipliers at once. If D is singular on several discs, their x are not
 * unique, and one may push another out of its disc without an end. Then a sequence of regular problems is solved, each
 * near the solution of the last one (Rockafellar 1976). */
#include "linalg/dense/disc_minimum.h"
#include "base/bracket.h"
#include "linalg/dense/factors.h"
#include <math.h>
#include <stdbool.h>
#include <string.h>

enum { LEAST_GROUPED = 4, SWEEPS = 60, MOST_SWEEPS = 1000, MOST_DOUBLINGS = 200, MOST_MOVES = 300, ALONE = 8 };

#define ROUND  4e-15 /* |x| over the radius, less 1, that is rounding */
#define ROUGH  1e-9  /* the same where D is nearly singular, or the minimum of the box keeps to its bound by rounding */
#define FINE   1e-16 /* of a multiplier */
#define NEAR   0.1   /* of the diagonal of D */
#define LEAST  1e-10 /* of the diagonal of D: the first guess of a multiplier */
#define ENOUGH 0.8   /* of the largest error is left by a step of Newton's method that helps */
#define RIDGE  1e-13 /* of the diagonal of D: where it is singular, but for its multipliers */

typedef struct discs {
    const kmp_box *box;
    kmp_box with; /* D with the multipliers */
    const int *partner;
    double *x, *y, *d, *s; /* d: n x n; s: of the first entry of a pair */
    double *a, *last;      /* n: a of the present problem; x of the last one */
    double *rough;         /* n, of the first entry of a pair: |x| over the radius, less 1, at multipliers that
                              differ only by rounding; 0: not above ROUND */
    int *side;
    double *room, *together; /* of a minimum in a box; of Newton's method */
    double near;             /* part of the diagonal of D that keeps x near to `last` */
    kmp_box_outcome outcome;
} discs;

static bool is_disc(const discs *w, int i)
{
    return w->partner[i] > i && w->box->lower[i] < w->box->upper[i];
}

/* |x| of a pair over its radius, less 1. */
static double beyond_disc(const discs *w, int i)
{
    return hypot(w->x[i], w->x[w->partner[i]]) / w->box->upper[i] - 1;
}

/* The diagonal of D of a pair. */
static double own(const discs *w, int i)
{
    return fmax(w->box->d[i + i * w->box->n], w->box->d[w->partner[i] * (w->box->n + 1)]);
}

static void solve_box(discs *w)
{
    if (w->outcome == KMP_BOX_FOUND)
        w->outcome = kmp_box_minimum(&w->with, w->x, w->y, w->side, w->room);
}

static void set_multiplier(discs *w, int i, double s)
{
    int n = w->box->n, j = w->partner[i];
    w->s[i] = s;
    w->d[i + i * n] = w->box->d[i + i * n] + w->near * w->box->d[i + i * n] + s;
    w->d[j + j * n] = w->box->d[j + j * n] + w->near * w->box->d[j + j * n] + s;
}

/* Solves with this multiplier; negative where it is too small. */
static double solve_with(discs *w, int i, double s)
{
    set_multiplier(w, i, s);
    solve_box(w);
    double ratio = 1 + beyond_disc(w, i);
    return ratio > 0 ? 1 / ratio - 1 : 1;
}

static double slope_of_disc(const discs *w, int i)
{
    double sum = w->box->a[i];
    for (int k = 0; k < w->box->n; k++)
        sum += w->box->d[i + k * w->box->n] * w->x[k];
    return sum;
}

/* The multiplier of a pair that lies beyond its circle with the multiplier `low`. */
static void find_multiplier(discs *w, int i, double low, double guess)
{
    double f_low = 1 / (1 + beyond_disc(w, i)) - 1, high = guess, f_high = solve_with(w, i, high), next;
    for (int k = 0; k < MOST_DOUBLINGS && f_high < 0; k++) {
        low = high;
        f_low = f_high;
        high *= 2;
        f_high = solve_with(w, i, high);
    }
    kmp_bracket bracket = kmp_bracket_of(low, f_low, high, f_high);
    while (fabs(beyond_disc(w, i)) > ROUND && w->outcome == KMP_BOX_FOUND &&
           kmp_bracket_next(&bracket, FINE * high, &next)) {
        double f = solve_with(w, i, next);
        kmp_bracket_take(&bracket, next, f, f >= 0);
    }
    const double left = fmax(fabs(bracket.f_near), fabs(bracket.f_far));
    w->rough[i] = fabs(beyond_disc(w, i)) > ROUND && left <= ROUGH ? left : 0;
}

/* Settles one pair with the others as they are. */
static void settle_disc(discs *w, int i)
{
    double last = w->s[i], radius = w->box->upper[i];
    /* Begins inside the disc: where D is singular the minimum that is found depends on the guess. */
    double far = 1 + beyond_disc(w, i);
    for (int k = 0; k < 2 && far > 1; k++)
        w->x[k ? w->partner[i] : i] /= far;
    if (solve_with(w, i, 0) >= -ROUND)
        return;
    double guess = hypot(slope_of_disc(w, i), slope_of_disc(w, w->partner[i])) / radius;
    find_multiplier(w, i, 0, last > 0 ? last : fmax(guess, LEAST * own(w, i)));
}

static bool agree(const discs *w)
{
    bool all = true;
    for (int i = 0; i < w->box->n; i++)
        if (is_disc(w, i))
            all =
                all && (w->s[i] > 0 ? fabs(beyond_disc(w, i)) : beyond_disc(w, i)) <= fmax(4 * ROUND, 2 * w->rough[i]);
    return all;
}

/* The largest distance of x from its circle, where a multiplier puts it there, or beyond; over the radius. */
static double largest_error(const discs *w)
{
    double most = 0;
    for (int i = 0; i < w->box->n; i++)
        if (is_disc(w, i)) {
            const double error = w->s[i] > 0 ? fabs(beyond_disc(w, i)) : fmax(beyond_disc(w, i), 0);
            most = error <= most ? most : error; /* also where it is not a number */
        }
    return most;
}

/* The change of 1/|x| of the discs `on` by their multipliers, count x count: x'Kx / |x|^3, K the inverse of D with
 * the multipliers on the entries inside. False: it is singular. */
static bool find_slopes_of_discs(discs *w, int count, const int *on, double *slope, double *room)
{
    const int n = w->box->n;
    double *factors = w->room, *change = room;
    int *pivot = (int *)(void *)(room + n), *inside = (int *)(void *)(room + 2 * n), many = 0;
    for (int i = 0; i < n; i++)
        if (w->side[i] == 0 && w->box->lower[i] < w->box->upper[i])
            inside[many++] = i;
    for (int k = 0; k < many; k++) {
        for (int l = 0; l < many; l++)
            factors[l + k * many] = w->d[inside[l] + inside[k] * n];
        factors[k + k * many] += RIDGE * w->box->d[inside[k] * (n + 1)];
    }
    if (kmp_lu_factor(many, factors, pivot) != 0)
        return false;
    for (int k = 0; k < count; k++) {
        const int i = on[k], j = w->partner[i];
        for (int l = 0; l < many; l++)
            change[l] = inside[l] == i || inside[l] == j ? w->x[inside[l]] : 0;
        kmp_lu_solve(many, factors, pivot, 1, change);
        for (int m = 0; m < count; m++) {
            const double size = hypot(w->x[on[m]], w->x[w->partner[on[m]]]);
            double sum = 0;
            for (int l = 0; l < many; l++)
                if (inside[l] == on[m] || inside[l] == w->partner[on[m]])
                    sum += w->x[inside[l]] * change[l];
            slope[m + k * count] = sum / (size * size * size);
        }
    }
    return true;
}

/* A step of Newton's method for the multipliers of all discs on or beyond their circle. False: it does not help, and
 * all is as before. */
static bool settle_together(discs *w)
{
    const int n = w->box->n;
    double *room = w->together, *x = room, *s = x + n, *step = s + n, *rest = step + n, *slope = rest + 3 * n;
    int *on = (int *)(void *)(slope + n * n / 4), count = 0;
    const double error = largest_error(w);
    memcpy(x, w->x, (size_t)n * sizeof *x);
    memcpy(s, w->s, (size_t)n * sizeof *s);
    for (int i = 0; i < n; i++) {
        const double beyond = is_disc(w, i) ? beyond_disc(w, i) : -1;
        if (!is_disc(w, i) || !(s[i] > 0 || beyond > ROUND) || !(beyond > -1))
            continue;
        step[count] = (1 - 1 / (1 + beyond)) / w->box->upper[i];
        on[count++] = i;
    }
    int *pivot = (int *)(void *)rest;
    if (!find_slopes_of_discs(w, count, on, slope, rest) || kmp_lu_factor(count, slope, pivot) != 0)
        return false;
    kmp_lu_solve(count, slope, pivot, 1, step);
    for (int k = 0; k < count; k++)
        set_multiplier(w, on[k], fmax(s[on[k]] + step[k], 0));
    solve_box(w);
    const double left = w->outcome == KMP_BOX_FOUND ? largest_error(w) : INFINITY;
    if (left <= error * ENOUGH)
        return true;
    w->outcome = KMP_BOX_FOUND;
    memcpy(w->x, x, (size_t)n * sizeof *x);
    for (int k = 0; k < count; k++)
        set_multiplier(w, on[k], s[on[k]]);
    for (int i = 0; i < n && error <= ROUGH; i++) /* of rounding */
        w->rough[i] = fmax(w->rough[i], error);
    return false;
}

/* Settles all pairs, from multipliers that are near where `near` is given. */
static void sweep(discs *w, int most)
{
    int n = w->box->n;
    const int alone = w->near > 0 ? 0 : ALONE;
    w->outcome = KMP_BOX_FOUND;
    memcpy(w->d, w->box->d, (size_t)(n * n) * sizeof *w->d);
    memset(w->rough, 0, (size_t)n * sizeof *w->rough);
    for (int i = 0; i < n; i++) {
        w->d[i + i * n] += w->near * w->box->d[i + i * n];
        w->a[i] = w->box->a[i] - w->near * w->box->d[i + i * n] * w->last[i];
    }
    for (int i = 0; i < n; i++)
        if (is_disc(w, i))
            set_multiplier(w, i, w->near > 0 ? w->s[i] : 0);
    solve_box(w);
    for (int sweep = 0; w->outcome == KMP_BOX_FOUND && !agree(w); sweep++) {
        bool helps = sweep >= alone && sweep < most;
        while (helps && !agree(w))
            helps = settle_together(w);
        if (helps || agree(w))
            break;
        w->outcome = sweep == most ? KMP_BOX_UNSETTLED : KMP_BOX_FOUND;
        for (int i = 0; i < n; i++)
            if (is_disc(w, i))
                settle_disc(w, i);
    }
}

/* The proximal point iteration: each problem is regular, and begins at the minimum of the last one. */
static void approach(discs *w)
{
    memset(w->last, 0, (size_t)w->box->n * sizeof *w->last);
    memset(w->s, 0, (size_t)w->box->n * sizeof *w->s);
    w->near = NEAR;
    for (int k = 0; k < MOST_MOVES; k++) {
        sweep(w, MOST_SWEEPS);
        if (w->outcome != KMP_BOX_FOUND)
            return;
        double moved = 0, size = 0;
        for (int i = 0; i < w->box->n; i++) {
            moved = fmax(moved, fabs(w->x[i] - w->last[i]));
            size = fmax(size, fabs(w->x[i]));
            w->last[i] = w->x[i];
        }
        if (!(size > 0) || moved / size <= ROUND)
            return;
    }
}

/* Removes rounding of |x| of a pair on its circle. */
static void place_on_circle(const discs *w, int i)
{
    const double far = 1 + beyond_disc(w, i);
    for (int k = 0; k < 2 && w->s[i] > 0 && w->rough[i] > 0; k++)
        w->x[k ? w->partner[i] : i] /= far;
}

/* The minimum of a problem as a whole. */
static kmp_box_outcome minimum_of_one(const kmp_box *box, const int *partner, double *x, double *y, int *side,
                                      double *room)
{
    int n = box->n, count = 0;
    discs w = {.box = box, .partner = partner, .x = x, .y = y, .side = side, .room = room};
    for (int i = 0; i < n; i++)
        count += is_disc(&w, i);
    if (count == 0)
        return kmp_box_minimum(box, x, y, side, room);
    w.d = room + kmp_box_room(n);
    w.s = w.d + n * n;
    w.a = w.s + n;
    w.last = w.a + n;
    w.rough = w.last + n;
    w.together = w.rough + n;
    w.with = *box;
    w.with.d = w.d;
    w.with.a = w.a;
    memset(w.last, 0, (size_t)n * sizeof *w.last);
    sweep(&w, SWEEPS);
    if (w.outcome == KMP_BOX_UNSETTLED)
        approach(&w);
    if (w.outcome == KMP_BOX_FOUND) {
        /* y with only D, and the sides of pairs. */
        for (int i = 0; i < w.box->n; i++)
            if (is_disc(&w, i)) {
                int j = w.partner[i];
                place_on_circle(&w, i);
                bool on = w.s[i] > 0 || beyond_disc(&w, i) >= -ROUND;
                w.side[i] = w.side[j] = on ? 1 : 0;
                w.y[i] = on ? slope_of_disc(&w, i) : 0;
                w.y[j] = on ? slope_of_disc(&w, j) : 0;
            }
    }
    return w.outcome;
}

/* -- groups ------------------------------------------------------------------------------------------------ */

static double *take_numbers(double **room, int count)
{
    double *taken = *room;
    *room += count;
    return taken;
}

static int *take_places(double **room, int count)
{
    return (int *)(void *)take_numbers(room, count);
}

/* Numbers the groups of entries that D or discs connect; returns the size of the largest. `queue`: n. */
static int find_groups(const kmp_box *box, const int *partner, int *group, int *queue, int *count)
{
    const int n = box->n;
    int largest = 0;
    *count = 0;
    for (int i = 0; i < n; i++)
        group[i] = -1;
    for (int first = 0; first < n; first++) {
        int size = 0;
        if (group[first] >= 0)
            continue;
        group[first] = *count;
        queue[size++] = first;
        for (int at = 0; at < size; at++)
            for (int j = 0; j < n; j++)
                if (group[j] < 0 && (box->d[j + queue[at] * n] != 0 || partner[queue[at]] == j)) {
                    group[j] = *count;
                    queue[size++] = j;
                }
        largest = size > largest ? size : largest;
        ++*count;
    }
    return largest;
}

/* Solves the problem of one group of at most `most` entries. */
static kmp_box_outcome minimum_of_group(const kmp_box *box, const int *partner, const int *group, int which, int most,
                                        double *x, double *y, int *side, double *room)
{
    const int n = box->n;
    int *member = take_places(&room, most), *mate = take_places(&room, most), *own_side = take_places(&room, most);
    double *a = take_numbers(&room, most), *lower = take_numbers(&room, most), *upper = take_numbers(&room, most);
    double *own_x = take_numbers(&room, most), *own_y = take_numbers(&room, most);
    double *d = take_numbers(&room, most * most);
    int size = 0;
    for (int i = 0; i < n; i++)
        if (group[i] == which)
            member[size++] = i;
    for (int k = 0; k < size; k++) {
        const int i = member[k];
        a[k] = box->a[i];
        lower[k] = box->lower[i];
        upper[k] = box->upper[i];
        own_x[k] = x[i];
        mate[k] = -1;
        for (int j = 0; j < size; j++) {
            d[k + j * size] = box->d[i + member[j] * n];
            mate[k] = partner[i] == member[j] ? j : mate[k];
        }
    }
    const kmp_box own = {size, d, a, lower, upper};
    const kmp_box_outcome outcome = minimum_of_one(&own, mate, own_x, own_y, own_side, room);
    for (int k = 0; k < size; k++) {
        x[member[k]] = own_x[k];
        y[member[k]] = own_y[k];
        side[member[k]] = own_side[k];
    }
    return outcome;
}

/* Groups that share nothing are solved one after the other: the cost is the sum of their cubes. */
KMP_LOCAL kmp_box_outcome kmp_disc_minimum(const kmp_box *box, const int *partner, double *x, double *y, int *side,
                                           double *room)
{
    const int n = box->n;
    kmp_box_outcome outcome = KMP_BOX_FOUND;
    if (n < LEAST_GROUPED)
        return minimum_of_one(box, partner, x, y, side, room);
    double *rest = room;
    int count, *group = take_places(&rest, n);
    const int most = find_groups(box, partner, group, (int *)(void *)rest, &count);
    if (count == 1)
        return minimum_of_one(box, partner, x, y, side, room);
    for (int which = 0; which < count && outcome == KMP_BOX_FOUND; which++)
        outcome = minimum_of_group(box, partner, group, which, most, x, y, side, rest);
    return outcome;
}
