/* SPDX-License-Identifier: BSD-3-Clause */
/* Quantities of instances, in lanes and in separate runs: the account of each instance gets the states of its steps, so
 * that it does not depend on other instances. A lane's states follow from its interpolant on closed loops. */
#include "ensemble/lanes/ensemble_measure.h"
#include "base/arena.h"
#include "base/memory.h"
#include "base/text.h"
#include "constraints/evaluation/evaluator.h"
#include "constraints/evaluation/validity.h"
#include "constraints/programs/saddle_program.h"
#include "ensemble/lanes/ensemble_conditions.h"
#include "ensemble/lanes/ensemble_kernels.h"
#include "ensemble/lanes/ensemble_start.h"
#include "ensemble/lanes/lane_state.h"
#include "integrators/run/runner.h"
#include "integrators/run/runner_change.h"
#include "model/data/body.h"
#include "output/quantities/smooth_piece.h"
#include <kempe/kempe.h>
#include <math.h>
#include <stdbool.h>
#include <string.h>

/* The last parts of a step that were sampled are kept, this number of them, for other lanes. */
enum { VECTORS = KMP_LANE_VECTORS, MOST_PARTS = 32 };

typedef struct sampled_part {
    int halvings, index;
    bool bad[KMP_LANES_MOST]; /* of a lane some sample is not good */
} sampled_part;

typedef struct kmp_measuring {
    const kmp_run_quantities *q;
    double *room;     /* of one account at a time */
    double *row;      /* q, qd, qdd, lambda */
    double *end;      /* of the channels */
    double *accounts; /* of a chunk, one for each instance */
    /* of all lanes, with their width: */
    kmp_lanes *lanes;              /* the program of outputs; NULL: no channel is computed, or not in lanes */
    double *wide[VECTORS];         /* size: the interpolants */
    int vectors;                   /* of them, at present */
    double *rows;                  /* 3 n + m: q and qd; qdd and lambda */
    bool doubtful[KMP_LANES_MOST]; /* some sample of the present step has lost digits of qdd or lambda */
    double *sampled;               /* points x channels of each lane, one lane after the other */
    int parts;                     /* of the present step that were sampled; the last of them are kept */
    sampled_part part[MOST_PARTS];
    double *in_part[MOST_PARTS]; /* as `sampled` */
} kmp_measuring;

/* The source of states within a step: a lane's interpolant, or a run. */
typedef struct within {
    kmp_engine *e;
    kmp_runner *run; /* NULL: that lane */
    kmp_lane_group *pool;
    size_t lane;
} within;

static bool make_lanes(kmp_engine *e)
{
    kmp_measuring *m = e->measuring;
    kmp_arena *a = &e->run_arena;
    size_t w = e->room.w;
    for (int k = 0; k < VECTORS; k++)
        m->wide[k] = kmp_arena_aligned(a, w * (size_t)kmp_lane_most(e));
    if (!m->q->inside)
        return !a->failed;
    if (m->q->computed)
        m->lanes = e->beside[0] = kmp_lanes_new(e->s->judge, (int)w, e->execution.plain);
    for (int l = 0; m->lanes && l < (int)w; l++)
        kmp_lanes_set_one(m->lanes, KMP_IN_CHART, l, e->eval->chart);
    m->rows = kmp_arena_aligned(a, w * (3 * (size_t)e->n + (size_t)e->m));
    m->sampled = KMP_ARENA_NEW(a, double, w *kmp_account_piece(m->q));
    for (int k = 0; k < MOST_PARTS; k++)
        m->in_part[k] = KMP_ARENA_NEW(a, double, w *kmp_account_piece(m->q));
    return !a->failed && (m->lanes || !m->q->computed);
}

