/* SPDX-License-Identifier: BSD-3-Clause */
/* The saddle system as a program: it is made once its cost, in operations, is less than what the evaluations of a run
 * would save. It serves corrections and closings as a kmp_closer, too, with the factors of its last run. */
#include "constraints/programs/saddle_program.h"
#include "base/arena.h"
#include "base/context.h"
#include "base/memory.h"
#include "constraints/evaluation/charts.h"
#include "constraints/programs/load_newton.h"
#include "constraints/programs/load_passes.h"
#include "constraints/programs/program_records.h"
#include "constraints/programs/program_writer.h"
#include "constraints/tolerances.h"
#include "dynamics/choose_variants.h"
#include "dynamics/equations.h"
#include "dynamics/motion.h"
#include "model/data/state.h"
#include "symbolic/contraction.h"
#include <float.h>
#include <kempe/kempe.h>
#include <limits.h>
#include <math.h>
#include <stdbool.h>
#include <string.h>

/* The solution of the saddle system written out, on the outputs of a motion program. By M and C it is L D L' of
 *
 *     [M J'; J 0] (qdd; -lambda) = (-C; -jdqd),
 *
 * in which each multiplier is eliminated after its coordinates: its pivot is the pivot of -S. By articulated bodies the
 * motion program has the solution. */

/* A way to solve, before anything is written. */
typedef struct elimination {
    bool by_bodies;
    int pivots;         /* n and r, or r by articulated bodies, which need no elimination: */
    kmp_writer_ldl ldl; /* of n + r unknowns */
    double operations;
} elimination;

/* State of the writer. */
typedef struct maker {
    const kmp_evaluator *eval;
    const kempe_system *s;
    const kmp_partition *part;
    const kmp_reduction *red; /* of the state (u, ud, v); NULL: of q and qd */
    kmp_writer_blocks jv;     /* of such a state */
    kmp_ref *rate, *right;    /* r: qd of v; right-hand side */
    bool closes;              /* of such a state */
    kmp_ref *first, *left;    /* r: correction of v; the one that is left */
    kmp_arena arena;
    elimination plan;
    kmp_program_writer w;
    kmp_load_newton loads; /* the multipliers that C has */
    kmp_graph *g;
    int n, r, size;
    int *position;             /* m: of a row among the unknowns; -1: it is not independent */
    kmp_ref *matrix;           /* size x size */
    kmp_ref *x;                /* size */
    kmp_ref *qdd, *dx, *open;  /* n */
    kmp_ref *lambda;           /* r */
    kmp_ref *pivot, *diagonal; /* size */
    kmp_ref power;
} maker;

/* -- choice -------------------------------------------------------------------------------------------- */

static void couple(unsigned char *pattern, int size, int i, int j)
{
    if (i >= 0 && j >= 0)
        pattern[(size_t)i * (size_t)size + (size_t)j] = pattern[(size_t)j * (size_t)size + (size_t)i] = 1;
}

/* False: no memory. */
static bool analyse(maker *k, bool by_bodies, elimination *p)
{
    const kempe_system *s = k->s;
    double source = kmp_writer_operations(k->eval, by_bodies);
    *p = (elimination){.by_bodies = by_bodies, .operations = source, .pivots = by_bodies ? k->r : k->n + k->r};
    if (by_bodies)
        return source >= 0;
    int size = k->n + k->r;
    unsigned char *pattern = KMP_NEW(unsigned char, (size_t)size *(size_t)size);
    if (pattern) {
        /* Pairs of unknowns that M or J couple. */
        const int *position = k->position;
        const kmp_pattern *mass = &s->mass, *jacobian = &s->jacobian;
        for (int i = 0; i < mass->count; i++)
            couple(pattern, size, mass->row[i], mass->col[i]);
        for (int i = 0; i < jacobian->count; i++)
            if (position[jacobian->row[i]] >= 0)
                couple(pattern, size, k->n + position[jacobian->row[i]], jacobian->col[i]);
    }
    bool made = pattern && kmp_writer_ldl_analyse(&p->ldl, &k->arena, size, k->n, pattern);
    kmp_free(pattern);
    p->operations += (double)p->ldl.operations;
    return made && source >= 0;
}

/* Plans the cheaper way; by articulated bodies there is none where forces depend on multipliers. False: no memory. */
static bool choose(maker *k)
{
    elimination other;
    bool bodies = k->eval->by_bodies;
    bool forced = bodies && (k->s->dynamics == KMP_DYNAMICS_ARTICULATED ||
                             kmp_eval_goes_by_links(k->eval)); /* M need not be made */
    const bool loaded = k->s->load_row_count > 0;
    if (!analyse(k, forced, &k->plan))
        return false;
    if (forced && loaded)
        k->plan.operations = INFINITY;
    if (!bodies || forced || loaded)
        return true;
    if (!analyse(k, true, &other))
        return false;
    if (other.operations < k->plan.operations)
        k->plan = other;
    return true;
}

