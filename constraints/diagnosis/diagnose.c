/* SPDX-License-Identifier: BSD-3-Clause */
/* The command `check` as a sequence: assemble, choose coordinates, find rank and redundant rows, then the parts of an
 * examination, each a function in one list; at last accelerations that a run could not evaluate. Models beyond a size
 * have only rank and choice. */
#include "constraints/diagnosis/diagnose.h"
#include "base/bracket.h"
#include "base/memory.h"
#include "constraints/closing/assembly.h"
#include "constraints/closing/rounding.h"
#include "constraints/closing/shaft_angles.h"
#include "constraints/diagnosis/diagnosis.h"
#include "constraints/diagnosis/diagnosis_rank.h"
#include "constraints/evaluation/charts.h"
#include "constraints/evaluation/evaluator.h"
#include "constraints/evaluation/state_ends.h"
#include "constraints/inexact/nearest_exact.h"
#include "constraints/kinds/kind.h"
#include "constraints/partition/singularity_causes.h"
#include "constraints/tolerances.h"
#include "linalg/dense/dot.h"
#include "model/data/closure_table.h"
#include "model/data/model.h"
#include "model/read/loads.h"
#include <kempe/check.h>
#include <math.h>
#include <string.h>

/* Reasons of a failed assembly. Held coordinates are released in trials, one by one and then all. If every joint of a
 * loop turns, its links are a polygon, which closes only if none is longer than all others together. */

enum { PUSHES = 4 };

/* -- held coordinates -------------------------------------------------------------------------------- */

static bool try_release(const kempe_system *s, const double *q, const bool *hold, int coordinate, kmp_release *release)
{
    kempe_assembly *a = NULL;
    kmp_guess guess = {q, hold, PUSHES, false, 0};
    if (kmp_assemble_from(s, &guess, &a) != KEMPE_OK)
        return false;
    *release = (kmp_release){coordinate, a->closed, coordinate < 0 ? 0 : a->q[coordinate]};
    kempe_assembly_free(a);
    return true;
}

static bool try_releases(kmp_obstacle *o, const kempe_system *s, kmp_arena *arena)
{
    const kmp_start *start = &s->model->start;
    double *q = KMP_ARENA_NEW(arena, double, s->n);
    bool *hold = KMP_ARENA_NEW(arena, bool, s->n), some = false;
    o->releases = KMP_ARENA_NEW(arena, kmp_release, s->n + 1);
    if (!q || !hold || !o->releases)
        return false;
    for (int k = 0; k < s->n; k++) {
        q[k] = start->q[k].value;
        hold[k] = start->hold[k];
    }
    for (int k = 0; k < s->n; k++) {
        if (!start->hold[k])
            continue;
        hold[k] = false;
        if (!try_release(s, q, hold, k, &o->releases[o->release_count]))
            return false;
        some = some || o->releases[o->release_count].closes;
        o->release_count++;
        hold[k] = true;
    }
    if (some || o->release_count < 2)
        return true;
    memset(hold, 0, (size_t)s->n * sizeof *hold);
    return try_release(s, q, hold, -1, &o->releases[o->release_count++]);
}

/* -- lengths ----------------------------------------------------------------------------------------- */

static const char *point_name(const kempe_model *model, int point)
{
    return point < 0 ? "its joint" : model->points[point].name;
}

static bool too_short(const kempe_model *model, int closure, kmp_short_links *reach)
{
    const kmp_closure *c = &model->closures[closure];
    const kmp_closure_parts *kind = kmp_closure_parts_of(c->kind);
    const kmp_part *part = kind ? kind->force : NULL;
    bool rod = part == &kmp_part_rod;
    if (!(rod || part == &kmp_part_ball) || c->function) /* a ball makes its points coincide */
        return false;
    kmp_loop_polygon p = kmp_loop_polygon_of(model, c);
    if (p.slides)
        return false;
    double length = rod ? c->number.value : 0, others = p.sum - p.longest + length;
    if (length > p.longest && length > p.sum) { /* the rod is the longest side */
        *reach = (kmp_short_links){closure, length, p.sum, NULL, NULL, NULL};
        return true;
    }
    *reach = (kmp_short_links){
        closure, p.longest, others, point_name(model, p.from), point_name(model, p.to), model->bodies[p.body].name};
    return p.longest > others * (1 + 1e-12);
}

/* b (r x p) = Bvu, scaled, from the scaled J here; false when singular. */
static bool dependent_rates(const kmp_examination *x, double *jv, int *pivot, double *b)
{
    const kmp_partition *part = x->part;
    const double *jacobian = kmp_diagnosis_jacobian(x, 0);
    int r = part->r, m = part->m;
    for (int i = 0; i < r; i++) {
        for (int k = 0; k < r; k++)
            jv[i + k * r] = jacobian[part->rows[i] + part->v[k] * m];
        for (int k = 0; k < part->p; k++)
            b[i + k * r] = -jacobian[part->rows[i] + part->u[k] * m];
    }
    if (kmp_lu_factor(r, jv, pivot) != 0)
        return false;
    kmp_lu_solve(r, jv, pivot, part->p, b);
    return true;
}

