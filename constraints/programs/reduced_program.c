/* SPDX-License-Identifier: BSD-3-Clause */
/* The reduced right-hand side as a program: it is written, run once at the state at rest, and kept if its pivots are
 * good there. After a run the factors are checked by the same bounds, and a step's end can lend h, J, Bvu and the
 * correction of v from its last stage. */
#include "constraints/programs/reduced_program.h"
#include "base/arena.h"
#include "base/memory.h"
#include "constraints/closing/close.h"
#include "constraints/programs/load_newton.h"
#include "constraints/programs/load_passes.h"
#include "constraints/programs/program_records.h"
#include "constraints/programs/program_writer.h"
#include "constraints/programs/saddle_program.h"
#include "dynamics/motion.h"
#include <float.h>
#include <math.h>
#include <string.h>

/* The linear algebra of a reduction written out, on the outputs of the motion program. Blocks of one and two rows are
 * solved by their determinant, larger ones by elimination in a given order. */

/* State of the writer. */
typedef struct maker {
    const kmp_reduction *red;
    kmp_program_writer w;
    kmp_graph *g; /* its graph */
    const kmp_reduced_program_plan *plan;
    int n, p, r;
    kmp_writer_blocks jv;
    kmp_ref *h, *h_t, *jdqd; /* r, of the independent rows; h_t is NULL if there is none */
    kmp_ref *b, *x_t, *a0;   /* r x p row by row, r, r */
    kmp_ref *dv;             /* r: the correction of v */
    kmp_ref *first;          /* r: the one before, with which v is closed */
    kmp_ref *rate;           /* r: qd of v */
    kmp_ref *mx;             /* n x p, row by row */
    kmp_ref *ma;             /* n: M a0, where the source has products and forces are written */
    kmp_load_newton loads;   /* the multipliers that C has */
    kmp_ref *column;         /* r x r: of Jv^-1, by independent rows, where they are needed */
    kmp_ref *lambda;         /* r */
    kmp_ref *vdd;            /* r: qdd of v */
} maker;

/* Factors of the reduced mass, L D L'. */
typedef struct reduced {
    kmp_ref m[KMP_REDUCED_PROGRAM_MOST][KMP_REDUCED_PROGRAM_MOST], inverse[KMP_REDUCED_PROGRAM_MOST];
} reduced;

static void negate(int count, kmp_ref *x)
{
    for (int i = 0; i < count; i++)
        x[i] = kmp_neg(x[i]);
}

/* Rows of independent closures in the order of the partition, selected from all rows. */
static void select_rows(const maker *k, const kmp_ref *all, kmp_ref *into)
{
    for (int i = 0; i < k->r; i++)
        into[i] = all[k->red->part->rows[i]];
}

/* Entry of X = (1; Bvu) in the row of a coordinate. */
static kmp_ref x_entry(const maker *k, int coordinate, int column)
{
    int place = k->red->place[coordinate];
    if (place >= 0)
        return k->b[place * k->p + column];
    return -1 - place == column ? KMP_ONE : KMP_ZERO;
}

/* Mr = X' M X, lower triangle, and -Fr = -X' C - (M X)' a0. */
static void make_reduced(maker *k, kmp_ref mr[KMP_REDUCED_PROGRAM_MOST][KMP_REDUCED_PROGRAM_MOST],
                         kmp_ref force[KMP_REDUCED_PROGRAM_MOST])
{
    for (int c = 0; c < k->p; c++) {
        force[c] = KMP_ZERO;
        for (int i = 0; i < k->n; i++) {
            kmp_writer_add_product(k->g, &force[c], x_entry(k, i, c), k->w.bias[i]);
            if (k->red->place[i] >= 0)
                kmp_writer_add_product(k->g, &force[c], k->mx[i * k->p + c], k->a0[k->red->place[i]]);
        }
        force[c] = kmp_neg(force[c]);
        for (int d = 0; d <= c; d++) {
            mr[c][d] = KMP_ZERO;
            for (int i = 0; i < k->n; i++)
                kmp_writer_add_product(k->g, &mr[c][d], x_entry(k, i, c), k->mx[i * k->p + d]);
        }
    }
}

/* Factors Mr = L D L' in place. The pivots D are returned, too. */
static void factor_reduced(maker *k, reduced *mr, kmp_ref *pivot)
{
    kmp_graph *g = k->g;
    for (int j = 0; j < k->p; j++) {
        pivot[j] = mr->m[j][j];
        mr->inverse[j] = kmp_div(g, KMP_ONE, pivot[j]);
        for (int i = j + 1; i < k->p; i++) {
            kmp_ref l = kmp_mul(g, mr->m[i][j], mr->inverse[j]);
            for (int c = j + 1; c <= i; c++)
                mr->m[i][c] = kmp_sub(g, mr->m[i][c], kmp_mul(g, l, mr->m[c][j]));
        }
        for (int i = j + 1; i < k->p; i++)
            mr->m[i][j] = kmp_mul(g, mr->m[i][j], mr->inverse[j]);
    }
}