/* -- solution ------------------------------------------------------------------------------------------ */

static void put_entry(maker *k, int i, int j, kmp_ref value)
{
    if (i >= 0 && j >= 0)
        k->matrix[i * k->size + j] = k->matrix[j * k->size + i] = value;
}

/* Solves x, which has minus the right-hand sides of M and J, for coordinates (n) and multipliers (r, NULL: not wanted).
 */
static void solve(maker *k, kmp_ref *coordinates, kmp_ref *multipliers)
{
    kmp_writer_ldl_solve(&k->plan.ldl, k->g, k->plan.ldl.size, k->x);
    for (int i = 0; i < k->n; i++)
        coordinates[i] = k->x[i];
    for (int i = 0; multipliers && i < k->r; i++)
        multipliers[i] = kmp_neg(k->x[k->n + i]);
}

/* -- program ------------------------------------------------------------------------------------------- */

static bool has_factors(const maker *k)
{
    return !k->red && !k->plan.by_bodies;
}

static kmp_saddle_program_layout lay_out(const maker *k)
{
    const kempe_system *s = k->s;
    kmp_saddle_program_layout l = {
        .n = k->n, .r = k->r, .pivots = k->size, .multipliers = k->jv.multipliers, .stage = KMP_SADDLE_PROGRAM_RUN};
    l.lambda = k->red ? k->part->p : k->n;
    l.rates = s->force ? 0 : l.lambda;
    l.power = l.lambda + (k->red && s->force ? 0 : k->r);
    l.pivot = l.power + s->dissipative;
    l.power = s->dissipative ? l.power : -1;
    l.diagonal = l.pivot + l.pivots;
    l.left = l.diagonal + l.pivots;
    l.turns = k->w.turns.count;
    l.jacobian = l.h + s->m;
    l.h_t = s->rheonomic ? l.jacobian + s->jacobian.count : -1;
    l.open = kmp_writer_closure_count(s);
    l.multiplier = l.open + k->n;
    l.dv = l.multiplier + k->jv.multipliers;
    l.by_bodies = k->plan.by_bodies;
    l.factors = has_factors(k) ? k->plan.ldl.start[k->size] + k->size : 0;
    return l;
}

static kmp_program *schedule(maker *k)
{
    kmp_program_writer *w = &k->w;
    int closures = kmp_writer_closure_count(k->s), factors = has_factors(k) ? k->plan.ldl.start[k->size] + k->size : 0;
    int loaded = w->load ? kmp_load_newton_outputs(&k->loads, w) : 0;
    if (!kmp_writer_room(w, 4 * k->n + 6 * k->r + w->turns.count + k->jv.multipliers + 1 + 2 * k->size + closures +
                                factors + loaded))
        return NULL;
    kmp_writer_stage(w);
    kmp_writer_put(w, k->closes ? k->r : 0, k->first);
    kmp_writer_put(w, w->turns.count, w->turns.angle);
    kmp_writer_stage(w);
    if (k->red && k->s->force)
        kmp_writer_put(w, k->r, k->rate);
    if (w->load)
        kmp_load_newton_put(&k->loads, w);
    kmp_writer_stage(w);
    for (int i = 0; k->red && i < k->part->p; i++)
        kmp_writer_put(w, 1, &k->qdd[k->part->u[i]]);
    if (k->red && !k->s->force)
        kmp_writer_put(w, k->r, k->rate);
    if (!k->red) {
        kmp_writer_put(w, k->n, k->qdd);
        kmp_writer_put(w, k->r, k->lambda);
    }
    kmp_writer_put(w, k->s->dissipative, &k->power);
    kmp_writer_put(w, k->size, k->pivot);
    kmp_writer_put(w, k->size, k->diagonal);
    kmp_writer_put(w, k->closes ? k->r : 0, k->left);
    if (w->load && !kmp_load_newton_separate(w))
        return NULL;
    kmp_writer_stage(w);
    kmp_writer_put(w, closures, w->closure);
    kmp_writer_put(w, k->n, k->open);
    kmp_writer_put(w, k->jv.multipliers, k->jv.multiplier);
    const bool rows = k->red && !k->closes;
    kmp_writer_put(w, rows ? k->r : 0, k->left);
    kmp_writer_stage(w);
    if (!k->red)
        kmp_writer_put(w, k->n, k->dx);
    for (int i = 0; rows && i < k->r; i++)
        kmp_writer_put(w, 1, &k->qdd[k->part->v[i]]);
    kmp_writer_put(w, rows ? k->r : 0, k->lambda);
    kmp_writer_stage(w);
    if (has_factors(k)) {
        kmp_writer_put(w, k->plan.ldl.start[k->size], k->plan.ldl.l);
        kmp_writer_put(w, k->size, k->plan.ldl.inverse);
    }
    return kmp_writer_program(w);
}