/* max |B| with v_i independent in place of u_k. */
static double after_exchange(const double *b, int r, int p, int i, int k)
{
    double pivot = b[i + k * r], most = fabs(1 / pivot);
    for (int c = 0; c < p; c++)
        for (int j = 0; j < r; j++) {
            double now = b[j + c * r];
            if (j == i && c == k)
                continue;
            if (j == i || c == k)
                now /= pivot;
            else
                now -= b[j + k * r] * b[i + c * r] / pivot;
            most = fmax(most, fabs(now));
        }
    return most;
}

static kmp_alternative best_exchange(const kmp_partition *part, const double *b, int i)
{
    kmp_alternative best = {part->v[i], -1, INFINITY, false};
    for (int k = 0; k < part->p; k++) {
        if (!(fabs(b[i + k * part->r]) > 1e-12))
            continue;
        double most = after_exchange(b, part->r, part->p, i, k);
        if (most < best.max_b) {
            best.max_b = most;
            best.instead = part->u[k];
        }
    }
    return best;
}

/* A part of the examination. The arena records memory failures. */
static void diagnosis_alternatives(kmp_examination *x)
{
    const kmp_partition *part = x->part;
    int r = part->r, p = part->p;
    double *jv = KMP_ARENA_NEW(x->arena, double, r *r), *b = KMP_ARENA_NEW(x->arena, double, r *p);
    int *pivot = KMP_ARENA_NEW(x->arena, int, r);
    x->diagnosis->alternatives = KMP_ARENA_NEW(x->arena, kmp_alternative, part->n);
    if (r == 0 || p == 0 || !jv || !b || !pivot || !x->diagnosis->alternatives || !dependent_rates(x, jv, pivot, b))
        return;
    for (int k = 0, i = 0, c = 0; c < part->n; c++) {
        if (k < p && part->u[k] == c) {
            x->diagnosis->alternatives[c] = (kmp_alternative){c, -1, part->max_b, true};
            k++;
        } else
            x->diagnosis->alternatives[c] = best_exchange(part, b, i++);
    }
    x->diagnosis->alternative_count = part->n;
}

/* Limits of motion: a mechanism of one degree of freedom moves by arc length in the scaled coordinates. Each step goes
 * along the tangent and is closed again; the turn of the tangent controls its length. A coordinate turns back where its
 * rate changes sign (its dead centre). Branches meet where the last pivot of J nearly vanishes (a change point). Both
 * are found to round-off. The motion ends when it returns to its start, angles modulo full turns with which the
 * closures hold at places on the way, too; otherwise it is followed in both directions. A coordinate that enters the
 * closures linearly, as a motor behind a gear, is scaled to be no faster than all others: its turns need no
 * steps. */

enum { MOST_STEPS = 3000, MOST_FOR_LIMITS = 40, MOST_SAMPLES = 12 /* step 2^11 is the last one before MOST_STEPS */ };
enum { LINEAR_PLACES = 3, TURN_STEPS = 4 };
#define FIRST_STEP 0.05
#define LONGEST    0.1
#define APPROACH   0.5  /* largest step over the last pivot, near other branches */
#define CROSSING   2e-4 /* smallest such step, with which an exact change point is crossed */
#define SHORTEST   1e-5
#define LEAST_DOT  0.985 /* of successive unit tangents */
#define FARTHEST   120.0 /* scaled */
#define SIDEWAYS   0.1   /* largest displacement by closing, over the step */
#define NEAR       1e-2
#define STANDS     1e-8 /* a coordinate with a smaller change does not move */
#define TURNED     1e-7 /* scaled, of a coordinate whose turns are counted */
#define RETURNED   1e-7 /* scaled |h| after full turns: above errors of closed places times some turns */
#define TWO_PI     6.283185307179586

/* A configuration of the motion. */
typedef struct place {
    double *q, *tangent; /* n; tangent scaled, of unit length */
    double arc, pivot;
} place;

typedef struct trace {
    kmp_examination *x;
    kmp_limits *limits;
    int n;
    double *unit;   /* n: scales of the walk as they were */
    double usual;   /* the largest last pivot so far */
    double *sample; /* MOST_SAMPLES x n: configurations after steps 1, 2, 4, .. */
    int sample_count;
    bool aperiodic; /* angles have come back without the closures */
    place before, here, next, trial, least, start;
} trace;