bool kmp_measuring_init(kmp_engine *e)
{
    const kmp_run_quantities *q = e->execution.quantities;
    kmp_arena *a = &e->run_arena;
    e->measuring = NULL;
    if (!q || q->count == 0)
        return true;
    kmp_measuring *m = e->measuring = KMP_ARENA_NEW(a, kmp_measuring, 1);
    if (!m)
        return false;
    m->q = q;
    if (!kmp_engine_no_lanes(e) && !make_lanes(e))
        return false;
    return KMP_ARENA_MAKE(a, KMP_ROOM(double, kmp_account_room(q), &m->room),
                          KMP_ROOM(double, 3 * e->n + e->m, &m->row), KMP_ROOM(double, q->channels, &m->end));
}

bool kmp_measuring_chunk(kmp_engine *e)
{
    if (!e->measuring)
        return true;
    e->measuring->accounts = KMP_ARENA_NEW(&e->arena, double, (size_t)e->count *kmp_account_size(e->measuring->q));
    return e->measuring->accounts;
}

bool kmp_measures_steps(const kmp_engine *e)
{
    const kmp_run_quantities *q = e->execution.quantities;
    return q && q->inside;
}

static double *account_of(const kmp_engine *e, int i)
{
    return e->measuring->accounts + (size_t)i * kmp_account_size(e->measuring->q);
}

void kmp_instance_begin_account(kmp_engine *e, int i)
{
    if (e->measuring)
        kmp_account_begin(e->measuring->q, account_of(e, i));
}

/* Puts the friction of elements that slip in place of their multipliers. */
static void show_friction(kmp_engine *e, double t, double *row)
{
    if (e->site && e->site->sticking.friction && e->measuring->q->late)
        kmp_friction_show(e->site, t, row);
}

/* The channels at a row. */
static void channels_at(kmp_engine *e, double t, const double *row, double *values)
{
    const kmp_run_quantities *q = e->measuring->q;
    int n = e->n;
    const double *shown = q->computed ? kmp_eval_shown(e->eval, t, row, row + n, row + 2 * n, row + 3 * n) : NULL;
    for (int k = 0; shown && k < e->s->use_count; k++) {
        double x;
        const int end = kmp_eval_left(e->s, shown, k, &x);
        if (end >= 0)
            atomic_store_explicit(&e->s->left[e->s->events.count + 2 * k + end % 2], true, memory_order_relaxed);
    }
    for (int c = 0; c < q->channels; c++)
        values[c] = shown && q->shown[c] >= 0 ? shown[q->shown[c]] : row[-1 - q->shown[c]];
}

static bool lane_channels(void *user, double t, double *values)
{
    kmp_engine *e = ((within *)user)->e;
    const kmp_measuring *m = e->measuring;
    double *row = m->row;
    int n = e->n;
    if (!kmp_within_state(e, t, m->q->late, row, row + n, row + 2 * n, row + 3 * n))
        return false;
    show_friction(e, t, row);
    channels_at(e, t, row, values);
    return true;
}

static bool run_channels(void *user, double t, double *values)
{
    const within *in = user;
    kmp_measuring *m = in->e->measuring;
    double work;
    if (kmp_runner_row(in->run, t, m->row, &work) != KEMPE_OK)
        return false;
    channels_at(in->e, t, m->row, values);
    return true;
}

/* -- lanes ------------------------------------------------------------------------------------------- */

/* The program does not depend on the instance whose numbers the evaluator has. There is none where forces depend on
 * multipliers. */
bool kmp_lane_group_complete(kmp_engine *e, kmp_lane_group *pool)
{
    const kmp_saddle_program_plan plan = {.part = &pool->part};
    kmp_saddle_program_written written;
    if (!e->measuring || !e->measuring->q->inside || !e->measuring->q->late || e->s->load_row_count > 0)
        return true;
    if (!kmp_saddle_program_write(e->eval, &plan, &written))
        return false;
    kmp_free(written.row);
    pool->complete = written.program;
    pool->completing = written.layout;
    if (!pool->complete)
        return true;
    pool->complete_lanes = kmp_lanes_new(pool->complete, (int)e->room.w, e->execution.plain);
    for (size_t l = 0; pool->complete_lanes && l < e->room.w; l++)
        kmp_lanes_set_one(pool->complete_lanes, KMP_IN_CHART, (int)l, e->eval->chart);
    return pool->complete_lanes;
}