/* Efforts are inputs of articulated bodies, zero without the user's force. */
static bool begin_writing(maker *k)
{
    int efforts = k->plan.by_bodies && !k->s->force ? k->n : 0, rows = k->plan.by_bodies ? k->s->m : 0;
    if (!kmp_writer_init(&k->w, k->eval, NULL, k->plan.by_bodies,
                         efforts + rows + (k->red ? 2 * k->n : 0) + k->s->load_row_count))
        return false;
    k->g = k->w.g;
    for (int i = 0; i < efforts; i++)
        kmp_writer_replace(&k->w, KMP_IN_EFFORT, i, KMP_ZERO);
    for (int r = 0; r < rows; r++)
        kmp_writer_replace(&k->w, KMP_IN_KEPT, r, k->position[r] >= 0 ? KMP_ONE : KMP_ZERO);
    k->size = k->plan.pivots;
    k->matrix = KMP_ARENA_NEW(&k->arena, kmp_ref, (size_t)k->size * (size_t)k->size);
    KMP_ARENA_EACH(&k->arena, kmp_ref, k->r, &k->lambda, &k->rate, &k->right, &k->first, &k->left);
    if (k->red)
        kmp_writer_take_state(&k->w, k->part);
    if (k->closes && !kmp_writer_close(&k->w, k->jv, k->first))
        return false;
    KMP_ARENA_EACH(&k->arena, kmp_ref, k->size, &k->x, &k->pivot, &k->diagonal);
    if (!kmp_load_newton_init(&k->loads, &k->w, k->part))
        return false;
    return KMP_ARENA_EACH(&k->arena, kmp_ref, k->n, &k->qdd, &k->dx, &k->open) && kmp_writer_import(&k->w);
}

/* qd of v: -Jv^-1 (Ju ud + h_t). */
static bool make_rates(maker *k)
{
    if (!kmp_writer_blocks_init(&k->jv, &k->arena, k->g, k->w.jacobian))
        return false;
    for (int i = 0; i < k->r; i++) {
        k->right[i] = k->w.h_t ? k->w.h_t[k->part->rows[i]] : KMP_ZERO;
        for (int c = 0; c < k->part->p; c++)
            kmp_writer_add_product(k->g, &k->right[i], k->jv.ju[i * k->part->p + c],
                                   kmp_writer_rate(&k->w, k->part, k->part->u[c]));
        k->right[i] = kmp_neg(k->right[i]);
    }
    for (int number = kmp_block_count(k->red->block); number-- > 0;) {
        kmp_writer_blocks_factor(&k->jv, number);
        kmp_writer_blocks_solve(&k->jv, number, 1, k->right, k->rate);
    }
    kmp_writer_blocks_correct(&k->jv, k->w.h, k->right, k->left);
    return k->s->force || kmp_writer_take_rates(&k->w, k->part, k->rate);
}

/* By articulated bodies. */
static bool take_solution(maker *k)
{
    for (int i = 0; i < k->n; i++) {
        k->qdd[i] = k->w.bias[i];
        k->open[i] = k->w.open[i];
        k->dx[i] = k->w.correction[i];
    }
    for (int i = 0; i < k->r; i++) {
        const int row = k->part->rows[i];
        k->lambda[i] = k->w.jdqd[row];
        k->pivot[i] = k->w.pivots[row];
        k->diagonal[i] = k->w.diagonals[row];
    }
    return true;
}

/* The multipliers that C has, by the rows of the inverse that belong to them: minus the solution there. False: no
 * memory. */
static bool make_loads(maker *k)
{
    for (int j = 0; k->w.load && j < k->loads.count; j++) {
        kmp_ref constant = KMP_ZERO;
        for (int i = 0; i < k->size; i++)
            k->x[i] = i == k->n + k->loads.at[j] ? KMP_ONE : KMP_ZERO;
        kmp_writer_ldl_solve(&k->plan.ldl, k->g, k->size, k->x);
        for (int i = 0; i < k->r; i++)
            kmp_writer_add_product(k->g, &constant, k->x[k->n + i], k->w.jdqd[k->part->rows[i]]);
        kmp_load_newton_take(&k->loads, &k->w, k->part, j, k->x, constant);
    }
    if (k->w.load)
        kmp_load_newton_solve(&k->loads, k->g);
    return !kmp_graph_failed(k->g);
}

