/* SPDX-License-Identifier: BSD-3-Clause */
/* The linear algebra of a reduction written out, on the outputs of the motion program. Blocks of one and two rows are
 * solved by their determinant, larger ones by elimination in a given order. */
#include "base/arena.h"
#include "base/memory.h"
#include "constraints/written/fused_inside.h"
#include "constraints/written/written.h"
#include "constraints/written/written_blocks.h"
#include "constraints/written/written_kept.h"

/* State of the writer. */
typedef struct maker {
    const kmp_reduction *red;
    kmp_written w;
    kmp_graph *g; /* its graph */
    const kmp_fused_plan *plan;
    int n, p, r;
    kmp_written_blocks jv;
    kmp_ref *h, *h_t, *jdqd; /* r, of the independent rows; h_t is NULL if there is none */
    kmp_ref *b, *x_t, *a0;   /* r x p row by row, r, r */
    kmp_ref *dv;             /* r: the correction of v */
    kmp_ref *first;          /* r: the one before, with which v is closed */
    kmp_ref *rate;           /* r: qd of v */
    kmp_ref *mx;             /* n x p, row by row */
} maker;

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

/* Bvu, x_t and the correction: -Jv^-1 of Ju, h_t and h. */
static void make_tangent(maker *k)
{
    for (int number = kmp_block_count(k->red->block); number-- > 0;) {
        kmp_written_blocks_factor(&k->jv, number);
        kmp_written_blocks_solve(&k->jv, number, k->p, k->jv.ju, k->b);
        if (k->h_t)
            kmp_written_blocks_solve(&k->jv, number, 1, k->h_t, k->x_t);
        kmp_written_blocks_solve(&k->jv, number, 1, k->h, k->dv);
    }
    negate(k->r * k->p, k->b);
    negate(k->r, k->x_t);
    negate(k->r, k->dv);
}

/* a0 = -Jv^-1 jdqd. */
static void make_curvature(maker *k)
{
    for (int number = kmp_block_count(k->red->block); number-- > 0;)
        kmp_written_blocks_solve(&k->jv, number, 1, k->jdqd, k->a0);
    negate(k->r, k->a0);
}

/* Entry of X = (1; Bvu) in the row of a coordinate. */
static kmp_ref x_entry(const maker *k, int coordinate, int column)
{
    int place = k->red->place[coordinate];
    if (place >= 0)
        return k->b[place * k->p + column];
    return -1 - place == column ? KMP_ONE : KMP_ZERO;
}

/* M X. */
static void make_mx(maker *k)
{
    const kmp_pattern *m = &k->w.s->mass;
    for (int e = 0; e < m->count; e++)
        for (int c = 0; c < k->p; c++) {
            int i = m->row[e], j = m->col[e];
            kmp_written_add_product(k->g, &k->mx[i * k->p + c], k->w.mass[e], x_entry(k, j, c));
            if (i != j)
                kmp_written_add_product(k->g, &k->mx[j * k->p + c], k->w.mass[e], x_entry(k, i, c));
        }
}

/* Mr = X' M X, lower triangle, and -Fr = -X' C - (M X)' a0. */
static void make_reduced(maker *k, kmp_ref mr[KMP_FUSED_MOST][KMP_FUSED_MOST], kmp_ref force[KMP_FUSED_MOST])
{
    for (int c = 0; c < k->p; c++) {
        force[c] = KMP_ZERO;
        for (int i = 0; i < k->n; i++) {
            kmp_written_add_product(k->g, &force[c], x_entry(k, i, c), k->w.bias[i]);
            if (k->red->place[i] >= 0)
                kmp_written_add_product(k->g, &force[c], k->mx[i * k->p + c], k->a0[k->red->place[i]]);
        }
        force[c] = kmp_neg(force[c]);
        for (int d = 0; d <= c; d++) {
            mr[c][d] = KMP_ZERO;
            for (int i = 0; i < k->n; i++)
                kmp_written_add_product(k->g, &mr[c][d], x_entry(k, i, c), k->mx[i * k->p + d]);
        }
    }
}