/* True if quantities are sampled in all lanes together. */
static bool samples(const kmp_engine *e, const kmp_lane_group *pool)
{
    bool shows = e->site && e->site->sticking.friction; /* in place of multipliers */
    return e->measuring->sampled && (!e->measuring->q->late || (pool->complete_lanes && !shows));
}

/* Prepares the interpolants of the present steps of all lanes, from all stages, or `rough` only from both ends. */
static void prepare(kmp_engine *e, bool rough)
{
    kmp_lane_state *room = &e->room;
    const kmp_dop853_step step = {.y = room->y, .h = room->step, .k = room->k, .y_new = room->y_new};
    kmp_lanes_interpolant(room->w, (size_t)e->size, &step, !rough, e->measuring->wide);
    e->measuring->vectors = rough ? 4 : VECTORS;
    memset(e->measuring->doubtful, 0, sizeof e->measuring->doubtful);
    e->measuring->parts = 0;
}

/* The place of a point of a piece in its part of the step, 0 to 1. */
static double place_of(int point)
{
    return 0.5 * (1 + kmp_piece_point(point));
}

/* The unknowns of all lanes at a place in their steps, into the room's `stage`, and their slopes, into its k[2]. */
static void evaluate_within(kmp_engine *e, kmp_lane_group *pool, double place)
{
    kmp_lane_state *room = &e->room;
    kmp_lanes_interpolate(room->w, (size_t)e->size, e->measuring->vectors, e->measuring->wide, place, room->stage);
    kmp_room_set_times(room, place);
    kmp_room_evaluate(e, pool, room->stage, room->k[2]);
}

void kmp_lanes_spread(const kmp_engine *e, const kmp_lane_group *pool, const double *y, const double *slope,
                      double *rows)
{
    size_t w = e->room.w, bytes = w * sizeof *rows, p = (size_t)e->p, n = (size_t)e->n;
    for (size_t k = 0; k < p; k++) {
        size_t u = (size_t)pool->part.u[k];
        memcpy(rows + u * w, y + k * w, bytes);
        memcpy(rows + (n + u) * w, y + (p + k) * w, bytes);
    }
    for (size_t k = 0; k < (size_t)e->r; k++) {
        size_t v = (size_t)pool->part.v[k];
        memcpy(rows + v * w, y + (2 * p + k) * w, bytes);
        memcpy(rows + (n + v) * w, slope + (2 * p + k) * w, bytes);
    }
}

/* qdd and lambda of all lanes from q and qd; the dropped rows have no load. */
static void complete_lanes(kmp_engine *e, const kmp_lane_group *pool)
{
    kmp_measuring *m = e->measuring;
    const kmp_saddle_program_layout *layout = &pool->completing;
    size_t w = e->room.w, n = (size_t)e->n;
    double *lambda = m->rows + 3 * n * w;
    kmp_lanes_set(pool->complete_lanes, KMP_IN_TIME, e->room.at);
    kmp_lanes_set(pool->complete_lanes, KMP_IN_Q, m->rows);
    kmp_lanes_set(pool->complete_lanes, KMP_IN_QD, m->rows + n * w);
    const double *out = kmp_lanes_run(pool->complete_lanes, KMP_SADDLE_PROGRAM_RUN);
    memcpy(m->rows + 2 * n * w, out + (size_t)layout->qdd * w, n * w * sizeof *out);
    memset(lambda, 0, (size_t)e->m * w * sizeof *lambda);
    for (int i = 0; i < layout->r; i++)
        memcpy(lambda + (size_t)pool->part.rows[i] * w, out + (size_t)(layout->lambda + i) * w, w * sizeof *out);
    for (size_t l = 0; l < w; l++)
        m->doubtful[l] = m->doubtful[l] || !kmp_saddle_program_is_good(layout, out + l, (int)w);
}

