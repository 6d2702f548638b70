/* SPDX-License-Identifier: BSD-3-Clause */
/* The lanes of a pool: their numbers, evaluations and stages in all of them, instances that enter and leave, and the
 * slopes and first steps of new ones. */
#include "ensemble/lanes/lane_state.h"
#include "base/memory.h"
#include "constraints/programs/reduced_program.h"
#include "ensemble/lanes/ensemble_conditions.h"
#include "ensemble/lanes/ensemble_engine.h"
#include "ensemble/lanes/ensemble_inside.h"
#include "ensemble/lanes/ensemble_kernels.h"
#include "ensemble/lanes/ensemble_measure.h"
#include "ensemble/lanes/ensemble_start.h"
#include "ensemble/lanes/lane_steps.h"
#include "integrators/decide/run_start.h"
#include "integrators/run/events.h"
#include "integrators/steppers/dop853.h"
#include "model/data/parameter.h"
#include "model/data/state.h"
#include <math.h>
#include <string.h>

/* -- pools -------------------------------------------------------------------------------------------------- */

/* Pools are found by the inputs of their program, so that an instance runs in the same pool whatever the other
 * instances are. */

void kmp_lane_group_free(kmp_lane_group *pool)
{
    if (!pool)
        return;
    kmp_lanes_free(pool->lanes);
    kmp_arena_free(&pool->sines.arena);
    kmp_lanes_free(pool->complete_lanes);
    kmp_program_free(pool->complete);
    kmp_program_free(pool->program);
    kmp_reduction_free(&pool->red);
    kmp_partition_free(&pool->part);
    kmp_free(pool->order);
    kmp_free(pool->pivot_block);
    kmp_free(pool->row);
    kmp_free(pool->loads.row);
    kmp_free(pool->output);
    kmp_free(pool->place);
    kmp_free(pool);
}

void kmp_lane_group_put(kmp_engine *e, kmp_lane_group *pool, int i)
{
    if (kmp_lane_steps_rest(e, pool, i))
        return;
    e->instances[i].next = -1;
    if (pool->tail >= 0)
        e->instances[pool->tail].next = i;
    else
        pool->head = i;
    pool->tail = i;
    pool->waiting++;
}

int kmp_lane_group_take(kmp_engine *e, kmp_lane_group *pool)
{
    int i = pool->head;
    if (i < 0)
        return -1;
    pool->head = e->instances[i].next;
    pool->tail = pool->head < 0 ? -1 : pool->tail;
    pool->waiting--;
    return i;
}

static bool same_choice(const kmp_lane_group *pool, const kmp_partition *part)
{
    return pool->part.p == part->p && memcmp(pool->part.u, part->u, (size_t)part->p * sizeof *part->u) == 0 &&
           memcmp(pool->part.rows, part->rows, (size_t)part->r * sizeof *part->rows) == 0;
}

/* Makes the lanes of the program, and finds where it takes the unknowns and leaves their slopes. false: no memory. */
static bool prepare(const kmp_engine *e, kmp_lane_group *pool)
{
    const kmp_program *program = pool->program;
    int size = kmp_lane_most(e),
        stage = e->s->load_row_count > 0 ? KMP_REDUCED_PROGRAM_ACCELERATIONS : KMP_REDUCED_PROGRAM_RATES;
    pool->slopes = stage;
    pool->lanes = kmp_lanes_new(program, (int)e->room.w, e->execution.plain);
    pool->output = KMP_NEW(kmp_lanes_output, program->outputs[stage + 1] - program->outputs[stage] + 1);
    pool->place = KMP_NEW(double *, size);
    if (!pool->lanes || !pool->output || !pool->place ||
        !kmp_fused_sines_init(&pool->sines, pool->lanes, (int)e->room.w))
        return false;
    pool->timed = kmp_lanes_takes(pool->lanes, KMP_IN_TIME);
    kmp_lanes_outputs(pool->lanes, stage, pool->output);
    kmp_lanes_places(pool->lanes, KMP_IN_Q, size, pool->place);
    return true;
}