/* Factors Mr = L D L' in place and solves for udd in `force`. The pivots D are returned, too. */
static void solve_reduced(maker *k, kmp_ref mr[KMP_FUSED_MOST][KMP_FUSED_MOST], kmp_ref *force, kmp_ref *pivot)
{
    kmp_graph *g = k->g;
    kmp_ref inverse[KMP_FUSED_MOST] = {0};
    for (int j = 0; j < k->p; j++) {
        pivot[j] = mr[j][j];
        inverse[j] = kmp_div(g, KMP_ONE, pivot[j]);
        for (int i = j + 1; i < k->p; i++) {
            kmp_ref l = kmp_mul(g, mr[i][j], inverse[j]);
            for (int c = j + 1; c <= i; c++)
                mr[i][c] = kmp_sub(g, mr[i][c], kmp_mul(g, l, mr[c][j]));
        }
        for (int i = j + 1; i < k->p; i++)
            mr[i][j] = kmp_mul(g, mr[i][j], inverse[j]);
    }
    for (int i = 0; i < k->p; i++)
        for (int j = 0; j < i; j++)
            force[i] = kmp_sub(g, force[i], kmp_mul(g, mr[i][j], force[j]));
    for (int i = k->p - 1; i >= 0; i--) {
        force[i] = kmp_mul(g, force[i], inverse[i]);
        for (int j = i + 1; j < k->p; j++)
            force[i] = kmp_sub(g, force[i], kmp_mul(g, mr[j][i], force[j]));
    }
}

/* qd of v. */
static void make_rates(const maker *k)
{
    for (int i = 0; i < k->r; i++) {
        k->rate[i] = k->x_t[i];
        for (int c = 0; c < k->p; c++)
            kmp_written_add_product(k->g, &k->rate[i], k->b[i * k->p + c],
                                    kmp_written_rate(&k->w, k->red->part, k->red->part->u[c]));
    }
}

/* Adds the power of closures that move in time, -lambda' h_t. The multipliers are Jv'^-1 f with the forces f of v that
 * M qdd + C leaves to the closures, so that the power is f' x_t. */
static void add_drives(maker *k, const kmp_ref *udd)
{
    const kmp_pattern *m = &k->w.s->mass;
    for (int i = 0; k->plan->drives && k->h_t && i < k->n; i++) {
        int place = k->red->place[i];
        if (place < 0 || k->x_t[place] == KMP_ZERO)
            continue;
        kmp_ref force = k->w.bias[i];
        for (int c = 0; c < k->p; c++)
            kmp_written_add_product(k->g, &force, k->mx[i * k->p + c], udd[c]);
        for (int e = 0; e < m->count; e++) {
            int other = m->row[e] == i ? m->col[e] : m->col[e] == i ? m->row[e] : -1;
            if (other >= 0 && k->red->place[other] >= 0)
                kmp_written_add_product(k->g, &force, k->w.mass[e], k->a0[k->red->place[other]]);
        }
        kmp_written_add_product(k->g, &k->w.power, force, k->x_t[place]);
    }
}

/* -- making ------------------------------------------------------------------------------------------ */

static bool allocate(maker *k)
{
    kmp_arena *a = &k->w.arena;
    int r = k->r;
    k->mx = KMP_ARENA_NEW(a, kmp_ref, k->n * k->p);
    k->h_t = k->w.s->rheonomic ? KMP_ARENA_NEW(a, kmp_ref, r) : NULL;
    k->b = KMP_ARENA_NEW(a, kmp_ref, r * k->p);
    return KMP_ARENA_EACH(a, kmp_ref, r, &k->h, &k->jdqd, &k->x_t, &k->a0, &k->dv, &k->first, &k->rate);
}

/* Outputs of the motion program for qd. Without user-defined forces, which are functions of qd, the rates of v are
 * expressions. */
static bool take_motion(maker *k)
{
    if (!k->w.s->force && !kmp_written_take_rates(&k->w, k->red->part, k->rate))
        return false;
    kmp_written_add_efforts(&k->w);
    select_rows(k, k->w.jdqd, k->jdqd);
    return true;
}

