/* SPDX-License-Identifier: BSD-3-Clause */
#include "analysis/sweep.h"
#include "analysis/sweep_point.h"
#include "base/bracket.h"
#include "base/context.h"
#include "base/memory.h"
#include "constraints/tolerances.h"
#include <math.h>
#include <string.h>

/* A step: the first one, the longest (of any coordinate, scaled; of s when the time leads), the shortest. */
#define FIRST_STEP 0.02
#define LONGEST    0.35
#define LONGEST_S  0.02
#define SHORTEST   1e-9
#define MOST_STEPS 1000000
/* It is kept when tangents turn by less than about 0.3, the first correction is below this part of it, and each
 * correction is below this part of the one before. */
#define LEAST_COSINE 0.955
#define MOST_OFF     0.2
#define CONTRACTION  0.3
/* Near a change point no step is longer than this part of how far it seems to be; at a margin below EXACT, or a change
 * of sign that steps of SHORT cannot resolve, the point counts as one where branches meet, and is crossed straight on
 * from where the margin was above ENTRY. */
#define APPROACH 0.5
#define NEAR     0.3
#define EXACT    1e-6
#define ENTRY    1e-3
#define SHORT    1e-7
/* Of leading rows, relative. */
#define FOLLOWS 1e-6
/* Where s is slower, in the motion, than this part of the fastest, a row is found by enclosing it, not by Newton on s.
 */
#define SLOW 0.05

/* Times at which it is seen what moves. */
enum { EPSILONS = 64, MOST_LEAPS = 6, SAMPLES = 7 };
#define EPSILON 2.220446049250313e-16

/* -- making and standing ----------------------------------------------------------------------------- */

static void pose_copy(const kmp_sweep *w, const kmp_pose *from, kmp_pose *to)
{
    to->s = from->s;
    to->ds = from->ds;
    memcpy(to->q, from->q, (size_t)w->n * sizeof *to->q);
    memcpy(to->dq, from->dq, (size_t)w->n * sizeof *to->dq);
}

static void poses_swap(kmp_pose *a, kmp_pose *b)
{
    kmp_pose c = *a;
    *a = *b;
    *b = c;
}

static bool make_room(kmp_sweep *w)
{
    int n = w->n, m = w->system->m;
    kmp_pose *poses[] = {&w->here, &w->next, &w->part_way, &w->entry};
    double **vectors[] = {&w->dx, &w->normal, &w->qs, &w->qss, &w->x, &w->unit}, **rows[] = {&w->h, &w->h_t, &w->jd};
    for (size_t k = 0; k < sizeof poses / sizeof *poses; k++)
        *poses[k] = (kmp_pose){.q = KMP_ARENA_NEW(&w->arena, double, n), .dq = KMP_ARENA_NEW(&w->arena, double, n)};
    for (size_t k = 0; k < sizeof vectors / sizeof *vectors; k++)
        *vectors[k] = KMP_ARENA_NEW(&w->arena, double, n + 1);
    for (size_t k = 0; k < sizeof rows / sizeof *rows; k++)
        *rows[k] = KMP_ARENA_NEW(&w->arena, double, m);
    w->jacobian = KMP_ARENA_NEW(&w->arena, double, w->system->jacobian.count);
    w->dropped = KMP_ARENA_NEW(&w->arena, bool, m);
    w->moving = KMP_ARENA_NEW(&w->arena, int, m);
    return !w->arena.failed;
}

kempe_status kmp_sweep_init(kmp_sweep *sweep, const kempe_system *system, const char *backend, const bool *closures)
{
    *sweep = (kmp_sweep){.system = system, .n = system->n, .time = -1, .size = 1};
    sweep->plant = kmp_plant_new(system, backend);
    if (!sweep->plant)
        return KEMPE_E_MEMORY;
    if (!make_room(sweep)) {
        kmp_sweep_free(sweep);
        return kmp_fail_memory(system->context);
    }
    for (int r = 0; closures && r < system->m; r++) {
        sweep->dropped[r] = closures[system->rows[r].closure];
        sweep->any_dropped = sweep->any_dropped || sweep->dropped[r];
    }
    return KEMPE_OK;
}

static void forget_choice(kmp_sweep *w)
{
    if (w->reduced)
        kmp_reduction_free(&w->red);
    kmp_partition_free(&w->part);
    kmp_arena_free(&w->of_choice);
    w->reduced = false;
}