/* By M and C. False: no memory, or a pivot is zero. */
static bool write_solution(maker *k)
{
    const kmp_pattern *mass = &k->s->mass, *jacobian = &k->s->jacobian;
    const kmp_writer_ldl *ldl = &k->plan.ldl;
    for (int e = 0; e < mass->count; e++)
        put_entry(k, mass->row[e], mass->col[e], k->w.mass[e]);
    for (int e = 0; e < jacobian->count; e++)
        if (k->position[jacobian->row[e]] >= 0)
            put_entry(k, k->n + k->position[jacobian->row[e]], jacobian->col[e], k->w.jacobian[e]);
    if (!kmp_writer_ldl_factor(&k->plan.ldl, &k->arena, k->g, k->matrix) || !make_loads(k))
        return false;
    /* The right side, and the accelerations and multipliers. */
    for (int i = 0; i < k->n; i++)
        k->x[i] = kmp_neg(k->w.bias[i]);
    for (int i = 0; i < k->r; i++)
        k->x[k->n + i] = kmp_neg(k->w.jdqd[k->part->rows[i]]);
    solve(k, k->qdd, k->lambda);
    /* Pivots of M and S, which are positive. */
    for (int i = 0; i < k->size; i++) {
        k->pivot[i] = i >= k->n ? kmp_neg(ldl->pivot[i]) : ldl->pivot[i];
        k->diagonal[i] = i >= k->n ? kmp_neg(ldl->diagonal[i]) : ldl->diagonal[i];
    }
    /* Accelerations with the loops open. */
    for (int i = 0; i < k->n; i++)
        k->x[i] = kmp_neg(k->w.bias[i]);
    kmp_writer_ldl_solve(ldl, k->g, ldl->leading, k->x);
    for (int i = 0; i < k->n; i++)
        k->open[i] = k->x[i];
    /* The mass-orthogonal correction. */
    for (int i = 0; i < k->n; i++)
        k->x[i] = KMP_ZERO;
    for (int i = 0; i < k->r; i++)
        k->x[k->n + i] = kmp_neg(kmp_input(k->g, KMP_IN_MU, (uint32_t)k->part->rows[i]));
    solve(k, k->dx, NULL);
    return true;
}

/* NULL: no memory, or a pivot is zero. */
static kmp_program *write_program(maker *k)
{
    if (k->red && !make_rates(k))
        return NULL;
    kmp_writer_add_efforts(&k->w);
    if (!(k->plan.by_bodies ? take_solution(k) : write_solution(k)))
        return NULL;
    /* Power of all that does work besides the potential: -lambda' h_t is the power of moving closures. */
    k->power = k->w.power;
    for (int i = 0; k->s->force && i < k->n; i++) {
        kmp_ref rate = kmp_writer_rate(&k->w, k->red ? k->part : NULL, i);
        kmp_writer_add_product(k->g, &k->power, kmp_input(k->g, KMP_IN_EFFORT, (uint32_t)i), rate);
    }
    for (int i = 0; k->w.h_t && i < k->r; i++)
        kmp_writer_add_product(k->g, &k->power, kmp_neg(k->lambda[i]), k->w.h_t[k->part->rows[i]]);
    return schedule(k);
}

static bool place_rows(maker *k)
{
    k->position = KMP_ARENA_NEW(&k->arena, int, k->part->m);
    for (int i = 0; k->position && i < k->part->m; i++)
        k->position[i] = -1;
    for (int i = 0; k->position && i < k->r; i++)
        k->position[k->part->rows[i]] = i;
    return k->position;
}

const char *kmp_saddle_program_obstacle(const kempe_system *s, int unknowns)
{
    const kmp_program *known = kmp_motion_known(s);
    return known && known->block_count > 0          ? "the model has equations that are solved by iteration"
           : unknowns > KMP_SADDLE_PROGRAM_UNKNOWNS ? "the model has too many coordinates and constraint equations"
                                                    : NULL;
}

double kmp_saddle_program_operations(const kmp_evaluator *eval, const kmp_partition *part)
{
    if (eval->by_products || kmp_saddle_program_obstacle(eval->system, part->n + part->r))
        return INFINITY;
    const kmp_program_cache_name name = kmp_writer_name("operations", eval, part, NULL, 0);
    const double *kept = kmp_program_cache_find(eval->system, name);
    if (kept)
        return *kept;
    maker k = {.eval = eval, .s = eval->system, .part = part, .n = part->n, .r = part->r};
    double operations = place_rows(&k) && choose(&k) ? k.plan.operations : -1;
    kmp_arena_free(&k.arena);
    operations = operations > KMP_SADDLE_PROGRAM_OPERATIONS ? INFINITY : operations;
    double *made = operations >= 0 ? KMP_NEW(double, 1) : NULL;
    if (made) {
        *made = operations;
        (void)kmp_program_cache_add(eval->system, name, made, kmp_free);
    }
    return operations;
}

