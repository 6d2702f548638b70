/* SPDX-License-Identifier: BSD-3-Clause */
/* Other assembly modes: starts at random, closed one by one, kept where they differ from all before, and named by the
 * signs of the determinants of Jv's blocks. A watch for a change of the mode follows these signs along a motion; where
 * rows are redundant it chooses the rows with the largest pivots again. */
#include "constraints/closing/assembly_modes.h"
#include "base/memory.h"
#include "constraints/closing/assembly.h"
#include "constraints/evaluation/charts.h"
#include "constraints/tolerances.h"
#include "linalg/dense/dense.h"
#include "model/data/model.h"
#include "model/read/loads.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { STARTS = 200, STARTS_OF_LARGE = 50, LARGE = 40 };
#define TWO_PI   6.283185307179586
#define ROUNDING 1e-13
#define FAR      3.0 /* a translation is sampled within this many characteristic lengths */

/* -- states ------------------------------------------------------------------------------------------ */

bool kmp_state_same(const kempe_system *system, double within, int apart_count, const int *apart, const double *a,
                    const double *b)
{
    for (int c = 0; c < system->chart_count; c++)
        if (!(kmp_chart_apart(system, c, a, b) < within))
            return false;
    for (int k = 0; k < system->n; k++) {
        double off = (a[k] - b[k]) / system->scale[k];
        if (system->model->motions[k].rotation)
            off = remainder(off, TWO_PI);
        if (fabs(off) < within || kmp_chart_of(system, k) >= 0)
            continue;
        int i = 0;
        while (i < apart_count && apart[i] != k)
            i++;
        if (i == apart_count)
            return false;
    }
    return true;
}

bool kmp_state_before(const kempe_system *system, double within, const double *a, const double *b)
{
    int k = 0;
    while (k < system->n && !(fabs(a[k] - b[k]) > within * system->scale[k]))
        k++;
    return k < system->n && a[k] < b[k];
}

kempe_status kmp_random_starts_next(kmp_random_starts *random, kempe_assembly **closed)
{
    const kempe_system *system = random->system;
    for (int k = 0; k < system->n; k++) {
        double reach = system->model->motions[k].rotation ? TWO_PI / 2 : random->far * system->length;
        random->guess[k] = random->from[k];
        if (!random->still[k])
            random->guess[k] += reach * kmp_walk_random(&random->state);
    }
    kmp_guess guess = {random->guess, random->still, 0, false, 0};
    KMP_TRY(kmp_assemble_from(system, &guess, closed));
    random->starts++;
    if ((*closed)->closed) {
        random->closed++;
        return KEMPE_OK;
    }
    kempe_assembly_free(*closed);
    *closed = NULL;
    return KEMPE_OK;
}

/* -- search -------------------------------------------------------------------------------------------- */

/* The most coordinates of a mechanism whose assembly modes are watched: J is dense here. */
enum { MOST_WATCHED = 60 };

typedef struct search {
    kempe_branches *b;
    kmp_walk *walk;
    kmp_partition part; /* r = 0: no signs */
    kmp_loop_block *blocks;
    int block_count;
    double *matrix;
    int *order;
} search;

/* Chooses the kept coordinates: the held ones, or else the model's independent ones; then further coordinates of a good
 * choice, up to the number of degrees of freedom. */
static bool choose_kept(search *s)
{
    const kempe_system *system = s->b->system;
    const kempe_model *model = system->model;
    bool *kept = s->b->kept;
    int n = system->n, count = 0;
    for (int k = 0; k < n; k++) {
        kept[k] = model->start.hold[k];
        count += kept[k] && !model->motions[k].elastic;
    }
    for (int k = 0; count == 0 && k < model->run.independent_count; k++)
        kept[model->run.independent[k]] = true;
    for (int k = count = 0; k < n; k++)
        count += kept[k];
    /* At the assembled state, in the charts in which it was found, J has its rank. */
    const kempe_assembly *a = s->b->assembly;
    if (a->chart)
        kmp_eval_set_charts(s->walk->eval, a->chart);
    kmp_walk_evaluate(s->walk, a->inner_q ? a->inner_q : a->q);
    int free = kmp_partition_prefer(system, s->walk->eval->jacobian, kept, s->order);
    for (int k = free - 1; k >= 0 && count < free; k--) {
        int c = kmp_chart_of(system, s->order[k]);
        if (c < 0 || !a->chart || kmp_chart_is_own(a->chart, c)) { /* in the user's own chart: not of a centred joint */
            count += !kept[s->order[k]];
            kept[s->order[k]] = true;
        }
    }
    return free >= 0;
}