/* x = Mr^-1 x */
static void solve_reduced(const maker *k, const reduced *mr, kmp_ref *x)
{
    kmp_graph *g = k->g;
    for (int i = 0; i < k->p; i++)
        for (int j = 0; j < i; j++)
            x[i] = kmp_sub(g, x[i], kmp_mul(g, mr->m[i][j], x[j]));
    for (int i = k->p - 1; i >= 0; i--) {
        x[i] = kmp_mul(g, x[i], mr->inverse[i]);
        for (int j = i + 1; j < k->p; j++)
            x[i] = kmp_sub(g, x[i], kmp_mul(g, mr->m[j][i], x[j]));
    }
}

/* Adds to a force of coordinate i the force of the accelerations a0. */
static void add_curvature(const maker *k, int i, kmp_ref *force)
{
    const kmp_pattern *m = &k->w.s->mass;
    if (k->ma)
        *force = kmp_add(k->g, *force, k->ma[i]);
    for (int e = 0; !k->ma && e < m->count; e++) {
        int other = m->row[e] == i ? m->col[e] : m->col[e] == i ? m->row[e] : -1;
        if (other >= 0 && k->red->place[other] >= 0)
            kmp_writer_add_product(k->g, force, k->w.mass[e], k->a0[k->red->place[other]]);
    }
}

/* The force of coordinate i, among v, that M qdd + C leaves to the closures. */
static kmp_ref force_of(const maker *k, int i, const kmp_ref *udd)
{
    kmp_ref force = k->w.bias[i];
    for (int c = 0; c < k->p; c++)
        kmp_writer_add_product(k->g, &force, k->mx[i * k->p + c], udd[c]);
    add_curvature(k, i, &force);
    return force;
}

/* -- multipliers -------------------------------------------------------------------------------------- */

/* The multiplier of load row j as it follows from C: influence' C + the value returned. udd = -Mr^-1 (X' C + (M X)' a0)
 * is left out. */
static kmp_ref find_influence(maker *k, const reduced *mr, int j, kmp_ref *influence)
{
    /* The column of Jv^-1 of the row: its multiplier is the product with the forces of v. */
    kmp_ref *column = k->column + k->loads.at[j] * k->r, *unit = k->lambda; /* which is written later */
    for (int i = 0; i < k->r; i++)
        unit[i] = i == k->loads.at[j] ? KMP_ONE : KMP_ZERO;
    for (int number = kmp_block_count(k->red->block); number-- > 0;)
        kmp_writer_blocks_solve(&k->jv, number, 1, unit, column);
    kmp_ref z[KMP_REDUCED_PROGRAM_MOST] = {0}, constant = KMP_ZERO;
    for (int i = 0; i < k->n; i++) {
        int place = k->red->place[i];
        kmp_ref force = KMP_ZERO;
        influence[i] = place >= 0 ? column[place] : KMP_ZERO;
        for (int c = 0; place >= 0 && c < k->p; c++)
            kmp_writer_add_product(k->g, &z[c], column[place], k->mx[i * k->p + c]);
        if (place >= 0)
            add_curvature(k, i, &force);
        if (place >= 0)
            kmp_writer_add_product(k->g, &constant, column[place], force);
    }
    solve_reduced(k, mr, z);
    for (int i = 0; i < k->n; i++)
        for (int c = 0; c < k->p; c++) {
            kmp_ref less = kmp_neg(z[c]);
            kmp_writer_add_product(k->g, &influence[i], less, x_entry(k, i, c));
            if (k->red->place[i] >= 0)
                kmp_writer_add_product(k->g, &constant, less,
                                       kmp_mul(k->g, k->mx[i * k->p + c], k->a0[k->red->place[i]]));
        }
    return constant;
}

/* Newton's method for the multipliers that C has. False: no memory. */
static bool make_loads(maker *k, const reduced *mr)
{
    kmp_ref *influence = KMP_ARENA_NEW(&k->w.arena, kmp_ref, k->n);
    if (!influence)
        return false;
    for (int j = 0; j < k->loads.count; j++) {
        kmp_ref constant = find_influence(k, mr, j, influence);
        kmp_load_newton_take(&k->loads, &k->w, k->red->part, j, influence, constant);
    }
    kmp_load_newton_solve(&k->loads, k->g);
    return true;
}

/* The multipliers of all independent rows. False: no memory. */
static bool make_multipliers(maker *k, const kmp_ref *udd)
{
    kmp_ref *force = KMP_ARENA_NEW(&k->w.arena, kmp_ref, k->r);
    if (!force)
        return false;
    for (int i = 0; i < k->n; i++)
        if (k->red->place[i] >= 0)
            force[k->red->place[i]] = force_of(k, i, udd);
    kmp_writer_blocks_solve_transposed(&k->jv, force, k->lambda);
    return true;
}

/* -- making ------------------------------------------------------------------------------------------ */