bool kmp_saddle_program_write(const kmp_evaluator *eval, const kmp_saddle_program_plan *requested,
                              kmp_saddle_program_written *written)
{
    const kmp_partition *part = requested->part;
    unsigned options = (requested->red != NULL) + 2u * requested->closes;
    *written = (kmp_saddle_program_written){0};
    const bool loaded = eval->system->load_row_count > 0, waits = requested->closes || eval->system->force;
    if (kmp_saddle_program_obstacle(eval->system, part->n + part->r) ||
        (requested->red && ((loaded && waits) || !kmp_writer_blocks_fit(requested->red))))
        return true;
    const kmp_program_cache_name name = kmp_writer_name("solved", eval, part, requested->order, options);
    kmp_saddle_program_layout layout;
    kmp_program_record record = {.layout = (int *)&layout, .count = sizeof layout / sizeof(int)};
    if (kmp_writer_recall(eval->system, name, &record)) {
        *written = (kmp_saddle_program_written){record.program, layout, record.row};
        return true;
    }
    maker k = {.eval = eval,
               .s = eval->system,
               .part = part,
               .red = requested->red,
               .closes = requested->closes,
               .jv = {.red = requested->red, .order = requested->order},
               .n = part->n,
               .r = part->r};
    unsigned long failures = kmp_memory_failures();
    if (place_rows(&k) && choose(&k) && k.plan.operations <= KMP_SADDLE_PROGRAM_OPERATIONS && begin_writing(&k)) {
        written->program = write_program(&k);
        written->layout = lay_out(&k);
        written->row = kmp_writer_rows(&k.jv);
    }
    kmp_writer_free(&k.w);
    kmp_arena_free(&k.arena);
    if (kmp_memory_failures() != failures) {
        kmp_program_free(written->program);
        kmp_free(written->row);
        *written = (kmp_saddle_program_written){0};
        return false;
    }
    layout = written->layout;
    record.program = written->program;
    record.row = written->row;
    record.multipliers = layout.multipliers;
    if (written->program)
        kmp_writer_keep(eval->system, name, &record);
    return true;
}

/* Cost of making the program, in operations for each operation of the program: measured by bench/bench_evaluations.c,
 * 450 to 1200. */
#define MAKING 700.0
/* Fewer evaluations than this belong to some dozen steps, which nearly every run takes. */
#define AT_ONCE 200.0

struct kmp_saddle_program {
    kmp_evaluator *eval;
    kmp_arena arena;
    kmp_writer_machine made;
    kmp_saddle_program_layout layout;
    double *effort;        /* n: user-defined forces; NULL: there are none */
    kmp_load_passes loads; /* of multipliers that forces depend on; without room: there are none */
    const double *end;     /* outputs of the last END */
};

/* -- making -------------------------------------------------------------------------------------------- */

/* Solves for the multipliers that forces depend on. False: they do not settle. */
static bool settle_loads(kmp_saddle_program *program)
{
    if (!program->loads.nu)
        return true;
    kmp_load_begin(&program->loads, program->eval->nu);
    return kmp_load_settle_one(&program->loads, program->made.machine);
}

kempe_status kmp_saddle_program_new(kmp_saddle_program **out, kmp_evaluator *eval, const kmp_partition *part)
{
    const kempe_system *s = eval->system;
    kmp_saddle_program_written written = {0};
    bool good = false;
    *out = NULL;
    kmp_saddle_program *program = KMP_NEW(kmp_saddle_program, 1);
    if (program)
        *program = (kmp_saddle_program){.eval = eval};
    double *still = program ? KMP_ARENA_NEW(&program->arena, double, s->n) : NULL;
    if (still && s->force)
        program->effort = KMP_ARENA_NEW(&program->arena, double, s->n);
    const kmp_saddle_program_plan plan = {.part = part};
    bool made = still && (!eval->nu || kmp_load_passes_init(&program->loads, &program->arena, s, part, 1)) &&
                !program->arena.failed && kmp_saddle_program_write(eval, &plan, &written);
    kmp_free(written.row); /* no elimination of v */
    if (!made || (written.program && !kmp_writer_machine_init(&program->made, eval, written.program))) {
        kmp_saddle_program_free(program);
        return kmp_fail_memory(s->context);
    }
    program->layout = written.layout;
    if (written.program) {
        /* Pivots do not depend on rates and efforts, which may be zero here. */
        kmp_machine_set(program->made.machine, KMP_IN_QD, still);
        kmp_writer_machine_place(&program->made, eval->t, eval->q);
        (void)settle_loads(program);
        good = kmp_saddle_program_is_good(&program->layout,
                                          kmp_machine_run(program->made.machine, KMP_SADDLE_PROGRAM_RUN), 1);
    }
    if (good)
        *out = program;
    else
        kmp_saddle_program_free(program);
    return KEMPE_OK;
}