/* The stages of outputs build on each other. */
static const double *shown_in_lanes(kmp_engine *e)
{
    kmp_measuring *m = e->measuring;
    const double *shown = NULL;
    if (!m->lanes)
        return NULL;
    kmp_lanes_set(m->lanes, KMP_IN_TIME, e->room.at);
    kmp_lanes_set(m->lanes, KMP_IN_Q, m->rows);
    kmp_lanes_set(m->lanes, KMP_IN_QD, m->rows + (size_t)e->n * e->room.w);
    if (m->q->late) {
        kmp_lanes_set(m->lanes, KMP_IN_QDD, m->rows + 2 * (size_t)e->n * e->room.w);
        kmp_lanes_set(m->lanes, KMP_IN_LAMBDA, m->rows + 3 * (size_t)e->n * e->room.w);
    }
    for (int stage = KMP_STAGE_POTENTIAL; stage <= KMP_STAGE_SHOWN; stage++)
        shown = kmp_lanes_run(m->lanes, stage);
    return shown;
}

/* Into pieces, one of each lane after the other. */
static void sample_into(kmp_engine *e, const kmp_lane_group *pool, int point, const double *y, const double *slope,
                        double *pieces)
{
    kmp_measuring *m = e->measuring;
    const kmp_run_quantities *q = m->q;
    size_t w = e->room.w, size = kmp_account_piece(q);
    kmp_lanes_spread(e, pool, y, slope, m->rows);
    if (q->late)
        complete_lanes(e, pool);
    const double *shown = shown_in_lanes(e);
    for (int c = 0; c < q->channels; c++) {
        const double *from =
            shown && q->shown[c] >= 0 ? shown + (size_t)q->shown[c] * w : m->rows + (size_t)(-1 - q->shown[c]) * w;
        for (size_t l = 0; l < w; l++)
            pieces[l * size + (size_t)(point * q->channels + c)] = from[l];
    }
}

/* Samples a part of the step in all lanes: more than one may need it. Flags of the whole step stay as they are. */
static void sample_part(kmp_engine *e, kmp_lane_group *pool, int halvings, int index, sampled_part *part,
                        double *pieces)
{
    kmp_measuring *m = e->measuring;
    kmp_lane_state *room = &e->room;
    bool doubtful[KMP_LANES_MOST];
    double bad[KMP_LANES_MOST];
    memcpy(doubtful, m->doubtful, sizeof doubtful);
    memcpy(bad, room->bad, room->w * sizeof *bad);
    memset(m->doubtful, 0, sizeof m->doubtful);
    memset(room->bad, 0, room->w * sizeof *bad);
    for (int point = 1; point < KMP_PIECE_POINTS - 1; point++) {
        evaluate_within(e, pool, ldexp(index + place_of(point), -halvings));
        sample_into(e, pool, point, room->stage, room->k[2], pieces);
    }
    *part = (sampled_part){.halvings = halvings, .index = index};
    for (size_t l = 0; l < room->w; l++)
        part->bad[l] = m->doubtful[l] || room->bad[l] != 0;
    memcpy(m->doubtful, doubtful, sizeof doubtful);
    memcpy(room->bad, bad, room->w * sizeof *bad);
}

static bool lane_part(void *user, int halvings, int index, double *piece)
{
    const within *in = user;
    kmp_engine *e = in->e;
    kmp_measuring *m = e->measuring;
    int kept = m->parts < MOST_PARTS ? m->parts : MOST_PARTS, k = 0;
    while (k < kept && (m->part[k].halvings != halvings || m->part[k].index != index))
        k++;
    if (k == kept) {
        k = m->parts++ % MOST_PARTS;
        sample_part(e, in->pool, halvings, index, &m->part[k], m->in_part[k]);
    }
    size_t size = kmp_account_piece(m->q), channels = (size_t)m->q->channels;
    if (m->part[k].bad[in->lane])
        return false;
    memcpy(piece + channels, m->in_part[k] + in->lane * size + channels, (size - 2 * channels) * sizeof *piece);
    return true;
}