/* Writes the last stage. */
static kmp_program *finish(maker *k)
{
    kmp_program_writer *w = &k->w;
    kmp_writer_stage(w);
    kmp_writer_put(w, k->jv.multipliers, k->jv.multiplier);
    kmp_writer_put(w, k->jv.pivots, k->jv.pivot);
    kmp_writer_put(w, kmp_writer_closure_count(w->s), w->closure);
    for (int c = 0; c < k->p; c++)
        for (int i = 0; i < k->r; i++)
            kmp_writer_put(w, 1, &k->b[i * k->p + c]);
    kmp_writer_put(w, k->r, k->dv);
    if (k->plan->closes)
        kmp_writer_put(w, k->r, k->x_t);
    if (k->plan->closes || k->plan->curvature)
        kmp_writer_put(w, k->r, k->a0);
    if (k->plan->forces)
        kmp_writer_put(w, k->r, k->lambda);
    if (k->plan->rows) {
        kmp_writer_stage(w);
        kmp_writer_put(w, k->r, k->vdd);
        kmp_writer_put(w, k->r, k->lambda);
    }
    return kmp_writer_program(w);
}

/* The stages before the last one, where C depends on multipliers. False: no memory. */
static bool schedule_loads(maker *k, const kmp_ref *end)
{
    kmp_writer_stage(&k->w);
    kmp_writer_stage(&k->w);
    kmp_load_newton_put(&k->loads, &k->w);
    kmp_writer_stage(&k->w);
    kmp_writer_put(&k->w, k->p, end);
    kmp_writer_put(&k->w, k->r, k->rate);
    kmp_writer_put(&k->w, k->p, end + k->p);
    kmp_writer_put(&k->w, k->plan->power, &k->w.power);
    return kmp_load_newton_separate(&k->w);
}

/* Writes the outputs of all stages; `end`: udd, then the pivots of the reduced mass. */
static kmp_program *schedule(maker *k, const kmp_ref *end)
{
    kmp_program_writer *w = &k->w;
    int closures = kmp_writer_closure_count(w->s);
    int loaded = w->load ? kmp_load_newton_outputs(&k->loads, w) : 0;
    if (!kmp_writer_room(w, 9 * k->r + 2 * k->p + 1 + w->turns.count + k->jv.multipliers + k->jv.pivots + closures +
                                k->r * k->p + loaded))
        return NULL;
    if (w->load)
        return schedule_loads(k, end) ? finish(k) : NULL;
    kmp_writer_stage(w);
    if (k->plan->closes) {
        kmp_writer_put(w, k->r, k->first);
        kmp_writer_put(w, w->turns.count, w->turns.angle);
    }
    kmp_writer_stage(w);
    if (!w->s->force)
        kmp_writer_put(w, k->p, end);
    kmp_writer_put(w, k->r, k->rate);
    if (!w->s->force) {
        kmp_writer_put(w, k->p, end + k->p);
        kmp_writer_put(w, k->plan->power, &w->power);
    }
    if (k->plan->closes)
        kmp_writer_put(w, k->r, k->dv);
    kmp_writer_stage(w);
    if (w->s->force) {
        kmp_writer_put(w, 2 * k->p, end);
        kmp_writer_put(w, k->plan->power, &w->power);
    }
    return finish(k);
}

/* The right-hand side in one stage. */
static kmp_program *schedule_slopes(maker *k, const kmp_ref *end)
{
    kmp_program_writer *w = &k->w;
    const int count = k->p + k->r + 2;
    kmp_ref least = k->p > 0 ? end[k->p] : KMP_ONE, excess = kmp_writer_blocks_excess(&k->jv);
    if (w->load || !kmp_writer_room(w, count))
        return NULL;
    for (int c = 1; c < k->p; c++)
        least = kmp_binary(k->g, KMP_OP_MIN, least, end[k->p + c]);
    kmp_writer_stage(w);
    kmp_writer_put(w, k->p, end);
    kmp_writer_put(w, k->r, k->rate);
    kmp_writer_put(w, 1, &least);
    kmp_writer_put(w, 1, &excess);
    return kmp_graph_failed(k->g) ? NULL : kmp_program_of_parameters(k->g, count, w->group[0]);
}

/* M X, and M a0 where it is needed for itself. False: no memory. */
static bool make_mass_times(maker *k)
{
    const kmp_pattern *m = &k->w.s->mass;
    for (int e = 0; k->w.mass && e < m->count; e++)
        for (int c = 0; c < k->p; c++) {
            int i = m->row[e], j = m->col[e];
            kmp_writer_add_product(k->g, &k->mx[i * k->p + c], k->w.mass[e], x_entry(k, j, c));
            if (i != j)
                kmp_writer_add_product(k->g, &k->mx[j * k->p + c], k->w.mass[e], x_entry(k, i, c));
        }
    if (k->w.mass)
        return true;
    kmp_ref *x = KMP_ARENA_NEW(&k->w.arena, kmp_ref, k->n), *product = KMP_ARENA_NEW(&k->w.arena, kmp_ref, k->n);
    bool made = x && product;
    for (int c = 0; made && c < k->p; c++) {
        for (int i = 0; i < k->n; i++)
            x[i] = x_entry(k, i, c);
        made = kmp_writer_product(&k->w, x, product);
        for (int i = 0; made && i < k->n; i++)
            k->mx[i * k->p + c] = product[i];
    }
    if (!made || !(k->plan->forces || k->plan->rows || (k->plan->drives && k->h_t)))
        return made;
    for (int i = 0; i < k->n; i++)
        x[i] = k->red->place[i] >= 0 ? k->a0[k->red->place[i]] : KMP_ZERO;
    k->ma = product;
    return kmp_writer_product(&k->w, x, product);
}

