/* SPDX-License-Identifier: BSD-3-Clause */
/* Forces f + v with the same accelerations of the contacts, and with v >= 0 of contacts without a force. With D, which
 * has the accelerations of all places by unit forces, the v are null vectors of S D F: F makes the forces of friction
 * that slips from the forces of its contacts, S takes the rows of the others. Combinations N c of these with positive
 * entries or none at contacts without a force span all in which the entry of such a contact is zero, where some y >= 0
 * with y_i = 1 has N'y = 0 (Farkas' lemma). The bodies do not feel v where (F v)' D F v is zero: D = G P G' with the
 * inverse inertia P. */
#include "integrators/friction/shared_contacts.h"
#include "constraints/tolerances.h"
#include "integrators/friction/friction_elements.h"
#include "integrators/friction/friction_problem.h"
#include "linalg/dense/factors.h"
#include <math.h>
#include <string.h>

enum { STAYS = -1, FOLLOWS = -2 }; /* in `place` of forces that are not unknown */

static int *room_for_indices(double **room, int n)
{
    int *taken = (int *)(void *)*room;
    *room += n;
    return taken;
}

static double *room_for(double **room, int n)
{
    double *taken = *room;
    *room += n;
    return taken;
}

/* Of the 3 n^2 + 17 n numbers: n^2 + 6 n here, and at most 2 n^2 + 10 n later (list_idle). */
KMP_LOCAL kmp_sharing kmp_sharing_begin(int n, const double *d, double *room)
{
    kmp_sharing s = {.n = n, .d = d};
    s.place = room_for_indices(&room, n);
    s.base = room_for_indices(&room, n);
    s.of = room_for_indices(&room, n);
    s.ratio = room_for(&room, n);
    s.scale = room_for(&room, n);
    s.presses = (bool *)(void *)room_for(&room, n);
    s.null = room_for(&room, n * n);
    s.room = room;
    for (int i = 0; i < n; i++)
        s.place[i] = STAYS;
    return s;
}

KMP_LOCAL void kmp_sharing_add(kmp_sharing *s, int i, bool presses)
{
    const double size = s->d[i + i * s->n];
    if (!(size > 0))
        return;
    s->of[s->count] = i;
    s->scale[s->count] = 1 / sqrt(size);
    s->presses[s->count] = presses;
    s->place[i] = s->count++;
}

KMP_LOCAL void kmp_sharing_follow(kmp_sharing *s, int i, int base, double ratio)
{
    s->place[i] = FOLLOWS;
    s->base[i] = base;
    s->ratio[i] = ratio;
}

/* The acceleration of place i by the unknown force j and all that follow it. */
static double entry(const kmp_sharing *s, int i, int j)
{
    double sum = s->d[i + s->of[j] * s->n];
    for (int k = 0; k < s->n; k++)
        if (s->place[k] == FOLLOWS && s->base[k] == s->of[j])
            sum += s->ratio[k] * s->d[i + k * s->n];
    return sum;
}

/* Null vectors of an m x n matrix, which is overwritten, by columns of n; their number. Room for m + 2 n. */
static int null_vectors(int m, int n, double *a, double *room, double *x)
{
    int *r = room_for_indices(&room, m), *c = room_for_indices(&room, n), rank = 0;
    double *pivots = room_for(&room, m < n ? m : n);
    kmp_lu_complete(m, n, a, NULL, r, c, pivots);
    while (rank < m && rank < n && pivots[rank] > KMP_SHARED_RANK * pivots[0])
        rank++;
    for (int k = rank; k < n; k++)
        kmp_lu_null_vector(m, n, a, c, rank, k, x + (k - rank) * n);
    return n - rank;
}

/* Lists the contacts without a force that can take none: some y >= 0 with y = 1 at its own entry has N'y = 0. Room for
 * 2 n^2 + 10 n. */