void kmp_saddle_program_free(kmp_saddle_program *program)
{
    if (!program)
        return;
    kmp_writer_machine_free(&program->made);
    kmp_arena_free(&program->arena);
    kmp_free(program);
}

const kmp_saddle_program_layout *kmp_saddle_program_layout_of(const kmp_saddle_program *program)
{
    return &program->layout;
}

kmp_counts kmp_saddle_program_count(const kmp_saddle_program *program)
{
    const kmp_program *p = program->made.program;
    return program->loads.nu ? kmp_load_count(p, KMP_SADDLE_PROGRAM_RUN)
                             : kmp_program_count(p, KMP_SADDLE_PROGRAM_RATES, KMP_SADDLE_PROGRAM_RUN);
}

long kmp_saddle_program_wait(const kmp_evaluator *eval, const kmp_partition *part, double operations, bool lanes)
{
    double own = kmp_saddle_program_operations(eval, part), saved = operations - own;
    if (own < 0 || (lanes && isfinite(own)))
        return own < 0 ? -1 : 0;
    double wait = saved > 0 ? MAKING * own / saved : INFINITY;
    return wait < AT_ONCE ? 0 : wait < 1e9 ? (long)wait : LONG_MAX;
}

/* -- running ------------------------------------------------------------------------------------------- */

bool kmp_saddle_program_applies(kmp_saddle_program *program)
{
    return kmp_writer_machine_applies(&program->made) && !program->eval->outer.given;
}

bool kmp_saddle_program_is_stale(kmp_saddle_program *program)
{
    return kmp_writer_machine_is_stale(&program->made);
}

bool kmp_saddle_program_is_good(const kmp_saddle_program_layout *layout, const double *out, int stride)
{
    const double *pivot = out + layout->pivot * stride, *diagonal = out + layout->diagonal * stride;
    for (int k = 0; k < layout->pivots; k++)
        if (!(pivot[k * stride] > KMP_SADDLE_PROGRAM_PIVOT * diagonal[k * stride]))
            return false;
    return true;
}

const double *kmp_saddle_program_run(kmp_saddle_program *program, double t, const double *q, const double *qd,
                                     bool *good)
{
    kmp_writer_machine_place(&program->made, t, q);
    kmp_machine_set(program->made.machine, KMP_IN_QD, qd);
    if (program->effort) {
        kmp_system_effort(program->eval->system, t, q, qd, program->effort);
        kmp_machine_set(program->made.machine, KMP_IN_EFFORT, program->effort);
    }
    const bool settled = settle_loads(program);
    if (program->loads.nu && settled) /* from which the next state begins */
        memcpy(program->eval->nu, program->loads.nu, (size_t)program->loads.m * sizeof(double));
    const double *out = kmp_machine_run(program->made.machine, KMP_SADDLE_PROGRAM_RUN);
    *good = settled && kmp_saddle_program_is_good(&program->layout, out, 1);
    return out;
}

const double *kmp_saddle_program_end(kmp_writer_machine *made, const kmp_saddle_program_layout *l, kmp_evaluator *eval,
                                     double t, const double *q)
{
    const double *out = kmp_machine_run(made->machine, KMP_SADDLE_PROGRAM_END);
    kmp_eval_use_closure(eval, t, q, out + l->h, out + l->jacobian, l->h_t >= 0 ? out + l->h_t : NULL);
    return out;
}

void kmp_saddle_program_lend(kmp_saddle_program *program, double t, const double *q)
{
    program->end = kmp_saddle_program_end(&program->made, &program->layout, program->eval, t, q);
}

bool kmp_saddle_program_cancels(const kmp_saddle_program_layout *l, const kempe_system *s, const double *end,
                                double rtol, double rate_scale)
{
    const double *open = end + l->open;
    double most = 0;
    for (int i = 0; l->r > 0 && i < kmp_model_coordinates(s->model); i++)
        most = isfinite(open[i]) ? fmax(most, fabs(open[i]) / s->scale[i]) : INFINITY;
    return DBL_EPSILON * most > KMP_MARGIN_CANCELLED * rtol * rate_scale * rate_scale;
}

bool kmp_saddle_program_is_cancelled(const kmp_saddle_program *program, double rtol, double rate_scale)
{
    return kmp_saddle_program_cancels(&program->layout, program->eval->system, program->end, rtol, rate_scale);
}