/* The tangent at p->q, from the last J, on the side of `like`. */
static void tangent_at(trace *w, place *p, const double *like)
{
    kmp_walk *walk = w->x->walk;
    kmp_walk_tangents(walk, w->n - 1);
    p->pivot = walk->last;
    bool other = kmp_dot(w->n, walk->basis, like) < 0;
    for (int k = 0; k < w->n; k++)
        p->tangent[k] = other ? -walk->basis[k] : walk->basis[k];
}

/* Steps from `from` to `to` by h along the tangent; false if no closed state is close by. */
static bool stride(trace *w, const place *from, double h, place *to)
{
    const double *scale = w->x->walk->scale;
    double sideways = 0;
    for (int k = 0; k < w->n; k++)
        to->q[k] = from->q[k] + h * from->tangent[k] * scale[k];
    if (!kmp_walk_close(w->x->walk, to->q))
        return false;
    for (int k = 0; k < w->n; k++) {
        double off = (to->q[k] - from->q[k]) / scale[k] - h * from->tangent[k];
        sideways += off * off;
    }
    if (sqrt(sideways) > SIDEWAYS * fabs(h) + 1e-9)
        return false;
    tangent_at(w, to, from->tangent);
    to->arc = from->arc + h;
    return kmp_dot(w->n, from->tangent, to->tangent) > LEAST_DOT;
}

static void copy(const trace *w, const place *from, place *to)
{
    memcpy(to->q, from->q, (size_t)w->n * sizeof *to->q);
    memcpy(to->tangent, from->tangent, (size_t)w->n * sizeof *to->tangent);
    to->arc = from->arc;
    to->pivot = from->pivot;
}

/* Extends the range of a coordinate. The start may be a dead centre. */
static void extend(kmp_coordinate_range *range, double q, bool dead, double scale)
{
    double same = dead ? STANDS * scale : 0;
    if (q > range->high - same) {
        range->high = fmax(q, range->high);
        range->high_dead = dead;
    }
    if (q < range->low + same) {
        range->low = fmin(q, range->low);
        range->low_dead = dead;
    }
}

/* True for an angle of a spherical joint that is singular at the start: the motion is followed in other angles. */
static bool is_unseen(const trace *w, int k)
{
    int c = kmp_chart_of(w->x->system, k);
    return c >= 0 && !kmp_chart_is_own(w->x->walk->eval->chart, c);
}

static void remember(trace *w, int coordinate, const double *q, double margin)
{
    kmp_limits *l = w->limits;
    if (l->limit_position_count == KMP_MOST_LIMIT_POSITIONS)
        return;
    double *copy_q = KMP_ARENA_NEW(w->x->arena, double, w->n);
    if (!copy_q)
        return;
    memcpy(copy_q, q, (size_t)w->n * sizeof *copy_q);
    kmp_charts_show(w->x->system, w->x->walk->eval->chart, q, copy_q, NULL);
    l->limit_position[l->limit_position_count++] = (kmp_limit_position){coordinate, copy_q, margin};
}

/* Finds the dead centre of coordinate k between here and next, by the sign of its tangent component. */
static void dead_centre(trace *w, int k)
{
    double b = w->next.arc - w->here.arc, fa = w->here.tangent[k], fb = w->next.tangent[k], x;
    for (int i = 0; i < 3; i++, b *= 1.02) { /* at the return to the start its arc length is inexact */
        if (!stride(w, &w->here, b, &w->trial))
            return;
        fb = w->trial.tangent[k];
        if ((fa > 0) != (fb > 0))
            break;
    }
    kmp_bracket bracket = kmp_bracket_of(0, fa, b, fb);
    while (fb != 0 && kmp_bracket_next(&bracket, 1e-14, &x)) {
        if (!stride(w, &w->here, x, &w->trial))
            return;
        double f = w->trial.tangent[k];
        if (fabs(f) < 1e-13)
            break;
        kmp_bracket_take(&bracket, x, f, (f > 0) == (fb > 0));
    }
    extend(&w->limits->range[k], w->trial.q[k], true, w->x->system->scale[k]);
    remember(w, k, w->trial.q, 1);
}

/* The last pivot at `h` from here; zero if closing fails, as near an exact change point. Keeps the best place. */
static double probe(void *self, double h)
{
    trace *w = self;
    if (!stride(w, &w->here, h, &w->trial))
        return 0;
    if (w->trial.pivot < w->least.pivot)
        copy(w, &w->trial, &w->least);
    return w->trial.pivot;
}

/* -- one direction ------------------------------------------------------------------------------------- */

/* Finds the minimum of the last pivot between `before` and `next`. */
static void change_point(trace *w)
{
    copy(w, &w->here, &w->least);
    (void)kmp_bracket_least(probe, w, w->before.arc - w->here.arc, w->next.arc - w->here.arc, 1e-8);
    double margin = w->least.pivot / w->usual;
    if (margin < NEAR)
        remember(w, -1, w->least.q, margin < KMP_MARGIN_EXACT ? 0 : margin);
}