static kmp_program *write_program(maker *k)
{
    reduced mr = {0};
    kmp_ref end[2 * KMP_REDUCED_PROGRAM_MOST] = {0};
    select_rows(k, k->w.h, k->h);
    if (k->h_t)
        select_rows(k, k->w.h_t, k->h_t);
    if (!kmp_writer_blocks_init(&k->jv, &k->w.arena, k->g, k->w.jacobian))
        return NULL;
    /* Bvu, x_t and the correction: -Jv^-1 of Ju, h_t and h. */
    for (int number = kmp_block_count(k->red->block); number-- > 0;) {
        kmp_writer_blocks_factor(&k->jv, number);
        kmp_writer_blocks_solve(&k->jv, number, k->p, k->jv.ju, k->b);
        if (k->h_t)
            kmp_writer_blocks_solve(&k->jv, number, 1, k->h_t, k->x_t);
        kmp_writer_blocks_solve(&k->jv, number, 1, k->h, k->dv);
    }
    negate(k->r * k->p, k->b);
    negate(k->r, k->x_t);
    negate(k->r, k->dv);
    /* qd of v. */
    for (int i = 0; i < k->r; i++) {
        k->rate[i] = k->x_t[i];
        for (int c = 0; c < k->p; c++)
            kmp_writer_add_product(k->g, &k->rate[i], k->b[i * k->p + c],
                                   kmp_writer_rate(&k->w, k->red->part, k->red->part->u[c]));
    }
    /* Without user-defined forces, which are functions of qd, the rates of v are expressions. */
    if (!k->w.s->force && !kmp_writer_take_rates(&k->w, k->red->part, k->rate))
        return NULL;
    kmp_writer_add_efforts(&k->w);
    select_rows(k, k->w.jdqd, k->jdqd);
    /* a0 = -Jv^-1 jdqd. */
    for (int number = kmp_block_count(k->red->block); number-- > 0;)
        kmp_writer_blocks_solve(&k->jv, number, 1, k->jdqd, k->a0);
    negate(k->r, k->a0);
    if (!make_mass_times(k))
        return NULL;
    make_reduced(k, mr.m, end);
    factor_reduced(k, &mr, end + k->p);
    solve_reduced(k, &mr, end);
    if (k->w.by_coordinate)
        return schedule_slopes(k, end);
    /* Adds the power of closures that move in time, -lambda' h_t. The multipliers are Jv'^-1 f with the forces f of v
     * that M qdd + C leaves to the closures, so that the power is f' x_t. */
    for (int i = 0; k->plan->drives && k->h_t && i < k->n; i++) {
        int place = k->red->place[i];
        if (place >= 0 && k->x_t[place] != KMP_ZERO)
            kmp_writer_add_product(k->g, &k->w.power, force_of(k, i, end), k->x_t[place]);
    }
    const bool forces = k->plan->forces || k->plan->rows;
    if ((k->w.load && !make_loads(k, &mr)) || (forces && !make_multipliers(k, end)))
        return NULL;
    for (int i = 0; k->plan->rows && i < k->r; i++) {
        k->vdd[i] = k->a0[i];
        for (int c = 0; c < k->p; c++)
            kmp_writer_add_product(k->g, &k->vdd[i], k->b[i * k->p + c], end[c]);
    }
    return schedule(k, end);
}

static kmp_program *make_program(maker *k, bool by_coordinate)
{
    const kempe_system *s = k->red->eval->system;
    bool begun = kmp_writer_init(&k->w, k->red->eval, k->plan->motion, false, 2 * k->n + s->load_row_count);
    k->g = k->w.g;
    k->w.by_coordinate = by_coordinate;
    if (!begun)
        return NULL;
    kmp_arena *a = &k->w.arena;
    int r = k->r;
    k->mx = KMP_ARENA_NEW(a, kmp_ref, k->n * k->p);
    k->h_t = k->w.s->rheonomic ? KMP_ARENA_NEW(a, kmp_ref, r) : NULL;
    k->b = KMP_ARENA_NEW(a, kmp_ref, r * k->p);
    k->column = KMP_ARENA_NEW(a, kmp_ref, r * r);
    if (!KMP_ARENA_EACH(a, kmp_ref, r, &k->h, &k->jdqd, &k->x_t, &k->a0, &k->dv, &k->first, &k->rate, &k->lambda,
                        &k->vdd) ||
        !k->column || !kmp_load_newton_init(&k->loads, &k->w, k->red->part))
        return NULL;
    kmp_writer_take_state(&k->w, k->red->part);
    if (k->plan->closes && !kmp_writer_close(&k->w, k->jv, k->first))
        return NULL;
    return kmp_writer_import(&k->w) ? write_program(k) : NULL;
}