void kmp_saddle_program_correct(kmp_saddle_program *program, const double *violation, double *dx)
{
    kmp_machine_set(program->made.machine, KMP_IN_MU, violation);
    memcpy(dx, kmp_machine_run(program->made.machine, KMP_SADDLE_PROGRAM_CORRECT),
           (size_t)program->layout.n * sizeof *dx);
}

/* -- closing ------------------------------------------------------------------------------------------- */

static int place(void *self, double t, const double *q)
{
    kmp_saddle_program_closing *closing = self;
    bool good;
    (void)kmp_saddle_program_run(closing->program, t, q, closing->qd, &good);
    kmp_saddle_program_lend(closing->program, t, q);
    return !good;
}

static bool correct(void *self, const double *violation, double *dx)
{
    kmp_saddle_program_closing *closing = self;
    kmp_saddle_program_correct(closing->program, violation, dx);
    return true;
}

kmp_closer kmp_saddle_program_closer(kmp_saddle_program_closing *closing, double *dx)
{
    kmp_evaluator *eval = closing->program->eval;
    return (kmp_closer){.self = closing,
                        .eval = eval,
                        .scale = eval->system->scale,
                        .count = eval->n,
                        .dx = dx,
                        .place = place,
                        .correct = correct};
}

const kmp_program *kmp_saddle_program_code(const kmp_saddle_program *program)
{
    return program->made.program;
}

kempe_status kmp_saddle_program_write_nearby(const kmp_saddle_program *program, const kmp_partition *part,
                                             kmp_program **nearby)
{
    *nearby = NULL;
    if (program->effort || program->loads.nu || program->layout.factors == 0)
        return KEMPE_OK;
    double run = (double)kmp_saddle_program_count(program).paper;
    return kmp_saddle_program_write_near(program->eval, part, run, nearby)
               ? KEMPE_OK
               : kmp_fail_memory(program->eval->system->context);
}

/* Accelerations and multipliers near the place of known factors: one residual, one solution, no factors. The residual
 * is taken from Newton and Euler's equations with J' lambda, shorter than M qdd + C - J' lambda. */

typedef struct writer {
    const kmp_evaluator *eval;
    const kempe_system *s;
    const kmp_partition *part;
    int n, r, count; /* of `value` */
    kmp_arena arena;
    kmp_writer_ldl ldl;
    kmp_program *source; /* of the values */
    kmp_graph *g;
    kmp_ref *value;   /* residual (n), curves (r), h_t (r) where closures move, power where there is one */
    kmp_ref *x, *out; /* n + r, and n + r + 1 */
} writer;

/* False: no memory, or there are no such equations. */
static bool write_nearby(writer *w)
{
    kmp_equations eq;
    kmp_events events = w->s->events; /* the system has recorded all conditions: none is added */
    unsigned sets = KMP_SET_CLOSURE | KMP_SET_JDQD | KMP_SET_CLOSED;
    const kmp_derivation_request scene = {
        .sets = sets | (w->s->dissipative ? KMP_SET_POWER : 0), .events = &events, .charted = true, .plain = true};
    if (kmp_equations_derive(&eq, w->s->model, &scene) != KEMPE_OK)
        return false;
    bool made = eq.n == w->n && eq.m == w->s->m;
    kmp_ref *value = w->value = KMP_ARENA_NEW(&w->arena, kmp_ref, w->n + 2 * w->r + 1);
    for (int i = 0; made && value && i < w->n; i++)
        value[w->count++] = eq.dynamics.closed[i];
    for (int i = 0; made && value && i < w->r; i++)
        value[w->count++] = kmp_equations_curve(&eq, w->part->rows[i]);
    for (int i = 0; made && value && w->s->rheonomic && i < w->r; i++)
        value[w->count++] = eq.closures.h_t[w->part->rows[i]];
    if (made && value && w->s->dissipative)
        value[w->count++] = eq.energy.power;
    const kmp_ref *group = value;
    w->source = made && value ? kmp_program_new(eq.graph, 1, &w->count, &group) : NULL;
    kmp_equations_free(&eq);
    return w->source;
}

/* Charts become numbers, as in the saddle program; multipliers are numbered by independent rows. */
static bool import(writer *w)
{
    int m = w->s->m, charts = KMP_CHART_SIZE * w->s->chart_count;
    kmp_ref *input, *by, *all = KMP_ARENA_NEW(&w->arena, kmp_ref, w->source->outputs[w->source->stages]);
    w->g = kmp_graph_new();
    if (!KMP_ARENA_EACH(&w->arena, kmp_ref, m + charts, &input, &by) || !w->g || !all)
        return false;
    for (int i = 0; i < m; i++) {
        input[i] = kmp_input(w->g, KMP_IN_LAMBDA, (uint32_t)i);
        by[i] = KMP_ZERO;
    }
    for (int i = 0; i < w->r; i++)
        by[w->part->rows[i]] = kmp_input(w->g, KMP_IN_LAMBDA, (uint32_t)i);
    int inputs = m + kmp_writer_plain_charts(w->eval, w->g, input + m, by + m);
    const kmp_importing how = {.count = inputs, .input = input, .by = by};
    if (!kmp_program_import(w->source, w->g, &how, all))
        return false;
    memcpy(w->value, all + w->source->outputs[1], (size_t)w->count * sizeof *w->value);
    return true;
}