/* Room for so many other leads. */
static bool renew_leads(kmp_sweep *w, int count, const kmp_lead *leads)
{
    int p = w->p;
    kmp_arena *arena = &w->of_leads;
    kmp_arena_free(arena);
    w->count = count;
    w->time = -1;
    w->lead = KMP_ARENA_NEW(arena, kmp_lead, count);
    w->ahead = KMP_ARENA_NEW(arena, double, count);
    w->matrix = KMP_ARENA_NEW(arena, double, (p + 1) * (p + 1));
    w->rhs = KMP_ARENA_NEW(arena, double, p + 1);
    w->pivots = KMP_ARENA_NEW(arena, double, p + 1);
    w->order = KMP_ARENA_NEW(arena, int, 2 * (p + 1));
    if (arena->failed)
        return false;
    memcpy(w->lead, leads, (size_t)count * sizeof *leads);
    return true;
}

void kmp_sweep_free(kmp_sweep *sweep)
{
    forget_choice(sweep);
    if (sweep->watched)
        kmp_margin_free(&sweep->margin);
    kmp_arena_free(&sweep->of_leads);
    kmp_arena_free(&sweep->arena);
    kmp_plant_free(sweep->plant);
    *sweep = (kmp_sweep){0};
}

/* u, v and rows at the plant's last closure; rank -1: by the pivots. */
static kempe_status choose(kmp_sweep *w, int rank)
{
    forget_choice(w);
    kempe_status status = kmp_partition_of_rank(&w->part, w->system, w->plant->jacobian, rank, NULL, 0);
    if (status != KEMPE_OK)
        return status;
    if (w->watched && !kmp_margin_choose(&w->margin, &w->part))
        return kmp_fail_memory(w->system->context);
    status = kmp_reduction_init(&w->red, w->plant, &w->part);
    if (status != KEMPE_OK)
        return status;
    w->reduced = true;
    w->block_count = w->red.block ? kmp_block_count(w->red.block) : 0;
    w->signs = KMP_ARENA_NEW(&w->of_choice, int, w->block_count);
    w->signs_after = KMP_ARENA_NEW(&w->of_choice, int, w->block_count);
    return w->of_choice.failed ? kmp_fail_memory(w->system->context) : KEMPE_OK;
}

kempe_status kmp_sweep_stand(kmp_sweep *w, double t, const double *q)
{
    if (!renew_leads(w, 1, &(kmp_lead){-1, t, t}))
        return kmp_fail_memory(w->system->context);
    w->time = 0;
    memcpy(w->here.q, q, (size_t)w->n * sizeof *q);
    w->here.s = 0;
    if (w->watched)
        kmp_margin_free(&w->margin);
    w->watched = false;
    (void)kmp_sweep_evaluate(w, 0, q); /* the closure; nothing is chosen yet */
    kempe_status status = choose(w, -1);
    if (status != KEMPE_OK)
        return status;
    w->p = w->part.p;
    w->watched = true;
    if (!kmp_margin_init(&w->margin, w->system, &w->part))
        return kmp_fail_memory(w->system->context);
    if (w->any_dropped)
        w->margin.near = w->part.r > 0 && w->part.pivots[w->part.r - 1] < EXACT * w->part.pivots[0];
    else if (!kmp_margin_begin(&w->margin, w->plant, t, q))
        return kmp_fail_memory(w->system->context);
    (void)kmp_sweep_evaluate(w, 0, q);
    if (w->margin.near)
        return kmp_fail(w->system->context, KEMPE_E_FAILED,
                        "the start is near a change point, where branches meet (last pivot of J %.1e of its usual "
                        "size): which way to go is not determined there; begin at another position ('start:')",
                        w->margin.last / w->margin.usual);
    return KEMPE_OK;
}

/* Rows with h_t at some time on the way, which is zero in all others; dropped here. */
static void find_moving(kmp_sweep *w, const kmp_lead *time, const double *q)
{
    w->moving_count = 0;
    for (int k = 0; k <= SAMPLES; k++) {
        kmp_plant_closure(w->plant, kmp_lead_value(time, (double)k / SAMPLES), q);
        for (int r = 0; w->plant->h_t && r < w->system->m; r++)
            if (w->plant->h_t[r] != 0 && !w->dropped[r]) {
                w->dropped[r] = w->any_dropped = true;
                w->moving[w->moving_count++] = r;
            }
    }
}