static int list_idle(kmp_sharing *s, int count)
{
    const int n = s->count;
    double *room = s->room, *q = room_for(&room, n * n), *y = room_for(&room, n), *slope = room_for(&room, n),
           *least = room_for(&room, n), *far = room_for(&room, n), *none = room_for(&room, n);
    int *side = room_for_indices(&room, n), m = 0, idle = 0;
    for (int i = 0; i < n; i++)
        m += s->presses[i];
    for (int i = 0, row = 0; i < n; i++) {
        for (int j = 0, column = 0; s->presses[i] && j < n; j++) {
            if (!s->presses[j])
                continue;
            double sum = 0;
            for (int k = 0; k < count; k++)
                sum += s->null[i + k * n] * s->null[j + k * n];
            q[row + m * column++] = sum;
        }
        row += s->presses[i];
    }
    for (int i = 0; i < m; i++) {
        least[i] = none[i] = 0;
        far[i] = INFINITY;
    }
    for (int i = 0, row = 0; i < n; i++) {
        if (!s->presses[i])
            continue;
        double open = 0, size = 0;
        memcpy(y, least, (size_t)m * sizeof *y);
        y[row] = least[row] = far[row] = 1;
        const kmp_box box = {m, q, none, least, far};
        const bool found = kmp_box_minimum(&box, y, slope, side, room) == KMP_BOX_FOUND;
        for (int j = 0; j < m; j++) {
            open += y[j] * slope[j];
            size += y[j] * y[j] * q[j + m * j];
        }
        s->presses[i] = found && open <= KMP_SHARED_ROUNDING * size;
        idle += s->presses[i];
        least[row] = 0;
        far[row++] = INFINITY;
    }
    return idle;
}

/* Leaves the combinations of the null vectors in which the `idle` contacts have no part; their number. */
static int keep_others(kmp_sharing *s, int count, int idle)
{
    const int n = s->count;
    double *rows = s->room, *part = rows + idle * count, *whole = part + count * count, *room = whole + count;
    for (int i = 0, row = 0; i < n; i++) {
        for (int k = 0; s->presses[i] && k < count; k++)
            rows[row + k * idle] = s->null[i + k * n];
        row += s->presses[i];
    }
    const int left = null_vectors(idle, count, rows, room, part);
    for (int i = 0; i < n; i++) {
        for (int k = 0; k < left; k++) {
            whole[k] = 0;
            for (int j = 0; j < count; j++)
                whole[k] += part[j + k * count] * s->null[i + j * n];
        }
        for (int k = 0; k < left; k++)
            s->null[i + k * n] = whole[k];
    }
    return left;
}

/* Null vectors of the forces that are unknown, as far as contacts without a force allow them; their number. */
static int find_null(kmp_sharing *s)
{
    const int n = s->count;
    double *a = s->room;
    for (int j = 0; j < n; j++)
        for (int i = 0; i < n; i++)
            a[i + j * n] = s->scale[i] * entry(s, s->of[i], j) * s->scale[j];
    const int count = n > 0 ? null_vectors(n, n, a, a + n * n, s->null) : 0;
    const int idle = count > 0 ? list_idle(s, count) : 0;
    return idle > 0 ? keep_others(s, count, idle) : count;
}

/* True if the bodies feel a null vector. */
static bool is_felt(const kmp_sharing *s, const double *vector)
{
    double *v = s->room, square = 0, size = 0;
    for (int i = 0; i < s->n; i++)
        v[i] = s->place[i] >= 0 ? s->scale[s->place[i]] * vector[s->place[i]] : 0;
    for (int i = 0; i < s->n; i++)
        if (s->place[i] == FOLLOWS)
            v[i] = s->place[s->base[i]] >= 0 ? s->ratio[i] * v[s->base[i]] : 0;
    for (int i = 0; i < s->n; i++) {
        for (int j = 0; j < s->n; j++)
            square += v[i] * s->d[i + j * s->n] * v[j];
        size += v[i] * s->d[i + i * s->n] * v[i];
    }
    return square > KMP_SHARED_ROUNDING * size;
}

/* True if null vector k has a part at unknown force i. */
static bool has_part(const kmp_sharing *s, int k, int i)
{
    double most = 0;
    for (int j = 0; j < s->count; j++)
        most = fmax(most, fabs(s->null[j + k * s->count]));
    return fabs(s->null[i + k * s->count]) > KMP_FRICTION_RANK * most;
}

KMP_LOCAL bool kmp_sharing_mark(kmp_sharing *s, kmp_friction_run *x, const int *which, bool *felt)
{
    for (int i = 0; i < x->count; i++)
        x->element[i].shares = false;
    const int count = find_null(s);
    bool any = false;
    *felt = false;
    for (int k = 0; k < count; k++) {
        bool contacts = false;
        for (int i = 0; i < s->count; i++) {
            kmp_friction_element *e = &x->element[which[s->of[i]]];
            if (e->contact && has_part(s, k, i))
                e->shares = contacts = true;
        }
        *felt = *felt || (contacts && is_felt(s, s->null + k * s->count));
        any = any || contacts;
    }
    return any;
}