static maker maker_of(const kmp_reduction *red, const kmp_reduced_program_plan *plan)
{
    return (maker){
        .red = red, .plan = plan, .jv = {.red = red, .order = plan->order}, .n = red->n, .p = red->p, .r = red->r};
}

kmp_program *kmp_reduced_program_write_slopes(const kmp_reduction *red, const kmp_reduced_program_plan *plan)
{
    maker k = maker_of(red, plan);
    kmp_program *program = make_program(&k, true);
    kmp_writer_free(&k.w);
    return program;
}

kmp_reduced_program_written kmp_reduced_program_write(const kmp_reduction *red, const kmp_reduced_program_plan *plan)
{
    const kempe_system *s = red->eval->system;
    unsigned options = plan->power + 2u * plan->closes + 4u * plan->drives + 8u * plan->curvature + 16u * plan->forces +
                       32u * red->eval->by_products + 64u * plan->rows;
    const kmp_program_cache_name name = kmp_writer_name("fused", red->eval, red->part, plan->order, options);
    kmp_reduced_program_layout layout;
    kmp_program_record record = {.layout = (int *)&layout, .count = sizeof layout / sizeof(int)};
    if (kmp_writer_recall(s, name, &record))
        return (kmp_reduced_program_written){record.program, record.row, layout};
    maker k = maker_of(red, plan);
    record.program = make_program(&k, false);
    record.row = record.program ? kmp_writer_rows(&k.jv) : NULL;
    layout = (kmp_reduced_program_layout){k.jv.multipliers, k.jv.pivots, k.w.turns.count};
    kmp_writer_free(&k.w);
    if (!record.row) {
        kmp_program_free(record.program);
        return (kmp_reduced_program_written){0};
    }
    record.multipliers = layout.multipliers;
    kmp_writer_keep(s, name, &record);
    return (kmp_reduced_program_written){record.program, record.row, layout};
}

_Static_assert((int)KMP_REDUCED_PROGRAM_CLOSE == KMP_SADDLE_PROGRAM_CLOSE &&
                   (int)KMP_REDUCED_PROGRAM_RATES == KMP_SADDLE_PROGRAM_RATES &&
                   (int)KMP_REDUCED_PROGRAM_END == KMP_SADDLE_PROGRAM_END &&
                   (int)KMP_REDUCED_PROGRAM_ROW == KMP_SADDLE_PROGRAM_ROW,
               "programs by the reduced mass and by the saddle system have their stages in the same order");

struct kmp_reduced_program {
    const kmp_reduction *red;
    bool closes; /* with the stage KMP_REDUCED_PROGRAM_CLOSE */
    bool by_saddle;
    kmp_arena arena;
    kmp_writer_machine made;
    kmp_saddle_program_layout layout;
    kmp_eliminated *row; /* of multipliers */
    int *order, *other;  /* r: of rows in the elimination; room for another */
    int *turn, *signs;   /* of each block of Jv: the factor from its pivots' signs to the block's sign; the block's
                          * sign */
    kmp_writer_efforts given;
    kmp_load_passes loads; /* of multipliers that forces depend on; without room: there are none */
    const double *dv;      /* r: the last correction, where it closes */
    const double *left;    /* r: the one that is left after it */
    const double *power;   /* of the last run */
};

/* Computes the product of the pivots' signs in each block; pivots are written from the last block to the first. false:
 * a pivot is zero or NaN. */
static bool find_signs(const kmp_reduced_program *f, const double *pivot, int *signs)
{
    bool regular = true;
    for (int block = kmp_block_count(f->red->block); block-- > 0;) {
        int size;
        (void)kmp_block_columns(f->red->block, block, &size);
        signs[block] = 1;
        for (int k = size == 2 ? 1 : size; k-- > 0; pivot++) {
            regular = regular && fabs(*pivot) > 0 && fabs(*pivot) <= DBL_MAX;
            signs[block] = *pivot < 0 ? -signs[block] : signs[block];
        }
    }
    return regular;
}

/* Solves for the multipliers that forces depend on. False: they do not settle. */
static bool settle_loads(kmp_reduced_program *f)
{
    if (!f->loads.nu)
        return true;
    kmp_load_begin(&f->loads, f->red->eval->nu);
    return kmp_load_settle_one(&f->loads, f->made.machine);
}

