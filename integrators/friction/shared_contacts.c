/* SPDX-License-Identifier: BSD-3-Clause */
/* Forces f + v with the same accelerations of the contacts, and with v >= 0 of contacts without a force. With D, which
 * has the accelerations of all places by unit forces, the v are null vectors of S D F: F makes the forces of friction
 * that slips from the forces of its contacts, S takes the rows of the others. Combinations N c of these with positive
 * entries or none at contacts without a force span all in which the entry of such a contact is zero, where some y >= 0
 * with y_i = 1 has N'y = 0 (Farkas' lemma). The bodies do not feel v where (F v)' D F v is zero: D = G P G' with the
 * inverse inertia P.
 *
 * Friction at rest is bounded by the forces of its contact. These are N* + Z c >= 0, where Z has the parts of the null
 * vectors at contacts. If contacts stay at rest with two such forces they do so with all between, since discs are
 * convex: so the corners of this set are tried. At a corner from which friction does not hold, the motion is decided
 * with contacts that are compliant by a small part of D and press with these forces. If they move they might as well
 * have moved. */
#include "integrators/friction/shared_contacts.h"
#include "constraints/tolerances.h"
#include "integrators/friction/friction_elements.h"
#include "integrators/friction/friction_problem.h"
#include "linalg/dense/disc_minimum.h"
#include "linalg/dense/factors.h"
#include <math.h>
#include <string.h>

enum { STAYS = -1, FOLLOWS = -2 }; /* in `place` of forces that are not unknown */

enum {
    MOST_CORNERS = 1000,     /* sets of contacts without a force that are tried */
    MOST_PASSES_SHARED = 400 /* of the iteration for bounds of friction */
};

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

/* Of kmp_sharing_room: n^2 + 7 n here, and the rest later. */
KMP_LOCAL kmp_sharing kmp_sharing_begin(int n, double *d, double *room)
{
    kmp_sharing s = {.n = n, .d = d};
    s.place = room_for_indices(&room, n);
    s.base = room_for_indices(&room, n);
    s.of = room_for_indices(&room, n);
    s.ratio = room_for(&room, n);
    s.scale = room_for(&room, n);
    s.presses = (bool *)(void *)room_for(&room, n);
    s.contact = (bool *)(void *)room_for(&room, n);
    s.null = room_for(&room, n * n);
    s.room = room;
    for (int i = 0; i < n; i++) {
        s.place[i] = STAYS;
        s.contact[i] = false;
    }
    return s;
}

static void add_unknown(kmp_sharing *s, int i, bool presses)
{
    const double size = s->d[i + i * s->n];
    if (!(size > 0))
        return;
    s->of[s->count] = i;
    s->scale[s->count] = 1 / sqrt(size);
    s->presses[s->count] = presses;
    s->place[i] = s->count++;
}

KMP_LOCAL void kmp_sharing_contact(kmp_sharing *s, int i, bool presses)
{
    s->contact[i] = true;
    add_unknown(s, i, presses);
}