KMP_LOCAL int kmp_sharing_number(int element, int count, const int *which)
{
    int k = 0;
    while (k < count && which[k] != element)
        k++;
    return k < count ? k : -1;
}

KMP_LOCAL double kmp_sharing_ratio(const kmp_friction_run *x, const kmp_friction_element *e, double slip)
{
    return -slip * kmp_friction_at(x, &x->element[e->base], KMP_ROLE_STATIC);
}

/* True for a contact whose force is more than rounding. */
static bool is_pressed(const kmp_friction_run *x, int k)
{
    const kmp_friction_element *e = &x->element[x->which[k]];
    return e->contact && x->f[k] * x->d[k + k * x->rest] > e->still;
}

/* The direction of slip, or its component; of slip that begins it follows from the rates that are added. */
static double slip_of(const kmp_friction_run *x, const kmp_friction_element *e)
{
    if (e->twin < 0 || e->rubs)
        return e->twin < 0 ? e->sense : e->along;
    const double size = hypot(e->ahead, x->element[e->twin].ahead);
    return size > 0 ? e->ahead / size : 0;
}

/* -- slip in place of rest ------------------------------------------------------------------------------ */

/* Slip of all elements of contacts that rest: its unknowns are the forces of `contacts` contacts, by number `of`, then
 * the accelerations of slip of `slips` elements, or pairs of components. */
typedef struct sliding {
    const kmp_friction_run *x;
    int contacts, slips, *of;
    double *way; /* of each element: the direction of slip, or its component; 0: it does not slip */
} sliding;

/* The acceleration of place i by the force of contact j and its friction in slip. */
static double slid_by(const sliding *s, int i, int j)
{
    const kmp_friction_run *x = s->x;
    const double ratio = kmp_friction_at(x, &x->element[x->which[j]], KMP_ROLE_STATIC);
    double sum = x->d[i + j * x->rest];
    for (int k = 0; k < x->rest; k++)
        if (s->way[k] != 0 && x->element[x->which[k]].base == x->which[j])
            sum -= ratio * s->way[k] * x->d[i + k * x->rest];
    return sum;
}

/* The same along the direction of slip of element i and its other component; of contact i by itself. */
static double slid_along(const sliding *s, int i, int j)
{
    const int other = s->x->partner[i];
    if (s->x->element[s->x->which[i]].contact)
        return slid_by(s, i, j);
    return s->way[i] * slid_by(s, i, j) + (other < 0 ? 0 : s->way[other] * slid_by(s, other, j));
}

/* Accelerations where friction of contacts has no force; accelerations of slip give its directions. False: no contact
 * slides.
 */
static bool find_ways(sliding *s, double *y, double *room)
{
    const kmp_friction_run *x = s->x;
    const int n = x->rest;
    double *f = room_for(&room, n), *lower = room_for(&room, n), *upper = room_for(&room, n);
    int *side = room_for_indices(&room, n);
    bool any = false;
    for (int k = 0; k < n; k++) {
        const kmp_friction_element *e = &x->element[x->which[k]];
        const bool free = e->contact && !e->broken && !e->implied;
        f[k] = lower[k] = upper[k] = e->base >= 0 || free ? 0 : x->f[k];
        upper[k] = free ? INFINITY : upper[k];
    }
    const kmp_box box = {n, x->d, x->a, lower, upper};
    if (kmp_box_minimum(&box, f, y, side, room) != KMP_BOX_FOUND)
        return false;
    for (int k = 0; k < n; k++) {
        const kmp_friction_element *e = &x->element[x->which[k]];
        const int other = x->partner[k];
        const double size = other < 0 ? fabs(y[k]) : hypot(y[k], y[other]);
        const bool slides = e->base >= 0 && !e->broken && !e->implied && size > kmp_friction_rounding(x, k);
        s->way[k] = slides ? y[k] / size : 0;
        any = any || slides;
    }
    return any;
}

/* True if contacts that rest could as well slip, with other forces of theirs: all in the direction in which they would
 * slide without friction, the contacts closed. The forces N >= 0 and accelerations s > 0 with A N + a = (0, s) exist
 * where least squares leave nothing. */