/* Runs the stages before END at a state, with the efforts of the last run. Returns the last outputs. */
static const double *run_stages(kmp_reduced_program *f, double t, const double *y)
{
    kmp_writer_machine_place(&f->made, t, y);
    if (f->loads.nu) {
        (void)settle_loads(f);
        return kmp_machine_run(f->made.machine, f->layout.stage);
    }
    if (f->closes)
        (void)kmp_machine_run(f->made.machine, KMP_REDUCED_PROGRAM_CLOSE);
    const double *out = kmp_machine_run(f->made.machine, KMP_REDUCED_PROGRAM_RATES);
    return f->by_saddle ? kmp_machine_run(f->made.machine, f->layout.stage) : out;
}

/* -- making ------------------------------------------------------------------------------------------ */

/* *program: NULL if there is none by the saddle system. False: no memory. */
static bool choose_program(kmp_reduced_program *f, kmp_program **program)
{
    const kempe_system *s = f->red->eval->system;
    int p = f->red->p, r = f->red->r;
    if (!KMP_ARENA_MAKE(&f->arena, KMP_ROOM(int, r, &f->order, &f->other)))
        return false;
    kmp_writer_order(f->red, f->order);
    if (f->by_saddle) {
        const kmp_saddle_program_plan plan = {
            .part = f->red->part, .red = f->red, .order = f->order, .closes = f->closes};
        kmp_saddle_program_written written;
        bool made = kmp_saddle_program_write(f->red->eval, &plan, &written);
        f->layout = written.layout;
        f->row = written.row;
        *program = written.program;
        return made;
    }
    const kmp_reduced_program_plan plan = {.order = f->order,
                                           .power = s->dissipative,
                                           .closes = f->closes,
                                           .drives = s->dissipative && s->rheonomic,
                                           .rows = !f->closes};
    kmp_reduced_program_written written = kmp_reduced_program_write(f->red, &plan);
    kmp_saddle_program_layout *l = &f->layout;
    const bool later = s->force || s->load_row_count > 0;
    *l = (kmp_saddle_program_layout){.stage = later ? KMP_REDUCED_PROGRAM_ACCELERATIONS : KMP_REDUCED_PROGRAM_RATES,
                                     .pivots = p,
                                     .multipliers = written.layout.multipliers,
                                     .rates = p,
                                     .pivot = s->force ? p : p + r,
                                     .turns = written.layout.turns,
                                     .h = written.layout.multipliers + written.layout.pivots};
    l->power = l->pivot + p;
    l->left = l->power + s->dissipative;
    l->jacobian = l->h + s->m;
    l->h_t = s->rheonomic ? l->jacobian + s->jacobian.count : -1;
    l->dv = l->h + kmp_writer_closure_count(s) + r * p;
    f->row = written.row;
    *program = written.program;
    return written.program;
}

static kempe_status build_program(kmp_reduced_program **out, const kmp_reduction *red, bool closes, bool by_saddle)
{
    int n = red->n, efforts = red->eval->system->force ? n : 0;
    kmp_reduced_program *f = KMP_NEW(kmp_reduced_program, 1);
    if (f)
        *f = (kmp_reduced_program){.red = red, .closes = closes, .by_saddle = by_saddle};
    kmp_program *program = NULL;
    bool made =
        f && choose_program(f, &program) && (!program || kmp_writer_machine_init(&f->made, red->eval, program)) &&
        KMP_ARENA_MAKE(&f->arena, KMP_ROOM(double, 2 * n, &f->given.state), KMP_ROOM(int, red->r, &f->turn, &f->signs),
                       KMP_ROOM(double, efforts, &f->given.q, &f->given.qd));
    if (made && efforts > 0)
        f->given.effort = KMP_ARENA_NEW(&f->arena, double, efforts);
    if (made && red->eval->nu)
        made = kmp_load_passes_init(&f->loads, &f->arena, red->eval->system, red->part, 1);
    if (!made || f->arena.failed) {
        kmp_reduced_program_free(f);
        return kmp_fail_memory(red->eval->system->context);
    }
    /* The state at rest. */
    for (int c = 0; c < red->p; c++)
        f->given.state[c] = red->eval->q[red->part->u[c]];
    for (int i = 0; i < red->r; i++)
        f->given.state[2 * red->p + i] = red->eval->q[red->part->v[i]];
    const double *there = NULL;
    if (program) {
        kmp_machine_set(f->made.machine, KMP_IN_QD, f->given.state);
        there = run_stages(f, red->eval->t, f->given.state);
    }
    if (by_saddle && (!there || !kmp_saddle_program_is_good(&f->layout, there, 1))) {
        kmp_reduced_program_free(f);
        return KEMPE_OK;
    }
    *out = f;
    if (by_saddle)
        return KEMPE_OK;
    /* The signs of blocks by the signs of their pivots. */
    const double *end = kmp_machine_run(f->made.machine, KMP_REDUCED_PROGRAM_END);
    (void)find_signs(f, end + f->layout.multipliers, f->signs);
    if (red->r > 0)
        kmp_block_take_signs(red->block, f->turn);
    for (int block = kmp_block_count(red->block); block-- > 0;)
        f->turn[block] *= f->signs[block];
    return KEMPE_OK;
}