kempe_status kmp_sweep_stand_moving(kmp_sweep *w, const kmp_lead *time, double t, const double *q)
{
    kempe_status status = kmp_sweep_stand(w, t, q);
    int p = w->p;
    if (status != KEMPE_OK)
        return status;
    find_moving(w, time, q);
    if (w->moving_count > 0)
        status = kmp_sweep_stand(w, t, q);
    if (status == KEMPE_E_MEMORY || (status == KEMPE_OK && w->p == p + w->moving_count))
        return status;
    for (int k = 0; k < w->moving_count; k++) /* some say what others say: they stay closures */
        w->dropped[w->moving[k]] = false;
    w->moving_count = 0;
    return kmp_sweep_stand(w, t, q);
}

/* -- what may lead ----------------------------------------------------------------------------------- */

/* What is left of a row across `count` orthonormal ones, twice for the sake of rounding; its length. */
static double across(int p, const double *basis, int count, double *row)
{
    double square = 0;
    for (int k = 0; k < 2 * count; k++) {
        const double *b = basis + k % count * p;
        double along = 0;
        for (int j = 0; j < p; j++)
            along += b[j] * row[j];
        for (int j = 0; j < p; j++)
            row[j] -= along * b[j];
    }
    for (int j = 0; j < p; j++)
        square += row[j] * row[j];
    return sqrt(square);
}

static void keep(int p, double *row, double length)
{
    for (int j = 0; j < p; j++)
        row[j] /= length;
}

/* Modified Gram-Schmidt: the given rows first, then always the longest that is left. -1: no memory. */
int kmp_sweep_find_more(kmp_sweep *w, int count, const int *coordinates, int *follows, int *more)
{
    int p = w->p, rank = 0, found = 0, dependent = 0;
    double *basis = KMP_NEW(double, (p + 1) * p + 1), *row = basis ? basis + p * p : NULL;
    *follows = -1;
    if (!basis)
        return -1;
    (void)kmp_sweep_evaluate(w, w->here.s, w->here.q);
    for (int k = -w->moving_count; k < count; k++) {
        if (k < 0)
            kmp_sweep_moving_row(w, w->moving[k + w->moving_count], row, 1);
        else
            kmp_sweep_motion_row(w, coordinates[k], row, 1);
        double length = rank < p ? across(p, basis, rank, row) : 0;
        if (length > FOLLOWS) {
            keep(p, row, length);
            memcpy(basis + rank++ * p, row, (size_t)p * sizeof *row);
        } else if (dependent++ == 0 && k >= 0) {
            *follows = coordinates[k];
        }
    }
    while (rank < p) {
        int best = -1;
        double longest = FOLLOWS;
        for (int c = 0; c < w->n; c++) {
            kmp_sweep_motion_row(w, c, row, 1);
            double length = across(p, basis, rank, row);
            if (length > longest * (1 + 1e-9)) {
                longest = length;
                best = c;
            }
        }
        if (best < 0)
            break;
        kmp_sweep_motion_row(w, best, row, 1);
        keep(p, row, across(p, basis, rank, row));
        memcpy(basis + rank++ * p, row, (size_t)p * sizeof *row);
        more[found++] = best;
    }
    for (int k = found; k < w->n; k++)
        more[k] = -1;
    kmp_free(basis);
    return dependent;
}

kempe_status kmp_sweep_lead(kmp_sweep *w, int count, const kmp_lead *leads, double s)
{
    if (!renew_leads(w, count, leads))
        return kmp_fail_memory(w->system->context);
    w->size = 0;
    for (int k = 0; k < count; k++) {
        double range = fabs(leads[k].to - leads[k].from);
        if (leads[k].coordinate < 0) {
            w->time = k;
            range = range > 0;
        } else {
            range /= w->system->scale[leads[k].coordinate];
        }
        w->size = fmax(w->size, range);
    }
    w->here.s = s;
    w->last_margin = w->last_step = w->fastest = 0;
    if (!(w->size > 0) || kmp_sweep_hold(w, &w->here) < FOLLOWS)
        return KEMPE_E_FAILED;
    return kmp_sweep_tangent(w, &w->here, NULL) ? KEMPE_OK : KEMPE_E_FAILED;
}

/* -- between two poses ------------------------------------------------------------------------------- */

/* A stretch of the curve from a to b, by the offset along a's tangent. */
typedef struct stretch {
    const kmp_pose *a, *b;
    double length, slant; /* offset of b; cosine of the tangents */
} stretch;