static void notice(trace *w)
{
    for (int k = 0; k < w->n; k++) {
        double one = w->here.tangent[k], two = w->next.tangent[k];
        if ((one > 0) != (two > 0) && fmax(fabs(one), fabs(two)) > 1e-9 && !is_unseen(w, k))
            dead_centre(w, k);
        extend(&w->limits->range[k], w->next.q[k], false, 1);
    }
    if (w->here.pivot < 0.5 * w->usual && w->here.pivot < w->before.pivot && w->here.pivot <= w->next.pivot &&
        w->before.arc < w->here.arc)
        change_point(w);
    w->usual = fmax(w->usual, w->next.pivot);
}

/* True if full turns that bring `at` to the start keep the closures at the places on the way: angles may enter them
 * otherwise than by sine and cosine. */
static bool turns_are_free(trace *w, const double *at)
{
    kmp_walk *walk = w->x->walk;
    double *turned = w->least.q, most = 0;
    bool turns = false;
    for (int i = 0; i < w->sample_count; i++) {
        for (int k = 0; k < w->n; k++) {
            double turn = w->x->system->model->motions[k].rotation ? at[k] - w->start.q[k] : 0;
            turns = turns || fabs(turn) > 1;
            turned[k] = w->sample[i * w->n + k] + TWO_PI * round(turn / TWO_PI);
        }
        kmp_walk_evaluate(walk, turned);
        most = fmax(most, kmp_eval_residual(walk->eval));
    }
    return !turns || most <= RETURNED;
}

/* The way of coordinate k from q to the start, modulo full turns. */
static double way_to_start(const trace *w, int k, double q)
{
    const double off = w->start.q[k] - q;
    return w->x->system->model->motions[k].rotation ? remainder(off, TWO_PI) : off;
}

/* True for a coordinate that is scaled because its columns of J are the same everywhere. */
static bool is_slowed(const trace *w, int k)
{
    return w->x->walk->scale[k] > w->unit[k];
}

/* Comes to the place that is nearest to the start, where the turns of fast coordinates can be counted. *along: the way
 * to it, nearly. False: these coordinates are not at the start there. */
static bool count_turns(trace *w, double *along)
{
    for (int i = 0; i < TURN_STEPS; i++) {
        double more = 0, square = 0;
        if (!stride(w, &w->here, *along, &w->trial))
            return false;
        for (int k = 0; k < w->n; k++)
            if (!is_slowed(w, k)) {
                more += way_to_start(w, k, w->trial.q[k]) / w->unit[k] * w->trial.tangent[k];
                square += w->trial.tangent[k] * w->trial.tangent[k];
            }
        *along += more / square;
    }
    for (int k = 0; k < w->n; k++) {
        const double off = way_to_start(w, k, w->trial.q[k]);
        if (is_slowed(w, k) && fabs(off) > TURNED * w->x->walk->scale[k])
            return false;
        w->trial.q[k] += off;
    }
    return true;
}

/* True if the step from here to next has passed the start, modulo full turns: next is then the start. */
static bool came_back(trace *w)
{
    double along = 0, square = 0, whole = 0, h = w->next.arc - w->here.arc;
    bool slowed = false;
    if (kmp_dot(w->n, w->start.tangent, w->next.tangent) < LEAST_DOT || w->here.arc < 2 * LONGEST)
        return false;
    for (int k = 0; k < w->n; k++) {
        double off = way_to_start(w, k, w->here.q[k]);
        slowed = slowed || is_slowed(w, k);
        if (is_slowed(w, k))
            continue;
        w->trial.q[k] = w->here.q[k] + off;
        off /= w->unit[k];
        along += off * w->here.tangent[k];
        square += off * off;
        whole += w->here.tangent[k] * w->here.tangent[k];
    }
    if (slowed)
        along /= whole;
    square -= slowed ? along * along * whole : along * along;
    if (along < -1e-12 || along > h + 1e-12 || square > 0.02 * h * h + 1e-16 || (slowed && !count_turns(w, &along)))
        return false;
    if (!turns_are_free(w, w->trial.q)) {
        w->aperiodic = true;
        return false;
    }
    memcpy(w->next.q, w->trial.q, (size_t)w->n * sizeof *w->next.q);
    memcpy(w->next.tangent, w->start.tangent, (size_t)w->n * sizeof *w->next.tangent);
    w->next.arc = w->here.arc + along;
    w->next.pivot = w->start.pivot;
    return true;
}

static const char *end_of_search(const trace *w)
{
    return w->aperiodic ? "the motion is not periodic: after full turns the angles return, but the loops are closed in "
                          "another way; the search ended there"
                        : "the motion continues beyond the length that was searched";
}