kempe_status kmp_reduced_program_new(kmp_reduced_program **out, const kmp_reduction *red, bool closes)
{
    *out = NULL;
    const kempe_system *s = red->eval->system;
    /* The program must have all numbers, and the linear algebra be small. */
    bool fits = red->p <= KMP_REDUCED_PROGRAM_FREEDOMS && kmp_eval_program(red->eval, false)->block_count == 0 &&
                kmp_writer_blocks_fit(red) && (s->load_row_count == 0 || (!closes && !s->force));
    return fits ? build_program(out, red, closes, false) : KEMPE_OK;
}

kempe_status kmp_reduced_program_new_by_saddle(kmp_reduced_program **out, const kmp_reduction *red, bool closes)
{
    *out = NULL;
    return build_program(out, red, closes, true);
}

void kmp_reduced_program_free(kmp_reduced_program *f)
{
    if (!f)
        return;
    kmp_writer_machine_free(&f->made);
    kmp_arena_free(&f->arena);
    kmp_free(f->row);
    kmp_free(f);
}

bool kmp_reduced_program_is_by_saddle(const kmp_reduced_program *f)
{
    return f->by_saddle;
}

/* -- running ----------------------------------------------------------------------------------------- */

kmp_writer_correction kmp_reduced_program_close(kmp_reduced_program *f, double t, const double *y)
{
    kmp_writer_correction c =
        kmp_writer_machine_close(&f->made, KMP_REDUCED_PROGRAM_CLOSE, f->red->r, f->layout.turns, t, y);
    f->dv = c.dv;
    return c;
}

const double *kmp_reduced_program_left(const kmp_reduced_program *f)
{
    return f->left;
}

bool kmp_reduced_program_run(kmp_reduced_program *f, double t, const double *y, double *dy)
{
    if (f->closes)
        (void)kmp_reduced_program_close(f, t, y);
    else
        kmp_writer_machine_place(&f->made, t, y);
    return kmp_reduced_program_finish(f, t, y, dy);
}

bool kmp_reduced_program_finish(kmp_reduced_program *f, double t, const double *y, double *dy)
{
    const kmp_saddle_program_layout *l = &f->layout;
    size_t p = (size_t)f->red->p, r = (size_t)f->red->r;
    const double *rates = f->given.effort ? kmp_machine_run(f->made.machine, KMP_REDUCED_PROGRAM_RATES) : NULL;
    if (rates)
        kmp_writer_put_efforts(&f->made, &f->given, f->red->part, t, y, f->closes ? f->dv : NULL, rates);
    const bool settled = settle_loads(f);
    if (f->loads.nu && settled) /* from which the next state begins */
        memcpy(f->red->eval->nu, f->loads.nu, (size_t)f->loads.m * sizeof(double));
    const double *out = kmp_machine_run(f->made.machine, l->stage);
    f->left = rates && !f->by_saddle ? rates + r : out + l->left;
    f->power = out + l->power;
    bool positive = true;
    if (rates || f->by_saddle) {
        memcpy(dy + p, out, p * sizeof *dy);
        memcpy(dy + 2 * p, rates ? rates : out + l->rates, r * sizeof *dy);
    } else { /* one after the other */
        memcpy(dy + p, out, (p + r) * sizeof *dy);
    }
    for (size_t c = 0; c < p; c++) {
        dy[c] = y[p + c];
        positive = positive && (f->by_saddle || out[(size_t)l->pivot + c] > 0);
    }
    return settled && (f->by_saddle ? kmp_saddle_program_is_good(l, out, 1) : positive);
}

double kmp_reduced_program_power(const kmp_reduced_program *f)
{
    double power = *f->power;
    for (int i = 0; f->given.effort && !f->by_saddle && i < f->red->n; i++)
        power += f->given.effort[i] * f->given.qd[i];
    return power;
}

bool kmp_reduced_program_applies(kmp_reduced_program *f)
{
    if (f->by_saddle && f->red->eval->outer.given)
        return false;
    return kmp_writer_machine_applies(&f->made);
}

bool kmp_reduced_program_fits(const kmp_reduced_program *f)
{
    kmp_writer_order(f->red, f->other);
    return memcmp(f->order, f->other, (size_t)f->red->r * sizeof *f->order) == 0;
}

bool kmp_reduced_program_is_stale(kmp_reduced_program *f)
{
    return kmp_writer_machine_is_stale(&f->made);
}

static bool is_good(const kmp_reduced_program *f, const double *end)
{
    return kmp_writer_order_is_good(f->layout.multipliers, f->row, end + f->layout.multiplier,
                                    f->red->eval->system->row_scale, 1);
}