/* Makes a pool. KEMPE_E_FAILED: its program cannot be written. */
static kempe_status make(kmp_engine *e, const kmp_partition *part, kmp_lane_group *pool)
{
    unsigned long failures = kmp_memory_failures();
    pool->head = pool->tail = -1;
    pool->order = KMP_NEW(int, part->r);
    KMP_TRY(kmp_made(e->context, pool->order && kmp_partition_copy(&pool->part, part)));
    KMP_TRY(kmp_reduction_init(&pool->red, e->eval, &pool->part));
    if (!kmp_writer_blocks_fit(&pool->red))
        return KEMPE_E_FAILED;
    kmp_writer_order(&pool->red, pool->order);
    const kmp_reduced_program_plan plan = {.order = pool->order,
                                           .power = true,
                                           .drives = true,
                                           .curvature = e->s->changes_by_rates,
                                           .forces = kmp_has_late_conditions(e->s)};
    const kmp_reduced_program_written written = kmp_reduced_program_write(&pool->red, &plan);
    pool->program = written.program;
    pool->layout = written.layout;
    pool->row = written.row;
    /* The block of each pivot; pivots are written from the last block to the first. */
    unsigned char *block = KMP_NEW(unsigned char, pool->layout.pivots + 1);
    int count = 0, size;
    for (int b = pool->part.r > 0 ? kmp_block_count(pool->red.block) : 0; block && b-- > 0;) {
        (void)kmp_block_columns(pool->red.block, b, &size);
        for (int k = size == 2 ? 1 : size; k-- > 0;)
            block[count++] = (unsigned char)b;
    }
    pool->pivot_block = block;
    pool->loads = (kmp_load_passes){
        .width = e->room.w, .n = e->n, .m = e->m, .row = KMP_NEW(int, e->s->load_row_count + 1), .by_state = true};
    if (pool->loads.row)
        pool->loads.loads = kmp_load_rows(e->s, &pool->part, pool->loads.row);
    bool made = pool->program && pool->pivot_block && pool->loads.row && prepare(e, pool);
    if (made && kmp_lane_group_complete(e, pool))
        return KEMPE_OK;
    return kmp_memory_failures() != failures ? kmp_fail_memory(e->context) : KEMPE_E_FAILED;
}

bool kmp_lane_group_among(const kmp_engine *e, const kmp_lane_group *pool)
{
    for (int k = 0; k < e->pool_count; k++)
        if (same_choice(e->pools[k], &pool->part) &&
            memcmp(e->pools[k]->order, pool->order, (size_t)pool->part.r * sizeof *pool->order) == 0)
            return true;
    return false;
}

/* Room for a pool: after the others, or where the one was that has been idle for the longest time. NULL: no memory. */
static kmp_lane_group **place_of(kmp_engine *e)
{
    int place = -1, kept = e->execution.pools > 0 ? e->execution.pools : KMP_POOLS_KEPT;
    for (int k = 0; k < e->pool_count && e->pool_count >= kept; k++)
        if (e->pools[k] != e->running && e->pools[k]->waiting == 0 && e->pools[k]->kept == 0 &&
            (place < 0 || e->pools[k]->used < e->pools[place]->used))
            place = k;
    if (place >= 0) {
        kmp_lane_group_free(e->pools[place]);
        e->pools[place] = NULL;
        return &e->pools[place];
    }
    kmp_lane_group **pools = kmp_list_room(e->pools, (size_t)e->pool_count, sizeof *pools);
    if (!pools)
        return NULL;
    e->pools = pools;
    return &e->pools[e->pool_count++];
}

/* Makes a pool and puts it into the list. */
static kempe_status add(kmp_engine *e, const kmp_partition *part, kmp_lane_group **added)
{
    kmp_lane_group *pool = KMP_NEW(kmp_lane_group, 1);
    KMP_TRY(kmp_made(e->context, pool));
    kempe_status status = make(e, part, pool);
    kmp_lane_group **place = status == KEMPE_OK ? place_of(e) : NULL;
    if (status == KEMPE_OK)
        status = kmp_made(e->context, place);
    if (status == KEMPE_OK)
        *place = *added = pool;
    else
        kmp_lane_group_free(pool);
    return status;
}