/* Chooses rows and v for the signs by the entries of J, with the kept coordinates in u if these can be independent. */
static void choose_blocks(search *s, const double *jacobian)
{
    const kempe_system *system = s->b->system;
    int count = 0;
    for (int k = 0; k < system->n; k++)
        if (s->b->kept[k])
            s->order[count++] = k;
    if (count == 0 || kmp_partition_init(&s->part, system, jacobian, s->order, count) != KEMPE_OK)
        (void)kmp_partition_init(&s->part, system, jacobian, NULL, 0);
    s->block_count = s->part.r > 0 ? kmp_loop_blocks(s->walk->eval, &s->part, &s->b->arena, &s->blocks) : 0;
    kmp_context_clear(system->context);
}

/* -- one state --------------------------------------------------------------------------------------- */

static char sign_of_block(const search *s, const kmp_loop_block *block)
{
    int size = block->size, sign = 1;
    double least = INFINITY, most = 0;
    for (int i = 0; i < size; i++)
        for (int k = 0; k < size; k++)
            s->matrix[i + k * size] = s->walk->jacobian[block->rows[i] + block->columns[k] * s->walk->m];
    if (kmp_lu_factor(size, s->matrix, s->order) != 0)
        return '0';
    for (int i = 0; i < size; i++) {
        double u = s->matrix[i + i * size];
        sign = (u < 0) != (s->order[i] != i) ? -sign : sign;
        least = fmin(least, fabs(u));
        most = fmax(most, fabs(u));
    }
    return least < KMP_RANK_SIGN * most ? '0' : sign > 0 ? '+' : '-';
}

/* Adds q to the list. */
static void add_branch(search *s, const double *q, double residual)
{
    const kempe_system *system = s->b->system;
    for (int k = 0; k < s->b->count; k++)
        if (kmp_state_same(system, KMP_SAME_STATE, 0, NULL, q, s->b->branch[k].q)) {
            s->b->branch[k].hits++;
            return;
        }
    if (s->b->count == KMP_MOST_BRANCHES) {
        s->b->many = true;
        return;
    }
    kmp_branch branch = {.residual = residual, .hits = 1};
    branch.q = KMP_ARENA_NEW(&s->b->arena, double, system->n);
    branch.sign = KMP_ARENA_NEW(&s->b->arena, char, s->block_count + 1);
    if (!branch.q || !branch.sign)
        return;
    for (int k = 0; k < system->n; k++) {
        double off = q[k] - s->b->assembly->q[k];
        off = system->model->motions[k].rotation ? remainder(off, TWO_PI) : off;
        branch.q[k] = s->b->assembly->q[k] + (fabs(off) < ROUNDING * system->scale[k] ? 0 : off);
    }
    kmp_walk_evaluate(s->walk, branch.q);
    for (int k = 0; k < s->block_count; k++)
        branch.sign[k] = sign_of_block(s, &s->blocks[k]);
    s->b->branch[s->b->count++] = branch;
}

static kempe_status assemble_sample(search *s, int seed)
{
    kempe_branches *b = s->b;
    kmp_random_starts random = {.system = b->system, .from = b->assembly->q, .still = b->kept, .far = FAR};
    random.state = (unsigned)seed;
    random.guess = KMP_ARENA_NEW(&b->arena, double, b->system->n);
    int starts = b->system->n > LARGE ? STARTS_OF_LARGE : STARTS;
    add_branch(s, b->assembly->q, b->assembly->residual);
    while (b->starts < starts && !b->many && !b->arena.failed && !kmp_interrupted(b->system->context)) {
        kempe_assembly *a = NULL;
        KMP_TRY(kmp_random_starts_next(&random, &a));
        if (a)
            add_branch(s, a->q, a->residual);
        kempe_assembly_free(a);
        b->starts = random.starts;
        b->closed = random.closed;
        kmp_progress(b->system->context, KMP_PROGRESS_STUDY, b->starts, starts, "starts");
    }
    return KEMPE_OK;
}