/* Follows the motion from the start along its tangent. Returns the reason of its end; NULL: it returned to the
 * start. */
static const char *trace_one_side(trace *w)
{
    double h = FIRST_STEP;
    w->sample_count = 0;
    copy(w, &w->start, &w->here);
    copy(w, &w->start, &w->before);
    for (int k = 0; k < MOST_STEPS; k++) {
        while (!stride(w, &w->here, h, &w->next))
            if ((h *= 0.5) < SHORTEST)
                return "the motion could not be followed further";
        bool back = came_back(w);
        notice(w);
        w->limits->length = fmax(w->limits->length, w->next.arc);
        if (back)
            return NULL;
        if (w->next.arc > FARTHEST)
            return end_of_search(w);
        h = fmin(fmin(1.3 * h, LONGEST), fmax(APPROACH * w->next.pivot / w->usual, CROSSING));
        if ((k & (k + 1)) == 0 && w->sample_count < MOST_SAMPLES)
            memcpy(w->sample + w->n * w->sample_count++, w->next.q, (size_t)w->n * sizeof *w->next.q);
        place old = w->before;
        w->before = w->here;
        w->here = w->next;
        w->next = old;
    }
    return end_of_search(w);
}

/* Scales coordinates whose columns of J are the same everywhere. False: no memory. */
static bool slow_linear_ones(trace *w)
{
    kmp_walk *walk = w->x->walk;
    const int n = w->n, m = walk->m;
    double *first = KMP_ARENA_NEW(w->x->arena, double, m *n), other = 0;
    bool *linear = KMP_ARENA_NEW(w->x->arena, bool, n);
    w->unit = kmp_arena_copy(w->x->arena, walk->scale, n, sizeof *walk->scale);
    if (!first || !linear || !w->unit)
        return false;
    for (int k = 0; k < n; k++)
        linear[k] = true;
    for (int i = 0; i <= LINEAR_PLACES; i++) {
        for (int k = 0; k < n; k++)
            w->trial.q[k] = w->start.q[k] + i * (0.3 + 0.1 * (k % 7)) * walk->scale[k];
        kmp_walk_evaluate(walk, w->trial.q);
        for (int e = 0; e < m * n; e++) {
            first[e] = i == 0 ? walk->jacobian[e] : first[e];
            linear[e / m] = linear[e / m] && fabs(walk->jacobian[e] - first[e]) <= STANDS * fabs(first[e]);
        }
    }
    for (int k = 0; k < n; k++)
        other += linear[k] ? 0 : w->start.tangent[k] * w->start.tangent[k];
    for (int k = 0; k < n && other > 0; k++) {
        walk->scale[k] *= linear[k] ? fmax(1, fabs(w->start.tangent[k]) / sqrt(other)) : 1;
        walk->least.scale = is_slowed(w, k) ? walk->scale : walk->least.scale;
    }
    return true;
}

static const char *why_not(const kmp_examination *x)
{
    const kmp_diagnosis *d = x->diagnosis;
    if (x->system->rheonomic)
        return "not examined, because a drive or another closure depends on time; kinematics with a sweep of t "
               "or of the drive follows it";
    if (x->part->n - d->generic_rank != 1)
        return "examined only for mechanisms with one degree of freedom";
    if (x->part->m == 0)
        return "nothing limits the motion, because there are no closures";
    if (x->part->r < d->generic_rank)
        return "the start is a change point (bifurcation): use another start to see the limits of a branch";
    if (!d->moved)
        return "no motion was found from the start";
    if (x->part->n > MOST_FOR_LIMITS)
        return "examined only for up to 40 coordinates";
    return NULL;
}