static stretch between(const kmp_sweep *w, const kmp_pose *a, const kmp_pose *b)
{
    return (stretch){a, b, kmp_sweep_offset(w, a, b), kmp_sweep_cosine(w, a, b)};
}

/* Cubic of Hermite at `x` of the length; derivative by the offset, of order 0, 1 or 2. */
static double hermite(const stretch *e, double x, double a, double da, double b, double db, int order)
{
    double l = e->length, d0 = da * l, d1 = db / e->slant * l, c2 = 3 * (b - a) - 2 * d0 - d1,
           c3 = 2 * (a - b) + d0 + d1;
    if (order == 0)
        return a + x * (d0 + x * (c2 + x * c3));
    return order == 1 ? (d0 + x * (2 * c2 + 3 * x * c3)) / l : (2 * c2 + 6 * x * c3) / (l * l);
}

static double s_at(const stretch *e, double x, int order)
{
    return hermite(e, x, e->a->s, e->a->ds, e->b->s, e->b->ds, order);
}

static void q_at(const kmp_sweep *w, const stretch *e, double x, int order, double *q)
{
    for (int i = 0; i < w->n; i++)
        q[i] = hermite(e, x, e->a->q[i], e->a->dq[i], e->b->q[i], e->b->dq[i], order);
}

/* The closed pose at x of the length, with its tangent, in part_way. */
static bool pose_at(kmp_sweep *w, const stretch *e, double x)
{
    double first, ratio;
    kmp_sweep_target target = {.base = e->a, .offset = x * e->length};
    w->part_way.s = s_at(e, x, 0);
    q_at(w, e, x, 0, w->part_way.q);
    return kmp_sweep_close(w, &target, &w->part_way, &first, &ratio) && kmp_sweep_tangent(w, &w->part_way, e->a);
}

/* Where on the cubic s is reached: s goes one way. */
static double guess_part(const stretch *e, double s)
{
    double to = e->b->s - s, x;
    kmp_bracket bracket = kmp_bracket_of(0, e->a->s - s, 1, to);
    while (kmp_bracket_next(&bracket, EPSILON, &x)) {
        double off = s_at(e, x, 0) - s;
        kmp_bracket_take(&bracket, x, off, to > 0 ? off >= 0 : off <= 0);
    }
    return bracket.far;
}

/* A sign change of f between 0 and 1, closed poses only, to rounding. f: ds, or s less a target. The pose is in
 * part_way. */
static bool enclose(kmp_sweep *w, const stretch *e, bool turn, double s)
{
    double f1 = turn ? e->b->ds : e->b->s - s, x;
    kmp_bracket bracket = kmp_bracket_of(0, turn ? e->a->ds : e->a->s - s, 1, f1);
    while (kmp_bracket_next(&bracket, 4 * EPSILON, &x)) {
        if (!pose_at(w, e, x))
            return false;
        double f = turn ? w->part_way.ds : w->part_way.s - s;
        if (f == 0 || (!turn && fabs(f) <= EPSILON * (1 + fabs(s))))
            return true;
        kmp_bracket_take(&bracket, x, f, (f > 0) == (f1 > 0));
    }
    return true;
}

/* The share of s in the motion. */
static double pace(const kmp_sweep *w, const kmp_pose *pose)
{
    return w->size * fabs(pose->ds);
}

/* What leads is known without rounding. */
static void set_leads(const kmp_sweep *w, double *q, double s)
{
    for (int k = 0; k < w->count; k++)
        if (k != w->time)
            q[w->lead[k].coordinate] = kmp_lead_value(&w->lead[k], s);
}

/* q at s, on this stretch, in part_way; the derivatives there. false: the branch has been lost. */
static bool land(kmp_sweep *w, const stretch *e, double s)
{
    double first, ratio, x = guess_part(e, s);
    kmp_sweep_target target = {.s = s};
    w->part_way.s = s;
    q_at(w, e, x, 0, w->part_way.q);
    bool slow = fmin(pace(w, e->a), pace(w, e->b)) < SLOW * w->fastest;
    if (slow && !enclose(w, e, false, s))
        return false;
    w->part_way.s = s;
    if (!slow &&
        (!kmp_sweep_close(w, &target, &w->part_way, &first, &ratio) || first > MOST_OFF * fabs(e->length) + 1e-9))
        return false;
    set_leads(w, w->part_way.q, s);
    return true;
}