kmp_reduced_program_end kmp_reduced_program_at_end(kmp_reduced_program *f)
{
    const kmp_saddle_program_layout *l = &f->layout;
    const double *out = kmp_machine_run(f->made.machine, KMP_REDUCED_PROGRAM_END);
    kmp_reduced_program_end end = {
        .good = is_good(f, out), .signs = f->signs, .h = out + l->h, .jacobian = out + l->jacobian};
    end.regular = find_signs(f, out + l->multipliers, f->signs);
    for (int block = kmp_block_count(f->red->block); block-- > 0;)
        f->signs[block] *= f->turn[block];
    end.h_t = l->h_t >= 0 ? out + l->h_t : NULL;
    end.bvu = end.h + kmp_writer_closure_count(f->red->eval->system);
    end.dv = end.bvu + f->red->r * f->red->p;
    end.x_t = f->closes ? end.dv + f->red->r : NULL;
    end.a0 = f->closes ? end.x_t + f->red->r : NULL;
    return end;
}

bool kmp_reduced_program_lend(kmp_reduced_program *f, double t, const double *q, double rtol, double rate_scale,
                              bool *cancelled)
{
    const double *end = kmp_saddle_program_end(&f->made, &f->layout, f->red->eval, t, q);
    *cancelled = kmp_saddle_program_cancels(&f->layout, f->red->eval->system, end, rtol, rate_scale);
    return is_good(f, end);
}

bool kmp_reduced_program_is_good(kmp_reduced_program *f, double t, const double *y)
{
    if (f->layout.multipliers == 0 && !f->by_saddle)
        return true;
    const double *out = run_stages(f, t, y);
    return (!f->by_saddle || kmp_saddle_program_is_good(&f->layout, out, 1)) &&
           is_good(f, kmp_machine_run(f->made.machine, KMP_REDUCED_PROGRAM_END));
}

/* -- rows ---------------------------------------------------------------------------------------------- */

static int place(void *self, double t, const double *q)
{
    kmp_reduced_program_row *row = self;
    kmp_reduced_program *f = row->program;
    kmp_evaluator *eval = f->red->eval;
    for (int i = 0; i < f->red->r; i++)
        row->y[2 * f->red->p + i] = q[f->red->part->v[i]];
    bool good = kmp_reduced_program_run(f, t, row->y, row->dy), regular = f->by_saddle;
    const double *end = kmp_saddle_program_end(&f->made, &f->layout, eval, t, q);
    regular = regular || find_signs(f, end + f->layout.multipliers, f->signs);
    row->dv = end + f->layout.dv;
    return !(good && regular && is_good(f, end));
}

static bool correct(void *self, const double *violation, double *dx)
{
    const kmp_reduced_program_row *row = self;
    (void)violation; /* h, in place */
    memcpy(dx, row->dv, (size_t)row->program->red->r * sizeof *dx);
    return true;
}

bool kmp_reduced_program_close_row(kmp_reduced_program_row *row, double t, double *q)
{
    const kmp_reduction *red = row->program->red;
    const kmp_closer closer = {.self = row,
                               .eval = red->eval,
                               .scale = red->eval->system->scale,
                               .count = red->r,
                               .at = red->part->v,
                               .dx = row->dx,
                               .rows = red->part->rows,
                               .row_count = red->r,
                               .place = place,
                               .correct = correct};
    const kmp_close_rule rule = kmp_reduction_close_rule(red);
    const kmp_closed closed = kmp_close(&closer, &rule, t, q);
    row->corrections = closed.corrections;
    return closed.closed;
}

void kmp_reduced_program_rates(const kmp_reduced_program_row *row, double *qd)
{
    const kmp_reduction *red = row->program->red;
    for (int c = 0; c < red->p; c++)
        qd[red->part->u[c]] = row->y[red->p + c];
    for (int i = 0; i < red->r; i++)
        qd[red->part->v[i]] = row->dy[2 * red->p + i];
}

void kmp_reduced_program_complete_row(const kmp_reduced_program_row *row, double *qdd, double *lambda)
{
    const kmp_reduction *red = row->program->red;
    const kmp_partition *part = red->part;
    const double *out = kmp_machine_run(row->program->made.machine, KMP_REDUCED_PROGRAM_ROW);
    for (int c = 0; c < red->p; c++)
        qdd[part->u[c]] = row->dy[red->p + c];
    memset(lambda, 0, (size_t)part->m * sizeof *lambda);
    for (int i = 0; i < red->r; i++) {
        qdd[part->v[i]] = out[i];
        lambda[part->rows[i]] = out[red->r + i];
    }
}

const kmp_program *kmp_reduced_program_code(const kmp_reduced_program *f)
{
    return f->given.effort ? NULL : f->made.program;
}

const kmp_saddle_program_layout *kmp_reduced_program_layout_of(const kmp_reduced_program *f)
{
    return &f->layout;
}

kmp_counts kmp_reduced_program_count(const kmp_reduced_program *f)
{
    const kmp_program *p = f->made.program;
    return f->loads.nu ? kmp_load_count(p, KMP_REDUCED_PROGRAM_ACCELERATIONS)
                       : kmp_program_count(p, KMP_REDUCED_PROGRAM_RATES, KMP_REDUCED_PROGRAM_RATES);
}