static kempe_status search_branches(kempe_branches *b, int seed)
{
    int n = b->system->n;
    search s = {.b = b, .walk = kmp_walk_new(b->system)};
    KMP_ARENA_MAKE(&b->arena, KMP_ROOM(bool, n, &b->kept), KMP_ROOM(double, n *n, &s.matrix),
                   KMP_ROOM(int, n, &s.order));
    kempe_status status = KEMPE_E_MEMORY;
    bool made = s.walk && !b->arena.failed && choose_kept(&s);
    if (made) {
        choose_blocks(&s, s.walk->eval->jacobian);
        kmp_charts_reset(b->system, s.walk->eval->chart);
        kmp_eval_set_charts(s.walk->eval, s.walk->eval->chart);
        status = b->arena.failed ? KEMPE_E_MEMORY : assemble_sample(&s, seed);
        /* All but the first, by signs and then by states. */
        for (int i = 2; i < b->count; i++) {
            kmp_branch moved = b->branch[i];
            int k = i;
            for (; k > 1; k--) {
                const kmp_branch *before = &b->branch[k - 1];
                int order = strcmp(moved.sign, before->sign);
                if (order ? order > 0 : !kmp_state_before(b->system, KMP_SAME_STATE, moved.q, before->q))
                    break;
                b->branch[k] = *before;
            }
            b->branch[k] = moved;
        }
    }
    if (!made || b->arena.failed)
        status = kmp_fail_memory(b->system->context);
    kmp_partition_free(&s.part);
    kmp_walk_free(s.walk);
    return status;
}

/* -- changes of the assembly mode ---------------------------------------------------------------------- */

struct kmp_mode_watch {
    kempe_branches b;
    search s;
    bool *occurs;   /* m x n: entries of J that were not zero at some state */
    int *level;     /* n: the block that a dependent coordinate belongs to, block_count for independent ones */
    double *rest;   /* m x n: candidate rows of a block, eliminated */
    int *candidate; /* m */
    int *rows;      /* of each block in turn: the blocks whose determinant is followed */
    char *sign;     /* of each block at the last state where it was known */
};

kmp_mode_watch *kmp_mode_watch_new(const kempe_system *system, const bool *kept, const double *q, const bool *released)
{
    bool possible = (!system->rheonomic || released) && system->chart_count == 0 && system->n <= MOST_WATCHED;
    int n = system->n, m = system->m, entries = system->jacobian.count, count = 0, at = 0;
    double *held = NULL; /* the entries of J, zero in the rows that are released */
    kmp_mode_watch *w = possible ? KMP_NEW(kmp_mode_watch, 1) : NULL;
    if (!w)
        return NULL;
    w->b.system = system;
    w->s = (search){.b = &w->b, .walk = kmp_walk_new_of_closures(system)};
    bool fits = w->s.walk &&
                KMP_ARENA_MAKE(&w->b.arena, KMP_ROOM(bool, n, &w->b.kept), KMP_ROOM(bool, m *n, &w->occurs),
                               KMP_ROOM(double, n *n, &w->s.matrix), KMP_ROOM(double, m *n, &w->rest),
                               KMP_ROOM(double, entries, &held), KMP_ROOM(int, n, &w->s.order, &w->level, &w->rows),
                               KMP_ROOM(int, m, &w->candidate));
    if (fits) {
        /* The signs with the kept coordinates independent, if these determine the others. */
        for (int k = 0; k < n; k++)
            count += w->b.kept[k] = kept[k];
        w->s.walk->excluded = released;
        kmp_walk_evaluate(w->s.walk, q);
        for (int e = 0; e < entries; e++)
            held[e] = released && released[system->jacobian.row[e]] ? 0 : w->s.walk->eval->jacobian[e];
        choose_blocks(&w->s, held);
        fits = count > 0 && w->s.part.r > 0 && w->s.part.p == count;
    }
    for (int k = 0; fits && k < count; k++)
        fits = w->b.kept[w->s.part.u[k]];
    const int blocks = w->s.block_count;
    w->sign = fits ? KMP_ARENA_NEW(&w->b.arena, char, blocks + 1) : NULL;
    if (!w->sign) {
        kmp_mode_watch_free(w);
        return NULL;
    }
    /* For each dependent coordinate, the block in which it is solved. */
    for (int k = 0; k < n; k++)
        w->level[k] = blocks;
    for (int b = 0; b < blocks; b++) {
        w->sign[b] = '0';
        for (int k = 0; k < w->s.blocks[b].size; k++) {
            w->level[w->s.blocks[b].columns[k]] = b;
            w->rows[at++] = w->s.blocks[b].rows[k];
        }
    }
    return w;
}

void kmp_mode_watch_free(kmp_mode_watch *w)
{
    if (!w)
        return;
    kmp_partition_free(&w->s.part);
    kmp_walk_free(w->s.walk);
    kmp_arena_free(&w->b.arena);
    kmp_free(w);
}