/* -- a step ------------------------------------------------------------------------------------------ */

static double longest_step(const kmp_sweep *w)
{
    double most = 0;
    for (int i = 0; i < w->n; i++)
        most = fmax(most, fabs(w->here.dq[i]) / w->system->scale[i]);
    double step = LONGEST / fmax(most, 1e-3);
    return w->time < 0 ? step : fmin(step, LONGEST_S / fmax(pace(w, &w->here), 1e-3));
}

/* u or rows that have become bad are chosen anew where it stands, and the signs of the blocks are taken. */
static kempe_status refresh(kmp_sweep *w)
{
    int v, u;
    if (!kmp_sweep_evaluate(w, w->here.s, w->here.q) || kmp_reduction_growth(&w->red, &v, &u) > KMP_EXCHANGE_SWEEP ||
        w->margin.rows > KMP_ROWS_SWEEP) {
        kempe_status status = choose(w, w->margin.r);
        w->exchanges++;
        if (status != KEMPE_OK)
            return status;
        if (!kmp_sweep_evaluate(w, w->here.s, w->here.q))
            return KEMPE_E_FAILED;
    }
    if (w->block_count > 0)
        kmp_block_take_signs(w->red.block, w->signs);
    return KEMPE_OK;
}

static bool signs_hold(kmp_sweep *w)
{
    if (w->block_count == 0)
        return true;
    kmp_block_take_signs(w->red.block, w->signs_after);
    return memcmp(w->signs, w->signs_after, (size_t)w->block_count * sizeof *w->signs) == 0;
}

/* s goes one way between the ends, or its rate changes sign: one turn at most. */
static bool turns_once(const stretch *e)
{
    if ((e->a->ds < 0) != (e->b->ds < 0))
        return true;
    for (int k = 1; k < 8; k++)
        if ((s_at(e, k / 8.0, 1) < 0) != (e->a->ds < 0))
            return false;
    return true;
}

typedef enum verdict { GOOD, BAD, SIGN } verdict;

/* Tries a step of this length from `here` to `next`; SIGN: all is well but a block has changed its sign. */
static verdict try_step(kmp_sweep *w, const kmp_pose *from, double step, bool leap)
{
    double first, ratio;
    kmp_pose *to = &w->next;
    kmp_sweep_target target = {.base = from, .offset = step};
    to->s = from->s + step * from->ds;
    for (int i = 0; i < w->n; i++)
        to->q[i] = from->q[i] + step * from->dq[i];
    if (!kmp_sweep_close(w, &target, to, &first, &ratio) || first > MOST_OFF * step || ratio > CONTRACTION)
        return BAD;
    if (!kmp_sweep_tangent(w, to, from) || kmp_sweep_cosine(w, from, to) < LEAST_COSINE)
        return BAD;
    bool same = leap || signs_hold(w);
    stretch e = between(w, from, to);
    if (!turns_once(&e))
        return BAD;
    return same ? GOOD : SIGN;
}

/* Straight on across a change point, from the last state that was well before it; farther where it lies deeper. */
static bool leap(kmp_sweep *w)
{
    double gone = kmp_sweep_offset(w, &w->entry, &w->here), step = 2 * gone + ENTRY;
    for (int k = 0; k < MOST_LEAPS; k++, step *= 2)
        if (try_step(w, &w->entry, step, true) == GOOD && kmp_sweep_margin(w, &w->next) > ENTRY / 2)
            return true;
    return false;
}

/* -- on the way -------------------------------------------------------------------------------------- */

typedef struct way {
    kmp_sweep *w;
    const kmp_sweep_task *task;
    double up;    /* +1, -1: where s goes */
    int row;      /* the next */
    double slack; /* rounding of s */
    bool lost, no_memory;
} way;

static bool reaches(const way *y, double s, double target)
{
    return y->up * (s - target) >= 0;
}

static double slack_of(const kmp_sweep *w)
{
    double most = 1;
    for (int k = 0; k < w->count; k++) {
        double range = fabs(w->lead[k].to - w->lead[k].from);
        if (range > 0)
            most = fmax(most, fmax(fabs(w->lead[k].from), fabs(w->lead[k].to)) / range);
    }
    return EPSILONS * EPSILON * most;
}