/* False: the interpolant of a lane is less exact than its step, where a run would integrate again. */
static bool is_exact(const kmp_engine *e, size_t l)
{
    const kmp_lane_state *room = &e->room;
    return !kmp_rk_is_coarse(e->size, VECTORS, e->measuring->wide[VECTORS - 1] + l, room->w, room->weight + l, room->w);
}

/* The step of a lane up to t; its samples are the samples of the whole step. */
static kmp_measured_step step_of(const kmp_engine *e, const kmp_lane_group *pool, size_t l, double t)
{
    const kmp_measuring *m = e->measuring;
    bool sampled = samples(e, pool) && !m->doubtful[l] && t == e->room.t_new[l];
    return (kmp_measured_step){.from = e->room.t[l],
                               .to = t,
                               .rtol = e->spec.rtol,
                               .sampled = sampled ? m->sampled + l * kmp_account_piece(m->q) : NULL,
                               .parts = sampled ? lane_part : NULL};
}

/* Passes over the step of a lane that changes no quantity, after samples at every second point. false: it must be
 * measured. */
static bool pass_over(kmp_engine *e, const kmp_lane_group *pool, size_t l)
{
    kmp_measured_step step = step_of(e, pool, l, e->room.t_new[l]);
    for (size_t k = 0, p = (size_t)e->p; e->measuring->q->turns && k < p; k++)
        if (kmp_model_motion(e->s->model, pool->part.u[k])->rotation)
            step.turn = fmax(step.turn, fabs(e->room.y[(p + k) * e->room.w + l]) * e->room.step[l]);
    return step.sampled && kmp_account_pass(e->measuring->q, account_of(e, e->room.who[l]), &step);
}

/* Takes the step of a lane that is about to be accepted into account, up to t. false: some state within it is not
 * available. */
static bool measure(kmp_engine *e, kmp_lane_group *pool, size_t l, double t)
{
    kmp_measuring *m = e->measuring;
    int i = e->room.who[l];
    within in = {.e = e, .pool = pool, .lane = l};
    kmp_measured_step step = step_of(e, pool, l, t);
    step.channels = lane_channels;
    step.user = &in;
    kmp_within_begin(e, pool, l);
    bool good = is_exact(e, l) && kmp_account_step(m->q, account_of(e, i), m->room, &step);
    kmp_within_end(e);
    return good;
}

static void sample_end(kmp_engine *e, kmp_lane_group *pool, int point, const double *y, const double *slope)
{
    kmp_room_set_times(&e->room, point > 0);
    kmp_room_put_inputs(e);
    sample_into(e, pool, point, y, slope, e->measuring->sampled);
}

/* Samples the points of the step with this stride; at its ends the slopes are known. */
static void sample_every(kmp_engine *e, kmp_lane_group *pool, int every)
{
    kmp_lane_state *room = &e->room;
    const int last = KMP_PIECE_POINTS - 1;
    if (!samples(e, pool))
        return;
    sample_end(e, pool, 0, room->y, room->k[1]);
    for (int point = every; point < last; point += every) {
        evaluate_within(e, pool, place_of(point));
        sample_into(e, pool, point, room->stage, room->k[2], e->measuring->sampled);
    }
    sample_end(e, pool, last, room->y_new, room->k[13]);
}

/* Finds the accepted steps that must be measured, and passes over the others. Returns their number. */
static int find_measured(kmp_engine *e, kmp_lane_group *pool, const kmp_attempt *what, bool *measured)
{
    kmp_lane_state *room = &e->room;
    const bool may_pass = samples(e, pool) && kmp_quantities_may_pass(e->measuring->q);
    int count = 0;
    if (may_pass) {
        prepare(e, true);
        sample_every(e, pool, 2);
    }
    for (size_t l = 0; l < room->w; l++) {
        measured[l] = what[l] == KMP_ATTEMPT_EVENT ||
                      (what[l] == KMP_ATTEMPT_TAKEN && !(may_pass && room->bad[l] == 0 && pass_over(e, pool, l)));
        count += measured[l];
        room->bad[l] = 0;
    }
    return count;
}