/* Writes the outputs of all stages; `end`: udd, then the pivots of the reduced mass. */
static kmp_program *schedule(maker *k, const kmp_ref *end)
{
    kmp_written *w = &k->w;
    int closures = kmp_written_closure_count(w->s);
    if (!kmp_written_room(w, 6 * k->r + 2 * k->p + 1 + w->turns.count + k->jv.multipliers + k->jv.pivots + closures +
                                 k->r * k->p))
        return NULL;
    kmp_written_stage(w);
    if (k->plan->closes) {
        kmp_written_put(w, k->r, k->first);
        kmp_written_put(w, w->turns.count, w->turns.angle);
    }
    kmp_written_stage(w);
    if (!w->s->force)
        kmp_written_put(w, k->p, end);
    kmp_written_put(w, k->r, k->rate);
    if (!w->s->force) {
        kmp_written_put(w, k->p, end + k->p);
        kmp_written_put(w, k->plan->power, &w->power);
    }
    if (k->plan->closes)
        kmp_written_put(w, k->r, k->dv);
    kmp_written_stage(w);
    if (w->s->force) {
        kmp_written_put(w, 2 * k->p, end);
        kmp_written_put(w, k->plan->power, &w->power);
    }
    kmp_written_stage(w);
    kmp_written_put(w, k->jv.multipliers, k->jv.multiplier);
    kmp_written_put(w, k->jv.pivots, k->jv.pivot);
    kmp_written_put(w, closures, w->closure);
    for (int c = 0; c < k->p; c++)
        for (int i = 0; i < k->r; i++)
            kmp_written_put(w, 1, &k->b[i * k->p + c]);
    kmp_written_put(w, k->r, k->dv);
    if (k->plan->closes)
        kmp_written_put(w, k->r, k->x_t);
    if (k->plan->closes || k->plan->curvature)
        kmp_written_put(w, k->r, k->a0);
    return kmp_written_program(w);
}

static kmp_program *write_program(maker *k)
{
    kmp_ref mr[KMP_FUSED_MOST][KMP_FUSED_MOST], end[2 * KMP_FUSED_MOST];
    select_rows(k, k->w.h, k->h);
    if (k->h_t)
        select_rows(k, k->w.h_t, k->h_t);
    if (!kmp_written_blocks_init(&k->jv, &k->w.arena, k->g, k->w.jacobian))
        return NULL;
    make_tangent(k);
    make_rates(k);
    if (!take_motion(k))
        return NULL;
    make_curvature(k);
    make_mx(k);
    make_reduced(k, mr, end);
    solve_reduced(k, mr, end, end + k->p);
    add_drives(k, end);
    return schedule(k, end);
}

static kmp_program *make_program(maker *k)
{
    bool begun = kmp_written_init(&k->w, k->red->eval, false, 2 * k->n);
    k->g = k->w.g;
    if (!begun || !allocate(k))
        return NULL;
    kmp_written_take_state(&k->w, k->red->part);
    if (k->plan->closes && !kmp_written_close(&k->w, k->jv, k->first))
        return NULL;
    return kmp_written_import(&k->w) ? write_program(k) : NULL;
}

static kmp_fused_written write_new(const kmp_reduction *red, const kmp_fused_plan *plan)
{
    maker k = {
        .red = red, .plan = plan, .jv = {.red = red, .order = plan->order}, .n = red->n, .p = red->p, .r = red->r};
    kmp_fused_written written = {.program = make_program(&k)};
    written.row = written.program ? kmp_written_rows(&k.jv) : NULL;
    written.layout = (kmp_fused_layout){k.jv.multipliers, k.jv.pivots, k.w.turns.count};
    kmp_written_free(&k.w);
    if (written.row)
        return written;
    kmp_program_free(written.program);
    return (kmp_fused_written){0};
}

kmp_fused_written kmp_fused_write(const kmp_reduction *red, const kmp_fused_plan *plan)
{
    const kempe_system *s = red->eval->system;
    unsigned options = plan->power + 2u * plan->closes + 4u * plan->drives + 8u * plan->curvature;
    const kmp_kept_name name = kmp_written_name("fused", red->eval, red->part, plan->order, options);
    kmp_fused_layout layout;
    kmp_written_record record = {.layout = (int *)&layout, .count = sizeof layout / sizeof(int)};
    if (kmp_written_recall(s, name, &record))
        return (kmp_fused_written){record.program, record.row, layout};
    kmp_fused_written written = write_new(red, plan);
    layout = written.layout;
    record.program = written.program;
    record.row = written.row;
    record.multipliers = layout.multipliers;
    if (written.program)
        kmp_written_keep(s, name, &record);
    return written;
}