kmp_lane_group *kmp_lane_group_of_choice(kmp_engine *e, const kmp_partition *part)
{
    for (int k = 0; k < e->pool_count; k++)
        if (same_choice(e->pools[k], part)) {
            e->pools[k]->used = ++e->finds;
            return e->pools[k];
        }
    return NULL;
}

/* Blocks of one row and of two rows are solved by their determinants (kmp_writer_order). */
bool kmp_lane_group_is_ordered(const kmp_lane_group *pool)
{
    return kmp_block_largest(pool->red.block) <= 2;
}

kempe_status kmp_lane_group_find(kmp_engine *e, const kmp_partition *part, kmp_lane_group **found)
{
    int order[KMP_LANE_ROWS];
    *found = NULL;
    for (int k = 0; k < e->pool_count && !*found; k++) {
        kmp_lane_group *pool = e->pools[k];
        if (!same_choice(pool, part))
            continue;
        kmp_writer_order(&pool->red, order);
        if (memcmp(pool->order, order, (size_t)part->r * sizeof *order) == 0)
            *found = pool;
    }
    kempe_status status = *found ? KEMPE_OK : add(e, part, found);
    if (*found)
        (*found)->used = ++e->finds;
    return status == KEMPE_E_FAILED ? KEMPE_OK : status;
}

/* -- room -------------------------------------------------------------------------------------------- */

bool kmp_lane_state_init(kmp_engine *e, int width)
{
    kmp_lane_state *room = &e->room;
    size_t w = (size_t)width, size = (size_t)kmp_lane_most(e), n = (size_t)e->n, m = (size_t)e->m;
    *room = (kmp_lane_state){.w = w};
    for (size_t l = 0; l < KMP_LANES_MOST; l++)
        room->who[l] = -1;
    kmp_arena *a = &e->run_arena;
    double **vectors[] = {&room->y, &room->y_new, &room->stage, &room->weight, &room->atol};
    for (size_t k = 0; k < sizeof vectors / sizeof *vectors; k++)
        *vectors[k] = kmp_arena_aligned(a, w * size);
    for (size_t k = 1; k <= (kmp_measures_steps(e) || e->s->events.count > 0 ? 16 : 13); k++)
        room->k[k] = kmp_arena_aligned(a, w * size);
    room->scale = kmp_arena_aligned(a, w * n);
    room->late = kmp_has_late_conditions(e->s);
    room->vdd = room->vdd_new = NULL;
    if (e->s->changes_by_rates) {
        room->vdd = kmp_arena_aligned(a, w * (n + m));
        room->vdd_new = kmp_arena_aligned(a, w * (n + m));
        room->vdd_middle = kmp_arena_aligned(a, w * (n + m));
    }
    room->nu = room->nu_now = room->nu_end = NULL;
    if (e->s->load_row_count > 0) {
        room->nu = kmp_arena_aligned(a, w * m);
        room->nu_now = kmp_arena_aligned(a, w * m);
        room->nu_end = kmp_arena_aligned(a, w * m);
    }
    room->row_scale = kmp_arena_aligned(a, w * m);
    room->per_scale = kmp_arena_aligned(a, w * n);
    room->per_row_scale = kmp_arena_aligned(a, w * m);
    room->square = KMP_ARENA_NEW(a, double, m *n);
    room->at = kmp_arena_aligned(a, w * (1 + KMP_TIME_NUMBERS * (size_t)kmp_model_all_inputs(e->s->model)));
    return !a->failed;
}

/* -- evaluation -------------------------------------------------------------------------------------- */

void kmp_room_put_inputs(kmp_engine *e)
{
    kmp_lane_state *room = &e->room;
    const bool has_inputs = kmp_model_all_inputs(e->s->model) > 0;
    for (size_t l = 0; l < room->w && has_inputs; l++) {
        const kmp_present_inputs *inputs = room->who[l] >= 0 ? &e->instances[room->who[l]].inputs : NULL;
        const double *now = inputs ? kmp_present_inputs_at(inputs, room->at[l]) : NULL;
        for (size_t k = 1; now && k < (size_t)kmp_present_inputs_size(inputs); k++)
            room->at[k * room->w + l] = now[k];
    }
}