/* A part of the examination. The arena records memory failures. */
static void diagnosis_limits(kmp_examination *x)
{
    kmp_limits *l = &x->diagnosis->limits;
    trace w = {.x = x, .limits = l, .n = x->system->n};
    l->why_not = why_not(x);
    if (l->why_not)
        return;
    l->range = KMP_ARENA_NEW(x->arena, kmp_coordinate_range, w.n);
    KMP_ARENA_EACH(x->arena, double, w.n, &w.start.q, &w.before.q, &w.here.q, &w.next.q, &w.trial.q, &w.least.q);
    w.sample = KMP_ARENA_NEW(x->arena, double, MOST_SAMPLES *w.n);
    if (!KMP_ARENA_EACH(x->arena, double, w.n, &w.start.tangent, &w.before.tangent, &w.here.tangent, &w.next.tangent,
                        &w.trial.tangent, &w.least.tangent))
        return;
    /* The start: the independent coordinate increases first. */
    memcpy(w.start.q, x->q, (size_t)w.n * sizeof *w.start.q);
    kmp_walk_evaluate(x->walk, x->q);
    tangent_at(&w, &w.start, w.start.tangent);
    if (!slow_linear_ones(&w))
        return;
    kmp_walk_evaluate(x->walk, x->q);
    tangent_at(&w, &w.start, w.start.tangent);
    if (w.start.tangent[x->part->u[0]] < 0)
        for (int k = 0; k < w.n; k++)
            w.start.tangent[k] = -w.start.tangent[k];
    w.usual = fmax(w.start.pivot, x->diagnosis->margin > 0 ? w.start.pivot / x->diagnosis->margin : 0);
    for (int k = 0; k < w.n; k++)
        l->range[k] = (kmp_coordinate_range){.low = x->q[k], .high = x->q[k]};
    l->walked = true;
    l->ended = trace_one_side(&w);
    l->cycle = !l->ended;
    if (l->ended) {
        for (int k = 0; k < w.n; k++)
            w.start.tangent[k] = -w.start.tangent[k];
        (void)trace_one_side(&w);
    }
    /* The coordinates that move, and the full turns of a cycle. */
    for (int k = 0; k < w.n; k++) {
        kmp_coordinate_range *s = &l->range[k];
        s->moves = s->high - s->low > STANDS * x->system->scale[k];
        if (l->cycle)
            s->turns = (int)lround((w.next.q[k] - w.start.q[k]) / TWO_PI);
        if (l->cycle && !x->system->model->motions[k].rotation)
            s->turns = 0;
        if (is_unseen(&w, k))
            *s = (kmp_coordinate_range){.low = NAN, .high = NAN, .moves = s->moves, .unseen = true};
    }
}

enum { MOST_COORDINATES = 100, MOST_ROWS = 200 };

/* Runs all parts of the examination. */
static kempe_status run_parts(kmp_examination *x, const kmp_evaluator *eval)
{
    void (*const parts[])(kmp_examination *) = {kmp_diagnosis_points,       kmp_diagnosis_dependents,
                                                kmp_diagnosis_second_order, kmp_diagnosis_repairs,
                                                diagnosis_alternatives,     diagnosis_limits};
    x->walk = kmp_walk_new(x->system);
    KMP_TRY(kmp_made(x->system->context, x->walk));
    kmp_eval_set_charts(x->walk->eval, eval->chart);
    for (int k = 0; k < (int)(sizeof parts / sizeof *parts) && !x->arena->failed; k++)
        parts[k](x);
    kmp_walk_free(x->walk);
    return KEMPE_OK;
}

/* Rank without the rows of drives that move. */
static kempe_status count_driven(kempe_check *check, const kmp_evaluator *eval)
{
    const kempe_system *s = check->system;
    kmp_partition free;
    double *j = KMP_ARENA_NEW(&check->arena, double, s->jacobian.count);
    bool any = false;
    for (int e = 0; j && e < s->jacobian.count; e++) {
        const kmp_closure *closure = &s->model->closures[s->rows[s->jacobian.row[e]].closure];
        bool drives = kmp_closure_is_drive(closure) && closure->function;
        any = any || drives;
        j[e] = drives ? 0 : eval->jacobian[e];
    }
    if (!any)
        return j ? KEMPE_OK : kmp_fail_memory(s->context);
    KMP_TRY(kmp_partition_init(&free, s, j, NULL, 0));
    check->driven = check->part.r - free.r;
    kmp_partition_free(&free);
    return KEMPE_OK;
}

/* An evaluator that makes M only where it must: a large tree has articulated bodies, a long mechanism products with M.
 * NULL after a message. */
static kmp_evaluator *make_evaluator(const kempe_system *s)
{
    const kmp_lazy_equations *late = s->late;
    bool waits = late && (late->by_links || late->by_products);
    kmp_evaluator *eval = kmp_eval_new_for(s, "tape", NULL, waits ? KMP_EVAL_WEIGHS : KMP_EVAL_EVALUATES);
    if (!eval || !eval->weighs_only)
        return eval;
    if (kmp_eval_add_articulated(eval) == KEMPE_OK &&
        (eval->bodies.machine || kmp_eval_add_composite(eval) == KEMPE_OK)) {
        kmp_eval_set_by_bodies(eval, eval->bodies.machine != NULL);
        return eval;
    }
    kmp_eval_free(eval);
    return NULL;
}

/* Appends a sentence about a value of the caller's system at the start that is not finite, with its states and forces.
 */
static kempe_status foresee_values(const kempe_check *check, const double *q, const double *qd, const double *chart,
                                   kmp_text *why)
{
    const kempe_system *s = check->given;
    int own = check->system->n;
    kmp_evaluator *eval = make_evaluator(s);
    double *state = eval ? KMP_ARENA_NEW(&eval->arena, double, 2 * s->n) : NULL;
    for (int k = 0; state && k < s->n; k++) {
        state[k] = k < own ? q[k] : 0;
        state[s->n + k] = k < own ? qd[k] : s->model->start.qd[k].value;
    }
    if (state && chart)
        kmp_eval_set_charts(eval, chart);
    if (state)
        (void)kmp_put_not_finite(eval, 0, state, state + s->n, why);
    kmp_eval_free(eval);
    return state ? KEMPE_OK : kmp_fail_memory(s->context);
}