static bool take_factors(writer *w)
{
    int entries = w->ldl.start[w->ldl.size];
    w->ldl.l = KMP_ARENA_NEW(&w->arena, kmp_ref, entries);
    w->ldl.inverse = KMP_ARENA_NEW(&w->arena, kmp_ref, w->ldl.size);
    if (!w->ldl.l || !w->ldl.inverse)
        return false;
    for (int e = 0; e < entries; e++)
        w->ldl.l[e] = kmp_input(w->g, KMP_IN_MU, (uint32_t)e);
    for (int i = 0; i < w->ldl.size; i++)
        w->ldl.inverse[i] = kmp_input(w->g, KMP_IN_MU, (uint32_t)(entries + i));
    return true;
}

/* NULL: no memory. */
static kmp_program *improve(writer *w)
{
    int n = w->n, r = w->r, count = n + r + w->s->dissipative;
    kmp_graph *g = w->g;
    w->x = KMP_ARENA_NEW(&w->arena, kmp_ref, n + r);
    w->out = KMP_ARENA_NEW(&w->arena, kmp_ref, count);
    if (!w->x || !w->out)
        return NULL;
    for (int i = 0; i < n + r; i++)
        w->x[i] = kmp_neg(w->value[i]);
    kmp_writer_ldl_solve(&w->ldl, g, w->ldl.size, w->x);
    for (int i = 0; i < n; i++)
        w->out[i] = kmp_add(g, kmp_input(g, KMP_IN_QDD, (uint32_t)i), w->x[i]);
    for (int i = 0; i < r; i++)
        w->out[n + i] = kmp_sub(g, kmp_input(g, KMP_IN_LAMBDA, (uint32_t)i), w->x[n + i]);
    kmp_ref power = w->s->dissipative ? w->value[w->count - 1] : KMP_ZERO;
    for (int i = 0; w->s->rheonomic && i < r; i++)
        kmp_writer_add_product(g, &power, kmp_neg(w->out[n + i]), w->value[n + r + i]);
    if (w->s->dissipative)
        w->out[n + r] = power;
    const kmp_ref *group = w->out;
    kmp_program *p = kmp_graph_failed(g) ? NULL : kmp_program_new(g, 1, &count, &group);
    if (!p || kmp_program_contract(p, 0, 0))
        return p;
    kmp_program_free(p);
    return NULL;
}

bool kmp_saddle_program_write_near(const kmp_evaluator *eval, const kmp_partition *part, double run,
                                   kmp_program **program)
{
    unsigned most = run < UINT_MAX ? (unsigned)run : UINT_MAX;
    const kmp_program_cache_name name = kmp_writer_name("nearby", eval, part, NULL, most);
    kmp_program_record record = {0};
    *program = NULL;
    if (kmp_writer_recall(eval->system, name, &record)) {
        kmp_free(record.row);
        *program = record.program;
        return true;
    }
    writer w = {.eval = eval, .s = eval->system, .part = part, .n = part->n, .r = part->r};
    unsigned long failures = kmp_memory_failures();
    /* The order of elimination by M and C, in the arena. */
    maker k = {.eval = eval, .s = eval->system, .part = part, .n = part->n, .r = part->r};
    bool ordered = place_rows(&k) && analyse(&k, false, &k.plan);
    w.arena = k.arena;
    w.ldl = k.plan.ldl;
    /* Short enough, with a residual that has about the operations of M, C, J and gamma. */
    double solution = ordered ? 4.0 * w.ldl.start[w.ldl.size] + w.ldl.size : INFINITY;
    if (ordered && kmp_writer_operations(eval, false) + solution <= KMP_SADDLE_PROGRAM_NEARBY * run &&
        write_nearby(&w) && import(&w) && take_factors(&w))
        *program = improve(&w);
    kmp_program_free(w.source);
    kmp_graph_free(w.g);
    kmp_arena_free(&w.arena);
    if (kmp_memory_failures() != failures) {
        kmp_program_free(*program);
        *program = NULL;
        return false;
    }
    record.program = *program;
    kmp_writer_keep(eval->system, name, &record);
    return true;
}