void kmp_room_find_limit(kmp_engine *e, size_t l)
{
    const kmp_instance *x = &e->instances[e->room.who[l]];
    e->room.until[l] = kmp_present_inputs_until(&x->inputs);
    e->room.limit[l] = kmp_first_limit(x->next_sample, e->room.until[l], x->end);
}

/* Solves for the multipliers that forces depend on, in each lane from the multipliers in the room. Lanes without a
 * solution are marked in `bad`. */
static void settle_loads(kmp_engine *e, kmp_lane_group *pool)
{
    kmp_lane_state *room = &e->room;
    kmp_load_passes *x = &pool->loads;
    memcpy(room->nu_now, room->nu, room->w * (size_t)e->m * sizeof *room->nu);
    x->nu = room->nu_now;
    x->scale = room->scale;
    x->weight = room->row_scale;
    kmp_load_begin(x, NULL);
    for (size_t l = 0; l < room->w; l++)
        x->settled[l] = room->who[l] < 0;
    (void)kmp_load_settle_lanes(x, pool->lanes);
    for (size_t l = 0; l < room->w; l++)
        room->bad[l] += !x->settled[l];
}

/* k = f(at, y) in all lanes, whose unknowns the program has; failed evaluations are marked in `bad`. */
static void evaluate_placed(kmp_engine *e, kmp_lane_group *pool, const double *y, double *k)
{
    kmp_lane_state *room = &e->room;
    if (pool->timed) {
        kmp_room_put_inputs(e);
        kmp_lanes_set(pool->lanes, KMP_IN_TIME, room->at);
    }
    if (room->nu)
        settle_loads(e, pool);
    kmp_lanes_run_in_place(pool->lanes, pool->slopes);
    kmp_lanes_publish(room->w, e, pool, y, k);
}

void kmp_room_evaluate(kmp_engine *e, kmp_lane_group *pool, const double *y, double *k)
{
    kmp_lanes_set(pool->lanes, KMP_IN_Q, y);
    evaluate_placed(e, pool, y, k);
}

void kmp_room_set_times(kmp_lane_state *room, double c)
{
    for (size_t l = 0; l < room->w; l++)
        room->at[l] = room->t[l] + c * room->step[l];
}

/* -- stages ------------------------------------------------------------------------------------------ */

#define TERMS(a) ((int)(sizeof(a) / sizeof *(a)))

#define STAGE(number, a, ...)                                                                                          \
    do {                                                                                                               \
        const kmp_lanes_sum sum = {room->y,     room->step, TERMS(a), a, (const double *const[]){__VA_ARGS__},         \
                                   room->stage, pool->place};                                                          \
        kmp_lanes_combine(room->w, (size_t)e->size, &sum);                                                             \
        if (pool->timed)                                                                                               \
            kmp_room_set_times(room, kmp_dop853_c[number]);                                                            \
        evaluate_placed(e, pool, room->stage, k[number]);                                                              \
    } while (0)

void kmp_room_run_stages(kmp_engine *e, kmp_lane_group *pool)
{
    kmp_lane_state *room = &e->room;
    double **k = room->k;
    kmp_fused_sines_take(&pool->sines, KMP_SINES_NEAR, NULL);
    KMP_DOP853_STAGES(STAGE, k);
    kmp_fused_sines_take(&pool->sines, KMP_SINES_ALONE, NULL);
}

void kmp_room_run_dense_stages(kmp_engine *e, kmp_lane_group *pool)
{
    kmp_lane_state *room = &e->room;
    double **k = room->k;
    KMP_DOP853_DENSE_STAGES(STAGE, k);
    for (size_t l = 0; l < room->w; l++) {
        room->dense_bad[l] = room->bad[l] != 0;
        room->bad[l] = 0;
    }
}

/* -- programs ---------------------------------------------------------------------------------------- */

/* The programs of all lanes; some may be NULL. */
enum { PROGRAMS = 4 };

static void list_programs(const kmp_engine *e, const kmp_lane_group *pool, kmp_lanes *program[PROGRAMS])
{
    program[0] = pool->lanes;
    program[1] = pool->complete_lanes;
    program[2] = e->beside[0];
    program[3] = e->beside[1];
}