KMP_LOCAL void kmp_sharing_friction(kmp_sharing *s, int i, int base, double ratio)
{
    s->base[i] = base;
    s->ratio[i] = ratio;
    add_unknown(s, i, false);
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
    s->nulls = find_null(s);
    bool any = false;
    *felt = false;
    for (int k = 0; k < s->nulls; k++) {
        bool contacts = false;
        for (int i = 0; i < s->count; i++)
            contacts = contacts || (x->element[which[s->of[i]]].contact && has_part(s, k, i));
        for (int i = 0; i < s->count && contacts; i++) {
            kmp_friction_element *e = &x->element[which[s->of[i]]];
            e->shares = e->shares || (e->base < 0 && has_part(s, k, i));
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

/* The acceleration of place k; *all: the largest of its parts. */
static double acceleration_of(const kmp_friction_run *x, int k, double *all)
{
    double y = x->a[k];
    *all = fabs(y);
    for (int j = 0; j < x->rest; j++) {
        const double by = x->d[k + j * x->rest] * x->f[j];
        y += by;
        *all = fmax(*all, fabs(by));
    }
    return y;
}

/* The direction of slip, or its component; of slip that begins it follows from the rates that are added, or from its
 * acceleration. Friction of a contact that has opened has no sense any more. */
static double slip_of(const kmp_friction_run *x, int k)
{
    const kmp_friction_element *e = &x->element[x->which[k]];
    double all;
    if (e->twin < 0)
        return e->rubs ? e->rubs : e->sense != 0 ? e->sense : acceleration_of(x, k, &all) < 0 ? -1 : 1;
    if (e->rubs)
        return e->along;
    const double size = hypot(e->ahead, x->element[e->twin].ahead);
    return size > 0 ? e->ahead / size : 0;
}

/* -- slip in place of rest ------------------------------------------------------------------------------ */

/* A search among the forces of contacts that share. */
typedef struct corners {
    kmp_sharing *s;
    const kmp_sharing_state *at;
    double *force;                 /* n: of contacts that are tried */
    double *f, *y, *lower, *upper; /* n: of a decision with these */
    double *bound, *own_a, *own_d; /* n: bounds of friction of the last pass; a and the diagonal of D put aside */
    double *part;                  /* of the null vectors of a group */
    int *side;                     /* n */
    int *group, *member, *null_of, *zero; /* s->count: groups by unknown force; contacts and null vectors of a group;
                                             its contacts without a force */
    double *room;
    double least; /* the least acceleration of slip, scaled */
} corners;

/* Keeps null vectors whose parts at contacts are independent. */
static void keep_independent(kmp_sharing *s)
{
    const int n = s->count, count = s->nulls;
    double *room = s->room, *a = room_for(&room, n * count), *pivots = room_for(&room, n);
    int *r = room_for_indices(&room, n), *c = room_for_indices(&room, n), rank = 0;
    for (int k = 0; k < count; k++)
        for (int i = 0; i < n; i++)
            a[i + k * n] = s->contact[s->of[i]] && has_part(s, k, i) ? s->null[i + k * n] : 0;
    kmp_lu_complete(n, count, a, NULL, r, c, pivots);
    while (rank < count && pivots[rank] > KMP_FRICTION_RANK * pivots[0])
        rank++;
    for (int k = 0; k < rank; k++)
        memcpy(a + k * n, s->null + c[k] * n, (size_t)n * sizeof *a);
    memcpy(s->null, a, (size_t)(n * rank) * sizeof *a);
    s->nulls = rank;
}

static bool is_shared(const kmp_sharing *s, int k, int i)
{
    return s->contact[s->of[i]] && has_part(s, k, i);
}

/* Finds the group of each contact, the number of one of its null vectors; -1: the contact shares no load. */
static void group_contacts(corners *w)
{
    const kmp_sharing *s = w->s;
    for (int i = 0; i < s->count; i++)
        w->group[i] = -1;
    for (int k = 0; k < s->nulls; k++)
        for (int i = 0; i < s->count; i++) {
            const int other = w->group[i];
            for (int j = 0; j < s->count && is_shared(s, k, i); j++)
                if (j == i || (other >= 0 && w->group[j] == other))
                    w->group[j] = k;
        }
}

/* Bounds of friction by forces of contacts. `part`: of the way from the last bounds. */
static void bound_friction(corners *w, const double *force, double part)
{
    const kmp_sharing *s = w->s;
    for (int i = 0; i < s->n; i++) {
        if (s->contact[i])
            continue;
        w->lower[i] = w->upper[i] = w->at->f[i];
        if (s->place[i] != STAYS && s->base[i] >= 0) {
            w->bound[i] += part * (s->ratio[i] * force[s->base[i]] - w->bound[i]);
            w->upper[i] = w->bound[i];
            w->lower[i] = s->place[i] == FOLLOWS ? w->bound[i] : -w->bound[i];
        } else if (s->place[i] != STAYS) {
            w->lower[i] = w->at->lower[i];
            w->upper[i] = w->at->upper[i];
        }
    }
}

static bool find_motion(corners *w)
{
    const kmp_box box = {w->s->n, w->s->d, w->at->a, w->lower, w->upper};
    return kmp_disc_minimum(&box, w->at->partner, w->f, w->y, w->side, w->room) == KMP_BOX_FOUND;
}

/* True if friction at rest has an acceleration. */
static bool slides(const corners *w)
{
    const kmp_sharing *s = w->s;
    for (int i = 0; i < s->n; i++)
        if (s->place[i] >= 0 && !s->contact[i] && s->scale[s->place[i]] * fabs(w->y[i]) > w->least)
            return true;
    return false;
}

/* True if friction holds with these forces of contacts. */
static bool holds_with(corners *w)
{
    const size_t size = (size_t)w->s->n * sizeof *w->f;
    memset(w->bound, 0, size);
    memcpy(w->f, w->at->f, size);
    bound_friction(w, w->force, 1);
    for (int i = 0; i < w->s->n; i++)
        if (w->s->contact[i])
            w->f[i] = w->lower[i] = w->upper[i] = w->force[i];
    return find_motion(w) && !slides(w);
}

/* Decides with contacts that press with these forces where they have no overlap, and are compliant. True: they move, or
 * that does not settle. */
static bool moves_with(corners *w)
{
    const kmp_sharing *s = w->s;
    const size_t size = (size_t)s->n * sizeof *w->f;
    double changed = INFINITY;
    bool found = true;
    memset(w->bound, 0, size);
    memcpy(w->f, w->at->f, size);
    memcpy(w->own_a, w->at->a, size);
    for (int i = 0; i < s->n; i++) {
        w->own_d[i] = s->d[i + i * s->n];
        if (!s->contact[i])
            continue;
        w->f[i] = w->force[i];
        w->lower[i] = s->place[i] >= 0 ? 0 : w->f[i];
        w->upper[i] = s->place[i] >= 0 ? INFINITY : w->f[i];
        s->d[i + i * s->n] += KMP_SHARED_SOFT * w->own_d[i];
        w->at->a[i] -= KMP_SHARED_SOFT * w->own_d[i] * w->force[i];
    }
    for (int pass = 0; pass < MOST_PASSES_SHARED && found && changed > KMP_SHARED_SETTLED; pass++) {
        double most = 0, all = 0;
        memcpy(w->force, w->f, size);
        bound_friction(w, w->force, pass < MOST_PASSES_SHARED / 4 ? 1 : 0.5);
        found = find_motion(w);
        for (int i = 0; i < s->n; i++) {
            most = fmax(most, fabs(w->f[i] - w->force[i]));
            all = fmax(all, fabs(w->f[i]));
        }
        changed = all > 0 ? most / all : 0;
    }
    memcpy(w->at->a, w->own_a, size);
    for (int i = 0; i < s->n; i++)
        s->d[i + i * s->n] = w->own_d[i];
    return !found || changed > KMP_SHARED_SETTLED || slides(w);
}

/* Forces of contacts, none for the contacts `zero`; false: others would pull. */
static bool find_corner(corners *w, int shares, int nulls)
{
    const kmp_sharing *s = w->s;
    double *room = w->room, *a = room_for(&room, nulls * nulls), most = 0;
    int *pivot = room_for_indices(&room, nulls);
    for (int j = 0; j < nulls; j++) {
        const int i = w->member[w->zero[j]];
        w->part[j] = -w->at->f[s->of[i]] / s->scale[i];
        for (int k = 0; k < nulls; k++)
            a[j + k * nulls] = s->null[i + w->null_of[k] * s->count];
    }
    if (kmp_lu_factor(nulls, a, pivot) != 0)
        return false;
    kmp_lu_solve(nulls, a, pivot, 1, w->part);
    memcpy(w->force, w->at->f, (size_t)s->n * sizeof *w->force);
    for (int j = 0; j < shares; j++) {
        const int i = w->member[j];
        for (int k = 0; k < nulls; k++)
            w->force[s->of[i]] += s->scale[i] * w->part[k] * s->null[i + w->null_of[k] * s->count];
        most = fmax(most, fabs(w->force[s->of[i]] / s->scale[i]));
    }
    bool presses = most < INFINITY;
    for (int j = 0; j < shares; j++) {
        const int i = w->member[j];
        presses = presses && w->force[s->of[i]] / s->scale[i] >= -KMP_FRICTION_TIE * most;
        w->force[s->of[i]] = fmax(w->force[s->of[i]], 0);
    }
    return presses;
}

/* The next set of `count` of n numbers in their order; false: it was the last one. */
static bool next_set(int n, int count, int *set)
{
    int k = count - 1;
    while (k >= 0 && set[k] == n - count + k)
        k--;
    if (k < 0)
        return false;
    set[k]++;
    for (int j = k + 1; j < count; j++)
        set[j] = set[j - 1] + 1;
    return true;
}

/* True if a group of contacts might as well move, with the forces of the others as they are. */
static bool moves_group(corners *w, int group)
{
    const kmp_sharing *s = w->s;
    int shares = 0, nulls = 0;
    double sets = 1;
    for (int i = 0; i < s->count; i++)
        if (w->group[i] == group)
            w->member[shares++] = i;
    for (int k = 0; k < s->nulls; k++) {
        bool among = false;
        for (int j = 0; j < shares; j++)
            among = among || is_shared(s, k, w->member[j]);
        if (among)
            w->null_of[nulls++] = k;
    }
    for (int k = 0; k < nulls; k++) {
        w->zero[k] = k;
        sets *= (double)(shares - k) / (k + 1);
    }
    long number = 0;
    const long every = (long)ceil(fmin(sets / MOST_CORNERS, 1e9));
    do {
        if (number++ % every == 0 && find_corner(w, shares, nulls) && !holds_with(w) && find_corner(w, shares, nulls) &&
            moves_with(w))
            return true;
    } while (next_set(shares, nulls, w->zero));
    return false;
}

KMP_LOCAL bool kmp_sharing_may_move(kmp_sharing *s, const kmp_sharing_state *at)
{
    const int n = s->n;
    double *room = s->room, size = 0;
    bool bounded = false, moves = false;
    for (int i = 0; i < n; i++)
        bounded = bounded || (s->place[i] >= 0 && !s->contact[i] && s->base[i] >= 0);
    if (!bounded || s->nulls == 0)
        return false;
    keep_independent(s);
    corners w = {.s = s, .at = at};
    double **const arrays[] = {&w.force, &w.f, &w.y, &w.lower, &w.upper, &w.bound, &w.own_a, &w.own_d, &w.part};
    int **const indices[] = {&w.side, &w.group, &w.member, &w.null_of, &w.zero};
    for (size_t k = 0; k < sizeof arrays / sizeof *arrays; k++)
        *arrays[k] = room_for(&room, n);
    for (size_t k = 0; k < sizeof indices / sizeof *indices; k++)
        *indices[k] = room_for_indices(&room, n);
    w.room = room;
    for (int i = 0; i < n; i++)
        size += s->d[i + i * n] > 0 ? at->a[i] * at->a[i] / s->d[i + i * n] : 0;
    w.least = KMP_SHARED_SLIDES * sqrt(size);
    group_contacts(&w);
    for (int k = 0; k < s->nulls && !moves; k++) {
        bool is_group = false;
        for (int i = 0; i < s->count; i++)
            is_group = is_group || w.group[i] == k;
        moves = is_group && moves_group(&w, k);
    }
    return moves;
}

KMP_LOCAL void kmp_sharing_report(kmp_friction_run *x, kmp_friction_fact fact, double t, bool felt)
{
    if (felt ? x->past.felt : x->past.shared)
        return;
    x->past.shared = true;
    x->past.felt = felt;
    kmp_friction_report(x, fact, -1, t, felt);
}

/* True for a contact that leaves its surface. */
static bool leaves(const kmp_friction_run *x, int k)
{
    const kmp_friction_element *e = &x->element[x->which[k]];
    double all;
    const double y = acceleration_of(x, k, &all);
    return e->broken && y > fmax(e->still, KMP_FRICTION_ROUNDING * all);
}

/* True for friction of a joint that slips with a level by a load. */
static bool slips_by_load(const kmp_friction_element *e)
{
    return e->base < 0 && e->loaded && e->stance == KMP_FRICTION_SLIPS && e->sense != 0;
}

/* Measures with the forces of elements, and a part of a null vector. */
static int measure_along(kmp_friction_run *x, const kmp_sharing *s, int k, double part, double t, const double *q,
                         const double *qd)
{
    for (int i = 0; i < s->n; i++) {
        const int place = s->place[i] == FOLLOWS ? s->place[s->base[i]] : s->place[i];
        const double way = place >= 0 ? s->scale[place] * s->null[place + k * s->count] : 0;
        const double force = x->f[i] + part * (s->place[i] == FOLLOWS ? s->ratio[i] * way : way);
        kmp_friction_put(x, &x->element[x->which[i]], KMP_ROLE_GIVEN, force);
    }
    return kmp_friction_measure(x, t, q, qd);
}

/* *changes: the level of friction that slips by a load depends on how contacts share. */
static int find_changed_levels(kmp_friction_run *x, const kmp_sharing *s, double t, const double *q, const double *qd,
                               bool *changes)
{
    double size = 0;
    bool any = false;
    *changes = false;
    for (int i = 0; i < x->count; i++)
        any = any || slips_by_load(&x->element[i]);
    for (int i = 0; i < s->count; i++)
        size = fmax(size, fabs(x->f[s->of[i]]) / s->scale[i]);
    for (int k = 0; any && k < s->nulls && !*changes; k++) {
        double most = 0;
        for (int i = 0; i < s->count; i++)
            most = fmax(most, fabs(s->null[i + k * s->count]));
        KMP_FRICTION_TRY(measure_along(x, s, k, 0, t, q, qd));
        for (int i = 0; i < x->count; i++)
            x->aside[i] = kmp_friction_level_at(x, &x->element[i], KMP_ROLE_LEVEL, x->element[i].sense);
        KMP_FRICTION_TRY(measure_along(x, s, k, KMP_FRICTION_UNIT * size / most, t, q, qd));
        for (int i = 0; i < x->count; i++) {
            const kmp_friction_element *e = &x->element[i];
            const double change = kmp_friction_level_at(x, e, KMP_ROLE_LEVEL, e->sense) - x->aside[i];
            *changes = *changes ||
                       (slips_by_load(e) && fabs(change) > KMP_SHARED_UNFELT * KMP_FRICTION_UNIT * fabs(x->aside[i]));
        }
    }
    return 0;
}

KMP_LOCAL int kmp_friction_find_present(kmp_friction_run *x, double t, const double *q, const double *qd)
{
    bool felt, changes = false;
    kmp_sharing s = kmp_sharing_begin(x->rest, x->d, x->room);
    for (int k = 0; k < x->rest; k++) {
        const kmp_friction_element *e = &x->element[x->which[k]];
        const int base = e->base >= 0 ? kmp_sharing_number(e->base, x->rest, x->which) : -1;
        x->lower[k] = -kmp_friction_bound(x, e, 1);
        x->upper[k] = kmp_friction_bound(x, e, -1);
        const bool alone = !e->contact && base < 0; /* friction of a joint: it shares what it can carry */
        if (e->implied || (e->contact && leaves(x, k)) || (alone && (e->broken || x->upper[k] - x->lower[k] <= 0)))
            continue;
        if (e->contact)
            kmp_sharing_contact(&s, k, !is_pressed(x, k));
        else if (e->broken)
            kmp_sharing_follow(&s, k, base, kmp_sharing_ratio(x, e, slip_of(x, k)));
        else
            kmp_sharing_friction(&s, k, base, base < 0 ? 0 : kmp_sharing_ratio(x, e, -1));
    }
    const kmp_sharing_state at = {x->a, x->f, x->partner, x->lower, x->upper};
    if (!kmp_sharing_mark(&s, x, x->which, &felt))
        return 0;
    if (q && !felt)
        KMP_FRICTION_TRY(find_changed_levels(x, &s, t, q, qd, &changes));
    kmp_sharing_report(x, KMP_FRICTION_FACT_SHARED, t, felt || changes || kmp_sharing_may_move(&s, &at));
    return 0;
}

KMP_LOCAL bool kmp_sharing_is_felt_by(const kmp_friction_element *e)
{
    return e->base >= 0 || slips_by_load(e);
}

KMP_LOCAL bool kmp_sharing_is_carried(const kmp_friction_element *e)
{
    return e->beside || (e->base < 0 && e->stance == KMP_FRICTION_CARRIED);
}

KMP_LOCAL void kmp_friction_find_shared(kmp_friction_run *x, double t)
{
    bool more = false, rubs = false;
    for (int k = 0; k < x->rest; k++) {
        kmp_friction_element *e = &x->element[x->which[k]];
        e->beside = e->contact && e->broken && !leaves(x, k);
        more = more || kmp_sharing_is_carried(e);
        rubs = rubs || e->base >= 0;
    }
    if (more && !x->past.felt && (rubs || !x->past.shared))
        (void)kmp_friction_find_present(x, t, NULL, NULL);
}