/* Reports accelerations that are undetermined or not finite, with which every run would end. */
static kempe_status foresee(kempe_check *check, kmp_evaluator *eval, const double *q)
{
    const kempe_assembly *a = check->assembly;
    kmp_text why = {0};
    kempe_status status = kmp_foresee_massless(eval, &check->part, 0, q, &why);
    if (status == KEMPE_OK && !why.s)
        status = foresee_values(check, q, a->inner_q ? a->inner_qd : a->qd, a->chart, &why);
    if (why.s) {
        check->undetermined = kmp_arena_strdup(&check->arena, why.s);
        kmp_log(check->system->context, KEMPE_LOG_WARNING, "%s", why.s);
        status = check->undetermined ? status : kmp_fail_memory(check->system->context);
    }
    kmp_text_free(&why);
    kmp_eval_closure(eval, 0, q);
    return status;
}

/* Runs the whole examination. Its cost grows with the cube of the coordinates, so that large models skip it. */
static kempe_status examine_closures(kempe_check *check, kmp_evaluator *eval, const double *q)
{
    const kempe_system *s = check->system;
    kmp_diagnosis *diagnosis = &check->diagnosis;
    kmp_examination x = {.system = s, .q = q, .part = &check->part, .arena = &check->arena, .diagnosis = diagnosis};
    kempe_status status = KEMPE_OK;
    diagnosis->declared = kmp_closure_all_rows(s->model);
    diagnosis->generic_rank = check->part.r;
    diagnosis->margin = 1;
    diagnosis->block_count = kmp_loop_blocks(eval, &check->part, &check->arena, &diagnosis->blocks);
    diagnosis->ran = s->n <= MOST_COORDINATES && s->m <= MOST_ROWS;
    if (!diagnosis->ran) {
        diagnosis->why_not = "more than 100 coordinates or 200 constraint equations: only rank, choice of coordinates "
                             "and blocks were examined";
        diagnosis->limits.why_not = diagnosis->why_not;
    } else if (diagnosis->block_count >= 0) {
        status = run_parts(&x, eval);
    }
    if (diagnosis->block_count < 0 && !check->arena.failed)
        return KEMPE_E_FAILED; /* the reduction has set the message */
    return check->arena.failed ? kmp_fail_memory(s->context) : status;
}

/* Computes rank and choice at the assembled configuration, then examines them. */
static kempe_status examine_at(kempe_check *check, kmp_evaluator *eval, const double *q)
{
    const kmp_run_settings *run = &check->system->model->run;
    kmp_eval_closure(eval, 0, q);
    KMP_TRY(kmp_partition_init(&check->part, check->system, eval->jacobian, run->independent, run->independent_count));
    KMP_TRY(kmp_partition_condition(&check->part, check->system, eval->jacobian, &check->condition));
    KMP_TRY(count_driven(check, eval));
    KMP_TRY(foresee(check, eval, q));
    return examine_closures(check, eval, q);
}

static kempe_status examine(kempe_check *check)
{
    const kempe_assembly *a = check->assembly;
    kmp_evaluator *eval = make_evaluator(check->system);
    KMP_TRY(kmp_made(check->system->context, eval));
    if (a->chart)
        kmp_eval_set_charts(eval, a->chart);
    kempe_status status = examine_at(check, eval, a->inner_q ? a->inner_q : a->q);
    kmp_eval_free(eval);
    return status;
}

/* Keeps the message of the assembly; later trial assemblies add their own to the context. */
static kempe_status explain(kempe_check *check)
{
    const kempe_system *s = check->assembly->system;
    kempe_context *context = check->system->context;
    check->reason = kmp_arena_strdup(&check->arena, kempe_context_message(context));
    kmp_obstacle *obstacle = &check->obstacle;
    obstacle->reaches = KMP_ARENA_NEW(&check->arena, kmp_short_links, s->model->closure_count);
    if (!check->reason || !obstacle->reaches || !try_releases(obstacle, s, &check->arena))
        return kmp_fail_memory(context);
    for (int c = 0; c < s->model->closure_count; c++)
        obstacle->reach_count += too_short(s->model, c, &obstacle->reaches[obstacle->reach_count]);
    kmp_context_clear(context);
    for (const char *line = check->reason; *line; line += line[0] == '\n') {
        int length = (int)strcspn(line, "\n");
        (void)kmp_fail(context, KEMPE_E_FAILED, "%.*s", length, line);
        line += length;
    }
    return KEMPE_E_FAILED;
}