/* Gives one instance's numbers of a kind to all programs of a lane: of the pool, of quantities, of conditions. */
static void give_lane(kmp_engine *e, const kmp_lane_group *pool, kmp_input_kind kind, size_t l, const double *x)
{
    kmp_lanes *program[PROGRAMS];
    list_programs(e, pool, program);
    for (int k = 0; k < PROGRAMS; k++)
        if (program[k])
            kmp_lanes_set_one(program[k], kind, (int)l, x);
}

void kmp_lane_set_modes(kmp_engine *e, kmp_lane_group *pool, size_t l)
{
    give_lane(e, pool, KMP_IN_MODE, l, e->instances[e->room.who[l]].mode);
}

/* -- in and out -------------------------------------------------------------------------------------- */

/* One instance's numbers of a vector of lanes. */
static void put_lane(double *lanes, size_t w, size_t l, int count, const double *x)
{
    for (size_t k = 0; k < (size_t)count; k++)
        lanes[k * w + l] = x[k];
}

static void take_lane(const double *lanes, size_t w, size_t l, int count, double *x)
{
    for (size_t k = 0; k < (size_t)count; k++)
        x[k] = lanes[k * w + l];
}

void kmp_room_load(kmp_engine *e, kmp_lane_group *pool, size_t l, int i)
{
    kmp_lane_state *room = &e->room;
    kmp_instance *x = &e->instances[i];
    size_t w = room->w;
    const double *scale = x->constants.numbers + e->parameters, *row_scale = scale + e->n;
    room->who[l] = i;
    room->t[l] = x->t;
    room->h[l] = x->h;
    room->error_old[l] = x->error_old;
    room->pivot[l] = x->pivot;
    room->exchange[l] = x->limit;
    room->longest[l] = x->longest;
    room->rejected[l] = x->rejected;
    room->tries[l] = x->tries;
    for (size_t k = 0; k < KMP_SIGN_WORDS; k++)
        room->negative[k * w + l] = x->signs.negative[k];
    if (x->signs.known && !x->rests)
        kmp_fused_sines_put(&pool->sines, (int)l, x->base);
    kmp_room_find_limit(e, l);
    put_lane(room->y, w, l, e->size, x->y);
    put_lane(room->k[1], w, l, e->size, x->dy);
    put_lane(room->scale, w, l, e->n, scale);
    put_lane(room->row_scale, w, l, e->m, row_scale);
    for (int k = 0; k < e->n; k++)
        room->per_scale[(size_t)k * w + l] = 1 / scale[k];
    for (int k = 0; k < e->m; k++)
        room->per_row_scale[(size_t)k * w + l] = 1 / row_scale[k];
    kmp_start_tolerances(e->p, pool->part.u, e->r, pool->part.v, kmp_model_coordinates(e->s->model), scale,
                         e->spec.atol, x->rate_scale, (ptrdiff_t)w, room->atol + l);
    if (e->s->dissipative)
        room->atol[(size_t)(2 * e->p + e->r) * w + l] = KMP_UNCONTROLLED;
    if (room->vdd)
        put_lane(room->vdd, w, l, e->n + e->m, x->vdd);
    if (room->nu)
        put_lane(room->nu, w, l, e->m, x->nu);
    give_lane(e, pool, KMP_IN_PARAMETER, l, x->constants.numbers);
    kmp_event_tracker *watching = kmp_lane_watching(e, l);
    if (!watching)
        return;
    kmp_event_tracker_take(watching, x->mode, x->constants.numbers, &x->inputs, x->past);
    kmp_lane_set_modes(e, pool, l);
}

void kmp_room_count_made(kmp_engine *e, size_t l)
{
    kmp_lane_state *room = &e->room;
    kmp_ensemble_result *result = &e->results[room->who[l]];
    result->steps += (long)room->made[l];
    result->rejected += (long)room->repeated[l];
    result->rhs += 12 * (long)room->made[l] + 11 * (long)room->repeated[l];
    room->made[l] = room->repeated[l] = room->spare[l] = 0;
}