/* Takes a step into the account of its instance. A step without exact states between its ends is left to a separate run
 * from its beginning; an account that has some of its states is made again by a run from the start. */
static kmp_attempt measure_one(kmp_engine *e, kmp_lane_group *pool, size_t l, double end, bool bad, kmp_attempt what)
{
    kmp_lane_state *room = &e->room;
    if (what == KMP_ATTEMPT_TAKEN && (bad || !is_exact(e, l))) {
        e->instances[room->who[l]].again = false;
        room->h[l] = room->step[l];
        kmp_lane_evict(e, l, KMP_LANE_NO_STATES);
        return KMP_ATTEMPT_NONE;
    }
    if (!bad && measure(e, pool, l, end))
        return what;
    kmp_instance_leave(e, room->who[l], KMP_LANE_NO_STATES);
    kmp_room_empty(room, l);
    return KMP_ATTEMPT_NONE;
}

void kmp_taken_measure(kmp_engine *e, kmp_lane_group *pool, const bool *searched, kmp_attempt *what)
{
    kmp_lane_state *room = &e->room;
    bool measured[KMP_LANES_MOST] = {false};
    if (find_measured(e, pool, what, measured) == 0)
        return;
    if (!searched)
        kmp_room_run_dense_stages(e, pool);
    prepare(e, false);
    sample_every(e, pool, 1);
    for (size_t l = 0; l < room->w; l++) {
        bool bad = room->bad[l] != 0 || room->dense_bad[l];
        room->bad[l] = 0;
        if (!measured[l])
            continue;
        e->results[room->who[l]].rhs += searched && searched[l] ? 0 : 3;
        double end = what[l] == KMP_ATTEMPT_EVENT ? room->event[l] : room->t_new[l];
        if (end > room->t[l])
            what[l] = measure_one(e, pool, l, end, bad, what[l]);
    }
}

/* -- runs -------------------------------------------------------------------------------------------- */

bool kmp_run_measure(kmp_engine *e, int i, kmp_runner *run)
{
    kmp_measuring *m = e->measuring;
    within in = {.e = e, .run = run};
    if (!m || !m->q->inside)
        return true;
    kmp_engine_hold_inputs(e, kmp_runner_inputs(run));
    kmp_eval_set_modes(e->eval, kmp_runner_modes(run));
    const kmp_measured_step step = {.from = kmp_runner_t_old(run),
                                    .to = kmp_runner_t(run),
                                    .rtol = e->spec.rtol,
                                    .channels = run_channels,
                                    .user = &in};
    bool good = kmp_account_step(m->q, account_of(e, i), m->room, &step);
    kmp_text why = {0};
    kmp_engine_hold_inputs(e, NULL);
    if (!good && !run->reason && kmp_account_excess(m->q, account_of(e, i), step.to, &why))
        run->reason = kmp_text_take(&why);
    return good;
}

void kmp_instance_measured(kmp_engine *e, kmp_lane_group *pool, int i, double t, const double *row)
{
    kmp_measuring *m = e->measuring;
    bool known = true;
    if (!m)
        return;
    e->eval->inputs.before = true;
    if (row)
        memcpy(m->row, row, (size_t)(3 * e->n + e->m) * sizeof *row);
    else
        memcpy(m->row, e->state, (size_t)(2 * e->n) * sizeof *row);
    if (!row && m->q->late)
        known = kmp_instance_complete(e, pool, m->row + e->n, m->row + 2 * e->n, m->row + 3 * e->n);
    if (!row)
        show_friction(e, t, m->row);
    channels_at(e, t, m->row, m->end);
    e->eval->inputs.before = false;
    for (int c = 0; c < m->q->channels && !known; c++)
        m->end[c] = NAN;
    kmp_account_values(m->q, account_of(e, i), 0, t, m->end, e->taken + (size_t)i * (size_t)m->q->values);
}