static void give(way *y, const double *q, const double *qs, const double *qss)
{
    const kmp_sweep_task *t = y->task;
    if (t->row(t->user, y->row, t->s[y->row], q, qs, qss))
        y->no_memory = true;
    y->row++;
}

/* Derivatives by s of the cubic, where no state can be closed. */
static void give_crossing(way *y, const stretch *e, double s)
{
    kmp_sweep *w = y->w;
    double x = guess_part(e, s), s1 = s_at(e, x, 1), s2 = s_at(e, x, 2);
    q_at(w, e, x, 0, w->part_way.q);
    q_at(w, e, x, 1, w->qs);
    q_at(w, e, x, 2, w->qss);
    for (int i = 0; i < w->n; i++) {
        w->qss[i] = (w->qss[i] - w->qs[i] / s1 * s2) / (s1 * s1);
        w->qs[i] /= s1;
    }
    set_leads(w, w->part_way.q, s);
    for (int k = 0; k < w->count; k++)
        if (k != w->time) {
            w->qs[w->lead[k].coordinate] = w->lead[k].to - w->lead[k].from;
            w->qss[w->lead[k].coordinate] = 0;
        }
    give(y, w->part_way.q, w->qs, w->qss);
}

/* The rows of a stretch up to `limit`; `crossing`: a change point lies in it. */
static void give_rows(way *y, const stretch *e, double limit, bool crossing)
{
    kmp_sweep *w = y->w;
    const kmp_sweep_task *t = y->task;
    while (y->row < t->count && reaches(y, limit, t->s[y->row]) && !y->lost && !y->no_memory) {
        double s = t->s[y->row];
        if (crossing) {
            give_crossing(y, e, s);
            continue;
        }
        y->lost = !land(w, e, s) || !kmp_sweep_derivatives(w, &w->part_way, w->qs, w->qss);
        if (!y->lost)
            give(y, w->part_way.q, w->qs, w->qss);
    }
}

/* A row that is the dead centre itself. */
static void give_dead(way *y)
{
    const kmp_sweep_task *t = y->task;
    if (y->row < t->count && fabs(t->s[y->row] - y->w->here.s) <= y->slack)
        give(y, y->w->here.q, NULL, NULL);
}

/* It stands at s_end, within the stretch. */
static kmp_sweep_end arrive(way *y, const stretch *e)
{
    kmp_sweep *w = y->w;
    if (!land(w, e, y->task->s_end) || !kmp_sweep_tangent(w, &w->part_way, e->a))
        return KMP_SWEEP_LOST;
    pose_copy(w, &w->part_way, &w->here);
    return KMP_SWEEP_ARRIVED;
}

/* s turns between here and next: up to there, or to s_end before it. Rows nearer to it than rounding are it. */
static kmp_sweep_end stop_dead(way *y)
{
    kmp_sweep *w = y->w;
    stretch e = between(w, &w->here, &w->next);
    if (!enclose(w, &e, true, 0))
        return KMP_SWEEP_LOST;
    pose_copy(w, &w->part_way, &w->next);
    e = between(w, &w->here, &w->next);
    double limit = w->next.s - y->up * y->slack;
    give_rows(y, &e, limit, false);
    if (y->lost)
        return KMP_SWEEP_LOST;
    if (reaches(y, limit, y->task->s_end))
        return arrive(y, &e);
    pose_copy(w, &w->next, &w->here);
    w->here.ds = 0;
    give_dead(y);
    return KMP_SWEEP_DEAD;
}

/* -- change points ----------------------------------------------------------------------------------- */

/* Where the margin, which falls evenly to it, is zero: told; rows in between. */
static kmp_sweep_end cross(way *y, double margin)
{
    kmp_sweep *w = y->w;
    if (!leap(w) || (w->next.ds > 0) != (y->up > 0))
        return KMP_SWEEP_LOST;
    stretch e = between(w, &w->entry, &w->next);
    double gone = kmp_sweep_offset(w, &w->entry, &w->here), at = kmp_sweep_margin(w, &w->entry);
    double x = fmin(1, (gone + gone * margin / fmax(at - margin, margin)) / e.length);
    give_rows(y, &e, w->next.s, true);
    w->part_way.s = s_at(&e, x, 0);
    w->part_way.ds = w->next.ds;
    q_at(w, &e, x, 0, w->part_way.q);
    memcpy(w->part_way.dq, w->next.dq, (size_t)w->n * sizeof *w->next.dq);
    if (y->task->change && y->task->change(y->task->user, &w->part_way, margin))
        y->no_memory = true;
    w->last_step = 0;
    return KMP_SWEEP_ARRIVED; /* on the other side */
}