void kmp_room_store(kmp_engine *e, size_t l)
{
    kmp_lane_state *room = &e->room;
    kmp_instance *x = &e->instances[room->who[l]];
    kmp_room_count_made(e, l);
    x->t = room->t[l];
    x->h = room->h[l];
    x->error_old = room->error_old[l];
    x->pivot = room->pivot[l];
    x->rejected = room->rejected[l];
    for (size_t k = 0; k < KMP_SIGN_WORDS; k++)
        x->signs.negative[k] = room->negative[k * room->w + l];
    x->tries = (int)room->tries[l];
    take_lane(room->y, room->w, l, e->size, x->y);
    take_lane(room->k[1], room->w, l, e->size, x->dy);
    if (room->vdd)
        take_lane(room->vdd, room->w, l, e->n + e->m, x->vdd);
    if (room->nu)
        take_lane(room->nu, room->w, l, e->m, x->nu);
}

void kmp_room_empty(kmp_lane_state *room, size_t l)
{
    room->who[l] = -1;
    room->step[l] = 0;
    room->error_old[l] = 1;
    room->made[l] = room->repeated[l] = room->spare[l] = 0;
    room->gaps = true;
}

void kmp_lane_evict(kmp_engine *e, size_t l, const char *why)
{
    kmp_lane_state *room = &e->room;
    kmp_room_store(e, l);
    e->results[room->who[l]].why = why;
    room->out[room->out_count++] = room->who[l];
    kmp_room_empty(room, l);
}

kempe_status kmp_room_run_expelled(kmp_engine *e, kmp_lane_group *pool)
{
    kempe_status status = KEMPE_OK;
    for (int k = 0; k < e->room.out_count && status == KEMPE_OK; k++) {
        int i = e->room.out[k];
        const kmp_instance *x = &e->instances[i];
        double margin = x->seen_t >= 0 ? fmin(1, x->seen_margin) : 1;
        status = kmp_instance_apart(e, pool, i, margin, e->results[i].why);
    }
    e->room.out_count = 0;
    return status;
}

/* -- first steps ------------------------------------------------------------------------------------- */

/* The sum of ((a - b) / w)^2 of a lane, in the weights of the room; b NULL: 0. */
static double square_of(const kmp_engine *e, size_t l, const double *a, const double *b)
{
    const kmp_lane_state *room = &e->room;
    return kmp_start_square(e->size, (ptrdiff_t)room->w, a + l, b ? b + l : NULL, room->weight + l);
}

/* First steps as in rk.c; an instance whose evaluation fails is left to a separate run. */
static void choose_steps(kmp_engine *e, kmp_lane_group *pool)
{
    kmp_lane_state *room = &e->room;
    double slope[KMP_LANES_MOST] = {0};
    for (size_t l = 0; l < room->w; l++) {
        const kmp_instance *x = room->who[l] >= 0 ? &e->instances[room->who[l]] : NULL;
        room->step[l] = room->bad[l] = 0;
        if (!x || x->has_step)
            continue;
        for (size_t k = l; k < (size_t)e->size * room->w; k += room->w)
            room->weight[k] = room->atol[k] + e->spec.rtol * fabs(room->y[k]);
        slope[l] = square_of(e, l, room->k[1], NULL);
        room->step[l] = kmp_start_euler(slope[l], square_of(e, l, room->y, NULL), room->limit[l] - room->t[l]);
    }
    for (size_t k = 0; k < (size_t)e->size * room->w; k++)
        room->stage[k] = room->y[k] + room->step[k % room->w] * room->k[1][k];
    kmp_room_set_times(room, 1);
    kmp_room_evaluate(e, pool, room->stage, room->k[2]);
    for (size_t l = 0; l < room->w; l++) {
        kmp_instance *x = room->who[l] >= 0 ? &e->instances[room->who[l]] : NULL;
        if (!x || x->has_step)
            continue;
        x->has_step = true;
        e->results[room->who[l]].rhs++;
        const double h = room->step[l], change = square_of(e, l, room->k[2], room->k[1]);
        room->h[l] = kmp_start_step(h, fmax(sqrt(change) / h, sqrt(slope[l])), kmp_dop853.numbers.order,
                                    room->limit[l] - room->t[l]);
        if (room->bad[l] != 0)
            kmp_lane_evict(e, l, "a right-hand side that cannot be evaluated");
    }
}