/* Rows that can determine block b: they contain its coordinates, and otherwise coordinates of blocks solved before it.
 */
static int list_candidates(kmp_mode_watch *w, int b)
{
    int m = w->s.walk->m, n = w->s.walk->n, count = 0;
    for (int i = 0; i < m; i++) {
        bool own = false, later = false;
        for (int k = 0; k < n; k++)
            if (w->occurs[i + k * m]) {
                own = own || w->level[k] == b;
                later = later || (w->level[k] > b && w->level[k] < w->s.block_count);
            }
        if (own && !later)
            w->candidate[count++] = i;
    }
    return count;
}

/* The rows of block b with the largest pivots at the current state, in ascending order: where rows are redundant, the
 * determinant of fixed ones changes its sign also where the closures lose no rank. */
static void choose_rows(kmp_mode_watch *w, int b, int *rows)
{
    const kmp_loop_block *block = &w->s.blocks[b];
    int size = block->size, count = list_candidates(w, b);
    if (count <= size)
        return;
    for (int k = 0; k < size; k++)
        for (int i = 0; i < count; i++)
            w->rest[i + k * count] = w->s.walk->jacobian[w->candidate[i] + block->columns[k] * w->s.walk->m];
    for (int done = 0; done < size; done++) {
        int row = done, column = 0;
        for (int k = 0; k < size; k++)
            for (int i = done; i < count; i++)
                if (fabs(w->rest[i + k * count]) > fabs(w->rest[row + column * count])) {
                    row = i;
                    column = k;
                }
        kmp_swap_int(&w->candidate[done], &w->candidate[row]);
        for (int k = 0; k < size; k++) {
            double value = w->rest[done + k * count];
            w->rest[done + k * count] = w->rest[row + k * count];
            w->rest[row + k * count] = value;
        }
        double pivot = w->rest[done + column * count];
        if (pivot == 0)
            return;
        for (int k = 0; k < size; k++)
            for (int i = done + 1; k != column && i < count; i++)
                w->rest[i + k * count] -= w->rest[i + column * count] / pivot * w->rest[done + k * count];
        for (int i = done + 1; i < count; i++)
            w->rest[i + column * count] = 0;
    }
    for (int k = 0; k < size; k++) {
        int i = k;
        for (; i > 0 && rows[i - 1] > w->candidate[k]; i--)
            rows[i] = rows[i - 1];
        rows[i] = w->candidate[k];
    }
}

const kmp_loop_block *kmp_mode_watch_next(kmp_mode_watch *w, const double *q)
{
    const kmp_loop_block *changed = NULL;
    int entries = w->s.walk->m * w->s.walk->n;
    kmp_walk_evaluate(w->s.walk, q);
    for (int e = 0; e < entries; e++)
        w->occurs[e] = w->occurs[e] || w->s.walk->jacobian[e] != 0;
    int *rows = w->rows;
    for (int b = 0; b < w->s.block_count; rows += w->s.blocks[b++].size) {
        kmp_loop_block block = w->s.blocks[b];
        block.rows = rows;
        char sign = sign_of_block(&w->s, &block);
        if (sign != '0') {
            if (w->sign[b] != '0' && w->sign[b] != sign && !changed)
                changed = &w->s.blocks[b];
            choose_rows(w, b, rows);
            w->sign[b] = sign_of_block(&w->s, &block);
        }
    }
    return changed;
}

kempe_status kempe_branches_new(const kempe_system *system, int seed, kempe_branches **branches)
{
    KMP_WANTED_BOTH(system, branches);
    kmp_model_begin(system->model);
    KMP_MAKE(system->context, kempe_branches, b);
    b->system = system;
    kempe_status status = kmp_assembly_at_start(system, &b->assembly);
    if (status == KEMPE_OK)
        status = search_branches(b, seed);
    b->warnings = kmp_context_warnings(system->context);
    b->status = status = kmp_context_verdict(system->context, status);
    return KMP_GIVE_OR_FREE(status, branches, b, kempe_branches_free);
}

void kempe_branches_free(kempe_branches *branches)
{
    if (!branches)
        return;
    kempe_assembly_free(branches->assembly);
    kmp_free(branches->warnings);
    kmp_arena_free(&branches->arena);
    kmp_free(branches);
}

KMP_GETTER(int kempe_branches_count(const kempe_branches *branches), branches, branches->count, 0)
KMP_GETTER_AT(const double *kempe_branches_q(const kempe_branches *branches, int k), branches, k, branches->count,
              branches->branch[k].q, NULL)