/* No step goes farther than a part of the way to where the margin would be zero. */
static double near_step(const kmp_sweep *w, double margin, double step)
{
    if (margin > NEAR)
        return step;
    double slope = w->last_step > 0 ? fabs(w->last_margin - margin) / w->last_step : 1;
    return fmin(step, APPROACH * margin / fmax(slope, 1));
}

/* -- all the way ------------------------------------------------------------------------------------- */

/* One step of at most *step, then what it leads to. ARRIVED: on, or at s_end when *there. */
static kmp_sweep_end go_on(way *y, double *step, bool *there)
{
    kmp_sweep *w = y->w;
    double margin = kmp_sweep_margin(w, &w->here);
    kempe_status status = refresh(w);
    if (status != KEMPE_OK)
        return status == KEMPE_E_MEMORY ? KMP_SWEEP_NO_MEMORY : KMP_SWEEP_LOST;
    if (margin > ENTRY)
        pose_copy(w, &w->here, &w->entry);
    w->fastest = fmax(w->fastest, pace(w, &w->here));
    double h = near_step(w, margin, fmin(*step, longest_step(w)));
    verdict v = BAD;
    while (margin > EXACT && h > SHORTEST && (v = try_step(w, &w->here, h, false)) != GOOD) {
        w->rejected++;
        if (v == SIGN && h < SHORT)
            break;
        h /= 2;
    }
    bool crossing = margin <= EXACT || (v != GOOD && margin < ENTRY); /* rounding alone is left of it */
    if (crossing && cross(y, margin) != KMP_SWEEP_ARRIVED)
        return KMP_SWEEP_LOST;
    if (!crossing && v != GOOD)
        return KMP_SWEEP_LOST;
    w->steps++;
    stretch e = between(w, crossing ? &w->entry : &w->here, &w->next);
    if (!crossing && (w->next.ds > 0) != (y->up > 0)) {
        kmp_sweep_end end = stop_dead(y);
        *there = end == KMP_SWEEP_ARRIVED;
        return end;
    }
    if (!crossing)
        give_rows(y, &e, w->next.s, false);
    if (!crossing)
        w->last_step = h;
    w->last_margin = margin;
    *step = crossing ? ENTRY : e.slant > 0.99 ? 2 * h : e.slant > 0.97 ? 1.2 * h : h;
    *there = reaches(y, w->next.s, y->task->s_end);
    if (*there && !crossing && !y->lost)
        return arrive(y, &e);
    if (*there && crossing && y->up > 0)
        poses_swap(&w->entry, &w->next);
    poses_swap(&w->here, &w->next);
    return y->lost ? KMP_SWEEP_LOST : KMP_SWEEP_ARRIVED;
}

/* The tangent that leads towards s_end: from a dead centre back to where it came from. */
static void turn(way *y)
{
    kmp_pose *here = &y->w->here;
    bool dead = here->ds == 0;
    if (dead || (here->ds > 0) != (y->up > 0)) {
        for (int i = 0; i < y->w->n; i++)
            here->dq[i] = -here->dq[i];
        here->ds = -here->ds;
    }
    if (dead)
        here->ds = y->up * 1e-300;
}

kmp_sweep_end kmp_sweep_go(kmp_sweep *sweep, const kmp_sweep_task *task, int *rows)
{
    way y = {.w = sweep, .task = task, .up = task->s_end >= sweep->here.s ? 1 : -1, .slack = slack_of(sweep)};
    kmp_sweep_end end = KMP_SWEEP_ARRIVED;
    bool there = task->s_end == sweep->here.s;
    double step = FIRST_STEP;
    long most = sweep->steps + MOST_STEPS;
    if (sweep->here.ds == 0)
        give_dead(&y);
    turn(&y);
    pose_copy(sweep, &sweep->here, &sweep->entry);
    while (!there && end == KMP_SWEEP_ARRIVED) {
        if (kmp_interrupted(sweep->system->context))
            end = KMP_SWEEP_INTERRUPTED;
        else
            end = sweep->steps < most ? go_on(&y, &step, &there) : KMP_SWEEP_LOST;
        if (y.no_memory)
            end = KMP_SWEEP_NO_MEMORY;
    }
    *rows = y.row;
    return end;
}