void kmp_room_find_accelerations(const kmp_engine *e, const kmp_lane_group *pool, const double *end,
                                 const double *slope, double *vdd)
{
    size_t w = e->room.w, p = (size_t)e->p, r = (size_t)e->r;
    size_t closures = (size_t)kmp_writer_closure_count(e->s);
    const double *b = end + (size_t)(pool->layout.multipliers + pool->layout.pivots) * w + closures * w;
    const double *a0 = b + (p * r + r) * w, *udd = slope + p * w;
    memcpy(vdd, a0, r * w * sizeof *vdd);
    for (size_t c = 0; c < p; c++)
        for (size_t k = 0; k < r * w; k++)
            vdd[k] += b[c * r * w + k] * udd[c * w + k % w];
    if (!e->room.late)
        return;
    double *lambda = vdd + (size_t)e->n * w;
    memset(lambda, 0, (size_t)e->m * w * sizeof *lambda);
    for (size_t i = 0; i < r; i++)
        memcpy(lambda + (size_t)pool->part.rows[i] * w, a0 + (r + i) * w, w * sizeof *lambda);
}

void kmp_room_begin(kmp_engine *e, kmp_lane_group *pool)
{
    kmp_lane_state *room = &e->room;
    bool choose = false;
    for (size_t l = 0; l < room->w; l++)
        room->step[l] = room->bad[l] = 0;
    kmp_lanes *program[PROGRAMS];
    list_programs(e, pool, program);
    for (int k = 0; k < PROGRAMS; k++)
        if (program[k])
            (void)kmp_lanes_run(program[k], KMP_STAGE_PARAMETERS);
    kmp_room_set_times(room, 0);
    int64_t renewed[KMP_LANES_MOST];
    for (size_t l = 0; l < room->w; l++)
        renewed[l] = room->who[l] >= 0 && kmp_instance_is_new(&e->instances[room->who[l]]);
    kmp_fused_sines_take(&pool->sines, KMP_SINES_RENEW, renewed);
    kmp_room_evaluate(e, pool, room->y, room->k[2]);
    kmp_fused_sines_take(&pool->sines, KMP_SINES_ALONE, NULL);
    const double *end = kmp_lanes_run(pool->lanes, KMP_REDUCED_PROGRAM_END), *pivot = kmp_lanes_pivots(e, pool, end);
    uint64_t negative[KMP_SIGN_WORDS * KMP_LANES_MOST];
    kmp_lanes_signs(room->w, pool->layout.pivots, pool->pivot_block, pivot, negative);
    if (room->vdd)
        kmp_room_find_accelerations(e, pool, end, room->k[2], room->vdd_new);
    for (size_t l = 0; l < room->w; l++) {
        kmp_instance *x = room->who[l] >= 0 ? &e->instances[room->who[l]] : NULL;
        if (!x || !kmp_instance_is_new(x))
            continue;
        if (room->bad[l] != 0) {
            kmp_lane_evict(e, l, "a right-hand side that cannot be evaluated");
            continue;
        }
        for (size_t k = l; !x->signs.known && k < KMP_SIGN_WORDS * room->w; k += room->w)
            room->negative[k] = negative[k];
        room->pivot[l] = x->signs.known ? room->pivot[l] : 0;
        x->signs.known = true;
        x->rests = false;
        for (size_t k = l; room->vdd && k < ((size_t)e->n + (size_t)e->m) * room->w; k += room->w)
            room->vdd[k] = room->vdd_new[k];
        for (size_t k = l; room->nu && k < (size_t)e->m * room->w; k += room->w)
            room->nu[k] = room->nu_now[k];
        if (x->has_slope)
            continue;
        for (size_t k = l; k < (size_t)e->size * room->w; k += room->w)
            room->k[1][k] = room->k[2][k];
        x->has_slope = true;
        e->results[room->who[l]].rhs++;
        choose = choose || !x->has_step;
    }
    if (choose)
        choose_steps(e, pool);
}