static kempe_status find_loads(kempe_check *check)
{
    kmp_evaluator *eval = kmp_eval_new_of_closures(check->system);
    kempe_status status = kmp_made(check->system->context, eval);
    if (status == KEMPE_OK)
        status = kmp_find_shared_loads(eval, 0, check->assembly->q, &check->arena, &check->diagnosis.loads);
    kmp_eval_free(eval);
    return status;
}

static kempe_status diagnose(kempe_check *check)
{
    kempe_status status = kmp_assembly_at_start(check->system, &check->assembly);
    check->assembled = check->assembly && check->assembly->closed; /* also with goals that were not reached */
    if (check->assembled)
        status = (kmp_context_clear(check->system->context), examine(check));
    if (check->assembled && status == KEMPE_OK)
        status = kmp_shafts_refuse(check->system, check->assembly->q);
    if (check->assembled && status == KEMPE_OK)
        status = kmp_shafts_warn(check->system, check->assembly->q);
    if (check->assembled)
        return status == KEMPE_OK ? find_loads(check) : status;
    return status == KEMPE_E_FAILED && check->assembly ? explain(check) : status;
}

/* Doubts a start at which a run would end: by the whole model, whose states begin at zero where the mechanism has none.
 */
static kempe_status judge_ends(kempe_check *check)
{
    const kempe_system *s = check->given;
    kempe_assembly *start = NULL;
    int from = 0;
    if (s->events.count == 0)
        return KEMPE_OK;
    kmp_evaluator *eval = kmp_eval_new_for(s, "tape", NULL, KMP_EVAL_WEIGHS);
    kempe_status status = kmp_made(s->context, eval);
    if (status == KEMPE_OK && check->own)
        status = kmp_assemble_start(s, &start);
    const kempe_assembly *a = check->own ? start : check->assembly;
    if (status == KEMPE_OK && a && a->closed) {
        check->ended = kmp_eval_next_end(eval, KMP_ENDS_OF_MODEL, 0, a->q, a->qd, NULL, NULL, &from) >= 0;
        kmp_eval_doubt_ends(eval, KMP_ENDS_OF_MODEL, 0, a->q, a->qd, NULL, NULL);
    }
    kempe_assembly_free(start);
    kmp_eval_free(eval);
    return status;
}

/* Without the states, on which neither closures nor masses depend, and without forces, which may; and without the rows
 * of friction, the last closures, which are redundant unless a run holds them. */
static kempe_status leave_out_forces(kempe_check *c, const kempe_model *model)
{
    c->mechanism = KMP_NEW(kempe_model, 1);
    KMP_TRY(kmp_made(model->context, c->mechanism));
    *c->mechanism = *model;
    c->mechanism->motion_count = kmp_model_coordinates(model);
    c->mechanism->source.has_digest = false;
    c->mechanism->state_count = c->mechanism->force_count = c->mechanism->sensor_count = 0;
    c->mechanism->closure_count -= kmp_model_friction_count(model);
    c->mechanism->output_count = c->mechanism->run.until_count = 0;
    KMP_TRY(kmp_system_new(c->mechanism, NULL, &c->own));
    c->system = c->own;
    return KEMPE_OK;
}

kempe_status kmp_check(const kempe_system *system, kempe_check **check)
{
    KMP_MAKE(system->context, kempe_check, c);
    c->given = c->system = system;
    c->body_count = system->model->body_count - 1;
    c->loop_count = system->model->closure_count - kmp_model_friction_count(system->model);
    unsigned long failures = kmp_memory_failures();
    bool leaves_out = system->model->state_count > 0 || kmp_model_friction_count(system->model) > 0;
    kempe_status status = leaves_out ? leave_out_forces(c, system->model) : KEMPE_OK;
    if (status == KEMPE_OK)
        status = diagnose(c);
    if (status == KEMPE_OK && c->assembled)
        status = judge_ends(c);
    c->warnings = kmp_context_warnings(system->context);
    if (status == KEMPE_E_FAILED && kmp_memory_failures() != failures)
        status = KEMPE_E_MEMORY; /* the messages of earlier trials are dropped */
    c->status = status = kmp_context_verdict(system->context, status);
    return KMP_GIVE_IF(kmp_is_complete(status) || (status == KEMPE_E_FAILED && !c->assembled), status, check, c,
                       kempe_check_free);
}

void kempe_check_free(kempe_check *check)
{
    if (!check)
        return;
    kempe_assembly_free(check->assembly);
    kmp_partition_free(&check->part);
    kempe_system_free(check->own);
    kmp_free(check->mechanism);
    kmp_arena_free(&check->arena);
    kmp_free(check->warnings);
    kmp_free(check);
}