static bool may_slide(const kmp_friction_run *x)
{
    const int n = x->rest;
    double *room = x->room, least = INFINITY, most = 0, open = 0, size = 0;
    sliding s = {.x = x, .of = room_for_indices(&room, n), .way = room_for(&room, n)};
    double *y = room_for(&room, n), *right = room_for(&room, n);
    for (int k = 0; k < n; k++) {
        const kmp_friction_element *e = &x->element[x->which[k]];
        const double ratio = e->contact ? kmp_friction_at(x, e, KMP_ROLE_STATIC) : 0;
        if (!e->contact || e->broken || e->implied)
            continue;
        least = fmin(least, ratio);
        most = fmax(most, ratio);
        s.of[s.contacts++] = k;
    }
    if (!(least < (1 - KMP_FRICTION_TIE) * most) || !find_ways(&s, y, room))
        return false; /* equal coefficients have one bound of all */
    for (int k = 0; k < n; k++)
        if (s.way[k] != 0 && (x->partner[k] < 0 || x->partner[k] > k || s.way[x->partner[k]] == 0))
            s.of[s.contacts + s.slips++] = k;
    const int m = s.contacts + s.slips;
    double *a = room_for(&room, m * m), *q = room_for(&room, m * m), *z = room_for(&room, m),
           *slope = room_for(&room, m), *linear = room_for(&room, m), *lower = room_for(&room, m),
           *far = room_for(&room, m);
    int *side = room_for_indices(&room, m);
    for (int i = 0; i < m; i++) {
        const int k = s.of[i], other = x->partner[k];
        const double scale = 1 / sqrt(x->d[k + k * n]);
        right[i] = x->a[k];
        for (int j = 0; j < n; j++) /* joints that are held */
            if (x->element[x->which[j]].base < 0 && !x->element[x->which[j]].contact)
                right[i] += x->d[k + j * n] * x->f[j];
        right[i] *= i < s.contacts ? scale : scale * s.way[k];
        if (i >= s.contacts && other >= 0)
            right[i] += scale * s.way[other] * x->a[other];
        for (int j = 0; j < m; j++)
            a[i + j * m] =
                j < s.contacts ? scale * slid_along(&s, k, s.of[j]) / sqrt(x->d[s.of[j] * (n + 1)]) : -(i == j);
        size += right[i] * right[i];
    }
    for (int j = 0; j < m; j++) {
        linear[j] = 0;
        for (int i = 0; i < m; i++) {
            linear[j] += a[i + j * m] * right[i];
            q[i + j * m] = 0;
            for (int k = 0; k < m; k++)
                q[i + j * m] += a[k + i * m] * a[k + j * m];
        }
        z[j] = lower[j] = j < s.contacts ? 0 : KMP_SHARED_SLIDES * sqrt(size);
        far[j] = INFINITY;
    }
    const kmp_box box = {m, q, linear, lower, far};
    if (kmp_box_minimum(&box, z, slope, side, room) != KMP_BOX_FOUND)
        return false;
    for (int i = 0; i < m; i++) {
        double left = right[i];
        for (int j = 0; j < m; j++)
            left += a[i + j * m] * z[j];
        open += left * left;
    }
    return open <= KMP_SHARED_ROUNDING * size;
}

KMP_LOCAL void kmp_sharing_report(kmp_friction_run *x, kmp_friction_fact fact, double t, bool felt)
{
    if (felt ? x->past.felt : x->past.shared)
        return;
    x->past.shared = true;
    x->past.felt = felt;
    kmp_friction_report(x, fact, -1, t, felt);
}

KMP_LOCAL void kmp_friction_find_shared(kmp_friction_run *x, double t)
{
    bool carried = false, rubs = false, felt;
    for (int k = 0; k < x->rest; k++) {
        const kmp_friction_element *e = &x->element[x->which[k]];
        carried = carried || (e->contact && e->stance == KMP_FRICTION_CARRIED);
        rubs = rubs || e->base >= 0;
    }
    if (!carried || x->past.felt || (x->past.shared && !rubs))
        return;
    kmp_sharing s = kmp_sharing_begin(x->rest, x->d, x->room);
    for (int k = 0; k < x->rest; k++) {
        const kmp_friction_element *e = &x->element[x->which[k]];
        const int base = e->base >= 0 ? kmp_sharing_number(e->base, x->rest, x->which) : -1;
        if (e->implied || (e->broken && base < 0))
            continue;
        if (e->broken)
            kmp_sharing_follow(&s, k, base, kmp_sharing_ratio(x, e, slip_of(x, e)));
        else
            kmp_sharing_add(&s, k, e->contact && !is_pressed(x, k));
    }
    if (kmp_sharing_mark(&s, x, x->which, &felt))
        kmp_sharing_report(x, KMP_FRICTION_FACT_SHARED, t, felt || (rubs && may_slide(x)));
}
